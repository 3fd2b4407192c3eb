//! The part of a line of positions at one heading that lies in a success set, with exact ends.
//!
//! At a fixed heading the borders of every set are lines, circles and horizontal sections of cones, which intersect
//! a line at roots in closed form. The borders of an image through a lens and of an error limit are searched
//! between samples. All computations are in `f64` and agree with [`SuccessSet::membership`] to its rounding.

pub use self::stretch::{LineInterval, OPEN};
pub use self::view::ViewAlongLine;

use self::stretch::{intersect, roots, unite};
use self::view::{ViewAt, cone, length, moved, sphere};
use super::boxed::is_whole_circle;
use super::prepared::{Kind, Node, Prepared};
use super::scalar::{ALL, dot};
use super::visibility::Sight;
use super::{BoxSet, ErrorLimit, Planar, SuccessSet};

mod stretch;
mod view;

/// Number of samples in the search for the border of an image through a lens or of an error limit.
const SAMPLES: u32 = 24;

/// Number of indices that each set reserves for its own constraints.
const EACH: u32 = 4096;

/// A line segment of positions in the goal frame: `from + t way`, t from 0 to `length`.
#[derive(Clone, Copy, Debug)]
pub struct LineSegment {
    /// Start, metres, goal frame.
    pub from: [f64; 2],
    /// Direction; `t` is in units of its length.
    pub way: [f64; 2],
    /// Largest `t`: metres only if `way` is a unit vector.
    pub length: f64,
}

impl LineSegment {
    /// Returns the position at `t`, metres.
    #[must_use]
    pub fn at(&self, t: f64) -> [f64; 2] {
        [0, 1].map(|i| self.from[i] + t * self.way[i])
    }
}

/// A success set prepared for intersection with line segments.
#[derive(Debug)]
pub struct LineClipper {
    set: Prepared,
}

impl LineClipper {
    /// Prepares a set.
    pub fn of(set: &SuccessSet) -> Self {
        let set = Prepared::of(set);
        Self { set }
    }

    /// Returns the number of views of tags in the set.
    pub fn views(&self) -> usize {
        self.set.views.len()
    }

    /// Returns the headings of the goal frame at which arcs end, radians: a set may begin or end there abruptly.
    pub fn ends_of_arcs(&self) -> Vec<f64> {
        fn collect(node: &Node, into: &mut Vec<f64>) {
            match &node.kind {
                Kind::Box(set) if !is_whole_circle(set.yaw_deg) => {
                    into.extend(set.yaw_deg.map(f64::to_radians));
                }
                Kind::Any(nodes) | Kind::All(nodes) => {
                    nodes.iter().for_each(|node| collect(node, into));
                }
                _ => {}
            }
        }
        let mut all = Vec::new();
        collect(&self.set.root, &mut all);
        all
    }

    /// Returns the set at a heading of the goal frame, radians.
    pub fn at(&self, yaw: f64) -> Headed<'_> {
        let (cos, sin) = (libm::cos(yaw), libm::sin(yaw));
        let origin = Planar {
            x: 0.0,
            y: 0.0,
            cos,
            sin,
        };
        let views = self.set.views.iter().map(|view| ViewAt::new(view, &origin));
        Headed {
            all: self,
            yaw,
            origin,
            views: views.collect(),
        }
    }
}

/// A success set at one heading.
#[derive(Debug)]
pub struct Headed<'a> {
    all: &'a LineClipper,
    yaw: f64,
    /// The pose at the frame's origin with this heading.
    origin: Planar<f64>,
    views: Vec<ViewAt>,
}

impl Headed<'_> {
    /// Returns the intervals of a line segment that lie in the set, in order.
    pub fn stretches(&self, walk: &LineSegment) -> Vec<LineInterval> {
        let mut all = Vec::new();
        self.stretches_into(walk, &mut all);
        all
    }

    /// Like [`Self::stretches`], into a list that is cleared first: many line segments need one allocation.
    pub fn stretches_into(&self, walk: &LineSegment, into: &mut Vec<LineInterval>) {
        into.clear();
        self.of_node(&self.all.set.root, walk, None, into);
    }

    /// Returns the intervals as [`Self::stretches`], and those from which each view sees its tag: the view's number,
    /// and an interval as in [`Self::seen`]. Each view is intersected once.
    pub fn stretches_and_seen(
        &self,
        walk: &LineSegment,
    ) -> (Vec<LineInterval>, Vec<(usize, LineInterval)>) {
        let mut seen = Vec::with_capacity(self.views.len());
        for view in 0..self.views.len() {
            self.of_view(view, 0, walk, |interval| seen.push((view, interval)));
        }
        let mut all = Vec::new();
        self.of_node(&self.all.set.root, walk, Some(&seen), &mut all);
        (all, seen)
    }

    /// Returns the intervals of a line segment from which a view sees its tag.
    pub fn seen(&self, view: usize, walk: &LineSegment) -> Vec<LineInterval> {
        let mut all = Vec::new();
        self.of_view(view, 0, walk, |interval| all.push(interval));
        all
    }

    /// Returns the number of views of tags in the set.
    pub fn views(&self) -> usize {
        self.views.len()
    }

    /// Returns the distance and angles of a view along a line segment, whether or not the tag is visible.
    pub fn sight(&self, view: usize, walk: &LineSegment) -> ViewAlongLine {
        let (resolved, at) = (&self.all.set.views[view], &self.views[view]);
        ViewAlongLine {
            ray: moved(&at.ray, walk),
            back: self.back(at.back, walk),
            normal: resolved.normal,
        }
    }

    /// Returns the robot's position at this heading with the camera of a view directly above or below the tag.
    pub fn at_tag(&self, view: usize) -> [f64; 2] {
        let back = self.views[view].back;
        [-back[0], -back[1]]
    }

    /// Returns the unit directions on the floor from the tag to where a view sees it best: along the tag's normal,
    /// against the optical axis, and between the two. Fewer if one of them is vertical.
    pub fn before_tag(&self, view: usize) -> impl Iterator<Item = [f64; 2]> {
        let view = &self.all.set.views[view];
        let Planar { cos, sin, .. } = self.origin;
        let [x, y] = [view.axes[0][0], view.axes[1][0]];
        let ahead = unit([cos * x - sin * y, sin * x + cos * y]);
        let normal = unit([view.normal[0], view.normal[1]]);
        let against = ahead.map(|[x, y]| [-x, -y]);
        let both = normal.zip(against);
        let between = both.and_then(|([a, b], [x, y])| unit([a + x, b + y]));
        [normal, against, between].into_iter().flatten()
    }

    fn back(&self, back: [f64; 3], walk: &LineSegment) -> [[f64; 3]; 2] {
        moved(&[back, [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], walk)
    }

    fn pose(&self, walk: &LineSegment, t: f64) -> Planar<f64> {
        let [x, y] = walk.at(t);
        Planar {
            x,
            y,
            ..self.origin
        }
    }

    /// Appends the intervals of a line segment that lie in a node's set, in order. `seen` has the intervals of every
    /// view if they are known.
    fn of_node(
        &self,
        node: &Node,
        walk: &LineSegment,
        seen: Option<&[(usize, LineInterval)]>,
        all: &mut Vec<LineInterval>,
    ) {
        let whole = LineInterval::of(walk.length);
        let from = all.len();
        let number = node.number.wrapping_mul(EACH);
        match &node.kind {
            Kind::Box(set) => all.extend(self.of_box(set, number, walk)),
            Kind::Footprint(set) => {
                let slacks = |t: f64, note: &mut dyn FnMut(usize, f64)| {
                    let pose = self.pose(walk, t);
                    set.slacks(&pose, ALL, 0, &mut |index, _, slack| note(index, slack));
                };
                all.extend(affine(whole, number, slacks));
            }
            Kind::View(view, limit) => {
                match seen {
                    Some(seen) => {
                        let own = seen.iter().filter(|(of, _)| of == view);
                        all.extend(own.map(|(_, interval)| interval.numbered(number)));
                    }
                    None => self.of_view(*view, number, walk, |interval| all.push(interval)),
                }
                let middle = all.len();
                if let Some(limit) = limit.as_ref().filter(|_| middle > from) {
                    self.of_limit(*view, limit, number + EACH / 2, walk, all);
                    intersect(all, from, middle);
                }
            }
            Kind::Near(view, d_min) => {
                let least = d_min + view.less.ray;
                let [at, way] = self.back(view.tag_to_camera(&self.origin), walk);
                let mut ends = sphere(at, way, least);
                let far = |t: f64| length(at, way, t) >= least;
                whole.parts(&mut ends, number, far, |part| all.push(part));
            }
            Kind::Square {
                view,
                cosine,
                back: behind,
            } => {
                let back = view.tag_to_camera(&self.origin);
                let back = [0, 1, 2].map(|i| back[i] + behind * view.normal[i]);
                let [at, way] = self.back(back, walk);
                let along = [dot(view.normal, at), dot(view.normal, way)];
                let mut ends = cone(at, way, along, *cosine);
                let outside = |t: f64| cosine * length(at, way, t) >= along[0] + t * along[1];
                whole.parts(&mut ends, number, outside, |part| all.push(part));
            }
            Kind::Sides { lines, .. } => {
                let (start, end) = (self.pose(walk, 0.0), self.pose(walk, whole.to));
                for (index, side) in lines {
                    let number = number.wrapping_add(64 * (index % 64));
                    let mut left = Some(whole);
                    for (index, point) in (0..).zip(&side.points) {
                        let at = side.of_point(&start, *point);
                        let slope = (side.of_point(&end, *point) - at) / whole.to;
                        left = left.and_then(|left| left.clipped(at, slope, number + index % 64));
                    }
                    all.extend(left);
                }
                unite(all, from);
            }
            Kind::Any(nodes) => {
                for node in nodes {
                    self.of_node(node, walk, seen, all);
                }
                unite(all, from);
            }
            Kind::All(nodes) => {
                all.push(whole);
                for node in nodes {
                    let middle = all.len();
                    if middle == from {
                        break;
                    }
                    self.of_node(node, walk, seen, all);
                    intersect(all, from, middle);
                }
            }
        }
    }

    /// Appends the intervals in which the error of a view's observation is within a limit.
    fn of_limit(
        &self,
        view: usize,
        limit: &ErrorLimit,
        number: u32,
        walk: &LineSegment,
        all: &mut Vec<LineInterval>,
    ) {
        let sight = self.sight(view, walk);
        let set = &self.all.set.views[view].set;
        let slack = |t: f64| {
            let [d, phi, psi] = sight.at(t);
            let corners_px = [None; 4];
            let sight = Sight {
                d,
                phi,
                psi,
                corners_px,
            };
            limit.slack(set, &sight)
        };
        let whole = LineInterval::of(walk.length);
        let mut ends = roots(&whole, SAMPLES, slack);
        let holds = |t: f64| slack(t) >= 0.0;
        whole.parts(&mut ends, number, holds, |part| all.push(part));
    }

    fn of_box(&self, set: &BoxSet, number: u32, walk: &LineSegment) -> Option<LineInterval> {
        let [x, y] = walk.from;
        let mut headed = true;
        set.slacks(x, y, self.yaw, &mut |name, slack| {
            headed &= name != "yaw" || slack >= 0.0;
        });
        let mut left = headed.then(|| LineInterval::of(walk.length))?;
        for (axis, [lo, hi]) in [set.x, set.y].into_iter().enumerate() {
            let (at, way) = (walk.from[axis], walk.way[axis]);
            let number = number + 2 * axis as u32;
            left = left.clipped(at - lo, way, number)?;
            left = left.clipped(hi - at, -way, number + 1)?;
        }
        Some(left)
    }
}

/// Returns the unit vector of a direction; `None` if its length is at most 1e-9.
fn unit([x, y]: [f64; 2]) -> Option<[f64; 2]> {
    let length = libm::hypot(x, y);
    (length > 1e-9).then(|| [x / length, y / length])
}

/// The number of slacks that [`affine`] keeps at a time.
const AT_A_TIME: usize = 32;

/// Returns the interval in which slacks that are affine along a line segment are at least 0. Each slack is reported with
/// its number, from 0.
fn affine(
    whole: LineInterval,
    number: u32,
    slacks: impl Fn(f64, &mut dyn FnMut(usize, f64)),
) -> Option<LineInterval> {
    let mut left = whole;
    let mut start = [0.0; AT_A_TIME];
    let mut first = 0;
    loop {
        let mut count = 0;
        slacks(0.0, &mut |index, slack| {
            count = index + 1;
            if let Some(kept) = start.get_mut(index.wrapping_sub(first)) {
                *kept = slack;
            }
        });
        // Evaluated at both ends, so that the difference is as exact as the slacks.
        let mut rest = Some(left);
        slacks(whole.to, &mut |index, end| {
            if let (Some(part), Some(start)) = (rest, start.get(index.wrapping_sub(first))) {
                let slope = (end - start) / whole.to;
                rest = part.clipped(*start, slope, number + index as u32 % 64);
            }
        });
        left = rest?;
        first += AT_A_TIME;
        if first >= count {
            return Some(left);
        }
    }
}
