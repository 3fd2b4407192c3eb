//! The command line: arguments and printing. The work is done in the crates `posegate-site`, `-plan`, `-place`, `-learn`, `-replay` and `-show`.
//!
//! Entry points: [`program`] runs a command line. [`calls`] has what other languages call directly, with the same words for
//! the same errors.
#![forbid(unsafe_code)]
#![deny(missing_docs)]

use clap::{Parser, Subcommand};
use posegate_files::guard::guarded;
use std::ffi::OsString;
use std::process::ExitCode;

mod arguments;
mod belief;
pub mod calls;
mod chain;
mod check;
mod contains;
mod cost;
mod cover;
mod demo;
mod draw;
mod explain;
mod failure;
mod gate;
mod import;
mod init;
mod learn;
mod manual;
mod metrics;
mod place;
mod plan;
mod predict;
mod recording;
mod replay;
mod report;
mod sheet;
mod site;
mod site_input;
mod table;
mod terminal;

/// Decides whether a robot is localized well enough for its task.
///
/// A site file states from which poses each task succeeds. `table build` turns such a set into a
/// proven table for a controller's flash. `gate` decides on recorded estimates with the code that
/// runs on the controller.
#[derive(Parser)]
#[command(
    name = "posegate",
    version,
    arg_required_else_help = true,
    args_conflicts_with_subcommands = true,
    after_help = "Example:\n  posegate demo -o demo-out\n  posegate --completions bash > ~/.local/share/bash-completion/completions/posegate\n\nExit codes: 0 done; 1 the answer is no (a denial, a failed proof); 2 bad input or usage, or standard output that cannot be written (without a message if its reader has ended); 3 internal."
)]
struct Arguments {
    /// Print the file with which this shell completes commands
    #[arg(long, value_name = "SHELL", exclusive = true)]
    completions: Option<clap_complete::Shell>,
    /// Write manual pages, one for each command, into this folder
    #[arg(long, value_name = "DIR", exclusive = true)]
    man: Option<posegate_files::files::OutputFolder>,
    #[command(subcommand)]
    command: Option<Command>,
}

#[derive(Subcommand)]
enum Command {
    Init(init::Arguments),
    Check(check::Arguments),
    Import(import::Arguments),
    Contains(contains::Arguments),
    #[command(subcommand)]
    Table(table::Command),
    Gate(gate::Arguments),
    Chain(chain::Arguments),
    Plan(plan::Arguments),
    Cover(cover::Arguments),
    Metrics(metrics::Arguments),
    #[command(subcommand)]
    Learn(learn::Command),
    Predict(predict::Arguments),
    Replay(Box<replay::Arguments>),
    Cost(cost::Arguments),
    Place(place::Arguments),
    #[command(subcommand)]
    Site(site::Command),
    Draw(draw::Arguments),
    Report(report::Arguments),
    Explain(explain::Arguments),
    Demo(demo::Arguments),
}

/// Runs a command line, whose first word is the name of the program. Prints its answer or its failure.
///
/// Call it once in a process: it handles the panics of all threads.
pub fn program(words: impl IntoIterator<Item = OsString>) -> ExitCode {
    let words: Vec<OsString> = words.into_iter().collect();
    guarded(|| run(&words).unwrap_or_else(failure::Failure::report))
}

fn run(words: &[OsString]) -> failure::Outcome {
    let Some((arguments, files)) = arguments::parsed(words)? else {
        return Ok(ExitCode::SUCCESS);
    };
    let files = &files;
    if let Some(shell) = arguments.completions {
        return manual::completions(shell);
    }
    if let Some(folder) = &arguments.man {
        return manual::pages(folder, files);
    }
    // Without a command, clap prints the help, and this line is not reached.
    let Some(command) = &arguments.command else {
        return Err(failure::Failure::printed());
    };
    match command {
        Command::Init(arguments) => init::run(arguments, files),
        Command::Check(arguments) => check::run(arguments, files),
        Command::Import(arguments) => import::run(arguments, files),
        Command::Contains(arguments) => contains::run(arguments, files),
        Command::Table(command) => table::run(command, files),
        Command::Gate(arguments) => gate::run(arguments, files),
        Command::Chain(arguments) => chain::run(arguments, files),
        Command::Plan(arguments) => plan::run(arguments, files),
        Command::Cover(arguments) => cover::run(arguments, files),
        Command::Metrics(arguments) => metrics::run(arguments, files),
        Command::Learn(command) => learn::run(command, files),
        Command::Predict(arguments) => predict::run(arguments, files),
        Command::Replay(arguments) => replay::run(arguments, files),
        Command::Cost(arguments) => cost::run(arguments, files),
        Command::Place(arguments) => place::run(arguments, files),
        Command::Site(command) => site::run(command, files),
        Command::Draw(arguments) => draw::run(arguments, files),
        Command::Report(arguments) => report::run(arguments, files),
        Command::Explain(arguments) => explain::run(arguments),
        Command::Demo(arguments) => demo::run(arguments, files),
    }
}
