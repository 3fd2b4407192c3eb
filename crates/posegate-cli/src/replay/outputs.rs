//! The files that a replay writes while it reads the recording.

use super::Arguments;
use crate::site_input::{Failure, json_line};
use posegate_host::files::{Draft, Files, unprinted};
use posegate_host::log::replay::{Channels, Row};
use serde_json::Value;
use std::fs::File;
use std::io::{self, BufWriter, Write};

/// The rows and the MCAP file, each if requested.
pub struct Outputs {
    rows: Option<(Box<dyn Write>, Option<Draft>)>,
    mcap: Option<(Channels<BufWriter<File>>, Draft)>,
}

impl Outputs {
    pub fn open(arguments: &Arguments, files: &Files) -> Result<Self, Failure> {
        let copy = |draft: &Draft| draft.file.try_clone().map_err(|error| draft.fault(error));
        let rows = match &arguments.rows {
            None => None,
            Some(output) if output.is_standard() => {
                let stdout = BufWriter::new(std::io::stdout());
                Some((Box::new(stdout) as Box<dyn Write>, None))
            }
            Some(output) => {
                let draft = files.draft(output)?;
                let file = BufWriter::new(copy(&draft)?);
                Some((Box::new(file) as Box<dyn Write>, Some(draft)))
            }
        };
        let mcap = match &arguments.mcap {
            None => None,
            Some(output) => {
                let draft = files.draft(output)?;
                let file = BufWriter::new(copy(&draft)?);
                let channels = Channels::new(file).map_err(|error| draft.fault(error))?;
                Some((channels, draft))
            }
        };
        Ok(Self { rows, mcap })
    }

    pub fn row(&mut self, row: &Row) -> Result<(), Failure> {
        if let Some((rows, draft)) = &mut self.rows
            && let Err(error) = rows.write_all(json_line(&row.json()).as_bytes())
        {
            return Err(rows_fault(draft.as_ref(), error));
        }
        if let Some((channels, draft)) = &mut self.mcap {
            channels.row(row).map_err(|error| draft.fault(error))?;
        }
        Ok(())
    }

    pub fn finish(self, summary: &Value) -> Result<(), Failure> {
        if let Some((mut rows, draft)) = self.rows {
            if let Err(error) = rows.flush() {
                return Err(rows_fault(draft.as_ref(), error));
            }
            if let Some(draft) = draft {
                draft.keep()?;
            }
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

/// Returns the failure for an error of writing rows.
fn rows_fault(draft: Option<&Draft>, error: io::Error) -> Failure {
    match draft {
        Some(draft) => draft.fault(error).into(),
        None => unprinted(error).into(),
    }
}
