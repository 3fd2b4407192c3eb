//! Tables of random success sets contain no pose that is not in the set.
//!
//! Random trees of boxes, footprints, obstacles, unions of regions and views of tags (with tolerances, walls,
//! least distances and angles, sharpness, error limits) become proven tables. Poses of the tables are
//! sampled, and `definition.rs` checks each of them: it uses only the definitions of the sets, with
//! tag, camera and dock displaced within their tolerances. `POSEGATE_SETS` and `POSEGATE_SAMPLES` (per set) set the
//! counts of the nightly job (`./ci.sh sets`). The fast suite tries twelve sets, others each day.

use posegate_testkit::counts;
mod definition;
mod random;

use crate::definition::Nature;
use crate::random::Random;
use posegate::bake::{BakeError, BakeInput, Extent, Layout, Step, TableSpec};
use posegate::contain::{Decision, decide};
use posegate::set::{Estimate, PoseSet};
use posegate::shape::{ErrorLimit, ErrorModel, Shape, SuccessSet};
use posegate::table::Table;
use posegate::verify::{BuildError, ExpectedTable, VerifyError, build, verify};
use posegate_site::Site;
use std::sync::atomic::{AtomicU64, Ordering};

fn number(variable: &str, otherwise: u64) -> u64 {
    std::env::var(variable).map_or(otherwise, |value| {
        value.parse().unwrap_or_else(|e| panic!("{variable}: {e}"))
    })
}

/// Counts of what was checked.
#[derive(Default)]
struct Tally {
    sets: AtomicU64,
    empty: AtomicU64,
    withheld: AtomicU64,
    /// Poses in cells, and poses in facet pieces.
    cells: AtomicU64,
    facets: AtomicU64,
    wrong: AtomicU64,
    /// Permitted pose-sets, each checked at poses of its border.
    permits: AtomicU64,
}

#[test]
fn all_poses_of_a_table_are_in_the_set() {
    let (sets, samples) = (
        number("POSEGATE_SETS", if counts::is_deep() { 1000 } else { 12 }),
        number("POSEGATE_SAMPLES", 1000),
    );
    let tally = Tally::default();
    let next = AtomicU64::new(counts::first_seed());
    std::thread::scope(|scope| {
        for _ in 0..std::thread::available_parallelism().map_or(2, usize::from) {
            scope.spawn(|| {
                loop {
                    let seed = next.fetch_add(1, Ordering::Relaxed);
                    if tally.sets.load(Ordering::Relaxed) >= sets {
                        break;
                    }
                    one(seed, samples, &tally);
                }
            });
        }
    });
    let count = |value: &AtomicU64| value.load(Ordering::Relaxed);
    for (name, value, goal) in [
        ("random success sets with a proven table", &tally.sets, None),
        ("random success sets that are empty", &tally.empty, None),
        ("tables that were withheld", &tally.withheld, None),
        ("poses sampled in cells", &tally.cells, None),
        ("poses sampled that facets hold", &tally.facets, None),
        ("pose-sets permitted", &tally.permits, None),
        ("sampled poses outside their set", &tally.wrong, Some(0)),
    ] {
        let goal = goal.map_or("null".into(), |goal: u64| goal.to_string());
        println!(
            "\n{{\"name\": \"{name}\", \"value\": {}, \"unit\": \"\", \"goal\": {goal}}}",
            count(value)
        );
    }
    assert_eq!(count(&tally.wrong), 0);
    // Most random sets are not empty, most of their tables are proven, and enough poses are checked.
    assert!(count(&tally.sets) >= sets);
    assert!(
        count(&tally.cells) + count(&tally.facets) >= sets * samples,
        "too few samples"
    );
    assert!(count(&tally.facets) * 10 >= sets, "too few of facets");
    assert!(count(&tally.permits) >= sets, "too few permits");
    assert!(count(&tally.withheld) * 5 <= sets, "too many withheld");
}

/// A set that is empty because a union in it is empty has no table, even if the set without that union has one.
#[test]
fn empty_sets_have_no_table() {
    let site = Site::parse(
        include_str!("../../../../examples/sites/dock.toml"),
        "dock.toml",
    )
    .unwrap();
    let task = site.task("see-t7").unwrap();
    let Shape::Visibility(view) = task.success.shape else {
        panic!("a visibility set");
    };
    let model = ErrorModel {
        translation: [0.1, 0.0, 0.0, 0.0],
        yaw_deg: [0.0; 4],
    };
    let limit = |translation| SuccessSet {
        goal: task.success.goal,
        shape: Shape::Bounded {
            view,
            limit: ErrorLimit {
                model,
                translation,
                yaw_deg: 1.0,
            },
        },
    };
    for layout in [Layout::Facets, Layout::Grid] {
        let mut spec = *site.table_spec(task).unwrap();
        spec.layout = layout;
        let order = BakeInput {
            task: "see-t7",
            success: &task.success,
            spec,
            epsilon: site.epsilon,
        };
        let (bytes, _) = build(&order, &|| ()).unwrap();
        let proof = |success: &SuccessSet| {
            let claim = ExpectedTable {
                task: "see-t7",
                success,
                epsilon: site.epsilon,
            };
            verify(&bytes, &claim, &|| ())
        };
        // Every pose is proven, and only then the digest is compared: it is that of another set.
        let hex = |digest: [u8; 32]| digest.iter().map(|b| format!("{b:02x}")).collect();
        let other = VerifyError::Header {
            field: "task digest",
            found: hex(task.success.digest(site.epsilon)),
            expected: hex(limit(0.2).digest(site.epsilon)),
        };
        assert_eq!(proof(&limit(0.2)), Err(other));
        let unproven = proof(&limit(0.05));
        assert!(
            matches!(unproven, Err(VerifyError::Facet(_) | VerifyError::Cell(_))),
            "{layout:?}: {unproven:?}"
        );
    }
}

/// Without tolerances membership agrees with the definition, on both sides of every border.
#[test]
fn membership_agrees_with_the_definition() {
    // Metres or radians. The definition samples outlines and the tag's face, so this is its accuracy.
    const NEAR: f64 = 0.02;
    let (mut inside, mut outside) = (0u64, 0u64);
    let (skipped, step) = counts::part(4);
    let worlds: Vec<u64> = (0..400).skip(skipped).step_by(step).collect();
    for seed in &worlds {
        let mut random = Random::new(seed + 1_000_000);
        let world = random.world_without_tolerances();
        let nature = Nature::as_surveyed(&mut random);
        let goal = world.success.goal;
        let (sin, cos) = goal.yaw_deg.to_radians().sin_cos();
        for _ in 0..400 {
            let pose = random.pose_in(&Extent {
                x: [-2.0, 2.0],
                y: [-2.0, 2.0],
                yaw_deg: [-70.0, 70.0],
            });
            let [x, y, yaw] = pose;
            let membership = world.success.membership([
                goal.x + cos * x - sin * y,
                goal.y + sin * x + cos * y,
                yaw + goal.yaw_deg.to_radians(),
            ]);
            // A displacement at a wall next to the tag moves the border of the camera's places by more.
            let near = |(name, slack): &(&str, f64)| {
                // A wall that contains the tag hides it from all poses.
                !slack.is_finite() || slack.abs() < if *name == "wall" { 0.15 } else { NEAR }
            };
            if membership.slack.iter().any(near) {
                continue;
            }
            let fault = nature.fault(&world, pose);
            assert_eq!(
                fault.is_none(),
                membership.inside,
                "set {seed}: {pose:?}: {fault:?}, {:?}\n{world:?}",
                membership.slack
            );
            inside += u64::from(membership.inside);
            outside += u64::from(!membership.inside);
        }
    }
    let least = 25 * worlds.len() as u64;
    assert!(inside > least && outside > least, "{inside} {outside}");
}

/// Tests a random set: its table in a random layout, with samples.
fn one(seed: u64, samples: u64, tally: &Tally) {
    let mut random = Random::new(seed);
    let world = random.world();
    let order = order(&mut random, &world.success);
    let bytes = match build(&order, &|| ()) {
        Ok((bytes, _)) => bytes,
        Err(BuildError::Verify(_)) => {
            tally.withheld.fetch_add(1, Ordering::Relaxed);
            return;
        }
        Err(BuildError::Bake(BakeError::Empty { .. } | BakeError::NoPieces(_))) => {
            tally.empty.fetch_add(1, Ordering::Relaxed);
            return;
        }
        Err(error) => panic!("set {seed}: {error}"),
    };
    tally.sets.fetch_add(1, Ordering::Relaxed);
    let table = Table::parse(&bytes).expect("a proven table");
    let wrong = |pose: [f64; 3], random: &mut Random, by: &str| {
        let nature = Nature::random(random, &world);
        if let Some(fault) = nature.fault(&world, pose) {
            eprintln!("set {seed}, {by}: {pose:?} is outside: {fault}\n{world:?}");
            tally.wrong.fetch_add(1, Ordering::Relaxed);
        }
    };
    let (mut in_cells, mut in_facets) = (0, 0);
    if let Some(runs) = runs(&table).filter(|runs| !runs.is_empty()) {
        for _ in 0..samples {
            let pose = in_a_run(&mut random, &table, &runs);
            wrong(pose, &mut random, "cells");
            in_cells += 1;
        }
    }
    if table.facets().is_some() {
        // Random poses of the extent, concentrated near poses that the table contains.
        let mut held: Vec<[f64; 3]> = Vec::new();
        for _ in 0..20 * samples {
            let near = held.len() > 8 && random.chance(0.9);
            let pose = if near {
                let about = held[random.below(held.len() as u64) as usize];
                [0.2, 0.2, 0.1]
                    .iter()
                    .zip(about)
                    .map(|(by, v)| v + random.within(-by, *by))
                    .collect::<Vec<f64>>()
                    .try_into()
                    .expect("three")
            } else {
                random.pose_in(&order.spec.extent)
            };
            if is_held(&table, &world.success, pose) {
                wrong(pose, &mut random, "facets");
                in_facets += 1;
                if held.len() < 1000 {
                    held.push(pose);
                }
            }
            if in_facets >= samples {
                break;
            }
        }
    }
    // Pose-sets, and poses on their borders.
    for _ in 0..samples / 10 {
        let at = random.pose_in(&order.spec.extent);
        let (translation, yaw) = (random.within(0.005, 0.4), random.within(0.005, 0.2));
        if !permits(&table, &world.success, at, [translation, yaw]) {
            continue;
        }
        tally.permits.fetch_add(1, Ordering::Relaxed);
        for _ in 0..12 {
            let (sin, cos) = random.within(0.0, 6.3).sin_cos();
            let by = translation * (1.0 - 1e-9);
            let turn = [-yaw, yaw, random.within(-yaw, yaw)][random.below(3) as usize];
            let pose = [
                at[0] + by * cos,
                at[1] + by * sin,
                at[2] + turn * (1.0 - 1e-9),
            ];
            wrong(pose, &mut random, "a permit");
        }
    }
    tally.cells.fetch_add(in_cells, Ordering::Relaxed);
    tally.facets.fetch_add(in_facets, Ordering::Relaxed);
}

fn order<'a>(random: &mut Random, success: &'a SuccessSet) -> BakeInput<'a> {
    let layout = if random.chance(0.5) {
        Layout::Grid
    } else {
        Layout::Facets
    };
    let yaw = random.within(5.0, 60.0);
    BakeInput {
        task: "random",
        success,
        spec: TableSpec {
            extent: Extent {
                x: [-2.0, 2.0],
                y: [-2.0, 2.0],
                yaw_deg: if random.chance(0.1) {
                    [-180.0, 180.0]
                } else {
                    [-yaw, yaw]
                },
            },
            step: Step {
                xy: random.within(0.05, 0.12),
                yaw_deg: random.within(3.0, 8.0),
            },
            layout,
        },
        epsilon: 0.99,
    }
}

/// Returns `true` if the table contains a very small set at a pose of the goal frame.
fn is_held(table: &Table<'_>, success: &SuccessSet, pose: [f64; 3]) -> bool {
    permits(table, success, pose, [1e-5, 1e-5])
}

/// Returns `true` if the table contains a bounded set of the given metres and radians at a pose of the goal frame.
fn permits(
    table: &Table<'_>,
    success: &SuccessSet,
    [x, y, yaw]: [f64; 3],
    [translation_m, yaw_rad]: [f64; 2],
) -> bool {
    let goal = success.goal;
    let (sin, cos) = goal.yaw_deg.to_radians().sin_cos();
    let world = [
        goal.x + cos * x - sin * y,
        goal.y + sin * x + cos * y,
        yaw + goal.yaw_deg.to_radians(),
    ];
    let estimate = Estimate {
        x_m: world[0],
        y_m: world[1],
        yaw_rad: world[2],
    };
    let set = PoseSet::bounded(estimate, translation_m, yaw_rad).expect("a bounded set");
    decide(table, &set) == Decision::Inside
}

/// Returns slab, row, first and last column of each run.
fn runs(table: &Table<'_>) -> Option<Vec<[u32; 4]>> {
    let (grid, cells) = (table.grid()?, table.cells());
    let mut runs = Vec::new();
    for slab in 0..cells.slabs {
        let rows = grid.slab(slab);
        for row in rows.first_row()..rows.first_row() + rows.rows() {
            for run in rows.runs(row) {
                runs.push([slab, row, run.first, run.last].map(u32::from));
            }
        }
    }
    Some(runs)
}

/// Returns a pose in a run, often at its end.
fn in_a_run(random: &mut Random, table: &Table<'_>, runs: &[[u32; 4]]) -> [f64; 3] {
    let cells = table.cells();
    let [slab, row, first, last] = runs[random.below(runs.len() as u64) as usize];
    let mut part = || match random.below(4) {
        0 => 0.0,
        1 => 1.0,
        _ => random.within(0.0, 1.0),
    };
    let step = f64::from(cells.step_um) * 1e-6;
    let (u, v, w) = (part(), part(), part());
    let column = f64::from(first) + u * f64::from(last + 1 - first);
    let units = f64::from(cells.yaw_lo.signed())
        + (cells.slab_edge(slab as u16) as f64)
        + w * (cells.slab_edge(slab as u16 + 1) - cells.slab_edge(slab as u16)) as f64;
    [
        f64::from(cells.x_lo_um) * 1e-6 + column * step,
        f64::from(cells.y_lo_um) * 1e-6 + (f64::from(row) + v) * step,
        units / 4_294_967_296.0 * std::f64::consts::TAU,
    ]
}
