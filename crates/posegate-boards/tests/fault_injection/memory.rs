//! Every bit of a gate's memory, flipped between two steps.
//!
//! The machine is at the beginning of a cycle, and its memory and registers are saved. For each bit of the
//! gate, the bit is flipped, the next cycles run, and everything is restored. Bytes are set to four values
//! in the same way.

use crate::firmware::Firmware;
use crate::golden::{Golden, Sample};
use crate::machine::{At, Lamps, Machine};
use crate::remote::{EmulatorEnded, SP};
use posegate::gate::Reason;

/// Cycles that are observed after a fault if reports arrive: a new permit is possible within them.
const CYCLES: u32 = 3;
/// Cycles that are observed without reports: longer than the hold time of a permit and the age of its estimate.
const SILENT_CYCLES: u32 = 6;

/// A moment at which the gate's memory is damaged.
pub struct Situation {
    pub name: &'static str,
    /// The cycle that is about to begin.
    pub cycle: u32,
    /// Number of observed cycles, and the first cycle from which on the output must be low.
    cycles: u32,
    low_from: u32,
    /// `true` if a fault is latched before the damage.
    pub latched: bool,
}

impl Situation {
    const fn is_silent(&self) -> bool {
        self.cycles == SILENT_CYCLES
    }
}

/// The results of all faults in a situation.
#[derive(Default)]
pub struct Counts {
    pub bits: u64,
    pub bytes: u64,
    pub wrong_permits: u64,
    /// The program ended in its fault handler, in a loop or locked up, with the output low.
    pub ended: u64,
    /// The program looped or the processor locked up with the output high, and the heartbeat has stopped: an
    /// external watchdog opens.
    pub stopped_open: u64,
}

/// The damage to a gate's memory.
#[derive(Clone, Copy)]
enum Damage {
    Bit(usize),
    Byte(usize, u8),
}

/// A machine between two steps, and everything that a step can change.
struct Rest<'f> {
    firmware: &'f Firmware,
    machine: Machine,
    gate: u32,
    length: u32,
    variables: Vec<u8>,
    stack: Vec<u8>,
    stack_pointer: u32,
    registers: String,
    lamps: Lamps,
    /// The cycle before which the machine stops again.
    end: u32,
}

/// Levels of the output in the next cycles; fewer if the program or the schedule ended.
type Levels = Vec<bool>;

/// The end of the program within the cycles, and its output.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum End {
    None,
    Low,
    HighWithoutHeartbeat,
    High,
}

impl<'f> Rest<'f> {
    fn of(firmware: &'f Firmware, situation: &Situation) -> Result<Self, EmulatorEnded> {
        let mut machine = Machine::start(firmware, &[]);
        let before = situation.cycle - u32::from(situation.latched);
        machine.run_to(firmware, before)?;
        let [_, gate, length, ..] = machine.registers;
        if situation.latched {
            // A flipped bit in the state: the gate latches the fault.
            let bytes = machine.remote.read_long(gate, length)?;
            machine.remote.flip(gate + open_state(&bytes), 0)?;
            machine.run_to(firmware, situation.cycle)?;
        }
        let stack_pointer = machine.remote.register(SP)?;
        let (from, to) = firmware.variables;
        Ok(Self {
            firmware,
            gate,
            length,
            variables: machine.remote.read_long(from, to - from)?,
            stack: machine
                .remote
                .read_long(stack_pointer, firmware.stack_top - stack_pointer)?,
            stack_pointer,
            registers: machine.remote.all_registers()?,
            lamps: machine.lamps()?,
            end: situation.cycle + situation.cycles,
            machine,
        })
    }

    fn put_back(&mut self) -> Result<(), EmulatorEnded> {
        if self.machine.lamps()? != self.lamps {
            self.machine.set_lamps(self.lamps, self.firmware.store)?;
        }
        let remote = &mut self.machine.remote;
        remote.write_long(self.firmware.variables.0, &self.variables)?;
        remote.write_long(self.stack_pointer, &self.stack)?;
        remote.set_all_registers(&self.registers)
    }

    fn damage(&mut self, damage: Damage) -> Result<(), EmulatorEnded> {
        let gate = self.gate;
        match damage {
            Damage::Bit(bit) => self
                .machine
                .remote
                .flip(gate + bit as u32 / 8, (bit % 8) as u8),
            Damage::Byte(at, value) => self.machine.remote.write(gate + at as u32, &[value]),
        }
    }

    /// Returns the output in the next cycles, and why there are fewer.
    fn levels(&mut self) -> Result<(Levels, End), EmulatorEnded> {
        self.machine.discard_events();
        self.machine.stop_at(self.end)?;
        let at = self.machine.run();
        let samples = Sample::all(self.lamps, &self.machine.events());
        let levels = samples.iter().map(|sample| sample.high).collect();
        let ends = [self.firmware.stop, self.firmware.over].map(At::Address);
        let end = if ends.contains(&at) {
            End::None
        } else if !self.machine.lamps()?.interlock() {
            End::Low
        } else if at == At::Hung && !self.machine.beats(self.firmware) {
            End::HighWithoutHeartbeat
        } else {
            End::High
        };
        Ok((levels, end))
    }
}

/// Returns the offset of an open gate's state: a word with the mark of a permit, next to its complement.
fn open_state(bytes: &[u8]) -> u32 {
    let words: Vec<u32> = bytes
        .chunks_exact(4)
        .map(|word| u32::from_le_bytes(word.try_into().expect("four bytes")))
        .collect();
    let is_state = |pair: &[u32]| pair[0] >> 16 == 0xa53c && pair[0] ^ pair[1] == u32::MAX;
    let at = words.windows(2).position(is_state);
    4 * at.expect("the state of an open gate") as u32
}

/// Returns the situations of a firmware's schedule.
pub fn situations(golden: &Golden) -> Vec<Situation> {
    let code = |reason: Reason| u32::from(reason.code());
    let (inside, outside) = (0, code(Reason::NotContained));
    let find = |name, before: (bool, Option<u32>), reason: u32| {
        let found = golden.samples.windows(2).find(|pair| {
            let is_before =
                pair[0].high == before.0 && before.1.is_none_or(|r| r == pair[0].reason);
            is_before && pair[1].reason == reason && !pair[1].high
        });
        let found = found.unwrap_or_else(|| panic!("the schedule has no {name}"));
        Situation {
            name,
            cycle: found[1].number,
            cycles: CYCLES,
            low_from: 0,
            latched: false,
        }
    };
    let silent = |name, cycle, low_from| Situation {
        name,
        cycle,
        cycles: SILENT_CYCLES,
        low_from,
        latched: false,
    };
    let quiet = code(Reason::Silent);
    let ended = golden
        .samples
        .windows(2)
        .find(|pair| pair[0].high && pair[1].reason == quiet);
    let ended = ended.expect("a permit that silence ends")[1].number;
    // One report arrives in the silence.
    let short = golden.samples.windows(3).find(|three| {
        three.iter().all(|sample| !sample.high)
            && three[0].reason == quiet
            && three[1].reason == inside
            && three[2].reason == code(Reason::Qualifying)
    });
    let short = short.expect("a permit that is not earned in time")[2].number;
    let denied = Some(code(Reason::OutsideTable));
    let open = golden
        .samples
        .windows(3)
        .find(|three| three.iter().all(|sample| sample.high));
    vec![
        find("open, a denial coming", (true, None), outside),
        find("inhibited, a denial coming", (false, denied), outside),
        find(
            "one permit short, a denial coming",
            (false, Some(inside)),
            outside,
        ),
        find(
            "open, a gap coming",
            (true, None),
            code(Reason::SequenceGap),
        ),
        find(
            "open, a stale report coming",
            (true, None),
            code(Reason::Stale),
        ),
        find(
            "inhibited, the first permit coming",
            (false, denied),
            inside,
        ),
        Situation {
            name: "latched, a permit coming",
            cycle: open.expect("three open cycles")[2].number,
            cycles: CYCLES,
            low_from: 0,
            latched: true,
        },
        silent("open, silence coming", ended - 1, 1),
        silent("open in silence, its end coming", ended, 0),
        silent("silent, silence coming", ended + 1, 0),
        silent("one permit short, silence coming", short, 0),
    ]
}

/// Flips every bit of the gate, and sets every byte to four values.
pub fn every_bit(firmware: &Firmware, situation: &Situation) -> Counts {
    const GONE: &str = "QEMU has ended without a fault";
    let start = || Rest::of(firmware, situation).unwrap_or_else(|EmulatorEnded| panic!("{GONE}"));
    let mut rest = start();
    let (expected, end) = rest
        .levels()
        .unwrap_or_else(|EmulatorEnded| panic!("{GONE}"));
    assert_eq!(end, End::None, "{}: ends without a fault", situation.name);
    // Without a fault the levels are low from some cycle on; otherwise no permit could be wrong.
    let low_from = situation.low_from as usize;
    assert_eq!(
        expected.len(),
        situation.cycles as usize,
        "{}",
        situation.name
    );
    assert!(
        !expected[low_from] && expected[..low_from].iter().all(|high| *high),
        "{}: {expected:?}",
        situation.name
    );
    assert!(!situation.is_silent() || expected[low_from..].iter().all(|high| !high));
    let mut counts = Counts::default();
    let bits = rest.length as usize * 8;
    let mut damages: Vec<Damage> = (0..bits).map(Damage::Bit).collect();
    for at in 0..rest.length as usize {
        let there = rest.stack[(rest.gate - rest.stack_pointer) as usize + at];
        damages.extend([0, 0xff, 0xa5, !there].map(|value| Damage::Byte(at, value)));
    }
    for (number, damage) in damages.into_iter().enumerate() {
        match damage {
            Damage::Bit(_) => counts.bits += 1,
            Damage::Byte(..) => counts.bytes += 1,
        }
        let mut attempt = || {
            rest.put_back()?;
            rest.damage(damage)?;
            rest.levels()
        };
        let (levels, end) = attempt().unwrap_or_else(|EmulatorEnded| {
            // A processor that has locked up keeps its output, without a heartbeat.
            let high = rest.machine.last_lamps().interlock();
            let end = if high {
                End::HighWithoutHeartbeat
            } else {
                End::Low
            };
            (Levels::new(), end)
        });
        let wrong = levels.iter().zip(&expected).any(|(l, e)| *l && !*e);
        if wrong || end == End::High {
            counts.wrong_permits += 1;
            eprintln!("{}: damage {number}: {levels:?}, {end:?}", situation.name);
        } else if end == End::Low {
            counts.ended += 1;
        } else if end == End::HighWithoutHeartbeat {
            counts.stopped_open += 1;
            eprintln!("{}: damage {number}: {levels:?}, {end:?}", situation.name);
        }
        if end != End::None {
            // The processor may be in a handler, which the debugger cannot leave.
            rest = start();
        }
    }
    rest.put_back()
        .unwrap_or_else(|EmulatorEnded| panic!("{GONE}"));
    let again = rest
        .levels()
        .unwrap_or_else(|EmulatorEnded| panic!("{GONE}"));
    assert_eq!(again, (expected, End::None), "not all is put back");
    counts
}
