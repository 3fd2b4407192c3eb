//! The newest movements, in memory of fixed size.

use super::increment::{Excess, Step};
use heapless::Vec;

/// The newest N movements. An array whose oldest entry is overwritten: `heapless::Deque` has arithmetic that may panic.
#[derive(Debug)]
pub(super) struct Ring<const N: usize> {
    /// From `oldest` to the end, then from the start.
    items: Vec<Step, N, u32>,
    /// What the robot drove in addition in each.
    more: [Excess; N],
    oldest: u32,
    /// The stamp at which the newest entry begins.
    begins_ms: u32,
    /// The length and the turns that the robot drove in the newest entry, as [`Step::driven`].
    drove: [u32; 2],
}

/// The longest time of increments that are kept as one, milliseconds: N entries reach back at least half of N times this time, whatever the
/// rate of the odometry.
pub(super) const TOGETHER_MS: u32 = 8;

impl<const N: usize> Ring<N> {
    pub const fn new() -> Self {
        const { assert!(N > 0, "a tracker keeps one increment at least") };
        Self {
            items: Vec::new(),
            more: [Excess::NONE; N],
            oldest: 0,
            begins_ms: 0,
            drove: [0; 2],
        }
    }

    pub fn clear(&mut self) {
        *self = Self::new();
    }

    /// Adds the newest increment, what the robot drove in it, and the stamp at which it begins. Returns the oldest entry if it is overwritten.
    pub fn push(&mut self, newest: Step, drove: [u32; 2], begins_ms: u32) -> Option<Step> {
        let last = match (self.oldest as usize).checked_sub(1) {
            Some(before) => before,
            None => self.items.len().wrapping_sub(1),
        };
        if newest.stamp_ms.wrapping_sub(self.begins_ms) <= TOGETHER_MS
            && let (Some(last), Some(more)) = (self.items.get_mut(last), self.more.get_mut(last))
        {
            let [length, turns] = self.drove;
            let [by_length, by_turns] = drove;
            let all = [
                length.saturating_add(by_length),
                turns.saturating_add(by_turns),
            ];
            if let Some(both) = last.and(&newest, all) {
                (*last, *more) = both;
                self.drove = all;
                return None;
            }
        }
        self.drove = drove;
        self.begins_ms = begins_ms;
        let Err(newest) = self.items.push(newest) else {
            return None;
        };
        let at = self.oldest as usize;
        let oldest = self.items.get_mut(at)?;
        let left = core::mem::replace(oldest, newest);
        *self.more.get_mut(at)? = Excess::NONE;
        let next = self.oldest.wrapping_add(1);
        self.oldest = if (next as usize) < N { next } else { 0 };
        Some(left)
    }

    /// Returns the k-th movement from the oldest, and what was driven in addition.
    pub fn get(&self, k: usize) -> Option<(&Step, Excess)> {
        let at = (self.oldest as usize).wrapping_add(k);
        let at = if at < N { at } else { at.wrapping_sub(N) };
        Some((self.items.get(at)?, *self.more.get(at)?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::VecDeque;
    use std::vec::Vec as List;

    #[test]
    fn ring_keeps_newest_entries_in_order() {
        let of = |stamp_ms| Step {
            x_q8: 1,
            y_q8: 2,
            turn: 3,
            stamp_ms,
        };
        let mut ring = Ring::<5>::new();
        let mut expected = VecDeque::new();
        for stamp in (0..23).map(|k| 9 * k) {
            expected.push_back(of(stamp));
            let left = if expected.len() > 5 {
                expected.pop_front()
            } else {
                None
            };
            assert_eq!(ring.push(of(stamp), [0; 2], stamp.wrapping_sub(9)), left);
            let kept: List<Step> = (0..5)
                .filter_map(|k| ring.get(k))
                .map(|(step, _)| *step)
                .collect();
            assert_eq!(kept, expected.iter().copied().collect::<List<_>>());
        }
        ring.clear();
        assert_eq!((0..5).filter_map(|k| ring.get(k)).count(), 0);
        assert_eq!(ring.push(of(1), [0; 2], 0), None);
    }
}
