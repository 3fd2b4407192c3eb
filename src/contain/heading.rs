//! One facet over all headings of a pose-set: for sets whose heading is uncertain.
//!
//! At the heading offset `t = T u` (`-1 <= u <= 1`, T the largest offset) the ellipsoid `{F u : |u| <= 1}` is an
//! ellipse about `f u`, f the first column of F in the plane, with the other two columns times
//! `r(u) = sqrt(1 - u^2)`. A facet `n . P <= b` therefore asks whether a function of one variable stays
//! below zero. With J a quarter turn, m the estimate and R the turn by a heading:
//!
//! - World axes, point v: `n.m + G u + N r(u) + C cos(t) + S sin(t) <= b`, where `C = n . R v` and `S = n . J R v` at the
//!   estimate's heading, `G = n.f` and `N = |F23' n|`.
//! - Robot axes, point q: `n_t . (m - q + f u) + |F23' n_t| r(u) <= b`, where `n_t` is n turned by the heading plus t.
//!
//! [`holds`] cuts `[-1, 1]` into slabs. Each slab has its middle e, its half width h in u and its half width
//! `w = T h <= 1` in heading. C, S, G, H and N are evaluated at its middle heading; `x = u - e`. A slab
//! holds if one of two upper bounds does, else it is halved. If the exact section at its middle is beyond the facet, the
//! facet does not hold.
//!
//! # The bounds of a slab
//!
//! | part | at most |
//! |---|---|
//! | `S sin(T x)` | `kappa S T x + abs(S) (w^3/24 + w^5/3000)`, `kappa = 1 - w^2/8` |
//! | `C cos(T x)` | C if C > 0, else `C cos w`; in the parabola, if C > 0: `C - C (1 - cos w) (x/h)^2` |
//! | robot axes, `G = n.f`: `G x cos(T x)` | `G x (1 - 3 w^2/8) + abs(G) h (w^2/8 + w^4/24)` |
//! | robot axes, `H = (J n).f`: `H x sin(T x)` | `H h w (x/h)^2` if H > 0, else 0 |
//! | robot axes: `abs(F23' n_t)`, a = F23' n, b = F23' J n | its square is `a.a + (b.b - a.a) sin^2 + a.b sin(2 T x)`, so with `p^2 = a.a + max(b.b - a.a, 0) sin^2 w` it is at most `p + (a.b / p) sin(2 T x) / 2` |
//! | its `sin(2 T x) / 2` | `(1 - w^2/2) T x`, off by at most `w^3/6 + 2 w^5/15` |
//! | its product with r(u) | `n r(u) + tilt r(e) x/h + abs(tilt) max abs(r(u) - r(e))` |
//! | growth by a movement ([`Movement`]) | `rho abs(n) + d (abs(S) + abs(C) (w + d/2))`, and in robot axes d times the longest offset |
//! | first bound: `g x + N r(e + x)` | its largest value on the slab: at an end, or `hypot(g, N) - g e` |
//! | second bound: `N r(u)` | `N (p + (1 - u^2) / p) / 2` for any p > 0: a parabola, whose largest value is known |
//!
//! # Rounding
//!
//! Lengths are "fine": 2^-14 of the layout's length unit, below 2^31. [`SLACK`] covers rounding to the nearest; all
//! else rounds against acceptance. The table covers the roundings of the estimate (`super::facet_clearance_q14`).
//!
//! | rounded to the nearest | fine units, at most |
//! |---|---|
//! | cosine and sine, 2 of 2^-30; each coordinate of the turned normal, 0.5 of 2^-28: together 1.3 of 2^-28, times a point of 2^15.5 units | 3.6 in C and, times w, in S |
//! | the middle's heading, 1 of 2^-32 turn: 1.5e-9 rad, times 2^29.5 | 1.2 in C and, times w, in S |
//! | the columns of F, C, S, G, H and the products `G e`, `H e` to fine units | 4 |
//! | T to 2^-28 rad, 0.5 and 1.5e-9 of it, times h, times S: at most `(0.5 + 0.4 T) h 2^1.5` | 3 |
//! | kappa and its products; the product of G with `3 w^2/8` | 5 |
//! | **sum** | **21.6** |
//!
//! In robot axes C and S contain `G e` and `H e` and may reach 2^29.9: 3.4 more. [`SCALED_UM_Q14`] and [`SCALED_YAW`] cover the
//! rounding of a scale (margins only).

use super::compact;
use crate::num::{BinaryAngle, product, sqrt_ceil, towards_zero};
use crate::pose::Pose;
use crate::set::{Extent, Growth, PoseSet, SqrtFactor};
use crate::table::{Axes, Facet, Facets, Frame, MOST_SLABS, Piece};

/// Most by which roundings to the nearest can lower a bound, fine units.
const SLACK: i64 = 28;
/// Most by which a scale can lower a factor's entries: 0.5 um in six of them, 1.23 um, 2^-14 um.
const SCALED_UM_Q14: i32 = 20_200;
/// A factor's yaw times a scale, up by 2^-24 turn, times a point of 2^15 units: fine units.
const SCALED_YAW: i32 = 202;
/// Most by which roundings can lower a bound of [`Sweep::broadly`], length units: of a point, a chord, the set's width, and a scale
/// (margins only).
const ROUNDED_BROADLY: i64 = 6;
/// Largest number of halvings of `[-1, 1]`.
const DEEPEST: u32 = 6;
/// The largest heading offset that is cut into slabs: one turn, 2^-24 turn.
const ONE_TURN: u32 = 1 << 24;
/// 2^-24 turn in units of 2^-28 rad, times 2^20: 0.15 too large.
const TAU: i64 = 105_414_358;
/// Fraction bits of u.
const U: u32 = 15;
/// One in radians, cosines and sines: 2^-28.
const ONE: i64 = 1 << 28;

/// Slack of an arc, 2^-32 turn: headings of estimate and goal are each within 0.51, and the proof treats the border of
/// a box's arc as 1.37 wide.
const ARC_SLACK: u32 = 3;

/// Returns `true` if headings up to `reach` from one that is `above_goal`, 2^-32 turn, lie in a piece's arc.
#[inline(always)]
pub(super) fn in_arc(piece: &Piece<'_>, above_goal: u32, reach: u32) -> bool {
    let above = above_goal.wrapping_sub(piece.from);
    let reach = reach.saturating_add(ARC_SLACK);
    let room = above.min(piece.width.saturating_sub(above));
    piece.is_whole_circle() || (above <= piece.width && reach <= room)
}

/// A pose-set's numbers for this test.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sweep {
    /// The estimate above the goal, length units.
    pub x: i32,
    /// As x.
    pub y: i32,
    heading: BinaryAngle,
    /// Cosine and sine of the heading, 2^-30.
    facing: [i32; 2],
    /// The largest heading offset, 2^-24 turn; `ONE_TURN + 1` for every larger offset.
    pub yaw: u32,
    /// The same, 2^-28 rad, to the nearest.
    turn: i32,
    /// The columns of the factor's x and y rows, fine units, to the nearest; zero for a cylinder.
    pub columns: [[i32; 2]; 3],
    /// The radius of a cylinder, micrometres.
    pub radius: Option<i32>,
    /// Upper bound of the length of an offset in the plane, micrometres.
    pub broad: u32,
    /// The layout's length unit is 2^k micrometres.
    unit: u32,
    /// Most by which a scale's rounding can lower a set's reach (margins only), fine units.
    scaled: i32,
    /// The growth of the set by a movement.
    movement: Movement,
}

/// The growth of an ellipsoid by a movement, at every heading. A cylinder includes it in its own extents.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Movement {
    /// The radius in the plane, fine units, up.
    length: i32,
    /// The turn to either side, 2^-28 rad, up: at most a turn.
    turn: i32,
    /// One and a half times the ellipsoid's longest offset in the plane, fine units, up.
    broad: i32,
    /// The movement as given.
    by: Growth,
}

impl Movement {
    const NONE: Self = Self {
        length: 0,
        turn: 0,
        broad: 0,
        by: Growth::NONE,
    };

    /// Returns `true` if there is no movement. Any movement has a length or a turn of at least a unit, because both are rounded up.
    #[inline(always)]
    const fn is_none(&self) -> bool {
        self.length | self.turn == 0
    }
}

/// A set's point in a frame, and a bound of its movement over all poses of the set.
#[derive(Clone, Copy, Debug)]
pub(super) struct Broadly {
    /// The point for the estimate, length units.
    point: [i32; 2],
    /// The bound, fine units.
    moved: i64,
}

impl Broadly {
    /// Returns `true` if a facet of the frame holds for every pose of the set. The cheapest test, and the loosest.
    #[inline(always)]
    pub fn hold(&self, facet: Facet) -> bool {
        let normal = [i32::from(facet.x), i32::from(facet.y)];
        let spare = (i64::from(facet.b) << 14).wrapping_sub(dot(normal, self.point));
        spare >= self.moved
    }
}

/// Returns `true` if every pose of a set is within a facet of a frame. `slabs` is the number of slabs that may still be
/// evaluated. `false` if that is not shown.
#[inline(never)]
fn holds(sweep: &Sweep, facet: Facet, frame: &Frame<'_>, first: &Width, slabs: &mut u32) -> bool {
    let point = [i32::from(frame.x), i32::from(frame.y)];
    holds_at(sweep, facet, frame.axes, point, first, slabs)
}

#[inline(always)]
fn holds_at(
    sweep: &Sweep,
    facet: Facet,
    axes: Axes,
    point: [i32; 2],
    first: &Width,
    slabs: &mut u32,
) -> bool {
    // Below a radian the slabs are few, and the heading's whole circle costs far too much.
    if (sweep.radius.is_some() || sweep.turn() > ONE)
        && let Some(decided) = at_once(sweep, facet, axes, point)
    {
        return decided;
    }
    in_slabs(sweep, facet, axes, point, first, slabs)
}

/// Decides without slabs if the facet holds: for a cylinder, or for every heading. `None` if slabs are needed. A separate function,
/// so that the slabs do not need its stack.
#[inline(never)]
fn at_once(sweep: &Sweep, facet: Facet, axes: Axes, point: [i32; 2]) -> Option<bool> {
    let section = sweep.section(facet, axes, point, 0);
    if let Some(radius) = sweep.radius {
        return Some(sweep.cylinder_holds(facet, &section, radius));
    }
    if sweep.holds_at_any_heading(facet, &section) {
        return Some(true);
    }
    (sweep.yaw > ONE_TURN).then_some(false)
}

/// As [`at_once`], slab by slab, for an ellipsoid that turns by at most one turn.
#[inline(never)]
fn in_slabs(
    sweep: &Sweep,
    facet: Facet,
    axes: Axes,
    point: [i32; 2],
    whole: &Width,
    slabs: &mut u32,
) -> bool {
    let first = sweep.first_depth();
    let (mut depth, mut index) = (first, 0u32);
    let mut width = *whole;
    loop {
        let Some(left) = slabs.checked_sub(1) else {
            return false;
        };
        *slabs = left;
        let middle = index
            .wrapping_mul(2)
            .wrapping_add(1)
            .wrapping_mul(width.in_u.unsigned_abs());
        let e = (middle as i32).wrapping_sub(1 << U);
        let section = sweep.section(facet, axes, point, e);
        match section.slab(sweep, e, &width) {
            Slab::Outside => return false,
            Slab::Unsure if depth == DEEPEST => return false,
            Slab::Unsure => {
                depth = depth.wrapping_add(1);
                index = index.wrapping_mul(2);
                width = sweep.width(depth);
            }
            Slab::Inside => {
                // The next slab: up from each second half.
                let was = depth;
                while depth > first && index & 1 == 1 {
                    depth = depth.wrapping_sub(1);
                    index >>= 1;
                }
                index = index.wrapping_add(1);
                if index.wrapping_shr(depth) != 0 {
                    return true;
                }
                if depth != was {
                    width = if depth == first {
                        *whole
                    } else {
                        sweep.width(depth)
                    };
                }
            }
        }
    }
}

/// A slab's half width and the terms of its bounds, each rounded against acceptance.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Width {
    /// In u, 2^-15.
    pub in_u: i32,
    /// In heading, 2^-28 rad, at most [`ONE`].
    w: i32,
    /// `1 - w^2 / 8`, 2^-28.
    kappa: i32,
    /// `w^3/24 + w^5/3000`, 2^-28, up.
    rest: i32,
    /// `w^2/8 + w^4/24`, 2^-28, up, and the error of `3 (1 - kappa)` for `3 w^2 / 8`.
    shortening_rest: i32,
    /// `cos w`, 2^-28, down.
    cos: i32,
    /// `sin^2 w`, 2^-28, up.
    sine_square: i32,
    /// `w - w^3/2`, 2^-28, to within 12 units.
    leaning: i32,
    /// `w^3/6 + 2 w^5/15`, 2^-28, up, and the errors of `leaning` and [`slope`].
    leaning_rest: i32,
}

impl Width {
    /// Returns `3 w^2 / 8`, 2^-28, to within 5 units.
    #[inline(always)]
    const fn shortening(&self) -> i32 {
        (ONE as i32).wrapping_sub(self.kappa).wrapping_mul(3)
    }

    /// Returns `1 - cos w`, 2^-28, down: `cos` is at most 6 units too small.
    #[inline(always)]
    fn versine(&self) -> i32 {
        (ONE as i32).wrapping_sub(self.cos).wrapping_sub(7).max(0)
    }
}

/// One facet at the middle of a slab, fine units.
#[derive(Clone, Copy, Debug)]
pub(super) struct Section {
    /// The part of b that is left for the terms below.
    pub left: i64,
    pub c: i32,
    pub s: i32,
    pub g: i32,
    /// Robot axes only, as `turns`.
    pub h: i32,
    /// The part of g in robot axes.
    pub g_turning: i32,
    /// An upper bound of the part of `|along|` in world axes, if both kinds are summed.
    pub still: u32,
    /// The other two columns along the normal, and along the normal a quarter turn ahead.
    pub along: [i32; 2],
    pub ahead: [i32; 2],
    /// The normal in world axes, 2^-14.
    pub normal: [i32; 2],
    /// `true` if the normal turns with the heading: robot axes.
    pub turns: bool,
}

/// The result of a slab's test.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Slab {
    /// No pose of the slab is beyond the facet.
    Inside,
    /// The middle section of the slab is beyond the facet.
    Outside,
    /// The bounds do not decide.
    Unsure,
}

impl Sweep {
    /// `None` if the estimate is beyond the layout's reach, or the set is far wider than the layout.
    pub fn of(facets: &Facets<'_>, set: &PoseSet, goal: Pose) -> Option<Self> {
        Self::at(facets, set, compact::place(facets, set, goal)?)
    }

    /// As [`Sweep::of`], with the estimate relative to the goal in length units.
    #[inline(never)]
    pub fn at(facets: &Facets<'_>, set: &PoseSet, [x, y]: [i32; 2]) -> Option<Self> {
        let by = match set.extent() {
            Extent::Grown { by, .. } => by,
            _ => Growth::NONE,
        };
        let (columns, yaw, radius) = match set.extent() {
            Extent::Gaussian(factor) | Extent::Grown { factor, .. } => {
                let SqrtFactor {
                    yaw,
                    x: [x1, x2, x3],
                    y: [y1, y2, y3],
                } = factor;
                ([[x1, y1], [x2, y2], [x3, y3]], yaw, None)
            }
            Extent::Bounded {
                translation_um,
                yaw_q24,
            } => ([[0; 2]; 3], yaw_q24, Some(translation_um)),
        };
        let unit = u32::from(facets.unit());
        let yaw = yaw.unsigned_abs().min(ONE_TURN + 1);
        let broad = set.common().broad_um;
        // Below 2^15 length units, so 2^29 fine ones.
        let fine = |v: i32| nearest(i64::from(v) << 14, unit) as i32;
        (broad.wrapping_shr(unit) < 1 << 15).then_some(Self {
            x,
            y,
            heading: set.mean().yaw,
            facing: set.mean().yaw.cos_sin_q30(),
            yaw,
            turn: (i64::from(yaw).wrapping_mul(TAU).wrapping_add(1 << 19) >> 20) as i32,
            columns: columns.map(|column| column.map(fine)),
            radius,
            broad,
            unit,
            scaled: SCALED_UM_Q14.wrapping_shr(unit).wrapping_add(SCALED_YAW),
            movement: if by == Growth::NONE {
                Movement::NONE
            } else {
                // The whole set's width is more than the ellipsoid's: below 2^29.6.
                let whole = fine(broad as i32).wrapping_add(2);
                Movement {
                    length: fine(by.translation_um()).wrapping_add(1),
                    turn: (i64::from(by.yaw_q24()).wrapping_mul(TAU) >> 20).wrapping_add(1) as i32,
                    broad: whole.wrapping_add(whole >> 1),
                    by,
                }
            },
        })
    }

    /// Returns the sweep with a cylinder's disc as columns, rounded up.
    pub fn with_disc(mut self) -> Self {
        if let Some(radius) = self.radius {
            let radius = (nearest(i64::from(radius) << 14, self.unit) as i32).wrapping_add(1);
            self.columns = [[0; 2], [radius, 0], [0, radius]];
        }
        self
    }

    /// Returns a pose relative to the estimate, um, um, 2^-24 turn. The input position is relative to the goal in fine
    /// units; the heading is that at u = e.
    pub fn offset_of(&self, [x, y]: [i64; 2], e: i32) -> [i64; 3] {
        let um = |at: i64, from: i32| {
            let fine = at.wrapping_sub(i64::from(from) << 14);
            // To micrometres: 2^30 * 2^12.
            fine.wrapping_shl(self.unit) >> 14
        };
        let yaw = i64::from(self.yaw).wrapping_mul(i64::from(e)) >> U;
        [um(x, self.x), um(y, self.y), yaw]
    }

    /// Returns cosine and sine of the heading at u = e / 2^15, 2^-30. u is from -1 to 1, times the largest heading
    /// offset.
    pub fn turned_to(&self, e: i32) -> [i32; 2] {
        if e == 0 {
            return self.facing;
        }
        let turn = (i64::from(self.yaw) << 8).wrapping_mul(i64::from(e)) >> U;
        self.heading.plus(BinaryAngle(turn as u32)).cos_sin_q30()
    }

    /// Returns `true` if one of the pieces contains every pose of the set, each facet decided over all headings.
    #[inline(never)]
    pub fn is_held(&self, facets: &Facets<'_>, set: &PoseSet, goal: Pose) -> bool {
        let above_goal = set.mean().yaw.minus(goal.yaw).0;
        let mut slabs = MOST_SLABS;
        let first = self.width(self.first_depth());
        facets.pieces().any(|piece| {
            in_arc(&piece, above_goal, set.common().turn.reach)
                && piece.frames().all(|frame| {
                    let broadly = self.broadly(&frame);
                    let mut facets = frame.facets();
                    facets.all(|facet| {
                        broadly.hold(facet) || holds(self, facet, &frame, &first, &mut slabs)
                    })
                })
        })
    }

    /// Returns the set's point in a frame with a bound of its movement over all poses of the set.
    #[inline(never)]
    pub fn broadly(&self, frame: &Frame<'_>) -> Broadly {
        self.broadly_at(frame.axes, [i32::from(frame.x), i32::from(frame.y)])
    }

    #[inline(always)]
    fn broadly_at(&self, axes: Axes, [vx, vy]: [i32; 2]) -> Broadly {
        let length = |x: i32, y: i32| {
            let (x, y) = (x.unsigned_abs(), y.unsigned_abs());
            // At most 12 % more than the length.
            x.max(y).wrapping_add(x.min(y) >> 1).wrapping_add(1)
        };
        let turned = |x: i32, y: i32, sign: i32| {
            let [c, s] = self.facing;
            let s = s.wrapping_mul(sign);
            let ahead = product(c, x).wrapping_sub(product(s, y));
            let aside = product(s, x).wrapping_add(product(c, y));
            [nearest(ahead, 30) as i32, nearest(aside, 30) as i32]
        };
        let (point, lever) = match axes {
            Axes::World if (vx, vy) == (0, 0) => ([self.x, self.y], 0),
            Axes::World => {
                let [x, y] = turned(vx, vy, 1);
                let point = [self.x.wrapping_add(x), self.y.wrapping_add(y)];
                (point, length(vx, vy))
            }
            Axes::Robot => {
                let (x, y) = (self.x.wrapping_sub(vx), self.y.wrapping_sub(vy));
                (turned(x, y, -1), length(x, y))
            }
        };
        // No chord is longer than two radii: 2^17 * 2^29.
        let turn = self.turn().wrapping_add(i64::from(self.movement.turn));
        let chord = i64::from(lever).wrapping_mul(turn.min(2 * ONE)) >> 28;
        let broad = i64::from(self.broad.wrapping_shr(self.unit));
        let moved = broad.wrapping_add(chord).wrapping_add(ROUNDED_BROADLY);
        Broadly {
            point,
            // A normal is longer than 1 by 2^-8 at most.
            moved: moved.wrapping_add(moved >> 7).wrapping_shl(14),
        }
    }

    /// Returns the turn of the movement to either side, 2^-32 turn.
    pub fn swing(&self) -> i64 {
        i64::from(self.movement.by.yaw_q24()) << 8
    }

    /// Returns the largest heading offset, 2^-28 rad.
    pub fn turn(&self) -> i64 {
        i64::from(self.turn)
    }

    /// Returns the number of halvings after which slabs are narrow enough for the bounds: `T 2^-depth <= 1`.
    pub fn first_depth(&self) -> u32 {
        (0..3)
            .find(|depth| self.turn().wrapping_shr(*depth).wrapping_add(4) <= ONE)
            .unwrap_or(3)
    }

    pub fn width(&self, depth: u32) -> Width {
        let w = self.turn().wrapping_shr(depth).wrapping_add(4);
        let angle = self.yaw.wrapping_shl(7).wrapping_shr(depth).wrapping_mul(2);
        let [cos, sin] = BinaryAngle(angle.wrapping_add(2)).cos_sin_q30();
        let up = |a: i64, b: i64| (a.wrapping_mul(b) >> 28).wrapping_add(1);
        let square = up(w, w);
        let cube = up(square, w);
        let fourth = up(cube, w);
        let fifth = up(fourth, w);
        let cos_down = cos.wrapping_sub(4) >> 2;
        let sin_up = i64::from((sin.wrapping_add(4) >> 2).wrapping_add(1));
        Width {
            in_u: 1i32.wrapping_shl(U.wrapping_sub(depth)),
            w: w as i32,
            kappa: ONE.wrapping_sub(square >> 3) as i32,
            // By 24 and by 3000, up, without a quotient.
            rest: (cube.wrapping_mul(10_923) >> 18)
                .wrapping_add(fifth.wrapping_mul(1_399) >> 22)
                .wrapping_add(2) as i32,
            // By 24, up, without a quotient.
            shortening_rest: (square >> 3)
                .wrapping_add(fourth.wrapping_mul(10_923) >> 18)
                .wrapping_add(8) as i32,
            cos: cos_down,
            sine_square: up(sin_up, sin_up) as i32,
            leaning: w.wrapping_sub(cube >> 1) as i32,
            // Two fifteenths, up, without a quotient; the slope times at most a half.
            leaning_rest: (cube.wrapping_mul(43_691) >> 18)
                .wrapping_add(fifth.wrapping_mul(34_953) >> 18)
                .wrapping_add(16 + (1 << 13)) as i32,
        }
    }

    /// Returns a length in micrometres times the length of a facet's normal, fine units, rounded up.
    fn along_any(&self, facet: Facet, length: i64) -> i64 {
        let (x, y) = (i64::from(facet.x), i64::from(facet.y));
        // Below 2^29 and 2^14.1.
        let length = sqrt_ceil(squares(x, y)).wrapping_mul(length);
        length.wrapping_shr(self.unit).wrapping_add(1)
    }

    /// Returns `true` if a facet holds at every heading of the circle, by the section at the estimate's heading.
    fn holds_at_any_heading(&self, facet: Facet, section: &Section) -> bool {
        let reach = if section.turns {
            self.along_any(facet, i64::from(self.broad))
        } else {
            let [a2, a3] = section.along.map(i64::from);
            let square = squares(a2, a3).wrapping_add(squares(i64::from(section.g), 0));
            let moved = section.moved(i64::from(self.movement.length), 0);
            sqrt_ceil(square).wrapping_add(4).wrapping_add(moved)
        };
        let left = section.left.wrapping_sub(reach).wrapping_sub(SLACK);
        left >= 0
            && left.unsigned_abs().saturating_mul(left.unsigned_abs())
                >= squares(i64::from(section.c), i64::from(section.s))
    }

    /// Returns `true` if a facet holds for a cylinder: a disc about the estimate at each heading, exact except for roundings.
    ///
    /// `C cos t + S sin t` over `|t| <= T` is largest where the point is along the normal, or at an end.
    fn cylinder_holds(&self, facet: Facet, section: &Section, radius: i32) -> bool {
        let reach = self.along_any(facet, i64::from(radius));
        let left = section.left.wrapping_sub(reach).wrapping_sub(SLACK);
        let (c, s) = (i64::from(section.c), i64::from(section.s.saturating_abs()));
        if left < 0 {
            return false;
        }
        if left.unsigned_abs().saturating_mul(left.unsigned_abs()) >= squares(c, s) {
            return true;
        }
        // Below half a turn an end is the largest if the sum still rises there.
        let [cos, sin] = BinaryAngle(self.yaw.wrapping_shl(8))
            .cos_sin_q30()
            .map(i64::from);
        let rises = s.wrapping_mul(cos).wrapping_sub(c.wrapping_mul(sin)) >> 30;
        let at_end = c.wrapping_mul(cos).wrapping_add(s.wrapping_mul(sin)) >> 30;
        self.yaw < ONE_TURN / 2 && rises >= 16 && at_end.wrapping_add(16) <= left
    }

    /// Returns the section of a facet at u = e, unit 2^-15.
    #[inline(never)]
    pub fn section(&self, facet: Facet, axes: Axes, point: [i32; 2], e: i32) -> Section {
        let [c, s] = self.turned_to(e);
        let (nx, ny) = (i32::from(facet.x), i32::from(facet.y));
        let b = i64::from(facet.b) << 14;
        let [f, second, third] = self.columns;
        // The normal turned, 2^-28: against the heading in world axes, with it in robot axes.
        let turned = |s: i32| {
            let x = product(c, nx).wrapping_sub(product(s, ny));
            let y = product(s, nx).wrapping_add(product(c, ny));
            [nearest(x, 16) as i32, nearest(y, 16) as i32]
        };
        let at_e = |v: i32| nearest(product(v, e), U) as i32;
        match axes {
            Axes::World => {
                let [tx, ty] = turned(s.wrapping_neg());
                let [vx, vy] = point;
                let along = |column| nearest(dot([nx, ny], column), 14) as i32;
                let g = along(f);
                let spare = b.wrapping_sub(dot([nx, ny], [self.x, self.y]));
                Section {
                    left: spare
                        .wrapping_sub(i64::from(at_e(g)))
                        .wrapping_sub(i64::from(self.scaled)),
                    c: nearest(dot([tx, ty], [vx, vy]), 14) as i32,
                    s: nearest(dot([ty, tx.wrapping_neg()], [vx, vy]), 14) as i32,
                    g,
                    h: 0,
                    g_turning: 0,
                    still: 0,
                    along: [along(second), along(third)],
                    ahead: [0; 2],
                    normal: [nx, ny],
                    turns: false,
                }
            }
            Axes::Robot => {
                let normal = turned(s);
                let [tx, ty] = normal;
                let ahead = [ty.wrapping_neg(), tx];
                let [qx, qy] = point;
                let offset = [self.x.wrapping_sub(qx), self.y.wrapping_sub(qy)];
                let of = |normal, column| nearest(dot(normal, column), 28) as i32;
                let (g, h) = (of(normal, f), of(ahead, f));
                Section {
                    left: b.wrapping_sub(i64::from(self.scaled)),
                    c: (nearest(dot(normal, offset), 14) as i32).wrapping_add(at_e(g)),
                    s: (nearest(dot(ahead, offset), 14) as i32).wrapping_add(at_e(h)),
                    g,
                    h,
                    g_turning: g,
                    still: 0,
                    along: [of(normal, second), of(normal, third)],
                    ahead: [of(ahead, second), of(ahead, third)],
                    normal: normal.map(|v| nearest(i64::from(v), 14) as i32),
                    turns: true,
                }
            }
        }
    }
}

/// Headings on either side of the estimate's at which [`farthest`] evaluates facets.
const SIDE: i32 = 8;

/// Returns the pose of a set that is farthest beyond a facet of a layout's first piece, or nearest to one. Searches
/// the sections at seventeen headings, and some around the farthest. Relative to the estimate, in world axes: um, um,
/// 2^-24 turn. For reports.
pub(super) fn farthest(facets: &Facets<'_>, set: &PoseSet, goal: Pose) -> [i64; 3] {
    let Some(sweep) = Sweep::of(facets, set, goal) else {
        return [0; 3];
    };
    let mut most = Touching::NONE;
    for frame in facets.pieces().take(1).flat_map(|piece| piece.frames()) {
        let point = [i32::from(frame.x), i32::from(frame.y)];
        for facet in frame.facets() {
            let mut own = Touching::NONE;
            let at = |e: i32, own: &mut Touching| {
                let section = sweep.section(facet, frame.axes, point, e);
                let found = sweep.touching(facet, &section, e);
                if found.beyond > own.beyond {
                    *own = found;
                }
            };
            for k in SIDE.wrapping_neg()..=SIDE {
                at(k << 12, &mut own);
            }
            // Down to 1/64, as finely as roots are known.
            for step in [1 << 11, 1 << 10, 1 << 9] {
                let e = own.e;
                at(e.wrapping_add(step).min(1 << U), &mut own);
                at(e.wrapping_sub(step).max(-(1 << U)), &mut own);
            }
            if own.beyond > most.beyond {
                most = own;
            }
        }
    }
    most.offset
}

/// The point where a section reaches farthest along a facet's normal.
#[derive(Clone, Copy)]
struct Touching {
    /// Its distance beyond the facet, fine units.
    beyond: i64,
    /// u of the section, 2^-15.
    e: i32,
    /// Relative to the estimate: um, um, 2^-24 turn.
    offset: [i64; 3],
}

impl Touching {
    const NONE: Self = Self {
        beyond: i64::MIN,
        e: 0,
        offset: [0; 3],
    };
}

impl Touching {
    /// Returns the pose after a movement along the normal that turns it outwards, to first order.
    fn moved(self, movement: &Movement, section: &Section) -> Self {
        if movement.is_none() {
            return self;
        }
        let [nx, ny] = section.normal.map(i64::from);
        let length = sqrt_ceil(squares(nx, ny)).max(1);
        let along = |v: i64| {
            let moved = v.wrapping_mul(i64::from(movement.by.translation_um()));
            towards_zero(moved, length)
        };
        let slope = i64::from(section.s.saturating_abs());
        let swung = slope.wrapping_mul(i64::from(movement.turn)) >> 28;
        let turn = i64::from(movement.by.yaw_q24());
        let turn = if section.s < 0 {
            turn.wrapping_neg()
        } else {
            turn
        };
        let [x, y, yaw] = self.offset;
        Self {
            beyond: self
                .beyond
                .wrapping_add(i64::from(movement.length))
                .wrapping_add(swung),
            e: self.e,
            offset: [
                x.wrapping_add(along(nx)),
                y.wrapping_add(along(ny)),
                yaw.wrapping_add(turn),
            ],
        }
    }
}

impl Sweep {
    /// Returns the pose of a section that is farthest along a facet's normal.
    fn touching(&self, facet: Facet, section: &Section, e: i32) -> Touching {
        let yaw = i64::from(self.yaw).wrapping_mul(i64::from(e)) >> U;
        let beyond = i64::from(section.c).wrapping_sub(section.left);
        // The directions of the other two columns, or of the plane's axes, along the normal.
        let (columns, [a, b], share) = match self.radius {
            Some(radius) => {
                let normal = match section.turns {
                    true => self.normal(facet, e),
                    false => [i32::from(facet.x), i32::from(facet.y)],
                };
                let along = normal.map(i64::from);
                let fine = nearest(i64::from(radius) << 14, self.unit) as i32;
                ([[fine, 0], [0, fine]], along, 1 << U)
            }
            None => {
                let [_, second, third] = self.columns;
                (
                    [second, third],
                    section.along.map(i64::from),
                    i64::from(Root::of(e).low()),
                )
            }
        };
        let length = sqrt_ceil(squares(a, b)).max(1);
        let share = |v: i64| {
            let v = v.wrapping_mul(share);
            towards_zero(v, length)
        };
        let (a2, a3) = (share(a), share(b));
        let [f, ..] = self.columns;
        let [[x2, y2], [x3, y3]] = columns;
        let axis = |f: i32, second: i32, third: i32| {
            let fine = i64::from(f)
                .wrapping_mul(i64::from(e))
                .wrapping_add(i64::from(second).wrapping_mul(a2))
                .wrapping_add(i64::from(third).wrapping_mul(a3))
                >> U;
            // To micrometres: 2^29 * 2^12.
            fine.wrapping_shl(self.unit) >> 14
        };
        let [fx, fy] = f;
        let reach = match self.radius {
            Some(radius) => self.along_any(facet, i64::from(radius)),
            None => length.wrapping_mul(i64::from(Root::of(e).low())) >> U,
        };
        let touching = Touching {
            beyond: beyond.wrapping_add(reach),
            e,
            offset: [axis(fx, x2, x3), axis(fy, y2, y3), yaw],
        };
        touching.moved(&self.movement, section)
    }

    /// Returns a facet's normal in world axes at u = e, for a facet in robot axes, 2^-14.
    fn normal(&self, facet: Facet, e: i32) -> [i32; 2] {
        let [c, s] = self.turned_to(e);
        let (nx, ny) = (i32::from(facet.x), i32::from(facet.y));
        let x = product(c, nx).wrapping_sub(product(s, ny));
        let y = product(s, nx).wrapping_add(product(c, ny));
        [nearest(x, 30) as i32, nearest(y, 30) as i32]
    }
}

impl Section {
    /// Returns the result of the test of the slab about this section.
    pub fn slab(&self, sweep: &Sweep, e: i32, width: &Width) -> Slab {
        // Sections of a cylinder do not shrink with u.
        let is_cylinder = sweep.radius.is_some();
        let root = if is_cylinder {
            Root::CYLINDER
        } else {
            Root::of(e)
        };
        if self.is_outside(&root) {
            return Slab::Outside;
        }
        let Reach { n, tilt } = self.reach(width);
        let part = |value: i64, of: i32| (value.wrapping_mul(i64::from(of)) >> 28).wrapping_add(1);
        let in_u = i64::from(width.in_u);
        let over = |value: i64| value.wrapping_mul(in_u) >> U;
        let mut fixed = self
            .left
            .wrapping_sub(SLACK)
            .wrapping_sub(part(i64::from(self.s.saturating_abs()), width.rest));
        let mut more = 0;
        if !sweep.movement.is_none() {
            let [first, parabola] = self.movement(&sweep.movement, width);
            fixed = fixed.wrapping_sub(first);
            more = parabola.wrapping_sub(first);
        }
        let (mut bend, mut rise) = (0, 0);
        if self.turns {
            let g = over(i64::from(self.g_turning.saturating_abs())).wrapping_add(1);
            let change = if is_cylinder {
                0
            } else {
                root.change(width.in_u)
            };
            let changes = tilt.saturating_abs().wrapping_mul(i64::from(change)) >> U;
            fixed = fixed
                .wrapping_sub(part(g, width.shortening_rest))
                .wrapping_sub(changes)
                .wrapping_sub(2);
            bend = part(over(i64::from(self.h.max(0))).wrapping_add(1), width.w);
            rise = tilt
                .wrapping_mul(i64::from(root.up))
                .wrapping_shr(width.in_u.trailing_zeros())
                .wrapping_sub(product(self.g_turning, width.shortening()) >> 28);
        }
        let turned = sweep.turn().wrapping_mul(i64::from(self.s)) >> 28;
        let g = i64::from(self.g)
            .wrapping_add(turned.wrapping_mul(i64::from(width.kappa)) >> 28)
            .wrapping_add(rise);
        let shrunk = i64::from(self.c.saturating_abs()).wrapping_mul(i64::from(width.cos)) >> 28;
        let c = if self.c < 0 {
            shrunk.wrapping_neg()
        } else {
            i64::from(self.c)
        };
        let spare = fixed.wrapping_sub(c);
        if !is_cylinder && at_most(spare.wrapping_sub(bend), g, n, e, width.in_u) {
            return Slab::Inside;
        }
        let curve = if self.c > 0 {
            product(self.c, width.versine()) >> 28
        } else {
            0
        };
        let curve = curve.wrapping_sub(bend);
        let spare = spare.wrapping_sub(more);
        let is_inside = if is_cylinder {
            let slope = over(g.saturating_abs()).wrapping_add(3);
            peak_at_most(spare.wrapping_sub(n).wrapping_sub(4), slope, curve)
        } else {
            parabola_at_most(spare, g, n, curve, &root, width.in_u)
        };
        if is_inside {
            Slab::Inside
        } else {
            Slab::Unsure
        }
    }

    /// Returns upper bounds of a movement's growth along the normal over a slab, fine units: with `C cos(T x)` as in the first
    /// bound, and as in the parabola.
    ///
    /// A turn by d changes `C cos y + S sin y` by the integral of `-C sin + S cos` over angles up to `|y| + d`: at most
    /// `d (|S| + |C| (w + d/2))`. The first bound takes C for `C cos` if C is above zero, which no turn exceeds. In robot axes the
    /// offsets of the ellipsoid turn with the robot: at most d times the longest.
    #[inline(never)]
    fn movement(&self, movement: &Movement, width: &Width) -> [i64; 2] {
        let Movement {
            length,
            turn,
            broad,
            ..
        } = *movement;
        let (w, turn) = (i64::from(width.w), i64::from(turn));
        let away = w.wrapping_add(turn >> 1).wrapping_add(1).min(ONE);
        // Below 2^31 * 2^28.
        let bent = i64::from(self.c.saturating_abs()).wrapping_mul(away) >> 28;
        let aside = i64::from(self.s.saturating_abs()).wrapping_add(2 * SLACK);
        let aside = if self.turns {
            aside.wrapping_add(i64::from(broad))
        } else {
            aside
        };
        let moved = self.moved(i64::from(length), w.wrapping_add(turn).min(ONE));
        // Below 2^32.1 * 2^30.7.
        let with = |slope: i64| {
            let swung = (slope.wrapping_mul(turn) >> 28).wrapping_add(1);
            moved.wrapping_add(swung)
        };
        let bent = aside.wrapping_add(bent);
        [with(if self.c < 0 { bent } else { aside }), with(bent)]
    }

    /// Returns an upper bound of a length times that of the section's normal, while normals of robot axes turn by up to w, 2^-28 rad.
    ///
    /// In a weighted sum a part of the normal turns. No normal and no weighted sum of normals is longer than 1 by more than 2^-8.
    fn moved(&self, length: i64, w: i64) -> i64 {
        const LONGEST: i64 = (1 << 14) + (1 << 6) + 1;
        let [x, y] = self.normal.map(i64::from);
        let turned = if self.turns {
            (w.wrapping_mul(LONGEST) >> 28).wrapping_add(2)
        } else {
            0
        };
        let normal = sqrt_ceil(squares(x, y))
            .wrapping_add(turned)
            .wrapping_add(2)
            .min(LONGEST);
        (length.wrapping_mul(normal) >> 14).wrapping_add(1)
    }

    /// Returns `true` if the section itself is beyond the facet.
    pub fn is_outside(&self, root: &Root) -> bool {
        let left = self
            .left
            .wrapping_add(SLACK)
            .wrapping_sub(i64::from(self.c));
        let [a, b] = self.along.map(i64::from);
        // (N r)^2: 2^31 * 2^30.
        let square = squares(a, b) >> 30;
        let low = u64::from(root.low());
        let reach = square.wrapping_mul(low).wrapping_mul(low);
        left < 0 || left.unsigned_abs().saturating_mul(left.unsigned_abs()) < reach
    }

    /// Returns the reach of the slab's sections from their centres along the normal.
    fn reach(&self, width: &Width) -> Reach {
        let ([a2, a3], [b2, b3]) = (self.along.map(i64::from), self.ahead.map(i64::from));
        // Two coordinates within 1.6, and the least value that the parabola accepts.
        let root = |a: i64, b: i64| sqrt_ceil(squares(a, b)).wrapping_add(4).max(16);
        if !self.turns {
            return Reach {
                n: root(a2, a3),
                tilt: 0,
            };
        }
        // Squares of lengths below 2^29.2.
        let (along_square, ahead_square) = (squares(a2, a3), squares(b2, b3));
        let grown = ahead_square.saturating_sub(along_square);
        let grown = (grown >> 28)
            .wrapping_add(1)
            .wrapping_mul(width.sine_square.unsigned_abs().into());
        let p = sqrt_ceil(along_square.wrapping_add(grown)).max(16);
        let slope = slope(a2.wrapping_mul(b2).wrapping_add(a3.wrapping_mul(b3)), p);
        let of_slope = |part: i32| slope.wrapping_mul(i64::from(part)) >> 28;
        let off = (slope
            .saturating_abs()
            .wrapping_mul(i64::from(width.leaning_rest)))
            >> 28;
        // In world axes: `cos(T x)` times the whole, and the rest of the part that does not turn.
        let versine = i64::from((ONE as i32).wrapping_sub(width.cos));
        let still = if self.still > 0 {
            (i64::from(self.still).wrapping_mul(versine) >> 28).wrapping_add(1)
        } else {
            0
        };
        // a and b are within 5.6, the error of the heading included; the quotient and two products within 3.
        Reach {
            n: p.wrapping_add(off).wrapping_add(still).wrapping_add(9),
            tilt: of_slope(width.leaning),
        }
    }
}

/// Returns `product / p` to within 2^-14 of itself and 2, by a quotient of 32 bits: a longer one takes more stack. p is below 2^31, above
/// zero.
#[inline(always)]
fn slope(product: i64, p: i64) -> i64 {
    let magnitude = product.unsigned_abs();
    let above = |bits: u32, zeros: u32| 64u32.wrapping_sub(zeros).saturating_sub(bits);
    let down = above(32, magnitude.leading_zeros());
    let less = above(16, p.leading_zeros());
    let quotient = (magnitude.wrapping_shr(down) as u32)
        .checked_div(p.wrapping_shr(less) as u32)
        .unwrap_or(0);
    let quotient = i64::from(quotient).wrapping_shl(down).wrapping_shr(less);
    if product < 0 {
        quotient.wrapping_neg()
    } else {
        quotient
    }
}

/// An upper bound of `|F23' n_t|` over a slab: `n + tilt x / h`.
struct Reach {
    n: i64,
    tilt: i64,
}

/// `sqrt(1 - e^2)` for e = 0, 1/64, ..., 1, 2^-15, up.
const ROOTS: [u16; 65] = [
    32_768, 32_764, 32_752, 32_732, 32_704, 32_668, 32_624, 32_572, 32_511, 32_443, 32_366, 32_281,
    32_187, 32_085, 31_975, 31_856, 31_728, 31_591, 31_446, 31_291, 31_127, 30_954, 30_772, 30_579,
    30_377, 30_165, 29_943, 29_710, 29_466, 29_211, 28_945, 28_668, 28_378, 28_077, 27_762, 27_434,
    27_093, 26_737, 26_367, 25_982, 25_580, 25_162, 24_725, 24_271, 23_796, 23_301, 22_783, 22_242,
    21_674, 21_080, 20_455, 19_797, 19_103, 18_368, 17_588, 16_756, 15_864, 14_901, 13_853, 12_698,
    11_403, 9_915, 8_128, 5_770, 0,
];

/// `sqrt(1 - e^2)` for an e that is a multiple of 2^-6.
pub(super) struct Root {
    e: i32,
    /// `1 - e^2`, 2^-30.
    square: u32,
    /// Its root, 2^-15, up.
    up: u32,
}

impl Root {
    /// For a cylinder, at any heading.
    pub const CYLINDER: Self = Self {
        e: 0,
        square: 1 << 30,
        up: 1 << U,
    };

    #[inline(always)]
    pub fn of(e: i32) -> Self {
        let number = e.unsigned_abs() >> 9;
        Self {
            e,
            square: (1u32 << 30).saturating_sub(e.wrapping_mul(e).unsigned_abs()),
            up: ROOTS
                .get(number as usize)
                .map_or(0, |root| u32::from(*root)),
        }
    }

    /// Returns the largest difference of r on a slab from r at its middle e, 2^-15, rounded up.
    fn change(&self, h: i32) -> u32 {
        let far = self.e.saturating_abs().wrapping_add(h);
        let near = self.e.saturating_abs().wrapping_sub(h).max(0);
        let down = self.up.saturating_sub(Self::of(far).low());
        let up = Self::of(near).up.saturating_sub(self.low());
        down.max(up)
    }

    /// Returns the root, rounded down.
    pub const fn low(&self) -> u32 {
        self.up.saturating_sub(1)
    }
}

/// Returns `true` if `g x + N r(e + x) <= spare` for `|x| <= h`. Sound for any g below 2^34 and N below 2^32.
#[inline(never)]
fn at_most(spare: i64, g: i64, n: i64, e: i32, h: i32) -> bool {
    // The slope at an end, times r, is surely not below zero.
    let rises = |g: i64, end: i32, root: &Root| {
        let r = if g < 0 { root.up } else { root.low() };
        g.wrapping_mul(i64::from(r)) >= n.wrapping_mul(i64::from(end))
    };
    let at_end = |g: i64, root: &Root| {
        let g = g.wrapping_mul(i64::from(h)) >> U;
        let n = n.wrapping_mul(i64::from(root.up)) >> U;
        g.wrapping_add(n).wrapping_add(2) <= spare
    };
    let (first, last) = (e.wrapping_sub(h), e.wrapping_add(h));
    let root = Root::of(last);
    if rises(g, last, &root) {
        return at_end(g, &root);
    }
    let root = Root::of(first);
    let mirrored = g.wrapping_neg();
    if rises(mirrored, first.wrapping_neg(), &root) {
        return at_end(mirrored, &root);
    }
    let left = spare.wrapping_add(g.wrapping_mul(i64::from(e)) >> U);
    if left < 0 {
        return false;
    }
    // Eighths: squares below 2^63.
    let up = |v: i64| v.unsigned_abs().wrapping_add(7) >> 3;
    let left = left.unsigned_abs() >> 3;
    left.wrapping_mul(left) >= squares(up(g) as i64, up(n) as i64)
}

/// Returns `true` if `g x + N r(e + x) - curve (x / h)^2 <= spare` for `|x| <= h`, by a parabola above N r.
///
/// For any M > 0: `N r(u) <= (N^2 / M + M (1 - u^2)) / 2`. With `M = N / r(e)`, about, it touches at e.
#[inline(never)]
fn parabola_at_most(spare: i64, g: i64, n: i64, curve: i64, root: &Root, h: i32) -> bool {
    // 1 / r, 2^-15, more than 2^30 / up; so N^2 / M <= N up / 2^15 + 2 for N >= 16.
    let inverse = (1u32 << 30)
        .checked_div(root.up)
        .unwrap_or(0)
        .wrapping_add(1);
    let m = n.wrapping_mul(i64::from(inverse)) >> U;
    let (e, h) = (i64::from(root.e), i64::from(h));
    let constant = (n.wrapping_mul(i64::from(root.up)) >> U)
        .wrapping_add(4)
        .wrapping_add(m.wrapping_mul(i64::from(root.square)) >> 30)
        >> 1;
    let left = spare.wrapping_sub(constant).wrapping_sub(4);
    // Over the slab the rest is `slope y - curve y^2`, -1 <= y <= 1.
    let slope = (g.wrapping_mul(h) >> U)
        .wrapping_sub((m.wrapping_mul(e) >> U).wrapping_mul(h) >> U)
        .saturating_abs()
        .wrapping_add(3);
    let curve = curve.wrapping_add(m.wrapping_mul(h.wrapping_mul(h)) >> 31);
    peak_at_most(left, slope, curve)
}

/// Returns `true` if `slope y - curve y^2 <= left` for `|y| <= 1`; the slope must not be below zero.
#[inline(always)]
fn peak_at_most(left: i64, slope: i64, curve: i64) -> bool {
    if !(left >= 0) {
        return false;
    }
    if !(slope < curve.wrapping_mul(2)) {
        return slope.wrapping_sub(curve) <= left;
    }
    // No peak is higher than the slope alone, which also decides if the curve is too small for eighths.
    if slope <= left {
        return true;
    }
    // Eighths: products below 2^62.
    let slope = slope.wrapping_add(7) >> 3;
    slope.wrapping_mul(slope) <= (curve >> 3).wrapping_mul(left >> 3).wrapping_mul(4)
}

fn squares(a: i64, b: i64) -> u64 {
    let (a, b) = (a.unsigned_abs(), b.unsigned_abs());
    a.wrapping_mul(a).wrapping_add(b.wrapping_mul(b))
}

/// Returns `a . b`.
fn dot([ax, ay]: [i32; 2], [bx, by]: [i32; 2]) -> i64 {
    product(ax, bx).wrapping_add(product(ay, by))
}

/// Returns `value / 2^by` to the nearest.
fn nearest(value: i64, by: u32) -> i64 {
    value
        .wrapping_add(1i64.wrapping_shl(by) >> 1)
        .wrapping_shr(by)
}

#[cfg(test)]
pub(super) mod tests;
