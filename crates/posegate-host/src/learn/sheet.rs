//! Rows of a CSV with a header: columns by name, in any order, others ignored. Errors state the line and
//! column of an invalid field.

use super::LearnError;

/// A column that is used.
#[derive(Clone, Copy, Debug)]
pub(super) struct Column {
    index: usize,
    name: &'static str,
}

/// A reader of a CSV.
pub(super) struct Sheet<'a, R = &'a [u8]> {
    file: &'a str,
    names: Vec<String>,
    reader: csv::Reader<R>,
    record: csv::StringRecord,
}

/// A row of the CSV.
pub(super) struct Line<'a> {
    file: &'a str,
    record: &'a csv::StringRecord,
    /// The line number, from 1.
    pub(super) number: u64,
}

impl<'a, R: std::io::Read> Sheet<'a, R> {
    pub(super) fn new(bytes: R, file: &'a str) -> Result<Self, LearnError> {
        // Fields are trimmed when they are used: a trimmed copy of each row would take as long as its numbers.
        let mut reader = csv::ReaderBuilder::new()
            // Numbers need no quotes. An unclosed quote would hide the rest of the file.
            .quoting(false)
            .flexible(true)
            .from_reader(bytes);
        let header = reader.headers().map_err(|fault| unreadable(file, &fault))?;
        let names = header
            .iter()
            .map(|name| name.trim().trim_start_matches('\u{feff}').trim().to_owned())
            .collect();
        Ok(Self {
            file,
            names,
            reader,
            record: csv::StringRecord::new(),
        })
    }

    /// Returns a column if it exists.
    pub(super) fn optional(&self, name: &'static str) -> Result<Option<Column>, LearnError> {
        let mut places = (0..self.names.len()).filter(|index| self.names[*index] == name);
        let column = places.next().map(|index| Column { index, name });
        match places.next() {
            None => Ok(column),
            Some(again) => Err(LearnError::Place {
                file: self.file.to_owned(),
                line: 1,
                column: again + 1,
                what: format!("the column `{name}` is there twice; keep one of them"),
            }),
        }
    }

    /// Returns a required column.
    pub(super) fn needed(&self, name: &'static str, all: &[&str]) -> Result<Column, LearnError> {
        self.optional(name)?.ok_or_else(|| LearnError::Place {
            file: self.file.to_owned(),
            line: 1,
            column: 1,
            what: format!(
                "there is no column `{name}`; expected a header with {} (this one has {:?})",
                all.join(", "),
                self.names.join(", ")
            ),
        })
    }

    /// Returns the first column, in the order of the header, that `takes` accepts.
    pub(super) fn first(&self, takes: impl Fn(&str) -> bool) -> Option<String> {
        self.names.iter().find(|name| takes(name)).cloned()
    }

    /// Returns the index of a column with any name.
    pub(super) fn place(&self, name: &str) -> Option<usize> {
        self.names.iter().position(|known| known == name)
    }

    /// Returns the next row.
    pub(super) fn line(&mut self) -> Result<Option<Line<'_>>, LearnError> {
        let more = self.reader.read_record(&mut self.record);
        if !more.map_err(|fault| unreadable(self.file, &fault))? {
            return Ok(None);
        }
        let line = Line {
            file: self.file,
            number: self.record.position().map_or(0, csv::Position::line),
            record: &self.record,
        };
        let (found, expected) = (line.record.len(), self.names.len());
        if found != expected {
            return Err(line.wrong(
                found.min(expected) + 1,
                format!("{found} fields; the header has {expected}"),
            ));
        }
        Ok(Some(line))
    }
}

impl Line<'_> {
    /// Returns a number that is finite and allowed.
    pub(super) fn number(
        &self,
        column: Column,
        allows: impl Fn(f64) -> bool,
        expected: &str,
    ) -> Result<f64, LearnError> {
        self.number_at(column.index, column.name, allows, expected)
    }

    /// Returns a number in a column given by its index.
    pub(super) fn number_at(
        &self,
        index: usize,
        name: &str,
        allows: impl Fn(f64) -> bool,
        expected: &str,
    ) -> Result<f64, LearnError> {
        let text = self.field(index);
        let number = text.parse::<f64>().ok();
        number
            .filter(|number| number.is_finite() && allows(*number))
            .ok_or_else(|| {
                self.wrong(
                    index + 1,
                    format!("`{text}` in `{name}`; expected {expected}"),
                )
            })
    }

    /// Returns the text of a field.
    pub(super) fn text(&self, index: usize) -> String {
        self.field(index).to_owned()
    }

    fn field(&self, index: usize) -> &str {
        self.record.get(index).unwrap_or("").trim()
    }

    /// Returns the text of a field that is not empty.
    pub(super) fn name(&self, column: Column, expected: &str) -> Result<String, LearnError> {
        let text = self.text(column.index);
        if text.is_empty() {
            return Err(self.wrong(
                column.index + 1,
                format!("nothing in `{}`; expected {expected}", column.name),
            ));
        }
        Ok(text)
    }

    /// Returns a field that is 0 or 1.
    pub(super) fn flag(&self, column: Column) -> Result<bool, LearnError> {
        let value = self.number(column, |value| value == 0.0 || value == 1.0, "0 or 1")?;
        Ok(value == 1.0)
    }

    /// Refuses a field that is not empty.
    pub(super) fn empty(&self, column: Column, why: &str) -> Result<(), LearnError> {
        let text = self.field(column.index);
        if text.is_empty() {
            return Ok(());
        }
        Err(self.wrong(
            column.index + 1,
            format!(
                "`{text}` in `{}`; expected nothing there: {why}",
                column.name
            ),
        ))
    }

    /// Returns the position of the row in the file, bytes.
    pub(super) fn byte(&self) -> u64 {
        self.record.position().map_or(0, csv::Position::byte)
    }

    /// Returns the error of a row.
    pub(super) fn wrong_row(&self, what: String) -> LearnError {
        self.wrong(1, what)
    }

    /// Returns the error of a field.
    pub(super) fn wrong_at(&self, column: Column, what: String) -> LearnError {
        self.wrong(column.index + 1, what)
    }

    fn wrong(&self, column: usize, what: String) -> LearnError {
        LearnError::Place {
            file: self.file.to_owned(),
            line: self.number,
            column,
            what,
        }
    }
}

fn unreadable(file: &str, fault: &csv::Error) -> LearnError {
    let line = fault.position().map_or(1, csv::Position::line);
    LearnError::Place {
        file: file.to_owned(),
        line,
        column: 1,
        what: format!("{fault}"),
    }
}
