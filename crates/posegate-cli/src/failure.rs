//! The failure of a subcommand, and the only renderer of errors. Messages are escaped and shortened before they are printed.

use miette::{Diagnostic, LabeledSpan, MietteSpanContents, SourceCode, SourceSpan, SpanContents};
use posegate::bake::BakeError;
use posegate::verify::BuildError;
use posegate_files::excerpt::Excerpt;
use posegate_files::files::{FileError, Input};
use posegate_files::printable::{printable, printable_lines};
use posegate_site::SiteError;
use std::fmt;
use std::io::Write;
use std::process::ExitCode;

/// Bytes of a message that are printed.
const LONGEST: usize = 4_000;
/// Bytes of a message of several lines that are printed.
const LONGEST_LIST: usize = 64_000;

/// The failure of a subcommand, with its exit code.
pub struct Failure {
    code: u8,
    /// The message. `None` if it is printed already, or if the reader of standard output has ended.
    shown: Option<Box<Shown>>,
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
        Self::of(2, Shown::with_causes(&error))
    }

    /// Bad input or usage: exit code 2, with a message and what to do about it.
    pub fn usage(message: String, help: &str) -> Self {
        Self::of(2, Shown::new(&message).help(help))
    }

    /// As [`Failure::usage`], with a message of several lines. The caller must escape names from files: a line end in a name
    /// would look like one of the message.
    pub fn list(message: &str, help: &str) -> Self {
        let mut shown = Shown::new("");
        shown.message = cut(&printable_lines(message), LONGEST_LIST);
        Self::of(2, shown.help(help))
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
        let mut shown = Shown::new(&message);
        shown.help = error.help.as_deref().map(short);
        shown.place = error
            .at
            .zip(error.excerpt.as_deref())
            .map(|(at, excerpt)| Place {
                name: short(&error.file),
                column: at.column,
                label: error
                    .expected
                    .as_deref()
                    .map(|expected| short(&format!("expected {expected}"))),
                excerpt: excerpt.clone(),
            });
        Self::of(2, shown)
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
        Self::of(3, Shown::new(&message).help(help))
    }

    /// Bad usage whose message is printed already: exit code 2.
    pub fn printed() -> Self {
        Self {
            code: 2,
            shown: None,
        }
    }

    fn of(code: u8, shown: Shown) -> Self {
        Self {
            code,
            shown: Some(Box::new(shown)),
        }
    }

    /// Returns the message with its causes, each after a colon, and what to do about it. `None` if it is printed already.
    pub fn words(&self) -> Option<(String, Option<String>)> {
        let shown = self.shown.as_deref()?;
        let mut message = shown.message.clone();
        let mut cause = shown.cause.as_deref();
        while let Some(next) = cause {
            message = format!("{message}: {}", next.message);
            cause = next.cause.as_deref();
        }
        Some((message, shown.help.clone()))
    }

    /// Prints the failure and returns its exit code.
    pub fn report(self) -> ExitCode {
        if let Some(shown) = self.shown {
            to_stderr(&format!("{:?}", miette::Report::new(*shown)));
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

/// The parts of a failure that are printed. All texts are printable.
struct Shown {
    message: String,
    help: Option<String>,
    cause: Option<Box<Shown>>,
    place: Option<Place>,
}

/// A place in a file.
struct Place {
    name: String,
    /// Column in characters, counted from 1.
    column: usize,
    label: Option<String>,
    excerpt: Excerpt,
}

impl Shown {
    fn new(message: &str) -> Self {
        Self {
            message: short(message),
            help: None,
            cause: None,
            place: None,
        }
    }

    fn help(mut self, help: &str) -> Self {
        self.help = Some(short(help));
        self
    }

    fn with_causes(error: &dyn std::error::Error) -> Self {
        let mut shown = Self::new(&error.to_string());
        shown.cause = error
            .source()
            .map(|cause| Box::new(Self::with_causes(cause)));
        shown
    }
}

impl fmt::Debug for Shown {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

impl fmt::Display for Shown {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for Shown {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        self.cause.as_ref().map(|cause| &**cause as _)
    }
}

impl Diagnostic for Shown {
    fn help(&self) -> Option<Box<dyn fmt::Display + '_>> {
        self.help.as_ref().map(|help| Box::new(help) as _)
    }

    fn source_code(&self) -> Option<&dyn SourceCode> {
        self.place.as_ref().map(|place| place as _)
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        let place = self.place.as_ref()?;
        let fault = place.excerpt.fault.clone();
        let label = LabeledSpan::new(place.label.clone(), fault.start, fault.len());
        Some(Box::new(std::iter::once(label)))
    }
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
