//! Chooses the fewest tags for a warehouse of 100 docks and 2,000 candidates. Prints cost, bound, gap and time as
//! JSON lines. The judge of `crates/posegate-plan/tests/planning` executes the plans on the written site. Fails if a
//! goal is missed. Run by `ci.sh cover`. Optional arguments: aisles, docks, candidates, and a file for the written
//! site.

use posegate::shape::Shape;
use posegate_plan::cover::{CoverOptions, cover, written};
use posegate_plan::{Options, Plan, Prepared, StepKind};
use posegate_site::{DriveModel, Site, StartUncertainty};
use std::process::ExitCode;
use std::time::Instant;

#[allow(dead_code)]
use posegate_testkit::judge;
#[allow(dead_code)]
use posegate_testkit::planning_sites as sites;
use posegate_testkit::warehouse;

use judge::{Model, Robot, Set, Start, Step, run};
use sites::Random;

/// Number of runs of each plan.
const RUNS: u64 = 2_000;

fn line(name: &str, value: f64, unit: &str, goal: Option<f64>) -> bool {
    let text = goal.map_or("null".to_owned(), |goal| goal.to_string());
    println!(
        "{{\"name\": \"cover: {name}\", \"value\": {value}, \"unit\": \"{unit}\", \"goal\": {text}}}"
    );
    goal.is_none_or(|goal| value <= goal)
}

/// Returns the processor seconds of this process.
fn processor() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let after = stat.rsplit(')').next().unwrap_or_default();
    let ticks = after.split_whitespace().skip(11).take(2);
    ticks
        .filter_map(|ticks| ticks.parse::<f64>().ok())
        .sum::<f64>()
        / 100.0
}

fn main() -> ExitCode {
    let number = |at: usize, default: usize| {
        let given = std::env::args().nth(at);
        given.map_or(default, |given| given.parse().expect("a number"))
    };
    let (aisles, docks, candidates) = (number(1, 10), number(2, 100), number(3, 2_000));
    let text = warehouse::warehouse(1, aisles, 40.0, docks, candidates);
    let site = Site::parse(&text, "warehouse.toml").expect("the site is valid");
    let begin = Instant::now();
    let found = cover(&site, &CoverOptions::default(), &|_, _| ()).expect("a cover");
    let seconds = begin.elapsed().as_secs_f64();
    let processor = processor();
    let mut good = true;
    let unserved = found.tasks.iter().filter(|task| task.reason.is_some());
    for task in unserved.clone() {
        eprintln!(
            "{}: {}",
            task.task,
            task.reason.as_deref().unwrap_or_default()
        );
    }
    line("endpoints", docks as f64, "tasks", None);
    line("candidates", candidates as f64, "candidates", None);
    good &= line(
        "tasks without a plan",
        unserved.count() as f64,
        "tasks",
        Some(0.0),
    );
    line("tags chosen", found.tags.len() as f64, "tags", None);
    line("cost", found.cost, "cost", None);
    line("bound", found.bound, "cost", None);
    line("bound by prices alone", found.bound_checked, "cost", None);
    good &= line("gap", found.gap(), "share", Some(0.05));
    line("rounds", found.rounds as f64, "rounds", None);
    line("plans made", found.plans as f64, "plans", None);
    good &= line("time", seconds, "s", Some(300.0));
    line("processor time", processor, "s", None);

    let text = written(&text, "warehouse.toml", &found).expect("a site file");
    if let Some(path) = std::env::args().nth(4) {
        std::fs::write(path, &text).expect("a file that can be written");
    }
    let site = Site::parse(&text, "warehouse.toml").expect("a valid site");
    good &= judged(&site);
    if good {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    }
}

/// Plans again on the written site, and executes the plans.
fn judged(site: &Site) -> bool {
    let Some(DriveModel::Bounded(drift)) = site.navigation.model else {
        panic!("robots drive by bounds");
    };
    let controller = site.navigation.controller;
    let robot = Robot {
        model: Model::Bounded([drift.k_turn, drift.k_drift, drift.k_slip]),
        controller: [controller.translation, controller.turn_deg.to_radians()],
    };
    let mut prepared = Prepared::of(site, None).expect("a library");
    let (mut planned, mut failed, mut runs) = (0, 0, 0);
    for (seed, (name, task)) in site.tasks.iter().enumerate() {
        let from = task.from.as_ref().expect("a start");
        let start = site.chains[from].start.toward(task.success.goal);
        let found = prepared.plan(&start, name, &Options::default());
        let Some(plan) = found.expect("an answer").plan else {
            continue;
        };
        planned += 1;
        let steps = steps(site, &plan);
        let StartUncertainty::Bounded {
            translation,
            yaw_deg,
        } = start.known
        else {
            panic!("starts are bounded");
        };
        let known = Start::Bounded([translation, yaw_deg.to_radians()]);
        let pose = [start.pose.x, start.pose.y, start.pose.yaw_deg.to_radians()];
        let mut random = Random(seed as u64);
        for _ in 0..RUNS {
            runs += 1;
            failed += u32::from(run(&mut random, pose, known, &robot, &steps).is_some());
        }
    }
    let without = site.tasks.len() - planned;
    let all = line(
        "without a plan on the written site",
        without as f64,
        "tasks",
        Some(0.0),
    );
    line("runs of their plans", f64::from(runs), "runs", None);
    line("runs that failed", f64::from(failed), "runs", Some(0.0)) && all
}

/// Returns the steps of a plan for the judge, from the numbers of the site file.
fn steps(site: &Site, plan: &Plan) -> Vec<Step> {
    let walls: Vec<Vec<[f64; 2]>> = site.walls.iter().map(|wall| wall.corners.clone()).collect();
    plan.steps
        .iter()
        .map(|step| match step.report.kind {
            StepKind::Navigation => Step::Drive {
                to: step.report.after.pose,
            },
            StepKind::Work => {
                let task = &site.tasks[step.report.task.as_deref().expect("a task")];
                let goal = task.success.goal;
                let Shape::Box(set) = &task.success.shape else {
                    panic!("docks are boxes");
                };
                Step::Work {
                    set: Set::Box {
                        goal: [goal.x, goal.y, goal.yaw_deg.to_radians()],
                        x: set.x[1],
                        y: set.y[1],
                        yaw: set.yaw_deg[1].to_radians(),
                    },
                }
            }
            StepKind::Localization => {
                let tag = &site.tags[&step.tags[0]].tag;
                let at = tag.pose;
                Step::Look {
                    set: Set::Past {
                        pose: [at.x, at.y, at.z, at.yaw_deg.to_radians()],
                        size: tag.size,
                        bit_px: 4.0,
                        walls: walls.clone(),
                    },
                    bound: step.report.after.certain,
                    doubt: 0.0,
                }
            }
        })
        .collect()
}
