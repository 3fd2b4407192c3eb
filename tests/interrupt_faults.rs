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

use controller::{Alone, Controller, DOCK, FORCED, INHIBIT_HOLD_MS, LAMPS, PERMIT_HOLD_MS, start};
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

/// Far above the firmware's variables.
const UNUSED_RAM: u32 = 0x2030_0000;
/// In between its watchdog's 50 ms and its permits' 100.
const LATE_MS: u8 = 60;

/// Has the timer's interrupt come to nothing for [`LATE_MS`] by the board's clock, once, in so many cycles.
fn come_late_in(debugger: &mut Debugger, cycles: u32) {
    let vector = debugger.read(TIMER_VECTOR, 4);
    let code: [u16; 14] = [
        0x4806,                  // ldr r0, counter
        0x6801,                  // ldr r1, [r0]
        0x3901,                  // subs r1, #1
        0x6001,                  // str r1, [r0]
        0xd105,                  // bne goes_on
        0x4805,                  // ldr r0, clock
        0x6801,                  // ldr r1, [r0]
        0x6802,                  // waits: ldr r2, [r0]
        0x1a52,                  // subs r2, r2, r1
        0x2a00 | LATE_MS as u16, // cmp r2, #LATE_MS
        0xd3fb,                  // blo waits
        0x4a03,                  // goes_on: ldr r2, vector
        0x4710,                  // bx r2
        0xbf00,                  // nop
    ];
    let counter = UNUSED_RAM + 0x40;
    let words = [counter.to_le_bytes(), 0x4002_8018u32.to_le_bytes()];
    let code = code.map(u16::to_le_bytes);
    let bytes = [code.as_flattened(), words.as_flattened(), &vector].concat();
    debugger.write(UNUSED_RAM, &bytes);
    debugger.write(counter, &cycles.to_le_bytes());
    debugger.write(TIMER_VECTOR, &(UNUSED_RAM | 1).to_le_bytes());
}

/// The watchdog forces the output low in a cycle that takes too long, and the cycle goes on: no permit from
/// before drives it high again, young as it still is. Reports then earn another.
#[test]
fn a_cycle_that_comes_late_opens_on_no_old_permit() {
    // Where the machine held the emulation up as well, the permit was no longer young.
    let seen = (0..5).any(|_| {
        let mut alone = open_and(|debugger| come_late_in(debugger, 100));
        let controller = &mut alone.controller;
        let (mut before, mut weighed_ms) = (controller.last(), 0);
        let late = loop {
            let told = controller.good_until("a cycle more", |_| true);
            let passed = told.now_ms.wrapping_sub(before.now_ms);
            if passed >= u32::from(LATE_MS) {
                break told;
            }
            if told.weighed.is_some_and(|weighed| weighed.verdict.is_ok()) {
                weighed_ms = told.now_ms;
            }
            before = told;
        };
        assert!(!late.interlock_high && !late.permitted, "{late:?}");
        assert_eq!((late.state, late.weighed), (FORCED, None));
        let opened = controller.open();
        let closed_for = opened.now_ms.wrapping_sub(late.now_ms);
        assert!(closed_for >= INHIBIT_HOLD_MS, "{closed_for}");
        let was_young = late.now_ms.wrapping_sub(weighed_ms) <= PERMIT_HOLD_MS;
        before.permitted && was_young
    });
    assert!(seen, "no permit was young enough");
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
