//! Tests an estimate against the cells of a table, or against several pieces of facets together: a spot check.
//!
//! The estimate and the outermost poses of the set in 26 directions (24 for a cylinder) must lie in covered
//! cells, or each in some piece. This confirms what the first evaluation has proven; it proves nothing itself. A pose
//! is moved towards the estimate by more than its own rounding, so it belongs to the set. The first
//! evaluation has checked it with a slack of 6 um and 2^-24 turn.
//!
//! Each variable of the covariance is scaled by a power of two, so that its diagonal lies in
//! `[2^28, 2^30)`. The directions are those of the scaled variables and do not depend on units.

use super::believed::{Cylinder, Ellipsoid, Question};
use super::bits::{Short, quotient, root, word16, word32};
use super::planes::Place;
use crate::num;
use crate::set::Uncertainty;
use crate::table::parts;

/// Lengths are in 2^-3 um, at most 2^31 of them.
pub(super) const FINER: i32 = 3;
const LONGEST: u64 = 1 << 31;
/// 10^12 2^6 and 10^6 2^3, with their top bits at bit 30.
const SQUARE_MICRO: (i32, i32) = (0x746a_5288, 15);
/// (2^32 / (2 pi))^2 and 2^32 / (2 pi) 10^6 2^3, with their top bits at bit 30, rounded down.
const SQUARE_TURN: (i32, i32) = (1_740_684_680, 28);
const MICRO_TURN: (i32, i32) = (1_303_797_293, 22);
/// Half a turn.
const ONE_TURN: u64 = 1 << 32;
/// Upper bound of the effect of rounding the scaled covariance on the level of an outermost pose. Its
/// entries are off by less than 2.5 each, and its least eigenvalue is above 12 (the first evaluation
/// accepts no other).
const ROUNDING: i64 = 96;
/// Half of the square root of 2, unit 2^-16, rounded down.
const DIAGONAL: i64 = 46_340;

/// One of each pair of opposite directions.
static DIRECTIONS: [[i8; 3]; 13] = [
    [1, 0, 0],
    [0, 1, 0],
    [0, 0, 1],
    [1, 1, 0],
    [1, -1, 0],
    [1, 0, 1],
    [1, 0, -1],
    [0, 1, 1],
    [0, 1, -1],
    [1, 1, 1],
    [1, 1, -1],
    [1, -1, 1],
    [1, -1, -1],
];

/// The cells and the set's estimate among them.
pub(super) struct Cells<'a> {
    table: &'a [u8],
    grid: &'a [u8],
    /// The estimate relative to the goal in world axes, and its heading above the lower end of the yaw
    /// range.
    at: [i64; 2],
    yaw: u32,
}

/// Returns `true` if every checked pose lies in a covered cell.
#[inline(never)]
pub(super) fn hold(table: &[u8], grid: &[u8], question: &Question<'_>) -> Option<bool> {
    let cells = Cells {
        table,
        grid,
        at: question.above(table, FINER)?,
        yaw: question
            .heading()?
            .wrapping_sub(word32(table, 24)?)
            .wrapping_sub(word32(table, 52)?),
    };
    outermost_hold(question, &Among::Cells(cells))
}

/// Where poses are looked up. No call goes through a pointer, so the deepest stack is known.
pub(super) enum Among<'a> {
    Cells(Cells<'a>),
    Pieces(Place<'a>),
}

impl Among<'_> {
    /// Returns `true` if a pose of the set is covered: its offset from the estimate, 2^-3 um, 2^-3 um, 2^-32 turn.
    #[inline(never)]
    fn has(&self, offset: [i64; 3]) -> Option<bool> {
        match self {
            Self::Cells(cells) if parts::CELLS => cells.covers(offset),
            Self::Pieces(place) if parts::UNIONS => place.is_in_a_piece(offset),
            _ => None,
        }
    }
}

/// Returns `true` if the estimate and every outermost pose of the set is covered.
#[inline(never)]
pub(super) fn outermost_hold(question: &Question<'_>, among: &Among<'_>) -> Option<bool> {
    if !among.has([0; 3])? {
        return Some(false);
    }
    match question.belief.spread.as_ref()? {
        Uncertainty::Gaussian(covariance) => {
            let scaled = Scaled::of(&question.ellipsoid(covariance)?)?;
            of_ellipsoid(&scaled, question, among)
        }
        Uncertainty::Bounded {
            translation_m,
            yaw_rad,
        } => of_cylinder(&question.cylinder(*translation_m, *yaw_rad)?, among),
    }
}

#[inline(never)]
fn of_ellipsoid(scaled: &Scaled, question: &Question<'_>, among: &Among<'_>) -> Option<bool> {
    for direction in &DIRECTIONS {
        let Some(offset) = scaled.outermost(direction.map(i64::from)) else {
            continue;
        };
        let offset = moved(question, offset);
        if !(among.has(offset)? && among.has(offset.map(i64::wrapping_neg))?) {
            return Some(false);
        }
    }
    Some(true)
}

/// Returns an offset from the estimate after a movement that leads farther the same way.
fn moved(question: &Question<'_>, [x, y, turn]: [i64; 3]) -> [i64; 3] {
    if question.moved_um == 0 && question.swing == 0 {
        return [x, y, turn];
    }
    // Below 2^40 in magnitude: halved until squares fit.
    let (small_x, small_y) = (x >> 10, y >> 10);
    let square = small_x
        .wrapping_mul(small_x)
        .wrapping_add(small_y.wrapping_mul(small_y));
    let length = root(square.unsigned_abs()).wrapping_add(2);
    // What is left of it in every direction.
    let by = drawn_in(i64::from(question.side_um) << FINER);
    let along = |v: i64| quotient(v.wrapping_mul(by), length);
    let swing = drawn_in(question.swing).wrapping_mul(turn.signum());
    [
        x.wrapping_add(along(small_x)),
        y.wrapping_add(along(small_y)),
        turn.wrapping_add(swing),
    ]
}

#[inline(never)]
fn of_cylinder(cylinder: &Cylinder, among: &Among<'_>) -> Option<bool> {
    let radius = drawn_in((cylinder.radius_q8 >> 5) as i64);
    let diagonal = radius.wrapping_mul(DIAGONAL) >> 16;
    let yaw = drawn_in(cylinder.yaw);
    let around = [
        [radius, 0],
        [0, radius],
        [diagonal, diagonal],
        [diagonal, diagonal.wrapping_neg()],
    ];
    for turn in [yaw.wrapping_neg(), 0, yaw] {
        for [x, y] in around {
            let opposite = [x.wrapping_neg(), y.wrapping_neg(), turn];
            if !(among.has([x, y, turn])? && among.has(opposite)?) {
                return Some(false);
            }
        }
    }
    Some(true)
}

impl Cells<'_> {
    /// Returns `true` if the pose at an offset from the estimate (world axes) lies in a covered cell.
    #[inline(never)]
    fn covers(&self, [dx, dy, turn]: [i64; 3]) -> Option<bool> {
        let [x, y] = self.at;
        let (x, y) = (x.saturating_add(dx), y.saturating_add(dy));
        if x.unsigned_abs().max(y.unsigned_abs()) > LONGEST {
            return Some(false);
        }
        let cosine = i64::from(word32(self.table, 28)? as i32);
        let sine = i64::from(word32(self.table, 32)? as i32);
        let ahead = cosine.wrapping_mul(x).wrapping_add(sine.wrapping_mul(y)) >> 30;
        let aside = cosine.wrapping_mul(y).wrapping_sub(sine.wrapping_mul(x)) >> 30;
        let step = u64::from(word32(self.table, 44)?) << FINER;
        let cell = |at: i64, low: usize, count: usize| {
            let low = i64::from(word32(self.table, low)? as i32) << FINER;
            let number = num::quotient(u64::try_from(at.wrapping_sub(low)).ok()?, step)?;
            let number = u16::try_from(number).ok()?;
            (number < word16(self.table, count)?).then_some(number)
        };
        let (Some(column), Some(row)) = (cell(ahead, 36, 48), cell(aside, 40, 50)) else {
            return Some(false);
        };
        let (span, slabs) = (word32(self.table, 56)?, u64::from(word16(self.table, 60)?));
        let yaw = u64::from(self.yaw.wrapping_add(turn as u32));
        let span = if span == 0 { 1 << 32 } else { u64::from(span) };
        if yaw > span {
            return Some(false);
        }
        // Slab k begins at floor(k span / slabs).
        let scaled = yaw.wrapping_add(1).wrapping_mul(slabs).wrapping_sub(1);
        let slab = num::quotient(scaled, span)?.min(slabs.wrapping_sub(1));
        self.is_covered(usize::try_from(slab).ok()?, row, column)
    }

    /// Returns `true` if a run of a row of a slab contains a column.
    #[inline(never)]
    fn is_covered(&self, slab: usize, row: u16, column: u16) -> Option<bool> {
        let entry = slab.wrapping_mul(8).wrapping_add(4);
        let offset = usize::try_from(word32(self.grid, entry)?).ok()?;
        let first = word16(self.grid, entry.wrapping_add(4))?;
        let count = word16(self.grid, entry.wrapping_add(6))?;
        let rows = count & 0x7fff;
        let Some(row) = row.checked_sub(first).filter(|row| *row < rows) else {
            return Some(false);
        };
        let (row, rows) = (usize::from(row), usize::from(rows));
        let (_, rest) = self.grid.split_at_checked(offset)?;
        let (from, to, runs) = if count == rows as u16 {
            (row, row.wrapping_add(1), rest)
        } else {
            let starts = rows.wrapping_add(1).wrapping_mul(2);
            let at = |row: usize| Some(usize::from(word16(rest, row.wrapping_mul(2))?));
            let (_, runs) = rest.split_at_checked(starts)?;
            (at(row)?, at(row.wrapping_add(1))?, runs)
        };
        let is_wide = self.grid.first().copied()? == 2;
        for run in from..to {
            let (left, right) = if is_wide {
                let at = run.wrapping_mul(4);
                (word16(runs, at)?, word16(runs, at.wrapping_add(2))?)
            } else {
                let both = word16(runs, run.wrapping_mul(2))?;
                (both & 0xff, both >> 8)
            };
            if left <= column && column <= right {
                return Some(true);
            }
        }
        Some(false)
    }
}

/// A covariance times the squared radius, with each variable scaled by a power of two: x, y in 2^-3 um, yaw
/// in 2^-32 turn.
struct Scaled {
    /// By rows.
    covariance: [[i64; 3]; 3],
    powers: [i32; 3],
}

impl Scaled {
    #[inline(never)]
    fn of(ellipsoid: &Ellipsoid) -> Option<Self> {
        let (plane, between, turning) = (
            ellipsoid.plane.times(SQUARE_MICRO),
            ellipsoid.plane.times(MICRO_TURN),
            ellipsoid.yaw.times(SQUARE_TURN),
        );
        let [xx, xy, yy, xt, yt, tt] = ellipsoid.covariance;
        let (xx, xy, yy) = (xx.times(plane), xy.times(plane), yy.times(plane));
        let (xt, yt, tt) = (xt.times(between), yt.times(between), tt.times(turning));
        let power = |variance: Short| 30i32.wrapping_sub(variance.top()) >> 1;
        let (px, py, pt) = (power(xx), power(yy), power(tt));
        let at = |number: Short, p: i32, q: i32| {
            let value = number.at(p.wrapping_add(q))?;
            (value.unsigned_abs() <= 1 << 30).then_some(i64::from(value))
        };
        let (xy, xt, yt) = (at(xy, px, py)?, at(xt, px, pt)?, at(yt, py, pt)?);
        Some(Self {
            covariance: [
                [at(xx, px, px)?, xy, xt],
                [xy, at(yy, py, py)?, yt],
                [xt, yt, at(tt, pt, pt)?],
            ],
            powers: [px, py, pt],
        })
    }

    /// Returns the offset of the pose of the set that is farthest along a direction of the scaled
    /// variables. `None` if it is at least a turn away: the first evaluation denies such a set.
    #[inline(never)]
    fn outermost(&self, direction: [i64; 3]) -> Option<[i64; 3]> {
        let along = self.covariance.map(|row| dot(row, direction));
        // Below 2^33.2, its root times 2^14 below 2^31.
        let square = dot(along, direction).max(0).wrapping_add(ROUNDING);
        let length = root(square.unsigned_abs().wrapping_shl(28));
        let mut offset = [0i64; 3];
        for ((offset, along), power) in offset.iter_mut().zip(along).zip(self.powers) {
            // Below 2^32 * 2^28; the quotient is times 2^14.
            let scaled = drawn_in(quotient(along.wrapping_mul(1 << 28), length));
            *offset = unscaled(scaled, power.wrapping_add(14));
        }
        let [.., turn] = offset;
        (turn.unsigned_abs() < ONE_TURN).then_some(offset)
    }
}

/// Returns `value / 2^power`, rounded towards zero, limited to a value above [`LONGEST`].
fn unscaled(value: i64, power: i32) -> i64 {
    let magnitude = value.unsigned_abs();
    let by = power.unsigned_abs();
    let magnitude = if power >= 0 {
        magnitude.checked_shr(by).unwrap_or(0)
    } else if magnitude == 0 {
        0
    } else if by < magnitude.leading_zeros() {
        magnitude.wrapping_shl(by)
    } else {
        u64::MAX
    };
    let magnitude = magnitude.min(1 << 40) as i64;
    if value < 0 {
        magnitude.wrapping_neg()
    } else {
        magnitude
    }
}

/// Returns a length or a turn less 2^-16 of it.
fn drawn_in(value: i64) -> i64 {
    let less = value.unsigned_abs() >> 16;
    if value < 0 {
        value.wrapping_add(less as i64)
    } else {
        value.wrapping_sub(less as i64)
    }
}

fn dot([a, b, c]: [i64; 3], [x, y, z]: [i64; 3]) -> i64 {
    a.wrapping_mul(x)
        .wrapping_add(b.wrapping_mul(y))
        .wrapping_add(c.wrapping_mul(z))
}
