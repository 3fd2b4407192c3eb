//! Repeated evaluation of a task's view of its tag at many poses.

use super::membership::seen;
use super::visibility::{Resolved, distance_and_angles};
use super::{Planar, Scalar, Shape, SuccessSet};

/// A success set prepared for evaluation at many poses.
#[derive(Debug)]
pub struct ViewEvaluator<'a> {
    set: &'a SuccessSet,
    /// The goal: x, y, and the cosine and sine of its heading.
    goal: Planar<f64>,
    view: Option<Resolved<f64>>,
    /// `true` if the view is the whole set.
    alone: bool,
}

impl SuccessSet {
    /// Prepares the set.
    #[must_use]
    pub fn watch(&self) -> ViewEvaluator<'_> {
        let [cos, sin] = f64::cos_sin_deg(self.goal.yaw_deg);
        ViewEvaluator {
            set: self,
            goal: Planar {
                x: self.goal.x,
                y: self.goal.y,
                cos,
                sin,
            },
            view: self.shape.visibility().map(|view| view.resolve(self.goal)),
            alone: matches!(self.shape, Shape::Visibility(_)),
        }
    }
}

impl ViewEvaluator<'_> {
    /// Returns `[d, phi, psi]` (m, rad; [`Sight`](super::Sight)) of the task's only view at a world pose (x, y, yaw; m,
    /// rad) of the set. `None` outside of the set, and for sets without exactly one view. Agrees with
    /// [`SuccessSet::membership`].
    #[must_use]
    pub fn at(&self, world: [f64; 3]) -> Option<[f64; 3]> {
        let view = self.view.as_ref()?;
        let [dx, dy] = [world[0] - self.goal.x, world[1] - self.goal.y];
        let (c, s) = (self.goal.cos, self.goal.sin);
        let (sin, cos) = libm::sincos(world[2]);
        let pose = Planar {
            x: c * dx + s * dy,
            y: c * dy - s * dx,
            cos: cos * c + sin * s,
            sin: sin * c - cos * s,
        };
        if self.alone {
            let mut inside = true;
            seen(view, &pose, &mut |_, slack| inside &= slack >= 0.0);
            if !inside {
                return None;
            }
        } else if !self.set.membership(world).inside {
            return None;
        }
        let ray = view.in_camera(&pose, view.centre);
        Some(distance_and_angles(
            ray,
            view.tag_to_camera(&pose),
            view.normal,
        ))
    }
}
