//! Planar poses in any arithmetic, and sets in their goal frames.

use super::scalar::{ALL, Scalar, Vector};
use super::{PoseDeg, Shape, Sight, SuccessSet};
use std::vec::Vec;

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

impl<S: Scalar> Planar<S> {
    /// A point of the goal frame seen from the robot: `T_g_r^-1 p`.
    pub(crate) fn to_robot(self, [px, py, pz]: Vector<S>) -> Vector<S> {
        let (dx, dy) = (px - self.x, py - self.y);
        [
            self.cos * dx + self.sin * dy,
            self.cos * dy - self.sin * dx,
            pz,
        ]
    }

    /// A point of the robot in the goal frame.
    pub(crate) fn to_goal(self, [px, py]: [S; 2]) -> [S; 2] {
        [
            self.x + self.cos * px - self.sin * py,
            self.y + self.sin * px + self.cos * py,
        ]
    }
}

/// What a pose is to a success set.
#[derive(Clone, Debug, PartialEq)]
pub struct Membership {
    /// Whether the pose is in the set.
    pub inside: bool,
    /// The slack of each constraint by name: at least 0 inside, roughly metres or radians.
    pub slack: Vec<(&'static str, f64)>,
    /// For visibility sets: what the camera sees.
    pub sight: Option<Sight>,
}

impl SuccessSet {
    /// A world pose `(x m, y m, yaw rad)` in the goal frame, yaw not wrapped.
    #[must_use]
    pub fn to_goal(&self, [x, y, yaw]: [f64; 3]) -> [f64; 3] {
        let PoseDeg {
            x: gx,
            y: gy,
            yaw_deg,
        } = self.goal;
        let [c, s] = f64::cos_sin_deg(yaw_deg);
        let (dx, dy) = (x - gx, y - gy);
        [c * dx + s * dy, c * dy - s * dx, yaw - yaw_deg.to_radians()]
    }

    /// Whether a world pose `(x m, y m, yaw rad)` is in the set, with the slack of every
    /// constraint. In `f64`: a pose within 1e-12 of a border may fall on either side.
    #[must_use]
    pub fn membership(&self, world: [f64; 3]) -> Membership {
        let [x, y, yaw] = self.to_goal(world);
        let pose = Planar {
            x,
            y,
            cos: libm::cos(yaw),
            sin: libm::sin(yaw),
        };
        let mut slack = Vec::new();
        let mut note = |name, value: f64| slack.push((name, value));
        let sight = match &self.shape {
            Shape::Box(set) => {
                set.slacks(x, y, yaw, &mut note);
                None
            }
            Shape::Footprint(set) => {
                set.slacks(&pose, ALL, &mut |_, name, value| note(name, value));
                None
            }
            Shape::Visibility(set) => {
                let resolved = set.resolve::<f64>(self.goal);
                resolved.slacks(&pose, ALL, &mut |_, name, value| note(name, value));
                Some(resolved.sight(&pose))
            }
        };
        // Several constraints may share a name: keep the smallest of each.
        let mut smallest: Vec<(&'static str, f64)> = Vec::new();
        for (name, value) in slack {
            match smallest.iter_mut().find(|(known, _)| *known == name) {
                Some((_, least)) => *least = least.min(value),
                None => smallest.push((name, value)),
            }
        }
        Membership {
            inside: smallest.iter().all(|(_, value)| *value >= 0.0),
            slack: smallest,
            sight,
        }
    }
}
