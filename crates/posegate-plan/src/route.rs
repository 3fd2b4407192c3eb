//! The route of a chain or a plan: what a picture of the hall shows of each step.

use serde_json::Value;

use super::{BeliefStateF64, ChainReport, StepKind};

/// A route.
#[derive(Clone, Debug, PartialEq)]
pub struct Route {
    /// The steps.
    pub steps: Vec<RouteStep>,
}

/// A step of a route.
#[derive(Clone, Debug, PartialEq)]
pub struct RouteStep {
    /// The kind of the step.
    pub kind: StepKind,
    /// The task's name; `None` for a drive.
    pub task: Option<String>,
    /// The robot's intended place before the step: x, y in metres.
    pub from: [f64; 2],
    /// The distance of the robot's farthest possible place from it, metres.
    pub reach: f64,
    /// The robot's intended place after the step: x, y in metres.
    pub to: [f64; 2],
}

impl From<&ChainReport> for Route {
    fn from(report: &ChainReport) -> Self {
        let place = |belief: &BeliefStateF64| [belief.pose[0], belief.pose[1]];
        let steps = report.steps.iter().map(|step| RouteStep {
            kind: step.kind,
            task: step.task.clone(),
            from: place(&step.before),
            reach: reach(&step.before),
            to: place(&step.after),
        });
        Self {
            steps: steps.collect(),
        }
    }
}

impl Route {
    /// Reads the route of a plan that `posegate plan --json` printed, from the belief at its start. Returns `None` for
    /// another value.
    #[must_use]
    pub fn from_json(plan: &Value, start: &BeliefStateF64) -> Option<Self> {
        let (mut from, mut reach) = ([start.pose[0], start.pose[1]], reach(start));
        let mut steps = Vec::new();
        for step in plan["steps"].as_array()? {
            let kind = match step["type"].as_str()? {
                "work" => StepKind::Work,
                "localization" => StepKind::Localization,
                "navigation" => StepKind::Navigation,
                _ => return None,
            };
            let to = [step["pose"][0].as_f64()?, step["pose"][1].as_f64()?];
            steps.push(RouteStep {
                kind,
                task: step["task"].as_str().map(str::to_owned),
                from,
                reach,
                to,
            });
            from = to;
            reach = step["translation"].as_f64()? + step["spread"]["translation"].as_f64()?;
        }
        Some(Self { steps })
    }
}

/// Returns the distance of the farthest possible place from the intended one, metres.
fn reach(belief: &BeliefStateF64) -> f64 {
    belief.enclosing()[0] + belief.spread[0]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Options, Prepared};
    use posegate_site::Site;

    const SITE: &str = include_str!("../../../examples/sites/paper-chain.toml");

    #[test]
    fn route_of_a_printed_plan_is_that_of_the_plan() {
        let site = Site::parse(SITE, "paper-chain.toml").unwrap();
        let start = &site.chains["back-to-dock"].start;
        let mut planner = Prepared::of(&site, Some("back-to-dock")).unwrap();
        let planned = planner.plan(start, "dock", &Options::default()).unwrap();
        let own = Route::from(&planned.plan.as_ref().unwrap().report());
        assert!(own.steps.len() >= 3, "{own:?}");
        let text = planned.to_json().to_string();
        let begun = BeliefStateF64::at_start(
            [start.pose.x, start.pose.y, start.pose.yaw_deg.to_radians()],
            start.spread,
            &start.known,
        );
        let read = Route::from_json(&serde_json::from_str(&text).unwrap(), &begun).unwrap();
        assert_eq!(read.steps.len(), own.steps.len());
        for (a, b) in read.steps.iter().zip(&own.steps) {
            assert_eq!((a.kind, &a.task), (b.kind, &b.task));
            let near = |a: f64, b: f64| (a - b).abs() < 1e-9;
            assert!(near(a.reach, b.reach), "{a:?} {b:?}");
            for axis in 0..2 {
                assert!(near(a.from[axis], b.from[axis]) && near(a.to[axis], b.to[axis]));
            }
        }
        assert_eq!(Route::from_json(&Value::Null, &begun), None);
    }
}
