//! A run with a fault, compared with the run without a fault.

use crate::fault::Fault;
use crate::firmware::Firmware;
use crate::golden::{Golden, Sample};
use crate::machine::{At, Lamps, Machine};
use crate::remote::EmulatorEnded;

/// How a run with a fault ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// With the end of its schedule.
    Over,
    /// In the handler of panics and faults, which closes.
    Halted,
    /// In a loop or asleep, without end.
    Hung,
    /// The processor has locked up.
    LockedUp,
}

/// The effect of a fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Class {
    /// The output was as without the fault, in every cycle.
    NoEffect,
    /// The output was low in a cycle in which it is high without the fault.
    MoreClosed,
    /// The program ended or looped, and the output is low.
    EndedLow,
    /// The program looped or the processor locked up with the output high in a cycle in which it is low
    /// without the fault. The heartbeat has stopped, so an external watchdog opens.
    EndedHighWithoutHeartbeat,
    /// The output was high at the end of a cycle in which it is low without the fault, or forever with a
    /// heartbeat.
    WrongPermit,
}

impl Class {
    pub const ALL: [Self; 5] = [
        Self::NoEffect,
        Self::MoreClosed,
        Self::EndedLow,
        Self::EndedHighWithoutHeartbeat,
        Self::WrongPermit,
    ];

    pub const fn name(self) -> &'static str {
        match self {
            Self::NoEffect => "no effect on the output",
            Self::MoreClosed => "closed",
            Self::EndedLow => "program ended, closed",
            Self::EndedHighWithoutHeartbeat => "program ended, open, heartbeat stopped",
            Self::WrongPermit => "wrong permit",
        }
    }
}

/// A run with a fault.
pub struct Trial {
    pub class: Class,
    pub end: End,
    /// The reason of the first verdict that differs from the run without the fault.
    pub reason: Option<u32>,
    /// The place of the fault, and the first cycle with a wrong output.
    pub fault_place: String,
    pub wrong_in: Option<u32>,
}

/// Runs the firmware with a fault.
pub fn run(firmware: &Firmware, golden: &Golden, fault: &Fault) -> Trial {
    let mut machine = Machine::start(firmware, &[]);
    let mut fault_place = String::new();
    let end = observe(&mut machine, firmware, fault, &mut fault_place).unwrap_or(End::LockedUp);
    classify(&mut machine, firmware, golden, end, fault_place)
}

fn observe(
    machine: &mut Machine,
    firmware: &Firmware,
    fault: &Fault,
    fault_place: &mut String,
) -> Result<End, EmulatorEnded> {
    machine.run_to(firmware, fault.cycle())?;
    *fault_place = fault.inject(machine, firmware)?;
    Ok(match machine.run_to_end(firmware)? {
        At::Address(address) if address == firmware.over => End::Over,
        At::Address(address) if address == firmware.halted => End::Halted,
        // A broken marker stops here, like any loop.
        At::Address(_) | At::Hung => End::Hung,
        At::LockedUp => End::LockedUp,
    })
}

/// Classifies a run that has ended. One that hangs is observed for as long again: an external watchdog lets the output open for as long as
/// the heartbeat changes.
pub fn classify(
    machine: &mut Machine,
    firmware: &Firmware,
    golden: &Golden,
    end: End,
    fault_place: String,
) -> Trial {
    let finished = Sample::all(Lamps::default(), &machine.events()).len();
    let open_at_the_end = match end {
        End::Over => false,
        End::LockedUp => machine.last_lamps().interlock(),
        End::Halted | End::Hung => machine
            .lamps()
            .unwrap_or_else(|EmulatorEnded| machine.last_lamps())
            .interlock(),
    };
    let beats = end == End::Hung && machine.beats(firmware);
    let samples = Sample::all(Lamps::default(), &machine.events());
    // Endless cycles are judged one by one.
    let goes_on = beats && samples.len() > finished;
    let expected = |number: u32| golden.sample(number);
    // A cycle that is not in the schedule has no permit.
    let wrong = |sample: &Sample| sample.high && !expected(sample.number).is_some_and(|g| g.high);
    let wrong_in = samples.iter().find(|s| wrong(s)).map(|s| s.number);
    let closed = samples
        .iter()
        .any(|sample| !sample.high && expected(sample.number).is_some_and(|g| g.high));
    let reason = samples
        .iter()
        .find(|sample| expected(sample.number).is_none_or(|g| g.reason != sample.reason))
        .map(|sample| sample.reason);
    let class = if wrong_in.is_some() {
        Class::WrongPermit
    } else if open_at_the_end && !goes_on {
        if beats {
            Class::WrongPermit
        } else {
            Class::EndedHighWithoutHeartbeat
        }
    } else if end != End::Over {
        Class::EndedLow
    } else if closed {
        Class::MoreClosed
    } else {
        Class::NoEffect
    };
    Trial {
        class,
        end,
        reason,
        fault_place,
        wrong_in,
    }
}
