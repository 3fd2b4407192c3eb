//! A lower bound of the cost of every chain, with looks from any places: the straight path, and the least number of
//! looks that any chain needs.
//!
//! A chain ends with its pose-set inside the work's success set, so the set is no wider than that. Without a look the
//! set is at least as wide as at the start: drives only add to it. With one look it has at least that look's error,
//! grown by the path from the places where its tag is visible. If both are too wide, every chain needs two looks.
//! Effects that are neglected here (turns, angles of view, walls) only make chains more expensive.

use core::f64::consts::PI;

use nalgebra::{Matrix2, Matrix3, Vector2};

use super::library::region;
use posegate::bake::wide_extent;
use posegate::shape::{PoseDeg, Shape, SuccessSet};
use posegate_site::{ChainStart, DriveModel, ErrorBound, Site, StartUncertainty};

/// A box that contains a success set, in its goal frame: metres and radians.
struct Hull {
    goal: PoseDeg,
    x: [f64; 2],
    y: [f64; 2],
    /// `None` if every heading is possible.
    yaw: Option<f64>,
}

impl Hull {
    /// `None` if the set has no bounds.
    fn of(success: &SuccessSet) -> Option<Self> {
        let (x, y, yaw_deg) = match &success.shape {
            Shape::Box(set) => (set.x, set.y, set.yaw_deg),
            _ => {
                let extent = wide_extent(success)?;
                (extent.x, extent.y, extent.yaw_deg)
            }
        };
        let yaw = yaw_deg[1] - yaw_deg[0];
        Some(Self {
            goal: success.goal,
            x,
            y,
            yaw: (yaw < 359.0).then(|| yaw.to_radians()),
        })
    }

    /// Returns the distance of a position of the world from the box.
    fn distance(&self, [x, y]: [f64; 2]) -> f64 {
        let turn = self.goal.yaw_deg.to_radians();
        let (s, c) = (libm::sin(turn), libm::cos(turn));
        let (dx, dy) = (x - self.goal.x, y - self.goal.y);
        let off = |at: f64, [low, high]: [f64; 2]| (low - at).max(at - high).max(0.0);
        libm::hypot(off(c * dx + s * dy, self.x), off(c * dy - s * dx, self.y))
    }

    /// Returns `true` if a set with these half widths may fit: along x and y, and in heading.
    fn admits(&self, [x, y, yaw]: [f64; 3]) -> bool {
        // The core rounds outwards; nothing is excluded for a rounding.
        const SLACK: f64 = 1e-6;
        2.0 * x <= self.x[1] - self.x[0] + SLACK
            && 2.0 * y <= self.y[1] - self.y[0] + SLACK
            && self.yaw.is_none_or(|wide| 2.0 * yaw <= wide + SLACK)
    }
}

/// Errors that drives cannot reduce: translation and heading of a cylinder, metres and radians.
type Errors = [f64; 2];

/// Returns errors after drives of at least a length: the errors that every path of that length adds.
fn driven([rho, alpha]: Errors, metres: f64, model: Option<&DriveModel>) -> Errors {
    let swung = 2.0 * metres * libm::sin(alpha.min(PI) / 2.0);
    match model {
        Some(DriveModel::Bounded(drift)) => [
            rho + drift.k_slip * metres + swung,
            alpha + drift.k_drift * metres,
        ],
        _ => [rho + swung, alpha],
    }
}

/// A work task, its start, and the requirements of every chain of a site between them.
pub(super) struct EveryChain<'a> {
    site: &'a Site,
    start: &'a ChainStart,
    model: Option<DriveModel>,
    hull: Option<Hull>,
    /// The price of a metre; 0 if drives may be cheaper than their length.
    metre: f64,
}

impl<'a> EveryChain<'a> {
    /// `start` is in the world. `priced` is `true` if drives have prices of their own.
    pub fn of(
        site: &'a Site,
        start: &'a ChainStart,
        work: &SuccessSet,
        model: Option<DriveModel>,
        priced: bool,
    ) -> Self {
        Self {
            site,
            start,
            model,
            hull: Hull::of(work),
            metre: if priced { 0.0 } else { site.planner.metre },
        }
    }

    /// Returns a lower bound of the cost of every chain.
    pub fn bound(&self) -> f64 {
        let Some(hull) = &self.hull else {
            return 0.0;
        };
        let drive_cost = self.metre * hull.distance(self.begin());
        if self.is_possible_without_look(hull) {
            return drive_cost;
        }
        let look = self.site.planner.look_cost;
        let two = 2.0 * look + drive_cost;
        self.looks()
            .filter_map(|(success, bound)| self.one_look(hull, success, bound, two))
            .fold(two, f64::min)
    }

    const fn begin(&self) -> [f64; 2] {
        [self.start.pose.x, self.start.pose.y]
    }

    /// The success sets and errors of all looks of the site.
    fn looks(&self) -> impl Iterator<Item = (&SuccessSet, ErrorBound)> {
        let own = self.site.tasks.values();
        let own = own.filter_map(|task| Some((&task.success, task.error_bound?)));
        let made = self.site.planner.looks.values();
        own.chain(made.map(|made| (&made.success, made.bound)))
    }

    /// Errors at the start as a cylinder; 0 for errors that drives can reduce.
    fn known(&self) -> Errors {
        match &self.start.known {
            StartUncertainty::Bounded {
                translation,
                yaw_deg,
            } => [*translation, yaw_deg.to_radians()],
            StartUncertainty::Gaussian { .. } => [0.0, 0.0],
        }
    }

    /// Returns the least distance of the estimate from its place: that at the end of a drive, or `still` without a
    /// drive.
    fn spread(&self, metres: f64, still: Errors) -> Errors {
        let controller = self.site.navigation.controller;
        let left = [controller.translation, controller.turn_deg.to_radians()];
        if metres > 0.0 {
            left
        } else {
            [left[0].min(still[0]), left[1].min(still[1])]
        }
    }

    /// Returns `true` unless every chain needs a look.
    fn is_possible_without_look(&self, hull: &Hull) -> bool {
        let metres = hull.distance(self.begin());
        let spread = &self.start.spread;
        let spread = self.spread(metres, [spread.translation, spread.turn_deg.to_radians()]);
        let [rho, alpha] = driven(self.known(), metres, self.model.as_ref());
        let cylinder = [rho + spread[0], rho + spread[0], alpha + spread[1]];
        hull.admits(cylinder) && self.random(hull).is_none_or(|half| hull.admits(half))
    }

    /// Returns half widths, in the goal frame, that the set of a Gaussian start has after every drive. Drives shear
    /// the covariance along the heading's error and add to it. So neither the heading's variance nor the covariance
    /// of the position at a known heading becomes smaller.
    fn random(&self, hull: &Hull) -> Option<[f64; 3]> {
        let StartUncertainty::Gaussian {
            covariance,
            epsilon,
        } = &self.start.known
        else {
            return None;
        };
        let all = Matrix3::from_fn(|row, column| covariance[row][column]);
        let radius = libm::sqrt(posegate::confidence::radius_squared(*epsilon)?);
        let yaw = all[(2, 2)].max(0.0);
        let plane: Matrix2<f64> = all.fixed_view::<2, 2>(0, 0).into();
        let shared = Vector2::new(all[(0, 2)], all[(1, 2)]);
        let known = if yaw > 0.0 {
            plane - shared * shared.transpose() / yaw
        } else {
            plane
        };
        let turn = hull.goal.yaw_deg.to_radians();
        let (s, c) = (libm::sin(turn), libm::cos(turn));
        let along = |axis: Vector2<f64>| {
            let variance: f64 = (axis.transpose() * known * axis)[(0, 0)];
            radius * libm::sqrt(variance.max(0.0))
        };
        Some([
            along(Vector2::new(c, s)),
            along(Vector2::new(-s, c)),
            radius * libm::sqrt(yaw),
        ])
    }

    /// Returns a lower bound of the cost of every chain with only this look; `None` if there is no such chain below
    /// `most`.
    fn one_look(
        &self,
        hull: &Hull,
        success: &SuccessSet,
        bound: ErrorBound,
        most: f64,
    ) -> Option<f64> {
        /// Squares along each side of the region from which the look may succeed.
        const SIDE: u32 = 24;
        let (centre, radius) = region(success);
        let look = self.site.planner.look_cost;
        let [x, y] = self.begin();
        let straight = hull.distance([x, y]);
        let to_tag = libm::hypot(centre[0] - x, centre[1] - y);
        let nearest = (to_tag - radius).max(0.0) + (hull.distance(centre) - radius).max(0.0);
        if look + self.metre * nearest.max(straight) >= most {
            return None;
        }
        let error = bound.metres_radians();
        let side = 2.0 * radius / f64::from(SIDE);
        let half = side * core::f64::consts::FRAC_1_SQRT_2;
        let cells = (0..SIDE).flat_map(|row| (0..SIDE).map(move |column| [column, row]));
        let costs = cells.filter_map(|cell| {
            let at: [f64; 2] = core::array::from_fn(|axis| {
                centre[axis] - radius + side * (f64::from(cell[axis]) + 0.5)
            });
            let from_tag = (libm::hypot(at[0] - centre[0], at[1] - centre[1]) - half).max(0.0);
            let to = (libm::hypot(at[0] - x, at[1] - y) - half).max(0.0);
            let on = (hull.distance(at) - half).max(0.0);
            let [before, turned] = driven(self.known(), to, self.model.as_ref());
            // Every pose of the set before the look is near enough to the tag.
            if from_tag + before > radius + 1e-6 {
                return None;
            }
            let [rho, alpha] = driven(error, on, self.model.as_ref());
            let still = [before + error[0], turned + error[1]];
            let spread = self.spread(on, still);
            let half_widths = [rho + spread[0], rho + spread[0], alpha + spread[1]];
            let drive_cost = (to + on).max(straight);
            hull.admits(half_widths)
                .then_some(look + self.metre * drive_cost)
        });
        costs.fold(None, |least: Option<f64>, cost| {
            Some(least.map_or(cost, |least| least.min(cost)))
        })
    }
}
