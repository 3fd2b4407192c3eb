//! The settings of the node: ROS parameters with their ranges, and the settings of the gate and the tracker made from them.

use crate::arguments::Arguments;
use crate::parameters::{Parameters, Value};
use posegate::gate::{InvalidParameter, Restart, Settings, Source, site_digest};
use posegate::motion::MotionBounds;
use posegate::report::FrameId;
use posegate::set::{CrossTerms, Inflation, SplitWeight, Trust};
use posegate::table::{Table, TableError};
use posegate::track::{OdometryErrors, TrackerSettings};

/// How a subscription receives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Delivery {
    /// Reliable, or best effort.
    pub reliable: bool,
    /// Also messages that were published before the node started, or later ones only.
    pub transient_local: bool,
}

/// The settings of a node.
#[derive(Clone, Debug)]
pub struct NodeSettings {
    task: String,
    site_digest: [u8; 32],
    /// Whether the digest of the site file was given, or taken from the table.
    pub site_is_checked: bool,
    sources: [Source; 1],
    /// The frame in which poses must be.
    pub frame: String,
    /// How far the covariances are trusted.
    pub trust: Trust,
    /// How fast the robot moves at most.
    pub bounds: MotionBounds,
    maximum_age_ms: u32,
    report_period_ms: u32,
    permit_hold_ms: u32,
    inhibit_hold_ms: u32,
    permits_in_a_row: u16,
    restart: Restart,
    look_at: Option<u32>,
    /// The period of the control cycle, milliseconds.
    pub cycle_ms: u32,
    /// The period of the permission's heartbeat, milliseconds.
    pub heartbeat_ms: u32,
    /// For how long a consumer may use a permission after its stamp, milliseconds.
    pub valid_ms: u32,
    /// How poses are received.
    pub pose_delivery: Delivery,
    /// How odometry is received.
    pub odom_delivery: Delivery,
    /// The tracker, if odometry is used.
    pub tracker: Option<TrackerSettings>,
    /// Whether markers are published.
    pub markers: bool,
}

/// Parameters that are refused.
#[derive(Debug, thiserror::Error)]
pub enum SettingsError {
    /// A name that no parameter has.
    #[error("{place}: there is no parameter `{name}`{hint}; the parameters are: {all}")]
    Unknown {
        /// The name.
        name: String,
        /// Where it was given.
        place: String,
        /// A similar name, in words.
        hint: String,
        /// All names.
        all: String,
    },
    /// A value of the wrong type or beyond its range.
    #[error("{place}: the parameter `{name}` is {given}: expected {expected}")]
    Invalid {
        /// The name.
        name: &'static str,
        /// Where it was given.
        place: String,
        /// What was given.
        given: String,
        /// What is expected.
        expected: &'static str,
    },
    /// The robot's speed is not stated.
    #[error(
        "nothing states how fast the robot moves: give max_speed (m/s) and max_yaw_rate_deg (degrees/s), the fastest that its drives can move it; or stands_still:=true if something else, such as brakes, keeps it in place while it is permitted"
    )]
    NoMotionBounds,
    /// The robot stands still, and moves.
    #[error("stands_still is true and a speed is given: give one or the other")]
    TwoMotionBounds,
    /// Odometry without its errors.
    #[error(
        "use_odometry is true and `{0}` is not given: state the errors of the odometry, odometry_m_per_sqrt_m, odometry_rad_per_sqrt_rad, odometry_rad_per_sqrt_m and odometry_slip (docs/for-ros.md says how they are measured)"
    )]
    NoOdometryErrors(&'static str),
    /// Simulated time.
    #[error(
        "use_sim_time is true: the gate needs a clock that cannot stop, so this node uses the system's clock; set use_sim_time to false for it, and play recordings with `posegate replay`"
    )]
    SimulatedTime,
    /// Times that do not fit each other.
    #[error("{0}")]
    Times(&'static str),
    /// A setting that the gate refuses.
    #[error("{0}")]
    Gate(#[from] InvalidParameter),
    /// Not a table.
    #[error("the table is not one: {0}; build it again with `posegate table build`")]
    Table(#[from] TableError),
    /// The table of another task.
    #[error(
        "the table is for the task `{found}`, and the parameter `task` is `{expected}`: give the table of that task"
    )]
    WrongTask {
        /// The task of the table.
        found: String,
        /// The task that was asked for.
        expected: String,
    },
    /// The table of another site.
    #[error(
        "the table was made from another site file: its digest is {found}, and {expected} was given; build the table from the site file that is in use (`posegate table info` prints a table's digest)"
    )]
    WrongSite {
        /// The digest of the table.
        found: String,
        /// The digest that was given.
        expected: String,
    },
}

/// Every parameter.
const NAMES: [&str; 36] = [
    "cross_terms",
    "cycle_ms",
    "frame_id",
    "heartbeat_ms",
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
    "pose_durability",
    "pose_reliability",
    "report_period_ms",
    "restart",
    "site_digest",
    "stands_still",
    "task",
    "use_odometry",
    "use_sim_time",
    "valid_ms",
];

const TIME: &str = "milliseconds, a whole number from 1 to 60000";
const NUMBER: &str = "a number that is not below zero";

impl NodeSettings {
    /// Makes the settings from the arguments and the bytes of the table.
    ///
    /// # Errors
    /// [`SettingsError`]. No accepted value switches a check off.
    pub fn new(arguments: &Arguments, table: &[u8]) -> Result<Self, SettingsError> {
        let reader = Reader(&arguments.parameters);
        reader.check_names()?;
        if reader.bool("use_sim_time", false)? {
            return Err(SettingsError::SimulatedTime);
        }
        let table = Table::parse(table)?;
        let (digest, site_is_checked) = reader.site(arguments.site_digest.as_deref(), &table)?;
        let task = reader.text("task", table.task())?;
        if task != table.task() {
            return Err(SettingsError::WrongTask {
                found: table.task().to_owned(),
                expected: task,
            });
        }
        let frame = reader.text("frame_id", "map")?;
        let trust = reader.trust()?;
        let bounds = reader.bounds()?;
        let tracker = reader.tracker(bounds, trust, &table)?;
        let source = Source {
            frame: FrameId::of(&frame),
            // A tracker applies the trust itself.
            trust: if tracker.is_some() {
                Trust::FULL
            } else {
                trust
            },
            motion: bounds,
        };
        let settings = Self {
            task,
            site_digest: digest,
            site_is_checked,
            sources: [source],
            frame,
            trust,
            bounds,
            maximum_age_ms: reader.ms("maximum_age_ms", 1_000)?,
            report_period_ms: reader.ms("report_period_ms", reader.ms("permit_hold_ms", 500)?)?,
            permit_hold_ms: reader.ms("permit_hold_ms", 500)?,
            inhibit_hold_ms: reader.ms("inhibit_hold_ms", 500)?,
            permits_in_a_row: reader.whole(
                "permits_in_a_row",
                3,
                "a whole number from 1 to 65535",
                1..=65_535,
            )? as u16,
            restart: match reader.choice(
                "restart",
                ["automatic", "on_reset"],
                "`automatic` or `on_reset`",
            )? {
                0 => Restart::Automatic,
                _ => Restart::OnReset,
            },
            look_at: reader.look_at()?,
            cycle_ms: reader.ms("cycle_ms", 20)?,
            heartbeat_ms: reader.ms("heartbeat_ms", 50)?,
            valid_ms: reader.ms("valid_ms", 250)?,
            pose_delivery: reader.delivery("pose_reliability", "pose_durability", true)?,
            odom_delivery: reader.delivery("odom_reliability", "odom_durability", false)?,
            tracker,
            markers: reader.bool("markers", true)?,
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
        if !(self.response_ms() < self.maximum_age_ms) {
            return Err(SettingsError::Times(
                "maximum_age_ms is not above valid_ms + cycle_ms: a permission that consumers use for valid_ms would be older than that; lengthen maximum_age_ms or shorten valid_ms",
            ));
        }
        Ok(self.gate().check()?)
    }

    /// Returns the longest time from a step until every consumer has followed the answer of the next one: a cycle, and the time for
    /// which consumers use a permission when nothing follows it.
    #[must_use]
    pub const fn response_ms(&self) -> u32 {
        self.cycle_ms + self.valid_ms
    }

    /// Returns the settings of the gate.
    #[must_use]
    pub fn gate(&self) -> Settings<'_> {
        Settings {
            task: &self.task,
            site_digest: self.site_digest,
            sources: &self.sources,
            maximum_age_ms: self.maximum_age_ms,
            response_ms: self.response_ms(),
            report_period_ms: self.report_period_ms,
            permit_hold_ms: self.permit_hold_ms,
            inhibit_hold_ms: self.inhibit_hold_ms,
            permits_in_a_row: self.permits_in_a_row,
            restart: self.restart,
            look_at: self.look_at,
        }
    }

    /// Returns the name of the task.
    #[must_use]
    pub fn task(&self) -> &str {
        &self.task
    }

    /// Returns the digest of the site file, in hexadecimal digits.
    #[must_use]
    pub fn site(&self) -> String {
        hex(&self.site_digest)
    }
}

/// Returns bytes as hexadecimal digits.
fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Reads parameters by name.
struct Reader<'p>(&'p Parameters);

impl Reader<'_> {
    fn check_names(&self) -> Result<(), SettingsError> {
        let unknown = self.0.names().find(|name| !NAMES.contains(name));
        let Some(name) = unknown else {
            return Ok(());
        };
        let similar = NAMES
            .iter()
            .map(|known| (distance(name, known), known))
            .min();
        let hint = similar.filter(|(distance, _)| *distance <= 3);
        Err(SettingsError::Unknown {
            name: name.to_owned(),
            place: self.0.place(name).to_owned(),
            hint: hint.map_or(String::new(), |(_, known)| {
                format!(" (did you mean `{known}`?)")
            }),
            all: NAMES.join(", "),
        })
    }

    fn invalid(&self, name: &'static str, expected: &'static str) -> SettingsError {
        let given = match self.0.get(name) {
            Some(Value::Bool(value)) => value.to_string(),
            Some(Value::Integer(value)) => value.to_string(),
            Some(Value::Double(value)) => format!("{value:?}"),
            Some(Value::Text(value)) => format!("`{value}`"),
            None => "missing".into(),
        };
        SettingsError::Invalid {
            name,
            place: self.0.place(name).to_owned(),
            given,
            expected,
        }
    }

    fn bool(&self, name: &'static str, default: bool) -> Result<bool, SettingsError> {
        match self.0.get(name) {
            None => Ok(default),
            Some(Value::Bool(value)) => Ok(*value),
            Some(_) => Err(self.invalid(name, "true or false")),
        }
    }

    fn text(&self, name: &'static str, default: &str) -> Result<String, SettingsError> {
        match self.0.get(name) {
            None => Ok(default.to_owned()),
            Some(Value::Text(value)) if !value.is_empty() => Ok(value.clone()),
            Some(_) => Err(self.invalid(name, "a text that is not empty")),
        }
    }

    fn number(&self, name: &'static str) -> Result<Option<f64>, SettingsError> {
        match self.0.get(name) {
            None => Ok(None),
            Some(Value::Double(value)) if value.is_finite() && *value >= 0.0 => Ok(Some(*value)),
            Some(Value::Integer(value)) if *value >= 0 => Ok(Some(*value as f64)),
            Some(_) => Err(self.invalid(name, NUMBER)),
        }
    }

    fn whole(
        &self,
        name: &'static str,
        default: u32,
        expected: &'static str,
        range: std::ops::RangeInclusive<i64>,
    ) -> Result<u32, SettingsError> {
        match self.0.get(name) {
            None => Ok(default),
            Some(Value::Integer(value)) if range.contains(value) => {
                u32::try_from(*value).map_err(|_| self.invalid(name, expected))
            }
            Some(_) => Err(self.invalid(name, expected)),
        }
    }

    fn ms(&self, name: &'static str, default: u32) -> Result<u32, SettingsError> {
        self.whole(name, default, TIME, 1..=60_000)
    }

    /// Returns the index of a text among the choices; the first is the default.
    fn choice<const N: usize>(
        &self,
        name: &'static str,
        choices: [&str; N],
        expected: &'static str,
    ) -> Result<usize, SettingsError> {
        let given = match self.0.get(name) {
            None => return Ok(0),
            Some(Value::Text(given)) => choices.iter().position(|choice| choice == given),
            Some(_) => None,
        };
        given.ok_or_else(|| self.invalid(name, expected))
    }

    fn site(
        &self,
        option: Option<&str>,
        table: &Table<'_>,
    ) -> Result<([u8; 32], bool), SettingsError> {
        let expected = "the 64 hexadecimal digits that `posegate table info` prints";
        let parameter = match self.0.get("site_digest") {
            None => None,
            Some(Value::Text(digits)) => Some(digits.as_str()),
            Some(_) => return Err(self.invalid("site_digest", expected)),
        };
        let Some(digits) = option.or(parameter) else {
            return Ok((table.site_digest(), false));
        };
        let digest = site_digest(digits).ok_or_else(|| SettingsError::Invalid {
            name: "site_digest",
            place: if option.is_some() {
                "--site-digest"
            } else {
                self.0.place("site_digest")
            }
            .to_owned(),
            given: format!("`{digits}`"),
            expected,
        })?;
        if digest == table.site_digest() {
            Ok((digest, true))
        } else {
            Err(SettingsError::WrongSite {
                found: hex(&table.site_digest()),
                expected: digits.to_owned(),
            })
        }
    }

    fn trust(&self) -> Result<Trust, SettingsError> {
        let inflation = Inflation::new(self.number("inflation")?.unwrap_or(1.0))
            .ok_or_else(|| self.invalid("inflation", "a factor from 1 to 4096"))?;
        let expected = "`yaw_unknown` (AMCL), `all_unknown` (variances alone) or `filled` (all terms are the filter's)";
        let cross_terms = match self.choice(
            "cross_terms",
            ["yaw_unknown", "all_unknown", "filled"],
            expected,
        )? {
            0 => CrossTerms::YawUnknown(SplitWeight::HALF),
            1 => CrossTerms::AllUnknown(SplitWeight::HALF),
            _ => CrossTerms::Filled,
        };
        Ok(Trust {
            inflation,
            cross_terms,
        })
    }

    fn bounds(&self) -> Result<MotionBounds, SettingsError> {
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
        // A robot that is stated not to move at all is one that stands still: that has its own parameter.
        let across = across.unwrap_or(0.0);
        if along + across + turn == 0.0 {
            return Err(SettingsError::NoMotionBounds);
        }
        MotionBounds::new(along, across, turn.to_radians()).ok_or_else(|| {
            self.invalid(
                "max_speed",
                "speeds up to 1000 m/s and turn rates up to 1375 degrees/s",
            )
        })
    }

    fn look_at(&self) -> Result<Option<u32>, SettingsError> {
        let expected = "the id of a tag, a whole number that is not below zero";
        match self.0.get("look_at") {
            None => Ok(None),
            Some(_) => self
                .whole("look_at", 0, expected, 0..=i64::from(u32::MAX))
                .map(Some),
        }
    }

    fn delivery(
        &self,
        reliability: &'static str,
        durability: &'static str,
        is_latched: bool,
    ) -> Result<Delivery, SettingsError> {
        let reliable = self.choice(
            reliability,
            ["reliable", "best_effort"],
            "`reliable` or `best_effort`",
        )? == 0;
        let expected = "`transient_local` or `volatile`";
        let transient_local = match self.0.get(durability) {
            None => is_latched,
            Some(_) => self.choice(durability, ["transient_local", "volatile"], expected)? == 0,
        };
        Ok(Delivery {
            reliable,
            // Messages from before can only be kept for a reliable subscription.
            transient_local: transient_local && reliable,
        })
    }

    fn tracker(
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

/// Returns the number of single-letter changes between two names.
fn distance(from: &str, to: &str) -> usize {
    let to: Vec<char> = to.chars().collect();
    let mut row: Vec<usize> = (0..=to.len()).collect();
    for (i, a) in from.chars().take(64).enumerate() {
        let mut before = row[0];
        row[0] = i + 1;
        for (j, b) in to.iter().enumerate() {
            let changed = before + usize::from(a != *b);
            before = row[j + 1];
            row[j + 1] = changed.min(before + 1).min(row[j] + 1);
        }
    }
    row[to.len()]
}

#[cfg(test)]
mod tests;
