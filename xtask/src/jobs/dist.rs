//! `dist`: the files of a release, built, installed into empty roots by the README's commands, and run there.

pub mod archives;
mod build;
pub mod install;
mod sbom;

use crate::archive::TARGETS;
use crate::arguments::Arguments;
use crate::files::{self, Scratch, target_folder};
use crate::need;
use crate::report::Report;
use crate::shell::{Result, cmd, say};
use build::Sources;
use std::fs;
use std::path::Path;

/// What the archives of a release are named by.
const SUMS: &str = "SHA256SUMS";
/// The default number of builds.
const BUILDS: u64 = 2;
/// The commands of the README that only this job runs: they need the files of a release.
const INSTALLERS: [&str; 4] = [
    "sha256sum ",
    "pip install posegate-",
    "sudo dpkg ",
    "tar -xzf ",
];

/// Returns `true` if a command of the README is one that this job runs.
pub fn installs(line: &str) -> bool {
    INSTALLERS.iter().any(|start| line.starts_with(start))
}

/// Builds the files of a release into a folder (`target/dist` if none is given): the wheel, the static programs, the package for
/// Debian, the archive for C, a bill of materials, and the checksums of all. Installs each into an empty root by the README's commands,
/// and runs it there.
///
/// Everything is built twice, the second time from a copy of the sources in another folder: both must be equal, byte for byte. The
/// second argument is the number of builds.
pub fn dist(given: &Arguments) -> Result {
    let folder = given
        .path(0)
        .unwrap_or_else(|| target_folder().join("dist"));
    let builds = given.number(1, BUILDS)?;
    tools()?;
    let version = version()?;
    let mut report = Report::default();
    clear(&folder)?;
    let target = target_folder().join("dist-build");
    make(
        &Sources::new(files::root(), &target, &version)?,
        &folder,
        &mut report,
    )?;
    for file in files::files_ending(&folder, "")? {
        let name = files::name(&file);
        report.note(&format!("dist: {name}"), files::size(&file)?, "B");
    }
    install::install(&folder, &version, &mut report)?;
    for number in 2..=builds {
        say(&format!("build {number}, in another folder"));
        let scratch = Scratch::new()?;
        let copy = scratch.join("sources");
        build::copy_sources(&copy)?;
        let again = scratch.join("dist");
        files::make_folder(&again)?;
        let target = scratch.join("target");
        make(
            &Sources::new(&copy, &target, &version)?,
            &again,
            &mut Report::default(),
        )?;
        compare(&folder, &again, &mut report)?;
    }
    report.finish()
}

/// Installs what the job needs.
fn tools() -> Result {
    need::targets(&[build::STATIC])?;
    need::targets(&TARGETS)?;
    need::qemu()?;
    for (command, package) in [
        ("arm-none-eabi-gcc", "gcc-arm-none-eabi"),
        ("riscv64-unknown-elf-gcc", "gcc-riscv64-unknown-elf"),
        ("qemu-system-riscv32", "qemu-system-misc"),
        ("make", "make"),
        ("dpkg-deb", "dpkg"),
        ("python3", "python3"),
        ("unshare", "util-linux"),
    ] {
        need::command(command, package)?;
    }
    Ok(())
}

/// Makes all files of a release in an empty folder.
fn make(sources: &Sources, folder: &Path, report: &mut Report) -> Result {
    let programs = build::programs(sources)?;
    archives::programs(sources, &programs, folder)?;
    archives::debian(sources, &programs, folder)?;
    let archive = build::archives(sources)?;
    archives::c(sources, &archive.files, folder)?;
    build::wheel(sources, folder)?;
    sbom::write(
        sources,
        &[&programs.crates[..], &archive.crates[..]].concat(),
        folder,
        report,
    )?;
    say("checksums");
    let names: Vec<String> = files::files_ending(folder, "")?
        .iter()
        .map(|path| files::name(path))
        .filter(|name| name != SUMS)
        .collect();
    let sums = cmd("sha256sum --").args(&names).dir(folder).read()?;
    files::write(folder.join(SUMS), sums)
}

/// Compares the files of two builds, byte for byte.
fn compare(first: &Path, second: &Path, report: &mut Report) -> Result {
    let names = |folder: &Path| -> Result<Vec<String>> {
        let files = files::files_ending(folder, "")?;
        Ok(files.iter().map(|path| files::name(path)).collect())
    };
    let expected = names(first)?;
    report.require(expected == names(second)?, "two builds made other files");
    let mut equal = 0;
    for name in &expected {
        let path = second.join(name);
        if path.is_file() && files::bytes(first.join(name))? == files::bytes(path)? {
            equal += 1;
        } else {
            eprintln!("two builds of {name} differ");
        }
    }
    report.at_least(
        "dist: files that are equal in two builds in two folders",
        equal,
        "files",
        expected.len(),
    );
    Ok(())
}

/// Returns the version, which all manifests must have.
pub fn version() -> Result<String> {
    let of = |path: &str| -> Result<String> {
        let text = files::read(path)?;
        let line = text
            .lines()
            .find_map(|line| line.strip_prefix("version = \""));
        let version = line.and_then(|rest| rest.strip_suffix('"'));
        Ok(version
            .ok_or_else(|| format!("{path}: no version"))?
            .to_owned())
    };
    let version = of("Cargo.toml")?;
    for path in [
        "crates/posegate-python/Cargo.toml",
        "crates/posegate-ros2/Cargo.toml",
    ] {
        let other = of(path)?;
        if other != version {
            return Err(format!("{path}: version {other}, and Cargo.toml has {version}").into());
        }
    }
    Ok(version)
}

/// Empties a folder of an earlier run of this job, or makes the folder.
fn clear(folder: &Path) -> Result {
    if folder.exists() {
        let is_ours = folder.join(SUMS).is_file() || fs::read_dir(folder)?.next().is_none();
        if !is_ours {
            return Err(format!(
                "{} has other files than a release: name an empty or a new folder",
                folder.display()
            )
            .into());
        }
        fs::remove_dir_all(folder)?;
    }
    files::make_folder(folder)?;
    // The mark of a folder of this job, also if it fails.
    files::write(folder.join(SUMS), "")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_installing_commands_are_left_to_this_job() {
        assert!(installs("sudo dpkg -i posegate_0.1.0-1_amd64.deb"));
        assert!(installs("pip install posegate-0.1.0-*.whl"));
        assert!(!installs("posegate demo -o x") && !installs("pip install maturin"));
    }

    #[test]
    fn release_with_differing_bytes_is_refused() {
        let folders = [Scratch::new().unwrap(), Scratch::new().unwrap()];
        for (folder, text) in folders.iter().zip(["one", "two"]) {
            files::write(folder.join("same"), "x").unwrap();
            files::write(folder.join("other"), text).unwrap();
        }
        let compared = |first: &Scratch, second: &Scratch| {
            let mut report = Report::default();
            compare(first.path(), second.path(), &mut report).unwrap();
            report.finish()
        };
        assert!(compared(&folders[0], &folders[0]).is_ok());
        assert!(compared(&folders[0], &folders[1]).is_err());
        fs::remove_file(folders[1].join("same")).unwrap();
        assert!(compared(&folders[0], &folders[1]).is_err());
    }

    /// The wheel contains the files of its own folder.
    #[test]
    fn licences_of_the_wheel_are_those_of_the_repository() {
        for name in archives::LICENCES {
            let own = files::root().join("crates/posegate-python").join(name);
            let top = files::root().join(name);
            assert!(
                files::bytes(&own).unwrap() == files::bytes(top).unwrap(),
                "copy {name} into crates/posegate-python"
            );
        }
    }

    #[test]
    fn folder_with_other_files_is_not_emptied() {
        let folder = Scratch::new().unwrap();
        files::write(folder.join("mine"), "x").unwrap();
        assert!(clear(folder.path()).is_err());
        files::write(folder.join(SUMS), "").unwrap();
        assert!(clear(folder.path()).is_ok() && !folder.join("mine").exists());
    }
}
