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
    // Where the facet layout ends, as the header says.
    let word = |at: usize| usize::from(bytes[at]) + 256 * usize::from(bytes[at + 1]);
    let facets = word(76) + word(80);
    for facet in 0..15 {
        let at = facets - 6 * facet - 2;
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

fn settings<'a>(table: &Table<'a>, permits_in_a_row: u16) -> Settings<'a> {
    Settings {
        task: table.task(),
        site_digest: table.site_digest(),
        sources: &SOURCES,
        maximum_age_ms: 200,
        permit_hold_ms: 25,
        inhibit_hold_ms: 25,
        permits_in_a_row,
        restart: Restart::Automatic,
        look_at: None,
    }
}

/// Whether a permit still stands is looked at once more, from the other copies: whatever the first look let
/// stand.
#[test]
fn a_permit_that_was_left_standing_ends() {
    let table = Table::parse(SEE_T7).unwrap();
    let settings = settings(&table, 1);
    let mut gate = Gate::new(SEE_T7, &settings, 900).unwrap();
    assert!(gate.step(1010, &report(1, 0.0)).permission.is_permit());
    for (now_ms, stands) in [(1035, true), (1036, false)] {
        gate.now_ms = Doubled::new(now_ms);
        assert!(matches!(gate.state(), State::Permitted));
        assert_eq!(gate.told(None).permission.is_permit(), stands);
    }
    gate.now_ms = Doubled::new(1035);
    gate.last_stamp_ms = Doubled::new(1035 - 200);
    assert!(gate.told(None).permission.is_permit());
    gate.last_stamp_ms = Doubled::new(1035 - 201);
    assert!(!gate.told(None).permission.is_permit());
}

/// Both looks at how long a denial has stood agree, and a clock that has gone round does not make it young.
#[test]
fn both_looks_at_the_hold_time_agree() {
    let table = Table::parse(SEE_T7).unwrap();
    let settings = settings(&table, 1);
    let mut gate = Gate::new(SEE_T7, &settings, 0).unwrap();
    for start in [0, 1 << 31, u32::MAX - 10] {
        gate.closed_at_ms = Doubled::new(start);
        for (after, enough) in [(0, false), (24, false), (25, true), (1 << 31, true)] {
            gate.now_ms = Doubled::new(start.wrapping_add(after));
            assert_eq!(gate.is_held_long_enough().unwrap(), enough);
            let again = gate.is_held_long_enough_by_complement(&settings);
            assert_eq!(again, enough);
        }
    }
    let mut gate = Gate::new(SEE_T7, &settings, 0).unwrap();
    for cycle in 1..=10u32 {
        let _ = gate.tick(cycle.wrapping_mul(1 << 30));
        assert!(gate.is_held_long_enough().unwrap(), "{cycle}");
    }
}

/// While a report is looked at, nothing stands: who leaves the way leaves a closed gate.
#[test]
fn a_step_takes_the_permit_back_first() {
    let table = Table::parse(SEE_T7).unwrap();
    for restart in [Restart::Automatic, Restart::OnReset] {
        let settings = Settings {
            restart,
            ..settings(&table, 1)
        };
        let mut gate = Gate::new(SEE_T7, &settings, 900).unwrap();
        assert!(gate.step(1010, &report(1, 0.0)).permission.is_permit());
        let before = gate.take_back().unwrap();
        assert_eq!(gate.state(), State::Inhibited(Reason::Silent));
        assert!(!gate.told(None).permission.is_permit());
        gate.give_back(&before);
        assert!(gate.told(None).permission.is_permit());
    }
}

/// A denial that is taken for a repetition of the last report does not give the permit back.
#[test]
fn only_the_last_report_is_a_repetition() {
    let table = Table::parse(SEE_T7).unwrap();
    let settings = settings(&table, 1);
    let mut gate = Gate::new(SEE_T7, &settings, 900).unwrap();
    let last = report(1, 0.0);
    assert!(gate.step(1010, &last).permission.is_permit());
    assert!(gate.is_last_again(&last));
    for other in [
        Report { source: 1, ..last },
        Report {
            sequence: 2,
            ..last
        },
        Report {
            stamp_ms: last.stamp_ms + 1,
            ..last
        },
    ] {
        assert!(!gate.is_last_again(&other));
    }
}

/// The second look at what follows agrees with the first, wherever the first permits.
#[test]
fn both_looks_at_what_follows_agree() {
    let table = Table::parse(SEE_T7).unwrap();
    let settings = settings(&table, 1);
    let mut gate = Gate::new(SEE_T7, &settings, 900).unwrap();
    assert!(gate.step(1010, &report(1, 0.0)).permission.is_permit());
    let before = Before::of(gate.state).unwrap();
    let last = report(1, 0.0);
    let mut followed = 0;
    for sequence in [0, 1, 2, 3, u32::MAX] {
        for later in [0, 1, 10, (1 << 31) - 1, 1 << 31, u32::MAX] {
            for frame in ["map", "odom"] {
                let next = Report {
                    sequence,
                    stamp_ms: last.stamp_ms.wrapping_add(later),
                    frame: FrameId::of(frame),
                    ..last
                };
                let first = gate.follows(&next, &before).unwrap().is_ok() && frame == "map";
                assert_eq!(gate.follows_again(&next, &before), first, "{next:?}");
                followed += u32::from(first);
            }
        }
    }
    assert_eq!(followed, 3);
}
