//! `c`: the C boundary.

use crate::arguments::Arguments;
use crate::board::{self, CORES, Level};
use crate::files::{self, Scratch, target_folder};
use crate::jobs::test::{ran, suite};
use crate::need::{self, THUMBS};
use crate::report::Report;
use crate::shell::{Cmd, Result, cmd};
use std::collections::BTreeSet;
use std::path::Path;

const HEADER: &str = "include/posegate.h";
/// Compilers that must take the header without a warning, and its language.
const COMPILERS: [(&str, &str); 4] = [
    ("gcc -std=c99", "c"),
    ("g++ -std=c++11", "c++"),
    ("arm-none-eabi-gcc -std=c99", "c"),
    ("arm-none-eabi-g++ -std=c++11", "c++"),
];

/// Checks that the header is current and clean, and that misuse is refused. Builds C firmware by Make and by CMake. It must answer
/// the vector file and the serial line as the firmware in Rust does.
pub fn c(_: &Arguments) -> Result {
    need::targets(&THUMBS)?;
    need::qemu()?;
    for (command, package) in [
        ("arm-none-eabi-gcc", "gcc-arm-none-eabi"),
        ("arm-none-eabi-g++", "libstdc++-arm-none-eabi-newlib"),
        ("gcc", "gcc"),
        ("g++", "g++"),
        ("make", "make"),
        ("cmake", "cmake"),
    ] {
        need::command(command, package)?;
    }
    ran(
        suite("--test c_boundary --test c_header --test c_overlap --test c_sequencer"),
        1,
    )?;
    for (compiler, language) in COMPILERS {
        cmd(compiler)
            .words(&format!("-x {language} -Wall -Wextra -pedantic -Wconversion -Wshadow -Wundef -Werror -fsyntax-only {HEADER}"))
            .run()?;
    }
    let report = Report::default();
    let folder = Scratch::new()?;
    for (target, machine) in CORES {
        let made = folder.join("make").join(target);
        with_target_folder(cmd("make -C examples/c"))
            .arg(format!("TARGET={target}"))
            .arg(format!("OUT={}", made.display()))
            .run()?;
        archive(target, &made, &report)?;
        let configured = folder.join("cmake").join(target);
        cmd("cmake -S examples/c --toolchain arm-none-eabi.cmake -B")
            .arg(&configured)
            .arg(format!("-DPOSEGATE_TARGET={target}"))
            .arg(format!(
                "-DPOSEGATE_CARGO_DIR={}",
                target_folder().display()
            ))
            .run()?;
        with_target_folder(cmd("cmake --build"))
            .arg(&configured)
            .run()?;
        let rust = emulated(machine, &board::build(Level::Fast, target, "vectors")?)?;
        for built in [&made, &configured] {
            for example in ["docking_gate", "controller"] {
                board::emulate(machine, &built.join(format!("{example}.elf")), 600).run()?;
            }
        }
        // Both link the same archive: one of them answers the vectors.
        let line = emulated(machine, &made.join("vectors.elf"))?;
        if line != rust {
            return Err(format!("C: {line}\nRust: {rust}").into());
        }
        println!(
            "{}",
            line.trim_end().replacen("vectors", "vectors in C,", 1)
        );
    }

    added_to_a_project(&folder)?;

    // The smallest gate opens and closes, and the bench answers, as those in Rust do.
    let tests = suite("--test docking_gate --test uart_replay");
    ran(with_target_folder(tests).env("POSEGATE_FIRMWARE", "c"), 2)?;
    report.finish()
}

/// Builds a project with its own toolchain that adds `examples/c`, calls the archive, and does not ask for the examples.
fn added_to_a_project(folder: &Scratch) -> Result {
    let (project, built) = (folder.join("project"), folder.join("project/build"));
    std::fs::create_dir_all(&project)?;
    let examples = std::env::current_dir()?.join("examples/c");
    let text = format!(
        "cmake_minimum_required(VERSION 3.21)\nproject(firmware LANGUAGES C)\nset(POSEGATE_TARGET thumbv6m-none-eabi)\n\
         add_subdirectory({} posegate)\nadd_executable(firmware.elf main.c)\ntarget_link_libraries(firmware.elf PRIVATE posegate)\n\
         target_link_options(firmware.elf PRIVATE -nostdlib -Wl,-e,main -Wl,--gc-sections)\n",
        examples.display()
    );
    files::write(project.join("CMakeLists.txt"), text)?;
    let main = "#include \"posegate.h\"\nint main(void) { return posegate_abi_version() != POSEGATE_ABI_VERSION; }\n";
    files::write(project.join("main.c"), main)?;
    cmd("cmake -DCMAKE_SYSTEM_NAME=Generic -DCMAKE_C_COMPILER=arm-none-eabi-gcc -DCMAKE_TRY_COMPILE_TARGET_TYPE=STATIC_LIBRARY")
        .arg("-DCMAKE_C_FLAGS=-mcpu=cortex-m0plus -mthumb")
        .arg(format!("-DPOSEGATE_CARGO_DIR={}", target_folder().display()))
        .arg("-S")
        .arg(&project)
        .arg("-B")
        .arg(&built)
        .run()?;
    with_target_folder(cmd("cmake --build")).arg(&built).run()?;
    if !built.join("firmware.elf").is_file() || built.join("posegate/controller.elf").exists() {
        return Err("a project that adds examples/c has another result".into());
    }
    Ok(())
}

fn with_target_folder(command: Cmd) -> Cmd {
    command.env("CARGO_TARGET_DIR", target_folder())
}

fn emulated(machine: &str, elf: &Path) -> Result<String> {
    board::emulate(machine, elf, 600).read()
}

/// Links every function of the header without a C library: no symbol is undefined, and no panic, allocator or defmt can be reached.
fn archive(target: &str, out: &Path, report: &Report) -> Result {
    let archive = target_folder()
        .join(target)
        .join("firmware/libposegate_c.a");
    let core = match target {
        "thumbv6m-none-eabi" => "-mcpu=cortex-m0plus -mfloat-abi=soft",
        _ => "-mcpu=cortex-m4 -mfpu=fpv4-sp-d16 -mfloat-abi=hard",
    };
    let link = |name: &str, functions: &[&str]| -> Result<std::path::PathBuf> {
        let elf = out.join(name);
        cmd("arm-none-eabi-gcc")
            .words(core)
            .words("-mthumb -nostdlib -T examples/c/link.ld -Wl,--gc-sections -Wl,-z,noexecstack -Wl,-e,posegate_abi_version")
            .args(functions.iter().map(|function| format!("-Wl,-u,{function}")))
            .arg(&archive)
            .arg("-o")
            .arg(&elf)
            .run()?;
        Ok(elf)
    };
    let header = files::read(HEADER)?;
    let functions = functions(&header);
    if functions.len() < 25 {
        return Err(format!(
            "{HEADER} declares {} functions, of at least 25",
            functions.len()
        )
        .into());
    }
    let every = link("every.elf", &functions.iter().copied().collect::<Vec<_>>())?;
    let symbols = cmd("arm-none-eabi-nm -C").arg(every).read()?;
    for name in &functions {
        if !symbols
            .lines()
            .any(|line| line.ends_with(&format!(" T {name}")))
        {
            return Err(format!("not in the archive: {name}").into());
        }
    }
    let foreign = [" U ", "panic", "defmt", "__rust_alloc", "__rg_", "unwind"];
    let found: Vec<&str> = symbols
        .lines()
        .filter(|line| foreign.iter().any(|word| line.contains(word)))
        .collect();
    if !found.is_empty() {
        return Err(format!(
            "{}\nin the archive for {target}: see above",
            found.join("\n")
        )
        .into());
    }
    report.note(
        &format!("functions of the C boundary that link alone, {target}"),
        functions.len(),
        "functions",
    );
    Ok(())
}

/// Returns the names of the header's functions.
fn functions(header: &str) -> BTreeSet<&str> {
    let is_name = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_';
    let calls = header.match_indices("posegate_").filter_map(|(at, _)| {
        let is_start = !header[..at].ends_with(|c: char| c.is_ascii_alphanumeric() || c == '_');
        let rest = &header[at..];
        let (name, after) = rest.split_at(rest.find(|c| !is_name(c))?);
        (is_start && after.starts_with('(')).then_some(name)
    });
    calls.collect()
}

#[cfg(test)]
mod tests {
    use super::functions;

    #[test]
    fn functions_are_names_before_a_parenthesis() {
        let header = "posegate_status posegate_gate_step(struct posegate_gate *gate);\n#define X_posegate_y(\n/* posegate_gate_step() */ posegate_abi_version(void)";
        let found: Vec<&str> = functions(header).into_iter().collect();
        assert_eq!(found, ["posegate_abi_version", "posegate_gate_step"]);
    }
}
