//! A footprint in a union of convex regions.
//!
//! The footprint lies in the union if it lies in the rectangle around the union and its interior does not
//! overlap the part of the rectangle outside of the union. That part is cut into convex cells, which are
//! obstacles. (A footprint of one point has no interior.)

use super::polygon::{clipped, edges, hull};
use super::{Clear, Exclusion, Footprint, Shape};
use std::sync::Arc;

/// Cells narrower than this are rounding gaps between touching regions, metres.
const CRACK: f64 = 1e-10;

/// Largest total number of corners of the regions, and largest number of free cells.
const MOST_CORNERS: usize = 4096;
const MOST_CELLS: usize = 1024;

impl Shape {
    /// Creates the set of poses at which a convex footprint (robot frame) lies in the union of convex regions
    /// (goal frame), all as [`Footprint::new`] accepts them. `None` without a region, if a polygon is not valid,
    /// or if there are too many: 4,096 corners in all, 1,024 free cells between them.
    #[must_use]
    pub fn footprint_in_union(footprint: &[[f64; 2]], regions: &[Vec<[f64; 2]>]) -> Option<Self> {
        if let [only] = regions {
            let set = Footprint::new(footprint.to_vec(), only.clone()).ok()?;
            return Some(Self::Footprint(set));
        }
        if regions.is_empty() || regions.iter().map(Vec::len).sum::<usize>() > MOST_CORNERS {
            return None;
        }
        let corners = || regions.iter().flatten();
        let ends = |axis: usize| {
            let values = corners().map(|corner| corner[axis]);
            values.fold([f64::INFINITY, f64::NEG_INFINITY], |[lo, hi], v| {
                [lo.min(v), hi.max(v)]
            })
        };
        let ([x0, x1], [y0, y1]) = (ends(0), ends(1));
        let about = std::vec![[x0, y0], [x1, y0], [x1, y1], [x0, y1]];
        let mut free = std::vec![about.clone()];
        for region in regions {
            free = free.iter().flat_map(|cell| without(cell, region)).collect();
            if free.len() > MOST_CELLS {
                return None;
            }
        }
        // A point may lie on a cut between two cells, in the interior of neither: it is in the union only if one
        // region contains it.
        if footprint.len() == 1 && !free.is_empty() {
            let each = regions
                .iter()
                .map(|region| Footprint::new(footprint.to_vec(), region.clone()));
            let each: Vec<Self> = each
                .map(|set| set.map(Self::Footprint).ok())
                .collect::<Option<_>>()?;
            return Some(Self::Any(each));
        }
        let mut all = std::vec![Self::Footprint(
            Footprint::new(footprint.to_vec(), about).ok()?
        )];
        let regions: Arc<[Vec<[f64; 2]>]> = regions.into();
        for cell in free {
            let clear = Clear::new(footprint.to_vec(), hull(cell)).ok()?;
            let regions = regions.clone();
            all.push(Self::Apart(Exclusion::Gap { clear, regions }));
        }
        Some(Self::All(all))
    }
}

/// Returns the part of a convex cell outside of a convex polygon, cut along the polygon's edges.
fn without(cell: &[[f64; 2]], polygon: &[[f64; 2]]) -> Vec<Vec<[f64; 2]>> {
    let mut rest = cell.to_vec();
    let mut left = Vec::new();
    for [from, to] in edges(polygon) {
        left.push(beside(&rest, to, from));
        rest = beside(&rest, from, to);
    }
    left.retain(|piece| width(piece) > CRACK);
    left
}

/// Returns the part of a convex polygon to the left of a line.
fn beside(polygon: &[[f64; 2]], from: [f64; 2], to: [f64; 2]) -> Vec<[f64; 2]> {
    clipped(polygon, |p| {
        (to[0] - from[0]) * (p[1] - from[1]) - (to[1] - from[1]) * (p[0] - from[0])
    })
}

/// Returns an upper bound of a polygon's width: twice its area over its longest side.
fn width(polygon: &[[f64; 2]]) -> f64 {
    let (mut area, mut longest) = (0.0, 0.0f64);
    for [a, b] in edges(polygon) {
        area += a[0] * b[1] - a[1] * b[0];
        longest = longest.max(libm::hypot(b[0] - a[0], b[1] - a[1]));
    }
    if longest > 0.0 { area / longest } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::{PoseDeg, SuccessSet};

    fn rectangle([x0, x1]: [f64; 2], [y0, y1]: [f64; 2]) -> Vec<[f64; 2]> {
        std::vec![[x0, y0], [x1, y0], [x1, y1], [x0, y1]]
    }

    /// An L of two rectangles: a robot passes the corner where neither rectangle contains it.
    #[test]
    fn a_footprint_may_lie_across_regions() {
        let regions = [
            rectangle([0.0, 4.0], [0.0, 1.0]),
            rectangle([0.0, 1.0], [0.0, 4.0]),
        ];
        let robot = rectangle([-0.3, 0.3], [-0.2, 0.2]);
        let shape = Shape::footprint_in_union(&robot, &regions).unwrap();
        let goal = PoseDeg {
            x: 0.0,
            y: 0.0,
            yaw_deg: 0.0,
        };
        let set = SuccessSet { goal, shape };
        let inside =
            |x: f64, y: f64, yaw_deg: f64| set.membership([x, y, yaw_deg.to_radians()]).inside;
        // In each of the rectangles alone, and in both.
        assert!(inside(3.0, 0.5, 0.0) && inside(0.5, 3.0, 0.0));
        assert!(inside(0.9, 0.7, 0.0) && inside(0.85, 0.6, 20.0));
        let both = |x: f64, y: f64| {
            regions.iter().any(|r| {
                let only = Footprint::new(robot.clone(), r.clone()).unwrap();
                let set = SuccessSet {
                    goal,
                    shape: Shape::Footprint(only),
                };
                set.membership([x, y, 0.0]).inside
            })
        };
        assert!(!both(0.9, 0.81) && inside(0.7, 0.81, 0.0) && !inside(0.9, 0.81, 0.0));
        // Over the inner corner.
        assert!(!inside(1.1, 1.0, 45.0));
    }

    /// The free space between the regions is cut into cells; a point on a cut is in no cell, and not in the
    /// union.
    #[test]
    fn a_point_between_regions_is_outside() {
        let regions = [
            rectangle([-2.0, -1.0], [-1.0, 1.0]),
            rectangle([1.0, 2.0], [0.0, 0.5]),
        ];
        assert_eq!(Shape::footprint_in_union(&[[0.0, 0.0]], &[]), None);
        let shape = Shape::footprint_in_union(&[[0.0, 0.0]], &regions).unwrap();
        let goal = PoseDeg {
            x: 0.0,
            y: 0.0,
            yaw_deg: 0.0,
        };
        let set = SuccessSet { goal, shape };
        for x in -40..=40 {
            for y in -20..=20 {
                let [x, y] = [x, y].map(|v| 0.05 * f64::from(v));
                let held = |[x0, x1]: [f64; 2], [y0, y1]: [f64; 2]| {
                    (x0..=x1).contains(&x) && (y0..=y1).contains(&y)
                };
                let expected = held([-2.0, -1.0], [-1.0, 1.0]) || held([1.0, 2.0], [0.0, 0.5]);
                assert_eq!(set.membership([x, y, 0.3]).inside, expected, "{x} {y}");
            }
        }
    }
}
