//! The files that a replay writes while it reads.

use super::Arguments;
use crate::door::{Draft, Failure};
use posegate::log::replay::{Channels, Row};
use serde_json::Value;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

/// The files that are written while the recording is read.
pub struct Files {
    rows: Option<(Box<dyn Write>, Option<Draft>)>,
    mcap: Option<(Channels<BufWriter<File>>, Draft)>,
}

impl Files {
    pub fn open(arguments: &Arguments) -> Result<Self, Failure> {
        let copy = |draft: &Draft| draft.file.try_clone().map_err(|error| draft.fault(&error));
        let rows = match &arguments.rows {
            None => None,
            Some(path) if path == Path::new("-") => {
                let stdout = BufWriter::new(std::io::stdout());
                Some((Box::new(stdout) as Box<dyn Write>, None))
            }
            Some(path) => {
                let draft = Draft::new(path)?;
                let file = BufWriter::new(copy(&draft)?);
                Some((Box::new(file) as Box<dyn Write>, Some(draft)))
            }
        };
        let mcap = match &arguments.mcap {
            None => None,
            Some(path) => {
                let draft = Draft::new(path)?;
                let file = BufWriter::new(copy(&draft)?);
                let channels = Channels::new(file).map_err(|error| draft.fault(&error))?;
                Some((channels, draft))
            }
        };
        Ok(Self { rows, mcap })
    }

    pub fn row(&mut self, row: &Row) -> Result<(), Failure> {
        if let Some((rows, draft)) = &mut self.rows
            && let Err(error) = writeln!(rows, "{}", row.json())
        {
            return Err(rows_fault(draft.as_ref(), &error));
        }
        if let Some((channels, draft)) = &mut self.mcap {
            channels.row(row).map_err(|error| draft.fault(&error))?;
        }
        Ok(())
    }

    pub fn finish(self, summary: &Value) -> Result<(), Failure> {
        if let Some((mut rows, draft)) = self.rows {
            if let Err(error) = rows.flush() {
                return Err(rows_fault(draft.as_ref(), &error));
            }
            if let Some(draft) = draft {
                draft.keep()?;
            }
        }
        if let Some((channels, draft)) = self.mcap {
            let mut file = channels
                .finish(summary)
                .map_err(|error| draft.fault(&error))?;
            file.flush().map_err(|error| draft.fault(&error))?;
            draft.keep()?;
        }
        Ok(())
    }
}

/// A reader of standard output that has gone away ends the program quietly.
fn rows_fault(draft: Option<&Draft>, error: &std::io::Error) -> Failure {
    match draft {
        Some(draft) => draft.fault(error),
        None if error.kind() == std::io::ErrorKind::BrokenPipe => std::process::exit(0),
        None => Failure::usage(
            format!("standard output cannot be written: {error}"),
            "redirect it to a file",
        ),
    }
}
