//! Records and poses at the ends of their ranges, compared with the record's numbers in `f64`.

use super::scenes::Random;
use posegate::num::BinaryAngle;
use posegate::pose::Pose;
use posegate::sight::{ANGLE_ERROR_UM, FailedConstraint, LENGTH_ERROR_UM, Scene, TagVisibility};
use posegate::table::{
    FARTHEST_CAMERA_UM, LARGEST_HEIGHT_UM, LARGEST_SIGHT_UM, SIGHT_LENGTH, SightRecord,
};

const ONE: i32 = 1 << 30;

type Vector = [f64; 3];

fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Returns the distance, um, and the slacks of a record at a pose from the record's numbers, each with a bound of
/// the effect of rounding.
fn truth(record: &SightRecord, pose: &Pose) -> (f64, Vec<(FailedConstraint, f64, f64)>) {
    let (s, c) = (f64::from(pose.yaw.0) / 4_294_967_296.0 * std::f64::consts::TAU).sin_cos();
    let to_robot = |[x, y, z]: Vector| [c * x + s * y, c * y - s * x, z];
    let exact = |v: [i32; 3]| v.map(f64::from);
    let unit = |v: [i32; 3]| v.map(|v| f64::from(v) / f64::from(ONE));
    let [x, y, z] = exact(record.middle);
    let place = to_robot([x - f64::from(pose.x_um), y - f64::from(pose.y_um), z]);
    let camera = exact(record.camera);
    let ray = [0, 1, 2].map(|axis| place[axis] - camera[axis]);
    let in_camera = |v: Vector| record.axes.map(|axis| dot(unit(axis), v));
    let edge = |edge: [i32; 3]| in_camera(to_robot(exact(edge).map(|v| v / 256.0)));
    let (middle, right, up) = (
        in_camera(ray),
        edge(record.half_right),
        edge(record.half_up),
    );
    let d = dot(ray, ray).sqrt();
    let (length, angle) = (LENGTH_ERROR_UM as f64, ANGLE_ERROR_UM as f64);
    let mut slacks = vec![(
        FailedConstraint::Distance,
        f64::from(record.d_max) - d,
        length,
    )];
    let cos = |q30: i32| f64::from(q30) / f64::from(ONE);
    for (a, b) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
        let corner = [0, 1, 2].map(|axis| middle[axis] + a * right[axis] + b * up[axis]);
        slacks.push((
            FailedConstraint::Depth,
            corner[2] - f64::from(record.z_near),
            length,
        ));
        for axis in [0, 1] {
            let [f, centre, image] = [record.focal, record.centre, record.image]
                .map(|pair| f64::from(pair[axis]) / 16_384.0);
            let error = length * (f + centre.abs().max((image - centre).abs()))
                + (f64::from(record.d_max) + 1e8) / 4096.0;
            let first = f * corner[axis] + centre * corner[2];
            slacks.push((FailedConstraint::Image, first, error));
            slacks.push((FailedConstraint::Image, image * corner[2] - first, error));
        }
    }
    slacks.push((
        FailedConstraint::Phi,
        middle[2] - cos(record.cos_phi) * d,
        angle,
    ));
    let facing = -dot(to_robot(unit(record.normal)), ray);
    slacks.push((
        FailedConstraint::Psi,
        facing - cos(record.cos_psi) * d,
        angle,
    ));
    (d, slacks)
}

/// Returns three orthogonal axes, rounded to 2^-30, and the first two also as half edges of the
/// given length.
fn frame(random: &mut Random) -> [Vector; 3] {
    let mut any = || [0, 1, 2].map(|_| random.within(-1.0, 1.0));
    let unit = |v: Vector| v.map(|x| x / dot(v, v).sqrt());
    let (a, b) = (unit(any()), any());
    let along = dot(a, b);
    let b = unit([0, 1, 2].map(|axis| b[axis] - along * a[axis]));
    let cross = [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ];
    [a, b, cross]
}

fn record(random: &mut Random) -> SightRecord {
    let mut end = |lo: i32, hi: i32| match random.bits() % 4 {
        0 => lo,
        1 | 2 => hi,
        _ => random.within(f64::from(lo), f64::from(hi)) as i32,
    };
    let mut pair = |lo: i32, hi: i32| [end(lo, hi), end(lo, hi)];
    let (focal, image) = (pair(1, ONE), pair(1, ONE));
    let centre = pair(1 - ONE, ONE - 1);
    let [camera_x, camera_y] = pair(-FARTHEST_CAMERA_UM, FARTHEST_CAMERA_UM);
    let [camera_z, tag_z] = pair(-LARGEST_HEIGHT_UM, LARGEST_HEIGHT_UM);
    let [tag_x, tag_y] = pair(i32::MIN, i32::MAX);
    let [cos_phi, cos_psi] = pair(0, ONE);
    let [z_near, d_max] = [
        end(0, LARGEST_SIGHT_UM),
        end(LARGEST_SIGHT_UM / 2, LARGEST_SIGHT_UM),
    ];
    let scaled = |v: Vector, by: f64| v.map(|x| (x * by).round() as i32);
    let one = f64::from(ONE);
    let half = if random.one_in(2) {
        one - 2.0
    } else {
        random.scale(1e4, one - 2.0)
    };
    let (axes, tag) = (frame(random), frame(random));
    // Every other camera sees nearly everything before it, so that some tags are visible.
    let all = random.one_in(2);
    let seen = |pair: [i32; 2], wide: i32| if all { [wide; 2] } else { pair };
    let [cos_phi, cos_psi] = seen([cos_phi, cos_psi], 0);
    SightRecord {
        tag: random.bits() as u32,
        focal: seen(focal, ONE >> 8),
        centre: seen(centre, ONE >> 1),
        image: seen(image, ONE),
        z_near: if all { z_near >> 8 } else { z_near },
        d_max,
        cos_phi,
        cos_psi,
        camera: [camera_x, camera_y, camera_z],
        axes: axes.map(|axis| scaled(axis, one)),
        middle: [tag_x, tag_y, tag_z],
        half_right: scaled(tag[0], half),
        half_up: scaled(tag[1], half),
        normal: scaled(tag[2], one),
    }
}

/// Nothing overflows: at the ends of every range the answer and the distance are those of plain numbers.
#[test]
fn answers_are_correct_at_ends_of_ranges() {
    let mut random = Random(3);
    let (mut near, mut far, mut visible) = (0, 0, 0);
    let reach = f64::from(1 << 27);
    for _ in 0..200_000 {
        let record = record(&mut random);
        let scene = Scene::new(record).unwrap_or_else(|| panic!("{record:?}"));
        let mut about = |middle: i32| match random.bits() % 12 {
            0 => i32::MIN,
            1 => i32::MAX,
            2 => middle.saturating_add((1 << 27) - 1),
            3 => middle.saturating_sub(1 << 27),
            4 => middle.saturating_add(random.within(-8.0 * reach, 8.0 * reach) as i32),
            _ => middle.saturating_add(random.within(-reach, reach) as i32 / 2),
        };
        let pose = Pose {
            x_um: about(record.middle[0]),
            y_um: about(record.middle[1]),
            yaw: BinaryAngle(random.bits() as u32),
        };
        let sighting = scene.look(&pose);
        let (d, slacks) = truth(&record, &pose);
        let [x, y, _] = record.middle;
        let within = |a: i32, b: i32| a.abs_diff(b) < 1 << 27;
        let is_near = within(x, pose.x_um) && within(y, pose.y_um);
        assert_eq!(sighting.d_um != u32::MAX, is_near);
        if sighting.d_um == u32::MAX {
            assert!(d > 110e6, "{d}");
            assert_eq!(
                sighting.answer,
                TagVisibility::NotVisible(FailedConstraint::Distance)
            );
            assert_eq!((sighting.cos_phi_q30, sighting.corners), (0, [None; 4]));
            far += 1;
        } else {
            let off = f64::from(sighting.d_um) - d;
            assert!(off.abs() <= LENGTH_ERROR_UM as f64, "{d} {off}");
            near += 1;
        }
        let surely = |slack: &(FailedConstraint, f64, f64)| slack.1 > 2.0 * slack.2;
        let surely_not = |slack: &(FailedConstraint, f64, f64)| slack.1 < -2.0 * slack.2;
        match sighting.answer {
            TagVisibility::Visible => {
                visible += 1;
                assert!(slacks.iter().all(|slack| slack.1 >= 0.0), "{slacks:?}");
            }
            TagVisibility::NotVisible(why) => {
                assert!(
                    slacks.iter().any(|slack| slack.0 == why && slack.1 < 0.0),
                    "{why:?} {slacks:?}"
                );
            }
            TagVisibility::Unsure => assert!(
                !slacks.iter().any(surely_not) && !slacks.iter().all(surely),
                "{slacks:?}"
            ),
        }
    }
    println!("{near} within reach, {far} beyond, {visible} visible");
    assert!(
        near > 50_000 && far > 20_000 && visible > 2_000,
        "{near} {far} {visible}"
    );
}

/// A camera in the tag's middle does not see the tag, and there is no division by zero.
#[test]
fn zero_distance_gives_no_angle() {
    let mut random = Random(4);
    for _ in 0..1000 {
        let mut record = record(&mut random);
        record.camera = [0, 0, record.middle[2].clamp(-100, 100)];
        record.middle[2] = record.camera[2];
        let scene = Scene::new(record).unwrap();
        let sighting = scene.look(&Pose {
            x_um: record.middle[0],
            y_um: record.middle[1],
            yaw: BinaryAngle(random.bits() as u32),
        });
        assert_eq!((sighting.d_um, sighting.cos_phi_q30), (0, 0));
        assert_eq!(sighting.cos_psi_q30, 0);
        assert_ne!(sighting.answer, TagVisibility::Visible);
    }
}

#[test]
fn record_bytes_equal_its_words() {
    let mut random = Random(5);
    let record = record(&mut random);
    let bytes = record.bytes();
    let word = |at: usize| i32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
    assert_eq!(bytes.len(), SIGHT_LENGTH);
    assert_eq!(word(0), record.tag as i32);
    for (at, expected) in [
        (4, record.focal[0]),
        (12, record.centre[0]),
        (24, record.image[1]),
        (28, record.z_near),
        (32, record.d_max),
        (36, record.cos_phi),
        (40, record.cos_psi),
        (44, record.camera[0]),
        (56, record.axes[0][0]),
        (68, record.axes[1][0]),
        (88, record.axes[2][2]),
        (92, record.middle[0]),
        (104, record.half_right[0]),
        (116, record.half_up[0]),
        (128, record.normal[0]),
        (136, record.normal[2]),
    ] {
        assert_eq!(word(at), expected, "{at}");
    }
}
