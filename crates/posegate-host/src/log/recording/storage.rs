//! Bags: the files of a recording with topics, one after the other.

use super::body::BodyFrames;
use super::diagnostics::ReaderDiagnostics;
use super::intake::{Intake, Wanted};
use super::mcap_file::McapFile;
use super::transforms::FrameNames;
use super::{Item, Recording, RecordingError};
use std::collections::VecDeque;
use std::io::Read;

/// A file of a bag, in any format. It announces its topics to the intake and passes on every message.
pub(super) trait Storage: Send {
    /// Returns the next item; `None` at the end, or at a damaged place.
    fn next(&mut self, intake: &mut Intake) -> Result<Option<Item>, RecordingError>;

    /// Returns the number of bytes that were read from the file.
    fn bytes(&self) -> u64;
}

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
