//! `posegate completions`: what a shell needs to complete commands.

use crate::door::{Outcome, answer, write};
use clap::CommandFactory;
use std::path::PathBuf;

/// Writes a shell's completions of this command line
#[derive(clap::Args)]
#[command(
    after_help = "Example:\n  posegate completions bash > ~/.local/share/bash-completion/completions/posegate"
)]
pub struct Arguments {
    /// The shell
    #[arg(value_enum)]
    shell: clap_complete::Shell,
    /// Where to write them; `-` for standard output
    #[arg(short, long, default_value = "-")]
    output: PathBuf,
}

pub fn run(arguments: &Arguments) -> Outcome {
    let mut text = Vec::new();
    let mut command = crate::Arguments::command();
    clap_complete::generate(arguments.shell, &mut command, "posegate", &mut text);
    write(&arguments.output, &text)?;
    Ok(answer(true))
}
