//! `posegate init`: a sample site file to start from.

use crate::door::{Failure, Outcome, answer, print, write};
use posegate::site::SAMPLE;
use std::path::PathBuf;

/// Writes a commented sample site file
#[derive(clap::Args)]
#[command(after_help = "Example:\n  posegate init site.toml")]
pub struct Arguments {
    /// Where to write it; `-` for standard output
    #[arg(default_value = "site.toml")]
    file: PathBuf,
    /// Overwrite a file that is there
    #[arg(long)]
    force: bool,
}

pub fn run(arguments: &Arguments) -> Outcome {
    let Arguments { file, force } = arguments;
    if file.exists() && !force {
        return Err(Failure::usage(
            format!("{} is there already", file.display()),
            "name another file, or overwrite it with --force",
        ));
    }
    write(file, SAMPLE.as_bytes())?;
    if file.as_os_str() != "-" {
        print(&format_args!(
            "wrote {}; next: posegate check {0}",
            file.display()
        ))?;
    }
    Ok(answer(true))
}
