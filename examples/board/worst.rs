//! A search for the pose-set that costs a decision most: half of the tries at random, half about the
//! dearest set so far.

use posegate::set::{Estimate, PoseSet, RadiusSquared};

/// Where estimates are sought: m, m, rad to either side.
pub const RANGE: [f64; 3] = [2.2, 2.2, 0.37];
const LARGEST: [f64; 3] = [0.5, 0.5, 0.25];

/// Numbers in [0, 1) that make a set: estimate, deviations, correlations, kind.
type Genes = [f64; 10];

/// The search.
pub struct Search {
    state: u64,
    genes: Genes,
    best: Genes,
    cost: u64,
}

impl Search {
    /// A search from a seed that is not zero.
    pub const fn new(seed: u64) -> Self {
        Self {
            state: seed,
            genes: [0.5; 10],
            best: [0.5; 10],
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

    /// The next set.
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
        let [x, y, yaw, a, b, c, xy, x_yaw, y_yaw, kind] = self.genes;
        let at = |gene: f64, range: f64| (2.0 * gene - 1.0) * range;
        let estimate = Estimate {
            x_m: at(x, RANGE[0]),
            y_m: at(y, RANGE[1]),
            yaw_rad: at(yaw, RANGE[2]),
        };
        // Down to a thousandth, evenly by magnitude.
        let size = |gene: f64, most: f64| {
            let halvings = 10.0 * gene;
            let whole = halvings as i32;
            let rest = halvings - f64::from(whole);
            most * (1.0 - 0.5 * rest) / f64::from(1u32 << whole)
        };
        let [dx, dy, dyaw] = [
            size(a, LARGEST[0]),
            size(b, LARGEST[1]),
            size(c, LARGEST[2]),
        ];
        if kind < 0.15 {
            return PoseSet::bounded(estimate, 3.0 * dx, 2.0 * dyaw).ok();
        }
        let [xy, x_yaw, y_yaw] = [xy, x_yaw, y_yaw].map(|gene| at(gene, 0.9));
        let (xy, x_yaw, y_yaw) = (xy * dx * dy, x_yaw * dx * dyaw, y_yaw * dy * dyaw);
        let covariance = [
            [dx * dx, xy, x_yaw],
            [xy, dy * dy, y_yaw],
            [x_yaw, y_yaw, dyaw * dyaw],
        ];
        PoseSet::gaussian(estimate, covariance, radius).ok()
    }

    /// Tells what the last set cost; whether it is the dearest.
    pub fn found(&mut self, cost: u64) -> bool {
        let dearer = cost > self.cost;
        if dearer {
            (self.cost, self.best) = (cost, self.genes);
        }
        dearer
    }

    /// What the dearest set cost.
    pub const fn cost(&self) -> u64 {
        self.cost
    }
}
