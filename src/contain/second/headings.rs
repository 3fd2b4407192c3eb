//! A facet at single headings of the set, for sets whose heading is uncertain: exact sections at seventeen headings.
//!
//! Given the yaw, a point's position has the mean `m + C_pt t / C_tt` and the covariance
//! `C_pp - C_pt C_tp / C_tt`, and the set's section there is that ellipse times `1 - t^2 / C_tt`. A set that is
//! inside a facet has all its sections inside, so this denies nothing that the first evaluation permits. Between the
//! headings it is silent: a spot check, like that of cells.
//!
//! What it allows, beyond the tolerances of [`super`]: 2^-11 of the extent, for the root of `C_tt`, quotients and a normal that is
//! turned and rounded.

use super::bits::quotient;
use super::planes::{Body, Facet, OWN, ROUNDED_AND_TURNED, both, dot, wide};
use super::turn::cosine_and_sine;

/// Headings on either side of the estimate's.
const SIDE: i32 = 8;
/// A variance of the yaw below this, times L squared, moves no point by more than 2^-8 of the set's extent.
const HARDLY: i32 = 1 << 12;

impl Body {
    /// Returns `true` if the sections of the set at seventeen headings are within a facet.
    #[inline(never)]
    pub(super) fn sections_hold(&self, facet: &Facet, axes: u8, point: [i32; 2]) -> bool {
        // Half a turn to each side is every heading.
        let turn = self.reach.isqrt().min(1 << 31) as i64;
        (SIDE.wrapping_neg()..=SIDE).all(|k| {
            let ahead = turn.wrapping_mul(i64::from(k)) >> 3;
            self.section_holds(facet, axes, point, ahead as u32, k)
        })
    }

    /// The same at one heading, where the yaw is k eighths of its extent.
    fn section_holds(
        &self,
        [x0, x1, y0, y1, b0, b1]: &Facet,
        axes: u8,
        [vx, vy]: [i32; 2],
        ahead: u32,
        k: i32,
    ) -> bool {
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
        let lever = i64::from(vx.saturating_abs()).wrapping_add(i64::from(vy.saturating_abs()));
        let lever = if axes == 0 {
            lever
        } else {
            let [x, y] = at;
            i64::from(x.saturating_abs()).wrapping_add(i64::from(y.saturating_abs()))
        };
        let spare = (i64::from(number(b0, b1)) << 28)
            .wrapping_add(self.clearance)
            .wrapping_add(lever)
            .wrapping_add(ROUNDED_AND_TURNED)
            .wrapping_add(OWN)
            .wrapping_sub(dot(normal, at));
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
        let (shift, across, open) = if self.is_cylinder {
            (0, square, 64)
        } else if tt < HARDLY {
            return true;
        } else {
            // n . C_pt / sqrt(C_tt), with 15 more bits of the root.
            let root = (u64::from(tt.unsigned_abs()) << 30).isqrt();
            let sum = wide(nx, xt).wrapping_add(wide(ny, yt));
            let along = quotient(sum.wrapping_mul(1 << 15), root);
            let shift = along.wrapping_mul(i64::from(k)) >> 3;
            let rest = square.wrapping_sub(along.wrapping_mul(along)).max(0);
            (
                shift,
                rest,
                64i64.wrapping_sub(i64::from(k).wrapping_mul(i64::from(k))),
            )
        };
        let left = spare.wrapping_sub(shift);
        // 2^-11 of the set's extent along the normal.
        let allowed = (square.unsigned_abs().isqrt() >> 11) as i64;
        let left = left.wrapping_add(allowed).wrapping_add(16);
        // Below 2^31; 16 times the square of it below 2^66: quarters.
        left >= 0 && {
            let left = left >> 1;
            left.wrapping_mul(left).wrapping_mul(4) >= (across >> 6).wrapping_mul(open)
        }
    }
}
