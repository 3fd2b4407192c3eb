//! Walls and boxes that hide tags.

use super::scalar::{Scalar, Vector, dot, minus};
use super::visibility::{Resolved, Visibility};
use super::{Planar, PoseDeg};

/// A vertical wall (two corners) or a block over a convex outline, from one height to another.
#[derive(Clone, Debug, PartialEq)]
pub struct Wall {
    /// The wall's name in the site file.
    pub name: String,
    /// Corners `[x, y]` in the world, metres: two of a wall, or a convex outline counter-clockwise.
    pub corners: Vec<[f64; 2]>,
    /// Lower and upper end, metres above the floor.
    pub z: [f64; 2],
    /// Areas where no tag may be mounted: `[from, to]` along its corners, in metres from the first one, and
    /// `[low, high]` above the floor.
    pub keep_outs: Vec<[[f64; 2]; 2]>,
}

/// A wall is assumed to be smaller than its numbers by this, metres: a tag that is mounted on a wall touches it, and
/// its corners are rounded.
pub(crate) const WALL_BORDER: f64 = 1e-9;

impl Wall {
    /// Returns the distance of a point `[x, y]` from the wall in the plan, metres: 0 within a block.
    pub fn distance(&self, [x, y]: [f64; 2]) -> f64 {
        let count = self.corners.len();
        let edge = |i: usize| (self.corners[i], self.corners[(i + 1) % count]);
        let left = |i: usize| {
            let (a, b) = edge(i);
            (b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0]) >= 0.0
        };
        if count > 2 && (0..count).all(left) {
            return 0.0;
        }
        let off = |i: usize| {
            let (a, b) = edge(i);
            let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
            let along = ((x - a[0]) * dx + (y - a[1]) * dy) / (dx * dx + dy * dy);
            let along = along.clamp(0.0, 1.0);
            libm::hypot(a[0] + along * dx - x, a[1] + along * dy - y)
        };
        (0..count).map(off).fold(f64::INFINITY, f64::min)
    }

    /// Returns the corners at both heights in the goal frame.
    pub(crate) fn corners_in_goal<S: Scalar>(&self, goal: PoseDeg) -> Vec<Vector<S>> {
        let [cos, sin] = S::cos_sin_deg(goal.yaw_deg);
        let frame = Planar {
            x: S::exact(goal.x),
            y: S::exact(goal.y),
            cos,
            sin,
        };
        self.z
            .iter()
            .flat_map(|z| {
                self.corners
                    .iter()
                    .map(|[x, y]| frame.to_robot([*x, *y, *z].map(S::exact)))
            })
            .collect()
    }

    /// Returns pairs of corners with an edge between them, as numbered by [`Self::corners_in_goal`].
    fn edges(&self) -> Vec<[usize; 2]> {
        let count = self.corners.len();
        let around = if count == 2 { 1 } else { count };
        let mut edges = Vec::new();
        for i in 0..around {
            let next = (i + 1) % count;
            edges.push([i, next]);
            edges.push([count + i, count + next]);
        }
        edges.extend((0..count).map(|i| [i, count + i]));
        edges
    }
}

/// Returns planes `(normal, offset)` in the goal frame with the wall above (`normal . P >= offset`) and the tag's
/// corners below. If the camera is below one of them, no part of the wall is between camera and tag. If the camera is
/// below none of them, some part is.
///
/// The planes that separate the wall from the tag are a polyhedral cone, and the height of a given camera above a plane
/// is linear in it. The lowest height is reached at an extreme ray: a plane through three corners of wall and tag.
/// (With a tolerance the tag's corners are those of cubes, which makes the set slightly smaller.)
pub(crate) fn planes(view: &Visibility, wall: &Wall, goal: PoseDeg) -> Vec<([f64; 3], f64)> {
    let tag: Resolved<f64> = view.resolve(goal);
    let corners = tag.corners;
    let points: Vec<[f64; 3]> = wall.corners_in_goal(goal);
    let edges = wall.edges();
    // The cube about a corner that contains it within the tolerance.
    let by = tag.less.hung;
    let about = |corner: [f64; 3]| -> Vec<[f64; 3]> {
        if by > 0.0 {
            let way = |bits: usize, axis: usize| if bits >> axis & 1 == 1 { by } else { -by };
            let place = |bits| [0, 1, 2].map(|axis| corner[axis] + way(bits, axis));
            (0..8).map(place).collect()
        } else {
            std::vec![corner]
        }
    };
    let mut normals: Vec<[f64; 3]> = Vec::new();
    let places: Vec<[f64; 3]> = corners.iter().flat_map(|corner| about(*corner)).collect();
    for [from, to] in &edges {
        let (from, to) = (points[*from], points[*to]);
        normals.extend(
            places
                .iter()
                .map(|place| cross(minus(to, from), minus(*place, from))),
        );
        // The wall's own faces: this edge with every other edge.
        normals.extend(
            edges
                .iter()
                .map(|[a, b]| cross(minus(to, from), minus(points[*b], points[*a]))),
        );
    }
    for (i, corner) in corners.iter().enumerate() {
        let edge = minus(corners[(i + 1) % 4], *corner);
        for place in about(*corner) {
            normals.extend(points.iter().map(|point| cross(edge, minus(*point, place))));
        }
    }
    normals.push(tag.normal);
    let mut planes: Vec<([f64; 3], f64)> = Vec::new();
    for normal in normals {
        let length = libm::sqrt(dot(normal, normal));
        if length < 1e-9 {
            continue;
        }
        let normal = normal.map(|v| v / length);
        let [[wall_least, wall_most], [tag_least, tag_most]] =
            [&points[..], &corners[..]].map(|points| range(normal, points));
        for (way, least, most) in [(1.0, wall_least, tag_most), (-1.0, -wall_most, -tag_least)] {
            let n = normal.map(|v| way * v);
            let most = most + tag.less.hung;
            if least - most < -0.5 * WALL_BORDER {
                continue;
            }
            let offset = (least + 0.5 * WALL_BORDER).max(most + 0.1 * WALL_BORDER);
            let known = |(m, o): &([f64; 3], f64)| {
                (offset - o).abs() < 1e-10 && (0..3).all(|i| (m[i] - n[i]).abs() < 1e-10)
            };
            if !planes.iter().any(known) {
                planes.push((n, offset));
            }
        }
    }
    planes
}

/// Returns the least and the largest product of a normal with the points.
fn range(normal: [f64; 3], points: &[[f64; 3]]) -> [f64; 2] {
    let start = [f64::INFINITY, f64::NEG_INFINITY];
    points.iter().fold(start, |[least, most], point| {
        let height = dot(normal, *point);
        [least.min(height), most.max(height)]
    })
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}
