//! Finds the lowest value of one constraint over a pose set, by branch and bound.
//!
//! A pose set is cut into slices of one yaw. Every constraint is concave in (x, y) there, so its least
//! value over an elliptical slice is on the slice's border: in closed form for an affine constraint,
//! else at some border angle `b`, found by Newton's method. The remaining search is over the slice
//! parameter `p` for the least of those values, F(p). If at every fixed border angle the constraint's
//! second derivative in p is at most K (one-sided), then F - K p^2 / 2 is concave as a minimum of
//! concave functions, and over a cell of width h F is at least its lesser end value minus K h^2 / 8.
//! Cells whose bound is above the best value found are dropped, so no basin is missed by more than
//! the tolerance.

use super::Pose;
use super::sets::Constraint;
use std::f64::consts::TAU;

/// The pose set at one scale, in the goal frame: `(x, y) = at + lean t + w shape (cos b, sin b)`,
/// yaw = at_yaw + t, with `t` and `w` given by the slice parameter `p` in [-half, half].
#[derive(Clone, Copy, Debug)]
pub struct Slices {
    pub at: Pose,
    pub lean: [f64; 2],
    pub shape: [[f64; 2]; 2],
    /// `w` of the middle slice.
    pub radius: f64,
    /// If `true`: `t = reach sin p, w = radius cos p`. Else `t = reach p, w = radius`.
    pub round: bool,
    pub reach: f64,
    pub half: f64,
}

/// Bounds over all slices of t and w, and of their first and second derivatives.
struct Reach {
    t: [f64; 3],
    w: [f64; 3],
}

impl Slices {
    fn slice(&self, p: f64) -> (f64, f64) {
        if self.round {
            let (s, c) = p.sin_cos();
            (self.reach * s, self.radius * c.max(0.0))
        } else {
            (self.reach * p, self.radius)
        }
    }

    /// Returns the pose on the border of the slice at p, in the border direction `e`.
    fn pose(&self, p: f64, e: [f64; 2]) -> Pose {
        let (t, w) = self.slice(p);
        let [c, s] = e;
        let [r0, r1] = self.shape;
        [
            self.at[0] + self.lean[0] * t + w * (r0[0] * c + r0[1] * s),
            self.at[1] + self.lean[1] * t + w * (r1[0] * c + r1[1] * s),
            self.at[2] + t,
        ]
    }

    /// Returns `shape' n`.
    fn spread(&self, n: [f64; 2]) -> [f64; 2] {
        let [r0, r1] = self.shape;
        [r0[0] * n[0] + r1[0] * n[1], r0[1] * n[0] + r1[1] * n[1]]
    }

    /// Returns the spectral norm of `shape`.
    fn stretch(&self) -> f64 {
        let [[a, b], [c, d]] = self.shape;
        0.5 * ((a + d).hypot(c - b) + (a - d).hypot(c + b))
    }

    fn reach(&self) -> Reach {
        let (r, w) = (self.reach, self.radius);
        if self.round {
            let s = self.half.sin();
            Reach {
                t: [r * s, r, r * s],
                w: [w, w * s, w],
            }
        } else {
            Reach {
                t: [r, r, 0.0],
                w: [w, 0.0, 0.0],
            }
        }
    }
}

/// The best point so far.
#[derive(Clone, Copy, Debug)]
pub struct Lowest {
    pub value: f64,
    pub pose: Pose,
}

/// How far below the best value a basin may hide, absolute and relative to that value.
#[derive(Clone, Copy, Debug)]
pub struct Tolerance {
    pub absolute: f64,
    pub relative: f64,
}

impl Tolerance {
    fn target(&self, best: f64) -> f64 {
        best - self.absolute - self.relative * best.abs()
    }
}

/// Largest number of splits, for sets whose border coincides with the constraint's.
const MOST_CELLS: usize = 200_000;

/// Lowers `best` to the constraint's least value over the slices, if that is lower.
pub fn lower(c: &Constraint, slices: &Slices, tolerance: Tolerance, best: &mut Lowest) {
    if c.weight == 0.0 && c.turning == [0.0; 2] && c.cos == 0.0 && c.sin == 0.0 {
        lower_still(c, slices, best);
    } else {
        lower_turning(c, slices, tolerance, best);
    }
}

fn norm(v: [f64; 2]) -> f64 {
    v[0].hypot(v[1])
}

/// Returns the unit vector opposite to `u`; any unit vector if `u` is zero.
fn against(u: [f64; 2], length: f64) -> [f64; 2] {
    if length > 0.0 {
        u.map(|v| -v / length)
    } else {
        [1.0, 0.0]
    }
}

/// A plane that does not turn: `g t - |shape' n| w` has its minimum in closed form.
fn lower_still(c: &Constraint, slices: &Slices, best: &mut Lowest) {
    let n = c.fixed;
    let drift = (n[0] * slices.lean[0] + n[1] * slices.lean[1]) * slices.reach;
    let p = if slices.round {
        let across = norm(slices.spread(n)) * slices.radius;
        -drift.atan2(across).clamp(-slices.half, slices.half)
    } else {
        -slices.half.copysign(drift)
    };
    let u = slices.spread(n);
    let length = norm(u);
    let pose = slices.pose(p, against(u, length));
    let value = c.value(pose);
    if value < best.value {
        *best = Lowest { value, pose };
    }
}

/// Returns a bound of the second derivative in p of the constraint at a fixed border angle. Norms (`|u|` of
/// `u = w shape' n(a)`, the ray's length) are convex where they bend sharply, so that minus a norm
/// never bends up faster than its vector's second derivative.
fn bend(c: &Constraint, slices: &Slices) -> f64 {
    let r = slices.reach();
    let curl = r.t[1] * r.t[1] + r.t[2];
    let (turning, lean, stretch) = (norm(c.turning), norm(slices.lean), slices.stretch());
    // R(a) turning . at adds to the terms of cos and sin.
    let [x, y] = [slices.at[0], slices.at[1]];
    let swing = [
        c.cos + c.turning[0] * x + c.turning[1] * y,
        c.sin + c.turning[0] * y - c.turning[1] * x,
    ];
    let along = c.fixed[0] * slices.lean[0] + c.fixed[1] * slices.lean[1];
    let centre = norm(swing) * curl
        + turning * lean * (curl * r.t[0] + 2.0 * r.t[1] * r.t[1] + r.t[2])
        + along.abs() * r.t[2];
    let most = stretch * turning;
    let u = norm(slices.spread(c.fixed)) + most;
    let border = r.w[2] * u + 2.0 * r.w[1] * most * r.t[1] + r.w[0] * most * curl;
    let ray = lean * r.t[2] + r.w[2] * stretch + norm(c.mount) * curl;
    centre + border + c.weight * ray
}

/// Returns the least value on the border of the slice at p, and the border's direction `e` there; or a lower
/// bound of that value, if that bound is above `enough`.
fn at_slice(c: &Constraint, slices: &Slices, p: f64, enough: f64) -> (f64, [f64; 2]) {
    let (t, w) = slices.slice(p);
    let (s, k) = (slices.at[2] + t).sin_cos();
    let n = [
        c.fixed[0] + k * c.turning[0] - s * c.turning[1],
        c.fixed[1] + s * c.turning[0] + k * c.turning[1],
    ];
    let x = slices.at[0] + slices.lean[0] * t;
    let y = slices.at[1] + slices.lean[1] * t;
    let centre = c.offset + n[0] * x + n[1] * y + c.cos * k + c.sin * s;
    let u = slices.spread(n).map(|v| w * v);
    if c.weight == 0.0 {
        let length = (u[0] * u[0] + u[1] * u[1]).sqrt();
        return (centre - length, against(u, length));
    }
    let [mx, my] = c.mount;
    let border = Border {
        u,
        ray: [
            c.tag[0] - x - (k * mx - s * my),
            c.tag[1] - y - (s * mx + k * my),
        ],
        shape: slices.shape.map(|row| row.map(|v| w * v)),
        rise: c.rise,
        weight: c.weight,
    };
    let crude = centre + border.bound(w * slices.stretch());
    if crude >= enough {
        return (crude, [1.0, 0.0]);
    }
    let (value, e) = border.least();
    (centre + value, e)
}

/// `u.e - weight |(ray - shape e, rise)|` for `e = (cos b, sin b)`.
struct Border {
    u: [f64; 2],
    ray: [f64; 2],
    shape: [[f64; 2]; 2],
    rise: f64,
    weight: f64,
}

const SAMPLES: usize = 16;

impl Border {
    /// Returns a lower bound of all values, from the spectral norm of `shape`.
    fn bound(&self, stretch: f64) -> f64 {
        let [x, y] = self.ray;
        let across = (x * x + y * y).sqrt() + stretch;
        let length = (across * across + self.rise * self.rise).sqrt();
        let [u, v] = self.u;
        -(u * u + v * v).sqrt() - self.weight * length
    }

    /// Returns `shape e` and the ray's horizontal part.
    fn ray(&self, e: [f64; 2]) -> ([f64; 2], [f64; 2]) {
        let moved = self.shape.map(|row| row[0] * e[0] + row[1] * e[1]);
        (moved, [self.ray[0] - moved[0], self.ray[1] - moved[1]])
    }

    fn value(&self, e: [f64; 2]) -> f64 {
        let (_, v) = self.ray(e);
        let length = (v[0] * v[0] + v[1] * v[1] + self.rise * self.rise).sqrt();
        self.u[0] * e[0] + self.u[1] * e[1] - self.weight * length
    }

    /// Returns the first and second derivative in the border angle.
    fn slopes(&self, e: [f64; 2]) -> (f64, f64) {
        let (moved, v) = self.ray(e);
        let (d, _) = self.ray([-e[1], e[0]]);
        let length = (v[0] * v[0] + v[1] * v[1] + self.rise * self.rise).sqrt();
        let first = -(v[0] * d[0] + v[1] * d[1]) / length;
        let bent = d[0] * d[0] + d[1] * d[1] + v[0] * moved[0] + v[1] * moved[1];
        let second = (bent - first * first) / length;
        (
            self.u[1] * e[0] - self.u[0] * e[1] - self.weight * first,
            -self.u[0] * e[0] - self.u[1] * e[1] - self.weight * second,
        )
    }

    /// Returns the least value and its angle, by samples and then Newton's method from every sample that is lower
    /// than its neighbours.
    fn least(&self) -> (f64, [f64; 2]) {
        let step = TAU / SAMPLES as f64;
        let (ss, cs) = step.sin_cos();
        let mut e = [1.0, 0.0];
        let mut values = [0.0; SAMPLES];
        for v in &mut values {
            *v = self.value(e);
            e = [e[0] * cs - e[1] * ss, e[0] * ss + e[1] * cs];
        }
        let mut best = (f64::INFINITY, [1.0, 0.0]);
        for (i, v) in values.iter().enumerate() {
            let before = values[(i + SAMPLES - 1) % SAMPLES];
            if *v > before || *v > values[(i + 1) % SAMPLES] {
                continue;
            }
            let found = self.descend(i as f64 * step, step);
            if found.0 < best.0 {
                best = found;
            }
        }
        best
    }

    /// Returns the local minimum within `step` of `b`, by Newton's method inside a shrinking bracket.
    fn descend(&self, mut b: f64, step: f64) -> (f64, [f64; 2]) {
        let (mut low, mut high) = (b - step, b + step);
        for _ in 0..60 {
            let (s, c) = b.sin_cos();
            let (first, second) = self.slopes([c, s]);
            if first > 0.0 {
                high = b;
            } else {
                low = b;
            }
            let mut next = b - first / second;
            if !(second > 0.0 && next > low && next < high) {
                next = 0.5 * (low + high);
            }
            let moved = (next - b).abs();
            b = next;
            if moved < 1e-5 {
                break;
            }
        }
        let (s, c) = b.sin_cos();
        (self.value([c, s]), [c, s])
    }
}

/// Branch and bound over the slices.
fn lower_turning(c: &Constraint, slices: &Slices, tolerance: Tolerance, best: &mut Lowest) {
    let bend = bend(c, slices);
    let (mut least, mut found) = (best.value, None);
    let mut look = |p: f64, width: f64, least: &mut f64| {
        let enough = *least + bend * width * width / 8.0;
        let (value, e) = at_slice(c, slices, p, enough);
        if value < *least {
            (*least, found) = (value, Some((p, e)));
        }
        (p, value)
    };
    let h = slices.half;
    let [middle, first, last] = [0.0, -h, h].map(|p| look(p, h, &mut least));
    let mut stack = Vec::with_capacity(64);
    stack.push((first, middle));
    stack.push((middle, last));
    let mut cells = 0;
    while let Some((a, b)) = stack.pop() {
        let width: f64 = b.0 - a.0;
        let bound = a.1.min(b.1) - bend * width * width / 8.0;
        if bound >= tolerance.target(least) || cells > MOST_CELLS {
            continue;
        }
        cells += 1;
        let m = look(0.5 * (a.0 + b.0), 0.5 * width, &mut least);
        // The better half is searched first.
        if a.1 < b.1 {
            stack.push((m, b));
            stack.push((a, m));
        } else {
            stack.push((a, m));
            stack.push((m, b));
        }
    }
    if let Some((p, e)) = found {
        *best = Lowest {
            value: least,
            pose: slices.pose(p, e),
        };
    }
}
