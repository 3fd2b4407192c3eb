//! One merge at a time in a folder.

use std::fs::OpenOptions;
use std::io::{ErrorKind, Write};
use std::path::PathBuf;

use super::error::FleetError;
use super::random::random;
use super::store::{Store, fault};

/// The file that a merge holds while it runs, among the parts.
const NAME: &str = ".merge";

/// A merge that runs. It goes with the process, unless that is killed: then its file says which process it was.
pub(super) struct Lock {
    path: PathBuf,
    text: String,
}

impl Lock {
    /// Takes the lock of a folder with parts.
    ///
    /// # Errors
    /// [`FleetError::Locked`] where another merge has it.
    pub(super) fn take(store: &Store) -> Result<Self, FleetError> {
        let path = store.path(NAME);
        let text = format!(
            "host {}, process {}, {:016x}\n",
            host(),
            std::process::id(),
            random()
        );
        let new = OpenOptions::new().write(true).create_new(true).open(&path);
        let mut file = match new {
            Err(cause) if cause.kind() == ErrorKind::AlreadyExists => {
                let by = store.read(NAME)?.unwrap_or_default();
                let by = match String::from_utf8_lossy(&by).trim() {
                    "" => "it has not said which".into(),
                    by => by.into(),
                };
                return Err(FleetError::Locked { path, by });
            }
            file => file.map_err(fault(&path))?,
        };
        if let Err(cause) = file.write_all(text.as_bytes()) {
            // The first error is the one to report.
            let _ = std::fs::remove_file(&path);
            return Err(fault(&path)(cause));
        }
        Ok(Self { path, text })
    }
}

impl Drop for Lock {
    fn drop(&mut self) {
        // Where somebody has removed it, another merge may have it.
        if std::fs::read_to_string(&self.path).is_ok_and(|text| text == self.text) {
            let _ = std::fs::remove_file(&self.path);
        }
    }
}

/// The name of this machine, for whoever looks for the process.
fn host() -> String {
    let kernel = std::fs::read_to_string("/proc/sys/kernel/hostname").ok();
    let told = kernel.or_else(|| std::env::var("HOSTNAME").ok());
    let told = told.or_else(|| std::env::var("COMPUTERNAME").ok());
    told.map_or_else(|| "unknown".into(), |name| name.trim().into())
}
