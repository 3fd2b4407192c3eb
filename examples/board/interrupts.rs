//! The additional parts of the board that an interrupt-driven controller uses: the serial line's and the
//! system timer's interrupts, a clock of milliseconds, the LEDs as pins, the watchdog.

use super::{Led, Stuck, TICKS_PER_SECOND, Uart, read, write};
use core::convert::Infallible;
use cortex_m::interrupt::InterruptNumber;
use cortex_m::peripheral::scb::SystemHandler;
use cortex_m::peripheral::syst::SystClkSource;
use cortex_m::peripheral::{NVIC, Peripherals};
use embedded_hal::digital::{ErrorType, InputPin, OutputPin};

/// The interrupts of the first serial line, by their numbers (AN386, and QEMU's `hw/arm/mps2.c`).
#[derive(Clone, Copy)]
#[repr(u16)]
pub enum Interrupt {
    /// A byte has been received.
    Receive = 0,
    /// A byte has been sent.
    Send = 1,
}

// SAFETY: these interrupt numbers exist on the processor.
unsafe impl InterruptNumber for Interrupt {
    fn number(self) -> u16 {
        self as u16
    }
}

impl Interrupt {
    /// Returns the interrupt from the number that the default handler receives.
    pub const fn of(number: i16) -> Option<Self> {
        match number {
            0 => Some(Self::Receive),
            1 => Some(Self::Send),
            _ => None,
        }
    }
}

/// The processor implements the upper bits of a priority; a smaller number has a higher priority.
const FIRST: u8 = 0x00;
const SECOND: u8 = 0x40;
const LAST: u8 = 0x80;

/// Starts the serial line's interrupts and the system timer's, `per_second` times a second. The line has
/// a higher priority than the timer, because it buffers only one byte: 87 us at 115,200 bits a second,
/// less than a control cycle. `None` if they were already started.
pub fn start(per_second: u32) -> Option<()> {
    let mut core = Peripherals::take()?;
    Uart::start_interrupts();
    core.SYST.set_clock_source(SystClkSource::Core);
    core.SYST.set_reload(TICKS_PER_SECOND / per_second - 1);
    core.SYST.clear_current();
    // SAFETY: no critical section of this program uses priorities.
    unsafe {
        core.NVIC.set_priority(Interrupt::Receive, FIRST);
        core.NVIC.set_priority(Interrupt::Send, SECOND);
        core.SCB.set_priority(SystemHandler::SysTick, LAST);
    }
    core.SYST.enable_interrupt();
    core.SYST.enable_counter();
    // SAFETY: likewise; data that the handlers share is in mutexes.
    unsafe {
        NVIC::unmask(Interrupt::Receive);
        NVIC::unmask(Interrupt::Send);
    }
    Some(())
}

impl Uart {
    const INTERRUPTS: usize = 0x4000_400c;
    const SENT: u32 = 1 << 0;
    const RECEIVED: u32 = 1 << 1;
    const OVERRUN: u32 = 1 << 3;

    fn start_interrupts() {
        let mut uart = Self::new();
        while uart.receive().is_some() {}
        write(Self::CONTROL, 0b1111);
    }

    /// In the receive interrupt: returns the byte, and whether an earlier byte was lost.
    pub fn received() -> (Option<u8>, bool) {
        // Cleared first: a byte that arrives after this raises it again.
        write(Self::INTERRUPTS, Self::RECEIVED);
        let state = read(Self::STATE);
        if state & Self::OVERRUN != 0 {
            write(Self::STATE, Self::OVERRUN);
        }
        let byte = (state & Self::RECEIVE_FULL != 0).then(|| read(Self::DATA) as u8);
        (byte, state & Self::OVERRUN != 0)
    }

    /// In the send interrupt, or one that was pended by software: sends the next byte, if there is one
    /// and the line accepts it. The interrupt is raised again when that byte has been sent.
    pub fn sent(next: impl FnOnce() -> Option<u8>) {
        write(Self::INTERRUPTS, Self::SENT);
        if read(Self::STATE) & Self::SEND_FULL == 0
            && let Some(byte) = next()
        {
            write(Self::DATA, u32::from(byte));
        }
    }
}

/// A clock of milliseconds in hardware (FPGA I/O block), independent of the program.
pub struct Clock;

impl Clock {
    const COUNTER: usize = 0x4002_8018;
    const PRESCALE: usize = 0x4002_801c;

    /// Starts the clock at a time.
    pub fn start(at_ms: u32) {
        write(Self::PRESCALE, TICKS_PER_SECOND / 1000 - 1);
        write(Self::COUNTER, at_ms);
    }

    /// Returns the time, wrapping.
    pub fn now_ms() -> u32 {
        read(Self::COUNTER)
    }
}

/// The level of the interlock's LED, as an input. In a product this is the relay's second contact.
pub struct Contact;

impl ErrorType for Contact {
    type Error = Infallible;
}

impl InputPin for Contact {
    fn is_high(&mut self) -> Result<bool, Infallible> {
        Ok(Led::is_high())
    }

    fn is_low(&mut self) -> Result<bool, Infallible> {
        Ok(!Led::is_high())
    }
}

/// User LED 1, for the heartbeat.
pub struct Heartbeat;

impl Heartbeat {
    const LED_1: u32 = 2;
}

impl ErrorType for Heartbeat {
    type Error = Stuck;
}

impl OutputPin for Heartbeat {
    fn set_low(&mut self) -> Result<(), Stuck> {
        write(Led::LEDS, read(Led::LEDS) & !Self::LED_1);
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Stuck> {
        write(Led::LEDS, read(Led::LEDS) | Self::LED_1);
        Ok(())
    }
}

/// The board's watchdog (CMSDK APB): raises the non-maskable interrupt if it is not fed in time.
pub struct Watchdog(u32);

impl Watchdog {
    const LOAD: usize = 0x4000_8000;
    const CONTROL: usize = 0x4000_8008;
    const CLEAR: usize = 0x4000_800c;
    const LOCK: usize = 0x4000_8c00;
    const KEY: u32 = 0x1acc_e551;
    const INTERRUPT: u32 = 1;

    /// Starts a watchdog with a period of `within_ms`.
    pub fn start(within_ms: u32) -> Self {
        let watchdog = Self(TICKS_PER_SECOND / 1000 * within_ms);
        watchdog.feed();
        write(Self::LOCK, Self::KEY);
        write(Self::CONTROL, Self::INTERRUPT);
        write(Self::LOCK, 0);
        watchdog
    }

    /// Acknowledges the watchdog's interrupt and restarts the period.
    pub fn acknowledge() {
        write(Self::LOCK, Self::KEY);
        write(Self::CLEAR, 1);
        write(Self::LOCK, 0);
    }

    /// Restarts the period.
    pub fn feed(&self) {
        write(Self::LOCK, Self::KEY);
        write(Self::LOAD, self.0);
        write(Self::LOCK, 0);
    }
}
