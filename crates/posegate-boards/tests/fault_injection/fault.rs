//! Faults: one flipped bit of code, of a register or of memory, at a moment of a run.

use crate::firmware::Firmware;
use crate::golden::{Golden, Moment};
use crate::machine::{At, Machine};
use crate::random::Random;
use crate::remote::{EmulatorEnded, SP, XPSR};

/// Where a bit is flipped.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Kind {
    Code,
    Register,
    Memory,
}

impl Kind {
    pub const ALL: [Self; 3] = [Self::Code, Self::Register, Self::Memory];

    pub const fn name(self) -> &'static str {
        match self {
            Self::Code => "code",
            Self::Register => "registers",
            Self::Memory => "RAM",
        }
    }
}

/// One flipped bit.
#[derive(Clone, Copy, Debug)]
pub enum Fault {
    /// A bit of an instruction, when a cycle begins.
    Code { cycle: u32, address: u32, bit: u8 },
    /// A bit of a register.
    Register {
        moment: Moment,
        register: u8,
        bit: u8,
    },
    /// A bit of the memory in use: variables, and the stack from its pointer on. `share` selects the place.
    Memory { moment: Moment, share: u64 },
}

impl Fault {
    /// Returns a fault of a kind, chosen uniformly.
    pub fn choose(kind: Kind, golden: &Golden, random: &mut Random) -> Self {
        let moment = *random.of(&golden.moments);
        match kind {
            Kind::Code => Self::Code {
                cycle: random.below(golden.samples.len() as u64) as u32,
                address: *random.of(&golden.code),
                bit: random.below(8) as u8,
            },
            Kind::Register => {
                let register = random.below(17) as u8;
                Self::Register {
                    moment,
                    register: if register == 16 { XPSR } else { register },
                    bit: random.below(32) as u8,
                }
            }
            Kind::Memory => Self::Memory {
                moment,
                share: random.next(),
            },
        }
    }

    /// Returns the cycle of the fault.
    pub const fn cycle(&self) -> u32 {
        match self {
            Self::Code { cycle, .. } => *cycle,
            Self::Register { moment, .. } | Self::Memory { moment, .. } => moment.cycle,
        }
    }

    /// Flips the bit. The machine must be at the beginning of the cycle.
    pub fn inject(
        &self,
        machine: &mut Machine,
        firmware: &Firmware,
    ) -> Result<String, EmulatorEnded> {
        match *self {
            Self::Code { address, bit, .. } => {
                machine.remote.flip(address, bit)?;
                Ok(format!("{address:#x}.{bit} {}", firmware.function(address)))
            }
            Self::Register {
                moment,
                register,
                bit,
            } => {
                let place = reach(machine, firmware, moment)?;
                let value = machine.remote.register(register)?;
                machine.remote.set_register(register, value ^ 1 << bit)?;
                Ok(format!("r{register}.{bit} at {place}"))
            }
            Self::Memory { moment, share } => {
                let place = reach(machine, firmware, moment)?;
                let stack = machine.remote.register(SP)?;
                let (from, to) = firmware.variables;
                let variables = u64::from(to - from);
                let bytes = variables + u64::from(firmware.stack_top - stack);
                let bit = ((u128::from(share) * u128::from(bytes * 8)) >> 64) as u64;
                let byte = bit / 8;
                let address = if byte < variables {
                    from + byte as u32
                } else {
                    stack + (byte - variables) as u32
                };
                machine.remote.flip(address, (bit % 8) as u8)?;
                Ok(format!(
                    "[top-{:#x}].{} at {place}",
                    firmware.stack_top - address,
                    bit % 8
                ))
            }
        }
    }
}

/// Runs to a moment of a cycle. The machine must be at the beginning of that cycle.
fn reach(
    machine: &mut Machine,
    firmware: &Firmware,
    moment: Moment,
) -> Result<String, EmulatorEnded> {
    machine.remote.set_breakpoint(moment.address)?;
    for hit in 1..=moment.hit {
        let at = machine.run();
        assert_eq!(at, At::Address(moment.address), "{moment:?}, hit {hit}");
        if hit < moment.hit {
            machine.remote.clear_breakpoint(moment.address)?;
            machine.remote.step()?;
            machine.remote.set_breakpoint(moment.address)?;
        }
    }
    machine.remote.clear_breakpoint(moment.address)?;
    Ok(format!(
        "{:#x} {} (hit {})",
        moment.address,
        firmware.function(moment.address),
        moment.hit
    ))
}
