//! CSV and TUM files as streams of estimates.

use super::body::{Body, BodyFrames};
use super::diagnostics::ReaderDiagnostics;
use super::intake::sample_of_base;
use super::{Item, Recording, RecordingError, Sample};
use crate::estimates::Rows;
use crate::trajectories;
use crate::tum::{Stamped, TumError, numbers};
use crate::{Columns, Row};
use posegate::report::{Heading, PoseEstimate};
use posegate::set::Uncertainty;
use posegate_files::input::Lines as Limited;
use std::io::{BufRead, BufReader, Read};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// A reader of a CSV or TUM file.
pub struct Text<R: Read> {
    lines: Lines<R>,
    file: String,
    diagnostics: ReaderDiagnostics,
    bytes: Arc<AtomicU64>,
    covariance: bool,
    body: BodyFrames,
}

enum Lines<R: Read> {
    Csv(Box<Rows<Counted<R>>>),
    Tum {
        input: BufReader<Counted<R>>,
        line: Vec<u8>,
        number: usize,
    },
    Poses(std::vec::IntoIter<Stamped>),
}

/// A reader that counts bytes.
pub(super) struct Counted<R> {
    input: Limited<R>,
    bytes: Arc<AtomicU64>,
}

impl<R: Read> Read for Counted<R> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let count = self.input.read(buffer)?;
        self.bytes.fetch_add(count as u64, Ordering::Relaxed);
        Ok(count)
    }
}

impl<R: Read> Text<R> {
    /// Returns a reader of a CSV with the columns of an estimate and a time; without a covariance if
    /// `covariance` is `false`, for bounded sets. `file` names it in errors.
    ///
    /// # Errors
    /// [`RecordingError::Csv`] if a column is missing or repeated, or the header cannot be read.
    pub fn csv(input: R, file: &str, covariance: bool) -> Result<Self, RecordingError> {
        let (input, bytes) = counted(input);
        let columns = if covariance {
            Columns::Estimates
        } else {
            Columns::TimedPoses
        };
        let rows = Rows::new(input, file, columns)?;
        rows.needs_time()?;
        Ok(Self::of(
            Lines::Csv(Box::new(rows)),
            file,
            bytes,
            covariance,
        ))
    }

    /// Returns `true` if the file has the time at which each estimate was used (`now_s`).
    pub fn has_use(&self) -> bool {
        match &self.lines {
            Lines::Csv(rows) => rows.has_use(),
            Lines::Tum { .. } | Lines::Poses(_) => false,
        }
    }

    /// Also reads the time since the last fix from a column of a CSV, seconds. Returns `true` if the header has it.
    pub fn reads_since_fix(&mut self, column: &str) -> bool {
        match &mut self.lines {
            Lines::Csv(rows) => rows.reads_since_fix(column),
            Lines::Tum { .. } | Lines::Poses(_) => false,
        }
    }

    /// Returns a reader of a trajectory: estimates without a covariance.
    pub fn tum(input: R, file: &str) -> Self {
        let (input, bytes) = counted(input);
        let lines = Lines::Tum {
            input: BufReader::new(input),
            line: Vec::new(),
            number: 0,
        };
        Self::of(lines, file, bytes, false)
    }

    /// Returns a reader of a trajectory in any format: estimates without a covariance.
    ///
    /// # Errors
    /// As [`trajectories::read`].
    pub fn trajectory(
        text: &[u8],
        file: &str,
        times: Option<trajectories::Named<'_>>,
    ) -> Result<Self, TumError> {
        let found = trajectories::read(text, file, times)?;
        let bytes = Arc::new(AtomicU64::new(text.len() as u64));
        let lines = Lines::Poses(found.poses.into_iter());
        Ok(Self::of(lines, file, bytes, false))
    }

    fn of(lines: Lines<R>, file: &str, bytes: Arc<AtomicU64>, covariance: bool) -> Self {
        Self {
            lines,
            file: file.into(),
            diagnostics: ReaderDiagnostics::default(),
            bytes,
            covariance,
            body: BodyFrames::default(),
        }
    }

    /// Gives the places of frames on the robot: the poses are those of a frame that the user names.
    #[must_use]
    pub fn with_body(mut self, body: BodyFrames) -> Self {
        self.body = body;
        self
    }
}

fn counted<R: Read>(input: R) -> (Counted<R>, Arc<AtomicU64>) {
    let bytes = Arc::new(AtomicU64::new(0));
    let counted = Counted {
        input: Limited::new(input),
        bytes: bytes.clone(),
    };
    (counted, bytes)
}

impl<R: Read> Recording for Text<R> {
    fn next(&mut self) -> Result<Option<Item>, RecordingError> {
        let sample = match &mut self.lines {
            Lines::Poses(poses) => match poses.next() {
                None => return Ok(None),
                Some(pose) => of_pose(&pose),
            },
            Lines::Csv(rows) => match rows.next() {
                None => return Ok(None),
                Some(row) => of_row(&row?, self.covariance),
            },
            Lines::Tum {
                input,
                line,
                number,
            } => loop {
                line.clear();
                let longest = Limited::<R>::LONGEST as u64 + 1;
                let count = input.by_ref().take(longest).read_until(b'\n', line);
                let count = count.map_err(|source| RecordingError::Io {
                    file: self.file.clone(),
                    source,
                })?;
                if count == 0 {
                    return Ok(None);
                }
                if count as u64 == longest {
                    return Err(RecordingError::Io {
                        file: self.file.clone(),
                        source: std::io::Error::new(
                            std::io::ErrorKind::InvalidData,
                            "a line is too long: lines end with a line feed",
                        ),
                    });
                }
                *number += 1;
                let text = String::from_utf8_lossy(line);
                let text = text.trim_start_matches('\u{feff}');
                if let Some((numbers, _)) = numbers(text.trim_end(), &self.file, *number)? {
                    break of_numbers(numbers);
                }
            },
        };
        // A text names no frame; one that the user names has a place, or is the base.
        let body = self.body.body(None, true).unwrap_or(Body::Base);
        let mut sample = sample_of_base(sample, body);
        let [east, north] = self.body.origin();
        let belief = &mut sample.belief;
        (belief.x_m, belief.y_m) = (belief.x_m - east, belief.y_m - north);
        if let Some([x, y, _]) = &mut sample.truth {
            (*x, *y) = (*x - east, *y - north);
        }
        Ok(Some(Item::Estimate(sample)))
    }

    fn diagnostics(&self) -> &ReaderDiagnostics {
        &self.diagnostics
    }

    fn bytes(&self) -> u64 {
        self.bytes.load(Ordering::Relaxed)
    }
}

/// Returns a time since the last fix in milliseconds, rounded up. `None` if it is below zero or not a number.
fn milliseconds(since_fix_s: f64) -> Option<u32> {
    // A conversion to `u32` saturates.
    (since_fix_s >= 0.0).then(|| libm::ceil(since_fix_s * 1000.0) as u32)
}

fn of_row(row: &Row, covariance: bool) -> Sample {
    let mut belief = PoseEstimate::new(row.estimate, Uncertainty::Gaussian(row.covariance));
    if !covariance {
        belief.spread = None;
    }
    Sample {
        source: 0,
        t_s: row.t_s.unwrap_or(f64::NAN),
        logged_s: row.now_s,
        exact_ns: None,
        frame: None,
        z_m: 0.0,
        belief,
        truth: row.truth,
        since_fix_ms: row.since_fix_s.and_then(milliseconds),
        lever_m: 0.0,
        other: None,
        is_ambiguous: false,
        fault: None,
    }
}

fn of_pose(pose: &Stamped) -> Sample {
    let (p, q) = (pose.position, pose.rotation);
    of_numbers([pose.t_s, p.x, p.y, p.z, q.i, q.j, q.k, q.w])
}

fn of_numbers([t_s, x, y, z_m, qx, qy, qz, qw]: [f64; 8]) -> Sample {
    Sample {
        source: 0,
        t_s,
        logged_s: None,
        exact_ns: None,
        frame: None,
        z_m,
        belief: PoseEstimate {
            x_m: x,
            y_m: y,
            heading: Heading::Quaternion([qx, qy, qz, qw]),
            spread: None,
        },
        truth: None,
        since_fix_ms: None,
        lever_m: 0.0,
        other: None,
        is_ambiguous: false,
        fault: None,
    }
}
