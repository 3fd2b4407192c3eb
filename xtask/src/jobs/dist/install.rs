//! Installs a release into empty roots by the commands of the README, and runs it there.

use super::{SUMS, installs};
use crate::archive::TARGETS;
use crate::files::{self, Scratch};
use crate::report::Report;
use crate::shell::{Cmd, Result, cmd, program_at, say};
use std::path::{Path, PathBuf};

/// What the smallest gate in C prints on every core.
pub const GATE: &str = "500 ms: open\n1500 ms: closed, not_contained\n2050 ms: open\n3110 ms: closed, silent\n59 reports\n";
/// Starts the node, waits until it decides, stops it, and returns its exit code. `$0` is the folder of the root.
const RUN_NODE: &str = r#"
"$@" 2> "$0/node.log" & node=$!
until grep -q 'decides on the task `dock`' "$0/node.log"; do
    if ! kill -0 $node; then cat "$0/node.log" >&2; exit 1; fi
    sleep 0.1
done
kill -TERM $node
wait $node
"#;
/// A verdict in Python, with a table of the wheel's own.
const VERDICT: &str = "import posegate, sys
table = posegate.Site.open(sys.argv[1]).build('dock')
covariance = [[1e-4, 0, 0], [0, 1e-4, 0], [0, 0, 1e-4]]
assert table.decide(0.01, 0.0, 0.0, covariance).permit
assert table.decide(0.07, 0.0, 0.0, covariance).reason == 'not_contained'";

/// Runs the commands of the README's first block in a folder with the files of the release, and then what they have installed.
pub fn install(release: &Path, version: &str, report: &mut Report) -> Result {
    let scratch = Scratch::new()?;
    let folder = scratch.join("release");
    files::make_folder(&folder)?;
    for file in files::files_ending(release, "")? {
        files::copy(&file, folder.join(files::name(&file)))?;
    }
    let debian = empty_debian(&scratch)?;
    say("a fresh environment of Python");
    let environment = scratch.join("python");
    cmd("python3 -m venv").arg(&environment).run()?;
    let path = std::env::var_os("PATH").unwrap_or_default();
    let path = std::iter::once(environment.join("bin")).chain(std::env::split_paths(&path));
    let path = std::env::join_paths(path)?;
    say("commands of the README");
    let lines = commands(&files::read("README.md")?)?;
    for line in &lines {
        // Into an empty root instead of this machine, and without an administrator.
        let there = format!("unshare --map-root-user dpkg --root='{}'", debian.display());
        let line = line.replacen("sudo dpkg", &there, 1);
        cmd("bash -c")
            .arg(line)
            .env("PATH", &path)
            .dir(&folder)
            .run()?;
    }
    report.at_least(
        "dist: commands of the README that install",
        lines.len(),
        "commands",
        5,
    );
    all_are_summed(&folder)?;

    say("the wheel");
    let python = environment.join("bin/python");
    let demo = scratch.join("demo");
    program_at(&environment.join("bin/posegate"))
        .words("demo -o")
        .arg(&demo)
        .run()?;
    // Without the repository's own module in sight.
    program_at(&python)
        .words("-I -c")
        .arg(VERDICT)
        .arg(demo.join("site.toml"))
        .run()?;

    say("the static programs");
    let empty = scratch.join("empty");
    let name = format!("posegate-{version}-x86_64-linux");
    files::make_folder(&empty)?;
    cmd("mv").arg(folder.join(&name)).arg(&empty).run()?;
    run_programs(&empty, &format!("/{name}/"), version)?;

    say("the package for Debian");
    run_programs(&debian, "/usr/bin/", version)?;
    remove_package(&debian)?;

    say("the archive for C");
    let c = folder.join(format!("posegate-c-{version}"));
    for core in TARGETS {
        run_gate(&c, core)?;
    }
    report.at_least(
        "dist: cores on which the smallest gate in C runs",
        TARGETS.len(),
        "cores",
        6,
    );
    Ok(())
}

/// Returns the commands of the first block of the README.
fn commands(readme: &str) -> Result<Vec<String>> {
    let block = readme
        .split("\n```sh\n")
        .nth(1)
        .and_then(|rest| rest.split("\n```").next());
    let block = block.ok_or("README.md: no block of commands")?;
    let mut found = Vec::new();
    for line in block.lines() {
        let line = line.split('#').next().unwrap_or_default().trim();
        if !installs(line) {
            return Err(format!("README.md: a command that installs nothing: {line}").into());
        }
        found.push(line.to_owned());
    }
    Ok(found)
}

/// Makes a root with nothing in it but the lists of dpkg.
fn empty_debian(scratch: &Scratch) -> Result<PathBuf> {
    let root = scratch.join("debian");
    for folder in ["info", "updates", "triggers"] {
        files::make_folder(root.join("var/lib/dpkg").join(folder))?;
    }
    files::write(root.join("var/lib/dpkg/status"), "")?;
    Ok(root)
}

/// Checks that the sums name every file of the release.
fn all_are_summed(folder: &Path) -> Result {
    let sums = files::read(folder.join(SUMS))?;
    for file in files::files_ending(folder, "")? {
        let name = files::name(&file);
        if name != SUMS
            && !sums
                .lines()
                .any(|line| line.ends_with(&format!("  {name}")))
        {
            return Err(format!("{SUMS} does not name {name}").into());
        }
    }
    Ok(())
}

/// Runs the program that follows within the root that follows. No administrator is needed.
const WITHIN: &str = "unshare --map-root-user --root";

/// Returns a command of a program within a root, in which there is nothing else.
fn within(root: &Path, program: &str) -> Cmd {
    cmd(WITHIN).arg(root).arg(program)
}

/// Makes tables and decides in a root, and starts the node there.
fn run_programs(root: &Path, folder: &str, version: &str) -> Result {
    let program = format!("{folder}posegate");
    let output = within(root, &program).arg("--version").read()?;
    if output.trim() != format!("posegate {version}") {
        return Err(format!("the program prints the version `{}`", output.trim()).into());
    }
    within(root, &program).words("demo -o /demo").run()?;
    within(root, &program)
        .words("table verify /demo/dock.posegate /demo/site.toml")
        .run()?;
    // Loopback only.
    within(root, &format!("{folder}posegate-node"))
        .words("--help")
        .run()?;
    cmd("bash -c")
        .arg(RUN_NODE)
        .arg(root)
        .words(WITHIN)
        .arg(root)
        .arg(format!("{folder}posegate-node"))
        .words("/demo/dock.posegate --ros-args -p max_speed:=0.05 -p max_yaw_rate_deg:=6.0")
        .env("ROS_DOMAIN_ID", (10 + std::process::id() % 90).to_string())
        .env("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
        .limit(120)
        .run()
}

/// Checks what dpkg installed, and that it removes all of it.
fn remove_package(root: &Path) -> Result {
    let dpkg = || cmd("unshare --map-root-user dpkg").arg(format!("--root={}", root.display()));
    let changed = dpkg().words("--verify posegate").read()?;
    if !changed.trim().is_empty() {
        return Err(format!("dpkg --verify: {changed}").into());
    }
    dpkg().words("--purge posegate").run()?;
    let left = files::files_below(&root.join("usr"));
    if !left.is_empty() {
        return Err(format!("left after dpkg --purge: {left:?}").into());
    }
    Ok(())
}

/// Links the smallest gate with the archive of a core, without Rust, and runs it in an emulator.
fn run_gate(folder: &Path, core: &str) -> Result {
    let output = cmd("make --no-print-directory -s -C")
        .arg(folder.join("examples/c"))
        .arg("run_gate")
        .arg(format!("TARGET={core}"))
        .arg("CARGO=false")
        .limit(120)
        .read()?;
    if output != GATE {
        return Err(format!("{core}: the gate in C prints\n{output}and not\n{GATE}").into());
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_command_of_the_first_block_installs() {
        let page = "x\n```sh\nsha256sum --check S   # all\ntar -xzf a.tar.gz\n```\n\n```sh\nposegate x\n```\n";
        assert_eq!(
            commands(page).unwrap(),
            ["sha256sum --check S", "tar -xzf a.tar.gz"]
        );
        assert!(commands("x\n```sh\nposegate demo -o x\n```\n").is_err());
        assert!(commands("no block").is_err());
    }

    #[test]
    fn file_without_a_sum_is_found() {
        let folder = Scratch::new().unwrap();
        files::write(folder.join("a.deb"), "x").unwrap();
        files::write(folder.join(SUMS), "00  b.deb\n").unwrap();
        assert!(all_are_summed(folder.path()).is_err());
        files::write(folder.join(SUMS), "00  a.deb\n").unwrap();
        assert!(all_are_summed(folder.path()).is_ok());
    }
}
