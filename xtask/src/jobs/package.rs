//! `package`: checks the crates as a user gets them.

use crate::arguments::Arguments;
use crate::files::{self, Scratch, target_folder};
use crate::need::{self, THUMBS};
use crate::report::Report;
use crate::shell::{Cmd, Result, cmd, program_at};
use std::path::{Path, PathBuf};

/// The crates that are published, each after those that it needs.
const CRATES: [&str; 10] = [
    "posegate",
    "posegate-files",
    "posegate-learn",
    "posegate-site",
    "posegate-replay",
    "posegate-place",
    "posegate-plan",
    "posegate-show",
    "posegate-c",
    "posegate-cli",
];
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
/// What the package of the C boundary may contain in addition: what its README names, and what these files need.
const BOUNDARY: &[&str] = &[".cargo/config.toml", "examples/", "include/posegate.h"];
/// Files that must be in the packages, by their paths in the repository.
const NEEDED: [&str; 5] = [
    "CHANGELOG.md",
    "include/posegate.h",
    "crates/posegate-c/include/posegate.h",
    "crates/posegate-c/examples/c/docking_gate.c",
    "crates/posegate-show/src/page/core.wasm",
];
/// What packages have of the files at the top of the repository: a package, and files, or folders that end in `/`. They are copied
/// when the packages are made: links would break if a repository is unpacked without them.
const SHARED: [(&str, &[&str]); 9] = [
    ("posegate-files", &LICENCES),
    ("posegate-learn", &LICENCES),
    ("posegate-site", &LICENCES),
    ("posegate-replay", &LICENCES),
    ("posegate-place", &LICENCES),
    ("posegate-plan", &LICENCES),
    ("posegate-show", &LICENCES),
    ("posegate-cli", &LICENCES),
    (
        "posegate-c",
        &[
            LICENCES[0],
            LICENCES[1],
            "include/",
            "examples/c/",
            "examples/sites/",
            "examples/tables/",
        ],
    ),
];
const LICENCES: [&str; 2] = ["LICENSE-MIT", "LICENSE-APACHE"];
/// Files that each package must have.
const OF_EACH: [&str; 3] = ["README.md", LICENCES[0], LICENCES[1]];
/// Keys that each manifest must have.
const METADATA: [&str; 7] = [
    "version",
    "rust-version",
    "license",
    "description",
    "readme",
    "keywords",
    "categories",
];

/// Checks the packages:
///
/// - they contain nothing that a user does not need, and every file that the pages link;
/// - each has its metadata, its README and both licences;
/// - the program is installed from them and runs;
/// - the package of the C boundary, by itself, builds the examples in C, and the smallest gate runs;
/// - a user's firmware links against the library, at the addresses of its own memory.x.
///
/// The crates need each other in versions that are not published yet, so cargo cannot install one package alone. Therefore the
/// packages are unpacked as in the repository, the library with the others in `crates/`, and the library's manifest names them
/// as a workspace. Everything is built from files of the packages; only the versions of third-party crates are those of the
/// repository's Cargo.lock.
///
/// With a folder as its argument, the job leaves there the repository as it is packed: `cargo publish -p NAME` runs in it.
pub fn package(arguments: &Arguments) -> Result {
    need::targets(&THUMBS)?;
    need::qemu()?;
    need::command("arm-none-eabi-readelf", "binutils-arm-none-eabi")?;
    need::command("arm-none-eabi-gcc", "gcc-arm-none-eabi")?;
    need::command("make", "make")?;
    let folder = Scratch::new()?;
    let mut report = Report::default();
    let staged = arguments.path(0).unwrap_or_else(|| folder.join("staged"));
    stage(&staged)?;
    let unpacked = unpacked(&staged, &folder, &mut report)?;
    for name in NEEDED {
        report.require(
            unpacked.join(name).is_file(),
            format_args!("the package has no {name}"),
        );
    }
    check_links(&unpacked, &mut report)?;
    // Before the builds, which take minutes.
    std::mem::take(&mut report).finish()?;

    run_boundary(&folder, &unpacked)?;
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

/// Builds and runs the examples in C from the package of the C boundary, outside of any workspace.
fn run_boundary(folder: &Scratch, unpacked: &Path) -> Result {
    let alone = folder.join("posegate-c");
    cmd("cp -r")
        .arg(unpacked.join("crates/posegate-c"))
        .arg(&alone)
        .run()?;
    let mut manifest = files::read(alone.join("Cargo.toml"))?;
    manifest.push_str(&format!(
        "\n[workspace]\n\n[patch.crates-io]\nposegate = {{ path = {:?} }}\n",
        unpacked.display().to_string()
    ));
    files::write(alone.join("Cargo.toml"), manifest)?;
    // `posegate` comes from a folder, not from the registry as in the package's own lock file.
    files::copy(unpacked.join("Cargo.lock"), alone.join("Cargo.lock"))?;
    cmd("cargo update --quiet --workspace --manifest-path")
        .arg(alone.join("Cargo.toml"))
        .run()?;
    with_target_folder(cmd("make -C").arg(alone.join("examples/c")))
        .arg(format!("OUT={}", folder.join("c").display()))
        .arg("run")
        .run()
}

/// Sets cargo's target folder, for commands in another folder.
fn with_target_folder(command: Cmd) -> Cmd {
    command.env("CARGO_TARGET_DIR", target_folder())
}

/// Copies the repository's files into a new folder, and into each package what it shares with the top.
fn stage(staged: &Path) -> Result {
    if staged.exists() {
        return Err(format!("{} exists: name a new folder", staged.display()).into());
    }
    let listed = cmd("git ls-files -z --cached --others --exclude-standard").read()?;
    // A file that was removed and not yet committed is listed too.
    let files: Vec<&str> = listed
        .split_terminator('\0')
        .filter(|file| Path::new(file).is_file())
        .collect();
    let copied = |from: &str, to: &Path| -> Result {
        files::make_folder(to.parent().unwrap_or(to))?;
        files::copy(from, to)
    };
    for file in &files {
        copied(file, &staged.join(file))?;
    }
    for (package, shared) in SHARED {
        for name in shared {
            let mut count = 0;
            for file in files.iter().filter(|file| is_allowed(file, &[name])) {
                copied(file, &staged.join("crates").join(package).join(file))?;
                count += 1;
            }
            if count == 0 {
                return Err(format!("{package} shares {name}, which the repository lacks").into());
            }
        }
    }
    Ok(())
}

/// Packs the crates, checks their content, and unpacks them as in the repository. Returns that folder.
fn unpacked(staged: &Path, folder: &Scratch, report: &mut Report) -> Result<PathBuf> {
    let mut pack = cmd("cargo package --no-verify --allow-dirty");
    for name in CRATES {
        pack = pack.arg("-p").arg(name);
    }
    // In a separate folder: cargo's folder may contain packages of other versions.
    pack.arg("--target-dir")
        .arg(folder.join("packed"))
        .dir(staged)
        .run()?;
    let packed = files::files_ending(folder.join("packed/package"), ".crate")?;
    if packed.len() != CRATES.len() {
        return Err(format!("{} packages, not {}", packed.len(), CRATES.len()).into());
    }
    let root = folder.join("posegate");
    let mut bytes = 0;
    for name in CRATES {
        let is_package = |path: &&PathBuf| version_of(&files::name(path), name).is_some();
        let archive = packed
            .iter()
            .find(is_package)
            .ok_or_else(|| format!("no package of {name}"))?;
        let size = files::size(archive)?;
        report.note(&format!("package {name}"), size, "B");
        bytes += size;
        let allowed = match name {
            "posegate" => LIBRARY.to_vec(),
            "posegate-c" => [OTHERS, BOUNDARY].concat(),
            _ => OTHERS.to_vec(),
        };
        let list = cmd("tar -tzf").arg(archive).read()?;
        let foreign: Vec<&str> = list
            .lines()
            .filter_map(|path| path.split_once('/'))
            .map(|(_, path)| path)
            .filter(|path| !is_allowed(path, &allowed))
            .collect();
        report.require(
            foreign.is_empty(),
            format_args!(
                "the package {name} contains files that a user does not need:\n{}\n",
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
        for file in OF_EACH {
            report.require(
                to.join(file).is_file(),
                format_args!("the package {name} has no {file}"),
            );
        }
        for key in missing(&files::read(to.join("Cargo.toml"))?) {
            report.require(false, format_args!("the manifest of {name} has no `{key}`"));
        }
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

/// Returns the keys of [`METADATA`] that a packed manifest lacks.
fn missing(manifest: &str) -> Vec<&'static str> {
    let package = manifest.split("\n[package]\n").nth(1).unwrap_or_default();
    let package = package.split("\n[").next().unwrap_or_default();
    let has = |key: &str| {
        let value = package
            .lines()
            .find_map(|line| line.strip_prefix(key)?.strip_prefix(" = "));
        value.is_some_and(|value| !["\"\"", "[]", "false"].contains(&value))
    };
    METADATA.into_iter().filter(|key| !has(key)).collect()
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
    pages.extend(
        CRATES[1..]
            .iter()
            .map(|name| root.join("crates").join(name).join("README.md")),
    );
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

/// Returns the files that a page links, also those at its end (`[name]: file`).
fn links(page: &str) -> Vec<&str> {
    let inline = page
        .split("](")
        .skip(1)
        .filter_map(|rest| rest.split(')').next());
    let named = page
        .lines()
        .filter_map(|line| line.strip_prefix('[')?.split_once("]: "))
        .map(|(_, link)| link);
    inline
        .chain(named)
        .filter_map(|link| link.split('#').next())
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
        assert_eq!(version_of("posegate-site-0.1.0.crate", "posegate"), None);
    }

    #[test]
    fn unneeded_files_are_found() {
        assert!(is_allowed("src/gate/mod.rs", OTHERS) && is_allowed("Cargo.toml", OTHERS));
        assert!(!is_allowed("tests/cases.rs", OTHERS) && !is_allowed("srcs/a", OTHERS));
    }

    #[test]
    fn missing_metadata_is_found() {
        let good = "# comment\n\n[package]\nversion = \"0.1.0\"\nrust-version = \"1.93\"\nlicense = \"MIT\"\ndescription = \"x\"\n\
                    readme = \"README.md\"\nkeywords = [\ncategories = [\n\n[lib]\nname = \"x\"\n";
        assert_eq!(missing(good), [""; 0]);
        let bad = good
            .replace("readme = \"README.md\"", "readme = false")
            .replace("license", "licence");
        assert_eq!(missing(&bad), ["license", "readme"]);
        let later = good.replace("keywords = [\n", "") + "keywords = [\n";
        assert_eq!(missing(&later), ["keywords"]);
    }

    /// The package of the C boundary is built by itself with the profile of the workspace.
    #[test]
    fn profile_of_the_boundary_equals_that_of_the_workspace() {
        let profile = |path: &str| -> String {
            let text = files::read(files::root().join(path)).unwrap();
            let (_, rest) = text.split_once("[profile.firmware]\n").unwrap();
            rest.lines()
                .map(str::trim)
                .take_while(|line| !line.is_empty())
                .flat_map(|line| [line, "\n"])
                .collect()
        };
        let own = profile("crates/posegate-c/.cargo/config.toml");
        assert!(own.contains("panic = \"abort\""), "{own}");
        assert_eq!(own, profile("Cargo.toml"));
    }

    #[test]
    fn links_are_files_of_the_package() {
        let page = "[a](docs/a.md#part) ![b](b.svg) [c](https://example.org/x) [d](#here) [e][f]\n\n[f]: docs/f.md#part\n";
        assert_eq!(links(page), ["docs/a.md", "b.svg", "docs/f.md"]);
    }

    #[test]
    fn address_follows_the_type_of_the_section() {
        let list = "  [ 0]                   NULL            00000000 000000\n  [ 1] .vector_table     PROGBITS        08040000 010000 000400\n";
        assert_eq!(address(list, ".vector_table").as_deref(), Some("08040000"));
        assert_eq!(address(list, ".text"), None);
    }
}
