//! The view of a pose-set for the walk: its extent in a slab, its fit in a row, a pose of it.
//!
//! All offsets are from the estimate, in the goal frame: micrometres, and 2^-24 turn.

use super::support::{SupportPoint, dot, held, reach, squared_length, wide_square};
use crate::num::{ANGLE_UNITS_PER_Q24, BinaryAngle, Divisor, clamped, sqrt_floor};
use crate::pose::Pose;
use crate::set::{Extent, Growth, SqrtFactor, broad_um, scaled_yaw};

/// A side of a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// Towards smaller x.
    Left,
    /// Towards larger x.
    Right,
}

/// A part of the goal frame, relative to the estimate: a row within a slab. Closed intervals.
#[derive(Clone, Copy, Debug)]
pub struct Window {
    /// Lower and upper end, micrometres.
    pub y: [i64; 2],
    /// Lower and upper end, 2^-24 turn.
    pub yaw: [i64; 2],
}

/// Upper bounds on the reach of a set that is cut to a slab, from the estimate, micrometres.
#[derive(Clone, Copy, Debug)]
pub struct Cut {
    pub left: i64,
    pub right: i64,
    pub bottom: i64,
    pub top: i64,
}

/// An offset from the estimate: micrometres, micrometres, 2^-24 turn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Offset(pub [i64; 3]);

impl Offset {
    /// Returns `mean` plus this offset, both in the goal frame. The offset is first shortened by 2^-12 of
    /// itself, so that its rounding cannot leave the set.
    pub fn applied_to(self, mean: Pose) -> Pose {
        // Shrunk by at least one unit, towards zero.
        let drawn_in = |v: i64| match v.signum() {
            1 => v.wrapping_sub(v >> 12).wrapping_sub(1),
            -1 => v.wrapping_sub(v >> 12),
            _ => v,
        };
        let [x, y, yaw] = self.0.map(drawn_in);
        let length = |at: i32, by: i64| i64::from(at).saturating_add(by) as i32;
        Pose {
            x_um: length(mean.x_um, x),
            y_um: length(mean.y_um, y),
            yaw: mean
                .yaw
                .plus(BinaryAngle(yaw.wrapping_mul(ANGLE_UNITS_PER_Q24) as u32)),
        }
    }
}

/// A pose-set as the walk needs it. The methods that end in `_end` are for reports and decide
/// nothing.
pub trait Section {
    /// Values that the tests of all rows of a walk use, computed at their first use. Answers do not depend on them.
    type Shared: Default;
    /// Returns the largest yaw offset, 2^-24 turn.
    fn yaw_q24(&self) -> i64;
    /// Returns the reach of the set for yaw offsets in a window, rounded up.
    fn cut(&self, yaw: [i64; 2]) -> Cut;
    /// Returns `true` only if no pose of the set within the window is farther than `room` to that
    /// side.
    fn fits_row(&self, side: Side, window: &Window, room: i64, shared: &mut Self::Shared) -> bool;
    /// Returns the pose of largest (`high`) or smallest yaw.
    fn yaw_end(&self, high: bool) -> Offset;
    /// Returns the pose of largest (`high`) or smallest y within a yaw window.
    fn y_end(&self, high: bool, yaw: [i64; 2]) -> Offset;
    /// Returns the pose farthest to a side within a window.
    fn row_end(&self, side: Side, window: &Window) -> Offset;
}

/// Half a turn, 2^-24 turn.
const HALF_TURN: i64 = 1 << 23;

/// A bounded set: a disc in the plane, an interval in yaw. A rotation does not change it. From half a turn on, the interval is every
/// heading.
pub struct Disc {
    radius: i64,
    yaw: i64,
}

impl Disc {
    pub fn new(translation_um: i32, yaw_q24: i32) -> Self {
        Self {
            radius: i64::from(translation_um),
            yaw: i64::from(yaw_q24),
        }
    }

    /// Returns a cylinder that contains an ellipsoid grown by a movement.
    pub fn around(factor: &SqrtFactor, by: Growth) -> Self {
        let radius = i64::from(broad_um(factor)).wrapping_add(i64::from(by.translation_um()));
        let yaw = i64::from(factor.yaw).wrapping_add(i64::from(by.yaw_q24()));
        Self { radius, yaw }
    }

    /// Returns the disc as an extent. The radius is below 2^29, the yaw at most 2^30.
    pub fn extent(&self) -> Extent {
        Extent::Bounded {
            translation_um: self.radius as i32,
            yaw_q24: self.yaw as i32,
        }
    }

    /// Returns both extents times `scale_q16 / 65536`, rounded up, the yaw as [`scaled_yaw`]. `None` if the radius reaches
    /// 2^29.
    pub fn scaled(&self, scale_q16: u32) -> Option<Self> {
        let scaled = |v: i64| v.wrapping_mul(i64::from(scale_q16)).wrapping_add(0xffff) >> 16;
        let radius = scaled(self.radius);
        (radius < 1 << 29).then_some(Self {
            radius,
            yaw: i64::from(scaled_yaw(self.yaw as i32, scale_q16)),
        })
    }

    /// Returns the y of a window that is nearest to the estimate.
    fn nearest_y(&self, [low, high]: [i64; 2]) -> i64 {
        if low > 0 {
            low
        } else if high < 0 {
            high
        } else {
            0
        }
    }
}

impl Section for Disc {
    type Shared = ();

    fn yaw_q24(&self) -> i64 {
        self.yaw.min(HALF_TURN)
    }

    fn cut(&self, _yaw: [i64; 2]) -> Cut {
        Cut {
            left: self.radius,
            right: self.radius,
            bottom: self.radius,
            top: self.radius,
        }
    }

    /// Exact: `room^2 + y^2 >= radius^2` at the window's nearest y.
    fn fits_row(&self, _side: Side, window: &Window, room: i64, (): &mut ()) -> bool {
        let y = self.nearest_y(window.y);
        room >= 0 && wide_square(room).wrapping_add(wide_square(y)) >= wide_square(self.radius)
    }

    fn yaw_end(&self, high: bool) -> Offset {
        Offset([
            0,
            0,
            if high {
                self.yaw_q24()
            } else {
                self.yaw_q24().wrapping_neg()
            },
        ])
    }

    fn y_end(&self, high: bool, yaw: [i64; 2]) -> Offset {
        let y = if high {
            self.radius
        } else {
            self.radius.wrapping_neg()
        };
        Offset([0, y, nearest_to_zero(yaw)])
    }

    fn row_end(&self, side: Side, window: &Window) -> Offset {
        let y = self.nearest_y(window.y);
        let left = self
            .radius
            .wrapping_mul(self.radius)
            .wrapping_sub(y.wrapping_mul(y));
        let x = sqrt_floor(left.max(0).unsigned_abs());
        let x = if side == Side::Right {
            x
        } else {
            x.wrapping_neg()
        };
        Offset([x, y, nearest_to_zero(window.yaw)])
    }
}

fn nearest_to_zero([low, high]: [i64; 2]) -> i64 {
    clamped(0, low, high)
}

/// A Gaussian set: an ellipsoid given by its factor, in the goal frame.
pub struct Ellipsoid {
    factor: SqrtFactor,
}

/// Either set: with `small_code` the walk is in flash once, for this type.
pub enum EitherSection {
    Disc(Disc),
    Ellipsoid(Ellipsoid),
}

impl EitherSection {
    pub fn of(extent: Extent) -> Self {
        match extent {
            Extent::Gaussian(factor) => Self::Ellipsoid(Ellipsoid::new(factor)),
            Extent::Bounded {
                translation_um,
                yaw_q24,
            } => Self::Disc(Disc::new(translation_um, yaw_q24)),
            Extent::Grown { factor, by } => Self::Disc(Disc::around(&factor, by)),
        }
    }
}

impl Section for EitherSection {
    type Shared = Shared;

    fn yaw_q24(&self) -> i64 {
        match self {
            Self::Disc(disc) => disc.yaw_q24(),
            Self::Ellipsoid(ellipsoid) => ellipsoid.yaw_q24(),
        }
    }

    fn cut(&self, yaw: [i64; 2]) -> Cut {
        match self {
            Self::Disc(disc) => disc.cut(yaw),
            Self::Ellipsoid(ellipsoid) => ellipsoid.cut(yaw),
        }
    }

    fn fits_row(&self, side: Side, window: &Window, room: i64, shared: &mut Shared) -> bool {
        match self {
            Self::Disc(disc) => disc.fits_row(side, window, room, &mut ()),
            Self::Ellipsoid(ellipsoid) => ellipsoid.fits_row(side, window, room, shared),
        }
    }

    fn yaw_end(&self, high: bool) -> Offset {
        match self {
            Self::Disc(disc) => disc.yaw_end(high),
            Self::Ellipsoid(ellipsoid) => ellipsoid.yaw_end(high),
        }
    }

    fn y_end(&self, high: bool, yaw: [i64; 2]) -> Offset {
        match self {
            Self::Disc(disc) => disc.y_end(high, yaw),
            Self::Ellipsoid(ellipsoid) => ellipsoid.y_end(high, yaw),
        }
    }

    fn row_end(&self, side: Side, window: &Window) -> Offset {
        match self {
            Self::Disc(disc) => disc.row_end(side, window),
            Self::Ellipsoid(ellipsoid) => ellipsoid.row_end(side, window),
        }
    }
}

/// Fraction bits of coordinates on the unit sphere.
const UNIT_BITS: u32 = 20;
const UNIT: i64 = 1 << UNIT_BITS;

impl Ellipsoid {
    pub const fn new(factor: SqrtFactor) -> Self {
        Self { factor }
    }

    /// Returns the row that grows towards a side.
    fn towards(&self, side: Side) -> [i32; 3] {
        match side {
            Side::Right => self.factor.x,
            Side::Left => self.factor.x.map(i32::wrapping_neg),
        }
    }

    /// Returns the farthest reach of a row in a yaw window, rounded up.
    fn reach(&self, row: [i32; 3], yaw: [i64; 2]) -> i64 {
        reach(row, self.factor.yaw, held(row, self.factor.yaw, yaw))
    }

    /// Returns approximately the point of the unit sphere that is farthest along a row with the yaw
    /// in a window.
    fn farthest(&self, row: [i32; 3], yaw: [i64; 2]) -> [i64; 3] {
        let [first, second, third] = row.map(i64::from);
        let first = match held(row, self.factor.yaw, yaw) {
            SupportPoint::Free => ratio(first.wrapping_mul(UNIT), sqrt_floor(squared_length(row))),
            SupportPoint::At(offset) => {
                ratio(offset.wrapping_mul(UNIT), i64::from(self.factor.yaw))
            }
        };
        let first = clamped(first, -UNIT, UNIT);
        let left = rest(first, 0);
        let [_, row2, row3] = row;
        let side = sqrt_floor(squared_length([0, row2, row3]));
        [
            first,
            ratio(left.wrapping_mul(second), side),
            ratio(left.wrapping_mul(third), side),
        ]
    }

    /// Returns the offset of a point of the unit sphere.
    fn offset(&self, u: [i64; 3]) -> Offset {
        let along = |row: [i32; 3]| {
            let [a, b, c] = row.map(i64::from);
            let [u1, u2, u3] = u;
            a.wrapping_mul(u1)
                .wrapping_add(b.wrapping_mul(u2))
                .wrapping_add(c.wrapping_mul(u3))
                >> UNIT_BITS
        };
        Offset([
            along(self.factor.x),
            along(self.factor.y),
            along([self.factor.yaw, 0, 0]),
        ])
    }

    /// Returns approximately the touching point of a row window: the point farthest along `row`, which grows towards a side, on
    /// the edge of the window that is nearer to the slab's own farthest point.
    ///
    /// `None` if the slab's farthest point lies within the row: then the row does not sharpen the
    /// bound.
    fn touch<'a>(
        &self,
        side: Side,
        row: [i32; 3],
        window: &Window,
        shared: &'a mut Shared,
    ) -> Option<Touch<'a>> {
        let shared = match side {
            Side::Left => &mut shared.left,
            Side::Right => &mut shared.right,
        };
        let farthest_y = match shared.farthest_y {
            Some((yaw, y)) if yaw == window.yaw => y,
            _ => {
                let Offset([_, y, _]) = self.offset(self.farthest(row, window.yaw));
                shared.farthest_y = Some((window.yaw, y));
                y
            }
        };
        let [low, high] = window.y;
        let edge = if farthest_y < low {
            low
        } else if farthest_y > high {
            high
        } else {
            return None;
        };
        let factor = shared
            .factor
            .get_or_insert_with(|| FactorWithYFirst::new(&self.factor, row));
        Some(Touch::at(factor, edge, window.yaw))
    }
}

/// What tests of rows of an ellipsoid share: half of the work of a test.
#[derive(Default)]
pub struct Shared {
    left: SharedBySide,
    right: SharedBySide,
}

#[derive(Default)]
struct SharedBySide {
    factor: Option<FactorWithYFirst>,
    /// A yaw window, and the y of the point that is farthest to the side in it.
    farthest_y: Option<([i64; 2], i64)>,
}

/// The factor with y first, `y = Y1 v1, yaw = T1 v1 + T2 v2, x = X1 v1 + X2 v2 + X3 v3`, with x towards a side. All values are
/// approximate and not trusted: they only propose multipliers.
struct FactorWithYFirst {
    y1: i64,
    t1: i64,
    t2: i64,
    x: [i64; 3],
    /// Length of `(X2, X3)`.
    across: i64,
}

impl FactorWithYFirst {
    fn new(factor: &SqrtFactor, row: [i32; 3]) -> Self {
        let yaw = i64::from(factor.yaw);
        let [row1, _, _] = row.map(i64::from);
        let [fy1, _, _] = factor.y.map(i64::from);
        let y1 = sqrt_floor(squared_length(factor.y)).max(1);
        let t1 = ratio(yaw.wrapping_mul(fy1), y1);
        let t2 = root(yaw.wrapping_mul(yaw).wrapping_sub(t1.wrapping_mul(t1))).max(1);
        let x1 = ratio(dot(row, factor.y), y1);
        let x2 = ratio(yaw.wrapping_mul(row1).wrapping_sub(x1.wrapping_mul(t1)), t2);
        let across = dot(row, row).wrapping_sub(x1.wrapping_mul(x1));
        let x3 = root(across.wrapping_sub(x2.wrapping_mul(x2))).max(1);
        Self {
            y1,
            t1,
            t2,
            x: [x1, x2, x3],
            across: root(across).max(1),
        }
    }
}

/// A point v of the unit sphere. Approximate and not trusted, as the factor.
struct Touch<'a> {
    factor: &'a FactorWithYFirst,
    v: [i64; 3],
}

impl<'a> Touch<'a> {
    /// Returns the point farthest along x where y is `edge` and the yaw lies in a window.
    fn at(factor: &'a FactorWithYFirst, edge: i64, [e0, e1]: [i64; 2]) -> Self {
        let &FactorWithYFirst {
            y1,
            t1,
            t2,
            x: [_, x2, _],
            across,
        } = factor;
        let v1 = clamped(ratio(edge.wrapping_mul(UNIT), y1), -UNIT, UNIT);
        let left = rest(v1, 0);
        let free = ratio(left.wrapping_mul(x2), across);
        // The yaw at a v2, and the v2 at a yaw.
        let at = |v2: i64| t1.wrapping_mul(v1).wrapping_add(t2.wrapping_mul(v2)) >> UNIT_BITS;
        let held = |e: i64| ratio(e.wrapping_mul(UNIT).wrapping_sub(t1.wrapping_mul(v1)), t2);
        let end = match at(free) {
            yaw if yaw < e0 => Some(e0),
            yaw if yaw > e1 => Some(e1),
            _ => None,
        };
        let v2 = end.map_or(free, held);
        let v2 = clamped(v2, left.wrapping_neg(), left);
        Self {
            factor,
            v: [v1, v2, rest(v1, v2)],
        }
    }

    /// Returns the outward normal of the ellipsoid at v, `(along the row, along y, along yaw)`, from
    /// `F' a = k v`, scaled so that the first entry is v3.
    fn normal(&self) -> [i64; 3] {
        let &FactorWithYFirst {
            y1,
            t1,
            t2,
            x: [x1, x2, x3],
            ..
        } = self.factor;
        let [v1, v2, v3] = self.v;
        let along = v3.max(1);
        let yaw = ratio(v2.wrapping_mul(x3).wrapping_sub(x2.wrapping_mul(along)), t2);
        let y = ratio(
            v1.wrapping_mul(x3)
                .wrapping_sub(x1.wrapping_mul(along))
                .saturating_sub(t1.saturating_mul(yaw)),
            y1,
        );
        [along, y, yaw]
    }

    /// Returns the offset of v: along the row, y, yaw.
    fn offset(&self) -> [i64; 3] {
        let &FactorWithYFirst {
            y1,
            t1,
            t2,
            x: [x1, x2, x3],
            ..
        } = self.factor;
        let [v1, v2, v3] = self.v;
        let sum = x1
            .wrapping_mul(v1)
            .wrapping_add(x2.wrapping_mul(v2))
            .wrapping_add(x3.wrapping_mul(v3));
        let yaw = t1.wrapping_mul(v1).wrapping_add(t2.wrapping_mul(v2));
        [
            sum >> UNIT_BITS,
            y1.wrapping_mul(v1) >> UNIT_BITS,
            yaw >> UNIT_BITS,
        ]
    }
}

/// Largest multiplier that the certificate accepts: every product with an entry stays below 2^61.
const LARGEST_MULTIPLIER: u64 = 1 << 31;

impl Section for Ellipsoid {
    type Shared = Shared;

    fn yaw_q24(&self) -> i64 {
        i64::from(self.factor.yaw)
    }

    fn cut(&self, yaw: [i64; 2]) -> Cut {
        let (x, y) = (self.factor.x, self.factor.y);
        Cut {
            left: self.reach(x.map(i32::wrapping_neg), yaw),
            right: self.reach(x, yaw),
            bottom: self.reach(y.map(i32::wrapping_neg), yaw),
            top: self.reach(y, yaw),
        }
    }

    /// A certificate by weak duality: for any multipliers `a = (a_x > 0, a_y, a_yaw)` and any pose
    /// p of the set within the window,
    ///
    /// ```text
    /// a_x x = a.p - a_y y - a_yaw yaw <= |F' a| + max(-a_y y) + max(-a_yaw yaw)
    /// ```
    ///
    /// with the maxima over the window's ends. If the right side is at most `a_x room`, no such pose
    /// has x above `room`. The last comparison is exact, so soundness does not depend on the
    /// multipliers. They come from the touching point, which makes the bound tight.
    fn fits_row(&self, side: Side, window: &Window, room: i64, shared: &mut Shared) -> bool {
        let row = self.towards(side);
        let Some(touch) = self.touch(side, row, window, shared) else {
            return false;
        };
        let [ax, ay, at] = touch.normal();
        if !(ax > 0
            && ay.unsigned_abs() < LARGEST_MULTIPLIER
            && at.unsigned_abs() < LARGEST_MULTIPLIER
            && room.unsigned_abs() < LARGEST_MULTIPLIER)
        {
            return false;
        }
        let most = |a: i64, [low, high]: [i64; 2]| {
            let a = a.wrapping_neg();
            a.saturating_mul(low).max(a.saturating_mul(high))
        };
        let spare = ax
            .wrapping_mul(room)
            .saturating_sub(most(ay, window.y))
            .saturating_sub(most(at, window.yaw));
        let [x1, x2, x3] = row.map(i64::from);
        let [y1, y2, y3] = self.factor.y.map(i64::from);
        // Each product is below 2^61: a_x < 2^21, a_y < 2^31, a_yaw < 2^31; entries below 2^30.
        let plane = |x: i64, y: i64| ax.wrapping_mul(x).wrapping_add(ay.wrapping_mul(y));
        let first = plane(x1, y1).wrapping_add(at.wrapping_mul(i64::from(self.factor.yaw)));
        let square = wide_square(first)
            .wrapping_add(wide_square(plane(x2, y2)))
            .wrapping_add(wide_square(plane(x3, y3)));
        spare >= 0 && wide_square(spare) >= square
    }

    fn yaw_end(&self, high: bool) -> Offset {
        self.offset([if high { UNIT } else { -UNIT }, 0, 0])
    }

    fn y_end(&self, high: bool, yaw: [i64; 2]) -> Offset {
        let row = if high {
            self.factor.y
        } else {
            self.factor.y.map(i32::wrapping_neg)
        };
        self.offset(self.farthest(row, yaw))
    }

    fn row_end(&self, side: Side, window: &Window) -> Offset {
        let row = self.towards(side);
        let mut shared = Shared::default();
        match self.touch(side, row, window, &mut shared) {
            None => self.offset(self.farthest(row, window.yaw)),
            Some(touch) => {
                let [along, y, yaw] = touch.offset();
                let x = if side == Side::Right {
                    along
                } else {
                    along.wrapping_neg()
                };
                Offset([x, y, yaw])
            }
        }
    }
}

/// Returns `a / b` rounded down, or 0 if b is not above zero. For proposals only.
fn ratio(a: i64, b: i64) -> i64 {
    Divisor::new(b).map_or(0, |by| by.floor(a))
}

/// Returns the square root, or 0 for negative numbers. For proposals only.
fn root(square: i64) -> i64 {
    sqrt_floor(square.max(0).unsigned_abs())
}

/// Returns `sqrt(1 - a^2 - b^2)` of coordinates on the unit sphere.
fn rest(a: i64, b: i64) -> i64 {
    root(
        UNIT.wrapping_mul(UNIT)
            .wrapping_sub(a.wrapping_mul(a))
            .wrapping_sub(b.wrapping_mul(b)),
    )
}
