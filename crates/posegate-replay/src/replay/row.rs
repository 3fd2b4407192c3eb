//! One estimate of a replay.

use super::margin_of;
use crate::recording::Sample;
use crate::tables::estimate_row;
use crate::{coordinates, recording::yaw_of};
use posegate::gate::{Reason, State, Verdict};
use posegate::report::{Heading, PoseEstimate};
use posegate::set::Uncertainty;
use serde_json::{Value, json};

/// The names of the rules that judge single estimates; `ate` judges a whole recording.
pub const RULES: [&str; 3] = ["distance", "sigma", "ellipse"];

/// One estimate of a replay, with all results.
#[derive(Clone, Debug)]
pub struct Row {
    /// The number of the estimate, from 0, in the order of the recording.
    pub index: u64,
    /// The number of the estimate's source.
    pub source: u8,
    /// The estimate's stamp, seconds.
    pub t_s: f64,
    /// Time at which the estimate was recorded, seconds, if the gate uses that clock.
    pub logged_s: Option<f64>,
    /// The estimated pose: x, y (m), yaw (rad), in the recorded frame.
    pub pose: [f64; 3],
    /// The uncertainty that the gate was given; `None` if the source reports none.
    pub spread: Option<Uncertainty>,
    /// The recorded uncertainty; `None` if the recording states none.
    pub recorded: Option<Uncertainty>,
    /// The estimate's age, seconds, if known.
    pub age: Option<f64>,
    /// `true` if the estimate is in the world frame.
    pub in_world: bool,
    /// `true` if the estimate has a pose-set, at any age. Computed only if there may be a truth.
    pub possible: bool,
    /// The verdict on this estimate alone.
    pub verdict: Verdict,
    /// `true` if two poses fit the image that the estimate is from.
    pub is_ambiguous: bool,
    /// `true` if the margin was computed.
    pub examined: bool,
    /// `true` if the gate is open after the estimate.
    pub permitted: bool,
    /// The gate's state after the estimate.
    pub state: State,
    /// The result of the gate's step.
    pub step: Result<(), Reason>,
    /// The true pose in the world (m, m, rad), if known.
    pub truth: Option<[f64; 3]>,
    /// The time since the last fix of the source, milliseconds, if known.
    pub since_fix_ms: Option<u32>,
    /// The comparison with the truth; `None` if the truth is not known.
    pub against: Option<TruthComparison>,
    /// The results of the rules in [`RULES`]. `None` if a rule lacks its input.
    pub rules: [Option<bool>; 3],
}

/// The comparison of an estimate with the truth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TruthComparison {
    /// `true` if the true pose is in the success set, by the set's own definition.
    pub inside: bool,
    /// The scale at which the border of the pose-set passes through the true pose; `None` if there is no pose-set.
    pub scale: Option<f64>,
    /// `true` if the true pose is in the pose-set: the scale is at most 1.
    pub held: Option<bool>,
    /// `e' P^-1 e` with the error e (x, y, yaw) and the covariance P that the gate was given, before inflation. `None`
    /// without a covariance, if P is not positive definite, or if the source is not declared.
    pub nees: Option<f64>,
    /// Distance of the positions, metres.
    pub error_m: f64,
    /// Difference of the headings, radians, 0 to pi.
    pub error_yaw_rad: f64,
}

impl Row {
    pub(super) fn of(
        sample: &Sample,
        belief: &PoseEstimate,
        verdict: Verdict,
        logged_s: Option<f64>,
    ) -> Self {
        let yaw = match belief.heading {
            Heading::Radians(yaw) => yaw,
            Heading::RollPitchYaw([_, _, yaw]) => yaw,
            Heading::Quaternion(entries) => yaw_of(entries),
        };
        Self {
            index: 0,
            source: sample.source,
            t_s: sample.t_s,
            logged_s,
            pose: [belief.x_m, belief.y_m, yaw],
            spread: belief.spread,
            recorded: sample.belief.spread,
            age: None,
            in_world: false,
            possible: false,
            verdict,
            is_ambiguous: sample.is_ambiguous,
            examined: true,
            permitted: false,
            state: State::Inhibited(Reason::Silent),
            step: Err(Reason::Silent),
            truth: sample.truth,
            since_fix_ms: sample.since_fix_ms,
            against: None,
            rules: [None; 3],
        }
    }

    /// Returns the gate's time, seconds.
    #[must_use]
    pub fn now_s(&self) -> f64 {
        self.logged_s.unwrap_or(self.t_s)
    }

    /// Returns the age of the estimate, seconds, if known.
    #[must_use]
    pub const fn age_s(&self) -> Option<f64> {
        self.age
    }

    /// Returns the margin, if there is one and it was computed.
    #[must_use]
    pub fn margin(&self) -> Option<f64> {
        margin_of(&self.verdict).filter(|_| self.examined)
    }

    /// Returns the reason of a denial.
    #[must_use]
    pub const fn reason(&self) -> Option<Reason> {
        match self.verdict {
            Verdict::Permit { .. } => None,
            Verdict::Deny { reason, .. } => Some(reason),
        }
    }

    /// Returns the estimate as a row of a table for `learn` ([`ESTIMATES`](crate::tables::ESTIMATES)). `None` if it is in another frame,
    /// has no covariance, or if two poses fit.
    #[must_use]
    pub fn table_row(&self) -> Option<String> {
        let is_usable = self.in_world && !self.is_ambiguous;
        is_usable
            .then(|| estimate_row(self.t_s, self.pose, self.recorded, self.truth))
            .flatten()
    }

    /// Returns the row as `posegate gate` prints it, with the additional results of a replay.
    #[must_use]
    pub fn json(&self) -> Value {
        let worst = match self.verdict {
            Verdict::Permit { .. } => None,
            Verdict::Deny { worst_pose, .. } => worst_pose.map(coordinates),
        };
        let mut line = json!({
            "index": self.index,
            "t_s": self.t_s,
            "verdict": if self.verdict.is_permit() { "permit" } else { "deny" },
            "reason": self.reason().map(Reason::name),
            "margin": self.margin(),
            "worst_pose": worst,
            "permitted": self.permitted,
            "state": self.state.name(),
            "gate_reason": self.step.err().map(Reason::name),
            "age_s": self.age_s(),
            "pose": self.pose,
        });
        for (name, permits) in RULES.iter().zip(self.rules) {
            line[*name] = json!(permits);
        }
        if let (Some(against), Some(truth)) = (&self.against, self.truth) {
            line["truth"] = json!(truth);
            line["in_success_set"] = json!(against.inside);
            line["in_pose_set"] = json!(against.held);
            line["nees"] = json!(against.nees);
            line["error_m"] = json!(against.error_m);
            line["error_yaw_rad"] = json!(against.error_yaw_rad);
        }
        line
    }
}
