//! The border of a convex region of the plane, traced around a point inside and cut into chords.

use crate::shape::farthest_holding;

/// A constraint of a region: at least zero inside, concave.
pub(super) type Curve = std::boxed::Box<dyn Fn([f64; 2]) -> f64 + Send + Sync>;

/// A half-plane `normal . P <= offset`, the normal of unit length.
#[derive(Clone, Copy, Debug)]
pub(super) struct HalfPlane {
    pub normal: [f64; 2],
    pub offset: f64,
}

/// A part of a border between two points, the region to its left.
pub(super) type Chord = [[f64; 2]; 2];

/// Number of directions in which the border is evaluated.
const DIRECTIONS: usize = 720;

impl HalfPlane {
    pub fn slack(&self, [x, y]: [f64; 2]) -> f64 {
        self.offset - self.normal[0] * x - self.normal[1] * y
    }

    /// Returns the part of the half-plane's border that lies in a window.
    pub fn segment(&self, window: &[Self]) -> Option<Chord> {
        let [nx, ny] = self.normal;
        let along = [-ny, nx];
        let foot = [nx * self.offset, ny * self.offset];
        let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
        for other in window {
            let rate = other.normal[0] * along[0] + other.normal[1] * along[1];
            let room = other.slack(foot);
            if rate > 1e-12 {
                high = high.min(room / rate);
            } else if rate < -1e-12 {
                low = low.max(room / rate);
            } else if room < 0.0 {
                return None;
            }
        }
        let at = |t: f64| [foot[0] + t * along[0], foot[1] + t * along[1]];
        (low < high).then(|| [at(low), at(high)])
    }
}

/// A region: curves within a window of half-planes.
pub(super) struct Region<'a> {
    pub curves: &'a [Curve],
    pub window: &'a [HalfPlane],
}

impl Region<'_> {
    /// Returns chords of the curves' parts of the border, at most `sagitta` inside of it; `None` if no
    /// candidate is an inner point.
    pub fn chords(&self, candidates: &[[f64; 2]], sagitta: f64) -> Option<Vec<Chord>> {
        let inner = candidates
            .iter()
            .map(|point| (self.slack(*point), *point))
            .filter(|(slack, _)| *slack > 1e-4)
            .max_by(|a, b| a.0.total_cmp(&b.0))
            .map(|(_, point)| point)?;
        let turn = core::f64::consts::TAU;
        let angle = |i: usize| turn * i as f64 / DIRECTIONS as f64;
        // Points of the border with the constraint that ends the region there, and the corners between
        // two constraints.
        let mut points: Vec<([f64; 2], usize)> = Vec::with_capacity(DIRECTIONS + 16);
        let mut last = self.border(inner, 0.0);
        points.push(last);
        for i in 1..=DIRECTIONS {
            let next = self.border(inner, angle(i));
            if next.1 != last.1 {
                let end = farthest_holding(angle(i - 1), angle(i), 44, |angle| {
                    self.border(inner, angle).1 == last.1
                });
                let corner = self.border(inner, end).0;
                points.push((corner, last.1));
                points.push((corner, next.1));
            }
            if i < DIRECTIONS {
                points.push(next);
            }
            last = next;
        }
        // Begin where the constraint changes, if it does.
        let count = points.len();
        let start = (0..count)
            .find(|i| points[*i].1 != points[(*i + count - 1) % count].1)
            .unwrap_or(0);
        points.rotate_left(start);
        let closed = points.iter().all(|(_, number)| *number == points[0].1);
        if closed {
            points.push(points[0]);
        }
        let mut chords = Vec::new();
        for run in points.chunk_by(|a, b| a.1 == b.1) {
            if run[0].1 < self.curves.len() {
                let run: Vec<[f64; 2]> = run.iter().map(|(point, _)| *point).collect();
                simplify(&run, sagitta, &mut chords);
            }
        }
        Some(chords)
    }

    fn slack(&self, point: [f64; 2]) -> f64 {
        let curves = self.curves.iter().map(|curve| curve(point));
        let window = self.window.iter().map(|plane| plane.slack(point));
        curves.chain(window).fold(f64::INFINITY, f64::min)
    }

    /// Returns where the region ends in a direction, and at which curve (window planes are numbered
    /// after the curves).
    fn border(&self, inner: [f64; 2], angle: f64) -> ([f64; 2], usize) {
        let along = [libm::cos(angle), libm::sin(angle)];
        let at = |t: f64| [inner[0] + t * along[0], inner[1] + t * along[1]];
        let mut least = (f64::INFINITY, self.curves.len());
        for (number, plane) in self.window.iter().enumerate() {
            let rate = plane.normal[0] * along[0] + plane.normal[1] * along[1];
            if rate > 1e-12 {
                let t = plane.slack(inner) / rate;
                if t < least.0 {
                    least = (t, self.curves.len() + number);
                }
            }
        }
        for (number, curve) in self.curves.iter().enumerate() {
            // Concave along the ray and positive at its start: one end.
            if curve(at(least.0)) >= 0.0 {
                continue;
            }
            let end = farthest_holding(0.0, least.0, 52, |t| curve(at(t)) >= 0.0);
            least = (end, number);
        }
        (at(least.0), least.1)
    }
}

/// Approximates a convex curve by chords within a distance of it: splits where the curve is farthest.
fn simplify(points: &[[f64; 2]], sagitta: f64, chords: &mut Vec<Chord>) {
    let mut waiting = std::vec![(0, points.len() - 1)];
    while let Some((from, to)) = waiting.pop() {
        let (a, b) = (points[from], points[to]);
        let along = [b[0] - a[0], b[1] - a[1]];
        let length = libm::hypot(along[0], along[1]);
        // A closed curve starts and ends at the same point: then the distance from that point is used.
        let height = |p: [f64; 2]| {
            let offset = [p[0] - a[0], p[1] - a[1]];
            if length > 1e-9 {
                (along[0] * offset[1] - along[1] * offset[0]).abs() / length
            } else {
                libm::hypot(offset[0], offset[1])
            }
        };
        let farthest = (from + 1..to)
            .map(|i| (height(points[i]), i))
            .max_by(|a, b| a.0.total_cmp(&b.0));
        match farthest {
            Some((height, middle)) if height > sagitta => {
                waiting.push((middle, to));
                waiting.push((from, middle));
            }
            _ if length > 1e-7 => chords.push([a, b]),
            _ => {}
        }
    }
}
