//! The factor of a Gaussian pose-set.

use crate::pose::GoalFrame;

/// A factor F of the pose-set `{ mean + F u : |u| <= 1 }`, with rows yaw, x and y.
///
/// The yaw row has one entry: `F = [[yaw, 0, 0], x, y]`, so a cut at a heading is a cut in the first
/// coordinate of u. The radius is part of F. The extent along a direction `a` of the plane is
/// `|a_x x + a_y y|`, one dot product and no matrix.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct SqrtFactor {
    /// Largest yaw offset, unit 2^-24 turn, above zero and below 2^29.
    pub(crate) yaw: i32,
    /// Row of x, micrometres, each below 2^28 in magnitude.
    pub(crate) x: [i32; 3],
    /// Row of y, micrometres, each below 2^28 in magnitude.
    pub(crate) y: [i32; 3],
}

impl SqrtFactor {
    /// Returns the yaw row: the largest yaw offset, unit 2^-24 turn.
    #[must_use]
    pub const fn yaw_q24(&self) -> i32 {
        self.yaw
    }

    /// Returns the x row, micrometres.
    #[must_use]
    pub const fn x_um(&self) -> [i32; 3] {
        self.x
    }

    /// Returns the y row, micrometres.
    #[must_use]
    pub const fn y_um(&self) -> [i32; 3] {
        self.y
    }

    /// Returns the factor in the goal frame. Each length is within 1 um of the exact one.
    #[must_use]
    pub(crate) fn to_goal(self, goal: &GoalFrame) -> Self {
        let [x1, x2, x3] = self.x;
        let [y1, y2, y3] = self.y;
        let (gx1, gy1) = goal.turn_to_goal(x1, y1);
        let (gx2, gy2) = goal.turn_to_goal(x2, y2);
        let (gx3, gy3) = goal.turn_to_goal(x3, y3);
        Self {
            yaw: self.yaw,
            x: [gx1, gx2, gx3],
            y: [gy1, gy2, gy3],
        }
    }

    /// Returns the factor times `scale_q16 / 65536`: each length within 0.5 of the exact one, the yaw
    /// rounded up (the test of an arc of headings has no allowance for it). `None` if a length reaches
    /// 2^29 or the yaw 2^30.
    #[must_use]
    pub(crate) fn scaled(&self, scale_q16: u32) -> Option<Self> {
        let entry = |value: i32, limit: i64, round: i64| {
            let product = i64::from(value).checked_mul(i64::from(scale_q16))?;
            let value = product.wrapping_add(round) >> 16;
            (value.unsigned_abs() < limit.unsigned_abs())
                .then_some(value)
                .and_then(|v| i32::try_from(v).ok())
        };
        let row = |[a, b, c]: [i32; 3]| {
            let length = |v| entry(v, 1 << 29, 1 << 15);
            Some([length(a)?, length(b)?, length(c)?])
        };
        Some(Self {
            // A yaw of zero would be a zero divisor: one unit is outwards.
            yaw: entry(self.yaw, 1 << 30, 0xffff)?.max(1),
            x: row(self.x)?,
            y: row(self.y)?,
        })
    }
}
