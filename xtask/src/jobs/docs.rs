//! `docs`: the API documents, and the commands of the README and of docs/.

use crate::arguments::Arguments;
use crate::files::{self, Scratch, root, target_folder, tested};
use crate::jobs::stamps;
use crate::jobs::test::build_suite;
use crate::need::{self, THUMBS};
use crate::report::Report;
use crate::shell::{Result, cmd, program_at};
use std::path::Path;

/// Sample files that the pages name.
const SAMPLES: [&str; 7] = [
    "tests/data/estimates.csv",
    "tests/data/apriltag_errors_sample.csv",
    "tests/data/dockings.csv",
    "examples/sites/loading-bay.toml",
    "examples/sites/paper-chain.toml",
    "examples/sites/docks.toml",
    "examples/sites/docks.yaml",
];
/// Commands that run before those of a page.
const PROGRAMS: [&str; 5] = [
    "posegate ",
    "cargo run ",
    "cargo build ",
    "cargo rustc ",
    "make ",
];

/// Commands that build and run a program, and the program of the fast suite that stands for it.
const BUILT: [(&str, &str); 2] = [
    ("cargo run --release -- ", "posegate"),
    (
        "cargo run --release -p posegate-replay --example drive_bag -- ",
        "drive_bag",
    ),
];

/// The page that `cargo xtask python` runs, since it needs the wheel.
const OF_PYTHON: &str = "for-python.md";

/// Builds the API documents of all libraries without a warning. Runs every command in the shell blocks of the
/// README and of docs/, each page in a separate folder with the sample files. The program is that
/// of the fast suite, so that nothing is built twice; `budgets` and `dist` build it for release, and run the demo.
pub fn docs(_: &Arguments) -> Result {
    need::targets(&THUMBS)?;
    need::qemu()?;
    need::command("arm-none-eabi-gcc", "gcc-arm-none-eabi")?;
    need::command("make", "make")?;
    stamps::are_stated()?;
    // Pages link each other if their folders exist, in whatever order they are made.
    for package in ["posegate", "posegate_site"] {
        std::fs::create_dir_all(target_folder().join("doc").join(package))?;
    }
    // The packages of the lints, so that what these depend on is not checked twice.
    cmd("cargo doc --no-deps --workspace --exclude posegate-peers")
        .env("RUSTDOCFLAGS", "-D warnings")
        .run()?;
    let mut report = Report::default();
    check_front_pages(&mut report)?;
    build_suite("--bin posegate --example drive_bag").run()?;
    // Its lines are the README's.
    program_at(&tested("examples/may_dock")).run()?;
    let mut pages = files::files_ending("docs", ".md")?;
    pages.retain(|page| !page.ends_with(OF_PYTHON));
    pages.insert(0, "README.md".into());
    let mut with_commands = 0;
    for page in pages {
        let text = files::read(&page)?;
        let page = page.display();
        let commands = commands(&text).map_err(|error| format!("{page}: {error}"))?;
        let Some(commands) = commands else {
            continue;
        };
        let folder = Scratch::new()?;
        run(&commands, folder.path()).map_err(|error| format!("{page}: {error}"))?;
        report.note(
            &format!("commands of {page} that run"),
            commands.len(),
            "commands",
        );
        report.require(
            commands.len() >= 4,
            format_args!("{page}: fewer than 4 commands"),
        );
        with_commands += 1;
    }
    report.require(with_commands >= 6, "fewer than 6 pages with commands");
    report.finish()
}

/// Checks that the front pages of both libraries lead to the types with which a program begins, in one click.
fn check_front_pages(report: &mut Report) -> Result {
    let folder = target_folder().join("doc");
    for (page, module, item) in [
        ("posegate", "gate/", "struct.Gate.html"),
        ("posegate", "../posegate_site/", "struct.Site.html"),
        ("posegate_site", "", "struct.Site.html"),
        ("posegate_site", "../posegate/gate/", "struct.Gate.html"),
    ] {
        let page = folder.join(page).join("index.html");
        let html = files::read(&page)?;
        // In another crate rustdoc links the module where the item is defined, where a page leads on to the public one.
        let leads = |link: &str| {
            link.starts_with(module) && link.ends_with(item) && page.with_file_name(link).is_file()
        };
        let has_link = html
            .split("href=\"")
            .filter_map(|rest| rest.split('"').next())
            .any(leads);
        report.require(
            has_link,
            format_args!("{}: no link to {module}{item}", page.display()),
        );
    }
    Ok(())
}

/// Returns the commands of a page, or nothing if it has no block of them.
fn commands(page: &str) -> Result<Option<Vec<String>>> {
    for other in ["```bash", "```shell", "```console"] {
        if page.lines().any(|line| line.starts_with(other)) {
            return Err("blocks of commands begin with ```sh".into());
        }
    }
    if !page.lines().any(|line| line == "```sh") {
        return Ok(None);
    }
    let mut is_inside = false;
    let mut found = Vec::new();
    for line in page.lines() {
        match line {
            "```sh" => is_inside = true,
            "```" => is_inside = false,
            _ if is_inside => found.extend(command(line)?),
            _ => {}
        }
    }
    Ok(Some(found))
}

/// Returns the command of a line, or `None` if there is nothing to run.
fn command(line: &str) -> Result<Option<String>> {
    let line = line.split('#').next().unwrap_or_default();
    // The jobs' own command runs this job, and `dist` runs those that need the files of a release.
    let is_run_elsewhere = ["./ci.sh", "cargo xtask"]
        .iter()
        .any(|start| line.starts_with(start))
        || crate::jobs::dist::installs(line);
    if line.trim().is_empty() || is_run_elsewhere {
        return Ok(None);
    }
    if !PROGRAMS.iter().any(|program| line.starts_with(program)) {
        return Err(format!("a command that is not run: {line}").into());
    }
    // The program and the example are built already. Other cargo commands run in this workspace.
    for (start, built) in BUILT {
        if let Some(rest) = line.strip_prefix(start) {
            return Ok(Some(format!("{built} {rest}")));
        }
    }
    let mut words = line.splitn(3, ' ');
    Ok(Some(match (words.next(), words.next(), words.next()) {
        (Some("cargo"), Some(subcommand), Some(rest)) => {
            format!("cargo {subcommand} --manifest-path \"$POSEGATE/Cargo.toml\" {rest}")
        }
        _ => line.to_owned(),
    }))
}

/// Runs commands one after the other in a folder.
fn run(commands: &[String], folder: &Path) -> Result {
    for sample in SAMPLES {
        files::copy(sample, folder.join(files::name(Path::new(sample))))?;
    }
    let old = std::env::var_os("PATH").unwrap_or_default();
    let built = ["", "examples"].map(tested);
    let paths = built.into_iter().chain(std::env::split_paths(&old));
    let path = std::env::join_paths(paths)?;
    for line in commands {
        let code = cmd("bash -c")
            .arg(line)
            .env("POSEGATE", root())
            .env("CARGO_TARGET_DIR", target_folder())
            .env("PATH", &path)
            .dir(folder)
            .code()?;
        // `gate` returns 1 if an estimate is denied, `replay` if one was permitted falsely.
        let may_be_one = line.starts_with("posegate gate ") || line.starts_with("posegate replay ");
        if code != 0 && !(code == 1 && may_be_one) {
            return Err(format!("a command failed with {code}: {line}").into());
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commands_are_those_of_shell_blocks() {
        let page = "```sh\nposegate demo -o x   # a comment\n\n./ci.sh docs\ncargo run --release -- check s.toml\ncargo run --release -p posegate-replay --example drive_bag -- a b\ncargo build -p posegate-c\n```\n```toml\nx = 1\n```\n";
        let found = commands(page).unwrap().unwrap();
        assert_eq!(found.len(), 4);
        assert_eq!(found[0].trim(), "posegate demo -o x");
        assert_eq!(found[1], "posegate check s.toml");
        assert_eq!(found[2], "drive_bag a b");
        assert_eq!(
            found[3],
            "cargo build --manifest-path \"$POSEGATE/Cargo.toml\" -p posegate-c"
        );
    }

    #[test]
    fn blocks_that_would_not_run_are_refused() {
        assert!(commands("```bash\nls\n```\n").is_err());
        assert!(commands("```sh\nrm -r x\n```\n").is_err());
        assert!(commands("no block\n").unwrap().is_none());
    }
}
