//! Bags: the files of a recording with topics, one after the other, in any format.

use super::body::BodyFrames;
use super::diagnostics::ReaderDiagnostics;
use super::intake::{Intake, Wanted};
use super::kind::{Format, format_of};
use super::mcap_file::McapFile;
use super::ros1_file::Ros1File;
use super::sqlite_file::SqliteFile;
use super::transforms::FrameNames;
use super::whole::Unpacked;
use super::{Item, Recording, RecordingError};
use std::collections::VecDeque;
use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::PathBuf;

/// A file of a bag, in any format. It announces its topics to the intake and passes on every message.
pub(super) trait Storage: Send {
    /// Returns the next item; `None` at the end, or at a damaged place.
    fn next(&mut self, intake: &mut Intake) -> Result<Option<Item>, RecordingError>;

    /// Returns the number of bytes that were read from the file.
    fn bytes(&self) -> u64;
}

/// A file of a bag that is not open yet.
pub enum BagFile<'a> {
    /// A file at a path.
    Path(PathBuf),
    /// A stream, and its name for errors. It cannot be SQLite, which is read at any place.
    Stream(Box<dyn Read + Send + 'a>, String),
}

/// A file that is opened when its first message is wanted.
struct Unopened<'a> {
    file: Option<BagFile<'a>>,
    opened: Option<Box<dyn Storage + 'a>>,
}

impl<'a> Storage for Unopened<'a> {
    fn next(&mut self, intake: &mut Intake) -> Result<Option<Item>, RecordingError> {
        if let Some(file) = self.file.take() {
            self.opened = Some(opened(file)?);
        }
        match &mut self.opened {
            Some(file) => file.next(intake),
            None => Ok(None),
        }
    }

    fn bytes(&self) -> u64 {
        self.opened.as_ref().map_or(0, |file| file.bytes())
    }
}

/// Opens a file by its first bytes, also if it is compressed as a whole.
fn opened<'a>(file: BagFile<'a>) -> Result<Box<dyn Storage + 'a>, RecordingError> {
    let (reader, name, path): (Box<dyn Read + Send + 'a>, String, Option<PathBuf>) = match file {
        BagFile::Stream(reader, name) => (reader, name, None),
        BagFile::Path(path) => {
            let name = path.display().to_string();
            let file = File::open(&path).map_err(|source| RecordingError::Io {
                file: name.clone(),
                source,
            })?;
            (Box::new(file), name, Some(path))
        }
    };
    let io = |source| RecordingError::Io {
        file: name.clone(),
        source,
    };
    let mut reader = BufReader::with_capacity(BUFFER, reader);
    match format_of(reader.fill_buf().map_err(io)?) {
        Format::Zstd => {
            let mut reader = BufReader::with_capacity(BUFFER, Unpacked::new(reader));
            match format_of(reader.fill_buf().map_err(io)?) {
                Format::Sqlite => {
                    let mut copy = tempfile::NamedTempFile::new().map_err(io)?;
                    std::io::copy(&mut reader, &mut copy).map_err(io)?;
                    let copy = copy.into_temp_path();
                    let path = copy.to_path_buf();
                    Ok(Box::new(SqliteFile::open(&path, &name, Some(copy))?))
                }
                Format::Ros1 => Ok(Box::new(Ros1File::new(reader, &name))),
                _ => Ok(Box::new(McapFile::new(reader, &name))),
            }
        }
        Format::Sqlite => match path {
            Some(path) => Ok(Box::new(SqliteFile::open(&path, &name, None)?)),
            None => Err(RecordingError::NotABag {
                file: name,
                why: "SQLite from a stream: it is read at any place; name the file".into(),
            }),
        },
        Format::Ros1 => Ok(Box::new(Ros1File::new(reader, &name))),
        _ => Ok(Box::new(McapFile::new(reader, &name))),
    }
}

/// Bytes that are read from a file at a time.
const BUFFER: usize = 1 << 18;

/// A reader of a bag.
pub struct Bag<'a> {
    files: VecDeque<Box<dyn Storage + 'a>>,
    /// Bytes of the files that were read to their ends.
    bytes: u64,
    intake: Intake,
}

impl<'a> Bag<'a> {
    /// Returns a reader of an MCAP file's bytes; `file` names them in errors.
    pub fn new(input: impl Read + Send + 'a, file: &str, wanted: &[Wanted]) -> Self {
        Self::of(
            [Box::new(McapFile::new(input, file)) as Box<_>].into(),
            wanted,
        )
    }

    /// Returns a reader of files one after the other, each of the format that its first bytes say.
    pub fn of_files(files: impl IntoIterator<Item = BagFile<'a>>, wanted: &[Wanted]) -> Self {
        let files = files.into_iter().map(|file| {
            let file = Unopened {
                file: Some(file),
                opened: None,
            };
            Box::new(file) as Box<dyn Storage + 'a>
        });
        Self::of(files.collect(), wanted)
    }

    fn of(files: VecDeque<Box<dyn Storage + 'a>>, wanted: &[Wanted]) -> Self {
        Self {
            files,
            bytes: 0,
            intake: Intake::new(wanted),
        }
    }

    /// Names the frames of which poses are composed where a topic has transforms (`/tf`).
    #[must_use]
    pub fn with_frames(mut self, names: FrameNames) -> Self {
        self.intake.names = names;
        self
    }

    /// Gives the places of frames on the robot.
    #[must_use]
    pub fn with_body(mut self, body: BodyFrames) -> Self {
        self.intake.body = body;
        self
    }

    /// Returns the places of frames on the robot, with the static transforms that were read.
    #[must_use]
    pub fn into_body(self) -> BodyFrames {
        self.intake.body
    }
}

impl Recording for Bag<'_> {
    fn next(&mut self) -> Result<Option<Item>, RecordingError> {
        while let Some(file) = self.files.front_mut() {
            if let Some(item) = file.next(&mut self.intake)? {
                return Ok(Some(item));
            }
            self.bytes += file.bytes();
            self.files.pop_front();
            self.intake.next_file();
        }
        Ok(None)
    }

    fn diagnostics(&self) -> &ReaderDiagnostics {
        &self.intake.diagnostics
    }

    fn bytes(&self) -> u64 {
        self.bytes + self.files.front().map_or(0, |file| file.bytes())
    }
}
