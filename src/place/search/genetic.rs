//! The paper's own way: a genetic algorithm.

use super::{Budget, Found, Look, Optimizer, Problem, distinct, folded};
use genetic_algorithm::strategy::evolve::prelude::*;
use std::vec::Vec;

/// A genetic algorithm's settings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Genetic {
    /// Points of a generation.
    pub population: u32,
    /// Generations without anything better before steps get smaller.
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

/// Points of a generation that may be looked at, in populations: parents that are changed count, too.
const OFFSPRING: u64 = 4;

/// Sizes of mutations, one after the other.
const STEPS: [f64; 5] = [0.2, 0.05, 0.01, 0.002, 0.0004];

/// What is asked of a chromosome.
#[derive(Clone, Copy)]
struct Ask<'a> {
    problem: &'a dyn Problem,
    budget: &'a Budget<'a>,
}

impl core::fmt::Debug for Ask<'_> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("Ask")
    }
}

/// A whole number in the order of a float: the float's own bits, turned round below zero.
fn in_order(value: f64) -> isize {
    let bits = value.to_bits() as i64;
    let ordered = if bits < 0 {
        i64::MIN.wrapping_sub(bits)
    } else {
        bits
    };
    ordered as isize
}

impl Fitness for Ask<'_> {
    type Genotype = RangeGenotype<f64>;

    fn calculate_for_chromosome(
        &mut self,
        chromosome: &FitnessChromosome<Self>,
        _: &FitnessGenotype<Self>,
    ) -> Option<FitnessValue> {
        self.budget.spend(1);
        let value = self
            .problem
            .value(&folded(self.problem, &chromosome.genes), Look::Quick);
        value.is_finite().then(|| in_order(value))
    }
}

impl Optimizer for Genetic {
    fn name(&self) -> &'static str {
        "ga"
    }

    fn search(&self, problem: &dyn Problem, budget: &Budget<'_>, seed: u64) -> Vec<Found> {
        let middle = Found {
            point: std::vec![0.5; problem.dimensions()],
            value: f64::INFINITY,
        };
        let generations = budget.left() / (OFFSPRING * u64::from(self.population));
        let Some(generations) = generations.checked_sub(1).filter(|count| *count > 0) else {
            return std::vec![middle];
        };
        let genotype = RangeGenotype::<f64>::builder()
            .with_genes_size(problem.dimensions())
            .with_allele_range(0.0..=1.0)
            .with_mutation_type(MutationType::StepScaled(STEPS.to_vec()))
            .build();
        let Ok(genotype) = genotype else {
            return std::vec![middle];
        };
        let evolved = Evolve::builder()
            .with_genotype(genotype)
            .with_target_population_size(self.population as usize)
            .with_max_stale_generations(self.patience as usize)
            .with_max_generations(usize::try_from(generations).unwrap_or(usize::MAX))
            .with_fitness(Ask { problem, budget })
            .with_fitness_ordering(FitnessOrdering::Minimize)
            .with_par_fitness(true)
            .with_mutate(MutateMultiGene::new(2, 0.3))
            .with_crossover(CrossoverUniform::new(0.7, 0.8))
            .with_select(SelectTournament::new(0.5, 0.05, 4))
            .with_rng_seed_from_u64(seed)
            .call();
        let best = evolved.ok().and_then(|evolved| evolved.best_genes());
        let point = best.map_or(middle.point, |genes| folded(problem, &genes));
        let value = budget.values(problem, core::slice::from_ref(&point), Look::Fine)[0];
        distinct(problem, std::vec![Found { point, value }])
    }
}
