//! Does a report permit by itself? Its order, its age, and both evaluations of each of its hypotheses.

use super::{CorruptWord, Gate, Reason, Weighed};
use crate::contain::{self, Decision, second};
use crate::gate::Source;
use crate::gate::elsewhere::allowed_for;
use crate::gate::evidence::{Evidence, MOST_HYPOTHESES};
use crate::gate::permission::{Check, FlowSignature};
use crate::report::{PoseEstimate, Report};
use crate::set::{Growth, Trust};
use crate::table::{self, Table};
use crate::task::Risk;
use core::hint::black_box;

impl Gate<'_> {
    /// Returns `Ok` if a report permits by itself. A repeated report is evaluated like any other, but without
    /// [`Check::Followed`], so its signature is never complete.
    pub(super) fn weigh(
        &self,
        now_ms: u32,
        evidence: &Evidence<'_>,
        source: Result<&Source, Reason>,
        newest: Result<u32, Reason>,
        flow: &mut FlowSignature,
    ) -> Weighed {
        let source = match source {
            Ok(source) => source,
            Err(reason) => return Ok(Err(reason)),
        };
        let report = evidence.report;
        let follows = self.follows(report, newest)?;
        match follows {
            Ok(()) => flow.past(Check::Followed),
            Err(Reason::Repeated) => {}
            Err(reason) => return Ok(Err(reason)),
        }
        if !self.is_fresh_at(now_ms, report.stamp_ms) {
            return Ok(Err(Reason::Stale));
        }
        flow.past(Check::Fresh);
        let table = match &self.table {
            Ok(table) => table,
            Err(reason) => return Ok(Err(*reason)),
        };
        if !(evidence.others.len() < MOST_HYPOTHESES) {
            return Ok(Err(Reason::TooManyHypotheses));
        }
        let grown;
        let movement = if source.motion.stands_still() {
            &evidence.beside
        } else {
            let age_ms = now_ms.wrapping_sub(report.stamp_ms);
            let driven = self.settings.movement(source.motion, age_ms);
            grown = driven.plus(evidence.beside);
            &grown
        };
        let radius = table.radius_squared();
        // Most reports state neither: nothing is copied for them.
        let changed;
        let trust = if evidence.since_fix_ms.is_none() && evidence.elsewhere == Risk::NONE {
            &source.trust
        } else {
            let aged = source.trust_after(evidence.since_fix_ms);
            match allowed_for(evidence.elsewhere, radius, aged) {
                Some(trust) if evidence.elsewhere == Risk::NONE || evidence.can_make_up() => {
                    changed = trust;
                }
                _ => return Ok(Err(Reason::ElsewhereTooLikely)),
            }
            &changed
        };
        if let Err(reason) = first_opinion(table, &report.belief, trust, movement) {
            return Ok(Err(reason));
        }
        for belief in evidence.others {
            if let Err(reason) = first_opinion(table, belief, trust, movement) {
                return Ok(Err(reason));
            }
        }
        flow.past(Check::First);
        // Looked up again, so that the two evaluations do not depend on one pointer.
        let Some(source) = black_box(self.settings)
            .sources
            .get(usize::from(report.source))
        else {
            return Err(CorruptWord);
        };
        let seen = black_box(evidence);
        let grown;
        let movement = if source.motion.stands_still() {
            &seen.beside
        } else {
            grown = self
                .movement_by_complement(report, source)
                .plus(seen.beside);
            &grown
        };
        let changed;
        let trust = if seen.since_fix_ms.is_none() && seen.elsewhere == Risk::NONE {
            &source.trust
        } else {
            // The radius from flash, as for the evaluation itself.
            let radius = table::stored_radius_squared(self.bytes);
            let aged = source.trust_again(seen.since_fix_ms);
            match radius.and_then(|radius| allowed_for(seen.elsewhere, radius, aged)) {
                Some(trust) => changed = trust,
                None => return Ok(Err(Reason::EvaluationsDisagree)),
            }
            &changed
        };
        let confirms = |belief: &PoseEstimate| {
            let word = second::opinion_after(self.bytes, belief, *trust, movement);
            word == second::INSIDE
        };
        if !confirms(&report.belief) {
            return Ok(Err(Reason::EvaluationsDisagree));
        }
        // Counted down, so that a loop that ends too early is found.
        let mut left = evidence.others.len();
        for belief in evidence.others {
            if !confirms(belief) {
                return Ok(Err(Reason::EvaluationsDisagree));
            }
            left = left.wrapping_sub(1);
        }
        if !(left == 0) {
            return Err(CorruptWord);
        }
        flow.past(Check::Second);
        Ok(follows)
    }

    /// Returns the largest movement until a permission on a report ends, from the complements and in another form: within the time
    /// until the estimate is too old, or the time since its stamp until the hold time is over, whichever is less.
    #[inline(never)]
    fn movement_by_complement(&self, report: &Report, source: &Source) -> Growth {
        let seen = black_box(self);
        let settings = seen.settings;
        let now = seen.now_ms.by_complement_of_opaque();
        let most = settings.maximum_age_ms;
        let held = settings.permit_hold_ms.wrapping_add(settings.response_ms);
        let age = now.wrapping_sub(report.stamp_ms);
        // Each time is below 2^31. An estimate that is older than the maximum age does not come here.
        let left = most.saturating_sub(age);
        let horizon = if left < held {
            most.max(age)
        } else {
            age.wrapping_add(held)
        };
        source.motion.within(horizon)
    }
}

/// Returns `Ok` if the pose-set of a hypothesis after a movement is inside by the first evaluation.
#[inline(never)]
fn first_opinion(
    table: &Table<'_>,
    belief: &PoseEstimate,
    trust: &Trust,
    movement: &Growth,
) -> Result<(), Reason> {
    let mut set = belief.pose_set(table.radius_squared(), *trust);
    // In place: the set takes more memory than the rest of the step.
    let set = match &mut set {
        Ok(set) => set,
        Err(impossible) => return Err((*impossible).into()),
    };
    if !movement.is_none() {
        set.grow(*movement);
    }
    match contain::decide(table, set) {
        Decision::Inside => Ok(()),
        Decision::Outside(cause) => Err(cause.into()),
    }
}
