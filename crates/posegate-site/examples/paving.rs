//! Measures the proven share of a success set, and the speed. Prints one JSON line each; fails if a goal is missed.
//! Run by `ci.sh paving`, which prints codac's figures for the same set.
//!
//! Volumes are in codac's unit, in which a degree of yaw counts as 2 cm: cubic metres.

use posegate::bake::{BakeInput, Layout, Step, TableSpec};
use posegate::contain::{Decision, decide};
use posegate::set::{Estimate, PoseSet};
use posegate::table::Table;
use posegate::verify::{ExpectedTable, build, verify, volume};
use posegate_site::Site;
use std::process::ExitCode;
use std::time::Instant;

enum Goal {
    None,
    AtMost(f64),
    AtLeast(f64),
}

/// Metres per radian in codac's unit.
const METRES: f64 = 180.0 / std::f64::consts::PI * 0.02;

struct Lines {
    short: bool,
}

impl Lines {
    fn line(&mut self, name: &str, value: f64, unit: &str, goal: Goal) {
        let (text, reached) = match goal {
            Goal::None => ("null".to_string(), true),
            Goal::AtMost(goal) => (goal.to_string(), value <= goal),
            Goal::AtLeast(goal) => (goal.to_string(), value >= goal),
        };
        println!(
            "{{\"name\": \"{name}\", \"value\": {value}, \"unit\": \"{unit}\", \"goal\": {text}}}"
        );
        self.short |= !reached;
    }
}

fn main() -> ExitCode {
    let mut lines = Lines { short: false };
    paving(&mut lines);
    lens(&mut lines);
    share(&mut lines);
    if lines.short {
        ExitCode::FAILURE
    } else {
        ExitCode::SUCCESS
    }
}

fn site(text: &str) -> Site {
    Site::parse(text, "site.toml").expect("the site is valid")
}

fn order<'a>(site: &'a Site, task: &'a str, layout: Layout, step: Step) -> BakeInput<'a> {
    let found = site.task(task).expect("the site has the task");
    let spec = site.chosen_table(found).expect("a table");
    BakeInput {
        task,
        success: &found.success,
        spec: TableSpec {
            step,
            layout,
            ..spec
        },
        epsilon: site.epsilon,
    }
}

/// Returns the bytes, and the least seconds of ten runs to bake and prove them on one thread: processor time, as codac's.
fn built(order: &BakeInput<'_>) -> (Vec<u8>, f64) {
    let mut best = (Vec::new(), f64::INFINITY);
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build();
    let one = one.expect("a thread");
    for _ in 0..10 {
        let start = Instant::now();
        let (bytes, _) = one.install(|| build(order, &|| ()).expect("a proven table"));
        best = (bytes, best.1.min(start.elapsed().as_secs_f64()));
    }
    best
}

fn paving(lines: &mut Lines) {
    let site = site(include_str!("../../../examples/sites/paving.toml"));
    let coarse = Step {
        xy: 0.02,
        yaw_deg: 1.0,
    };
    let fine = Step {
        xy: 0.01,
        yaw_deg: 0.5,
    };
    // The chords of facets follow a curve to half of the step.
    let finest = Step { xy: 0.004, ..fine };
    for (name, layout, step, least) in [
        ("facets, 2 cm / 1 deg", Layout::Facets, coarse, Some(6.16)),
        ("facets, 4 mm / 0.5 deg", Layout::Facets, finest, Some(6.25)),
        ("grid, 2 cm / 1 deg", Layout::Grid, coarse, None),
        ("grid, 1 cm / 0.5 deg", Layout::Grid, fine, None),
    ] {
        let order = order(&site, "see", layout, step);
        let (bytes, seconds) = built(&order);
        let table = Table::parse(&bytes).expect("a table");
        let volume = volume(&table, order.success);
        let volume = volume.cells.or(volume.facets).expect("a volume") * METRES;
        let claim = ExpectedTable {
            task: order.task,
            success: order.success,
            epsilon: order.epsilon,
        };
        let start = Instant::now();
        verify(&bytes, &claim, &|| ()).expect("a proof");
        let proof = start.elapsed().as_secs_f64();
        let (least, most) = match least {
            Some(least) => (Goal::AtLeast(least), Goal::AtMost(0.2)),
            None => (Goal::None, Goal::None),
        };
        let line = |what: &str| format!("paving, {name}: {what}");
        lines.line(&line("proven inside"), volume, "m3", least);
        lines.line(&line("baked and proven"), seconds, "s", most);
        lines.line(&line("proven again"), proof, "s", Goal::AtMost(5.0));
        lines.line(&line("table"), bytes.len() as f64, "B", Goal::None);
    }
}

fn lens(lines: &mut Lines) {
    let site = site(include_str!("../../../examples/sites/lens.toml"));
    let step = Site::DEFAULT_STEP;
    let (bytes, seconds) = built(&order(&site, "see", Layout::Facets, step));
    let name = "reference set A through a plumb_bob lens, facets";
    lines.line(name, seconds * 1e3, "ms", Goal::AtMost(50.0));
    lines.line("the same: table", bytes.len() as f64, "B", Goal::None);
}

/// Prints the share of the true set that facets contain, by evenly distributed poses of the set.
fn share(lines: &mut Lines) {
    const POSES: usize = 400_000;
    for (name, text, task) in [
        (
            "reference set A",
            include_str!("../../../examples/sites/dock.toml"),
            "see-t7",
        ),
        (
            "the paved set",
            include_str!("../../../examples/sites/paving.toml"),
            "see",
        ),
        (
            "reference set A through a lens",
            include_str!("../../../examples/sites/lens.toml"),
            "see",
        ),
    ] {
        let site = site(text);
        let order = order(&site, task, Layout::Facets, Site::DEFAULT_STEP);
        let (bytes, _) = built(&order);
        let table = Table::parse(&bytes).expect("a table");
        let (mut inside, mut held) = (0u32, 0u32);
        let extent = order.spec.extent;
        let goal = order.success.goal;
        let (sin, cos) = goal.yaw_deg.to_radians().sin_cos();
        for index in 0..POSES {
            // Evenly distributed, by the fractions of multiples of irrational numbers.
            let share = |step: f64| (0.5 + index as f64 * step).fract();
            let at = |[lo, hi]: [f64; 2], share: f64| lo + share * (hi - lo);
            let (x, y) = (
                at(extent.x, share(0.819_172_513_396_164_4)),
                at(extent.y, share(0.671_043_606_703_789_3)),
            );
            let yaw = at(extent.yaw_deg, share(0.549_700_477_901_970_2)).to_radians();
            let world = [
                goal.x + cos * x - sin * y,
                goal.y + sin * x + cos * y,
                yaw + goal.yaw_deg.to_radians(),
            ];
            if !order.success.membership(world).inside {
                continue;
            }
            inside += 1;
            let estimate = Estimate {
                x_m: world[0],
                y_m: world[1],
                yaw_rad: world[2],
            };
            let set = PoseSet::bounded(estimate, 1e-5, 1e-5).expect("a small set");
            held += u32::from(decide(&table, &set) == Decision::Inside);
        }
        lines.line(
            &format!("{name}: share of its poses that facets hold"),
            f64::from(held) / f64::from(inside),
            "",
            Goal::AtLeast(0.99),
        );
    }
}
