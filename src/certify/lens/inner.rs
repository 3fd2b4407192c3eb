//! A large convex polygon within an outline: plain floats, nothing proven.
//!
//! Where the outline is convex the polygon follows it. Where it is not (the sides of an image with barrel
//! distortion), a tangent line bounds the largest convex part. The best tangent is found by rotation. Then the
//! corners that add least are removed until few are left.

use super::outline::Outline;
use crate::shape::{Window, clipped, edges, hull};

type Point = [f64; 2];

/// A point nearer to the polygon's border than this share of its size counts as on it.
const ON_BORDER: f64 = 1e-6;

/// A corner that adds less than this share of the solid angle does not justify a plane.
const WORTH: f64 = 2e-4;

/// Largest number of lines that cut off non-convex parts.
const MOST_CUTS: usize = 12;

impl Outline {
    /// Returns the outline's solid angle.
    pub fn solid_angle(&self) -> f64 {
        solid_angle(&self.border)
    }

    /// Returns a convex polygon within the outline, counter-clockwise, of at most [`Window::MOST`] corners.
    pub fn inner(&self) -> Vec<Point> {
        // A hull of few corners makes the rotation search fast.
        let hull = reduced(hull(self.border.clone()), 0.01 * WORTH, usize::MAX);
        let size = libm::sqrt(solid_angle(&hull));
        let mut cuts: Vec<Cut> = Vec::new();
        let mut polygon = hull.clone();
        for _ in 0..MOST_CUTS {
            let Some(cut) = self.deepest(&polygon) else {
                break;
            };
            polygon = clip(&polygon, &cut);
            cuts.push(cut);
        }
        self.turn(&hull, &mut cuts, ON_BORDER * size);
        let polygon = cuts.iter().fold(hull, |part, cut| clip(&part, cut));
        reduced(polygon, WORTH, Window::MOST)
    }

    /// Returns a line parallel to an edge through the deepest outline point behind it, as seen from the
    /// centre; `None` if no outline point is within the polygon.
    fn deepest(&self, polygon: &[Point]) -> Option<Cut> {
        let edges: Vec<(Cut, f64)> = edges(polygon)
            .map(|[from, to]| Cut::along(from, to))
            .map(|edge| (edge, edge.depth(self.centre)))
            .collect();
        // The position of a point between the centre and the edge behind it, as a share.
        let share = |point: &Point| {
            let shares = edges
                .iter()
                .map(|(edge, whole)| 1.0 - edge.depth(*point) / whole);
            shares.zip(&edges).max_by(|a, b| a.0.total_cmp(&b.0))
        };
        let shares = self.border.iter().filter_map(share);
        let (least, (edge, whole)) = shares.min_by(|a, b| a.0.total_cmp(&b.0))?;
        (least < 1.0 - ON_BORDER).then(|| Cut {
            most: edge.most - (1.0 - least) * whole,
            ..*edge
        })
    }

    /// Rotates each cut, tangent to the outline, until it removes the least area.
    fn turn(&self, hull: &[Point], cuts: &mut [Cut], least: f64) {
        for round in 0..2 * cuts.len() {
            let turned = round % cuts.len();
            let others = |at: &usize| *at != turned;
            let rest = (0..cuts.len())
                .filter(others)
                .fold(hull.to_vec(), |part, at| clip(&part, &cuts[at]));
            // The outline points that only this cut removes.
            let own: Vec<Point> = self
                .border
                .iter()
                .copied()
                .filter(|point| is_within(&rest, *point, least))
                .collect();
            let value = |cut: &Cut| solid_angle(&clip(&rest, cut));
            let mut best = cuts[turned];
            let (mut most, mut angle) = (value(&best), 0.05);
            while angle > 1e-3 {
                let turns = [angle, -angle].map(|angle| best.turned(angle, &own));
                match turns.into_iter().find(|cut| value(cut) > most) {
                    Some(better) => (most, best) = (value(&better), better),
                    None => angle *= 0.5,
                }
            }
            cuts[turned] = best;
        }
    }
}

/// The half-plane of the points with `normal . p <= most`.
#[derive(Clone, Copy, Debug)]
struct Cut {
    normal: Point,
    most: f64,
}

impl Cut {
    /// Returns the half-plane to the left of a line from one point to another.
    fn along(from: Point, to: Point) -> Self {
        let [dx, dy] = [to[0] - from[0], to[1] - from[1]];
        let length = libm::hypot(dx, dy);
        let normal = [dy / length, -dx / length];
        Self {
            normal,
            most: dot(normal, from),
        }
    }

    /// Returns how far a point is within the half-plane.
    fn depth(&self, point: Point) -> f64 {
        self.most - dot(self.normal, point)
    }

    /// Rotates the half-plane by an angle, so that it still cuts off all of these points.
    fn turned(&self, angle: f64, points: &[Point]) -> Self {
        let (cos, sin) = (libm::cos(angle), libm::sin(angle));
        let [x, y] = self.normal;
        let normal = [cos * x - sin * y, sin * x + cos * y];
        let along = points.iter().map(|point| dot(normal, *point));
        Self {
            normal,
            most: along.fold(f64::INFINITY, f64::min),
        }
    }
}

fn dot(a: Point, b: Point) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

/// Returns twice the area of the triangle a, b, c, positive if they are counter-clockwise.
fn turn(a: Point, b: Point, c: Point) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// Returns the solid angle of a polygon of normalised points: near the optical axis its area. Regions far off
/// the axis count by their solid angle, not by their larger area in a plane in front of the camera.
pub(super) fn solid_angle(polygon: &[Point]) -> f64 {
    let Some(first) = polygon.first() else {
        return 0.0;
    };
    let edges = polygon.windows(2);
    edges.map(|edge| triangle(*first, edge[0], edge[1])).sum()
}

/// Returns the solid angle of a triangle, positive if it is counter-clockwise (Van Oosterom and Strackee,
/// 1983).
fn triangle(a: Point, b: Point, c: Point) -> f64 {
    let length = |p: Point| libm::sqrt(1.0 + dot(p, p));
    let (p, q, r) = (length(a), length(b), length(c));
    let across = p * q * r + (1.0 + dot(a, b)) * r + (1.0 + dot(a, c)) * q + (1.0 + dot(b, c)) * p;
    2.0 * libm::atan2(turn(a, b, c), across)
}

/// Returns `true` if a point is in a convex polygon by more than a distance.
fn is_within(polygon: &[Point], point: Point, least: f64) -> bool {
    polygon.len() >= 3 && edges(polygon).all(|[from, to]| Cut::along(from, to).depth(point) > least)
}

/// Returns the part of a convex polygon in a half-plane.
fn clip(polygon: &[Point], cut: &Cut) -> Vec<Point> {
    clipped(polygon, |point| cut.depth(point))
}

/// Removes the corners that add least: all that add less than a share of the polygon, and more until few
/// enough are left.
fn reduced(mut polygon: Vec<Point>, worth: f64, most: usize) -> Vec<Point> {
    let worth = worth * solid_angle(&polygon);
    let ear = |polygon: &[Point], at: usize| {
        let count = polygon.len();
        let before = polygon[(at + count - 1) % count];
        triangle(before, polygon[at], polygon[(at + 1) % count])
    };
    let mut ears: Vec<f64> = (0..polygon.len()).map(|at| ear(&polygon, at)).collect();
    while polygon.len() > 3 {
        let costs = ears.iter().enumerate();
        let Some((least, cost)) = costs.min_by(|a, b| a.1.total_cmp(b.1)) else {
            break;
        };
        if polygon.len() <= most && *cost > worth {
            break;
        }
        polygon.remove(least);
        ears.remove(least);
        let count = polygon.len();
        for neighbour in [(least + count - 1) % count, least % count] {
            ears[neighbour] = ear(&polygon, neighbour);
        }
    }
    polygon
}
