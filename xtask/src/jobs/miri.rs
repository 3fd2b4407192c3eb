//! `miri`: runs tests in an interpreter.

use crate::arguments::Arguments;
use crate::jobs::test::passed;
use crate::report::Report;
use crate::shell::{Result, cmd, say};

/// Machines of 64 bits, of 32, and of the other byte order.
const MACHINES: [&str; 3] = [
    "x86_64-unknown-linux-gnu",
    "i686-unknown-linux-gnu",
    "s390x-unknown-linux-gnu",
];

/// Interprets the modules' own tests, some of the committed decisions and the C boundary: no undefined behaviour, and the same answers on
/// every machine. Long tests have fewer rounds (`rounds` in src/lib.rs). Prints a line for each machine with the number of passed tests.
pub fn miri(_: &Arguments) -> Result {
    if cmd("cargo +nightly miri --version").quiet()?.code != 0 {
        let install =
            "rustup toolchain install nightly --profile minimal --component miri,rust-src";
        say(install);
        cmd(install).run()?;
    }
    let mut report = Report::default();
    for machine in MACHINES {
        interpreted(
            &mut report,
            machine,
            100,
            "",
            &format!("--target {machine} -p posegate --lib --test any_machine"),
        )?;
        // These tests leak storage, so that its address stays the same.
        let boundary = format!("--target {machine} -p posegate-c --test c_boundary");
        interpreted(
            &mut report,
            &format!("{machine}, the C boundary"),
            17,
            " -Zmiri-ignore-leaks",
            &boundary,
        )?;
    }
    report.finish()
}

/// Runs tests by cargo, at least `least` of them, with more flags of the interpreter.
fn interpreted(report: &mut Report, name: &str, least: u64, flags: &str, tests: &str) -> Result {
    say(&format!("miri {name}"));
    // The references of the tests need floats of this machine's accuracy.
    let outcome = cmd("cargo +nightly miri test")
        .words(tests)
        .env(
            "MIRIFLAGS",
            format!("-Zmiri-disable-isolation -Zmiri-no-extra-rounding-error{flags}"),
        )
        .env("PROPTEST_CASES", "4")
        .env("PROPTEST_RNG_SEED", "1")
        .env("PROPTEST_DISABLE_FAILURE_PERSISTENCE", "1")
        .logged()?;
    report.require(
        outcome.code == 0,
        format_args!("miri {name} failed with {}", outcome.code),
    );
    report.at_least(
        &format!("miri {name}"),
        passed(&outcome.text),
        "tests",
        least,
    );
    Ok(())
}
