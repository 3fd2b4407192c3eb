//! The budgets that a host can measure: bytes, seconds to bake and to prove. One JSON line each;
//! ends non-zero where one falls short. Run by `ci.sh budgets`.
//!
//! Seconds are the best of five: the machine is shared, the work is not.

use posegate::bake::{Order, Step, grid};
use posegate::site::Site;
use posegate::verify::{Claim, verify};
use std::process::ExitCode;
use std::time::Instant;

fn main() -> ExitCode {
    let text = include_str!("sites/dock.toml");
    let site = Site::parse(text, "dock.toml").expect("the site is valid");
    let task = site.task("see-t7").expect("the site has the task");
    let mut short = false;
    let mut line = |name: &str, value: f64, unit: &str, goal: Option<f64>| {
        let goal_text = goal.map_or("null".to_string(), |goal| goal.to_string());
        println!(
            "{{\"name\": \"{name}\", \"value\": {value}, \"unit\": \"{unit}\", \"goal\": {goal_text}}}"
        );
        short |= goal.is_some_and(|goal| !(value <= goal));
    };
    for (label, step, bake_goal, bytes_goal) in [
        (
            "2 cm / 1 deg",
            Step {
                xy: 0.02,
                yaw_deg: 1.0,
            },
            1.0,
            Some(16_000.0),
        ),
        (
            "1 cm / 0.5 deg",
            Step {
                xy: 0.01,
                yaw_deg: 0.5,
            },
            10.0,
            None,
        ),
    ] {
        let mut spec = *site
            .table_spec(task)
            .expect("the site describes its tables");
        spec.step = step;
        let order = Order {
            task: "see-t7",
            success: &task.success,
            spec,
            epsilon: site.epsilon,
            site_digest: site.digest,
        };
        let claim = Claim {
            task: "see-t7",
            success: &task.success,
            epsilon: site.epsilon,
            site_digest: site.digest,
        };
        let mut bytes = Vec::new();
        let bake = best_of_five(|| bytes = grid(&order, &|| ()).expect("the table is baked"));
        let mut proven = 0;
        let prove = best_of_five(|| {
            proven = verify(&bytes, &claim, &|| ())
                .expect("the table is proven")
                .cells;
        });
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
            Some(bake_goal),
        );
        line(&format!("grid A at {label}: bake"), bake, "s", None);
        line(
            &format!("grid A at {label}: prove"),
            prove,
            "s",
            Some(bake_goal),
        );
        line(
            &format!("grid A at {label}: share of cells proven"),
            proven as f64 / all,
            "1",
            None,
        );
    }
    ExitCode::from(u8::from(short))
}

fn best_of_five(mut work: impl FnMut()) -> f64 {
    (0..5)
        .map(|_| {
            let started = Instant::now();
            work();
            started.elapsed().as_secs_f64()
        })
        .fold(f64::INFINITY, f64::min)
}
