//! The line to a controller over time: its last telemetry and a bound of its age. This module does no input or
//! output.
//!
//! A permit of the controller is valid only for a moment. A line can be silent, repeat old bytes or deliver them
//! late, and a controller can restart. Therefore a state counts only if its age has a bound, and the bound is short.
//! The bound comes from a round trip: telemetry that names one of our reports was made after we sent that report.
//! Later telemetry is later by the controller's clock, reduced by [`DRIFT_PER_MILLE`]. This lasts for at most
//! [`LIFE`]: then another round trip is needed. So no delay of the line, even if constant, makes an old state look
//! new. If the clock is faster than assumed, a state looks younger by at most what the clock gains in [`LIFE`].

use posegate::gate::State;
use posegate::wire::{Receiver, Telemetry};
use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// The controller's clock may be faster than this machine's by this much, in thousandths: an RC oscillator is within
/// 30.
pub const DRIFT_PER_MILLE: u32 = 30;
/// The time for which a round trip bounds the age of later telemetry, by the controller's clock.
pub const LIFE: Duration = Duration::from_secs(2);
/// The number of reports whose telemetry may still arrive.
const SENT: usize = 64;
/// A state that would be made this much later than it arrived is of another clock: times are whole milliseconds.
const AHEAD: Duration = Duration::from_millis(2);
/// The source of the reports that this end sends.
pub const SOURCE: u8 = 0;

/// The counts of a line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Telemetry messages that were read.
    pub telemetry: u64,
    /// Frames that were damaged.
    pub damaged: u64,
    /// Frames that are not telemetry of this version.
    pub foreign: u64,
    /// Messages that were repeated.
    pub repeated: u64,
    /// Messages that were lost, by their numbers.
    pub lost: u64,
    /// The number of restarts of the controller or its clock.
    pub restarts: u64,
}

/// The line to a controller, without any telemetry at first.
#[derive(Debug, Default)]
pub struct Link {
    receiver: Receiver,
    /// The last telemetry, and when it arrived.
    last: Option<(Telemetry, Instant)>,
    /// A time of the controller's clock, and a time of this machine that was certainly before it.
    anchor: Option<(u32, Instant)>,
    sent: VecDeque<(u32, Instant)>,
    counts: Counts,
}

impl Link {
    /// Forgets all telemetry: the line was closed.
    pub fn close(&mut self) {
        let counts = self.counts;
        *self = Self {
            counts,
            ..Self::default()
        };
    }

    /// Adds bytes that were read.
    pub fn take(&mut self, bytes: &[u8], at: Instant) {
        for byte in bytes {
            match self.receiver.push(*byte) {
                None => {}
                Some(Err(_)) => self.counts.damaged += 1,
                Some(Ok(body)) => match Telemetry::from_body(&body) {
                    None => self.counts.foreign += 1,
                    Some(telemetry) => self.hear(telemetry, at),
                },
            }
        }
    }

    fn hear(&mut self, telemetry: Telemetry, at: Instant) {
        if let Some((last, _)) = &self.last {
            let steps = telemetry.number.wrapping_sub(last.number);
            let passed = telemetry.now_ms.wrapping_sub(last.now_ms);
            if telemetry == *last {
                self.counts.repeated += 1;
                return;
            }
            if (1..1 << 31).contains(&steps) && passed < 1 << 31 {
                self.counts.lost += u64::from(steps - 1);
            } else {
                self.restart();
            }
        }
        self.counts.telemetry += 1;
        self.last = Some((telemetry, at));
        if let Some(report) = telemetry.weighed.filter(|report| report.source == SOURCE) {
            let sent = self
                .sent
                .iter()
                .find(|(number, _)| *number == report.sequence);
            if let Some((_, sent)) = sent {
                let is_newer = self
                    .made_after(telemetry.now_ms)
                    .is_none_or(|bound| bound < *sent);
                if is_newer {
                    self.anchor = Some((telemetry.now_ms, *sent));
                }
            }
        }
        if self
            .made_after(telemetry.now_ms)
            .is_some_and(|bound| bound > at + AHEAD)
        {
            self.restart();
        }
    }

    /// Starts with a new clock of the controller. Earlier telemetry is of the old clock.
    fn restart(&mut self) {
        self.counts.restarts += 1;
        self.anchor = None;
        self.sent.clear();
    }

    /// Returns a time of this machine that was certainly before a time of the controller's clock. `None` if there is
    /// no recent round trip.
    fn made_after(&self, now_ms: u32) -> Option<Instant> {
        let (anchor_ms, anchor) = self.anchor?;
        let passed = u64::from(now_ms.wrapping_sub(anchor_ms));
        if u128::from(passed) > LIFE.as_millis() {
            return None;
        }
        let certain = passed - (passed * u64::from(DRIFT_PER_MILLE)).div_ceil(1_000);
        Some(anchor + Duration::from_millis(certain))
    }

    /// Records a report that is written to the line.
    pub fn note_sent(&mut self, sequence: u32, at: Instant) {
        if self.sent.len() == SENT {
            self.sent.pop_front();
        }
        self.sent.push_back((sequence, at));
    }

    /// Returns the last telemetry.
    #[must_use]
    pub fn last(&self) -> Option<&Telemetry> {
        self.last.as_ref().map(|(telemetry, _)| telemetry)
    }

    /// Returns the time since the last telemetry arrived.
    #[must_use]
    pub fn silence(&self, now: Instant) -> Option<Duration> {
        let (_, at) = self.last?;
        Some(now.saturating_duration_since(at))
    }

    /// Returns an upper bound of the age of the last telemetry. `None` without a round trip: it can have any age.
    #[must_use]
    pub fn age(&self, now: Instant) -> Option<Duration> {
        let bound = self.made_after(self.last?.0.now_ms)?;
        Some(now.saturating_duration_since(bound))
    }

    /// Returns the time of the controller's clock at a moment, or an earlier one: the delay of the telemetry is not
    /// added.
    #[must_use]
    pub fn clock_ms(&self, now: Instant) -> Option<u32> {
        let (last, at) = self.last?;
        let since = now.saturating_duration_since(at).as_millis();
        Some(last.now_ms.wrapping_add(since as u32))
    }

    /// Returns `true` if the controller permits: its state is certainly younger than `limit`, its output is high, and
    /// it has no fault.
    #[must_use]
    pub fn permits(&self, now: Instant, limit: Duration) -> bool {
        let is_young = self.age(now).is_some_and(|age| age < limit);
        let says_so = self.last().is_some_and(|said| {
            said.permitted
                && said.state == State::Permitted
                && said.interlock_high
                && said.fault.is_none()
        });
        is_young && says_so
    }

    /// Returns the counts of this end of the line.
    #[must_use]
    pub const fn counts(&self) -> Counts {
        self.counts
    }
}

#[cfg(test)]
mod tests;
