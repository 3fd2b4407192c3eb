//! Parameters by name, each with its type and range.

use super::{Delivery, Serial, SettingsError, hex};
use crate::arguments::Arguments;
use crate::parameter_services::ReportedParameters;
use crate::parameters::{Parameters, Value};
use crate::poses::{PoseSettings, PoseType};
use posegate::gate::task_digest;
use posegate::motion::MotionBounds;
use posegate::set::{CrossTerms, Inflation, SplitWeight, Trust};
use posegate::table::Table;
use posegate::track::{OdometryErrors, TrackerSettings};
use posegate_replay::detector::{Detector, DetectorSettings};
use posegate_replay::recording::{BodyFrames, FrameNames};
use posegate_site::Site;
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::path::Path;

/// For what a parameter is.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Of {
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

/// Every parameter.
const PARAMETERS: [(Of, &[&str]); 5] = [
    (
        Of::Gate,
        &[
            "inflation",
            "inhibit_hold_ms",
            "look_at",
            "markers",
            "max_speed",
            "max_speed_across",
            "max_yaw_rate_deg",
            "maximum_age_ms",
            "maximum_fix_age_ms",
            "odom_durability",
            "odom_reliability",
            "odometry_m_per_sqrt_m",
            "odometry_m_per_sqrt_s",
            "odometry_maximum_gap_ms",
            "odometry_rad_per_sqrt_m",
            "odometry_rad_per_sqrt_rad",
            "odometry_rad_per_sqrt_s",
            "odometry_slip",
            "odometry_turn_slip",
            "odometry_turn_slip_per_m",
            "permit_hold_ms",
            "permits_in_a_row",
            "report_period_ms",
            "restart",
            "stands_still",
            "use_detections",
            "use_odometry",
            "use_sim_time",
        ],
    ),
    (
        Of::AnyNode,
        &[
            "cycle_ms",
            "frame_id",
            "heartbeat_ms",
            "lifecycle",
            "link_timeout_ms",
            "robot",
            "site_digest",
            "task",
            "task_digest",
            "valid_ms",
        ],
    ),
    (
        Of::Poses,
        &[
            "child_frame_id",
            "odom_frame_id",
            "pose_durability",
            "pose_reliability",
            "pose_type",
            "set_translation_m",
            "set_yaw_deg",
        ],
    ),
    (Of::PosesOfGate, &["cross_terms"]),
    (
        Of::Detections,
        &[
            "camera",
            "camera_info_reliability",
            "corner_sigma_px",
            "detections_durability",
            "detections_reliability",
            "max_hamming",
        ],
    ),
];

/// Returns the names of the parameters that are for something of `of`.
fn named(of: impl Fn(Of) -> bool) -> impl Iterator<Item = &'static str> {
    let groups = PARAMETERS.into_iter().filter(move |(own, _)| of(*own));
    groups.flat_map(|(_, names)| names.iter().copied())
}

/// Returns `true` if a node with a controller has a parameter.
fn is_with_controller(name: &str) -> bool {
    named(|of| matches!(of, Of::AnyNode | Of::Poses)).any(|own| own == name)
}

/// The standard deviation of a corner's coordinates, pixels. Detectors are often better; use a value measured with
/// the robot's own camera.
const CORNER_SIGMA_PX: f64 = 0.5;

const TIME: &str = "milliseconds, a whole number from 1 to 60000";
const NUMBER: &str = "a number that is not below zero";

/// Reads parameters by name.
pub(super) struct Reader<'p> {
    given: &'p Parameters,
    /// Every parameter that was read, with its value or default.
    used: RefCell<BTreeMap<&'static str, Value>>,
}

impl<'p> Reader<'p> {
    pub(super) fn new(given: &'p Parameters) -> Self {
        Self {
            given,
            used: RefCell::default(),
        }
    }

    /// Returns the parameters that the node has, with their values or defaults.
    pub(super) fn reported(self, is_serial: bool) -> ReportedParameters {
        let mut used = self.used.into_inner();
        used.retain(|name, _| !is_serial || is_with_controller(name));
        ReportedParameters(used)
    }

    /// Notes the value of a parameter, and returns what the node makes of it.
    fn used<T>(&self, name: &'static str, value: Value, setting: T) -> T {
        self.used.borrow_mut().insert(name, value);
        setting
    }

    pub(super) fn check_names(&self) -> Result<(), SettingsError> {
        let mut all: Vec<_> = named(|_| true).collect();
        all.sort_unstable();
        let unknown = self.given.names().find(|name| !all.contains(name));
        let Some(name) = unknown else {
            return Ok(());
        };
        let hint = posegate_site::question(name, all.iter().copied());
        Err(SettingsError::Unknown {
            name: name.to_owned(),
            place: self.given.place(name).to_owned(),
            hint: hint.map_or(String::new(), |hint| format!(" ({hint})")),
            all: all.join(", "),
        })
    }

    pub(super) fn serial(&self, arguments: &Arguments) -> Result<Option<Serial>, SettingsError> {
        let Some((path, baud)) = &arguments.serial else {
            return match self.given.get("link_timeout_ms") {
                None => Ok(None),
                Some(_) => Err(SettingsError::NoSerial),
            };
        };
        let names = self.given.names().filter(|name| *name != "use_sim_time");
        let foreign = names.into_iter().find(|name| !is_with_controller(name));
        match foreign {
            Some(name) => Err(SettingsError::OfTheController {
                name: name.to_owned(),
                place: self.given.place(name).to_owned(),
            }),
            None => Ok(Some(Serial {
                path: path.clone(),
                baud: *baud,
                link_timeout_ms: self.whole(
                    "link_timeout_ms",
                    150,
                    "a whole number of milliseconds from 1 to 500",
                    1..=500,
                )?,
            })),
        }
    }

    fn invalid(&self, name: &'static str, expected: &'static str) -> SettingsError {
        let given = match self.given.get(name) {
            Some(Value::Bool(value)) => value.to_string(),
            Some(Value::Integer(value)) => value.to_string(),
            Some(Value::Double(value)) => format!("{value:?}"),
            Some(Value::Text(value)) => format!("`{value}`"),
            None => "missing".into(),
        };
        SettingsError::Invalid {
            name,
            place: self.given.place(name).to_owned(),
            given,
            expected,
        }
    }

    pub(super) fn bool(&self, name: &'static str, default: bool) -> Result<bool, SettingsError> {
        match self.given.get(name) {
            None => Ok(self.used(name, Value::Bool(default), default)),
            Some(Value::Bool(value)) => Ok(self.used(name, Value::Bool(*value), *value)),
            Some(_) => Err(self.invalid(name, "true or false")),
        }
    }

    pub(super) fn text(&self, name: &'static str, default: &str) -> Result<String, SettingsError> {
        let text = match self.given.get(name) {
            None => default.to_owned(),
            Some(Value::Text(value)) if !value.is_empty() => value.clone(),
            Some(_) => return Err(self.invalid(name, "a text that is not empty")),
        };
        Ok(self.used(name, Value::Text(text.clone()), text))
    }

    fn number(&self, name: &'static str) -> Result<Option<f64>, SettingsError> {
        let number = match self.given.get(name) {
            None => return Ok(None),
            Some(Value::Double(value)) if value.is_finite() && *value >= 0.0 => *value,
            Some(Value::Integer(value)) if *value >= 0 => *value as f64,
            Some(_) => return Err(self.invalid(name, NUMBER)),
        };
        Ok(Some(self.used(name, Value::Double(number), number)))
    }

    pub(super) fn whole(
        &self,
        name: &'static str,
        default: u32,
        expected: &'static str,
        range: std::ops::RangeInclusive<i64>,
    ) -> Result<u32, SettingsError> {
        let whole = match self.given.get(name) {
            None => default,
            Some(Value::Integer(value)) if range.contains(value) => {
                u32::try_from(*value).map_err(|_| self.invalid(name, expected))?
            }
            Some(_) => return Err(self.invalid(name, expected)),
        };
        Ok(self.used(name, Value::Integer(i64::from(whole)), whole))
    }

    pub(super) fn ms(&self, name: &'static str, default: u32) -> Result<u32, SettingsError> {
        self.whole(name, default, TIME, 1..=60_000)
    }

    /// Returns the index of a text among the choices; the first is the default.
    pub(super) fn choice<const N: usize>(
        &self,
        name: &'static str,
        choices: [&str; N],
        expected: &'static str,
    ) -> Result<usize, SettingsError> {
        let chosen = match self.given.get(name) {
            None => Some(0),
            Some(Value::Text(given)) => choices.iter().position(|choice| choice == given),
            Some(_) => None,
        };
        let word = chosen.and_then(|chosen| choices.get(chosen));
        match (chosen, word) {
            (Some(chosen), Some(word)) => {
                Ok(self.used(name, Value::Text((*word).to_owned()), chosen))
            }
            _ => Err(self.invalid(name, expected)),
        }
    }

    pub(super) fn site(
        &self,
        option: Option<&str>,
        table: &Table<'_>,
    ) -> Result<([u8; 32], bool), SettingsError> {
        let expected = "the 64 hexadecimal digits that `posegate table info` prints";
        // The older name of the parameter.
        let name = match self.given.get("task_digest") {
            None => "site_digest",
            Some(_) => "task_digest",
        };
        let parameter = match self.given.get(name) {
            None => None,
            Some(Value::Text(digits)) => Some(digits.as_str()),
            Some(_) => return Err(self.invalid(name, expected)),
        };
        let Some(digits) = option.or(parameter) else {
            return Ok((table.task_digest(), false));
        };
        let digest = task_digest(digits).ok_or_else(|| SettingsError::Invalid {
            name,
            place: if option.is_some() {
                "--task-digest"
            } else {
                self.given.place(name)
            }
            .to_owned(),
            given: format!("`{digits}`"),
            expected,
        })?;
        if digest == table.task_digest() {
            Ok((digest, true))
        } else {
            Err(SettingsError::WrongSite {
                found: hex(&table.task_digest()),
                expected: digits.to_owned(),
            })
        }
    }

    /// Reads the site file. The table must be of its task.
    pub(super) fn site_file(
        &self,
        path: Option<&Path>,
        table: &Table<'_>,
    ) -> Result<Option<Site>, SettingsError> {
        let Some(path) = path else {
            return Ok(None);
        };
        let site = Site::read(path).map_err(|error| SettingsError::Site(error.to_string()))?;
        let task = site.task(table.task()).ok();
        let digest = task.map(|task| site.task_digest(task));
        if digest == Some(table.task_digest()) {
            return Ok(Some(site));
        }
        let expected = digest.map_or("no such task".into(), |digest| hex(&digest));
        Err(SettingsError::WrongSite {
            found: hex(&table.task_digest()),
            expected: format!("{expected} (of {})", path.display()),
        })
    }

    /// Returns the tags and the camera, if detections are used.
    pub(super) fn detector(
        &self,
        site: Option<&Site>,
        table: &Table<'_>,
    ) -> Result<Option<Detector>, SettingsError> {
        let is_used = self.bool("use_detections", false)?;
        let is_foreign = move |of| match of {
            Of::Poses | Of::PosesOfGate => is_used,
            Of::Detections => !is_used,
            Of::Gate | Of::AnyNode => false,
        };
        if let Some(name) = named(is_foreign).find(|name| self.given.get(name).is_some()) {
            return Err(SettingsError::OtherInput {
                name: name.to_owned(),
                place: self.given.place(name).to_owned(),
                of: if is_used {
                    "poses"
                } else {
                    "detections of tags"
                },
                instead: !is_used,
            });
        }
        if !is_used {
            return Ok(None);
        }
        let site = site.ok_or(SettingsError::NoSite)?;
        let camera = match self.given.get("camera") {
            None => None,
            Some(_) => Some(self.text("camera", "")?),
        };
        let corner_sigma_px = self.number("corner_sigma_px")?.unwrap_or(CORNER_SIGMA_PX);
        if !(0.01..=100.0).contains(&corner_sigma_px) {
            return Err(self.invalid("corner_sigma_px", "pixels from 0.01 to 100"));
        }
        let settings = DetectorSettings {
            corner_sigma_px,
            max_hamming: self.whole("max_hamming", 0, "a whole number from 0 to 3", 0..=3)? as i32,
            radius_squared: f64::from(table.radius_squared().q16()) / 65_536.0,
        };
        Ok(Some(Detector::new(site, camera.as_deref(), settings)?))
    }

    /// Returns how poses are read.
    pub(super) fn poses(
        &self,
        site: Option<&Site>,
        frame: &str,
        trust: Trust,
        table: &Table<'_>,
    ) -> Result<PoseSettings, SettingsError> {
        const TYPES: [PoseType; 4] = [
            PoseType::WithCovariance,
            PoseType::Odometry,
            PoseType::Pose,
            PoseType::Transforms,
        ];
        let chosen = self.choice(
            "pose_type",
            ["pose_with_covariance", "odometry", "pose", "tf"],
            "`pose_with_covariance`, `odometry`, `pose` or `tf`",
        )?;
        let kind = TYPES.get(chosen).copied();
        let kind = kind.unwrap_or(PoseType::WithCovariance);
        let bound = [
            self.number("set_translation_m")?,
            self.number("set_yaw_deg")?,
        ];
        let bound = match bound {
            [None, None] if kind.has_covariance() => None,
            [None, _] => return Err(SettingsError::NoBound("set_translation_m")),
            [_, None] => return Err(SettingsError::NoBound("set_yaw_deg")),
            [Some(translation), Some(yaw)] => {
                if !(translation > 0.0 && translation < 268.0) {
                    return Err(self.invalid("set_translation_m", "metres above 0 and below 268"));
                }
                if !(yaw > 0.0 && yaw <= 180.0) {
                    return Err(self.invalid("set_yaw_deg", "degrees above 0, at most 180"));
                }
                Some([translation, yaw.to_radians()])
            }
        };
        let child = match self.given.get("child_frame_id") {
            None => None,
            Some(_) => Some(self.text("child_frame_id", "")?),
        };
        let none = BTreeMap::new();
        let body = BodyFrames::new(site.map_or(&none, |site| &site.frames))
            .with_origin(site.map_or([0.0; 2], |site| site.map_origin))
            .with_named(child.as_slice());
        let is_partial = bound.is_none() && trust.cross_terms != CrossTerms::Filled;
        let radius_squared = f64::from(table.radius_squared().q16()) / 65_536.0;
        Ok(PoseSettings {
            kind,
            bound,
            body: if is_partial {
                body.of_partial_covariances()
            } else {
                body
            },
            names: FrameNames {
                world: frame.to_owned(),
                odometry: self.text("odom_frame_id", "odom")?,
                base: child,
            },
            radius_squared: radius_squared * f64::from(trust.inflation.q16()) / 65_536.0,
        })
    }

    /// Returns the delivery of a topic of which only the last message counts: best effort is received from every
    /// publisher.
    pub(super) fn best_effort(&self, reliability: &'static str) -> Result<Delivery, SettingsError> {
        let choices = ["best_effort", "reliable"];
        let reliable = self.choice(reliability, choices, "`reliable` or `best_effort`")? == 1;
        Ok(Delivery {
            reliable,
            transient_local: false,
        })
    }

    pub(super) fn trust(&self, is_filled: bool) -> Result<Trust, SettingsError> {
        let inflation = Inflation::new(self.number("inflation")?.unwrap_or(1.0))
            .ok_or_else(|| self.invalid("inflation", "a factor from 1 to 4096"))?;
        let expected = "`yaw_unknown` (AMCL), `all_unknown` (variances alone) or `filled` (all terms are the filter's)";
        let cross_terms = match self.choice(
            "cross_terms",
            ["yaw_unknown", "all_unknown", "filled"],
            expected,
        )? {
            _ if is_filled => CrossTerms::Filled,
            0 => CrossTerms::YawUnknown(SplitWeight::HALF),
            1 => CrossTerms::AllUnknown(SplitWeight::HALF),
            _ => CrossTerms::Filled,
        };
        Ok(Trust {
            inflation,
            cross_terms,
        })
    }

    pub(super) fn bounds(&self) -> Result<MotionBounds, SettingsError> {
        let speeds = [
            self.number("max_speed")?,
            self.number("max_speed_across")?,
            self.number("max_yaw_rate_deg")?,
        ];
        if self.bool("stands_still", false)? {
            return match speeds {
                [None, None, None] => Ok(MotionBounds::STANDS_STILL),
                _ => Err(SettingsError::TwoMotionBounds),
            };
        }
        let [Some(along), across, Some(turn)] = speeds else {
            return Err(SettingsError::NoMotionBounds);
        };
        // A robot that is stated not to move at all needs the parameter `stands_still`.
        if along + across.unwrap_or(0.0) + turn == 0.0 {
            return Err(SettingsError::NoMotionBounds);
        }
        let turn = turn.to_radians();
        // What is not stated is not taken for none.
        let bounds = match across {
            Some(across) => MotionBounds::new(along, across, turn),
            None => MotionBounds::in_any_direction(along, turn),
        };
        bounds.ok_or_else(|| {
            self.invalid(
                "max_speed",
                "speeds up to 1000 m/s and turn rates up to 1375 degrees/s",
            )
        })
    }

    pub(super) fn look_at(&self) -> Result<Option<u32>, SettingsError> {
        let expected = "the id of a tag, a whole number that is not below zero";
        match self.given.get("look_at") {
            None => Ok(None),
            Some(_) => self
                .whole("look_at", 0, expected, 0..=i64::from(u32::MAX))
                .map(Some),
        }
    }

    pub(super) fn delivery(
        &self,
        reliability: &'static str,
        durability: &'static str,
    ) -> Result<Delivery, SettingsError> {
        let reliable = self.choice(
            reliability,
            ["reliable", "best_effort"],
            "`reliable` or `best_effort`",
        )? == 0;
        let expected = "`transient_local` or `volatile`";
        let transient_local =
            self.choice(durability, ["volatile", "transient_local"], expected)? == 1;
        Ok(Delivery {
            reliable,
            // Only reliable subscriptions receive earlier messages.
            transient_local: transient_local && reliable,
        })
    }

    pub(super) fn tracker(
        &self,
        bounds: MotionBounds,
        trust: Trust,
        table: &Table<'_>,
    ) -> Result<Option<TrackerSettings>, SettingsError> {
        if !self.bool("use_odometry", false)? {
            return Ok(None);
        }
        let required = |name: &'static str| {
            self.number(name)?
                .ok_or(SettingsError::NoOdometryErrors(name))
        };
        let optional =
            |name: &'static str| Ok::<f64, SettingsError>(self.number(name)?.unwrap_or(0.0));
        let errors = OdometryErrors {
            m_per_sqrt_m: required("odometry_m_per_sqrt_m")?,
            rad_per_sqrt_rad: required("odometry_rad_per_sqrt_rad")?,
            rad_per_sqrt_m: required("odometry_rad_per_sqrt_m")?,
            m_per_sqrt_s: optional("odometry_m_per_sqrt_s")?,
            rad_per_sqrt_s: optional("odometry_rad_per_sqrt_s")?,
            slip: required("odometry_slip")?,
            turn_slip: optional("odometry_turn_slip")?,
            turn_slip_per_m: optional("odometry_turn_slip_per_m")?,
        };
        Ok(Some(TrackerSettings {
            errors,
            bounds,
            trust,
            radius_squared: table.radius_squared(),
            maximum_gap_ms: self.ms("odometry_maximum_gap_ms", 100)?,
            maximum_fix_age_ms: self.ms("maximum_fix_age_ms", 1_500)?,
        }))
    }
}
