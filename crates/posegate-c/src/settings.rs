//! The settings of a gate: a constant in flash.

use super::memory::{Plain, unused, write};
use super::posegate_status;
use core::ffi::c_char;
use posegate::gate::{Restart, Settings, Source};
use posegate::motion::MotionBounds;
use posegate::set::{Aging, CrossTerms, Inflation, MOST_AGES, SplitWeight};

/// Bytes of a name. A shorter name is padded with zeros, as a C initialiser does.
pub const POSEGATE_NAME_LENGTH: usize = 32;
/// Largest number of sources of a gate.
pub const POSEGATE_MOST_SOURCES: usize = 4;
/// The value of a tag's number if there is no tag.
pub const POSEGATE_NO_TAG: u32 = 0xffff_ffff;

/// The terms of its covariance that a source fills. 0 is not a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum posegate_cross_terms {
    /// All terms.
    Filled = 1,
    /// All but those between yaw and plane (AMCL): the values there are ignored.
    YawUnknown = 2,
    /// Only the variances (such as a landing target's).
    AllUnknown = 3,
}

/// The condition for a restart after a permit has ended. 0 is not a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum posegate_restart {
    /// After a denial the gate qualifies again by itself. Only faults wait for a reset.
    Automatic = 1,
    /// After every end of a permit the gate waits for a reset (no automatic restart, ISO 3691-4:2020, 4.1.14).
    OnReset = 2,
}

/// The movement of the robot while an estimate is used, from its stamp until its permission ends. 0 is not a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum posegate_motion {
    /// The robot does not move. Other means must ensure this, such as brakes that the same output releases. The source's
    /// speeds are ignored.
    StandsStill = 1,
    /// The robot moves within the speeds of the source.
    Moves = 2,
}

/// Largest number of inflations by age of a source.
pub const POSEGATE_MOST_AGES: usize = 4;
const _: () = assert!(POSEGATE_MOST_AGES == MOST_AGES);

/// The inflation of estimates up to a time since the last fix.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct posegate_age {
    /// The largest time since the last fix, milliseconds, rounded down to 64 ms: at least 64, and more than in the entry before. 0 if
    /// this entry and those after it are not used.
    pub until_ms: u32,
    /// The factor by which covariances are multiplied, unit 2^-16: at least 1, not less than in the entry before, not more than the
    /// source's own. It is rounded up to 2^-6.
    pub inflation_q16: u32,
}

/// A localization source as the controller knows it.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct posegate_source {
    /// The frame that the source's reports must be in, such as "map".
    pub frame: [c_char; POSEGATE_NAME_LENGTH],
    /// The factor by which the source's covariances are multiplied before use: from 1 to 4096.
    pub inflation: f64,
    /// A `posegate_cross_terms`.
    pub cross_terms: u32,
    /// If terms are unknown: the plane's share of the spread, from 1 to 255 of 256. 128 doubles both blocks.
    pub share_q8: u32,
    /// A `posegate_motion`.
    pub motion: u32,
    /// Reserved: must be 0.
    pub reserved: u32,
    /// The largest speed along the robot's axis, m/s, in either direction. Every possible movement counts, also without a
    /// command.
    pub along_m_s: f64,
    /// The largest speed across the robot's axis, m/s, in either direction, of the point whose pose is reported. 0 is true of a point on
    /// the axle of a differential drive whose wheels do not slip sideways; a point L metres ahead of the axle needs L times the turn rate.
    pub across_m_s: f64,
    /// The largest turn rate, rad/s, in either direction.
    pub turn_rad_s: f64,
    /// Smaller inflations for estimates soon after a fix (`posegate_evidence.since_fix_ms`), the youngest first; all zero if one factor is
    /// used. A tracker does not use them.
    pub ages: [posegate_age; POSEGATE_MOST_AGES],
}

/// The parameters of a gate. No accepted value switches a check off, and zeroed settings are refused.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct posegate_settings {
    /// The task that the table must be for.
    pub task: [c_char; POSEGATE_NAME_LENGTH],
    /// The task digest that the table must have: SHA-256 of the set, the goal and the confidence (`posegate table info` prints it).
    pub task_digest: [u8; 32],
    /// The sources. A report carries the index of its source.
    pub sources: [posegate_source; POSEGATE_MOST_SOURCES],
    /// The number of sources: at least 1.
    pub source_count: u32,
    /// The oldest estimate that may keep the interlock open, in milliseconds: from 1 to 2^31 - 1. The age counts
    /// up to the end of the permission, `response_ms` after the time of the step.
    pub maximum_age_ms: u32,
    /// The longest time from the `now_ms` of one step or tick until the output has followed the answer of the next
    /// one, in milliseconds: at least 1, and less than `maximum_age_ms`. It is the sum of the longest period of
    /// the control cycle, the longest duration of a step and the delay of the output. `posegate table cost` states the
    /// instructions of a step, or of a cycle with a tracker, for your table and core.
    /// If a later cycle finds the gate open, the gate closes: `POSEGATE_REASON_CYCLE_LATE`.
    pub response_ms: u32,
    /// The longest time between two reports of the sources, in milliseconds: from 1 to 2^31 - 1. Settings with which reports at this
    /// distance would never open the gate are refused.
    pub report_period_ms: u32,
    /// A permit ends if no further permit comes for longer than this, in milliseconds: from 1 to 2^31 - 1; at least
    /// `report_period_ms` if more than one permit in a row is needed.
    pub permit_hold_ms: u32,
    /// After a denial, and after the start, nothing is permitted for this time, in milliseconds: from 1 to 2^31 -
    /// 1.
    pub inhibit_hold_ms: u32,
    /// The number of consecutive reports that must permit before the gate opens: from 1 to 65,535.
    pub permits_in_a_row: u32,
    /// A `posegate_restart`.
    pub restart: u32,
    /// The tag that the robot should look at to relocalise for this task, or `POSEGATE_NO_TAG`. Only the advice
    /// uses it.
    pub look_at_tag: u32,
    /// The largest number of runs of cells that a decision reads (a row without a run counts as one), for a table with cells; 0 means 1,000.
    /// A pose-set that needs more is denied: `POSEGATE_REASON_TOO_COSTLY`. A run takes at most 150 instructions on a Cortex-M4F, and each slab of headings that a set meets 3,500.
    /// Facets are not affected.
    pub most_runs: u32,
}

// SAFETY: numbers.
unsafe impl Plain for posegate_settings {}

/// Writes settings whose times fit a source that reports every `period_ms`, and whose reports arrive up to `jitter_ms` after their
/// stamps: such as 500 and 100 for AMCL at 2 Hz. Task, task digest and sources are zero and must be filled in; `response_ms` is 20,
/// `permits_in_a_row` 3, and the restart is automatic.
///
/// Two reports arrive at most `period_ms + jitter_ms` apart: this is `report_period_ms` and `inhibit_hold_ms`. `permit_hold_ms` is one
/// response longer, `maximum_age_ms` two. If the response time of your controller is longer than 20 ms, set `response_ms`, and add the
/// difference to `permit_hold_ms` and twice the difference to `maximum_age_ms`. One lost report closes the gate; to tolerate one, give twice
/// the period. The movement that is possible in these times is added to every set, so short times leave more slack. Odometry makes them
/// short (`posegate_tracker`), and the period is then the odometry's.
///
/// # Safety
/// Each pointer is null, misaligned, or valid for its type.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn posegate_settings_for_source(
    period_ms: u32,
    jitter_ms: u32,
    settings: *mut posegate_settings,
) -> posegate_status {
    let times = Settings::for_source(period_ms, jitter_ms);
    let fitting = posegate_settings {
        maximum_age_ms: times.maximum_age_ms,
        response_ms: times.response_ms,
        report_period_ms: times.report_period_ms,
        permit_hold_ms: times.permit_hold_ms,
        inhibit_hold_ms: times.inhibit_hold_ms,
        permits_in_a_row: u32::from(times.permits_in_a_row),
        restart: posegate_restart::Automatic as u32,
        most_runs: times.most_runs,
        look_at_tag: POSEGATE_NO_TAG,
        ..Plain::ZERO
    };
    // SAFETY: the caller's promise.
    posegate_status::of(|| unsafe { write(settings, fitting) })
}

/// Returns the bytes of a name, and its length up to the first zero.
pub(super) fn name(from: &[c_char; POSEGATE_NAME_LENGTH]) -> ([u8; POSEGATE_NAME_LENGTH], usize) {
    let bytes = from.map(|character| {
        let [byte] = character.to_ne_bytes();
        byte
    });
    let length = bytes.iter().take_while(|byte| **byte != 0).count();
    (bytes, length)
}

impl posegate_source {
    pub(super) fn source(&self) -> Result<Source, posegate_status> {
        const FILLED: u32 = posegate_cross_terms::Filled as u32;
        const YAW_UNKNOWN: u32 = posegate_cross_terms::YawUnknown as u32;
        const ALL_UNKNOWN: u32 = posegate_cross_terms::AllUnknown as u32;
        const STANDS_STILL: u32 = posegate_motion::StandsStill as u32;
        const MOVES: u32 = posegate_motion::Moves as u32;
        unused(self.reserved)?;
        let share = u8::try_from(self.share_q8)
            .ok()
            .and_then(SplitWeight::from_q8);
        let share = share.ok_or(posegate_status::CrossTerms);
        let cross_terms = match self.cross_terms {
            FILLED => CrossTerms::Filled,
            YAW_UNKNOWN => CrossTerms::YawUnknown(share?),
            ALL_UNKNOWN => CrossTerms::AllUnknown(share?),
            _ => return Err(posegate_status::CrossTerms),
        };
        let (bytes, length) = name(&self.frame);
        let frame = bytes.get(..length).unwrap_or_default();
        let frame = core::str::from_utf8(frame).map_err(|_| posegate_status::Frame)?;
        let motion = match self.motion {
            STANDS_STILL => Some(MotionBounds::STANDS_STILL),
            // A robot that moves has a speed: zeros were forgotten.
            MOVES => MotionBounds::new(self.along_m_s, self.across_m_s, self.turn_rad_s)
                .filter(|bounds| *bounds != MotionBounds::STANDS_STILL),
            _ => None,
        };
        let motion = motion.ok_or(posegate_status::Motion)?;
        let source = Source::new(frame, self.inflation, cross_terms, motion)?;
        let aging = self.aging().ok_or(posegate_status::Aging)?;
        Ok(Source { aging, ..source })
    }

    fn aging(&self) -> Option<Aging> {
        let used = self.ages.iter().take_while(|age| age.until_ms != 0).count();
        let (used, rest) = self.ages.split_at_checked(used)?;
        if rest
            .iter()
            .any(|age| (age.until_ms, age.inflation_q16) != (0, 0))
        {
            return None;
        }
        let mut steps = [(0, Inflation::NONE); POSEGATE_MOST_AGES];
        for (step, age) in steps.iter_mut().zip(used) {
            *step = (age.until_ms, Inflation::from_q16(age.inflation_q16)?);
        }
        Aging::new(steps.get(..used.len())?)
    }
}

impl posegate_settings {
    pub(super) const fn restart(&self) -> Result<Restart, posegate_status> {
        const AUTOMATIC: u32 = posegate_restart::Automatic as u32;
        const ON_RESET: u32 = posegate_restart::OnReset as u32;
        match self.restart {
            AUTOMATIC => Ok(Restart::Automatic),
            ON_RESET => Ok(Restart::OnReset),
            _ => Err(posegate_status::Restart),
        }
    }
}
