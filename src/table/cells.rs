//! Where the cells of a table are, and how many there are: also the extent of a table of facets.

use super::LARGEST_REACH_UM;
use crate::num::{BinaryAngle, Divisor, clamped};

/// The cells of a table: their position and number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Cells {
    /// Lower corner in the goal frame, micrometres.
    pub x_lo_um: i32,
    /// Lower corner in the goal frame, micrometres.
    pub y_lo_um: i32,
    /// Edge of a cell along x and y, micrometres, at least 1.
    pub step_um: i32,
    /// Cells along x, at least 1.
    pub columns: u16,
    /// Cells along y, at least 1.
    pub rows: u16,
    /// Lower end of the yaw range in the goal frame.
    pub yaw_lo: BinaryAngle,
    /// Width of the yaw range, 2^-32 turn, at most 2^32 (the whole circle).
    pub yaw_span: u64,
    /// Slabs in yaw, at least 1.
    pub slabs: u16,
}

impl Cells {
    /// Returns edge `k` of the slabs, relative to [`Cells::yaw_lo`], 2^-32 turn, rounded down; `k` is at most
    /// [`Cells::slabs`].
    #[must_use]
    pub fn slab_edge(&self, k: u16) -> i64 {
        // At most 2^32 * 2^16.
        let scaled = self.yaw_span.wrapping_mul(u64::from(k)) as i64;
        Divisor::new(i64::from(self.slabs)).map_or(0, |by| by.floor(scaled))
    }

    /// Returns the last slab that contains the offset `at` above [`Cells::yaw_lo`] (2^-32 turn, within the range).
    #[must_use]
    pub fn slab_of(&self, at: i64) -> u16 {
        // floor(k w / n) <= at if and only if k w < (at + 1) n.
        let scaled = at
            .wrapping_add(1)
            .wrapping_mul(i64::from(self.slabs))
            .wrapping_sub(1);
        let k = Divisor::new(self.yaw_span as i64).map_or(0, |by| by.floor(scaled));
        clamped(k, 0, i64::from(self.slabs).wrapping_sub(1)) as u16
    }

    /// Returns `true` if the yaw range is the whole circle.
    #[must_use]
    pub const fn is_whole_circle(&self) -> bool {
        self.yaw_span == 1 << 32
    }

    /// Returns the upper end along x, micrometres.
    #[must_use]
    pub const fn x_hi_um(&self) -> i32 {
        self.x_lo_um
            .wrapping_add(self.step_um.wrapping_mul(self.columns as i32))
    }

    /// Returns the upper end along y, micrometres.
    #[must_use]
    pub const fn y_hi_um(&self) -> i32 {
        self.y_lo_um
            .wrapping_add(self.step_um.wrapping_mul(self.rows as i32))
    }

    /// Returns `true` if every field and the extent along each axis are in range.
    pub(super) fn are_valid(&self) -> bool {
        let reaches = |lo: i32, count: u16| {
            let hi = i64::from(self.step_um)
                .wrapping_mul(i64::from(count))
                .wrapping_add(i64::from(lo));
            lo >= -LARGEST_REACH_UM && hi <= i64::from(LARGEST_REACH_UM)
        };
        self.step_um >= 1
            && self.columns >= 1
            && self.rows >= 1
            && self.slabs >= 1
            && self.yaw_span >= u64::from(self.slabs)
            && reaches(self.x_lo_um, self.columns)
            && reaches(self.y_lo_um, self.rows)
    }
}
