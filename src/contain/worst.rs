//! The worst pose of a denied set, for reports: a pose of the set that the table does not cover.

use super::{GoalFramePoseSet, Margin, union};
use crate::num::{ANGLE_UNITS_PER_Q24, sqrt_ceil};
use crate::pose::Pose;
use crate::set::{Extent, PoseSet};
use crate::table::Table;
use crate::table::parts;

/// One of each pair of opposite directions in which outermost poses are looked up.
const DIRECTIONS: [[i8; 3]; 13] = [
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

/// Length units between the facets and a pose that is named. (With four, a set 1 % too large often has none.)
const CLEAR_UNITS: i64 = 1;

/// Cells between the covered ones and an uncovered pose that is named.
const CLEAR_CELLS: i64 = 1;

/// One, in the unit of a direction.
const ONE: i64 = 1 << 12;

impl GoalFramePoseSet<'_> {
    /// Returns a pose of the set that the table does not cover, at the border of the set, or `None` if none is found. `high` is a scale at which
    /// the set is no longer covered.
    ///
    /// Candidates are poses where the set leaves first as it grows, where the whole set is farthest out, and its largest headings, since an
    /// interval of headings is a border without a facet. If they are covered, or if several pieces cover the set together, the outermost poses are
    /// searched as well. Of all that are not covered, the one that is farthest out is returned.
    ///
    /// A pose within the table's extent that is beyond the facets by more than a cell is preferred. Nearer to the facets a pose may be in the success
    /// set, since facets do not fill a set with curved borders; and a success set may go on beyond the extent.
    pub(super) fn worst_pose(&self, table: &Table<'_>, high: Margin) -> Option<Pose> {
        let cell = table.facets().map_or(0, |layout| {
            let units = i64::from(table.cells().step_um).wrapping_shr(layout.unit().into());
            units.wrapping_shl(28).wrapping_neg()
        });
        self.worst_of(table, high, Some(cell))
            .or_else(|| self.worst_of(table, high, None))
    }

    /// As [`Self::worst_pose`], of the poses of the extent that are deeper outside than `clear`, or of all poses.
    #[inline(never)]
    fn worst_of(&self, table: &Table<'_>, high: Margin, clear: Option<i64>) -> Option<Pose> {
        let outside = |pose: Pose| {
            let depth = self.depth(table, pose);
            let counts = clear.is_none_or(|clear| depth < clear && is_in_extent(table, pose));
            if counts { depth } else { 0 }
        };
        let mut worst: Option<(i64, Pose)> = None;
        let mut consider = |offset: [i64; 3]| {
            let offset = self.set.farthest_towards(offset);
            let pose = self.set.at_offset(offset);
            let depth = outside(pose);
            let order = (depth < 0)
                .then(|| self.order(table, offset, depth))
                .flatten();
            if let Some(order) = order
                && worst.is_none_or(|(least, _)| order < least)
            {
                worst = Some((order, pose));
            }
            worst.is_some()
        };
        let scale = i64::from(high.0).max(1);
        let outwards = |v: i64| {
            let scaled = v.wrapping_mul(Margin::ONE.0.into()).checked_div(scale);
            scaled.unwrap_or(v)
        };
        consider(self.witness(table, high).map(outwards));
        consider(self.witness(table, Margin::ONE));
        for end in self.ends_of_heading() {
            consider(end);
            consider(end.map(i64::wrapping_neg));
        }
        let has_pieces = table
            .facets()
            .is_some_and(|layout| parts::UNIONS && layout.pieces().nth(1).is_some());
        // The estimate itself last: a set may be too thin for another pose.
        let is_found = consider([0; 3]);
        if table.facets().is_none() {
            // Cells have no depth to climb along.
            for direction in &DIRECTIONS {
                for sign in [1, -1] {
                    let start = normal(direction.map(|v| i64::from(v).wrapping_mul(sign)));
                    consider(self.outermost(start));
                }
            }
        } else if has_pieces || !is_found {
            consider(self.farthest_out(outside));
        }
        worst.map(|(_, pose)| pose)
    }

    /// Returns the order in which uncovered poses at an offset are preferred, the least first: the way beyond the facets, or beyond the cells that
    /// are covered. `None` if that is less than [`CLEAR_UNITS`] or [`CLEAR_CELLS`], since a table does not fill its set.
    fn order(&self, table: &Table<'_>, offset: [i64; 3], depth: i64) -> Option<i64> {
        if table.facets().is_some() {
            return (depth < CLEAR_UNITS.wrapping_neg() << 28).then_some(depth);
        }
        if offset == [0; 3] {
            // The estimate itself is outside.
            return Some(i64::MIN);
        }
        let share = self.leaves_at(offset, |pose| self.depth(table, pose));
        let cells = table.cells();
        let slab = cells.yaw_span.checked_div(cells.slabs.into()).unwrap_or(0) as i64;
        let step = i64::from(cells.step_um);
        let [x, y, yaw] = offset.map(i64::saturating_abs);
        // 256ths of a cell.
        let of = |way: i64, cell: i64| {
            let beyond = way.wrapping_mul(256i64.wrapping_sub(share));
            beyond.checked_div(cell).unwrap_or(0)
        };
        let beyond = of(x, step).max(of(y, step)).max(of(yaw, slab));
        (beyond >= CLEAR_CELLS << 8).then_some(beyond.wrapping_neg())
    }

    /// Returns the largest share of an offset, in 256ths, up to which the way from the estimate is inside; 0 if the estimate is outside.
    fn leaves_at(&self, offset: [i64; 3], outside: impl Fn(Pose) -> i64) -> i64 {
        let at = |share: i64| {
            let offset = offset.map(|v| v.wrapping_mul(share).wrapping_div(256));
            outside(self.set.at_offset(offset))
        };
        let (mut inside, mut out) = (0i64, 256i64);
        while out.wrapping_sub(inside) > 1 {
            let middle = inside.wrapping_add(out) >> 1;
            if at(middle) < 0 {
                out = middle;
            } else {
                inside = middle;
            }
        }
        inside
    }

    /// Returns the depth of a pose in the table: below zero outside, in units of the facets if there are any.
    fn depth(&self, table: &Table<'_>, pose: Pose) -> i64 {
        if let Some(layout) = table.facets() {
            return union::depth(layout, pose, table.goal().pose);
        }
        let point = Extent::Bounded {
            translation_um: 0,
            yaw_q24: 0,
        };
        let is_covered = GoalFramePoseSet::at(table, &PoseSet::of(pose, point), point)
            .is_some_and(|point| point.is_covered(table, Margin(0)));
        if is_covered { 0 } else { -1 }
    }

    /// Returns the offsets of the poses that turn farthest to one side, and of that at half a turn on the way: um, um, 2^-32 turn.
    fn ends_of_heading(&self) -> [[i64; 3]; 2] {
        let (x, y, yaw_q24) = match self.set.extent() {
            Extent::Gaussian(factor) => (factor.x[0], factor.y[0], factor.yaw),
            Extent::Grown { factor, by } => (
                factor.x[0],
                factor.y[0],
                factor.yaw.wrapping_add(by.yaw_q24()),
            ),
            Extent::Bounded { yaw_q24, .. } => (0, 0, yaw_q24),
        };
        let end = [
            x.into(),
            y.into(),
            i64::from(yaw_q24).wrapping_mul(ANGLE_UNITS_PER_Q24),
        ];
        let whole = i64::from(yaw_q24).max(1 << 23);
        let at_half = |v: i64| v.wrapping_mul(1 << 23).checked_div(whole).unwrap_or(v);
        [end, end.map(at_half)]
    }

    /// Returns the offset of the outermost pose of least depth, um, um, 2^-32 turn: searched from each of 26 directions by smaller and smaller
    /// steps.
    fn farthest_out(&self, depth: impl Fn(Pose) -> i64) -> [i64; 3] {
        let depth = |offset: [i64; 3]| depth(self.set.at_offset(offset));
        let mut best = [ONE, 0, 0];
        let mut least = i64::MAX;
        for start in &DIRECTIONS {
            for sign in [ONE, ONE.wrapping_neg()] {
                let start = normal(start.map(|v| i64::from(v).wrapping_mul(sign)));
                let (found, at) = self.climbed(start, &depth);
                if found < least {
                    (least, best) = (found, at);
                }
            }
        }
        self.outermost(best)
    }

    /// Returns the least depth found near a direction, and where.
    fn climbed(&self, start: [i64; 3], depth: &impl Fn([i64; 3]) -> i64) -> (i64, [i64; 3]) {
        let mut best = start;
        let mut least = depth(self.outermost(start));
        let mut step = ONE >> 2;
        while step > ONE >> 7 {
            let mut is_better = false;
            for direction in &DIRECTIONS {
                for sign in [step, step.wrapping_neg()] {
                    let [a, b, c] = best;
                    let [da, db, dc] = direction.map(|v| i64::from(v).wrapping_mul(sign));
                    let moved = [a.wrapping_add(da), b.wrapping_add(db), c.wrapping_add(dc)];
                    let moved = normal(moved);
                    let found = depth(self.outermost(moved));
                    if found < least {
                        (least, best, is_better) = (found, moved, true);
                    }
                }
            }
            if !is_better {
                step >>= 1;
            }
        }
        (least, best)
    }

    /// Returns the offset of the pose of the set farthest in a direction of its own axes, unit 2^-12: um, um, 2^-32 turn.
    fn outermost(&self, direction: [i64; 3]) -> [i64; 3] {
        let (x, y, turn) = match self.set.extent() {
            Extent::Gaussian(factor) | Extent::Grown { factor, .. } => {
                let along = |row: [i32; 3]| {
                    let sum = row.iter().zip(direction).fold(0i64, |sum, (entry, by)| {
                        sum.wrapping_add(i64::from(*entry).wrapping_mul(by))
                    });
                    sum >> 12
                };
                (
                    along(factor.x_um()),
                    along(factor.y_um()),
                    along([factor.yaw_q24(), 0, 0]),
                )
            }
            Extent::Bounded {
                translation_um,
                yaw_q24,
            } => {
                // Of the circle at that angle; of the yaw, twice the share, at most all.
                let [a, b, c] = direction;
                let [a, b, _] = normal([a, b, 0]);
                let turn = c.wrapping_mul(2).clamp(ONE.wrapping_neg(), ONE);
                let of = |extent: i32, by: i64| i64::from(extent).wrapping_mul(by) >> 12;
                (
                    of(translation_um, a),
                    of(translation_um, b),
                    of(yaw_q24, turn),
                )
            }
        };
        let (x, y, turn) = match self.set.extent() {
            Extent::Grown { by, .. } => {
                // The same direction for the movement; its whole turn.
                let [a, b, c] = direction;
                let [a, b, _] = normal([a, b, 0]);
                let of = |along: i64| i64::from(by.translation_um()).wrapping_mul(along) >> 12;
                let swing = i64::from(by.yaw_q24()).wrapping_mul(c.signum());
                (
                    x.wrapping_add(of(a)),
                    y.wrapping_add(of(b)),
                    turn.wrapping_add(swing),
                )
            }
            _ => (x, y, turn),
        };
        [x, y, turn.wrapping_mul(ANGLE_UNITS_PER_Q24)]
    }
}

/// Returns `true` if a pose in the world frame is within a table's extent, by a cell at least.
fn is_in_extent(table: &Table<'_>, pose: Pose) -> bool {
    let cells = table.cells();
    let Some(pose) = table.goal().pose_to_goal(pose) else {
        return false;
    };
    let step = i64::from(cells.step_um);
    let is_in = |at: i32, lo: i32, count: u16| {
        let at = i64::from(at).wrapping_sub(i64::from(lo));
        at >= step && at <= i64::from(count).wrapping_sub(1).wrapping_mul(step)
    };
    let above = u64::from(pose.yaw.minus(cells.yaw_lo).0);
    let slab = cells.yaw_span.checked_div(cells.slabs.into()).unwrap_or(0);
    is_in(pose.x_um, cells.x_lo_um, cells.columns)
        && is_in(pose.y_um, cells.y_lo_um, cells.rows)
        && (cells.yaw_span >= 1 << 32
            || above >= slab && above <= cells.yaw_span.saturating_sub(slab))
}

/// Returns a direction of length one; entries are below 2^15.
fn normal(direction: [i64; 3]) -> [i64; 3] {
    let squares = direction.iter().fold(0u64, |sum, v| {
        sum.wrapping_add(v.unsigned_abs().wrapping_mul(v.unsigned_abs()))
    });
    let length = sqrt_ceil(squares).max(1);
    direction.map(|v| v.wrapping_mul(ONE).checked_div(length).unwrap_or(0))
}
