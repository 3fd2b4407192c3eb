//! `posegate init`: writes a sample site file.

use crate::site_input::{Failure, Outcome, answer, print, print_json};
use posegate_files::files::{Files, Output};
use posegate_site::SAMPLE;

/// Writes a commented sample site file
#[derive(clap::Args)]
#[command(after_help = "Example:\n  posegate init site.toml")]
pub struct Arguments {
    /// The file to write; `-` for standard output
    #[arg(default_value = "site.toml")]
    file: Output,
    /// Overwrite an existing file
    #[arg(long)]
    force: bool,
    /// Print JSON: what was written
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments, files: &Files) -> Outcome {
    let Arguments { file, force, json } = arguments;
    if file.as_path().exists() && !force {
        return Err(Failure::usage(
            format!("{} exists already", file.display()),
            "name another file, or overwrite it with --force",
        ));
    }
    files.write(file, SAMPLE.as_bytes())?;
    if *json && !file.is_standard() {
        print_json(
            &serde_json::json!({"file": file.display().to_string(), "bytes": SAMPLE.len()}),
        )?;
    } else if !file.is_standard() {
        print(&format_args!(
            "wrote {}; next: posegate check {0}",
            file.display()
        ))?;
    }
    Ok(answer(true))
}
