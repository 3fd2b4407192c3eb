//! The share of a success set that its table contains.
//!
//! Poses of the set within the table's extent are decided one by one, as the gate does, with a pose-set of a micrometre. The groups of the
//! set that have a name (the sets of a union, regions, pairs of regions) are sampled each by itself, because a table can hold nearly the
//! whole set without a single pose across two of its regions.

use crate::bake::ranges;
use crate::contain::{Decision, decide};
use crate::set::{Estimate, PoseSet};
use crate::shape::{GroupName, Ranges, SuccessSet};
use crate::table::Table;
use core::f64::consts::{PI, TAU};
use core::fmt;
use rayon::prelude::*;

/// Number of poses of each named group.
const POSES_OF_GROUP: usize = 4_000;
/// Largest number of tried poses per sampled pose.
const TRIES: usize = 100;
/// Number of equal parts of each range of a group, to find the place where most poses are missing.
const PLACES: usize = 4;
/// The pose-sets that are decided: m, rad.
const TINY: f64 = 1e-6;

/// The share of a set that a table contains.
#[derive(Clone, Debug, PartialEq)]
pub struct Coverage {
    /// The share, from 0 to 1; 1 if no pose of the set is found within the table's extent.
    pub share: f64,
    /// The number of poses of the set that were decided: [`Self::POSES`] or more, unless the set is too thin.
    pub poses: usize,
    /// The named group with the smallest share; without groups the whole set.
    pub worst: GroupCoverage,
}

/// The share of a group of poses that a table contains.
#[derive(Clone, Debug, PartialEq)]
pub struct GroupCoverage {
    /// The name; `None` for the whole set.
    pub name: Option<GroupName>,
    /// The share, from 0 to 1.
    pub share: f64,
    /// Where most of the missing poses are: ranges of x, y and yaw in the goal frame, m, m, rad. `None` if none are missing.
    pub place: Option<Ranges>,
}

impl Coverage {
    /// The number of poses of the set that are decided, unless the set is too thin.
    pub const POSES: usize = 20_000;
    /// The least share of the set without a warning.
    pub const LEAST: f64 = 0.98;
    /// The least share of a group without a warning.
    pub const LEAST_OF_GROUP: f64 = 0.9;

    /// Returns `true` if the table should not be used without a look at what it lacks.
    #[must_use]
    pub fn is_low(&self) -> bool {
        self.share < Self::LEAST || self.worst.share < Self::LEAST_OF_GROUP
    }
}

impl fmt::Display for Coverage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let percent = |share: f64| 100.0 * share;
        write!(
            f,
            "the table holds {:.1} % of the success set within its extent",
            percent(self.share)
        )?;
        let GroupCoverage { name, share, place } = &self.worst;
        if let Some(name) = name {
            write!(f, ", of the poses {} {:.1} %", Where(name), percent(*share))?;
        }
        if let Some([x, y, yaw]) = place {
            let [from, to] = yaw.map(f64::to_degrees);
            write!(
                f,
                "; most are missing at x {:.2} to {:.2} m, y {:.2} to {:.2} m, yaw {from:.0} to {to:.0} deg of the goal frame",
                x[0], x[1], y[0], y[1],
            )?;
        }
        Ok(())
    }
}

/// A group in a sentence.
struct Where<'a>(&'a GroupName);

impl fmt::Display for Where<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            GroupName::Across(..) => write!(f, "{}", self.0),
            _ => write!(f, "in {}", self.0),
        }
    }
}

/// Measures the share of a success set that a table contains, within the table's extent. The result is always the same.
#[must_use]
pub fn coverage(table: &Table<'_>, success: &SuccessSet) -> Coverage {
    let mut ranges = ranges(table.cells());
    // Headings as people write them: the lower end below half a turn.
    if ranges[2][0] >= PI {
        ranges[2] = ranges[2].map(|end| end - TAU);
    }
    let held = |poses: &[[f64; 3]]| -> Vec<bool> {
        poses
            .par_iter()
            .map(|pose| holds(table, success, *pose))
            .collect()
    };
    let mut whole = None;
    let mut worst: Option<GroupCoverage> = None;
    for group in success.groups() {
        let wanted = if group.name.is_some() {
            POSES_OF_GROUP
        } else {
            Coverage::POSES
        };
        let poses = group.sample(ranges, wanted, TRIES * wanted);
        let held = held(&poses);
        let count = held.iter().filter(|held| **held).count();
        let share = if poses.is_empty() {
            1.0
        } else {
            count as f64 / poses.len() as f64
        };
        let is_whole = group.name.is_none();
        let own = GroupCoverage {
            name: group.name,
            share,
            place: place(&poses, &held),
        };
        if is_whole {
            whole = Some((poses.len(), own));
        } else if !poses.is_empty() && worst.as_ref().is_none_or(|worst| share < worst.share) {
            worst = Some(own);
        }
    }
    let (poses, whole) = whole.unwrap_or_else(|| {
        let none = GroupCoverage {
            name: None,
            share: 1.0,
            place: None,
        };
        (0, none)
    });
    Coverage {
        share: whole.share,
        poses,
        worst: worst.unwrap_or(whole),
    }
}

/// Returns `true` if the gate finds a pose of the goal frame inside.
fn holds(table: &Table<'_>, success: &SuccessSet, pose: [f64; 3]) -> bool {
    let [x_m, y_m, yaw_rad] = success.to_world(pose);
    let estimate = Estimate { x_m, y_m, yaw_rad };
    PoseSet::bounded(estimate, TINY, TINY).is_ok_and(|set| decide(table, &set) == Decision::Inside)
}

/// Returns the place where most poses are missing.
fn place(poses: &[[f64; 3]], held: &[bool]) -> Option<Ranges> {
    let all: Ranges = core::array::from_fn(|axis| {
        let values = poses.iter().map(|pose| pose[axis]);
        values.fold([f64::INFINITY, f64::NEG_INFINITY], |[lo, hi], v| {
            [lo.min(v), hi.max(v)]
        })
    });
    let mut missing = [[[0u32; PLACES]; PLACES]; PLACES];
    let index = |pose: &[f64; 3], axis: usize| {
        let [lo, hi] = all[axis];
        ((((pose[axis] - lo) / (hi - lo)) * PLACES as f64) as usize).min(PLACES - 1)
    };
    for (pose, _) in poses.iter().zip(held).filter(|(_, held)| !**held) {
        let [i, j, k] = [0, 1, 2].map(|axis| index(pose, axis));
        missing[i][j][k] += 1;
    }
    let mut most = (0, [0; 3]);
    for (i, plane) in missing.iter().enumerate() {
        for (j, row) in plane.iter().enumerate() {
            for (k, count) in row.iter().enumerate() {
                if *count > most.0 {
                    most = (*count, [i, j, k]);
                }
            }
        }
    }
    let (count, at) = most;
    (count > 0).then(|| {
        core::array::from_fn(|axis| {
            let [lo, hi] = all[axis];
            let end = |i: usize| lo + (hi - lo) * i as f64 / PLACES as f64;
            [end(at[axis]), end(at[axis] + 1)]
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bake::{BakeInput, Extent, Layout, Step, TableSpec, table};
    use crate::shape::{BoxSet, Footprint, PoseDeg, Shape};

    fn set(shape: Shape) -> SuccessSet {
        let goal = PoseDeg {
            x: 1.0,
            y: -2.0,
            yaw_deg: 100.0,
        };
        SuccessSet { goal, shape }
    }

    fn bytes(success: &SuccessSet, layout: Layout) -> Vec<u8> {
        let order = BakeInput {
            task: "t",
            success,
            spec: TableSpec {
                extent: Extent {
                    x: [-2.0, 2.0],
                    y: [-2.0, 2.0],
                    yaw_deg: [-30.0, 30.0],
                },
                step: Step {
                    xy: 0.02,
                    yaw_deg: 2.0,
                },
                layout,
            },
            epsilon: 0.99,
        };
        table(&order, &|| ()).unwrap()
    }

    fn boxed(x: [f64; 2], y: [f64; 2], yaw_deg: [f64; 2]) -> Shape {
        Shape::Box(BoxSet { x, y, yaw_deg })
    }

    /// The table of a box holds it; of a larger box it holds the share of the volumes, and lacks the far end.
    #[test]
    fn coverage_is_share_of_volume() {
        let own = set(boxed([-1.0, 0.5], [-0.5, 0.5], [-20.0, 20.0]));
        let bytes = bytes(&own, Layout::Facets);
        let table = Table::parse(&bytes).unwrap();
        let all = coverage(&table, &own);
        assert!(all.share > 0.998 && all.poses >= Coverage::POSES, "{all:?}");
        assert!(!all.is_low());
        let larger = set(boxed([-1.0, 1.0], [-0.5, 0.5], [-20.0, 20.0]));
        let part = coverage(&table, &larger);
        assert!(
            (part.share - 0.75).abs() < 0.003 && part.is_low(),
            "{part:?}"
        );
        let [x, ..] = part.worst.place.unwrap();
        assert!(x[0] > 0.45 && x[1] <= 1.0, "{part:?}");
        let yaw = part.worst.place.unwrap()[2];
        assert!(yaw[0] > -0.36 && yaw[1] < 0.36, "{part:?}");
        let percent = format!("{:.1} % of the success set", 100.0 * part.share);
        assert!(part.to_string().contains(&percent), "{part}");
        // Headings beyond the extent do not count, poses at the border of the set do.
        let wider = set(boxed([-1.0, 0.5], [-0.5, 0.5], [-90.0, 20.0]));
        let share = coverage(&table, &wider).share;
        assert!((share - 0.8).abs() < 0.003, "{share}");
    }

    /// A set of a millionth of the extent, by itself and next to a large one.
    #[test]
    fn coverage_finds_thin_sets() {
        let thin = || boxed([0.7, 0.71], [0.3, 0.31], [12.0, 12.5]);
        let large = || boxed([-1.0, 0.5], [-0.5, 0.5], [-20.0, 20.0]);
        let of_large = bytes(&set(large()), Layout::Facets);
        let table = Table::parse(&of_large).unwrap();
        let alone = coverage(&table, &set(thin()));
        assert!(
            alone.share == 0.0 && alone.poses >= Coverage::POSES,
            "{alone:?}"
        );
        let both = coverage(&table, &set(Shape::Any(vec![large(), thin()])));
        assert!(both.share > 0.998 && both.is_low(), "{both:?}");
        assert_eq!(both.worst.name, Some(GroupName::Member(1)));
        assert!(
            both.to_string().contains("in set 2 of the union 0.0 %"),
            "{both}"
        );
    }

    /// A table of both regions that lacks all poses across them holds nearly the whole set.
    #[test]
    fn coverage_names_pair_of_regions() {
        let rectangle =
            |[x0, x1]: [f64; 2], [y0, y1]: [f64; 2]| vec![[x0, y0], [x1, y0], [x1, y1], [x0, y1]];
        let robot = rectangle([-0.2, 0.2], [-0.15, 0.15]);
        let regions = [
            rectangle([-1.8, -0.5], [-1.0, 1.0]),
            rectangle([-0.5, 1.8], [-1.5, 1.5]),
            rectangle([1.7, 1.8], [1.4, 1.8]),
        ];
        let alone = regions[..2]
            .iter()
            .map(|region| Shape::Footprint(Footprint::new(robot.clone(), region.clone()).unwrap()));
        let apart = bytes(&set(Shape::Any(alone.collect())), Layout::Facets);
        let table = Table::parse(&apart).unwrap();
        let across = set(Shape::footprint_in_union(&robot, &regions).unwrap());
        let found = coverage(&table, &across);
        assert!(found.share > 0.8 && found.worst.share == 0.0, "{found:?}");
        assert_eq!(found.worst.name, Some(GroupName::Across(0, 1)));
        assert!(
            found.to_string().contains("across regions 1 and 2 0.0 %"),
            "{found}"
        );
        let [x, ..] = found.worst.place.unwrap();
        assert!(x[0] > -0.75 && x[1] < -0.25, "{found:?}");
    }

    #[test]
    fn coverage_is_equal_for_any_number_of_threads() {
        let own = set(boxed([-1.0, 0.5], [-0.5, 0.51], [-20.0, 20.0]));
        let bytes = bytes(&own, Layout::Grid);
        let table = Table::parse(&bytes).unwrap();
        let by = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            pool.unwrap().install(|| coverage(&table, &own))
        };
        let one = by(1);
        assert!(one.share < 1.0 && one.share > 0.9, "{one:?}");
        assert_eq!(one, by(5));
    }
}
