//! Why a subcommand failed, and the one renderer of errors. Whatever a message holds, it is printed escaped and cut to a limited length.

use miette::{Diagnostic, LabeledSpan, MietteSpanContents, SourceCode, SourceSpan, SpanContents};
use posegate::bake::BakeError;
use posegate::verify::BuildError;
use posegate_host::excerpt::Excerpt;
use posegate_host::files::{FileError, Input};
use posegate_host::printable::{printable, printable_lines};
use posegate_host::site::SiteError;
use std::fmt;
use std::process::ExitCode;

/// Characters of a message that are printed.
const LONGEST: usize = 4_000;
/// The same of a message of several lines.
const LONGEST_LIST: usize = 64_000;

/// Why a subcommand failed, with its exit code.
pub struct Failure {
    code: u8,
    /// What is printed; nothing where the reader of standard output has ended.
    shown: Option<Box<Shown>>,
}

pub type Outcome = Result<ExitCode, Failure>;

/// The answer of a subcommand: 0 for yes, 1 for no.
pub fn answer(yes: bool) -> ExitCode {
    ExitCode::from(u8::from(!yes))
}

impl Failure {
    /// Bad input or usage: exit code 2.
    pub fn input(error: impl std::error::Error) -> Self {
        Self::of(2, Shown::with_causes(&error))
    }

    /// Bad input or usage in words, with what to do about it.
    pub fn usage(message: String, help: &str) -> Self {
        Self::of(2, Shown::new(&message).help(help))
    }

    /// The same with a message of several lines. Names from files in it are escaped already: their line ends would be taken for its own.
    pub fn list(message: &str, help: &str) -> Self {
        let mut shown = Shown::new("");
        shown.message = cut(&printable_lines(message), LONGEST_LIST);
        Self::of(2, shown.help(help))
    }

    /// A fault in a file with its text.
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

    /// A table that cannot be made from a site file.
    pub fn table(site: &Input, task: &str, error: BakeError) -> Self {
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
        Self::usage(format!("{}: task `{task}`: {error}", site.display()), help)
    }

    /// A table that cannot be made from a site file, or not be proven.
    pub fn build(site: &Input, task: &str, error: BuildError) -> Self {
        match error {
            BuildError::Bake(error) => Self::table(site, task, error),
            error if error.is_internal() => Self::internal(error.to_string()),
            error => Self::usage(
                format!("{}: task `{task}`: {error}", site.display()),
                "the set is thinner there than a proof can tell: choose other steps or another extent in [table] or \
                 task.NAME.table, or leave slivers out of the success set",
            ),
        }
    }

    /// A fault of this program: exit code 3.
    pub fn internal(message: String) -> Self {
        let help =
            "this is a fault of posegate, not of the input: please report it with the site file";
        Self::of(3, Shown::new(&message).help(help))
    }

    /// Bad usage that is printed already.
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

    /// Prints the failure and gives its exit code.
    pub fn report(self) -> ExitCode {
        if let Some(shown) = self.shown {
            crate::terminal::to_stderr(&format!("{:?}", miette::Report::new(*shown)));
        }
        ExitCode::from(self.code)
    }
}

impl From<FileError> for Failure {
    fn from(error: FileError) -> Self {
        match error {
            // As Unix tools end in front of `head`. The exit code is not 0, which would be a yes.
            FileError::Closed => Self::printed(),
            error => Self::usage(error.to_string(), error.help()),
        }
    }
}

/// Text on one line, printable and of limited length.
fn short(text: &str) -> String {
    // What is cut off is not escaped first: it may be long.
    cut(&printable(&cut(text, LONGEST)), 2 * LONGEST)
}

/// The text, or its beginning and its end.
fn cut(text: &str, most: usize) -> String {
    if text.len() <= most {
        return text.into();
    }
    let head = &text[..text.floor_char_boundary(most * 3 / 4)];
    let tail = &text[text.ceil_char_boundary(text.len() - most / 4)..];
    format!("{head} \u{2026} {tail}")
}

/// What is printed of a failure. All of its text is printable.
struct Shown {
    message: String,
    help: Option<String>,
    cause: Option<Box<Shown>>,
    place: Option<Place>,
}

/// A place in a file.
struct Place {
    name: String,
    /// In characters, counted from 1.
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

/// The excerpt, with the lines and the column of the whole file.
impl SourceCode for Place {
    fn read_span<'a>(
        &'a self,
        span: &SourceSpan,
        before: usize,
        after: usize,
    ) -> Result<Box<dyn SpanContents<'a> + 'a>, miette::MietteError> {
        let part = self.excerpt.text.read_span(span, before, after)?;
        // Without lines around it, it is the fault's place that is asked for.
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
