//! `packages`: what build systems read in the release for C.

use crate::archive::{self, Core};
use crate::arguments::Arguments;
use crate::board;
use crate::files::{self, Scratch};
use crate::jobs::dist::{archives, install, version};
use crate::jobs::robot::features;
use crate::need;
use crate::report::Report;
use crate::shell::{Cmd, Result, cmd, program_at};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// The core whose programs run, and its board in the emulator.
const CORE: (&str, &str) = ("cortex-m4f", "mps2-an386");
/// The archives with which programs are linked: parts and level.
const LINKED: [(&str, &str); 2] = [("all", "3"), ("turning", "s")];
const SOURCES: [&str; 5] = [
    "docking_gate.c",
    "startup.c",
    "board.c",
    "robot.c",
    "tables.S",
];
/// The page with the lines of a user of CMake: first of an unpacked release, then of its file.
const PAGE: &str = "docs/for-c.md";
/// Prints the archive that is chosen, below `lib`.
const CHOICE: &str = r#"cmake_minimum_required(VERSION 3.16)
project(choice LANGUAGES NONE)
if(ZEPHYR)
  function(zephyr_link_libraries library)
    get_target_property(path ${library} IMPORTED_LOCATION)
    message(NOTICE "chosen ${path}")
  endfunction()
  add_subdirectory(${RELEASE}/zephyr zephyr)
else()
  find_package(posegate ${WANTED} REQUIRED COMPONENTS ${COMPONENTS} PATHS ${RELEASE})
  get_target_property(path posegate::posegate IMPORTED_LOCATION)
  message(NOTICE "chosen ${path}")
endif()
"#;
/// Options of CMake, and the archive that they choose or the reason why there is none.
const CHOICES: &str = "\
-DCMAKE_SYSTEM_PROCESSOR=cortex-m0plus => thumbv6m-none-eabi/all-3
-DCMAKE_SYSTEM_PROCESSOR=Cortex-M3 => thumbv7m-none-eabi/all-3
-DCMAKE_SYSTEM_PROCESSOR=cortex-m4 => thumbv7em-none-eabi/all-3
-DCMAKE_SYSTEM_PROCESSOR=cortex-m7 -DCMAKE_C_FLAGS=-mfloat-abi=hard => thumbv7em-none-eabihf/all-3
-DCMAKE_SYSTEM_PROCESSOR=cortex-m33 => thumbv8m.main-none-eabihf/all-3
-DCMAKE_SYSTEM_PROCESSOR=rv32imac => riscv32imc-unknown-none-elf/all-3
-DCMAKE_SYSTEM_PROCESSOR=arm -DCMAKE_C_FLAGS=-mcpu=cortex-m0plus => thumbv6m-none-eabi/all-3
-DCMAKE_C_FLAGS=-march=rv32imc => riscv32imc-unknown-none-elf/all-3
-DCMAKE_SYSTEM_PROCESSOR=arm -DPOSEGATE_CORE=cortex-m4f => thumbv7em-none-eabihf/all-3
-DPOSEGATE_CORE=cortex-m4 -DCMAKE_C_FLAGS=-mfloat-abi=hard => thumbv7em-none-eabi/all-3
-DPOSEGATE_CORE=cortex-m3 -DPOSEGATE_PARTS=boxes => thumbv7m-none-eabi/boxes-3
-DPOSEGATE_CORE=cortex-m3 -DPOSEGATE_LEVEL=s => thumbv7m-none-eabi/all-s
-DPOSEGATE_CORE=cortex-m3 -DCOMPONENTS=turning-s => thumbv7m-none-eabi/turning-s
-DPOSEGATE_CORE=cortex-m3 -DWANTED=0.1.0 => thumbv7m-none-eabi/all-3
-DPOSEGATE_CORE=cortex-m3 -DWANTED=0.2 => compatible with requested version
-DPOSEGATE_CORE=cortex-m3 -DWANTED=1.0 => compatible with requested version
-DPOSEGATE_CORE=cortex-m3 -DWANTED=0.1.7 => compatible with requested version
-DPOSEGATE_CORE=cortex-m3 -DCOMPONENTS=boxes-3;all-3 => no archive `boxes-3;all-3`
-DPOSEGATE_CORE=cortex-m3 -DPOSEGATE_PARTS=some => no archive `some-3`
-DCMAKE_SYSTEM_PROCESSOR=arm => no archive for the core `arm`
-DPOSEGATE_CORE=cortex-a7 => no archive for the core `cortex-a7`
-DZEPHYR=1 -DCONFIG_POSEGATE=y -DCONFIG_POSEGATE_PARTS=all -DCONFIG_CPU_CORTEX_M0PLUS=y => thumbv6m-none-eabi/all-3
-DZEPHYR=1 -DCONFIG_POSEGATE=y -DCONFIG_POSEGATE_PARTS=boxes -DCONFIG_CPU_CORTEX_M4=y -DCONFIG_POSEGATE_SMALL=y => thumbv7em-none-eabi/boxes-s
-DZEPHYR=1 -DCONFIG_POSEGATE=y -DCONFIG_POSEGATE_PARTS=turning -DCONFIG_CPU_CORTEX_M7=y -DCONFIG_FP_HARDABI=y => thumbv7em-none-eabihf/turning-3
-DZEPHYR=1 -DCONFIG_POSEGATE=y -DCONFIG_POSEGATE_PARTS=all -DCONFIG_CPU_CORTEX_M33=y -DCONFIG_FP_HARDABI=y => thumbv8m.main-none-eabihf/all-3
-DZEPHYR=1 -DCONFIG_POSEGATE=y -DCONFIG_POSEGATE_PARTS=all -DCONFIG_RISCV=y => riscv32imc-unknown-none-elf/all-3
";

/// Lays out the release for C and checks it as its users see it. Programs by `find_package`, by `FetchContent` and by pkg-config are
/// linked and run in an emulator. The choice of an archive is checked for every core, with empty files for the archives that no program
/// is linked with. The tools of Zephyr, Arduino and CMSIS-Pack do not run: what they read is parsed and compared with their rules.
pub fn packages(_: &Arguments) -> Result {
    for (command, package) in [
        ("cmake", "cmake"),
        ("pkg-config", "pkg-config"),
        ("xmllint", "libxml2-utils"),
    ] {
        need::command(command, package)?;
    }
    need::qemu()?;
    let scratch = Scratch::new()?;
    let version = version()?;
    let name = format!("posegate-c-{version}");
    let release = scratch.join(&name);
    archives::lay_out_c(files::root(), &version, &all_archives(&scratch)?, &release)?;
    let mut report = Report::default();
    let file = scratch.join(format!("{name}.tar.gz"));
    cmd("tar -czf")
        .arg(&file)
        .arg("-C")
        .arg(scratch.path())
        .arg(&name)
        .run()?;
    let page = files::read(PAGE)?;
    let mut blocks = page.split("```cmake\n").skip(1);
    let mut lines = || -> Result<String> {
        let block = blocks.next().and_then(|rest| rest.split("```").next());
        let block = block.ok_or_else(|| format!("{PAGE}: no two blocks of cmake"))?;
        Ok(block.replace("PATH/", &format!("{}/", scratch.path().display())))
    };
    let programs = [
        (
            "find_package",
            project(&scratch.join("found"), &lines()?, &release)?,
        ),
        (
            "FetchContent",
            project(&scratch.join("fetched"), &lines()?, &release)?,
        ),
        ("pkg-config", pkg_config(&release, &scratch)?),
    ];
    for (name, elf) in &programs {
        let output = board::emulate(CORE.1, elf, 120).read()?;
        report.same_text(
            &format!("packages: the gate by {name}"),
            &output,
            "output",
            install::GATE,
        );
    }
    let [small, usual, _] = programs.each_ref().map(|(_, elf)| elf);
    report.less_than(
        "packages: flash of a gate with the component turning-s",
        core()?.flash(small)?,
        "B",
        core()?.flash(usual)?,
        core()?.flash(usual)?,
    );
    choices(&release, &scratch, &mut report)?;
    pack(&release, &mut report)?;
    let python = need::python(
        "package-tools",
        "kconfiglib, platformio, yaml",
        "kconfiglib==14.1.0 platformio==6.2.0 pyyaml==6.0.4",
    )?;
    let script = scratch.join("manifests.py");
    files::write(&script, include_str!("packages/manifests.py"))?;
    program_at(&python).arg(script).arg(&release).run()?;
    report.finish()
}

fn core() -> Result<&'static Core> {
    Core::named(CORE.0)
}

/// Returns the archives of a release by name: those with which programs are linked, and an empty file for all others.
fn all_archives(scratch: &Scratch) -> Result<Vec<(String, PathBuf)>> {
    let empty = scratch.join("empty.a");
    files::write(&empty, "")?;
    let mut all = Vec::new();
    for core in &archive::CORES {
        for (parts, _) in archive::PARTS {
            for level in archive::LEVELS {
                let is_linked = core.name == CORE.0 && LINKED.contains(&(parts, level));
                let path = if is_linked {
                    archive::build(core, features(parts)?, level)?
                } else {
                    empty.clone()
                };
                all.push((format!("{}/{parts}-{level}", core.target), path));
            }
        }
    }
    Ok(all)
}

/// Returns what a compiler must be given for the smallest gate of a release: its options, and its sources.
fn gate(release: &Path) -> (String, Vec<PathBuf>) {
    let examples = release.join("examples/c");
    let options = format!(
        "-std=c99 -O2 -ffreestanding -ffunction-sections -nostdlib -T {0}/link.ld -Wl,--gc-sections -Wl,-z,noexecstack -I{0} -Wa,-I,{1}",
        examples.display(),
        release.display()
    );
    (options, SOURCES.map(|name| examples.join(name)).into())
}

/// Builds a user's project with these lines, which link the smallest gate, and returns its program.
fn project(folder: &Path, lines: &str, release: &Path) -> Result<PathBuf> {
    let core = core()?;
    let (options, sources) = gate(release);
    let sources: Vec<String> = sources
        .iter()
        .map(|path| path.display().to_string())
        .collect();
    files::make_folder(folder)?;
    let text = format!(
        "cmake_minimum_required(VERSION 3.16)\nproject(firmware C ASM)\nadd_executable(firmware ${{SOURCES}})\n{lines}\ntarget_link_libraries(firmware PRIVATE c)\n"
    );
    files::write(folder.join("CMakeLists.txt"), text)?;
    let built = folder.join("build");
    cmd("cmake -DCMAKE_SYSTEM_NAME=Generic -DCMAKE_SYSTEM_PROCESSOR=arm -DCMAKE_TRY_COMPILE_TARGET_TYPE=STATIC_LIBRARY")
        .words("-DCMAKE_C_COMPILER=arm-none-eabi-gcc -DCMAKE_ASM_COMPILER=arm-none-eabi-gcc")
        .args(["C", "ASM"].map(|language| format!("-DCMAKE_{language}_FLAGS={} {options}", core.flags)))
        .arg(format!("-DSOURCES={}", sources.join(";")))
        .arg("-S")
        .arg(folder)
        .arg("-B")
        .arg(&built)
        .run()?;
    cmd("cmake --build").arg(&built).run()?;
    Ok(built.join("firmware"))
}

/// Links the smallest gate with the options of pkg-config. If no core is named, it must not link.
fn pkg_config(release: &Path, scratch: &Scratch) -> Result<PathBuf> {
    let core = core()?;
    let elf = scratch.join("pkg_config.elf");
    let link = |variables: &[String]| -> Result<Cmd> {
        let found = cmd("pkg-config --cflags --libs posegate")
            .args(variables)
            .env("PKG_CONFIG_PATH", release.join("lib/pkgconfig"))
            .read()?;
        let (options, sources) = gate(release);
        let link = core.tool("gcc")?.words(core.flags).words(&options);
        Ok(link.args(sources).words(&found).words("-lc -o").arg(&elf))
    };
    let refused = link(&[])?.quiet()?;
    if refused.code == 0 || !refused.text.contains("DEFINE_VARIABLE_CORE") {
        return Err(format!("pkg-config without a core: {}", refused.text).into());
    }
    let (parts, level) = LINKED[1];
    link(&[
        format!("--define-variable=core={}", core.target),
        format!("--define-variable=set={parts}-{level}"),
    ])?
    .run()?;
    Ok(elf)
}

/// Checks the archive that CMake chooses for each core.
fn choices(release: &Path, scratch: &Scratch, report: &mut Report) -> Result {
    let project = scratch.join("choice");
    files::make_folder(&project)?;
    files::write(project.join("CMakeLists.txt"), CHOICE)?;
    for (number, line) in CHOICES.lines().enumerate() {
        let (options, expected) = line.split_once(" => ").ok_or("a choice has no =>")?;
        let outcome = cmd("cmake -DCMAKE_SYSTEM_NAME=Generic")
            .words(options)
            .arg(format!("-DRELEASE={}", release.display()))
            .arg("-S")
            .arg(&project)
            .arg("-B")
            .arg(project.join(number.to_string()))
            .quiet()?;
        let chosen = format!(
            "chosen {}/lib/{expected}/{}\n",
            release.display(),
            archive::FILE
        );
        // CMake breaks the lines of its errors.
        let words: Vec<&str> = outcome.text.split_whitespace().collect();
        let holds = match outcome.code {
            0 => outcome.text.contains(&chosen),
            _ => words.join(" ").contains(expected),
        };
        report.require(
            holds,
            format_args!(
                "{options}: {expected} is expected, and CMake prints {}",
                outcome.text
            ),
        );
    }
    report.at_least(
        "packages: choices of an archive by CMake",
        CHOICES.lines().count(),
        "choices",
        26,
    );
    Ok(())
}

/// Checks the description for CMSIS-Pack: its elements, and that each file is in the release.
fn pack(release: &Path, report: &mut Report) -> Result {
    let description = release.join("Posegate.posegate.pdsc");
    let query = |path: &str| cmd("xmllint --xpath").arg(path).arg(&description).read();
    for element in [
        "vendor",
        "name",
        "description",
        "url",
        "license",
        "releases/release[@version]",
    ] {
        let found = query(&format!("count(/package/{element})"))?;
        report.require(
            found.trim() == "1",
            format_args!("the pack has {found} of {element}"),
        );
    }
    let names = query("/package/components/component/files/file/@name")?;
    let names: BTreeSet<&str> = names.split('"').skip(1).step_by(2).collect();
    for name in &names {
        report.require(
            release.join(name).is_file(),
            format_args!("no {name}, which the pack names"),
        );
    }
    let conditions = query("/package/components//@condition")?;
    for id in conditions.split('"').skip(1).step_by(2) {
        let count = query(&format!("count(/package/conditions/condition[@id='{id}'])"))?;
        report.require(
            count.trim() == "1",
            format_args!("the pack has {count} conditions {id}"),
        );
    }
    // Arm's cores only, and the header.
    let most = (archive::CORES.len() - 1) * archive::PARTS.len() * archive::LEVELS.len() + 1;
    report.at_least(
        "packages: files that the pack names",
        names.len(),
        "files",
        most,
    );
    Ok(())
}
