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
mod completions;
mod contains;
mod cost;
mod cover;
mod demo;
mod doctor;
mod draw;
mod explain;
mod failure;
mod family;
mod gate;
mod import;
mod init;
mod inscribe;
mod learn;
mod manual;
mod metrics;
mod place;
mod plan;
mod predict;
mod recording;
mod replay;
mod report;
mod seal;
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
    after_help = "Example:\n  posegate demo -o demo-out\n\nExit codes: 0 done; 1 the answer is no (a denial, a failed proof); 2 bad input or usage, or standard output that cannot be written (without a message if its reader has ended); 3 internal."
)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
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
    Seal(seal::Arguments),
    Family(family::Arguments),
    Inscribe(inscribe::Arguments),
    Cost(cost::Arguments),
    Place(place::Arguments),
    #[command(subcommand)]
    Site(site::Command),
    Draw(draw::Arguments),
    Doctor(doctor::Arguments),
    Report(report::Arguments),
    Explain(explain::Arguments),
    Completions(completions::Arguments),
    Man(manual::Arguments),
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
    match &arguments.command {
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
        Command::Seal(arguments) => seal::run(arguments, files),
        Command::Family(arguments) => family::run(arguments, files),
        Command::Inscribe(arguments) => inscribe::run(arguments, files),
        Command::Cost(arguments) => cost::run(arguments, files),
        Command::Place(arguments) => place::run(arguments, files),
        Command::Site(command) => site::run(command, files),
        Command::Draw(arguments) => draw::run(arguments, files),
        Command::Doctor(arguments) => doctor::run(arguments, files),
        Command::Report(arguments) => report::run(arguments, files),
        Command::Explain(arguments) => explain::run(arguments),
        Command::Completions(arguments) => completions::run(arguments, files),
        Command::Man(arguments) => manual::run(arguments, files),
        Command::Demo(arguments) => demo::run(arguments, files),
    }
}
