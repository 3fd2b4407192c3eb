//! Shared by all subcommands: reading site files and their tasks.

pub use crate::failure::{Failure, Outcome, answer};
pub use crate::terminal::{json_line, print, print_json, progress, progress_with_rate, warn};
use posegate_files::files::{Files, Input};
use posegate_show::doctor::{IMPOSSIBLE_ERROR, stated_errors};
use posegate_site::{Site, Task};

/// Reads and checks a site file.
pub fn site(files: &Files, input: &Input) -> Result<Site, Failure> {
    Ok(site_and_text(files, input)?.0)
}

/// Reads a site file, and returns its text too.
pub fn site_and_text(files: &Files, input: &Input) -> Result<(Site, String), Failure> {
    let (text, name) = files.read_text(input)?;
    Ok((parsed(files, &text, &name)?, text))
}

/// Reads a site for commands that rely on its localization tasks: also checks the stated errors of these tasks.
pub fn relied_on(files: &Files, input: &Input) -> Result<Site, Failure> {
    let site = site(files, input)?;
    check_stated_errors(&site)?;
    Ok(site)
}

/// Refuses a stated error that the tolerances of tag and camera exceed from every view. Warns if they exceed it from
/// some views.
pub fn check_stated_errors(site: &Site) -> Result<(), Failure> {
    for warning in stated_errors(site) {
        let message = format!("{}: {}", warning.about, warning.message);
        if warning.code == IMPOSSIBLE_ERROR {
            return Err(Failure::usage(message, &warning.help));
        }
        warn(&format_args!(
            "warning: {message}\n  help: {}",
            warning.help
        ));
    }
    Ok(())
}

/// Parses and checks the text of a site file, and registers the files that it names as inputs of the command.
pub fn parsed(files: &Files, text: &str, name: &str) -> Result<Site, Failure> {
    let site = Site::parse(text, name).map_err(|error| Failure::in_file(&error))?;
    register(files, &site)?;
    Ok(site)
}

/// Registers the files that a site names.
fn register(files: &Files, site: &Site) -> Result<(), Failure> {
    for file in &site.files {
        files.register(file)?;
    }
    Ok(())
}

/// Returns a task of a site by name.
pub fn task<'a>(site: &'a Site, name: &str) -> Result<&'a Task, Failure> {
    site.task(name).map_err(Failure::input)
}
