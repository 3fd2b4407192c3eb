//! Measures the cost of a placement: `placement rate` prints how many poses and places are evaluated per second;
//! `placement serve SITE TASK SIGMA_X SIGMA_Y SIGMA_YAW_DEG` answers lines of `x y z yaw_deg` with the expected cost of
//! the task's tag there, for other optimizers to ask.

use posegate::shape::Pose3Deg;
use posegate_place::{Cost, Gaussian, Quadrature, Task, expected_cost};
use posegate_site::{SAMPLE, Site};
use rayon::prelude::*;
use std::error::Error;
use std::io::{BufRead, Write};
use std::time::Instant;

/// Goal: pose costs per second and core.
const GOAL: f64 = 2e6;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    match words.as_slice() {
        ["rate"] => rate(),
        ["serve", site, task, x, y, yaw_deg] => {
            let sigmas = [x.parse()?, y.parse()?, yaw_deg.parse::<f64>()?.to_radians()];
            serve(&Site::read(site)?, task, sigmas)
        }
        _ => Err("expected `rate` or `serve SITE TASK SIGMA_X SIGMA_Y SIGMA_YAW_DEG`".into()),
    }
}

fn placement_task(site: &Site, task: &str) -> Result<Task, Box<dyn Error>> {
    let set = site.task(task)?.success.clone();
    let tag = *set.tags().first().ok_or("the task looks at no tag")?;
    let reserve = Task::usual_reserve(&set, &tag);
    Ok(Task {
        set,
        tag,
        wall: None,
        reserve,
    })
}

/// Measures costs of single poses, and expected costs, per second on one core.
fn rate() -> Result<(), Box<dyn Error>> {
    let site = Site::parse(SAMPLE, "sample")?;
    let task = placement_task(&site, "see-t7")?;
    let cost = Cost::default();
    let costs = task.set.evaluator();
    let mut sum = 0.0;
    let started = Instant::now();
    let count = 4_000_000_u32;
    for k in 0..count {
        let share = f64::from(k) / f64::from(count);
        let pose = [2.0 * share - 1.0, 0.5 - share, 0.2 * share - 0.1];
        sum += costs
            .at(pose)
            .map_or(cost.c_high, |view| cost.of_view(view));
    }
    let poses = f64::from(count) / started.elapsed().as_secs_f64();
    println!(
        "{}",
        line("pose costs per second and core", poses, "1/s", Some(GOAL))
    );
    let belief = Gaussian::of_sigmas([0.1, 0.1, 1f64.to_radians()], 0.99)?;
    let started = Instant::now();
    let count = 200_u32;
    for _ in 0..count {
        sum += expected_cost(&task.set, &belief, &cost, &Quadrature::ROUGH)?
            .mean
            .value;
    }
    let places = f64::from(count) / started.elapsed().as_secs_f64();
    println!(
        "{}",
        line("expected costs per second and core", places, "1/s", None)
    );
    eprintln!("checksum {sum:.6e}");
    if poses < GOAL {
        return Err(format!("{poses:.3e} pose costs a second are fewer than {GOAL:.0e}").into());
    }
    Ok(())
}

fn line(name: &str, value: f64, unit: &str, goal: Option<f64>) -> serde_json::Value {
    serde_json::json!({ "name": name, "value": value, "unit": unit, "goal": goal })
}

/// Answers lines of standard input. An empty line ends a batch, whose lines are computed in parallel.
fn serve(site: &Site, task: &str, sigmas: [f64; 3]) -> Result<(), Box<dyn Error>> {
    let task = placement_task(site, task)?;
    let belief = Gaussian::of_sigmas(sigmas, site.epsilon)?;
    let cost = Cost::default();
    let mean = |pose: &Pose3Deg| {
        let found = expected_cost(&task.at(*pose), &belief, &cost, &Quadrature::ROUGH);
        found.map_or(f64::INFINITY, |found| found.mean.value)
    };
    let mut batch = Vec::new();
    let mut out = std::io::stdout().lock();
    for text in std::io::stdin().lock().lines() {
        let text = text?;
        if !text.is_empty() {
            let numbers: Vec<f64> = text
                .split_whitespace()
                .map(str::parse)
                .collect::<Result<_, _>>()?;
            let [x, y, z, yaw_deg] = numbers[..] else {
                return Err(format!("expected four numbers in `{text}`").into());
            };
            batch.push(Pose3Deg {
                x,
                y,
                z,
                yaw_deg,
                ..task.tag.pose
            });
            continue;
        }
        let values: Vec<f64> = batch.par_iter().map(mean).collect();
        for value in values {
            writeln!(out, "{value:.17e}")?;
        }
        out.flush()?;
        batch.clear();
    }
    Ok(())
}
