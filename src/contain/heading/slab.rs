//! The bounds of a slab of headings: whether a facet holds at all of them. [`super`] derives the bounds and their roundings.

use super::{Movement, ONE, SLACK, Section, Slab, Sweep, U, Width, squares};
use crate::num::{product, sqrt_ceil};

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
    pub(super) fn moved(&self, length: i64, w: i64) -> i64 {
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
pub(super) fn slope(product: i64, p: i64) -> i64 {
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
pub(in crate::contain) struct Root {
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
