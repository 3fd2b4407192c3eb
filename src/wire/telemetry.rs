//! The telemetry of a controller (version 2).

use super::{Body, LONGEST_BODY, Reader, VERSION_2};
use crate::gate::{InterlockFault, Reason, State};
use heapless::Vec;

/// Type of the message.
pub(super) const TELEMETRY: u8 = 2;

const NOTHING: u8 = 0;
const WEIGHED: u8 = 1;

/// The message that a controller sends once per control cycle, and once for every report. It contains
/// the state of the gate, the report that was evaluated, and the clock by which a sender stamps its
/// reports.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Telemetry {
    /// The number of this message: a gap shows a message that did not fit on the line.
    pub number: u32,
    /// The number of the control cycle.
    pub cycle: u32,
    /// The controller's clock in that cycle, milliseconds, wrapping.
    pub now_ms: u32,
    /// The report that was evaluated, if any.
    pub weighed: Option<ReportOutcome>,
    /// The state of the gate after that report, or after the cycle.
    pub state: State,
    /// `true` if the permission given to the interlock is a permit.
    pub permitted: bool,
    /// `true` if the interlock's output is high, read back.
    pub interlock_high: bool,
    /// The latched fault of the interlock; `None` if there is none.
    pub fault: Option<InterlockFault>,
    /// Counts of the serial line.
    pub line: LinkCounters,
}

/// A report with the gate's verdict on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ReportOutcome {
    /// The source in the report.
    pub source: u8,
    /// The report's sequence number.
    pub sequence: u32,
    /// The report's stamp as the controller received it, milliseconds.
    pub stamp_ms: u32,
    /// `Ok` if the report permits by itself.
    pub verdict: Result<(), Reason>,
}

/// Counts of a controller's line since its start. All counts wrap.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct LinkCounters {
    /// Bytes received.
    pub bytes: u32,
    /// Bytes lost: they arrived faster than they could be stored.
    pub lost: u32,
    /// Frames that were damaged, or not reports.
    pub refused: u32,
    /// Reports skipped: more came in a cycle than the controller evaluates.
    pub left_aside: u32,
}

impl Telemetry {
    /// Returns the body of the message.
    #[must_use]
    pub fn body(&self) -> Vec<u8, LONGEST_BODY> {
        let (mark, rest) = match self.state {
            State::Inhibited(reason) => (1, u16::from(reason.code())),
            State::Qualifying(count) => (2, count),
            State::Permitted => (3, 0),
            State::Latched(reason) => (4, u16::from(reason.code())),
        };
        let flags = u8::from(self.permitted) | u8::from(self.interlock_high) << 1;
        let fault = match self.fault {
            None => 0,
            Some(InterlockFault::Output) => 1,
            Some(InterlockFault::Input) => 2,
            Some(InterlockFault::NotFollowing) => 3,
            Some(InterlockFault::Heartbeat) => 4,
            Some(InterlockFault::OldPermission) => 5,
        };
        let (weighed, source, sequence, stamp_ms, reason) = match self.weighed {
            None => (NOTHING, 0, 0, 0, 0),
            Some(report) => (
                WEIGHED,
                report.source,
                report.sequence,
                report.stamp_ms,
                report.verdict.map_or_else(Reason::code, |()| 0),
            ),
        };
        let mut body = Body(Vec::new());
        body.put([VERSION_2, TELEMETRY]);
        for word in [self.number, self.cycle, self.now_ms] {
            body.put(word.to_le_bytes());
        }
        body.put([mark]);
        body.put(rest.to_le_bytes());
        body.put([flags, fault, weighed, source]);
        body.put(sequence.to_le_bytes());
        body.put(stamp_ms.to_le_bytes());
        body.put([reason]);
        let LinkCounters {
            bytes,
            lost,
            refused,
            left_aside,
        } = self.line;
        for count in [bytes, lost, refused, left_aside] {
            body.put(count.to_le_bytes());
        }
        body.0
    }

    /// Parses telemetry from the body of a message, or returns `None` if it is not telemetry.
    #[must_use]
    pub fn from_body(body: &[u8]) -> Option<Self> {
        let mut rest = Reader(body);
        if rest.take()? != [VERSION_2, TELEMETRY] {
            return None;
        }
        let (number, cycle, now_ms) = (rest.word()?, rest.word()?, rest.word()?);
        let [mark] = rest.take()?;
        let value = u16::from_le_bytes(rest.take()?);
        let reason = || Reason::from_code(u8::try_from(value).ok()?);
        let state = match mark {
            1 => State::Inhibited(reason()?),
            2 => State::Qualifying(value),
            3 if value == 0 => State::Permitted,
            4 => State::Latched(reason()?),
            _ => return None,
        };
        let [flags, fault, weighed, source] = rest.take()?;
        let fault = match fault {
            0 => None,
            1 => Some(InterlockFault::Output),
            2 => Some(InterlockFault::Input),
            3 => Some(InterlockFault::NotFollowing),
            4 => Some(InterlockFault::Heartbeat),
            5 => Some(InterlockFault::OldPermission),
            _ => return None,
        };
        let (sequence, stamp_ms) = (rest.word()?, rest.word()?);
        let [reason] = rest.take()?;
        let weighed = match weighed {
            NOTHING if (source, sequence, stamp_ms, reason) == (0, 0, 0, 0) => None,
            WEIGHED => Some(ReportOutcome {
                source,
                sequence,
                stamp_ms,
                verdict: match reason {
                    0 => Ok(()),
                    code => Err(Reason::from_code(code)?),
                },
            }),
            _ => return None,
        };
        let line = LinkCounters {
            bytes: rest.word()?,
            lost: rest.word()?,
            refused: rest.word()?,
            left_aside: rest.word()?,
        };
        (flags < 4 && rest.0.is_empty()).then_some(Self {
            number,
            cycle,
            now_ms,
            weighed,
            state,
            permitted: flags & 1 != 0,
            interlock_high: flags & 2 != 0,
            fault,
            line,
        })
    }
}

#[cfg(test)]
mod tests;
