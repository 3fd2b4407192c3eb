//! Tools that jobs need and a machine may lack. They are installed, which is logged, or named with the command that
//! installs them.

use crate::files::target_folder;
use crate::shell::{Cmd, Result, cmd, program_at, say};
use std::path::{Path, PathBuf};

/// The cores that the checks of the library run on.
pub const THUMBS: [&str; 2] = ["thumbv6m-none-eabi", "thumbv7em-none-eabihf"];

/// Installs the missing ones of these Rust targets.
pub fn targets(names: &[&str]) -> Result {
    let sysroot = cmd("rustc --print sysroot").read()?;
    let libraries = Path::new(sysroot.trim()).join("lib/rustlib");
    for name in names {
        if !libraries.join(name).is_dir() {
            say(&format!("rustup target add {name}"));
            cmd("rustup target add").arg(name).run()?;
        }
    }
    Ok(())
}

/// Returns the linker that comes with the compiler.
pub fn linker() -> Result<Cmd> {
    let sysroot = cmd("rustc --print sysroot").read()?;
    let host = cmd("rustc --print host-tuple").read()?;
    let folder = Path::new(sysroot.trim()).join("lib/rustlib");
    Ok(program_at(&folder.join(host.trim()).join("bin/rust-lld")))
}

/// Installs the emulator if it is missing.
pub fn qemu() -> Result {
    command("qemu-system-arm", "qemu-system-arm")
}

/// Installs a package of the system if its command is missing.
pub fn command(name: &str, package: &str) -> Result {
    if exists(name) {
        return Ok(());
    }
    say(&format!("apt-get install -y {package}"));
    let is_root = cmd("id -u").read()?.trim() == "0";
    let sudo = if is_root { "" } else { "sudo " };
    cmd(&format!("{sudo}apt-get update -qq")).run()?;
    cmd(&format!("{sudo}apt-get install -y -qq {package}")).run()?;
    if exists(name) {
        return Ok(());
    }
    Err(format!("{name} is missing after: apt-get install -y {package}").into())
}

/// Installs a subcommand of cargo if it is missing.
pub fn cargo_command(name: &str) -> Result {
    if exists(name) {
        return Ok(());
    }
    say(&format!("cargo install {name} --locked"));
    cmd(&format!("cargo install {name} --locked")).run()
}

/// Returns the Python of an environment below the target folder, with these packages; `import` names modules whose import shows
/// that they are installed.
pub fn python(environment: &str, import: &str, packages: &str) -> Result<PathBuf> {
    let folder = target_folder().join(environment);
    let python = folder.join("bin/python");
    let has_packages = |python: &Path| -> Result<bool> {
        let import = format!("import {import}");
        Ok(python.exists() && program_at(python).arg("-c").arg(import).quiet()?.code == 0)
    };
    if has_packages(&python)? {
        return Ok(python);
    }
    command("python3", "python3")?;
    say(&format!("pip install {packages}"));
    let made = cmd("python3 -m venv").arg(&folder).code()?;
    if made != 0 {
        return Err("no venv: apt-get install -y python3-venv".into());
    }
    let pip = folder.join("bin/pip");
    if program_at(&pip)
        .words("install -q")
        .words(packages)
        .code()?
        != 0
        || !has_packages(&python)?
    {
        return Err(format!("missing: {} install {packages}", pip.display()).into());
    }
    Ok(python)
}

/// Returns `true` if a program of this name is on the search path.
pub fn exists(program: &str) -> bool {
    use std::os::unix::fs::PermissionsExt;
    let paths = std::env::var_os("PATH").unwrap_or_default();
    std::env::split_paths(&paths).any(|folder| {
        let metadata = folder.join(program).metadata();
        metadata.is_ok_and(|file| file.is_file() && file.permissions().mode() & 0o111 != 0)
    })
}
