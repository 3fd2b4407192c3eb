//! Counts the instructions of a decision on a Cortex-M4F, in QEMU.
//!
//! ```text
//! cargo run -p posegate --profile firmware --target thumbv7em-none-eabihf --features firmware --example count_instructions
//! ```
//!
//! which the runner in `.cargo/config.toml` turns into
//!
//! ```text
//! qemu-system-arm -M mps2-an386 -icount shift=6 -display none -monitor none -serial stdio -semihosting-config enable=on,target=native -kernel target/thumbv7em-none-eabihf/firmware/examples/count_instructions
//! ```
//!
//! Prints one JSON line per figure; ends with exit code 1 if a figure cannot be trusted. Instructions, not cycles: QEMU
//! models no wait states and no caches. The figures depend on the compiler.
//!
//! With `-icount shift=6` an instruction takes 64 ns, 1.6 ticks of the 25 MHz system timer. The program measures that
//! ratio itself on a loop of known length, and subtracts the cost of measuring.
#![cfg_attr(target_os = "none", no_std, no_main)]

/// Firmware has no meaning on a host; this lets `cargo test --all-features` build there.
#[cfg(not(target_os = "none"))]
fn main() {}

#[cfg(target_os = "none")]
mod board;

#[cfg(target_os = "none")]
#[path = "board/emulated.rs"]
mod emulated;

#[cfg(target_os = "none")]
#[path = "../crates/posegate-testkit/src/looks.rs"]
mod looks;

#[cfg(target_os = "none")]
#[path = "../benches/naive_grid.rs"]
mod naive_grid;

#[cfg(target_os = "none")]
mod firmware {
    use crate::board::counter::{Counter, Failure, M4F, goal, spin};
    use crate::board::stack::used_by;
    use crate::board::worst::{Bounds, Genes, MIDDLE, Search};
    use crate::emulated::run;
    use crate::looks::{self, LOOKS, Looks, added};
    use crate::naive_grid::BitGrid;
    use core::f64::consts::PI;
    use core::hint::black_box;
    use cortex_m_rt::entry;
    use posegate::contain::{self, Cause, Decision, Examination, Margin, second};
    use posegate::pose::Pose;
    use posegate::report::PoseEstimate;
    use posegate::set::{Estimate, Growth, InputError, PoseSet, RadiusSquared, Trust, Uncertainty};
    use posegate::sight::{Scene, Sighting, TagVisibility};
    use posegate::table::{Table, WorstCase};

    static DOCK: &[u8] = include_bytes!("tables/dock.posegate");
    static SEE_T7: &[u8] = include_bytes!("tables/see-t7.posegate");
    static SEE_T7_GRID: &[u8] = include_bytes!("tables/see-t7-grid.posegate");
    /// Facets in several pieces: the task `see-bay` of `sites/loading-bay.toml`, and a corner that a robot passes.
    static SEE_BAY: &[u8] = include_bytes!("../tests/data/see-bay.posegate");
    static CORNER: &[u8] = include_bytes!("../tests/data/corner.posegate");
    /// Cells of the whole circle.
    static WHOLE_CIRCLE: &[u8] = include_bytes!("../tests/data/whole-circle.posegate");

    /// Iterations of a loop that checks the whole measurement, and the allowed cost of its call.
    const KNOWN_TURNS: u32 = 400;
    const CALL: u32 = if M4F { 8 } else { 14 };

    /// A Gaussian estimate: deviations in m, m, deg; correlations xy, x-yaw, y-yaw.
    struct Gaussian {
        estimate: Estimate,
        covariance: [[f64; 3]; 3],
    }

    impl Gaussian {
        const fn new(x_m: f64, [x, y, yaw_deg]: [f64; 3], [xy, x_yaw, y_yaw]: [f64; 3]) -> Self {
            let yaw = yaw_deg * PI / 180.0;
            let (xy, x_yaw, y_yaw) = (xy * x * y, x_yaw * x * yaw, y_yaw * y * yaw);
            Self {
                estimate: Estimate {
                    x_m,
                    y_m: 0.0,
                    yaw_rad: 0.0,
                },
                covariance: [
                    [x * x, xy, x_yaw],
                    [xy, y * y, y_yaw],
                    [x_yaw, y_yaw, yaw * yaw],
                ],
            }
        }
    }

    const CORRELATIONS: [f64; 3] = [0.3, 0.2, 0.4];
    static LARGE: Gaussian = Gaussian::new(0.0, [0.2, 0.2, 0.5], CORRELATIONS);
    static SMALL: Gaussian = Gaussian::new(0.0, [0.01, 0.01, 0.2], CORRELATIONS);
    /// So far back that a part of the set does not see the tag.
    static EDGE: Gaussian = Gaussian::new(-1.2, [0.2, 0.2, 0.5], CORRELATIONS);
    const WIDE_TRANSLATION_M: f64 = 0.1;
    const WIDE_YAW_RAD: f64 = 2.0 * PI / 180.0;

    // Measured functions. Not inlined, so that each call is a real call.

    #[inline(never)]
    fn convert(from: &Gaussian, radius: RadiusSquared) -> Result<PoseSet, InputError> {
        PoseSet::gaussian(from.estimate, from.covariance, radius)
    }

    #[inline(never)]
    fn convert_bounded(from: &Estimate) -> Result<PoseSet, InputError> {
        PoseSet::bounded(
            *from,
            black_box(WIDE_TRANSLATION_M),
            black_box(WIDE_YAW_RAD),
        )
    }

    #[inline(never)]
    fn decide(table: &Table<'_>, set: &PoseSet) -> Decision {
        contain::decide(table, set)
    }

    #[inline(never)]
    fn decide_with_margin(table: &Table<'_>, set: &PoseSet) -> (Decision, Margin) {
        contain::decide_with_margin(table, set)
    }

    #[inline(never)]
    fn examine(table: &Table<'_>, set: &PoseSet) -> Examination {
        contain::examine(table, set)
    }

    #[inline(never)]
    fn look(scene: &Scene, pose: &Pose) -> Sighting {
        scene.look(pose)
    }

    #[inline(never)]
    fn contains_naively(grid: &BitGrid<'_>, set: &Naive) -> bool {
        grid.contains(set.mean, &set.information, set.reach, set.r2)
    }

    /// A Gaussian set in the naive grid's form: everything is prepared before the count.
    struct Naive {
        mean: [f32; 3],
        information: [[f32; 3]; 3],
        reach: [f32; 3],
        r2: f32,
    }

    impl Naive {
        fn of(from: &Gaussian, radius: RadiusSquared) -> Option<Self> {
            let covariance = nalgebra::Matrix3::from_fn(|i, j| from.covariance[i][j]);
            let inverse = covariance.try_inverse()?;
            let r2 = f64::from(radius.q16()) / 65536.0;
            let Estimate { x_m, y_m, yaw_rad } = from.estimate;
            let number = |i: usize, j: usize| inverse[(i, j)] as f32;
            Some(Self {
                mean: [x_m, y_m, yaw_rad].map(|v| v as f32),
                information: [0, 1, 2].map(|i| [0, 1, 2].map(|j| number(i, j))),
                reach: [0, 1, 2]
                    .map(|i| nalgebra::ComplexField::sqrt(r2 * from.covariance[i][i]) as f32),
                r2: r2 as f32,
            })
        }
    }

    /// Bits of the naive grid: 200 x 200 x 40 cells.
    static mut BITS: [u8; 200_000] = [0; 200_000];

    /// Number of sets tried for the most expensive decision. For facets the search is free. For cells it starts at the
    /// most expensive sets that a long search on an M4F has found (2,000 sets from each of eight seeds).
    const TRIES: u32 = 12_000;
    const TRIES_OF_CELLS: u32 = 60;
    /// For cells, one set in this many is made as large as the table permits, because the walk over a set that is
    /// outside stops early.
    const FITTED: u32 = 3;
    const DEAR_SEE_T7_GRID: Genes = [
        0.453766, 0.539741, 0.431277, 0.024601, 0.014985, 0.164541, 0.554702, 0.520781, 0.305119,
        0.770215,
    ];
    const DEAR_WHOLE_CIRCLE: Genes = [
        0.335759, 0.363156, 0.468712, 0.004586, 0.000000, 0.000000, 0.015874, 0.626499, 0.409079,
        0.925321,
    ];
    /// Bounds of the search.
    const ABOUT: Bounds = Bounds {
        range: [2.8, 2.2, 0.42],
        largest: [0.5, 0.5, 0.25],
    };
    const EVERY_HEADING: Bounds = Bounds {
        range: [1.1, 1.1, PI],
        largest: [0.2, 0.2, 1.6],
    };

    fn goal_of(table: &Table<'_>) -> Estimate {
        let goal_pose = table.goal().pose;
        Estimate {
            x_m: f64::from(goal_pose.x_um) * 1e-6,
            y_m: f64::from(goal_pose.y_um) * 1e-6,
            yaw_rad: f64::from(goal_pose.yaw.signed()) * (PI / 2_147_483_648.0),
        }
    }

    /// Prints the cost of the most expensive decision that a search finds, and the bound that the table gives.
    fn worst(
        counter: &mut Counter,
        name: &str,
        table: &Table<'_>,
        (bounds, dear): (Bounds, Genes),
        tries: u32,
    ) -> Result<(), Failure> {
        let mut search = Search::new(0x9e37_79b9_7f4a_7c15, goal_of(table), bounds, dear);
        let by_facets = table.grid().is_none();
        let mut deepest = 0;
        // The movement of the most expensive set so far.
        let mut best_movement = 0;
        let radius = table.radius_squared();
        for number in 0..tries {
            let random = if by_facets { tries / 2 } else { 0 };
            let Some(mut set) = search.next(number >= random, radius) else {
                continue;
            };
            if !by_facets && number % FITTED == 0 {
                let is_inside = |set: &PoseSet| decide(table, set) == Decision::Inside;
                if let Some(fitted) = search.fitted(radius, is_inside) {
                    set = fitted;
                }
            }
            let mut cost = counter
                .count(|| decide(black_box(table), black_box(&set)))?
                .0;
            // A robot that moves: the set is grown by 1 to 128 mm in any direction or along the heading, and by 0.09 to 11 degrees.
            let mut movement = number % 128;
            if number >= random && number % 2 != 0 {
                movement = best_movement;
            }
            let length = 1_000 << (movement % 8);
            let side = if movement < 64 { length } else { 0 };
            let moved = set.grown(Growth::along(length, side, 4_096 << (movement / 8 % 8)));
            let own = counter
                .count(|| decide(black_box(table), black_box(&moved)))?
                .0;
            if own > cost {
                (set, cost) = (moved, own);
            }
            let is_highest = search.found(cost);
            if is_highest {
                best_movement = movement;
            }
            if is_highest || number % 61 == 0 {
                let (stack, _) = used_by(|| decide(black_box(table), black_box(&set)));
                deepest = stack.max(deepest);
            }
        }
        let worst = table.worst_case();
        let bound = if M4F {
            worst.instructions_m4f()
        } else {
            worst.instructions_m0_plus()
        };
        if by_facets {
            let is_union = table
                .facets()
                .is_some_and(|facets| facets.pieces().nth(1).is_some());
            let (cost, depth) = if is_union {
                (
                    "most expensive decision found, several pieces",
                    "deepest stack found of several pieces",
                )
            } else {
                (
                    "most expensive decision found, facets",
                    "deepest stack found of facets",
                )
            };
            let limits = match (is_union, M4F) {
                (false, true) => [20_000, 35_000],
                (false, false) => [60_000, 134_000],
                (true, true) => [20_000, 147_000],
                (true, false) => [60_000, 522_000],
            };
            counter.short_of(cost, search.cost(), "instructions", limits);
            let most = if is_union { 2_168 } else { 1_024 };
            counter.short_of(depth, u64::from(deepest), "B", [512, most]);
        } else {
            counter.line(
                "most expensive decision found, cells,",
                name,
                search.cost(),
                "instructions",
                None,
            );
            counter.line(
                "deepest stack found, cells,",
                name,
                u64::from(deepest),
                "B",
                None,
            );
        }
        counter.line(
            "bound by the table,",
            name,
            u64::from(bound),
            "instructions",
            None,
        );
        if search.cost() > u64::from(bound) {
            return Err("a decision costs more than the table's worst case");
        }
        match search.most_expensive(radius) {
            Some(set) if !by_facets => runs(counter, name, table, &set),
            _ => Ok(()),
        }
    }

    /// Prints the cost of the most expensive second evaluation that a search finds among sets that the first permits, and the bound that the
    /// table gives. Half of the tries are grown by a movement.
    fn confirmation(
        counter: &mut Counter,
        name: &str,
        bytes: &[u8],
        bounds: Bounds,
        tries: u32,
    ) -> Result<(), Failure> {
        let table = &Table::parse(bytes).map_err(|_| "the table does not parse")?;
        let mut search = Search::new(0x9e37_79b9_7f4a_7c15, goal_of(table), bounds, MIDDLE);
        let radius = table.radius_squared();
        for number in 0..tries {
            let Some(mut set) = search.next(number >= tries / 4, radius) else {
                continue;
            };
            let grown = number % 2 == 1;
            let movement = if grown {
                Growth::new(1_000, 16_384)
            } else {
                Growth::NONE
            };
            let is_inside = |set: &PoseSet| decide(table, &set.grown(movement)) == Decision::Inside;
            if number % FITTED == 0
                && let Some(fitted) = search.fitted(radius, is_inside)
            {
                set = fitted;
            }
            if is_inside(&set) {
                let belief = search.belief();
                let opinion = || {
                    second::opinion_after(
                        black_box(bytes),
                        black_box(&belief),
                        Trust::FULL,
                        &movement,
                    )
                };
                let cost = counter.count(opinion)?.0;
                search.found(cost);
            }
        }
        let bound = u64::from(table.worst_case().confirmation_m4f());
        counter.line(
            "most expensive second opinion found,",
            name,
            search.cost(),
            "instructions",
            None,
        );
        counter.line(
            "bound by the table, second opinion,",
            name,
            bound,
            "instructions",
            None,
        );
        // Cores without wide products take up to four times as many.
        let most = if M4F { bound } else { 4 * bound };
        if search.cost() > most {
            return Err("a second opinion costs more than the table's worst case");
        }
        Ok(())
    }

    /// Prints the cost of a decision's most expensive run, with that of the slab it may begin: the difference of two limits of runs.
    /// Fails if it is above the price that `worst_case` takes.
    fn runs(
        counter: &mut Counter,
        name: &str,
        table: &Table<'_>,
        set: &PoseSet,
    ) -> Result<(), Failure> {
        let up_to = |limit: u32| decide(&table.within(limit), set);
        let ends = |limit: u32| up_to(limit) != Decision::Outside(Cause::TooCostly);
        let (mut few, mut enough) = (0, table.worst_case().runs);
        while enough - few > 1 {
            let limit = few + (enough - few) / 2;
            if ends(limit) {
                enough = limit;
            } else {
                few = limit;
            }
        }
        let mut highest = 0;
        for run in (1..enough).step_by(enough as usize / 64 + 1) {
            let mut cost = |limit: u32| -> Result<u64, Failure> {
                let table = table.within(limit);
                Ok(counter
                    .count(|| decide(black_box(&table), black_box(set)))?
                    .0)
            };
            highest = highest.max(cost(run + 1)?.saturating_sub(cost(run)?));
        }
        let price = |worst: WorstCase| {
            u64::from(if M4F {
                worst.instructions_m4f()
            } else {
                worst.instructions_m0_plus()
            })
        };
        let none = WorstCase::default();
        let one = WorstCase {
            slabs: 1,
            runs: 1,
            ..none
        };
        let most = price(one) - price(none);
        counter.line(
            "most expensive run,",
            name,
            highest,
            "instructions",
            Some(most),
        );
        if highest > most {
            return Err("a run costs more than its price in the table's worst case");
        }
        Ok(())
    }

    /// Prints the cost of a sighting: from the goal, and the most expensive over poses all over the table.
    fn sight(counter: &mut Counter, table: &Table<'_>) -> Result<(), Failure> {
        let make = || Scene::of(black_box(table));
        let scene = counter.print("scene see-t7", make)?;
        let scene = scene.ok_or("the table has no sight record")?;
        let home = table.goal().pose;
        let (cost, sighting) = counter.count(|| look(black_box(&scene), black_box(&home)))?;
        if sighting.answer != TagVisibility::Visible {
            return Err("the tag is not visible from the goal");
        }
        counter.line("", "sight see-t7", cost, "instructions", goal(1_500, 0));
        let (stack, _) = used_by(|| look(black_box(&scene), black_box(&home)));
        counter.line(
            "stack of",
            "sight see-t7",
            u64::from(stack),
            "B",
            goal(512, 512),
        );
        let (mut highest, mut digest) = (0, 0);
        let mut poses = Looks::new();
        for _ in 0..LOOKS {
            let pose = poses.pose();
            let (cost, sighting) = counter.count(|| look(black_box(&scene), black_box(&pose)))?;
            highest = cost.max(highest);
            digest = added(digest, &sighting);
        }
        if digest != looks::SEE_T7 {
            return Err("the sightings of this core differ from the host's");
        }
        counter.line(
            "worst found of",
            "sight see-t7",
            highest,
            "instructions",
            goal(1_500, 0),
        );
        Ok(())
    }

    /// The second evaluation of sets that the first permits.
    fn second_opinions(counter: &mut Counter) -> Result<(), Failure> {
        let gaussian = |from: &Gaussian| {
            PoseEstimate::new(from.estimate, Uncertainty::Gaussian(from.covariance))
        };
        let wide = Uncertainty::Bounded {
            translation_m: WIDE_TRANSLATION_M,
            yaw_rad: WIDE_YAW_RAD,
        };
        for (name, table, belief) in [
            ("second opinion see-t7 large", SEE_T7, gaussian(&LARGE)),
            ("second opinion see-t7 small", SEE_T7, gaussian(&SMALL)),
            (
                "second opinion see-t7 wide",
                SEE_T7,
                PoseEstimate::new(LARGE.estimate, wide),
            ),
            (
                "second opinion see-t7 grid large",
                SEE_T7_GRID,
                gaussian(&LARGE),
            ),
            (
                "second opinion see-t7 grid small",
                SEE_T7_GRID,
                gaussian(&SMALL),
            ),
            ("second opinion dock small", DOCK, gaussian(&SMALL)),
        ] {
            let opinion = || second::opinion(black_box(table), black_box(&belief), Trust::FULL);
            if counter.print(name, opinion)? != second::INSIDE {
                return Err("a permit is not confirmed");
            }
            let (stack, _) = used_by(opinion);
            counter.line("stack of", name, u64::from(stack), "B", None);
        }
        Ok(())
    }

    fn measure() -> Result<(), Failure> {
        let mut counter = Counter::new()?;
        let (known, ()) = counter.count(|| spin(black_box(KNOWN_TURNS)))?;
        if known.abs_diff(u64::from(2 * KNOWN_TURNS)) > u64::from(CALL) {
            return Err("a loop of known length is counted wrongly");
        }
        let parse = |bytes| Table::parse(bytes).map_err(|_| "a table does not parse");
        let dock = parse(DOCK)?;
        let see_t7 = counter.print("parse see-t7", || parse(black_box(SEE_T7)))??;
        let radius = see_t7.radius_squared();

        let impossible = |_| "an estimate was refused";
        let (cost, large) = counter.count(|| convert(black_box(&LARGE), black_box(radius)))?;
        let large = large.map_err(impossible)?;
        counter.line(
            "",
            "convert large",
            cost,
            "instructions",
            goal(2_050, 5_500),
        );
        let (cost, small) = counter.count(|| convert(black_box(&SMALL), black_box(radius)))?;
        let small = small.map_err(impossible)?;
        counter.line(
            "",
            "convert small",
            cost,
            "instructions",
            goal(2_050, 5_500),
        );
        let (cost, wide) = counter.count(|| convert_bounded(black_box(&LARGE.estimate)))?;
        let wide = wide.map_err(impossible)?;
        counter.line("", "convert wide", cost, "instructions", goal(600, 1_850));
        let edge = convert(&EDGE, radius).map_err(impossible)?;

        for (decide_name, examine_name, set, inside) in [
            ("decide see-t7 large", "examine see-t7 large", &large, true),
            ("decide see-t7 small", "examine see-t7 small", &small, true),
            ("decide see-t7 wide", "examine see-t7 wide", &wide, true),
            ("decide see-t7 edge", "examine see-t7 edge", &edge, false),
        ] {
            let (cost, decision) = counter.count(|| decide(black_box(&see_t7), black_box(set)))?;
            let edge = !inside;
            let most = if edge { None } else { goal(1_200, 2_500) };
            counter.line("", decide_name, cost, "instructions", most);
            let with_margin = counter
                .count(|| decide_with_margin(black_box(&see_t7), black_box(set)))?
                .0;
            let more = with_margin.saturating_sub(cost);
            counter.line(
                "margin on top of",
                decide_name,
                more,
                "instructions",
                goal(600, 0),
            );
            let (stack, _) = used_by(|| decide(black_box(&see_t7), black_box(set)));
            let stack = u64::from(stack);
            if edge {
                counter.short_of("stack of decide see-t7 edge", stack, "B", [512, 1_024]);
            } else {
                counter.line("stack of", decide_name, stack, "B", goal(512, 512));
            }
            let examination =
                counter.print(examine_name, || examine(black_box(&see_t7), black_box(set)))?;
            if (decision == Decision::Inside) != inside || examination.decision != decision {
                return Err("a decision is not the expected one");
            }
        }
        sight(&mut counter, &see_t7)?;
        let see_t7_grid =
            counter.print("parse see-t7 grid", || parse(black_box(SEE_T7_GRID)))??;
        for (name, set) in [
            ("decide see-t7 grid large", &large),
            ("decide see-t7 grid small", &small),
        ] {
            let inside = counter.print(name, || decide(black_box(&see_t7_grid), black_box(set)))?;
            if inside != Decision::Inside {
                return Err("the grid does not hold a set that it should");
            }
        }
        // SAFETY: the only use of the static, on the only thread.
        let bits = unsafe { &mut *core::ptr::addr_of_mut!(BITS) };
        let naive = BitGrid::unpack(&see_t7_grid, bits).ok_or("the bits do not hold the table")?;
        // In software floats the large set outlasts the timer.
        let sets: &[(&str, &Gaussian)] = if M4F {
            &[
                ("naive bit grid see-t7 large", &LARGE),
                ("naive bit grid see-t7 small", &SMALL),
            ]
        } else {
            &[("naive bit grid see-t7 small", &SMALL)]
        };
        for &(name, from) in sets {
            let set = Naive::of(from, radius).ok_or("a covariance has no inverse")?;
            if !counter.print(name, || {
                contains_naively(black_box(&naive), black_box(&set))
            })? {
                return Err("the naive grid does not hold a set that it should");
            }
        }
        second_opinions(&mut counter)?;
        worst(
            &mut counter,
            "decide see-t7",
            &see_t7,
            (ABOUT, MIDDLE),
            TRIES,
        )?;
        worst(
            &mut counter,
            "decide dock",
            &dock,
            (ABOUT, MIDDLE),
            TRIES / 4,
        )?;
        for (name, bytes) in [("decide see-bay", SEE_BAY), ("decide corner", CORNER)] {
            let table = parse(bytes)?;
            worst(
                &mut counter,
                name,
                &table,
                (EVERY_HEADING, MIDDLE),
                TRIES / 8,
            )?;
        }
        for (name, bytes, bounds) in [
            ("see-t7", SEE_T7, ABOUT),
            ("dock", DOCK, ABOUT),
            ("see-bay", SEE_BAY, EVERY_HEADING),
            ("corner", CORNER, EVERY_HEADING),
            ("see-t7 grid", SEE_T7_GRID, ABOUT),
        ] {
            let tries = if bytes.len() > 2_000 {
                TRIES_OF_CELLS
            } else {
                TRIES / 12
            };
            confirmation(&mut counter, name, bytes, bounds, tries)?;
        }
        let circle = parse(WHOLE_CIRCLE)?;
        let home = circle.goal().pose;
        let at_home = Estimate {
            x_m: f64::from(home.x_um) * 1e-6,
            y_m: f64::from(home.y_um) * 1e-6,
            yaw_rad: 0.0,
        };
        // Mostly slabs.
        let narrow = PoseSet::bounded(at_home, 0.001, PI).map_err(impossible)?;
        let _ = counter.print("decide whole circle, every heading", || {
            decide(black_box(&circle), black_box(&narrow))
        })?;
        let narrow = PoseSet::gaussian(
            at_home,
            [[1e-4, 2e-5, 6e-3], [2e-5, 1e-4, 6e-3], [6e-3, 6e-3, 1.1]],
            radius,
        );
        let narrow = narrow.map_err(impossible)?;
        let _ = counter.print("decide whole circle, every heading, ellipsoid", || {
            decide(black_box(&circle), black_box(&narrow))
        })?;
        for (name, bytes, about) in [
            ("decide see-t7 grid", SEE_T7_GRID, (ABOUT, DEAR_SEE_T7_GRID)),
            (
                "decide whole circle grid",
                WHOLE_CIRCLE,
                (EVERY_HEADING, DEAR_WHOLE_CIRCLE),
            ),
        ] {
            worst(&mut counter, name, &parse(bytes)?, about, TRIES_OF_CELLS)?;
        }
        let decision = counter.print("decide dock small", || {
            decide(black_box(&dock), black_box(&small))
        })?;
        if decision != Decision::Inside {
            return Err("the small set is not inside the dock's success set");
        }
        if counter.short {
            return Err("a figure is above its goal");
        }
        Ok(())
    }

    #[entry]
    fn main() -> ! {
        run(measure)
    }
}
