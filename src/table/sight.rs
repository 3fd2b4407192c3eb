//! The sight record: a camera and the tag that it observes, in integers.
//!
//! A table of a visibility set contains one, so that the controller can predict what its camera should see
//! ([`crate::num`] has the units; the module `sight` computes the prediction). It has no influence on a decision.
//!
//! Camera axes are the optical ones: right, down, forward. Every number is the site's value to the nearest unit;
//! `verify` allows an error of 0.51 unit, and error budgets assume that.
//!
//! # Bytes (little-endian)
//!
//! | offset in the record | type | field | range |
//! |---|---|---|---|
//! | 0 | u32 | the tag's number | |
//! | 4 | i32, i32 | focal lengths, 2^-14 px | 1 to 2^30 |
//! | 12 | i32, i32 | column and row of the optical axis, 2^-14 px | +-(2^30 - 1) |
//! | 20 | i32, i32 | image width and height, 2^-14 px | 1 to 2^30 |
//! | 28 | i32 | smallest depth of a corner, um | 0 to 10^8 |
//! | 32 | i32 | largest distance from camera to tag, um | 1 to 10^8 |
//! | 36 | i32, i32 | cosines of the largest phi and psi, 2^-30 | 0 to 2^30 |
//! | 44 | 3 x i32 | camera in the robot's frame, um | x, y +-2^24, z +-2^26 |
//! | 56 | 9 x i32 | the camera's axes in the robot's frame: right, down, forward, 2^-30 | right-handed unit vectors at right angles |
//! | 92 | 3 x i32 | middle of the tag in the world, um | z +-2^26 |
//! | 104 | 3 x i32, 3 x i32 | vectors from the tag's middle to the middle of its right and of its upper edge as a viewer sees them, in the world, 2^-8 um | equal lengths, up to 2^30, at right angles |
//! | 128 | 3 x i32 | the tag's normal in the world, out of its face, 2^-30 | the unit vector on the side of right x up |

/// Bytes of a sight record.
pub const SIGHT_LENGTH: usize = 4 * SIGHT_WORDS;
/// Largest distance from which a tag is seen, micrometres (100 m).
pub const LARGEST_SIGHT_UM: i32 = 100_000_000;
/// Largest distance of a camera from the robot's centre along x and along y, micrometres (16.8 m).
pub const FARTHEST_CAMERA_UM: i32 = 1 << 24;
/// Largest distance of a camera or tag from the floor, micrometres (67 m).
pub const LARGEST_HEIGHT_UM: i32 = 1 << 26;
/// Fraction bits of pixels.
pub const PIXEL_BITS: u32 = 14;
/// Fraction bits of the half edges of a tag, which are in micrometres.
pub const EDGE_BITS: u32 = 8;

const SIGHT_WORDS: usize = 35;
/// 2^30: the value 1 of cosines and axes, and the largest pixel number and half edge.
const ONE: i32 = 1 << 30;

/// A sight record as its words in flash, checked to be in range.
pub(crate) type Words = [[u8; 4]; SIGHT_WORDS];

/// A camera and the tag that it observes. Units and ranges are those of the table in this module's head.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct SightRecord {
    /// The tag's number within its family.
    pub tag: u32,
    /// Focal lengths along a row and a column, 2^-14 px.
    pub focal: [i32; 2],
    /// Column and row of the optical axis, 2^-14 px.
    pub centre: [i32; 2],
    /// Image width and height, 2^-14 px.
    pub image: [i32; 2],
    /// Smallest depth of a corner, um.
    pub z_near: i32,
    /// Largest distance from the camera to the middle of the tag, um.
    pub d_max: i32,
    /// Cosine of the largest angle between the optical axis and the ray to the tag, 2^-30.
    pub cos_phi: i32,
    /// Cosine of the largest angle between the tag's normal and the ray to the camera, 2^-30.
    pub cos_psi: i32,
    /// The camera in the robot's frame, um.
    pub camera: [i32; 3],
    /// The camera's axes right, down and forward in the robot's frame, 2^-30.
    pub axes: [[i32; 3]; 3],
    /// The middle of the tag in the world, um.
    pub middle: [i32; 3],
    /// Vector from the middle of the tag to the middle of its right edge as a viewer sees it, in the world, 2^-8 um.
    pub half_right: [i32; 3],
    /// Vector from the middle of the tag to the middle of its upper edge, in the world, 2^-8 um.
    pub half_up: [i32; 3],
    /// The tag's normal in the world, out of its face, 2^-30.
    pub normal: [i32; 3],
}

/// Returns the words of a record, or `None` if a number is out of range.
pub(super) fn checked(bytes: &[u8]) -> Option<&Words> {
    let words: &Words = bytes.as_chunks().0.try_into().ok()?;
    SightRecord::of_words(words).is_valid().then_some(words)
}

impl SightRecord {
    pub(crate) fn of_words(words: &Words) -> Self {
        let [
            tag,
            fx,
            fy,
            cx,
            cy,
            width,
            height,
            z_near,
            d_max,
            cos_phi,
            cos_psi,
            rest @ ..,
        ] = words.map(i32::from_le_bytes);
        let [x, y, z, rest @ ..] = rest;
        let [a, b, c, d, e, f, g, h, i, rest @ ..] = rest;
        let [j, k, l, m, n, o, p, q, r, s, t, u] = rest;
        Self {
            tag: tag.cast_unsigned(),
            focal: [fx, fy],
            centre: [cx, cy],
            image: [width, height],
            z_near,
            d_max,
            cos_phi,
            cos_psi,
            camera: [x, y, z],
            axes: [[a, b, c], [d, e, f], [g, h, i]],
            middle: [j, k, l],
            half_right: [m, n, o],
            half_up: [p, q, r],
            normal: [s, t, u],
        }
    }

    /// Returns the bytes.
    #[must_use]
    pub fn bytes(&self) -> [u8; SIGHT_LENGTH] {
        let [right, down, forward] = self.axes;
        let scalars = [self.z_near, self.d_max, self.cos_phi, self.cos_psi];
        let words = [self.tag.cast_signed()]
            .into_iter()
            .chain(self.focal)
            .chain(self.centre)
            .chain(self.image)
            .chain(scalars)
            .chain(self.camera)
            .chain(right)
            .chain(down)
            .chain(forward)
            .chain(self.middle)
            .chain(self.half_right)
            .chain(self.half_up)
            .chain(self.normal);
        let mut bytes = [0; SIGHT_LENGTH];
        for (place, word) in bytes.as_chunks_mut().0.iter_mut().zip(words) {
            *place = word.to_le_bytes();
        }
        bytes
    }

    /// Returns `true` if every number is in range.
    #[must_use]
    pub fn is_valid(&self) -> bool {
        let within = |value: i32, most: i32| value.unsigned_abs() <= most.unsigned_abs();
        let above_zero = |value: &i32| (1..=ONE).contains(value);
        let [camera_x, camera_y, camera_z] = self.camera;
        let [_, _, tag_z] = self.middle;
        let [right, down, forward] = self.axes;
        let square = |a: [i32; 3]| dot(a, a);
        let one = |axis: [i32; 3]| is_near(square(axis), 1 << 60);
        let cross = |a: [i32; 3], b: [i32; 3]| is_near(dot(a, b), 0);
        let edge = square(self.half_right);
        self.focal.iter().all(above_zero)
            && self.centre.iter().all(|v| within(*v, ONE - 1))
            && self.image.iter().all(above_zero)
            && (0..=LARGEST_SIGHT_UM).contains(&self.z_near)
            && (1..=LARGEST_SIGHT_UM).contains(&self.d_max)
            && (0..=ONE).contains(&self.cos_phi)
            && (0..=ONE).contains(&self.cos_psi)
            && within(camera_x, FARTHEST_CAMERA_UM)
            && within(camera_y, FARTHEST_CAMERA_UM)
            && within(camera_z, LARGEST_HEIGHT_UM)
            && within(tag_z, LARGEST_HEIGHT_UM)
            && [right, down, forward, self.normal].into_iter().all(one)
            && cross(right, down)
            && cross(down, forward)
            && cross(forward, right)
            && (1..=1 << 60).contains(&edge)
            && is_near(square(self.half_up), edge)
            && cross(self.half_right, self.half_up)
            && cross(self.normal, self.half_right)
            && cross(self.normal, self.half_up)
            && is_right_handed(right, down, forward)
            && is_right_handed(self.half_right, self.half_up, self.normal)
    }
}

/// Returns `true` if `a x b` points to the side of c.
fn is_right_handed(a: [i32; 3], b: [i32; 3], c: [i32; 3]) -> bool {
    let [ax, ay, az] = a.map(i64::from);
    let [bx, by, bz] = b.map(i64::from);
    // Each product of two numbers is from -2^62 + 2^31 to 2^62: nothing wraps.
    let minor = |a: i64, b: i64, other_a: i64, other_b: i64| {
        a.wrapping_mul(b)
            .wrapping_sub(other_a.wrapping_mul(other_b))
    };
    let minors = [
        minor(ay, bz, az, by),
        minor(az, bx, ax, bz),
        minor(ax, by, ay, bx),
    ];
    c.into_iter().zip(minors).fold(0, |sum: i128, (c, minor)| {
        sum.wrapping_add(i128::from(c).wrapping_mul(i128::from(minor)))
    }) > 0
}

/// Returns the dot product of two vectors, below 2^64.
fn dot(a: [i32; 3], b: [i32; 3]) -> i128 {
    a.into_iter().zip(b).fold(0, |sum, (a, b)| {
        sum.wrapping_add(i128::from(i64::from(a).wrapping_mul(i64::from(b))))
    })
}

/// Returns `true` if a product of two vectors of lengths up to 2^30 equals the wanted value, except for the rounding of
/// their entries: 0.51 sqrt(3) on each side, 2^31.
fn is_near(product: i128, wanted: i128) -> bool {
    product.abs_diff(wanted) < 1 << 32
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// A camera half a metre above the floor looks forward, at a tag that faces it.
    pub(crate) const GOOD: SightRecord = SightRecord {
        tag: 0xfedc_ba98,
        focal: [615 << 14, 616 << 14],
        centre: [320 << 14, 240 << 14],
        image: [640 << 14, 480 << 14],
        z_near: 50_000,
        d_max: 5_500_000,
        cos_phi: 973_124_000,
        cos_psi: 690_189_000,
        camera: [250_000, 1, 500_000],
        axes: [[0, -ONE, 0], [0, 0, -ONE], [ONE, 0, 0]],
        middle: [4_000_000, 2, 500_000],
        half_right: [0, -150_000 << 8, 0],
        half_up: [0, 0, 150_000 << 8],
        normal: [-ONE, 0, 0],
    };

    #[test]
    fn record_round_trips_through_bytes() {
        assert!(GOOD.is_valid());
        let bytes = GOOD.bytes();
        assert_eq!(SightRecord::of_words(checked(&bytes).unwrap()), GOOD);
        assert!(checked(&bytes[1..]).is_none());
        // Each word is in a field of its own.
        for word in 0..SIGHT_WORDS {
            let mut changed = bytes;
            changed[4 * word] ^= 1;
            let words: &Words = changed.as_chunks().0.try_into().unwrap();
            assert_eq!(SightRecord::of_words(words).bytes(), changed);
            assert_ne!(SightRecord::of_words(words), GOOD);
        }
    }

    fn accepts(change: impl Fn(&mut SightRecord)) -> bool {
        let mut record = GOOD;
        change(&mut record);
        assert_eq!(checked(&record.bytes()).is_some(), record.is_valid());
        record.is_valid()
    }

    #[test]
    fn record_numbers_out_of_range_are_refused() {
        for (value, expected) in [
            (0, false),
            (1, true),
            (ONE, true),
            (ONE + 1, false),
            (-1, false),
        ] {
            for axis in [0, 1] {
                assert_eq!(accepts(|r| r.focal[axis] = value), expected, "{value}");
                assert_eq!(accepts(|r| r.image[axis] = value), expected, "{value}");
            }
        }
        for (value, expected) in [
            (ONE - 1, true),
            (1 - ONE, true),
            (ONE, false),
            (-ONE, false),
            (i32::MIN, false),
        ] {
            for axis in [0, 1] {
                assert_eq!(accepts(|r| r.centre[axis] = value), expected, "{value}");
            }
        }
        let most = LARGEST_SIGHT_UM;
        for (value, near, far) in [
            (-1, false, false),
            (0, true, false),
            (1, true, true),
            (most, true, true),
            (most + 1, false, false),
        ] {
            assert_eq!(accepts(|r| r.z_near = value), near, "{value}");
            assert_eq!(accepts(|r| r.d_max = value), far, "{value}");
        }
        for (value, expected) in [(-1, false), (0, true), (ONE, true), (ONE + 1, false)] {
            assert_eq!(accepts(|r| r.cos_phi = value), expected, "{value}");
            assert_eq!(accepts(|r| r.cos_psi = value), expected, "{value}");
        }
        for (axis, most) in [
            (0, FARTHEST_CAMERA_UM),
            (1, FARTHEST_CAMERA_UM),
            (2, LARGEST_HEIGHT_UM),
        ] {
            for (value, expected) in [
                (most, true),
                (-most, true),
                (most + 1, false),
                (-most - 1, false),
            ] {
                assert_eq!(
                    accepts(|r| r.camera[axis] = value),
                    expected,
                    "{axis} {value}"
                );
                let expected = expected || axis < 2;
                assert_eq!(
                    accepts(|r| r.middle[axis] = value),
                    expected,
                    "{axis} {value}"
                );
            }
        }
        assert!(accepts(|r| r.middle = [i32::MIN, i32::MAX, 0]));
    }

    /// A unit vector may be off by its rounding, and a little more: here by 1 of 2^-30 along itself (2^31 of its
    /// square), and by 3 across.
    #[test]
    fn non_orthogonal_axes_and_edges_are_refused() {
        for axis in 0..3 {
            let long = GOOD.axes[axis].map(|v| v / ONE);
            for (more, expected) in [(1, true), (-2, true), (2, false), (-3, false)] {
                let changed = |r: &mut SightRecord| {
                    for (entry, one) in r.axes[axis].iter_mut().zip(long) {
                        *entry += one * more;
                    }
                };
                assert_eq!(accepts(changed), expected, "{axis} {more}");
                // One of the entries that are zero.
                let zero = long.iter().position(|v| *v == 0).unwrap();
                assert!(accepts(|r| r.axes[axis][zero] = 3));
                assert!(!accepts(|r| r.axes[axis][zero] = 4));
            }
        }
        assert!(accepts(|r| r.normal[0] = 2 - ONE));
        assert!(!accepts(|r| r.normal[0] = 3 - ONE));
        // An edge of 3.8e7 is across another edge by 112, or across a normal by 4; and is longer by 56.
        for (axis, off, expected) in [(2, 111, true), (2, 112, false), (0, 3, true), (0, 4, false)]
        {
            assert_eq!(
                accepts(|r| r.half_right[axis] = off),
                expected,
                "{axis} {off}"
            );
        }
        for (axis, off, expected) in [(1, 111, true), (1, 112, false), (0, 3, true), (0, 4, false)]
        {
            assert_eq!(accepts(|r| r.half_up[axis] = off), expected, "{axis} {off}");
        }
        assert!(accepts(|r| r.half_up[2] += 55) && !accepts(|r| r.half_up[2] += 56));
        // Edges of length 0, and of more than 2^30.
        assert!(!accepts(|r| (r.half_right, r.half_up) = ([0; 3], [0; 3])));
        let edges = |length: i32| {
            accepts(|r| (r.half_right, r.half_up) = ([0, -length, 0], [0, 0, length]))
        };
        assert!(edges(1) && edges(ONE) && !edges(ONE + 1));
        // Mirrored.
        assert!(!accepts(|r| r.axes[0][1] = ONE));
        assert!(!accepts(|r| r.half_up[2] = -150_000 << 8));
        assert!(accepts(
            |r| (r.half_up[2], r.half_right[1]) = (-150_000 << 8, 150_000 << 8)
        ));
        // Every entry at its limits.
        for end in [i32::MIN, i32::MAX] {
            assert!(!accepts(|r| r.axes = [[end; 3]; 3]));
            assert!(!accepts(
                |r| (r.half_right, r.half_up, r.normal) = ([end; 3], [end; 3], [end; 3])
            ));
        }
    }
}
