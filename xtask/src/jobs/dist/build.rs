//! Builds what a release contains: the same bytes in every folder.

use crate::archive;
use crate::files;
use crate::need;
use crate::shell::{Cmd, Result, cmd, say};
use serde_json::Value;
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// The target of the static programs.
pub const STATIC: &str = "x86_64-unknown-linux-musl";
/// The target of the wheel.
pub const WHEEL: &str = "x86_64-unknown-linux-gnu";
/// The oldest systems on which the wheel must run: glibc 2.17.
const WHEEL_TAG: &str = "manylinux2014";

/// Where every build finds the sources. Cargo puts the path of a package outside of its workspace into the names of symbols. The
/// node and the wheel are such workspaces. So each build sees the sources at this path, by a separate mount.
const PLACE: &str = "/tmp/posegate-dist";
/// Runs a command where the folder that is the first argument is mounted at [`PLACE`]. No administrator is needed.
const MOUNTED: &str =
    "mkdir -p \"$0\" && mount --bind \"$1\" \"$0\" && cd \"$0\" && shift && exec \"$@\"";

/// Where a build reads and writes.
pub struct Sources {
    /// The repository, or a copy of it.
    pub folder: PathBuf,
    /// What cargo builds into.
    target: PathBuf,
    pub version: String,
    /// The time of the last commit, which all files get.
    pub epoch: String,
}

/// A crate that cargo built: its name and version.
pub type Crate = (String, String);

/// Files that were built, and the crates in them or needed to build them.
pub struct Built {
    pub files: Vec<(String, PathBuf)>,
    pub crates: Vec<(&'static str, BTreeSet<Crate>)>,
}

impl Sources {
    pub fn new(folder: &Path, target: &Path, version: &str) -> Result<Self> {
        let epoch = cmd("git log -1 --format=%ct").read()?;
        Ok(Self {
            folder: folder.into(),
            target: target.into(),
            version: version.into(),
            epoch: epoch.trim().into(),
        })
    }

    /// Returns a command of cargo or of maturin whose output does not depend on the folders. Its words follow.
    fn reproducible(&self, program: &Path) -> Result<Cmd> {
        let home = cargo_home()?;
        // The last match counts.
        let mut flags = vec![
            format!("--remap-path-prefix={}=cargo", home.display()),
            format!("--remap-path-prefix={}=target", self.target.display()),
            format!("--remap-path-prefix={PLACE}=posegate"),
        ];
        // The folder of a registry has the name of its host, which may be a mirror.
        let registries = fs::read_dir(home.join("registry/src"));
        for registry in registries.into_iter().flatten() {
            let folder = registry?.path();
            flags.push(format!("--remap-path-prefix={}=registry", folder.display()));
        }
        Ok(cmd("unshare --map-root-user --mount sh -c")
            .arg(MOUNTED)
            .arg(PLACE)
            .arg(&self.folder)
            .arg(program)
            .env("CARGO_ENCODED_RUSTFLAGS", flags.join("\u{1f}"))
            .env("CARGO_TARGET_DIR", &self.target)
            .env("CARGO_INCREMENTAL", "0")
            .env("CARGO_PROFILE_RELEASE_STRIP", "symbols")
            .env("SOURCE_DATE_EPOCH", &self.epoch))
    }

    /// Returns the crates that cargo compiles by a command of these words.
    fn cargo(&self, words: &str) -> Result<BTreeSet<Crate>> {
        let lines = self
            .reproducible(Path::new("cargo"))?
            .words(words)
            .words("--locked --message-format json-render-diagnostics")
            .read()?;
        lines
            .lines()
            .filter_map(|line| compiled(line).transpose())
            .collect()
    }
}

fn cargo_home() -> Result<PathBuf> {
    std::env::var_os("CARGO_HOME")
        .map(PathBuf::from)
        .or_else(|| std::env::var_os("HOME").map(|home| Path::new(&home).join(".cargo")))
        .ok_or_else(|| "neither CARGO_HOME nor HOME is set".into())
}

/// Fails if a built file names this machine's folders, or the host of a registry.
fn names_no_machine(sources: &Sources, files: &[(String, PathBuf)]) -> Result {
    let own = [
        cargo_home()?,
        sources.folder.clone(),
        sources.target.clone(),
    ];
    let own = own.iter().map(|path| path.display().to_string());
    let words: Vec<String> = own.chain(["registry/src/".into()]).collect();
    for (name, path) in files {
        let bytes = fs::read(path).map_err(|error| format!("{}: {error}", path.display()))?;
        if let Some(word) = words.iter().find(|word| contains(&bytes, word.as_bytes())) {
            return Err(format!("{name} contains `{word}`: a path of this machine").into());
        }
    }
    Ok(())
}

fn contains(bytes: &[u8], word: &[u8]) -> bool {
    bytes.windows(word.len()).any(|part| part == word)
}

/// Returns the crate that a line of cargo's messages reports as compiled.
fn compiled(line: &str) -> Result<Option<Crate>> {
    let message: Value = serde_json::from_str(line)?;
    if message["reason"] != "compiler-artifact" {
        return Ok(None);
    }
    let id = message["package_id"].as_str().unwrap_or_default();
    crate_of(id)
        .map(Some)
        .ok_or_else(|| format!("not the id of a package: {id}").into())
}

/// Reads `SOURCE#NAME@VERSION`, or `SOURCE/NAME#VERSION`.
fn crate_of(id: &str) -> Option<Crate> {
    let (source, rest) = id.rsplit_once('#')?;
    let (name, version) = match rest.split_once('@') {
        Some(both) => both,
        None => (source.rsplit('/').next()?, rest),
    };
    Some((name.into(), version.into()))
}

/// Builds the programs, static.
pub fn programs(sources: &Sources) -> Result<Built> {
    say("static programs");
    // SQLite, which reads bags of ROS 2, is compiled with the programs.
    need::command("musl-gcc", "musl-tools")?;
    let node = "--manifest-path crates/posegate-ros2/Cargo.toml";
    let crates = vec![
        (
            "posegate",
            sources.cargo(&format!(
                "build --release --target {STATIC} -p posegate-cli --bin posegate"
            ))?,
        ),
        (
            "posegate-node",
            sources.cargo(&format!(
                "build --release --target {STATIC} {node} --bin posegate-node"
            ))?,
        ),
    ];
    let file = |name: &str| {
        (
            name.to_owned(),
            sources.target.join(STATIC).join("release").join(name),
        )
    };
    let files = vec![file("posegate"), file("posegate-node")];
    names_no_machine(sources, &files)?;
    Ok(Built { files, crates })
}

/// Builds the archives for C: for each core, set of parts and level.
pub fn archives(sources: &Sources) -> Result<Built> {
    say("archives for C");
    let mut all = BTreeSet::new();
    let mut files = Vec::new();
    for core in &archive::CORES {
        for (parts, features) in archive::PARTS {
            for level in archive::LEVELS {
                let words = archive::words(core, features, level).join(" ");
                all.append(&mut sources.cargo(&words)?);
                let name = format!("{}/{parts}-{level}", core.target);
                let folder = sources.target.join("localized").join(&name);
                let localized = folder.join(archive::FILE);
                archive::localize(core, &archive::built(core, &sources.target), &localized)?;
                files.push((name, localized));
            }
        }
    }
    names_no_machine(sources, &files)?;
    Ok(Built {
        files,
        crates: vec![("posegate-c", all)],
    })
}

/// Builds the wheel into a folder. Zig's linker has the symbols of old systems.
pub fn wheel(sources: &Sources, folder: &Path) -> Result {
    say("wheel");
    let tools = need::python(
        "dist-tools",
        "maturin, ziglang",
        "maturin==1.16.0 ziglang==0.17.1",
    )?;
    // Zig is found as a module of the first Python.
    let bin = tools.parent().ok_or("no folder of Python")?.to_owned();
    let path = std::env::var_os("PATH").unwrap_or_default();
    let path = std::env::join_paths(std::iter::once(bin).chain(std::env::split_paths(&path)))?;
    sources
        .reproducible(&tools)?
        .words("-m maturin build --release --locked --zig --target")
        .words(&format!(
            "{WHEEL} --compatibility {WHEEL_TAG} -m crates/posegate-python/Cargo.toml -o"
        ))
        .arg(folder)
        .env("PATH", path)
        .run()
}

/// Copies the files of the repository into a new folder.
pub fn copy_sources(to: &Path) -> Result {
    let listed = cmd("git ls-files -z --cached --others --exclude-standard").read()?;
    for file in listed.split_terminator('\0') {
        let from = Path::new(file);
        // A file that was removed and not yet committed is listed too.
        if !from.is_file() {
            continue;
        }
        let to = to.join(file);
        files::make_folder(to.parent().unwrap_or(&to))?;
        fs::copy(from, &to).map_err(|error| format!("{file}: {error}"))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn path_in_a_file_is_found() {
        assert!(contains(
            b"\0/home/x/.cargo/registry/src/host/a.rs",
            b"registry/src/"
        ));
        assert!(!contains(b"registry/a.rs", b"registry/src/"));
        assert!(!contains(b"", b"x"));
    }

    #[test]
    fn crates_are_read_from_the_ids_of_packages() {
        let crate_of = |id| crate_of(id).unwrap();
        let expected = |name: &str, version: &str| (name.to_owned(), version.to_owned());
        assert_eq!(
            crate_of("registry+https://registry.example/index#serde@1.0.1"),
            expected("serde", "1.0.1")
        );
        assert_eq!(
            crate_of("path+file:///x/xtask#0.1.0"),
            expected("xtask", "0.1.0")
        );
        assert_eq!(
            crate_of("path+file:///x/main#posegate@0.1.0"),
            expected("posegate", "0.1.0")
        );
    }

    #[test]
    fn messages_without_a_crate_are_skipped() {
        assert_eq!(compiled(r#"{"reason": "build-finished"}"#).unwrap(), None);
        assert!(compiled("no json").is_err());
        assert!(compiled(r#"{"reason": "compiler-artifact", "package_id": "x"}"#).is_err());
    }
}
