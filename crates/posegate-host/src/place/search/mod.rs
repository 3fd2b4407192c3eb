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

/// What is searched: a function on the unit cube, the same for the same point on every thread.
pub trait Problem: Sync {
    /// How many numbers a point has: at least one.
    fn dimensions(&self) -> usize;

    /// Whether a number goes round.
    fn is_periodic(&self, number: usize) -> bool;

    /// Points that are worth a look before all others; none, where nothing is known.
    fn initial_guesses(&self) -> Vec<Vec<f64>> {
        Vec::new()
    }

    /// The value of a point: the less the better. Infinite where there is none; not NaN.
    fn value(&self, point: &[f64], look: Fidelity) -> f64;
}

/// How closely a point is looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fidelity {
    /// Closely enough to tell where it goes downhill.
    Quick,
    /// As closely as the answer is.
    Fine,
}

/// A point and its value.
#[derive(Clone, Debug, PartialEq)]
pub struct Solution {
    /// In the unit cube.
    pub point: Vec<f64>,
    /// Its value.
    pub value: f64,
}

/// A search for the least value.
///
/// The answer depends on the problem, the budget and the seed alone, not on the number of threads.
pub trait Optimizer: Sync {
    /// Its name on the command line.
    fn name(&self) -> &'static str;

    /// Whether all of the budget goes to it: its answers need no polish.
    fn refines_internally(&self) -> bool {
        false
    }

    /// Looks for the least value with no more evaluations than the budget's. The answers are local optima, no two of them
    /// near each other, the best one first by a fine look; at least one.
    fn search(&self, problem: &dyn Problem, budget: &Budget<'_>, seed: u64) -> Vec<Solution>;
}

/// How often a function may be asked, and who is told.
pub struct Budget<'a> {
    most: u64,
    spent: AtomicU64,
    tell: &'a (dyn Fn(u64) + Sync),
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
    /// So many evaluations; `tell` hears of each batch that was made.
    pub const fn new(most: u64, tell: &'a (dyn Fn(u64) + Sync)) -> Self {
        Self {
            most,
            spent: AtomicU64::new(0),
            tell,
        }
    }

    /// How many were made.
    #[must_use]
    pub fn spent(&self) -> u64 {
        self.spent.load(Ordering::Relaxed)
    }

    /// How many are left.
    #[must_use]
    pub fn left(&self) -> u64 {
        self.most.saturating_sub(self.spent())
    }

    /// The values of points, in parallel; as many as the budget allows, the others are infinite.
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
        (self.tell)(count);
    }
}

/// The point of the unit cube that a free one stands for: numbers that go round are wrapped, others are mirrored at the
/// cube's sides.
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

/// How far apart two points are: the largest difference of a number.
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

/// Points that are told apart as optima of their own.
const APART: f64 = 0.01;

/// The best of each neighbourhood, the best first.
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
