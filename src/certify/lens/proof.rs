//! The proof that a polygon of normalised points is seen. (See the documentation of [`crate::certify`].)

use crate::certify::{Interval, Slope, sharp};
use crate::shape::{Camera, Lens, Scalar};

/// The limits of a window: the disc where the lens is one-to-one, the raw image, and the rectified one.
#[derive(Clone, Copy, Debug)]
pub(super) struct Region {
    pub lens: Lens,
    /// Radius of the disc.
    pub field: f64,
    /// The raw image; its own lens is not used.
    pub raw: Camera,
    /// The rectified image as planes, if the detector reads it.
    pub rect: Option<[[f64; 3]; 4]>,
    /// Width of the border that is excluded from the raw image, pixels.
    pub border_px: f64,
}

/// Largest number of halvings before an edge counts as not proven.
const DEEPEST: u32 = 26;

impl Region {
    /// Returns `true` if a polygon of planes, in their order around it, is proven to lie in the region.
    pub fn holds(&self, planes: &[[f64; 3]]) -> bool {
        let Some(corners) = corners(planes) else {
            return false;
        };
        let field = Interval::point(self.field).square();
        let in_bounds = corners.iter().all(|corner| {
            let [x, y] = *corner;
            let within = x.square() + y.square();
            within.hi <= field.lo
                && self
                    .rect
                    .iter()
                    .flatten()
                    .all(|plane| side(*plane, *corner).is_at_least_zero())
        });
        in_bounds
            && corners
                .iter()
                .zip(corners.iter().cycle().skip(1))
                .all(|(from, to)| self.edge_holds(*from, *to))
    }

    /// Returns `true` if the lens is proven to map a line segment into the image.
    fn edge_holds(&self, from: [Interval; 2], to: [Interval; 2]) -> bool {
        let mut open = Vec::from([(0.0, 1.0, DEEPEST)]);
        while let Some((lo, hi, depth)) = open.pop() {
            let range = Interval { lo, hi };
            let over = self.slacks(from, to, range);
            let settled = |slack: &Slope| slack.value.is_at_least_zero();
            if over.iter().all(settled) {
                continue;
            }
            let middle = range.middle();
            let at_middle = self.slacks(from, to, Interval::point(middle));
            let offset = range - Interval::point(middle);
            let mut all = true;
            for (over, at) in over.iter().zip(&at_middle) {
                if at.value.hi < 0.0 {
                    return false;
                }
                all &= sharp(*over, at.value, offset).is_at_least_zero();
            }
            if all {
                continue;
            }
            if depth == 0 {
                return false;
            }
            open.push((lo, middle, depth - 1));
            open.push((middle, hi, depth - 1));
        }
        true
    }

    /// Returns how far within the left, right, top and bottom of the raw image a part of a line is mapped,
    /// pixels, with the derivatives along it.
    fn slacks(&self, from: [Interval; 2], to: [Interval; 2], part: Interval) -> [Slope; 4] {
        let point = [0, 1].map(|axis| {
            let by_yaw = to[axis] - from[axis];
            Slope {
                value: from[axis] + by_yaw * part,
                by_yaw,
            }
        });
        let [x, y] = self.lens.distort(point);
        let raw = &self.raw;
        let within = |at: Slope, f: f64, c: f64, size: f64| {
            let place = Slope::exact(f) * at + Slope::exact(c);
            let border = Slope::exact(self.border_px);
            [place - border, Slope::exact(size) - border - place]
        };
        let [left, right] = within(x, raw.fx, raw.cx, raw.width_px);
        let [top, bottom] = within(y, raw.fy, raw.cy, raw.height_px);
        [left, right, top, bottom]
    }
}

/// Encloses the signed side of a plane on which a point is: positive inside.
fn side([a, b, c]: [f64; 3], [x, y]: [Interval; 2]) -> Interval {
    Interval::point(a) * x + Interval::point(b) * y + Interval::point(c)
}

/// Returns the corners of the planes' intersection, each where a plane meets the next; `None` unless each is
/// strictly within all other planes.
fn corners(planes: &[[f64; 3]]) -> Option<Vec<[Interval; 2]>> {
    let count = planes.len();
    if count < 3 {
        return None;
    }
    let mut corners = Vec::with_capacity(count);
    for (first, plane) in planes.iter().enumerate() {
        let second = (first + 1) % count;
        let [[a, b, c], [d, e, f]] = [*plane, planes[second]].map(|p| p.map(Interval::point));
        let turn = a * e - b * d;
        if !(turn.lo > 0.0) {
            return None;
        }
        let scale = turn.reciprocal();
        let corner = [(b * f - c * e) * scale, (c * d - a * f) * scale];
        let others = planes.iter().enumerate();
        let strictly = others
            .filter(|(other, _)| *other != first && *other != second)
            .all(|(_, other)| side(*other, corner).lo > 0.0);
        if !strictly {
            return None;
        }
        corners.push(corner);
    }
    Some(corners)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A barrel lens in the middle of its image, and the rectangle that touches its sides.
    fn region() -> (Region, [f64; 2]) {
        let lens = Lens::PlumbBob([-0.2, 0.05, 0.0, 0.0, 0.0]);
        let region = Region {
            lens,
            field: lens.field().unwrap(),
            raw: Camera::pinhole([640.0, 480.0], [400.0, 400.0], [320.0, 240.0]),
            rect: None,
            border_px: 0.0,
        };
        // On an axis the distortion increases, so a bisection finds where the image ends.
        let end = |pixels: f64| {
            let (mut lo, mut hi) = (0.0, region.field);
            for _ in 0..60 {
                let middle = 0.5 * (lo + hi);
                let [x, _] = lens.distort([middle, 0.0]);
                if 400.0 * x < pixels {
                    lo = middle
                } else {
                    hi = middle
                }
            }
            lo
        };
        let ends = [end(320.0), end(240.0)];
        (region, ends)
    }

    fn rectangle([x, y]: [f64; 2]) -> [[f64; 3]; 4] {
        [[1.0, 0.0, x], [0.0, 1.0, y], [-1.0, 0.0, x], [0.0, -1.0, y]]
    }

    #[test]
    fn rectangle_is_proven_until_it_touches_the_border() {
        let (region, [x, y]) = region();
        assert!(region.holds(&rectangle([x - 1e-9, y - 1e-9])));
        for off in [[1e-9, -1e-9], [-1e-9, 1e-9], [0.1, -0.1]] {
            assert!(
                !region.holds(&rectangle([x + off[0], y + off[1]])),
                "{off:?}"
            );
        }
        let narrow = Region {
            border_px: 1.0,
            ..region
        };
        assert!(!narrow.holds(&rectangle([x - 1e-9, y - 1e-9])));
        assert!(narrow.holds(&rectangle([x - 0.01, y - 0.01])));
    }

    #[test]
    fn the_field_and_the_rectified_image_bound_it() {
        let (region, [x, y]) = region();
        let small = rectangle([0.5 * x, 0.5 * y]);
        let corner = 0.5 * libm::hypot(x, y);
        let within = |field: f64| Region { field, ..region }.holds(&small);
        assert!(within(corner + 1e-9) && !within(corner - 1e-9));
        let rect = |share: f64| Region {
            rect: Some(rectangle([share * x, y])),
            ..region
        };
        assert!(rect(0.51).holds(&small) && !rect(0.49).holds(&small));
    }

    /// Planes that do not bound a polygon in their order prove nothing.
    #[test]
    fn planes_are_a_polygon() {
        let (region, [x, y]) = region();
        let [left, top, right, bottom] = rectangle([0.5 * x, 0.5 * y]);
        assert!(
            region.holds(&[left, top, right, bottom]) && region.holds(&[top, right, bottom, left])
        );
        let slanted = [-0.1, -0.1, 1.0];
        for planes in [
            &[left, right, top, bottom][..],
            &[bottom, right, top, left],
            &[left, top, right],
            &[left, top],
            &[left, top, right, [-1.0, -1.0, 9.0], bottom],
            &[left, top, right, right, bottom],
            &[left, top, right, bottom, left, top, right, bottom],
            &[left, top, slanted, right, bottom],
            &[left, top, [f64::NAN, 0.0, 1.0], bottom],
        ] {
            assert!(!region.holds(planes), "{planes:?}");
        }
    }
}
