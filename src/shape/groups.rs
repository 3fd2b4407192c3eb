//! Groups of the poses of a set that its writer can name, and samples of them.
//!
//! A small group, such as the poses across two regions, is lost among the poses of the whole set. So each group is sampled by
//! itself: its surroundings are halved, the halves without a pose of the group are removed, and poses are drawn from the rest.

use super::evaluator::{PoseBlock, SetEvaluator};
use super::{Exclusion, Footprint, Planar, Shape, SuccessSet};
use core::fmt;
use rayon::prelude::*;

/// Ranges of x, y and yaw: `[lo, hi]`, m, m, rad.
pub type Ranges = [[f64; 2]; 3];

/// Largest number of groups. With more, the set is not divided further.
const MOST_GROUPS: usize = 64;
/// Number of blocks from which poses are drawn.
const BLOCKS: usize = 4_096;
/// Number of poses that are drawn at once.
const BATCH: usize = 1 << 14;

/// The name of a group. Numbers are indices, as in the site file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum GroupName {
    /// A set of a union.
    Member(usize),
    /// The robot is in this region.
    Region(usize),
    /// The robot is in two regions, and in neither of them alone.
    Across(usize, usize),
}

impl fmt::Display for GroupName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Member(set) => write!(f, "set {} of the union", set + 1),
            Self::Region(region) => write!(f, "region {}", region + 1),
            Self::Across(a, b) => write!(f, "across regions {} and {}", a + 1, b + 1),
        }
    }
}

/// Poses of a success set.
#[derive(Clone, Debug)]
pub struct PoseGroup {
    /// The name; `None` for the whole set.
    pub name: Option<GroupName>,
    set: SuccessSet,
    /// The robot in either of two regions.
    across: Option<[Footprint; 2]>,
}

impl SuccessSet {
    /// Returns the whole set as a group, and the groups of its unions: the sets of each union, each region, and each pair of regions. They
    /// may overlap, and some may have no pose.
    #[must_use]
    pub fn groups(&self) -> Vec<PoseGroup> {
        let mut groups = vec![PoseGroup {
            name: None,
            set: self.clone(),
            across: None,
        }];
        let (members, regions) = divided(&self.shape);
        if members.len() + regions.len() * (regions.len() + 1) / 2 <= MOST_GROUPS {
            let of = |name, shape, across| PoseGroup {
                name: Some(name),
                set: SuccessSet {
                    shape,
                    ..self.clone()
                },
                across,
            };
            let members = members.into_iter().enumerate();
            groups.extend(members.map(|(i, shape)| of(GroupName::Member(i), shape, None)));
            for (i, region) in regions.iter().enumerate() {
                let own = Shape::All(vec![Shape::Footprint(region.clone()), self.shape.clone()]);
                groups.push(of(GroupName::Region(i), own, None));
                for (j, other) in regions.iter().enumerate().skip(i + 1) {
                    let both = Some([region.clone(), other.clone()]);
                    groups.push(of(GroupName::Across(i, j), self.shape.clone(), both));
                }
            }
        }
        groups
    }
}

/// Returns the sets of which a shape is the union, and the robot in each of its regions.
fn divided(shape: &Shape) -> (Vec<Shape>, Vec<Footprint>) {
    match shape {
        Shape::Any(sets) => (sets.clone(), Vec::new()),
        Shape::Apart(Exclusion::Gap { clear, regions }) => {
            let robot = |region: &Vec<[f64; 2]>| {
                Footprint::new(clear.footprint().to_vec(), region.clone()).ok()
            };
            (Vec::new(), regions.iter().filter_map(robot).collect())
        }
        Shape::All(sets) => {
            let inner = sets.iter().map(divided).enumerate();
            let mut members = Vec::new();
            let mut regions: Vec<Footprint> = Vec::new();
            for (place, (own, theirs)) in inner {
                members.extend(own.into_iter().map(|member| {
                    let mut sets = sets.clone();
                    sets[place] = member;
                    Shape::All(sets)
                }));
                // Each of the gaps between regions names all of them.
                if !theirs.iter().all(|region| regions.contains(region)) {
                    regions.extend(theirs);
                }
            }
            (members, regions)
        }
        Shape::Box(_)
        | Shape::Footprint(_)
        | Shape::Visibility(_)
        | Shape::Bounded { .. }
        | Shape::Apart(_) => (Vec::new(), Vec::new()),
    }
}

/// A group prepared for sampling.
struct Sampler<'a> {
    set: SetEvaluator,
    across: Option<&'a [Footprint; 2]>,
}

impl Sampler<'_> {
    fn contains(&self, pose: [f64; 3]) -> bool {
        let is_across = self.across.is_none_or(|regions| {
            let planar = Planar::from(pose);
            let [a, b] = regions.each_ref().map(|region| region.depths(&planar));
            let within = |depths: &[f64]| depths.iter().all(|depth| *depth >= 0.0);
            let mut either = a.iter().zip(&b).map(|(a, b)| a.max(*b));
            either.all(|depth| depth >= 0.0) && !within(&a) && !within(&b)
        });
        is_across && self.set.contains(pose)
    }

    fn excludes(&self, block: &PoseBlock) -> bool {
        let is_elsewhere = self.across.is_some_and(|regions| {
            let planar = Planar::from(block.middle);
            let most = block.distance + regions[0].lever() * block.turn;
            let [a, b] = regions.each_ref().map(|region| region.depths(&planar));
            let within = |depths: &[f64]| depths.iter().all(|depth| *depth > most);
            let mut either = a.iter().zip(&b).map(|(a, b)| a.max(*b));
            within(&a) || within(&b) || either.any(|depth| depth < -most)
        });
        is_elsewhere || self.set.excludes(block)
    }
}

impl PoseGroup {
    /// Returns at least `wanted` poses of the group within the ranges, evenly distributed (goal frame: m, m, rad), or fewer if not so many
    /// are found among `most` poses of blocks that may contain some. Always the same poses.
    #[must_use]
    pub fn sample(&self, ranges: Ranges, wanted: usize, most: usize) -> Vec<[f64; 3]> {
        let sampler = Sampler {
            set: self.set.evaluator(),
            across: self.across.as_ref(),
        };
        let blocks = blocks(ranges, &|block| sampler.excludes(block));
        let mut found: Vec<[f64; 3]> = Vec::new();
        let mut tried = 0;
        while found.len() < wanted && tried < most && !blocks.is_empty() {
            let batch = BATCH.min(most - tried);
            let poses = (tried..tried + batch).into_par_iter().map(|i| {
                let block = blocks[i % blocks.len()];
                let share = spread(i as f64);
                core::array::from_fn(|axis| {
                    let [lo, hi] = block[axis];
                    lo + (hi - lo) * share[axis]
                })
            });
            found.par_extend(poses.filter(|pose| sampler.contains(*pose)));
            tried += batch;
        }
        found
    }
}

/// Returns point `i` of a sequence that fills the unit cube evenly (a Kronecker sequence).
fn spread(i: f64) -> [f64; 3] {
    // The powers of the root of g^4 = g + 1.
    const G: f64 = 1.220_744_084_605_759_5;
    [1.0 / G, 1.0 / (G * G), 1.0 / (G * G * G)].map(|step| {
        let at = 0.5 + i * step;
        at - libm::floor(at)
    })
}

/// Returns about [`BLOCKS`] blocks of equal size that together contain all poses of a set within the ranges.
fn blocks(ranges: Ranges, excludes: &(dyn Fn(&PoseBlock) -> bool + Sync)) -> Vec<Ranges> {
    let mut blocks = vec![ranges];
    // Each level halves the longest side. A few levels without a removal are common, many are a set that fills its blocks.
    for _ in 0..40 {
        if blocks.is_empty() || blocks.len() * 2 > BLOCKS {
            break;
        }
        blocks = blocks
            .par_iter()
            .flat_map_iter(|block| halves(*block))
            .filter(|half| !excludes(&PoseBlock::of(*half)))
            .collect();
    }
    blocks
}

/// Returns the halves of a block along its longest side; a radian counts as a metre.
pub(crate) fn halves(block: Ranges) -> [Ranges; 2] {
    let length = |axis: usize| block[axis][1] - block[axis][0];
    let longest = (1..3).fold(0, |best, axis| {
        if length(axis) > length(best) {
            axis
        } else {
            best
        }
    });
    let [lo, hi] = block[longest];
    let middle = 0.5 * (lo + hi);
    [[lo, middle], [middle, hi]].map(|half| {
        let mut block = block;
        block[longest] = half;
        block
    })
}
