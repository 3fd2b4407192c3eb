//! Planar poses in any arithmetic.

use super::scalar::{Scalar, Vector};

/// A planar pose in the goal frame: position in metres, and cosine and sine of the yaw.
#[derive(Clone, Copy, Debug)]
pub struct Planar<S> {
    /// Metres.
    pub x: S,
    /// Metres.
    pub y: S,
    /// Cosine of the yaw.
    pub cos: S,
    /// Sine of the yaw.
    pub sin: S,
}

impl From<[f64; 3]> for Planar<f64> {
    /// Returns a pose from x, y and yaw: m, m, rad.
    fn from([x, y, yaw]: [f64; 3]) -> Self {
        let (sin, cos) = libm::sincos(yaw);
        Self { x, y, cos, sin }
    }
}

impl<S: Scalar> Planar<S> {
    /// Transforms a point of the goal frame to the robot frame: `T_g_r^-1 p`.
    pub(crate) fn to_robot(self, [px, py, pz]: Vector<S>) -> Vector<S> {
        let [x, y] = self.to_robot_level([px, py]);
        [x, y, pz]
    }

    /// Transforms a point of the floor likewise.
    pub(crate) fn to_robot_level(self, [px, py]: [S; 2]) -> [S; 2] {
        let (dx, dy) = (px - self.x, py - self.y);
        [self.cos * dx + self.sin * dy, self.cos * dy - self.sin * dx]
    }

    /// Transforms a point of the robot frame to the goal frame, metres.
    pub fn to_goal(self, [px, py]: [S; 2]) -> [S; 2] {
        [
            self.x + self.cos * px - self.sin * py,
            self.y + self.sin * px + self.cos * py,
        ]
    }
}
