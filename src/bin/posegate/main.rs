//! The command line: arguments and printing. What it does lives in the library's rooms.

use clap::{Parser, Subcommand};
use std::process::ExitCode;

mod belief;
mod chain;
mod check;
mod completions;
mod contains;
mod cost;
mod cover;
mod demo;
mod doctor;
mod door;
mod draw;
mod explain;
mod family;
mod gate;
mod import;
mod init;
mod learn;
mod manual;
mod metrics;
mod place;
mod plan;
mod predict;
mod replay;
mod report;
mod seal;
mod site;
mod table;

/// Decides whether a robot is localized well enough for its task.
///
/// A site file says from which poses each task succeeds. `table build` turns such a set into a
/// proven table for a controller's flash; `gate` decides on recorded estimates with the very code
/// that runs there.
#[derive(Parser)]
#[command(
    version,
    after_help = "Example:\n  posegate demo -o demo-out\n\nExit codes: 0 done; 1 the answer is no (a denial, a failed proof); 2 bad input or usage; 3 internal."
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

fn main() -> ExitCode {
    let result = match Arguments::parse().command {
        Command::Init(arguments) => init::run(&arguments),
        Command::Check(arguments) => check::run(&arguments),
        Command::Import(arguments) => import::run(&arguments),
        Command::Contains(arguments) => contains::run(&arguments),
        Command::Table(command) => table::run(&command),
        Command::Gate(arguments) => gate::run(&arguments),
        Command::Chain(arguments) => chain::run(&arguments),
        Command::Plan(arguments) => plan::run(&arguments),
        Command::Cover(arguments) => cover::run(&arguments),
        Command::Metrics(arguments) => metrics::run(&arguments),
        Command::Learn(command) => learn::run(&command),
        Command::Predict(arguments) => predict::run(&arguments),
        Command::Replay(arguments) => replay::run(&arguments),
        Command::Seal(arguments) => seal::run(&arguments),
        Command::Family(arguments) => family::run(&arguments),
        Command::Cost(arguments) => cost::run(&arguments),
        Command::Place(arguments) => place::run(&arguments),
        Command::Site(command) => site::run(&command),
        Command::Draw(arguments) => draw::run(&arguments),
        Command::Doctor(arguments) => doctor::run(&arguments),
        Command::Report(arguments) => report::run(&arguments),
        Command::Explain(arguments) => explain::run(&arguments),
        Command::Completions(arguments) => completions::run(&arguments),
        Command::Man(arguments) => manual::run(&arguments),
        Command::Demo(arguments) => demo::run(&arguments),
    };
    match result {
        Ok(code) => code,
        Err(failure) => failure.report(),
    }
}
