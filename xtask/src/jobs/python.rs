//! `python`: the wheel of `crates/posegate-python`, built, installed in a fresh environment and compared with the program in it.

use crate::arguments::Arguments;
use crate::files::{self, Scratch, target_folder};
use crate::need;
use crate::report::Report;
use crate::shell::{Result, cmd, program_at, say};
use std::fs;
use std::path::{Path, PathBuf};

const CRATE: &str = "crates/posegate-python";
/// Sets over which the memory is watched.
const SETS: u64 = 1_000_000;
/// Most bytes of the wheel.
const LARGEST_WHEEL: u64 = 8_000_000;

/// Lints the crate, builds its wheel, and runs `tests/` of the crate with the wheel in an environment that has nothing else but NumPy.
/// The argument is the number of sets over which the memory is watched; 10000000 is the deep variant.
pub fn python(given: &Arguments) -> Result {
    let sets = given.number(0, SETS)?;
    let tools = need::python(
        "python-tools",
        "maturin, mypy, numpy, matplotlib",
        "maturin mypy numpy matplotlib",
    )?;
    let manifest = format!("{CRATE}/Cargo.toml");
    say("lints");
    cmd("cargo fmt --check --manifest-path")
        .arg(&manifest)
        .run()?;
    in_target(cmd("cargo clippy --locked --release --manifest-path").arg(&manifest))
        .words("-- -D warnings")
        .run()?;
    let wheel = wheel(&tools, &manifest)?;
    let mut report = Report::default();
    report.at_most("python: wheel", files::size(&wheel)?, "B", LARGEST_WHEEL);
    let name = files::name(&wheel);
    // One wheel for all versions, for systems as old as the one that builds.
    report.require(
        name.contains("-cp39-abi3-manylinux_"),
        format_args!("{name} is not a wheel of the stable ABI for manylinux"),
    );
    let python = fresh_environment(&wheel)?;
    say("types");
    program_at(&tools)
        .words("-m mypy --strict --python-executable")
        .arg(&python)
        .words("--cache-dir")
        .arg(target_folder().join("mypy"))
        .env("MYPYPATH", format!("{CRATE}/tests"))
        .args(files::files_ending(format!("{CRATE}/tests"), ".py")?)
        .run()?;
    for package in ["-p posegate", &format!("{CRATE}/examples/verdict_plot.py")] {
        program_at(&tools)
            .words("-m mypy --strict --python-executable")
            // The example draws by a package that the tools have.
            .arg(if package.starts_with("-p") {
                &python
            } else {
                &tools
            })
            .words("--cache-dir")
            .arg(target_folder().join("mypy"))
            .env("MYPYPATH", format!("{CRATE}/python"))
            .words(package)
            .run()?;
    }
    say("tests");
    let test = |name: &str| program_at(&python).arg(format!("{CRATE}/tests/{name}"));
    test("equal_to_program.py").json()?;
    test("many.py").arg(sets.to_string()).json()?;
    test("examples.py").json()?;
    let folder = Scratch::new()?;
    in_target(test("page.py")).arg(folder.path()).json()?;
    say("the notebook");
    program_at(&python)
        .words("-m pip install -q nbclient ipykernel")
        .run()?;
    test("notebook.py").arg(folder.path()).json()?;
    report.finish()
}

/// Returns a command that builds into the folder of the other jobs.
fn in_target(command: crate::shell::Cmd) -> crate::shell::Cmd {
    command.env("CARGO_TARGET_DIR", target_folder())
}

/// Builds the wheel.
fn wheel(tools: &Path, manifest: &str) -> Result<PathBuf> {
    say("the wheel");
    let folder = target_folder().join("wheels");
    remove(&folder)?;
    in_target(program_at(tools).words("-m maturin build --release --locked -m"))
        .arg(manifest)
        .arg("-o")
        .arg(&folder)
        .run()?;
    let wheels = files::files_ending(&folder, ".whl")?;
    match wheels.as_slice() {
        [wheel] => Ok(wheel.clone()),
        all => Err(format!("{} wheels instead of one", all.len()).into()),
    }
}

/// Returns the Python of a new environment with the wheel and what it asks for.
fn fresh_environment(wheel: &Path) -> Result<PathBuf> {
    say("a fresh environment");
    let folder = target_folder().join("python-fresh");
    remove(&folder)?;
    cmd("python3 -m venv").arg(&folder).run()?;
    let python = folder.join("bin/python");
    program_at(&python)
        .words("-m pip install -q")
        .arg(wheel)
        .run()?;
    Ok(python)
}

/// Removes a folder of an earlier run.
fn remove(folder: &Path) -> Result {
    match folder.exists() {
        true => Ok(fs::remove_dir_all(folder)?),
        false => Ok(()),
    }
}
