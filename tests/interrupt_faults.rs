//! The firmware of `examples/interrupt_gate.rs` in QEMU, and what goes wrong in a controller itself, put in
//! by a debugger's hand while the interlock is open: a jump to nowhere, a hang, a flipped bit of flash.
#![cfg(feature = "cli")]

#[path = "support/controller.rs"]
mod controller;
#[path = "support/debugger.rs"]
mod debugger;
#[path = "support/dock.rs"]
mod dock;
#[path = "support/firmware.rs"]
mod firmware;

use controller::{Alone, Controller, DOCK, LAMPS, start};
use debugger::Debugger;
use posegate::gate::{Reason, State};
use posegate::wire::{encode, report_body};
use std::time::Duration;

/// Whether the heart beats: changes of its lamp within some looks at it.
fn beats(controller: &mut Controller) -> usize {
    let mut lamp = || {
        std::thread::sleep(Duration::from_millis(10));
        controller.board.word(LAMPS) & 2
    };
    let seen: Vec<u32> = (0..60).map(|_| lamp()).collect();
    seen.windows(2).filter(|pair| pair[0] != pair[1]).count()
}

/// An open controller, and a debugger's hand in it that does something.
fn open_and(harm: impl FnOnce(&mut Debugger)) -> Alone {
    let mut alone = start();
    let controller = &mut alone.controller;
    controller.open();
    assert!(beats(controller) > 2);
    controller.catch_up();
    controller.open();
    assert!(controller.board.interlock_is_high());
    controller.compare_no_more();
    let socket = controller.board.listen_for_debugger();
    harm(&mut Debugger::connect(&socket));
    alone
}

/// A program that is no more: no message, no beat, and the output low for good.
fn is_closed_for_good(controller: &mut Controller) {
    controller.board.wait_until_low(Duration::from_secs(5));
    // What was said before.
    while controller
        .board
        .frame_within(Duration::from_millis(500))
        .is_some()
    {}
    assert_eq!(beats(controller), 0);
    controller.pour(&encode(&report_body(&controller.next_report())));
    assert_eq!(
        controller.board.frame_within(Duration::from_millis(500)),
        None
    );
    assert!(!controller.board.interlock_is_high());
}

/// Where the address of the timer's interrupt is.
const TIMER_VECTOR: u32 = 0x3c;

#[test]
fn a_fault_closes_and_stops_the_heart() {
    // The next cycle is at an address that is no code.
    let mut alone = open_and(|debugger| debugger.write(TIMER_VECTOR, &[0; 4]));
    is_closed_for_good(&mut alone.controller);
}

/// The watchdog's: nothing else runs any more.
#[test]
fn a_cycle_that_hangs_closes_and_stops_the_heart() {
    let mut alone = open_and(|debugger| {
        let vector = debugger.read(TIMER_VECTOR, 4);
        let vector = u32::from_le_bytes(vector.try_into().unwrap());
        // Bit 0 says that it is Thumb; `b .`
        debugger.write(vector & !1, &[0xfe, 0xe7]);
    });
    is_closed_for_good(&mut alone.controller);
}

/// A bit of the table falls over in flash while the gate is open: found within a round of the scrub.
#[test]
fn a_flipped_bit_of_flash_closes_for_good() {
    let mut alone = open_and(|debugger| {
        let flash = debugger.read(0, 0x2_0000);
        let at = flash.windows(DOCK.len()).position(|bytes| bytes == DOCK);
        let at = at.expect("the table is in flash") + 200;
        debugger.write(at as u32, &[flash[at] ^ 4]);
    });
    let controller = &mut alone.controller;
    let latched = State::Latched(Reason::TableDamaged);
    controller.good_until("the scrub has found it", |told| told.state == latched);
    for _ in 0..50 {
        let told = controller.good_until("a cycle more", |_| true);
        assert_eq!((told.state, told.interlock_high), (latched, false));
    }
    // The controller itself is well, and says what is wrong.
    assert!(beats(controller) > 2);
}
