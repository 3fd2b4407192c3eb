//! A recording played: read on one thread, judged on the others.

use super::{Replay, Row};
use crate::log::recording::{Item, Looks, Recording, RecordingError, Sample};
use std::mem::take;
use std::sync::mpsc::{SyncSender, sync_channel};
use std::vec::Vec;

/// So many estimates are judged at a time.
const BATCH: usize = 1024;
/// So many batches wait at most.
const WAITING: usize = 4;

/// What of a recording is played.
#[derive(Clone, Debug)]
pub struct Part {
    /// The first and the last stamp, seconds.
    pub range: [f64; 2],
    /// The camera and its tags, where looks at tags are estimates.
    pub looks: Option<Looks>,
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
    /// The rows' taker had enough.
    Taker(E),
}

#[derive(Default)]
struct Batch {
    samples: Vec<Sample>,
    truth: Vec<(f64, [f64; 3])>,
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
            for (t_s, pose) in batch.truth {
                replay.truth(t_s, pose);
            }
            let taken = replay.estimates(&batch.samples, out);
            taken.map_err(PlayError::Taker)?;
            progress(batch.bytes);
        }
        match reader.join() {
            Ok(Ok(())) => replay.finish(out).map_err(PlayError::Taker),
            Ok(Err(Some(error))) => Err(PlayError::Recording(error)),
            Ok(Err(None)) => Err(PlayError::NoCamera),
            Err(panic) => std::panic::resume_unwind(panic),
        }
    })
}

/// Reads to the end, or until nobody listens. An error, or `None` where a camera is missing.
fn send(
    recording: &mut (dyn Recording + Send),
    part: &mut Part,
    sender: &SyncSender<Batch>,
) -> Result<(), Option<RecordingError>> {
    let mut batch = Batch::default();
    loop {
        let item = recording.next().map_err(Some)?;
        let over = item.is_none();
        match item {
            None => {}
            Some(Item::Truth { t_s, pose }) => batch.truth.push((t_s, pose)),
            Some(Item::Estimate(sample)) => part.add(sample, &mut batch),
            Some(Item::Detections {
                source,
                t_s,
                logged_s,
                found,
            }) => {
                let looks = part.looks.as_mut().ok_or(None)?;
                if let Some(sample) = looks.estimate(source, t_s, logged_s, &found) {
                    part.add(sample, &mut batch);
                }
            }
        }
        if over || batch.samples.len() >= BATCH || batch.truth.len() >= BATCH {
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
