//! Compares the sight record with the site: every number must be within the rounding that the controller
//! assumes.

use super::VerifyError;
use crate::certify::Interval;
use crate::shape::{Resolved, SuccessSet, Visibility, WORLD};
use crate::table::{EDGE_BITS, PIXEL_BITS, SightRecord};

/// Largest distance of a number of the record from the site's, in its unit.
const ROUNDING: f64 = 0.51;

/// The name of a number, the record's value, and the site's value enclosed, in the record's unit.
type Compared = (&'static str, i32, Interval);

/// Compares a record with a set's camera and tag, or its absence with a set that has none.
///
/// # Errors
/// [`VerifyError::Header`] for the first number that differs.
pub(super) fn sight(record: Option<SightRecord>, success: &SuccessSet) -> Result<(), VerifyError> {
    let differs = |field, found: String, expected: String| {
        Err(VerifyError::Header {
            field,
            found,
            expected,
        })
    };
    let none = || "none".to_string();
    let Some(set) = success.shape.visibility() else {
        return match record {
            None => Ok(()),
            Some(found) => differs("sight record", format!("of tag {}", found.tag), none()),
        };
    };
    // Without a record the controller evaluates no view, so the baker may decide whether a record could
    // hold the site's numbers.
    let Some(record) = record else {
        return if crate::bake::sight_record(success).is_some() {
            differs("sight record", none(), format!("of tag {}", set.tag.id))
        } else {
            Ok(())
        };
    };
    if record.tag != set.tag.id {
        return differs("tag", record.tag.to_string(), set.tag.id.to_string());
    }
    let wrong = |(_, found, site): &Compared| {
        let off = *site - Interval::point(f64::from(*found));
        !(off.lo >= -ROUNDING && off.hi <= ROUNDING)
    };
    match numbers(&record, set).into_iter().find(wrong) {
        None => Ok(()),
        Some((field, found, site)) => {
            differs(field, found.to_string(), format!("{:.2}", site.middle()))
        }
    }
}

/// Returns every number of a record with the site's.
fn numbers(record: &SightRecord, set: &Visibility) -> Vec<Compared> {
    let site: Resolved<Interval> = set.resolve(WORLD);
    let scaled = |value: Interval, unit: f64| value * Interval::point(unit);
    let (um, q30) = (1e6, f64::from(1 << 30));
    let pixel = f64::from(1 << PIXEL_BITS);
    let edge = um * f64::from(1 << EDGE_BITS);
    let camera = set.camera;
    let number =
        |name, found: i32, site: f64, unit: f64| (name, found, scaled(Interval::point(site), unit));
    let ([fx, fy], [cx, cy], [width, height]) = (record.focal, record.centre, record.image);
    let mut all = std::vec![
        number("fx, 2^-14 px,", fx, camera.fx, pixel),
        number("fy, 2^-14 px,", fy, camera.fy, pixel),
        number("cx, 2^-14 px,", cx, camera.cx, pixel),
        number("cy, 2^-14 px,", cy, camera.cy, pixel),
        number("image width, 2^-14 px,", width, camera.width_px, pixel),
        number("image height, 2^-14 px,", height, camera.height_px, pixel),
        number("z_near, um,", record.z_near, set.z_near, um),
        number("d_max, um,", record.d_max, set.d_max, um),
        (
            "cosine of phi_max, 2^-30,",
            record.cos_phi,
            scaled(site.cos_phi, q30)
        ),
        (
            "cosine of psi_max, 2^-30,",
            record.cos_psi,
            scaled(site.cos_psi, q30)
        ),
    ];
    let [right, down, ahead] = record.axes;
    // The columns of the mount's rotation are forward, left and up.
    let axis = |column: usize| site.axes.map(|row| row[column]);
    let from_middle = |a: usize, b: usize| {
        // The middle of an edge, minus the middle of the tag.
        let half = Interval::point(0.5);
        [0, 1, 2].map(|k| (site.corners[a][k] + site.corners[b][k]) * half - site.centre[k])
    };
    let mut vector = |name, found: [i32; 3], site: [Interval; 3], unit: f64| {
        all.extend(
            found
                .into_iter()
                .zip(site)
                .map(|(found, site)| (name, found, scaled(site, unit))),
        );
    };
    vector("camera, um,", record.camera, site.mount, um);
    vector("camera axis right, 2^-30,", right, axis(1).map(|v| -v), q30);
    vector("camera axis down, 2^-30,", down, axis(2).map(|v| -v), q30);
    vector("camera axis forward, 2^-30,", ahead, axis(0), q30);
    vector("tag, um,", record.middle, site.centre, um);
    vector(
        "tag's half edge to the right, 2^-8 um,",
        record.half_right,
        from_middle(1, 2),
        edge,
    );
    vector(
        "tag's half edge upwards, 2^-8 um,",
        record.half_up,
        from_middle(2, 3),
        edge,
    );
    vector("tag's normal, 2^-30,", record.normal, site.normal, q30);
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bake::sight_record;
    use crate::shape::{Camera, Pose3Deg, PoseDeg, Shape, Tag, Tolerance};

    /// Returns a set with numbers that are not whole multiples of a unit.
    fn odd(tilt_deg: f64) -> SuccessSet {
        let pose = |x: f64, turn: f64| Pose3Deg {
            x,
            y: -1.234_567_89,
            z: 0.567_891_23,
            roll_deg: turn,
            pitch_deg: 0.5 * turn,
            yaw_deg: 123.4 + turn,
        };
        let shape = Visibility {
            camera: Camera::pinhole(
                [640.0, 480.0],
                [615.123_456, 616.654_321],
                [321.987_654, 239.456_789],
            ),
            mount: pose(0.123_456_78, -0.7 * tilt_deg),
            tag: Tag {
                id: 7,
                size: 0.165_432_1,
                pose: pose(1_234.567_891_2, tilt_deg),
            },
            d_max: 5.123_456_7,
            phi_max_deg: 33.3,
            psi_max_deg: 55.5,
            z_near: 0.051_234_56,
            tag_tolerance: Tolerance::NONE,
            mount_tolerance: Tolerance::NONE,
            sharpness: None,
            error_room: None,
        };
        SuccessSet {
            goal: PoseDeg {
                x: 1234.0,
                y: 0.0,
                yaw_deg: 77.7,
            },
            shape: Shape::Visibility(shape),
        }
    }

    /// The baked number is the nearest; its neighbour may also be accepted in a narrow case, and nothing
    /// beyond.
    #[test]
    fn only_nearest_integers_are_proven() {
        for tilt_deg in [0.0, 12.3, -98.7] {
            let success = odd(tilt_deg);
            let record = sight_record(&success).unwrap();
            assert_eq!(sight(Some(record), &success), Ok(()));
            for word in 0..35 {
                for off in [2, -2] {
                    let mut words = [[0; 4]; 35];
                    words.copy_from_slice(record.bytes().as_chunks().0);
                    let number = i32::from_le_bytes(words[word]).wrapping_add(off);
                    words[word] = number.to_le_bytes();
                    let changed = SightRecord::of_words(&words);
                    assert!(sight(Some(changed), &success).is_err(), "{word} {off}");
                }
            }
            assert!(sight(None, &success).is_err());
        }
    }

    /// Out of a record's range there is no record, and none is required.
    #[test]
    fn numbers_out_of_range_have_no_record() {
        let mut success = odd(0.0);
        let Shape::Visibility(set) = &mut success.shape else {
            unreachable!();
        };
        set.d_max = 100.001;
        assert_eq!(sight_record(&success), None);
        assert_eq!(sight(None, &success), Ok(()));
    }
}
