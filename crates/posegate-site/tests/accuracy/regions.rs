//! The same ratio, and the share of poses that a table holds, for random robots across random regions: corners, doors, crossings,
//! shifted rooms, funnels, regions that are turned relative to each other. All estimates are across regions: no region alone contains
//! the robot. The truth is by the areas of what the regions leave of the robot's outline.

use crate::oracle::{Pose, PoseSet, Rng, union_scale};
use crate::{Case, core_set, drawn, q16};
use posegate::bake::{BakeInput, Layout, Step, TableSpec, extent};
use posegate::contain::{Decision, decide, examine};
use posegate::shape::{PoseDeg, Shape, SuccessSet};
use posegate::table::Table;
use posegate::verify::{build, coverage};
use rayon::prelude::*;

type Polygon = Vec<[f64; 2]>;

/// Goals: the mean of all tables and their tenth percentile.
const MEAN: f64 = 0.97;
const P10: f64 = 0.85;
const HELD: f64 = 0.98;

struct Hall {
    name: &'static str,
    robot: Polygon,
    regions: Vec<Polygon>,
    yaw_deg: f64,
}

fn rectangle([x0, x1]: [f64; 2], [y0, y1]: [f64; 2]) -> Polygon {
    vec![[x0, y0], [x1, y0], [x1, y1], [x0, y1]]
}

fn turned(polygon: &[[f64; 2]], [x, y, yaw]: Pose) -> Polygon {
    let (s, c) = yaw.sin_cos();
    let turn = |[a, b]: &[f64; 2]| [x + c * a - s * b, y + s * a + c * b];
    polygon.iter().map(turn).collect()
}

fn hall(rng: &mut Rng, number: u64) -> Hall {
    let (long, wide) = (rng.within(0.25, 0.5), rng.within(0.15, 0.25));
    let robot = match rng.below(4) {
        0 => vec![[long, 0.0], [-0.6 * long, wide], [-0.6 * long, -wide]],
        1 => vec![
            [long, 0.4 * wide],
            [0.6 * long, wide],
            [-long, wide],
            [-long, -wide],
            [0.6 * long, -wide],
            [long, -0.4 * wide],
        ],
        _ => rectangle([-long, long], [-wide, wide]),
    };
    let door = wide + rng.within(0.05, 0.3);
    let room = long + rng.within(0.1, 0.5);
    let lane = rectangle([-3.0, 0.0], [-room, room]);
    let (name, regions) = match number % 8 {
        0 => (
            "corner",
            vec![
                rectangle([-0.6, 3.0], [-0.6, 0.6 + rng.within(0.0, 0.3)]),
                rectangle([-0.6, 0.6], [-0.6, 3.0]),
            ],
        ),
        1 => ("bay", vec![lane, rectangle([0.0, 1.5], [-door, door])]),
        2 => (
            "crossing",
            vec![
                rectangle([-2.5, 2.5], [-room, room]),
                rectangle([-0.7, 0.7], [-2.5, 2.5]),
            ],
        ),
        3 => (
            "turned",
            vec![
                lane,
                turned(
                    &rectangle([-0.3, 2.0], [-door, door]),
                    [0.0, 0.0, rng.within(0.2, 0.7)],
                ),
            ],
        ),
        4 => (
            "two rooms and a door",
            vec![
                lane,
                rectangle([0.0, 0.3], [-door, door]),
                rectangle([0.3, 2.5], [-room, room + 0.4]),
            ],
        ),
        5 => {
            let around = |rng: &mut Rng, at: [f64; 2]| -> Polygon {
                let mut angles: Vec<f64> = (0..6)
                    .map(|_| rng.within(0.0, std::f64::consts::TAU))
                    .collect();
                angles.sort_by(f64::total_cmp);
                let radius = rng.within(0.9, 1.4);
                let corner = |a: &f64| [at[0] + radius * a.cos(), at[1] + radius * a.sin()];
                angles.iter().map(corner).collect()
            };
            (
                "polygons",
                vec![around(rng, [-0.5, 0.0]), around(rng, [0.5, 0.2])],
            )
        }
        6 => (
            "shifted",
            vec![
                rectangle([-2.5, 0.0], [-room, room]),
                rectangle([0.0, 2.5], [room - 2.0 * door, room + 0.8]),
            ],
        ),
        _ => (
            "funnel",
            vec![
                vec![[-2.0, -1.2], [0.0, -door], [0.0, door], [-2.0, 1.2]],
                rectangle([0.0, 1.2], [-door, door]),
            ],
        ),
    };
    Hall {
        name,
        robot,
        regions,
        yaw_deg: [30.0, 60.0, 180.0][rng.below(3)],
    }
}

/// Returns twice the area of the part of a convex polygon that no region covers.
fn uncovered(polygon: &[[f64; 2]], regions: &[Polygon]) -> f64 {
    let Some((region, others)) = regions.split_first() else {
        let ends = polygon.iter().cycle().skip(1);
        return polygon
            .iter()
            .zip(ends)
            .map(|(a, b)| a[0] * b[1] - a[1] * b[0])
            .sum();
    };
    let mut rest = polygon.to_vec();
    let mut area = 0.0;
    for (a, b) in region.iter().zip(region.iter().cycle().skip(1)) {
        let height = |p: &[f64; 2]| (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]);
        let (mut left, mut right) = (Vec::new(), Vec::new());
        for (p, q) in rest.iter().zip(rest.iter().cycle().skip(1)) {
            let (hp, hq) = (height(p), height(q));
            if hp >= 0.0 {
                left.push(*p);
            }
            if hp <= 0.0 {
                right.push(*p);
            }
            if hp * hq < 0.0 {
                let t = hp / (hp - hq);
                let at = [p[0] + t * (q[0] - p[0]), p[1] + t * (q[1] - p[1])];
                left.push(at);
                right.push(at);
            }
        }
        if right.len() > 2 {
            area += uncovered(&right, others);
        }
        rest = left;
        if rest.len() < 3 {
            break;
        }
    }
    area
}

/// Returns a random pose-set about a pose across regions, as large as those of the other unions, with its true scale.
fn case(rng: &mut Rng, hall: &Hall, inside: &(dyn Fn(Pose) -> f64 + Sync)) -> Case {
    const MOST: f64 = 3.0;
    const LEAST: f64 = 0.3;
    let most = hall.yaw_deg.to_radians();
    loop {
        let estimate = [
            rng.within(-1.2, 1.2),
            rng.within(-1.2, 1.2),
            0.98 * rng.within(-most, most),
        ];
        if inside(estimate) < 0.0 {
            continue;
        }
        let outline = turned(&hall.robot, estimate);
        let alone = |region: &Polygon| uncovered(&outline, std::slice::from_ref(region)) < 1e-9;
        if hall.regions.iter().any(alone) {
            continue;
        }
        let set = drawn(rng);
        // Quickly: the outermost poses on each axis of a set that is too large.
        let outermost = |axis: usize| match &set {
            PoseSet::Gaussian { cov, r2 } => cov[axis].map(|v| v * (r2 / cov[axis][axis]).sqrt()),
            PoseSet::Bounded { translation, yaw } => {
                let reach = [*translation, *translation, *yaw];
                [0, 1, 2].map(|i| if i == axis { reach[i] } else { 0.0 })
            }
        };
        let fits = (0..3).map(outermost).all(|by| {
            let at = |sign: f64| [0, 1, 2].map(|i| estimate[i] + sign * LEAST * by[i]);
            inside(at(1.0)) >= 0.0 && inside(at(-1.0)) >= 0.0
        });
        if !fits {
            continue;
        }
        let truth = union_scale(inside, estimate, &set, MOST, rng);
        if truth > LEAST && truth < 0.99 * MOST {
            return Case {
                estimate,
                set,
                truth,
            };
        }
    }
}

/// Prints a line for each table and one for all. Returns `true` if a goal is missed.
pub fn regions(count: u64, seed: u64) -> bool {
    let mut all: Vec<f64> = Vec::new();
    let mut short = false;
    for number in 0..16 {
        let mut rng = Rng::new(seed.wrapping_mul(7_000_003).wrapping_add(number));
        let hall = hall(&mut rng, number);
        let shape = Shape::footprint_in_union(&hall.robot, &hall.regions).expect("polygons");
        let success = SuccessSet {
            goal: PoseDeg {
                x: 0.0,
                y: 0.0,
                yaw_deg: 0.0,
            },
            shape,
        };
        let mut chosen = extent(&success, None).expect("a set with an extent");
        chosen.yaw_deg = [-hall.yaw_deg, hall.yaw_deg];
        let order = BakeInput {
            task: hall.name,
            success: &success,
            spec: TableSpec {
                extent: chosen,
                step: Step {
                    xy: 0.02,
                    yaw_deg: 2.0,
                },
                layout: Layout::Facets,
            },
            epsilon: 0.99,
        };
        let bytes = build(&order, &|| ()).expect("a table").0;
        let table = Table::parse(&bytes).expect("a table");
        let covered = coverage(&table, &success);
        let most = hall.yaw_deg.to_radians();
        let inside = |pose: Pose| {
            let is_in = pose[2].abs() <= most
                && uncovered(&turned(&hall.robot, pose), &hall.regions) < 1e-9;
            if is_in { 1.0 } else { -1.0 }
        };
        let results: Vec<(f64, bool)> = (0..count)
            .into_par_iter()
            .map(|i| {
                let mut rng =
                    Rng::new(seed.wrapping_mul(9_000_011).wrapping_add(1000 * number + i));
                let case = case(&mut rng, &hall, &inside);
                let tiny = Case {
                    set: PoseSet::Bounded {
                        translation: 1e-6,
                        yaw: 1e-6,
                    },
                    ..case
                };
                let held = decide(&table, &core_set(&tiny, 1.0)) == Decision::Inside;
                let margin = q16(examine(&table, &core_set(&case, 1.0)).margin);
                (margin / case.truth, held)
            })
            .collect();
        let mut ratios: Vec<f64> = results.iter().map(|result| result.0).collect();
        let held = results.iter().filter(|result| result.1).count() as f64 / count as f64;
        let [mean, p10, largest] = figures(&mut ratios);
        let facets = table.facets();
        println!(
            "{{\"name\": \"accepted over true scale across regions, {}\", \"value\": {mean:.4}, \"unit\": \"mean\", \"goal\": null, \
             \"p10\": {p10:.4}, \"largest\": {largest:.6}, \"held\": {held:.4}, \"covered\": {:.4}, \"across_covered\": {:.4}, \
             \"corners\": {}, \"yaw_deg\": {}, \"pieces\": {}, \"unit_um\": {}, \"bytes\": {}, \"m4f\": {}}}",
            hall.name,
            covered.share,
            covered.worst.share,
            hall.robot.len(),
            hall.yaw_deg,
            facets.map_or(0, |facets| facets.pieces().count()),
            facets.map_or(0, |facets| 1 << facets.unit()),
            bytes.len(),
            table.worst_case().instructions_m4f(),
        );
        short |= largest > 1.0 + 1e-6 || held < HELD;
        all.extend(ratios);
    }
    let [mean, p10, largest] = figures(&mut all);
    println!(
        "{{\"name\": \"accepted over true scale across regions\", \"value\": {mean:.4}, \"unit\": \"mean\", \"goal\": {MEAN}, \
         \"p10\": {p10:.4}, \"p10_goal\": {P10}, \"largest\": {largest:.6}, \"cases\": {}}}",
        all.len(),
    );
    short | !(mean >= MEAN && p10 >= P10)
}

/// Returns the mean, the tenth percentile and the largest.
fn figures(values: &mut [f64]) -> [f64; 3] {
    values.sort_by(f64::total_cmp);
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    [mean, values[values.len() / 10], values[values.len() - 1]]
}
