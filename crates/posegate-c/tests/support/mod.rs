//! What the tests of the C boundary share: memory as C has it, and the settings, reports and messages of a dock.
// Each test uses a part.
#![allow(dead_code)]

pub mod functions;

use posegate::report::{FrameId, Heading, PoseEstimate};
use posegate::set::Uncertainty;
use posegate::table::Table;
use posegate_c::*;

pub static DOCK: &[u8] = include_bytes!("../../../../examples/tables/dock.posegate");
pub static SEE_T7: &[u8] = include_bytes!("../../../../examples/tables/see-t7.posegate");
pub static RULES: &[u8] = include_bytes!("../../../../examples/tables/contingent.rules");

/// Returns a pointer to a value that never moves, as in C.
pub fn leaked<T>(value: T) -> *mut T {
    Box::into_raw(Box::new(value))
}

/// Returns zeros: the tests use it for structs of numbers and pointers.
pub fn zero<T>() -> T {
    // SAFETY: as above.
    unsafe { core::mem::zeroed() }
}

/// Returns zeroed storage that never moves.
pub fn zeroed<T>() -> *mut T {
    leaked(zero())
}

/// Returns a pointer to a place for a `T` that is misaligned by one byte.
pub fn misaligned<T>() -> *mut T {
    let bytes = vec![0u64; size_of::<T>() / 8 + 2].leak();
    bytes.as_mut_ptr().wrapping_byte_add(1).cast()
}

pub fn name<const N: usize>(text: &str) -> [core::ffi::c_char; N] {
    let mut name = [0; N];
    for (to, byte) in name.iter_mut().zip(text.bytes()) {
        *to = core::ffi::c_char::from_ne_bytes([byte]);
    }
    name
}

/// Returns a source whose robot moves at up to 1 mm/s along its axis.
pub fn source() -> posegate_source {
    posegate_source {
        frame: name("map"),
        inflation: 1.0,
        cross_terms: posegate_cross_terms::Filled as u32,
        motion: posegate_motion::Moves as u32,
        along_m_s: 0.001,
        ..zero()
    }
}

/// Returns the settings of a gate of the dock with two sources.
pub fn settings() -> posegate_settings {
    let unused = posegate_source {
        motion: posegate_motion::StandsStill as u32,
        ..zero()
    };
    posegate_settings {
        task: name("dock"),
        task_digest: Table::parse(DOCK).unwrap().task_digest(),
        sources: [
            source(),
            posegate_source {
                frame: name("odom"),
                inflation: 1.5,
                cross_terms: posegate_cross_terms::YawUnknown as u32,
                share_q8: 128,
                ..unused
            },
            // Not used: `source_count` is 2.
            posegate_source {
                inflation: f64::NAN,
                cross_terms: 99,
                ..unused
            },
            unused,
        ],
        source_count: 2,
        maximum_age_ms: 200,
        response_ms: 30,
        report_period_ms: 50,
        permit_hold_ms: 100,
        inhibit_hold_ms: 40,
        permits_in_a_row: 3,
        restart: posegate_restart::Automatic as u32,
        look_at_tag: 7,
        most_runs: 0,
    }
}

/// Converts an estimate to that of C. What its form does not use is not zero.
pub fn in_c(belief: &PoseEstimate) -> posegate_belief {
    let (heading_kind, heading) = match belief.heading {
        Heading::Radians(yaw) => (posegate_heading::Yaw, [yaw, f64::NAN, 7.0, 7.0]),
        Heading::RollPitchYaw([roll, pitch, yaw]) => {
            (posegate_heading::RollPitchYaw, [roll, pitch, yaw, f64::NAN])
        }
        Heading::Quaternion(entries) => (posegate_heading::Quaternion, entries),
    };
    let mut spread = [7.0; 9];
    let spread_kind = match belief.spread {
        Some(Uncertainty::Gaussian(covariance)) => {
            spread.copy_from_slice(covariance.as_flattened());
            posegate_spread::Gaussian
        }
        Some(Uncertainty::Bounded {
            translation_m,
            yaw_rad,
        }) => {
            [spread[0], spread[1]] = [translation_m, yaw_rad];
            posegate_spread::Bounded
        }
        None => posegate_spread::Unknown,
    };
    posegate_belief {
        x_m: belief.x_m,
        y_m: belief.y_m,
        heading,
        spread,
        heading_kind: heading_kind as u32,
        spread_kind: spread_kind as u32,
    }
}

pub fn report_of_c(sequence: u32, stamp_ms: u32, belief: posegate_belief) -> posegate_report {
    posegate_report {
        belief,
        frame: FrameId::of("map").digest(),
        source: 0,
        sequence,
        stamp_ms,
        reserved: 0,
    }
}

pub fn evidence_of_c(report: posegate_report, others: &[posegate_belief]) -> posegate_evidence {
    let mut evidence = posegate_evidence {
        report,
        other_count: others.len() as u32,
        ..zero()
    };
    evidence.others[..others.len()].copy_from_slice(others);
    evidence
}

pub fn message(bytes: &[u8]) -> posegate_message {
    let mut message = posegate_message {
        length: bytes.len() as u8,
        ..zero()
    };
    message.bytes[..bytes.len()].copy_from_slice(bytes);
    message
}
