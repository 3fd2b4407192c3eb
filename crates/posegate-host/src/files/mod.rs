//! The files of one command: everything that it reads and writes is opened here.
//!
//! Entry points: [`Files::read`], [`Files::write`]. No output replaces an input, through whatever link or spelling of its path: what is
//! read is registered, what is to be written is declared, and the first pair that is one file ends the command before it has written
//! anything.

use crate::input::{self, Limit};
use std::cell::RefCell;
use std::fs::File;
use std::io;
use std::io::{ErrorKind, Read, Write};
use std::path::{Path, PathBuf};

pub use self::argument::{Input, NamedInput, Output, OutputFolder};
pub use self::draft::Draft;
pub use self::error::FileError;
use self::identity::Identity;

mod argument;
mod draft;
mod error;
mod identity;

/// The files of one command.
#[derive(Debug, Default)]
pub struct Files {
    known: RefCell<Known>,
}

#[derive(Debug, Default)]
struct Known {
    inputs: Vec<Named>,
    outputs: Vec<Named>,
    standard_inputs: usize,
}

/// A file that is known.
#[derive(Clone, Debug)]
struct Named {
    /// For messages.
    name: String,
    path: PathBuf,
    identity: Option<Identity>,
}

/// An input that is open.
pub struct Opened {
    /// Its bytes.
    pub reader: Box<dyn Read + Send>,
    /// Its name for messages.
    pub name: String,
    /// Its length in bytes; 0 if it is not known.
    pub length: u64,
}

const STDIN: &str = "<stdin>";
const STDOUT: &str = "<stdout>";

impl Files {
    /// The files of a command, of which none is known yet but standard output.
    #[must_use]
    pub fn new() -> Self {
        let files = Self::default();
        let identity = Identity::of_standard(io::stdout());
        files.known.borrow_mut().outputs.push(Named {
            name: STDOUT.into(),
            path: "-".into(),
            identity,
        });
        files
    }

    /// Declares an argument that is read.
    ///
    /// # Errors
    /// [`FileError::ReplacesInput`], or [`FileError::StandardInputTwice`].
    pub fn declare_input(&self, input: &Input) -> Result<(), FileError> {
        if input.is_standard() {
            let mut known = self.known.borrow_mut();
            known.standard_inputs += 1;
            if known.standard_inputs > 1 {
                return Err(FileError::StandardInputTwice);
            }
        }
        self.register(input.as_path())
    }

    /// Declares an argument that is written.
    ///
    /// # Errors
    /// [`FileError::ReplacesInput`], or [`FileError::OneForTwo`].
    pub fn declare_output(&self, output: &Output) -> Result<(), FileError> {
        let output = target(output.as_path());
        self.check(&output)?;
        let mut known = self.known.borrow_mut();
        let same = known.outputs.iter().skip(1).find(|other| {
            output.path == other.path
                || output.identity.is_some() && output.identity == other.identity
        });
        // A device takes any number of outputs.
        if let Some(other) = same.filter(|_| output.identity.is_some() || output.name == STDOUT) {
            return Err(FileError::OneForTwo {
                one: other.name.clone(),
                other: output.name,
            });
        }
        known.outputs.push(output);
        Ok(())
    }

    /// Registers a file that is read, before or after it is: one that another input names, for example.
    ///
    /// # Errors
    /// [`FileError::ReplacesInput`] if it is an output that is declared.
    pub fn register(&self, path: &Path) -> Result<(), FileError> {
        let (name, identity) = if path == Path::new("-") {
            (STDIN.into(), Identity::of_standard(io::stdin()))
        } else {
            (path.display().to_string(), Identity::of(path))
        };
        self.register_as(Named {
            name,
            path: path.into(),
            identity,
        })
    }

    fn register_as(&self, input: Named) -> Result<(), FileError> {
        let mut known = self.known.borrow_mut();
        for output in &known.outputs {
            replaces(output, &input)?;
        }
        known.inputs.push(input);
        Ok(())
    }

    /// Refuses an output that is an input.
    fn check(&self, output: &Named) -> Result<(), FileError> {
        let known = self.known.borrow();
        known
            .inputs
            .iter()
            .try_for_each(|input| replaces(output, input))
    }

    /// Opens an input.
    ///
    /// # Errors
    /// [`FileError::Unread`], or [`FileError::ReplacesInput`].
    pub fn open(&self, input: &Input) -> Result<Opened, FileError> {
        if input.is_standard() {
            self.register(input.as_path())?;
            return Ok(Opened {
                reader: Box::new(io::stdin()),
                name: STDIN.into(),
                length: 0,
            });
        }
        let path = input.as_path();
        let name = path.display().to_string();
        let unread = |cause| FileError::Unread {
            name: name.clone(),
            cause,
        };
        let file = File::open(path).map_err(unread)?;
        let data = file.metadata().map_err(unread)?;
        // Of the file that is open: the path may mean another one by now.
        self.register_as(Named {
            name: name.clone(),
            path: path.into(),
            identity: Identity::of_metadata(&data, path),
        })?;
        Ok(Opened {
            reader: Box::new(file),
            name,
            length: data.len(),
        })
    }

    /// Reads an input whole, up to [`Limit::FILE`]. Gives its bytes and its name for messages.
    ///
    /// # Errors
    /// As [`Files::open`].
    pub fn read(&self, input: &Input) -> Result<(Vec<u8>, String), FileError> {
        let opened = self.open(input)?;
        match input::read_from(opened.reader, Limit::FILE) {
            Ok(bytes) => Ok((bytes, opened.name)),
            Err(error) => Err(FileError::Unread {
                name: opened.name,
                cause: error.into_io(),
            }),
        }
    }

    /// Begins an output file.
    ///
    /// # Errors
    /// [`FileError::Unwritten`], or [`FileError::ReplacesInput`].
    pub fn draft(&self, output: &Output) -> Result<Draft, FileError> {
        self.check(&target(output.as_path()))?;
        Draft::new(output.as_path())
    }

    /// Writes an output whole or not at all, or to standard output.
    ///
    /// # Errors
    /// As [`Files::draft`] and [`print()`].
    pub fn write(&self, output: &Output, bytes: &[u8]) -> Result<(), FileError> {
        if output.is_standard() {
            return print(bytes);
        }
        whole(self.draft(output)?, bytes)
    }

    /// Writes files into a folder, which is made if it does not exist. All are checked before the first one is written.
    ///
    /// # Errors
    /// As [`Files::draft`].
    pub fn write_into(
        &self,
        folder: &OutputFolder,
        files: &[(String, Vec<u8>)],
    ) -> Result<(), FileError> {
        let folder = folder.as_path();
        for (name, _) in files {
            self.check(&target(&folder.join(name)))?;
        }
        std::fs::create_dir_all(folder).map_err(|cause| FileError::unwritten(folder, cause))?;
        for (name, bytes) in files {
            whole(Draft::new(&folder.join(name))?, bytes)?;
        }
        Ok(())
    }

    /// Replaces an input by what was made of it: only for a command whose purpose that is.
    ///
    /// # Errors
    /// [`FileError::Unwritten`].
    pub fn replace(&self, input: &Input, bytes: &[u8]) -> Result<(), FileError> {
        if input.is_standard() {
            return print(bytes);
        }
        whole(Draft::new(input.as_path())?, bytes)
    }

    /// Refuses inputs that are below one of these names in a folder, where library code will replace files.
    ///
    /// # Errors
    /// [`FileError::ReplacesInput`].
    pub fn reserve(&self, folder: &OutputFolder, names: &[&str]) -> Result<(), FileError> {
        for name in names {
            let root = folder.as_path().join(name);
            for input in &self.known.borrow().inputs {
                let real = |path: &Path| path.canonicalize().ok();
                let within = real(&root)
                    .zip(real(&input.path))
                    .is_some_and(|(root, path)| path.starts_with(root));
                if within || has_links(input) && is_below(&root, input) {
                    return Err(FileError::ReplacesInput {
                        output: root.display().to_string(),
                        input: input.name.clone(),
                    });
                }
            }
        }
        Ok(())
    }
}

/// What a path to write to means now.
fn target(path: &Path) -> Named {
    if path == Path::new("-") {
        return Named {
            name: STDOUT.into(),
            path: path.into(),
            identity: Identity::of_standard(io::stdout()),
        };
    }
    Named {
        name: path.display().to_string(),
        path: path.into(),
        identity: Identity::of_target(path),
    }
}

fn replaces(output: &Named, input: &Named) -> Result<(), FileError> {
    if output.identity.is_none() || output.identity != input.identity {
        return Ok(());
    }
    Err(FileError::ReplacesInput {
        output: output.name.clone(),
        input: input.name.clone(),
    })
}

fn whole(mut draft: Draft, bytes: &[u8]) -> Result<(), FileError> {
    draft.write(bytes)?;
    draft.keep()
}

/// Returns `true` if the file may have a second name.
fn has_links(input: &Named) -> bool {
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt;
        input.path.metadata().is_ok_and(|data| data.nlink() > 1)
    }
    #[cfg(not(unix))]
    true
}

/// Returns `true` if a file below a folder, or the path itself, is the input.
fn is_below(root: &Path, input: &Named) -> bool {
    let mut open = std::vec![root.to_path_buf()];
    while let Some(path) = open.pop() {
        let Ok(data) = path.symlink_metadata() else {
            continue;
        };
        if data.is_dir() {
            let entries = std::fs::read_dir(&path).into_iter().flatten().flatten();
            open.extend(entries.map(|entry| entry.path()));
        } else if input.identity.is_some() && Identity::of_metadata(&data, &path) == input.identity
        {
            return true;
        }
    }
    false
}

/// Writes to standard output, and sees that it has got there.
///
/// # Errors
/// [`FileError::StandardOutput`]; [`FileError::Closed`] if its reader has ended.
pub fn print(bytes: &[u8]) -> Result<(), FileError> {
    let mut out = io::stdout().lock();
    out.write_all(bytes)
        .and_then(|()| out.flush())
        .map_err(unprinted)
}

/// An error of writing to standard output.
#[must_use]
pub fn unprinted(cause: io::Error) -> FileError {
    match cause.kind() {
        ErrorKind::BrokenPipe => FileError::Closed,
        _ => FileError::StandardOutput(cause),
    }
}

#[cfg(test)]
mod tests;
