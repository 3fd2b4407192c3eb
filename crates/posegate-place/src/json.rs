//! Placements as JSON: what `posegate place --json` prints.

use super::placement::{Placed, Placement};
use posegate::shape::{Pose3Deg, Tolerance};
use serde_json::{Value, json};

impl Placed {
    /// Returns `{"tag_pose", "mean", "cost_at_goal", "p_miss", "margin", "distance", ...}`; missing numbers are
    /// null.
    #[must_use]
    pub fn to_json(&self) -> Value {
        json!({
            "tag_pose": pose_json(&self.pose),
            "size": self.size,
            "mean": self.mean.map(|mean| mean.value),
            "mean_error": self.mean.map(|mean| mean.error),
            "cost_at_goal": self.cost_at_goal,
            "p_miss": self.p_miss,
            "p_unknown": self.p_unknown.value,
            "margin": self.margin,
            "contained": self.contained,
            "reserve": tolerance_json(self.reserve),
            "left": tolerance_json(self.left()),
            "tolerance": tolerance_json(self.tolerance()),
            "distance": self.distance,
        })
    }
}

impl Placed {
    /// Returns the installation error beyond the reserve at which the task still succeeds.
    #[must_use]
    pub fn left(&self) -> Tolerance {
        Tolerance {
            translation: 0.01 * self.left,
            turn_deg: self.left,
        }
    }

    /// Returns the total installation error at which the task still succeeds: the reserve and the additional error.
    /// Zero if not even the reserve is allowed.
    #[must_use]
    pub fn tolerance(&self) -> Tolerance {
        if !self.contained || self.mean.is_none() {
            return Tolerance::NONE;
        }
        let left = self.left();
        Tolerance {
            translation: self.reserve.translation + left.translation,
            turn_deg: self.reserve.turn_deg + left.turn_deg,
        }
    }
}

fn pose_json(pose: &Pose3Deg) -> Value {
    json!({
        "x": pose.x,
        "y": pose.y,
        "z": pose.z,
        "roll_deg": pose.roll_deg,
        "pitch_deg": pose.pitch_deg,
        "yaw_deg": pose.yaw_deg,
    })
}

fn tolerance_json(tolerance: Tolerance) -> Value {
    json!({ "translation": tolerance.translation, "yaw_deg": tolerance.turn_deg })
}

impl Placement {
    /// Returns the best place, with `evaluations`, `others` and `restarts`.
    #[must_use]
    pub fn to_json(&self) -> Value {
        let mut value = self.best.to_json();
        let others: Vec<Value> = self.others.iter().map(Placed::to_json).collect();
        value["evaluations"] = json!(self.evaluations);
        value["others"] = json!(others);
        let restarts = self.restarts.iter();
        let restarts: Vec<Value> = restarts
            .map(|one| json!({ "mean": one.mean, "tag_pose": pose_json(&one.pose) }))
            .collect();
        value["restarts"] = json!(restarts);
        value
    }
}
