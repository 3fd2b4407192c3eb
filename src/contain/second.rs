//! The second evaluation: a plain formula that must confirm every permit of [`super::decide`].
//!
//! A flipped bit in code, registers or memory can make a decision permit wrongly. The second evaluation
//! shares next to nothing with the first: it starts from the floats of the belief, reads the table from its
//! bytes in flash by readers of its own, has its own fixed point, its own cosine and sine, and another
//! formula (covariances, where the first has factors). What makes the first wrong does not make the
//! second wrong in the same way. It is not for permitting: it has no margin, and no proof but the first
//! one's. A gate latches a fault where the two disagree, so it must say [`INSIDE`] whenever a healthy first
//! evaluation does; by how much it is more lenient is kept small:
//!
//! # Facets
//! A piece holds a set when its arc holds the headings, and for every facet `a . P <= b`, with `s` what the
//! estimate has to spare and P linear in the yaw, `s >= 0` and `s^2 >= r2 a'Pa`; of a cylinder,
//! `s >= rho |(a_x, a_y)| + alpha |a_yaw|`. No root and no quotient, but where an ellipsoid fails a facet in
//! the robot's axes: the touching point is then looked at with the product of its yaw and offset, as the
//! first evaluation does.
//!
//! | tolerance, of s | at most |
//! |---|---|
//! | the first rounds estimate and turned points to length units, and its cosines to 2^-15: what the proof of a table raises every b by, so that nothing outside of the proven set is let in (`facet_clearance_q14`) | 0.72 to 1.1 units; where P turns 0.79 more and 5.7e-5 of the lever |
//! | position to 2^-15 unit, cosine and sine to 2^-26 at a lever of 2^15 units; a quaternion's heading to 32 of 2^-32 turn, likewise; the same of the covariance's axes | 1/64 unit |
//! | squared radius, variances and shares: down, 2^-28 of them | 2^-29 of the extent |
//! | covariances down, to 28 bits of the largest variance (26 at least): each variance is lowered by 5, and by 8 more after turns and levers, which counts where the set is far longer than it is along the normal | 6e-4 of the longest extent |
//! | headings of the arc | 32 of 2^-32 turn |
//!
//! Beyond first order the first evaluation subtracts what this one does not: that is what lets through
//! the most, where sets turn by tenths of a radian (`tests/second_opinion.rs` measures it).
//!
//! # Cells
//! Where facets do not hold a set and the table has cells, outermost poses of the set are looked up: a
//! spot check, no proof. What it lets through is measured.

use crate::report::PoseEstimate;
use crate::set::Trust;

use self::believed::Question;
use self::bits::word32;

mod believed;
mod bits;
mod planes;
mod spots;
#[cfg(test)]
mod tests;
mod turn;

/// The word of [`opinion`] that confirms a permit: half ones, half zeros.
pub const INSIDE: u32 = 0x5a3c_96e1;
/// The word that does not: every bit differs.
const OUTSIDE: u32 = !INSIDE;

/// [`INSIDE`] if the plain formula says that the belief's pose-set lies inside the table's success set,
/// at the table's squared radius and as far as its source is trusted; another word otherwise.
///
/// `table` is the bytes of a table that has been parsed once; of other bytes the answer means nothing, and
/// is given without panic. Anything that is no number, a variance that is not above zero, an
/// orientation that is none: not inside. Of a covariance only the upper triangle is looked at.
///
/// Cost: `ci.sh budgets` prints it; about as many instructions as the first evaluation with the
/// conversion of its floats for facets, some ten times that for cells.
#[inline(never)]
#[must_use]
pub fn opinion(table: &[u8], belief: &PoseEstimate, trust: Trust) -> u32 {
    if is_inside(table, belief, trust) == Some(true) {
        INSIDE
    } else {
        OUTSIDE
    }
}

fn is_inside(table: &[u8], belief: &PoseEstimate, trust: Trust) -> Option<bool> {
    let question = Question {
        belief,
        trust,
        radius_q16: word32(table, 64)?,
    };
    if !(trust.is_valid() && (1 << 16..1 << 24).contains(&question.radius_q16)) {
        return None;
    }
    let by_planes = layout(table, 76).and_then(|planes| planes::hold(table, planes, &question));
    if by_planes == Some(true) {
        return Some(true);
    }
    spots::hold(table, layout(table, 68)?, &question)
}

/// The bytes of a layout whose offset and length stand in the header.
fn layout(table: &[u8], at: usize) -> Option<&[u8]> {
    let offset = usize::try_from(word32(table, at)?).ok()?;
    let length = usize::try_from(word32(table, at.wrapping_add(4))?).ok()?;
    if length == 0 {
        return None;
    }
    let (_, rest) = table.split_at_checked(offset)?;
    Some(rest.split_at_checked(length)?.0)
}
