//! Searches the places of a space for the least value: a grid, then descents from its best places. Each piece is searched
//! in its own coordinates, with its borders as bounds.

use super::objective::PlaceValue;
use super::space::{Piece, Space};
use basin::{
    Bobyqa, BoundedCmaEs, BoxBounds, ConstraintDescription, ConstraintSet, Constraints,
    CostFunction, DenseMatrix, Executor, Mads, PopulationProgress, Ssga,
};
use core::cell::RefCell;
use posegate::shape::Pose3Deg;
use rayon::prelude::*;

/// How a search descends from a place of the grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Quadratic models within bounds (Powell's BOBYQA).
    Bobyqa,
    /// CMA-ES, for comparison.
    Cmaes,
    /// A genetic algorithm in the place's piece (the paper's optimizer), for comparison.
    Genetic,
}

/// A place and its value.
#[derive(Clone, Debug)]
struct Found {
    piece: usize,
    point: Vec<f64>,
    pose: Pose3Deg,
    value: PlaceValue,
}

/// The result of a search.
pub(super) struct Searched {
    /// Local optima, the best first: a mirror image, for example.
    pub best: Vec<Pose3Deg>,
    /// The ends of the descents from the grid.
    pub descents: Vec<Pose3Deg>,
    /// The number of places that were evaluated.
    pub looks: u64,
}

/// A function of the pose whose least value is searched.
pub(super) struct Search<'a> {
    pub space: &'a Space,
    /// The same on every thread.
    pub value: &'a (dyn Fn(Pose3Deg) -> PlaceValue + Sync),
    /// Poses near which there may be good places.
    pub guesses: Vec<Pose3Deg>,
    /// Called with each number of evaluated places.
    pub progress: &'a (dyn Fn(u64) + Sync),
}

/// Percentages of the looks for the grid and for the descents; the rest is for the polish.
const GRID: u64 = 30;
const DESCENTS: u64 = 45;
/// Largest number of descents, and the least number of looks of each per coordinate.
const STARTS: u64 = 6;
const LEAST: u64 = 12;
/// The number of local optima that are polished.
const POLISHED: usize = 2;
/// Descents begin at least this far apart, shares of an axis. Their first steps are half as long.
const STARTS_APART: f64 = 0.1;
/// Optima that are closer to each other are one.
const APART: f64 = 0.01;
/// Guesses that are closer to each other are one.
const SAME: f64 = 1e-3;
/// The last steps of a descent and of a polish.
const LAST: [f64; 2] = [1e-3, 1e-6];

/// A search from one place.
#[derive(Clone, Copy)]
enum Local {
    By(Method),
    /// Mesh adaptive direct search: it also descends along a kink, such as the border of what contains the pose-set.
    Mesh,
}

/// The steps of a polish.
const POLISH: [Local; 2] = [Local::By(Method::Bobyqa), Local::Mesh];

impl Search<'_> {
    /// Searches the space with at most a number of looks. The result depends only on the arguments, not on the number of threads.
    pub fn run(&self, method: Method, looks: u64, seed: u64) -> Searched {
        let grid: Vec<Found> = self
            .grid(looks * GRID / 100, seed)
            .into_par_iter()
            .map(|(piece, point)| self.look(piece, point))
            .collect();
        let mut spent = grid.len() as u64;
        let most = (looks * DESCENTS / 100).min(looks.saturating_sub(spent));
        let number = (most / LEAST).clamp(1, STARTS);
        let starts = self.distinct(grid, STARTS_APART, number as usize);
        let first = 0.5 * STARTS_APART;
        let each = most / starts.len().max(1) as u64;
        let (ends, used) =
            self.descents(&[Local::By(method)], starts, [first, LAST[0]], each, seed);
        spent += used;
        let descents = self.distinct(ends, APART, usize::MAX);
        let chosen: Vec<Found> = descents.iter().take(POLISHED).cloned().collect();
        let each = looks.saturating_sub(spent) / chosen.len().max(1) as u64;
        let (ends, used) = self.descents(&POLISH, chosen, [APART, LAST[1]], each, seed);
        let poses = |all: &[Found]| all.iter().map(|one| one.pose).collect();
        Searched {
            best: poses(&self.distinct(ends, APART, POLISHED)),
            descents: poses(&descents),
            looks: spent + used,
        }
    }

    /// Returns the best places, the best first, each at least a distance from the others on its piece.
    fn distinct(&self, mut all: Vec<Found>, apart: f64, most: usize) -> Vec<Found> {
        all.sort_by(|a, b| a.value.order(&b.value));
        let mut kept: Vec<Found> = Vec::new();
        for found in all {
            let piece = &self.space.pieces()[found.piece];
            let near = |other: &Found| {
                other.piece == found.piece && piece.apart(&other.point, &found.point) < apart
            };
            if kept.len() < most && !kept.iter().any(near) {
                kept.push(found);
            }
        }
        kept
    }

    fn look(&self, piece: usize, point: Vec<f64>) -> Found {
        let pose = self.space.pieces()[piece].pose(&point);
        let value = (self.value)(pose);
        (self.progress)(1);
        Found {
            piece,
            point,
            pose,
            value,
        }
    }

    /// Returns at most a number of points of the pieces: guesses, and an even spread that depends on the seed.
    fn grid(&self, most: u64, seed: u64) -> Vec<(usize, Vec<f64>)> {
        let most = (most as usize).max(1);
        let pieces = self.space.pieces();
        let mut guesses: Vec<(usize, Vec<f64>)> = Vec::new();
        for guess in &self.guesses {
            for (number, piece) in pieces.iter().enumerate() {
                let point = piece.point(guess);
                let same = |(other, at): &(usize, Vec<f64>)| {
                    *other == number && piece.apart(at, &point) < SAME
                };
                if !guesses.iter().any(same) {
                    guesses.push((number, point));
                }
            }
        }
        let every = guesses.len().div_ceil((most / 2).max(1)).max(1);
        let mut points: Vec<_> = guesses.into_iter().step_by(every).collect();
        let (rest, whole) = (
            most.saturating_sub(points.len()),
            pieces.iter().map(Piece::size).sum::<f64>(),
        );
        for (number, piece) in pieces.iter().enumerate() {
            // Each seed takes another part of the sequence.
            let begin = (seed % 1_000 * 1_000) as u32;
            let shift = spread(begin, &std::vec![0.0; piece.dimensions()]);
            let share = piece.size() / whole.max(f64::MIN_POSITIVE);
            // A narrow piece may have the best place.
            let count = (libm::floor(rest as f64 * share) as u32).max(2);
            points.extend((0..count).map(|k| (number, spread(k, &shift))));
        }
        if points.is_empty() {
            points.push((0, std::vec![0.5; pieces[0].dimensions()]));
        }
        points.truncate(most);
        points
    }

    /// Descends from each place with steps from a first to a last length and at most `each` looks. Returns the best places
    /// that were seen, and the number of looks.
    fn descents(
        &self,
        locals: &[Local],
        from: Vec<Found>,
        steps: [f64; 2],
        each: u64,
        seed: u64,
    ) -> (Vec<Found>, u64) {
        let ends: Vec<(Found, u64)> = from
            .into_par_iter()
            .with_max_len(1)
            .map(|start| {
                let trace = RefCell::new(Trace {
                    best: start,
                    left: each,
                });
                for local in locals {
                    let from = trace.borrow().best.clone();
                    self.descend(*local, &from, steps, seed, &trace);
                }
                let trace = trace.into_inner();
                (trace.best, each - trace.left)
            })
            .collect();
        let spent = ends.iter().map(|(_, spent)| spent).sum();
        (ends.into_iter().map(|(end, _)| end).collect(), spent)
    }

    fn descend(
        &self,
        local: Local,
        start: &Found,
        [first, last]: [f64; 2],
        seed: u64,
        trace: &RefCell<Trace>,
    ) {
        let piece = &self.space.pieces()[start.piece];
        if piece.dimensions() == 0 {
            return;
        }
        let bound = |side: f64| -> Vec<f64> {
            let of = |(axis, at): (usize, &f64)| {
                if piece.is_periodic(axis) {
                    at + side - 0.5
                } else {
                    side
                }
            };
            start.point.iter().enumerate().map(of).collect()
        };
        let bounded = Bounded {
            search: self,
            piece: start.piece,
            bounds: [bound(0.0), bound(1.0)],
            trace,
        };
        let from = start.point.clone();
        // What a run returns is not needed: the trace has the best place, and the run ends when no look is left.
        match local {
            Local::By(Method::Bobyqa) => {
                let solver = Bobyqa::new()
                    .with_initial_radius(first)
                    .with_final_radius(last);
                let _ = Executor::from_start(bounded, solver, from).run();
            }
            Local::By(Method::Cmaes) => {
                let solver = BoundedCmaEs::<_, DenseMatrix>::new(seed, first);
                let state = PopulationProgress::from_point(from);
                let _ = Executor::new(bounded, solver, state).run();
            }
            Local::Mesh => {
                let solver = Mads::new()
                    .bounded()
                    .with_initial_poll_size(first)
                    .with_minimum_poll_size(last);
                let _ = Executor::from_start(bounded, solver, from).run();
            }
            Local::By(Method::Genetic) => {
                let state = PopulationProgress::empty();
                let _ = Executor::new(bounded, Ssga::new(seed), state).run();
            }
        }
    }
}

/// Returns a point of an additive recurrence by powers of the generalized golden ratio: any first part of the sequence is spread
/// evenly (M. Roberts, "The Unreasonable Effectiveness of Quasirandom Sequences", 2018).
fn spread(number: u32, shift: &[f64]) -> Vec<f64> {
    // The root of x^(n + 1) = x + 1.
    let power = 1.0 / (shift.len() as f64 + 1.0);
    let ratio = (0..40).fold(2.0, |x: f64, _| libm::pow(1.0 + x, power));
    let at = |(axis, shift): (usize, &f64)| {
        let at = shift + f64::from(number + 1) * libm::pow(ratio, -(axis as f64 + 1.0));
        at - libm::floor(at)
    };
    shift.iter().enumerate().map(at).collect()
}

/// What a descent has seen, and the looks that it has left.
struct Trace {
    best: Found,
    left: u64,
}

/// A piece with its bounds, as a problem of the optimizers.
struct Bounded<'a> {
    search: &'a Search<'a>,
    piece: usize,
    bounds: [Vec<f64>; 2],
    trace: &'a RefCell<Trace>,
}

/// No look is left.
#[derive(Debug, thiserror::Error)]
#[error("no look is left")]
struct Spent;

impl CostFunction for Bounded<'_> {
    type Param = Vec<f64>;
    type Output = f64;
    type Error = Spent;

    fn cost(&self, point: &Vec<f64>) -> Result<f64, Spent> {
        let mut trace = self.trace.borrow_mut();
        trace.left = trace.left.checked_sub(1).ok_or(Spent)?;
        let found = self.search.look(self.piece, point.clone());
        let value = found.value;
        if value.order(&trace.best.value).is_lt() {
            trace.best = found;
        }
        Ok(value.merit())
    }
}

impl Constraints for Bounded<'_> {
    type Set = ConstraintSet<BoxBounds<Vec<f64>>>;

    fn constraints(&self) -> <Self::Set as ConstraintDescription>::Borrowed<'_> {
        let [lower, upper] = &self.bounds;
        ConstraintSet::new().with_bounds(BoxBounds::new(Some(lower), Some(upper)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::sync::atomic::{AtomicU64, Ordering};

    const METHODS: [Method; 3] = [Method::Bobyqa, Method::Cmaes, Method::Genetic];

    /// Searches a narrow valley whose lowest point is at x, z and yaw; returns the looks that were reported, too.
    fn searched(method: Method, [looks, seed]: [u64; 2], at: [f64; 3]) -> (Searched, u64) {
        let origin = Pose3Deg {
            x: 0.0,
            y: 0.0,
            z: 0.0,
            roll_deg: 0.0,
            pitch_deg: 0.0,
            yaw_deg: 0.0,
        };
        let ranges = [Some([0.0, 4.0]), None, Some([0.0, 2.0]), Some([0.0, 360.0])];
        let reported = AtomicU64::new(0);
        let search = Search {
            space: &Space::free(origin, ranges).unwrap(),
            value: &|pose| {
                let turn = (pose.yaw_deg - at[2]).abs();
                let off = [
                    pose.x - at[0],
                    pose.z - at[1],
                    turn.min(360.0 - turn) / 90.0,
                ];
                let coupled = off[0] + off[1];
                PlaceValue::valid(
                    1.0 + 9.0 * coupled * coupled + off.iter().map(|v| v * v).sum::<f64>(),
                )
            },
            guesses: std::vec![],
            progress: &|count| {
                reported.fetch_add(count, Ordering::Relaxed);
            },
        };
        (search.run(method, looks, seed), reported.into_inner())
    }

    #[test]
    fn least_value_is_found_inside_and_at_borders() {
        for (at, expected) in [
            ([1.3, 0.7, 200.0], [1.3, 0.7, 200.0]),
            // The yaw wraps.
            ([1.3, 0.7, 359.5], [1.3, 0.7, 359.5]),
            // Beyond the border of z, where x is lower along the valley.
            ([2.0, -0.5, 90.0], [1.55, 0.0, 90.0]),
        ] {
            for (method, near) in METHODS.into_iter().zip([1e-4, 1e-3, 1e-2]) {
                let (found, _) = searched(method, [1_000, 1], at);
                let best = found.best[0];
                let turn = (best.yaw_deg - expected[2]).abs();
                let turn = turn.min(360.0 - turn) / 90.0;
                let off = (best.x - expected[0])
                    .hypot(best.z - expected[1])
                    .hypot(turn);
                assert!(off < near, "{method:?} {at:?} {best:?}");
            }
        }
    }

    #[test]
    fn looks_are_limited_and_reported() {
        for method in METHODS {
            for looks in [1, 2, 7, 49, 333] {
                let (found, reported) = searched(method, [looks, 1], [1.0, 1.0, 1.0]);
                assert!(found.looks <= looks, "{method:?} {looks}: {}", found.looks);
                assert_eq!(found.looks, reported);
                assert!(!found.best.is_empty());
            }
        }
    }
}
