//! What a controller that runs by interrupts uses of the board besides: the serial line's and the
//! system timer's interrupts, a clock of milliseconds, the lamps as pins, the watchdog.

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
    /// A byte has come.
    Receive = 0,
    /// A byte has gone.
    Send = 1,
}

// SAFETY: numbers of interrupts that the processor has.
unsafe impl InterruptNumber for Interrupt {
    fn number(self) -> u16 {
        self as u16
    }
}

impl Interrupt {
    /// The interrupt that the default handler is told of.
    pub const fn of(number: i16) -> Option<Self> {
        match number {
            0 => Some(Self::Receive),
            1 => Some(Self::Send),
            _ => None,
        }
    }
}

/// Bits of a priority that the processor has are the upper ones; a smaller number goes first.
const FIRST: u8 = 0x00;
const SECOND: u8 = 0x40;
const LAST: u8 = 0x80;

/// Starts the serial line's interrupts and the system timer's, `per_second` times a second. The line goes
/// before the timer, since it keeps one byte: 87 us at 115,200 bits a second, less than a control cycle.
/// `None` where that was done before.
pub fn start(per_second: u32) -> Option<()> {
    let mut core = Peripherals::take()?;
    Uart::start_interrupts();
    core.SYST.set_clock_source(SystClkSource::Core);
    core.SYST.set_reload(TICKS_PER_SECOND / per_second - 1);
    core.SYST.clear_current();
    // SAFETY: no critical section of this program is made by priorities.
    unsafe {
        core.NVIC.set_priority(Interrupt::Receive, FIRST);
        core.NVIC.set_priority(Interrupt::Send, SECOND);
        core.SCB.set_priority(SystemHandler::SysTick, LAST);
    }
    core.SYST.enable_interrupt();
    core.SYST.enable_counter();
    // SAFETY: likewise; what the handlers share is behind mutexes.
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

    /// In the interrupt of a byte that has come: the byte, and whether one before it was lost.
    pub fn received() -> (Option<u8>, bool) {
        // Cleared first: a byte that comes from here on raises it again.
        write(Self::INTERRUPTS, Self::RECEIVED);
        let state = read(Self::STATE);
        if state & Self::OVERRUN != 0 {
            write(Self::STATE, Self::OVERRUN);
        }
        let byte = (state & Self::RECEIVE_FULL != 0).then(|| read(Self::DATA) as u8);
        (byte, state & Self::OVERRUN != 0)
    }

    /// In the interrupt of a byte that has gone, or one that was pended by hand: sends the next one, if
    /// there is one and the line takes it. When it has gone, the interrupt comes again.
    pub fn sent(next: impl FnOnce() -> Option<u8>) {
        write(Self::INTERRUPTS, Self::SENT);
        if read(Self::STATE) & Self::SEND_FULL == 0
            && let Some(byte) = next()
        {
            write(Self::DATA, u32::from(byte));
        }
    }
}

/// A clock of milliseconds that runs by itself (FPGA I/O block), whatever the program does.
pub struct Clock;

impl Clock {
    const COUNTER: usize = 0x4002_8018;
    const PRESCALE: usize = 0x4002_801c;

    /// Starts it at a time.
    pub fn start(at_ms: u32) {
        write(Self::PRESCALE, TICKS_PER_SECOND / 1000 - 1);
        write(Self::COUNTER, at_ms);
    }

    /// The time, wrapping.
    pub fn now_ms() -> u32 {
        read(Self::COUNTER)
    }
}

/// The level of the interlock's lamp, as an input: what a product wires to the relay's second contact.
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

/// The board's watchdog (CMSDK APB): when it is not fed in time, the interrupt that cannot be masked.
pub struct Watchdog(u32);

impl Watchdog {
    const LOAD: usize = 0x4000_8000;
    const CONTROL: usize = 0x4000_8008;
    const CLEAR: usize = 0x4000_800c;
    const LOCK: usize = 0x4000_8c00;
    const KEY: u32 = 0x1acc_e551;
    const INTERRUPT: u32 = 1;

    /// A watchdog that waits so long, started.
    pub fn start(within_ms: u32) -> Self {
        let watchdog = Self(TICKS_PER_SECOND / 1000 * within_ms);
        watchdog.feed();
        write(Self::LOCK, Self::KEY);
        write(Self::CONTROL, Self::INTERRUPT);
        write(Self::LOCK, 0);
        watchdog
    }

    /// In its interrupt: waits again.
    pub fn acknowledge() {
        write(Self::LOCK, Self::KEY);
        write(Self::CLEAR, 1);
        write(Self::LOCK, 0);
    }

    /// Begins the wait anew.
    pub fn feed(&self) {
        write(Self::LOCK, Self::KEY);
        write(Self::LOAD, self.0);
        write(Self::LOCK, 0);
    }
}
