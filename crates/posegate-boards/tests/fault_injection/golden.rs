//! The run without a fault: the output of each cycle, and the executed instructions.

use crate::firmware::Firmware;
use crate::machine::{At, Event, Lamps, Machine};
use std::collections::{BTreeSet, HashMap};

/// The observation at the end of a cycle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sample {
    /// The number with which the cycle began.
    pub number: u32,
    /// The interlock's output.
    pub high: bool,
    /// The verdict's reason; 0 for a permit.
    pub reason: u32,
}

/// A moment of a run: before an execution of an instruction in a cycle's step, with its count in that step.
#[derive(Clone, Copy, Debug)]
pub struct Moment {
    pub cycle: u32,
    pub address: u32,
    pub hit: u32,
}

pub struct Golden {
    pub samples: Vec<Sample>,
    /// Instructions of the steps, in the order in which they are executed.
    pub moments: Vec<Moment>,
    /// Addresses of code bytes that are executed after the start.
    pub code: Vec<u32>,
}

impl Golden {
    /// Runs the firmware twice: with markers, and with every instruction logged.
    pub fn of(firmware: &Firmware) -> Self {
        let samples = samples(firmware);
        let again = self::samples(firmware);
        assert_eq!(samples, again, "two runs without a fault differ");
        let (moments, code) = trace(firmware, &samples);
        Self {
            samples,
            moments,
            code,
        }
    }

    pub fn sample(&self, number: u32) -> Option<&Sample> {
        self.samples.get(number as usize)
    }
}

fn samples(firmware: &Firmware) -> Vec<Sample> {
    let mut machine = Machine::start(firmware, &[]);
    let at = machine.run();
    assert_eq!(at, At::Address(firmware.over), "{}", firmware.name);
    let samples = Sample::all(Lamps::default(), &machine.events());
    let numbers = samples.iter().map(|sample| sample.number);
    assert!(samples.len() > 1 && numbers.eq(0..samples.len() as u32));
    samples
}

impl Sample {
    /// Returns the finished cycles, by the numbers with which they began.
    pub fn all(mut lamps: Lamps, events: &[Event]) -> Vec<Self> {
        let mut begun = None;
        let mut samples = Vec::new();
        for event in events {
            match *event {
                Event::Lamps(now) => lamps = now,
                Event::Begins(number) => begun = Some(number),
                Event::Done { number, reason } => samples.push(Self {
                    number: begun.take().unwrap_or(number),
                    high: lamps.interlock(),
                    reason,
                }),
            }
        }
        samples
    }
}

fn trace(firmware: &Firmware, samples: &[Sample]) -> (Vec<Moment>, Vec<u32>) {
    let mut machine = Machine::start(firmware, &["-singlestep"]);
    // The start is skipped: it takes a hundred times as long as a cycle.
    machine.run_to(firmware, 0).expect("the machine runs");
    machine
        .remote
        .console("log exec,nochain")
        .expect("the machine runs");
    assert_eq!(machine.run(), At::Address(firmware.over));
    machine
        .remote
        .console("log none")
        .expect("the machine runs");
    let text = std::fs::read_to_string(machine.log()).expect("the emulator's log");
    let mut moments = Vec::new();
    let mut executed = BTreeSet::new();
    let mut hits: HashMap<u32, u32> = HashMap::new();
    let (mut cycle, mut within, mut before) = (0u32, true, u32::MAX);
    for line in text.lines() {
        // "Trace 0: 0x7f... [00000000/00000408/00000110/ff000200] main"
        let Some(address) = line
            .strip_prefix("Trace 0: ")
            .and_then(|rest| rest.split('/').nth(1))
            .and_then(|field| u32::from_str_radix(field, 16).ok())
        else {
            continue;
        };
        // An instruction that was interrupted is logged twice.
        if address == before {
            continue;
        }
        before = address;
        executed.insert(address);
        if address == firmware.begins {
            within = true;
            hits.clear();
        } else if address == firmware.done {
            within = false;
            cycle += 1;
        } else if within && !firmware.is_in_marker(address) {
            let hit = hits.entry(address).or_default();
            *hit += 1;
            moments.push(Moment {
                cycle,
                address,
                hit: *hit,
            });
        }
    }
    assert_eq!(
        cycle as usize,
        samples.len(),
        "the trace contains every cycle"
    );
    let code = executed
        .into_iter()
        .filter(|address| !firmware.is_in_marker(*address))
        .flat_map(|address| {
            let half = firmware.image[address as usize + 1];
            // The first five bits identify a long instruction.
            let length = if half >> 3 >= 0b11101 { 4 } else { 2 };
            address..address + length
        })
        .collect();
    (moments, code)
}
