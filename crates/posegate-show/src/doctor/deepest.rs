//! Searches the deepest pose of a success set, to check that the set is not empty.

use crate::draw::ingredients::{frame, radians};
use posegate::shape::{MinSlack, SetEvaluator};
use posegate_site::Task;

/// The deepest pose that was found in a set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Deepest {
    /// The pose in the world: m, m, rad.
    pub pose: [f64; 3],
    /// The pose's slack; below 0 if no pose of the set was found.
    pub least: MinSlack,
}

/// Number of poses of the lattice along each axis.
const LOOKS: u32 = 13;
/// Number of lattice poses from which the search continues.
const STARTS: usize = 32;
/// The range if the site does not give one for a task's table: metres about the goal, and a quarter turn.
const FAR: f64 = 10.0;

/// Searches the deepest pose within the range that the site file gives for the task's table: its extent,
/// or twice its expected pose-set. Without either, the range is 10 m and a quarter turn about the goal.
#[must_use]
pub fn deepest(task: &Task, depth: &SetEvaluator) -> Deepest {
    let quarter = core::f64::consts::FRAC_PI_2;
    let about = |reach: f64, turn: f64| [[-reach, reach], [-reach, reach], [-turn, turn]];
    let ranges = match (task.wish.extent, task.wish.expected) {
        (Some(extent), _) => [extent.x, extent.y, extent.yaw_deg.map(f64::to_radians)],
        (None, Some(expected)) => {
            let turn = 2.0 * expected.turn_deg.to_radians();
            about(2.0 * expected.translation, turn.min(2.0 * quarter))
        }
        (None, None) => about(FAR, quarter),
    };
    let goal = radians(task.success.goal);
    let place = frame(goal);
    let at = |pose: [f64; 3]| {
        let [x, y] = place.to_goal([pose[0], pose[1]]);
        let pose = [x, y, goal[2] + pose[2]];
        Deepest {
            pose,
            least: depth.least(pose),
        }
    };
    let along = |axis: usize, k: u32| {
        let [lo, hi]: [f64; 2] = ranges[axis];
        lo + (hi - lo) * f64::from(k) / f64::from(LOOKS - 1)
    };
    // Most sets contain the goal.
    let within = |pose: [f64; 3]| [0, 1, 2].map(|i| pose[i].max(ranges[i][0]).min(ranges[i][1]));
    let mut poses = std::vec![within([0.0; 3])];
    for i in 0..LOOKS {
        for j in 0..LOOKS {
            poses.extend((0..LOOKS).map(|k| [along(0, i), along(1, j), along(2, k)]));
        }
    }
    let mut starts: Vec<([f64; 3], Deepest)> = poses.iter().map(|p| (*p, at(*p))).collect();
    let goals = starts.first().copied();
    starts.sort_by(|(_, a), (_, b)| b.least.slack.total_cmp(&a.least.slack));
    starts.truncate(STARTS);
    starts.extend(goals);
    let climbed = starts.into_iter().map(|(mut pose, mut best)| {
        let mut share = 1.0 / f64::from(LOOKS - 1);
        while share > 1e-6 && best.least.slack < f64::INFINITY {
            let mut higher = false;
            for axis in 0..3 {
                for way in [-share, share] {
                    let mut next = pose;
                    next[axis] += way * (ranges[axis][1] - ranges[axis][0]);
                    let next = within(next);
                    let there = at(next);
                    if there.least.slack > best.least.slack {
                        (pose, best, higher) = (next, there, true);
                    }
                }
            }
            if !higher {
                share *= 0.5;
            }
        }
        best
    });
    let most = climbed.reduce(|a, b| if b.least.slack > a.least.slack { b } else { a });
    most.unwrap_or_else(|| at([0.0; 3]))
}
