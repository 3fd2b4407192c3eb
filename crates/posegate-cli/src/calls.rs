//! Entry points for other languages: the same reading, checks and error messages as the command line.
//!
//! The package `posegate-python` calls these functions.

use crate::failure::Failure;
use crate::site_input;
use crate::{gate, table};
use posegate::set::RadiusSquared;
use posegate::table::Table;
use posegate_files::files::{Files, Input, captured};
use posegate_site::{Site, Task};
use std::ffi::OsString;
use std::path::Path;
use std::process::ExitCode;
use std::sync::OnceLock;

/// The file of the library that has this code in it, if a program of another language has loaded it.
static LIBRARY: OnceLock<Box<Path>> = OnceLock::new();

/// Returns the file of the library, if there is one.
pub(crate) fn library() -> Option<&'static Path> {
    LIBRARY.get().map(AsRef::as_ref)
}

/// The reason of a refused call, as the command line prints it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Refusal {
    /// What is wrong, with its causes. Printable, on one line.
    pub message: String,
    /// What to do about it.
    pub help: Option<String>,
}

impl From<Failure> for Refusal {
    fn from(failure: Failure) -> Self {
        let (message, help) = failure.words().unwrap_or_default();
        Self { message, help }
    }
}

/// Runs a command line in a program of another language. `library` is the file that has this code in it: shards of a site
/// are merged only if all were made by the same file.
pub fn program_of(library: &Path, words: impl IntoIterator<Item = OsString>) -> u8 {
    // The first call counts: a process loads one library.
    let _ = LIBRARY.set(library.into());
    let code = crate::program(words);
    (0..=u8::MAX)
        .find(|number| ExitCode::from(*number) == code)
        .unwrap_or(3)
}

/// Runs a command line in this thread, and returns what it prints on standard output. An answer of no (exit code 1) is an answer, too.
///
/// # Errors
/// The command line is wrong, or the command refuses its input.
pub fn answer(words: Vec<OsString>) -> Result<String, Refusal> {
    if let Err(error) = crate::arguments::command().try_get_matches_from(&words) {
        let text = error.to_string();
        let message = text.lines().next().unwrap_or_default();
        return Err(Refusal {
            message: message.trim_start_matches("error: ").to_owned(),
            help: None,
        });
    }
    let (ended, printed) = captured(|| crate::run(&words));
    ended?;
    Ok(String::from_utf8_lossy(&printed).into_owned())
}

/// Reads the bytes of a table, and checks them.
///
/// # Errors
/// The file cannot be read, or is not a table.
pub fn read_table(path: OsString) -> Result<Vec<u8>, Refusal> {
    let (bytes, name) = Files::new()
        .read(&Input::from(path))
        .map_err(Failure::from)?;
    check_table(&bytes, &name)?;
    Ok(bytes)
}

/// Checks the bytes of a table; `name` is its name in messages.
///
/// # Errors
/// The bytes are not a table.
pub fn check_table(bytes: &[u8], name: &str) -> Result<(), Refusal> {
    match Table::parse(bytes) {
        Ok(_) => Ok(()),
        Err(error) => Err(gate::not_a_table(name, error).into()),
    }
}

/// Returns the squared radius of a confidence, or that of the table.
///
/// # Errors
/// The confidence is not one that the gate accepts.
pub fn radius(table: &Table<'_>, epsilon: Option<f64>) -> Result<RadiusSquared, Refusal> {
    Ok(gate::radius(table, epsilon)?)
}

/// Reads a site file.
///
/// # Errors
/// The file, or one that it names, cannot be read or has a fault.
pub fn read_site(path: OsString) -> Result<Site, Refusal> {
    Ok(site_input::site(&Files::new(), &Input::from(path))?)
}

/// Checks the text of a site file; `name` is its name in messages.
///
/// # Errors
/// The text, or a file that it names, has a fault.
pub fn parse_site(text: &str, name: &str) -> Result<Site, Refusal> {
    Ok(site_input::parsed(&Files::new(), text, name)?)
}

/// Returns a task of a site by name.
///
/// # Errors
/// The site has no such task.
pub fn task<'a>(site: &'a Site, name: &str) -> Result<&'a Task, Refusal> {
    Ok(site_input::task(site, name)?)
}

/// Builds and proves the table of a task; `path` is the site's name in messages.
///
/// # Errors
/// The task does not exist, or its set gives no table that can be proven.
pub fn build_table(site: &Site, path: OsString, name: &str) -> Result<Vec<u8>, Refusal> {
    Ok(table::built(site, &Input::from(path), name, site.epsilon)?)
}
