//! Searches of the unit cube for the least value.

pub use self::cmaes::{Cmaes, Descent};
pub use self::genetic::Genetic;
pub use self::polish::Polish;

mod cmaes;
mod genetic;
mod polish;
#[cfg(test)]
mod tests;

use rayon::prelude::*;
use std::sync::atomic::{AtomicU64, Ordering};

/// A function on the unit cube. Its value at a point is the same on every thread.
pub trait Problem: Sync {
    /// Returns the number of coordinates: at least one.
    fn dimensions(&self) -> usize;

    /// Returns `true` if a coordinate is periodic.
    fn is_periodic(&self, number: usize) -> bool;

    /// Returns points to evaluate before all others; empty by default.
    fn initial_guesses(&self) -> Vec<Vec<f64>> {
        Vec::new()
    }

    /// Returns the value of a point; less is better. Infinite if the point is invalid; never NaN.
    fn value(&self, point: &[f64], look: Fidelity) -> f64;
}

/// The fidelity of an evaluation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fidelity {
    /// Accurate enough to find the direction of descent.
    Quick,
    /// As accurate as the answer.
    Fine,
}

/// A point and its value.
#[derive(Clone, Debug, PartialEq)]
pub struct Solution {
    /// The point in the unit cube.
    pub point: Vec<f64>,
    /// The value at the point.
    pub value: f64,
}

/// A search for the least value.
///
/// The answer depends only on the problem, the budget and the seed, not on the number of threads.
pub trait Optimizer: Sync {
    /// The name on the command line.
    fn name(&self) -> &'static str;

    /// Returns `true` if the search uses the complete budget and its answers need no polish.
    fn refines_internally(&self) -> bool {
        false
    }

    /// Searches the least value with at most the budget's evaluations. Returns at least one local optimum. No two of
    /// them are near each other. The best one by fine evaluation comes first.
    fn search(&self, problem: &dyn Problem, budget: &Budget<'_>, seed: u64) -> Vec<Solution>;
}

/// A limit of the number of evaluations, with a progress callback.
pub struct Budget<'a> {
    most: u64,
    spent: AtomicU64,
    progress: &'a (dyn Fn(u64) + Sync),
}

impl core::fmt::Debug for Budget<'_> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("Budget")
            .field("most", &self.most)
            .field("spent", &self.spent)
            .finish_non_exhaustive()
    }
}

impl<'a> Budget<'a> {
    /// Creates a budget of `most` evaluations. `progress` is called with the size of each evaluated batch.
    pub const fn new(most: u64, progress: &'a (dyn Fn(u64) + Sync)) -> Self {
        Self {
            most,
            spent: AtomicU64::new(0),
            progress,
        }
    }

    /// Returns the number of evaluations made.
    #[must_use]
    pub fn spent(&self) -> u64 {
        self.spent.load(Ordering::Relaxed)
    }

    /// Returns the number of evaluations left.
    #[must_use]
    pub fn left(&self) -> u64 {
        self.most.saturating_sub(self.spent())
    }

    /// Returns the values of points, evaluated in parallel. Points beyond the budget get infinity.
    #[must_use]
    pub fn values(&self, problem: &dyn Problem, points: &[Vec<f64>], look: Fidelity) -> Vec<f64> {
        let allowed = points
            .len()
            .min(usize::try_from(self.left()).unwrap_or(usize::MAX));
        let (asked, rest) = points.split_at(allowed);
        let mut values: Vec<f64> = asked
            .par_iter()
            .map(|point| problem.value(point, look))
            .collect();
        values.extend(rest.iter().map(|_| f64::INFINITY));
        self.spend(allowed as u64);
        values
    }

    fn spend(&self, count: u64) {
        self.spent.fetch_add(count, Ordering::Relaxed);
        (self.progress)(count);
    }
}

/// Maps a point into the unit cube: periodic coordinates are wrapped, others are mirrored at the cube's sides.
pub(super) fn folded(problem: &dyn Problem, free: &[f64]) -> Vec<f64> {
    let fold = |(number, value): (usize, &f64)| {
        if problem.is_periodic(number) {
            value - libm::floor(*value)
        } else {
            let twice = value - 2.0 * libm::floor(0.5 * value);
            if twice > 1.0 { 2.0 - twice } else { twice }
        }
    };
    free.iter().enumerate().map(fold).collect()
}

/// Returns the distance of two points: the largest difference of a coordinate.
pub(super) fn apart(problem: &dyn Problem, a: &[f64], b: &[f64]) -> f64 {
    let off = |number: usize| {
        let off = (a[number] - b[number]).abs();
        if problem.is_periodic(number) {
            off.min(1.0 - off)
        } else {
            off
        }
    };
    (0..a.len()).map(off).fold(0.0, f64::max)
}

/// Points that are farther apart than this are distinct optima.
const APART: f64 = 0.01;

/// Returns the best of each neighbourhood, the best first.
pub(super) fn distinct(problem: &dyn Problem, mut all: Vec<Solution>) -> Vec<Solution> {
    all.sort_by(|a, b| a.value.total_cmp(&b.value));
    let mut kept: Vec<Solution> = Vec::new();
    for found in all {
        if kept
            .iter()
            .all(|other| apart(problem, &other.point, &found.point) > APART)
        {
            kept.push(found);
        }
    }
    kept
}
