//! Chooses the convex parts of a success set from which a table is made.

use super::{Nearest, slab_start};
use crate::shape::{ConvexPart, Parts, Ranges, SuccessSet};
use crate::table::Cells;
use core::f64::consts::TAU;

/// Returns the poses that a table covers.
pub(crate) fn ranges(cells: &Cells) -> Ranges {
    let metres = |um: i32| f64::from(um) * 1e-6;
    let radians = |units: i64| units as f64 / 4_294_967_296.0 * core::f64::consts::TAU;
    let start = slab_start(cells);
    [
        [metres(cells.x_lo_um), metres(cells.x_hi_um())],
        [metres(cells.y_lo_um), metres(cells.y_hi_um())],
        [radians(start), radians(start + cells.yaw_span as i64)],
    ]
}

/// Returns the pose within the ranges that violates a set least, from lattices that are refined around
/// the best pose.
pub(super) fn nearest(set: &SuccessSet, mut ranges: Ranges) -> Nearest {
    let look = |pose: [f64; 3]| {
        let world = set.to_world(pose);
        let slacks = set.membership(world).slack;
        let [x, y, yaw] = world;
        let world = [x, y, yaw - TAU * libm::round(yaw / TAU)];
        let least = slacks.into_iter().min_by(|a, b| a.1.total_cmp(&b.1));
        let (constraint, slack) = least.unwrap_or(("nothing", f64::INFINITY));
        Nearest {
            pose: world,
            constraint,
            slack,
        }
    };
    let mut best = look(ranges.map(|[lo, hi]| 0.5 * (lo + hi)));
    for _ in 0..6 {
        let found = lattice(ranges, [11; 3])
            .map(|pose| (look(pose), pose))
            .max_by(|a, b| a.0.slack.total_cmp(&b.0.slack));
        let Some((found, at)) = found else {
            break;
        };
        if found.slack > best.slack {
            best = found;
        }
        ranges = core::array::from_fn(|axis| {
            let [lo, hi] = ranges[axis];
            let step = (hi - lo) / 8.0;
            [(at[axis] - step).max(lo), (at[axis] + step).min(hi)]
        });
    }
    best
}

/// Returns at most `most` parts that cover the success set within the ranges, those that cover most
/// first. Samples `looks` poses along each axis. If few of them are in the set, the ranges are narrowed
/// to those that are.
pub(super) fn covering(
    parts: &Parts,
    ranges: Ranges,
    looks: [u32; 3],
    most: usize,
) -> Vec<ConvexPart> {
    if let Some(only) = parts.only() {
        return vec![only];
    }
    let mut ranges = ranges;
    let mut found: Vec<([f64; 3], ConvexPart)> = Vec::new();
    // The ranges are narrowed at most twice.
    for _ in 0..3 {
        let held = lattice(ranges, looks).filter_map(|pose| {
            let (part, slack) = parts.holding(&[pose]);
            (slack >= 0.0).then_some((pose, part))
        });
        let held: Vec<_> = held.collect();
        let enough = held.len() * 8 >= looks.iter().map(|n| *n as usize).product();
        if !held.is_empty() {
            ranges = about(&held, ranges, looks);
            found = held;
        }
        if enough || found.is_empty() {
            break;
        }
    }
    chosen(&found, most)
}

/// Up to this number of parts, parts that add little are skipped.
const FEW: usize = 32;
/// A part adds little if it adds less than the poses divided by this number.
const LITTLE: usize = 1_000;

/// Returns a small number of parts that contain the poses, chosen greedily.
fn chosen(found: &[([f64; 3], ConvexPart)], most: usize) -> Vec<ConvexPart> {
    // Candidate parts, spread over the poses.
    const TRIED: usize = 256;
    let mut candidates: Vec<&ConvexPart> = Vec::new();
    let stride = found.len().div_ceil(4 * TRIED).max(1);
    for (_, part) in found.iter().step_by(stride) {
        if candidates.len() < TRIED && !candidates.iter().any(|known| known.is_same(part)) {
            candidates.push(part);
        }
    }
    let holds: Vec<Vec<bool>> = candidates
        .iter()
        .map(|part| {
            found
                .iter()
                .map(|(pose, _)| part.slack(*pose) >= 0.0)
                .collect()
        })
        .collect();
    let mut open = vec![true; found.len()];
    let mut parts = Vec::new();
    while parts.len() < most {
        let gain = |holds: &Vec<bool>| holds.iter().zip(&open).filter(|(h, o)| **h && **o).count();
        let best = holds
            .iter()
            .enumerate()
            .map(|(number, holds)| (gain(holds), number))
            // The first among equals.
            .max_by_key(|(gain, number)| (*gain, core::cmp::Reverse(*number)));
        let Some((gain, best)) = best.filter(|(gain, _)| *gain > 0) else {
            break;
        };
        // A part that adds little needs as much flash as a part that adds much. But at a corner that extends into the set, pose-sets are
        // covered only by all the parts that meet there.
        if parts.len() >= 2 && gain * LITTLE < found.len() && most <= FEW {
            break;
        }
        for (open, holds) in open.iter_mut().zip(&holds[best]) {
            *open &= !holds;
        }
        parts.push(candidates[best].clone());
    }
    parts
}

/// Returns the ranges of the poses found, one step wider.
fn about(found: &[([f64; 3], ConvexPart)], ranges: Ranges, looks: [u32; 3]) -> Ranges {
    core::array::from_fn(|axis| {
        let [lo, hi] = ranges[axis];
        let step = (hi - lo) / f64::from(looks[axis]);
        let values = found.iter().map(|(pose, _)| pose[axis]);
        let (least, greatest) = values.fold((hi, lo), |(a, b), v| (a.min(v), b.max(v)));
        [(least - step).max(lo), (greatest + step).min(hi)]
    })
}

/// Returns poses in the middle of equal parts of the ranges.
pub(super) fn lattice(ranges: Ranges, looks: [u32; 3]) -> impl Iterator<Item = [f64; 3]> {
    let at = move |axis: usize, i: u32| {
        let [lo, hi] = ranges[axis];
        lo + (hi - lo) * (f64::from(i) + 0.5) / f64::from(looks[axis])
    };
    (0..looks[2]).flat_map(move |w| {
        (0..looks[1]).flat_map(move |y| (0..looks[0]).map(move |x| [at(0, x), at(1, y), at(2, w)]))
    })
}
