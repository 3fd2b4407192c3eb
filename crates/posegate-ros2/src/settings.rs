//! The settings of the node: ROS parameters with their ranges, and the settings of the gate and the tracker made from them.

use self::given::Given;
use crate::arguments::Arguments;
use crate::parameter_services::ReportedParameters;
use crate::poses::PoseSettings;
use posegate::gate::{InvalidParameter, Restart, Settings, Source};
use posegate::motion::MotionBounds;
use posegate::report::FrameId;
use posegate::set::{Aging, Trust};
use posegate::table::{Table, TableError};
use posegate::track::TrackerSettings;
use posegate_files::printable::hex;
use posegate_replay::detector::{Detector, DetectorError};
use std::path::PathBuf;

mod given;
mod reader;

/// The quality of service of a subscription.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Delivery {
    /// `true` for reliable, `false` for best effort.
    pub reliable: bool,
    /// `true` if messages from before the node's start are also received.
    pub transient_local: bool,
}

/// A serial line to a controller.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Serial {
    /// The device.
    pub path: PathBuf,
    /// The speed, bits per second.
    pub baud: u32,
    /// A state of the controller counts only if it is certainly younger than this, milliseconds.
    pub link_timeout_ms: u32,
}

/// The settings of a node. With a serial line, the controller's own settings decide instead of those of the gate
/// here.
#[derive(Clone, Debug)]
pub struct NodeSettings {
    task: String,
    /// The settings of the gate, without the task's name and the sources.
    gate: Settings<'static>,
    table_digest: [u8; 32],
    /// The name of the robot in the permit: the node's full name, unless a parameter states another.
    pub robot: String,
    /// `true` if the digest of the site file was given, `false` if it was taken from the table.
    pub site_is_checked: bool,
    sources: [Source; 1],
    /// The required frame of poses.
    pub frame: String,
    /// How poses are read.
    pub poses: PoseSettings,
    /// The trust in the covariances.
    pub trust: Trust,
    /// The largest speeds of the robot.
    pub bounds: MotionBounds,
    /// The period of the control cycle, milliseconds.
    pub cycle_ms: u32,
    /// The period of the permission's heartbeat, milliseconds.
    pub heartbeat_ms: u32,
    /// The time after its stamp for which a consumer may use a permission, milliseconds.
    pub valid_ms: u32,
    /// The quality of service of the poses.
    pub pose_delivery: Delivery,
    /// The quality of service of the odometry.
    pub odom_delivery: Delivery,
    /// The tags and the camera, if detections are used instead of poses.
    pub detector: Option<Detector>,
    /// The topics of the detections and of the camera info, for messages.
    pub detection_topics: [String; 2],
    /// The quality of service of the detections.
    pub detections_delivery: Delivery,
    /// The quality of service of the camera info.
    pub camera_info_delivery: Delivery,
    /// The tracker, if odometry is used.
    pub tracker: Option<TrackerSettings>,
    /// `true` if markers are published.
    pub markers: bool,
    /// `true` if the node denies until a manager of lifecycles has made it active.
    pub is_managed: bool,
    /// The parameters as services report them.
    pub parameters: ReportedParameters,
    /// The line to the controller that decides; `None` if the node decides.
    pub serial: Option<Serial>,
}

/// The reason why parameters are refused.
#[derive(Debug, thiserror::Error)]
pub enum SettingsError {
    /// There is no parameter with this name.
    #[error("{place}: there is no parameter `{name}`{hint}; the parameters are: {all}")]
    Unknown {
        /// The name.
        name: String,
        /// The source: the file or the argument.
        place: String,
        /// A similar name, as text.
        hint: String,
        /// All names.
        all: String,
    },
    /// A value has the wrong type or is beyond its range.
    #[error("{place}: the parameter `{name}` is {given}: expected {expected}")]
    Invalid {
        /// The name.
        name: &'static str,
        /// The source: the file or the argument.
        place: String,
        /// The given value.
        given: String,
        /// The expected value.
        expected: &'static str,
    },
    /// The robot's speed is not stated.
    #[error(
        "nothing states how fast the robot moves: give max_speed (m/s) and max_yaw_rate_deg (degrees/s), the fastest that its drives can move it; or stands_still:=true if something else, such as brakes, keeps it in place while it is permitted"
    )]
    NoMotionBounds,
    /// Both a standstill and a speed are stated.
    #[error("stands_still is true and a speed is given: give one or the other")]
    TwoMotionBounds,
    /// Odometry is used without its errors.
    #[error(
        "use_odometry is true and `{0}` is not given: state the errors of the odometry, odometry_m_per_sqrt_m, odometry_rad_per_sqrt_rad, odometry_rad_per_sqrt_m and odometry_slip (docs/for-ros.md says how they are measured)"
    )]
    NoOdometryErrors(&'static str),
    /// Simulated time is requested.
    #[error(
        "use_sim_time is true: the gate needs a clock that cannot stop, so this node uses the system's clock; set use_sim_time to false for it, and play recordings with `posegate replay`"
    )]
    SimulatedTime,
    /// The parameter is a setting of the gate, which is on the controller.
    #[error(
        "{place}: the parameter `{name}` is a setting of the gate, and with --serial the controller's gate decides by its own settings: leave it out"
    )]
    OfTheController {
        /// The name.
        name: String,
        /// The source: the file or the argument.
        place: String,
    },
    /// A setting of a line is given without a line.
    #[error(
        "link_timeout_ms is given without --serial: it is for a controller on a serial line; give --serial DEV, or leave it out"
    )]
    NoSerial,
    /// Detections are used without a site file.
    #[error(
        "use_detections is true and no site file is given: give --site FILE, the file that the table was made from; it has the tags and the camera"
    )]
    NoSite,
    /// The site file cannot be used.
    #[error("the site file cannot be used: {0}")]
    Site(String),
    /// The camera or a tag is missing from the site.
    #[error("{0}; the parameter `camera` names the camera")]
    Detector(#[from] DetectorError),
    /// A parameter of detections is given without detections, or one of poses with detections.
    #[error(
        "{place}: the parameter `{name}` is for {of}: leave it out, or set use_detections to {instead}"
    )]
    OtherInput {
        /// The name.
        name: String,
        /// The source: the file or the argument.
        place: String,
        /// The subject of the parameter.
        of: &'static str,
        /// The value of `use_detections` with which the parameter is allowed.
        instead: bool,
    },
    /// Messages without a covariance need a stated bound, of both kinds.
    #[error(
        "`{0}` is not given: state the largest error of the poses, set_translation_m (metres) and set_yaw_deg (degrees); both are needed for poses without a covariance (pose_type pose and tf), and they replace the covariance of others"
    )]
    NoBound(&'static str),
    /// Times contradict each other.
    #[error("{0}")]
    Times(&'static str),
    /// The gate refuses a setting.
    #[error("{0}")]
    Gate(#[from] InvalidParameter),
    /// The bytes are not a table.
    #[error("the table is not one: {0}; build it again with `posegate table build`")]
    Table(#[from] TableError),
    /// The table of another task.
    #[error(
        "the table is for the task `{found}`, and the parameter `task` is `{expected}`: give the table of that task"
    )]
    WrongTask {
        /// The task of the table.
        found: String,
        /// The requested task.
        expected: String,
    },
    /// The table has another task digest.
    #[error(
        "the table was made from another site file, or before its task changed: its task digest is {found}, and {expected} was given; build the table from the site file that is in use (`posegate table info` prints a table's task digest)"
    )]
    WrongSite {
        /// The digest of the table.
        found: String,
        /// The given digest.
        expected: String,
    },
}

/// The ROS clocks of the node and of a consumer may differ by this, milliseconds. Consumers refuse heartbeats from
/// farther in the future.
pub const CLOCKS_MS: u32 = 20;

impl NodeSettings {
    /// Creates the settings from the arguments and the bytes of the table.
    ///
    /// # Errors
    /// [`SettingsError`]. No accepted value disables a check.
    pub fn new(arguments: &Arguments, table: &[u8]) -> Result<Self, SettingsError> {
        let names = &arguments.names;
        let given = Given::new(&arguments.parameters)?;
        if given.bool("use_sim_time", false) {
            return Err(SettingsError::SimulatedTime);
        }
        let table = Table::parse(table)?;
        let (task_digest, site_is_checked) =
            given.site(arguments.task_digest.as_deref(), &table)?;
        let task = given.text("task", table.task());
        if task != table.task() {
            return Err(SettingsError::WrongTask {
                found: table.task().to_owned(),
                expected: task,
            });
        }
        let serial = given.serial(arguments)?;
        let site = given.site_file(arguments.site.as_deref(), &table)?;
        let detector = given.detector(site.as_ref(), &table)?;
        let frame = given.text("frame_id", "map");
        let trust = given.trust(detector.is_some())?;
        let bounds = match serial {
            Some(_) => MotionBounds::STANDS_STILL,
            None => given.bounds()?,
        };
        let tracker = given.tracker(bounds, trust, &table)?;
        let source = Source {
            frame: FrameId::of(&frame),
            // A tracker applies the trust itself.
            trust: if tracker.is_some() {
                Trust::FULL
            } else {
                trust
            },
            aging: Aging::NONE,
            motion: bounds,
        };
        // Odometry comes 10 to 50 times a second, a detector of tags misses some images, and AMCL reports every 0.6 s while the robot moves.
        let usual_hold_ms = match (&tracker, &detector) {
            (Some(_), _) => 200,
            (None, Some(_)) => 500,
            (None, None) => 800,
        };
        let permit_hold_ms = given.whole("permit_hold_ms", usual_hold_ms);
        let [cycle_ms, valid_ms] = [given.whole("cycle_ms", 20), given.whole("valid_ms", 250)];
        let settings = Self {
            task,
            gate: Settings {
                task: "",
                task_digest,
                sources: &[],
                maximum_age_ms: given.whole("maximum_age_ms", 1_500),
                response_ms: cycle_ms + valid_ms + CLOCKS_MS,
                report_period_ms: given.whole("report_period_ms", permit_hold_ms),
                permit_hold_ms,
                inhibit_hold_ms: given.whole("inhibit_hold_ms", 500),
                permits_in_a_row: given.whole("permits_in_a_row", 3) as u16,
                restart: match given.text("restart", "automatic").as_str() {
                    "on_reset" => Restart::OnReset,
                    _ => Restart::Automatic,
                },
                // A PC walks all cells of a table within a cycle.
                most_runs: u32::MAX,
                look_at: given.optional_whole("look_at"),
            },
            table_digest: table.digest(),
            robot: given.text("robot", &names.full_node()),
            site_is_checked: site_is_checked || site.is_some(),
            sources: [source],
            poses: given.poses(site.as_ref(), &frame, trust, &table)?,
            frame,
            trust,
            bounds,
            cycle_ms,
            heartbeat_ms: given.whole("heartbeat_ms", 50),
            valid_ms,
            pose_delivery: given.delivery("pose_reliability", "pose_durability"),
            odom_delivery: given.delivery("odom_reliability", "odom_durability"),
            detection_topics: [names.detections.clone(), names.camera_info.clone()],
            detections_delivery: given.delivery("detections_reliability", "detections_durability"),
            camera_info_delivery: given.best_effort("camera_info_reliability"),
            detector,
            tracker,
            markers: given.bool("markers", true),
            is_managed: given.bool("lifecycle", false),
            parameters: given.reported(serial.is_some()),
            serial,
        };
        settings.check()?;
        Ok(settings)
    }

    fn check(&self) -> Result<(), SettingsError> {
        if !(2 * self.heartbeat_ms <= self.valid_ms) {
            return Err(SettingsError::Times(
                "valid_ms is less than twice heartbeat_ms: one lost heartbeat would end every permission; lengthen valid_ms or shorten heartbeat_ms",
            ));
        }
        if !(self.cycle_ms <= self.heartbeat_ms) {
            return Err(SettingsError::Times(
                "heartbeat_ms is less than cycle_ms: a heartbeat is sent by a control cycle; lengthen heartbeat_ms or shorten cycle_ms",
            ));
        }
        if self.serial.is_some() {
            return Ok(());
        }
        if !(self.response_ms() < self.gate.maximum_age_ms) {
            return Err(SettingsError::Times(
                "maximum_age_ms is not above valid_ms + cycle_ms + 20: a permission that consumers use for valid_ms would be older than that; lengthen maximum_age_ms or shorten valid_ms",
            ));
        }
        Ok(self.gate().check()?)
    }

    /// Returns the longest time from a step until every consumer has followed the answer of the next one. It is the
    /// sum of a cycle, the time for which consumers use the last permission, and the difference of their clocks.
    #[must_use]
    pub const fn response_ms(&self) -> u32 {
        self.gate.response_ms
    }

    /// Returns the age at which a report is no longer used, milliseconds.
    #[must_use]
    pub const fn oldest_ms(&self) -> u32 {
        self.gate.maximum_age_ms.saturating_sub(self.response_ms())
    }

    /// Returns the settings of the gate.
    #[must_use]
    pub fn gate(&self) -> Settings<'_> {
        Settings {
            task: &self.task,
            sources: &self.sources,
            ..self.gate
        }
    }

    /// Returns how much of each set is movement, as text; `None` if odometry carries the poses, or the robot stands still.
    #[must_use]
    pub fn movement(&self) -> Option<String> {
        (self.tracker.is_none() && self.bounds != MotionBounds::STANDS_STILL).then(|| {
            let growth = self.gate().movement(self.bounds, 0);
            let m = f64::from(growth.translation_um()) * 1e-6;
            let degrees = f64::from(growth.yaw_q24()) * 360.0 / 16_777_216.0;
            format!("{m:.3} m and {degrees:.1} degrees of each set, or more, are movement at the stated speeds until the permission ends: less with shorter times, with use_odometry, or with stands_still:=true if brakes keep the robot in place")
        })
    }

    /// Returns the name of the task.
    #[must_use]
    pub fn task(&self) -> &str {
        &self.task
    }

    /// Returns the SHA-256 of the table's bytes, in hexadecimal digits.
    #[must_use]
    pub fn table(&self) -> String {
        hex(&self.table_digest)
    }

    /// Returns the task digest, in hexadecimal digits.
    #[must_use]
    pub fn site(&self) -> String {
        hex(&self.gate.task_digest)
    }
}

#[cfg(test)]
mod tests;
