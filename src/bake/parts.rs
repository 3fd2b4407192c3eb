//! Chooses the convex parts of a success set from which a table is made.

use super::{Nearest, slab_start};
use crate::certify::radians;
use crate::shape::{ConvexPart, Parts, PoseGroup, Ranges, SuccessSet};
use crate::table::Cells;
use core::f64::consts::TAU;

/// Returns the poses that a table covers.
pub(crate) fn ranges(cells: &Cells) -> Ranges {
    let metres = |um: i32| f64::from(um) * 1e-6;
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
/// first.
///
/// If the set is a union, the poses of each of its groups count equally, however few they are ([`SuccessSet::groups`]).
pub(super) fn covering(
    set: &SuccessSet,
    ranges: Ranges,
    looks: [u32; 3],
    most: usize,
) -> Vec<ConvexPart> {
    let parts = Parts::of(set);
    if let Some(only) = parts.only() {
        return vec![only];
    }
    let of_lattice = of_lattice(&parts, ranges, looks, most);
    let groups = set.groups();
    if groups.len() == 1 {
        return of_lattice;
    }
    GroupPoses::new(&parts, &groups, ranges).chosen(of_lattice, most)
}

/// Returns parts that cover a lattice of `looks` poses along each axis. If few of them are in the set, the ranges are narrowed to
/// those that are.
fn of_lattice(parts: &Parts, ranges: Ranges, looks: [u32; 3], most: usize) -> Vec<ConvexPart> {
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

/// Poses of a set's groups, with the parts that hold them.
struct GroupPoses {
    poses: Vec<[f64; 3]>,
    /// The largest slack of a part at each pose.
    slacks: Vec<f64>,
    /// The weight of each pose: those of a group add up to 1.
    weights: Vec<f64>,
    /// The number of groups with a pose.
    groups: f64,
    /// Parts with the largest slack at one of the poses.
    candidates: Vec<ConvexPart>,
}

/// Poses of each group.
const POSES: usize = 400;
/// Tried poses of each group.
const TRIES: usize = 100 * POSES;
/// The mean share of the largest slack that the parts of a lattice must give for every group.
const GOOD: f64 = 0.97;
/// The least gain of a part, in that share of one group.
const GAIN: f64 = 0.004;

impl GroupPoses {
    fn new(parts: &Parts, groups: &[PoseGroup], ranges: Ranges) -> Self {
        let mut all = Self {
            poses: Vec::new(),
            slacks: Vec::new(),
            weights: Vec::new(),
            groups: 0.0,
            candidates: Vec::new(),
        };
        for group in groups {
            let found = group.sample(ranges, POSES, TRIES);
            let stride = (found.len() / POSES).max(1);
            let first = all.poses.len();
            for pose in found.into_iter().step_by(stride) {
                let (part, slack) = parts.holding(&[pose]);
                if slack > 1e-6 {
                    all.poses.push(pose);
                    all.slacks.push(slack);
                    if !all.candidates.iter().any(|known| known.is_same(&part)) {
                        all.candidates.push(part);
                    }
                }
            }
            let count = all.poses.len() - first;
            all.weights
                .extend(core::iter::repeat_n(1.0 / count as f64, count));
            all.groups += f64::from(u8::from(count > 0));
        }
        all
    }

    /// Returns the share of the largest slack that each part gives at each pose, from 0 to 1.
    fn shares(&self, parts: &[ConvexPart]) -> Vec<Vec<f64>> {
        let mut all = ConvexPart::slacks(parts, &self.poses);
        for slacks in &mut all {
            for (slack, largest) in slacks.iter_mut().zip(&self.slacks) {
                *slack = (*slack / largest).clamp(0.0, 1.0);
            }
        }
        all
    }

    /// Returns the parts of a lattice if they are good for every group, or else other parts, chosen greedily.
    fn chosen(&self, of_lattice: Vec<ConvexPart>, most: usize) -> Vec<ConvexPart> {
        let mut best = vec![0.0; self.poses.len()];
        for shares in self.shares(&of_lattice) {
            raise(&mut best, &shares);
        }
        let mut at = 0;
        let mut is_good = true;
        while at < best.len() {
            let count = libm::round(1.0 / self.weights[at]) as usize;
            let sum: f64 = best[at..at + count].iter().sum();
            is_good &= sum >= GOOD * count as f64;
            at += count;
        }
        if is_good {
            return of_lattice;
        }
        let shares = self.shares(&self.candidates);
        // Cells may have as many parts as they like.
        let mut parts = if most > FEW { of_lattice } else { Vec::new() };
        if parts.is_empty() {
            best.fill(0.0);
        }
        while parts.len() < most {
            let gain = |shares: &Vec<f64>| -> f64 {
                let gains = shares.iter().zip(&best).zip(&self.weights);
                gains
                    .map(|((own, best), weight)| weight * (own - best).max(0.0))
                    .sum()
            };
            let gains = shares.iter().map(gain).enumerate();
            // The first among equals.
            let found = gains.max_by(|a, b| a.1.total_cmp(&b.1).then(b.0.cmp(&a.0)));
            let Some((number, _)) = found.filter(|(_, gain)| *gain > GAIN) else {
                break;
            };
            raise(&mut best, &shares[number]);
            parts.push(self.candidates[number].clone());
        }
        parts
    }
}

/// Raises numbers to others that are larger.
fn raise(best: &mut [f64], others: &[f64]) {
    for (best, other) in best.iter_mut().zip(others) {
        *best = best.max(*other);
    }
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
