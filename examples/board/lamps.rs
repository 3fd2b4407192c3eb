//! The LEDs for an interlock with read-back and heartbeat: user LED 0 is the output, its level is the
//! contact's, user LED 1 is the heartbeat.

use super::{Led, read, write};
use core::convert::Infallible;
use embedded_hal::digital::{ErrorType, InputPin, OutputPin};

/// The level of the output, as a separate input.
pub struct ReadBack;

/// User LED 1, for an external watchdog.
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
