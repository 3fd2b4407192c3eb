//! The files that a replay writes while it reads the recording.

use super::Arguments;
use crate::site_input::{Failure, json_line};
use posegate_files::files::{Draft, Files, Output, unprinted};
use posegate_replay::replay::{Channels, Row};
use posegate_replay::tables::ESTIMATES;
use serde_json::Value;
use std::fs::File;
use std::io::{self, BufWriter, Write};

/// The rows, the table of estimates and the MCAP file, each if requested.
pub struct Outputs {
    rows: Option<Lines>,
    csv: Option<Lines>,
    /// The rows of the table, and the estimates that give none.
    counts: [u64; 2],
    mcap: Option<(Channels<BufWriter<File>>, Draft)>,
}

/// A text that is written line by line.
struct Lines {
    writer: Box<dyn Write>,
    /// `None` for standard output.
    draft: Option<Draft>,
}

impl Lines {
    fn open(output: Option<&Output>, files: &Files) -> Result<Option<Self>, Failure> {
        let Some(output) = output else {
            return Ok(None);
        };
        if output.is_standard() {
            return Ok(Some(Self {
                writer: Box::new(BufWriter::new(std::io::stdout())),
                draft: None,
            }));
        }
        let draft = files.draft(output)?;
        Ok(Some(Self {
            writer: Box::new(BufWriter::new(copy(&draft)?)),
            draft: Some(draft),
        }))
    }

    fn line(&mut self, text: &str) -> Result<(), Failure> {
        let written = self.writer.write_all(text.as_bytes());
        written.map_err(|error| self.fault(error))
    }

    fn finish(mut self) -> Result<(), Failure> {
        let flushed = self.writer.flush();
        flushed.map_err(|error| self.fault(error))?;
        match self.draft {
            Some(draft) => Ok(draft.keep()?),
            None => Ok(()),
        }
    }

    fn fault(&self, error: io::Error) -> Failure {
        match &self.draft {
            Some(draft) => draft.fault(error).into(),
            None => unprinted(error).into(),
        }
    }
}

fn copy(draft: &Draft) -> Result<File, Failure> {
    Ok(draft.file.try_clone().map_err(|error| draft.fault(error))?)
}

impl Outputs {
    pub fn open(arguments: &Arguments, files: &Files) -> Result<Self, Failure> {
        let mut csv = Lines::open(arguments.csv.as_ref(), files)?;
        if let Some(csv) = &mut csv {
            csv.line(ESTIMATES)?;
        }
        let mcap = match &arguments.mcap {
            None => None,
            Some(output) => {
                let draft = files.draft(output)?;
                let file = BufWriter::new(copy(&draft)?);
                let channels = Channels::new(file).map_err(|error| draft.fault(error))?;
                Some((channels, draft))
            }
        };
        Ok(Self {
            rows: Lines::open(arguments.rows.as_ref(), files)?,
            csv,
            counts: [0; 2],
            mcap,
        })
    }

    pub fn row(&mut self, row: &Row) -> Result<(), Failure> {
        if let Some(rows) = &mut self.rows {
            rows.line(&json_line(&row.json()))?;
        }
        if let Some(csv) = &mut self.csv {
            let line = row.table_row();
            self.counts[usize::from(line.is_none())] += 1;
            csv.line(&line.unwrap_or_default())?;
        }
        if let Some((channels, draft)) = &mut self.mcap {
            channels.row(row).map_err(|error| draft.fault(error))?;
        }
        Ok(())
    }

    /// Returns the number of rows of the table of estimates, and of estimates that give none. `None` if no table is written.
    pub fn table(&self) -> Option<[u64; 2]> {
        self.csv.as_ref().map(|_| self.counts)
    }

    pub fn finish(self, summary: &Value) -> Result<(), Failure> {
        for lines in [self.rows, self.csv].into_iter().flatten() {
            lines.finish()?;
        }
        if let Some((channels, draft)) = self.mcap {
            let mut file = channels
                .finish(summary)
                .map_err(|error| draft.fault(error))?;
            file.flush().map_err(|error| draft.fault(error))?;
            draft.keep()?;
        }
        Ok(())
    }
}
