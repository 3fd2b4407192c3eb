//! The failure of a subcommand, and the only renderer of errors. Messages are escaped and shortened before they are printed.

use miette::{
    LabeledSpan, MietteDiagnostic, MietteSpanContents, Report, SourceCode, SourceSpan, SpanContents,
};
use posegate::bake::BakeError;
use posegate::verify::BuildError;
use posegate_files::excerpt::Excerpt;
use posegate_files::files::{FileError, Input};
use posegate_files::printable::{printable, printable_lines};
use posegate_site::SiteError;
use std::io::Write;
use std::process::ExitCode;

/// Bytes of a message that are printed.
const LONGEST: usize = 4_000;
/// Bytes of a message of several lines that are printed.
const LONGEST_LIST: usize = 64_000;

/// The failure of a subcommand, with its exit code.
pub struct Failure {
    code: u8,
    /// The message, of printable texts. `None` if it is printed already, or if the reader of standard output has ended.
    report: Option<Report>,
}

pub type Outcome = Result<ExitCode, Failure>;

/// Returns the exit code of an answer: 0 for yes, 1 for no.
pub fn answer(yes: bool) -> ExitCode {
    ExitCode::from(u8::from(!yes))
}

/// Prints text and a line end on stderr. The caller must escape text from files. A failed write is ignored: there is nowhere
/// to report it.
pub fn to_stderr(text: &str) {
    let _ = writeln!(std::io::stderr(), "{text}");
}

impl Failure {
    /// Bad input or usage: exit code 2.
    pub fn input(error: impl std::error::Error) -> Self {
        Self::of(2, with_causes(&error))
    }

    /// Bad input or usage: exit code 2, with a message and what to do about it.
    pub fn usage(message: String, help: &str) -> Self {
        Self::of(2, with_help(short(&message), help))
    }

    /// As [`Failure::usage`], with a message of several lines. The caller must escape names from files: a line end in a name
    /// would look like one of the message.
    pub fn list(message: &str, help: &str) -> Self {
        let message = cut(&printable_lines(message), LONGEST_LIST);
        Self::of(2, with_help(message, help))
    }

    /// An error at a place in a site file, with the text around it: exit code 2.
    pub fn in_file(error: &SiteError) -> Self {
        let message = match &error.at {
            Some(at) => format!(
                "{}:{}:{}: {}",
                error.file, at.line, at.column, error.message
            ),
            None => format!("{}: {}", error.file, error.message),
        };
        let mut shown = MietteDiagnostic::new(short(&message));
        shown.help = error.help.as_deref().map(short);
        let Some((at, excerpt)) = error.at.zip(error.excerpt.as_deref()) else {
            return Self::of(2, shown.into());
        };
        let expected = error.expected.as_deref();
        let label = expected.map(|expected| short(&format!("expected {expected}")));
        let fault = excerpt.fault.clone();
        shown.labels = Some(vec![LabeledSpan::new(label, fault.start, fault.len())]);
        let place = Place {
            name: short(&error.file),
            column: at.column,
            excerpt: excerpt.clone(),
        };
        Self::of(2, Report::new(shown).with_source_code(place))
    }

    /// An error of making a table from a site file: exit code 2.
    pub fn table(site: &Input, task: &str, error: BakeError) -> Self {
        let help = match &error {
            BakeError::Empty { .. } => "make the steps finer, or put the extent about the set",
            BakeError::TooLarge {
                what: "facets" | "facets in a frame" | "frames" | "pieces",
                ..
            } => {
                "make the success set simpler, or write layout = \"grid\" in [table] or task.NAME.table"
            }
            BakeError::TooLarge { .. } | BakeError::TooFar { .. } => {
                "make the extent smaller or the steps coarser in [table] or task.NAME.table"
            }
            BakeError::NoPieces(_) => "write layout = \"grid\" in [table] or task.NAME.table",
            BakeError::Goal { x, y } => {
                let help = format!(
                    "add the map's origin to the site, which is subtracted from goals, tags, estimates and truth: [origin] x = {:?}, y = {:?}",
                    x.round(),
                    y.round()
                );
                return Self::usage(format!("{}: task `{task}`: {error}", site.display()), &help);
            }
            BakeError::Epsilon(_) => "write an epsilon such as 0.99 in [confidence]",
            _ => "see [table] and task.NAME.table in the site file",
        };
        Self::usage(format!("{}: task `{task}`: {error}", site.display()), help)
    }

    /// An error of making or proving a table from a site file: exit code 2, or 3 for an internal error.
    pub fn build(site: &Input, task: &str, error: BuildError) -> Self {
        match error {
            BuildError::Bake(error) => Self::table(site, task, error),
            error if error.is_internal() => Self::internal(error.to_string()),
            error => Self::usage(
                format!("{}: task `{task}`: {error}", site.display()),
                "the set is thinner there than a proof can resolve: choose other steps or another extent in [table] or \
                 task.NAME.table, or leave slivers out of the success set",
            ),
        }
    }

    /// An internal error: exit code 3.
    pub fn internal(message: String) -> Self {
        let help = "this is an internal error of posegate: please report it with the site file";
        Self::of(3, with_help(short(&message), help))
    }

    /// Bad usage whose message is printed already: exit code 2.
    pub fn printed() -> Self {
        Self {
            code: 2,
            report: None,
        }
    }

    fn of(code: u8, report: Report) -> Self {
        let report = Some(report);
        Self { code, report }
    }

    /// Returns the message with its causes, each after a colon, and what to do about it. `None` if it is printed already.
    pub fn words(&self) -> Option<(String, Option<String>)> {
        let report = self.report.as_ref()?;
        let messages: Vec<String> = report.chain().map(ToString::to_string).collect();
        Some((
            messages.join(": "),
            report.help().map(|help| help.to_string()),
        ))
    }

    /// Prints the failure and returns its exit code.
    pub fn report(self) -> ExitCode {
        if let Some(report) = self.report {
            to_stderr(&format!("{report:?}"));
        }
        ExitCode::from(self.code)
    }
}

impl From<FileError> for Failure {
    fn from(error: FileError) -> Self {
        match error {
            // Ends quietly, as Unix tools do before `head`. The exit code is not 0, which would mean yes.
            FileError::Closed => Self::printed(),
            error => Self::usage(error.to_string(), error.help()),
        }
    }
}

/// Returns text on one line, printable and of limited length.
fn short(text: &str) -> String {
    // The text may be very long, so it is cut before it is escaped.
    cut(&printable(&cut(text, LONGEST)), 2 * LONGEST)
}

/// Returns the text, or its beginning and end if it has more than `most` bytes.
fn cut(text: &str, most: usize) -> String {
    if text.len() <= most {
        return text.into();
    }
    let head = &text[..text.floor_char_boundary(most * 3 / 4)];
    let tail = &text[text.ceil_char_boundary(text.len() - most / 4)..];
    format!("{head} \u{2026} {tail}")
}

fn with_help(message: String, help: &str) -> Report {
    MietteDiagnostic::new(message).with_help(short(help)).into()
}

fn with_causes(error: &dyn std::error::Error) -> Report {
    let message = short(&error.to_string());
    match error.source() {
        Some(cause) => with_causes(cause).wrap_err(message),
        None => MietteDiagnostic::new(message).into(),
    }
}

/// A place in a file.
struct Place {
    name: String,
    /// Column in characters, counted from 1.
    column: usize,
    excerpt: Excerpt,
}

/// Provides the excerpt with line and column numbers of the whole file.
impl SourceCode for Place {
    fn read_span<'a>(
        &'a self,
        span: &SourceSpan,
        before: usize,
        after: usize,
    ) -> Result<Box<dyn SpanContents<'a> + 'a>, miette::MietteError> {
        let part = self.excerpt.text.read_span(span, before, after)?;
        // miette asks for the place of the fault alone, without the lines around it.
        let column = match before {
            0 => self.column.saturating_sub(1),
            _ => part.column(),
        };
        Ok(Box::new(MietteSpanContents::new_named(
            self.name.clone(),
            part.data(),
            *part.span(),
            part.line() + self.excerpt.first_line.saturating_sub(1),
            column,
            part.line_count(),
        )))
    }
}
