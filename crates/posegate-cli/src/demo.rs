//! `posegate demo`: the paper's case study.

use crate::site_input::{Failure, Outcome, answer, print, progress};
use posegate_files::files::{Files, OutputFolder};
use posegate_show::draw::figures;
use posegate_show::draw::report::{numbers, summary};
use posegate_show::draw::study::{CaseStudy, SITE, StudyError};

/// Writes the paper's case study: pictures, tables and numbers
#[derive(clap::Args)]
#[command(after_help = "Example:\n  posegate demo -o demo-out")]
pub struct Arguments {
    /// The folder to write to; it is created if it does not exist
    #[arg(short, long)]
    output: OutputFolder,
    /// Print the numbers as JSON instead of the summary
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments, files: &Files) -> Outcome {
    let folder = &arguments.output;
    files.make(folder)?;
    let bar = progress(CaseStudy::steps().map_err(fault)?, "proving");
    let study = CaseStudy::run(&|| bar.inc(1)).map_err(fault)?;
    bar.finish_and_clear();
    let mut written: Vec<(String, Vec<u8>)> = vec![("site.toml".into(), SITE.into())];
    for table in &study.tables {
        written.push((format!("{}.posegate", table.task), table.bytes.clone()));
    }
    for (name, picture) in figures(&study).map_err(fault)? {
        written.push((name.into(), picture.into_bytes()));
    }
    let numbers = numbers(&study).map_err(fault)?;
    written.push(("numbers.json".into(), numbers.clone().into_bytes()));
    files.write_into(folder, &written)?;
    if arguments.json {
        print(&numbers.trim_end())?;
        return Ok(answer(true));
    }
    print(&summary(&study).map_err(fault)?.trim_end())?;
    print(&format_args!("Files in {}", folder.display()))?;
    for (name, _) in &written {
        print(&format_args!("  {name}"))?;
    }
    Ok(answer(true))
}

/// The study has its own input, so every error is an internal error.
fn fault(error: StudyError) -> Failure {
    Failure::internal(error.to_string())
}
