//! How a permit is earned, stands and ends: ages, permits in a row, the hold time, and restarts. What opens the gate is checked a second time from
//! the complements.

use super::{CorruptWord, DecodedState, Gate, Reason, Report, StateSnapshot};
use crate::gate::permission::{Check, FlowSignature};
use crate::gate::{Restart, Settings};
use core::hint::black_box;

impl Gate<'_> {
    /// Returns `true` if a stamp is not older than the maximum age when a permission of the cycle at `now_ms` ends, and not from
    /// the future. A stamp from the future has an age of half the clock's range or more.
    pub(super) fn is_fresh_at(&self, now_ms: u32, stamp_ms: u32) -> bool {
        now_ms.wrapping_sub(stamp_ms) <= self.settings.oldest_ms()
    }

    /// Restores the state from before a report that the first checks found to be a repetition. Closes the gate
    /// if the second check, from the complements, finds another report.
    pub(super) fn repeat(&mut self, report: &Report, before: &StateSnapshot) {
        if self.is_last_again(report) {
            self.restore(before);
        } else {
            self.close(before, Reason::Repeated);
        }
    }

    /// Adds one permit, and opens the gate if there are enough. The report is the last one already. Repeats the first checks from the
    /// complements: `before`, `held`, and that the report permits. Returns [`CorruptWord`] if they disagree, or if the signature is not that of every check before.
    pub(super) fn permit(
        &mut self,
        before: &StateSnapshot,
        held: bool,
        mut flow: FlowSignature,
    ) -> Result<(), CorruptWord> {
        // Else a denial that is taken for a permit would qualify the next report. The gate must remember this report. Its age is checked
        // again by [`Gate::output`].
        if flow != FlowSignature::WEIGHED {
            return Err(CorruptWord);
        }
        // This report does not count on earlier permits that should have ended.
        if before.standing.is_earning() && !self.stands() {
            return Err(CorruptWord);
        }
        self.permitted_at_ms = self.now_ms;
        let settings = black_box(&*self).settings;
        let needed = u32::from(settings.permits_in_a_row);
        let so_far = match before.standing {
            DecodedState::Inhibited(_) => 0,
            DecodedState::Qualifying(count) => u32::from(count),
            DecodedState::Permitted(_) => needed,
            DecodedState::Latched(_) => return Err(CorruptWord),
        };
        let count = so_far.saturating_add(1).min(0xffff);
        if !(count >= needed && held) {
            self.state = DecodedState::Qualifying(count as u16).word();
            return Ok(());
        }
        // The count and the times again, from the complements: detects a corrupted count or subtraction.
        if !before.has_earned_by_complement(settings.permits_in_a_row)
            || !self.is_held_long_enough_by_complement(settings)
        {
            return Err(CorruptWord);
        }
        flow.past(Check::Qualified);
        self.state = DecodedState::Permitted(flow).word();
        Ok(())
    }

    /// Returns `true` if the hold time since the last denial is over.
    pub(super) fn is_held_long_enough(&self) -> Result<bool, CorruptWord> {
        let seen = black_box(self);
        let closed_for = seen
            .now_ms
            .get_of_opaque()?
            .wrapping_sub(seen.closed_at_ms.get_of_opaque()?);
        Ok(closed_for >= self.settings.inhibit_hold_ms)
    }

    /// As [`Gate::is_held_long_enough`], from the complements.
    pub(super) fn is_held_long_enough_by_complement(&self, settings: &Settings<'_>) -> bool {
        let seen = black_box(self);
        let now = seen.now_ms.by_complement_of_opaque();
        let opens = seen
            .closed_at_ms
            .by_complement_of_opaque()
            .wrapping_add(settings.inhibit_hold_ms);
        now.wrapping_sub(opens) <= u32::MAX.wrapping_sub(settings.inhibit_hold_ms)
    }

    /// Closes the gate for at least the hold time. With [`Restart::OnReset`] an open gate stays closed until the
    /// reset.
    #[cfg_attr(small_code, inline(never))]
    pub(super) fn close(&mut self, before: &StateSnapshot, reason: Reason) {
        match before.standing {
            DecodedState::Latched(_) => {}
            DecodedState::Permitted(_) if self.settings.restart == Restart::OnReset => {
                self.state = DecodedState::Latched(reason).word();
            }
            _ => self.enter_inhibited(reason),
        }
    }

    pub(super) fn enter_inhibited(&mut self, reason: Reason) {
        self.closed_at_ms = self.now_ms;
        self.state = DecodedState::Inhibited(reason).word();
    }

    /// Returns `true` if a permit that is valid or being earned has not ended: a second check of the times, from the complements, independent
    /// of the first.
    #[cfg_attr(small_code, inline(never))]
    pub(super) fn stands(&self) -> bool {
        let seen = black_box(self);
        let settings = seen.settings;
        let now = seen.now_ms.by_complement_of_opaque();
        let age = now.wrapping_sub(seen.newest_stamp_ms.by_complement_of_opaque());
        let since = now.wrapping_sub(seen.permitted_at_ms.by_complement_of_opaque());
        age <= settings.oldest_ms() && since <= settings.permit_hold_ms
    }
}
