//! A pose-set against facet layers.
//!
//! Per group, the coarsest slab that holds the set's whole yaw interval is asked first, with a test
//! per facet that needs neither root nor division. Where a facet fails, the set is asked of narrower
//! slabs, at last cut into the parts that lie in each slab of a tiling; all parts must pass.
//!
//! # The test of a facet
//! With the estimate m and the factor F in the integers of [`Compact`]: `s = b - a.m` and the row
//! `g = F'a`; the set is inside the half-space when `s >= |g|`, here `s >= 0` and `s^2 >= g1^2 + g2^2 +
//! g3^2`. For a part of the set with yaw offsets in a window, by weak duality, for *any* t on the
//! right side of g1: `s - (g1 - t) p >= sqrt(t^2 + g2^2 + g3^2)`, where p is the window's edge as a
//! share of the largest yaw offset; t >= g1 for the lower edge, t <= g1 for the upper one. The t that
//! makes it sharpest needs a root and a quotient, and their rounding cannot make it unsound.
//!
//! # Rounding
//!
//! | step | at most, in units of the factor | paid by |
//! |---|---|---|
//! | estimate and goal to length and yaw units | - | the proof: pieces are proven with every b raised by it ([`slack_q14`]) |
//! | entries of the factor, to the nearest: 0.5 each in three entries of two rows | 1.24 | s is lowered by 3 |
//! | factor times a scale (margins only): 0.5 um each, likewise | 1.24 | the same |
//! | yaw entry, cylinder's radius: rounded up; a cylinder's turn, away from zero | 1 | the same |
//! | s / 2^14, down; g / 2^14, up | 0 | - |
//! | (g1 - t) p, up; p outwards by 2^-14 and a yaw unit | 0 | - |

use super::compact::{Compact, Shape};
use crate::num::{Divisor, clamped, sqrt_floor};
use crate::table::{Facet, Facets, Layer, NORMAL_BITS, Piece};

/// What rounding of the estimate can do to `a . p` of a facet, in length units times 2^14: the proof
/// of a table raises every b by it.
///
/// Estimate and goal are within 0.5 um on each axis, and their difference is rounded to the nearest
/// 2^k um: 0.5 + 2^-k units on each axis. Yaw: 0.5 and 3 units of 2^-32 turn.
#[must_use]
pub fn slack_q14(facet: Facet, length_shift: u8, yaw_shift: u8) -> i64 {
    let along = i64::from(facet.x.unsigned_abs()).wrapping_add(i64::from(facet.y.unsigned_abs()));
    let tilt = i64::from(facet.yaw.unsigned_abs());
    let half_and = |value: i64, extra: i64, shift: u8| {
        // value / 2 + value * extra / 2^shift, up.
        (value >> 1)
            .wrapping_add(value.wrapping_mul(extra).wrapping_shr(u32::from(shift)))
            .wrapping_add(2)
    };
    half_and(along, 1, length_shift).wrapping_add(half_and(tilt, 3, yaw_shift))
}

/// A part of the set: its yaw offsets as shares of the largest, times 2^14, and the window's tangents.
#[derive(Clone, Copy)]
struct Cut {
    low: i32,
    high: i32,
}

const ONE: i32 = 1 << NORMAL_BITS;
/// Nodes that can wait: one a layer and a spare.
const WAITING: usize = 16;

/// Whether every pose of the set lies in the facets' pieces.
pub(super) fn covers(facets: &Facets<'_>, set: &Compact) -> bool {
    // One unit for the rounding of the estimate's yaw, on either side.
    let low = set.yaw.wrapping_sub(set.reach).wrapping_sub(1);
    let high = set.yaw.wrapping_add(set.reach).wrapping_add(1);
    if low < 0 {
        return false;
    }
    let (low, high) = (low.unsigned_abs(), high.unsigned_abs());
    let mut number = 0;
    while number < facets.layers() {
        let group = facets.layer(number).group;
        match group_covers(facets, set, number, low, high) {
            Some(next) if facets.layer(next).group != group => number = next,
            _ => return false,
        }
    }
    true
}

/// Whether a group of layers passes the set; the number of the next group's first layer if so.
fn group_covers(facets: &Facets<'_>, set: &Compact, first: u8, low: u32, high: u32) -> Option<u8> {
    let group = facets.layer(first).group;
    let mut number = first;
    let mut whole: Option<u8> = None;
    let mut passed = false;
    loop {
        let layer = facets.layer(number);
        if layer.slabs == 0 || layer.group != group {
            break;
        }
        if !passed {
            let (slab, fits) = home(&layer, low, high);
            if fits {
                whole = Some(number);
                passed = passes(facets.slab(&layer, slab), set, middle(&layer, slab), None);
            }
        }
        number = number.wrapping_add(1);
    }
    // `number` is now the first layer of the next group.
    if passed {
        return Some(number);
    }
    let from = whole.unwrap_or(first);
    tiled(facets, set, from, number, low, high).then_some(number)
}

/// The slab that an interval of yaw begins in, and whether it ends in it too.
fn home(layer: &Layer, low: u32, high: u32) -> (u16, bool) {
    let stride = u32::from(layer.stride);
    let last = u32::from(layer.slabs).wrapping_sub(1);
    let slab = low.checked_div(stride).unwrap_or(0).min(last);
    let end = slab.wrapping_add(2).wrapping_mul(stride);
    let start = slab.wrapping_mul(stride);
    (slab as u16, low >= start && high <= end)
}

/// The middle of a slab, yaw units above the lower end.
fn middle(layer: &Layer, slab: u16) -> i32 {
    i32::from(slab)
        .wrapping_add(1)
        .wrapping_mul(i32::from(layer.stride))
}

/// The parts of the set in the slabs of a tiling, each asked and cut further where it fails, down to
/// the group's last layer.
fn tiled(facets: &Facets<'_>, set: &Compact, from: u8, end: u8, low: u32, high: u32) -> bool {
    let layer = facets.layer(from);
    let stride = u32::from(layer.stride);
    let Some(first) = low.checked_div(stride.wrapping_mul(2)) else {
        return false;
    };
    let mut slab = first.wrapping_mul(2);
    // Even slabs tile the range.
    while slab.wrapping_mul(stride) < high {
        let Ok(number) = u16::try_from(slab) else {
            return false;
        };
        if !descends(facets, set, (from, number), end, low, high) {
            return false;
        }
        slab = slab.wrapping_add(2);
    }
    true
}

/// One tile: passes, or all of its halves that the set meets do.
fn descends(
    facets: &Facets<'_>,
    set: &Compact,
    top: (u8, u16),
    end: u8,
    low: u32,
    high: u32,
) -> bool {
    let mut waiting: heapless::Vec<(u8, u16), WAITING> = heapless::Vec::new();
    let mut next = Some(top);
    while let Some((number, slab)) = next {
        let layer = facets.layer(number);
        let stride = u32::from(layer.stride);
        let start = u32::from(slab).wrapping_mul(stride);
        let meets = start < high && start.wrapping_add(stride.wrapping_mul(2)) > low;
        if meets {
            let cut = cut(set, start, stride);
            let passed = slab < layer.slabs
                && passes(
                    facets.slab(&layer, slab),
                    set,
                    middle(&layer, slab),
                    Some(cut),
                );
            if !passed {
                let below = number.wrapping_add(1);
                let child = slab.saturating_mul(2);
                if below >= end || waiting.push((below, child.saturating_add(2))).is_err() {
                    return false;
                }
                next = Some((below, child));
                continue;
            }
        }
        next = waiting.pop();
    }
    true
}

/// The window of a slab as shares of the set's largest yaw offset, outwards.
fn cut(set: &Compact, start: u32, stride: u32) -> Cut {
    let by = Divisor::new(i64::from(set.reach));
    let start = i64::from(start)
        .wrapping_sub(i64::from(set.yaw))
        .wrapping_sub(1);
    let end = start
        .wrapping_add(i64::from(stride).wrapping_mul(2))
        .wrapping_add(2);
    let share = |offset: i64| offset.wrapping_mul(i64::from(ONE));
    let one = i64::from(ONE);
    let least = one.wrapping_neg();
    Cut {
        low: by.map_or(least, |by| clamped(by.floor(share(start)), least, one)) as i32,
        high: by.map_or(one, |by| clamped(by.ceil(share(end)), least, one)) as i32,
    }
}

/// Whether a part of the set (all of it without a cut) lies in a piece.
fn passes(piece: Piece<'_>, set: &Compact, middle: i32, cut: Option<Cut>) -> bool {
    let yaw = set.yaw.wrapping_sub(middle);
    // A slab reaches 2^13 from its middle, a set less than 2^15 from its estimate.
    !piece.is_empty()
        && yaw.unsigned_abs() < 1 << 15
        && piece.facets().all(|facet| holds(facet, set, yaw, cut))
}

fn holds(facet: Facet, set: &Compact, yaw: i32, cut: Option<Cut>) -> bool {
    let (ax, ay, at) = (i32::from(facet.x), i32::from(facet.y), i32::from(facet.yaw));
    // |(a_x, a_y)| <= 2^14 (1 + 2^-8) and |(x, y)| < 2^15.5: below 2^29.6; the tilt's product below
    // 2^30, b's below 2^29: the sum of all may pass 2^31, so it is taken with care.
    let plane = ax.wrapping_mul(set.x).wrapping_add(ay.wrapping_mul(set.y));
    let spare = (i32::from(facet.b) << NORMAL_BITS)
        .saturating_sub(plane)
        .saturating_sub(at.wrapping_mul(yaw));
    if !(spare >= 0) {
        return false;
    }
    // In units of the factor, lowered by what its rounding can do. Sets reach below 2^16.
    let spare = spare
        .wrapping_shr(NORMAL_BITS.saturating_sub(set.finer))
        .min(0xffff)
        .wrapping_sub(3);
    match set.shape {
        Shape::Ellipsoid { yaw, x, y } => {
            let [x1, x2, x3] = x;
            let [y1, y2, y3] = y;
            let row = |x: i32, y: i32| ax.wrapping_mul(x).wrapping_add(ay.wrapping_mul(y));
            let g1 = row(x1, y1).wrapping_add(at.wrapping_mul(yaw));
            let (g2, g3) = (up(row(x2, y2)), up(row(x3, y3)));
            let across = square(g2).wrapping_add(square(g3));
            let whole = square(up(g1)).wrapping_add(across);
            if spare >= 0 && square(spare) >= whole {
                return true;
            }
            cut.is_some_and(|cut| cut_holds(spare, g1, across, cut))
        }
        Shape::Cylinder { radius, yaw } => {
            // |(a_x, a_y)| <= 2^14 (1 + 2^-8).
            let radius = radius.wrapping_add(radius >> 8).wrapping_add(1);
            let (low, high) = cut.map_or((ONE.wrapping_neg(), ONE), |cut| (cut.low, cut.high));
            let g1 = up_signed(at.wrapping_mul(yaw));
            let turned = share(g1, low).max(share(g1, high));
            spare >= radius.wrapping_add(turned)
        }
    }
}

/// The test of a part: at the edge that cuts the farthest point off.
fn cut_holds(spare: i32, g1: i32, across: u32, cut: Cut) -> bool {
    let along = g1 >> NORMAL_BITS;
    let side = sqrt_floor(u64::from(across));
    let edge = if along >= 0 { cut.high } else { cut.low };
    let other = if along >= 0 { cut.low } else { cut.high };
    [edge, other].into_iter().any(|p| {
        // The sharpest t is side * p / sqrt(1 - p^2); rounding is harmless.
        let height = sqrt_floor(u64::from(square(ONE).saturating_sub(square(p))));
        let best = Divisor::new(height).map_or(i64::from(i32::MAX), |by| {
            by.nearest(side.wrapping_mul(i64::from(p)))
        });
        let t = clamped(best, -0xffff, 0xffff) as i32;
        // Upper edge: t <= g1; lower edge: t >= g1. Rounded towards g1's safe side.
        let upper = p == cut.high;
        let t = if upper {
            t.min(along)
        } else {
            t.max(along.wrapping_add(1))
        };
        // (g1 - t) p, up: g1 lies in [along, along + 1].
        let moved =
            share(along.wrapping_sub(t), p).max(share(along.wrapping_add(1).wrapping_sub(t), p));
        let left = spare.wrapping_sub(moved);
        left >= 0
            && u64::from(square(left.min(0xffff)))
                >= u64::from(square(t)).saturating_add(u64::from(across))
    })
}

/// `value * share / 2^14`, up. Values below 2^17, shares at most 2^14.
fn share(value: i32, share: i32) -> i32 {
    let product = i64::from(value).wrapping_mul(i64::from(share));
    ((product.wrapping_neg() >> NORMAL_BITS).wrapping_neg()) as i32
}

/// `|value| / 2^14`, up.
fn up(value: i32) -> i32 {
    (value.unsigned_abs().wrapping_add((1 << NORMAL_BITS) - 1) >> NORMAL_BITS) as i32
}

/// `value / 2^14` away from zero.
fn up_signed(value: i32) -> i32 {
    if value < 0 {
        up(value).wrapping_neg()
    } else {
        up(value)
    }
}

/// The square of a number below 2^16.
fn square(value: i32) -> u32 {
    value.unsigned_abs().wrapping_mul(value.unsigned_abs())
}

/// Where a set leaves the pieces about its estimate's heading first: the touching point of the facet
/// with the least to spare, from the estimate in world axes: um, um, 2^-24 turn. For reports.
pub(super) fn witness(facets: &Facets<'_>, set: &Compact) -> [i32; 3] {
    let at = set.yaw.max(0).unsigned_abs();
    let mut least = i64::MAX;
    let mut found = [0; 3];
    for number in 0..facets.layers() {
        let layer = facets.layer(number);
        // The finest layer of each group.
        if facets.layer(number.wrapping_add(1)).group == layer.group {
            continue;
        }
        let (slab, _) = home(&layer, at, at);
        let yaw = set.yaw.wrapping_sub(middle(&layer, slab));
        for facet in facets.slab(&layer, slab).facets() {
            let (spare, offset) = touching(facet, set, yaw);
            if spare < least {
                (least, found) = (spare, offset);
            }
        }
    }
    found
}

/// What a facet has to spare, and the point of the set nearest to it.
fn touching(facet: Facet, set: &Compact, yaw: i32) -> (i64, [i32; 3]) {
    let row = |x: i32, y: i32| {
        i64::from(facet.x)
            .wrapping_mul(i64::from(x))
            .wrapping_add(i64::from(facet.y).wrapping_mul(i64::from(y)))
    };
    let tilted = |yaw: i32| i64::from(facet.yaw).wrapping_mul(i64::from(yaw));
    let spare = (i64::from(facet.b) << NORMAL_BITS)
        .wrapping_sub(row(set.x, set.y))
        .wrapping_sub(tilted(yaw))
        .wrapping_shl(set.finer);
    let ratio = |value: i64, by: i64| Divisor::new(by).map_or(0, |d| d.floor(value)) as i32;
    let (reach, offset) = match set.shape {
        Shape::Ellipsoid { yaw, x, y } => {
            let [x1, x2, x3] = x;
            let [y1, y2, y3] = y;
            let g = [
                row(x1, y1).wrapping_add(tilted(yaw)),
                row(x2, y2),
                row(x3, y3),
            ];
            let square = g.iter().fold(0u64, |sum, v| {
                sum.saturating_add(v.unsigned_abs().saturating_mul(v.unsigned_abs()))
            });
            let length = sqrt_floor(square);
            let along = |row: [i32; 3]| {
                let sum = row.iter().zip(g).fold(0i64, |sum, (a, b)| {
                    sum.saturating_add(i64::from(*a).saturating_mul(b))
                });
                ratio(sum, length)
            };
            (length, [along(x), along(y), along([yaw, 0, 0])])
        }
        Shape::Cylinder { radius, yaw } => {
            let along = |normal: i16| i32::from(normal).wrapping_mul(radius) >> NORMAL_BITS;
            let turned = if facet.yaw < 0 {
                yaw.wrapping_neg()
            } else {
                yaw
            };
            let reach = (i64::from(radius) << NORMAL_BITS).wrapping_add(tilted(turned));
            (reach, [along(facet.x), along(facet.y), turned])
        }
    };
    let [x, y, yaw] = offset;
    (
        spare.wrapping_sub(reach),
        [set.micrometres(x), set.micrometres(y), set.q24(yaw)],
    )
}
