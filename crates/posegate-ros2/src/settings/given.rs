//! Every parameter: what it is for and what its value must be; and the given ones, checked.

use super::SettingsError;
use crate::parameter_services::ReportedParameters;
use crate::parameters::Parameters;
use serde_norway::Value;
use std::cell::RefCell;
use std::collections::BTreeMap;

/// For what a parameter is.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Of {
    /// A gate or odometry, which a node with a controller does not have.
    Gate,
    AnyNode,
    /// Poses, on any node. Not allowed if detections are used.
    Poses,
    /// Poses for a gate. (The covariance from corners has all its terms.)
    PosesOfGate,
    /// Allowed only if detections are used.
    Detections,
}

impl Of {
    /// Returns `true` if a node with a controller has such a parameter.
    pub(super) fn is_with_controller(self) -> bool {
        matches!(self, Self::AnyNode | Self::Poses)
    }
}

/// What a value must be, and the words for it.
#[derive(Clone, Copy)]
enum Kind {
    Bool,
    /// A text that is not empty.
    Text(&'static str),
    /// A number from the first to the second.
    Number(f64, f64, &'static str),
    /// A whole number from the first to the second.
    Whole(u32, u32, &'static str),
    Word(&'static [&'static str], &'static str),
}

const TEXT: Kind = Kind::Text("a text that is not empty");
const DIGEST: Kind = Kind::Text(DIGITS);
const MS: Kind = Kind::Whole(1, 60_000, "milliseconds, a whole number from 1 to 60000");
const LINK_MS: Kind = Kind::Whole(1, 500, "a whole number of milliseconds from 1 to 500");
const COUNT: Kind = Kind::Whole(1, 65_535, "a whole number from 1 to 65535");
const BITS: Kind = Kind::Whole(0, 3, "a whole number from 0 to 3");
const TAG: Kind = Kind::Whole(
    0,
    u32::MAX,
    "the id of a tag, a whole number that is not below zero",
);
const AMOUNT: Kind = Kind::Number(0.0, f64::MAX, "a number that is not below zero");
const FACTOR: Kind = Kind::Number(1.0, 4096.0, "a factor from 1 to 4096");
const PIXELS: Kind = Kind::Number(0.01, 100.0, "pixels from 0.01 to 100");
const METRES: Kind = Kind::Number(ABOVE_0, 268f64.next_down(), "metres above 0 and below 268");
const DEGREES: Kind = Kind::Number(ABOVE_0, 180.0, "degrees above 0, at most 180");
const ABOVE_0: f64 = f64::MIN_POSITIVE;
const RELIABILITY: Kind = Kind::Word(&["reliable", "best_effort"], "`reliable` or `best_effort`");
const DURABILITY: Kind = Kind::Word(
    &["volatile", "transient_local"],
    "`transient_local` or `volatile`",
);
const RESTART: Kind = Kind::Word(&["automatic", "on_reset"], "`automatic` or `on_reset`");
const CROSS_TERMS: Kind = Kind::Word(
    &["yaw_unknown", "all_unknown", "filled"],
    "`yaw_unknown` (AMCL), `all_unknown` (variances alone) or `filled` (all terms are the filter's)",
);
const POSE_TYPE: Kind = Kind::Word(
    &["pose_with_covariance", "odometry", "pose", "tf"],
    "`pose_with_covariance`, `odometry`, `pose` or `tf`",
);
/// The form of a digest.
pub(super) const DIGITS: &str = "the 64 hexadecimal digits that `posegate table info` prints";

/// Every parameter.
const DECLARED: [(&str, Of, Kind); 52] = [
    ("camera", Of::Detections, TEXT),
    ("camera_info_reliability", Of::Detections, RELIABILITY),
    ("child_frame_id", Of::Poses, TEXT),
    ("corner_sigma_px", Of::Detections, PIXELS),
    ("cross_terms", Of::PosesOfGate, CROSS_TERMS),
    ("cycle_ms", Of::AnyNode, MS),
    ("detections_durability", Of::Detections, DURABILITY),
    ("detections_reliability", Of::Detections, RELIABILITY),
    ("frame_id", Of::AnyNode, TEXT),
    ("heartbeat_ms", Of::AnyNode, MS),
    ("inflation", Of::Gate, FACTOR),
    ("inhibit_hold_ms", Of::Gate, MS),
    ("lifecycle", Of::AnyNode, Kind::Bool),
    ("link_timeout_ms", Of::AnyNode, LINK_MS),
    ("look_at", Of::Gate, TAG),
    ("markers", Of::Gate, Kind::Bool),
    ("max_hamming", Of::Detections, BITS),
    ("max_speed", Of::Gate, AMOUNT),
    ("max_speed_across", Of::Gate, AMOUNT),
    ("max_yaw_rate_deg", Of::Gate, AMOUNT),
    ("maximum_age_ms", Of::Gate, MS),
    ("maximum_fix_age_ms", Of::Gate, MS),
    ("odom_durability", Of::Gate, DURABILITY),
    ("odom_frame_id", Of::Poses, TEXT),
    ("odom_reliability", Of::Gate, RELIABILITY),
    ("odometry_m_per_sqrt_m", Of::Gate, AMOUNT),
    ("odometry_m_per_sqrt_s", Of::Gate, AMOUNT),
    ("odometry_maximum_gap_ms", Of::Gate, MS),
    ("odometry_rad_per_sqrt_m", Of::Gate, AMOUNT),
    ("odometry_rad_per_sqrt_rad", Of::Gate, AMOUNT),
    ("odometry_rad_per_sqrt_s", Of::Gate, AMOUNT),
    ("odometry_slip", Of::Gate, AMOUNT),
    ("odometry_turn_slip", Of::Gate, AMOUNT),
    ("odometry_turn_slip_per_m", Of::Gate, AMOUNT),
    ("permit_hold_ms", Of::Gate, MS),
    ("permits_in_a_row", Of::Gate, COUNT),
    ("pose_durability", Of::Poses, DURABILITY),
    ("pose_reliability", Of::Poses, RELIABILITY),
    ("pose_type", Of::Poses, POSE_TYPE),
    ("report_period_ms", Of::Gate, MS),
    ("restart", Of::Gate, RESTART),
    ("robot", Of::AnyNode, TEXT),
    ("set_translation_m", Of::Poses, METRES),
    ("set_yaw_deg", Of::Poses, DEGREES),
    ("site_digest", Of::AnyNode, DIGEST),
    ("stands_still", Of::Gate, Kind::Bool),
    ("task", Of::AnyNode, TEXT),
    ("task_digest", Of::AnyNode, DIGEST),
    ("use_detections", Of::Gate, Kind::Bool),
    ("use_odometry", Of::Gate, Kind::Bool),
    ("use_sim_time", Of::Gate, Kind::Bool),
    ("valid_ms", Of::AnyNode, MS),
];

impl Kind {
    /// Returns what is expected, unless a value is that.
    fn refusal(self, value: &Value) -> Option<&'static str> {
        let (is_right, expected) = match self {
            Self::Bool => (value.is_bool(), "true or false"),
            Self::Text(words) => (value.as_str().is_some_and(|text| !text.is_empty()), words),
            Self::Number(least, most, words) => {
                let range = least..=most;
                (value.as_f64().is_some_and(|n| range.contains(&n)), words)
            }
            Self::Whole(least, most, words) => {
                let range = u64::from(least)..=u64::from(most);
                (value.as_u64().is_some_and(|n| range.contains(&n)), words)
            }
            Self::Word(known, words) => (
                value.as_str().is_some_and(|word| known.contains(&word)),
                words,
            ),
        };
        (!is_right).then_some(expected)
    }
}

/// The given parameters, of which each exists and has a value of its kind.
pub(super) struct Given<'p> {
    given: &'p Parameters,
    /// Every parameter that was read, with its value or default.
    used: RefCell<BTreeMap<&'static str, Value>>,
}

impl<'p> Given<'p> {
    /// Checks parameters.
    ///
    /// # Errors
    /// [`SettingsError::Unknown`] or [`SettingsError::Invalid`]
    pub(super) fn new(given: &'p Parameters) -> Result<Self, SettingsError> {
        let checked = Self {
            given,
            used: RefCell::default(),
        };
        for name in given.names() {
            let Some((name, _, kind)) = DECLARED.iter().find(|(known, ..)| *known == name) else {
                let all = DECLARED.map(|(name, ..)| name);
                let hint = posegate_site::question(name, all.into_iter());
                return Err(SettingsError::Unknown {
                    name: name.to_owned(),
                    place: given.place(name).to_owned(),
                    hint: hint.map_or(String::new(), |hint| format!(" ({hint})")),
                    all: all.join(", "),
                });
            };
            if let Some(expected) = given.get(name).and_then(|value| kind.refusal(value)) {
                return Err(checked.invalid(name, expected));
            }
        }
        Ok(checked)
    }

    /// Returns the error of a value, which is not as expected.
    pub(super) fn invalid(&self, name: &'static str, expected: &'static str) -> SettingsError {
        SettingsError::Invalid {
            name,
            place: self.place(name),
            given: match self.given.get(name) {
                Some(Value::String(text)) => format!("`{text}`"),
                Some(Value::Bool(value)) => value.to_string(),
                Some(Value::Number(number)) => number.to_string(),
                _ => "missing".into(),
            },
            expected,
        }
    }

    /// Returns the first given parameter that satisfies a condition on its name and on what it is for.
    pub(super) fn first(&self, is_it: impl Fn(&str, Of) -> bool) -> Option<&'static str> {
        let mut all = DECLARED.into_iter();
        let found = all.find(|(name, of, _)| is_it(name, *of) && self.has(name));
        found.map(|(name, ..)| name)
    }

    /// Returns the parameters that the node has, with their values or defaults.
    pub(super) fn reported(self, is_serial: bool) -> ReportedParameters {
        let mut used = self.used.into_inner();
        let all = DECLARED.into_iter();
        for (name, ..) in all.filter(|(_, of, _)| is_serial && !of.is_with_controller()) {
            used.remove(name);
        }
        ReportedParameters(used)
    }

    pub(super) fn has(&self, name: &str) -> bool {
        self.given.get(name).is_some()
    }

    /// Returns the source of a parameter.
    pub(super) fn place(&self, name: &str) -> String {
        self.given.place(name).to_owned()
    }

    /// Returns a value or its default, and notes it.
    fn value<T: Clone + Into<Value>>(
        &self,
        name: &'static str,
        default: Option<T>,
        of: impl FnOnce(&Value) -> Option<T>,
    ) -> Option<T> {
        let value = self.given.get(name).and_then(of).or(default)?;
        self.used.borrow_mut().insert(name, value.clone().into());
        Some(value)
    }

    pub(super) fn bool(&self, name: &'static str, default: bool) -> bool {
        let value = self.value(name, Some(default), Value::as_bool);
        value.unwrap_or(default)
    }

    pub(super) fn text(&self, name: &'static str, default: &str) -> String {
        let value = self.value(name, Some(default.to_owned()), text);
        value.unwrap_or_default()
    }

    pub(super) fn optional_text(&self, name: &'static str) -> Option<String> {
        self.value(name, None, text)
    }

    pub(super) fn number(&self, name: &'static str) -> Option<f64> {
        self.value(name, None, Value::as_f64)
    }

    pub(super) fn whole(&self, name: &'static str, default: u32) -> u32 {
        self.value(name, Some(default), whole).unwrap_or(default)
    }

    pub(super) fn optional_whole(&self, name: &'static str) -> Option<u32> {
        self.value(name, None, whole)
    }

    /// Returns the given digits of a parameter, and their source.
    pub(super) fn digest(&self, name: &str) -> Option<(&'p str, &'p str)> {
        let digits = self.given.get(name)?.as_str()?;
        Some((digits, self.given.place(name)))
    }
}

fn text(given: &Value) -> Option<String> {
    given.as_str().map(str::to_owned)
}

fn whole(given: &Value) -> Option<u32> {
    u32::try_from(given.as_u64()?).ok()
}
