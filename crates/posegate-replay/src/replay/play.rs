//! Plays a recording: one thread reads, the others evaluate.

use super::{Replay, Row};
use crate::recording::{Item, Recording, RecordingError, Sample, TagLocalizer, TruePose};
use std::mem::take;
use std::sync::Arc;
use std::sync::mpsc::{SyncSender, sync_channel};

/// Estimates per batch.
const BATCH: usize = 1024;
/// The fewest estimates in the first batch, from which the clock is determined.
const FIRST: usize = 64;
/// The first batch ends with this many true poses, even with fewer estimates.
const MOST_TRUE: usize = 1 << 16;
/// The most batches in the queue.
const WAITING: usize = 4;

/// The part of a recording to play.
#[derive(Clone, Debug)]
pub struct Part {
    /// The range of stamps, first and last, seconds.
    pub range: [f64; 2],
    /// The camera and its tags, if estimates are computed from detections.
    pub looks: Option<TagLocalizer>,
    /// Number of estimates outside of the range.
    pub outside: u64,
}

/// The reason why a recording was not played to its end.
#[derive(Debug)]
pub enum PlayError<E> {
    /// The recording cannot be read.
    Recording(RecordingError),
    /// The recording has tag detections, but no camera is known.
    NoCamera,
    /// The tag detections are in two frames, so they come from two cameras.
    Cameras([Arc<str>; 2]),
    /// The callback for rows returned an error.
    Taker(E),
}

#[derive(Default)]
struct Batch {
    samples: Vec<Sample>,
    truth: Vec<TruePose>,
    bytes: u64,
}

/// Plays a recording. Calls `out` with each row and `progress` with the number of bytes read so far. Memory does
/// not grow with the recording.
///
/// # Errors
/// [`PlayError`].
pub fn play<E: Send>(
    recording: &mut (dyn Recording + Send),
    part: &mut Part,
    replay: &mut Replay<'_>,
    out: &mut impl FnMut(&Row) -> Result<(), E>,
    progress: &mut impl FnMut(u64),
) -> Result<(), PlayError<E>> {
    std::thread::scope(|scope| {
        let (sender, receiver) = sync_channel::<Batch>(WAITING);
        let reader = scope.spawn(move || send(recording, part, &sender));
        for batch in &receiver {
            for pose in &batch.truth {
                replay.truth(pose);
            }
            let taken = replay.estimates(&batch.samples, out);
            taken.map_err(PlayError::Taker)?;
            progress(batch.bytes);
        }
        match reader.join() {
            Ok(Ok(())) => replay.finish(out).map_err(PlayError::Taker),
            Ok(Err(Stop::Recording(error))) => Err(PlayError::Recording(error)),
            Ok(Err(Stop::NoCamera)) => Err(PlayError::NoCamera),
            Ok(Err(Stop::Cameras(frames))) => Err(PlayError::Cameras(frames)),
            Err(panic) => std::panic::resume_unwind(panic),
        }
    })
}

/// The reason why reading ends early.
enum Stop {
    Recording(RecordingError),
    NoCamera,
    Cameras([Arc<str>; 2]),
}

/// Reads to the end, or until the receiver is gone.
fn send(
    recording: &mut (dyn Recording + Send),
    part: &mut Part,
    sender: &SyncSender<Batch>,
) -> Result<(), Stop> {
    let mut batch = Batch::default();
    let mut is_first = true;
    loop {
        let item = recording.next().map_err(Stop::Recording)?;
        let over = item.is_none();
        match item {
            None => {}
            Some(Item::Truth(pose)) => batch.truth.push(pose),
            Some(Item::Estimate(sample)) => part.add(sample, &mut batch),
            Some(Item::Detections {
                source,
                t_s,
                exact_ns,
                frame,
                found,
            }) => {
                let looks = part.looks.as_mut().ok_or(Stop::NoCamera)?;
                looks.note_frame(&frame).map_err(Stop::Cameras)?;
                if let Some(sample) = looks.estimate(source, t_s, exact_ns, &found) {
                    part.add(sample, &mut batch);
                }
            }
        }
        let enough = !is_first || batch.samples.len() >= FIRST || batch.truth.len() >= MOST_TRUE;
        if over || batch.samples.len() >= BATCH || (enough && batch.truth.len() >= BATCH) {
            is_first &= batch.samples.is_empty();
            batch.bytes = recording.bytes();
            if sender.send(take(&mut batch)).is_err() || over {
                return Ok(());
            }
        }
    }
}

impl Part {
    fn add(&mut self, sample: Sample, batch: &mut Batch) {
        let [from, to] = self.range;
        // A NaN stamp counts as in range: the gate denies the estimate.
        if sample.t_s < from || sample.t_s > to {
            self.outside += 1;
        } else {
            batch.samples.push(sample);
        }
    }
}
