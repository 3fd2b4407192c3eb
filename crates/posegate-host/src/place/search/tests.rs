use super::*;

/// The sum of squares about a point, in a narrow valley, with a forbidden part.
struct Valley {
    at: Vec<f64>,
    round: bool,
    forbidden: f64,
}

impl Problem for Valley {
    fn dimensions(&self) -> usize {
        self.at.len()
    }

    fn is_periodic(&self, number: usize) -> bool {
        self.round && number == 0
    }

    fn value(&self, point: &[f64], _: Fidelity) -> f64 {
        assert!(point.iter().all(|v| (0.0..=1.0).contains(v)), "{point:?}");
        if point[1] < self.forbidden {
            return f64::INFINITY;
        }
        let off = |number: usize| {
            let off = (point[number] - self.at[number]).abs();
            if self.is_periodic(number) {
                off.min(1.0 - off)
            } else {
                off
            }
        };
        // A narrow valley: the coordinates are coupled.
        let all: Vec<f64> = (0..self.at.len()).map(off).collect();
        let first = all[0] + all[1];
        10.0 * first * first + all.iter().map(|v| v * v).sum::<f64>()
    }
}

fn optimizers() -> [&'static dyn Optimizer; 3] {
    const WIDE: Cmaes = Cmaes {
        scattered: 64,
        sigma: 0.15,
        settled: 1e-12,
        starts: 6,
        population: 8,
    };
    const CMAES: Cmaes = Cmaes {
        sigma: 0.04,
        population: 6,
        ..WIDE
    };
    const GENETIC: Genetic = Genetic {
        population: 50,
        patience: 12,
    };
    [&WIDE, &GENETIC, &CMAES]
}

#[test]
fn minimum_is_found() {
    let plain = Valley {
        at: vec![0.3, 0.8, 0.55],
        round: false,
        forbidden: -1.0,
    };
    let round = Valley {
        at: vec![0.999, 0.8, 0.55],
        round: true,
        forbidden: -1.0,
    };
    for problem in [plain, round] {
        for (optimizer, near) in optimizers().into_iter().zip([1e-4, 2e-2, 1e-4]) {
            let budget = Budget::new(5_000, &|_| ());
            let found = optimizer.search(&problem, &budget, 1);
            assert!(budget.spent() <= 5_000);
            let off = apart(&problem, &found[0].point, &problem.at);
            assert!(off < near, "{}: {found:?}", optimizer.name());
            assert_eq!(
                problem.value(&found[0].point, Fidelity::Fine),
                found[0].value
            );
        }
    }
}

#[test]
fn minimum_on_a_border_is_found() {
    // The least value is on the border of the forbidden part, at a side of the cube.
    let problem = Valley {
        at: vec![1.0, 0.2],
        round: false,
        forbidden: 0.5,
    };
    let budget = Budget::new(4_000, &|_| ());
    let rough = optimizers()[0].search(&problem, &budget, 3).remove(0);
    let polish = Polish {
        from: rough,
        step: 0.01,
        smallest: 1e-9,
    };
    let found = polish
        .search(&problem, &Budget::new(4_000, &|_| ()), 3)
        .remove(0);
    assert!(
        (found.point[0] - 1.0).abs() < 1e-6 && (found.point[1] - 0.5).abs() < 1e-6,
        "{found:?}"
    );
}

#[test]
fn answer_depends_only_on_the_seed() {
    let problem = Valley {
        at: vec![0.3, 0.8, 0.5],
        round: true,
        forbidden: 0.2,
    };
    for optimizer in optimizers() {
        let run = |threads: usize, seed: u64| {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .unwrap();
            pool.install(|| {
                let budget = Budget::new(1_000, &|_| ());
                let found = optimizer.search(&problem, &budget, seed);
                (found, budget.spent())
            })
        };
        assert_eq!(run(1, 7), run(3, 7), "{}", optimizer.name());
        assert_ne!(run(2, 7).0, run(2, 8).0, "{}", optimizer.name());
    }
}

#[test]
fn budget_is_not_exceeded() {
    let problem = Valley {
        at: vec![0.3, 0.8],
        round: false,
        forbidden: -1.0,
    };
    for optimizer in optimizers() {
        for most in [0, 1, 49, 50, 99, 333] {
            let reported = AtomicU64::new(0);
            let progress = |count: u64| {
                reported.fetch_add(count, Ordering::Relaxed);
            };
            let budget = Budget::new(most, &progress);
            let found = optimizer.search(&problem, &budget, 1);
            assert!(
                budget.spent() <= most + 1,
                "{} {most}: {}",
                optimizer.name(),
                budget.spent()
            );
            assert!(!found.is_empty());
            assert_eq!(reported.load(Ordering::Relaxed), budget.spent());
        }
    }
}
