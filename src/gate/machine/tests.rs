use super::*;
use crate::gate::{Restart, Source};
use crate::motion::MotionBounds;
use crate::report::{FrameId, PoseEstimate};
use crate::set::{Aging, Estimate, Trust, Uncertainty};
use crate::table::CRC_LENGTH;

const SEE_T7: &[u8] = include_bytes!("../../../examples/tables/see-t7.posegate");
const SEE_T7_GRID: &[u8] = include_bytes!("../../../examples/tables/see-t7-grid.posegate");
const DOCK: &[u8] = include_bytes!("../../../examples/tables/dock.posegate");
const MAP: Source = Source {
    frame: FrameId::of("map"),
    trust: Trust::FULL,
    aging: Aging::NONE,
    motion: MotionBounds::STANDS_STILL,
};
static SOURCES: [Source; 1] = [MAP];

/// A report at `y_m` to the side of the goal.
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
        belief: PoseEstimate::new(estimate, Uncertainty::Gaussian(covariance)),
    }
}

/// The table with every border moved outwards by 0.5 m.
fn wider() -> Vec<u8> {
    let mut bytes = SEE_T7.to_vec();
    let end = bytes.len() - CRC_LENGTH;
    // The end of the facet layout, from the header.
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

/// The parsed table differs from the bytes in flash, as after a bit flip in memory: the first evaluation permits,
/// the second does not, and the gate latches the fault.
#[test]
fn evaluations_that_disagree_are_latched() {
    let table = Table::parse(SEE_T7).unwrap();
    let settings = Settings {
        task: table.task(),
        task_digest: table.task_digest(),
        sources: &SOURCES,
        maximum_age_ms: 200,
        response_ms: 10,
        report_period_ms: 1,
        permit_hold_ms: 100,
        inhibit_hold_ms: 1,
        permits_in_a_row: 1,
        restart: Restart::Automatic,
        most_runs: 1_000,
        look_at: None,
    };
    let wide = wider();
    let beyond = 1.9;
    let mut gate = Gate::new(SEE_T7, &settings, 1000).unwrap();
    assert_eq!(gate.step(1010, &report(1, 0.0)).verdict, Ok(()));
    let denied = gate.step(1020, &report(2, beyond));
    assert_eq!(denied.verdict, Err(Reason::NotContained));
    gate.table = Ok(Table::parse(&wide).unwrap());
    // If both evaluations say inside, the corrupted table is not noticed.
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
        task_digest: table.task_digest(),
        sources: &SOURCES,
        maximum_age_ms: 200,
        response_ms: 25,
        report_period_ms: 1,
        permit_hold_ms: 25,
        inhibit_hold_ms: 25,
        permits_in_a_row,
        restart: Restart::Automatic,
        most_runs: 1_000,
        look_at: None,
    }
}

/// The validity of what was earned is checked again from the complements, independently of the first check. What the first check left
/// standing for too long is a fault, for a permit and for permits in a row.
#[test]
fn what_was_left_standing_too_long_is_a_fault() {
    let table = Table::parse(SEE_T7).unwrap();
    for permits_in_a_row in [1, 2] {
        let settings = settings(&table, permits_in_a_row);
        // A report with its stamp 1010, at 1010. Then the time and the newest stamp are as if the first check had not run.
        let stands = |now_ms: u32, newest_stamp_ms: u32| {
            let mut gate = Gate::new(SEE_T7, &settings, 900).unwrap();
            let earned = gate.step(1010, &report(1, 0.0)).state;
            assert_eq!(earned == State::Permitted, permits_in_a_row == 1);
            gate.now_ms = RedundantWord::new(now_ms);
            gate.newest_stamp_ms = RedundantWord::new(newest_stamp_ms);
            let step = gate.output(Some(Ok(())));
            if step.state == earned {
                assert_eq!(step.permission.is_permit(), permits_in_a_row == 1);
                assert_eq!(step.verdict, Ok(()));
                return true;
            }
            assert!(!step.permission.is_permit());
            assert_eq!(step.state, State::Latched(Reason::MemoryDamaged));
            assert_eq!(step.verdict, Err(Reason::MemoryDamaged));
            assert_eq!(gate.state(), State::Latched(Reason::MemoryDamaged));
            false
        };
        assert!(stands(1035, 1010) && !stands(1036, 1010));
        assert!(stands(1035, 1035 - 175) && !stands(1035, 1035 - 176));
        // From the future, by less than the response time.
        assert!(stands(1035, 1035) && !stands(1035, 1036));
    }
}

/// A report that is too old, and that the first check of its age let through, is a fault when it is remembered.
#[test]
fn an_old_report_that_was_let_through_is_a_fault() {
    let table = Table::parse(SEE_T7).unwrap();
    let settings = settings(&table, 1);
    let oldest = 1400 - settings.oldest_ms();
    for (stamp_ms, is_fault) in [(oldest, false), (oldest - 1, true), (1401, true)] {
        let mut gate = Gate::new(SEE_T7, &settings, 900).unwrap();
        let _ = gate.tick(1400);
        let old = Report {
            stamp_ms,
            ..report(1, 0.0)
        };
        let before = gate.revoke().unwrap();
        gate.remember(&old, Ok(&MAP), Ok(stamp_ms)).unwrap();
        gate.permit(&before, true, past(|_| true)).unwrap();
        let step = gate.output(Some(Ok(())));
        assert_eq!(step.permission.is_permit(), !is_fault, "{stamp_ms}");
        let latched = step.state == State::Latched(Reason::MemoryDamaged);
        assert_eq!(latched, is_fault, "{stamp_ms}");
    }
}

/// A stamp that changes in the caller's memory after it was checked is not remembered.
#[test]
fn a_stamp_that_changes_after_its_check_is_a_fault() {
    let table = Table::parse(SEE_T7).unwrap();
    let settings = settings(&table, 1);
    let mut gate = Gate::new(SEE_T7, &settings, 900).unwrap();
    let changed = Report {
        stamp_ms: 1010 ^ 1 << 31,
        ..report(1, 0.0)
    };
    gate.remember(&changed, Ok(&MAP), Ok(1010)).unwrap();
    assert_eq!(gate.newest_stamp_ms.get(), Err(CorruptWord));
    let step = gate.step(1020, &report(2, 0.0));
    assert_eq!(step.verdict, Err(Reason::MemoryDamaged));
}

/// Whatever a later report or clock brings, the first fault is the reported one.
#[test]
fn a_latched_gate_reports_its_fault() {
    let table = Table::parse(SEE_T7).unwrap();
    let settings = settings(&table, 1);
    let mut gate = Gate::new(SEE_T7, &settings, 900).unwrap();
    gate.fault(Reason::CodeDamaged);
    let first = Err(Reason::CodeDamaged);
    assert_eq!(gate.step(1010, &report(1, 0.0)).verdict, first);
    assert_eq!(gate.step(500, &report(2, 0.0)).verdict, first);
    gate.last_sequence = UNFINISHED;
    assert_eq!(gate.step(510, &report(3, 0.0)).verdict, first);
    assert_eq!(gate.tick(520).verdict, first);
}

/// Permits that should have ended do not count for the next report.
#[test]
fn a_report_does_not_count_on_permits_that_have_ended() {
    let table = Table::parse(SEE_T7).unwrap();
    let settings = settings(&table, 2);
    for (now_ms, counts) in [(1035, true), (1036, false)] {
        let mut gate = Gate::new(SEE_T7, &settings, 900).unwrap();
        assert_eq!(gate.step(1010, &report(1, 0.0)).state, State::Qualifying(1));
        let before = gate.revoke().unwrap();
        // The first check of the times is skipped.
        gate.now_ms = RedundantWord::new(now_ms);
        let counted = gate.permit(&before, true, past(|_| true));
        assert_eq!(counted.is_ok(), counts, "{now_ms}");
    }
}

/// Both checks of the hold time agree, and a wrap of the clock does not make the last denial recent.
#[test]
fn both_looks_at_the_hold_time_agree() {
    let table = Table::parse(SEE_T7).unwrap();
    let settings = settings(&table, 1);
    let mut gate = Gate::new(SEE_T7, &settings, 0).unwrap();
    for start in [0, 1 << 31, u32::MAX - 10] {
        gate.closed_at_ms = RedundantWord::new(start);
        for (after, enough) in [(0, false), (24, false), (25, true), (1 << 31, true)] {
            gate.now_ms = RedundantWord::new(start.wrapping_add(after));
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

/// While a report is evaluated, no permit is valid: a program that leaves its path leaves a closed gate.
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
        let before = gate.revoke().unwrap();
        assert_eq!(gate.state(), State::Latched(Reason::MemoryDamaged));
        assert!(!gate.output(None).permission.is_permit());
        gate.restore(&before);
        assert!(gate.output(None).permission.is_permit());
        // A step that ends before it stores a state leaves a fault for the next one.
        let _ = gate.revoke().unwrap();
        let step = gate.step(1020, &report(2, 0.0));
        assert_eq!(step.state, State::Latched(Reason::MemoryDamaged));
    }
}

/// The checks of a report before it counts.
const CHECKS: [Check; 5] = [
    Check::Followed,
    Check::Fresh,
    Check::First,
    Check::Second,
    Check::FollowedAgain,
];

/// Returns the signature of some of [`CHECKS`].
fn past(passed: impl Fn(usize) -> bool) -> FlowSignature {
    let mut flow = FlowSignature::start();
    for (number, check) in CHECKS.into_iter().enumerate() {
        if passed(number) {
            flow.past(check);
        }
    }
    flow
}

/// A report that did not pass every check, as after a fault that takes a denial for a permit, does not qualify the next one.
#[test]
fn a_report_that_skipped_a_check_counts_for_nothing() {
    let table = Table::parse(SEE_T7).unwrap();
    let settings = settings(&table, 2);
    for skipped in 0..=CHECKS.len() {
        let mut gate = Gate::new(SEE_T7, &settings, 900).unwrap();
        let _ = gate.tick(1010);
        gate.newest_stamp_ms = RedundantWord::new(1000);
        let before = gate.revoke().unwrap();
        let flow = past(|number| number != skipped);
        let counted = gate.permit(&before, true, flow);
        let counts = skipped == CHECKS.len();
        assert_eq!(counted.is_ok(), counts, "{skipped}");
        assert_eq!(
            matches!(gate.state(), State::Qualifying(1)),
            counts,
            "{skipped}"
        );
    }
}

/// A denial that is taken for a repetition of the last report does not restore the permit.
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

/// The path of a repetition omits a check: a repetition that is treated as the next report never opens the gate.
#[test]
fn a_repetition_never_completes_the_signature() {
    let table = Table::parse(SEE_T7).unwrap();
    let settings = settings(&table, 1);
    for (sequence, verdict) in [(1, Err(Reason::Repeated)), (0, Ok(()))] {
        let mut gate = Gate::new(SEE_T7, &settings, 900).unwrap();
        let last = report(1, 0.0);
        assert!(gate.step(1010, &last).permission.is_permit());
        gate.last_sequence = RedundantWord::new(sequence);
        gate.newest_stamp_ms = RedundantWord::new(last.stamp_ms - 1 + sequence);
        let mut flow = FlowSignature::start();
        let newest = gate.is_newest(1010, last.stamp_ms).unwrap();
        let weighed = gate.weigh(
            1010,
            &Evidence::of(&last),
            gate.source_of(&last),
            newest,
            &mut flow,
        );
        assert_eq!(weighed, Ok(verdict));
        // The state is set as if `last` were the next report.
        gate.last_sequence = RedundantWord::new(0);
        gate.newest_stamp_ms = RedundantWord::new(last.stamp_ms - 1);
        let before = StateSnapshot::of(gate.state).unwrap();
        if gate.follows_again(&last) {
            flow.past(Check::FollowedAgain);
        }
        let counted = gate.permit(&before, true, flow);
        assert_eq!(counted.is_ok(), verdict.is_ok());
        if counted.is_err() {
            continue;
        }
        gate.newest_stamp_ms = RedundantWord::new(last.stamp_ms);
        assert_eq!(gate.state(), State::Permitted);
        assert!(gate.output(None).permission.is_permit());
    }
}

/// The second check of the succession agrees with the first wherever the first permits: for every last report,
/// near the wrap of the clock and of the sequence, after the clock was set back, and for several maximum ages.
#[test]
fn both_looks_at_what_follows_agree() {
    let table = Table::parse(SEE_T7).unwrap();
    let (mut followed, mut tried) = (0, 0);
    for maximum_age_ms in [2, 200, (1 << 31) - 1] {
        let settings = Settings {
            sources: &[MAP; 2],
            maximum_age_ms,
            response_ms: 1,
            ..settings(&table, 1)
        };
        for now_ms in [0, 5, 1000, 1 << 31, u32::MAX] {
            let mut gate = Gate::new(SEE_T7, &settings, now_ms).unwrap();
            for last in [(NO_SOURCE, 0), (0, 7), (0, u32::MAX), (1, 7)] {
                let (right, all) = both_looks(&mut gate, now_ms, last);
                followed += right;
                tried += all;
            }
        }
    }
    assert!(
        followed > 1000 && tried > 4 * followed,
        "{followed} {tried}"
    );
}

/// Returns the number of reports that follow, and the number that were tried.
fn both_looks(gate: &mut Gate<'_>, now_ms: u32, (source, sequence): (u32, u32)) -> (u32, u32) {
    let maximum = gate.settings.maximum_age_ms;
    let oldest = maximum - gate.settings.response_ms;
    let ages = [0, 1, 10, oldest, oldest + 1, maximum + 1, (1 << 31) - 1];
    let ahead = [1, 10.min(maximum), maximum].map(u32::wrapping_neg);
    // Without reports the clock goes on: the stamp counts as past until the clock has nearly wrapped.
    let silent = [1 << 31, 3 << 30, maximum.wrapping_neg() - 1];
    let (mut followed, mut tried) = (0, 0);
    gate.last_source = RedundantWord::new(source);
    gate.last_sequence = RedundantWord::new(sequence);
    for newest in ages.into_iter().chain(ahead).chain(silent) {
        gate.newest_stamp_ms = RedundantWord::new(now_ms.wrapping_sub(newest));
        let is_past = newest < maximum.wrapping_neg();
        for age in ages.into_iter().chain(ahead).chain([1 << 31]) {
            let newer = source == NO_SOURCE || is_past && age < newest;
            for (steps, frame) in [(0, "map"), (1, "map"), (1, "odom"), (2, "map")] {
                let next = Report {
                    frame: FrameId::of(frame),
                    stamp_ms: now_ms.wrapping_sub(age),
                    sequence: sequence.wrapping_add(steps),
                    ..report(0, 0.0)
                };
                let fresh = age <= oldest;
                let right = source == NO_SOURCE || source == 0 && steps == 1;
                let expected = fresh && frame == "map" && right && newer;
                let stamp = gate.is_newest(now_ms, next.stamp_ms).unwrap();
                let first = gate.source_of(&next).is_ok()
                    && gate.follows(&next, stamp).unwrap().is_ok()
                    && gate.is_fresh_at(now_ms, next.stamp_ms);
                let what = (now_ms, source, newest, &next);
                assert_eq!(first, expected, "{what:?}");
                assert_eq!(gate.follows_again(&next) && fresh, expected, "{what:?}");
                followed += u32::from(expected);
                tried += 1;
            }
        }
    }
    (followed, tried)
}

/// A flipped bit in the settings, or in the reference to them, is found in the next cycle, with or without a
/// report. A reset does not accept the changed settings.
#[test]
fn settings_that_change_are_found_in_every_cycle() {
    const OTHER: Source = Source {
        frame: FrameId::of("odom"),
        trust: Trust::FULL,
        aging: Aging::NONE,
        motion: MotionBounds::STANDS_STILL,
    };
    type Change = fn(&mut Settings<'_>);
    let changes: [Change; 10] = [
        |s| s.response_ms ^= 1 << 3,
        |s| s.permit_hold_ms ^= 1 << 20,
        |s| s.maximum_age_ms ^= 1 << 20,
        |s| s.inhibit_hold_ms ^= 1,
        |s| s.permits_in_a_row ^= 2,
        |s| s.restart = Restart::OnReset,
        |s| s.sources = &[],
        |s| s.sources = &[OTHER; 2],
        |s| s.sources = &[MAP, OTHER],
        |s| s.sources = &[MAP; 1],
    ];
    let table = Table::parse(SEE_T7).unwrap();
    let sources = [MAP; 2];
    let settings = Settings {
        sources: &sources,
        ..settings(&table, 1)
    };
    let damaged = State::Latched(Reason::MemoryDamaged);
    for change in changes {
        let mut changed = settings;
        change(&mut changed);
        for comes in [None, Some(report(2, 0.0))] {
            let mut gate = Gate::new(SEE_T7, &settings, 900).unwrap();
            assert!(gate.step(1010, &report(1, 0.0)).permission.is_permit());
            gate.settings = &changed;
            let step = match comes {
                None => gate.tick(1020),
                Some(report) => gate.step(1020, &report),
            };
            assert_eq!(step.state, damaged);
            assert!(!step.permission.is_permit());
            gate.reset(1030).unwrap();
            assert_eq!(gate.state(), damaged);
            gate.settings = &settings;
            gate.reset(1040).unwrap();
            assert_eq!(gate.state(), State::Inhibited(Reason::Silent));
        }
    }
}

/// A report that the first checks let through, as if they had been skipped, is refused by the second checks. Each
/// fault is tried alone.
#[test]
fn second_checks_refuse_what_first_checks_let_through() {
    let table = Table::parse(SEE_T7).unwrap();
    let mut settings = settings(&table, 3);
    settings.inhibit_hold_ms = 500;
    // What was earned at 1020 still stands at 1400.
    settings.maximum_age_ms = 600;
    settings.permit_hold_ms = 600;
    let earned = |count| {
        let word = DecodedState::Qualifying(count).word();
        // The first reading of the state was corrupted: it found two permits.
        let standing = DecodedState::Qualifying(2);
        StateSnapshot {
            standing,
            state: word,
        }
    };
    // A gate that was closed at 900, received a report at 1020, and is at `now_ms`.
    let permit = |now_ms: u32, report: &Report, before: StateSnapshot| {
        let mut gate = Gate::new(SEE_T7, &settings, 900).unwrap();
        let _ = gate.step(1020, &super::tests::report(1, 0.0));
        gate.now_ms = RedundantWord::new(now_ms);
        let follows = gate.follows_again(report);
        let flow = past(|number| number < 4 || follows);
        let permitted = gate.permit(&before, true, flow);
        let is_open = matches!(gate.state(), State::Permitted);
        assert_eq!(permitted.is_ok(), is_open, "{permitted:?}");
        is_open
    };
    let at = |now_ms: u32| Report {
        stamp_ms: now_ms - 10,
        ..report(2, 0.0)
    };
    assert!(permit(1400, &at(1400), earned(2)));
    // Not enough permits in a row; hold time not over.
    assert!(!permit(1400, &at(1400), earned(1)));
    assert!(!permit(1399, &at(1399), earned(2)));
    // Another sequence number, source or frame; a stamp that is not newer.
    let faults: [fn(&mut Report); 5] = [
        |report| report.sequence = 3,
        |report| report.sequence = 1,
        |report| report.source = 1,
        |report| report.frame = FrameId::of("odom"),
        |report| report.stamp_ms = 1010,
    ];
    for (number, fault) in faults.into_iter().enumerate() {
        let mut report = at(1400);
        fault(&mut report);
        assert!(!permit(1400, &report, earned(2)), "fault {number}");
    }
}

/// A report that the first checks let through, but that follows no other report, is a fault of the gate.
#[test]
fn a_step_checks_the_order_again() {
    let table = Table::parse(SEE_T7).unwrap();
    let settings = settings(&table, 1);
    let others: [fn(&mut Report); 3] = [
        |_| (),
        |report| report.stamp_ms = 1005,
        |report| report.frame = FrameId::of("odom"),
    ];
    for (number, other) in others.into_iter().enumerate() {
        let mut gate = Gate::new(SEE_T7, &settings, 900).unwrap();
        assert!(gate.step(1010, &report(1, 0.0)).permission.is_permit());
        let mut next = report(2, 0.0);
        other(&mut next);
        gate.now_ms = RedundantWord::new(1020);
        let before = gate.revoke().unwrap();
        let taken = gate.take(
            1020,
            &Evidence::of(&next),
            Ok(&MAP),
            Ok(next.stamp_ms),
            &before,
        );
        let follows = number == 0;
        let expected = if follows {
            Ok(Ok(()))
        } else {
            Err(CorruptWord)
        };
        assert_eq!(taken, expected, "{number}");
        assert_eq!(gate.state() == State::Permitted, follows, "{number}");
    }
}

/// A report that the first checks take for the last one, but that is another one, does not keep the gate open.
#[test]
fn another_report_is_no_repetition() {
    let table = Table::parse(SEE_T7).unwrap();
    let settings = settings(&table, 1);
    let last = report(1, 0.0);
    let others: [fn(&mut Report); 4] = [
        |_| (),
        |report| report.sequence = 2,
        |report| report.source = 1,
        |report| report.stamp_ms += 1,
    ];
    for (number, other) in others.into_iter().enumerate() {
        let mut gate = Gate::new(SEE_T7, &settings, 900).unwrap();
        assert!(gate.step(1010, &last).permission.is_permit());
        let before = gate.revoke().unwrap();
        let mut report = last;
        other(&mut report);
        gate.repeat(&report, &before);
        assert_eq!(gate.state() == State::Permitted, number == 0, "{number}");
    }
}

/// The same table with one byte changed, and with a valid checksum.
fn with_byte(at: usize, changed: u8) -> Vec<u8> {
    let mut bytes = SEE_T7.to_vec();
    bytes[at] ^= changed;
    let end = bytes.len() - CRC_LENGTH;
    let crc = crate::table::checksum(&bytes[..end]).to_le_bytes();
    bytes[end..].copy_from_slice(&crc);
    bytes
}

/// Another valid table that replaces the one from the start (a bank swap, an update over the air) is refused in the
/// next step, tick and scrub, for any content. The fault is latched.
#[test]
fn a_table_that_is_replaced_is_refused() {
    let table = Table::parse(SEE_T7).unwrap();
    let settings = settings(&table, 1);
    // A table of another site; tables of the same site with other facets.
    for replaced in [with_byte(96, 1), with_byte(127, 0x80), wider()] {
        assert!(Table::parse(&replaced).is_ok());
        for call in 0..3 {
            let mut gate = Gate::new(SEE_T7, &settings, 900).unwrap();
            assert!(gate.step(1010, &report(1, 0.0)).permission.is_permit());
            gate.bytes = &replaced;
            match call {
                0 => {
                    let step = gate.step(1020, &report(2, 0.0));
                    assert_eq!(step.verdict, Err(Reason::TableDamaged));
                    assert!(!step.permission.is_permit());
                }
                1 => assert!(!gate.tick(1011).permission.is_permit()),
                _ => assert_eq!(gate.scrub(1), ScrubProgress::Damaged),
            }
            assert_eq!(gate.state(), State::Latched(Reason::TableDamaged));
            gate.bytes = SEE_T7;
            assert!(!gate.step(1030, &report(3, 0.0)).permission.is_permit());
        }
    }
    // Only the digest differs, under the same checksum: a page of flash that is half written.
    let mut half = SEE_T7.to_vec();
    half[96] ^= 1;
    let mut gate = Gate::new(SEE_T7, &settings, 900).unwrap();
    assert!(gate.step(1010, &report(1, 0.0)).permission.is_permit());
    gate.bytes = &half;
    assert!(!gate.tick(1011).permission.is_permit());
    assert_eq!(gate.state(), State::Latched(Reason::TableDamaged));
}

/// The age of an estimate counts up to the end of the step's permission, so a long decision does not make an old
/// estimate fresh. An open gate closes equally early.
#[test]
fn an_estimate_is_judged_at_the_end_of_the_permission() {
    let table = Table::parse(SEE_T7).unwrap();
    for response_ms in [1, 20, 150, 199] {
        let settings = Settings {
            response_ms,
            report_period_ms: 1,
            permit_hold_ms: 1000,
            ..settings(&table, 1)
        };
        let stamp_ms = report(1, 0.0).stamp_ms;
        let oldest = stamp_ms + 200 - response_ms;
        for (now_ms, fresh) in [(oldest, true), (oldest + 1, false)] {
            let mut gate = Gate::new(SEE_T7, &settings, 900).unwrap();
            let step = gate.step(now_ms, &report(1, 0.0));
            assert_eq!(step.permission.is_permit(), fresh, "{response_ms}");
            assert_eq!(
                step.verdict,
                if fresh { Ok(()) } else { Err(Reason::Stale) }
            );
            let mut gate = Gate::new(SEE_T7, &settings, 900).unwrap();
            assert!(gate.step(stamp_ms, &report(1, 0.0)).permission.is_permit());
            let mut cycle_ms = stamp_ms;
            while now_ms - cycle_ms > response_ms {
                cycle_ms += response_ms;
                assert!(gate.tick(cycle_ms).permission.is_permit());
            }
            assert_eq!(gate.tick(now_ms).permission.is_permit(), fresh);
        }
    }
}

/// A bit of flash that flips while the gate runs, before or after the bytes that the scrub has just checked, is
/// found by the end of the next round. Healthy flash is never reported.
#[test]
fn every_flipped_bit_of_flash_is_found_by_the_scrub() {
    const COUNT: usize = 64;
    let table = Table::parse(SEE_T7).unwrap();
    let settings = settings(&table, 1);
    let calls = (SEE_T7.len() - CRC_LENGTH).div_ceil(COUNT);
    let mut gate = Gate::new(SEE_T7, &settings, 900).unwrap();
    assert!(gate.step(1010, &report(1, 0.0)).permission.is_permit());
    for call in 1..=10 * calls {
        let whole = call.is_multiple_of(calls);
        let expected = if whole {
            ScrubProgress::Whole
        } else {
            ScrubProgress::UnderWay
        };
        assert_eq!(gate.scrub(COUNT), expected);
    }
    assert!(gate.tick(1011).permission.is_permit());
    let every = crate::test_iterations(1, 1999) as usize;
    for bit in (0..SEE_T7.len() * 8).step_by(every) {
        let mut damaged = SEE_T7.to_vec();
        damaged[bit / 8] ^= 1 << (bit % 8);
        let mut gate = Gate::new(SEE_T7, &settings, 900).unwrap();
        assert!(gate.step(1010, &report(1, 0.0)).permission.is_permit());
        let before = bit % calls;
        for _ in 0..before {
            assert_eq!(gate.scrub(COUNT), ScrubProgress::UnderWay);
        }
        // The flash changes under the gate.
        gate.bytes = &damaged;
        let found = (before..2 * calls).position(|_| gate.scrub(COUNT) == ScrubProgress::Damaged);
        // The checksum at the end is compared in every call.
        let at_once = bit / 8 >= SEE_T7.len() - CRC_LENGTH;
        let ends = [calls, 2 * calls].map(|end| end - before - 1);
        assert!(
            found.is_some_and(|at| if at_once { at == 0 } else { ends.contains(&at) }),
            "{bit}: {found:?}"
        );
        let latched = State::Latched(Reason::TableDamaged);
        assert_eq!(gate.state(), latched);
        assert!(!gate.tick(1011).permission.is_permit());
    }
}

/// A permission is valid until the next step. A cycle later than the response time shows that the age was judged
/// for too short a time: the gate closes, and qualifies again with the report of that cycle.
#[test]
fn a_late_cycle_closes_an_open_gate() {
    let table = Table::parse(SEE_T7).unwrap();
    let settings = Settings {
        response_ms: 20,
        report_period_ms: 1,
        permit_hold_ms: 100,
        inhibit_hold_ms: 1,
        ..settings(&table, 2)
    };
    for (passed_ms, stands) in [(20, true), (21, false), (60, false)] {
        for with_report in [false, true] {
            let mut gate = Gate::new(SEE_T7, &settings, 980).unwrap();
            let _ = gate.step(1010, &report(1, 0.0));
            assert!(gate.step(1020, &report(2, 0.0)).permission.is_permit());
            let now_ms = 1020 + passed_ms;
            let step = if with_report {
                gate.step(now_ms, &report(3, 0.0))
            } else {
                gate.tick(now_ms)
            };
            assert_eq!(step.permission.is_permit(), stands, "{passed_ms}");
            let expected = match (stands, with_report) {
                (true, _) => State::Permitted,
                (false, false) => State::Inhibited(Reason::CycleLate),
                (false, true) => State::Qualifying(1),
            };
            assert_eq!(step.state, expected, "{passed_ms}");
        }
    }
    // While the gate is closed, no permission is in force for too long.
    let mut gate = Gate::new(SEE_T7, &settings, 980).unwrap();
    let _ = gate.step(1010, &report(1, 0.0));
    let _ = gate.tick(1080);
    assert_eq!(gate.state(), State::Qualifying(1));
}

/// A shorter table of the same site is written over the first bytes and leaves the last ones unchanged.
#[test]
fn a_shorter_table_in_the_same_place_is_refused() {
    let table = Table::parse(SEE_T7_GRID).unwrap();
    let settings = settings(&table, 1);
    for shorter in [SEE_T7, DOCK] {
        assert!(shorter.len() < SEE_T7_GRID.len());
        let mut both = SEE_T7_GRID.to_vec();
        both[..shorter.len()].copy_from_slice(shorter);
        let mut gate = Gate::new(SEE_T7_GRID, &settings, 900).unwrap();
        assert!(gate.step(1010, &report(1, 0.0)).permission.is_permit());
        gate.bytes = &both;
        assert!(!gate.tick(1011).permission.is_permit());
        assert_eq!(gate.state(), State::Latched(Reason::TableDamaged));
    }
}

mod aging;
mod change;
mod hypotheses;

/// Cells are walked no farther than the settings allow; facets have no such limit.
#[test]
fn a_set_that_takes_too_many_runs_is_denied_for_that() {
    for (bytes, has_cells) in [(SEE_T7_GRID, true), (SEE_T7, false)] {
        let table = Table::parse(bytes).unwrap();
        for (most_runs, is_enough) in [(0, false), (3, false), (1_000, true), (u32::MAX, true)] {
            let settings = Settings {
                most_runs,
                ..settings(&table, 1)
            };
            let mut gate = Gate::new(bytes, &settings, 900).unwrap();
            let step = gate.step(1010, &report(1, 0.0));
            let expected = if is_enough || !has_cells {
                Ok(())
            } else {
                Err(Reason::TooCostly)
            };
            assert_eq!(step.verdict, expected, "{most_runs}");
            assert_eq!(step.permission.is_permit(), expected.is_ok());
        }
    }
}
