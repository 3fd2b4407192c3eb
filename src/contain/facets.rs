//! Tests a pose-set against the pieces of a facet layout.
//!
//! The set is inside if one piece contains it: its headings lie in the piece's arc, and its points in every frame
//! ([`super::frame`]) satisfy every facet. (Or if several pieces contain it together: [`super::union`].) A facet is tested in up to three steps, each sharper and more expensive than
//! the previous one. `s` is the slack of the estimate (less the frame's rest and the roundings below), `g = F'a` the
//! extent along the normal, `h = (J D)'a` the row of the bend:
//!
//! 1. `s >= |X| + |lever| + E` (no extent along any normal is larger), where `E = f |X|` is an upper bound of the bend
//!    `-f u1 (h.u)`. This takes one comparison per facet; the rest is common to the frame.
//! 2. `s >= E` and `(s - E)^2 >= |g|^2`.
//!    A moved ellipsoid is tested in these two steps; the growth by the movement along the normal is first subtracted from `s`.
//! 3. The maximum of `g.u - f u1 (h.u)` over `|u| <= 1`, bounded by weak duality. For any lambda above |Q|, with `Q`
//!    the symmetric matrix of the bend, the maximum is at most `lambda + g' (lambda - Q)^-1 g / 4`. With lambda = r / 2
//!    and r >= |g| this gives `r - f g1 (h.g) / r^2 + 2 |Q|^2 / (r - 2 |Q|)`, and `|Q| = f (|h| + |h1|) / 2`. This
//!    takes two roots and three quotients of 32 bits.
//!
//! # Rounding
//!
//! | step | at most | covered by |
//! |---|---|---|
//! | estimate and goal to length units, cosine and sine, P to length units | [`clearance_q14`] | the proof of a table raises every b by this |
//! | entries of the factor to the nearest: 0.71 in each of three columns | 1.23 units of the extent | s is lowered by [`ROUNDING`] |
//! | a normal in robot axes rotated into world axes: 0.83 of 2^-14 by cosine and sine, 0.71 to the nearest; times the extent, 2^14 | 1.54 | the same |
//! | yaw times lever: 1.13 on each axis of one column | 1.60 | the same |
//! | factor times a scale (margins only): 0.5 um in six entries | 1.23 | the same |
//! | a factor's yaw times a scale (margins only): up, by at most 2^-24 turn, at a lever of 4.2 m | 1.57 | the same |
//! | **sum of these**, times the length of a normal | **7.20** | |
//! | s to the extent's units, down; g, E, rest and radius up | 0 | - |
//! | step 3: cosines, quotients and h to the nearest | 12 | [`ROUNDING_OF_BEND`] |

use super::compact::{Columns, QuantizedPoseSet};
use super::frame::{FramePoints, Ready};
use super::heading::{self, Sweep, in_arc};
use super::nearest::{DecisionObserver, Nearest, NoObserver, ONE_Q10};
use super::union;
use crate::num::{COS_SIN_ERROR_Q15, Divisor, sqrt_floor, sqrt_upper};
use crate::parts;
use crate::pose::Pose;
use crate::set::{Extent, PoseSet, Turn};
use crate::table::{Axes, Facet, Facets, Frame, NORMAL_BITS};

/// Most by which rounding can lower an extent's reach along a normal, in the extent's units.
const ROUNDING: i32 = 8;
/// Most by which the roundings of step 3 can lower the bend, in the extent's units.
const ROUNDING_OF_BEND: i32 = 16;
/// Largest `|x| + |y|` of a normal in any axes: 2^14 sqrt(1 + 2^-7) sqrt(2).
const ALONG_AT_ANY_ANGLE: i64 = 23_262;
/// Half of [`ALONG_AT_ANY_ANGLE`], times 1.118.
const ROUNDED_AND_TURNED: i64 = 13_004;

/// Returns the largest error of `a . P` of a facet from rounding the estimate and its heading, in length units times
/// 2^14. The proof of a table raises every b by this value.
///
/// Estimate and goal are within 0.5 um on each axis, and their difference is rounded to the nearest 2^k um. These
/// roundings are on world axes, which a normal in robot axes can meet at any angle. A rotated point has the error of
/// cosine and sine times its length, and is rounded once more. That error rotates with the yaw offset t, which the
/// decision uses to first order: it counts `sqrt(1 + t^2)` times its length, at most 1.118 times, at any angle to the
/// normal.
#[must_use]
pub fn clearance_q14(facet: Facet, axes: Axes, turns: bool, unit: u8, lever: u16) -> i64 {
    let along = match axes {
        Axes::World => {
            i64::from(facet.x.unsigned_abs()).wrapping_add(i64::from(facet.y.unsigned_abs()))
        }
        Axes::Robot => ALONG_AT_ANY_ANGLE,
    };
    // 0.5 + 2^-k on each axis. Headings: 1.6e-9 rad at a lever of 2^15 are 2^-14.
    let estimate = (along >> 1)
        .wrapping_add(along.wrapping_shr(u32::from(unit)))
        .wrapping_add(3);
    if matches!(axes, Axes::World) && !turns {
        return estimate;
    }
    // Error * 2^-15 * 2^14 times |P|, times the normal's length.
    let lever = i64::from(lever);
    let turned = i64::from(COS_SIN_ERROR_Q15).wrapping_mul(lever.wrapping_add(lever >> 7)) >> 1;
    estimate
        .wrapping_add(turned)
        .wrapping_add(ROUNDED_AND_TURNED)
        .wrapping_add(2)
}

/// Returns `true` if one of the pieces contains every pose of the set, or several together.
#[inline(always)]
pub(super) fn covers(facets: &Facets<'_>, set: &PoseSet, goal: Pose) -> bool {
    plainly(facets, set, goal)
        || at_its_headings(facets, set, goal)
        || union::covers(facets, set, goal)
}

/// As [`covers`], and returns a lower bound on the factor by which the set could be larger, unit 2^-10 (see
/// [`Nearest`]). `None` if no piece contains the set.
#[inline(never)]
pub(super) fn margin_q10(facets: &Facets<'_>, set: &PoseSet, goal: Pose) -> Option<u32> {
    let mut nearest = Nearest::new();
    if is_held(facets, set, goal, &mut nearest) {
        return Some(nearest.margin_q10());
    }
    (at_its_headings(facets, set, goal) || union::covers(facets, set, goal)).then_some(ONE_Q10)
}

/// Steps 1 to 3.
#[inline(never)]
fn plainly(facets: &Facets<'_>, set: &PoseSet, goal: Pose) -> bool {
    is_held(facets, set, goal, &mut NoObserver)
}

/// Step 4: for sets that turn.
#[inline(never)]
fn at_its_headings(facets: &Facets<'_>, set: &PoseSet, goal: Pose) -> bool {
    parts::HEADINGS
        && facets.lever() != 0
        && Sweep::of(facets, set, goal).is_some_and(|sweep| sweep.is_held(facets, set, goal))
}

#[inline(always)]
fn is_held(
    facets: &Facets<'_>,
    set: &PoseSet,
    goal: Pose,
    watch: &mut impl DecisionObserver,
) -> bool {
    let ready = QuantizedPoseSet::of(facets, set, goal).and_then(|set| Ready::of(set, facets));
    let mut columns = None;
    ready.is_some_and(|ready| {
        facets.pieces().any(|piece| {
            in_arc(&piece, ready.set.above_goal, ready.set.common.turn.reach) && {
                watch.piece(&piece, &ready.set, facets.lever() > 0);
                let mut frames = piece.frames();
                frames.all(|frame| holds(&frame, &ready, &mut columns, watch))
            }
        })
    })
}

/// Returns `true` if the set's points satisfy the facets of a frame.
#[inline(always)]
fn holds(
    frame: &Frame<'_>,
    ready: &Ready<'_>,
    columns: &mut Option<Columns>,
    watch: &mut impl DecisionObserver,
) -> bool {
    let seen = ready.seen(frame);
    let [lx, ly] = seen.lever;
    // `|lx| + |ly|` is at most twice the longest lever: halved to fit the range of `turned`.
    let lever = lx
        .unsigned_abs()
        .wrapping_add(ly.unsigned_abs())
        .wrapping_add(1)
        >> 1;
    let lever = ready.set.turned(lever as i32) << 1;
    let less = seen.rest.wrapping_add(ROUNDING);
    // Step 1: no extent along any normal is larger.
    let extent = ready
        .broad
        .wrapping_add(lever)
        .wrapping_add(lever >> 7)
        .wrapping_add(4 + ROUNDING);
    let enough = extent.wrapping_add(seen.bend).wrapping_add(seen.rest);
    let down = NORMAL_BITS.wrapping_sub(ready.set.finer);
    frame.facets().all(|facet| {
        let spare = spare(facet, &seen).wrapping_shr(down);
        watch.facet(spare);
        spare >= enough || holds_sharply(facet, ready, &seen, columns, spare.wrapping_sub(less))
    }) && {
        watch.frame(&seen, extent);
        true
    }
}

/// Returns `true` if step 2 or step 3 accepts.
#[inline(never)]
fn holds_sharply(
    facet: Facet,
    ready: &Ready<'_>,
    seen: &FramePoints,
    columns: &mut Option<Columns>,
    spare: i32,
) -> bool {
    if !(spare >= 0) {
        return false;
    }
    let spare = spare.min(0xffff);
    let [lx, ly] = seen.lever;
    let lever = along(facet, [ready.set.turned(lx), ready.set.turned(ly)]);
    let columns = match (&*columns, ready.set.set.extent()) {
        (_, Extent::Bounded { .. }) => return spare >= ready.broad.wrapping_add(up(lever)),
        (_, Extent::Grown { factor, by }) => {
            let columns = &*columns.get_or_insert_with(|| ready.set.columns(factor.x, factor.y));
            let turns = [factor.yaw, by.yaw_q24()].map(|yaw| Turn::of(yaw.unsigned_abs()));
            let moved = by.translation_um().unsigned_abs();
            return holds_grown(facet, ready, seen, columns, &turns, moved, spare);
        }
        (Some(columns), _) => columns,
        (None, Extent::Gaussian(factor)) => &*columns.insert(ready.set.columns(factor.x, factor.y)),
    };
    let normal = in_world(facet, seen.axes, ready);
    let parts = parts(normal, columns, lever);
    let reach = reach_square(parts);
    let left = spare.wrapping_sub(seen.bend);
    left >= 0 && square(left) >= reach
        || seen.bend > 0
            && square(spare) >= reach >> 1
            && bends(
                normal,
                columns,
                parts,
                ready.set.common.turn.radians_q15,
                reach,
                spare,
            )
}

/// Returns `true` if step 2 accepts a moved ellipsoid; otherwise step 4 decides. `turns` are the largest turns of the ellipsoid and of
/// the movement; `moved` is the length of the movement, micrometres.
///
/// The extents along the normal add up: `|F'a| + rho |a| + omega |lever|`, with the ellipsoid's own turn in F'a. The bend is the whole
/// set's.
#[inline(never)]
fn holds_grown(
    facet: Facet,
    ready: &Ready<'_>,
    seen: &FramePoints,
    columns: &Columns,
    turns: &[Turn; 2],
    moved: u32,
    spare: i32,
) -> bool {
    let set = &ready.set;
    let [lx, ly] = seen.lever;
    let lever = |turn: &Turn| {
        let by = turn.shift(set.finer);
        along(facet, [turn.at(lx, by), turn.at(ly, by)])
    };
    let [own, swing] = turns;
    // A lever is within 1.6; a normal is longer than 1 by 2^-8 at most.
    let swung = up(lever(swing)).wrapping_add(2);
    let moved = moved.wrapping_shr(set.unit).wrapping_add(1);
    let moved = moved.wrapping_add(moved >> 7).wrapping_add(1) as i32;
    let spare = spare.wrapping_sub(swung).wrapping_sub(moved);
    if !(spare >= 0) {
        return false;
    }
    let normal = in_world(facet, seen.axes, ready);
    let parts = parts(normal, columns, lever(own));
    let reach = reach_square(parts);
    let left = spare.wrapping_sub(seen.bend);
    left >= 0 && square(left) >= reach
}

/// Returns a facet's normal in world axes, times 2^14.
#[inline(always)]
fn in_world(facet: Facet, axes: Axes, ready: &Ready<'_>) -> [i32; 2] {
    let normal = [i32::from(facet.x), i32::from(facet.y)];
    match axes {
        Axes::World => normal,
        Axes::Robot => ready.outwards(normal),
    }
}

/// Returns `F'a` times 2^14: the columns along a normal in world axes, the lever along the facet's normal in its own
/// axes.
#[cfg_attr(small_code, inline(never))]
#[cfg_attr(not(small_code), inline(always))]
fn parts(normal: [i32; 2], columns: &Columns, lever: i32) -> [i32; 3] {
    let [first, second, third] = columns.map(|column| dot(normal, column));
    [first.wrapping_add(lever), second, third]
}

/// Returns the slack of the estimate at a facet, length units times 2^14: below 2^30.8.
#[inline(always)]
fn spare(facet: Facet, seen: &FramePoints) -> i32 {
    (i32::from(facet.b) << NORMAL_BITS).wrapping_sub(along(facet, [seen.x, seen.y]))
}

/// Returns `a . v`, times 2^14.
#[inline(always)]
fn along(facet: Facet, v: [i32; 2]) -> i32 {
    dot([i32::from(facet.x), i32::from(facet.y)], v)
}

#[inline(always)]
const fn dot([ax, ay]: [i32; 2], [x, y]: [i32; 2]) -> i32 {
    ax.wrapping_mul(x).wrapping_add(ay.wrapping_mul(y))
}

/// Returns `|F'a|^2`, each part rounded up. Below 2^32: the extent is below 2^14 and the lever's part below 2^14.5, so
/// that both together are below 2^15.3.
#[cfg_attr(small_code, inline(never))]
#[cfg_attr(not(small_code), inline(always))]
fn reach_square(parts: [i32; 3]) -> u32 {
    parts
        .iter()
        .fold(0u32, |sum, part| sum.wrapping_add(square(up(*part))))
}

/// Returns `true` if step 3 accepts: the facet with its bend bounded by weak duality.
#[cfg_attr(small_code, inline(never))]
#[cfg_attr(not(small_code), inline(always))]
fn bends(
    [ax, ay]: [i32; 2],
    columns: &Columns,
    parts: [i32; 3],
    radians: i32,
    reach: u32,
    spare: i32,
) -> bool {
    // (J D)'a: of a column (x, y) it is a_y x - a_x y.
    let across = |[x, y]: [i32; 2]| nearest(ay.wrapping_mul(x).wrapping_sub(ax.wrapping_mul(y)));
    let h = columns.map(across);
    let g = parts.map(nearest);
    // An upper bound of the root, at most 0.2 % too large: one Newton step from above.
    let above = sqrt_upper(reach);
    let root = reach
        .checked_div(above)
        .unwrap_or(0)
        .wrapping_add(above)
        .wrapping_shr(1)
        .wrapping_add(1);
    let squares = h.iter().fold(0u32, |sum, v| sum.wrapping_add(square(*v)));
    let ([h1, ..], [g1, ..]) = (h, g);
    // |Q|, rounded up: 2^15.6 * 2^14.
    let q = sqrt_upper(squares)
        .wrapping_add(h1.unsigned_abs())
        .wrapping_add(8)
        .wrapping_mul(radians.unsigned_abs())
        .wrapping_shr(16)
        .wrapping_add(1);
    let left = spare.wrapping_sub(root as i32);
    if left >= q as i32 {
        return true;
    }
    if root <= q.wrapping_mul(4) {
        return false;
    }
    // cos = g1 / r, unit 2^-14, and h.g / r: |h.g| is below 2^29.3.
    let product = h
        .iter()
        .zip(g)
        .fold(0i32, |sum, (h, g)| sum.wrapping_add(h.wrapping_mul(g)));
    let cosine = quotient(g1.wrapping_mul(1 << 14), root);
    let share = quotient(product, root);
    // - f cos (h.g) / r: 2^14 * 2^14.1, shifted, times 2^14.
    let bend = (cosine.wrapping_mul(share) >> 14).wrapping_mul(radians) >> 15;
    // q is at most a quarter of r, below 2^14.
    let second_order = q
        .wrapping_mul(q)
        .wrapping_mul(2)
        .checked_div(root.wrapping_sub(q.wrapping_mul(2)))
        .unwrap_or(u32::MAX >> 2)
        .wrapping_add(1);
    left.wrapping_add(bend) >= (second_order as i32).wrapping_add(ROUNDING_OF_BEND)
}

/// Returns `value / by`, rounded towards zero, or 0 if `by` is 0.
fn quotient(value: i32, by: u32) -> i32 {
    let quotient = value.unsigned_abs().checked_div(by).unwrap_or(0) as i32;
    if value < 0 {
        quotient.wrapping_neg()
    } else {
        quotient
    }
}

/// Returns `|value| / 2^14`, rounded up.
#[cfg_attr(small_code, inline(never))]
#[cfg_attr(not(small_code), inline(always))]
fn up(value: i32) -> i32 {
    (value.unsigned_abs().wrapping_add((1 << NORMAL_BITS) - 1) >> NORMAL_BITS) as i32
}

/// Returns `value / 2^14`, rounded to the nearest.
#[inline(always)]
fn nearest(value: i32) -> i32 {
    value.wrapping_add(1 << (NORMAL_BITS - 1)) >> NORMAL_BITS
}

/// Returns the square of a number below 2^16.
#[inline(always)]
fn square(value: i32) -> u32 {
    value.unsigned_abs().wrapping_mul(value.unsigned_abs())
}

/// Returns where a set first leaves its piece, or all of several pieces: the touching point of the facet with the least slack after the extent,
/// relative to the estimate, in world axes: um, um, 2^-24 turn. For reports; to first order, or for a set that turns by more
/// than a fiftieth of a radian from its sections at some headings.
pub(super) fn witness(facets: &Facets<'_>, set: &PoseSet, goal: Pose) -> [i64; 3] {
    if let Some(found) = union::witness(facets, set, goal) {
        return found;
    }
    let ready = QuantizedPoseSet::of(facets, set, goal).and_then(|set| Ready::of(set, facets));
    // Up to a fiftieth of a radian, first order is exact enough.
    let has_moved = matches!(set.extent(), Extent::Grown { .. });
    let is_linear = !has_moved && (facets.lever() == 0 || set.common().turn.radians_q15 <= 1 << 9);
    let Some(ready) = ready.filter(|_| is_linear) else {
        return heading::farthest(facets, set, goal);
    };
    let (mut least, mut found) = (i64::MAX, [0; 3]);
    for frame in facets.pieces().take(1).flat_map(|piece| piece.frames()) {
        let seen = ready.seen(&frame);
        for facet in frame.facets() {
            let spare = i64::from(spare(facet, &seen)).wrapping_shl(ready.set.finer);
            let (reach, offset) = touching(facet, &seen, &ready);
            if spare.wrapping_sub(reach) < least {
                (least, found) = (spare.wrapping_sub(reach), offset);
            }
        }
    }
    found
}

/// Returns the reach of a set along a normal, in the extent's units times 2^14, and the touching point: um, um, 2^-24
/// turn. The point is of the unrounded set, without the allowance for roundings in the reach.
fn touching(facet: Facet, seen: &FramePoints, ready: &Ready<'_>) -> (i64, [i64; 3]) {
    let set = &ready.set;
    let [lx, ly] = seen.lever;
    let lever = along(facet, [set.turned(lx), set.turned(ly)]);
    let yaw_q24 = i64::from(set.common.turn.reach >> 8);
    let normal = in_world(facet, seen.axes, ready);
    match set.set.extent() {
        Extent::Gaussian(factor) | Extent::Grown { factor, .. } => {
            let columns = set.columns(factor.x, factor.y);
            let g = parts(normal, &columns, lever);
            let sum = g.iter().fold(0u64, |sum, g| {
                let g = u64::from(g.unsigned_abs());
                sum.saturating_add(g.saturating_mul(g))
            });
            let length = sqrt_floor(sum);
            // Shares of the columns, times 2^14, and of the yaw.
            let shares = g.map(|g| {
                let g = i64::from(g).wrapping_mul(1 << 14);
                Divisor::new(length).map_or(0, |by| by.nearest(g))
            });
            // Three products below 2^29 * 2^14.
            let axis = |row: [i32; 3]| {
                let sum = row.iter().zip(shares).fold(0i64, |sum, (entry, share)| {
                    sum.wrapping_add(i64::from(*entry).wrapping_mul(share))
                });
                sum >> NORMAL_BITS
            };
            let [share, ..] = shares;
            let yaw = yaw_q24.wrapping_mul(share) >> NORMAL_BITS;
            (length, [axis(factor.x), axis(factor.y), yaw])
        }
        Extent::Bounded { translation_um, .. } => {
            let radius = i64::from(ready.broad);
            // The length of a normal is 1 to within 2^-8.
            let [nx, ny] = normal.map(|v| u64::from(v.unsigned_abs()));
            let length = sqrt_floor(nx.wrapping_mul(nx).wrapping_add(ny.wrapping_mul(ny)));
            let [x, y] = normal.map(|v| {
                let along = i64::from(v).wrapping_mul(i64::from(translation_um));
                Divisor::new(length).map_or(0, |by| by.nearest(along))
            });
            let yaw = if lever < 0 {
                yaw_q24.wrapping_neg()
            } else {
                yaw_q24
            };
            let reach = (radius << NORMAL_BITS).wrapping_add(i64::from(lever.unsigned_abs()));
            (reach, [x, y, yaw])
        }
    }
}

#[cfg(test)]
mod small;
#[cfg(test)]
mod touch;
