//! Chooses the extent of a table if the site does not state it.

use super::parts::lattice;
use super::{Extent, reach_m};
use crate::shape::{
    Parts, PoseBlock, PoseDeg, Ranges, Resolved, Shape, SuccessSet, Tolerance, halves,
    is_whole_circle,
};
use core::f64::consts::PI;

/// How much wider than the expected pose-set a table is: estimates lie around the goal, not at it.
const AROUND: f64 = 2.0;
/// Number of sampled poses along each axis.
const LOOKS: u32 = 25;
/// Smallest part of the set's limits that is searched for poses far from the others, on each axis.
const SMALLEST: f64 = 1.0 / 512.0;
/// Largest number of parts that are searched.
const MOST_PARTS: u32 = 1 << 18;

/// Returns an extent that contains a success set, no wider than twice an expected (bounded) pose-set about the goal
/// if one is given. `None` if the set has no bound and no pose-set is expected, or if no pose of the set is found.
///
/// A hull of the set's limits is narrowed three times to the poses that are found in the set. Then the rest of the hull is searched
/// for parts of the set that are much smaller, or far from the others, and the extent is widened to them. (Parts thinner than a
/// thousandth of the hull may be lost; [`crate::verify::coverage`] cannot see them.)
#[must_use]
pub fn extent(set: &SuccessSet, expected: Option<Tolerance>) -> Option<Extent> {
    let everything = [[f64::NEG_INFINITY, f64::INFINITY]; 2];
    let mut ranges =
        hull(&set.shape, set.goal).unwrap_or([everything[0], everything[1], [-PI, PI]]);
    let about = expected.map(|expected| {
        let turn = (AROUND * expected.turn_deg.to_radians()).min(PI);
        let way = AROUND * expected.translation;
        [[-way, way], [-way, way], [-turn, turn]]
    });
    if let Some(about) = about {
        ranges = meet(ranges, about)?;
    }
    let most = reach_m();
    ranges = meet(
        ranges,
        [[-most, most], [-most, most], [-2.0 * PI, 2.0 * PI]],
    )?;
    // A set without any bound would be as wide as the format allows.
    if ranges[..2].iter().any(|[lo, hi]| hi - lo >= 2.0 * most) {
        return None;
    }
    let ranges = widened(set, ranges, narrowed(set, ranges))?;
    // Rounded outwards to whole centimetres and tenths of degrees.
    let outwards = |[lo, hi]: [f64; 2], unit: f64| {
        [
            libm::floor(lo / unit + 1e-6) * unit,
            libm::ceil(hi / unit - 1e-6) * unit,
        ]
    };
    let yaw_deg = ranges[2].map(f64::to_degrees);
    let yaw_deg = if yaw_deg[1] - yaw_deg[0] >= 359.0 {
        [-180.0, 180.0]
    } else {
        outwards(yaw_deg, 0.1)
    };
    Some(Extent {
        x: outwards(ranges[0], 0.01),
        y: outwards(ranges[1], 0.01),
        yaw_deg,
    })
}

/// Returns the limits narrowed three times to the poses of a lattice that are in a set; `None` if none are found.
fn narrowed(set: &SuccessSet, mut ranges: Ranges) -> Option<Ranges> {
    let parts = Parts::of(set);
    for _ in 0..3 {
        let mut found: Option<Ranges> = None;
        for pose in lattice(ranges, [LOOKS; 3]) {
            if parts.holding(&[pose]).1 >= 0.0 {
                let at = pose.map(|v| [v, v]);
                found = Some(found.map_or(at, |known| join(known, at)));
            }
        }
        let found = found?;
        let step: [f64; 3] =
            core::array::from_fn(|i| (ranges[i][1] - ranges[i][0]) / f64::from(LOOKS));
        ranges = core::array::from_fn(|i| {
            [
                (found[i][0] - step[i]).max(ranges[i][0]),
                (found[i][1] + step[i]).min(ranges[i][1]),
            ]
        });
    }
    Some(ranges)
}

/// Returns ranges widened to the parts of a set that are more than a lattice step outside of them, within limits; `None` without a pose.
///
/// The limits are halved. Halves that cannot contain poses of the set, or that lie in the ranges, are dropped, the smallest ones also
/// if none of 27 poses of them is in the set.
fn widened(set: &SuccessSet, limits: Ranges, mut ranges: Option<Ranges>) -> Option<Ranges> {
    let evaluator = set.evaluator();
    let step = ranges.map(|ranges| ranges.map(|[lo, hi]| (hi - lo) / f64::from(LOOKS)));
    let mut open = vec![limits];
    let mut searched = 0;
    while let Some(block) = open.pop() {
        let is_known = ranges.zip(step).is_some_and(|(ranges, step)| {
            (0..3).all(|i| {
                ranges[i][0] - step[i] <= block[i][0] && block[i][1] <= ranges[i][1] + step[i]
            })
        });
        searched += 1;
        if is_known || searched > MOST_PARTS || evaluator.excludes(&PoseBlock::of(block)) {
            continue;
        }
        let is_small =
            (0..3).all(|i| block[i][1] - block[i][0] <= SMALLEST * (limits[i][1] - limits[i][0]));
        if !is_small {
            open.extend(halves(block));
        } else if lattice(block, [3; 3]).any(|pose| evaluator.contains(pose)) {
            ranges = Some(ranges.map_or(block, |known| join(known, block)));
        }
    }
    ranges
}

/// Returns an extent that contains a set from its limits alone: wider than [`extent`], but computed in a
/// microsecond. `None` if the set has no bound.
#[must_use]
pub fn wide_extent(set: &SuccessSet) -> Option<Extent> {
    let [x, y, yaw] = hull(&set.shape, set.goal)?;
    let most = reach_m();
    if [x, y].iter().any(|[lo, hi]| !(*lo > -most && *hi < most)) {
        return None;
    }
    let yaw_deg = yaw.map(f64::to_degrees);
    Some(Extent {
        x: [x[0] - 0.01, x[1] + 0.01],
        y: [y[0] - 0.01, y[1] + 0.01],
        yaw_deg: if yaw_deg[1] - yaw_deg[0] >= 359.0 {
            [-180.0, 180.0]
        } else {
            [yaw_deg[0] - 0.1, yaw_deg[1] + 0.1]
        },
    })
}

/// Returns a range of poses that contains a set; `None` if a range is empty.
fn hull(shape: &Shape, goal: PoseDeg) -> Option<Ranges> {
    const ALL: Ranges = [
        [f64::NEG_INFINITY, f64::INFINITY],
        [f64::NEG_INFINITY, f64::INFINITY],
        [-PI, PI],
    ];
    match shape {
        Shape::Box(set) => {
            let yaw = if is_whole_circle(set.yaw_deg) {
                [-PI, PI]
            } else {
                set.yaw_deg.map(f64::to_radians)
            };
            Some([set.x, set.y, yaw])
        }
        Shape::Footprint(set) => {
            // At least one point of the robot is in the region.
            let arm = set.lever();
            let ends = |axis: usize| {
                let values = set.region().iter().map(|corner| corner[axis]);
                values.fold([f64::INFINITY, f64::NEG_INFINITY], |[lo, hi], v| {
                    [lo.min(v), hi.max(v)]
                })
            };
            let [x, y] = [ends(0), ends(1)].map(|[lo, hi]| [lo - arm, hi + arm]);
            Some([x, y, [-PI, PI]])
        }
        Shape::Visibility(set) | Shape::Bounded { view: set, .. } => {
            let tag: Resolved<f64> = set.resolve(goal);
            let reach = set.d_max + libm::hypot(set.mount.x, set.mount.y);
            let [x, y] = [0, 1].map(|i| [tag.centre[i] - reach, tag.centre[i] + reach]);
            Some([x, y, [-PI, PI]])
        }
        Shape::Apart(_) => Some(ALL),
        Shape::Any(sets) => sets.iter().filter_map(|set| hull(set, goal)).reduce(join),
        Shape::All(sets) => sets
            .iter()
            .map(|set| hull(set, goal))
            .try_fold(ALL, |sum, next| meet(sum, next?)),
    }
}

fn join(a: Ranges, b: Ranges) -> Ranges {
    core::array::from_fn(|i| [a[i][0].min(b[i][0]), a[i][1].max(b[i][1])])
}

/// Returns the intersection. Headings may differ by turns: the nearest turn of the second is used.
fn meet(a: Ranges, mut b: Ranges) -> Option<Ranges> {
    let whole = |[lo, hi]: [f64; 2]| hi - lo >= 2.0 * PI - 1e-9;
    if whole(b[2]) {
        b[2] = a[2];
    } else if !whole(a[2]) {
        let middle = |[lo, hi]: [f64; 2]| 0.5 * (lo + hi);
        let turns = libm::round((middle(a[2]) - middle(b[2])) / (2.0 * PI)) * 2.0 * PI;
        b[2] = b[2].map(|end| end + turns);
    }
    let a = if whole(a[2]) { [a[0], a[1], b[2]] } else { a };
    let both: Ranges = core::array::from_fn(|i| [a[i][0].max(b[i][0]), a[i][1].min(b[i][1])]);
    both.iter().all(|[lo, hi]| lo < hi).then_some(both)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::BoxSet;

    fn set(shape: Shape) -> SuccessSet {
        let goal = PoseDeg {
            x: 1.0,
            y: -2.0,
            yaw_deg: 30.0,
        };
        SuccessSet { goal, shape }
    }

    fn contains(extent: Extent, x: [f64; 2], y: [f64; 2], yaw_deg: [f64; 2]) -> bool {
        let pairs = [(extent.x, x), (extent.y, y), (extent.yaw_deg, yaw_deg)];
        let within = |[lo, hi]: [f64; 2], [a, b]: [f64; 2]| lo <= a + 1e-9 && b <= hi + 1e-9;
        pairs.iter().all(|(outer, inner)| within(*outer, *inner))
    }

    /// No pose of a lattice over the hall is in the dock, nor in the passage.
    #[test]
    fn chosen_extent_contains_small_sets_far_from_large_one() {
        let of = |x, y, yaw_deg| Shape::Box(BoxSet { x, y, yaw_deg });
        let any = set(Shape::Any(vec![
            of([-6.0, 0.0], [-3.0, 3.0], [-20.0, 20.0]),
            of([4.71, 4.77], [0.31, 0.36], [84.0, 86.0]),
        ]));
        let chosen = extent(&any, None).unwrap();
        assert!(
            contains(chosen, [-6.0, 4.77], [-3.0, 3.0], [-20.0, 86.0]),
            "{chosen:?}"
        );
        assert!(chosen.x[1] < 4.9 && chosen.yaw_deg[1] < 90.0, "{chosen:?}");
        let alone = set(of([4.71, 4.77], [0.31, 0.36], [84.0, 86.0]));
        let all = set(Shape::All(vec![any.shape, alone.shape]));
        let chosen = extent(&all, None).unwrap();
        assert!(
            contains(chosen, [4.71, 4.77], [0.31, 0.36], [84.0, 86.0]),
            "{chosen:?}"
        );
    }

    #[test]
    fn chosen_extent_contains_narrow_passage_of_regions() {
        let rectangle =
            |[x0, x1]: [f64; 2], [y0, y1]: [f64; 2]| vec![[x0, y0], [x1, y0], [x1, y1], [x0, y1]];
        let robot = rectangle([-0.3, 0.3], [-0.2, 0.2]);
        let regions = [
            rectangle([-5.0, 0.0], [-4.0, 4.0]),
            rectangle([0.0, 5.0], [1.0, 1.42]),
        ];
        let across = set(Shape::footprint_in_union(&robot, &regions).unwrap());
        let chosen = extent(&across, None).unwrap();
        assert!(
            contains(chosen, [-4.8, 4.7], [-3.8, 3.8], [-180.0, 180.0]),
            "{chosen:?}"
        );
        // A set without a pose.
        let long = rectangle([-6.0, 6.0], [-0.2, 0.2]);
        let none = set(Shape::footprint_in_union(&long, &regions).unwrap());
        assert_eq!(extent(&none, None), None);
    }
}
