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

mod slab;
mod touching;

pub(super) use self::slab::Root;
pub(super) use self::touching::farthest;
use super::compact;
use crate::num::{BinaryAngle, product, sqrt_ceil};
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
    /// `w^3/6 + 2 w^5/15`, 2^-28, up, and the errors of `leaning` and [`slab::slope`].
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
                    // From a turn on, every heading is reached.
                    turn: (i64::from(by.yaw_q24())
                        .min(i64::from(ONE_TURN))
                        .wrapping_mul(TAU)
                        >> 20)
                        .wrapping_add(1) as i32,
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
