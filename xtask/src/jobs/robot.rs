//! `robot` and `costs`: what a whole program in C takes, with the archive as released.

use crate::archive::{self, Core};
use crate::arguments::Arguments;
use crate::board::{self, Level};
use crate::files::{self, Scratch};
use crate::jobs::test::build_suite;
use crate::jobs::{flash, own_library};
use crate::need;
use crate::report::Report;
use crate::shell::{Cmd, Result, cmd, program_at};
use crate::stack::Program;
use serde_json::Value;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

const FOLDER: &str = "examples/c/robot";
const TASKS: [&str; 3] = ["dock", "see-t7", "wait"];
const DIGESTS: &str = "examples/c/robot/task_digests.h";

/// The cores of the program: how a user names them, the emulator with its board and what an instruction takes, the objects of the board,
/// and where its memories begin if not where the linker script has them.
pub struct Board {
    pub core: &'static str,
    emulator: (&'static str, &'static str),
    sources: &'static [&'static str],
    memory: &'static str,
}

const ON_ARM: &[&str] = &["examples/c/startup.c", "examples/c/board.c"];

pub const BOARDS: [Board; 3] = [
    Board {
        core: "cortex-m4f",
        emulator: (
            "qemu-system-arm",
            "-M mps2-an386 -semihosting-config enable=on,target=native -icount shift=6",
        ),
        sources: ON_ARM,
        memory: "",
    },
    Board {
        core: "cortex-m0plus",
        emulator: (
            "qemu-system-arm",
            "-M mps2-an385 -semihosting-config enable=on,target=native -icount shift=6",
        ),
        sources: ON_ARM,
        memory: "",
    },
    Board {
        core: "rv32imc",
        emulator: (
            "qemu-system-riscv32",
            "-M virt -bios none -serial stdio -icount shift=0",
        ),
        sources: &["examples/c/robot/virt.c"],
        memory: "-Wl,--defsym=flash_origin=0x80000000,--defsym=ram_origin=0x80800000",
    },
];

impl Board {
    pub fn core(&self) -> Result<&'static Core> {
        Core::named(self.core)
    }

    /// Compiles and links a program of these sources, and `more` options, with an archive.
    pub fn link(
        &self,
        sources: &[&str],
        more: &str,
        archive: &Path,
        elf: &Path,
        includes: &Path,
    ) -> Result {
        let core = self.core()?;
        core.tool("gcc")?
            .words(core.flags)
            .words("-Os -g -std=c99 -pedantic -Wall -Wextra -Wconversion -Wshadow -Werror -ffreestanding -ffunction-sections -fdata-sections -nostdlib")
            .words("-T examples/c/link.ld -Wl,-z,noexecstack -Wl,--gc-sections -Wl,--no-warn-rwx-segments -Iinclude -Iexamples/c -Iexamples/c/robot")
            .words(self.memory)
            .words(more)
            .arg("-I")
            .arg(includes)
            .arg(format!("-Wa,-I,{}", includes.display()))
            .args(self.sources)
            .args(sources)
            .arg(archive)
            .words("-lc -lgcc")
            .arg("-o")
            .arg(elf)
            .run()
    }

    /// Returns the command that runs a program in the emulator.
    pub fn emulate(&self, elf: &Path) -> Result<Cmd> {
        let (emulator, board) = self.emulator;
        let package = match emulator {
            "qemu-system-arm" => "qemu-system-arm",
            _ => "qemu-system-misc",
        };
        need::command(emulator, package)?;
        Ok(cmd(emulator)
            .words("-display none -monitor none")
            .words(board)
            .arg("-kernel")
            .arg(elf)
            .limit(600))
    }
}

/// Builds the program for each core with the archive as released, runs it, and prints what it costs. The tables of the program must be
/// those of its site file.
pub fn robot(_: &Arguments) -> Result {
    tables()?;
    let mut report = Report::default();
    for board in &BOARDS {
        of_board(board, "turning", "3", &mut report)?;
    }
    // The largest archive, on the core of which most robots are made.
    let core = BOARDS[0].core()?;
    let archive = archive::build(core, features("all")?, "3")?;
    own_library::check(core, &archive, &mut report)?;
    report.finish()
}

/// Returns the figures of the program with an archive, by their names, and prints them.
pub fn of_board(
    board: &Board,
    parts: &str,
    level: &str,
    report: &mut Report,
) -> Result<Vec<(String, u64)>> {
    let features = features(parts)?;
    let archive = archive::build(board.core()?, features, level)?;
    let folder = Scratch::new()?;
    let sources = ["main.c", "measure.c", "tables.S"].map(|name| format!("{FOLDER}/{name}"));
    let sources = sources.each_ref().map(String::as_str);
    let (elf, empty) = (folder.join("robot.elf"), folder.join("empty.elf"));
    board.link(&sources, "", &archive, &elf, folder.path())?;
    board.link(&sources, "-DEMPTY_LOOP", &archive, &empty, folder.path())?;
    let output = board.emulate(&elf)?.read()?;
    let mut figures = vec![(
        "flash over an empty loop".to_owned(),
        board.core()?.flash(&elf)? - board.core()?.flash(&empty)?,
    )];
    for line in output.lines() {
        let figure: Value =
            serde_json::from_str(line).map_err(|_| format!("the program prints: {line}"))?;
        match (figure["name"].as_str(), figure["value"].as_u64()) {
            (Some(name), Some(value)) => figures.push((name.to_owned(), value)),
            _ => return Err(format!("the program prints: {line}").into()),
        }
    }
    for (name, value) in &figures {
        report.note(
            &format!("robot, {}, {parts}, opt-level {level}: {name}", board.core),
            value,
            "",
        );
    }
    Ok(figures)
}

const FIGURES: &str = "crates/posegate-site/src/controller_cost/figures.txt";
const COLUMNS: &str = "# What a gate in C takes, made by POSEGATE_BLESS=1 ./ci.sh costs. Flash and stack in bytes, calls in instructions of examples/c/robot.
# core level parts flash_of_gate flash_of_tracker stack_of_init stack_of_step stack_of_tracked init odometry fix late_fix step change
";
const CHANGE: &str = "posegate_gate_change_table";

/// Measures what a gate in C takes on each core, at both levels of optimization, with each set of parts, and compares it with the figures
/// from which `posegate table cost` and the documents take theirs. A figure may differ by 2 %, as by another compiler of C.
pub fn costs(_: &Arguments) -> Result {
    let mut report = Report::default();
    let found = measured(&archive::LEVELS, &mut report)?;
    if std::env::var_os("POSEGATE_BLESS").is_some() {
        files::write(FIGURES, format!("{COLUMNS}{}", found.concat()))?;
    }
    compare(&found, &mut report)?;
    bounds_hold_for_small_code(&mut report)?;
    report.finish()
}

/// Does what [`costs`] does, for the archives that are built for small code.
pub fn costs_of_small_code() -> Result {
    let mut report = Report::default();
    let found = measured(&["s"], &mut report)?;
    compare(&found, &mut report)?;
    report.finish()
}

/// Returns the rows of levels of optimization.
fn measured(levels: &[&str], report: &mut Report) -> Result<Vec<String>> {
    let mut found = Vec::new();
    for board in &BOARDS {
        for level in levels {
            // A gate of boxes cannot take the dock of the program: its calls take no more than those of the next.
            let mut calls = String::new();
            for parts in ["turning", "boxes", "all"] {
                let row = costs_of(board, parts, level, &mut calls, report)?;
                found.push(format!("{} {level} {parts} {row}\n", board.core));
            }
        }
    }
    Ok(found)
}

/// Compares each row with the figures.
fn compare(found: &[String], report: &mut Report) -> Result {
    let known = files::read(FIGURES)?;
    let differ = |(a, b): (&str, &str)| match (a.parse::<u64>(), b.parse::<u64>()) {
        (Ok(a), Ok(b)) => 50 * a.abs_diff(b) > a,
        _ => a != b,
    };
    let mut wrong = 0;
    for row in found {
        let words = || row.split_whitespace();
        let is_known = known.lines().any(|line| {
            line.split(' ').count() == words().count() && !line.split(' ').zip(words()).any(differ)
        });
        if !is_known {
            eprintln!("measured, and not in {FIGURES}: {row}");
            wrong += 1;
        }
    }
    let name = "rows of figures that differ from what is measured";
    report.at_most(name, wrong, "rows", 0);
    Ok(())
}

/// Searches for the dearest evaluations with small code, and compares each with the bound of its table. `posegate table cost` scales the
/// bounds of the second evaluation, which are those of a Cortex-M4F, to other cores.
fn bounds_hold_for_small_code(report: &mut Report) -> Result {
    const SEARCH: &str = "count_instructions";
    for (target, machine) in board::CORES {
        let elf = board::build(Level::Small, target, SEARCH)?;
        let search = board::emulate(machine, &elf, 600).words("-icount shift=6");
        let (mut found, mut beyond, mut compared) = (0, 0, 0);
        // The goals of the search are those of fast code: only its figures count.
        for line in search.quiet()?.text.lines() {
            let Ok(figure) = serde_json::from_str::<Value>(line) else {
                continue;
            };
            let (name, value) = (&figure["name"], figure["value"].as_u64().unwrap_or(0));
            let name = name.as_str().unwrap_or_default();
            if name.contains("most expensive") && !name.contains("run,") {
                found = value;
            } else if name.contains("bound by the table") {
                let is_second = name.contains("second opinion");
                let times = if is_second && target == "thumbv6m-none-eabi" {
                    4
                } else {
                    1
                };
                beyond += u64::from(found == 0 || found > times * value);
                compared += 1;
            }
        }
        let name = format!("bounds of a table that are too low for small code, {target}");
        report.at_most(&name, beyond, "bounds", 0);
        report.at_least(&format!("{name}: compared"), compared, "bounds", 10);
    }
    Ok(())
}

/// Returns a row of figures after its names.
fn costs_of(
    board: &Board,
    parts: &str,
    level: &str,
    calls: &mut String,
    report: &mut Report,
) -> Result<String> {
    if parts != "boxes" {
        let figures = of_board(board, parts, level, report)?;
        let figure = |name: &str| {
            let found = figures.iter().find(|(own, _)| own == name);
            found
                .map(|(_, value)| value.to_string())
                .ok_or_else(|| format!("the program prints no {name}"))
        };
        let names = [
            "init, most",
            "odometry, most",
            "fix, most",
            "fix that is 62 increments old, most",
            "step on the tracker, most",
            "change of table, most",
        ];
        *calls = names
            .map(figure)
            .into_iter()
            .collect::<std::result::Result<Vec<_>, _>>()?
            .join(" ");
    }
    let archive = archive::build(board.core()?, features(parts)?, level)?;
    let gate: Vec<&str> = flash::GATE.into_iter().chain([CHANGE]).collect();
    let both: Vec<&str> = gate.iter().copied().chain(flash::TRACKER).collect();
    let flash_of_gate = flash::of(&archive, &gate)?;
    let flash_of_tracker = flash::of(&archive, &both)? - flash_of_gate;
    let folder = Scratch::new()?;
    let elf = folder.join("all.elf");
    flash::link(&archive, &both, "", &elf)?;
    let objdump = board.core()?.tool("objdump")?;
    let program = Program::of(&objdump.words("-d --no-show-raw-insn").arg(&elf).read()?);
    let deepest = |names: &[&str]| -> Result<u64> {
        names
            .iter()
            .try_fold(0, |most, name| Ok(program.deepest(name)?.max(most)))
    };
    let [start, cycle @ ..] = &flash::GATE;
    let init = deepest(&[start, CHANGE])?;
    let step = deepest(cycle)?;
    let tracked = deepest(&flash::TRACKER)?;
    Ok(format!(
        "{flash_of_gate} {flash_of_tracker} {init} {step} {tracked} {calls}"
    ))
}

/// Returns the features of a set of parts.
pub fn features(parts: &str) -> Result<&'static str> {
    archive::PARTS
        .iter()
        .find(|(name, _)| *name == parts)
        .map(|(_, features)| *features)
        .ok_or_else(|| format!("no parts {parts}").into())
}

/// Returns the header with the task digests that the program expects of its tables.
fn digests() -> Result<String> {
    let mut header =
        "/* The task digests of the tables in this folder: posegate table info TABLE. */\n"
            .to_owned();
    for task in TASKS {
        let bytes = files::bytes(table(task))?;
        let digest = bytes.get(96..128).ok_or("a table has a digest")?;
        let digest: Vec<String> = digest.iter().map(|byte| format!("0x{byte:02x}")).collect();
        let name = task.to_uppercase().replace('-', "_");
        writeln!(
            header,
            "#define TASK_DIGEST_OF_{name} {{{}}}",
            digest.join(", ")
        )?;
    }
    Ok(header)
}

/// Fails if a table of the program is not what the program `posegate` builds of its site file.
fn tables() -> Result {
    build_suite("--bin posegate").run()?;
    let folder = Scratch::new()?;
    for task in TASKS {
        let (committed, fresh) = (table(task), folder.join(task));
        program_at(&files::tested("posegate"))
            .words("table build --task")
            .args([task, "-o"])
            .arg(&fresh)
            .arg(format!("{FOLDER}/site.toml"))
            .run()?;
        if files::bytes(&committed)? != files::bytes(&fresh)? {
            return Err(format!("{0} is not what its site file makes: posegate table build {FOLDER}/site.toml --task {task} -o {0}", committed.display()).into());
        }
    }
    if files::read(DIGESTS)? != digests()? {
        return Err(format!(
            "{DIGESTS} does not have the digests of the tables:\n{}",
            digests()?
        )
        .into());
    }
    Ok(())
}

fn table(task: &str) -> PathBuf {
    Path::new(FOLDER).join(task).with_extension("posegate")
}
