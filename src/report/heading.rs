//! Headings from orientations, in integers.

use crate::num::{BinaryAngle, FloatUnit, Rounding, converted, is_below_power_of_two, is_finite};
use crate::set::InputError;

/// The robot's heading, in the form that a source reports.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Heading {
    /// The yaw in radians, counter-clockwise; any number of turns below 16,384 rad.
    Radians(f64),
    /// Fixed-axis angles in radians, `R = Rz(yaw) Ry(pitch) Rx(roll)`. Roll and pitch are checked, but
    /// not used.
    RollPitchYaw([f64; 3]),
    /// A unit quaternion `x, y, z, w` (ROS's order). Its tilt is checked, but not used.
    Quaternion([f64; 4]),
}

/// Roll and pitch below 2^-4 rad (3.6 degrees) each: a tilt below 5.07 degrees.
const TILT_POWER: i32 = -4;
/// `x^2 + y^2` of a quaternion, the squared sine of half the tilt, below 2^-9: a tilt below 5.07 degrees.
const TILT_DOWN: u32 = 9;
/// `|q|^2` is within 2^-15 of 1: |q| within 1.5e-5.
const NORM_DOWN: u32 = 15;

/// The unit of a quaternion's entries: 2^-40.
const ENTRY: FloatUnit = FloatUnit::new(1, -40);

impl Heading {
    /// Returns the heading as a binary angle: within 0.5 unit and 2^-8 unit of the true one.
    ///
    /// # Errors
    /// [`InputError::EstimateNotFinite`], [`InputError::EstimateOutOfRange`],
    /// [`InputError::OrientationInvalid`], [`InputError::Tilted`].
    pub fn angle(&self) -> Result<BinaryAngle, InputError> {
        match self {
            Self::Radians(yaw) => of_radians(*yaw),
            Self::RollPitchYaw([roll, pitch, yaw]) => {
                for tilt in [roll, pitch] {
                    if !is_finite(*tilt) {
                        return Err(InputError::EstimateNotFinite);
                    }
                    if !is_below_power_of_two(*tilt, TILT_POWER) {
                        return Err(InputError::Tilted);
                    }
                }
                of_radians(*yaw)
            }
            Self::Quaternion(entries) => of_quaternion(entries),
        }
    }
}

fn of_radians(yaw: f64) -> Result<BinaryAngle, InputError> {
    if !is_finite(yaw) {
        return Err(InputError::EstimateNotFinite);
    }
    BinaryAngle::from_radians(yaw).ok_or(InputError::EstimateOutOfRange)
}

/// Returns `atan2(2 (w z + x y), w^2 + x^2 - y^2 - z^2)`, which does not depend on the quaternion's
/// length.
///
/// Entries are rounded to within 2^-41, which changes the heading by at most 2^-39 rad (0.0013 unit).
fn of_quaternion(entries: &[f64; 4]) -> Result<BinaryAngle, InputError> {
    let mut fixed = [0i64; 4];
    for (fixed, entry) in fixed.iter_mut().zip(entries) {
        // Below 2: no square sum leaves its range.
        if !is_below_power_of_two(*entry, 1) {
            return Err(InputError::OrientationInvalid);
        }
        let entry = converted(*entry, &ENTRY, Rounding::Nearest);
        *fixed = entry.map_err(|_| InputError::OrientationInvalid)?;
    }
    let [xx, yy, zz, ww] = fixed.map(|entry| product(entry, entry));
    let [x, y, z, w] = fixed;
    let one = 1i128 << 80;
    let norm = xx.wrapping_add(yy).wrapping_add(zz).wrapping_add(ww);
    if !(norm.abs_diff(one) < one.unsigned_abs() >> NORM_DOWN) {
        return Err(InputError::OrientationInvalid);
    }
    if !(xx.wrapping_add(yy) < one >> TILT_DOWN) {
        return Err(InputError::Tilted);
    }
    // The length is |q|^2 cos(pitch), slightly below 1; unit 2^-56.
    let cosine = ww.wrapping_add(xx).wrapping_sub(yy).wrapping_sub(zz) >> 24;
    let sine = product(w, z).wrapping_add(product(x, y)) >> 23;
    Ok(angle_of(cosine as i64, sine as i64))
}

/// Returns a product below 2^82. Six copies would take 400 bytes of flash.
#[cfg_attr(small_code, inline(never))]
fn product(a: i64, b: i64) -> i128 {
    i128::from(a).wrapping_mul(i128::from(b))
}

/// Arctangents of 2^-k, unit 2^-56 turn, to the nearest.
const ARCTANGENTS: [i64; 41] = [
    9_007_199_254_740_992,
    5_317_260_203_651_848,
    2_809_494_260_081_567,
    1_426_143_154_396_570,
    715_839_029_270_683,
    358_268_477_703_266,
    179_177_955_010_598,
    89_594_445_026_371,
    44_797_906_047_171,
    22_399_038_468_267,
    11_199_529_914_810,
    5_599_766_292_493,
    2_799_883_313_132,
    1_399_941_677_427,
    699_970_841_321,
    349_985_420_986,
    174_992_710_534,
    87_496_355_272,
    43_748_177_637,
    21_874_088_818,
    10_937_044_409,
    5_468_522_205,
    2_734_261_102,
    1_367_130_551,
    683_565_276,
    341_782_638,
    170_891_319,
    85_445_659,
    42_722_830,
    21_361_415,
    10_680_707,
    5_340_354,
    2_670_177,
    1_335_088,
    667_544,
    333_772,
    166_886,
    83_443,
    41_722,
    20_861,
    10_430,
];

/// Returns the direction of a vector whose length is between 2^54 and 2^58, to the nearest binary angle:
/// CORDIC (Volder 1959), which rotates the vector to the x axis by ever smaller known angles.
///
/// | error, unit 2^-32 turn | at most |
/// |---|---|
/// | the rest after the last rotation: 2^-40 rad | 0.0007 |
/// | 41 shifts, a unit of 2^-54 of the length each | 0.0001 |
/// | 41 arctangents, half a unit of 2^-24 each | 0.0001 |
fn angle_of(x: i64, y: i64) -> BinaryAngle {
    let behind = x < 0;
    let (mut x, mut y) = if behind {
        (x.wrapping_neg(), y.wrapping_neg())
    } else {
        (x, y)
    };
    let mut angle = if behind { 1i64 << 55 } else { 0 };
    for (k, arctangent) in (0u32..).zip(&ARCTANGENTS) {
        let (dx, dy) = (y.wrapping_shr(k), x.wrapping_shr(k));
        if y > 0 {
            x = x.wrapping_add(dx);
            y = y.wrapping_sub(dy);
            angle = angle.wrapping_add(*arctangent);
        } else {
            x = x.wrapping_sub(dx);
            y = y.wrapping_add(dy);
            angle = angle.wrapping_sub(*arctangent);
        }
    }
    // The low 32 bits of the angle, to the nearest.
    BinaryAngle((angle.wrapping_add(1 << 23) >> 24) as u32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::TAU;
    use proptest::prelude::*;

    /// Returns the difference between an angle and radians, in units of 2^-32 turn.
    fn off(angle: BinaryAngle, radians: f64) -> f64 {
        let units = f64::from(angle.0) - radians / TAU * 4_294_967_296.0;
        (units / 4_294_967_296.0 - (units / 4_294_967_296.0).round()) * 4_294_967_296.0
    }

    /// Returns `Rz(yaw) Ry(pitch) Rx(roll)` as x, y, z, w.
    fn quaternion(roll: f64, pitch: f64, yaw: f64) -> [f64; 4] {
        let turn = nalgebra::UnitQuaternion::from_euler_angles(roll, pitch, yaw);
        [turn.i, turn.j, turn.k, turn.w]
    }

    proptest! {
        #[test]
        fn directions_round_to_nearest(radians in -4.0f64..4.0, bits in 54i32..58) {
            let length = 2f64.powi(bits);
            let angle = angle_of((length * radians.cos()) as i64, (length * radians.sin()) as i64);
            prop_assert!(off(angle, radians).abs() <= 0.51, "{}", off(angle, radians));
        }

        #[test]
        fn quaternion_yaw_is_exact_to_rounding(
            roll in -0.05f64..0.05, pitch in -0.05f64..0.05, yaw in -3.2f64..3.2,
            length in 0.99999f64..1.00001, flipped: bool,
        ) {
            let sign = if flipped { -length } else { length };
            let angle = Heading::Quaternion(quaternion(roll, pitch, yaw).map(|v| v * sign)).angle();
            prop_assert!(off(angle.unwrap(), yaw).abs() <= 0.51);
            let same = Heading::RollPitchYaw([roll, pitch, yaw]).angle();
            prop_assert!(off(same.unwrap(), yaw).abs() <= 0.51);
        }

        #[test]
        fn bits_never_panic(bits in proptest::array::uniform4(any::<u64>())) {
            let entries = bits.map(f64::from_bits);
            let _ = Heading::Quaternion(entries).angle();
            let [roll, pitch, yaw, _] = entries;
            let _ = Heading::RollPitchYaw([roll, pitch, yaw]).angle();
        }
    }

    #[test]
    fn invalid_rotations_are_refused() {
        for entries in [
            [0.0; 4],
            [0.0, 0.0, 0.0, 1.0001],
            [0.0, 0.0, 0.0, 0.9999],
            [0.0, 0.0, f64::NAN, 1.0],
            [0.0, 0.0, f64::INFINITY, 1.0],
            [0.0, 0.0, 1e300, 1.0],
        ] {
            let angle = Heading::Quaternion(entries).angle();
            assert_eq!(angle, Err(InputError::OrientationInvalid), "{entries:?}");
        }
    }

    #[test]
    fn a_tilted_robot_is_refused() {
        let limit = 5f64.to_radians();
        for (roll, pitch) in [(1.0, 0.0), (0.0, -1.0), (0.8, 0.8)] {
            let at = |angle: f64| Heading::Quaternion(quaternion(roll * angle, pitch * angle, 2.0));
            assert!(at(0.99 * limit / f64::hypot(roll, pitch)).angle().is_ok());
            assert_eq!(
                at(1.03 * limit / f64::hypot(roll, pitch)).angle(),
                Err(InputError::Tilted)
            );
        }
        let tilted = |roll, pitch| Heading::RollPitchYaw([roll, pitch, 0.0]).angle();
        assert!(tilted(0.0624, -0.0624).is_ok());
        assert_eq!(tilted(0.0625, 0.0), Err(InputError::Tilted));
        assert_eq!(tilted(0.0, -0.0625), Err(InputError::Tilted));
        assert_eq!(tilted(f64::NAN, 0.0), Err(InputError::EstimateNotFinite));
        assert_eq!(
            tilted(0.0, f64::INFINITY),
            Err(InputError::EstimateNotFinite)
        );
    }
}
