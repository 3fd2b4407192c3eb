//! A facet at single headings of the set, for sets whose heading is uncertain: exact sections at seventeen headings.
//!
//! Given the yaw, a point's position has the mean `m + C_pt t / C_tt` and the covariance
//! `C_pp - C_pt C_tp / C_tt`, and the set's section there is that ellipse times `1 - t^2 / C_tt`. A set that is
//! inside a facet has all its sections inside, so this denies nothing that the first evaluation permits. Between the
//! headings nothing is checked: a spot check, like that of cells.
//!
//! Tolerances in addition to those of [`super`]: 2^-11 of the extent, for quotients and a normal that is
//! turned and rounded; 18 of the units in which the longest extent, or L times the turn, has at least 2^13; and,
//! of the effect of the yaw, the share of the roundings in `C_tt`.

use super::bits::{quotient, root, wide};
use super::planes::{Body, Facet, ROUNDED_AND_TURNED, both, dot};
use super::turn::cosine_and_sine;
use crate::num;

/// Headings on either side of the estimate's.
const SIDE: i32 = 8;
/// Below this variance of the yaw, times L squared, the set is thinner in yaw than 2^-10 of its extent, and roundings exceed
/// it. Then the whole ellipsoid is compared at the estimate's heading, with the largest effect of a turn as a tolerance.
const THIN: i32 = 1 << 6;
/// Most by which roundings of C can lower the variance of the yaw, and a little more.
const LOST: u64 = 16;

impl Body {
    /// Returns `true` if the sections of the set at seventeen headings are within a facet.
    #[inline(never)]
    pub(super) fn sections_hold(&self, facet: &Facet, axes: u8, point: [i32; 2]) -> bool {
        let [.., tt] = self.world;
        // Below 2^32: in a set that turns farther, headings repeat. The root of C_tt has 15 more bits.
        let yaw =
            [self.reach, u64::from(tt.unsigned_abs()) << 30].map(|square| root(square) as i64);
        let section = |e: i32, swing: i64, seeks: bool| {
            self.section_holds(facet, axes, point, yaw, [e, swing as i32], seeks)
        };
        if !self.is_cylinder && tt >= THIN {
            // Twice to where the section before reaches farthest: to first order the touching point.
            let mut e = 0;
            for seeks in [true, true, false] {
                match section(e, 0, seeks) {
                    None => return false,
                    Some(next) => e = next,
                }
            }
        }
        let holds = |k: i32, swing: i64| section(k << 12, swing, false).is_some();
        // A turn of 2^31 or more: the low bits are the heading.
        (SIDE.wrapping_neg()..=SIDE).all(|k| {
            holds(k, 0)
                && (self.swing == 0 || holds(k, self.swing) && holds(k, self.swing.wrapping_neg()))
        })
    }

    /// Checks the section at the share e, unit 2^-15, of the yaw's extent: `None` if it is beyond the facet, else the share at which the
    /// set would reach farthest if the point moved as it does here, if that is sought. The robot has turned by `swing`, 2^-32 turn, after that.
    fn section_holds(
        &self,
        [x0, x1, y0, y1, b0, b1]: &Facet,
        axes: u8,
        [vx, vy]: [i32; 2],
        [turn, deviation]: [i64; 2],
        [e, swing]: [i32; 2],
        seeks: bool,
    ) -> Option<i32> {
        let ahead = (turn.wrapping_mul(i64::from(e)) >> 15) as u32;
        let ahead = ahead.wrapping_add(swing as u32);
        let number = |low: &u8, high: &u8| i32::from(i16::from_le_bytes([*low, *high]));
        let normal = [number(x0, x1), number(y0, y1)];
        let [nx, ny] = normal;
        let [x, y] = self.at;
        let [c, s] = cosine_and_sine(self.heading.wrapping_add(ahead));
        let back = s.wrapping_neg();
        let (vx, vy) = (vx << 14, vy << 14);
        // The point, and the normal in world axes.
        let (at, turned) = if axes == 0 {
            let ax = both(c, vx, back, vy);
            let ay = both(s, vx, c, vy);
            ([x.wrapping_add(ax), y.wrapping_add(ay)], normal)
        } else {
            let (dx, dy) = (x.wrapping_sub(vx), y.wrapping_sub(vy));
            (
                [both(c, dx, s, dy), both(c, dy, back, dx)],
                [both(c, nx, back, ny), both(s, nx, c, ny)],
            )
        };
        let [px, py] = at;
        let lever = if axes == 0 {
            [px.wrapping_sub(x), py.wrapping_sub(y)]
        } else {
            at
        };
        let [lx, ly] = lever.map(i32::unsigned_abs);
        let length = i64::from(lx.max(ly).wrapping_add(lx.min(ly) >> 1));
        let spare = (i64::from(number(b0, b1)) << 28)
            .wrapping_add(self.clearance)
            .wrapping_add(length.wrapping_sub(length >> 4))
            .wrapping_add(ROUNDED_AND_TURNED)
            .wrapping_sub(dot(normal, at));
        let spare = if self.moved == 0 {
            spare
        } else {
            spare.wrapping_sub(self.moved_along(turned))
        };
        let size = |value: i64| self.scaled(value).map_or(1 << 30, i64::from);
        let spare = if spare < 0 {
            size(spare.wrapping_neg()).wrapping_neg()
        } else {
            size(spare)
        };
        let [nx, ny] = turned;
        let [xx, xy, yy, xt, yt, tt] = self.world;
        let square = wide(nx.wrapping_mul(nx), xx)
            .wrapping_add(wide(nx.wrapping_mul(ny).wrapping_mul(2), xy))
            .wrapping_add(wide(ny.wrapping_mul(ny), yy))
            .max(0);
        let reach = root(square.unsigned_abs());
        let mut allowed = reach >> 11;
        let (mut shift, mut across, mut next) = (0, square, e);
        if !self.is_cylinder && tt < THIN {
            if e != 0 {
                return Some(e);
            }
            // Twice the lever; in robot axes the normal turns, too: at most the extent times the turn, 2 pi / 2^32 below 2^-29.
            let lever = self.scaled(length << 15).map_or(1 << 30, u64::from);
            allowed = allowed.wrapping_add(lever);
            if axes != 0 {
                let turn = turn.unsigned_abs();
                allowed = allowed.wrapping_add(reach.wrapping_mul(turn) >> 29);
            }
        } else if !self.is_cylinder {
            // n . C_pt / sqrt(C_tt).
            let sum = wide(nx, xt).wrapping_add(wide(ny, yt));
            let along = quotient(sum.wrapping_mul(1 << 15), deviation.unsigned_abs());
            let relative = along.unsigned_abs().wrapping_mul(LOST);
            let tt = u64::from(tt.unsigned_abs());
            allowed = allowed.wrapping_add(num::quotient(relative, tt).unwrap_or(0));
            shift = along.wrapping_mul(i64::from(e)) >> 15;
            let rest = square.wrapping_sub(along.wrapping_mul(along)).max(0);
            let open = (1i64 << 30).wrapping_sub(i64::from(e).wrapping_mul(i64::from(e)));
            across = (rest >> 30).wrapping_mul(open.max(0));
            if seeks {
                // The lever counts as well: the movement of the point over the yaw's extent.
                let both = along.wrapping_add(self.moved(normal, lever, axes, turn));
                let squares = rest
                    .unsigned_abs()
                    .saturating_add(both.unsigned_abs().saturating_mul(both.unsigned_abs()));
                let length = root(squares).max(1);
                let farthest = quotient(both.wrapping_mul(1 << 15), length) as i32;
                next = farthest.clamp(-(1 << 15), 1 << 15);
            }
        }
        let left = spare.wrapping_sub(shift);
        let left = left.wrapping_add(allowed as i64).wrapping_add(16);
        let holds = left >= 0
            && left.unsigned_abs().saturating_mul(left.unsigned_abs()) >= across.unsigned_abs();
        holds.then_some(next)
    }

    /// Returns the movement of the point along the normal over the yaw's extent, in the units of a scaled length.
    fn moved(&self, normal: [i32; 2], [lx, ly]: [i32; 2], axes: u8, turn: i64) -> i64 {
        let ahead = if axes == 0 {
            [ly.wrapping_neg(), lx]
        } else {
            [ly, lx.wrapping_neg()]
        };
        let along = dot(normal, ahead);
        // The extent in 2^-31 rad.
        let turn = turn.min(1 << 31).wrapping_mul(1_686_629_713) >> 30;
        let length = (along >> 14).wrapping_mul(turn >> 17);
        let size = self
            .scaled(length.saturating_abs())
            .map_or(1 << 30, i64::from);
        if length < 0 {
            size.wrapping_neg()
        } else {
            size
        }
    }
}
