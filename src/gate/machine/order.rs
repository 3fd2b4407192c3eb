//! The order of reports: source, sequence number and stamp, each checked twice in different forms.

use super::{
    BACKWARDS_MS, CorruptWord, Gate, NO_SOURCE, Reason, RedundantWord, Report, Source, Weighed,
};
use core::hint::black_box;

impl Gate<'_> {
    /// Checks that a report is the next one of the last report's source. The first report after a start or a reset
    /// always passes.
    pub(super) fn follows(&self, report: &Report, newest: Result<u32, Reason>) -> Weighed {
        let seen = black_box(self);
        let source = seen.last_source.get_of_opaque()?;
        if source == NO_SOURCE {
            return Ok(Ok(()));
        }
        if source != u32::from(report.source) {
            return Ok(Err(Reason::SourceChanged));
        }
        let steps = report
            .sequence
            .wrapping_sub(seen.last_sequence.get_of_opaque()?);
        if steps > 1 {
            return Ok(Err(Reason::SequenceGap));
        }
        if steps == 0 && report.stamp_ms == seen.newest_stamp_ms.get_of_opaque()? {
            return Ok(Err(Reason::Repeated));
        }
        Ok(match newest {
            Ok(_) if steps == 0 => Err(Reason::SequenceStuck),
            otherwise => otherwise.map(drop),
        })
    }

    /// Checks that a stamp is newer than every earlier stamp, and not from the future, in a cycle at `now_ms`. Returns the stamp.
    ///
    /// Both stamps are counted back from the latest time that the newest stamp can have, so that the clock's wrap
    /// makes neither older than it is. After 49.7 days the wrap makes the newest stamp recent again, and a fresh
    /// report waits for the maximum age at most.
    pub(super) fn is_newest(
        &self,
        now_ms: u32,
        stamp_ms: u32,
    ) -> Result<Result<u32, Reason>, CorruptWord> {
        let seen = black_box(self);
        if !(now_ms.wrapping_sub(stamp_ms) < BACKWARDS_MS) {
            return Ok(Err(Reason::Stale));
        }
        let latest = now_ms.wrapping_add(self.settings.maximum_age_ms);
        let newest = match seen.last_source.get_of_opaque()? {
            // Farther back than any stamp.
            NO_SOURCE => latest.wrapping_add(1),
            _ => seen.newest_stamp_ms.get_of_opaque()?,
        };
        Ok(
            if latest.wrapping_sub(stamp_ms) < latest.wrapping_sub(newest) {
                Ok(stamp_ms)
            } else {
                Err(Reason::TimeBackwards)
            },
        )
    }

    /// Returns `true` if a report has the frame of its source and follows the last report. A second check against a
    /// corrupted result of the first: it reads the complements and compares in another form. A stamp from the future
    /// is not fresh, and freshness has a second check too.
    pub(super) fn follows_again(&self, report: &Report) -> bool {
        let seen = black_box(self);
        let source = seen.last_source.by_complement_of_opaque();
        let settings = seen.settings;
        let framed = settings
            .sources
            .get(usize::from(report.source))
            .is_some_and(|known| known.frame.digest() ^ report.frame.digest() == 0);
        if source == NO_SOURCE {
            return framed;
        }
        let sequence = seen.last_sequence.by_complement_of_opaque();
        let newest = seen.newest_stamp_ms.by_complement_of_opaque();
        // Counted forwards from just after the latest time that the newest stamp can have.
        let behind = seen
            .now_ms
            .by_complement_of_opaque()
            .wrapping_add(settings.maximum_age_ms)
            .wrapping_add(1);
        framed
            && source ^ u32::from(report.source) == 0
            && sequence.wrapping_add(1) ^ report.sequence == 0
            && report.stamp_ms.wrapping_sub(behind) > newest.wrapping_sub(behind)
    }

    /// Returns `true` if a report is the last one: a second check, in case another denial is taken for
    /// [`Reason::Repeated`].
    pub(super) fn is_last_again(&self, report: &Report) -> bool {
        let seen = black_box(self);
        seen.last_source.by_complement_of_opaque() ^ u32::from(report.source) == 0
            && seen.last_sequence.by_complement_of_opaque() ^ report.sequence == 0
            && seen.newest_stamp_ms.by_complement_of_opaque() ^ report.stamp_ms == 0
    }

    /// Stores the values that the next report is compared with. A report of an undeclared source or in another frame is not stored, and a
    /// stamp from the future neither: otherwise no report would be newer until that time. Each word and its complement are from a reading of
    /// their own, so that a wrong reading is found in the next cycle; the first one of the stamp is that which was checked.
    pub(super) fn remember(
        &mut self,
        report: &Report,
        source: Result<&Source, Reason>,
        newest: Result<u32, Reason>,
    ) -> Result<(), CorruptWord> {
        if source.is_err() {
            return Ok(());
        }
        let again = black_box(report);
        if let Ok(stamp_ms) = newest {
            self.newest_stamp_ms = RedundantWord::of_two(stamp_ms, again.stamp_ms);
        } else if self.last_source.get()? == NO_SOURCE {
            // Older than every fresh stamp.
            let stale = self.settings.maximum_age_ms.wrapping_add(1);
            self.newest_stamp_ms = RedundantWord::new(self.now_ms.get()?.wrapping_sub(stale));
        }
        self.last_source = RedundantWord::of_two(u32::from(report.source), u32::from(again.source));
        self.last_sequence = RedundantWord::of_two(report.sequence, again.sequence);
        Ok(())
    }
}
