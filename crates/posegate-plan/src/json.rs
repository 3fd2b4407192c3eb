//! Chains and plans as JSON: what `posegate chain --json` and `posegate plan --json` print.

use serde_json::{Value, json};

use super::{ChainReport, Plan, PlanResult, Status, StepKind, StepReport};
use posegate::chain::StartAssumption;
use posegate_replay::factor;

impl ChainReport {
    /// `{"success", "assume", "risk", "steps", "failed_step", "reason"}`.
    #[must_use]
    pub fn to_json(&self) -> Value {
        let steps: Vec<Value> = self.steps.iter().map(StepReport::to_json).collect();
        let failure = self.first_failure();
        json!({
            "success": self.succeeds(),
            "assume": match self.assume {
                StartAssumption::AtGoal => "at-goal",
                StartAssumption::General => "general",
            },
            "risk": self.risk,
            "steps": steps,
            "failed_step": failure.map(|(index, _)| index),
            "reason": failure.map(|(_, why)| why.name()),
        })
    }
}

impl StepReport {
    /// A step. Tasks have `contained` and `margin`; a drive with the odometry model has a `covariance`. `translation`
    /// and `yaw_rad` enclose the error after the step; `spread` bounds the estimate's distance from its place.
    #[must_use]
    pub fn to_json(&self) -> Value {
        let [translation, yaw] = self.after.enclosing();
        let mut step = json!({
            "type": match self.kind {
                StepKind::Work => "work",
                StepKind::Localization => "localization",
                StepKind::Navigation => "navigation",
            },
            "translation": translation,
            "yaw_rad": yaw,
            "pose": self.after.pose,
            "spread": { "translation": self.after.spread[0], "yaw_rad": self.after.spread[1] },
            "risk": self.risk,
        });
        if let Some(task) = &self.task {
            step["task"] = json!(task);
            step["contained"] = json!(self.failure.is_none());
            step["margin"] = json!(self.margin.map(factor));
        }
        if let Some(random) = &self.after.random {
            let p = random.covariance;
            let rows: Vec<Vec<f64>> = (0..3)
                .map(|row| (0..3).map(|column| p[(row, column)]).collect())
                .collect();
            step["covariance"] = json!(rows);
        }
        if let Some(failure) = self.failure {
            step["reason"] = json!(failure.name());
        }
        step
    }
}

impl Plan {
    /// The plan as a chain.
    #[must_use]
    pub fn report(&self) -> ChainReport {
        ChainReport {
            assume: StartAssumption::General,
            steps: self.steps.iter().map(|step| step.report.clone()).collect(),
            risk: self.risk,
        }
    }

    fn to_json(&self) -> Value {
        let mut value_of_plan = self.report().to_json();
        let steps: Vec<Value> = self
            .steps
            .iter()
            .map(|step| {
                let mut value = step.report.to_json();
                value["place"] = json!(step.place);
                if let Some(tag) = step.tags.first() {
                    value["tag"] = json!(tag);
                    value["tags"] = json!(step.tags);
                }
                value
            })
            .collect();
        value_of_plan["steps"] = json!(steps);
        value_of_plan["cost"] = json!(self.cost);
        value_of_plan
    }
}

impl PlanResult {
    /// `{"status", "success", "cost", "cost_bound", "library_bound", "gap", "risk", "steps", "contingencies",
    /// "nearest_miss"}`. `cost_bound` is a bound for every chain, `library_bound` for the chains of the library;
    /// `gap` is the part of the cost above `cost_bound`.
    #[must_use]
    pub fn to_json(&self) -> Value {
        let mut value_of_plan = match &self.plan {
            Some(plan) => plan.to_json(),
            None => json!({ "success": false, "steps": [], "cost": null, "risk": null }),
        };
        value_of_plan["status"] = json!(match self.status {
            Status::Optimal => "optimal",
            Status::Feasible => "feasible",
            Status::Infeasible => "infeasible",
            Status::Limit => "limit",
        });
        value_of_plan["cost_bound"] = json!(self.bound_of_all);
        value_of_plan["library_bound"] = json!(self.bound);
        value_of_plan["gap"] = json!(self.gap());
        value_of_plan["model_from"] = json!(self.model_from);
        let others: Vec<Value> = self
            .contingencies
            .iter()
            .map(|other| {
                let mut value = other.plan.to_json();
                value["after_step"] = json!(other.step);
                value["lost_tag"] = json!(other.tags.join(", "));
                value["risk_before"] = json!(other.risk_before);
                value
            })
            .collect();
        value_of_plan["contingencies"] = json!(others);
        value_of_plan["nearest_miss"] = match &self.nearest {
            None => Value::Null,
            Some(miss) => json!({
                "margin": miss.scale,
                "translation": miss.set[0],
                "yaw_rad": miss.set[1],
                "after": miss.after,
            }),
        };
        if self.plan.is_none() {
            value_of_plan["reason"] = json!(self.why_not());
        }
        value_of_plan
    }

    /// Returns the reason why there is no plan, with the nearest miss.
    #[must_use]
    pub fn why_not(&self) -> String {
        let mut text: String = match self.status {
            Status::Limit => "no plan within the limit of the search".into(),
            _ => "infeasible: no chain of the library is certain to succeed".into(),
        };
        match &self.nearest {
            Some(miss) => {
                let after = match &miss.after {
                    Some(look) => format!("after a look at {look}"),
                    None => "without a look".into(),
                };
                text += &format!(
                    "; the nearest miss is {after}: the robot arrives within {:.3} m and {:.2} deg, but only a set {:.3} times as large would fit{}; mount a tag that is seen nearer to the task, allow more at the task, or state drives that err less",
                    miss.set[0],
                    miss.set[1].to_degrees(),
                    miss.scale,
                    if miss.least > 1.0 {
                        format!(", and the site's `least_margin` is {}", miss.least)
                    } else {
                        String::new()
                    }
                );
            }
            None => text += "; no chain arrives at the work task",
        }
        if self.model_from.is_none() {
            text += "; the site has no drive model: add [navigation] model = {...}";
        }
        text
    }
}
