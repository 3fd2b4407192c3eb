//! What the node makes of the given parameters.

use super::given::{DIGITS, Given, Of};
use super::{Delivery, Serial, SettingsError, hex};
use crate::arguments::Arguments;
use crate::poses::{PoseSettings, PoseType};
use posegate::gate::task_digest;
use posegate::motion::MotionBounds;
use posegate::set::{CrossTerms, Inflation, SplitWeight, Trust};
use posegate::table::Table;
use posegate::track::{OdometryErrors, TrackerSettings};
use posegate_replay::detector::{Detector, DetectorSettings};
use posegate_replay::recording::{BodyFrames, FrameNames};
use posegate_site::Site;
use std::collections::BTreeMap;
use std::path::Path;

/// The standard deviation of a corner's coordinates, pixels. Detectors are often better; use a value measured with
/// the robot's own camera.
const CORNER_SIGMA_PX: f64 = 0.5;

impl Given<'_> {
    pub(super) fn serial(&self, arguments: &Arguments) -> Result<Option<Serial>, SettingsError> {
        let Some(path) = &arguments.serial else {
            return match self.has("link_timeout_ms") {
                false => Ok(None),
                true => Err(SettingsError::NoSerial),
            };
        };
        match self.first(|name, of| !of.is_with_controller() && name != "use_sim_time") {
            Some(name) => Err(SettingsError::OfTheController {
                name: name.to_owned(),
                place: self.place(name),
            }),
            None => Ok(Some(Serial {
                path: path.clone(),
                baud: arguments.baud,
                link_timeout_ms: self.whole("link_timeout_ms", 150),
            })),
        }
    }

    pub(super) fn site(
        &self,
        option: Option<&str>,
        table: &Table<'_>,
    ) -> Result<([u8; 32], bool), SettingsError> {
        // The older name of the parameter.
        let name = match self.has("task_digest") {
            false => "site_digest",
            true => "task_digest",
        };
        let (digits, place) = match (option, self.digest(name)) {
            (Some(digits), _) => (digits, "--task-digest"),
            (None, Some(given)) => given,
            (None, None) => return Ok((table.task_digest(), false)),
        };
        let digest = task_digest(digits).ok_or_else(|| SettingsError::Invalid {
            name,
            place: place.to_owned(),
            given: format!("`{digits}`"),
            expected: DIGITS,
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
        let is_used = self.bool("use_detections", false);
        let is_foreign = |_: &str, of| match of {
            Of::Poses | Of::PosesOfGate => is_used,
            Of::Detections => !is_used,
            Of::Gate | Of::AnyNode => false,
        };
        if let Some(name) = self.first(is_foreign) {
            return Err(SettingsError::OtherInput {
                name: name.to_owned(),
                place: self.place(name),
                of: match is_used {
                    true => "poses",
                    false => "detections of tags",
                },
                instead: !is_used,
            });
        }
        if !is_used {
            return Ok(None);
        }
        let site = site.ok_or(SettingsError::NoSite)?;
        let camera = self.optional_text("camera");
        let settings = DetectorSettings {
            corner_sigma_px: self.number("corner_sigma_px").unwrap_or(CORNER_SIGMA_PX),
            max_hamming: self.whole("max_hamming", 0) as i32,
            radius_squared: radius_squared(table),
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
        let kind = match self.text("pose_type", "pose_with_covariance").as_str() {
            "odometry" => PoseType::Odometry,
            "pose" => PoseType::Pose,
            "tf" => PoseType::Transforms,
            _ => PoseType::WithCovariance,
        };
        let bound = match ["set_translation_m", "set_yaw_deg"].map(|name| self.number(name)) {
            [None, None] if kind.has_covariance() => None,
            [None, _] => return Err(SettingsError::NoBound("set_translation_m")),
            [_, None] => return Err(SettingsError::NoBound("set_yaw_deg")),
            [Some(translation), Some(yaw)] => Some([translation, yaw.to_radians()]),
        };
        let child = self.optional_text("child_frame_id");
        let none = BTreeMap::new();
        let body = BodyFrames::new(site.map_or(&none, |site| &site.frames))
            .with_origin(site.map_or([0.0; 2], |site| site.map_origin))
            .with_named(child.as_slice());
        let is_partial = bound.is_none() && trust.cross_terms != CrossTerms::Filled;
        Ok(PoseSettings {
            kind,
            bound,
            body: match is_partial {
                true => body.of_partial_covariances(),
                false => body,
            },
            names: FrameNames {
                world: frame.to_owned(),
                odometry: self.text("odom_frame_id", "odom"),
                base: child,
            },
            radius_squared: radius_squared(table) * f64::from(trust.inflation.q16()) / 65_536.0,
        })
    }

    /// Returns the delivery of a topic of which only the last message counts: best effort is received from every
    /// publisher.
    pub(super) fn best_effort(&self, reliability: &'static str) -> Delivery {
        Delivery {
            reliable: self.text(reliability, "best_effort") == "reliable",
            transient_local: false,
        }
    }

    pub(super) fn trust(&self, is_filled: bool) -> Result<Trust, SettingsError> {
        let inflation = Inflation::new(self.number("inflation").unwrap_or(1.0));
        let cross_terms = match self.text("cross_terms", "yaw_unknown").as_str() {
            "yaw_unknown" if !is_filled => CrossTerms::YawUnknown(SplitWeight::HALF),
            "all_unknown" if !is_filled => CrossTerms::AllUnknown(SplitWeight::HALF),
            _ => CrossTerms::Filled,
        };
        Ok(Trust {
            inflation: inflation
                .ok_or_else(|| self.invalid("inflation", "a factor from 1 to 4096"))?,
            cross_terms,
        })
    }

    pub(super) fn bounds(&self) -> Result<MotionBounds, SettingsError> {
        let speeds = ["max_speed", "max_speed_across", "max_yaw_rate_deg"];
        let speeds = speeds.map(|name| self.number(name));
        if self.bool("stands_still", false) {
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
        let expected = "speeds up to 1000 m/s and turn rates up to 1375 degrees/s";
        bounds.ok_or_else(|| self.invalid("max_speed", expected))
    }

    pub(super) fn delivery(&self, reliability: &'static str, durability: &'static str) -> Delivery {
        let reliable = self.text(reliability, "reliable") == "reliable";
        let transient_local = self.text(durability, "volatile") == "transient_local";
        Delivery {
            reliable,
            // Only reliable subscriptions receive earlier messages.
            transient_local: transient_local && reliable,
        }
    }

    pub(super) fn tracker(
        &self,
        bounds: MotionBounds,
        trust: Trust,
        table: &Table<'_>,
    ) -> Result<Option<TrackerSettings>, SettingsError> {
        if !self.bool("use_odometry", false) {
            return Ok(None);
        }
        let optional = |name| self.number(name).unwrap_or_default();
        let required = |name| {
            let number = self.number(name);
            number.ok_or(SettingsError::NoOdometryErrors(name))
        };
        let errors = OdometryErrors {
            m_per_sqrt_m: required("odometry_m_per_sqrt_m")?,
            rad_per_sqrt_rad: required("odometry_rad_per_sqrt_rad")?,
            rad_per_sqrt_m: required("odometry_rad_per_sqrt_m")?,
            m_per_sqrt_s: optional("odometry_m_per_sqrt_s"),
            rad_per_sqrt_s: optional("odometry_rad_per_sqrt_s"),
            slip: required("odometry_slip")?,
            turn_slip: optional("odometry_turn_slip"),
            turn_slip_per_m: optional("odometry_turn_slip_per_m"),
        };
        Ok(Some(TrackerSettings {
            errors,
            bounds,
            trust,
            radius_squared: table.radius_squared(),
            maximum_gap_ms: self.whole("odometry_maximum_gap_ms", 100),
            maximum_fix_age_ms: self.whole("maximum_fix_age_ms", 1_500),
        }))
    }
}

/// Returns the squared radius of a table's pose-sets.
fn radius_squared(table: &Table<'_>) -> f64 {
    f64::from(table.radius_squared().q16()) / 65_536.0
}
