//! Chains and plans as JSON (CLI.md).

use serde_json::{Value, json};
use std::string::String;
use std::vec::Vec;

use super::{ChainReport, StepKind, StepReport};
use crate::chain::{Assume, Failure};
use crate::contain::Cause;
use crate::log::factor;

impl ChainReport {
    /// `{"success", "assume", "risk", "steps", "failed_step", "reason"}`.
    #[must_use]
    pub fn to_json(&self) -> Value {
        let steps: Vec<Value> = self.steps.iter().map(StepReport::to_json).collect();
        let failure = self.first_failure();
        json!({
            "success": self.succeeds(),
            "assume": match self.assume {
                Assume::AtGoal => "at-goal",
                Assume::General => "general",
            },
            "risk": self.risk,
            "steps": steps,
            "failed_step": failure.map(|(index, _)| index),
            "reason": failure.map(|(_, why)| reason(why)),
        })
    }
}

impl StepReport {
    /// A step: tasks have `contained` and `margin`, drives grown by the odometry a `covariance`. `translation` and
    /// `yaw_rad` are what is known after the step; `spread` is where the estimate may be then.
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
            step["reason"] = json!(reason(failure));
        }
        step
    }
}

fn reason(failure: Failure) -> String {
    match failure {
        Failure::NotContained(Cause::TooLarge) => "pose_set_too_large".into(),
        Failure::NotContained(Cause::OffTable) => "outside_table".into(),
        Failure::NotContained(Cause::NotContained) => "not_contained".into(),
        Failure::StartTooFar => "start_too_far".into(),
        Failure::BeyondNumbers => "beyond_numbers".into(),
    }
}
