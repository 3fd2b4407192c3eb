//! Covers as JSON.

use serde_json::{Value, json};

use super::{ChosenTag, Cover, TaskCoverage};
use crate::{Plan, StepKind};

impl Cover {
    /// Returns `{"success", "cost", "bound", "bound_checked", "gap", "beside", "finished", "rounds", "cuts", "plans",
    /// "tags", "tasks"}`.
    #[must_use]
    pub fn to_json(&self) -> Value {
        let tags: Vec<Value> = self.tags.iter().map(ChosenTag::to_json).collect();
        let tasks: Vec<Value> = self.tasks.iter().map(TaskCoverage::to_json).collect();
        json!({
            "success": self.serves_all(),
            "cost": self.cost,
            "bound": self.bound,
            "bound_checked": self.bound_checked,
            "gap": self.gap(),
            "beside": self.beside,
            "finished": self.is_finished,
            "rounds": self.rounds,
            "cuts": self.cuts,
            "plans": self.plans,
            "tags": tags,
            "tasks": tasks,
        })
    }
}

impl ChosenTag {
    fn to_json(&self) -> Value {
        let pose = self.tag.tag.pose;
        json!({
            "name": self.name,
            "id": self.tag.tag.id,
            "family": self.tag.family,
            "size": self.tag.tag.size,
            "pose": {
                "x": pose.x, "y": pose.y, "z": pose.z,
                "roll_deg": pose.roll_deg, "pitch_deg": pose.pitch_deg, "yaw_deg": pose.yaw_deg,
            },
            "cost": self.cost,
            "looked_at_by": self.looked_at_by,
            "needed_by": self.needed_by,
            "second_of": self.second_of,
        })
    }
}

impl TaskCoverage {
    fn to_json(&self) -> Value {
        let plan = self.planned.plan.as_ref();
        let others: Vec<Value> = self
            .planned
            .contingencies
            .iter()
            .map(|other| json!({ "lost": other.tags, "after_step": other.step, "steps": steps(&other.plan) }))
            .collect();
        json!({
            "task": self.task,
            "from": self.from,
            "success": self.reason.is_none(),
            "reason": self.reason,
            "in_reach": self.in_reach,
            "alone": self.alone,
            "cost": plan.map(|plan| plan.cost),
            "risk": plan.map(|plan| plan.risk),
            "steps": plan.map(steps),
            "contingencies": others,
        })
    }
}

/// Returns the steps of a plan in short form: `look TASK`, `drive PLACE`, `work TASK`.
fn steps(plan: &Plan) -> Vec<String> {
    let name = |task: &Option<String>| task.clone().unwrap_or_default();
    plan.steps
        .iter()
        .map(|step| match step.report.kind {
            StepKind::Localization => format!("look {}", name(&step.report.task)),
            StepKind::Navigation => format!("drive {}", step.place),
            StepKind::Work => format!("work {}", name(&step.report.task)),
        })
        .collect()
}

impl TaskCoverage {
    /// Returns the steps of the task's plan in short form: `look TASK`, `drive PLACE`, `work TASK`; empty if it has
    /// no plan.
    #[must_use]
    pub fn steps(&self) -> Vec<String> {
        self.planned.plan.as_ref().map(steps).unwrap_or_default()
    }
}
