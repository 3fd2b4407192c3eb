//! Repeats the decisions of `tests/data/vectors.bin`, on this machine or on a controller: prints a JSON line, and fails
//! if a decision differs from the file.
//!
//! ```text
//! cargo run -p posegate --release --features firmware --example vectors
//! cargo build -p posegate --profile firmware --target thumbv6m-none-eabi --features firmware --example vectors
//! qemu-system-arm -M mps2-an385 -display none -monitor none -serial none -semihosting-config enable=on,target=native -kernel target/thumbv6m-none-eabi/firmware/examples/vectors
//! ```
//!
//! `./ci.sh vectors` does so on every core. For ARMv8-M the machine is `mps2-an505`.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[path = "../crates/posegate-testkit/src/replay.rs"]
mod replay;

use core::fmt;
use posegate::recordings::Evaluator;
use replay::{Fault, MAXIMUM_AGE_MS, Outcome};

static VECTORS: &[u8] = include_bytes!("../tests/data/vectors.bin");

/// In the order of the table numbers in the requests.
static TABLES: [&[u8]; 8] = [
    include_bytes!("tables/dock.posegate"),
    include_bytes!("tables/see-t7.posegate"),
    include_bytes!("tables/see-t7-grid.posegate"),
    include_bytes!("../tests/data/whole-circle.posegate"),
    include_bytes!("../tests/data/turning.posegate"),
    include_bytes!("../tests/data/over-180.posegate"),
    include_bytes!("../tests/data/over-180-grid.posegate"),
    include_bytes!("../tests/data/corner.posegate"),
];

fn replayed() -> Result<Outcome, Fault> {
    let [a, b, c, d, e, f, g, h] = TABLES.map(|table| Evaluator::new(table, MAXIMUM_AGE_MS));
    let no_gate = |_| "a gate does not take its maximum age";
    let gates = [
        a.map_err(no_gate)?,
        b.map_err(no_gate)?,
        c.map_err(no_gate)?,
        d.map_err(no_gate)?,
        e.map_err(no_gate)?,
        f.map_err(no_gate)?,
        g.map_err(no_gate)?,
        h.map_err(no_gate)?,
    ];
    replay::replay(VECTORS, &gates)
}

/// A JSON line with the outcome on a core.
struct Line<'a>(&'a str, Outcome);

impl fmt::Display for Line<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self(core, outcome) = self;
        write!(
            f,
            "{{\"name\":\"vectors {core}\",\"count\":{},\"mismatches\":{},\"first_mismatch\":",
            outcome.count, outcome.mismatches
        )?;
        match outcome.first_mismatch {
            None => f.write_str("null")?,
            Some(index) => write!(f, "{index}")?,
        }
        f.write_str(",\"goal\":0}")
    }
}

#[cfg(not(target_os = "none"))]
fn main() -> std::process::ExitCode {
    let core = std::env::consts::ARCH.replace('_', "-");
    match replayed() {
        Ok(outcome) => {
            println!("{}", Line(&core, outcome));
            u8::from(!outcome.is_good()).into()
        }
        Err(fault) => {
            println!("{{\"error\":\"{fault}\"}}");
            1.into()
        }
    }
}

#[cfg(target_os = "none")]
#[path = "board/emulated.rs"]
mod emulated;

#[cfg(target_os = "none")]
mod firmware {
    use crate::emulated::run;
    use crate::{Line, replayed};
    use cortex_m_rt::entry;
    use cortex_m_semihosting::hprintln;

    /// Returns the core that this runs on, from its CPUID register.
    fn core() -> &'static str {
        // SAFETY: CPUID is an aligned register of every Cortex-M; reading it changes nothing.
        let cpuid = unsafe { core::ptr::read_volatile(0xe000_ed00 as *const u32) };
        // ARMv6-M is the architecture without compare and swap. QEMU has no such board that is large enough, so its
        // code runs on a Cortex-M3, which executes all of it.
        let is_v6 = !cfg!(target_has_atomic = "32");
        match cpuid >> 4 & 0xfff {
            0xc23 if is_v6 => "ARMv6-M on Cortex-M3",
            0xc23 => "Cortex-M3",
            0xc24 => "Cortex-M4",
            0xc27 => "Cortex-M7",
            0xd21 => "Cortex-M33",
            _ => "unknown core",
        }
    }

    #[entry]
    fn main() -> ! {
        run(|| {
            let outcome = replayed()?;
            let is_good = outcome.is_good();
            hprintln!("{}", Line(core(), outcome));
            if is_good {
                Ok(())
            } else {
                Err("a decision differs from the file")
            }
        })
    }
}
