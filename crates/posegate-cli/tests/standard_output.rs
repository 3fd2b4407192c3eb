//! If output cannot be written to standard output, the exit code reports it.
#![cfg(target_os = "linux")]

use posegate_testkit::{commands, counts};

use commands::{DEMO, Folder, LINES, Role, arguments, code_of, filled};
use std::fs::File;
use std::process::Stdio;
use std::sync::OnceLock;

/// The option that prints JSON. Subcommands without it refuse it.
const JSON: &str = "--json";

/// Returns all command lines: unchanged, with JSON, and with each output on standard output.
fn lines() -> Vec<Vec<String>> {
    let mut all = Vec::new();
    for (leaf, line) in LINES {
        let plain = filled(leaf, line, &[]);
        let mut json = plain.clone();
        json.push(JSON.into());
        all.extend([plain, json]);
        for (argument, role) in arguments(leaf, line) {
            if role == Role::Output {
                all.push(filled(leaf, line, &[(&argument, "-")]));
            }
        }
    }
    let alone = [
        "--help",
        "--version",
        "help",
        "table --help",
        "help table build",
        "explain --json",
        "--completions bash",
    ];
    all.extend(alone.map(|line| line.split(' ').map(String::from).collect()));
    all
}

/// Returns those valid command lines that print something.
fn printing() -> &'static [Vec<String>] {
    static PRINTING: OnceLock<Vec<Vec<String>>> = OnceLock::new();
    PRINTING.get_or_init(|| {
        let prints = |line: &Vec<String>| {
            let output = Folder::new().run(line);
            let refused = output.status.code() == Some(2);
            let error = String::from_utf8_lossy(&output.stderr);
            // Some subcommands, such as draw, have no JSON. Standard output refuses an MCAP, and JSON with another
            // result.
            let is_known = [
                "unexpected argument '--json'",
                "cannot hold",
                "cannot both go to",
            ];
            if refused && is_known.iter().any(|known| error.contains(known)) {
                return false;
            }
            assert_eq!(
                output.status.code(),
                Some(code_of(&line[0])),
                "{line:?}: {error}"
            );
            !output.stdout.is_empty()
        };
        // An eighth of them each day; all in a deep job.
        let (skipped, step) = counts::part(8);
        let lines = lines().into_iter().skip(skipped).step_by(step);
        lines.filter(prints).collect()
    })
}

/// Runs each command that prints, with a standard output that cannot be written.
fn each(stdout: impl Fn() -> Stdio, check: impl Fn(&[String], Option<i32>, &str)) {
    let least = if counts::is_deep() { 60 } else { 5 };
    assert!(printing().len() > least, "{}", printing().len());
    for line in printing() {
        let folder = Folder::new();
        let output = folder.command(line).stdout(stdout()).output().unwrap();
        let error = String::from_utf8_lossy(&output.stderr);
        check(line, output.status.code(), &error);
        // No partly written file remains.
        let is_draft = |path: &std::path::PathBuf| path.to_string_lossy().ends_with(".tmp");
        let left = folder.snapshot().into_keys().find(is_draft);
        assert_eq!(left, None, "{line:?}");
    }
}

#[test]
fn full_standard_output_is_an_error() {
    let full = || {
        File::options()
            .write(true)
            .open("/dev/full")
            .unwrap()
            .into()
    };
    each(full, |line, code, error| {
        assert_eq!(code, Some(2), "{line:?}: {error}");
        assert!(
            error.contains("standard output cannot be written"),
            "{line:?}: {error}"
        );
    });
}

/// `posegate ... | head` ends without a message, and not with the exit code of an answer.
#[test]
fn closed_standard_output_ends_quietly() {
    let closed = || {
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        writer.into()
    };
    each(closed, |line, code, error| {
        assert_eq!(code, Some(2), "{line:?}: {error}");
        assert!(
            !error.contains("standard output") && !error.contains("panic"),
            "{line:?}: {error}"
        );
    });
}

#[test]
#[ignore = "takes long: ./ci.sh deep"]
fn demo_reports_a_full_standard_output() {
    let full = File::options().write(true).open("/dev/full").unwrap();
    let folder = Folder::new();
    let line = filled(DEMO.0, DEMO.1, &[]);
    let output = folder.command(&line).stdout(full).output().unwrap();
    assert_eq!(output.status.code(), Some(2), "{output:?}");
    assert!(folder.path().join("out-output/numbers.json").is_file());
}

/// A standard error that cannot be written does not change the exit code.
#[test]
fn full_standard_error_does_not_change_the_exit_code() {
    for (line, code) in [
        ("check nowhere.toml", 2),
        ("explain --nonsense", 2),
        ("report site.toml -o out", 0),
    ] {
        let full = File::options().write(true).open("/dev/full").unwrap();
        let line: Vec<&str> = line.split(' ').collect();
        let status = Folder::new().command(&line).stderr(full).status().unwrap();
        assert_eq!(status.code(), Some(code), "{line:?}");
    }
}
