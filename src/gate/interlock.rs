//! The interlock: an output that is high only while the gate permits.

use super::Permission;
use super::settings::{InvalidParameter, is_time};
use core::convert::Infallible;
use embedded_hal::digital::{ErrorType, InputPin, OutputPin};

/// An output pin that is high only while a gate permits. It is low when it is made, after every denial,
/// after every error, and when it is dropped.
///
/// [`Interlock::with_read_back`] adds an input that reads the contact, which must follow the output within a
/// time limit. [`Interlock::with_heartbeat`] adds a second output for an external watchdog. It toggles while
/// [`Interlock::apply`] is called and no fault is latched. A fault is latched until [`Interlock::reset`]:
/// the output stays low and the heartbeat stops. Call [`Interlock::apply`] in every control cycle. In a
/// cycle without a report, pass the permission from [`super::Gate::tick`].
#[derive(Debug)]
pub struct Interlock<P: OutputPin, R: InputPin = NoPin, H: OutputPin = NoPin> {
    output: LowOnDrop<P>,
    high: bool,
    read_back: Option<ReadBack<R>>,
    heartbeat: Option<Heartbeat<H>>,
    last_ms: Option<u32>,
    fault: Option<InterlockFault>,
}

#[cfg(feature = "defmt")]
impl<P: OutputPin, R: InputPin, H: OutputPin> defmt::Format for Interlock<P, R, H> {
    /// Writes the driven level and the fault. Pins have no format.
    fn format(&self, f: defmt::Formatter<'_>) {
        defmt::write!(
            f,
            "Interlock {{ high: {=bool}, fault: {} }}",
            self.high,
            self.fault
        );
    }
}

/// The fault that keeps an interlock low.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum InterlockFault {
    /// The output pin reported an error.
    Output,
    /// The read-back pin reported an error.
    Input,
    /// The read-back did not follow the output in time: a contact is welded or broken, or a pin is stuck.
    NotFollowing,
    /// The heartbeat's pin reported an error.
    Heartbeat,
    /// A permit of another cycle was applied: it was stored, or the clock was read again after the step.
    OldPermission,
}

messages!(InterlockFault {
    Output => "the output pin reported an error",
    Input => "the read-back pin reported an error",
    NotFollowing => "the read-back did not follow the output in time: a contact is welded or broken, or a pin is stuck",
    Heartbeat => "the heartbeat's pin reported an error",
    OldPermission => "a permission of another cycle was applied: it was stored, or the clock was read again after the step",
});

/// The placeholder for a pin that is not connected.
#[derive(Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct NoPin;

impl ErrorType for NoPin {
    type Error = Infallible;
}

impl OutputPin for NoPin {
    fn set_low(&mut self) -> Result<(), Infallible> {
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}

impl InputPin for NoPin {
    fn is_high(&mut self) -> Result<bool, Infallible> {
        Ok(false)
    }

    fn is_low(&mut self) -> Result<bool, Infallible> {
        Ok(true)
    }
}

#[derive(Debug)]
struct ReadBack<R> {
    input: R,
    within_ms: u32,
    /// How much longer the contact may be low while the output is high, in milliseconds.
    left_open_ms: u32,
    /// How much longer the contact may be high while the output is low, in milliseconds. Restored only when
    /// the contact is read low while the output is low: a welded contact agrees with an output that goes
    /// high again.
    left_closed_ms: u32,
}

#[derive(Debug)]
struct Heartbeat<H> {
    output: H,
    period_ms: u32,
    left_ms: u32,
    high: bool,
}

/// A pin that goes low when it is dropped.
#[derive(Debug)]
struct LowOnDrop<P: OutputPin>(P);

impl<P: OutputPin> Drop for LowOnDrop<P> {
    fn drop(&mut self) {
        let _ = self.0.set_low();
    }
}

impl<P: OutputPin> Interlock<P> {
    /// Takes the pin and drives it low.
    ///
    /// # Errors
    /// The pin's own error. The pin is dropped.
    pub fn new(mut output: P) -> Result<Self, P::Error> {
        output.set_low()?;
        Ok(Self {
            output: LowOnDrop(output),
            high: false,
            read_back: None,
            heartbeat: None,
            last_ms: None,
            fault: None,
        })
    }
}

impl<P: OutputPin, R: InputPin, H: OutputPin> Interlock<P, R, H> {
    /// Adds an input that is high when the contact is closed. The input must follow the output within
    /// `within_ms` (from 1 to 2^31 - 1). For a contact that stays closed, all times with a low output are
    /// added up, however short each is.
    ///
    /// # Errors
    /// [`InvalidParameter::InterlockTime`] if `within_ms` is out of range.
    pub fn with_read_back<R2: InputPin>(
        self,
        input: R2,
        within_ms: u32,
    ) -> Result<Interlock<P, R2, H>, InvalidParameter> {
        if !is_time(within_ms) {
            return Err(InvalidParameter::InterlockTime);
        }
        Ok(Interlock {
            output: self.output,
            high: self.high,
            read_back: Some(ReadBack {
                input,
                within_ms,
                left_open_ms: within_ms,
                left_closed_ms: within_ms,
            }),
            heartbeat: self.heartbeat,
            last_ms: self.last_ms,
            fault: self.fault,
        })
    }

    /// Adds an output that toggles every `period_ms` (from 1 to 2^31 - 1), in the first [`Interlock::apply`] that is due; or in
    /// every one if the calls are farther apart. A beat comes up to one call late, and the next one that much earlier.
    ///
    /// # Errors
    /// [`InvalidParameter::InterlockTime`] if `period_ms` is out of range.
    pub fn with_heartbeat<H2: OutputPin>(
        self,
        output: H2,
        period_ms: u32,
    ) -> Result<Interlock<P, R, H2>, InvalidParameter> {
        if !is_time(period_ms) {
            return Err(InvalidParameter::InterlockTime);
        }
        Ok(Interlock {
            output: self.output,
            high: self.high,
            read_back: self.read_back,
            heartbeat: Some(Heartbeat {
                output,
                period_ms,
                left_ms: period_ms,
                high: false,
            }),
            last_ms: self.last_ms,
            fault: self.fault,
        })
    }

    /// Drives the output as the permission says, checks the read-back and toggles the heartbeat. `now_ms` is
    /// the time on a wrapping clock that the step of this cycle was given; a permit of another time is
    /// refused. A clock that goes backwards counts as a time of at least 2^31 ms, which is above every
    /// limit.
    ///
    /// # Errors
    /// The fault, now and in every call until [`Interlock::reset`]. The output is low. Pass
    /// [`super::Reason::InterlockFault`] to [`super::Gate::fault`].
    pub fn apply(&mut self, now_ms: u32, permission: &Permission) -> Result<(), InterlockFault> {
        let passed = self.last_ms.map_or(0, |last| now_ms.wrapping_sub(last));
        self.last_ms = Some(now_ms);
        let done = match self.fault {
            Some(fault) => Err(fault),
            None => self
                .follow(passed)
                .and_then(|()| self.drive(now_ms, permission))
                .and_then(|()| self.beat(passed)),
        };
        if let Err(fault) = done {
            self.fault = Some(fault);
            self.high = false;
            // Repeated in every cycle: the pin may accept it later.
            let _ = self.output.0.set_low();
        }
        done
    }

    /// Drives the output low, independently of the gate.
    ///
    /// # Errors
    /// [`InterlockFault::Output`] if the pin reports an error; it is then latched, unless another fault is.
    pub fn close(&mut self) -> Result<(), InterlockFault> {
        let now_ms = self.last_ms.unwrap_or_default();
        self.drive(now_ms, &Permission::DENIED)
            .inspect_err(|fault| {
                // The first fault is the cause.
                self.fault = self.fault.or(Some(*fault));
            })
    }

    /// Returns the latched fault.
    #[must_use]
    pub const fn fault(&self) -> Option<InterlockFault> {
        self.fault
    }

    /// Clears a latched fault. Like [`super::Gate::reset`], this is a manual action. The output stays low
    /// until the next permit.
    pub fn reset(&mut self) {
        self.fault = None;
        self.last_ms = None;
        if let Some(read_back) = &mut self.read_back {
            read_back.left_open_ms = read_back.within_ms;
            read_back.left_closed_ms = read_back.within_ms;
        }
    }

    /// Returns the output pin, to read its level.
    pub const fn output(&self) -> &P {
        &self.output.0
    }

    /// Checks that the contact has followed the level to which the output was last driven.
    fn follow(&mut self, passed: u32) -> Result<(), InterlockFault> {
        let Some(read_back) = &mut self.read_back else {
            return Ok(());
        };
        let high = read_back
            .input
            .is_high()
            .map_err(|_| InterlockFault::Input)?;
        if high == self.high {
            read_back.left_open_ms = read_back.within_ms;
            if !high {
                read_back.left_closed_ms = read_back.within_ms;
            }
            return Ok(());
        }
        let left = if high {
            &mut read_back.left_closed_ms
        } else {
            &mut read_back.left_open_ms
        };
        *left = left
            .checked_sub(passed)
            .ok_or(InterlockFault::NotFollowing)?;
        Ok(())
    }

    fn drive(&mut self, now_ms: u32, permission: &Permission) -> Result<(), InterlockFault> {
        let mut driven = Ok(());
        self.high = permission.opens_at(now_ms);
        if self.high {
            driven = self.output.0.set_high();
        }
        // Not `else`: the permission is read once more, so that a jump into the wrong branch is undone.
        if !permission.opens_at(now_ms) {
            self.high = false;
            driven = self.output.0.set_low();
        }
        driven.map_err(|_| InterlockFault::Output)?;
        if permission.is_permit() && !self.high {
            return Err(InterlockFault::OldPermission);
        }
        Ok(())
    }

    fn beat(&mut self, passed: u32) -> Result<(), InterlockFault> {
        let Some(heartbeat) = &mut self.heartbeat else {
            return Ok(());
        };
        match heartbeat.left_ms.checked_sub(passed) {
            Some(left @ 1..) => {
                heartbeat.left_ms = left;
                return Ok(());
            }
            // The delay of this beat shortens the time until the next one, so that beats keep their rate.
            _ => {
                let late = passed.wrapping_sub(heartbeat.left_ms);
                heartbeat.left_ms = heartbeat.period_ms.saturating_sub(late).max(1);
            }
        }
        heartbeat.high = !heartbeat.high;
        let beaten = if heartbeat.high {
            heartbeat.output.set_high()
        } else {
            heartbeat.output.set_low()
        };
        beaten.map_err(|_| InterlockFault::Heartbeat)
    }
}

#[cfg(test)]
mod tests;
