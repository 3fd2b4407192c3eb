//! What a view costs by bounds that were learnt from a detector's own errors.

use super::objective::ViewCost;
use super::quadrature::Quadrature;
use crate::learn::ErrorModel;

/// The bound on the error of an observation, centimetres and degrees alike: `100 translation + yaw`. A view of which the
/// model says nothing is a miss.
#[derive(Clone, Copy, Debug)]
pub struct LearntCost<'a> {
    /// The bounds, by d, phi and psi.
    pub model: &'a ErrorModel,
    /// What a miss costs.
    pub c_high: f64,
}

impl ViewCost for LearntCost<'_> {
    fn of_view(&self, [d, phi, psi]: [f64; 3]) -> f64 {
        let bounds = self.model.bounds(d, phi, psi);
        bounds.map_or(f64::INFINITY, |(translation, yaw)| {
            100.0 * translation + yaw.to_degrees()
        })
    }

    fn of_miss(&self) -> f64 {
        self.c_high
    }

    /// A learnt bound jumps and bends at the borders of its cells: what is gained beyond 1e-4 is not worth its time, and
    /// what is spent has a limit.
    fn quadrature(&self, wanted: Quadrature) -> Quadrature {
        let views = if wanted.accuracy > 1e-4 {
            60_000
        } else {
            600_000
        };
        Quadrature {
            accuracy: wanted.accuracy.max(1e-4),
            headings: wanted.headings.min(900),
            views: wanted.views.min(views),
        }
    }
}
