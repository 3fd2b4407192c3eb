//! For recordings and benches only: evaluates estimates one by one, without state. An interlock is driven by
//! [`crate::gate::Gate`].
//!
//! An [`Evaluator`] checks the age of a stamp, then the numbers, and decides. It does not wait for consecutive permits,
//! runs no second evaluation and checks no settings. It does not notice lost, repeated or foreign reports. One bad
//! estimate or one flipped bit is enough for a wrong permit.
//!
//! ```
//! use posegate::gate::{Reason, Verdict};
//! use posegate::recordings::Evaluator;
//! use posegate::set::{Estimate, PoseSet};
//!
//! let evaluator = Evaluator::new(include_bytes!("../../examples/tables/dock.posegate"), 200)?;
//! let estimate = Estimate { x_m: 0.01, y_m: 0.0, yaw_rad: 0.0 };
//! let set = PoseSet::bounded(estimate, 0.03, 0.01);
//!
//! // 50 ms after the estimate, and 300 ms after it.
//! assert!(matches!(evaluator.evaluate(1_050, 1_000, set), Verdict::Permit { .. }));
//! assert_eq!(evaluator.permits(1_300, 1_000, set), Err(Reason::Stale));
//! # Ok::<(), posegate::gate::InvalidParameter>(())
//! ```

use crate::contain::{self, Decision};
use crate::gate::{self, InvalidParameter, Reason, Verdict};
use crate::set::{InputError, PoseSet, RadiusSquared};
use crate::table::{Table, TableError};

/// For recordings and benches only: a table and a maximum age, to evaluate estimates for one task, each on its own. A
/// controller that drives an interlock uses a [`gate::Gate`].
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Evaluator<'a> {
    table: Result<Table<'a>, TableError>,
    maximum_age_ms: u32,
}

/// The squared radius of epsilon 0.99, used without a table: 11.3449, rounded up.
const RADIUS_099: u32 = 743_498;

impl<'a> Evaluator<'a> {
    /// Returns an evaluator on the bytes of a table. Invalid bytes give an evaluator that denies
    /// ([`Reason::TableDamaged`], [`Reason::TableTooNew`] or [`Reason::PartMissing`]), because a controller with damaged flash must still answer.
    ///
    /// # Errors
    /// [`InvalidParameter::MaximumAge`] unless `1 <= maximum_age_ms < 2^31`.
    pub fn new(table: &'a [u8], maximum_age_ms: u32) -> Result<Self, InvalidParameter> {
        if !(1..1 << 31).contains(&maximum_age_ms) {
            return Err(InvalidParameter::MaximumAge);
        }
        Ok(Self {
            table: Table::parse(table),
            maximum_age_ms,
        })
    }

    /// Returns the table, or the reason why the bytes are not one.
    ///
    /// # Errors
    /// The error of [`Table::parse`].
    pub const fn table(&self) -> Result<&Table<'a>, TableError> {
        match &self.table {
            Ok(table) => Ok(table),
            Err(error) => Err(*error),
        }
    }

    /// Returns the squared radius of the site's confidence, from the table.
    #[must_use]
    pub fn radius_squared(&self) -> RadiusSquared {
        let fallback = RadiusSquared::from_q16(RADIUS_099);
        self.table
            .as_ref()
            .map_or(fallback, |table| Some(table.radius_squared()))
            .unwrap_or(RadiusSquared::LARGEST)
    }

    /// Evaluates a pose-set with the stamp `stamp_ms` at the time of use `now_ms`, both of one wrapping millisecond
    /// clock. A clock of 32 bits cannot distinguish an age from the same age plus 49.7 days, so the source must not
    /// keep estimates that long. Returns the verdict with its margin and worst pose, at the cost of
    /// [`contain::examine`]. A control loop that needs only the answer calls [`Evaluator::permits`].
    pub fn evaluate(
        &self,
        now_ms: u32,
        stamp_ms: u32,
        set: Result<PoseSet, InputError>,
    ) -> Verdict {
        match self.admit(now_ms, stamp_ms, set) {
            Err(reason) => Verdict::deny(reason),
            Ok((table, set)) => gate::judge(table, &set),
        }
    }

    /// Returns only the verdict: one decision, no margin.
    ///
    /// # Errors
    /// The reason of a denial.
    pub fn permits(
        &self,
        now_ms: u32,
        stamp_ms: u32,
        set: Result<PoseSet, InputError>,
    ) -> Result<(), Reason> {
        let (table, set) = self.admit(now_ms, stamp_ms, set)?;
        match contain::decide(table, &set) {
            Decision::Inside => Ok(()),
            Decision::Outside(cause) => Err(cause.into()),
        }
    }

    /// Checks the preconditions of a decision: a valid table, a fresh stamp, valid numbers.
    fn admit(
        &self,
        now_ms: u32,
        stamp_ms: u32,
        set: Result<PoseSet, InputError>,
    ) -> Result<(&Table<'a>, PoseSet), Reason> {
        let table = self.table().map_err(Reason::from)?;
        if !self.is_fresh(now_ms, stamp_ms) {
            return Err(Reason::Stale);
        }
        Ok((table, set.map_err(Reason::from)?))
    }

    /// Returns `true` if a stamp is not older than the maximum age and not from the future.
    const fn is_fresh(&self, now_ms: u32, stamp_ms: u32) -> bool {
        // A stamp from the future wraps to an age of 2^31 or more, above every maximum. A stamp that is 24.8 days off
        // or more is ambiguous on this clock, as `evaluate` states.
        let age_ms = now_ms.wrapping_sub(stamp_ms);
        age_ms <= self.maximum_age_ms
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SET: Result<PoseSet, InputError> = Err(InputError::CovarianceZero);

    #[test]
    fn no_maximum_age_disables_the_age_check() {
        for bad in [0, 1 << 31, u32::MAX] {
            assert_eq!(
                Evaluator::new(&[], bad).err(),
                Some(InvalidParameter::MaximumAge)
            );
        }
        assert!(Evaluator::new(&[], 1).is_ok() && Evaluator::new(&[], (1 << 31) - 1).is_ok());
    }

    /// Ages 0, maximum and one more; stamps from the future; the wrap of the clock.
    #[test]
    fn only_stamps_within_maximum_age_are_fresh() {
        let evaluator = Evaluator {
            table: Err(TableError::Magic),
            maximum_age_ms: 100,
        };
        // Freshness is checked after the table, so this tests the age alone.
        let fresh = |now: u32, stamp: u32| evaluator.is_fresh(now, stamp);
        for base in [0u32, 1, 50, u32::MAX, u32::MAX - 50, 1 << 31] {
            for (age, expected) in [
                (0, true),
                (1, true),
                (100, true),
                (101, false),
                (1 << 30, false),
            ] {
                assert_eq!(
                    fresh(base, base.wrapping_sub(age)),
                    expected,
                    "{base} {age}"
                );
            }
            for ahead in [1, 2, 100, 101, 1 << 20, (1 << 31) - 1, 1 << 31] {
                assert!(!fresh(base, base.wrapping_add(ahead)), "{base} {ahead}");
            }
        }
    }

    #[test]
    fn an_evaluator_without_a_table_denies() {
        let evaluator = Evaluator::new(&[0; 4096], 100).unwrap();
        assert_eq!(evaluator.permits(0, 0, SET), Err(Reason::TableDamaged));
        assert_eq!(
            evaluator.evaluate(0, 0, SET),
            Verdict::deny(Reason::TableDamaged)
        );
    }

    #[test]
    fn default_radius_is_at_least_that_of_confidence_099() {
        assert!(f64::from(RADIUS_099) / 65536.0 >= 11.344866730144373);
    }
}
