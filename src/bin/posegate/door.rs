//! What every subcommand shares: reading, writing whole files, failing with the right exit code.

use indicatif::{ProgressBar, ProgressStyle};
use miette::{Diagnostic, LabeledSpan, NamedSource, SourceCode};
use posegate::bake::BakeError;
use posegate::site::{Site, SiteError, Task};
use std::fmt;
use std::fs::File;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Why a subcommand failed, with its exit code.
pub struct Failure {
    code: u8,
    report: miette::Report,
}

pub type Outcome = Result<ExitCode, Failure>;

/// The answer of a subcommand: 0 for yes, 1 for no.
pub fn answer(yes: bool) -> ExitCode {
    ExitCode::from(u8::from(!yes))
}

impl Failure {
    /// Bad input or usage: exit code 2.
    pub fn input(error: impl std::error::Error + Send + Sync + 'static) -> Self {
        Self {
            code: 2,
            report: miette::Report::from_err(error),
        }
    }

    /// Bad input or usage in words, with what to do about it.
    pub fn usage(message: String, help: &str) -> Self {
        Self {
            code: 2,
            report: miette::miette!(help = help, "{message}"),
        }
    }

    /// A fault in a file with its text.
    pub fn in_file(error: SiteError, text: String) -> Self {
        Self {
            code: 2,
            report: miette::Report::new(SiteFault {
                source: NamedSource::new(&error.file, text),
                error,
            }),
        }
    }

    /// A table that cannot be made from a site file.
    pub fn table(site: &Path, task: &str, error: BakeError) -> Self {
        let help = match &error {
            BakeError::Empty { .. } => "make the steps finer, or put the extent about the set",
            BakeError::TooLarge { .. } | BakeError::TooFar { .. } => {
                "make the extent smaller or the steps coarser in [table] or task.NAME.table"
            }
            BakeError::NoPieces(_) => "write layout = \"grid\" or \"auto\"",
            BakeError::Goal { .. } => "choose a world origin nearer to the site",
            BakeError::Epsilon(_) => "write an epsilon such as 0.99 in [confidence]",
            _ => "see [table] and task.NAME.table in the site file",
        };
        let place = format!("{}: task `{task}`", site.display());
        Self {
            code: 2,
            report: miette::miette!(help = help, "{place}: {error}"),
        }
    }

    /// A fault of this program: exit code 3.
    pub fn internal(message: String) -> Self {
        Self {
            code: 3,
            report: miette::miette!(
                help = "this is a fault of posegate, not of the input: please report it with the site file",
                "{message}"
            ),
        }
    }

    /// Prints the failure and gives its exit code.
    pub fn report(self) -> ExitCode {
        eprintln!("{:?}", self.report);
        ExitCode::from(self.code)
    }
}

/// A site file's fault with the place shown.
struct SiteFault {
    error: SiteError,
    source: NamedSource<String>,
}

impl fmt::Debug for SiteFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

impl fmt::Display for SiteFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.error.at {
            Some(at) => write!(
                f,
                "{}:{}:{}: {}",
                self.error.file, at.line, at.column, self.error.message
            ),
            None => write!(f, "{}: {}", self.error.file, self.error.message),
        }
    }
}

impl std::error::Error for SiteFault {}

impl Diagnostic for SiteFault {
    fn help(&self) -> Option<Box<dyn fmt::Display + '_>> {
        self.error.help.as_ref().map(|help| Box::new(help) as _)
    }

    fn source_code(&self) -> Option<&dyn SourceCode> {
        self.error.at.as_ref().map(|_| &self.source as _)
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        let at = self.error.at.as_ref()?;
        let label = self
            .error
            .expected
            .as_ref()
            .map(|expected| format!("expected {expected}"));
        Some(Box::new(std::iter::once(LabeledSpan::new(
            label, at.offset, at.len,
        ))))
    }
}

/// The text of a file, or of standard input for `-`, and its name for errors.
pub fn read(path: &Path) -> Result<(Vec<u8>, String), Failure> {
    let mut bytes = Vec::new();
    if path == Path::new("-") {
        std::io::stdin().read_to_end(&mut bytes).map_err(|error| {
            Failure::usage(
                format!("standard input cannot be read: {error}"),
                "give a file",
            )
        })?;
        return Ok((bytes, "<stdin>".into()));
    }
    let name = path.display().to_string();
    let bytes = std::fs::read(path).map_err(|error| {
        Failure::usage(
            format!("{name}: {error}"),
            "check the path; `-` reads standard input",
        )
    })?;
    Ok((bytes, name))
}

/// Reads and checks a site file.
pub fn site(path: &Path) -> Result<Site, Failure> {
    let (bytes, name) = read(path)?;
    parsed(bytes, &name)
}

/// Checks the text of a site file.
pub fn parsed(bytes: Vec<u8>, name: &str) -> Result<Site, Failure> {
    let text = String::from_utf8(bytes).map_err(|error| {
        Failure::usage(
            format!("{name}: not UTF-8: {error}"),
            "site files are UTF-8 text",
        )
    })?;
    Site::parse(&text, name).map_err(|error| {
        // The fault may be in a file that the site names.
        let text = if *error.file == *name {
            text
        } else {
            std::fs::read_to_string(&*error.file).unwrap_or_default()
        };
        Failure::in_file(error, text)
    })
}

/// A task of a site by name.
pub fn task<'a>(site: &'a Site, name: &str) -> Result<&'a Task, Failure> {
    site.task(name).map_err(Failure::input)
}

/// Writes a file whole or not at all: to a temporary name beside it, then renamed.
pub fn write(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    if path == Path::new("-") {
        return match std::io::stdout().write_all(bytes) {
            Err(error) if error.kind() == std::io::ErrorKind::BrokenPipe => std::process::exit(0),
            written => written.map_err(|error| {
                Failure::usage(
                    format!("standard output cannot be written: {error}"),
                    "give a file",
                )
            }),
        };
    }
    let mut draft = Draft::new(path)?;
    let written = draft.file.write_all(bytes);
    written.map_err(|error| cannot_write(path, &error))?;
    draft.keep()
}

fn cannot_write(path: &Path, error: &dyn fmt::Display) -> Failure {
    Failure::usage(
        format!("{}: {error}", path.display()),
        "check that the folder exists and can be written",
    )
}

/// A file that is being written under a temporary name. It goes where it is not kept. A device, a pipe, or an output that is open already
/// (`/dev/stdout`) is written to as it is; where a link leads to a file that file is replaced.
pub struct Draft {
    /// What is written to.
    pub file: File,
    path: PathBuf,
    temporary: Option<PathBuf>,
}

impl Draft {
    pub fn new(path: &Path) -> Result<Self, Failure> {
        let real = path.canonicalize();
        if real.is_err() && path.is_symlink() && path.metadata().is_err() {
            return Err(cannot_write(path, &"a link that leads to no file"));
        }
        let open_already = ["/dev/stdout", "/dev/stderr", "/dev/fd", "/proc"];
        let as_it_is = open_already.iter().any(|root| path.starts_with(root))
            || path
                .metadata()
                .is_ok_and(|data| real.is_err() || !data.is_file());
        let path = &real.unwrap_or_else(|_| path.into());
        let (file, temporary) = if as_it_is {
            (File::options().append(true).open(path), None)
        } else {
            let mut name = path.file_name().unwrap_or_default().to_os_string();
            name.push(format!(".{}.tmp", std::process::id()));
            let temporary = path.with_file_name(name);
            (File::create(&temporary), Some(temporary))
        };
        Ok(Self {
            file: file.map_err(|error| cannot_write(path, &error))?,
            path: path.into(),
            temporary,
        })
    }

    /// An error of writing to it, with its name.
    pub fn fault(&self, error: &dyn fmt::Display) -> Failure {
        cannot_write(&self.path, error)
    }

    /// Gives it its name.
    pub fn keep(mut self) -> Result<(), Failure> {
        let Some(temporary) = &self.temporary else {
            return Ok(());
        };
        let done = self
            .file
            .sync_all()
            .and_then(|()| std::fs::rename(temporary, &self.path));
        let done = done.map_err(|error| cannot_write(&self.path, &error));
        if done.is_ok() {
            self.temporary = None;
        }
        done
    }
}

impl Drop for Draft {
    fn drop(&mut self) {
        if let Some(temporary) = &self.temporary {
            // What is left of the attempt goes; the first error is the one to report.
            let _ = std::fs::remove_file(temporary);
        }
    }
}

/// A progress bar on stderr; none where stderr is no terminal.
pub fn progress(length: u64, what: &'static str) -> ProgressBar {
    bar(length, what, "{msg:>10} [{bar:40}] {pos}/{len} {eta}")
}

/// The same with how many are done in a second, of which some take long: times stand still between them otherwise.
pub fn progress_with_rate(length: u64, what: &'static str) -> ProgressBar {
    let template = "{msg:>10} [{bar:40}] {pos}/{len}, {per_sec}, {eta} left";
    let bar = bar(length, what, template);
    bar.enable_steady_tick(std::time::Duration::from_millis(200));
    bar
}

fn bar(length: u64, what: &'static str, template: &str) -> ProgressBar {
    let style =
        ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::new(length)
        .with_style(style)
        .with_message(what)
}

/// Prints one line on stdout. A reader that has gone away ends the program quietly.
pub fn print(line: &impl fmt::Display) -> Result<(), Failure> {
    let mut out = std::io::stdout().lock();
    match writeln!(out, "{line}") {
        Ok(()) => Ok(()),
        Err(error) if error.kind() == std::io::ErrorKind::BrokenPipe => std::process::exit(0),
        Err(error) => Err(Failure::usage(
            format!("standard output cannot be written: {error}"),
            "redirect it to a file",
        )),
    }
}
