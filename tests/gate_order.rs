//! The order of reports: a report counts only if it is the next one of the same source, with a stamp newer than all
//! before. Delayed or repeated reports, or reports of two sources in turn, never open the gate. A
//! gate is not closed for longer than its settings state, for any behaviour of the clock.

#[path = "../crates/posegate-testkit/src/gate.rs"]
#[allow(dead_code)] // This target uses only a part.
mod support;

use posegate::gate::{Gate, Reason, Settings, State};
use posegate::report::Report;
use support::{DOCK, MAXIMUM_AGE_MS, belief, permitted, report, settings};

/// Returns a report from outside of the dock.
fn outside(sequence: u32, stamp_ms: u32) -> Report {
    Report {
        belief: belief(1.0),
        ..report(sequence, stamp_ms)
    }
}

/// Start times: near the wrap of the clock, at half its range, and elsewhere.
const STARTS: [u32; 4] = [0, 1000, (1 << 31) - 100, u32::MAX - 100];

/// A newer report, of this source or of another, states that the robot has left the dock. Older reports from inside
/// the dock are repeated while still fresh, and never open the gate. This holds for any number of required
/// permits and any hold time of a denial.
#[test]
fn reports_older_than_a_denial_never_open() {
    for start in STARTS {
        for (permits_in_a_row, inhibit_hold_ms) in [(1, 1), (1, 50), (3, 1), (3, 50)] {
            let settings = Settings {
                permits_in_a_row,
                inhibit_hold_ms,
                ..settings()
            };
            for source in [0, 1] {
                for first in 0..6 {
                    let mut gate = Gate::new(DOCK, &settings, start).unwrap();
                    let good: Vec<Report> = (0..6)
                        .map(|k| report(100 + k, start.wrapping_add(60 + 10 * k)))
                        .collect();
                    for report in &good {
                        let _ = gate.step(report.stamp_ms, report);
                    }
                    assert_eq!(gate.state(), State::Permitted);
                    let mut now = start.wrapping_add(120);
                    let left = Report {
                        source,
                        ..outside(106, now)
                    };
                    assert!(!gate.step(now, &left).permission.is_permit());
                    for old in good[first..].iter().chain(&good) {
                        now = now.wrapping_add(7);
                        let step = gate.step(now, old);
                        assert!(step.verdict.is_err(), "{step:?}");
                        assert!(!step.permission.is_permit(), "{step:?}");
                    }
                }
            }
        }
    }
}

/// The same for reports that were delayed while those of another source were newer.
#[test]
fn source_that_lags_behind_another_is_denied() {
    let settings = Settings {
        permits_in_a_row: 1,
        inhibit_hold_ms: 1,
        ..settings()
    };
    let mut gate = Gate::new(DOCK, &settings, 0).unwrap();
    let of_other = Report {
        source: 1,
        ..outside(7, 100)
    };
    let _ = gate.step(100, &of_other);
    let verdicts = (0..8).map(|k| {
        let stamp_ms = 70 + 10 * k;
        gate.step(stamp_ms + 40, &report(k, stamp_ms)).verdict
    });
    let (changed, older) = (Err(Reason::SourceChanged), Err(Reason::TimeBackwards));
    let expected = [changed, older, older, older, Ok(()), Ok(()), Ok(()), Ok(())];
    assert!(verdicts.eq(expected));
}

/// Each report of two sources in turn is denied, because the last one was of the other source, for any sequence
/// numbers, also constant ones.
#[test]
fn two_sources_in_turn_never_open() {
    for permits_in_a_row in [1, 2, 3] {
        for (is_stuck, is_outside) in [(false, false), (true, false), (true, true)] {
            let settings = Settings {
                permits_in_a_row,
                inhibit_hold_ms: 1,
                ..settings()
            };
            let mut gate = Gate::new(DOCK, &settings, 0).unwrap();
            for k in 1..50u32 {
                let now = 20 * k;
                let source = (k % 2) as u8;
                let said = Report {
                    source,
                    ..report(if is_stuck { 5 } else { k / 2 }, now)
                };
                let said = match source {
                    0 if is_outside => Report {
                        source,
                        ..outside(k, now)
                    },
                    _ => said,
                };
                let step = gate.step(now, &said);
                if k == 1 {
                    // The first report has no predecessor.
                    assert_eq!(step.verdict, Ok(()));
                    assert_eq!(step.permission.is_permit(), permits_in_a_row == 1);
                } else {
                    assert_eq!(step.verdict, Err(Reason::SourceChanged));
                    assert!(!step.permission.is_permit());
                }
            }
            // As soon as one source is alone, its next report counts.
            let next = Report {
                source: 1,
                ..report(if is_stuck { 6 } else { 25 }, 1000)
            };
            assert_eq!(gate.step(1000, &next).verdict, Ok(()));
        }
    }
}

/// A report with the number and the stamp of the last one and another content: its content may end a permit
/// at once, and never counts for one.
#[test]
fn denied_repetition_closes_the_gate() {
    let settings = settings();
    let (mut gate, sequence, now) = permitted(DOCK, &settings, 1000);
    let step = gate.step(now + 1, &outside(sequence, now));
    assert_eq!(step.verdict, Err(Reason::OutsideTable));
    assert_eq!(step.state, State::Inhibited(Reason::OutsideTable));
    assert!(!step.permission.is_permit());
    // Good repetitions have no effect.
    for later in 2..100 {
        let step = gate.step(now + later, &report(sequence, now));
        assert_eq!(step.verdict, Err(Reason::Repeated));
        assert_eq!(step.state, State::Inhibited(Reason::OutsideTable));
    }
    let mut unknown = report(sequence, now);
    unknown.belief.spread = None;
    let (mut gate, ..) = permitted(DOCK, &settings, 1000);
    let step = gate.step(now + 1, &unknown);
    assert_eq!(step.verdict, Err(Reason::CovarianceUnknown));
    assert!(!step.permission.is_permit());
}

/// A repetition that permits is not counted: neither the count of permits nor the end of a permit changes.
#[test]
fn permitted_repetition_has_no_effect() {
    let settings = settings();
    let mut gate = Gate::new(DOCK, &settings, 0).unwrap();
    let _ = gate.step(60, &report(1, 60));
    for now in 61..160 {
        let step = gate.step(now, &report(1, 60));
        assert_eq!(step.verdict, Err(Reason::Repeated));
        assert_eq!(step.state, State::Qualifying(1), "{now}");
    }
    let _ = gate.step(160, &report(1, 60));
    let step = gate.step(161, &report(1, 60));
    assert_eq!(step.state, State::Inhibited(Reason::Silent));
    // Its age is still checked.
    let step = gate.step(261, &report(1, 60));
    assert_eq!(step.verdict, Err(Reason::Stale));
}

/// A source that restarts with another number is denied once, for the gap.
#[test]
fn restarted_source_recovers_after_one_gap() {
    let settings = settings();
    for begins in [0, 5, 1 << 31, u32::MAX - 1] {
        let (mut gate, _, mut now) = permitted(DOCK, &settings, 1000);
        let mut verdicts = Vec::new();
        for k in 0..5 {
            now += 20;
            let step = gate.step(now, &report(begins.wrapping_add(k), now));
            verdicts.push(step.verdict);
            assert_eq!(step.permission.is_permit(), k >= 3);
        }
        assert_eq!(verdicts[0], Err(Reason::SequenceGap), "{begins}");
        assert_eq!(verdicts[1..], [Ok(()); 4]);
    }
}

/// Returns the time from `now` until a report counts, with one report every 5 ms, stamped when it is sent.
fn waits(gate: &mut Gate<'_>, mut sequence: u32, mut now: u32) -> u32 {
    let since = now;
    loop {
        now = now.wrapping_add(5);
        sequence = sequence.wrapping_add(1);
        if gate.step(now, &report(sequence, now)).verdict == Ok(()) {
            break now.wrapping_sub(since);
        }
        assert!(now.wrapping_sub(since) < 10_000);
    }
}

/// The clock wraps after 49.7 days. After any time without reports, with cycles in between or a controller that
/// slept, a fresh report counts after the maximum age at the latest.
#[test]
fn fresh_report_counts_after_weeks_of_silence() {
    const DAY_MS: u64 = 86_400_000;
    let settings = settings();
    let mut silences: Vec<u64> = (0..120).map(|day| day * DAY_MS).collect();
    for round in [1u64 << 31, 1 << 32, 3 << 31, 1 << 33] {
        silences.extend((0..500).map(|k| round - 250 + k));
    }
    let (mut at_once, mut later) = (0, 0);
    for silence in silences {
        for cycle in [None, Some(1 << 29)] {
            let (mut gate, sequence, now) = permitted(DOCK, &settings, 1000);
            let until = u64::from(now) + silence;
            let mut tick = u64::from(now);
            while let Some(cycle) = cycle
                && tick + cycle < until
            {
                tick += cycle;
                assert!(!gate.tick(tick as u32).permission.is_permit());
            }
            let waited = waits(&mut gate, sequence, until as u32);
            assert!(waited <= MAXIMUM_AGE_MS + 10, "{silence}: {waited}");
            at_once += u32::from(waited == 5);
            later += u32::from(waited > 10);
        }
    }
    assert!(at_once > 2_000 && later > 100, "{at_once} {later}");
}

/// If a controller's clock is set back, earlier reports do not become fresh, and new reports wait for
/// the maximum age at most.
#[test]
fn clock_set_back_never_makes_reports_fresh() {
    let usual = settings();
    let settings = Settings {
        permits_in_a_row: 1,
        inhibit_hold_ms: 1,
        ..usual
    };
    for start in STARTS {
        for back in [1, 5, 19, 20, 50, 150, MAXIMUM_AGE_MS] {
            let good: Vec<Report> = (0..10)
                .map(|k| report(k, start.wrapping_add(20 + 20 * k)))
                .collect();
            let mut gate = Gate::new(DOCK, &settings, start).unwrap();
            for report in &good {
                let _ = gate.step(report.stamp_ms, report);
            }
            let mut now = start.wrapping_add(205);
            let _ = gate.step(now, &outside(10, now));
            now = now.wrapping_sub(back);
            assert_eq!(gate.tick(now).verdict, Err(Reason::TimeBackwards));
            for old in good.iter().chain(&good).chain(&good) {
                now = now.wrapping_add(11);
                let step = gate.step(now, old);
                assert!(!step.permission.is_permit(), "{start} {back}: {step:?}");
            }
        }
        for back in [
            1,
            100,
            MAXIMUM_AGE_MS,
            1000,
            1 << 20,
            (1 << 31) - 1,
            1 << 31,
        ] {
            let (mut gate, sequence, now) = permitted(DOCK, &usual, start);
            let now = now.wrapping_sub(back);
            assert!(!gate.tick(now).permission.is_permit());
            let waited = waits(&mut gate, sequence, now);
            let expected = back.min(MAXIMUM_AGE_MS) + 1..=MAXIMUM_AGE_MS + 10;
            assert!(expected.contains(&waited), "{back}: {waited}");
        }
        // For any maximum age.
        for maximum_age_ms in [1 << 30, (1 << 31) - 1] {
            let settings = Settings {
                maximum_age_ms,
                response_ms: 60,
                ..usual
            };
            let (mut gate, sequence, now) = permitted(DOCK, &settings, start);
            let now = now.wrapping_sub(50);
            assert!(!gate.tick(now).permission.is_permit());
            assert_eq!(waits(&mut gate, sequence, now), 55);
            // Set back to a time after the newest stamp.
            let (mut gate, sequence, now) = permitted(DOCK, &settings, start);
            let _ = gate.tick(now.wrapping_add(60));
            let now = now.wrapping_add(50);
            assert!(!gate.tick(now).permission.is_permit());
            assert_eq!(waits(&mut gate, sequence, now), 5);
        }
    }
}

/// A stamp from the future is denied, and later stamps are not compared with it.
#[test]
fn future_stamp_does_not_delay_later_reports() {
    let settings = settings();
    for ahead in [1, 100, MAXIMUM_AGE_MS, 100_000, (1 << 31) - 1] {
        let (mut gate, sequence, now) = permitted(DOCK, &settings, 1000);
        let future = report(sequence + 1, now.wrapping_add(20 + ahead));
        assert_eq!(gate.step(now + 20, &future).verdict, Err(Reason::Stale));
        let next = report(sequence + 2, now + 40);
        assert_eq!(gate.step(now + 40, &next).verdict, Ok(()), "{ahead}");
        // Nor if it was the first stamp.
        let mut gate = Gate::new(DOCK, &settings, 1000).unwrap();
        let future = report(0, 1020 + ahead);
        assert_eq!(gate.step(1020, &future).verdict, Err(Reason::Stale));
        assert_eq!(gate.step(1040, &report(1, 1040)).verdict, Ok(()), "{ahead}");
    }
}
