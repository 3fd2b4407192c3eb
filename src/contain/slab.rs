//! One facet over a slab of headings: an upper bound of how far the set reaches beyond it.
//!
//! At the heading offset `t = T u` (`-1 <= u <= 1`, T the largest offset) the ellipsoid `{F u : |u| <= 1}` is an ellipse about `f u`, f the
//! first column of F in the plane, with the other two columns times `r(u) = sqrt(1 - u^2)`. (A cylinder is a disc at every heading: `f = 0`,
//! `r = 1`.) A slab has its middle e and its half width h in u, and its half width `w = T h <= 1/2` in heading. With `u = e + h y` and
//! `tau = w y` (`-1 <= y <= 1`), n the facet's normal in world axes at the middle heading, A the part of the point that turns there, J a
//! quarter turn and `D = f h y + F23 s r(u)` (`|s| <= 1`), the set reaches beyond the middle by
//!
//! - world axes (`P = p + R(yaw) v`): `n . D + n . (R(tau) A - A)`;
//! - robot axes (`P = R(-yaw) (p - q)`): `n_tau . D + (n_tau - n) . A`, where n_tau is n turned by tau.
//!
//! # The bound
//!
//! | part | at most |
//! |---|---|
//! | A: `-C (1 - cos tau) + S sin tau`; the first term is at most 0 for C > 0, `C = n . A`, S its derivative | `S w y + max(-C, 0) w^2/2 + abs(S) w^3/6` |
//! | world axes: `n . D` | `G y + N r(u)`, `G = h n . f`, `N = abs(F23' n)` |
//! | robot axes: `n_tau . D` | the same with `n + tau J n`, and `w^2/2 abs(D)` |
//! | its `tau y h (J n) . f` | `max(H, 0)`, `H = w h (J n) . f` |
//! | its `abs(F23' n + tau F23' J n)` is convex in y | the chord between its ends: `N + L y` |
//! | `L y r(u)` | `L r(e) y + abs(L) max abs(r(u) - r(e))` |
//! | what is left: `g y + N r(e + h y)` | at an end, or `(hypot(g, h N) - g e) / h` |
//! | growth by a movement: radius rho, turn d, in a strip of half width a | `min(rho, rho abs(n . u) + a abs(n . Ju)) + d (abs(S) + abs(C) (w + d/2))`, in robot axes also d times the longest offset |
//!
//! For the whole set (`e = 0`, `h = 1`) the last but one is `hypot(g, N)` with the larger end for N. All errors of the bound fall with the square of
//! w, or faster.
//!
//! # Rounding
//! Every number of a [`Section`] is in extent units, except those of the point. [`Placed::slack`] covers what is rounded to the nearest; everything
//! else rounds against acceptance. Its parts are listed in `contain/error_budget.rs`, which adds them up and searches for the largest sum. The
//! proof of a table covers the rounding of a point, at any heading ([`super::facet_clearance_q14`]).

use super::placed::{Movement, Placed, Seen, dot, q15};
use crate::num::{product, sqrt_ceil, towards_zero, wide};
use crate::set::Turn;
use crate::table::parts;
use crate::table::{Axes, Facet, NORMAL_BITS};

/// A section is beyond a facet if it is so by more than this, extent units.
const BEYOND: i32 = 20;
/// Largest number of halvings of `[-1, 1]`.
pub(super) const DEEPEST: u32 = 6;
/// Fraction bits of u.
pub(super) const U: u32 = 15;
/// Squares are compared up to this one's, extent units.
const MOST: i32 = 0xffff;
/// No slab reaches so far from its middle, extent units.
const FAR: i32 = 1 << 17;

/// A slab's half width.
#[derive(Clone, Copy, Debug)]
pub(super) struct Width {
    /// The number of halvings of `[-1, 1]`.
    pub depth: u32,
    /// w: at most half a radian.
    turn: Turn,
    /// The right shift of a product of the turn and a length in length units, to extent units.
    shift: u32,
    /// `w^2/2` times the longest offset from a slab's middle, quarters of an extent unit, up.
    second_order: i32,
}

/// The middle of a slab.
#[derive(Clone, Copy, Debug)]
pub(super) struct Middle {
    /// u, 2^-15.
    pub e: i32,
    /// Cosine and sine of the heading, 2^-15.
    pub facing: [i32; 2],
    /// The middle of the section there from the estimate, extent units, world axes.
    pub offset: [i32; 2],
}

impl Middle {
    /// Returns a vector of robot axes in world axes, to the nearest.
    #[cfg_attr(small_code, inline(never))]
    #[cfg_attr(not(small_code), inline(always))]
    pub fn outwards(&self, [x, y]: [i32; 2]) -> [i32; 2] {
        let [c, s] = self.facing;
        [
            q15(dot([c, s.wrapping_neg()], [x, y])),
            q15(dot([s, c], [x, y])),
        ]
    }

    /// Returns a vector of world axes in robot axes, to the nearest.
    #[cfg_attr(small_code, inline(never))]
    #[cfg_attr(not(small_code), inline(always))]
    pub fn inwards(&self, [x, y]: [i32; 2]) -> [i32; 2] {
        let [c, s] = self.facing;
        [
            q15(dot([c, s], [x, y])),
            q15(dot([s.wrapping_neg(), c], [x, y])),
        ]
    }
}

impl Width {
    /// No width.
    pub const NONE: Self = Self {
        depth: 0,
        turn: Turn::NONE,
        shift: 0,
        second_order: 0,
    };

    /// Returns the width of the first slabs of a set that turns by `yaw`, at most a turn: `whole`, or its halves.
    pub fn first(whole: Turn, yaw: u32) -> Self {
        let mut depth = 0u32;
        let mut turn = whole;
        while turn.radians_q15 > Turn::LARGEST && depth < 4 {
            depth = depth.wrapping_add(1);
            let up = 1u32.wrapping_shl(depth).wrapping_sub(1);
            turn = Turn::of(yaw.wrapping_add(up).wrapping_shr(depth));
        }
        Self {
            depth,
            turn,
            shift: 0,
            second_order: 0,
        }
    }

    /// Returns the width with the units of a set: finer than the length unit by `finer` bits, with offsets up to `broad`.
    pub fn with_units(mut self, finer: i32, broad: i32) -> Self {
        self.shift = self.turn.shift(finer);
        // A slab beside the estimate: at most sqrt(1 + h^2) <= 1.12 times the longest offset.
        let longest = if self.depth == 0 {
            broad
        } else {
            broad.wrapping_add(broad >> 3)
        };
        // 2^15.2 * 2^13.
        let bent = longest.wrapping_mul(self.turn.square_q15 as i32) >> 14;
        // A normal is longer than one by up to 2^-8.
        self.second_order = bent.wrapping_add(bent >> 8).wrapping_add(2);
        self
    }

    /// Returns the effect of all headings of the set, from that of a slab's.
    #[inline(always)]
    pub fn of_all(&self, slab: i32) -> i32 {
        slab.wrapping_shl(self.depth)
    }

    /// Returns half the width.
    #[inline(never)]
    pub fn halved(&self) -> Self {
        let turn = self.turn.halved();
        // Offsets from the middle of the estimate's slab are shorter.
        let longer = if self.depth == 0 { 3 } else { 31 };
        let second_order = self
            .second_order
            .wrapping_add(self.second_order.wrapping_shr(longer));
        let second_order = (second_order >> 2).wrapping_add(1);
        Self {
            depth: self.depth.wrapping_add(1),
            turn,
            shift: self.shift.wrapping_add(1).min(32),
            second_order,
        }
    }

    /// Returns the width at a depth, halved as often as it takes.
    pub fn halved_to(mut self, depth: u32) -> Self {
        while self.depth < depth {
            self = self.halved();
        }
        self
    }

    /// Returns the half width in u, 2^-15.
    pub const fn in_u(&self) -> i32 {
        1i32.wrapping_shl(U.wrapping_sub(self.depth))
    }

    /// Returns a length (length units) times w, extent units, to the nearest.
    #[inline(always)]
    pub fn turned(&self, length: i32) -> i32 {
        self.turn.at(length, self.shift)
    }

    /// Returns a number times w, to the nearest.
    #[inline(always)]
    pub fn turn_at(&self, value: i32) -> i32 {
        self.turn.at(value, self.turn.shift(0))
    }
}

/// One facet at the middle of a slab. The numbers are linear in the facet's normal, offset and point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Section {
    /// The slack of the middle, extent units, rounded down.
    pub left: i32,
    /// C, length units, rounded down.
    pub c: i32,
    /// S, length units.
    pub s: i32,
    /// S w and G, extent units.
    pub slope: i32,
    /// H, extent units.
    pub bend: i32,
    /// F23' n, extent units.
    pub along: [i32; 2],
    /// w F23' J n, robot axes only, extent units.
    pub ahead: [i32; 2],
    /// n, 2^-14.
    pub normal: [i32; 2],
    /// `true` if n turns with the heading: robot axes.
    pub turns: bool,
    /// `true` if the effect of the turn on the offsets is more than its first order. A disc is the same at every heading.
    pub bends: bool,
}

/// The result of a slab's test.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Slab {
    /// No pose of the slab is beyond the facet.
    Inside,
    /// The middle section of the slab is beyond the facet.
    Outside,
    /// The bound does not decide.
    Unsure,
}

impl Section {
    /// Returns the section of a facet at the middle of a slab; `seen` is the frame's point there.
    #[inline(always)]
    pub fn of(facet: Facet, seen: &Seen, placed: &Placed, at: &Middle, width: &Width) -> Self {
        let own = [i32::from(facet.x), i32::from(facet.y)];
        let turns = matches!(seen.axes, Axes::Robot);
        let normal = if turns { at.outwards(own) } else { own };
        let [nx, ny] = normal;
        let ahead = [ny.wrapping_neg(), nx];
        let [ax, ay] = seen.arm;
        let aside = if turns {
            [ay, ax.wrapping_neg()]
        } else {
            [ay.wrapping_neg(), ax]
        };
        let mut c = dot(own, seen.arm) >> NORMAL_BITS;
        let mut s = nearest(dot(own, aside));
        let [sx, sy] = seen.swing;
        // The turn is known to 3.8e-5.
        let turned = sx.unsigned_abs().wrapping_add(sy.unsigned_abs()) >> 14;
        let mut left = placed.spare(facet, seen).wrapping_sub(turned as i32);
        let [f, second, third] = placed.columns;
        let along = dot(normal, f);
        if parts::HEADINGS && at.e != 0 {
            // u is a multiple of 2^-6.
            left = left.wrapping_sub(up((along.wrapping_add(32) >> 6).wrapping_mul(at.e >> 9)));
            if turns {
                // Of extents, in length units.
                let long = |v: i32| (v >> NORMAL_BITS).wrapping_shl(placed.down) >> NORMAL_BITS;
                c = c.wrapping_add(long(dot(normal, at.offset)));
                s = s.wrapping_add(long(dot(ahead, at.offset)));
            }
        }
        let along = along.wrapping_shr(width.depth);
        let mut section = Self {
            left,
            c,
            s,
            slope: nearest(along.wrapping_add(dot(own, seen.swing))),
            bend: 0,
            along: [nearest(dot(normal, second)), nearest(dot(normal, third))],
            ahead: [0; 2],
            normal,
            turns,
            bends: turns && !placed.is_cylinder,
        };
        if turns {
            let turned = |column| width.turn_at(nearest(dot(ahead, column)));
            let half = 1i32.wrapping_shl(width.depth) >> 1;
            let f = f.map(|v| v.wrapping_add(half).wrapping_shr(width.depth));
            section.bend = turned(f);
            section.ahead = [turned(second), turned(third)];
        }
        section
    }

    /// Returns the result of the test of the slab about this section.
    #[inline(always)]
    pub fn slab(&self, placed: &Placed, e: i32, width: &Width) -> Slab {
        if self.left >= FAR {
            return Slab::Inside;
        }
        let root = placed.root(e);
        if self.is_outside(&root) {
            return Slab::Outside;
        }
        let square = width.turn.square_q15 as i32;
        // In quarters: |S| w^3/6, below 2^15 * 2^13, and 2^13 / 6.
        let swing = long_lever(&width.turn, self.s.wrapping_abs(), width.shift);
        let mut less = (swing.wrapping_mul(square) >> 15).wrapping_mul(10_923) >> 14;
        if self.c < 0 {
            // |C| w^2/2: 2^17 * 2^13, to extent units.
            let bent = self.c.wrapping_neg().wrapping_mul(square);
            less = less.wrapping_add(bent.wrapping_shr(placed.down));
        }
        if self.bends {
            less = less
                .wrapping_add(width.second_order)
                .wrapping_add(self.bend.max(0) << 2);
        }
        // Each of two was rounded down by less than a quarter.
        let mut less = (less.wrapping_add(5) >> 2).wrapping_add(placed.slack(self.turns, e));
        if let Some(movement) = &placed.movement {
            less = less.wrapping_add(self.moved(movement, placed, width));
        }
        let spare = self.left.wrapping_sub(less);
        let is_inside = if width.depth == 0 {
            self.whole_at_most(spare, placed.is_cylinder)
        } else {
            parts::HEADINGS && self.at_most(spare, &root, width, placed.is_cylinder)
        };
        if is_inside {
            Slab::Inside
        } else {
            Slab::Unsure
        }
    }

    /// Returns the larger square of `|F23' n_tau|` at both ends.
    #[inline(always)]
    fn ends(&self) -> [u32; 2] {
        let ([a2, a3], [b2, b3]) = (self.along, self.ahead);
        [
            squares(a2.wrapping_add(b2), a3.wrapping_add(b3)),
            squares(a2.wrapping_sub(b2), a3.wrapping_sub(b3)),
        ]
    }

    /// Returns `true` if the whole set reaches at most `spare` along the normal.
    #[inline(always)]
    fn whole_at_most(&self, spare: i32, is_cylinder: bool) -> bool {
        let [last, first] = self.ends();
        let n = last.max(first);
        let (spare, more) = if is_cylinder {
            (spare.wrapping_sub(self.slope.wrapping_abs()), 0)
        } else {
            (spare, squares(self.slope, 0))
        };
        let is_short = self.slope.wrapping_abs() <= MOST;
        is_short && spare >= 0 && squares(spare.min(MOST), 0) >= n.saturating_add(more)
    }

    /// Returns `true` if the slab reaches at most `spare` along the normal.
    #[inline(never)]
    fn at_most(&self, spare: i32, root: &Root, width: &Width, is_cylinder: bool) -> bool {
        if spare < 0 {
            return false;
        }
        let [last, first] = self.ends().map(|square| sqrt_ceil(square.into()) as i32);
        let n = last.wrapping_add(first).wrapping_add(1) >> 1;
        let tilt = last.wrapping_sub(n);
        if is_cylinder {
            let most = self.slope.wrapping_add(tilt).wrapping_abs();
            return most.wrapping_add(n) <= spare;
        }
        let mut spare = spare;
        let mut g = self.slope;
        if tilt != 0 {
            g = g.wrapping_add(q15(tilt.wrapping_mul(root.up)));
            let change = tilt.wrapping_abs().wrapping_mul(root.change(width.in_u()));
            spare = spare.wrapping_sub(change >> 15).wrapping_sub(2);
        }
        peak_at_most(spare, g, n, root.e, width.depth)
    }

    /// Returns an upper bound of a movement's growth along the normal over a slab, extent units.
    #[inline(never)]
    fn moved(&self, movement: &Movement, placed: &Placed, width: &Width) -> i32 {
        let turn = &movement.turn;
        let radians = turn.radians_q15;
        // |S| + |C| (w + d/2), length units: 2^17 / 4 * 2^14.6.
        let away = width
            .turn
            .radians_q15
            .wrapping_add(radians >> 1)
            .wrapping_add(1);
        let bent = (self.c.wrapping_neg().max(0) >> 2)
            .wrapping_add(1)
            .wrapping_mul(away)
            >> 13;
        let lever = self.s.wrapping_abs().wrapping_add(bent).wrapping_add(2);
        let mut moved = long_lever(turn, lever, movement.shift);
        // n with the part of it that turns; no normal and no weighted sum of normals is longer than 1 by more than 2^-8.
        const LONGEST: i32 = (1 << 14) + (1 << 6) + 1;
        let turned = if self.turns {
            width.turn.radians_q15.wrapping_add(radians) >> 1
        } else {
            0
        };
        if self.turns {
            // The longest offset turns with the robot: 2^15.2 * 2^14.
            let longest = placed.broad.wrapping_add(placed.broad >> 3).wrapping_add(1);
            moved = moved
                .wrapping_add(longest.wrapping_mul(radians) >> 15)
                .wrapping_add(1);
        }
        let along = |length: i32, normal: i32| {
            // 2^15 * 2^14.1.
            let normal = normal.wrapping_add(turned).wrapping_add(4).min(LONGEST);
            (length.wrapping_mul(normal) >> 14).wrapping_add(1)
        };
        let [nx, ny] = self.normal;
        if movement.side == movement.length {
            let normal = sqrt_ceil(squares(nx, ny).into()) as i32;
            return moved.wrapping_add(along(movement.length, normal));
        }
        // Along the estimate's heading and across it: 2^14 * 2^15 each.
        let [c, s] = placed.facing;
        let part = |sum: i32| sum.wrapping_abs() >> 15;
        let ahead = part(nx.wrapping_mul(c).wrapping_add(ny.wrapping_mul(s)));
        let aside = part(ny.wrapping_mul(c).wrapping_sub(nx.wrapping_mul(s)));
        moved
            .wrapping_add(along(movement.length, ahead))
            .wrapping_add(along(movement.side, aside))
    }

    /// Returns the offset from the estimate of the section's pose that is farthest along the normal: x and y in world axes, extent units times 2^15.
    /// For reports, and for the choice of a piece.
    pub fn farthest(&self, placed: &Placed, e: i32) -> [i64; 2] {
        let [a, b] = self.along;
        let length = sqrt_ceil(squares(a, b).into()).max(1);
        let root = i64::from(placed.root(e).low());
        let share = |v: i32| towards_zero(i64::from(v).wrapping_mul(root), length);
        let (a, b) = (share(a), share(b));
        let [[fx, fy], [x2, y2], [x3, y3]] = placed.columns;
        let axis = |first: i32, second: i32, third: i32| {
            product(first, e)
                .wrapping_add(i64::from(second).wrapping_mul(a))
                .wrapping_add(i64::from(third).wrapping_mul(b))
        };
        [axis(fx, x2, x3), axis(fy, y2, y3)]
    }

    /// Returns `true` if the section itself is beyond the facet.
    pub fn is_outside(&self, root: &Root) -> bool {
        let left = self.left.wrapping_add(BEYOND);
        let [a, b] = self.along;
        if left < 0 {
            return true;
        }
        // (N r)^2, down: 2^15.3 * 2^15.
        let low = root.low();
        let reach =
            (squares(a, b) >> 16).wrapping_mul(low.wrapping_mul(low).unsigned_abs() >> 15) << 1;
        squares(left.min(MOST), 0) < reach
    }
}

/// Returns `true` if `g y + N r(e + h y) <= spare` for `|y| <= 1`.
fn peak_at_most(spare: i32, g: i32, n: i32, e: i32, depth: u32) -> bool {
    let h = 1i32.wrapping_shl(U.wrapping_sub(depth));
    // The derivative at an end, times r, is surely not below zero. `h u` is exact: u is a multiple of 2^-6.
    let rises = |g: i32, end: i32, root: &Root| {
        let r = if g < 0 { root.up } else { root.low() };
        // Halves, since a slope has 17 bits.
        (g >> 1).wrapping_mul(r) > n.wrapping_mul(end.wrapping_shr(depth)) >> 1
    };
    let at_end = |g: i32, root: &Root| {
        let reach = n.wrapping_mul(root.up) >> 15;
        g.wrapping_add(reach).wrapping_add(1) <= spare
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
    // h spare + g e >= hypot(g, h N), each times 2^6: exact; below 2^24.
    let scale = 6u32.wrapping_sub(depth);
    let left = spare
        .wrapping_shl(scale)
        .wrapping_add(g.wrapping_mul(e >> 9));
    if left < 0 {
        return false;
    }
    let square = |v: u32| wide(v, v);
    let reach =
        square(g.unsigned_abs() << 6).wrapping_add(square(n.unsigned_abs().wrapping_shl(scale)));
    square(left.unsigned_abs()) >= reach
}

/// Returns `a^2 + b^2`, for numbers below 2^15.5.
#[inline(always)]
pub(super) fn squares(a: i32, b: i32) -> u32 {
    let square = |v: i32| v.unsigned_abs().wrapping_mul(v.unsigned_abs());
    square(a).wrapping_add(square(b))
}

/// Returns at least a turn times a lever below 2^17 (length units), extent units: [`Turn::at`] takes a quarter of it.
#[inline(always)]
fn long_lever(turn: &Turn, lever: i32, shift: u32) -> i32 {
    // A turn of at most half a radian is shifted by 4 or more. Only a lever of 0 has larger ones.
    let quarter = lever.wrapping_add(3) >> 2;
    turn.at(quarter, shift.wrapping_sub(2)).wrapping_add(3)
}

/// Returns `value / 2^14`, rounded up.
#[inline(always)]
fn up(value: i32) -> i32 {
    value.wrapping_add((1 << NORMAL_BITS) - 1) >> NORMAL_BITS
}

/// Returns `value / 2^14`, rounded to the nearest.
#[inline(always)]
fn nearest(value: i32) -> i32 {
    value.wrapping_add(1 << (NORMAL_BITS - 1)) >> NORMAL_BITS
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
#[derive(Clone, Copy, Debug)]
pub(super) struct Root {
    e: i32,
    /// 2^-15, up.
    pub up: i32,
}

impl Root {
    /// For a cylinder, at any heading.
    pub const CYLINDER: Self = Self { e: 0, up: 1 << U };

    #[inline(always)]
    pub fn of(e: i32) -> Self {
        let number = e.unsigned_abs() >> 9;
        Self {
            e,
            up: ROOTS
                .get(number as usize)
                .map_or(0, |root| i32::from(*root)),
        }
    }

    /// Returns the root, rounded down.
    pub const fn low(&self) -> i32 {
        let low = self.up.wrapping_sub(1);
        if low < 0 { 0 } else { low }
    }

    /// Returns the largest difference of r on a slab from r at its middle e, 2^-15, rounded up.
    fn change(&self, h: i32) -> i32 {
        let far = self.e.wrapping_abs().wrapping_add(h);
        let near = self.e.wrapping_abs().wrapping_sub(h).max(0);
        let down = self.up.wrapping_sub(Self::of(far).low());
        let up = Self::of(near).up.wrapping_sub(self.low());
        down.max(up)
    }
}
