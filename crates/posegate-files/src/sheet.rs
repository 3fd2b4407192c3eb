//! Rows of a CSV with a header: columns by name, in any order, others ignored. Errors state the line and the column of
//! an invalid field.
//!
//! Entry points: [`Sheet::new`], [`Sheet::with`]; [`Records`] for a file without a header. Rows are read one by one into the same
//! memory.

use std::io::{Chain, Read};
use std::str::FromStr;

/// A fault in a CSV.
#[derive(Debug, thiserror::Error)]
#[error("{file}:{line}{}: {fault}", .column.map_or_else(String::new, |column| format!(":{column}")))]
pub struct SheetError {
    /// The file.
    pub file: String,
    /// Line, from 1.
    pub line: u64,
    /// Field of the line, from 1; `None` if the fault is that of a row.
    pub column: Option<usize>,
    /// The fault.
    pub fault: Box<SheetFault>,
}

/// The kinds of faults in a CSV.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SheetFault {
    /// A required column is missing.
    #[error(
        "there is no column `{name}`; expected a header with {expected} (this one has {found:?})"
    )]
    MissingColumn {
        /// The column.
        name: String,
        /// All required columns.
        expected: String,
        /// The existing columns.
        found: String,
    },
    /// A column appears twice.
    #[error("the column `{0}` appears twice; keep one of them")]
    RepeatedColumn(String),
    /// A field has another text than expected.
    #[error("`{text}` in `{name}`; expected {expected}")]
    Field {
        /// The text.
        text: String,
        /// The column.
        name: String,
        /// The expected text.
        expected: String,
    },
    /// A fault that only the reader of this kind of file knows.
    #[error("{0}")]
    Other(String),
    /// A field is not UTF-8.
    #[error("bytes that are not UTF-8; save the file as UTF-8")]
    NotText,
    /// A carriage return is not part of a line end.
    #[error(
        "a carriage return without a line feed; save the file with lines that end with a line feed"
    )]
    CarriageReturn,
    /// An opening quote has no closing quote.
    #[error("a quote that is not closed; close it, or leave both quotes out")]
    OpenQuote,
    /// The input cannot be read.
    #[error("{0}")]
    Csv(csv::Error),
}

impl SheetError {
    /// Returns the error of a row, or of a field if there is a column.
    pub fn new(file: &str, line: u64, column: Option<usize>, fault: SheetFault) -> Self {
        Self {
            file: file.to_owned(),
            line,
            column,
            fault: Box::new(fault),
        }
    }
}

/// The index of a column.
#[derive(Clone, Copy, Debug, Default)]
pub struct Column(usize);

/// A reader of the lines of a CSV that are neither blank nor comments.
pub struct Records<R> {
    file: String,
    reader: csv::Reader<Chain<R, &'static [u8]>>,
    record: csv::StringRecord,
    number: u64,
}

/// A reader of a CSV.
pub struct Sheet<R> {
    names: Vec<String>,
    /// The line of the names, from 1.
    header: u64,
    records: Records<R>,
}

/// A row of a CSV.
pub struct Line<'a> {
    file: &'a str,
    names: &'a [String],
    record: &'a csv::StringRecord,
    /// The line number, from 1.
    pub number: u64,
}

/// Returns the usual settings: no comments, no quotes.
pub fn settings() -> csv::ReaderBuilder {
    let mut settings = csv::ReaderBuilder::new();
    // Numbers need no quotes. An unclosed quote would hide the rest of the file.
    settings.quoting(false);
    // Only a line feed ends a record, so the line number of a record follows from the line feeds up to its end.
    settings.terminator(csv::Terminator::Any(b'\n'));
    settings.has_headers(false).flexible(true);
    settings
}

/// Returns the results of a function for all items, or its first error.
pub fn each<A, T: Copy + Default, E, const N: usize>(
    items: [A; N],
    mut of: impl FnMut(A) -> Result<T, E>,
) -> Result<[T; N], E> {
    let mut results = [T::default(); N];
    for (result, item) in results.iter_mut().zip(items) {
        *result = of(item)?;
    }
    Ok(results)
}

impl<R: Read> Records<R> {
    /// Starts before the first line. `settings` are those of [`settings()`], perhaps with comments or quotes; `file` names the input in
    /// errors.
    pub fn new(settings: &csv::ReaderBuilder, input: R, file: &str) -> Self {
        Self {
            file: file.to_owned(),
            // A line feed ends the last line, too.
            reader: settings.from_reader(input.chain(&b"\n"[..])),
            record: csv::StringRecord::new(),
            number: 0,
        }
    }

    /// Returns the fields of the next line and its number, from 1; `None` at the end. Fields are not trimmed: a trimmed copy of each
    /// row would take as long as its numbers. The last field may end with the carriage return of a line end.
    ///
    /// # Errors
    /// [`SheetFault::NotText`], [`SheetFault::CarriageReturn`], [`SheetFault::OpenQuote`], [`SheetFault::Csv`].
    pub fn next_record(&mut self) -> Result<Option<(&csv::StringRecord, u64)>, SheetError> {
        loop {
            let mut bytes = std::mem::take(&mut self.record).into_byte_record();
            let more = self.reader.read_byte_record(&mut bytes);
            let reached = self.reader.position().line();
            let fault = |line: u64, column: Option<usize>, fault: SheetFault| {
                Err(SheetError::new(&self.file, line, column, fault))
            };
            match more {
                Ok(true) => {}
                Ok(false) => return Ok(None),
                Err(cause) => return fault(reached, None, SheetFault::Csv(cause)),
            }
            // A field in quotes may have several lines. A field whose quote is not closed ends with the line feed that `new` adds.
            let text = bytes.as_slice();
            let within = text.iter().filter(|byte| **byte == b'\n').count() as u64;
            if text.ends_with(b"\n") {
                return fault(reached.saturating_sub(within), None, SheetFault::OpenQuote);
            }
            self.number = reached.saturating_sub(1 + within);
            let is_lone = |pair: &[u8]| pair[0] == b'\r' && !matches!(pair[1], b'\r' | b'\n');
            if text.windows(2).any(is_lone) {
                return fault(self.number, None, SheetFault::CarriageReturn);
            }
            let is_blank = bytes.len() == 1 && text.iter().all(|byte| *byte == b'\r');
            self.record = match csv::StringRecord::from_byte_record(bytes) {
                Ok(record) => record,
                Err(error) => {
                    let column = error.utf8_error().field() + 1;
                    return fault(self.number, Some(column), SheetFault::NotText);
                }
            };
            if !is_blank {
                return Ok(Some((&self.record, self.number)));
            }
        }
    }
}

impl<R: Read> Sheet<R> {
    /// Reads the header with the usual settings; `file` names the input in errors.
    pub fn new(input: R, file: &str) -> Result<Self, SheetError> {
        Self::with(&settings(), input, file)
    }

    /// Reads the header.
    pub fn with(settings: &csv::ReaderBuilder, input: R, file: &str) -> Result<Self, SheetError> {
        let mut records = Records::new(settings, input, file);
        let name = |name: &str| name.trim().trim_start_matches('\u{feff}').trim().to_owned();
        let (names, header) = match records.next_record()? {
            Some((names, line)) => (names.iter().map(name).collect(), line),
            None => (Vec::new(), 1),
        };
        Ok(Self {
            names,
            header,
            records,
        })
    }

    /// Returns the names of all columns.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Returns the first column with a name, which others may have too.
    pub fn first(&self, name: &str) -> Option<Column> {
        let place = self.names.iter().position(|known| known == name);
        place.map(Column)
    }

    /// Returns a column if it exists.
    pub fn optional(&self, name: &str) -> Result<Option<Column>, SheetError> {
        let mut places = (0..self.names.len()).filter(|index| self.names[*index] == name);
        let column = places.next().map(Column);
        match places.next() {
            None => Ok(column),
            Some(again) => {
                let fault = SheetFault::RepeatedColumn(name.to_owned());
                Err(self.wrong_header(Some(again + 1), fault))
            }
        }
    }

    /// Returns a required column.
    pub fn needed(&self, name: &str, all: &[&str]) -> Result<Column, SheetError> {
        self.optional(name)?.ok_or_else(|| self.missing(name, all))
    }

    /// Returns the error of a column that does not exist.
    pub fn missing(&self, name: &str, all: &[&str]) -> SheetError {
        let fault = SheetFault::MissingColumn {
            name: name.to_owned(),
            expected: all.join(", "),
            found: self.names.join(", "),
        };
        self.wrong_header(Some(1), fault)
    }

    /// Returns an error of the header; `column` is from 1.
    pub fn wrong_header(&self, column: Option<usize>, fault: SheetFault) -> SheetError {
        SheetError::new(&self.records.file, self.header, column, fault)
    }

    /// Returns the next row.
    pub fn line(&mut self) -> Result<Option<Line<'_>>, SheetError> {
        if self.records.next_record()?.is_none() {
            return Ok(None);
        }
        let line = Line {
            file: &self.records.file,
            names: &self.names,
            record: &self.records.record,
            number: self.records.number,
        };
        let (found, expected) = (line.record.len(), self.names.len());
        if found != expected {
            let what = format!("{found} fields; the header has {expected}");
            return Err(line.wrong_at(Column(found.min(expected)), what));
        }
        Ok(Some(line))
    }
}

impl<'a> Line<'a> {
    /// Returns the text of a field.
    pub fn text(&self, column: Column) -> &'a str {
        self.record.get(column.0).unwrap_or("").trim()
    }

    /// Returns the text of a field that is not empty.
    pub fn name(&self, column: Column, expected: &str) -> Result<&'a str, SheetError> {
        let text = self.text(column);
        if text.is_empty() {
            let what = format!("nothing in `{}`; expected {expected}", self.names[column.0]);
            return Err(self.wrong_at(column, what));
        }
        Ok(text)
    }

    /// Refuses a field that is not empty.
    pub fn empty(&self, column: Column, why: &str) -> Result<(), SheetError> {
        if self.text(column).is_empty() {
            return Ok(());
        }
        Err(self.wrong_field(column, &format!("nothing there: {why}")))
    }

    /// Returns a field that can be parsed and is allowed.
    fn parsed<T: FromStr>(
        &self,
        column: Column,
        allows: impl Fn(&T) -> bool,
        expected: &str,
    ) -> Result<T, SheetError> {
        let value = self.text(column).parse().ok().filter(allows);
        value.ok_or_else(|| self.wrong_field(column, expected))
    }

    /// Returns a number that is finite and allowed.
    pub fn number(
        &self,
        column: Column,
        allows: impl Fn(f64) -> bool,
        expected: &str,
    ) -> Result<f64, SheetError> {
        let allowed = |number: &f64| number.is_finite() && allows(*number);
        self.parsed(column, allowed, expected)
    }

    /// Returns any number, also NaN and infinity.
    pub fn any_number(&self, column: Column, expected: &str) -> Result<f64, SheetError> {
        self.parsed(column, |_| true, expected)
    }

    /// Returns any number, or `None` if the field is empty or its column is missing.
    pub fn optional_number(
        &self,
        column: Option<Column>,
        expected: &str,
    ) -> Result<Option<f64>, SheetError> {
        match column.filter(|column| !self.text(*column).is_empty()) {
            Some(column) => self.any_number(column, expected).map(Some),
            None => Ok(None),
        }
    }

    /// Returns a whole number.
    pub fn whole(&self, column: Column) -> Result<u64, SheetError> {
        self.parsed(column, |_| true, "a whole number, at least 0")
    }

    /// Returns a field that is 0 or 1.
    pub fn flag(&self, column: Column) -> Result<bool, SheetError> {
        let value = self.number(column, |value| value == 0.0 || value == 1.0, "0 or 1")?;
        Ok(value == 1.0)
    }

    /// Returns the position of the row in the file, bytes.
    pub fn byte(&self) -> u64 {
        self.record.position().map_or(0, csv::Position::byte)
    }

    /// Returns the error of a row.
    pub fn wrong_row(&self, what: String) -> SheetError {
        self.wrong(None, SheetFault::Other(what))
    }

    /// Returns the error of a field.
    pub fn wrong_at(&self, column: Column, what: String) -> SheetError {
        self.wrong(Some(column), SheetFault::Other(what))
    }

    fn wrong_field(&self, column: Column, expected: &str) -> SheetError {
        let fault = SheetFault::Field {
            text: self.text(column).to_owned(),
            name: self.names[column.0].clone(),
            expected: expected.to_owned(),
        };
        self.wrong(Some(column), fault)
    }

    fn wrong(&self, column: Option<Column>, fault: SheetFault) -> SheetError {
        let place = column.map(|column| column.0 + 1);
        SheetError::new(self.file, self.number, place, fault)
    }
}

#[cfg(test)]
mod tests;
