//! A local search for the minimum (mesh adaptive direct search; Audet and Dennis, SIAM J. Optim. 17(1), 2006). It
//! steps along random orthogonal axes. The step is longer if an axis helps, and is halved if none does. It needs no
//! gradient, and is valid at borders.

use super::{Budget, Fidelity, Optimizer, Problem, Solution, folded};
use nalgebra::DMatrix;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

/// The search's settings.
#[derive(Clone, Debug, PartialEq)]
pub struct Polish {
    /// The point at which the search begins.
    pub from: Solution,
    /// First step, as a share of the unit cube's edge.
    pub step: f64,
    /// Step at which the search ends, in the unit of `step`.
    pub smallest: f64,
}

impl Optimizer for Polish {
    fn name(&self) -> &'static str {
        "polish"
    }

    fn search(&self, problem: &dyn Problem, budget: &Budget<'_>, seed: u64) -> Vec<Solution> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let n = problem.dimensions();
        let mut best = self.from.clone();
        let mut step = self.step;
        let mut last: Option<Vec<f64>> = None;
        // The number of consecutive rounds in which no axis helped.
        let mut failed = 0;
        while step > self.smallest && budget.left() > 0 {
            let drawn = DMatrix::from_fn(n, n, |_, _| random.sample::<f64, _>(StandardNormal));
            let axes = drawn.qr().q();
            let mut directions: Vec<Vec<f64>> = Vec::with_capacity(2 * n + 1);
            for axis in axes.column_iter() {
                directions.push(axis.iter().map(|v| v * step).collect());
                directions.push(axis.iter().map(|v| -v * step).collect());
            }
            // The direction that helped last is tried again, twice as far.
            directions.extend(last.take());
            let points: Vec<Vec<f64>> = directions
                .iter()
                .map(|way| {
                    let free: Vec<f64> =
                        best.point.iter().zip(way).map(|(at, by)| at + by).collect();
                    folded(problem, &free)
                })
                .collect();
            let values = budget.values(problem, &points, Fidelity::Fine);
            let mut order: Vec<usize> = (0..values.len()).collect();
            order.sort_by(|a, b| values[*a].total_cmp(&values[*b]).then(a.cmp(b)));
            let first = order[0];
            if values[first] < best.value {
                best = Solution {
                    point: points[first].clone(),
                    value: values[first],
                };
                last = Some(directions[first].iter().map(|v| 2.0 * v).collect());
                step = (1.5 * step).min(self.step);
                failed = 0;
            } else {
                // Another set of axes is tried before the step is halved: at a corner few axes help.
                failed += 1;
                if failed % 2 == 0 {
                    step *= 0.5;
                }
            }
        }
        std::vec![best]
    }
}
