//! Cost of a view by the bounds of an error model: learnt from a detector's own errors, or a formula.

use super::objective::{Task, ViewCost};
use super::quadrature::Quadrature;
use posegate::shape::{self, Visibility};
use posegate_files::printable::fewest_digits;
use posegate_learn::ErrorModel;

/// A bound on the error of an observation by d, phi and psi ([`posegate::shape::Sight`]).
#[derive(Clone, Copy, Debug)]
pub enum ViewBound<'a> {
    /// Learnt from data.
    Learnt(&'a ErrorModel),
    /// `c0 + c1 d^2 + c2 phi^2 + c3 psi^2`.
    Formula(&'a shape::ErrorModel),
}

impl ViewBound<'_> {
    /// Returns the two bounds, metres and degrees, for metres and radians. `None` if a learnt model has too few data there.
    fn at(self, d: f64, phi: f64, psi: f64) -> Option<[f64; 2]> {
        match self {
            Self::Learnt(model) => model
                .bounds(d, phi, psi)
                .map(|(translation, yaw)| [translation, yaw.to_degrees()]),
            Self::Formula(model) => Some(model.at(d, phi, psi)),
        }
    }
}

/// The bound on the error of an observation, plus the error from the tolerances of tag and camera: `100 translation +
/// yaw`, so one centimetre costs as much as one degree. A view that the model does not cover is a miss.
#[derive(Clone, Debug)]
pub struct LearntCost<'a> {
    /// The bounds, by d, phi and psi.
    model: ViewBound<'a>,
    /// The cost of a miss.
    c_high: f64,
    /// The views with tolerances, with the tag at the camera's height: the lever is longest there, and a search may
    /// move the tag to any height. Empty if neither tag nor camera has a tolerance.
    views: Vec<Visibility>,
}

impl<'a> LearntCost<'a> {
    /// Creates the cost of a task's views; `c_high` is the cost of a miss.
    #[must_use]
    pub fn new(model: ViewBound<'a>, c_high: f64, task: &Task) -> Self {
        let mut views: Vec<Visibility> = Vec::new();
        let all = task.set.views_of(&task.tag).into_iter();
        for mut level in all.filter(|view| !view.is_exact()) {
            level.tag.pose.z = level.mount.z;
            let same = |known: &&mut Visibility| {
                known.mount == level.mount && known.mount_tolerance == level.mount_tolerance
            };
            match views.iter_mut().find(same) {
                Some(known) => known.phi_max_deg = known.phi_max_deg.max(level.phi_max_deg),
                None => views.push(level),
            }
        }
        Self {
            model,
            c_high,
            views,
        }
    }
}

impl ViewCost for LearntCost<'_> {
    fn of_view(&self, [d, phi, psi]: [f64; 3]) -> f64 {
        let bounds = self.model.at(d, phi, psi);
        let added = self.views.iter().map(|view| {
            let [metres, degrees] = view.tolerance_error(d + view.tolerance_margins().ray);
            100.0 * metres + degrees
        });
        bounds.map_or(f64::INFINITY, |[translation, yaw_deg]| {
            100.0 * translation + yaw_deg + added.fold(0.0, f64::max)
        })
    }

    fn of_miss(&self) -> f64 {
        self.c_high
    }

    fn definition(&self) -> String {
        format!(
            "100 times the error model's bound in metres plus its bound in degrees, {} outside of S; no unit",
            fewest_digits(self.c_high)
        )
    }

    /// A learnt bound has jumps and kinks at the borders of its cells. So the relative error is never below
    /// 1e-4, and the number of views is limited.
    fn quadrature(&self, requested: Quadrature) -> Quadrature {
        let views = if requested.accuracy > 1e-4 {
            60_000
        } else {
            600_000
        };
        Quadrature {
            accuracy: requested.accuracy.max(1e-4),
            headings: requested.headings.min(900),
            views: requested.views.min(views),
        }
    }
}
