//! Drives whose straight way crosses a wall. A plan states what a robot knows, not where it fits: the navigation avoids collisions.

use super::{ChainReport, StepKind};
use crate::site::Site;

/// Returns the number (from 0) of each drive whose straight way crosses a wall or block of the site, with the wall's name.
fn crossings<'s>(report: &ChainReport, site: &'s Site) -> Vec<(usize, &'s str)> {
    let mut found = Vec::new();
    for (number, step) in report.steps.iter().enumerate() {
        if step.kind != StepKind::Navigation {
            continue;
        }
        let way = [step.before.pose, step.after.pose].map(|[x, y, _]| [x, y]);
        let crossed = site.walls.iter().filter(|wall| {
            let corners = &wall.corners;
            let next = corners.iter().cycle().skip(1);
            corners
                .iter()
                .zip(next)
                .any(|(from, to)| meet(way, [*from, *to]))
        });
        found.extend(crossed.map(|wall| (number, wall.name.as_str())));
    }
    found
}

/// Returns a sentence for each drive whose straight way crosses a wall or block of the site, with the number of the step, from 1, and the
/// name of the wall.
#[must_use]
pub fn crossing_notes(report: &ChainReport, site: &Site) -> Vec<String> {
    let found = crossings(report, site);
    let notes = found.into_iter().map(|(number, wall)| {
        format!(
            "the straight way of step {} crosses `{wall}`: drives are not checked for collisions, and the navigation drives farther around it",
            number + 1
        )
    });
    notes.collect()
}

/// Returns `true` if two lines between two points cross or touch.
fn meet([a, b]: [[f64; 2]; 2], [c, d]: [[f64; 2]; 2]) -> bool {
    let side = |from: [f64; 2], to: [f64; 2], at: [f64; 2]| {
        (to[0] - from[0]) * (at[1] - from[1]) - (to[1] - from[1]) * (at[0] - from[0])
    };
    let apart = |p: f64, q: f64| p * q > 0.0;
    // Lines on one line have all sides zero: they are compared along both axes.
    let ranges = (0..2).all(|axis| {
        let [low, high] = [a[axis].min(b[axis]), a[axis].max(b[axis])];
        c[axis].max(d[axis]) >= low && c[axis].min(d[axis]) <= high
    });
    ranges && !apart(side(a, b, c), side(a, b, d)) && !apart(side(c, d, a), side(c, d, b))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_meet_where_they_cross_or_touch() {
        let way = [[0.0, 0.0], [4.0, 4.0]];
        for (line, expected) in [
            ([[0.0, 4.0], [4.0, 0.0]], true),
            ([[0.0, 4.0], [1.5, 2.5]], false),
            ([[2.0, 2.0], [2.0, 9.0]], true),
            ([[5.0, 5.0], [6.0, 6.0]], false),
            ([[3.0, 3.0], [6.0, 6.0]], true),
            ([[0.0, 1.0], [4.0, 5.0]], false),
        ] {
            assert_eq!(meet(way, line), expected, "{line:?}");
            assert_eq!(meet(line, way), expected, "{line:?}");
        }
    }
}
