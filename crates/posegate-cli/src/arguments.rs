//! Parses the arguments of all subcommands, and declares the files that they name.

use crate::failure::Failure;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{ArgMatches, Command, CommandFactory, FromArgMatches, ValueHint};
use posegate_files::files::{self, FileError, Files, Input, NamedInput, Output, OutputFolder};
use posegate_files::printable::printable_lines;
use std::any::TypeId;
use std::ffi::OsString;

/// Commands of earlier versions, with what to type instead.
const EARLIER: [(&str, &str); 6] = [
    (
        "completions",
        "type `posegate --completions SHELL`, which prints them",
    ),
    ("doctor", "type `posegate check SITE --draw DIR`"),
    (
        "family",
        "change `r` in the site file, and type `posegate table build SITE --task TASK --dry-run --json`, which prints the set's volume",
    ),
    (
        "inscribe",
        "type `posegate contains SITE --task TASK --box`",
    ),
    ("man", "type `posegate --man DIR`"),
    ("seal", "type `posegate table seal FIRMWARE`"),
];

/// What a command does with a file that an argument names.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// Reads the file.
    Input,
    /// Reads the file, to which the argument gives a name.
    NamedInput,
    /// Writes the file.
    Output,
    /// Writes files into this folder.
    OutputFolder,
}

impl Role {
    /// Returns the role that the argument's type states. `None` if the argument does not name a file.
    pub fn of(argument: &clap::Arg) -> Option<Self> {
        let kind = argument.get_value_parser().type_id();
        let all = [
            (TypeId::of::<Input>(), Self::Input),
            (TypeId::of::<NamedInput>(), Self::NamedInput),
            (TypeId::of::<Output>(), Self::Output),
            (TypeId::of::<OutputFolder>(), Self::OutputFolder),
        ];
        let found = all.into_iter().find(|(of, _)| kind == *of);
        found.map(|(_, role)| role)
    }
}

/// Returns the command line. Shells complete arguments that name files.
pub fn command() -> Command {
    with_hints(crate::Arguments::command())
}

fn with_hints(command: Command) -> Command {
    let hinted = command.mut_args(|argument| match Role::of(&argument) {
        Some(Role::OutputFolder) => argument.value_hint(ValueHint::DirPath),
        Some(Role::Input | Role::Output) => argument.value_hint(ValueHint::FilePath),
        Some(Role::NamedInput) | None => argument,
    });
    hinted.mut_subcommands(with_hints)
}

/// Parses a command line and declares its files. Returns `None` if help or the version was requested and printed.
///
/// # Errors
/// A command of an earlier version, a command line that clap refuses, or an output that is also an input.
pub fn parsed(words: &[OsString]) -> Result<Option<(crate::Arguments, Files)>, Failure> {
    let earlier = EARLIER
        .iter()
        .find(|(name, _)| words.get(1).is_some_and(|word| word == name));
    if let Some((name, instead)) = earlier {
        crate::failure::to_stderr(&format!(
            "`posegate {name}` does not exist any more: {instead}"
        ));
        return Err(Failure::printed());
    }
    let matches = match command().try_get_matches_from(words) {
        Ok(matches) => matches,
        Err(error) if error.use_stderr() => return Err(refused(&error)),
        Err(help) => {
            help.print()
                .and_then(|()| std::io::Write::flush(&mut std::io::stdout()))
                .map_err(files::unprinted)?;
            return Ok(None);
        }
    };
    let arguments =
        crate::Arguments::from_arg_matches(&matches).map_err(|error| refused(&error))?;
    let files = Files::new();
    declare(&files, &command(), &matches)?;
    Ok(Some((arguments, files)))
}

/// Declares the files of the requested subcommand. Outputs come first, so that the first input that is one of them is refused.
fn declare(files: &Files, command: &Command, matches: &ArgMatches) -> Result<(), FileError> {
    if let Some((name, matches)) = matches.subcommand()
        && let Some(command) = command.find_subcommand(name)
    {
        return declare(files, command, matches);
    }
    let named = |wanted: Role| {
        let all = command.get_arguments();
        let of_role = all.filter(move |argument| Role::of(argument) == Some(wanted));
        of_role.map(|argument| argument.get_id().as_str())
    };
    for id in named(Role::Output) {
        for output in matches.get_many::<Output>(id).into_iter().flatten() {
            files.declare_output(output)?;
        }
    }
    for id in named(Role::Input) {
        for input in matches.get_many::<Input>(id).into_iter().flatten() {
            files.declare_input(input)?;
        }
    }
    for id in named(Role::NamedInput) {
        for named in matches.get_many::<NamedInput>(id).into_iter().flatten() {
            files.declare_input(&named.input)?;
        }
    }
    Ok(())
}

/// Returns a parser that takes one of some names, each with its value.
pub fn choice<T: Clone + Send + Sync + 'static, const N: usize>(
    all: [(&'static str, T); N],
) -> impl TypedValueParser<Value = T> {
    let names = all.each_ref().map(|(name, _)| *name);
    PossibleValuesParser::new(names).try_map(move |name| {
        let known = all.iter().find(|(known, _)| *known == name);
        known.map(|(_, value)| value.clone()).ok_or(name)
    })
}

/// Parses numbers with commas between them. `None` if there are more or fewer, or if one is not accepted.
pub fn numbers<const N: usize>(text: &str, is_accepted: fn(f64) -> bool) -> Option<[f64; N]> {
    let number = |part: &str| {
        let number = part.trim().parse().ok();
        number.filter(|number| is_accepted(*number))
    };
    let all: Option<Vec<f64>> = text.split(',').map(number).collect();
    all?.try_into().ok()
}

/// Prints clap's message about wrong usage, in its colours. If the message contains unprintable text that was typed, it is
/// printed escaped and without colours.
fn refused(error: &clap::Error) -> Failure {
    let plain = error.to_string();
    let escaped = printable_lines(&plain);
    if escaped == plain {
        // There is nowhere to report an error of stderr to.
        let _ = error.print();
    } else {
        crate::failure::to_stderr(escaped.trim_end());
    }
    Failure::printed()
}

#[cfg(test)]
mod tests;
