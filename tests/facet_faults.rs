//! Facet layers: what is changed is not proven, what leaves a gap is refused, and what is permitted
//! agrees with the grid.
#![cfg(feature = "std")]

#[path = "support/sites.rs"]
mod sites;

use posegate::bake::{Extent, Layout, Order, Step, TableSpec};
use posegate::contain::{Decision, decide, examine};
use posegate::set::{Estimate, PoseSet, RadiusSquared};
use posegate::shape::{BoxSet, PoseDeg, Shape, SuccessSet};
use posegate::table::{Table, TableError};
use posegate::verify::{VerifyError, build, verify};
use sites::{claim, order, repair, sample};

fn facet_table(task: &str) -> Vec<u8> {
    let site = sample();
    let mut order = order(&site, task);
    order.spec.layout = Layout::Facets;
    coarse(&mut order);
    build(&order, &|| ()).unwrap().0
}

/// Coarser slabs: each proof below is one of a whole table.
fn coarse(order: &mut Order<'_>) {
    order.spec.step.yaw_deg = 4.0;
}

/// Where the facet layout begins, and its facets.
fn places(bytes: &[u8]) -> (usize, usize, usize) {
    let number = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
    let (start, length) = (number(76), number(80));
    let count = usize::from(u16::from_le_bytes([bytes[start + 6], bytes[start + 7]]));
    (start, start + length - 8 * count, count)
}

/// Push a facet out, drop it, or widen its slab: the proof notices where the facet matters.
#[test]
fn changed_facets_are_not_proven() {
    let site = sample();
    for task in ["dock", "park"] {
        let claim = claim(&site, task);
        let bytes = facet_table(task);
        assert!(verify(&bytes, &claim, &|| ()).unwrap().corners > 0);
        let (start, facets, count) = places(&bytes);
        let (mut pushed, mut dropped) = (0, 0);
        for facet in 0..count {
            // Out by three units: one may be taken up by the baker's own clearance.
            let mut changed = bytes.clone();
            let at = facets + 8 * facet + 6;
            let b = i16::from_le_bytes([changed[at], changed[at + 1]]);
            changed[at..at + 2].copy_from_slice(&(b + 3).to_le_bytes());
            repair(&mut changed);
            match verify(&changed, &claim, &|| ()) {
                Err(VerifyError::Facet(_)) => pushed += 1,
                Ok(_) => {}
                Err(other) => panic!("{other}"),
            }
            // Another facet in its place: as good as dropped.
            let mut changed = bytes.clone();
            let twin = facets + 8 * if facet == 0 { 1 } else { facet - 1 };
            let copy = changed[twin..twin + 8].to_vec();
            changed[facets + 8 * facet..facets + 8 * facet + 8].copy_from_slice(&copy);
            repair(&mut changed);
            dropped += usize::from(verify(&changed, &claim, &|| ()).is_err());
        }
        assert!(
            2 * pushed >= count && 10 * dropped >= 9 * count,
            "{task}: {pushed} {dropped} of {count}"
        );
        // Slabs twice as wide: yaw units doubled.
        let mut wider = bytes.clone();
        wider[start + 1] += 1;
        repair(&mut wider);
        assert!(verify(&wider, &claim, &|| ()).is_err());
    }
}

#[test]
fn gaps_and_indices_outside_are_refused() {
    let bytes = facet_table("park");
    let (start, facets, count) = places(&bytes);
    let refused = |change: &dyn Fn(&mut Vec<u8>)| {
        let mut changed = bytes.clone();
        change(&mut changed);
        repair(&mut changed);
        Table::parse(&changed).err()
    };
    assert_eq!(refused(&|_| ()), None);
    let facets_error = Some(TableError::Facets);
    // Fewer slabs, a shorter stride: the range of headings is not covered.
    assert_eq!(refused(&|b| b[start + 8 + 4] -= 1), facets_error);
    assert_eq!(refused(&|b| b[start + 8 + 2] ^= 1), facets_error);
    assert_eq!(refused(&|b| b[start + 1] -= 1), facets_error);
    // No layer, too many, another group.
    assert_eq!(refused(&|b| b[start + 2] = 0), facets_error);
    assert_eq!(refused(&|b| b[start + 2] = 13), facets_error);
    assert_eq!(refused(&|b| b[start + 8] = 1), facets_error);
    // An index that goes back, or past the facets.
    let index = start + 8 + 12 * usize::from(bytes[start + 2]);
    assert_eq!(refused(&|b| b[index] = 1), facets_error);
    assert_eq!(refused(&|b| b[index + 2] = 0xff), facets_error);
    assert_eq!(refused(&|b| b[start + 6] -= 1), facets_error);
    // A normal that has no length, a tilt beyond the stated largest.
    assert_eq!(refused(&|b| b[facets..facets + 4].fill(0)), facets_error);
    assert_eq!(
        refused(&|b| b[facets + 4..facets + 6].copy_from_slice(&[0xff, 0x7f])),
        facets_error
    );
    assert!(count > 10);
}

/// On the same set, the two layouts tell the same story: margins within the grid's resolution.
#[test]
fn facets_and_grid_agree() {
    let site = sample();
    let made = |layout| {
        let mut order = order(&site, "park");
        order.spec.layout = layout;
        build(&order, &|| ()).unwrap().0
    };
    let (grid, facets) = (made(Layout::Grid), made(Layout::Facets));
    let (grid, facets) = (Table::parse(&grid).unwrap(), Table::parse(&facets).unwrap());
    let goal = order(&site, "park").success.goal;
    let radius = RadiusSquared::from_q16(743_498).unwrap();
    let mut sum = 0.0;
    let mut count = 0.0;
    for k in 0..60 {
        let wave = |n: f64| (f64::from(k) * n).sin();
        let estimate = Estimate {
            x_m: goal.x + 0.1 * wave(1.3),
            y_m: goal.y + 0.1 * wave(2.1),
            yaw_rad: (goal.yaw_deg + wave(0.7)).to_radians(),
        };
        let (x, y, t) = (
            0.02 + 0.01 * wave(3.0),
            0.03 + 0.01 * wave(5.0),
            0.006 + 0.003 * wave(7.0),
        );
        let xy = 0.4 * x * y * wave(11.0);
        let covariance = [
            [x * x, xy, 0.0],
            [xy, y * y, 0.2 * y * t],
            [0.0, 0.2 * y * t, t * t],
        ];
        let set = PoseSet::gaussian(estimate, covariance, radius).unwrap();
        let margin = |table| f64::from(examine(table, &set).margin.q16()) / 65536.0;
        let (by_grid, by_facets) = (margin(&grid), margin(&facets));
        assert!(by_facets >= 0.93 * by_grid, "{k}: {by_facets} {by_grid}");
        assert_eq!(decide(&facets, &set) == Decision::Inside, by_facets >= 1.0);
        sum += by_facets / by_grid;
        count += 1.0;
    }
    // Facets follow the border; cells stop short of it.
    assert!(sum / count > 1.0, "{}", sum / count);
}

/// The estimate is rounded to length units (64 um here): a permit must hold to the micrometre all
/// the same. Small discs creep over each border of a box, at turned goals.
#[test]
fn the_rounding_of_the_estimate_is_paid_for() {
    let (mut permits, mut closest) = (0, f64::INFINITY);
    // Sixteen sizes, so that the last rounding of a facet's offset gives nothing away on some.
    let sizes = (0..16).map(|k| 1.0 + 4e-6 * f64::from(k));
    let turns = [0.0, 33.0, 77.7, -120.4];
    for (half, yaw_deg) in sizes.flat_map(|half| turns.map(|yaw_deg| (half, yaw_deg))) {
        let goal = PoseDeg {
            x: 1.234_567,
            y: -7.654_321,
            yaw_deg,
        };
        let success = SuccessSet {
            goal,
            shape: Shape::Box(BoxSet {
                x: [-half, half],
                y: [-half, half],
                yaw_deg: [-10.0, 10.0],
            }),
        };
        let extent = Extent {
            x: [-half, half],
            y: [-half, half],
            yaw_deg: [-10.0, 10.0],
        };
        let order = Order {
            task: "creep",
            success: &success,
            spec: TableSpec {
                extent,
                step: Step {
                    xy: 0.1,
                    yaw_deg: 5.0,
                },
                layout: Layout::Facets,
            },
            epsilon: 0.99,
            site_digest: [3; 32],
        };
        let bytes = build(&order, &|| ()).unwrap().0;
        let table = Table::parse(&bytes).unwrap();
        assert_eq!(table.facets().unwrap().length_shift(), 6);
        let (sin, cos) = yaw_deg.to_radians().sin_cos();
        let radius = 0.001;
        for side in 0..4 {
            for step in -80..160 {
                // How far the disc stays inside, metres: negative is over the border.
                let inside = f64::from(step) * 1e-6 + 2e-9;
                let out = half - radius - inside;
                let along = 0.000_37 * f64::from(step);
                let [x, y] = [[out, along], [-out, along], [along, out], [along, -out]][side];
                let estimate = Estimate {
                    x_m: goal.x + cos * x - sin * y,
                    y_m: goal.y + sin * x + cos * y,
                    yaw_rad: yaw_deg.to_radians(),
                };
                let set = PoseSet::bounded(estimate, radius, 0.01).unwrap();
                if decide(&table, &set) == Decision::Inside {
                    assert!(inside >= 0.0, "{yaw_deg} {side}: permitted {inside} m over");
                    permits += 1;
                    closest = inside.min(closest);
                }
            }
        }
    }
    assert!(permits > 10_000 && closest < 6e-5, "{permits} {closest}");
}

/// The worst pose of facets lies on the border that the set leaves over, in the goal's own axes.
#[test]
fn the_worst_pose_is_on_a_facet() {
    let goal = PoseDeg {
        x: 2.0,
        y: -1.0,
        yaw_deg: 90.0,
    };
    let extent = Extent {
        x: [-0.4, 0.4],
        y: [-0.2, 0.2],
        yaw_deg: [-10.0, 10.0],
    };
    let success = SuccessSet {
        goal,
        shape: Shape::Box(BoxSet {
            x: extent.x,
            y: extent.y,
            yaw_deg: extent.yaw_deg,
        }),
    };
    let order = Order {
        task: "leave",
        success: &success,
        spec: TableSpec {
            extent,
            step: Step {
                xy: 0.1,
                yaw_deg: 5.0,
            },
            layout: Layout::Facets,
        },
        epsilon: 0.99,
        site_digest: [3; 32],
    };
    let bytes = build(&order, &|| ()).unwrap().0;
    let table = Table::parse(&bytes).unwrap();
    assert!(table.grid().is_none());
    let radius = RadiusSquared::from_q16(9 << 16).unwrap();
    for [x, y] in [[0.35, 0.03], [-0.35, 0.03], [0.03, 0.15], [0.03, -0.15]] {
        let estimate = Estimate {
            x_m: goal.x - y,
            y_m: goal.y + x,
            yaw_rad: 90f64.to_radians(),
        };
        let s = 0.1 / 3.0;
        let covariance = [[s * s, 0.0, 0.0], [0.0, s * s, 0.0], [0.0, 0.0, 1e-6]];
        for set in [
            PoseSet::bounded(estimate, 0.1, 0.01).unwrap(),
            PoseSet::gaussian(estimate, covariance, radius).unwrap(),
        ] {
            let worst = examine(&table, &set).worst_pose.unwrap();
            let worst = table.goal().pose_to_goal(worst).unwrap();
            let expected = [x, y].map(|v: f64| match v.abs() {
                0.35 => 0.4 * v.signum(),
                0.15 => 0.2 * v.signum(),
                _ => v,
            });
            let [dx, dy] = [
                f64::from(worst.x_um) * 1e-6 - expected[0],
                f64::from(worst.y_um) * 1e-6 - expected[1],
            ];
            assert!(dx.hypot(dy) < 2e-3, "{x} {y}: {worst:?}");
        }
    }
}
