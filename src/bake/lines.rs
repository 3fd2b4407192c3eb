//! At one heading, the part of a line of constant y that lies in a set.
//!
//! At a fixed heading footprint and visibility sets are intersections of half-planes, discs and
//! second-order cones in (x, y). Each intersects the line in an interval, in closed form.

use crate::shape::{Binds, Convex, ConvexPart, Line, PoseDeg, Resolved, Visibility, rotation};

/// A set at one heading, with every constraint tightened by a dip.
pub(super) struct Node {
    /// `a x + b y + c >= 0` with unit (a, b), or with both zero.
    planes: Vec<[f64; 3]>,
    cones: Vec<Cone>,
}

/// `n . r >= cosine |r| + dip` for the ray `r = (px - x, py - y, z)`.
struct Cone {
    apex: [f64; 3],
    normal: [f64; 3],
    cosine: f64,
    dip: f64,
}

/// The empty interval.
const NOTHING: [f64; 2] = [f64::INFINITY, f64::NEG_INFINITY];

/// Returns the intersection of two intervals.
pub(super) fn intersect(a: [f64; 2], b: [f64; 2]) -> Option<[f64; 2]> {
    let (lo, hi) = (a[0].max(b[0]), a[1].min(b[1]));
    (lo <= hi).then_some([lo, hi])
}

impl Node {
    /// Returns a bound on the second derivative by the yaw of every constraint, metres, for poses up
    /// to `reach` from the goal.
    pub(super) fn curvature(part: &ConvexPart, reach: f64) -> f64 {
        let of = |set: &Convex| match set {
            Convex::Box(_) | Convex::Side(_) | Convex::Nothing => 0.0,
            // A vertex moves on a circle.
            Convex::Footprint(shape) => shape
                .footprint()
                .iter()
                .map(|[x, y]| libm::hypot(*x, *y))
                .fold(0.0, f64::max),
            // The tag moves around the robot, the camera around the robot's centre; |r| of a point
            // on a circle of radius m has |r|'' <= m + m^2 / |r|.
            Convex::Visibility(shape) => {
                let tag: Resolved<f64> = shape.resolve(part.goal);
                let away = tag
                    .corners
                    .iter()
                    .map(|c| libm::hypot(c[0], c[1]))
                    .fold(0.0, f64::max);
                let arm = libm::hypot(shape.mount.x, shape.mount.y);
                let near = shape.z_near.max(0.01);
                2.0 * (away + reach) + arm + arm * arm / near
            }
        };
        // A point of the robot moves around its centre, a point of the goal frame around the robot.
        let of_line = |line: &Line<f64>| {
            let away = |[x, y]: &[f64; 2]| match line.binds {
                Binds::Robot => libm::hypot(*x, *y),
                Binds::Goal => libm::hypot(*x, *y) + reach,
            };
            line.points.iter().map(away).fold(0.0, f64::max)
        };
        let lines = part.lines().map(of_line);
        part.constraints().map(of).chain(lines).fold(0.0, f64::max)
    }

    /// Returns the part at a heading of the goal frame. (Without its boxes.)
    pub(super) fn at(part: &ConvexPart, yaw: f64, dip: f64) -> Self {
        let mut node = Self {
            planes: Vec::new(),
            cones: Vec::new(),
        };
        for set in part.constraints() {
            let other = match set {
                Convex::Box(_) | Convex::Side(_) => continue,
                Convex::Nothing => Self {
                    planes: std::vec![[0.0, 0.0, -1.0]],
                    cones: Vec::new(),
                },
                Convex::Footprint(shape) => Self::of_footprint(shape, yaw, dip),
                Convex::Visibility(shape) => Self::of_visibility(shape, part.goal, yaw, dip),
            };
            node.planes.extend(other.planes);
            node.cones.extend(other.cones);
        }
        for line in part.lines() {
            node.planes.push(of_line(line, yaw, dip));
        }
        node
    }

    fn of_footprint(shape: &crate::shape::Footprint, yaw: f64, dip: f64) -> Self {
        let (s, c) = (libm::sin(yaw), libm::cos(yaw));
        let region = shape.region();
        let planes = (0..region.len())
            .map(|i| {
                let ([ax, ay], [bx, by]) = (region[i], region[(i + 1) % region.len()]);
                let length = libm::hypot(bx - ax, by - ay);
                // Inward normal of a counter-clockwise edge.
                let (nx, ny) = ((ay - by) / length, (bx - ax) / length);
                // The vertex that is farthest out.
                let least = shape
                    .footprint()
                    .iter()
                    .map(|[vx, vy]| nx * (c * vx - s * vy) + ny * (s * vx + c * vy))
                    .fold(f64::INFINITY, f64::min);
                [nx, ny, least - nx * ax - ny * ay - shape.inset() - dip]
            })
            .collect();
        Self {
            planes,
            cones: Vec::new(),
        }
    }

    fn of_visibility(shape: &Visibility, goal: PoseDeg, yaw: f64, dip: f64) -> Self {
        let tag: Resolved<f64> = shape.resolve(goal);
        let mount = shape.mount;
        let axes: [[f64; 3]; 3] = rotation(mount.roll_deg, mount.pitch_deg, mount.yaw_deg);
        let (s, c) = (libm::sin(yaw), libm::cos(yaw));
        let turn = |[x, y, z]: [f64; 3]| [c * x - s * y, s * x + c * y, z];
        // The camera's axes and position for a robot at the origin of the goal frame, at this
        // heading.
        let axis = |i: usize| turn([axes[0][i], axes[1][i], axes[2][i]]);
        let (forward, left, up) = (axis(0), axis(1), axis(2));
        let place = turn([mount.x, mount.y, mount.z]);
        let less = tag.less;
        // (fs forward + ls left + us up) . (ray - (x, y, 0)) >= least
        let side = |[fs, ls, us]: [f64; 3], least: f64| {
            let n = [0, 1, 2].map(|i| {
                let mut n = fs * forward[i];
                if ls != 0.0 {
                    n += ls * left[i];
                }
                if us != 0.0 {
                    n += us * up[i];
                }
                n
            });
            // The dip is stated for a constraint whose direction has unit length.
            let size = libm::sqrt(fs * fs + ls * ls + us * us);
            let length = libm::hypot(n[0], n[1]);
            move |ray: [f64; 3]| {
                let along = n[0] * ray[0] + n[1] * ray[1] + n[2] * ray[2];
                let constant = along - least - (dip + less.corner) * size;
                if length > 1e-12 * size {
                    [-n[0] / length, -n[1] / length, constant / length]
                } else {
                    [0.0, 0.0, constant]
                }
            }
        };
        let window = shape.camera.view();
        let planes = window.planes().iter();
        let sides: Vec<_> = core::iter::once(side([1.0, 0.0, 0.0], shape.z_near))
            .chain(planes.map(|[a, b, c]| side([*c, -a, -b], 0.0)))
            .collect();
        let rays = tag
            .corners
            .map(|corner| [0, 1, 2].map(|i| corner[i] - place[i]));
        let planes = rays
            .iter()
            .flat_map(|ray| sides.iter().map(|side| side(*ray)))
            .collect();
        // Vector from the camera to the tag, with a cone's tip moved along its axis.
        let moved =
            |axis: [f64; 3], by: f64| [0, 1, 2].map(|i| tag.centre[i] - place[i] - by * axis[i]);
        let zero = [0.0; 3];
        let apex = moved(zero, 0.0);
        let back = tag.normal.map(|n| -n);
        let cone = |apex, normal, cosine| Cone {
            apex,
            normal,
            cosine,
            dip,
        };
        let mut cones = std::vec![
            cone(moved(forward, less.phi), forward, tag.cos_phi),
            cone(moved(back, less.psi), back, tag.cos_psi),
            // |r| <= d_max is the cone 0 . r + d_max >= |r|.
            Cone {
                dip: dip + less.ray - shape.d_max,
                ..cone(apex, zero, 1.0)
            },
        ];
        if let Some([middle, radius]) = tag.ball {
            cones.push(Cone {
                dip: dip - radius,
                ..cone(moved(back, middle), zero, 1.0)
            });
        }
        Self { planes, cones }
    }

    /// Removes constraints that end no line within the rectangle of these x and y.
    pub(super) fn within(mut self, x: [f64; 2], y: [f64; 2]) -> Self {
        // Metres, far above rounding.
        const CLEAR: f64 = 1e-6;
        let corners = [[x[0], y[0]], [x[0], y[1]], [x[1], y[0]], [x[1], y[1]]];
        // Constraints are concave: if all corners satisfy one with this clearance, the whole
        // rectangle does.
        let clear = |slack: &dyn Fn([f64; 2]) -> f64| corners.iter().all(|p| slack(*p) > CLEAR);
        self.cones.retain(|cone| !clear(&|p| cone.slack(p)));
        self.planes
            .retain(|[a, b, c]| !clear(&|[x, y]| a * x + b * y + c));
        // A plane ends no line if another one with the same orientation ends the first line and the
        // last before it.
        let ends = |[a, b, c]: &[f64; 3]| {
            [
                a.signum(),
                -(b * y[0] + c) / a.abs(),
                -(b * y[1] + c) / a.abs(),
            ]
        };
        let all: Vec<[f64; 3]> = self.planes.iter().map(ends).collect();
        self.planes.retain(|plane| {
            let [way, first, last] = ends(plane);
            let hides = |other: &[f64; 3]| {
                other[0] == way && other[1] > first + CLEAR && other[2] > last + CLEAR
            };
            plane[0].abs() < 1e-3 || !all.iter().any(hides)
        });
        self
    }

    /// Shortens the lines at these y to their intersection with the set. A line that does not
    /// intersect it ends before it starts.
    pub(super) fn draw_in(&self, ys: &[f64], lines: &mut [[f64; 2]]) {
        for [a, b, c] in &self.planes {
            let (ys, lines) = live(ys, lines);
            for (line, y) in lines.iter_mut().zip(ys) {
                let rest = b * y + c;
                let [lo, hi] = line;
                if *a > 1e-12 {
                    *lo = lo.max(-rest / a);
                } else if *a < -1e-12 {
                    *hi = hi.min(-rest / a);
                } else if rest < 0.0 {
                    *line = NOTHING;
                }
            }
        }
        for cone in &self.cones {
            let (ys, lines) = live(ys, lines);
            cone.draw_in(ys, lines);
        }
    }
}

/// Returns a half-plane at a heading, from the constrained point that reaches farthest.
fn of_line(line: &Line<f64>, yaw: f64, dip: f64) -> [f64; 3] {
    let (s, c) = (libm::sin(yaw), libm::cos(yaw));
    let [nx, ny] = line.normal;
    match line.binds {
        // n . (p + R v) <= offset
        Binds::Robot => {
            let farthest = line
                .points
                .iter()
                .map(|[vx, vy]| nx * (c * vx - s * vy) + ny * (s * vx + c * vy))
                .fold(f64::NEG_INFINITY, f64::max);
            [-nx, -ny, line.offset - farthest - dip]
        }
        // (R n) . (q - p) <= offset
        Binds::Goal => {
            let (mx, my) = (c * nx - s * ny, s * nx + c * ny);
            let farthest = line
                .points
                .iter()
                .map(|[qx, qy]| mx * qx + my * qy)
                .fold(f64::NEG_INFINITY, f64::max);
            [mx, my, line.offset - farthest - dip]
        }
    }
}

/// Returns the lines without those at either end that end before they start.
fn live<'a>(ys: &'a [f64], lines: &'a mut [[f64; 2]]) -> (&'a [f64], &'a mut [[f64; 2]]) {
    let first = lines.iter().position(meets).unwrap_or(lines.len());
    let end = lines.iter().rposition(meets).map_or(first, |last| last + 1);
    (&ys[first..end], &mut lines[first..end])
}

/// Returns `true` if a line does not end before it starts.
pub(super) fn meets([lo, hi]: &[f64; 2]) -> bool {
    lo <= hi
}

impl Cone {
    fn slack(&self, [x, y]: [f64; 2]) -> f64 {
        let r = [self.apex[0] - x, self.apex[1] - y, self.apex[2]];
        let [nx, ny, nz] = self.normal;
        let length = libm::sqrt(r[0] * r[0] + r[1] * r[1] + r[2] * r[2]);
        nx * r[0] + ny * r[1] + nz * r[2] - self.cosine * length - self.dip
    }

    /// Returns the numbers n, k, c, m of a line: with `s = px - x`,
    /// `h(s) = n s + k - c sqrt(s^2 + m) >= 0`, a concave function.
    fn at(&self, y: f64) -> [f64; 4] {
        let across = self.apex[1] - y;
        let k = self.normal[1] * across + self.normal[2] * self.apex[2] - self.dip;
        let m = across * across + self.apex[2] * self.apex[2];
        [self.normal[0], k, self.cosine, m]
    }

    fn draw_in(&self, ys: &[f64], lines: &mut [[f64; 2]]) {
        // First the roots of several lines, without branches, so that they are vectorised.
        const LINES: usize = 16;
        let (mut first, mut second) = ([0.0; LINES], [0.0; LINES]);
        for (ys, lines) in ys.chunks(LINES).zip(lines.chunks_mut(LINES)) {
            for ((y, first), second) in ys.iter().zip(&mut first).zip(&mut second) {
                [*first, *second] = roots(self.at(*y));
            }
            let roots = first.into_iter().zip(second);
            for ((y, line), roots) in ys.iter().zip(lines).zip(roots) {
                let [lo, hi] = between(roots.into(), self.at(*y)).unwrap_or(NOTHING);
                let (lo, hi) = (self.apex[0] - hi, self.apex[0] - lo);
                *line = [line[0].max(lo), line[1].min(hi)];
            }
        }
    }
}

/// Returns the s where `(n s + k)^2 = c^2 (s^2 + m)`; not finite if there are fewer than two.
#[inline]
fn roots([n, k, c, m]: [f64; 4]) -> [f64; 2] {
    let (a, b, d) = (n * n - c * c, n * k, k * k - c * c * m);
    if a.abs() < 1e-12 {
        return [-d / (2.0 * b), f64::NAN];
    }
    // Every square root is correctly rounded, so the bytes do not depend on the implementation; this
    // one can be vectorised.
    let root = (b * b - a * d).sqrt();
    let q = -(b + root.copysign(b));
    [q / a, d / q]
}

/// Returns the s where `n s + k >= c sqrt(s^2 + m)`, from the roots.
#[inline]
fn between(roots: [f64; 2], [n, k, c, m]: [f64; 4]) -> Option<[f64; 2]> {
    let everything = [f64::NEG_INFINITY, f64::INFINITY];
    if c < 1e-9 {
        return if n > 1e-12 {
            Some([-k / n, f64::INFINITY])
        } else if n < -1e-12 {
            Some([f64::NEG_INFINITY, -k / n])
        } else {
            (k >= 0.0).then_some(everything)
        };
    }
    let h = |s: f64| n * s + k - c * libm::sqrt(s * s + m);
    // Squaring adds roots where the left side is negative.
    let end = match roots.map(|s| s.is_finite() && n * s + k >= -1e-9) {
        [true, true] => return Some([roots[0].min(roots[1]), roots[0].max(roots[1])]),
        [true, false] => roots[0],
        [false, true] => roots[1],
        // No root: everywhere or nowhere.
        [false, false] => return (h(0.0) >= 0.0).then_some(everything),
    };
    Some(if h(end + 1.0) >= 0.0 {
        [end, f64::INFINITY]
    } else if h(end - 1.0) >= 0.0 {
        [f64::NEG_INFINITY, end]
    } else {
        [end, end]
    })
}
