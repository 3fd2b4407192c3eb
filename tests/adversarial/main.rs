//! No false permit: random and searched pose-sets on random sets and tables, against an exact
//! double-precision oracle that shares no code with the crate.
//!
//! `cargo test --features cli --test adversarial` runs a short campaign; `ci.sh adversarial N SEED
//! [LAYOUT]` a long one. Prints one JSON line; ends non-zero at the first kind of failure.
//!
//! Each world is a random success set with a random goal, baked to a table that is then proven. On
//! it, a third of the pose-sets are random, a third are scaled to the border of what the table
//! itself accepts, and a third to the border of the true set, from below and from above. Every
//! permit is checked twice: the oracle's least slack over the pose-set, and the poses of the set that
//! would leave the covered cells first, on cells decoded from the bytes by the test.

#[path = "../oracle/mod.rs"]
mod oracle;
mod voxels;

use oracle::{
    Effort, Pose, PoseSet, RandomWorld, Rng, SetDeg, min_slack_over, pose_from_deg,
    random_estimate, random_pose_set, random_pose_set_near, random_world, scale, to_goal,
};
use posegate::bake::{Extent, Layout, Order, Step, TableSpec};
use posegate::contain::{Decision, decide, examine};
use posegate::set::{Estimate, Impossible, RadiusSquared};
use posegate::shape::{
    BoxSet, Camera, Footprint, Pose3Deg, PoseDeg, Shape, SuccessSet, Tag, Visibility,
};
use posegate::table::Table;
use posegate::verify::{Claim, build, verify};
use std::process::ExitCode;
use std::sync::atomic::{AtomicUsize, Ordering};
use voxels::Voxels;

/// Pose-sets that are tried on one world.
const PER_WORLD: usize = 2000;

#[derive(Default)]
struct Tally {
    cases: usize,
    permits: usize,
    near_border: usize,
    false_permits: usize,
    escapes: usize,
    unproven: usize,
    impossible: usize,
    ratios: Vec<f64>,
    cell_ratios: Vec<f64>,
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args()
        .skip(1)
        .filter(|a| !a.starts_with("--"))
        .collect();
    let number = |at: usize, default: u64| -> u64 {
        arguments.get(at).map_or(default, |text| {
            text.parse()
                .unwrap_or_else(|_| panic!("`{text}` is no number: adversarial N SEED [LAYOUT]"))
        })
    };
    let (cases, seed) = (number(0, 20_000) as usize, number(1, 1));
    let layout = arguments.get(2).map_or("grid", String::as_str);
    let layout_of = match layout {
        "grid" => Layout::Grid,
        "facets" => Layout::Facets,
        "both" => Layout::Both,
        _ => panic!("no layout `{layout}`: grid, facets or both"),
    };
    let worlds = cases.div_ceil(PER_WORLD);
    let next = AtomicUsize::new(0);
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let tallies: Vec<Tally> = std::thread::scope(|scope| {
        let workers: Vec<_> = (0..threads)
            .map(|_| {
                scope.spawn(|| {
                    let mut tally = Tally::default();
                    loop {
                        let world = next.fetch_add(1, Ordering::Relaxed);
                        if world >= worlds {
                            return tally;
                        }
                        let mut rng =
                            Rng::new(seed.wrapping_mul(1_000_003).wrapping_add(world as u64));
                        let left = (cases - world * PER_WORLD).min(PER_WORLD);
                        try_world(&mut rng, left, layout_of, &mut tally);
                    }
                })
            })
            .collect();
        workers
            .into_iter()
            .map(|worker| worker.join().unwrap())
            .collect()
    });
    let mut all = Tally::default();
    for tally in tallies {
        all.cases += tally.cases;
        all.permits += tally.permits;
        all.near_border += tally.near_border;
        all.false_permits += tally.false_permits;
        all.escapes += tally.escapes;
        all.unproven += tally.unproven;
        all.impossible += tally.impossible;
        all.ratios.extend(tally.ratios);
        all.cell_ratios.extend(tally.cell_ratios);
    }
    all.ratios.sort_by(f64::total_cmp);
    let mean = all.ratios.iter().sum::<f64>() / all.ratios.len() as f64;
    let p10 = all.ratios[all.ratios.len() / 10];
    let cells = all.cell_ratios.iter().sum::<f64>() / all.cell_ratios.len() as f64;
    // Facets have no cells.
    let cell_text = if cells.is_nan() {
        "null".to_string()
    } else {
        format!("{cells:.4}")
    };
    println!(
        "{{\"cases\": {}, \"permits\": {}, \"false_permits\": {}, \"mean_ratio\": {mean:.4}, \"p10_ratio\": {p10:.4}, \
         \"ratios\": {}, \"mean_cell_ratio\": {cell_text}, \"escapes\": {}, \"near_border\": {}, \"unproven_tables\": {}, \"seed\": {seed}, \"layout\": \"{layout}\"}}",
        all.cases,
        all.permits,
        all.false_permits,
        all.ratios.len(),
        all.escapes,
        all.near_border,
        all.unproven,
    );
    let share = all.permits as f64 / all.cases as f64;
    let sound = all.false_permits == 0 && all.escapes == 0 && all.unproven == 0;
    // A campaign that rarely permits, or rarely comes near a border, proves nothing.
    let telling =
        (0.3..=0.7).contains(&share) && 2 * all.near_border >= all.cases && all.impossible == 0;
    if !telling {
        eprintln!(
            "not telling: {share:.3} permits, {} of {} near a border, {} impossible",
            all.near_border, all.cases, all.impossible
        );
    }
    ExitCode::from(u8::from(!(sound && telling)))
}

/// A random world with its table.
struct Stage {
    random: RandomWorld,
    success: SuccessSet,
    bytes: Vec<u8>,
}

fn stage(rng: &mut Rng, layout: Layout) -> Stage {
    loop {
        let random = random_world(rng);
        let success = success_set(&random);
        let spec = spec(rng, &random, layout);
        let order = Order {
            task: "adversarial",
            success: &success,
            spec,
            epsilon: 0.99,
            site_digest: [7; 32],
        };
        // A set too small for its cells has no table; another world then.
        if let Ok((bytes, _)) = build(&order, &|| ()) {
            return Stage {
                random,
                success,
                bytes,
            };
        }
    }
}

fn try_world(rng: &mut Rng, cases: usize, layout: Layout, tally: &mut Tally) {
    let stage = stage(rng, layout);
    let world = &stage.random.world;
    let claim = Claim {
        task: "adversarial",
        success: &stage.success,
        epsilon: 0.99,
        site_digest: [7; 32],
    };
    if let Err(error) = verify(&stage.bytes, &claim, &|| ()) {
        eprintln!("unproven: {error}: {:?}", stage.success);
        tally.unproven += 1;
    }
    let table = Table::parse(&stage.bytes).unwrap();
    let voxels = (layout == Layout::Grid).then(|| Voxels::read(&stage.bytes));
    for case in 0..cases {
        let estimate = pose_from_deg(random_estimate(rng, world));
        let random = if rng.chance(0.1) {
            random_pose_set(rng).pose_set
        } else {
            random_pose_set_near(rng, world, estimate).pose_set
        };
        let truth = |set: &PoseSet| scale(world, estimate, set);
        let allowed = |set: &PoseSet| {
            let set = core_set(estimate, set).ok()?;
            Some(f64::from(examine(&table, &set).margin.q16()) / 65536.0)
        };
        // Close from either side, from a millionth to a tenth.
        let nearby = |rng: &mut Rng| {
            1.0 + rng.log_within(1e-7, 0.1) * if rng.chance(0.4) { 1.0 } else { -1.0 }
        };
        let set = match case % 3 {
            0 => {
                let (margin, exact) = (allowed(&random), truth(&random));
                if let Some(margin) = margin
                    && case % 60 == 0
                    && exact > 0.0
                    && exact.is_finite()
                {
                    tally.ratios.push(margin / exact);
                    let mean = to_goal(world.goal, estimate);
                    let escapes = |scale: f64| {
                        let Some(voxels) = &voxels else { return false };
                        voxels
                            .escapes(&scaled(&random, scale), mean, world.goal[2])
                            .is_some()
                    };
                    tally.cell_ratios.extend(cell_ratio(margin, escapes));
                }
                random
            }
            1 => match allowed(&random) {
                Some(margin) if margin > 0.0 && margin < 1e3 => {
                    tally.near_border += 1;
                    scaled(&random, margin * nearby(rng))
                }
                _ => random,
            },
            _ => match truth(&random) {
                exact if exact > 0.0 && exact < 1e3 => {
                    tally.near_border += 1;
                    scaled(&random, exact * nearby(rng))
                }
                _ => random,
            },
        };
        tally.cases += 1;
        let Ok(core) = core_set(estimate, &set) else {
            tally.impossible += 1;
            continue;
        };
        if decide(&table, &core) != Decision::Inside {
            continue;
        }
        tally.permits += 1;
        let (slack, pose) = min_slack_over(world, estimate, &set, 1.0, Effort::Full);
        if !(slack >= -1e-9) {
            tally.false_permits += 1;
            eprintln!(
                "FALSE PERMIT: slack {slack:e} at {pose:?}: {estimate:?} {set:?} in {:?}",
                stage.success
            );
        }
        let mean = to_goal(world.goal, estimate);
        if let Some(pose) = voxels
            .as_ref()
            .and_then(|v| v.escapes(&set, mean, world.goal[2]))
        {
            tally.escapes += 1;
            eprintln!(
                "ESCAPE from the cells at {pose:?}: {estimate:?} {set:?} in {:?}",
                stage.success
            );
        }
    }
}

/// The margin found over the largest scale at which nothing escapes from the cells.
fn cell_ratio(margin: f64, escapes: impl Fn(f64) -> bool) -> Option<f64> {
    if margin == 0.0 || !escapes(2.0 * margin) {
        return None;
    }
    let (mut low, mut high) = (margin, 2.0 * margin);
    while high - low > 1e-4 * high {
        let middle = 0.5 * (low + high);
        if escapes(middle) {
            high = middle;
        } else {
            low = middle;
        }
    }
    Some(margin / high)
}

fn scaled(set: &PoseSet, by: f64) -> PoseSet {
    match set {
        PoseSet::Gaussian { cov, r2 } => PoseSet::Gaussian {
            cov: cov.map(|row| row.map(|v| v * by * by)),
            r2: *r2,
        },
        PoseSet::Bounded { translation, yaw } => PoseSet::Bounded {
            translation: translation * by,
            yaw: yaw * by,
        },
    }
}

fn core_set(
    [x_m, y_m, yaw_rad]: Pose,
    set: &PoseSet,
) -> Result<posegate::set::PoseSet, Impossible> {
    let estimate = Estimate { x_m, y_m, yaw_rad };
    match set {
        PoseSet::Gaussian { cov, r2 } => {
            let radius = RadiusSquared::from_q16((r2 * 65536.0).ceil() as u32).unwrap();
            posegate::set::PoseSet::gaussian(estimate, *cov, radius)
        }
        PoseSet::Bounded { translation, yaw } => {
            posegate::set::PoseSet::bounded(estimate, *translation, *yaw)
        }
    }
}

/// An extent about where estimates fall, and 30 to 200 cells across; some over the whole circle.
fn spec(rng: &mut Rng, random: &RandomWorld, layout: Layout) -> TableSpec {
    let mut low = [f64::INFINITY; 3];
    let mut high = [f64::NEG_INFINITY; 3];
    for _ in 0..100 {
        let pose = to_goal(
            random.world.goal,
            pose_from_deg(random_estimate(rng, &random.world)),
        );
        let pose = [pose[0], pose[1], oracle::wrap(pose[2]).to_degrees()];
        for axis in 0..3 {
            low[axis] = low[axis].min(pose[axis]);
            high[axis] = high[axis].max(pose[axis]);
        }
    }
    let rounded = |v: f64| (v * 1e4).round() / 1e4;
    let mut extent = Extent {
        x: [rounded(low[0] - 0.05), rounded(high[0] + 0.05)],
        y: [rounded(low[1] - 0.05), rounded(high[1] + 0.05)],
        yaw_deg: [rounded(low[2] - 2.0), rounded(high[2] + 2.0)],
    };
    if let SetDeg::Box { x, y, yaw_deg } = &random.set_deg {
        // The borders of the cells are then those of the set.
        extent = Extent {
            x: *x,
            y: *y,
            yaw_deg: *yaw_deg,
        };
    }
    if extent.yaw_deg[1] - extent.yaw_deg[0] > 300.0 || rng.chance(0.1) {
        let lo = rounded(rng.within(-180.0, 180.0));
        extent.yaw_deg = [lo, lo + 360.0];
    }
    let largest = (extent.x[1] - extent.x[0]).max(extent.y[1] - extent.y[0]);
    let xy = (largest / rng.log_within(30.0, 200.0) * 1e4).ceil() / 1e4;
    let yaw_deg = rng.log_within(0.5, 3.0);
    TableSpec {
        extent,
        step: Step { xy, yaw_deg },
        layout,
    }
}

fn success_set(random: &RandomWorld) -> SuccessSet {
    let pose3 = |[x, y, z, roll_deg, pitch_deg, yaw_deg]: [f64; 6]| Pose3Deg {
        x,
        y,
        z,
        roll_deg,
        pitch_deg,
        yaw_deg,
    };
    let shape = match &random.set_deg {
        SetDeg::Box { x, y, yaw_deg } => Shape::Box(BoxSet {
            x: *x,
            y: *y,
            yaw_deg: *yaw_deg,
        }),
        SetDeg::Footprint { footprint, region } => {
            Shape::Footprint(Footprint::new(footprint.clone(), region.clone()).unwrap())
        }
        SetDeg::Visibility {
            camera,
            mount_deg,
            tag_in_world_deg,
            tag_size,
            d_max,
            phi_max_deg,
            psi_max_deg,
            z_near,
        } => Shape::Visibility(Visibility {
            camera: Camera {
                width_px: camera.width,
                height_px: camera.height,
                fx: camera.fx,
                fy: camera.fy,
                cx: camera.cx,
                cy: camera.cy,
            },
            mount: pose3(*mount_deg),
            tag: Tag {
                size: *tag_size,
                pose: pose3(*tag_in_world_deg),
            },
            d_max: *d_max,
            phi_max_deg: *phi_max_deg,
            psi_max_deg: *psi_max_deg,
            z_near: *z_near,
        }),
    };
    let [x, y, yaw_deg] = random.goal_deg;
    SuccessSet {
        goal: PoseDeg { x, y, yaw_deg },
        shape,
    }
}
