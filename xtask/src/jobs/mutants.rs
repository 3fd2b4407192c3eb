//! `mutants` and `gate_mutants`: measure the strength of the tests.

use crate::arguments::Arguments;
use crate::files::{self, Scratch};
use crate::need;
use crate::report::Report;
use crate::shell::{Result, cmd};
use std::path::Path;

/// The modules that a decision runs through.
const MODULES: [&str; 5] = ["num", "set", "table", "contain", "sight"];

/// Changes operators and empties bodies in core modules, one at a time: a mutant that no test finds is missed. The modules' own
/// tests run first, then the tests that need the host for the remaining mutants. Takes most of an hour; exclusions and their
/// reasons are in .cargo/mutants.toml.
pub fn mutants(given: &Arguments) -> Result {
    let named: Vec<&str> = given.all().iter().map(String::as_str).collect();
    let modules = if named.is_empty() {
        MODULES.to_vec()
    } else {
        named
    };
    let mut globs = Vec::new();
    for module in modules {
        if !Path::new(&format!("src/{module}.rs")).exists()
            && !Path::new(&format!("src/{module}")).is_dir()
        {
            return Err(format!("no module {module} in src").into());
        }
        globs.extend([format!("src/{module}.rs"), format!("src/{module}/**")]);
    }
    need::cargo_command("cargo-mutants")?;
    let folder = Scratch::new()?;
    let pass = |arguments: &str| -> Result {
        let code =
            cmd("cargo mutants -p posegate --colors never --minimum-test-timeout 20 --output")
                .arg(folder.path())
                .args(globs.iter().flat_map(|glob| ["-f", glob]))
                .words(arguments)
                .env("PROPTEST_RNG_SEED", "1")
                .env("POSEGATE_DEEP", "1")
                .env("PROPTEST_DISABLE_FAILURE_PERSISTENCE", "1")
                .code()?;
        // Exit code 2: mutants were missed; 3: some reached the time limit. Both are counted below.
        match code {
            0 | 2 | 3 => Ok(()),
            code => Err(format!("cargo mutants failed with {code}").into()),
        }
    };
    // The last pass has `mutants.out`, the one before it `mutants.out.old`.
    let list = |pass: &str, name: &str| files::read(folder.join(pass).join(format!("{name}.txt")));
    pass("-- --lib")?;
    let mut passes = vec!["mutants.out"];
    if !list("mutants.out", "missed")?.is_empty() {
        pass(
            "--iterate --features std --test-package posegate --test-package posegate-site -- --test grid_walk --test vectors --test facet_faults --test sight",
        )?;
        passes.push("mutants.out.old");
    }
    let mut report = Report::default();
    for name in ["caught", "unviable"] {
        let mut count = 0;
        for pass in &passes {
            count += list(pass, name)?.lines().count();
        }
        report.note(&format!("mutants {name}"), count, "mutants");
    }
    report.note(
        "mutants that ran out of time",
        list("mutants.out", "timeout")?.lines().count(),
        "mutants",
    );
    let missed = list("mutants.out", "missed")?;
    eprint!("{missed}");
    report.at_most("mutants missed", missed.lines().count(), "mutants", 0);
    report.finish()
}

/// Removes the checks of the gate, one at a time: a fast test must find each mutant. A part of a name runs only those mutants.
pub fn gate_mutants(given: &Arguments) -> Result {
    need::command("python3", "python3")?;
    cmd("python3 tests/support/gate_mutants.py")
        .args(given.all())
        .print()
}
