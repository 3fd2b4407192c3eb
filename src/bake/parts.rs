//! Which convex parts of a success set a table is made of.

use crate::shape::{Part, Parts, SuccessSet};
use std::vec;
use std::vec::Vec;

/// A range of poses in the goal frame: x, y, yaw, each lower and upper end, m, m, rad.
pub(super) type Ranges = [[f64; 2]; 3];

/// The parts that cover what lies in a success set within the ranges, at most so many of them; those that
/// cover most come first. `looks` poses along each axis are looked at; where they find little, the ranges
/// are drawn in about what they find.
pub(super) fn covering(
    set: &SuccessSet,
    ranges: Ranges,
    looks: [u32; 3],
    most: usize,
) -> Vec<Part> {
    let parts = Parts::of(set);
    if let Some(only) = parts.only() {
        return vec![only];
    }
    let mut ranges = ranges;
    let mut found: Vec<([f64; 3], Part)> = Vec::new();
    // Drawn in twice at most.
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

/// The fewest parts, chosen greedily, that hold the poses.
fn chosen(found: &[([f64; 3], Part)], most: usize) -> Vec<Part> {
    // Parts that are tried: spread over the poses.
    const TRIED: usize = 256;
    let mut candidates: Vec<&Part> = Vec::new();
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
            // The first of equals.
            .max_by_key(|(gain, number)| (*gain, core::cmp::Reverse(*number)));
        let Some((gain, best)) = best.filter(|(gain, _)| *gain > 0) else {
            break;
        };
        // What adds little costs as much flash as what adds much.
        if parts.len() >= 2 && gain * 400 < found.len() {
            break;
        }
        for (open, holds) in open.iter_mut().zip(&holds[best]) {
            *open &= !holds;
        }
        parts.push(candidates[best].clone());
    }
    parts
}

/// Ranges about the poses that were found, a step wider.
fn about(found: &[([f64; 3], Part)], ranges: Ranges, looks: [u32; 3]) -> Ranges {
    core::array::from_fn(|axis| {
        let [lo, hi] = ranges[axis];
        let step = (hi - lo) / f64::from(looks[axis]);
        let values = found.iter().map(|(pose, _)| pose[axis]);
        let (least, greatest) = values.fold((hi, lo), |(a, b), v| (a.min(v), b.max(v)));
        [(least - step).max(lo), (greatest + step).min(hi)]
    })
}

/// Poses in the middle of equal parts of the ranges.
pub(super) fn lattice(ranges: Ranges, looks: [u32; 3]) -> impl Iterator<Item = [f64; 3]> {
    let at = move |axis: usize, i: u32| {
        let [lo, hi] = ranges[axis];
        lo + (hi - lo) * (f64::from(i) + 0.5) / f64::from(looks[axis])
    };
    (0..looks[2]).flat_map(move |w| {
        (0..looks[1]).flat_map(move |y| (0..looks[0]).map(move |x| [at(0, x), at(1, y), at(2, w)]))
    })
}
