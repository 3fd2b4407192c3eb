//! A view of a tag along a line of positions at one heading.

use super::stretch::{LineInterval, quadratic, roots};
use super::{Headed, LineSegment, SAMPLES};
use crate::shape::Planar;
use crate::shape::scalar::{Vector, dot, transposed_times};
use crate::shape::visibility::{Resolved, ToleranceMargins, distance_and_angles};

/// A vector that is affine in the position: its value at the origin, and its change per metre along x and
/// along y.
type Affine = [Vector<f64>; 3];

/// A view at one heading.
#[derive(Debug)]
pub(super) struct ViewAt {
    /// Slacks that are affine in the position: value at the origin, change per metre along x and along y. All
    /// corners move by the same vector, so only the nearest corner counts for each plane.
    planes: Vec<[f64; 3]>,
    /// Camera to tag, in the camera's frame.
    pub(super) ray: Affine,
    /// Tag to camera, at the origin, in the goal frame.
    pub(super) back: Vector<f64>,
    /// `true` if a lens limits the image.
    through_lens: bool,
}

impl ViewAt {
    pub(super) fn new(view: &Resolved<f64>, origin: &Planar<f64>) -> Self {
        let Planar { cos, sin, .. } = *origin;
        let [x, y] = [[-cos, sin, 0.0], [-sin, -cos, 0.0]].map(|v| transposed_times(view.axes, v));
        let corners = view.corners.map(|corner| view.in_camera(origin, corner));
        let camera = &view.set.camera;
        let through_lens =
            view.less == ToleranceMargins::default() && camera.within_px([0.0; 2]).is_some();
        let window = camera.view();
        let mut planes = Vec::with_capacity(1 + window.planes().len());
        let mut add = |[ahead, left, up]: Vector<f64>, less: f64| {
            let normal = [ahead, left, up];
            let nearest = corners.iter().map(|corner| dot(normal, *corner));
            let nearest = nearest.fold(f64::INFINITY, f64::min);
            planes.push([nearest - less, dot(normal, x), dot(normal, y)]);
        };
        add([1.0, 0.0, 0.0], view.set.z_near + view.less.corner);
        let sides = window.planes().iter().filter(|_| !through_lens);
        for [a, b, c] in sides {
            let unit = 1.0 / libm::sqrt(a * a + b * b + c * c);
            add([c * unit, -a * unit, -b * unit], view.less.corner);
        }
        Self {
            planes,
            ray: [view.in_camera(origin, view.centre), x, y],
            back: view.tag_to_camera(origin),
            through_lens,
        }
    }
}

/// Returns a vector along a line segment: its value at the start, and its change per unit of `t`.
pub(super) fn moved([at, x, y]: &Affine, walk: &LineSegment) -> [Vector<f64>; 2] {
    let [fx, fy] = walk.from;
    let [wx, wy] = walk.way;
    [
        [0, 1, 2].map(|i| at[i] + fx * x[i] + fy * y[i]),
        [0, 1, 2].map(|i| wx * x[i] + wy * y[i]),
    ]
}

/// Distance and angles of a tag along a line segment.
#[derive(Clone, Copy, Debug)]
pub struct ViewAlongLine {
    pub(super) ray: [Vector<f64>; 2],
    pub(super) back: [Vector<f64>; 2],
    pub(super) normal: Vector<f64>,
}

impl ViewAlongLine {
    /// Returns `[d, phi, psi]` at `t`, metres and radians.
    pub fn at(&self, t: f64) -> [f64; 3] {
        let along = |[at, way]: &[Vector<f64>; 2]| [0, 1, 2].map(|i| at[i] + t * way[i]);
        distance_and_angles(along(&self.ray), along(&self.back), self.normal)
    }
}

impl Headed<'_> {
    /// Reports the intervals from which a view sees its tag.
    pub(super) fn of_view(
        &self,
        view: usize,
        number: u32,
        walk: &LineSegment,
        mut note: impl FnMut(LineInterval),
    ) {
        let resolved = &self.all.set.views[view];
        let at = &self.views[view];
        let Some(left) = self.of_convex_view(resolved, at, number, walk) else {
            return;
        };
        if at.through_lens {
            let slack = |t: f64| {
                let pose = self.pose(walk, t);
                resolved.image_slack(&pose).unwrap_or(f64::NEG_INFINITY)
            };
            let mut ends = roots(&left, SAMPLES, slack);
            left.parts(&mut ends, number + 63, |t| slack(t) >= 0.0, note);
        } else {
            note(left);
        }
    }

    /// Clips to all constraints of a view except a lens's image: they are convex at a heading.
    fn of_convex_view(
        &self,
        view: &Resolved<f64>,
        at: &ViewAt,
        number: u32,
        walk: &LineSegment,
    ) -> Option<LineInterval> {
        let ([fx, fy], [wx, wy]) = (walk.from, walk.way);
        let mut left = LineInterval::of(walk.length);
        for (index, [slack, x, y]) in at.planes.iter().enumerate() {
            let slope = x * wx + y * wy;
            left = left.clipped(slack + x * fx + y * fy, slope, number + index as u32)?;
        }
        let [ray, ray_way] = moved(&at.ray, walk);
        let d = view.set.d_max - view.less.ray;
        left = within(left, sphere(ray, ray_way, d), number + 32, |t| {
            length(ray, ray_way, t) <= d
        })?;
        let ray = [ray[0] - view.less.phi, ray[1], ray[2]];
        let ahead = [ray[0], ray_way[0]];
        left = within(
            left,
            cone(ray, ray_way, ahead, view.cos_phi),
            number + 33,
            |t| ahead[0] + t * ahead[1] >= view.cos_phi * length(ray, ray_way, t),
        )?;
        let [back, back_way] = self.back(at.back, walk);
        let before = |by: f64| [0, 1, 2].map(|i| back[i] - by * view.normal[i]);
        let off = before(view.less.psi);
        let facing = [dot(view.normal, off), dot(view.normal, back_way)];
        left = within(
            left,
            cone(off, back_way, facing, view.cos_psi),
            number + 34,
            |t| facing[0] + t * facing[1] >= view.cos_psi * length(off, back_way, t),
        )?;
        if let Some([middle, radius]) = view.ball {
            let off = before(middle);
            left = within(left, sphere(off, back_way, radius), number + 35, |t| {
                length(off, back_way, t) <= radius
            })?;
        }
        Some(left)
    }
}

/// Returns the part of an interval in which a concave slack is at least zero; its sign changes only at these ends.
fn within(
    left: LineInterval,
    mut ends: [f64; 2],
    number: u32,
    holds: impl Fn(f64) -> bool,
) -> Option<LineInterval> {
    let mut all: Option<LineInterval> = None;
    // The slack is concave, so parts that rounding separates belong together.
    left.parts(&mut ends, number, holds, |part| {
        all = Some(all.map_or(part, |first| LineInterval {
            from: first.from,
            to: part.to,
            ended_by: [first.ended_by[0], part.ended_by[1]],
        }));
    });
    all
}

pub(super) fn length(at: Vector<f64>, way: Vector<f64>, t: f64) -> f64 {
    let v = [0, 1, 2].map(|i| at[i] + t * way[i]);
    libm::sqrt(dot(v, v))
}

/// Returns the `t` where `|at + t way| = radius`.
pub(super) fn sphere(at: Vector<f64>, way: Vector<f64>, radius: f64) -> [f64; 2] {
    quadratic(
        dot(way, way),
        dot(at, way),
        dot(at, at) - radius * radius.abs(),
    )
}

/// Returns the `t` where `along[0] + t along[1]`, the component along a cone's axis, is plus or minus the
/// cosine of its half angle times the length of `at + t way`.
pub(super) fn cone(at: Vector<f64>, way: Vector<f64>, along: [f64; 2], cosine: f64) -> [f64; 2] {
    let square = cosine * cosine;
    quadratic(
        along[1] * along[1] - square * dot(way, way),
        along[0] * along[1] - square * dot(at, way),
        along[0] * along[0] - square * dot(at, at),
    )
}
