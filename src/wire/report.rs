//! The message that carries a report to a gate (version 2).

use super::{BOUNDED, Body, GAUSSIAN, LONGEST_BODY, Reader, VERSION_2, WireError};
use crate::report::{FrameId, Heading, PoseEstimate, Report};
use crate::set::Uncertainty;
use heapless::Vec;

/// Type of the message.
pub(super) const REPORT: u8 = 1;

const YAW: u8 = 1;
const ROLL_PITCH_YAW: u8 = 2;
const QUATERNION: u8 = 3;
const UNKNOWN: u8 = 0;

/// Returns the body of the message that carries a report: every field, bit for bit.
#[must_use]
pub fn report_body(report: &Report) -> Vec<u8, LONGEST_BODY> {
    body_of(REPORT, report)
}

/// Returns the body of a message of a type that carries a report.
pub(super) fn body_of(message: u8, report: &Report) -> Vec<u8, LONGEST_BODY> {
    let PoseEstimate {
        x_m,
        y_m,
        heading,
        spread,
    } = report.belief;
    let heading_kind = match heading {
        Heading::Radians(_) => YAW,
        Heading::RollPitchYaw(_) => ROLL_PITCH_YAW,
        Heading::Quaternion(_) => QUATERNION,
    };
    let spread_kind = match spread {
        None => UNKNOWN,
        Some(Uncertainty::Gaussian(_)) => GAUSSIAN,
        Some(Uncertainty::Bounded { .. }) => BOUNDED,
    };
    let mut body = Body(Vec::new());
    body.put([VERSION_2, message, report.source, heading_kind, spread_kind]);
    body.put(report.sequence.to_le_bytes());
    body.put(report.stamp_ms.to_le_bytes());
    body.put(report.frame.digest().to_le_bytes());
    body.floats(&[x_m, y_m]);
    match heading {
        Heading::Radians(yaw) => body.floats(&[yaw]),
        Heading::RollPitchYaw(angles) => body.floats(&angles),
        Heading::Quaternion(entries) => body.floats(&entries),
    }
    match spread {
        None => {}
        Some(Uncertainty::Gaussian(covariance)) => body.floats(covariance.as_flattened()),
        Some(Uncertainty::Bounded {
            translation_m,
            yaw_rad,
        }) => body.floats(&[translation_m, yaw_rad]),
    }
    body.0
}

/// Parses a report from the body of a message. The gate checks its numbers, not this function.
///
/// # Errors
/// [`WireError::Content`] if the body is not a report.
pub fn report_from_body(body: &[u8]) -> Result<Report, WireError> {
    read(body)
        .filter(|(message, _)| *message == REPORT)
        .map(|(_, report)| report)
        .ok_or(WireError::Content)
}

/// Parses the type of a message, and the report that it carries.
pub(super) fn read(body: &[u8]) -> Option<(u8, Report)> {
    let mut rest = Reader(body);
    let [version, message, source, heading, spread] = rest.take()?;
    if version != VERSION_2 {
        return None;
    }
    let sequence = u32::from_le_bytes(rest.take()?);
    let stamp_ms = u32::from_le_bytes(rest.take()?);
    let frame = FrameId::from_digest(u64::from_le_bytes(rest.take()?));
    let (x_m, y_m) = (rest.float()?, rest.float()?);
    let heading = match heading {
        YAW => Heading::Radians(rest.float()?),
        ROLL_PITCH_YAW => Heading::RollPitchYaw([rest.float()?, rest.float()?, rest.float()?]),
        QUATERNION => {
            Heading::Quaternion([rest.float()?, rest.float()?, rest.float()?, rest.float()?])
        }
        _ => return None,
    };
    let spread = match spread {
        UNKNOWN => None,
        GAUSSIAN => {
            let mut row = || Some([rest.float()?, rest.float()?, rest.float()?]);
            Some(Uncertainty::Gaussian([row()?, row()?, row()?]))
        }
        BOUNDED => Some(Uncertainty::Bounded {
            translation_m: rest.float()?,
            yaw_rad: rest.float()?,
        }),
        _ => return None,
    };
    let report = Report {
        source,
        frame,
        sequence,
        stamp_ms,
        belief: PoseEstimate {
            x_m,
            y_m,
            heading,
            spread,
        },
    };
    rest.0.is_empty().then_some((message, report))
}

#[cfg(test)]
mod tests;
