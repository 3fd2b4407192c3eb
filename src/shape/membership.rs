//! Is a pose in a success set? The slacks of its constraints.

use super::planar::Planar;
use super::scalar::{ALL, Scalar};
use super::visibility::ToleranceMargins;
use super::{PoseDeg, Resolved, Shape, Sight, SuccessSet};

/// Membership of a pose in a success set, with slacks.
#[derive(Clone, Debug, PartialEq)]
pub struct Membership {
    /// `true` if the pose is in the set.
    pub inside: bool,
    /// The slack of each constraint by name: at least 0 inside, roughly metres or radians.
    pub slack: Vec<(&'static str, f64)>,
    /// The tag as the camera sees it, if the set has exactly one view ([`Shape::visibility`]).
    pub sight: Option<Sight>,
}

impl SuccessSet {
    /// Transforms a world pose `(x m, y m, yaw rad)` to the goal frame, yaw not wrapped.
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
        let [x, y, yaw] = self.to_goal(world);
        let pose = Planar {
            x,
            y,
            cos: libm::cos(yaw),
            sin: libm::sin(yaw),
        };
        let slack = slacks(&self.shape, self.goal, &pose, [x, y, yaw]);
        let sight = self
            .shape
            .visibility()
            .map(|set| set.resolve::<f64>(self.goal).sight(&pose));
        Membership {
            inside: slack.iter().all(|(_, value)| *value >= 0.0),
            slack,
            sight,
        }
    }
}

/// Computes the slacks of a view. An image through a lens ends at its pixel borders, not at the window with which
/// tables are made. With tolerances the window is used.
pub fn seen(view: &Resolved<f64>, pose: &Planar<f64>, note: &mut impl FnMut(&'static str, f64)) {
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
pub fn is_seen(view: &Resolved<f64>, pose: &Planar<f64>) -> bool {
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

/// Returns the slacks of a set at a pose, by name; of a union those of the set with the largest least slack.
fn slacks(
    shape: &Shape,
    goal: PoseDeg,
    pose: &Planar<f64>,
    plain: [f64; 3],
) -> Vec<(&'static str, f64)> {
    let mut smallest: Vec<(&'static str, f64)> = Vec::new();
    // Several constraints may share a name: the smallest slack of each name is kept.
    let mut note = |name, value: f64| match smallest.iter_mut().find(|(known, _)| *known == name) {
        Some((_, least)) => *least = least.min(value),
        None => smallest.push((name, value)),
    };
    match shape {
        Shape::Box(set) => set.slacks(plain[0], plain[1], plain[2], &mut note),
        Shape::Footprint(set) => set.exact_slacks(pose, &mut note),
        Shape::Visibility(set) => {
            seen(&set.resolve::<f64>(goal), pose, &mut note);
        }
        Shape::Bounded { view, limit } => {
            let resolved = view.resolve::<f64>(goal);
            seen(&resolved, pose, &mut note);
            note("error", limit.slack(view, &resolved.sight(pose)));
        }
        Shape::Apart(set) => note(set.name(), set.slack(goal, pose)),
        Shape::All(sets) => {
            for set in sets {
                for (name, value) in slacks(set, goal, pose, plain) {
                    note(name, value);
                }
            }
        }
        Shape::Any(sets) => {
            let least = |slacks: &[(&'static str, f64)]| {
                slacks.iter().map(|(_, v)| *v).fold(f64::INFINITY, f64::min)
            };
            return sets
                .iter()
                .map(|set| slacks(set, goal, pose, plain))
                .max_by(|a, b| least(a).total_cmp(&least(b)))
                .unwrap_or_default();
        }
    }
    smallest
}
