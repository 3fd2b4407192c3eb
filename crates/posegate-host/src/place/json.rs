//! Placements as JSON (CLI.md).

use super::placement::{Placed, Placement};
use posegate::shape::Tolerance;
use serde_json::{Value, json};

impl Placed {
    /// Returns `{"tag_pose", "mean", "cost_at_goal", "p_miss", "margin", "distance", ...}`; missing numbers are
    /// null.
    #[must_use]
    pub fn to_json(&self) -> Value {
        json!({
            "tag_pose": {
                "x": self.pose.x,
                "y": self.pose.y,
                "z": self.pose.z,
                "roll_deg": self.pose.roll_deg,
                "pitch_deg": self.pose.pitch_deg,
                "yaw_deg": self.pose.yaw_deg,
            },
            "size": self.size,
            "mean": self.mean.map(|mean| mean.value),
            "mean_error": self.mean.map(|mean| mean.error),
            "cost_at_goal": self.cost_at_goal,
            "p_miss": self.p_miss,
            "p_unknown": self.p_unknown.value,
            "margin": self.margin,
            "contained": self.contained,
            "tolerance": tolerance_json(super::tolerance_of(self.tolerance)),
            "distance": self.distance,
        })
    }
}

fn tolerance_json(tolerance: Tolerance) -> Value {
    json!({ "translation": tolerance.translation, "yaw_deg": tolerance.turn_deg })
}

impl Placement {
    /// Returns the best place, with `evaluations` and `others`.
    #[must_use]
    pub fn to_json(&self) -> Value {
        let mut told = self.best.to_json();
        let others: Vec<Value> = self.others.iter().map(Placed::to_json).collect();
        told["evaluations"] = json!(self.evaluations);
        told["others"] = json!(others);
        told
    }
}
