//! Collisions of walls, blocks and robots on the floor.

/// Overlaps up to this depth do not count, metres: tags are mounted on walls.
const TOUCHING: f64 = 1e-6;

/// Returns `true` if the insides of two convex outlines intersect. Each outline may be a single
/// point, or a line of two points.
pub(super) fn meet(a: &[[f64; 2]], b: &[[f64; 2]]) -> bool {
    // If they do not intersect, they are separated by the normal of an edge, or, for lines and points, by the line's
    // own direction.
    let directions: Vec<[f64; 2]> = edges(a).chain(edges(b)).collect();
    let of_line = |points: &[[f64; 2]]| points.len() == 2;
    let along = edges(a)
        .filter(|_| of_line(a))
        .chain(edges(b).filter(|_| of_line(b)))
        .map(|[x, y]| [y, -x]);
    !directions.iter().copied().chain(along).any(|normal| {
        let ([a0, a1], [b0, b1]) = (over(a, normal), over(b, normal));
        a1 <= b0 + TOUCHING || b1 <= a0 + TOUCHING
    })
}

/// Yields the unit normals of the edges.
fn edges(points: &[[f64; 2]]) -> impl Iterator<Item = [f64; 2]> + '_ {
    let ends = points.iter().cycle().skip(1);
    points.iter().zip(ends).filter_map(|(a, b)| {
        let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
        let length = libm::hypot(dx, dy);
        (length > 0.0).then(|| [dy / length, -dx / length])
    })
}

/// Returns the interval of the points' projections onto a direction.
fn over(points: &[[f64; 2]], [nx, ny]: [f64; 2]) -> [f64; 2] {
    let heights = points.iter().map(|[x, y]| nx * x + ny * y);
    heights.fold([f64::INFINITY, f64::NEG_INFINITY], |[lo, hi], h| {
        [lo.min(h), hi.max(h)]
    })
}

#[cfg(test)]
mod tests {
    use super::meet;

    #[test]
    fn outlines_meet_if_their_insides_intersect() {
        let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        let moved = |x: f64, y: f64| square.map(|[a, b]| [a + x, b + y]);
        assert!(meet(&square, &moved(0.9, 0.9)) && meet(&square, &square));
        assert!(!meet(&square, &moved(1.0, 0.0)) && !meet(&square, &moved(0.0, -1.1)));
        assert!(meet(&square, &[[0.5, 0.5]]) && !meet(&square, &[[1.0, 0.5]]));
        // A wall through it, in front of it, and next to it on its line.
        assert!(meet(&square, &[[0.5, -1.0], [0.5, 2.0]]));
        assert!(!meet(&square, &[[1.5, -1.0], [1.5, 2.0]]));
        assert!(!meet(&square, &[[0.5, 1.5], [0.5, 2.0]]));
        assert!(meet(&[[0.0, 0.0], [1.0, 1.0]], &[[0.0, 1.0], [1.0, 0.0]]));
    }
}
