//! Is a pose in a success set? The slacks of its constraints.

use super::planar::Planar;
use super::prepared::Prepared;
use super::scalar::{ALL, Scalar};
use super::visibility::ToleranceMargins;
use super::{PoseDeg, Resolved, Sight, SuccessSet};

/// Membership of a pose in a success set, with slacks.
#[derive(Clone, Debug, PartialEq)]
pub struct Membership {
    /// `true` if the pose is in the set.
    pub inside: bool,
    /// The slack of each constraint by name: at least 0 inside, roughly metres or radians.
    pub slack: Vec<(&'static str, f64)>,
    /// The tag as the camera sees it, if the set has exactly one view ([`Shape::visibility`](super::Shape::visibility)).
    pub sight: Option<Sight>,
}

/// The least slack of a pose, at least 0 inside, and the constraint that has it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MinSlack {
    /// The slack, roughly in metres or radians.
    pub slack: f64,
    /// The constraint's name, as in [`SuccessSet::membership`].
    pub name: &'static str,
}

impl MinSlack {
    /// The slack of an empty union.
    pub(super) const NOTHING: Self = Self {
        slack: f64::NEG_INFINITY,
        name: "any",
    };

    /// The slack of an empty list of constraints.
    pub const EVERYTHING: Self = Self {
        slack: f64::INFINITY,
        name: "all",
    };

    /// Returns the lower of two slacks, the first of equal ones.
    pub(super) fn lower(self, other: Self) -> Self {
        if other.slack < self.slack {
            other
        } else {
            self
        }
    }
}

impl PoseDeg {
    /// Transforms a world pose `(x m, y m, yaw rad)` to this frame, yaw not wrapped.
    pub(super) fn to_goal(self, [x, y, yaw]: [f64; 3]) -> [f64; 3] {
        let [c, s] = f64::cos_sin_deg(self.yaw_deg);
        let (dx, dy) = (x - self.x, y - self.y);
        let yaw = yaw - self.yaw_deg.to_radians();
        [c * dx + s * dy, c * dy - s * dx, yaw]
    }
}

impl SuccessSet {
    /// Transforms a world pose `(x m, y m, yaw rad)` to the goal frame, yaw not wrapped.
    #[must_use]
    pub fn to_goal(&self, world: [f64; 3]) -> [f64; 3] {
        self.goal.to_goal(world)
    }

    /// Transforms a pose of the goal frame to the world: m, m, rad, yaw not wrapped.
    #[must_use]
    pub fn to_world(&self, [x, y, yaw]: [f64; 3]) -> [f64; 3] {
        let goal = self.goal;
        let [c, s] = f64::cos_sin_deg(goal.yaw_deg);
        [
            goal.x + c * x - s * y,
            goal.y + s * x + c * y,
            yaw + goal.yaw_deg.to_radians(),
        ]
    }

    /// Returns `true` if the set is convex in (x, y) at every heading.
    #[must_use]
    pub fn is_convex(&self) -> bool {
        super::Parts::of(self).only().is_some()
    }

    /// Returns `inside: true` if a world pose `(x m, y m, yaw rad)` is in the set, and the slack of every constraint. In
    /// `f64`: a pose within 1e-12 of a border may be on either side.
    #[must_use]
    pub fn membership(&self, world: [f64; 3]) -> Membership {
        let prepared = Prepared::of(self);
        let pose = self.to_goal(world).into();
        let slack = prepared.slacks(&pose);
        Membership {
            inside: slack.iter().all(|(_, value)| *value >= 0.0),
            slack,
            sight: prepared.view().map(|view| view.sight(&pose.planar)),
        }
    }
}

/// Computes the slacks of a view. An image through a lens ends at its pixel borders, not at the window with which
/// tables are made. With tolerances the window is used.
pub(super) fn seen(
    view: &Resolved<f64>,
    pose: &Planar<f64>,
    note: &mut impl FnMut(&'static str, f64),
) {
    let exact = view.less == ToleranceMargins::default() && view.image_slack(pose).is_some();
    view.slacks(pose, ALL, 0, &mut |_, name, value| {
        if !(exact && name.starts_with("image")) {
            note(name, value);
        }
    });
    if exact && let Some(slack) = view.image_slack(pose) {
        note("image", slack);
    }
}

/// Returns `true` if a view contains a pose: none of [`seen`]'s slacks is below 0. Constraints that most poses
/// violate are evaluated first.
pub(super) fn is_seen(view: &Resolved<f64>, pose: &Planar<f64>) -> bool {
    let mut holds = true;
    view.slacks(pose, view.cones(), 0, &mut |_, name, slack| {
        // Selections share their last bit, so image constraints of a lens with many sides may be among them.
        holds &= slack >= 0.0 || name.starts_with("image");
    });
    if holds {
        seen(view, pose, &mut |_, slack| holds &= slack >= 0.0);
    }
    holds
}
