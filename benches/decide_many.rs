//! Measures `contain::many`: nanoseconds for one set on one core and on all, and the share of sets that the filter
//! permits. Also measures the integer code on the same sets. Prints one JSON line for each figure; fails if
//! the goal for reference set A is missed or if any decision differs.
//!
//! `cargo bench --features std --bench decide_many`. A number is the best of 21 rounds over 100,000 sets, because other
//! processes may delay a round.

use posegate::contain::many::{Filter, decide_many};
use posegate::contain::{Decision, decide};
use posegate::set::{Estimate, InputError, PoseSet};
use posegate::table::Table;
use std::hint::black_box;
use std::process::ExitCode;
use std::time::Instant;

const SETS: usize = 100_000;
const ROUNDS: usize = 21;
/// Nanoseconds for one set about the goal of reference set A, one core.
const GOAL: f64 = 60.0;
/// Reference set A's table.
const A: &str = "see-t7";

/// The population that A permits; in the other one every border of the table is tried.
const PERMITTED: &str = "about the goal";

/// Poses and their covariances.
type Sets = (Vec<[f64; 3]>, Vec<[[f64; 3]; 3]>);

fn main() -> ExitCode {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/tables");
    let mut is_short = false;
    for name in [A, "dock", "see-left", "see-t7-grid"] {
        let bytes = std::fs::read(format!("{folder}/{name}.posegate")).expect("the table is there");
        let table = Table::parse(&bytes).expect("a table");
        for (population, place, reach) in [
            ("on the table", 0.5, [0.02, 0.2]),
            (PERMITTED, 0.1, [0.02, 0.1]),
        ] {
            let goal = if name == A && population == PERMITTED {
                GOAL
            } else {
                f64::INFINITY
            };
            is_short |= measure(&table, name, population, &sets(&table, place, reach), goal);
        }
    }
    ExitCode::from(u8::from(is_short))
}

/// Prints the figures of one table; returns `true` if a goal is missed.
fn measure(table: &Table<'_>, name: &str, population: &str, sets: &Sets, goal: f64) -> bool {
    let (poses, covariances) = sets;
    let radius = table.radius_squared();
    let filter = Filter::new(table, radius);
    let rows = || poses.iter().zip(covariances);
    let integers = |pose: &[f64; 3], covariance: &[[f64; 3]; 3]| {
        let [x_m, y_m, yaw_rad] = *pose;
        let estimate = Estimate { x_m, y_m, yaw_rad };
        PoseSet::gaussian(estimate, *covariance, radius).map(|set| decide(table, &set))
    };
    let mut expected = Vec::new();
    let by_integers = best(|| {
        expected = rows()
            .map(|(pose, covariance)| integers(pose, covariance))
            .collect();
    });
    let mut found: Vec<Result<Decision, InputError>> = Vec::new();
    let one = best(|| {
        found = rows()
            .map(|(pose, covariance)| filter.decide(*pose, covariance))
            .collect();
    });
    let is_same_on_one = found == expected;
    let all = best(|| found = decide_many(table, radius, poses, black_box(covariances)));
    let certain = rows().filter(|(pose, covariance)| filter.is_certain(**pose, covariance));
    let inside = expected
        .iter()
        .filter(|found| **found == Ok(Decision::Inside));
    let share = |count: usize| count as f64 / SETS as f64;
    let line = |what: &str, value: f64, unit: &str, goal: f64| {
        let goal = if goal.is_finite() {
            goal.to_string()
        } else {
            "null".into()
        };
        println!(
            "{{\"name\": \"decide_many, {name}, {population}: {what}\", \"value\": {value:.3}, \"unit\": \"{unit}\", \"goal\": {goal}}}"
        );
    };
    let none = f64::INFINITY;
    line("one core", one, "ns/set", goal);
    line("all cores", all, "ns/set", none);
    line("integer code alone, one core", by_integers, "ns/set", none);
    line(
        "share permitted by the filter",
        share(certain.count()),
        "1",
        none,
    );
    line("share permitted", share(inside.count()), "1", none);
    let is_same = is_same_on_one && found == expected;
    if !is_same {
        eprintln!("{name}, {population}: a decision differs from the integer code's");
    }
    !is_same || one > goal
}

/// Returns the shortest time of a round, nanoseconds for one set.
fn best(mut round: impl FnMut()) -> f64 {
    let times = (0..ROUNDS).map(|_| {
        let start = Instant::now();
        round();
        start.elapsed().as_secs_f64() * 1e9 / SETS as f64
    });
    times.fold(f64::INFINITY, f64::min)
}

/// Returns sets with estimates up to a share of the table's width from the middle of its cells, and a reach that is a share of it.
fn sets(table: &Table<'_>, place: f64, [least, most]: [f64; 2]) -> Sets {
    let mut state = 0x9e37_79b9_7f4a_7c15u64;
    let mut random = |low: f64, high: f64| {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        low + (high - low) * (state >> 11) as f64 / 9_007_199_254_740_992.0
    };
    let cells = table.cells();
    let (goal, step) = (table.goal(), f64::from(cells.step_um) * 1e-6);
    let turn = std::f64::consts::TAU / 4_294_967_296.0;
    let width = [
        step * f64::from(cells.columns),
        step * f64::from(cells.rows),
        cells.yaw_span as f64 * turn,
    ];
    let low = [
        f64::from(cells.x_lo_um) * 1e-6,
        f64::from(cells.y_lo_um) * 1e-6,
        f64::from(cells.yaw_lo.0) * turn,
    ];
    let (c, s) = (
        f64::from(goal.cos_q30) / 1_073_741_824.0,
        f64::from(goal.sin_q30) / 1_073_741_824.0,
    );
    let r = (f64::from(table.radius_squared().q16()) / 65_536.0).sqrt();
    (0..SETS)
        .map(|_| {
            let [x, y, yaw] = [0, 1, 2].map(|k| low[k] + width[k] * (0.5 + random(-place, place)));
            let pose = [
                f64::from(goal.pose.x_um) * 1e-6 + c * x - s * y,
                f64::from(goal.pose.y_um) * 1e-6 + s * x + c * y,
                f64::from(goal.pose.yaw.0) * turn + yaw,
            ];
            let sigma = [0, 1, 2].map(|k| width[k] * random(least, most) / r);
            let [a, b, free] = [0; 3].map(|_| random(-0.9, 0.9));
            let between = a * b + ((1.0 - a * a) * (1.0 - b * b)).sqrt() * free;
            let entry = |i: usize, j: usize, rho: f64| rho * sigma[i] * sigma[j];
            let (xy, xt, yt) = (entry(0, 1, between), entry(0, 2, a), entry(1, 2, b));
            let covariance = [
                [entry(0, 0, 1.0), xy, xt],
                [xy, entry(1, 1, 1.0), yt],
                [xt, yt, entry(2, 2, 1.0)],
            ];
            (pose, covariance)
        })
        .unzip()
}
