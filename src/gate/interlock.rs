//! The interlock: an output pin that is high only while the gate permits.

use super::Verdict;
use embedded_hal::digital::OutputPin;

/// An output that is high only after a permit. Low when it is made, after every denial, after every
/// pin error, and when it is dropped.
#[derive(Debug)]
pub struct Interlock<P: OutputPin> {
    pin: P,
}

impl<P: OutputPin> Interlock<P> {
    /// Takes the pin and drives it low.
    ///
    /// # Errors
    /// The pin's own error; the pin is then not taken into use.
    pub fn new(mut pin: P) -> Result<Self, P::Error> {
        pin.set_low()?;
        Ok(Self { pin })
    }

    /// Drives the pin by a verdict. The pin then stays as it is until the next call: whoever applies
    /// verdicts also closes the interlock when they stop coming, as `examples/docking_gate.rs` does
    /// with a timer.
    ///
    /// # Errors
    /// The pin's own error, after one more attempt to drive it low.
    pub fn apply(&mut self, verdict: &Verdict) -> Result<(), P::Error> {
        let result = if verdict.is_permit() {
            self.pin.set_high()
        } else {
            self.pin.set_low()
        };
        if result.is_err() {
            // The first error is the one to report; a second says nothing new.
            let _ = self.pin.set_low();
        }
        result
    }

    /// The pin, for reading it back.
    pub const fn pin(&self) -> &P {
        &self.pin
    }

    /// Drives the pin low.
    ///
    /// # Errors
    /// The pin's own error.
    pub fn close(&mut self) -> Result<(), P::Error> {
        self.pin.set_low()
    }
}

impl<P: OutputPin> Drop for Interlock<P> {
    fn drop(&mut self) {
        let _ = self.pin.set_low();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contain::Margin;
    use crate::gate::Reason;
    use core::cell::RefCell;
    use embedded_hal::digital::{Error, ErrorKind, ErrorType};
    use std::vec::Vec;

    #[derive(Debug)]
    struct Stuck;

    impl Error for Stuck {
        fn kind(&self) -> ErrorKind {
            ErrorKind::Other
        }
    }

    /// Records what it is driven to; fails at the calls it is told to.
    struct Pin<'a> {
        driven: &'a RefCell<Vec<bool>>,
        fails_at: Option<usize>,
    }

    impl ErrorType for Pin<'_> {
        type Error = Stuck;
    }

    impl OutputPin for Pin<'_> {
        fn set_low(&mut self) -> Result<(), Stuck> {
            self.drive(false)
        }

        fn set_high(&mut self) -> Result<(), Stuck> {
            self.drive(true)
        }
    }

    impl Pin<'_> {
        fn drive(&self, level: bool) -> Result<(), Stuck> {
            self.driven.borrow_mut().push(level);
            match self.fails_at {
                Some(at) if self.driven.borrow().len() == at => Err(Stuck),
                _ => Ok(()),
            }
        }
    }

    #[test]
    fn low_at_first_on_denial_on_error_and_at_the_end() {
        let driven = RefCell::new(Vec::new());
        let pin = Pin {
            driven: &driven,
            fails_at: Some(4),
        };
        {
            let mut interlock = Interlock::new(pin).unwrap();
            let permit = Verdict::Permit {
                margin: Margin::ONE,
            };
            interlock.apply(&permit).unwrap();
            interlock.apply(&Verdict::deny(Reason::Stale)).unwrap();
            assert!(interlock.apply(&permit).is_err());
            interlock.close().unwrap();
        }
        assert_eq!(
            *driven.borrow(),
            [false, true, false, true, false, false, false]
        );
    }
}
