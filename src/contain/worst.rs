//! The worst pose of a denied set, for reports: a pose of the set that the table does not cover.

use super::{GoalFramePoseSet, Margin, union};
use crate::num::{BinaryAngle, sqrt_ceil};
use crate::parts;
use crate::pose::Pose;
use crate::set::Extent;
use crate::table::Table;

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

/// One, in the unit of a direction.
const ONE: i64 = 1 << 12;

impl GoalFramePoseSet<'_> {
    /// Returns the pose that leaves the table first as the set grows, where `high` is a scale at which the set is no longer covered.
    ///
    /// With several pieces, a proof ends at that scale, and the pose found there may be covered. So it is compared with the poses
    /// at larger scales and with the result of a search among the outermost poses. Returns the pose that is farthest out of all
    /// pieces.
    pub(super) fn worst_pose(&self, table: &Table<'_>, high: Margin) -> Pose {
        let first = self.witness_pose(table, high);
        let pieces = table
            .facets()
            .filter(|layout| parts::UNIONS && layout.pieces().nth(1).is_some());
        let Some(layout) = pieces.filter(|_| table.grid().is_none()) else {
            return first;
        };
        let goal = table.goal().pose;
        let depth = |pose: Pose| union::depth(layout, pose, goal);
        let middle = Margin(
            high.0
                .wrapping_add(Margin::ONE.0.saturating_sub(high.0) >> 1),
        );
        let others = [
            self.witness_pose(table, middle),
            self.witness_pose(table, Margin::ONE),
            self.set.nearest_of(self.farthest_out(depth)),
        ];
        others.into_iter().fold(first, |best, pose| {
            if depth(pose) < depth(best) {
                pose
            } else {
                best
            }
        })
    }

    fn witness_pose(&self, table: &Table<'_>, scale: Margin) -> Pose {
        let offset = self.witness(table, scale);
        let pose = table.goal().pose_to_world(offset.applied_to(self.mean));
        self.set.nearest_of(pose)
    }

    /// Searches the outermost pose of least depth: from each of 26 directions by smaller and smaller steps.
    fn farthest_out(&self, depth: impl Fn(Pose) -> i64) -> Pose {
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
    fn climbed(&self, start: [i64; 3], depth: &impl Fn(Pose) -> i64) -> (i64, [i64; 3]) {
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

    /// Returns the pose of the set farthest in a direction of its own axes, unit 2^-12.
    fn outermost(&self, direction: [i64; 3]) -> Pose {
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
        let mean = self.set.mean();
        let length = |at: i32, by: i64| i64::from(at).saturating_add(by) as i32;
        Pose {
            x_um: length(mean.x_um, x),
            y_um: length(mean.y_um, y),
            yaw: mean.yaw.plus(BinaryAngle((turn << 8) as u32)),
        }
    }
}

/// Returns a direction of length one; entries are below 2^15.
fn normal(direction: [i64; 3]) -> [i64; 3] {
    let squares = direction.iter().fold(0u64, |sum, v| {
        sum.wrapping_add(v.unsigned_abs().wrapping_mul(v.unsigned_abs()))
    });
    let length = sqrt_ceil(squares).max(1);
    direction.map(|v| v.wrapping_mul(ONE).checked_div(length).unwrap_or(0))
}
