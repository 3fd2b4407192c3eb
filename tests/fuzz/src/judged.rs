//! Compares the gate's verdict on a set with that of `contain`.

use posegate::contain::{Decision, Examination, Margin};
use posegate::gate::{Reason, Verdict};
use posegate::recordings::Evaluator;
use posegate::set::PoseSet;

/// Maximum age of the gates, milliseconds.
pub const MAXIMUM_AGE_MS: u32 = 200;

/// Asserts that a gate on the bytes gives the decision on a set if the stamp is fresh, that both functions
/// agree, and that a stale stamp is denied.
pub fn agrees(bytes: &[u8], set: PoseSet, now_ms: u32, stamp_ms: u32, decided: &Examination) {
    let gate = Evaluator::new(bytes, MAXIMUM_AGE_MS).expect("an age in range");
    let verdict = gate.evaluate(now_ms, stamp_ms, Ok(set));
    let age = (i64::from(now_ms) - i64::from(stamp_ms)).rem_euclid(1 << 32);
    match gate.permits(now_ms, stamp_ms, Ok(set)) {
        Ok(()) => {
            assert_eq!(decided.decision, Decision::Inside);
            assert!(age <= i64::from(MAXIMUM_AGE_MS));
            let margin = decided.margin;
            assert!(margin >= Margin::ONE);
            assert_eq!(verdict, Verdict::Permit { margin });
        }
        Err(Reason::Stale) => {
            assert!(age > i64::from(MAXIMUM_AGE_MS));
            assert_eq!(verdict, Verdict::deny(Reason::Stale));
        }
        Err(reason) => {
            let Decision::Outside(cause) = decided.decision else {
                panic!("{reason:?} for a set that is inside");
            };
            assert_eq!(reason, cause.into());
            let (margin, worst_pose) = (Some(decided.margin), decided.worst_pose);
            let denial = Verdict::Deny {
                reason,
                margin,
                worst_pose,
            };
            assert_eq!(verdict, denial);
        }
    }
}
