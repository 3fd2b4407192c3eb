//! Tables are built for sets that have one; other sets give the right error.

use super::{BuildError, ExpectedTable, VerifyError, build, coverage, holds_nothing, verify};
use crate::bake::{self, BakeError, BakeInput, Effort, Extent, Layout, Step, TableSpec};
use crate::shape::{BoxSet, Clear, Exclusion, Footprint, PoseDeg, Shape, SuccessSet, Tolerance};
use crate::table::Table;

fn set(yaw_deg: f64, shape: Shape) -> SuccessSet {
    let goal = PoseDeg {
        x: 1.0,
        y: -2.0,
        yaw_deg,
    };
    SuccessSet { goal, shape }
}

fn order(success: &SuccessSet, yaw_deg: [f64; 2], layout: Layout) -> BakeInput<'_> {
    BakeInput {
        task: "t",
        success,
        spec: TableSpec {
            extent: Extent {
                x: [-1.5, 1.5],
                y: [-1.5, 1.5],
                yaw_deg,
            },
            step: Step {
                xy: 0.05,
                yaw_deg: 2.0,
            },
            layout,
        },
        epsilon: 0.99,
    }
}

/// A box of 4 mm to either side, in length units of 64 um or more: 200 of them leave nothing.
#[test]
fn facets_that_leave_no_pose_are_found() {
    let side = [-0.004, 0.004];
    let small = BoxSet {
        x: side,
        y: side,
        yaw_deg: [-4.0, 4.0],
    };
    let small = set(0.0, Shape::Box(small));
    let order = order(&small, [-5.0, 5.0], Layout::Facets);
    let largest = *Effort::EACH.last().unwrap();
    for (effort, is_void) in [(Effort::default(), false), (largest, true)] {
        let plan = bake::facets(&order, effort).unwrap();
        assert_eq!(holds_nothing(&order, &plan).unwrap(), is_void, "{effort:?}");
    }
}

/// A run of cells extends from one part of a set into the next. The parts need not meet where halves of the run
/// do, but each cell lies in one part.
#[test]
fn runs_across_parts_are_proven() {
    let clear = Clear::new(
        vec![[-0.0715, 0.397], [-0.474, 0.1131], [-0.1937, -0.3174]],
        vec![[-1.0738, 0.2624], [-1.771, -0.4295], [-0.4295, -0.7032]],
    );
    let success = set(90.0, Shape::Apart(Exclusion::Obstacle(clear.unwrap())));
    let (_, proof) = build(&order(&success, [140.0, 220.0], Layout::Grid), &|| ()).unwrap();
    assert!(proof.cells > 80_000, "{proof:?}");
}

/// More effort for one piece can lengthen the layout's lever, and so increase the decision's rounding errors for
/// the others: pieces that were proven before are proven again.
#[test]
fn adjacent_pieces_are_proven() {
    let square =
        |[x0, x1]: [f64; 2], [y0, y1]: [f64; 2]| vec![[x0, y0], [x1, y0], [x1, y1], [x0, y1]];
    let robot = [
        [0.3852, 0.2267],
        [0.0878, 0.3622],
        [-0.0751, 0.2998],
        [-0.1286, 0.1549],
        [0.1009, 0.0161],
        [0.3572, 0.1038],
    ];
    let regions = [
        square([-1.5, 1.5], [-0.5, 0.5]),
        square([-0.5, 0.5], [-1.5, 1.5]),
        square([0.3, 1.4], [0.3, 1.4]),
    ];
    let shape = Shape::footprint_in_union(&robot, &regions).unwrap();
    let success = SuccessSet {
        goal: PoseDeg {
            x: 0.491609,
            y: -0.800552,
            yaw_deg: 0.0,
        },
        shape: shape.within(Tolerance {
            translation: 0.022102,
            turn_deg: 0.33496,
        }),
    };
    let (bytes, _) = build(&order(&success, [-60.0, 60.0], Layout::Facets), &|| ()).unwrap();
    let table = Table::parse(&bytes).unwrap();
    assert!(table.facets().unwrap().pieces().count() >= 3);
}

/// A robot that may turn around in a crossing, and in a lane with a bay at an angle: few of its poses are across the two regions, at few
/// headings, and no piece for them may be lost.
#[test]
fn poses_across_regions_are_held_at_every_heading() {
    let square =
        |[x0, x1]: [f64; 2], [y0, y1]: [f64; 2]| vec![[x0, y0], [x1, y0], [x1, y1], [x0, y1]];
    let robot = square([-0.4, 0.4], [-0.2, 0.2]);
    let lane = square([-1.5, 1.5], [-0.55, 0.55]);
    let (cos, sin) = (libm::cos(0.4), libm::sin(0.4));
    let bay = square([-0.3, 1.6], [-0.35, 0.35]);
    let bay = bay
        .iter()
        .map(|[x, y]| [cos * x - sin * y, sin * x + cos * y]);
    let others = [square([-0.6, 0.6], [-1.5, 1.5]), bay.collect()];
    let lanes = [lane, square([-1.5, 0.0], [-0.55, 0.55])];
    for (lane, other) in lanes.into_iter().zip(others) {
        let shape = Shape::footprint_in_union(&robot, &[lane, other]).unwrap();
        let success = set(20.0, shape);
        let order = order(&success, [-180.0, 180.0], Layout::Facets);
        let (bytes, _) = build(&order, &|| ()).unwrap();
        let table = Table::parse(&bytes).unwrap();
        let found = coverage(&table, &success);
        assert!(found.share > 0.98 && found.worst.share > 0.9, "{found:?}");
        assert!(bytes.len() < 4_000, "{} bytes", bytes.len());
    }
}

/// Returns a polygon with corners on a circle.
fn round(corners: u32, radius: f64) -> Vec<[f64; 2]> {
    (0..corners)
        .map(|k| f64::from(k) / f64::from(corners) * core::f64::consts::TAU)
        .map(|angle| [radius * libm::cos(angle), radius * libm::sin(angle)])
        .collect()
}

/// A set without a pose in the table's extent, although each of its constraints has one.
#[test]
fn set_without_pose_in_extent_names_its_constraint() {
    let footprint = Footprint::new(
        vec![[0.4, 0.2], [-0.4, 0.2], [-0.4, -0.2], [0.4, -0.2]],
        vec![[0.35, 1.0], [-0.35, 1.0], [-0.35, -1.0], [0.35, -1.0]],
    );
    let success = set(0.0, Shape::Footprint(footprint.unwrap()));
    let faults = [Layout::Facets, Layout::Grid]
        .map(|layout| build(&order(&success, [-20.0, 20.0], layout), &|| ()).unwrap_err());
    let empty = |fault: &BuildError| match fault {
        BuildError::Bake(BakeError::Empty { nearest, .. }) => {
            let [_, _, yaw] = nearest.pose;
            nearest.constraint == "region"
                && nearest.slack < 0.0
                && yaw.abs() <= core::f64::consts::PI
        }
        _ => false,
    };
    assert!(faults.iter().all(empty), "{faults:?}");
}

/// A robot with more corners than facets have frames. A grid holds its set.
#[test]
fn set_with_too_many_corners_is_refused_by_facets() {
    let region = vec![[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]];
    let footprint = Footprint::new(round(300, 0.3), region).unwrap();
    let success = set(0.0, Shape::Footprint(footprint));
    let build = |layout| build(&order(&success, [-180.0, 180.0], layout), &|| ());
    assert!(matches!(
        build(Layout::Facets),
        Err(BuildError::Bake(BakeError::TooLarge { what: "frames", .. }))
    ));
    let (bytes, proof) = build(Layout::Grid).unwrap();
    let table = Table::parse(&bytes).unwrap();
    assert!(table.facets().is_none() && proof.cells > 1000, "{proof:?}");
}

/// Firmware of an older version would decide by cells that are not proven here.
#[test]
fn table_with_both_layouts_is_refused() {
    let bytes = include_bytes!("../../tests/data/both-layouts.posegate");
    let success = set(0.0, Shape::Any(Vec::new()));
    let claim = ExpectedTable {
        task: "over-180",
        success: &success,
        epsilon: 0.95,
    };
    assert_eq!(verify(bytes, &claim, &|| ()), Err(VerifyError::BothLayouts));
}
