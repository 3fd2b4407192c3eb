//! A number type for success sets: one definition of each set serves every arithmetic.

use core::ops::{Add, Mul, Neg, Sub};

/// A number type in which success sets are defined: `f64` for membership, outward-rounded intervals
/// and their derivatives for proofs ([`crate::certify`]).
pub trait Scalar:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Neg<Output = Self>
{
    /// Returns a number of the site file, exactly as an `f64` holds it.
    fn exact(value: f64) -> Self;

    /// Returns cosine and sine of an angle in degrees.
    fn cos_sin_deg(degrees: f64) -> [Self; 2];

    /// Returns the square root of the part above zero.
    fn root(self) -> Self;

    /// Returns the square.
    fn square(self) -> Self {
        self * self
    }
}

impl Scalar for f64 {
    fn exact(value: f64) -> Self {
        value
    }

    fn cos_sin_deg(degrees: f64) -> [Self; 2] {
        let radians = libm::fmod(degrees, 360.0).to_radians();
        [libm::cos(radians), libm::sin(radians)]
    }

    fn root(self) -> Self {
        libm::sqrt(self.max(0.0))
    }
}

/// Returns the last number from `inside` towards `outside` at which a condition holds, found by halving the distance so many times. It
/// holds at `inside`, and beyond the returned number no more.
pub(crate) fn farthest_holding(
    mut inside: f64,
    mut outside: f64,
    halvings: u32,
    holds: impl Fn(f64) -> bool,
) -> f64 {
    for _ in 0..halvings {
        let middle = 0.5 * (inside + outside);
        if holds(middle) {
            inside = middle;
        } else {
            outside = middle;
        }
    }
    inside
}

/// A selection of a set's slacks, one bit each in the order in which they are computed; the slacks
/// from number 63 on share the last bit.
pub type Selection = u64;

/// Every slack.
pub const ALL: Selection = u64::MAX;

/// No slack.
pub const NONE: Selection = 0;

/// Returns the selection of one slack.
pub fn selected(index: usize) -> Selection {
    1 << index.min(63)
}

/// A point or a direction in space.
pub(crate) type Vector<S> = [S; 3];

/// `a . b`.
pub(crate) fn dot<S: Scalar>(a: Vector<S>, b: Vector<S>) -> S {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// `a - b`.
pub(crate) fn minus<S: Scalar>(a: Vector<S>, b: Vector<S>) -> Vector<S> {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// `R v` for a matrix of rows.
pub(crate) fn times<S: Scalar>(rows: [Vector<S>; 3], v: Vector<S>) -> Vector<S> {
    rows.map(|row| dot(row, v))
}

/// `R' v` for a matrix of rows.
pub(crate) fn transposed_times<S: Scalar>(rows: [Vector<S>; 3], v: Vector<S>) -> Vector<S> {
    [0, 1, 2].map(|column| dot(rows.map(|row| row[column]), v))
}

/// `Rz(yaw) Ry(pitch) Rx(roll)` as rows (URDF's fixed axes).
pub fn rotation<S: Scalar>(roll_deg: f64, pitch_deg: f64, yaw_deg: f64) -> [Vector<S>; 3] {
    let [cr, sr] = S::cos_sin_deg(roll_deg);
    let [cp, sp] = S::cos_sin_deg(pitch_deg);
    let [cy, sy] = S::cos_sin_deg(yaw_deg);
    [
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ]
}
