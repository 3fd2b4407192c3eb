//! One estimate of a replay.

use super::{TruthComparison, margin_of};
use crate::log::recording::Sample;
use crate::log::{coordinates, recording::yaw_of};
use posegate::gate::{Reason, State, Verdict};
use posegate::report::{Heading, PoseEstimate};
use posegate::set::Uncertainty;
use serde_json::{Value, json};

/// One estimate with all that is said of it.
#[derive(Clone, Debug)]
pub struct Row {
    /// From 0, in the order of the recording.
    pub index: u64,
    /// Which source.
    pub source: u8,
    /// Its stamp, seconds.
    pub t_s: f64,
    /// When it was recorded, seconds, where the gate goes by that.
    pub logged_s: Option<f64>,
    /// x, y (m), yaw (rad), as they came.
    pub pose: [f64; 3],
    /// What the gate was given of its error.
    pub spread: Option<Uncertainty>,
    /// What the recording says of its error.
    pub recorded: Option<Uncertainty>,
    /// How old it was, seconds, where that is known.
    pub age: Option<f64>,
    /// Whether it is in the world's frame.
    pub in_world: bool,
    /// Whether it makes a pose-set, however old; looked for where there is a truth.
    pub possible: bool,
    /// The verdict on it alone.
    pub verdict: Verdict,
    /// Whether its margin was looked for.
    pub examined: bool,
    /// Whether the gate is open after it.
    pub permitted: bool,
    /// Where the gate stands after it.
    pub state: State,
    /// What the gate said of it.
    pub step: Result<(), Reason>,
    /// The true pose (m, m, rad), where there is one.
    pub truth: Option<[f64; 3]>,
    /// What the truth says.
    pub against: Option<TruthComparison>,
    /// What the rules of [`super::RULES`] say.
    /// `None` where a rule has nothing to judge by.
    pub rules: [Option<bool>; 3],
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
            examined: true,
            permitted: false,
            state: State::Inhibited(Reason::Silent),
            step: Err(Reason::Silent),
            truth: sample.truth,
            against: None,
            rules: [None; 3],
        }
    }

    /// The gate's time, seconds.
    #[must_use]
    pub fn now_s(&self) -> f64 {
        self.logged_s.unwrap_or(self.t_s)
    }

    /// How old the estimate was, seconds, where that is known.
    #[must_use]
    pub const fn age_s(&self) -> Option<f64> {
        self.age
    }

    /// The margin, where there is one and it was looked for.
    #[must_use]
    pub fn margin(&self) -> Option<f64> {
        margin_of(&self.verdict).filter(|_| self.examined)
    }

    /// The reason of a denial.
    #[must_use]
    pub const fn reason(&self) -> Option<Reason> {
        match self.verdict {
            Verdict::Permit { .. } => None,
            Verdict::Deny { reason, .. } => Some(reason),
        }
    }

    /// As `posegate gate` prints it, and what a replay knows beside.
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
        for (name, permits) in super::RULES.iter().zip(self.rules) {
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
