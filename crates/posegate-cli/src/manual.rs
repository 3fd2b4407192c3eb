//! Completions of shells and manual pages, both made of the command line itself.

use crate::site_input::{Failure, Outcome, answer, print};
use posegate_files::files::{self, Files, OutputFolder};

/// Prints the file with which a shell completes commands.
pub fn completions(shell: clap_complete::Shell) -> Outcome {
    let mut text = Vec::new();
    let mut command = crate::arguments::command();
    clap_complete::generate(shell, &mut command, "posegate", &mut text);
    files::print(&text)?;
    Ok(answer(true))
}

/// Writes a manual page for each command.
pub fn pages(folder: &OutputFolder, files: &Files) -> Outcome {
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
    files.write_into(folder, &pages)?;
    print(&format_args!(
        "{} pages in {}",
        pages.len(),
        folder.display()
    ))?;
    Ok(answer(true))
}
