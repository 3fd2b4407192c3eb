//! A genetic algorithm, the paper's optimizer: tournaments, uniform crossover, and normally distributed mutations of
//! decreasing size.

use super::{Budget, Fidelity, Optimizer, Problem, Solution};
use rand::{Rng, SeedableRng, seq::SliceRandom};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

/// A genetic algorithm's settings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Genetic {
    /// Points of a generation, at least two.
    pub population: u32,
    /// Generations without a better point before mutations get smaller.
    pub patience: u32,
}

impl Default for Genetic {
    /// A population like that of Matlab's `ga` for so few numbers.
    fn default() -> Self {
        Self {
            population: 50,
            patience: 12,
        }
    }
}

/// Children of a generation, as a share of the population.
const CHILDREN: f64 = 0.7;
/// Best points that always survive, as a share of the population.
const ELITE: f64 = 0.05;
/// Points of a tournament: the best of them wins.
const TOURNAMENT: usize = 4;
/// Probability that two parents exchange coordinates.
const CROSSOVER: f64 = 0.8;
/// Probability that a child is mutated.
const MUTATION: f64 = 0.3;
/// Coordinates that a mutation changes.
const MUTATED: usize = 2;
/// Standard deviations of a mutation, one after the other.
const STEPS: [f64; 5] = [0.2, 0.05, 0.01, 0.002, 0.0004];

impl Optimizer for Genetic {
    fn name(&self) -> &'static str {
        "ga"
    }

    fn search(&self, problem: &dyn Problem, budget: &Budget<'_>, seed: u64) -> Vec<Solution> {
        let size = self.population.max(2) as usize;
        let children = share(CHILDREN, size).next_multiple_of(2);
        // Reserves one evaluation for the fine look at the best point.
        if budget.left() <= size as u64 {
            return std::vec![Solution {
                point: std::vec![0.5; problem.dimensions()],
                value: f64::INFINITY,
            }];
        }
        let mut evolution = Evolution::new(problem, budget, size, seed);
        for (step, steps_left) in STEPS.into_iter().zip((1..=STEPS.len() as u64).rev()) {
            // Each step may use an equal share of the evaluations that its predecessors left.
            let end = budget.left() - budget.left() / steps_left;
            let mut stale = 0;
            while stale < self.patience && budget.left() > end + children as u64 {
                stale = if evolution.advance(children, step) {
                    0
                } else {
                    stale + 1
                };
            }
        }
        let point = evolution.population.swap_remove(0).point;
        let value = budget.values(problem, core::slice::from_ref(&point), Fidelity::Fine)[0];
        std::vec![Solution { point, value }]
    }
}

/// Returns a share of a count, rounded up.
fn share(share: f64, of: usize) -> usize {
    libm::ceil(share * of as f64) as usize
}

/// A population that evolves. Random numbers are drawn on one thread, so the result does not depend on the number of threads.
struct Evolution<'a> {
    problem: &'a dyn Problem,
    budget: &'a Budget<'a>,
    random: ChaCha8Rng,
    /// The best point first.
    population: Vec<Solution>,
}

impl<'a> Evolution<'a> {
    /// Draws a population at random.
    fn new(problem: &'a dyn Problem, budget: &'a Budget<'a>, size: usize, seed: u64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut point = || {
            (0..problem.dimensions())
                .map(|_| random.r#gen::<f64>())
                .collect()
        };
        let points = (0..size).map(|_| point()).collect();
        let mut population = evaluated(problem, budget, points);
        sort(&mut population);
        Self {
            problem,
            budget,
            random,
            population,
        }
    }

    /// Replaces the population by the next generation. Returns `true` if its best point is better than before.
    fn advance(&mut self, children: usize, step: f64) -> bool {
        let (size, before) = (self.population.len(), self.population[0].value);
        let points = (0..children / 2).flat_map(|_| self.pair(step)).collect();
        let mut all = core::mem::take(&mut self.population);
        all.extend(evaluated(self.problem, self.budget, points));
        sort(&mut all);
        let mut others = all.split_off(share(ELITE, size));
        let mut survivors = all;
        while survivors.len() < size {
            let winner = self.tournament(others.len());
            survivors.push(others.remove(winner));
        }
        sort(&mut survivors);
        self.population = survivors;
        self.population[0].value < before
    }

    /// Returns the winner of a tournament between random places of a sorted list.
    fn tournament(&mut self, length: usize) -> usize {
        (0..TOURNAMENT)
            .map(|_| self.random.gen_range(0..length))
            .min()
            .unwrap_or(0)
    }

    /// Returns two children of the winners of two tournaments.
    fn pair(&mut self, step: f64) -> [Vec<f64>; 2] {
        let length = self.population.len();
        let mut pair = [(); 2].map(|()| {
            let parent = self.tournament(length);
            self.population[parent].point.clone()
        });
        let is_crossed = self.random.gen_bool(CROSSOVER);
        if is_crossed {
            let [one, other] = &mut pair;
            for (a, b) in one.iter_mut().zip(other) {
                if self.random.r#gen() {
                    core::mem::swap(a, b);
                }
            }
        }
        for child in &mut pair {
            // A copy of a parent would waste an evaluation.
            if !is_crossed || self.random.gen_bool(MUTATION) {
                self.mutate(child, step);
            }
        }
        pair
    }

    /// Moves coordinates by a normally distributed number of steps, within the unit cube.
    fn mutate(&mut self, point: &mut [f64], step: f64) {
        let mut numbers: Vec<usize> = (0..point.len()).collect();
        let (chosen, _) = numbers.partial_shuffle(&mut self.random, MUTATED);
        for &mut number in chosen {
            let moved = point[number] + step * self.random.sample::<f64, _>(StandardNormal);
            point[number] = if self.problem.is_periodic(number) {
                moved - libm::floor(moved)
            } else {
                moved.clamp(0.0, 1.0)
            };
        }
    }
}

fn evaluated(problem: &dyn Problem, budget: &Budget<'_>, points: Vec<Vec<f64>>) -> Vec<Solution> {
    let values = budget.values(problem, &points, Fidelity::Quick);
    points
        .into_iter()
        .zip(values)
        .map(|(point, value)| Solution { point, value })
        .collect()
}

fn sort(points: &mut [Solution]) {
    points.sort_by(|a, b| a.value.total_cmp(&b.value));
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The distance from a corner; periodic in the first coordinate.
    struct Corner;

    impl Problem for Corner {
        fn dimensions(&self) -> usize {
            3
        }

        fn is_periodic(&self, number: usize) -> bool {
            number == 0
        }

        fn value(&self, point: &[f64], _: Fidelity) -> f64 {
            point.iter().sum()
        }
    }

    #[test]
    fn children_are_in_the_unit_cube_and_the_best_point_survives() {
        let budget = Budget::new(100_000, &|_| ());
        let mut evolution = Evolution::new(&Corner, &budget, 20, 5);
        for generation in 0..200 {
            let before = evolution.population[0].value;
            let is_better = evolution.advance(14, STEPS[generation % STEPS.len()]);
            let population = &evolution.population;
            assert_eq!(population.len(), 20);
            assert_eq!(is_better, population[0].value < before);
            assert!(population[0].value <= before);
            assert!(population.is_sorted_by_key(|found| found.value));
            let mut numbers = population.iter().flat_map(|found| &found.point);
            assert!(numbers.all(|number| (0.0..=1.0).contains(number)));
        }
        // 20 at first, and 14 children each.
        assert_eq!(budget.spent(), 20 + 200 * 14);
        assert!(evolution.population[0].value < 1e-3);
    }

    #[test]
    fn small_budget_gives_one_point_and_large_one_ends_early() {
        let genetic = Genetic {
            population: 10,
            patience: 3,
        };
        for most in [0, 10, 11, 12, 30, 100] {
            let budget = Budget::new(most, &|_| ());
            let found = genetic.search(&Corner, &budget, 1);
            assert_eq!(found.len(), 1);
            assert_eq!(found[0].value.is_finite(), most > 10, "{most}");
            assert!(budget.spent() <= most);
        }
        let budget = Budget::new(u64::MAX, &|_| ());
        let found = genetic.search(&Corner, &budget, 1);
        assert!(found[0].value < 0.01 && budget.spent() < 5_000);
    }
}
