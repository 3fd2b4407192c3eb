//! `posegate demo`: the paper's case study.

use crate::site_input::{Failure, Outcome, answer, print, progress};
use posegate_files::files::{Files, OutputFolder};
use posegate_show::draw::report::{numbers, summary};
use posegate_show::draw::study::{CaseStudy, SITE, StudyError};
use posegate_show::draw::{fig1_parking, fig2_chain, fig3_plan, fig3_sections, fig4_placement};

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
    for (name, text) in [
        ("fig1-parking.svg", fig1_parking(&study)),
        ("fig2-chain.svg", fig2_chain(&study)),
        ("fig3-sections.svg", fig3_sections(&study)),
        ("fig3-plan.svg", fig3_plan(&study)),
        ("fig4-placement.svg", Ok(fig4_placement(&study))),
        ("numbers.json", numbers(&study)),
    ] {
        written.push((name.into(), text.map_err(fault)?.into_bytes()));
    }
    files.write_into(folder, &written)?;
    if arguments.json {
        print(&numbers(&study).map_err(fault)?.trim_end())?;
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
