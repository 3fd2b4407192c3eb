//! Estimates in and verdicts out as small framed messages over a serial line.
//!
//! A frame is a body and its CRC-32C (little-endian), both encoded with COBS (Consistent Overhead Byte Stuffing,
//! Cheshire and Baker 1999), and a zero byte. Floats are sent as their bits, so the controller decides on exactly the
//! sender's numbers. A frame that is damaged, cut, too long or of another version is answered with its [`WireError`]
//! and denies.
//!
//! | request | type | | reply | type |
//! |---|---|---|---|---|
//! | version, 1 | u8 | | version, 1 | u8 |
//! | sequence number | u16 | | sequence number | u16 |
//! | table number | u8 | | status: 0, or a [`WireError`] | u8 |
//! | kind: 1 Gaussian, 2 bounded | u8 | | verdict: 0xA5 permit, 0 deny | u8 |
//! | stamp of the estimate, ms | u32 | | reason, 0 for none | u8 |
//! | time of use, ms | u32 | | bits: 0 margin, 1 worst pose, 2 interlock is high | u8 |
//! | squared radius, 2^-16 | u32 | | margin, 2^-16 | u32 |
//! | x, y (m), yaw (rad) | 3 f64 | | worst pose: x, y (um) | 2 i32 |
//! | Gaussian: covariance by rows; bounded: m, rad | 9 or 2 f64 | | worst pose: yaw (2^-32 turn) | u32 |
//!
//! The messages of version 1 request the verdict on one estimate. The messages of version 2 are for a
//! [`crate::gate::Gate`], which keeps state: a [`crate::report::Report`] ([`report_body`], [`report_from_body`]), and
//! the controller's [`Telemetry`], once per cycle. A sender learns the controller's clock from the telemetry and stamps
//! its reports by it.
//!
//! | report | type | | telemetry | type |
//! |---|---|---|---|---|
//! | version, 2 | u8 | | version, 2 | u8 |
//! | message, 1 | u8 | | message, 2 | u8 |
//! | source | u8 | | number of this message | u32 |
//! | heading: 1 yaw, 2 roll pitch yaw, 3 quaternion | u8 | | control cycle | u32 |
//! | spread: 0 unknown, 1 Gaussian, 2 bounded | u8 | | controller's clock, ms | u32 |
//! | sequence number | u32 | | state: 1 inhibited, 2 qualifying, 3 permitted, 4 latched | u8 |
//! | stamp, ms of the controller's clock | u32 | | reason of 1 and 4, permits of 2, or 0 | u16 |
//! | frame: digest of its name | u64 | | bits: 0 permitted, 1 interlock is high | u8 |
//! | x, y (m) | 2 f64 | | fault: 0 none, 1 output, 2 input, 3 not following, 4 heartbeat, 5 old permission | u8 |
//! | yaw; roll, pitch, yaw (rad); or x, y, z, w | 1, 3 or 4 f64 | | a report was evaluated: 1 (or 0, and the next four are 0) | u8 |
//! | nothing; covariance by rows; or m, rad | 0, 9 or 2 f64 | | its source | u8 |
//! | | | | its sequence number | u32 |
//! | | | | its stamp, ms | u32 |
//! | | | | its reason, 0 for a permit | u8 |
//! | | | | bytes received, bytes lost, frames refused, reports skipped | 4 u32 |
//!
//! Two more messages go to a gate of a robot that moves. A report with several hypotheses is sent as one message for each of them, in
//! order, and then the report ([`HypothesisCollector`]); these have the bytes of a report, but the message is `0x10 + k` for hypothesis
//! k and `0x20 + n` for the report after n hypotheses. An increment of the odometry ([`increment_body`]) is:
//!
//! | odometry | type |
//! |---|---|
//! | version, 2 | u8 |
//! | message, 4 | u8 |
//! | stamps of its beginning and its end, ms of the controller's clock | 2 u32 |
//! | ahead, to the left (2^-8 um) | 2 i32 |
//! | turn, counter-clockwise (2^-32 turn) | i32 |
//!
//! ```
//! use posegate::report::{FrameId, PoseEstimate, Report};
//! use posegate::set::{Estimate, Uncertainty};
//! use posegate::wire::{Receiver, encode, report_body, report_from_body};
//!
//! let report = Report {
//!     source: 0,
//!     frame: FrameId::of("map"),
//!     sequence: 1,
//!     stamp_ms: 20,
//!     belief: PoseEstimate::new(
//!         Estimate { x_m: 0.5, y_m: 0.0, yaw_rad: 0.0 },
//!         Uncertainty::Bounded { translation_m: 0.05, yaw_rad: 0.02 },
//!     ),
//! };
//! // The sender's bytes, and the controller that takes them one by one.
//! let bytes = encode(&report_body(&report));
//! let mut receiver = Receiver::new();
//! let received = bytes.iter().find_map(|byte| receiver.push(*byte)).expect("a whole frame");
//! assert_eq!(received.and_then(|body| report_from_body(&body)), Ok(report));
//!
//! // One damaged byte: a frame with an error.
//! let mut damaged = bytes;
//! damaged[9] ^= 0x10;
//! let received = damaged.iter().find_map(|byte| receiver.push(*byte)).expect("a whole frame");
//! assert!(received.is_err());
//! ```

use crate::contain::Margin;
use crate::gate::{Reason, Verdict};
use crate::num::BinaryAngle;
use crate::pose::Pose;
use crate::recordings::Evaluator;
use crate::set::{Estimate, InputError, PoseSet, RadiusSquared};
use heapless::Vec;

pub use self::frame::{Receiver, encode};
pub use self::hypotheses::{HypothesisCollector, counted_report_body, hypothesis_body};
pub use self::odometry::{increment_body, increment_from_body};
pub use self::report::{report_body, report_from_body};
pub use self::telemetry::{LinkCounters, ReportOutcome, Telemetry};
pub use crate::set::Uncertainty;

mod cobs;
mod frame;
mod hypotheses;
mod odometry;
mod report;
mod telemetry;

/// Version of the messages about single estimates.
pub const VERSION: u8 = 1;
/// Version of the messages from and to a gate with state.
pub const VERSION_2: u8 = 2;
/// Longest body of a message: a report with a quaternion and a covariance.
pub const LONGEST_BODY: usize = 141;
/// Longest frame: body, CRC, one COBS byte per 254 bytes, and the zero.
pub const LONGEST_FRAME: usize = LONGEST_BODY + 4 + 1 + 1;

/// A body whose checksum was correct.
pub type Frame = Vec<u8, { LONGEST_FRAME }>;

const PERMIT: u8 = 0xa5;
const GAUSSIAN: u8 = 1;
const BOUNDED: u8 = 2;

/// The reason why a frame is not a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
#[repr(u8)]
pub enum WireError {
    /// Longer than any message, or not COBS.
    Frame = 1,
    /// The checksum is wrong.
    Checksum = 2,
    /// Another version, an unknown kind, a radius out of range or below the table's, or a wrong length.
    Content = 3,
    /// There is no table of that number.
    Table = 4,
}

messages!(WireError {
    Frame => "the frame is longer than any message, or not COBS",
    Checksum => "the checksum of the frame is wrong",
    Content => "the message has another version, an unknown kind, a radius out of range or a wrong length",
    Table => "there is no table of the requested number",
});

/// A request to evaluate an estimate.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Request {
    /// Returned in the reply.
    pub sequence: u16,
    /// The index of the controller's table to use.
    pub table: u8,
    /// The time of the estimate, milliseconds of a wrapping clock.
    pub stamp_ms: u32,
    /// The time at which the estimate is used, milliseconds of the same clock. A controller with its own clock uses
    /// that instead.
    pub now_ms: u32,
    /// Squared radius of a Gaussian set, at least that of the table.
    pub radius_squared: RadiusSquared,
    /// The estimate.
    pub estimate: Estimate,
    /// The uncertainty of the estimate.
    pub spread: Uncertainty,
}

/// A reply with a verdict.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Reply {
    /// The sequence number of the request; 0xffff if the frame was not a request that could be evaluated.
    pub sequence: u16,
    /// The verdict, or the reason why the frame was not a request.
    pub verdict: Result<Verdict, WireError>,
    /// `true` if the interlock output is high, read back after the verdict.
    pub interlock_high: bool,
}

impl Request {
    /// Returns the pose-set of the request.
    ///
    /// # Errors
    /// The errors of [`PoseSet::gaussian`] and [`PoseSet::bounded`].
    pub fn pose_set(&self) -> Result<PoseSet, InputError> {
        match self.spread {
            Uncertainty::Gaussian(covariance) => {
                PoseSet::gaussian(self.estimate, covariance, self.radius_squared)
            }
            Uncertainty::Bounded {
                translation_m,
                yaw_rad,
            } => PoseSet::bounded(self.estimate, translation_m, yaw_rad),
        }
    }

    /// Returns the verdict of the evaluator that the request names.
    ///
    /// # Errors
    /// [`WireError::Table`] if there is no such evaluator. [`WireError::Content`] if the request has a smaller radius
    /// than the table was made for: the sender may be stricter than the site, but not less strict.
    pub fn evaluate(&self, gates: &[Evaluator<'_>]) -> Result<Verdict, WireError> {
        let gate = gates.get(usize::from(self.table)).ok_or(WireError::Table)?;
        let is_gaussian = matches!(self.spread, Uncertainty::Gaussian(_));
        if is_gaussian && !(self.radius_squared.q16() >= gate.radius_squared().q16()) {
            return Err(WireError::Content);
        }
        Ok(gate.evaluate(self.now_ms, self.stamp_ms, self.pose_set()))
    }

    /// Returns the body of the message.
    #[must_use]
    pub fn body(&self) -> Vec<u8, LONGEST_BODY> {
        let mut body = Body(Vec::new());
        let kind = match self.spread {
            Uncertainty::Gaussian(_) => GAUSSIAN,
            Uncertainty::Bounded { .. } => BOUNDED,
        };
        body.put([VERSION]);
        body.put(self.sequence.to_le_bytes());
        body.put([self.table, kind]);
        body.put(self.stamp_ms.to_le_bytes());
        body.put(self.now_ms.to_le_bytes());
        body.put(self.radius_squared.q16().to_le_bytes());
        for value in [self.estimate.x_m, self.estimate.y_m, self.estimate.yaw_rad] {
            body.put(value.to_le_bytes());
        }
        match self.spread {
            Uncertainty::Gaussian(covariance) => {
                for value in covariance.as_flattened() {
                    body.put(value.to_le_bytes());
                }
            }
            Uncertainty::Bounded {
                translation_m,
                yaw_rad,
            } => {
                body.put(translation_m.to_le_bytes());
                body.put(yaw_rad.to_le_bytes());
            }
        }
        body.0
    }

    /// Parses a request from the body of a message.
    ///
    /// # Errors
    /// [`WireError::Content`] if the body is not a request.
    pub fn from_body(body: &[u8]) -> Result<Self, WireError> {
        Self::read(body).ok_or(WireError::Content)
    }

    fn read(body: &[u8]) -> Option<Self> {
        let mut rest = Reader(body);
        let [version] = rest.take()?;
        if version != VERSION {
            return None;
        }
        let sequence = u16::from_le_bytes(rest.take()?);
        let [table, kind] = rest.take()?;
        let stamp_ms = u32::from_le_bytes(rest.take()?);
        let now_ms = u32::from_le_bytes(rest.take()?);
        let radius_squared = RadiusSquared::from_q16(u32::from_le_bytes(rest.take()?))?;
        let estimate = Estimate {
            x_m: rest.float()?,
            y_m: rest.float()?,
            yaw_rad: rest.float()?,
        };
        let spread = match kind {
            GAUSSIAN => {
                let mut row = || Some([rest.float()?, rest.float()?, rest.float()?]);
                Uncertainty::Gaussian([row()?, row()?, row()?])
            }
            BOUNDED => Uncertainty::Bounded {
                translation_m: rest.float()?,
                yaw_rad: rest.float()?,
            },
            _ => return None,
        };
        rest.0.is_empty().then_some(Self {
            sequence,
            table,
            stamp_ms,
            now_ms,
            radius_squared,
            estimate,
            spread,
        })
    }
}

impl Reply {
    /// Returns the reply to a frame that was not a request, or named no table: closed. The interlock must have been
    /// closed before.
    #[must_use]
    pub const fn refused(error: WireError) -> Self {
        Self {
            sequence: u16::MAX,
            verdict: Err(error),
            interlock_high: false,
        }
    }

    /// Returns the body of the message.
    #[must_use]
    pub fn body(&self) -> Vec<u8, LONGEST_BODY> {
        let (status, verdict, reason, margin, worst) = match self.verdict {
            Err(error) => (error as u8, 0, 0, None, None),
            Ok(Verdict::Permit { margin }) => (0, PERMIT, 0, Some(margin), None),
            Ok(Verdict::Deny {
                reason,
                margin,
                worst_pose,
            }) => (0, 0, reason.code(), margin, worst_pose),
        };
        let flags = u8::from(margin.is_some())
            | u8::from(worst.is_some()) << 1
            | u8::from(self.interlock_high) << 2;
        let pose = worst.unwrap_or_default();
        let mut body = Body(Vec::new());
        body.put([VERSION]);
        body.put(self.sequence.to_le_bytes());
        body.put([status, verdict, reason, flags]);
        body.put(margin.map_or(0, Margin::q16).to_le_bytes());
        body.put(pose.x_um.to_le_bytes());
        body.put(pose.y_um.to_le_bytes());
        body.put(pose.yaw.0.to_le_bytes());
        body.0
    }

    /// Parses a reply from the body of a message, or returns `None` if it is not a reply.
    #[must_use]
    pub fn from_body(body: &[u8]) -> Option<Self> {
        let mut rest = Reader(body);
        let [version] = rest.take()?;
        let sequence = u16::from_le_bytes(rest.take()?);
        let [status, verdict, reason, flags] = rest.take()?;
        let margin = Margin::from_q16(u32::from_le_bytes(rest.take()?));
        let worst_pose = Pose {
            x_um: i32::from_le_bytes(rest.take()?),
            y_um: i32::from_le_bytes(rest.take()?),
            yaw: BinaryAngle(u32::from_le_bytes(rest.take()?)),
        };
        if version != VERSION || flags > 7 || !rest.0.is_empty() {
            return None;
        }
        let margin = (flags & 1 != 0).then_some(margin);
        let worst_pose = (flags & 2 != 0).then_some(worst_pose);
        let verdict = match (status, verdict) {
            (0, PERMIT) => Ok(Verdict::Permit { margin: margin? }),
            (0, 0) => Ok(Verdict::Deny {
                reason: Reason::from_code(reason)?,
                margin,
                worst_pose,
            }),
            (1, 0) => Err(WireError::Frame),
            (2, 0) => Err(WireError::Checksum),
            (3, 0) => Err(WireError::Content),
            (4, 0) => Err(WireError::Table),
            _ => return None,
        };
        Some(Self {
            sequence,
            verdict,
            interlock_high: flags & 4 != 0,
        })
    }
}

/// A body under construction. Every message fits: the longest has [`LONGEST_BODY`] bytes, which tests check.
struct Body(Vec<u8, LONGEST_BODY>);

impl Body {
    fn put<const N: usize>(&mut self, bytes: [u8; N]) {
        // A body that is cut has a wrong length, so the reader refuses it.
        let _ = cobs::append(&mut self.0, &bytes);
    }

    fn floats(&mut self, values: &[f64]) {
        for value in values {
            self.put(value.to_le_bytes());
        }
    }
}

/// The part of a body that has not been read.
struct Reader<'a>(&'a [u8]);

impl Reader<'_> {
    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (head, rest) = self.0.split_first_chunk::<N>()?;
        self.0 = rest;
        Some(*head)
    }

    fn float(&mut self) -> Option<f64> {
        self.take().map(f64::from_le_bytes)
    }

    fn word(&mut self) -> Option<u32> {
        self.take().map(u32::from_le_bytes)
    }
}

#[cfg(test)]
mod tests;
