//! A recording played: read on one thread, judged on the others.

use super::{Replay, Row};
use crate::log::recording::{Item, Recording, RecordingError, Sample, TagLocalizer, TruePose};
use std::mem::take;
use std::sync::Arc;
use std::sync::mpsc::{SyncSender, sync_channel};

/// So many estimates are judged at a time.
const BATCH: usize = 1024;
/// The first has so many estimates at least, whatever else comes: the clock is known by them.
const FIRST: usize = 64;
/// And so many true poses at most.
const MOST_TRUE: usize = 1 << 16;
/// So many batches wait at most.
const WAITING: usize = 4;

/// What of a recording is played.
#[derive(Clone, Debug)]
pub struct Part {
    /// The first and the last stamp, seconds.
    pub range: [f64; 2],
    /// The camera and its tags, where looks at tags are estimates.
    pub looks: Option<TagLocalizer>,
    /// Estimates that were outside of the range.
    pub outside: u64,
}

/// Why a recording was not played to its end.
#[derive(Debug)]
pub enum PlayError<E> {
    /// It cannot be read.
    Recording(RecordingError),
    /// It has looks at tags, and no camera is known.
    NoCamera,
    /// Its looks at tags are in two frames, so of two cameras.
    Cameras([Arc<str>; 2]),
    /// The rows' taker had enough.
    Taker(E),
}

#[derive(Default)]
struct Batch {
    samples: Vec<Sample>,
    truth: Vec<TruePose>,
    bytes: u64,
}

/// Plays a recording: `out` is given each row, `progress` the bytes that were read. Memory does not grow with it.
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

/// Why reading ends early.
enum Stop {
    Recording(RecordingError),
    NoCamera,
    Cameras([Arc<str>; 2]),
}

/// Reads to the end, or until nobody listens.
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
        // A stamp that is no number is in every range: the gate denies it.
        if sample.t_s < from || sample.t_s > to {
            self.outside += 1;
        } else {
            batch.samples.push(sample);
        }
    }
}
