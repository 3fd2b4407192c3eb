//! Measures the budgets of the host: bytes, seconds to bake and to prove, voxels baked per second.
//! Prints one JSON line each; fails if a goal is missed. Run by `ci.sh budgets`.
//!
//! Seconds are the best of five, because other processes may delay a run. Voxels per second are all
//! voxels of the table over the median time of twenty bakings on one thread.

use posegate::bake::{BakeInput, Layout, Step, TableSpec, grid, table};
use posegate::table::Table;
use posegate::verify::{ExpectedTable, verify};
use posegate_site::Site;
use std::process::ExitCode;
use std::time::Instant;

enum Goal {
    None,
    AtMost(f64),
    AtLeast(f64),
}

fn main() -> ExitCode {
    let text = include_str!("../../../examples/sites/dock.toml");
    let site = Site::parse(text, "dock.toml").expect("the site is valid");
    let task = site.task("see-t7").expect("the site has the task");
    let one_thread = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .expect("a thread starts");
    let claim = ExpectedTable {
        task: "see-t7",
        success: &task.success,
        epsilon: site.epsilon,
    };
    let order = |spec: TableSpec| BakeInput {
        task: claim.task,
        success: claim.success,
        spec,
        epsilon: claim.epsilon,
    };
    let mut short = false;
    let mut line = |name: &str, value: f64, unit: &str, goal: Goal| {
        let (goal_text, reached) = match goal {
            Goal::None => ("null".to_string(), true),
            Goal::AtMost(goal) => (goal.to_string(), value <= goal),
            Goal::AtLeast(goal) => (goal.to_string(), value >= goal),
        };
        println!(
            "{{\"name\": \"{name}\", \"value\": {value}, \"unit\": \"{unit}\", \"goal\": {goal_text}}}"
        );
        short |= !reached;
    };
    for (label, step, bake_goal, bytes_goal) in [
        (
            "2 cm / 1 deg",
            Step {
                xy: 0.02,
                yaw_deg: 1.0,
            },
            1.0,
            Goal::AtMost(16_000.0),
        ),
        (
            "1 cm / 0.5 deg",
            Step {
                xy: 0.01,
                yaw_deg: 0.5,
            },
            10.0,
            Goal::None,
        ),
    ] {
        let mut spec = *site
            .table_spec(task)
            .expect("the site describes its tables");
        spec.step = step;
        let order = order(spec);
        let mut bytes = Vec::new();
        let bake = best(&times(5, || {
            bytes = grid(&order, &|| ()).expect("the table is baked");
        }));
        let alone = one_thread.install(|| {
            median(times(20, || {
                grid(&order, &|| ()).expect("the table is baked");
            }))
        });
        let mut proven = 0;
        let prove = best(&times(5, || {
            proven = verify(&bytes, &claim, &|| ())
                .expect("the table is proven")
                .cells;
        }));
        let cells = spec.cells().expect("the cells fit");
        let all = f64::from(cells.columns) * f64::from(cells.rows) * f64::from(cells.slabs);
        line(
            &format!("grid A at {label}: bytes"),
            bytes.len() as f64,
            "B",
            bytes_goal,
        );
        line(
            &format!("grid A at {label}: bake and prove"),
            bake + prove,
            "s",
            Goal::AtMost(bake_goal),
        );
        line(&format!("grid A at {label}: bake"), bake, "s", Goal::None);
        line(
            &format!("grid A at {label}: prove"),
            prove,
            "s",
            Goal::AtMost(bake_goal),
        );
        line(
            &format!("grid generation {label}, one core"),
            (all / alone).round(),
            "voxels/s",
            Goal::AtLeast(1e9),
        );
        line(
            &format!("grid A at {label}: share of cells proven"),
            proven as f64 / all,
            "1",
            Goal::None,
        );
    }
    let mut spec = *site
        .table_spec(task)
        .expect("the site describes its tables");
    spec.layout = Layout::Facets;
    let order = order(spec);
    let mut bytes = Vec::new();
    let bake = one_thread.install(|| {
        median(times(20, || {
            bytes = table(&order, &|| ()).expect("the table is baked");
        }))
    });
    let prove = best(&times(5, || {
        verify(&bytes, &claim, &|| ()).expect("the table is proven");
    }));
    let parsed = Table::parse(&bytes).expect("the table parses");
    let layout = parsed.facets().expect("the table has facets");
    let counts = [
        (
            "facets A: bytes of the layout",
            layout.byte_length(),
            Goal::AtMost(5_000.0),
        ),
        ("facets A: bytes of the table", bytes.len(), Goal::None),
        ("facets A: frames", layout.frame_count(), Goal::None),
        ("facets A: facets", layout.facet_count(), Goal::None),
    ];
    for (name, count, goal) in counts {
        let unit = if name.contains("bytes") { "B" } else { "1" };
        line(name, count as f64, unit, goal);
    }
    line("facets A: bake, one core", bake, "s", Goal::AtMost(0.01));
    line("facets A: prove", prove, "s", Goal::AtMost(1.0));
    ExitCode::from(u8::from(short))
}

/// Returns the seconds of each of several repetitions.
fn times(count: u32, mut work: impl FnMut()) -> Vec<f64> {
    (0..count)
        .map(|_| {
            let started = Instant::now();
            work();
            started.elapsed().as_secs_f64()
        })
        .collect()
}

fn best(seconds: &[f64]) -> f64 {
    seconds.iter().copied().fold(f64::INFINITY, f64::min)
}

fn median(mut seconds: Vec<f64>) -> f64 {
    seconds.sort_by(f64::total_cmp);
    let middle = seconds.len() / 2;
    0.5 * (seconds[middle - 1] + seconds[middle])
}
