//! A program in the emulated board's memory that stops the board for a test: at the start, before each control cycle and
//! at each interrupt of the watchdog. `board.rs` compiles it, loads it next to the firmware and communicates with it.
//!
//! The firmware's bytes are not changed. This program starts first, replaces the firmware's vector table by its own,
//! and calls the firmware's handlers from its own. While the board is stopped, the processor is within one
//! semihosting call, which reads the emulator's standard input: no instruction is executed, and so no time passes.
//!
//! A stop writes three words: the kind of stop, the board's clock, the lamps. Then commands are read, three words each.
#![no_std]
#![no_main]

use core::arch::asm;
use core::ptr::{read_volatile, write_volatile};
use core::sync::atomic::{AtomicU32, AtomicUsize, Ordering};

/// The firmware's vectors, at the second address of the board's flash.
const VECTORS: usize = 0x0040_0000;
const RESET: usize = 1;
const NMI: usize = 2;
const TIMER: usize = 15;
const RECEIVE: usize = 16;
const COUNT: usize = 48;

const VECTOR_TABLE: usize = 0xe000_ed08;
const TIMER_CONTROL: usize = 0xe000_e010;
const WATCHDOG_LOAD: usize = 0x4000_8000;
const WATCHDOG_VALUE: usize = 0x4000_8004;
const WATCHDOG_CLEAR: usize = 0x4000_800c;
const WATCHDOG_LOCK: usize = 0x4000_8c00;
const WATCHDOG_KEY: u32 = 0x1acc_e551;
const LAMPS: usize = 0x4002_8000;
const CLOCK: usize = 0x4002_8018;
const CLOCK_PRESCALE: usize = 0x4002_801c;
const CLOCK_PRESCALER: usize = 0x4002_8020;

const STOP_AT_START: u32 = 0;
const STOP_AT_CYCLE: u32 = 1;
const STOP_AT_WATCHDOG: u32 = 2;

/// Continues with the firmware's handler, once the given number of bytes in all has arrived and the given milliseconds
/// later.
const RUN: u32 = 0;
/// Sends the given number of bytes at an address to the test.
const READ: u32 = 1;
/// Writes the given number of bytes from the test to an address.
const WRITE: u32 = 2;
// Any other command continues without the firmware's handler.
#[repr(C, align(1024))]
struct Table([AtomicUsize; COUNT]);
static TABLE: Table = Table([const { AtomicUsize::new(0) }; COUNT]);
static FROM_TEST: AtomicUsize = AtomicUsize::new(0);
static TO_TEST: AtomicUsize = AtomicUsize::new(0);
/// Number of bytes that have arrived over the serial line.
static RECEIVED: AtomicU32 = AtomicU32::new(0);

fn get(address: usize) -> u32 {
    // SAFETY: registers of the board, and the firmware's vectors.
    unsafe { read_volatile(address as *const u32) }
}

fn put(address: usize, value: u32) {
    // SAFETY: likewise.
    unsafe { write_volatile(address as *mut u32, value) }
}

#[unsafe(no_mangle)]
extern "C" fn start() -> ! {
    for (number, entry) in TABLE.0.iter().enumerate() {
        entry.store(firmware(number), Ordering::Relaxed);
    }
    let own: [(usize, extern "C" fn()); 3] = [(NMI, watchdog), (TIMER, cycle), (RECEIVE, receive)];
    for (number, handler) in own {
        TABLE.0[number].store(handler as usize, Ordering::Relaxed);
    }
    put(VECTOR_TABLE, (&raw const TABLE).addr() as u32);
    FROM_TEST.store(open(b"/dev/stdin\0", 0), Ordering::Relaxed);
    TO_TEST.store(open(b"/dev/stdout\0", 4), Ordering::Relaxed);
    stop(STOP_AT_START);
    // SAFETY: does what the processor does at a reset, with the firmware's values.
    unsafe {
        asm!("msr msp, {}", "bx {}", in(reg) firmware(0), in(reg) firmware(RESET), options(noreturn));
    }
}

/// Returns a word of the firmware's vector table by its number.
fn firmware(number: usize) -> usize {
    get(VECTORS + 4 * number) as usize
}

/// Calls the firmware's handler.
fn call(number: usize) {
    // SAFETY: the processor would call the handler here. A handler is a function without arguments and changes only the
    // registers that a function may change. No float is used here.
    unsafe {
        asm!(
            "blx {}", in(reg) firmware(number),
            out("r0") _, out("r1") _, out("r2") _, out("r3") _, out("r12") _, out("lr") _,
        );
    }
}

/// Handles the timer's interrupt: stops before the control cycle.
extern "C" fn cycle() {
    // No byte is accepted before the clocks are stopped.
    hold_interrupts(true);
    let command = stop(STOP_AT_CYCLE);
    if let Some((received, _)) = command
        && RECEIVED.load(Ordering::Relaxed) != received
    {
        take_bytes(received);
    }
    hold_interrupts(false);
    if let Some((_, late_ms)) = command {
        let start = get(CLOCK);
        while get(CLOCK).wrapping_sub(start) < late_ms {}
        call(TIMER);
    }
}

fn hold_interrupts(hold: bool) {
    // SAFETY: the firmware does not run here. It finds the mask as it left it: off.
    unsafe {
        if hold {
            asm!("cpsid i");
        } else {
            asm!("cpsie i");
        }
    }
}

extern "C" fn watchdog() {
    if stop(STOP_AT_WATCHDOG).is_some() {
        call(NMI);
    } else {
        feed(WATCHDOG_CLEAR, 1);
    }
}

/// Handles the interrupt of a received byte, which has priority over the timer's interrupt.
extern "C" fn receive() {
    RECEIVED.fetch_add(1, Ordering::Relaxed);
    call(RECEIVE);
}

/// Waits for bytes of the line, which the host delivers at any time. Meanwhile the controller's clock, timer and
/// watchdog are stopped, so the time of delivery does not matter.
fn take_bytes(received: u32) {
    let timer = get(TIMER_CONTROL);
    put(TIMER_CONTROL, timer & !1);
    let watchdog = get(WATCHDOG_VALUE);
    feed(WATCHDOG_LOAD, u32::MAX);
    let clock = [CLOCK, CLOCK_PRESCALE, CLOCK_PRESCALER].map(|address| (address, get(address)));
    // Longer than a test takes. QEMU divides by one more than the first value, so it must not be the largest number.
    put(CLOCK_PRESCALER, u32::MAX);
    put(CLOCK_PRESCALE, u32::MAX - 1);
    hold_interrupts(false);
    // SAFETY: reads a word until it has a value. After each read the emulator serves its files. One iteration has five
    // instructions, 320 ns: a whole number of the 40 ns that the board's clocks count, so that all clocks stay in step.
    unsafe {
        asm!(
            "2: ldr {now}, [{count}]", "cmp {now}, {all}", "beq 3f", "yield", "b 2b", "3:",
            now = out(reg) _, count = in(reg) RECEIVED.as_ptr(), all = in(reg) received, options(nostack)
        );
    }
    for (address, value) in clock {
        put(address, value);
    }
    feed(WATCHDOG_LOAD, watchdog);
    put(TIMER_CONTROL, timer);
}

/// Writes a register of the watchdog.
fn feed(register: usize, value: u32) {
    put(WATCHDOG_LOCK, WATCHDOG_KEY);
    put(register, value);
    put(WATCHDOG_LOCK, 0);
}

/// Stops until the test lets the board run. Returns what to wait for, or `None` if the handler must be skipped.
fn stop(which: u32) -> Option<(u32, u32)> {
    let status = [which, get(CLOCK), get(LAMPS)];
    write((&raw const status).addr(), size_of_val(&status));
    loop {
        let mut command = [0u32; 3];
        read((&raw mut command).addr(), size_of_val(&command));
        // SAFETY: the call above has written the words, which the compiler cannot see.
        let [what, a, b] = unsafe { read_volatile(&raw const command) };
        match what {
            READ => write(a as usize, b as usize),
            WRITE => read(a as usize, b as usize),
            RUN => return Some((a, b)),
            _ => return None,
        }
    }
}

/// A call to the emulator's host (Arm's semihosting).
fn host(operation: usize, block: [usize; 3]) -> usize {
    let result;
    // SAFETY: the emulator reads and writes only the memory that the block names.
    unsafe {
        asm!("bkpt 0xab", inlateout("r0") operation => result, in("r1") &raw const block);
    }
    result
}

fn open(name: &[u8], mode: usize) -> usize {
    host(1, [name.as_ptr().addr(), mode, name.len() - 1])
}

fn write(address: usize, length: usize) {
    let left = host(5, [TO_TEST.load(Ordering::Relaxed), address, length]);
    if left != 0 {
        end();
    }
}

/// Reads the given number of bytes. A pipe may deliver them in parts.
fn read(mut address: usize, mut length: usize) {
    while length > 0 {
        let left = host(6, [FROM_TEST.load(Ordering::Relaxed), address, length]);
        if left >= length {
            end();
        }
        address += length - left;
        length = left;
    }
}

/// Ends the emulator, because the test has ended.
fn end() -> ! {
    const EXIT: usize = 0x18;
    const DONE: usize = 0x2_0026;
    loop {
        // SAFETY: the emulator ends.
        unsafe { asm!("bkpt 0xab", in("r0") EXIT, in("r1") DONE) };
    }
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    end()
}
