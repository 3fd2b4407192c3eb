//! CMA-ES: evolution by a normal distribution whose covariance is adapted (Hansen, "The CMA Evolution Strategy: A
//! Tutorial", arXiv 1604.00772), restarted from other points with larger and larger populations. The covariance also
//! learns from the worse half of a generation (the tutorial's negative weights), and step and covariance adapt faster
//! than by the tutorial's Table 1, since places have few coordinates; `./ci.sh placement` measures this choice.

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
    /// Points of a generation of the first runs.
    pub population: usize,
}

impl Default for Cmaes {
    fn default() -> Self {
        Self {
            scattered: 16,
            sigma: 0.04,
            settled: 1e-8,
            starts: 24,
            population: 6,
        }
    }
}

impl Optimizer for Cmaes {
    fn name(&self) -> &'static str {
        "cmaes"
    }

    fn refines_internally(&self) -> bool {
        true
    }

    fn search(&self, problem: &dyn Problem, budget: &Budget<'_>, seed: u64) -> Vec<Solution> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let dimensions = problem.dimensions();
        let mut scattered = problem.initial_guesses();
        scattered.extend((0..self.scattered).map(|k| scatter(k, dimensions, &mut random)));
        let values = budget.values(problem, &scattered, Fidelity::Fine);
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
            found.push(self.run(problem, budget, &begin, larger, &mut random));
            begun.push(begin);
        }
        // A run may end at a worse point than its start.
        found.extend(seen.into_iter().take(1));
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
        let found = strategy.run(problem, budget, &self.from.point, 1, &mut random);
        let best = if found.value < self.from.value {
            found
        } else {
            self.from.clone()
        };
        std::vec![best]
    }
}

impl Cmaes {
    /// Runs the strategy once from a point. `larger` multiplies the population.
    fn run(
        &self,
        problem: &dyn Problem,
        budget: &Budget<'_>,
        begin: &[f64],
        larger: usize,
        random: &mut ChaCha8Rng,
    ) -> Solution {
        let mut evolution = Evolution::new(self, problem, begin, larger);
        for number in 1..=600_i32 {
            let generation = evolution.draw(budget, random);
            evolution.keep_best(&generation);
            if budget.left() == 0 {
                break;
            }
            evolution.adapt(&generation, number);
            if evolution.has_ended(&generation) {
                break;
            }
        }
        evolution.best
    }
}

/// The constants of a run.
struct Rates {
    of_n: f64,
    population: usize,
    /// The weights of the better half.
    weights: Vec<f64>,
    /// The weights of the worse half, none above 0.
    worse: Vec<f64>,
    effective: f64,
    c_sigma: f64,
    damping: f64,
    c_c: f64,
    c_1: f64,
    c_mu: f64,
    /// The usual length of a step of normally distributed numbers.
    usual: f64,
}

impl Rates {
    /// Returns the constants for a number of dimensions and the points of a generation.
    fn new(n: usize, population: usize) -> Self {
        let of_n = n as f64;
        let parents = population / 2;
        let raw = |i: usize| raw_weight(population, i);
        let sum: f64 = (0..parents).map(raw).sum();
        let weights: Vec<f64> = (0..parents).map(|i| raw(i) / sum).collect();
        let effective = 1.0 / weights.iter().map(|weight| weight * weight).sum::<f64>();
        // 3.0 and 0.25 instead of the table's 5.0 and 0.0: faster.
        let c_sigma = (effective + 2.0) / (of_n + effective + 3.0);
        let c_1 = 2.0 / ((of_n + 1.3) * (of_n + 1.3) + effective);
        let rates = Self {
            of_n,
            population,
            weights,
            worse: Vec::new(),
            effective,
            c_sigma,
            damping: 1.0
                + 2.0 * (libm::sqrt((effective - 1.0) / (of_n + 1.0)) - 1.0).max(0.0)
                + c_sigma,
            c_c: (4.0 + effective / of_n) / (of_n + 4.0 + 2.0 * effective / of_n),
            c_1,
            c_mu: (1.0 - c_1).min(
                2.0 * (0.25 + effective - 2.0 + 1.0 / effective)
                    / ((of_n + 2.0) * (of_n + 2.0) + effective),
            ),
            usual: libm::sqrt(of_n) * (1.0 - 1.0 / (4.0 * of_n) + 1.0 / (21.0 * of_n * of_n)),
        };
        Self {
            worse: rates.worse_weights(),
            ..rates
        }
    }

    /// Returns the weights of the worse half, with the tutorial's bounds.
    fn worse_weights(&self) -> Vec<f64> {
        let (population, effective) = (self.population, self.effective);
        let (of_n, c_1, c_mu) = (self.of_n, self.c_1, self.c_mu);
        let worse = population / 2..population;
        let raw = |i: usize| raw_weight(population, i);
        let below = |power: i32| -> f64 {
            let powers = worse.clone();
            powers
                .map(|i| libm::pow(raw(i).abs(), f64::from(power)))
                .sum()
        };
        let effective_below = below(1) * below(1) / below(2);
        let most = (1.0 + c_1 / c_mu)
            .min(1.0 + 2.0 * effective_below / (effective + 2.0))
            .min((1.0 - c_1 - c_mu) / (of_n * c_mu));
        worse
            .clone()
            .map(|i| most * raw(i).min(0.0) / below(1))
            .collect()
    }
}

/// Returns the weight of the point with a rank from 0, before the weights are scaled.
fn raw_weight(population: usize, rank: usize) -> f64 {
    libm::log(0.5 * (population as f64 + 1.0)) - libm::log(rank as f64 + 1.0)
}

/// The points of a generation.
struct Generation {
    /// The principal axes of the covariance, and the standard deviations along them.
    axes: DMatrix<f64>,
    lengths: DVector<f64>,
    /// The points as multiples of the step size from the mean.
    steps: Vec<DVector<f64>>,
    points: Vec<Vec<f64>>,
    values: Vec<f64>,
    /// The numbers of the points, the best first.
    order: Vec<usize>,
}

impl Generation {
    /// Returns the reciprocals of the standard deviations as a diagonal matrix.
    fn shrinking(&self) -> DMatrix<f64> {
        DMatrix::from_diagonal(&self.lengths.map(|length| 1.0 / length))
    }

    /// Yields weights with the steps of the points from a rank on.
    fn weighted<'g>(
        &'g self,
        weights: &'g [f64],
        first: usize,
    ) -> impl Iterator<Item = (f64, &'g DVector<f64>)> {
        let steps = self.order[first..].iter().map(|index| &self.steps[*index]);
        weights.iter().copied().zip(steps)
    }
}

/// The state of a run.
struct Evolution<'a> {
    problem: &'a dyn Problem,
    rates: Rates,
    /// See [`Cmaes::settled`].
    flat: f64,
    mean: DVector<f64>,
    sigma: f64,
    covariance: DMatrix<f64>,
    path_sigma: DVector<f64>,
    path_c: DVector<f64>,
    best: Solution,
    /// The number of generations with nearly equal values, without a break.
    settled: u32,
}

impl<'a> Evolution<'a> {
    /// Creates the state before the first generation.
    fn new(strategy: &Cmaes, problem: &'a dyn Problem, begin: &[f64], larger: usize) -> Self {
        let n = problem.dimensions();
        Self {
            problem,
            rates: Rates::new(n, strategy.population * larger),
            flat: strategy.settled,
            mean: DVector::from_column_slice(begin),
            sigma: strategy.sigma,
            covariance: DMatrix::identity(n, n),
            path_sigma: DVector::zeros(n),
            path_c: DVector::zeros(n),
            best: Solution {
                point: begin.to_vec(),
                value: f64::INFINITY,
            },
            settled: 0,
        }
    }

    /// Draws and evaluates the points of a generation.
    fn draw(&self, budget: &Budget<'_>, random: &mut ChaCha8Rng) -> Generation {
        let eigen = SymmetricEigen::new(self.covariance.clone());
        let lengths = eigen.eigenvalues.map(|value| libm::sqrt(value.max(1e-24)));
        let stretched = &eigen.eigenvectors * DMatrix::from_diagonal(&lengths);
        let (n, population) = (self.mean.len(), self.rates.population);
        let steps: Vec<DVector<f64>> = (0..population)
            .map(|_| {
                let drawn = DVector::from_fn(n, |_, _| random.sample::<f64, _>(StandardNormal));
                &stretched * drawn
            })
            .collect();
        let points: Vec<Vec<f64>> = steps
            .iter()
            .map(|step| folded(self.problem, (&self.mean + step * self.sigma).as_slice()))
            .collect();
        let values = budget.values(self.problem, &points, Fidelity::Fine);
        let mut order: Vec<usize> = (0..population).collect();
        order.sort_by(|a, b| values[*a].total_cmp(&values[*b]).then(a.cmp(b)));
        Generation {
            axes: eigen.eigenvectors,
            lengths,
            steps,
            points,
            values,
            order,
        }
    }

    /// Keeps the best point of a generation if it is better than all before.
    fn keep_best(&mut self, generation: &Generation) {
        let first = generation.order[0];
        if generation.values[first] < self.best.value {
            self.best = Solution {
                point: generation.points[first].clone(),
                value: generation.values[first],
            };
        }
    }

    /// Moves the mean, and adapts the paths, the covariance and the step size.
    fn adapt(&mut self, generation: &Generation, number: i32) {
        let mut step = DVector::<f64>::zeros(self.mean.len());
        for (weight, other) in generation.weighted(&self.rates.weights, 0) {
            step += other * weight;
        }
        self.mean += &step * self.sigma;
        let h = self.adapt_paths(generation, &step, number);
        self.adapt_covariance(generation, h);
        let longer = self.path_sigma.norm() / self.rates.usual - 1.0;
        self.sigma *= libm::exp((self.rates.c_sigma / self.rates.damping) * longer);
        self.sigma = self.sigma.min(1.0);
    }

    /// Adapts the paths to the mean's step. Returns 1, or 0 if the path of the step size is too long.
    fn adapt_paths(&mut self, generation: &Generation, step: &DVector<f64>, number: i32) -> f64 {
        let (of_n, effective, usual) = (self.rates.of_n, self.rates.effective, self.rates.usual);
        let (c_sigma, c_c) = (self.rates.c_sigma, self.rates.c_c);
        let axes = &generation.axes;
        let whitened = axes * generation.shrinking() * axes.transpose() * step;
        self.path_sigma = &self.path_sigma * (1.0 - c_sigma)
            + whitened * libm::sqrt(c_sigma * (2.0 - c_sigma) * effective);
        let length = self.path_sigma.norm();
        let fresh = libm::sqrt(1.0 - libm::pow(1.0 - c_sigma, 2.0 * f64::from(number)));
        let stalls = length / fresh < (1.4 + 2.0 / (of_n + 1.0)) * usual;
        let h = if stalls { 1.0 } else { 0.0 };
        self.path_c =
            &self.path_c * (1.0 - c_c) + step * (h * libm::sqrt(c_c * (2.0 - c_c) * effective));
        h
    }

    /// Adapts the covariance to its path and to the steps of a generation.
    fn adapt_covariance(&mut self, generation: &Generation, h: f64) {
        let (weights, worse) = (&self.rates.weights, &self.rates.worse);
        let (c_c, c_1, c_mu) = (self.rates.c_c, self.rates.c_1, self.rates.c_mu);
        let n = self.mean.len();
        let mut spread = DMatrix::<f64>::zeros(n, n);
        for (weight, step) in generation.weighted(weights, 0) {
            spread += step * step.transpose() * weight;
        }
        let whitening = generation.shrinking() * generation.axes.transpose();
        for (weight, step) in generation.weighted(worse, weights.len()) {
            // No longer than a usual step, so that the covariance remains positive definite.
            let whitened = &whitening * step;
            let scale = self.rates.of_n / whitened.norm_squared().max(f64::MIN_POSITIVE);
            spread += step * step.transpose() * (weight * scale);
        }
        let of_all: f64 = 1.0 + worse.iter().sum::<f64>();
        let kept = 1.0 - c_1 - c_mu * of_all + (1.0 - h) * c_1 * c_c * (2.0 - c_c);
        let covariance =
            &self.covariance * kept + &self.path_c * self.path_c.transpose() * c_1 + spread * c_mu;
        self.covariance = (&covariance + covariance.transpose()) * 0.5;
    }

    /// Returns `true` if the values of a generation are too similar to continue.
    fn has_ended(&mut self, generation: &Generation) -> bool {
        let Generation { order, values, .. } = generation;
        let (first, last) = (order[0], order[self.rates.weights.len().max(1) - 1]);
        let flat = values[last] - values[first] <= self.flat * values[first].abs();
        self.settled = if flat { self.settled + 1 } else { 0 };
        let widest = self.sigma * generation.lengths.max();
        self.settled >= 3 || !(widest >= 1e-9)
    }
}

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
