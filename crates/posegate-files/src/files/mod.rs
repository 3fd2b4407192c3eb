//! The files of one command: every input and output is opened here.
//!
//! Entry points: [`Files::read`], [`Files::write`]. No output replaces an input, for any link or spelling of its
//! path. Inputs are registered and outputs are declared. If an input and an output are the same file, the command
//! ends before it writes any file.
//!
//! ```
//! use posegate_files::files::{Files, Input, Output};
//! use std::ffi::OsString;
//!
//! # let folder = tempfile::tempdir()?;
//! # let path = folder.path().join("site.toml");
//! # std::fs::write(&path, "x = 1")?;
//! # let path = OsString::from(path);
//! let files = Files::new();
//! let (bytes, name) = files.read(&Input::from(path.clone()))?;
//! assert_eq!((bytes.as_slice(), name.ends_with("site.toml")), (b"x = 1".as_slice(), true));
//!
//! // The input as an output is refused, and keeps its content.
//! assert!(files.write(&Output::from(path.clone()), b"").is_err());
//! assert_eq!(std::fs::read(path)?, b"x = 1");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

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

/// A registered input or a declared output.
#[derive(Clone, Debug)]
struct Named {
    /// The name for messages.
    name: String,
    path: PathBuf,
    identity: Option<Identity>,
}

/// An open input.
pub struct Opened {
    /// The input's bytes.
    pub reader: Box<dyn Read + Send>,
    /// The input's name for messages.
    pub name: String,
    /// The input's length in bytes; 0 if it is not known.
    pub length: u64,
}

const STDIN: &str = "<stdin>";
const STDOUT: &str = "<stdout>";

impl Files {
    /// Creates the files of a command; only standard output is declared.
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

    /// Declares an argument that will be read.
    ///
    /// # Errors
    /// [`FileError::ReplacesInput`] if the input is a declared output, [`FileError::StandardInputTwice`] if it is the
    /// second standard input.
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

    /// Declares an argument that will be written.
    ///
    /// # Errors
    /// [`FileError::ReplacesInput`] if the output is an input, [`FileError::OneForTwo`] if it is another output.
    pub fn declare_output(&self, output: &Output) -> Result<(), FileError> {
        let output = target(output.as_path());
        self.check(&output)?;
        let mut known = self.known.borrow_mut();
        let same = known.outputs.iter().skip(1).find(|other| {
            output.path == other.path
                || output.identity.is_some() && output.identity == other.identity
        });
        // A device accepts any number of outputs.
        if let Some(other) = same.filter(|_| output.identity.is_some() || output.name == STDOUT) {
            return Err(FileError::OneForTwo {
                one: other.name.clone(),
                other: output.name,
            });
        }
        known.outputs.push(output);
        Ok(())
    }

    /// Registers a file that is read, before or after it is read: for example, a file that another input names.
    ///
    /// # Errors
    /// [`FileError::ReplacesInput`] if it is a declared output.
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

    /// Returns an error if an output is a registered input.
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
    /// [`FileError::Unread`] if it cannot be opened, [`FileError::ReplacesInput`] if it is a declared output.
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
        // Use the metadata of the open file: the path may name another file by now.
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

    /// Reads a complete input of at most 256 MiB. Returns its bytes and its name for messages.
    ///
    /// # Errors
    /// As [`Files::open`]; [`FileError::Unread`] also if the input is longer.
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

    /// As [`Files::read`], for text.
    ///
    /// # Errors
    /// As [`Files::read`]; [`FileError::NotText`] if the input is not UTF-8.
    pub fn read_text(&self, input: &Input) -> Result<(String, String), FileError> {
        let (bytes, name) = self.read(input)?;
        match String::from_utf8(bytes) {
            Ok(text) => Ok((text, name)),
            Err(error) => Err(FileError::NotText {
                name,
                cause: error.utf8_error(),
            }),
        }
    }

    /// Begins an output file.
    ///
    /// # Errors
    /// [`FileError::Unwritten`] if it cannot be created, [`FileError::ReplacesInput`] if it is an input.
    pub fn draft(&self, output: &Output) -> Result<Draft, FileError> {
        self.check(&target(output.as_path()))?;
        Draft::new(output.as_path())
    }

    /// Writes an output atomically, or to standard output.
    ///
    /// # Errors
    /// As [`Files::draft`] and [`print()`].
    pub fn write(&self, output: &Output, bytes: &[u8]) -> Result<(), FileError> {
        if output.is_standard() {
            return print(bytes);
        }
        write_all(self.draft(output)?, bytes)
    }

    /// Writes files into a folder, which is created if it does not exist. All paths are checked before the first file
    /// is written.
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
        create(folder)?;
        for (name, bytes) in files {
            write_all(Draft::new(&folder.join(name))?, bytes)?;
        }
        Ok(())
    }

    /// Creates a folder for outputs, so that the command fails early if it cannot be created.
    ///
    /// # Errors
    /// [`FileError::Unwritten`] if it cannot be made.
    pub fn make(&self, folder: &OutputFolder) -> Result<(), FileError> {
        create(folder.as_path())
    }

    /// Replaces an input by a result made from it. Only for commands whose purpose is to change the input.
    ///
    /// # Errors
    /// [`FileError::Unwritten`] if writing fails.
    pub fn replace(&self, input: &Input, bytes: &[u8]) -> Result<(), FileError> {
        if input.is_standard() {
            return print(bytes);
        }
        write_all(Draft::new(input.as_path())?, bytes)
    }

    /// Returns an error if an input is below one of these names in a folder, in which library code will replace
    /// files.
    ///
    /// # Errors
    /// [`FileError::ReplacesInput`] for the first such input.
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

    /// Returns an error if an output is, or is below, one of these names in a folder whose content library code reads and writes.
    ///
    /// # Errors
    /// [`FileError::ReplacesInput`] for the name.
    pub fn keep_outside(
        output: &Output,
        folder: &OutputFolder,
        names: &[&str],
    ) -> Result<(), FileError> {
        let Some(path) = resolved(output.as_path()) else {
            return Ok(());
        };
        for name in names {
            let root = folder.as_path().join(name);
            if resolved(&root).is_some_and(|root| path.starts_with(root)) {
                return Err(FileError::ReplacesInput {
                    output: output.as_path().display().to_string(),
                    input: root.display().to_string(),
                });
            }
        }
        Ok(())
    }
}

/// Returns the path that an output has after links: of the file, or of its folder with its name if there is no file.
fn resolved(path: &Path) -> Option<PathBuf> {
    path.canonicalize().ok().or_else(|| {
        let folder = match path.parent()? {
            here if here.as_os_str().is_empty() => Path::new("."),
            folder => folder,
        };
        Some(folder.canonicalize().ok()?.join(path.file_name()?))
    })
}

/// Returns the file that an output path names at present.
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

fn write_all(mut draft: Draft, bytes: &[u8]) -> Result<(), FileError> {
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

fn create(folder: &Path) -> Result<(), FileError> {
    std::fs::create_dir_all(folder).map_err(|cause| FileError::unwritten(folder, cause))
}

/// Writes to standard output and flushes it.
///
/// # Errors
/// [`FileError::StandardOutput`] if writing fails, [`FileError::Closed`] if the reader has ended.
pub fn print(bytes: &[u8]) -> Result<(), FileError> {
    let is_captured = CAPTURED
        .with_borrow_mut(|captured| captured.as_mut().map(|text| text.extend(bytes)).is_some());
    if is_captured {
        return Ok(());
    }
    let mut out = io::stdout().lock();
    out.write_all(bytes)
        .and_then(|()| out.flush())
        .map_err(unprinted)
}

thread_local! {
    /// What [`print`] has taken instead of standard output.
    static CAPTURED: RefCell<Option<Vec<u8>>> = const { RefCell::new(None) };
}

/// Runs a command in this thread, and also returns what it prints ([`print()`]) instead of printing it.
pub fn captured<T>(run: impl FnOnce() -> T) -> (T, Vec<u8>) {
    /// Also ends with a panic.
    struct End;
    impl Drop for End {
        fn drop(&mut self) {
            CAPTURED.set(None);
        }
    }
    CAPTURED.set(Some(Vec::new()));
    let _end = End;
    let result = run();
    (result, CAPTURED.take().unwrap_or_default())
}

/// Converts an error of writing to standard output.
#[must_use]
pub fn unprinted(cause: io::Error) -> FileError {
    match cause.kind() {
        ErrorKind::BrokenPipe => FileError::Closed,
        _ => FileError::StandardOutput(cause),
    }
}

#[cfg(test)]
mod tests;
