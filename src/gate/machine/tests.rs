use super::*;
use crate::gate::{Restart, Source};
use crate::report::{Belief, FrameId};
use crate::set::{Estimate, Spread, Trust};
use crate::table::CRC_LENGTH;
use std::vec::Vec;

const SEE_T7: &[u8] = include_bytes!("../../../examples/tables/see-t7.posegate");
static SOURCES: [Source; 1] = [Source {
    frame: FrameId::of("map"),
    trust: Trust::FULL,
}];

/// A report from `y_m` beside the goal.
fn report(sequence: u32, y_m: f64) -> Report {
    let estimate = Estimate {
        x_m: 0.0,
        y_m,
        yaw_rad: 0.0,
    };
    let covariance = [[1e-4, 0.0, 0.0], [0.0, 1e-4, 0.0], [0.0, 0.0, 1e-5]];
    Report {
        source: 0,
        frame: FrameId::of("map"),
        sequence,
        stamp_ms: 1000 + 10 * sequence,
        belief: Belief::new(estimate, Spread::Gaussian(covariance)),
    }
}

/// The table with every border moved out by 0.5 m.
fn wider() -> Vec<u8> {
    let mut bytes = SEE_T7.to_vec();
    let end = bytes.len() - CRC_LENGTH;
    for facet in 0..15 {
        let at = end - 6 * facet - 2;
        let b = i16::from_le_bytes([bytes[at], bytes[at + 1]]) + 2000;
        bytes[at..at + 2].copy_from_slice(&b.to_le_bytes());
    }
    bytes[186..188].copy_from_slice(&9000u16.to_le_bytes());
    let crc = crate::table::checksum(&bytes[..end]).to_le_bytes();
    bytes[end..].copy_from_slice(&crc);
    bytes
}

/// The parsed table is another than the bytes in flash, as if it had fallen over in memory: the first
/// evaluation permits, the second does not, and the gate latches the fault.
#[test]
fn evaluations_that_disagree_are_latched() {
    let table = Table::parse(SEE_T7).unwrap();
    let settings = Settings {
        task: table.task(),
        site_digest: table.site_digest(),
        sources: &SOURCES,
        maximum_age_ms: 200,
        permit_hold_ms: 100,
        inhibit_hold_ms: 1,
        permits_in_a_row: 1,
        restart: Restart::Automatic,
        look_at: None,
    };
    let wide = wider();
    let beyond = 1.9;
    let mut gate = Gate::new(SEE_T7, &settings, 1000).unwrap();
    assert_eq!(gate.step(1010, &report(1, 0.0)).verdict, Ok(()));
    let denied = gate.step(1020, &report(2, beyond));
    assert_eq!(denied.verdict, Err(Reason::NotContained));
    gate.table = Ok(Table::parse(&wide).unwrap());
    // Where both say inside, the fallen table is not seen.
    assert_eq!(gate.step(1030, &report(3, 0.0)).verdict, Ok(()));
    let step = gate.step(1040, &report(4, beyond));
    assert_eq!(step.verdict, Err(Reason::EvaluationsDisagree));
    assert_eq!(step.state, State::Latched(Reason::EvaluationsDisagree));
    assert!(!step.permission.is_permit());
    let step = gate.step(1050, &report(5, 0.0));
    assert_eq!(step.state, State::Latched(Reason::EvaluationsDisagree));
}
