//! `package`: checks the crates as a user gets them.

use crate::arguments::Arguments;
use crate::files::{self, Scratch, target_folder};
use crate::need::{self, THUMBS};
use crate::report::Report;
use crate::shell::{Cmd, Result, cmd, program_at};
use std::path::{Path, PathBuf};

/// The crates that are published, each after those that it needs.
const CRATES: [&str; 4] = ["posegate", "posegate-host", "posegate-c", "posegate-cli"];
const MOST_BYTES: u64 = 1_300_000;
/// What the library's package may contain: files, and folders that end in `/`.
const LIBRARY: &[&str] = &[
    ".cargo/config.toml",
    ".cargo_vcs_info.json",
    "ARCHITECTURE.md",
    "CHANGELOG.md",
    "CONTRIBUTING.md",
    "README.md",
    "Cargo.lock",
    "Cargo.toml",
    "Cargo.toml.orig",
    "LICENSE-APACHE",
    "LICENSE-MIT",
    "build.rs",
    "cbindgen.toml",
    "memory.x",
    "benches/",
    "docs/",
    "examples/",
    "include/",
    "memory/",
    "src/",
];
/// The allowed content of the packages of the other crates.
const OTHERS: &[&str] = &[
    ".cargo_vcs_info.json",
    "Cargo.lock",
    "Cargo.toml",
    "Cargo.toml.orig",
    "README.md",
    "LICENSE-APACHE",
    "LICENSE-MIT",
    "src/",
];
/// Files that must be in the packages, by their paths in the repository.
const NEEDED: [&str; 6] = [
    "README.md",
    "CHANGELOG.md",
    "LICENSE-MIT",
    "LICENSE-APACHE",
    "include/posegate.h",
    "crates/posegate-host/src/page/core.wasm",
];

/// Checks the packages:
///
/// - they contain nothing that a user does not need, and every file that the pages link;
/// - the program is installed from them and runs, and the smallest gate in C is built from them and runs;
/// - a user's firmware links against the library, at the addresses of its own memory.x.
///
/// The crates need each other in versions that are not published yet, so cargo cannot install one package alone. Therefore the
/// packages are unpacked as in the repository, the library with the others in `crates/`, and the library's manifest names them
/// as a workspace. Everything is built from files of the packages; only the versions of third-party crates are those of the
/// repository's Cargo.lock.
pub fn package(_: &Arguments) -> Result {
    need::targets(&THUMBS)?;
    need::qemu()?;
    need::command("arm-none-eabi-readelf", "binutils-arm-none-eabi")?;
    need::command("arm-none-eabi-gcc", "gcc-arm-none-eabi")?;
    need::command("make", "make")?;
    let folder = Scratch::new()?;
    let mut report = Report::default();
    let unpacked = unpacked(&folder, &mut report)?;
    for name in NEEDED {
        report.require(
            unpacked.join(name).is_file(),
            format_args!("the package has no {name}"),
        );
    }
    check_links(&unpacked, &mut report)?;
    // Before the builds, which take minutes.
    std::mem::take(&mut report).finish()?;

    with_target_folder(cmd("make -C").arg(unpacked.join("examples/c")))
        .arg(format!("OUT={}", folder.join("c").display()))
        .arg("run")
        .run()?;
    with_target_folder(
        cmd("cargo install --locked --path").arg(unpacked.join("crates/posegate-cli")),
    )
    .arg("--root")
    .arg(folder.join("root"))
    .run()?;
    for line in ["init site.toml", "check site.toml"] {
        program_at(&folder.join("root/bin/posegate"))
            .words(line)
            .dir(folder.path())
            .run()?;
    }
    let start = own_firmware(&folder)?;
    report.same_text(
        "vector table of a firmware with a memory.x of its own",
        &start,
        "address",
        "08040000",
    );
    report.finish()
}

/// Sets cargo's target folder, for commands in another folder.
fn with_target_folder(command: Cmd) -> Cmd {
    command.env("CARGO_TARGET_DIR", target_folder())
}

/// Packs the crates, checks their content, and unpacks them as in the repository. Returns that folder.
fn unpacked(folder: &Scratch, report: &mut Report) -> Result<PathBuf> {
    let mut pack = cmd("cargo package --no-verify --allow-dirty");
    for name in CRATES {
        pack = pack.arg("-p").arg(name);
    }
    // In a separate folder: cargo's folder may contain packages of other versions.
    pack.arg("--target-dir").arg(folder.join("packed")).run()?;
    let packed = files::files_ending(folder.join("packed/package"), ".crate")?;
    if packed.len() != CRATES.len() {
        return Err(format!("{} packages, not {}", packed.len(), CRATES.len()).into());
    }
    let root = folder.join("posegate");
    let mut bytes = 0;
    for name in CRATES {
        let is_this = |path: &&PathBuf| version_of(&files::name(path), name).is_some();
        let archive = packed
            .iter()
            .find(is_this)
            .ok_or_else(|| format!("no package of {name}"))?;
        let size = files::size(archive)?;
        report.note(&format!("package {name}"), size, "B");
        bytes += size;
        let allowed = if name == "posegate" { LIBRARY } else { OTHERS };
        let list = cmd("tar -tzf").arg(archive).read()?;
        let foreign: Vec<&str> = list
            .lines()
            .filter_map(|path| path.split_once('/'))
            .map(|(_, path)| path)
            .filter(|path| !is_allowed(path, allowed))
            .collect();
        report.require(
            foreign.is_empty(),
            format_args!(
                "in the package {name}, and of no use to a user:\n{}\n",
                foreign.join("\n")
            ),
        );
        let to = if name == "posegate" {
            root.clone()
        } else {
            root.join("crates").join(name)
        };
        files::make_folder(&to)?;
        cmd("tar --strip-components=1 -xzf")
            .arg(archive)
            .arg("-C")
            .arg(&to)
            .run()?;
    }
    report.at_most("package", bytes, "B", MOST_BYTES);
    let mut manifest = files::read(root.join("Cargo.toml"))?;
    manifest.push_str("\n[workspace]\nmembers = [\"crates/*\"]\n\n[patch.crates-io]\nposegate = { path = \".\" }\n");
    for name in &CRATES[1..] {
        manifest.push_str(&format!("{name} = {{ path = \"crates/{name}\" }}\n"));
    }
    files::write(root.join("Cargo.toml"), manifest)?;
    files::copy("Cargo.lock", root.join("Cargo.lock"))?;
    // Removes from the lock file what only the repository's own tests need.
    cmd("cargo update --quiet --workspace --manifest-path")
        .arg(root.join("Cargo.toml"))
        .run()?;
    Ok(root)
}

/// Returns the version in the name of a crate's package.
fn version_of<'a>(file: &'a str, name: &str) -> Option<&'a str> {
    let version = file
        .strip_prefix(name)?
        .strip_prefix('-')?
        .strip_suffix(".crate")?;
    version
        .starts_with(|c: char| c.is_ascii_digit())
        .then_some(version)
}

fn is_allowed(path: &str, allowed: &[&str]) -> bool {
    allowed
        .iter()
        .any(|name| path == *name || (name.ends_with('/') && path.starts_with(name)))
}

/// Checks that every linked file of a page exists.
fn check_links(root: &Path, report: &mut Report) -> Result {
    let mut pages = files::files_ending(root.join("docs"), ".md")?;
    pages.extend(["README.md", "CONTRIBUTING.md"].map(|name| root.join(name)));
    let mut count = 0;
    for page in pages {
        let text = files::read(&page)?;
        let folder = page.parent().unwrap_or(root);
        for link in links(&text) {
            let page = page.strip_prefix(root).unwrap_or(&page).display();
            report.require(
                folder.join(link).exists(),
                format_args!("the package has no {link}, which its {page} links"),
            );
            count += 1;
        }
    }
    report.require(count >= 20, format_args!("the pages have {count} links"));
    Ok(())
}

/// Returns the files that a page links.
fn links(page: &str) -> Vec<&str> {
    let targets = page
        .split("](")
        .skip(1)
        .filter_map(|rest| rest.split([')', '#']).next());
    targets
        .filter(|link| !link.is_empty() && !link.contains("://"))
        .collect()
}

/// Builds a firmware with its own memory.x, and returns the address of its vector table.
fn own_firmware(folder: &Scratch) -> Result<String> {
    const TARGET: &str = "thumbv7em-none-eabihf";
    let firmware = folder.join("firmware");
    files::make_folder(firmware.join("src"))?;
    files::write(
        firmware.join("Cargo.toml"),
        include_str!("own_firmware/manifest.toml"),
    )?;
    files::write(
        firmware.join("src/main.rs"),
        include_str!("own_firmware/main.rs.txt"),
    )?;
    files::write(
        firmware.join("memory.x"),
        "MEMORY { FLASH : ORIGIN = 0x08040000, LENGTH = 256K RAM : ORIGIN = 0x20010000, LENGTH = 32K }\n",
    )?;
    let flags = format!(
        "-C link-arg=-L{} -C link-arg=-Tlink.x -C link-arg=--nmagic",
        firmware.display()
    );
    with_target_folder(cmd(&format!("cargo build --release --target {TARGET}")))
        .env("RUSTFLAGS", flags)
        .dir(&firmware)
        .run()?;
    let elf = target_folder().join(TARGET).join("release/own-firmware");
    let sections = cmd("arm-none-eabi-readelf -S -W").arg(elf).read()?;
    address(&sections, ".vector_table").ok_or_else(|| "the firmware has no .vector_table".into())
}

/// Returns the address of a section, by the list that readelf prints.
fn address(sections: &str, name: &str) -> Option<String> {
    let line = sections
        .lines()
        .find(|line| line.split_whitespace().any(|word| word == name))?;
    let mut words = line
        .split_whitespace()
        .skip_while(|word| *word != "PROGBITS");
    words.nth(1).map(str::to_owned)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn packages_are_distinguished_by_their_names() {
        assert_eq!(
            version_of("posegate-0.1.0.crate", "posegate"),
            Some("0.1.0")
        );
        assert_eq!(version_of("posegate-host-0.1.0.crate", "posegate"), None);
    }

    #[test]
    fn files_of_no_use_are_found() {
        assert!(is_allowed("src/gate/mod.rs", OTHERS) && is_allowed("Cargo.toml", OTHERS));
        assert!(!is_allowed("tests/cases.rs", OTHERS) && !is_allowed("srcs/a", OTHERS));
    }

    #[test]
    fn links_are_files_of_the_package() {
        let page = "[a](docs/a.md#part) ![b](b.svg) [c](https://example.org/x) [d](#here)";
        assert_eq!(links(page), ["docs/a.md", "b.svg"]);
    }

    #[test]
    fn address_follows_the_type_of_the_section() {
        let list = "  [ 0]                   NULL            00000000 000000\n  [ 1] .vector_table     PROGBITS        08040000 010000 000400\n";
        assert_eq!(address(list, ".vector_table").as_deref(), Some("08040000"));
        assert_eq!(address(list, ".text"), None);
    }
}
