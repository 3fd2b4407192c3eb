//! Executes a plan on a Cortex-M4F: rules and tables in flash, with a tag that is not seen and a slip during a drive.
//! Runs in QEMU; `crates/posegate-plan/tests/contingent_plan.rs` compares its output with the output of the same run on
//! the host.
//!
//! ```text
//! cargo run -p posegate --profile firmware --target thumbv7em-none-eabihf --features firmware --example contingent_plan
//! ```
#![cfg_attr(target_os = "none", no_std, no_main)]

/// Firmware has no meaning on a host; this lets `cargo test --all-features` build there.
#[cfg(not(target_os = "none"))]
fn main() {}

#[cfg(target_os = "none")]
#[path = "support/contingent_run.rs"]
mod contingent_run;

#[cfg(target_os = "none")]
#[path = "board/emulated.rs"]
mod emulated;

#[cfg(target_os = "none")]
mod firmware {
    use crate::contingent_run;
    use crate::emulated::run;
    use core::fmt::{Error, Write};
    use cortex_m_rt::entry;
    use cortex_m_semihosting::hprint;

    struct Out;

    impl Write for Out {
        fn write_str(&mut self, text: &str) -> Result<(), Error> {
            hprint!("{}", text);
            Ok(())
        }
    }

    #[entry]
    fn main() -> ! {
        run(|| contingent_run::run(&mut Out))
    }
}
