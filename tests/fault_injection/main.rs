//! Faults injected into the running firmware under emulation: how many lead to a wrong permit?
//!
//! Without arguments a small share, for the fast suite. `./ci.sh faults` runs the whole:
//! `cargo test --release --features std --test fault_injection -- N SEED`, N faults of each kind. Each fault
//! is a run of its own: one bit of code, of a register or of memory falls at a random moment after the start,
//! and the output at the end of each cycle is held against that of the run without a fault. A JSON line a
//! figure on stdout; each wrong permit with its place on stderr.

mod fault;
mod firmware;
mod golden;
mod machine;
mod random;
mod remote;
#[path = "../support/firmware.rs"]
#[allow(dead_code)]
mod support;
mod tally;
mod trial;

use crate::fault::{Fault, Kind};
use crate::firmware::Firmware;
use crate::golden::Golden;
use crate::random::Random;
use crate::tally::Tally;
use std::process::ExitCode;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

/// The share of wrong permits, in percent, that must not be passed.
const GOAL: f64 = 0.5;
/// Faults of each kind in the fast suite.
const FEW: u64 = 20;

fn main() -> ExitCode {
    let numbers: Vec<u64> = std::env::args()
        .skip(1)
        .filter(|argument| !argument.starts_with('-'))
        .filter_map(|argument| argument.parse().ok())
        .collect();
    let each = numbers.first().copied().unwrap_or(FEW);
    let seed = numbers.get(1).copied().unwrap_or(1);

    let protected = campaign(&Firmware::build("fault_target", true), each, seed);
    protected.print("", Some(GOAL));
    let plain = campaign(
        &Firmware::build("fault_target_unprotected", false),
        each / 4,
        seed,
    );
    plain.print("unprotected ", None);
    if protected.wrong_percent(None) < GOAL {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    }
}

/// So many faults of each kind.
fn campaign(firmware: &Firmware, each: u64, seed: u64) -> Tally {
    let golden = Golden::of(firmware);
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
                    let fault = Fault::choose(kind, &golden, &mut random);
                    let trial = trial::run(firmware, &golden, &fault);
                    let mut tally = tally.lock().expect("no thread has panicked");
                    tally.add(kind, index, &fault, trial);
                }
            });
        }
    });
    tally.into_inner().expect("no thread has panicked")
}
