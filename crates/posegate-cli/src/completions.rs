//! `posegate completions`: writes the file with which a shell completes commands.

use crate::site_input::{Outcome, answer};
use posegate_files::files::{Files, Output};

/// Writes completions of this command line for a shell
#[derive(clap::Args)]
#[command(
    after_help = "Example:\n  posegate completions bash > ~/.local/share/bash-completion/completions/posegate"
)]
pub struct Arguments {
    /// The shell
    #[arg(value_enum)]
    shell: clap_complete::Shell,
    /// The file to write; `-` for standard output
    #[arg(short, long, default_value = "-")]
    output: Output,
}

pub fn run(arguments: &Arguments, files: &Files) -> Outcome {
    let mut text = Vec::new();
    let mut command = crate::arguments::command();
    clap_complete::generate(arguments.shell, &mut command, "posegate", &mut text);
    files.write(&arguments.output, &text)?;
    Ok(answer(true))
}
