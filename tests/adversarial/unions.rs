//! Sets of two boxes a tenth of a millimetre apart, and of a box with a notch of half a millimetre: a pose-set that is permitted meets neither the
//! gap nor the notch. Judged by the projection of the pose-set to the plane, in closed form.

use crate::oracle::{Pose, PoseSet, Rng, to_world};
use crate::trial::{core_set, scaled};
use posegate::bake::{BakeInput, Extent, Layout, Step, TableSpec};
use posegate::contain::{Decision, decide};
use posegate::shape::{BoxSet, PoseDeg, Shape, SuccessSet};
use posegate::table::Table;
use posegate::verify::build;

/// The gap between x = 0 and this, metres; the notch is as wide as it is deep.
const GAP: f64 = 1e-4;
const NOTCH: f64 = 5e-4;
/// The rounding of the judge.
const ROUNDING: f64 = 1e-9;

/// Counts of pose-sets across a gap or a notch.
#[derive(Default)]
pub struct Counts {
    pub cases: usize,
    pub permits: usize,
    pub false_permits: usize,
}

/// Decides on pose-sets about gaps and notches, for a few random goals.
pub fn gaps_and_notches(rng: &mut Rng, cases: usize) -> Counts {
    let mut counts = Counts::default();
    let worlds = cases.div_ceil(500);
    for world in 0..worlds {
        let far = if rng.chance(0.3) { 1_200.0 } else { 10.0 };
        let goal = [
            rng.within(-far, far),
            rng.within(-far, far),
            rng.within(-3.1, 3.1),
        ];
        let is_notch = world % 2 == 1;
        let bytes = table(goal, is_notch);
        let table = Table::parse(&bytes).unwrap();
        for _ in 0..500.min(cases - counts.cases) {
            counts.cases += 1;
            let (mean, set) = near(rng);
            let estimate = to_world(goal, mean);
            let permits = |scale: f64| {
                let set = core_set(estimate, &scaled(&set, scale));
                set.is_ok_and(|set| decide(&table, &set) == Decision::Inside)
            };
            // The largest scale that is permitted.
            let (mut low, mut high) = (0.0, 2.0);
            for _ in 0..24 {
                let middle = 0.5 * (low + high);
                if permits(middle) {
                    low = middle;
                } else {
                    high = middle;
                }
            }
            if low == 0.0 {
                continue;
            }
            counts.permits += 1;
            let largest = scaled(&set, low);
            if meets(mean, goal[2], &largest, is_notch) {
                counts.false_permits += 1;
                if counts.false_permits <= 3 {
                    eprintln!("FALSE PERMIT across a gap: {goal:?} {mean:?} {largest:?}");
                }
            }
        }
    }
    counts
}

fn table(goal: Pose, is_notch: bool) -> Vec<u8> {
    let piece = |x: [f64; 2], y: [f64; 2]| {
        Shape::Box(BoxSet {
            x,
            y,
            yaw_deg: [-180.0, 180.0],
        })
    };
    let y = [-0.2, 0.2];
    let shapes = if is_notch {
        let below = [-0.2, 0.2 - NOTCH];
        vec![
            piece([-0.3, 0.0], y),
            piece([0.0, NOTCH], below),
            piece([NOTCH, 0.3], y),
        ]
    } else {
        vec![piece([-0.3, 0.0], y), piece([GAP, 0.3], y)]
    };
    let [x, y, yaw] = goal;
    let success = SuccessSet {
        goal: PoseDeg {
            x,
            y,
            yaw_deg: yaw.to_degrees(),
        },
        shape: Shape::Any(shapes),
    };
    let order = BakeInput {
        task: "gap",
        success: &success,
        spec: TableSpec {
            extent: Extent {
                x: [-0.5, 0.5],
                y: [-0.5, 0.5],
                yaw_deg: [-180.0, 180.0],
            },
            step: Step {
                xy: 0.01,
                yaw_deg: 5.0,
            },
            layout: Layout::Facets,
        },
        epsilon: 0.99,
    };
    build(&order, &|| ()).unwrap().0
}

/// A pose near the gap and the notch, in the goal frame, and a pose-set.
fn near(rng: &mut Rng) -> (Pose, PoseSet) {
    let mean = [
        rng.within(-0.03, 0.03),
        rng.within(0.15, 0.2),
        rng.within(-3.1, 3.1),
    ];
    let mut length = || rng.log_within(1e-4, 0.05);
    let (a, b) = (length(), length());
    let yaw = rng.log_within(0.01, 1.0);
    let set = if rng.chance(0.3) {
        PoseSet::Bounded {
            translation: a,
            yaw,
        }
    } else {
        let rho = rng.within(-0.9, 0.9);
        let r2 = 11.4;
        let [x, y, t] = [a, b, yaw].map(|v| v / f64::sqrt(r2));
        PoseSet::Gaussian {
            cov: [
                [x * x, rho * x * y, 0.0],
                [rho * x * y, y * y, 0.0],
                [0.0, 0.0, t * t],
            ],
            r2,
        }
    };
    (mean, set)
}

/// Returns `true` if a pose of the set lies in the gap or in the notch.
fn meets([x, y, _]: Pose, goal_yaw: f64, set: &PoseSet, is_notch: bool) -> bool {
    // The projection to the plane, in the goal's axes: xx, xy, yy.
    let [xx, xy, yy] = match set {
        PoseSet::Bounded { translation, .. } => {
            [translation * translation, 0.0, translation * translation]
        }
        PoseSet::Gaussian { cov, r2 } => {
            let (s, c) = goal_yaw.sin_cos();
            let [a, b, d] = [cov[0][0], cov[0][1], cov[1][1]];
            [
                c * c * a + 2.0 * c * s * b + s * s * d,
                c * s * (d - a) + (c * c - s * s) * b,
                s * s * a - 2.0 * c * s * b + c * c * d,
            ]
            .map(|v| v * r2)
        }
    };
    let wide = xx.sqrt();
    let width = if is_notch { NOTCH } else { GAP };
    let [from, to] = [f64::max(x - wide, 0.0), f64::min(x + wide, width)];
    if !is_notch {
        return to - from > ROUNDING;
    }
    (0..=200).any(|k| {
        let at = from + (to - from) * f64::from(k) / 200.0;
        let aside = at - x;
        let left = 1.0 - aside * aside / xx;
        let highest = y + xy / xx * aside + (left.max(0.0) * (yy - xy * xy / xx).max(0.0)).sqrt();
        to > from && at > ROUNDING && at < width - ROUNDING && highest > 0.2 - NOTCH + ROUNDING
    })
}
