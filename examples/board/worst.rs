//! A search for the pose-set with the most expensive decision: half of the tries are random, half are near
//! the most expensive set so far.

use posegate::report::PoseEstimate;
use posegate::set::{Estimate, PoseSet, RadiusSquared, Uncertainty};

/// Range of the estimates about a table's goal, to either side, and largest deviations: m, m, rad.
#[derive(Clone, Copy)]
pub struct Bounds {
    pub range: [f64; 3],
    pub largest: [f64; 3],
}

/// Numbers in [0, 1) that define a set: estimate, deviations, correlations, kind.
pub type Genes = [f64; 10];

/// Every gene in the middle of its range.
pub const MIDDLE: Genes = [0.5; 10];

/// The search.
pub struct Search {
    goal: Estimate,
    bounds: Bounds,
    state: u64,
    genes: Genes,
    best: Genes,
    cost: u64,
}

impl Search {
    /// Creates a search from a nonzero seed; tries near `best` until a more expensive set is found.
    pub const fn new(seed: u64, goal: Estimate, bounds: Bounds, best: Genes) -> Self {
        Self {
            goal,
            bounds,
            state: seed,
            genes: best,
            best,
            cost: 0,
        }
    }

    fn unit(&mut self) -> f64 {
        // xorshift64*
        self.state ^= self.state >> 12;
        self.state ^= self.state << 25;
        self.state ^= self.state >> 27;
        let bits = self.state.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 11;
        bits as f64 / 9_007_199_254_740_992.0
    }

    /// Returns the next set.
    pub fn next(&mut self, about_the_best: bool, radius: RadiusSquared) -> Option<PoseSet> {
        let step = if self.unit() < 0.5 { 0.01 } else { 0.1 };
        for i in 0..self.genes.len() {
            let fresh = self.unit();
            self.genes[i] = if about_the_best {
                (self.best[i] + step * (fresh - 0.5)).clamp(0.0, 1.0)
            } else {
                fresh
            };
        }
        self.set(radius)
    }

    /// Returns the set of the genes.
    fn set(&self, radius: RadiusSquared) -> Option<PoseSet> {
        // As the measured functions do, not through a report, so that they are compiled as a firmware has them.
        match self.genes() {
            (at, Uncertainty::Gaussian(covariance)) => {
                PoseSet::gaussian(at, covariance, radius).ok()
            }
            (
                at,
                Uncertainty::Bounded {
                    translation_m,
                    yaw_rad,
                },
            ) => PoseSet::bounded(at, translation_m, yaw_rad).ok(),
        }
    }

    /// Returns the estimate of the genes, as a report has it.
    pub fn belief(&self) -> PoseEstimate {
        let (estimate, spread) = self.genes();
        PoseEstimate::new(estimate, spread)
    }

    /// Returns the estimate and the spread of the genes.
    fn genes(&self) -> (Estimate, Uncertainty) {
        let [x, y, yaw, a, b, c, xy, x_yaw, y_yaw, kind] = self.genes;
        let at = |gene: f64, range: f64| (2.0 * gene - 1.0) * range;
        let Bounds { range, largest } = self.bounds;
        let estimate = Estimate {
            x_m: self.goal.x_m + at(x, range[0]),
            y_m: self.goal.y_m + at(y, range[1]),
            yaw_rad: self.goal.yaw_rad + at(yaw, range[2]),
        };
        let [dx, dy, dyaw] = [
            size(a) * largest[0],
            size(b) * largest[1],
            size(c) * largest[2],
        ];
        if kind < 0.15 {
            let wide = Uncertainty::Bounded {
                translation_m: 3.0 * dx,
                yaw_rad: 2.0 * dyaw,
            };
            return (estimate, wide);
        }
        let [xy, x_yaw, y_yaw] = [xy, x_yaw, y_yaw].map(|gene| at(gene, 0.9));
        let (xy, x_yaw, y_yaw) = (xy * dx * dy, x_yaw * dx * dyaw, y_yaw * dy * dyaw);
        let covariance = [
            [dx * dx, xy, x_yaw],
            [xy, dy * dy, y_yaw],
            [x_yaw, y_yaw, dyaw * dyaw],
        ];
        (estimate, Uncertainty::Gaussian(covariance))
    }

    /// Returns the last set, enlarged as far as it stays inside: bisects a range of factors ten times.
    pub fn fitted(
        &mut self,
        radius: RadiusSquared,
        mut is_inside: impl FnMut(&PoseSet) -> bool,
    ) -> Option<PoseSet> {
        let genes = self.genes;
        // Genes that enlarge the deviations: a tenth doubles them.
        let (mut inside, mut outside) = (-0.4, 0.4);
        for _ in 0..10 {
            let more = 0.5 * (inside + outside);
            self.grow(genes, more);
            if self.set(radius).is_some_and(|set| is_inside(&set)) {
                inside = more;
            } else {
                outside = more;
            }
        }
        self.grow(genes, inside);
        self.set(radius)
    }

    fn grow(&mut self, genes: Genes, more: f64) {
        for (gene, before) in self.genes.iter_mut().zip(genes).skip(3).take(3) {
            *gene = (before - more).clamp(0.0, 1.0);
        }
    }

    /// Reports the cost of the last set; returns `true` if it is the most expensive.
    pub fn found(&mut self, cost: u64) -> bool {
        let is_highest = cost > self.cost;
        if is_highest {
            (self.cost, self.best) = (cost, self.genes);
        }
        is_highest
    }

    /// Returns the most expensive set.
    pub fn most_expensive(&mut self, radius: RadiusSquared) -> Option<PoseSet> {
        self.genes = self.best;
        self.set(radius)
    }

    /// Returns the cost of the most expensive set.
    pub const fn cost(&self) -> u64 {
        self.cost
    }
}

/// Returns a gene's share of the largest deviation: from 1 down to a thousandth, logarithmically.
fn size(gene: f64) -> f64 {
    let halvings = 10.0 * gene;
    let whole = halvings as i32;
    let rest = halvings - f64::from(whole);
    (1.0 - 0.5 * rest) / f64::from(1u32 << whole)
}
