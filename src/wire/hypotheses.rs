//! A report with several hypotheses: one message for each, then the report with their number (version 2).
//!
//! A controller must not evaluate a report if one of its hypotheses was lost on the line, so the report states their number.
//! The messages carry no weights: a sender that omits hypotheses inflates its covariances, or does not send the report.

use super::report::{REPORT, body_of, read};
use super::{LONGEST_BODY, WireError};
use crate::gate::{Evidence, MOST_HYPOTHESES};
use crate::report::{FrameId, PoseEstimate, Report};
use crate::set::Growth;
use crate::task::Risk;
use heapless::Vec;

/// The type of hypothesis k is this plus k, from 1 to 7.
const HYPOTHESIS: u8 = 0x10;
/// The type of a report after n hypotheses is this plus n, from 1 to 7.
const COUNTED: u8 = 0x20;
const OTHERS: usize = MOST_HYPOTHESES - 1;

/// Returns the body of the message that carries hypothesis `number`, from 1 to 7: the report with the hypothesis as its estimate. Send
/// hypotheses in order, before the report. `None` for another number.
#[must_use]
pub fn hypothesis_body(number: u8, report: &Report) -> Option<Vec<u8, LONGEST_BODY>> {
    typed(HYPOTHESIS, number, report)
}

/// Returns the body of the message that carries a report after `others` hypotheses, from 1 to 7. `None` for another number.
#[must_use]
pub fn counted_report_body(others: u8, report: &Report) -> Option<Vec<u8, LONGEST_BODY>> {
    typed(COUNTED, others, report)
}

fn typed(message: u8, number: u8, report: &Report) -> Option<Vec<u8, LONGEST_BODY>> {
    (1..=OTHERS)
        .contains(&usize::from(number))
        .then(|| body_of(message | number, report))
}

/// The fields that the hypotheses of a report share with it.
type Common = (u8, FrameId, u32, u32);

fn common(report: &Report) -> Common {
    (
        report.source,
        report.frame,
        report.sequence,
        report.stamp_ms,
    )
}

/// Collects the hypotheses of a report. All belong to one source, sequence number, stamp and frame.
#[derive(Debug, Default)]
pub struct HypothesisCollector {
    others: Vec<PoseEstimate, OTHERS>,
    of: Option<Common>,
    /// The completed report.
    report: Option<Report>,
}

#[cfg(feature = "defmt")]
impl defmt::Format for HypothesisCollector {
    /// Writes the number of hypotheses only.
    fn format(&self, f: defmt::Formatter<'_>) {
        defmt::write!(f, "HypothesisCollector {{ others: {} }}", self.others.len());
    }
}

impl HypothesisCollector {
    /// Returns a collector without hypotheses.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            others: Vec::new(),
            of: None,
            report: None,
        }
    }

    /// Takes the body of a message: a hypothesis, or a report with or without hypotheses. Returns the report with its hypotheses as soon
    /// as it is complete.
    ///
    /// # Errors
    /// [`WireError::Content`] if the body is neither, if a hypothesis is missing, or if a hypothesis belongs to another report. The
    /// collected hypotheses are then discarded.
    pub fn take(&mut self, body: &[u8]) -> Result<Option<Evidence<'_>>, WireError> {
        if self.report.take().is_some() {
            self.forget();
        }
        let Some((message, report)) = read(body) else {
            self.forget();
            return Err(WireError::Content);
        };
        let [kind, number] = [message & 0xf0, message & 0x0f];
        let is_next = usize::from(number) == self.others.len().wrapping_add(1);
        let is_of_this = self.of.is_none_or(|of| of == common(&report));
        if kind == HYPOTHESIS && is_next && is_of_this && self.others.push(report.belief).is_ok() {
            self.of = Some(common(&report));
            return Ok(None);
        }
        let is_alone = message == REPORT && self.others.is_empty();
        let is_complete =
            kind == COUNTED && number > 0 && usize::from(number) == self.others.len() && is_of_this;
        if !(is_alone || is_complete) {
            self.forget();
            return Err(WireError::Content);
        }
        Ok(Some(Evidence {
            report: self.report.insert(report),
            others: &self.others,
            beside: Growth::NONE,
            since_fix_ms: None,
            elsewhere: Risk::NONE,
        }))
    }

    fn forget(&mut self) {
        *self = Self::new();
    }
}

#[cfg(test)]
mod tests;
