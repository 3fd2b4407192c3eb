//! Packs what was built: archives and a package for Debian. Names, times, owners and modes are the same for everybody.

use super::build::{Built, Sources};
use crate::archive;
use crate::files::{self, Scratch};
use crate::shell::{Result, cmd, program_at, say};
use std::path::{Path, PathBuf};

pub const LICENCES: [&str; 2] = ["LICENSE-MIT", "LICENSE-APACHE"];
/// What a robot's integrator copies: files of the repository.
const FOR_ROS: [&str; 3] = [
    "crates/posegate-ros2/launch/posegate.launch.py",
    "crates/posegate-ros2/launch/posegate.yaml",
    "integrations/ros2/permit_listener.py",
];
/// What a firmware in C begins with: files of the repository, and folders that end in `/`.
const FOR_C: [&str; 5] = [
    "include/posegate.h",
    "examples/c/",
    "examples/sites/dock.toml",
    "examples/tables/",
    PACKAGES,
];
/// What build systems read: it lies at the top of the release, with the version instead of `@VERSION@`.
const PACKAGES: &str = "integrations/c/";
/// Where Arduino looks for an archive: the core, and the folder below `src` that its boards name. Boards with `softfp`, such as those
/// with a Cortex-M7, pass floats as those without a floating-point unit do.
const FOR_ARDUINO: [(&str, &str); 6] = [
    ("thumbv6m-none-eabi", "cortex-m0plus"),
    ("thumbv7m-none-eabi", "cortex-m3"),
    ("thumbv7em-none-eabi", "cortex-m4"),
    ("thumbv7em-none-eabihf", "cortex-m4/fpv4-sp-d16-hard"),
    ("thumbv7em-none-eabi", "cortex-m7"),
    ("thumbv8m.main-none-eabihf", "cortex-m33/fpv5-sp-d16-hard"),
];
/// What of `examples/c/` needs the repository.
const NOT_FOR_C: [&str; 4] = [
    "vectors.c",
    "vector_tables.S",
    "CMakeLists.txt",
    "arm-none-eabi.cmake",
];

/// Packs the static programs.
pub fn programs(sources: &Sources, built: &Built, folder: &Path) -> Result {
    say("archive of the programs");
    let scratch = Scratch::new()?;
    let name = format!("posegate-{}-x86_64-linux", sources.version);
    let top = scratch.join(&name);
    for (program, path) in &built.files {
        put(path, &top.join(program))?;
    }
    for licence in LICENCES {
        put(&sources.folder.join(licence), &top.join(licence))?;
    }
    for file in FOR_ROS {
        let from = sources.folder.join(file);
        put(&from, &top.join("ros2").join(files::name(&from)))?;
    }
    descriptions(built, &top.join("share"))?;
    modes(&top, &["posegate", "posegate-node"])?;
    tar(sources, &scratch, &name, folder)
}

/// Packs the header, the archives, the examples in C, and what build systems read.
pub fn c(sources: &Sources, archives: &[(String, PathBuf)], folder: &Path) -> Result {
    say("archive for C");
    let scratch = Scratch::new()?;
    let name = format!("posegate-c-{}", sources.version);
    let top = scratch.join(&name);
    lay_out_c(&sources.folder, &sources.version, archives, &top)?;
    modes(&top, &[])?;
    tar(sources, &scratch, &name, folder)
}

/// Writes the folder of the release for C, with archives that are named `TARGET/PARTS-LEVEL`.
pub fn lay_out_c(
    repository: &Path,
    version: &str,
    archives: &[(String, PathBuf)],
    top: &Path,
) -> Result {
    let listed = cmd("git ls-files -z --").args(FOR_C).read()?;
    let mut count = 0;
    for file in listed.split_terminator('\0') {
        let from = repository.join(file);
        if let Some(file) = file.strip_prefix(PACKAGES) {
            let to = top.join(file);
            files::make_folder(to.parent().unwrap_or(top))?;
            files::write(to, files::read(from)?.replace("@VERSION@", version))?;
        } else if !NOT_FOR_C.iter().any(|end| file.ends_with(end)) {
            put(&from, &top.join(file))?;
        }
        count += 1;
    }
    if count < 24 {
        return Err(format!("{count} files for C").into());
    }
    let header = repository.join("include/posegate.h");
    put(&header, &top.join("src/posegate.h"))?;
    for (name, archive) in archives {
        put(archive, &top.join("lib").join(name).join(archive::FILE))?;
        let Some((target, set)) = name.split_once('/') else {
            return Err(format!("no set of parts in the name {name}").into());
        };
        if set == archive::USUAL {
            put(archive, &top.join("lib").join(target).join(archive::FILE))?;
            for (_, folder) in FOR_ARDUINO.iter().filter(|(own, _)| *own == target) {
                put(archive, &top.join("src").join(folder).join(archive::FILE))?;
            }
        }
    }
    for licence in LICENCES {
        put(&repository.join(licence), &top.join(licence))?;
    }
    let readme = include_str!("readme_c.md").replace("@VERSION@", version);
    files::write(top.join("README.md"), readme)
}

/// Makes the package for Debian and its relatives. The programs are static, so it depends on nothing.
pub fn debian(sources: &Sources, built: &Built, folder: &Path) -> Result {
    say("package for Debian");
    let scratch = Scratch::new()?;
    let version = format!("{}-1", sources.version);
    let root = scratch.join("root");
    for (program, path) in &built.files {
        put(path, &root.join("usr/bin").join(program))?;
    }
    let share = root.join("usr/share");
    descriptions(built, &share)?;
    let doc = share.join("doc/posegate");
    for file in FOR_ROS {
        let from = sources.folder.join(file);
        put(&from, &doc.join("examples").join(files::name(&from)))?;
    }
    let mit = files::read(sources.folder.join(LICENCES[0]))?;
    let copyright = include_str!("copyright.txt").replace("@MIT@", &indented(&mit));
    files::write(doc.join("copyright"), copyright)?;
    put(&sources.folder.join("CHANGELOG.md"), &doc.join("changelog"))?;
    cmd("gzip -9n").arg(doc.join("changelog")).run()?;
    let kilobytes: u64 = files::files_below(&root)
        .iter()
        .map(|path| files::size(path).map(|bytes| bytes.div_ceil(1024)))
        .sum::<Result<u64>>()?;
    let control = include_str!("control.txt")
        .replace("@VERSION@", &version)
        .replace("@KILOBYTES@", &kilobytes.to_string());
    files::make_folder(root.join("DEBIAN"))?;
    files::write(root.join("DEBIAN/control"), control)?;
    let mut sums = String::new();
    let mut installed = files::files_below(&root.join("usr"));
    installed.sort();
    for path in installed {
        let name = path.strip_prefix(&root)?.to_owned();
        sums.push_str(&cmd("md5sum --").arg(&name).dir(&root).unlogged().read()?);
    }
    files::write(root.join("DEBIAN/md5sums"), sums)?;
    modes(&root, &["usr/bin/posegate", "usr/bin/posegate-node"])?;
    cmd("dpkg-deb --root-owner-group -Zgzip -z9 --build")
        .arg(&root)
        .arg(folder.join(format!("posegate_{version}_amd64.deb")))
        .env("SOURCE_DATE_EPOCH", &sources.epoch)
        .run()
}

/// Writes the manual pages and the completions of shells, by the program that was built.
fn descriptions(built: &Built, share: &Path) -> Result {
    let (_, program) = built.files.first().ok_or("no program was built")?;
    let manual = share.join("man/man1");
    files::make_folder(&manual)?;
    program_at(program).words("--man").arg(&manual).run()?;
    let pages = files::files_ending(&manual, ".1")?;
    cmd("gzip -9n").args(&pages).unlogged().run()?;
    for (shell, path) in [
        ("bash", "bash-completion/completions/posegate"),
        ("zsh", "zsh/vendor-completions/_posegate"),
        ("fish", "fish/vendor_completions.d/posegate.fish"),
    ] {
        let path = share.join(path);
        files::make_folder(path.parent().unwrap_or(&path))?;
        let text = program_at(program)
            .words("--completions")
            .arg(shell)
            .read()?;
        files::write(&path, &text)?;
    }
    Ok(())
}

fn put(from: &Path, to: &Path) -> Result {
    files::make_folder(to.parent().unwrap_or(to))?;
    files::copy(from, to)
}

/// Sets the modes of all files and folders, whatever the umask of whoever builds.
fn modes(top: &Path, programs: &[&str]) -> Result {
    cmd("chmod -R u=rwX,go=rX").arg(top).run()?;
    for file in files::files_below(top) {
        let name = file.strip_prefix(top)?;
        let is_program = programs.iter().any(|program| name == Path::new(program));
        let mode = if is_program { "755" } else { "644" };
        cmd("chmod").arg(mode).arg(&file).unlogged().run()?;
    }
    Ok(())
}

fn tar(sources: &Sources, scratch: &Scratch, name: &str, folder: &Path) -> Result {
    let tar = scratch.join(format!("{name}.tar"));
    cmd("tar --format=gnu --sort=name --owner=0 --group=0 --numeric-owner")
        .arg(format!("--mtime=@{}", sources.epoch))
        .arg("-cf")
        .arg(&tar)
        .arg("-C")
        .arg(scratch.path())
        .arg(name)
        .run()?;
    cmd("gzip -9n").arg(&tar).run()?;
    let packed = format!("{name}.tar.gz");
    files::copy(scratch.join(&packed), folder.join(&packed))
}

/// Returns a text as Debian's copyright files have it: indented, with a dot on each empty line.
fn indented(text: &str) -> String {
    let lines = text.trim_end().lines();
    let lines: Vec<String> = lines
        .map(|line| {
            if line.trim().is_empty() {
                " .".into()
            } else {
                format!(" {line}")
            }
        })
        .collect();
    lines.join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn empty_lines_of_a_licence_have_a_dot() {
        assert_eq!(indented("a\n\nb\n"), " a\n .\n b");
    }
}
