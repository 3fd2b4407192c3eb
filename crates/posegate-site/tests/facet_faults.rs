//! Facets: changed facets are not proven, tables with a gap are refused, and decisions agree with
//! those of the grid.

use posegate_testkit::sites;

use posegate::bake::{
    BakeInput, Extent, FacetPlan, FramePlan, Layout, PiecePlan, Step, TableSpec, write_facets,
};
use posegate::contain::{Decision, decide, examine};
use posegate::set::{Estimate, PoseSet, RadiusSquared};
use posegate::shape::{BoxSet, Footprint, PoseDeg, Shape, SuccessSet};
use posegate::table::{Axes, Facet, Table, TableError};
use posegate::verify::{ExpectedTable, VerifyError, build, verify};
use sites::{claim, order, repair, sample};

fn facet_table(task: &str) -> Vec<u8> {
    let site = sample();
    let mut order = order(&site, task);
    order.spec.layout = Layout::Facets;
    build(&order, &|| ()).unwrap().0
}

/// Returns the offsets of the facet layout, of its pieces, its frames and its facets.
fn places(bytes: &[u8]) -> [usize; 4] {
    let number = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
    let start = number(76);
    let frames = start + 12 + 12 * usize::from(bytes[start + 1]);
    [
        start,
        start + 12,
        frames,
        frames + 6 * usize::from(bytes[start + 2]),
    ]
}

/// Returns a table's layout as the plan that it was written from.
fn plan(bytes: &[u8]) -> FacetPlan {
    let table = Table::parse(bytes).unwrap();
    let layout = table.facets().unwrap();
    FacetPlan {
        unit: layout.unit(),
        reach: layout.reach(),
        pieces: layout
            .pieces()
            .map(|piece| PiecePlan {
                from: piece.from,
                width: piece.width,
                frames: piece
                    .frames()
                    .map(|frame| FramePlan {
                        axes: frame.axes,
                        point: [frame.x, frame.y],
                        facets: frame.facets().collect(),
                    })
                    .collect(),
            })
            .collect(),
    }
}

/// Proves a table with another plan. Returns the table, or the error of the proof.
fn proven(
    order: &BakeInput<'_>,
    claim: &ExpectedTable<'_>,
    plan: &FacetPlan,
) -> Result<u64, VerifyError> {
    let bytes = write_facets(order, plan).unwrap();
    verify(&bytes, claim, &|| ()).map(|proof| proof.corners)
}

/// If a facet is pushed out or dropped, or the arc of headings widened, the proof fails and names the piece.
#[test]
fn changed_facets_are_not_proven() {
    let site = sample();
    for (task, every) in [("dock", true), ("park", true), ("see-t7", false)] {
        let (order, claim) = (order(&site, task), claim(&site, task));
        let made = plan(&facet_table(task));
        assert!(proven(&order, &claim, &made).unwrap() > 0);
        let (mut count, mut borders) = (0, 0);
        let (mut pushed, mut pushed_far, mut dropped) = (0, 0, 0);
        for frame in 0..made.pieces[0].frames.len() {
            for facet in 0..made.pieces[0].frames[frame].facets.len() {
                count += 1;
                let out_by = |units: i16| {
                    let mut changed = made.clone();
                    changed.pieces[0].frames[frame].facets[facet].b += units;
                    match proven(&order, &claim, &changed) {
                        Err(VerifyError::Facet(found)) => {
                            assert_eq!(found.piece, 0);
                            1
                        }
                        Ok(_) => 0,
                        Err(other) => panic!("{other}"),
                    }
                };
                // The table's extent is not a border of the set.
                let extent = task != "dock" && made.pieces[0].frames[frame].point == [0, 0];
                borders += usize::from(!extent);
                if extent {
                    pushed -= out_by(1);
                }
                // At a curve or far from the point, one unit may be within the slack from rounding.
                pushed += out_by(1);
                if !every && !extent {
                    pushed_far += out_by(2);
                }
                let mut changed = made.clone();
                let facets = &mut changed.pieces[0].frames[frame].facets;
                facets.remove(facet);
                changed.pieces[0].frames.retain(|f| !f.facets.is_empty());
                dropped += usize::from(proven(&order, &claim, &changed).is_err());
            }
        }
        println!("{task}: {pushed} of {borders} pushed, {dropped} of {count} dropped noticed");
        assert_eq!(dropped, count, "{task}");
        assert!(
            pushed == borders || (!every && 2 * pushed >= borders && pushed_far == borders),
            "{task}: {pushed} and {pushed_far} of {borders}"
        );
    }
    // The arc of the dock's headings, wider by 4 units (0.006 arc seconds).
    let (order, claim) = (order(&site, "dock"), claim(&site, "dock"));
    let made = plan(&facet_table("dock"));
    for (down, up) in [(4, 4), (0, 4)] {
        let mut wider = made.clone();
        wider.pieces[0].from -= down;
        wider.pieces[0].width += up;
        let found = proven(&order, &claim, &wider);
        assert!(matches!(found, Err(VerifyError::Facet(_))), "{found:?}");
    }
}

/// Checking the ends of an arc is not a proof: a vertex that crosses a wall between the ends is inside at both ends.
/// Here it crosses by a tenth of a millimetre.
#[test]
fn border_crossed_between_the_ends_is_detected() {
    let reach = 0.75;
    let footprint = Footprint::new(vec![[0.0, reach]], square(1.5)).unwrap();
    let success = SuccessSet {
        goal: PoseDeg {
            x: 0.0,
            y: 0.0,
            yaw_deg: 0.0,
        },
        shape: Shape::Footprint(footprint.clone()),
    };
    let order = BakeInput {
        task: "swing",
        success: &success,
        spec: TableSpec {
            extent: Extent {
                x: [-0.5, 0.5],
                y: [-0.5, 1.0],
                yaw_deg: [-1.0, 1.0],
            },
            step: Step {
                xy: 0.02,
                yaw_deg: 1.0,
            },
            layout: Layout::Facets,
        },
        epsilon: 0.99,
    };
    let claim = ExpectedTable {
        task: "swing",
        success: &success,
        epsilon: 0.99,
    };
    let made = plan(&build(&order, &|| ()).unwrap().0);
    // A frame of only the robot's centre, whose upper facet is correct at both ends of the arc.
    let unit = f64::from(1u32 << made.unit) * 1e-6;
    let upper = |yaw_deg: f64| 1.5 - reach * yaw_deg.to_radians().cos();
    let at = |top: f64| {
        let down = |v: f64| (v / unit).floor() as i16 - 1;
        let facet = |x: i16, y: i16, b: i16| Facet { x, y, b };
        let one = 16_384;
        FacetPlan {
            pieces: vec![PiecePlan {
                frames: vec![FramePlan {
                    axes: Axes::World,
                    point: [0, 0],
                    facets: vec![
                        facet(one, 0, down(0.4)),
                        facet(-one, 0, down(0.4)),
                        facet(0, one, down(top)),
                        facet(0, -one, down(0.4)),
                    ],
                }],
                ..made.pieces[0].clone()
            }],
            ..made.clone()
        }
    };
    // Sampling the corners at the ends accepts the facet; the set does not contain it at heading 0.
    let corner = |y: f64, yaw_deg: f64| {
        let (s, c) = yaw_deg.to_radians().sin_cos();
        (-reach * s).abs() <= 1.5 && y + reach * c <= 1.5
    };
    let coarse = upper(1.0);
    assert!(
        corner(coarse - unit, 1.0) && corner(coarse - unit, -1.0) && !corner(coarse - unit, 0.0)
    );
    let found = proven(&order, &claim, &at(coarse));
    assert!(matches!(found, Err(VerifyError::Facet(_))), "{found:?}");
    assert!(proven(&order, &claim, &at(upper(0.0))).is_ok());
}

fn square(half: f64) -> Vec<[f64; 2]> {
    vec![[half, half], [-half, half], [-half, -half], [half, -half]]
}

/// A set of two pieces: a pose-set is inside if one piece contains it, or both together, and not if it intersects a
/// gap between them.
#[test]
fn set_is_inside_joined_pieces_unless_it_meets_a_gap() {
    let site = sample();
    let order = order(&site, "dock");
    let claim = claim(&site, "dock");
    let made = plan(&facet_table("dock"));
    // Cut at x = 1 cm beyond the middle, so that the halves overlap by 2 cm, or before it, so that 2 cm are missing.
    let halves = |beyond: f64| {
        let pieces = [1, -1].map(|side: i16| {
            let mut piece = made.pieces[0].clone();
            let b = (beyond / (f64::from(1u32 << made.unit) * 1e-6)) as i16;
            for facet in &mut piece.frames[0].facets {
                if facet.x == side * 16_384 {
                    facet.b = b;
                }
            }
            piece
        });
        let two = FacetPlan {
            pieces: pieces.to_vec(),
            ..made.clone()
        };
        assert!(proven(&order, &claim, &two).is_ok());
        write_facets(&order, &two).unwrap()
    };
    let [bytes, apart] = [0.01, -0.01].map(halves);
    let [table, apart] = [&bytes, &apart].map(|bytes| Table::parse(bytes).unwrap());
    assert_eq!(table.facets().unwrap().pieces().count(), 2);
    let inside_of = |table: &Table<'_>, x_m: f64, radius: f64| {
        let estimate = Estimate {
            x_m,
            y_m: 0.0,
            yaw_rad: 0.0,
        };
        let set = PoseSet::bounded(estimate, radius, 0.01).unwrap();
        decide(table, &set) == Decision::Inside
    };
    let inside = |x_m, radius| inside_of(&table, x_m, radius);
    for x in [-0.06, -0.02, 0.02, 0.06] {
        assert!(inside(x, 0.008), "{x}");
    }
    // In the middle both contain the pose-set if it fits into the overlap, else both together.
    assert!(inside(0.0, 0.0095) && inside(0.0, 0.011) && inside(0.005, 0.02));
    // Neither contains what lies between them.
    assert!(inside_of(&apart, 0.03, 0.015) && inside_of(&apart, -0.03, 0.015));
    for (x, radius) in [
        (0.0, 0.0095),
        (0.0, 0.011),
        (0.005, 0.02),
        (0.0, 0.03),
        (0.018, 0.011),
    ] {
        assert!(!inside_of(&apart, x, radius), "{x} {radius}");
    }
}

#[test]
fn gaps_and_indices_outside_are_refused() {
    let bytes = facet_table("see-t7");
    let [start, piece, frame, facets] = places(&bytes);
    let refused = |change: &dyn Fn(&mut Vec<u8>)| {
        let mut changed = bytes.clone();
        change(&mut changed);
        repair(&mut changed);
        Table::parse(&changed).err()
    };
    assert_eq!(refused(&|_| ()), None);
    let wrong = Some(TableError::Facets);
    // Counts that leave a gap, or reach past the end.
    for at in [
        start + 1,
        start + 2,
        start + 4,
        piece + 8,
        piece + 10,
        frame + 1,
    ] {
        assert_eq!(refused(&|b| b[at] -= 1), wrong, "{at}");
        assert_eq!(refused(&|b| b[at] += 1), wrong, "{at}");
        assert_eq!(refused(&|b| b[at] = 0), wrong, "{at}");
    }
    // An arc outside of the header's yaw range: earlier, wider, around the circle.
    assert_eq!(refused(&|b| b[piece] -= 1), wrong);
    assert_eq!(refused(&|b| b[piece + 4] += 1), wrong);
    assert_eq!(refused(&|b| b[piece + 4..piece + 8].fill(0xff)), wrong);
    // Units and limits: too coarse, no reach, a reach or an offset beyond the longest lever.
    assert_eq!(refused(&|b| b[start] = 13), wrong);
    assert_eq!(refused(&|b| b[start + 3] = 1), wrong);
    assert_eq!(refused(&|b| b[start + 6..start + 8].fill(0)), wrong);
    assert_eq!(refused(&|b| b[start + 6..start + 8].fill(0x7f)), wrong);
    assert_eq!(refused(&|b| b[start + 8..start + 10].fill(0)), wrong, "arm");
    assert_eq!(
        refused(&|b| b[start + 10..start + 12].fill(0)),
        wrong,
        "farthest"
    );
    // Unknown axes; a byte that must be zero; a normal of length zero.
    assert_eq!(refused(&|b| b[frame] = 2), wrong);
    assert_eq!(refused(&|b| b[piece + 9] = 1), wrong);
    assert_eq!(refused(&|b| b[facets..facets + 4].fill(0)), wrong);
    assert_eq!(refused(&|b| b[facets + 1] ^= 0x20), wrong);
}

/// On the same set both layouts agree: their margins differ by no more than the grid's resolution.
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
    // Facets follow the border; cells end before it.
    assert!(sum / count > 1.0, "{}", sum / count);
}

/// The estimate is rounded to length units (64 or 128 um here). A permit must still be correct to the
/// micrometre. Small discs are moved over each border of a box in small steps, at turned goals.
#[test]
fn permits_are_correct_despite_rounding_of_the_estimate() {
    let (mut permits, mut closest) = (0, f64::INFINITY);
    // Sixteen sizes, so that the last rounding of a facet's offset leaves no slack for some of them.
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
        let order = BakeInput {
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
        };
        let bytes = build(&order, &|| ()).unwrap().0;
        let table = Table::parse(&bytes).unwrap();
        assert!((6..=7).contains(&table.facets().unwrap().unit()));
        let (sin, cos) = yaw_deg.to_radians().sin_cos();
        let radius = 0.001;
        for side in 0..4 {
            for step in -80..240 {
                // Distance of the disc from the border, metres; negative beyond the border.
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

/// The worst pose of facets is on the border across which the set leaves, in the goal's axes.
#[test]
fn worst_pose_is_beyond_a_facet() {
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
    let order = BakeInput {
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
                // At the border of the set, beyond that of the box at 0.4 m or 0.2 m.
                0.35 => 0.45 * v.signum(),
                0.15 => 0.25 * v.signum(),
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
