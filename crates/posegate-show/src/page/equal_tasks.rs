//! Tasks that are equal in the frames of their goals: a page shows one of them for all.

use super::contents::Shown;
use posegate_site::{Site, Task};

/// Lengths that differ by less are equal in a picture, metres; areas in square metres.
const SAME: f64 = 1e-3;

/// Returns the tasks in groups of equal tasks, in the order of each group's first task.
pub(super) fn groups_of_equal<'c>(site: &Site, tasks: &'c [Shown]) -> Vec<Vec<&'c Shown>> {
    let mut groups: Vec<Vec<&Shown>> = Vec::new();
    for task in tasks {
        let known = groups.iter_mut().find(|group| {
            let first = group.first();
            first.is_some_and(|first| are_equal(site, first, task))
        });
        match known {
            Some(group) => group.push(task),
            None => groups.push(vec![task]),
        }
    }
    groups
}

fn are_equal(site: &Site, a: &Shown, b: &Shown) -> bool {
    let (Some(first), Some(second)) = (site.tasks.get(&a.name), site.tasks.get(&b.name)) else {
        return false;
    };
    let same = |task: &Task| (task.kind, task.error_bound, task.wish);
    if same(first) != same(second) || a.table.is_ok() != b.table.is_ok() {
        return false;
    }
    // Tags have places in the world, so sets of views are compared by their pictures.
    let views = |task: &Task| !task.success.tags().is_empty();
    if views(first) || views(second) {
        views(first) && views(second) && have_equal_sections(a, b)
    } else {
        first.success.shape == second.success.shape
    }
}

fn have_equal_sections(a: &Shown, b: &Shown) -> bool {
    let near = |a: f64, b: f64| (a - b).abs() <= SAME;
    a.sections.len() == b.sections.len()
        && a.sections
            .iter()
            .zip(&b.sections)
            .all(|((yaw, rings), (other, others))| {
                near(*yaw, *other)
                    && rings.len() == others.len()
                    && rings.iter().zip(others).all(|(ring, other)| {
                        let (a, b) = (numbers(ring), numbers(other));
                        a.into_iter().zip(b).all(|(a, b)| near(a, b))
                    })
            })
}

/// The area and the ends of a ring: the same for two equal rings with different corners.
fn numbers(ring: &[[f64; 2]]) -> [f64; 5] {
    let ends = |axis: usize| {
        ring.iter()
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[lo, hi], point| {
                [lo.min(point[axis]), hi.max(point[axis])]
            })
    };
    let ([x0, x1], [y0, y1]) = (ends(0), ends(1));
    [area(ring), x0, x1, y0, y1]
}

/// Returns the area of a ring, negative if it is clockwise.
pub(super) fn area(ring: &[[f64; 2]]) -> f64 {
    let next = ring.iter().cycle().skip(1);
    let twice: f64 = ring
        .iter()
        .zip(next)
        .map(|([ax, ay], [bx, by])| ax * by - ay * bx)
        .sum();
    0.5 * twice
}
