//! A panic ends a process, so each program here is a run of this test executable.

use super::guarded;
use std::process::{Command, ExitCode, Output};

const PROGRAM: &str = "POSEGATE_GUARD_TEST";

fn program(name: &str) -> ExitCode {
    match name {
        "quiet" => return 1.into(),
        "main" => panic!("first\nline \u{1b}[31m"),
        "rayon" => {
            use rayon::prelude::*;
            let sum: u32 = (0..100u32)
                .into_par_iter()
                .map(|i| 100 / (50 - i).min(i))
                .sum();
            assert!(sum > 0);
        }
        "scope" => std::thread::scope(|scope| {
            scope.spawn(|| panic!("of a worker"));
        }),
        "detached" => {
            let worker = std::thread::spawn(|| panic!("of a worker"));
            assert!(worker.join().is_err());
        }
        "long" => panic!("{}", "x".repeat(1 << 20)),
        _ => unreachable!(),
    }
    0.into()
}

/// Not a test by itself: the process under test.
#[test]
fn child() {
    let Ok(name) = std::env::var(PROGRAM) else {
        return;
    };
    let code = guarded(|| program(&name));
    // `ExitCode` does not return its number, so compare the debug text.
    let is = |number: u8| std::format!("{code:?}") == std::format!("{:?}", ExitCode::from(number));
    std::process::exit((0..=9).find(|number| is(*number)).unwrap_or(99).into());
}

fn run(name: &str, backtrace: Option<&str>) -> (Output, Vec<String>) {
    let mut command = Command::new(std::env::current_exe().unwrap());
    command.args(["guard::tests::child", "--exact", "--nocapture"]);
    command.env(PROGRAM, name).env_remove("RUST_BACKTRACE");
    if let Some(value) = backtrace {
        command.env("RUST_BACKTRACE", value);
    }
    let output = command.output().unwrap();
    let text = String::from_utf8(output.stderr.clone()).unwrap();
    (output, text.lines().map(ToString::to_string).collect())
}

#[test]
fn panic_of_any_thread_is_one_line_and_exit_code_3() {
    for name in ["main", "rayon", "scope", "detached", "long"] {
        let (output, lines) = run(name, None);
        assert_eq!(output.status.code(), Some(3), "{name}: {lines:?}");
        assert_eq!(lines.len(), 1, "{name}: {lines:?}");
        let line = &lines[0];
        assert!(line.starts_with("internal error: ") && line.contains("please report it"));
        assert!(line.len() < 1000 && !line.contains('\u{1b}'), "{line}");
        // RUST_BACKTRACE=0 means no backtrace.
        assert_eq!(run(name, Some("0")).1.len(), 1, "{name}");
    }
    assert!(run("main", None).1[0].contains("first\\nline \\u{1b}[31m"));
}

#[test]
fn backtrace_is_printed_if_rust_backtrace_is_set() {
    let (output, lines) = run("main", Some("1"));
    assert_eq!(output.status.code(), Some(3));
    assert!(lines.len() > 2 && lines.iter().any(|line| line.contains("stack backtrace")));
}

#[test]
fn program_that_ends_keeps_its_exit_code() {
    let (output, lines) = run("quiet", None);
    assert_eq!((output.status.code(), lines.len()), (Some(1), 0));
}
