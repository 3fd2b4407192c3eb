//! The lamps as an interlock with read-back and heartbeat sees them: user LED 0 is the output, its level
//! what the contact does, user LED 1 the heartbeat.

use super::{Led, read, write};
use core::convert::Infallible;
use embedded_hal::digital::{ErrorType, InputPin, OutputPin};

/// The level of the output, as an input of its own.
pub struct ReadBack;

/// User LED 1, for a watchdog outside.
pub struct Heartbeat;

const LED_1: u32 = 2;

impl ErrorType for ReadBack {
    type Error = Infallible;
}

impl InputPin for ReadBack {
    fn is_high(&mut self) -> Result<bool, Infallible> {
        Ok(Led::is_high())
    }

    fn is_low(&mut self) -> Result<bool, Infallible> {
        Ok(!Led::is_high())
    }
}

impl ErrorType for Heartbeat {
    type Error = Infallible;
}

impl OutputPin for Heartbeat {
    fn set_low(&mut self) -> Result<(), Infallible> {
        write(Led::LEDS, read(Led::LEDS) & !LED_1);
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        write(Led::LEDS, read(Led::LEDS) | LED_1);
        Ok(())
    }
}
