//! Every pose of the robot that fits the corners of tags: one, or two if the tag's mirrored orientation fits too.
//!
//! At a fixed heading the sum of squares has one minimum over the position and is nearly quadratic. From each
//! minimum, the poses that fit within the wanted confidence are followed heading by heading. A side ends where no
//! position fits, or at the saddle that leads to the other minimum. The ellipsoid of a minimum is then grown until it
//! contains all of these poses ([`covering`]). A curved or flat valley gives a large set, not a wrong one.
//!
//! **When the second minimum is excluded.** If its sum of squares over sigma^2 is above that of the best one by at
//! least 16, and by at least 1.5 times the squared radius of the pose-sets. For one tag, sigma = 0.3 px and
//! confidence 0.99 this is `rms_2^2 >= rms_1^2 + 2.13 sigma^2`: a ratio of at least 2.1 for the usual `rms_1 = 0.61
//! sigma`. Noise makes the true pose fit worse than another pose by d with a probability of about `exp(-d / 2)`, 2e-4
//! here. [`MARGIN`] compensates for that in the remaining sets. If tags or camera have a tolerance, the difference is
//! that of the worst place within it: a second minimum is excluded only if it is clearly worse for all places (to
//! first order, as in `survey.rs`).
//!
//! **Cost:** 2 ms on a PC, the mean over the poses in the tests; more for a tag that is seen head-on. Every loop is
//! bounded: a valley of more than [`MOST_STEPS`] steps is refused.

use super::{
    APART, Fix, FixError, MountedCamera, STEP, TagObservation, View, apart, clearer, dot, misfit,
    slopes, survey, wrapped,
};
use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};

#[cfg(test)]
mod tests;

/// Most poses of one observation.
const MOST: usize = 2;
/// The covariance is this much larger than one that contains the sampled poses. The steps along the valley are small
/// compared with it. The probability that the true pose was excluded is small too: a chi-square quantile that is 4 %
/// larger leaves a slack of at least 10 % of 1 - epsilon.
const MARGIN: f64 = 1.04;
/// Steps from a minimum to the heading at which, to first order, the ellipsoid ends.
const HEADINGS: f64 = 16.0;
/// The largest step, radians.
const LONGEST_STEP: f64 = 0.01;
/// Most steps in one direction.
const MOST_STEPS: u32 = 600;
/// Directions in which the positions of one heading are sampled. The polygon around them is 2 % wider than their ellipse.
const DIRECTIONS: u32 = 16;
const AROUND: f64 = 1.02;
/// Most steps of a search at a fixed heading, and of the growth of one direction.
const PLACE_STEPS: u32 = 30;
const GROWTH_STEPS: u32 = 12;
/// Most times that a search is continued. It ends if it moves by less than this: metres and radians.
const SEARCHES: u32 = 6;
const SETTLED: f64 = 1e-6;

/// Estimates the robot's pose: the best fit first, then the second one if the corners do not exclude it. The
/// arguments are those of [`super::locate`].
///
/// The union of the ellipsoids contains the true pose with the confidence of `radius_squared`. This requires
/// independent normal errors of the corners with at most the deviation `sigma_px`, and tags and camera within their
/// tolerances.
///
/// # Errors
/// [`FixError`]; [`FixError::Ambiguous`] if more than two poses fit, or if the poses that fit are unbounded.
pub fn locate_all(
    eye: &MountedCamera,
    seen: &[TagObservation<'_>],
    sigma_px: f64,
    radius_squared: f64,
) -> Result<Vec<Fix>, FixError> {
    let view = View::checked(eye, seen, sigma_px, radius_squared)?;
    let variance = sigma_px * sigma_px;
    let found = view.minima();
    let best = *found.first().ok_or(FixError::NoPose)?;
    if best.0 > variance * misfit(8 * seen.len() - 3) {
        return Err(FixError::Misfit);
    }
    let balls = survey::balls(&view, eye, seen);
    let slack = radius_squared * variance;
    let mut basins: Vec<Basin> = Vec::new();
    let clearer = clearer(radius_squared) * variance;
    for found in found {
        // A search that has not converged is not a minimum: use the minimum that it leads to, or its own pose if that
        // fits.
        let settled = view.settled(found);
        let minimum = settled.unwrap_or(found);
        if basins.iter().any(|basin| basin.has(&minimum)) {
            continue;
        }
        let worse = minimum.0 - best.0;
        let bias = match settled {
            Some(_) if !basins.is_empty() => view.bias(&best, &minimum, &balls),
            _ => 0.0,
        };
        if !(worse - bias < clearer) {
            continue;
        }
        if basins.len() == MOST {
            return Err(FixError::Ambiguous);
        }
        basins.push(view.basin(minimum, variance, slack)?);
    }
    // Behind a saddle that fits is another minimum, which must be known.
    let is_known = |from: &Basin, minimum: &(f64, Vector3<f64>)| {
        let mut others = basins.iter().filter(|other| other.pose != from.pose);
        others.any(|other| other.has(minimum))
    };
    let is_closed = |basin: &Basin| {
        let mut behind = basin.behind.iter();
        behind.all(|minimum| is_known(basin, minimum))
    };
    if !basins.iter().all(is_closed) {
        return Err(FixError::Ambiguous);
    }
    let fix = |basin: &Basin| {
        let (covariance, grown) = covering(basin, radius_squared).ok_or(FixError::NoPose)?;
        let shifts = survey::shifts(&view, &basin.pose, &balls).ok_or(FixError::NoPose)?;
        let covariance = survey::widened(covariance, radius_squared, &shifts);
        let covariance = covariance.ok_or(FixError::NoPose)?;
        Ok(Fix::of(
            &basin.pose,
            &covariance,
            grown,
            basin.cost,
            seen.len(),
        ))
    };
    basins.iter().map(fix).collect()
}

/// The poses around a minimum that fit within the wanted confidence.
struct Basin {
    pose: Vector3<f64>,
    cost: f64,
    /// To first order.
    covariance: Matrix3<f64>,
    /// The step of the heading, radians.
    step: f64,
    /// The range of headings relative to the minimum's, up to a heading without a position that fits, or to a saddle.
    ends: [f64; 2],
    /// The minima behind its saddles, if a position fits at the saddle.
    behind: Vec<(f64, Vector3<f64>)>,
    /// Poses relative to the minimum; their hull contains all poses that fit.
    points: Vec<Vector3<f64>>,
}

impl Basin {
    /// Returns `true` if a minimum is in the basin.
    fn has(&self, (_, pose): &(f64, Vector3<f64>)) -> bool {
        let yaw = wrapped(pose.z - self.pose.z);
        let [from, to] = self.ends;
        apart(pose, &self.pose) <= APART || (from - self.step..=to + self.step).contains(&yaw)
    }
}

/// The best position at a heading.
struct Place {
    cost: f64,
    pose: Vector3<f64>,
    information: Matrix2<f64>,
}

impl View<'_> {
    /// Follows the valley from a minimum in both directions.
    fn basin(
        &self,
        (cost, pose): (f64, Vector3<f64>),
        variance: f64,
        slack: f64,
    ) -> Result<Basin, FixError> {
        let (information, _) = self.normal_equations(&pose).ok_or(FixError::NoPose)?;
        let covariance = information.cholesky().ok_or(FixError::NoPose)?.inverse() * variance;
        let reach = libm::sqrt(covariance[(2, 2)] * slack / variance);
        let mut basin = Basin {
            pose,
            cost,
            covariance,
            step: (reach / HEADINGS).min(LONGEST_STEP),
            ends: [0.0; 2],
            behind: Vec::new(),
            points: Vec::new(),
        };
        let level = cost + slack;
        let middle = self.place(pose).ok_or(FixError::NoPose)?;
        self.positions(&mut basin, &middle, level)?;
        for (side, sign) in [(0, -1.0), (1, 1.0)] {
            self.follow(&mut basin, side, sign, level)?;
        }
        Ok(basin)
    }

    /// Follows the valley to one side, up to a heading at which no position fits, or over a saddle to the minimum
    /// behind it.
    fn follow(
        &self,
        basin: &mut Basin,
        side: usize,
        sign: f64,
        level: f64,
    ) -> Result<(), FixError> {
        let (mut before, mut highest) = (basin.pose, basin.cost);
        let mut falls = false;
        for step in 1..=MOST_STEPS {
            let yaw = sign * f64::from(step) * basin.step;
            if yaw.abs() > core::f64::consts::PI {
                return Err(FixError::Ambiguous);
            }
            let start = Vector3::new(before.x, before.y, basin.pose.z + yaw);
            let place = self.place(start);
            if !falls {
                basin.ends[side] = yaw;
                // Nothing fits behind the camera.
                let Some(place) = &place else {
                    return Ok(());
                };
                self.positions(basin, place, level)?;
                if !(place.cost < level) {
                    return Ok(());
                }
                // Ignores rounding errors in a flat valley.
                falls = place.cost < highest - 1e-9 * level;
            } else if !place.as_ref().is_some_and(|place| place.cost < highest) {
                let behind = self.descended(before).ok_or(FixError::Ambiguous)?;
                basin.behind.push(behind);
                return Ok(());
            }
            let place = place.ok_or(FixError::Ambiguous)?;
            (before, highest) = (place.pose, place.cost);
        }
        Err(FixError::Ambiguous)
    }

    /// Returns the position that fits best at the heading of a pose, searched from its position.
    fn place(&self, start: Vector3<f64>) -> Option<Place> {
        let mut pose = start;
        let mut cost = self.cost(&pose)?;
        for _ in 0..PLACE_STEPS {
            let (information, gradient) = self.position_equations(&pose)?;
            let step = information.cholesky()?.solve(&gradient);
            let next = |share: f64| pose - Vector3::new(step.x, step.y, 0.0) * share;
            let better = [1.0, 0.5, 0.1].into_iter().find_map(|share| {
                let next = next(share);
                let lower = self.cost(&next).filter(|lower| *lower <= cost)?;
                Some((lower, next))
            });
            let Some((lower, next)) = better else {
                break;
            };
            (cost, pose) = (lower, next);
            if step.norm() < 1e-9 {
                break;
            }
        }
        let (information, _) = self.position_equations(&pose)?;
        Some(Place {
            cost,
            pose,
            information,
        })
    }

    /// Returns `J'J` and `J'e` with respect to the position alone.
    fn position_equations(&self, pose: &Vector3<f64>) -> Option<(Matrix2<f64>, Vector2<f64>)> {
        let residuals = self.residuals(pose)?;
        let column = |axis: Vector3<f64>| {
            let step = axis * STEP;
            slopes(
                &self.residuals(&(pose + step))?,
                &self.residuals(&(pose - step))?,
            )
        };
        let columns = [column(Vector3::x())?, column(Vector3::y())?];
        let information = Matrix2::from_fn(|r, c| dot(&columns[r], &columns[c]));
        let gradient = Vector2::from_fn(|r, _| dot(&columns[r], &residuals));
        Some((information, gradient))
    }

    /// Adds poses whose hull contains all positions that fit at a heading.
    fn positions(&self, basin: &mut Basin, place: &Place, level: f64) -> Result<(), FixError> {
        let yaw = Vector3::new(0.0, 0.0, wrapped(place.pose.z - basin.pose.z));
        let to = |pose: Vector3<f64>| {
            let away = pose - basin.pose;
            Vector3::new(away.x, away.y, 0.0) + yaw
        };
        let mut points = vec![to(place.pose)];
        let slack = level - place.cost;
        if slack > 0.0 {
            let factor = place.information.cholesky().ok_or(FixError::NoPose)?;
            for k in 0..DIRECTIONS {
                let turn = core::f64::consts::TAU * f64::from(k) / f64::from(DIRECTIONS);
                let unit = Vector2::new(libm::cos(turn), libm::sin(turn)) * libm::sqrt(slack);
                let direction = factor
                    .l()
                    .transpose()
                    .try_inverse()
                    .ok_or(FixError::NoPose)?
                    * unit;
                let direction = Vector3::new(direction.x, direction.y, 0.0);
                let fits = |share: f64| {
                    let cost = self.cost(&(place.pose + direction * share));
                    cost.is_some_and(|cost| cost < level)
                };
                let mut share = AROUND;
                let mut steps = 0;
                while fits(share) {
                    share *= 1.1;
                    steps += 1;
                    if steps > GROWTH_STEPS {
                        return Err(FixError::Ambiguous);
                    }
                }
                points.push(to(place.pose + direction * share));
            }
        }
        basin.points.extend(points);
        Ok(())
    }

    /// Continues a search until it no longer moves. `None` if it does not converge.
    fn settled(&self, found: (f64, Vector3<f64>)) -> Option<(f64, Vector3<f64>)> {
        let mut now = found;
        for _ in 0..SEARCHES {
            let next = self.descended(now.1)?;
            if apart(&next.1, &now.1) < SETTLED {
                return Some(next);
            }
            now = next;
        }
        None
    }

    /// Returns how much tags and camera within their tolerances can change the difference of the costs of two minima,
    /// to first order.
    fn bias(
        &self,
        best: &(f64, Vector3<f64>),
        other: &(f64, Vector3<f64>),
        balls: &[survey::Ball<'_, '_>],
    ) -> f64 {
        let own = other.0 - best.0;
        let difference = |view: &View<'_>| {
            let (best, neighbour) = view.descended(best.1)?;
            let minimum = view.descended(other.1).filter(|(_, pose)| {
                // The other minimum may be gone, so that the search leads to the best one.
                apart(pose, &neighbour) > 0.5 * apart(&other.1, &neighbour)
            });
            let other = minimum
                .map(|(cost, _)| cost)
                .or_else(|| view.cost(&other.1));
            Some(other? - best)
        };
        let of_ball = |ball: &survey::Ball<'_, '_>| {
            let mut sum = 0.0;
            for moved in &ball.axes {
                let least = [ball.size, -ball.size]
                    .into_iter()
                    .map(|by| difference(&moved(by)).unwrap_or(f64::NEG_INFINITY))
                    .fold(own, f64::min);
                sum += (own - least) * (own - least);
            }
            libm::sqrt(sum)
        };
        balls.iter().map(of_ball).sum()
    }
}

/// Returns a covariance whose ellipsoid contains all poses of a basin, and the largest ratio to the first-order one
/// in any direction. `None` if the first-order one is not positive definite.
///
/// Each pose outside of the ellipsoid stretches it along the direction to that pose, which is then on the border. The
/// result is the smallest ellipsoid about the same centre that contains the previous one and the pose.
fn covering(basin: &Basin, radius_squared: f64) -> Option<(Matrix3<f64>, f64)> {
    let first = basin.covariance * radius_squared;
    let mut shape = first;
    let inverse = first.cholesky()?.inverse();
    let mut points: Vec<(f64, Vector3<f64>)> = basin
        .points
        .iter()
        .map(|point| ((inverse * point).dot(point), *point))
        .collect();
    points.sort_by(|a, b| b.0.total_cmp(&a.0));
    for (_, point) in points {
        let outside = shape.cholesky()?.solve(&point).dot(&point);
        if outside > 1.0 {
            shape += point * point.transpose() * (1.0 - 1.0 / outside);
        }
    }
    let root = first.cholesky()?.l().try_inverse()?;
    let ratio = root * shape * root.transpose();
    let ratio = (ratio + ratio.transpose()) * 0.5;
    let largest = ratio.symmetric_eigenvalues().max();
    let covariance = shape * (MARGIN / radius_squared);
    Some((
        (covariance + covariance.transpose()) * 0.5,
        largest * MARGIN,
    ))
}
