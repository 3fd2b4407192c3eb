//! The worst pose of a denial is a pose of the given pose-set, for small and thin sets too.

use posegate_testkit::{counts, oracle};

use oracle::{Pose, PoseSet as Given, Rng, level};
use posegate::contain::{Decision, decide, examine};
use posegate::set::{CrossTerms, Estimate, Inflation, PoseSet, SplitWeight, Trust, Uncertainty};
use posegate::table::Table;
use posegate_replay::coordinates;
use std::path::Path;

/// Facets of a box, facets of a visibility set, cells, and twice facets in several pieces.
const TABLES: [&str; 6] = [
    "examples/tables/dock.posegate",
    "examples/tables/see-t7.posegate",
    "examples/tables/see-t7-grid.posegate",
    "tests/data/over-180.posegate",
    "tests/data/over-180-grid.posegate",
    "tests/data/corner.posegate",
];

/// A random set near a table's border: semi-axes from micrometres to decimetres, correlated at random.
fn random(rng: &mut Rng, r2: f64) -> (Given, Uncertainty) {
    if rng.chance(0.3) {
        let translation = rng.log_within(1e-6, 0.3);
        let yaw = rng.log_within(1e-7, 0.1);
        let spread = Uncertainty::Bounded {
            translation_m: translation,
            yaw_rad: yaw,
        };
        return (Given::Bounded { translation, yaw }, spread);
    }
    let [sx, sy, st] = [(1e-6, 0.1), (1e-6, 0.1), (1e-7, 0.05)].map(|(a, b)| rng.log_within(a, b));
    // Correlations of a product of random rows.
    let strength = if rng.chance(0.3) {
        0.0
    } else {
        rng.unit() * 3.0
    };
    let rows: [[f64; 3]; 3] = core::array::from_fn(|i| {
        let row: [f64; 3] = core::array::from_fn(|j| {
            f64::from(u8::from(i == j)) + strength * rng.within(-1.0, 1.0)
        });
        let length = row.iter().map(|v| v * v).sum::<f64>().sqrt();
        row.map(|v| v / length)
    });
    let sigma = [sx, sy, st];
    let cov: [[f64; 3]; 3] = core::array::from_fn(|i| {
        core::array::from_fn(|j| {
            let dot: f64 = (0..3).map(|k| rows[i][k] * rows[j][k]).sum();
            sigma[i] * sigma[j] * if i == j { 1.0 } else { dot }
        })
    });
    (Given::Gaussian { cov, r2 }, Uncertainty::Gaussian(cov))
}

fn read(path: &str) -> Vec<u8> {
    std::fs::read(Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join(path)).unwrap()
}

fn estimate_of([x_m, y_m, yaw_rad]: Pose) -> Estimate {
    Estimate { x_m, y_m, yaw_rad }
}

#[test]
fn worst_poses_are_in_the_given_set() {
    let mut rng = Rng::new(11 + counts::first_seed());
    let sets = if counts::is_deep() { 4_000 } else { 1_000 };
    let (mut denials, mut near, mut at_estimate) = (0u32, 0u32, 0u32);
    for path in TABLES {
        let bytes = read(path);
        let table = Table::parse(&bytes).unwrap();
        let radius = table.radius_squared();
        let goal = coordinates(table.goal().pose);
        // Estimates near the border, found by a search outwards from the goal with a tiny set.
        for _ in 0..sets {
            let direction = rng.within(-3.2, 3.2);
            let turn = rng.within(-0.1, 0.1);
            let tiny = |far: f64| {
                let pose = [
                    goal[0] + far * direction.cos(),
                    goal[1] + far * direction.sin(),
                    goal[2] + turn,
                ];
                let set = PoseSet::bounded(estimate_of(pose), 1e-6, 1e-7).unwrap();
                (pose, decide(&table, &set) == Decision::Inside)
            };
            let (mut low, mut high) = (0.0, 6.0);
            if !tiny(low).1 || tiny(high).1 {
                continue;
            }
            for _ in 0..24 {
                let middle = 0.5 * (low + high);
                if tiny(middle).1 {
                    low = middle
                } else {
                    high = middle
                }
            }
            let (given, spread) = random(&mut rng, f64::from(radius.q16()) / 65_536.0);
            let estimate = tiny((low - rng.log_within(1e-6, 0.05)).max(0.0)).0;
            let mean = PoseSet::bounded(estimate_of(estimate), 1.0, 1.0)
                .unwrap()
                .mean();
            let Ok(set) = PoseSet::trusted(mean, spread, radius, Trust::FULL) else {
                continue;
            };
            let examination = examine(&table, &set);
            let Some(worst) = examination.worst_pose else {
                continue;
            };
            denials += 1;
            let out = level(&given, estimate, coordinates(worst));
            if worst == set.mean() {
                at_estimate += 1;
                // Estimates are rounded to micrometres, so one may lie outside of a thinner set.
                continue;
            }
            assert!(
                out <= 1.0,
                "{path}: {worst:?} is {out} times as far out as the border of {spread:?} about {estimate:?}"
            );
            // The pose that leaves first as the set grows: on the border of the set scaled by the margin.
            let margin = f64::from(examination.margin.q16()) / 65_536.0;
            near += u32::from(out > 0.9 * margin);
        }
    }
    println!("{denials} denials, {near} where the set leaves, {at_estimate} at the estimate");
    assert!(denials > sets, "{denials}");
    assert!(near * 2 > denials, "{near} of {denials}");
    assert!(at_estimate * 5 < denials, "{at_estimate} of {denials}");
}

/// The worst pose of sets that are millimetres long and micrometres thin, round or rotated, inflated or not, is in
/// the set.
#[test]
fn worst_pose_of_a_thin_set_is_in_the_set() {
    let bytes = read("examples/tables/dock.posegate");
    let table = Table::parse(&bytes).unwrap();
    let radius = table.radius_squared();
    let r2 = f64::from(radius.q16()) / 65_536.0;
    for um in [2.0, 3.0, 5.0, 10.0, 30.0, 100.0, 300.0, 999.0] {
        for (inflation, share) in [(1.0, None), (2.5, None), (1.0, Some(SplitWeight::HALF))] {
            for turn in [0.0f64, 0.3, 1.0, 1.57] {
                let (s, c) = turn.sin_cos();
                let (long, thin) = (25e-6, (um * 1e-6) * (um * 1e-6));
                let cross = (long - thin) * s * c;
                let cov = |by: f64| {
                    [
                        [by * (long * c * c + thin * s * s), by * cross, 0.0],
                        [by * cross, by * (long * s * s + thin * c * c), 0.0],
                        [0.0, 0.0, by * 1e-6],
                    ]
                };
                let trust = Trust {
                    inflation: Inflation::new(inflation).unwrap(),
                    cross_terms: share.map_or(CrossTerms::Filled, CrossTerms::YawUnknown),
                };
                // The border along x is 0.08 m from the goal at the origin: the nearest estimate that is denied.
                let at = |far: f64| {
                    let estimate = [0.08 - far, 0.001, 0.0];
                    let mean = PoseSet::bounded(estimate_of(estimate), 1.0, 1.0)
                        .unwrap()
                        .mean();
                    let set =
                        PoseSet::trusted(mean, Uncertainty::Gaussian(cov(1.0)), radius, trust)
                            .unwrap();
                    (estimate, set, examine(&table, &set))
                };
                let (mut denied, mut permitted) = (0.0, 0.06);
                for _ in 0..20 {
                    let middle = 0.5 * (denied + permitted);
                    if at(middle).2.decision == Decision::Inside {
                        permitted = middle;
                    } else {
                        denied = middle;
                    }
                }
                // Half of the set's extent along x is beyond the border.
                let (estimate, set, examination) = at(0.5 * denied);
                let Some(worst) = examination.worst_pose else {
                    // Micrometres are rounded, and a pose less than a length unit (8 um) beyond the facets is not named.
                    assert!(0.5 * denied < 30e-6, "{um} um, {turn} rad: {denied}");
                    continue;
                };
                let by = if share.is_some() { 2.0 } else { inflation };
                let given = Given::Gaussian { cov: cov(by), r2 };
                let out = level(&given, estimate, coordinates(worst));
                let margin = f64::from(examination.margin.q16()) / 65_536.0;
                assert!(
                    worst != set.mean() && out <= 1.0 && out > 0.5 && margin < 1.0,
                    "{um} um, {turn} rad, {trust:?}: {worst:?} at {out}, margin {margin}"
                );
            }
        }
    }
}

/// On the facets of a box, every denial names a pose outside of the box, by its place or by its heading.
#[test]
fn worst_pose_on_a_box_is_outside_of_the_box() {
    let bytes = read("examples/tables/dock.posegate");
    let table = Table::parse(&bytes).unwrap();
    let radius = table.radius_squared();
    let mut rng = Rng::new(17 + counts::first_seed());
    let goal = coordinates(table.goal().pose);
    let half = [0.08, 0.06, 4f64.to_radians()];
    // The place or the heading of a pose beyond the box, metres or radians.
    let beyond = |pose: Pose| {
        let [x, y, yaw] = oracle::to_goal(goal, pose);
        let off = [x, y, oracle::wrap(yaw)];
        (0..3)
            .map(|k| off[k].abs() - half[k])
            .fold(f64::NEG_INFINITY, f64::max)
    };
    let (mut denials, mut by_heading, mut unnamed) = (0, 0, 0);
    for _ in 0..if counts::is_deep() { 200_000 } else { 10_000 } {
        let estimate = oracle::to_world(goal, half.map(|most| rng.within(-most, most)));
        let sigma =
            [(0.001, 0.02), (0.001, 0.02), (0.002, 0.05)].map(|(a, b)| rng.log_within(a, b));
        let cov = core::array::from_fn(|i| {
            core::array::from_fn(|j| if i == j { sigma[i] * sigma[i] } else { 0.0 })
        });
        let set = PoseSet::gaussian(estimate_of(estimate), cov, radius).unwrap();
        let examination = examine(&table, &set);
        if examination.decision == Decision::Inside {
            continue;
        }
        denials += 1;
        let Some(worst) = examination.worst_pose else {
            // The set leaves by less than its rounding outwards.
            unnamed += 1;
            let margin = f64::from(examination.margin.q16()) / 65_536.0;
            assert!(margin > 0.99, "{estimate:?} {sigma:?}: {margin}");
            continue;
        };
        let pose = coordinates(worst);
        let given = Given::Gaussian {
            cov,
            r2: f64::from(radius.q16()) / 65_536.0,
        };
        assert!(
            level(&given, estimate, pose) <= 1.0,
            "{estimate:?} {sigma:?}: {pose:?}"
        );
        // The table's borders are rounded by some micrometres.
        let out = beyond(pose);
        assert!(
            out > -2e-5,
            "{estimate:?} {sigma:?}: {pose:?} is inside by {out}"
        );
        let [_, _, yaw] = oracle::to_goal(goal, pose);
        by_heading += u32::from(oracle::wrap(yaw).abs() > half[2]);
    }
    println!("{denials} denials, {by_heading} by the heading, {unnamed} without a pose");
    assert!(denials > 1_000 && by_heading > denials / 10);
    assert!(unnamed * 50 < denials, "{unnamed} of {denials}");
}
