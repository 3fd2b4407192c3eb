//! Numbers from the bytes of an input, with zeros past its end.

use posegate::set::{Estimate, Growth, PoseSet, RadiusSquared};
use posegate::table::Table;
use std::f64::consts::TAU;

/// The bytes of an input that have not been read.
pub struct Input<'a>(pub &'a [u8]);

impl Input<'_> {
    pub fn take<const N: usize>(&mut self) -> [u8; N] {
        let mut taken = [0; N];
        let count = N.min(self.0.len());
        let (head, rest) = self.0.split_at(count);
        taken[..count].copy_from_slice(head);
        self.0 = rest;
        taken
    }

    pub fn byte(&mut self) -> u8 {
        let [byte] = self.take();
        byte
    }

    pub fn float(&mut self) -> f64 {
        f64::from_le_bytes(self.take())
    }

    /// Returns a number in `[0, 1)`.
    fn share(&mut self) -> f64 {
        f64::from(u16::from_le_bytes(self.take())) / 65_536.0
    }

    /// Returns a number from 1 down to 2^-16, by equal factors.
    fn scale(&mut self) -> f64 {
        (-16.0 * self.share()).exp2()
    }

    /// Returns a set up to about the size of a table, at a pose on the table or near it. Takes
    /// [`SET_LENGTH`] bytes.
    pub fn set_near(&mut self, table: &Table<'_>) -> Option<PoseSet> {
        let (goal, cells) = (table.goal(), table.cells());
        let [kind, radius] = self.take();
        let um = 1e-6;
        let [width, height] = [cells.columns, cells.rows]
            .map(|count| f64::from(cells.step_um) * um * f64::from(count));
        let turn = cells.yaw_span as f64 / 4_294_967_296.0 * TAU;
        let mut at = |lo: f64, width: f64| lo + width * (1.2 * self.share() - 0.1);
        let (x, y) = (
            at(f64::from(cells.x_lo_um) * um, width),
            at(f64::from(cells.y_lo_um) * um, height),
        );
        let yaw = at(
            f64::from(cells.yaw_lo.signed()) / 4_294_967_296.0 * TAU,
            turn,
        );
        let one = f64::from(1 << 30);
        let (c, s) = (f64::from(goal.cos_q30) / one, f64::from(goal.sin_q30) / one);
        let estimate = Estimate {
            x_m: f64::from(goal.pose.x_um) * um + c * x - s * y,
            y_m: f64::from(goal.pose.y_um) * um + s * x + c * y,
            yaw_rad: f64::from(goal.pose.yaw.signed()) / 4_294_967_296.0 * TAU + yaw,
        };
        let [a, b, t] = [width, height, turn].map(|width| width * self.scale());
        let [ab, at, bt] = [0; 3].map(|_| 2.0 * self.share() - 1.0);
        let set = if kind & 1 == 0 {
            // Only about half have correlations, so that not most of them are invalid.
            let [ab, at, bt] = [ab * a * b, at * a * t, bt * b * t].map(|covariance| {
                if kind & 2 == 0 {
                    covariance
                } else {
                    covariance * 0.4
                }
            });
            let covariance = [[a * a, ab, at], [ab, b * b, bt], [at, bt, t * t]];
            let radius_squared = match radius {
                0 => RadiusSquared::LARGEST,
                1 => RadiusSquared::from_q16(1 << 16)?,
                _ => table.radius_squared(),
            };
            PoseSet::gaussian(estimate, covariance, radius_squared).ok()?
        } else {
            PoseSet::bounded(estimate, a, t).ok()?
        };
        // Half of the sets have moved, by up to about their size.
        let [length, angle] = [kind >> 3 & 3, kind >> 5 & 3].map(|part| f64::from(part) / 2.0);
        if kind & 4 == 0 {
            Some(set)
        } else {
            Growth::of(a * length, t * angle).map(|by| set.grown(by))
        }
    }
}

/// Bytes of a set that is near a table.
pub const SET_LENGTH: usize = 20;
