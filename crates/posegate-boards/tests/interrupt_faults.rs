//! The firmware of `examples/interrupt_gate.rs` in QEMU, in virtual time, with faults of the controller while
//! the interlock is open: a jump to an invalid address, a hang, a late cycle, a missing watchdog interrupt, a flipped
//! bit of flash.

use posegate_testkit::controller;
use posegate_testkit::stepped;

use controller::{
    Controller, DOCK, FORCED, INHIBIT_HOLD_MS, PERIOD_MS, PERMIT_HOLD_MS, WATCHDOG_MS, start,
};
use posegate::gate::{Reason, State};
use posegate::wire::{encode, report_body};
use stepped::At;

/// Returns the number of changes of the heartbeat's lamp within some cycles.
fn beats(controller: &mut Controller, cycles: usize) -> usize {
    let mut heart = controller.board.stop().heartbeat_is_high();
    let mut beats = 0;
    for _ in 0..cycles {
        controller.hear();
        let now = controller.board.stop().heartbeat_is_high();
        beats += usize::from(now != heart);
        heart = now;
    }
    beats
}

/// Starts a controller and opens it. Its heartbeat runs.
fn open() -> Controller {
    let mut controller = start();
    // One change per 50 ms.
    let beats = beats(&mut controller, 60);
    assert!((11..=12).contains(&beats), "{beats}");
    controller.open();
    assert!(controller.interlock_is_high());
    controller
}

/// Asserts that the program has stopped: the output goes low with the watchdog's next interrupt at the latest and stays
/// low; there are no messages and no heartbeat.
fn is_closed_for_good(controller: &mut Controller) {
    let begun = controller.board.stop();
    controller.pour(&encode(&report_body(&controller.next_report())));
    let first = controller.run_cycle();
    assert_eq!(first.at, At::Watchdog);
    assert!(first.now_ms.wrapping_sub(begun.now_ms) <= WATCHDOG_MS);
    let heart = first.heartbeat_is_high();
    for _ in 0..20 {
        let stop = controller.board.run(&[]);
        assert_eq!(stop.at, At::Watchdog);
        assert_eq!(
            (stop.interlock_is_high(), stop.heartbeat_is_high()),
            (false, heart)
        );
        assert!(controller.board.next_frame().is_none());
        let report = encode(&report_body(&controller.next_report()));
        controller.board.put_on_line(&report);
    }
}

/// Address of the vector of the timer's interrupt.
const TIMER_VECTOR: u32 = 0x3c;

#[test]
fn fault_closes_interlock_and_stops_heartbeat() {
    let mut controller = open();
    // The next cycle jumps to an address without code.
    controller.board.write(TIMER_VECTOR, &[0; 4]);
    is_closed_for_good(&mut controller);
}

/// Only the watchdog's interrupt still runs.
#[test]
fn hung_cycle_closes_interlock_and_stops_heartbeat() {
    let mut controller = open();
    let vector = controller.board.read(TIMER_VECTOR, 4);
    let vector = u32::from_le_bytes(vector.try_into().unwrap());
    // Bit 0 of the vector marks Thumb code. Writes `b .`.
    controller.board.write(vector & !1, &[0xfe, 0xe7]);
    is_closed_for_good(&mut controller);
}

/// Between the watchdog's 50 ms and the permits' 100 ms.
const LATE_MS: u32 = 60;

/// Tests a late cycle while the earlier permit is still valid. The cycle closes the gate before it evaluates the received
/// report, and no earlier permit drives the output high again. New reports then lead to a new permit.
fn comes_late(watchdog_is_broken: bool) {
    let mut controller = open();
    let before = controller.good_until("a permit that is weighed", |telemetry| {
        telemetry.weighed.is_some()
    });
    assert!(before.permitted);
    controller.report(&controller.next_report());
    let high_for = controller.run_late_cycle(LATE_MS, watchdog_is_broken);
    assert!(high_for <= WATCHDOG_MS, "{high_for}");
    let late = controller.hear();
    let passed = late.now_ms.wrapping_sub(before.now_ms);
    assert_eq!(passed, PERIOD_MS + LATE_MS);
    assert!(passed <= PERMIT_HOLD_MS);
    assert_eq!((late.state, late.weighed), (FORCED, None));
    assert!(!late.interlock_high && !late.permitted && !controller.interlock_is_high());
    // The report is evaluated after that, and its permit counts as the first.
    let weighed = controller.hear();
    assert_eq!(weighed.cycle, late.cycle);
    assert!(
        weighed
            .weighed
            .is_some_and(|weighed| weighed.verdict.is_ok())
    );
    assert_eq!(weighed.state, State::Qualifying(1));
    let opened = controller.open();
    let closed_for = opened.now_ms.wrapping_sub(late.now_ms);
    assert!(
        (INHIBIT_HOLD_MS..INHIBIT_HOLD_MS + 3 * PERIOD_MS).contains(&closed_for),
        "{closed_for}"
    );
}

/// The watchdog forces the output low before the late cycle begins.
#[test]
fn late_cycle_never_opens_on_old_permit() {
    comes_late(false);
}

/// The controller detects the late cycle by its own clock.
#[test]
fn late_cycle_is_detected_without_watchdog() {
    comes_late(true);
}

/// A bit of the table flips in flash while the gate is open. The scrub finds it within one round.
#[test]
fn flipped_flash_bit_latches_interlock_low() {
    let mut controller = open();
    controller.compare_no_more();
    let flash = controller.board.read(0, 0x2_0000);
    let at = flash.windows(DOCK.len()).position(|bytes| bytes == DOCK);
    let at = at.expect("the table is in flash") + 200;
    controller.board.write(at as u32, &[flash[at] ^ 4]);
    let latched = State::Latched(Reason::TableDamaged);
    controller.good_until("the scrub has found it", |telemetry| {
        telemetry.state == latched
    });
    for _ in 0..50 {
        let telemetry = controller.good_until("a cycle more", |_| true);
        assert_eq!(
            (telemetry.state, telemetry.interlock_high),
            (latched, false)
        );
    }
    // The controller still runs and reports the fault.
    assert!(beats(&mut controller, 60) > 2);
}
