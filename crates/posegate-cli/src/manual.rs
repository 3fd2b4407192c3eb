//! `posegate man`: writes manual pages.

use crate::site_input::{Failure, Outcome, answer, print};
use posegate_files::files::{Files, OutputFolder};

/// Writes manual pages, one for each command
#[derive(clap::Args)]
#[command(after_help = "Example:\n  posegate man -o man && man man/posegate-table-build.1")]
pub struct Arguments {
    /// The folder to write to; it is created if it does not exist
    #[arg(short, long)]
    output: OutputFolder,
}

pub fn run(arguments: &Arguments, files: &Files) -> Outcome {
    let mut command = crate::arguments::command().name("posegate");
    command.build();
    let mut open = vec![(String::from("posegate"), command)];
    let mut pages = Vec::new();
    while let Some((name, command)) = open.pop() {
        for below in command
            .get_subcommands()
            .filter(|below| below.get_name() != "help")
        {
            open.push((format!("{name}-{}", below.get_name()), below.clone()));
        }
        let mut text = Vec::new();
        clap_mangen::Man::new(command)
            .title(name.clone())
            .render(&mut text)
            .map_err(|error| Failure::internal(error.to_string()))?;
        pages.push((format!("{name}.1"), text));
    }
    files.write_into(&arguments.output, &pages)?;
    print(&format_args!(
        "{} pages in {}",
        pages.len(),
        arguments.output.display()
    ))?;
    Ok(answer(true))
}
