//! The parts of the board that QEMU calls `mps2-an386` (Arm MPS2+ with a Cortex-M4F, AN386) used by the
//! examples: the serial line, one LED, the system timer. A product uses its HAL instead.
#![allow(dead_code)] // Each example uses a part.

pub mod counter;
pub mod interrupts;
pub mod lamps;
pub mod robot;
pub mod stack;
pub mod worst;

use core::ptr::{read_volatile, write_volatile};
use embedded_hal::digital::{Error, ErrorKind, ErrorType, OutputPin};

/// Ticks of the system timer in a second (AN386: 25 MHz).
pub const TICKS_PER_SECOND: u32 = 25_000_000;

/// Reads a device register.
fn read(address: usize) -> u32 {
    // SAFETY: every address in this file is an aligned register of the board.
    unsafe { read_volatile(address as *const u32) }
}

/// Writes a device register.
fn write(address: usize, value: u32) {
    // SAFETY: as in `read`; none of these registers lets a device write to memory.
    unsafe { write_volatile(address as *mut u32, value) }
}

/// The board's first serial line (CMSDK APB UART).
pub struct Uart(());

impl Uart {
    const DATA: usize = 0x4000_4000;
    const STATE: usize = 0x4000_4004;
    const CONTROL: usize = 0x4000_4008;
    const DIVIDER: usize = 0x4000_4010;
    const SEND_FULL: u32 = 1 << 0;
    const RECEIVE_FULL: u32 = 1 << 1;

    /// Enables the line: 25 MHz / 217 = 115,207 bits a second.
    pub fn new() -> Self {
        write(Self::DIVIDER, 217);
        write(Self::CONTROL, 0b11);
        Self(())
    }

    /// Returns the byte that has arrived, if any.
    pub fn receive(&mut self) -> Option<u8> {
        (read(Self::STATE) & Self::RECEIVE_FULL != 0).then(|| read(Self::DATA) as u8)
    }

    /// Sends bytes; returns when the last one is being sent.
    pub fn send(&mut self, bytes: &[u8]) {
        for byte in bytes {
            while read(Self::STATE) & Self::SEND_FULL != 0 {}
            write(Self::DATA, u32::from(*byte));
        }
    }
}

/// The output that represents the interlock: user LED 0 (FPGA I/O block).
pub struct Led(());

/// The output does not have the level to which it was driven.
#[derive(Debug)]
pub struct Stuck;

impl Led {
    const LEDS: usize = 0x4002_8000;
    const LED_0: u32 = 1;

    /// Takes the output. Only one part of the program may do this, because two would set conflicting levels.
    pub fn new() -> Self {
        Self(())
    }

    /// Returns the level, read back from the board.
    pub fn is_high() -> bool {
        read(Self::LEDS) & Self::LED_0 != 0
    }

    /// Drives the output low from any context: for handlers of panics and faults.
    pub fn force_low() {
        write(Self::LEDS, read(Self::LEDS) & !Self::LED_0);
    }
}

impl Error for Stuck {
    fn kind(&self) -> ErrorKind {
        ErrorKind::Other
    }
}

impl ErrorType for Led {
    type Error = Stuck;
}

impl OutputPin for Led {
    fn set_low(&mut self) -> Result<(), Stuck> {
        Self::force_low();
        if Self::is_high() { Err(Stuck) } else { Ok(()) }
    }

    fn set_high(&mut self) -> Result<(), Stuck> {
        write(Self::LEDS, read(Self::LEDS) | Self::LED_0);
        if Self::is_high() { Ok(()) } else { Err(Stuck) }
    }
}

/// The processor's system timer, on the processor's clock; counts down once and sets a flag at zero.
pub struct Timer {
    length: u32,
}

impl Timer {
    const CONTROL: usize = 0xe000_e010;
    const RELOAD: usize = 0xe000_e014;
    const CURRENT: usize = 0xe000_e018;
    const ENABLE_ON_CORE_CLOCK: u32 = 0b101;
    const HAS_REACHED_ZERO: u32 = 1 << 16;

    /// Ticks of the longest interval.
    pub const LONGEST: u32 = 0x00ff_ffff;

    /// Starts a timer of `length` ticks, at most [`Timer::LONGEST`].
    pub fn new(length: u32) -> Self {
        let length = length.min(Self::LONGEST);
        write(Self::RELOAD, length);
        write(Self::CONTROL, Self::ENABLE_ON_CORE_CLOCK);
        let mut timer = Self { length };
        timer.restart();
        timer
    }

    /// Restarts the timer.
    pub fn restart(&mut self) {
        // Writing any value clears the counter and the flag; the next tick loads the counter.
        write(Self::CURRENT, 0);
        while read(Self::CURRENT) == 0 {}
    }

    /// Returns the ticks since [`Timer::restart`]; `None` if the timer has run out. Call it once per interval,
    /// because reading clears the flag.
    pub fn elapsed(&mut self) -> Option<u32> {
        let left = read(Self::CURRENT);
        let over = read(Self::CONTROL) & Self::HAS_REACHED_ZERO != 0;
        (!over).then(|| self.length.wrapping_sub(left))
    }
}

/// The board's first timer (CMSDK APB TIMER0, 25 MHz): an interval of up to 171 s.
pub struct LongTimer(());

impl LongTimer {
    const CONTROL: usize = 0x4000_0000;
    const VALUE: usize = 0x4000_0004;
    const RELOAD: usize = 0x4000_0008;
    const INTERRUPT: usize = 0x4000_000c;
    const ENABLE: u32 = 1 << 0;
    const INTERRUPT_ENABLE: u32 = 1 << 3;

    /// Starts the timer. No interrupt is enabled: its interrupt flag records that the timer has run out.
    pub fn new() -> Self {
        let mut timer = Self(());
        timer.restart();
        timer
    }

    /// Restarts the timer.
    pub fn restart(&mut self) {
        write(Self::CONTROL, 0);
        write(Self::INTERRUPT, 1);
        write(Self::RELOAD, u32::MAX);
        write(Self::VALUE, u32::MAX);
        write(Self::CONTROL, Self::ENABLE | Self::INTERRUPT_ENABLE);
    }

    /// Returns the ticks since [`LongTimer::restart`]; `None` if the timer has run out.
    pub fn elapsed(&mut self) -> Option<u32> {
        let left = read(Self::VALUE);
        (read(Self::INTERRUPT) & 1 == 0).then(|| u32::MAX.wrapping_sub(left))
    }
}
