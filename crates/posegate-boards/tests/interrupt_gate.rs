//! The firmware of `examples/interrupt_gate.rs` in QEMU, in virtual time, with every fault of a serial line: random bytes,
//! silence, floods, damaged frames and intact frames with wrong content. The interlock is high after three consecutive
//! good reports, and at no other time. (Faults of the controller itself: `interrupt_faults.rs`.)
//!
//! The controller's report on each cycle is compared with the same gate on the host and with an oracle in plain
//! floats. The host gate gets the reports in the sent bytes (`crates/posegate-testkit/src/controller.rs`). The fast suite uses
//! smaller counts; `./ci.sh faults` sets them: `POSEGATE_GARBAGE_BYTES`, `POSEGATE_MUTANTS`,
//! `POSEGATE_FLOOD_SECONDS`.

use posegate_testkit::controller;
use posegate_testkit::mutants;

use controller::{Chance, Controller, DOCK, MAXIMUM_AGE_MS, PERIOD_MS, PERMIT_HOLD_MS, start};
use posegate::gate::{Reason, State};
use posegate::report::{FrameId, Report};
use posegate::table::Table;
use posegate::track::Increment;
use posegate::wire::{Telemetry, encode, report_body};
use posegate::wire::{counted_report_body, hypothesis_body};
use std::path::Path;
use std::time::Duration;

fn count(variable: &str, fast: usize) -> usize {
    std::env::var(variable).map_or(fast, |value| {
        value.parse().unwrap_or_else(|e| panic!("{variable}: {e}"))
    })
}

fn line(name: &str, value: impl core::fmt::Display, unit: &str, goal: &str) {
    // libtest may have begun the line.
    println!(
        "\n{{\"name\": \"{name}\", \"value\": {value}, \"unit\": \"{unit}\", \"goal\": {goal}}}"
    );
}

#[test]
fn host_settings_equal_firmware_settings() {
    let path =
        Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("examples/interrupt_gate.rs");
    let source = std::fs::read_to_string(path).unwrap();
    let (_, digest) = source.split_once("task_digest: [").unwrap();
    let (digest, _) = digest.split_once(']').unwrap();
    let digest: Vec<u8> = digest
        .split(',')
        .filter_map(|byte| u8::from_str_radix(byte.trim().strip_prefix("0x")?, 16).ok())
        .collect();
    assert_eq!(digest, Table::parse(DOCK).unwrap().task_digest());
    for setting in [
        format!("maximum_age_ms: {MAXIMUM_AGE_MS},"),
        format!("permit_hold_ms: {PERMIT_HOLD_MS},"),
        format!("inhibit_hold_ms: {},", controller::INHIBIT_HOLD_MS),
        format!("permits_in_a_row: {},", controller::PERMITS),
    ] {
        assert!(source.contains(&setting), "{setting}");
    }
}

#[test]
fn interlock_opens_after_three_good_reports() {
    let mut controller = start();
    assert!(!controller.interlock_is_high());
    assert_eq!(controller.tally.high, 0);
    let mut states = Vec::new();
    while !controller.last().permitted {
        let cycle = controller.last().cycle;
        controller.report(&controller.next_report());
        let telemetry = controller.until("the next cycle", |telemetry| telemetry.cycle != cycle);
        assert!(
            telemetry
                .weighed
                .is_some_and(|weighed| weighed.verdict.is_ok())
        );
        states.push(telemetry.state);
    }
    let three = [State::Qualifying(1), State::Qualifying(2), State::Permitted];
    assert_eq!(states, three);
    assert!(controller.interlock_is_high());
}

/// The gate closes in the cycle that evaluates the bad report, with that report's reason.
#[test]
fn bad_report_closes_interlock_at_once() {
    let mut controller = start();
    type Change = fn(&mut Report);
    let cases: [(Reason, Change); 9] = [
        (Reason::NotContained, |r| r.belief.x_m = 0.075),
        (Reason::OutsideTable, |r| r.belief.x_m = 1.0),
        (Reason::EstimateNotFinite, |r| r.belief.y_m = f64::NAN),
        (Reason::CovarianceUnknown, |r| r.belief.spread = None),
        (Reason::SequenceGap, |r| {
            r.sequence = r.sequence.wrapping_add(1)
        }),
        (Reason::SequenceStuck, |r| {
            r.sequence = r.sequence.wrapping_sub(1)
        }),
        (Reason::TimeBackwards, |r| {
            r.stamp_ms = r.stamp_ms.wrapping_sub(MAXIMUM_AGE_MS + 1)
        }),
        (Reason::Stale, |r| {
            r.stamp_ms = r.stamp_ms.wrapping_add(1000)
        }),
        (Reason::FrameMismatch, |r| r.frame = FrameId::of("odom")),
    ];
    for (reason, change) in cases {
        let cycle = controller.open().cycle;
        let mut report = controller.next_report();
        change(&mut report);
        controller.report(&report);
        let telemetry = controller.until("the next cycle", |telemetry| telemetry.cycle != cycle);
        assert_eq!(telemetry.weighed.map(|w| w.verdict), Some(Err(reason)));
        assert_eq!(
            (telemetry.state, telemetry.interlock_high),
            (State::Inhibited(reason), false)
        );
        assert!(!controller.interlock_is_high(), "{reason}");
    }
    assert_eq!(controller.tally.opened, cases.len());
}

/// Fixes come rarely and late, odometry in every cycle: the gate stays open while the robot drives, and closes at once when the
/// odometry breaks, when it ends, and when the fixes end.
#[test]
fn odometry_keeps_the_gate_open_between_fixes() {
    let mut controller = start();
    let drive = |controller: &mut Controller, cycles: u32, fixes: bool, ahead_um: i32| {
        let mut open = 0;
        // As if the last increment was one period ago.
        let mut newest_ms = controller.last().now_ms.wrapping_sub(PERIOD_MS);
        for cycle in 0..cycles {
            let now_ms = controller.last().now_ms;
            if fixes && cycle % 40 == 0 {
                // Stamped 60 ms ago, when the robot was at the goal.
                let fix = Report {
                    source: controller::CARRIED,
                    sequence: cycle,
                    stamp_ms: now_ms.wrapping_sub(60),
                    ..controller.next_report()
                };
                controller.fix(&fix);
            }
            // Back and forth, so that the robot stays at the goal.
            let ahead_um = if cycle % 2 == 0 { ahead_um } else { -ahead_um };
            controller.odometry(&Increment::new(ahead_um << 8, 0, 0, [newest_ms, now_ms]).unwrap());
            newest_ms = now_ms;
            let last = controller.last().cycle;
            let telemetry = controller.until("the next cycle", |telemetry| telemetry.cycle != last);
            open += u32::from(telemetry.permitted);
        }
        open
    };
    // The first increments mark the time; the fix of the first cycle is older than they are. The second fix opens.
    let opened = drive(&mut controller, 200, true, 500);
    assert!(opened > 130, "{opened}");
    assert!(controller.last().permitted);
    assert!(drive(&mut controller, 30, false, 500) == 30);
    // A jump of 30 cm.
    let now_ms = controller.last().now_ms;
    let before_ms = now_ms.wrapping_sub(PERIOD_MS);
    controller.odometry(&Increment::new(300_000 << 8, 0, 0, [before_ms, now_ms]).unwrap());
    let last = controller.last().cycle;
    let telemetry = controller.until("the next cycle", |telemetry| telemetry.cycle != last);
    assert_eq!(telemetry.state, State::Inhibited(Reason::OdometryJump));
    assert!(!controller.interlock_is_high());
    // It opens again after a newer fix, and stays open without fixes until they are too old.
    assert!(drive(&mut controller, 160, true, 500) > 60);
    assert!(controller.last().permitted);
    let still_open = drive(&mut controller, 200, false, 500);
    assert!((20..=110).contains(&still_open), "{still_open}");
    assert!(!controller.last().permitted);
    // Open again; then the odometry ends.
    assert!(drive(&mut controller, 160, true, 500) > 60);
    assert!(controller.last().permitted);
    let from_ms = controller.last().now_ms;
    let telemetry = controller.until("closed", |telemetry| !telemetry.permitted);
    let after_ms = telemetry.now_ms.wrapping_sub(from_ms);
    assert!(after_ms <= PERMIT_HOLD_MS + PERIOD_MS, "{after_ms}");
}

/// A report with hypotheses over the line: a hypothesis outside closes, and a lost one is detected.
#[test]
fn each_received_hypothesis_counts() {
    let mut controller = start();
    let send = |controller: &mut Controller, places: &[f64], lose: Option<usize>| {
        let cycle = controller.open().cycle;
        let report = controller.next_report();
        for (number, x_m) in (1u8..).zip(places) {
            let mut other = report;
            other.belief.x_m = *x_m;
            if lose != Some(usize::from(number)) {
                controller.send(&encode(&hypothesis_body(number, &other).unwrap()));
            }
        }
        let counted = counted_report_body(places.len() as u8, &report).unwrap();
        controller.send(&encode(&counted));
        controller.skip();
        let telemetry = controller.until("the report", |telemetry| {
            telemetry.cycle != cycle && (telemetry.weighed.is_some() || !telemetry.permitted)
        });
        (
            telemetry.state,
            telemetry.weighed.map(|weighed| weighed.verdict),
        )
    };
    let permitted = (State::Permitted, Some(Ok(())));
    assert_eq!(send(&mut controller, &[0.0, 0.005], None), permitted);
    let denied = Reason::NotContained;
    assert_eq!(
        send(&mut controller, &[0.0, 0.075], None),
        (State::Inhibited(denied), Some(Err(denied)))
    );
    // The lost hypothesis was the bad one: the report is refused, and the permit ends for lack of reports.
    assert_eq!(
        send(&mut controller, &[0.075, 0.0], Some(1)),
        (State::Inhibited(Reason::Silent), None)
    );
}

/// A permit ends with the first cycle after its hold time. Later reports must qualify again.
#[test]
fn silence_closes_interlock_until_new_permits() {
    let mut controller = start();
    for _ in 0..3 {
        let opened = controller.open();
        let (mut before, mut telemetry) = (opened, opened);
        while telemetry.permitted {
            before = telemetry;
            telemetry = controller.hear();
            assert_eq!(telemetry.weighed, None);
        }
        assert_eq!(telemetry.state, State::Inhibited(Reason::Silent));
        assert!(!telemetry.interlock_high && !controller.interlock_is_high());
        // By the controller's clock: the last cycle in which it was open, and the first in which it was not.
        let open_for = |telemetry: Telemetry| telemetry.now_ms.wrapping_sub(opened.now_ms);
        assert!(open_for(before) <= PERMIT_HOLD_MS && PERMIT_HOLD_MS < open_for(telemetry));
    }
    assert_eq!(controller.tally.opened, 3);
}

/// A report cannot be younger than its first byte, however late its last byte arrives.
#[test]
fn stamp_after_first_byte_is_in_the_future() {
    let mut controller = start();
    controller.open();
    let report = Report {
        stamp_ms: controller.last().now_ms.wrapping_add(100),
        ..controller.next_report()
    };
    let frame = encode(&report_body(&report));
    controller.send(&frame[..1]);
    controller.until("the stamp is past", |telemetry| {
        telemetry.now_ms.wrapping_sub(report.stamp_ms) < 1 << 31
    });
    controller.send(&frame[1..]);
    let telemetry = controller.hear();
    let weighed = telemetry.weighed.expect("a report");
    assert_eq!(weighed.verdict, Err(Reason::Stale));
    assert_eq!(weighed.stamp_ms, telemetry.now_ms.wrapping_add(1));
}

/// The speed and load of the host change neither the controller's messages nor their times.
#[test]
fn host_load_never_changes_controller_messages() {
    let run = |pause: Duration| {
        let mut controller = start();
        let mut chance = Chance(0x7133);
        let mut telemetry = Vec::new();
        for _ in 0..60 {
            let good = controller.next_report();
            let mut bytes = mutants::random_bytes(&mut chance, &good);
            bytes.push(0);
            bytes.extend(mutants::frame(&good));
            bytes.truncate(bytes.len() - chance.below(2));
            controller.pour(&bytes);
            std::thread::sleep(pause);
            telemetry.push((controller.hear(), controller.board.stop()));
        }
        telemetry
    };
    let slow = std::thread::spawn(move || run(Duration::from_millis(7)));
    let quick = run(Duration::ZERO);
    assert!(
        quick
            .iter()
            .any(|(telemetry, _)| telemetry.weighed.is_some())
    );
    assert_eq!(quick, slow.join().unwrap());
}

#[test]
fn random_bytes_never_open_interlock() {
    let mut controller = start();
    let bytes = count("POSEGATE_GARBAGE_BYTES", 60_000);
    let mut chance = Chance(0x6a5b_a6e5);
    let mut sent = 0;
    while sent < bytes {
        let good = controller.next_report();
        let bytes = mutants::random_bytes(&mut chance, &good);
        sent += bytes.len();
        controller.send(&bytes);
    }
    controller.until_quiet();
    let telemetry = controller.last();
    assert_eq!(telemetry.line.bytes as usize, sent);
    assert_eq!((controller.tally.high, controller.tally.weighed), (0, 0));
    assert!(
        telemetry.line.refused as usize > bytes / 1000,
        "{telemetry:?}"
    );
    // The random bytes have no lasting effect.
    controller.send(&[0]);
    controller.open();
    assert!(controller.interlock_is_high());
    assert_eq!(controller.tally.wrongly, 0);
    line(
        "uart firmware: random bytes",
        sent,
        "bytes",
        &bytes.to_string(),
    );
    line("uart firmware: opened by random bytes", 0, "times", "0");
}

/// One mutant per cycle or more, before good reports, together with them and instead of them.
#[test]
fn mutated_frames_never_get_a_false_permit() {
    let mut controller = start();
    let mutants = count("POSEGATE_MUTANTS", 150);
    let mut chance = Chance(0x003a_7a47);
    let (mut sent, mut rounds) = (0, 0);
    while sent < mutants {
        // Good reports until the gate is open, or, in some rounds, until it has counted one or two permits.
        let enough = [None, None, Some(1), Some(2)][rounds % 4];
        controller.good_until("open, or on the way", |telemetry| match telemetry.state {
            State::Permitted => true,
            State::Qualifying(count) => enough.is_some_and(|enough| count >= enough),
            _ => false,
        });
        for _ in 0..chance.below(6) {
            for _ in 0..chance.below(3) {
                let good = controller.next_report();
                let damaged = mutants::damaged(&mut chance, &good);
                controller.send(&damaged);
                sent += 1;
            }
            // The frame's end may be lost; without this zero the next report may be lost as well.
            if chance.below(4) > 0 {
                controller.send(&[0]);
            }
            step(&mut controller);
        }
        for _ in 0..1 + chance.below(6) {
            for _ in 0..1 + chance.below(4) {
                let good = controller.next_report();
                let lying = mutants::lying(&mut chance, &good);
                controller.send(&lying);
                sent += 1;
            }
            if chance.below(2) == 0 {
                step(&mut controller);
            } else {
                controller.hear();
            }
        }
        rounds += 1;
    }
    controller.until_quiet();
    let tally = controller.tally;
    assert_eq!(tally.wrongly, 0, "{tally:?}");
    // The test was not vacuous: mutants met open gates and closed them.
    assert!(
        tally.opened * 3 > rounds && tally.high > rounds,
        "{tally:?} {rounds}"
    );
    assert!(
        tally.weighed - tally.permitting > sent / 8,
        "{tally:?} {sent}"
    );
    let refused = controller.last().line.refused as usize;
    assert!(refused > sent / 8, "{refused} {sent}");
    line(
        "uart firmware: mutated frames",
        sent,
        "frames",
        &mutants.to_string(),
    );
    line(
        "uart firmware: permitted wrongly",
        tally.wrongly,
        "cycles",
        "0",
    );
    line(
        "uart firmware: cycles open among mutated frames",
        tally.high,
        "cycles",
        "null",
    );
    line(
        "uart firmware: openings among mutated frames",
        tally.opened,
        "times",
        "null",
    );
}

/// Sends a good report and reads messages until the next cycle.
fn step(controller: &mut Controller) {
    let cycle = controller.last().cycle;
    controller.report(&controller.next_report());
    controller.until("the next cycle", |telemetry| telemetry.cycle != cycle);
}

/// A flood of five times the line's speed: every cycle runs, and the heartbeat continues. Then more bytes than the queue
/// holds: the lost bytes are counted, and the next cycles run.
#[test]
fn flooded_line_never_stops_control_cycle() {
    const A_CYCLE: usize = 600;
    const BURST: usize = 2_000;
    let mut controller = start();
    let seconds = count("POSEGATE_FLOOD_SECONDS", 1) as u32;
    let mut chance = Chance(0x000f_100d);
    controller.open();
    controller.compare_no_more();
    let before = controller.last();
    let (mut beats, mut heart) = (0, false);
    let passed = |controller: &Controller| controller.last().now_ms.wrapping_sub(before.now_ms);
    // Whole messages are sent: what one cycle has got too many, the next has too few.
    let mut flood = 0;
    while passed(&controller) < 1000 * seconds {
        flood -= A_CYCLE.min(flood);
        while flood < A_CYCLE {
            let good = controller.next_report();
            let bytes = match chance.below(4) {
                0 => mutants::random_bytes(&mut chance, &good),
                1 => mutants::lying(&mut chance, &good),
                _ => mutants::frame(&good),
            };
            flood += bytes.len();
            controller.pour(&bytes);
        }
        let cycle = controller.last().cycle;
        controller.until("the next cycle", |telemetry| telemetry.cycle != cycle);
        let heart_now = controller.board.stop().heartbeat_is_high();
        beats += u32::from(heart_now != heart);
        heart = heart_now;
    }
    let last = controller.last();
    let cycles = last.cycle.wrapping_sub(before.cycle);
    let due = passed(&controller) / PERIOD_MS;
    let bytes = last.line.bytes.wrapping_sub(before.line.bytes);
    line("uart firmware: flooded with", bytes, "bytes", "null");
    line(
        "uart firmware: cycles run in a flood",
        cycles,
        "cycles",
        &due.to_string(),
    );
    line(
        "uart firmware: beats seen in a flood",
        beats,
        "beats",
        "null",
    );
    assert_eq!(cycles, due);
    // Two changes per tenth of a second.
    assert!(beats + 2 >= due / 5, "{beats}");
    assert!(last.line.lost == 0 && last.line.left_aside > 0, "{last:?}");
    controller.pour(&[0xff; BURST]);
    let telemetry = controller.until("the next cycle", |telemetry| telemetry.cycle != last.cycle);
    assert!(telemetry.line.lost as usize > BURST / 3, "{telemetry:?}");
    let telemetry = controller.until("the one after", |next| next.cycle != telemetry.cycle);
    assert!(telemetry.now_ms.wrapping_sub(last.now_ms) <= 3 * PERIOD_MS);
    controller.until_quiet();
    controller.send(&[0]);
    controller.until("closed", |telemetry| !telemetry.permitted);
    let opened = controller.tally.opened;
    controller.open();
    assert_eq!(controller.tally.opened, opened + 1);
    assert!(controller.interlock_is_high());
}
