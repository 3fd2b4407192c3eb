//! Small bodies that may be between two rays or two headings, and the number of rays needed to meet them.

use super::WhitenedPoseSet;
use core::f64::consts::{PI, TAU};
use posegate::shape::{ALL, BoxSet, Footprint, Line, Planar, Shape, SuccessSet};

/// The parts of a set that are convex at every heading and may be small: its excluded parts, and the boxes and
/// regions of its unions. (The views of a union are known only by rays.)
#[derive(Debug)]
pub(crate) struct Bodies(Vec<Body>);

#[derive(Debug)]
enum Body {
    /// The poses outside of all of these half-planes.
    Beyond(Vec<Line<f64>>),
    Box(BoxSet),
    Footprint(Footprint),
}

/// Largest number of directions in which a disc is evaluated to meet every body.
const MOST_LOOKS: u32 = 1024;

/// Extent of the sections, in radii of the ball. It is large enough to detect the approach of a body that does not
/// enter the ball.
const FAR: f64 = 1e5;

impl Bodies {
    pub(crate) fn of(set: &SuccessSet) -> Self {
        fn collect(set: &SuccessSet, shape: &Shape, in_union: bool, into: &mut Vec<Body>) {
            match shape {
                Shape::Apart(apart) => {
                    into.push(Body::Beyond(apart.lines(set.goal).collect()));
                }
                Shape::Box(set) if in_union => into.push(Body::Box(*set)),
                Shape::Footprint(set) if in_union => into.push(Body::Footprint(set.clone())),
                Shape::Any(shapes) | Shape::All(shapes) => {
                    let in_union = in_union || matches!(shape, Shape::Any(_));
                    for shape in shapes {
                        collect(set, shape, in_union, into);
                    }
                }
                // No parts of a union, or views.
                Shape::Box(_)
                | Shape::Footprint(_)
                | Shape::Visibility(_)
                | Shape::Bounded { .. } => {}
            }
        }
        let mut bodies = Vec::new();
        collect(set, &set.shape, false, &mut bodies);
        Self(bodies)
    }

    /// Returns the number of evenly spaced directions in which a heading's disc must be evaluated to meet every body
    /// in it; 0 if `few` are enough for each body. Also returns a bound on the mass (of the disc's two coordinates)
    /// that is still not met.
    pub(crate) fn looks(
        &self,
        white: &WhitenedPoseSet,
        u1: f64,
        radius: f64,
        few: u32,
    ) -> (u32, f64) {
        let step = |count: u32| TAU / f64::from(count);
        let mut extents: Vec<([f64; 2], f64)> = Vec::new();
        for body in &self.0 {
            let section = body.section(white, u1);
            let near = nearest(&section, FAR * white.radius);
            let Some([from, to]) = extent(&section, near, radius) else {
                continue;
            };
            let width = to - from;
            // Excludes the ends, where a ray may only touch the body.
            let inner = [from + 0.1 * width, to - 0.1 * width];
            if inner[1] - inner[0] <= step(few) {
                let ring = libm::exp(-0.5 * near * near) - libm::exp(-0.5 * radius * radius);
                extents.push((inner, width / TAU * ring.max(0.0)));
            }
        }
        if extents.is_empty() {
            return (0, 0.0);
        }
        let missed = |count: u32| {
            let step = step(count);
            // The same directions as those of the disc.
            let meets = |[from, to]: [f64; 2]| 0.05 + step * libm::ceil((from - 0.05) / step) <= to;
            let missed = extents.iter().filter(|(inner, _)| !meets(*inner));
            missed.map(|(_, mass)| *mass).sum::<f64>()
        };
        let mut best = (few, missed(few));
        for count in few + 1..=MOST_LOOKS {
            if best.1 <= 0.0 {
                break;
            }
            let missed = missed(count);
            if missed < best.1 {
                best = (count, missed);
            }
        }
        best
    }

    /// Returns the headings at which a body enters or leaves the discs, as t (`u1 = radius sin t`).
    pub(crate) fn ends(&self, white: &WhitenedPoseSet, samples: u32) -> Vec<f64> {
        let at = |k: u32| (f64::from(k) / f64::from(samples) - 0.5) * PI;
        let mut ends = Vec::new();
        for body in &self.0 {
            let beyond = |t: f64| {
                let section = body.section(white, white.radius * libm::sin(t));
                nearest(&section, FAR * white.radius) - white.radius * libm::cos(t)
            };
            let mut cross = |from: f64, to: f64| {
                let (mut low, mut high, below) = (from, to, beyond(from) < 0.0);
                for _ in 0..50 {
                    let middle = 0.5 * (low + high);
                    if (beyond(middle) < 0.0) == below {
                        low = middle;
                    } else {
                        high = middle;
                    }
                }
                ends.push(0.5 * (low + high));
            };
            let values: Vec<f64> = (0..=samples).map(|k| beyond(at(k))).collect();
            for (k, pair) in (0..).zip(values.windows(2)) {
                if (pair[0] < 0.0) != (pair[1] < 0.0) {
                    cross(at(k), at(k + 1));
                }
            }
            // Bodies that are inside for less than a sampling step.
            for (k, three) in (0..).zip(values.windows(3)) {
                let least = three[1] <= three[0] && three[1] <= three[2];
                let steepest = (three[0] - three[1]).max(three[2] - three[1]);
                if least && three[1] >= 0.0 && three[1] <= 1.5 * steepest {
                    let (from, to) = (at(k), at(k + 2));
                    if let Some(within) = below_zero(from, to, &beyond) {
                        cross(from, within);
                        cross(within, to);
                    }
                }
            }
        }
        ends
    }
}

/// Returns a point of an interval at which a function with one minimum is below zero, by golden-section search.
fn below_zero(mut from: f64, mut to: f64, value: &dyn Fn(f64) -> f64) -> Option<f64> {
    let ratio = 0.5 * (libm::sqrt(5.0) - 1.0);
    for _ in 0..40 {
        let (low, high) = (to - ratio * (to - from), from + ratio * (to - from));
        let (of_low, of_high) = (value(low), value(high));
        if of_low.min(of_high) < 0.0 {
            return Some(if of_low < of_high { low } else { high });
        }
        if of_low < of_high {
            to = high;
        } else {
            from = low;
        }
    }
    None
}

impl Body {
    /// Returns the body's corners at a heading, counter-clockwise, in units of the standard deviation about the disc's
    /// centre. Empty if the body is out of reach.
    fn section(&self, white: &WhitenedPoseSet, u1: f64) -> Vec<[f64; 2]> {
        let yaw = white.yaw * u1;
        let (sin, cos) = (libm::sin(yaw), libm::cos(yaw));
        let middle = white.middle(u1);
        let step = white.radius;
        let poses = [[0.0, 0.0], [step, 0.0], [0.0, step]].map(|offset| {
            let [x, y] = white.to_metres(offset);
            let [x, y] = [middle[0] + x, middle[1] + y];
            Planar { x, y, cos, sin }
        });
        let far = FAR * step;
        let mut corners = std::vec![[-far, -far], [far, -far], [far, far], [-far, far]];
        let mut keep = |[at, u, v]: [f64; 3]| {
            corners = clipped(&corners, [at, (u - at) / step, (v - at) / step]);
        };
        match self {
            Self::Beyond(sides) => {
                for side in sides {
                    let off = poses.map(|pose| -side.room(&pose));
                    // Skip a side that does not exist at some pose.
                    if off.iter().all(|off| off.is_finite()) {
                        keep(off);
                    }
                }
            }
            Self::Box(set) => {
                for ([lo, hi], at) in [
                    (set.x, poses.map(|pose| pose.x)),
                    (set.y, poses.map(|pose| pose.y)),
                ] {
                    keep(at.map(|at| at - lo));
                    keep(at.map(|at| hi - at));
                }
            }
            Self::Footprint(set) => {
                let slacks = poses.map(|pose| {
                    let mut slacks = Vec::new();
                    set.slacks(&pose, ALL, 0, &mut |_, _, slack| slacks.push(slack));
                    slacks
                });
                for (at, (u, v)) in slacks[0].iter().zip(slacks[1].iter().zip(&slacks[2])) {
                    keep([*at, *u, *v]);
                }
            }
        }
        corners
    }
}

/// Clips a convex polygon to `at + u x + v y >= 0`.
fn clipped(corners: &[[f64; 2]], [at, u, v]: [f64; 3]) -> Vec<[f64; 2]> {
    let height = |[x, y]: [f64; 2]| at + u * x + v * y;
    let mut left = Vec::with_capacity(corners.len() + 1);
    for (a, b) in edges(corners) {
        let (of_a, of_b) = (height(a), height(b));
        if of_a >= 0.0 {
            left.push(a);
        }
        if (of_a >= 0.0) != (of_b >= 0.0) {
            let share = of_a / (of_a - of_b);
            left.push([0, 1].map(|i| a[i] + share * (b[i] - a[i])));
        }
    }
    left
}

fn edges(corners: &[[f64; 2]]) -> impl Iterator<Item = ([f64; 2], [f64; 2])> + '_ {
    let ends = corners.iter().cycle().skip(1);
    corners.iter().zip(ends).map(|(a, b)| (*a, *b))
}

/// Returns the distance of a convex polygon from the origin: 0 if it contains the origin, `far` if it has no corners.
fn nearest(corners: &[[f64; 2]], far: f64) -> f64 {
    let mut inside = !corners.is_empty();
    let mut least = far;
    for (a, b) in edges(corners) {
        let [x, y] = [b[0] - a[0], b[1] - a[1]];
        inside &= a[0] * y - a[1] * x >= 0.0;
        let square = (x * x + y * y).max(f64::MIN_POSITIVE);
        let share = (-(a[0] * x + a[1] * y) / square).clamp(0.0, 1.0);
        least = least.min(libm::hypot(a[0] + share * x, a[1] + share * y));
    }
    if inside { 0.0 } else { least }
}

/// Returns the angles between which a convex polygon, at distance `near` from the origin, is visible from the origin
/// within a radius.
fn extent(corners: &[[f64; 2]], near: f64, radius: f64) -> Option<[f64; 2]> {
    if !(near > 0.0 && near < radius) {
        return None;
    }
    let mut points: Vec<[f64; 2]> = Vec::new();
    for (a, b) in edges(corners) {
        let edge = [b[0] - a[0], b[1] - a[1]];
        if libm::hypot(a[0], a[1]) <= radius {
            points.push(a);
        }
        let [square, along, off] = [
            edge[0] * edge[0] + edge[1] * edge[1],
            a[0] * edge[0] + a[1] * edge[1],
            a[0] * a[0] + a[1] * a[1] - radius * radius,
        ];
        let root = libm::sqrt(along * along - square * off);
        let crossings = [(-along - root) / square, (-along + root) / square];
        let crossings = crossings.into_iter().filter(|t| *t > 0.0 && *t < 1.0);
        points.extend(crossings.map(|t| [0, 1].map(|i| a[i] + t * edge[i])));
    }
    let angle = |[x, y]: [f64; 2]| libm::atan2(y, x);
    let first = angle(*points.first()?);
    // The polygon is less than half a turn wide.
    let turns = points.iter().map(|point| {
        let turn = angle(*point) - first;
        turn - TAU * libm::round(turn / TAU)
    });
    let (from, to) = turns.fold((0.0f64, 0.0f64), |(lo, hi), turn| {
        (lo.min(turn), hi.max(turn))
    });
    Some([first + from, first + to])
}
