//! `vectors`: repeats the decisions of tests/data/vectors.bin in five emulations, which report their core themselves. Two of them run also at the
//! level "s". (The fast suite repeats them on this machine.)

use crate::arguments::Arguments;
use crate::board::{self, Level};
use crate::need;
use crate::shell::Result;
use serde_json::Value;

/// A target of Rust, a machine of QEMU, and what the firmware calls the core.
const CORES: [(&str, &str, &str); 5] = [
    ("thumbv6m-none-eabi", "mps2-an385", "ARMv6-M on Cortex-M3"),
    ("thumbv7m-none-eabi", "mps2-an385", "Cortex-M3"),
    ("thumbv7em-none-eabihf", "mps2-an386", "Cortex-M4"),
    ("thumbv7em-none-eabihf", "mps2-an500", "Cortex-M7"),
    ("thumbv8m.main-none-eabihf", "mps2-an505", "Cortex-M33"),
];
const TARGETS: [&str; 4] = [
    "thumbv6m-none-eabi",
    "thumbv7m-none-eabi",
    "thumbv7em-none-eabihf",
    "thumbv8m.main-none-eabihf",
];
/// Least number of decisions in the file.
const LEAST: u64 = 10_000;

/// Prints a JSON line for each core. Fails unless each line counts every decision.
pub fn vectors(_: &Arguments) -> Result {
    need::targets(&TARGETS)?;
    need::qemu()?;
    let (mut failed, mut count) = (Vec::new(), 0);
    let built = board::build_all(Level::Fast, &TARGETS, &["vectors"])?;
    for (target, machine, core) in CORES {
        let elf = built.elf(target, "vectors");
        let outcome = board::emulate(machine, &elf, 600).outcome()?;
        let line = outcome.text.trim_end();
        println!("{line}");
        // Every core counts as many as the first one.
        if count == 0 {
            count = counted(line);
        }
        if outcome.code != 0 || count < LEAST || line != right(core, count) {
            failed.push(core.into());
        }
    }
    // Code for size shares functions that level 3 copies.
    let for_size = [CORES[0], CORES[2]];
    let targets = for_size.map(|(target, ..)| target);
    let built = board::build_all(Level::Small, &targets, &["vectors"])?;
    for (target, machine, core) in for_size {
        let elf = built.elf(target, "vectors");
        let outcome = board::emulate(machine, &elf, 600).outcome()?;
        let line = outcome.text.trim_end();
        println!("{}", line.replace(core, &format!("{core}, at the level s")));
        if outcome.code != 0 || line != right(core, count) {
            failed.push(format!("{core}, at the level s"));
        }
    }
    if failed.is_empty() {
        return Ok(());
    }
    Err(format!(
        "not the decisions of tests/data/vectors.bin: {}",
        failed.join(", ")
    )
    .into())
}

fn counted(line: &str) -> u64 {
    let line = serde_json::from_str::<Value>(line).unwrap_or_default();
    line["count"].as_u64().unwrap_or(0)
}

/// Returns the line of a core whose decisions are all as recorded.
fn right(core: &str, count: u64) -> String {
    format!(
        "{{\"name\":\"vectors {core}\",\"count\":{count},\"mismatches\":0,\"first_mismatch\":null,\"goal\":0}}"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn count_is_read_from_a_valid_line() {
        assert_eq!(counted(&right("Cortex-M4", 10_272)), 10_272);
        assert_eq!(counted(""), 0);
    }
}
