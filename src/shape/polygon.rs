//! Polygons in plain floats: lists of corners.

use super::footprint::orientation;

/// Returns the edges of a polygon, each from a corner to the next.
pub(crate) fn edges(corners: &[[f64; 2]]) -> impl Iterator<Item = [[f64; 2]; 2]> + '_ {
    let ends = corners.iter().cycle().skip(1);
    corners.iter().zip(ends).map(|(a, b)| [*a, *b])
}

/// Returns the part of a convex polygon in a half-plane, given how far within it a point is.
pub(crate) fn clipped(polygon: &[[f64; 2]], depth: impl Fn([f64; 2]) -> f64) -> Vec<[f64; 2]> {
    let mut part = Vec::with_capacity(polygon.len() + 1);
    for [from, to] in edges(polygon) {
        let (a, b) = (depth(from), depth(to));
        if a >= 0.0 {
            part.push(from);
        }
        if (a > 0.0 && b < 0.0) || (a < 0.0 && b > 0.0) {
            let share = a / (a - b);
            part.push([0, 1].map(|axis| from[axis] + share * (to[axis] - from[axis])));
        }
    }
    part
}

/// Returns the convex hull, counter-clockwise (Andrew's monotone chain).
pub fn hull(mut points: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    points.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    points.dedup();
    let chain = |points: &mut dyn Iterator<Item = [f64; 2]>| {
        let mut chain: Vec<[f64; 2]> = Vec::new();
        for point in points {
            while let [.., a, b] = chain.as_slice() {
                if orientation(*a, *b, point) > 0.0 {
                    break;
                }
                chain.pop();
            }
            chain.push(point);
        }
        chain.pop();
        chain
    };
    let mut lower = chain(&mut points.iter().copied());
    lower.extend(chain(&mut points.iter().rev().copied()));
    lower
}
