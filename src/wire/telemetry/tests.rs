use super::*;
use crate::wire::{Reply, report_from_body};
use proptest::prelude::*;
use std::vec::Vec as Bytes;

const FAULTS: [Option<InterlockFault>; 6] = [
    None,
    Some(InterlockFault::Output),
    Some(InterlockFault::Input),
    Some(InterlockFault::NotFollowing),
    Some(InterlockFault::Heartbeat),
    Some(InterlockFault::OldPermission),
];

proptest! {
    #[test]
    fn telemetry_round_trips(
        words: [u32; 9], count: u16, source: u8, mark in 0u8..4, reasons: [u8; 2],
        flags in 0u8..8, fault in 0usize..5,
    ) {
        let [number, cycle, now_ms, sequence, stamp_ms, bytes, lost, refused, left_aside] = words;
        let reason = |index: u8| Reason::ALL[usize::from(index) % Reason::ALL.len()];
        let sent = Telemetry {
            number,
            cycle,
            now_ms,
            weighed: (flags & 4 != 0).then_some(ReportOutcome {
                source,
                sequence,
                stamp_ms,
                verdict: if reasons[1] < 128 { Ok(()) } else { Err(reason(reasons[1])) },
            }),
            state: match mark {
                0 => State::Inhibited(reason(reasons[0])),
                1 => State::Qualifying(count),
                2 => State::Permitted,
                _ => State::Latched(reason(reasons[0])),
            },
            permitted: flags & 1 != 0,
            interlock_high: flags & 2 != 0,
            fault: FAULTS[fault],
            line: LinkCounters { bytes, lost, refused, left_aside },
        };
        prop_assert_eq!(Telemetry::from_body(&sent.body()), Some(sent));
    }

    /// A body that is accepted as telemetry encodes back to the same bytes, so no bit is ignored.
    #[test]
    fn decoded_telemetry_re_encodes_to_its_body(
        tail in proptest::collection::vec(prop_oneof![Just(0u8), 0u8..5, any::<u8>()], 40..46),
    ) {
        let body = [&[VERSION_2, TELEMETRY][..], &tail].concat();
        if let Some(telemetry) = Telemetry::from_body(&body) {
            prop_assert_eq!(&telemetry.body()[..], &body[..]);
        }
    }
}

/// Checks the table of the module's documentation, byte by byte.
#[test]
fn telemetry_is_as_documented() {
    let sent = Telemetry {
        number: 0x0403_0201,
        cycle: 0x0807_0605,
        now_ms: 0x0c0b_0a09,
        weighed: Some(ReportOutcome {
            source: 7,
            sequence: 0x1413_1211,
            stamp_ms: 0x1817_1615,
            verdict: Err(Reason::Stale),
        }),
        state: State::Qualifying(0x0e0d),
        permitted: true,
        interlock_high: true,
        fault: Some(InterlockFault::NotFollowing),
        line: LinkCounters {
            bytes: 0x2423_2221,
            lost: 0x2827_2625,
            refused: 0x2c2b_2a29,
            left_aside: 0x302f_2e2d,
        },
    };
    let expected: Bytes<u8> = [2, 2]
        .into_iter()
        .chain(1..=12)
        .chain([2, 0x0d, 0x0e, 3, 3, 1, 7])
        .chain(0x11..=0x18)
        .chain([12])
        .chain(0x21..=0x30)
        .collect();
    assert_eq!(sent.body()[..], expected[..]);
    assert_eq!(Reply::from_body(&expected), None);
    assert!(report_from_body(&expected).is_err());
    for length in 0..expected.len() {
        assert_eq!(Telemetry::from_body(&expected[..length]), None);
    }
}
