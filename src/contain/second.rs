//! The second evaluation: a plain formula that must confirm every permit of [`super::decide`].
//!
//! A flipped bit in code, registers or memory can make a decision permit wrongly. The second evaluation
//! shares almost nothing with the first. It starts from the floats of the estimate and reads the table from
//! its bytes in flash by its own readers. It has its own fixed point, its own cosine and sine, and another
//! formula (covariances, where the first uses factors). A fault that makes the first wrong does not make the
//! second wrong in the same way. The second evaluation must not permit alone: it has no margin, and its only
//! proof is that of the first. A gate latches a fault if the two disagree, so this one must return
//! [`INSIDE`] whenever a healthy first evaluation permits. Its extra tolerance is kept small:
//!
//! ```
//! use posegate::contain::second::{INSIDE, opinion};
//! use posegate::report::PoseEstimate;
//! use posegate::set::{Estimate, Trust, Uncertainty};
//!
//! // It reads the bytes of the table, and the floats as they were reported.
//! let table = include_bytes!("../../examples/tables/dock.posegate");
//! let reported = |x_m| {
//!     let estimate = Estimate { x_m, y_m: 0.0, yaw_rad: 0.0 };
//!     PoseEstimate::new(estimate, Uncertainty::Bounded { translation_m: 0.03, yaw_rad: 0.01 })
//! };
//! assert_eq!(opinion(table, &reported(0.0), Trust::FULL), INSIDE);
//! assert_ne!(opinion(table, &reported(0.06), Trust::FULL), INSIDE);
//! ```
//!
//! # Facets
//! A piece contains a set if its arc contains the headings and every facet `a . P <= b` holds. With the
//! slack `s` of the estimate and P linear in the yaw, a facet holds if `s >= 0` and `s^2 >= r2 a'Pa`; for a
//! cylinder, if `s >= rho |(a_x, a_y)| + alpha |a_yaw|`. This needs no root and no quotient, except if an
//! ellipsoid fails a facet in the robot's axes: then the touching point is checked with the product of its
//! yaw and offset, as in the first evaluation. A facet whose point rotates may also be satisfied by exact sections at seventeen headings
//! (`headings.rs`): beyond half a radian these alone decide.
//!
//! | tolerance, of s | at most |
//! |---|---|
//! | the first rounds estimate and rotated points to length units, and its cosines to 2^-15. The proof of a table raises every b by this, so that nothing outside of the proven set is accepted (`facet_clearance_q14`) | 0.72 to 1.1 units; where P rotates, 0.79 more and 5.7e-5 of the lever |
//! | position to 2^-14 unit, cosine and sine to 2^-26 at a lever of 2^15 units; a quaternion's heading to 16 of 2^-32 turn, at the same lever; the same for the covariance's axes | 1/64 unit |
//! | squared radius, variances and shares: down, by 1.5 of 2^-28 of their value | 0.75 of 2^-28 of the extent |
//! | covariances down, to 28 bits of the largest variance (26 at least): each variance is lowered by 3, and by 8 more after rotations and levers, which matters if the set is far longer than its extent along the normal | 6e-4 of the longest extent |
//! | headings of the arc | 32 of 2^-32 turn |
//!
//! A movement takes its own extent along the normal off s: `rho |a|`, and to first order its turn times the lever; sections are also
//! evaluated with the robot turned either way.
//!
//! The first evaluation subtracts bounds of the terms beyond first order; this one does not. That is the
//! largest difference, for sets that turn by tenths of a radian (`tests/second_opinion.rs` measures it).
//!
//! # Several pieces, and cells
//! If no single piece contains a set and there are several, each of the outermost poses of the set must lie in one of them. If
//! the table has cells instead of facets, these poses are looked up there. Both are spot checks, not proofs. The share of wrong acceptances is
//! measured.

use crate::report::PoseEstimate;
use crate::set::{Growth, Trust};
use crate::table::parts;

use self::believed::Question;
use self::bits::word32;

mod believed;
mod bits;
#[cfg(test)]
mod error_budget;
mod headings;
mod planes;
mod spots;
#[cfg(test)]
mod tests;
mod turn;

/// The word of [`opinion`] that confirms a permit: 16 ones, 16 zeros.
pub const INSIDE: u32 = 0x5a3c_96e1;
/// The word that denies: every bit differs.
const OUTSIDE: u32 = !INSIDE;

/// Returns [`INSIDE`] if the plain formula finds the estimate's pose-set inside the table's success set, at
/// the table's squared radius and with the trust in the source. Returns another word otherwise.
///
/// `table` must be the bytes of a table that has been parsed before. For other bytes the answer is
/// meaningless, but there is no panic. Invalid input is not inside: a value that is not a number, a variance
/// that is not above zero, an invalid orientation. Only the upper triangle of a covariance is read.
///
/// Cost (`ci.sh budgets` prints it): for facets about as many instructions as the first evaluation with the
/// conversion of its floats, for cells some ten times that.
#[inline(never)]
#[must_use]
pub fn opinion(table: &[u8], belief: &PoseEstimate, trust: Trust) -> u32 {
    opinion_after(table, belief, trust, &Growth::NONE)
}

/// As [`opinion`], of the estimate's pose-set grown by a movement.
#[inline(never)]
#[must_use]
pub fn opinion_after(table: &[u8], belief: &PoseEstimate, trust: Trust, movement: &Growth) -> u32 {
    if is_inside(table, belief, trust, movement) == Some(true) {
        INSIDE
    } else {
        OUTSIDE
    }
}

fn is_inside(table: &[u8], belief: &PoseEstimate, trust: Trust, movement: &Growth) -> Option<bool> {
    let question = Question {
        belief,
        trust,
        radius_q16: word32(table, 64)?,
        moved_um: movement.translation_um().unsigned_abs(),
        side_um: movement.side_um().unsigned_abs(),
        // From a turn on, every heading is reached.
        swing: i64::from(movement.yaw_q24().min(1 << 24)) << 8,
    };
    if !(trust.is_valid() && (1 << 16..1 << 24).contains(&question.radius_q16)) {
        return None;
    }
    match (layout(table, 76), layout(table, 68)) {
        (Some(planes), _) => planes::hold(table, planes, &question),
        (None, Some(cells)) if parts::CELLS => spots::hold(table, cells, &question),
        _ => None,
    }
}

/// Returns the bytes of a layout whose offset and length are in the header at `at`.
fn layout(table: &[u8], at: usize) -> Option<&[u8]> {
    let offset = usize::try_from(word32(table, at)?).ok()?;
    let length = usize::try_from(word32(table, at.wrapping_add(4))?).ok()?;
    if length == 0 {
        return None;
    }
    let (_, rest) = table.split_at_checked(offset)?;
    Some(rest.split_at_checked(length)?.0)
}
