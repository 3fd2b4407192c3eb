//! CMA-ES: evolution by a normal distribution whose covariance is adapted (Hansen, "The CMA Evolution Strategy: A
//! Tutorial", arXiv 1604.00772, the numbers of its Table 1), restarted from other points with larger and larger
//! populations.

use super::{Budget, Fidelity, Optimizer, Problem, Solution, apart, distinct, folded};
use nalgebra::{DMatrix, DVector, SymmetricEigen};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

/// The strategy's settings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cmaes {
    /// The number of points evaluated before the first start.
    pub scattered: u32,
    /// First standard deviation, as a share of the cube.
    pub sigma: f64,
    /// A run ends if the relative differences of its values are at most this.
    pub settled: f64,
    /// Largest number of starts.
    pub starts: u32,
    /// Points of a generation of the first runs; `None` derives it from the number of dimensions.
    pub population: Option<usize>,
    /// `true` if the covariance also learns from the worse half of a generation (the tutorial's negative weights), and
    /// step and covariance adapt faster than by the tutorial's table: for few evaluations.
    pub active: bool,
    /// `true` if the problem's initial guesses are evaluated first.
    pub hinted: bool,
    /// `true` if every start gets the same part of the budget, even if others end early.
    pub fair: bool,
    /// The fidelity of the first evaluations.
    pub look: Fidelity,
}

/// Smaller budgets are searched with [`Cmaes::LEAN`].
const FEW: u64 = 1_200;

impl Cmaes {
    /// For few evaluations: one run from the best of few points.
    pub const LEAN: Self = Self {
        scattered: 16,
        sigma: 0.04,
        settled: 1e-8,
        starts: 24,
        population: Some(6),
        active: true,
        hinted: true,
        fair: false,
        look: Fidelity::Fine,
    };

    /// Returns the settings for a budget.
    #[must_use]
    pub fn of_budget(evaluations: u64) -> Self {
        if evaluations < FEW {
            Self::LEAN
        } else {
            Self::default()
        }
    }
}

impl Default for Cmaes {
    fn default() -> Self {
        Self {
            scattered: 64,
            sigma: 0.06,
            settled: 1e-8,
            starts: 4,
            population: None,
            active: false,
            hinted: true,
            fair: true,
            look: Fidelity::Quick,
        }
    }
}

impl Optimizer for Cmaes {
    fn name(&self) -> &'static str {
        "cmaes"
    }

    fn refines_internally(&self) -> bool {
        self.look == Fidelity::Fine
    }

    fn search(&self, problem: &dyn Problem, budget: &Budget<'_>, seed: u64) -> Vec<Solution> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let dimensions = problem.dimensions();
        let mut scattered = if self.hinted {
            problem.initial_guesses()
        } else {
            Vec::new()
        };
        scattered.extend((0..self.scattered).map(|k| scatter(k, dimensions, &mut random)));
        let values = budget.values(problem, &scattered, self.look);
        let mut seen: Vec<Solution> = scattered
            .into_iter()
            .zip(values)
            .map(|(point, value)| Solution { point, value })
            .collect();
        seen.sort_by(|a, b| a.value.total_cmp(&b.value));
        let mut found: Vec<Solution> = Vec::new();
        let mut begun: Vec<Vec<f64>> = Vec::new();
        for start in 0..self.starts {
            if budget.left() == 0 {
                break;
            }
            // The best scattered point that is not near the start or the end of a run.
            let far = |one: &&Solution| {
                let ended = found.iter().map(|found| &found.point);
                let mut known = ended.chain(&begun);
                known.all(|other| apart(problem, &one.point, other) > self.sigma)
            };
            let begin = seen.iter().find(far).map_or_else(
                || (0..dimensions).map(|_| random.r#gen::<f64>()).collect(),
                |one| one.point.clone(),
            );
            let larger = 1 << (start / 6).min(4);
            let share = if self.fair {
                budget.left().div_ceil(u64::from(self.starts - start))
            } else {
                budget.left()
            };
            found.push(budget.with_part(share, |part| {
                self.run(problem, part, &begin, larger, self.look, &mut random)
            }));
            begun.push(begin);
        }
        // A run may end at a worse point than its start. Quick values are not comparable with fine ones.
        if found.is_empty() || self.look == Fidelity::Fine {
            found.extend(seen.into_iter().take(1));
        }
        distinct(problem, found)
    }
}

/// One run from a point that is known to be good.
#[derive(Clone, Debug, PartialEq)]
pub struct Descent {
    /// The point at which the search begins.
    pub from: Solution,
    /// First standard deviation, as a share of the unit cube's edge.
    pub sigma: f64,
}

impl Optimizer for Descent {
    fn name(&self) -> &'static str {
        "descent"
    }

    fn search(&self, problem: &dyn Problem, budget: &Budget<'_>, seed: u64) -> Vec<Solution> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let strategy = Cmaes {
            sigma: self.sigma,
            ..Cmaes::default()
        };
        let found = strategy.run(
            problem,
            budget,
            &self.from.point,
            1,
            Fidelity::Fine,
            &mut random,
        );
        let best = if found.value < self.from.value {
            found
        } else {
            self.from.clone()
        };
        std::vec![best]
    }
}

impl Cmaes {
    fn run(
        &self,
        problem: &dyn Problem,
        budget: &Budget<'_>,
        begin: &[f64],
        larger: usize,
        mut look: Fidelity,
        random: &mut ChaCha8Rng,
    ) -> Solution {
        let n = problem.dimensions();
        let of_n = n as f64;
        let usual_population = (4 + libm::floor(3.0 * libm::log(of_n)) as usize).max(6);
        let population = self.population.unwrap_or(usual_population) * larger;
        let parents = population / 2;
        let raw = |i: usize| libm::log(0.5 * (population as f64 + 1.0)) - libm::log(i as f64 + 1.0);
        let sum: f64 = (0..parents).map(raw).sum();
        let weights: Vec<f64> = (0..parents).map(|i| raw(i) / sum).collect();
        let effective = 1.0 / weights.iter().map(|weight| weight * weight).sum::<f64>();
        // With few evaluations the step adapts faster than by the table; `./ci.sh placement` measures this choice.
        let slower = if self.active { 3.0 } else { 5.0 };
        let c_sigma = (effective + 2.0) / (of_n + effective + slower);
        let damping =
            1.0 + 2.0 * (libm::sqrt((effective - 1.0) / (of_n + 1.0)) - 1.0).max(0.0) + c_sigma;
        let c_c = (4.0 + effective / of_n) / (of_n + 4.0 + 2.0 * effective / of_n);
        let c_1 = 2.0 / ((of_n + 1.3) * (of_n + 1.3) + effective);
        // For the same reason the covariance adapts faster.
        let quarter = if self.active { 0.25 } else { 0.0 };
        let c_mu = (1.0 - c_1).min(
            2.0 * (quarter + effective - 2.0 + 1.0 / effective)
                / ((of_n + 2.0) * (of_n + 2.0) + effective),
        );
        // The weights of the worse half, none above 0, with the tutorial's bounds.
        let worse: Vec<f64> = if self.active {
            let below = |power: i32| -> f64 {
                (parents..population)
                    .map(|i| libm::pow(raw(i).abs(), f64::from(power)))
                    .sum()
            };
            let effective_below = below(1) * below(1) / below(2);
            let most = (1.0 + c_1 / c_mu)
                .min(1.0 + 2.0 * effective_below / (effective + 2.0))
                .min((1.0 - c_1 - c_mu) / (of_n * c_mu));
            (parents..population)
                .map(|i| most * raw(i).min(0.0) / below(1))
                .collect()
        } else {
            Vec::new()
        };
        let of_all: f64 = 1.0 + worse.iter().sum::<f64>();
        let usual = libm::sqrt(of_n) * (1.0 - 1.0 / (4.0 * of_n) + 1.0 / (21.0 * of_n * of_n));

        let mut mean = DVector::from_column_slice(begin);
        let mut sigma = self.sigma;
        let mut covariance = DMatrix::<f64>::identity(n, n);
        let (mut path_sigma, mut path_c) = (DVector::<f64>::zeros(n), DVector::<f64>::zeros(n));
        let mut best = Solution {
            point: begin.to_vec(),
            value: f64::INFINITY,
        };
        let mut settled = 0;
        for generation in 1..=600_i32 {
            let eigen = SymmetricEigen::new(covariance.clone());
            let lengths = eigen.eigenvalues.map(|value| libm::sqrt(value.max(1e-24)));
            let stretched = &eigen.eigenvectors * DMatrix::from_diagonal(&lengths);
            let steps: Vec<DVector<f64>> = (0..population)
                .map(|_| {
                    let drawn = DVector::from_fn(n, |_, _| random.sample::<f64, _>(StandardNormal));
                    &stretched * drawn
                })
                .collect();
            let points: Vec<Vec<f64>> = steps
                .iter()
                .map(|step| folded(problem, (&mean + step * sigma).as_slice()))
                .collect();
            let values = budget.values(problem, &points, look);
            let mut order: Vec<usize> = (0..population).collect();
            order.sort_by(|a, b| values[*a].total_cmp(&values[*b]).then(a.cmp(b)));
            let (first, last) = (order[0], order[parents.max(1) - 1]);
            if values[first] < best.value {
                best = Solution {
                    point: points[first].clone(),
                    value: values[first],
                };
            }
            if budget.left() == 0 {
                break;
            }
            let mut step = DVector::<f64>::zeros(n);
            for (weight, index) in weights.iter().zip(&order) {
                step += &steps[*index] * *weight;
            }
            mean += &step * sigma;
            let shrunk = lengths.map(|length| 1.0 / length);
            let whitened = &eigen.eigenvectors
                * DMatrix::from_diagonal(&shrunk)
                * eigen.eigenvectors.transpose()
                * &step;
            path_sigma = path_sigma * (1.0 - c_sigma)
                + whitened * libm::sqrt(c_sigma * (2.0 - c_sigma) * effective);
            let length = path_sigma.norm();
            let fresh = libm::sqrt(1.0 - libm::pow(1.0 - c_sigma, 2.0 * f64::from(generation)));
            let stalls = length / fresh < (1.4 + 2.0 / (of_n + 1.0)) * usual;
            let h = if stalls { 1.0 } else { 0.0 };
            path_c = path_c * (1.0 - c_c) + &step * (h * libm::sqrt(c_c * (2.0 - c_c) * effective));
            let mut spread = DMatrix::<f64>::zeros(n, n);
            for (weight, index) in weights.iter().zip(&order) {
                spread += &steps[*index] * steps[*index].transpose() * *weight;
            }
            for (weight, index) in worse.iter().zip(&order[parents..]) {
                // No longer than a usual step, so that the covariance remains positive definite.
                let whitened = DMatrix::from_diagonal(&shrunk)
                    * eigen.eigenvectors.transpose()
                    * &steps[*index];
                let scale = of_n / whitened.norm_squared().max(f64::MIN_POSITIVE);
                spread += &steps[*index] * steps[*index].transpose() * (*weight * scale);
            }
            covariance = covariance
                * (1.0 - c_1 - c_mu * of_all + (1.0 - h) * c_1 * c_c * (2.0 - c_c))
                + &path_c * path_c.transpose() * c_1
                + spread * c_mu;
            covariance = (&covariance + covariance.transpose()) * 0.5;
            sigma *= libm::exp((c_sigma / damping) * (length / usual - 1.0));
            sigma = sigma.min(1.0);
            let flat = values[last] - values[first] <= self.settled * values[first].abs();
            settled = if flat { settled + 1 } else { 0 };
            let widest = sigma * lengths.max();
            match look {
                // Quick values no longer resolve the differences: continue with fine ones, from a slightly larger
                // spread.
                Fidelity::Quick if settled >= 2 || widest < QUICK => {
                    look = Fidelity::Fine;
                    settled = 0;
                    sigma *= 2.0;
                    best.value = f64::INFINITY;
                }
                Fidelity::Fine if settled >= 3 || !(widest >= 1e-9) => break,
                _ => {}
            }
        }
        if look == Fidelity::Quick {
            best.value =
                budget.values(problem, core::slice::from_ref(&best.point), Fidelity::Fine)[0];
        }
        best
    }
}

/// A run continues with fine evaluations if its widest standard deviation, as a share of the cube, is below this.
const QUICK: f64 = 3e-3;

/// Returns a point of an evenly spread sequence: Halton's, shifted at random.
fn scatter(index: u32, dimensions: usize, random: &mut ChaCha8Rng) -> Vec<f64> {
    const PRIMES: [u32; 6] = [2, 3, 5, 7, 11, 13];
    (0..dimensions)
        .map(|axis| {
            let base = PRIMES[axis % PRIMES.len()];
            let (mut k, mut share, mut place) = (index + 1, 1.0, 0.0);
            while k > 0 {
                share /= f64::from(base);
                place += share * f64::from(k % base);
                k /= base;
            }
            let moved = place + 1e-3 * random.r#gen::<f64>();
            moved - libm::floor(moved)
        })
        .collect()
}
