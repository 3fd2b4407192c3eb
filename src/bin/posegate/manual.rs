//! `posegate man`: manual pages.

use crate::door::{Failure, Outcome, answer, print, write};
use clap::CommandFactory;
use std::path::PathBuf;

/// Writes manual pages, one for each command
#[derive(clap::Args)]
#[command(after_help = "Example:\n  posegate man -o man && man man/posegate-table-build.1")]
pub struct Arguments {
    /// The folder to write them into; it is made where it is missing
    #[arg(short, long)]
    output: PathBuf,
}

pub fn run(arguments: &Arguments) -> Outcome {
    std::fs::create_dir_all(&arguments.output).map_err(|error| {
        Failure::usage(
            format!("{}: {error}", arguments.output.display()),
            "give a folder that can be written",
        )
    })?;
    let mut command = crate::Arguments::command().name("posegate");
    command.build();
    let mut open = vec![(String::from("posegate"), command)];
    let mut pages = 0;
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
        write(&arguments.output.join(format!("{name}.1")), &text)?;
        pages += 1;
    }
    print(&format_args!(
        "{pages} pages in {}",
        arguments.output.display()
    ))?;
    Ok(answer(true))
}
