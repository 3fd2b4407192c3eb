//! Every argument that names a file has the type of the file's role, and is in the list that
//! `crates/posegate-cli/tests/outputs_and_inputs.rs` tests.

use super::*;
use std::path::PathBuf;

/// The program itself and all leaves of the tree of commands, each followed by its arguments that name files.
const LIST: &str = include_str!("../../../../tests/data/file_arguments.txt");

fn walk(name: &str, command: &Command, found: &mut Vec<String>) {
    if name.is_empty() {
        found.push("posegate".into());
    } else if !command.has_subcommands() {
        found.push(name.into());
    }
    for argument in command.get_arguments() {
        let kind = argument.get_value_parser().type_id();
        let role = Role::of(argument);
        assert!(
            kind != TypeId::of::<PathBuf>() && kind != TypeId::of::<std::ffi::OsString>(),
            "{name} {}: give it the type of its role, of posegate_files::files",
            argument.get_id()
        );
        if let Some(role) = role {
            found.push(format!("  {} {role:?}", argument.get_id()));
        } else if kind == TypeId::of::<String>() {
            let names = format!("{:?}", argument.get_value_names());
            let help = argument
                .get_help()
                .map_or(String::new(), ToString::to_string);
            let like_a_file = ["FILE", "PATH", "DIR", "FOLDER"]
                .iter()
                .any(|word| names.contains(word))
                || help.contains("; `-` ");
            assert!(
                !like_a_file,
                "{name} {}: text that names a file? {help}",
                argument.get_id()
            );
        }
    }
    for below in command.get_subcommands() {
        let name = format!("{name} {}", below.get_name());
        walk(name.trim(), below, found);
    }
}

#[test]
fn every_argument_that_names_a_file_is_listed() {
    let mut found = Vec::new();
    walk("", &crate::Arguments::command(), &mut found);
    assert!(
        found.len() > 50,
        "the tree of commands is walked: {found:#?}"
    );
    let listed: Vec<&str> = LIST.lines().collect();
    assert_eq!(
        found, listed,
        "tests/data/file_arguments.txt differs from these; add a command for each to crates/posegate-testkit/src/commands.rs: {found:#?}"
    );
}

#[test]
fn command_line_is_sound_and_shells_complete_files() {
    let command = command();
    command.clone().debug_assert();
    let gate = command.find_subcommand("gate").unwrap();
    let hint = |id: &str| {
        let found = gate
            .get_arguments()
            .find(|argument| argument.get_id() == id);
        found.unwrap().get_value_hint()
    };
    assert_eq!(
        [hint("table"), hint("epsilon")],
        [ValueHint::FilePath, ValueHint::Unknown]
    );
}
