//! Drives whose straight path crosses a wall. A plan covers the robot's uncertainty and not its shape: the navigation
//! avoids collisions.

use super::{ChainReport, StepKind};
use posegate_site::Site;

/// Returns the number (from 0) of each drive whose straight path crosses a wall or block of the site, with the wall's
/// name.
fn crossings<'s>(report: &ChainReport, site: &'s Site) -> Vec<(usize, &'s str)> {
    let mut found = Vec::new();
    for (number, step) in report.steps.iter().enumerate() {
        if step.kind != StepKind::Navigation {
            continue;
        }
        let path = [step.before.pose, step.after.pose].map(|[x, y, _]| [x, y]);
        let crossed = site.walls.iter().filter(|wall| {
            let corners = &wall.corners;
            let next = corners.iter().cycle().skip(1);
            corners
                .iter()
                .zip(next)
                .any(|(from, to)| meet(path, [*from, *to]))
        });
        found.extend(crossed.map(|wall| (number, wall.name.as_str())));
    }
    found
}

/// Returns a sentence for each drive whose straight path crosses a wall or block of the site, with the number of the
/// step, from 1, and the name of the wall.
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

/// Returns `true` if two line segments cross or touch.
fn meet([a, b]: [[f64; 2]; 2], [c, d]: [[f64; 2]; 2]) -> bool {
    let side = |from: [f64; 2], to: [f64; 2], at: [f64; 2]| {
        (to[0] - from[0]) * (at[1] - from[1]) - (to[1] - from[1]) * (at[0] - from[0])
    };
    let apart = |p: f64, q: f64| p * q > 0.0;
    // Collinear segments have all sides zero: compare them along both axes.
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
    fn segments_meet_if_they_cross_or_touch() {
        let path = [[0.0, 0.0], [4.0, 4.0]];
        for (line, expected) in [
            ([[0.0, 4.0], [4.0, 0.0]], true),
            ([[0.0, 4.0], [1.5, 2.5]], false),
            ([[2.0, 2.0], [2.0, 9.0]], true),
            ([[5.0, 5.0], [6.0, 6.0]], false),
            ([[3.0, 3.0], [6.0, 6.0]], true),
            ([[0.0, 1.0], [4.0, 5.0]], false),
        ] {
            assert_eq!(meet(path, line), expected, "{line:?}");
            assert_eq!(meet(line, path), expected, "{line:?}");
        }
    }
}
