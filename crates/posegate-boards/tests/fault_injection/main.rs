//! Faults injected into the running firmware under emulation: how many lead to a wrong permit?
//!
//! Without arguments it runs a small share, for the fast suite. `./ci.sh faults` runs the whole:
//! `cargo test --release -p posegate-boards --test fault_injection -- N SEED`, N faults of each kind. Each fault
//! has its own run: one bit of code, of a register or of memory is flipped at a random moment after the start. The
//! output at the end of each cycle is compared with that of the run without a fault. Prints one JSON line per
//! figure on stdout, and each wrong permit with its place on stderr.

mod boot;
mod fault;
mod firmware;
mod golden;
mod machine;
mod memory;
mod random;
mod remote;
use posegate_testkit::firmware as support;
mod tally;
mod trial;

use crate::fault::{Fault, Kind};
use crate::firmware::Firmware;
use crate::golden::Golden;
use crate::machine::{At, Machine};
use crate::random::Random;
use crate::tally::Tally;
use crate::trial::{Class, End};
use std::process::ExitCode;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

/// Largest allowed share of wrong permits on one piece of facets, in percent. On several pieces together the second evaluation is a spot check.
const GOAL: f64 = 0.1;
/// Number of faults of each kind from which on the two firmwares can be distinguished.
const MANY: u64 = 400;
/// Number of faults of each kind in the fast suite.
const FEW: u64 = 8;

fn main() -> ExitCode {
    let numbers: Vec<u64> = std::env::args()
        .skip(1)
        .filter(|argument| !argument.starts_with('-'))
        .filter_map(|argument| argument.parse().ok())
        .collect();
    let each = numbers.first().copied().unwrap_or(FEW);
    let seed = numbers.get(1).copied().unwrap_or(1);

    let target = Firmware::build("fault_target", true, None);
    let golden = Golden::of(&target);
    faults_take_effect(&target, &golden);
    hangs_are_detected(&target);
    beats_are_seen(&target, &golden);
    let mut short = !damaged_starts(&target, each, seed);
    if each > FEW {
        short |= every_bit(&target, &golden) > 0;
    }
    let protected = campaign(&target, &golden, each, seed);
    protected.print("", Some(GOAL));
    let of_dock = protected.wrong_percent(None);
    short |= !(of_dock <= GOAL);
    for (table, goal) in [("footprint", Some(GOAL)), ("union", None)] {
        let target = Firmware::build("fault_target", true, Some(table));
        let tally = campaign(&target, &Golden::of(&target), each, seed);
        tally.print(&format!("{table}: "), goal);
        short |= goal.is_some_and(|goal| !(tally.wrong_percent(None) <= goal));
    }
    let plain = Firmware::build("fault_target_unprotected", false, None);
    let tally = campaign(&plain, &Golden::of(&plain), each / 4, seed);
    tally.print("unprotected ", None);
    // A harness that detects nothing would find no difference here either.
    if each >= MANY && tally.wrong_percent(None) <= of_dock {
        eprintln!("the unprotected sample does no worse: the harness does not see");
        short = true;
    }
    if short {
        ExitCode::FAILURE
    } else {
        ExitCode::SUCCESS
    }
}

/// Injects faults whose effect is known, because an injection without effect would find nothing.
fn faults_take_effect(firmware: &Firmware, golden: &Golden) {
    const CYCLE: u32 = 10;
    // A return that was executed in ten cycles, `bx lr`, becomes `bx r6`.
    let code = Fault::Code {
        cycle: CYCLE,
        address: firmware.begins + 2,
        bit: 6,
    };
    let moment = golden.moments.iter().find(|moment| moment.cycle == CYCLE);
    let register = Fault::Register {
        moment: *moment.expect("an instruction of the cycle"),
        register: remote::PC,
        bit: 30,
    };
    for fault in [code, register] {
        let trial = trial::run(firmware, golden, &fault);
        assert_ne!(trial.end, End::Over, "without effect: {fault:?}");
    }
    // For memory, the latched situation in `memory` shows the effect.
}

/// A firmware that reaches no marker again is detected quickly: a processor that sleeps, one that runs where there
/// is no memory, and a loop.
fn hangs_are_detected(firmware: &Firmware) {
    const WFI: [u8; 2] = [0x30, 0xbf];
    const TO_ITSELF: [u8; 2] = [0xfe, 0xe7];
    const NOWHERE: u32 = 0x0100_8000;
    for code in [WFI, TO_ITSELF] {
        let mut machine = Machine::start(firmware, &[]);
        let running = machine.run_to(firmware, 10);
        let written = running.and_then(|()| machine.remote.write(firmware.done, &code));
        assert_eq!(
            written.map(|()| machine.run()).ok(),
            Some(At::Hung),
            "{code:x?}"
        );
    }
    let mut machine = Machine::start(firmware, &[]);
    let running = machine.run_to(firmware, 10);
    let set = running.and_then(|()| machine.remote.set_register(remote::PC, NOWHERE));
    assert_eq!(set.map(|()| machine.run()).ok(), Some(At::Hung));
}

/// An open output with a heartbeat that goes on is a wrong permit, one whose firmware halts after a second of silence is not.
fn beats_are_seen(firmware: &Firmware, golden: &Golden) {
    // r0 is the lamps' register. The first loop writes 3 and 1 to it for ever, 100 times in a second. The second waits for 1.5 s, then
    // goes to `halted`.
    const BEATS: [u8; 16] = [
        3, 0x21, 1, 0x60, 1, 0x21, 1, 0x60, 0x22, 0x46, 1, 0x3a, 0xfd, 0xd1, 0xf7, 0xe7,
    ];
    const WAITS: [u8; 8] = [1, 0x3a, 0xfd, 0xd1, 0x18, 0x47, 0, 0xbf];
    for (code, class) in [
        (&BEATS[..], Class::WrongPermit),
        (&WAITS[..], Class::EndedHighWithoutHeartbeat),
    ] {
        let open = golden.samples.iter().position(|sample| sample.high);
        let open = open.expect("a cycle that is open") as u32;
        let mut machine = Machine::start(firmware, &[]);
        let end = machine.run_to(firmware, open + 1).and_then(|()| {
            machine.remote.write(firmware.done, code)?;
            for (register, value) in [
                (0, machine::LEDS),
                (2, 12_000_000),
                (3, firmware.halted | 1),
                (4, 80_000),
                (remote::PC, firmware.done),
            ] {
                machine.remote.set_register(register, value)?;
            }
            machine.run_to_end(firmware)
        });
        assert_eq!(end.ok(), Some(At::Hung), "{class:?}");
        let trial = trial::classify(&mut machine, firmware, golden, End::Hung, String::new());
        assert_eq!(trial.class, class);
    }
}

/// Starts with a damaged or unsealed image. Returns `true` if all stayed closed, and reported the damage if the program
/// reached its check.
fn damaged_starts(firmware: &Firmware, each: u64, seed: u64) -> bool {
    let unsealed = boot::unsealed(firmware);
    let damaged = boot::damaged(firmware, each.min(100), seed);
    let line = |name: &str, value: u64, goal: &str| {
        println!(
            "{{\"name\": \"starts {name}\", \"value\": {value}, \"unit\": \"starts\", \"goal\": {goal}}}"
        );
    };
    line("with a flipped bit of the image", damaged.tried, "null");
    line(
        "with a flipped bit, found by the check",
        damaged.found,
        "null",
    );
    line(
        "with a flipped bit, found by a check before",
        damaged.found_before,
        "null",
    );
    line(
        "with a flipped bit, program ended before",
        damaged.ended,
        "null",
    );
    line("with a flipped bit, opened", damaged.opened, "0");
    line("unsealed, denied", unsealed.found, "1");
    let found = damaged.found + damaged.found_before + damaged.ended;
    damaged.opened == 0 && found == damaged.tried && unsealed.found == 1
}

/// Flips every bit of the gate's memory in every situation. Returns the number of wrong permits.
fn every_bit(firmware: &Firmware, golden: &Golden) -> u64 {
    let situations = memory::situations(golden);
    let next = AtomicU64::new(0);
    let all = Mutex::new(Vec::new());
    std::thread::scope(|scope| {
        let threads = std::thread::available_parallelism().map_or(2, usize::from);
        for _ in 0..threads {
            scope.spawn(|| {
                loop {
                    let index = next.fetch_add(1, Ordering::Relaxed) as usize;
                    let Some(situation) = situations.get(index) else {
                        break;
                    };
                    let counts = memory::every_bit(firmware, situation);
                    all.lock()
                        .expect("no thread has panicked")
                        .push((index, counts));
                }
            });
        }
    });
    let mut all = all.into_inner().expect("no thread has panicked");
    all.sort_by_key(|(index, _)| *index);
    let mut wrong = 0;
    for (index, counts) in all {
        let line = |what: &str, value: u64, unit: &str, goal: &str| {
            let name = situations[index].name;
            println!(
                "{{\"name\": \"the gate's RAM, {name}: {what}\", \"value\": {value}, \"unit\": \"{unit}\", \"goal\": {goal}}}"
            );
        };
        line("bits flipped", counts.bits, "faults", "null");
        line("bytes set", counts.bytes, "faults", "null");
        line("program ended, closed", counts.ended, "faults", "null");
        line(
            "program ended, open, heartbeat stopped",
            counts.stopped_open,
            "faults",
            "null",
        );
        line("wrong permits", counts.wrong_permits, "faults", "0");
        wrong += counts.wrong_permits;
    }
    wrong
}

/// Runs `each` faults of each kind.
fn campaign(firmware: &Firmware, golden: &Golden, each: u64, seed: u64) -> Tally {
    let high = golden.samples.iter().filter(|sample| sample.high).count();
    eprintln!(
        "{}: {} cycles, {high} open; {} instructions in its steps, {} bytes of code executed",
        firmware.name,
        golden.samples.len(),
        golden.moments.len(),
        golden.code.len()
    );
    for sample in &golden.samples {
        eprint!("{}{} ", if sample.high { '+' } else { '-' }, sample.reason);
    }
    eprintln!();
    let next = AtomicU64::new(0);
    let tally = Mutex::new(Tally::default());
    let count = each * Kind::ALL.len() as u64;
    std::thread::scope(|scope| {
        let threads = std::thread::available_parallelism().map_or(2, usize::from);
        for _ in 0..threads {
            scope.spawn(|| {
                loop {
                    let index = next.fetch_add(1, Ordering::Relaxed);
                    if index >= count {
                        break;
                    }
                    let kind = Kind::ALL[(index % 3) as usize];
                    let mut random = Random::new(seed, index);
                    let fault = Fault::choose(kind, golden, &mut random);
                    let trial = trial::run(firmware, golden, &fault);
                    let mut tally = tally.lock().expect("no thread has panicked");
                    tally.add(kind, index, &fault, trial);
                }
            });
        }
    });
    tally.into_inner().expect("no thread has panicked")
}
