//! The normalised points that a camera sees, as a star-shaped outline around one of them: plain floats, nothing
//! proven.

use super::proof::Region;
use crate::shape::{Lens, edges, farthest_holding};

/// Number of rays of an outline, evenly spaced around its centre.
const RAYS: u32 = 96;

/// Number of rays to evenly spaced pixels of each side of the image, including its corners. Seen from the
/// centre, points far off the optical axis are close together.
const TO_A_SIDE: u32 = 48;

/// Points outside by less than the rest of this share are left to the shrinking in the proof.
const NEARLY: f64 = 1.0 - 1e-5;

/// Number of steps in the search for the first exit along a ray.
const STEPS: u32 = 24;

/// The part of a region that is visible from its centre.
#[derive(Debug)]
pub(super) struct Outline {
    pub centre: [f64; 2],
    angles: Vec<f64>,
    /// Its border, counter-clockwise.
    pub border: Vec<[f64; 2]>,
}

impl Region {
    /// Returns `true` if a point is in the region.
    pub fn contains(&self, [x, y]: [f64; 2]) -> bool {
        if !(libm::hypot(x, y) <= self.field) {
            return false;
        }
        let planes = self.rect.iter().flatten();
        let [u, v] = self.project([x, y]);
        let border = self.border_px;
        planes.copied().all(|[a, b, c]| a * x + b * y + c >= 0.0)
            && u >= border
            && v >= border
            && u <= self.raw.width_px - border
            && v <= self.raw.height_px - border
    }

    /// Returns the position of a point in the raw image.
    pub fn project(&self, point: [f64; 2]) -> [f64; 2] {
        let [x, y] = self.lens.distort(point);
        [self.raw.fx * x + self.raw.cx, self.raw.fy * y + self.raw.cy]
    }

    /// Returns the point of the field that is seen at a pixel of the raw image.
    pub fn lift(&self, [u, v]: [f64; 2]) -> Option<[f64; 2]> {
        let raw = &self.raw;
        undistort(
            &self.lens,
            [(u - raw.cx) / raw.fx, (v - raw.cy) / raw.fy],
            self.field,
        )
    }

    /// Returns the corners of the raw image without its border.
    pub fn corners_px(&self) -> [[f64; 2]; 4] {
        let border = self.border_px;
        let (right, bottom) = (self.raw.width_px - border, self.raw.height_px - border);
        [
            [border, border],
            [right, border],
            [right, bottom],
            [border, bottom],
        ]
    }

    /// Returns evenly spaced pixels along the border of the raw image.
    fn along_border_px(&self) -> impl Iterator<Item = [f64; 2]> {
        let corners = self.corners_px();
        (0..4 * TO_A_SIDE).map(move |step| {
            let (side, rest) = ((step / TO_A_SIDE) as usize, step % TO_A_SIDE);
            let (from, to) = (corners[side], corners[(side + 1) % 4]);
            let share = f64::from(rest) / f64::from(TO_A_SIDE);
            [0, 1].map(|axis| from[axis] + share * (to[axis] - from[axis]))
        })
    }

    /// Returns the region's outline around a point within it; `None` if no such point is found.
    pub fn outline(&self) -> Option<Outline> {
        let middle = [0.5 * self.raw.width_px, 0.5 * self.raw.height_px];
        let rect = self.rect.map(|[left, right, top, bottom]| {
            [
                0.5 * (right[2] / -right[0] - left[2] / left[0]),
                0.5 * (bottom[2] / -bottom[1] - top[2] / top[1]),
            ]
        });
        let centre = [rect, self.lift(middle), Some([0.0, 0.0])]
            .into_iter()
            .flatten()
            .find(|point| self.contains(*point))?;
        let mut angles: Vec<f64> = (0..RAYS)
            .map(|ray| core::f64::consts::TAU * f64::from(ray) / f64::from(RAYS))
            .collect();
        for [x, y] in self.along_border_px().filter_map(|pixel| self.lift(pixel)) {
            angles.push(angle_of([x - centre[0], y - centre[1]]));
        }
        let mut outline = Outline {
            centre,
            angles: Vec::new(),
            border: Vec::new(),
        };
        self.add(&mut outline, angles);
        Some(outline)
    }

    /// Adds the border points at some angles to an outline.
    fn add(&self, outline: &mut Outline, angles: Vec<f64>) {
        let known = outline
            .angles
            .iter()
            .copied()
            .zip(outline.border.iter().copied());
        let new = angles
            .into_iter()
            .map(|angle| (angle, self.way_out(outline.centre, angle)));
        let mut all: Vec<(f64, [f64; 2])> = known.chain(new).collect();
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        all.dedup_by(|a, b| (a.0 - b.0).abs() < 1e-9);
        (outline.angles, outline.border) = all.into_iter().unzip();
    }

    /// Adds to an outline the border points in the directions in which a polygon's border is outside of the
    /// region. Returns `true` if there were any.
    pub fn refine(&self, outline: &mut Outline, polygon: &[[f64; 2]]) -> bool {
        const PARTS: u32 = 32;
        let [x, y] = outline.centre;
        let mut angles = Vec::new();
        for [from, to] in edges(polygon) {
            for part in 0..PARTS {
                let share = f64::from(part) / f64::from(PARTS);
                let off = [
                    from[0] + share * (to[0] - from[0]) - x,
                    from[1] + share * (to[1] - from[1]) - y,
                ];
                if !self.contains([x + NEARLY * off[0], y + NEARLY * off[1]]) {
                    angles.push(angle_of(off));
                }
            }
        }
        let any = !angles.is_empty();
        self.add(outline, angles);
        any
    }

    /// Returns the last point in the region along a ray that starts at a point in it.
    fn way_out(&self, [x, y]: [f64; 2], angle: f64) -> [f64; 2] {
        let direction = [libm::cos(angle), libm::sin(angle)];
        let at = |t: f64| [x + t * direction[0], y + t * direction[1]];
        // Where the ray leaves the disc of the field.
        let along = x * direction[0] + y * direction[1];
        let rest = self.field * self.field - x * x - y * y;
        let end = libm::sqrt((along * along + rest).max(0.0)) - along;
        let (mut inside, mut outside) = (0.0, end);
        // Finer near the centre, because an image seldom reaches as far as the field.
        for step in 1..=STEPS {
            let share = f64::from(step) / f64::from(STEPS);
            let t = end * share * share;
            if self.contains(at(t)) {
                inside = t;
            } else {
                outside = t;
                break;
            }
        }
        at(farthest_holding(inside, outside, 44, |t| {
            self.contains(at(t))
        }))
    }
}

/// Returns an angle in [0, 2 pi].
fn angle_of([x, y]: [f64; 2]) -> f64 {
    libm::atan2(y, x).rem_euclid(core::f64::consts::TAU)
}

/// Returns the point of a disc that a lens maps to a given point; `None` if there is none.
fn undistort(lens: &Lens, target: [f64; 2], field: f64) -> Option<[f64; 2]> {
    let miss = |point: [f64; 2]| {
        let [x, y] = lens.distort(point);
        [target[0] - x, target[1] - y]
    };
    let size = |[x, y]: [f64; 2]| libm::hypot(x, y);
    let mut point = [0.0, 0.0];
    for _ in 0..60 {
        let off = miss(point);
        if size(off) < 1e-13 * (1.0 + size(target)) {
            return Some(point);
        }
        // A Newton step, halved until it stays in the disc and reduces the miss.
        let width = 1e-6 * (1.0 + size(point));
        let [x, y] = point;
        let (right, left) = (miss([x + width, y]), miss([x - width, y]));
        let (down, up) = (miss([x, y + width]), miss([x, y - width]));
        let slope = |a: f64, b: f64| (b - a) / (2.0 * width);
        let [a, b] = [slope(right[0], left[0]), slope(down[0], up[0])];
        let [c, d] = [slope(right[1], left[1]), slope(down[1], up[1])];
        let turn = a * d - b * c;
        let step = [
            (d * off[0] - b * off[1]) / turn,
            (a * off[1] - c * off[0]) / turn,
        ];
        let next = (0..40)
            .map(|halvings| libm::ldexp(1.0, -halvings))
            .map(|share| [x + share * step[0], y + share * step[1]])
            .find(|next| size(*next) <= field && size(miss(*next)) < size(off));
        match next {
            Some(next) => point = next,
            // The steps have reached their rounding, or the field's border.
            None => return (size(off) < 1e-9 * (1.0 + size(target))).then_some(point),
        }
    }
    None
}
