//! Measures the time and memory of plans. Prints one JSON line each; fails if a goal is missed. Run by
//! `ci.sh planning`.

#[path = "support/curves.rs"]
mod curves;

use curves::logarithmic;
use posegate_plan::{Options, Prepared, Status};
use posegate_site::Site;
use std::process::ExitCode;
use std::time::Instant;

use posegate_testkit::planning_sites as sites;

use sites::{Drive, Random, hall};

/// The paper's chain (Fig. 3): 1 m and 2 degrees, one tag, r_l of 5 cm and 2 degrees, a work task of centimetres.
const PAPER: &str = include_str!("../../../examples/sites/paper-chain.toml");

/// Seconds by the number of tags.
#[derive(Default)]
struct Growth {
    library: Vec<[f64; 2]>,
    plan: Vec<[f64; 2]>,
}

impl Growth {
    fn draw(&self) -> String {
        logarithmic(
            "What planning takes as a site grows",
            ["tags", "seconds"],
            &[
                (
                    "the library: tables, places, what leads where",
                    &self.library,
                ),
                ("one more plan, proven", &self.plan),
            ],
        )
    }
}

fn line(name: &str, value: f64, unit: &str, goal: Option<f64>) -> bool {
    let text = goal.map_or("null".to_owned(), |goal| goal.to_string());
    println!(
        "{{\"name\": \"{name}\", \"value\": {value}, \"unit\": \"{unit}\", \"goal\": {text}}}"
    );
    goal.is_none_or(|goal| value <= goal)
}

/// Returns the peak memory of this process, MiB.
fn peak() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find(|line| line.starts_with("VmHWM"));
    let kib = line.and_then(|line| line.split_whitespace().nth(1)?.parse::<f64>().ok());
    kib.unwrap_or(f64::NAN) / 1024.0
}

fn main() -> ExitCode {
    let mut good = true;
    good &= paper();
    let mut growth = Growth::default();
    for tags in [10, 30, 100, 200, 500, 1000] {
        let docks = if tags == 200 { 500 } else { 20 };
        good &= plant(tags, docks, &mut growth);
    }
    if let Some(path) = std::env::args().nth(1) {
        std::fs::write(&path, growth.draw()).expect("the plot can be written");
    }
    good &= line("planning: peak memory", peak(), "MiB", Some(1024.0));
    if good {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    }
}

fn paper() -> bool {
    let site = Site::parse(PAPER, "paper-chain.toml").expect("the site is valid");
    let chain = &site.chains["back-to-dock"];
    let mut times = Vec::new();
    let mut found = false;
    for _ in 0..9 {
        let begin = Instant::now();
        let mut prepared = Prepared::of(&site, None).expect("a library");
        let planned = prepared
            .plan(&chain.start, "dock", &Options::default())
            .expect("an answer");
        times.push(begin.elapsed().as_secs_f64() * 1e3);
        found = planned.status == Status::Optimal
            && planned.plan.is_some_and(|plan| plan.report().succeeds());
    }
    times.sort_by(f64::total_cmp);
    let guaranteed = line(
        "planning: the paper's chain is found and guaranteed",
        f64::from(u8::from(!found)),
        "failures",
        Some(0.0),
    );
    line(
        "planning: the paper's chain, library, plan and proofs",
        times[4],
        "ms",
        Some(10.0),
    ) && guaranteed
}

fn plant(tags: usize, docks: usize, growth: &mut Growth) -> bool {
    let text = hall(&mut Random(7), tags, docks, Drive::Bounded);
    let site = Site::parse(&text, "hall.toml").expect("the site is valid");
    let begin = Instant::now();
    let mut prepared = Prepared::of(&site, None).expect("a library");
    let library = begin.elapsed().as_secs_f64();
    let mut plans = 0;
    for dock in 0..docks {
        let chain = &site.chains[&format!("to{dock}")];
        let planned = prepared
            .plan(&chain.start, &format!("dock{dock}"), &Options::default())
            .expect("an answer");
        assert!(matches!(
            planned.status,
            Status::Optimal | Status::Infeasible
        ));
        plans += usize::from(planned.plan.is_some());
    }
    let seconds = begin.elapsed().as_secs_f64();
    let name = |what: &str| format!("planning: {tags} tags, {docks} work tasks, {what}");
    line(&name("library"), library, "s", None);
    line(&name("plans found"), plans as f64, "plans", None);
    line(
        &name("one more plan"),
        (seconds - library) / docks as f64 * 1e3,
        "ms",
        None,
    );
    growth.library.push([tags as f64, library]);
    growth
        .plan
        .push([tags as f64, (seconds - library) / docks as f64]);
    line(&name("all"), seconds, "s", (tags == 200).then_some(60.0))
}
