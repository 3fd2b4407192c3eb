//! Tables with features that no example task needs: far and turned goals, headings across +-180 degrees,
//! several runs in a row, several pieces, points that the robot carries. Except for that of
//! [`turning`], cells and facets are synthetic and belong to no success set.

use posegate::bake::{BakeError, BakeInput, Extent, FacetPlan, FramePlan, Layout, PiecePlan};
use posegate::bake::{Rows, Step, TableSpec, write_facets, write_grid};
use posegate::shape::{BoxSet, Footprint, PoseDeg, Shape, SuccessSet};
use posegate::table::{Axes, Cells, Facet, Run};
use posegate::verify::build;

/// Returns a table of every heading: two rooms whose wall moves with the heading, and a pillar in one of them.
pub fn whole_circle() -> Vec<u8> {
    const SLABS: u16 = 24;
    let slabs: Vec<Rows> = (0..SLABS)
        .map(|slab| {
            let wall = 6 + slab.abs_diff(SLABS / 2) / 2;
            let row = |row: u16| match row {
                0 => vec![],
                3..5 => vec![run(0, wall - 2), run(wall + 1, 15), run(18, 19)],
                _ => vec![run(0, wall - 1), run(wall + 1, 19)],
            };
            (0..20).map(row).collect()
        })
        .collect();
    let spec = TableSpec {
        extent: Extent {
            x: [-1.0, 1.0],
            y: [-1.0, 1.0],
            yaw_deg: [-180.0, 180.0],
        },
        step: Step {
            xy: 0.1,
            yaw_deg: 15.0,
        },
        layout: Layout::Grid,
    };
    table(
        "whole-circle",
        [-1500.25, 880.125, -135.0],
        spec,
        0.9,
        |order, cells| write_grid(order, cells, &slabs),
    )
}

/// Returns a table of every heading in facets: a robot that is longer behind than in front turns in a room of five
/// walls.
pub fn turning() -> Vec<u8> {
    let robot = vec![[0.3, -0.2], [0.3, 0.2], [-0.45, 0.25], [-0.45, -0.2]];
    let room = vec![
        [1.1, -0.9],
        [1.3, 0.4],
        [0.2, 1.2],
        [-1.2, 0.9],
        [-1.0, -1.0],
    ];
    let order = BakeInput {
        task: "turning",
        success: &SuccessSet {
            goal: PoseDeg {
                x: 812.75,
                y: -1203.5,
                yaw_deg: 151.2,
            },
            shape: Shape::Footprint(Footprint::new(robot, room).expect("two polygons")),
        },
        spec: TableSpec {
            extent: Extent {
                x: [-0.9, 1.0],
                y: [-0.8, 0.9],
                yaw_deg: [-180.0, 180.0],
            },
            step: Step {
                xy: 0.05,
                yaw_deg: 5.0,
            },
            layout: Layout::Facets,
        },
        epsilon: 0.99,
    };
    build(&order, &|| ()).expect("a table that is proven").0
}

/// Returns a table of facets in several pieces, of which one has an arc of its own: a robot passes the corner of an L of two regions,
/// or is in a bay next to it.
pub fn corner() -> Vec<u8> {
    let rectangle =
        |[x0, x1]: [f64; 2], [y0, y1]: [f64; 2]| vec![[x0, y0], [x1, y0], [x1, y1], [x0, y1]];
    let robot = rectangle([-0.35, 0.25], [-0.2, 0.2]);
    let regions = [
        rectangle([-1.5, 1.0], [-0.5, 0.7]),
        rectangle([-0.2, 1.0], [-1.6, 0.7]),
    ];
    let across = Shape::footprint_in_union(&robot, &regions).expect("two regions");
    let bay = Shape::Box(BoxSet {
        x: [0.4, 1.1],
        y: [-0.12, 0.12],
        yaw_deg: [-15.0, 12.0],
    });
    let order = BakeInput {
        task: "corner",
        success: &SuccessSet {
            goal: PoseDeg {
                x: -1250.5,
                y: 940.25,
                yaw_deg: -73.4,
            },
            shape: Shape::Any(vec![across, bay]),
        },
        spec: TableSpec {
            extent: Extent {
                x: [-1.4, 1.2],
                y: [-1.5, 0.7],
                yaw_deg: [-100.0, 100.0],
            },
            step: Step {
                xy: 0.05,
                yaw_deg: 5.0,
            },
            layout: Layout::Facets,
        },
        epsilon: 0.99,
    };
    build(&order, &|| ()).expect("a table that is proven").0
}

/// Returns a table of facets of headings from 140 to 220 degrees, in the world from 157.3 to 237.3.
pub fn over_180() -> Vec<u8> {
    let plan = FacetPlan {
        unit: UNIT,
        reach: 10_200,
        pieces: vec![in_a_rectangle(), in_view()],
    };
    table(
        "over-180",
        GOAL,
        over_180_spec(Layout::Facets),
        0.95,
        |order, _| write_facets(order, &plan),
    )
}

/// Returns a grid of the headings of [`over_180`], with columns that need 16 bits and two runs in a row.
pub fn over_180_grid() -> Vec<u8> {
    let slabs: Vec<Rows> = (0..8u16)
        .map(|slab| {
            let row = |row: u16| {
                let step = 3 * row.abs_diff(11) + slab;
                vec![run(step, 280 - 2 * step), run(300, 399 - step)]
            };
            (0..20).map(row).collect()
        })
        .collect();
    table(
        "over-180-grid",
        GOAL,
        over_180_spec(Layout::Grid),
        0.95,
        |order, cells| write_grid(order, cells, &slabs),
    )
}

fn over_180_spec(layout: Layout) -> TableSpec {
    TableSpec {
        extent: Extent {
            x: [-2.5, 1.5],
            y: [-0.1, 0.1],
            yaw_deg: [140.0, 220.0],
        },
        step: Step {
            xy: 0.01,
            yaw_deg: 10.0,
        },
        layout,
    }
}

/// Goal of [`over_180`]: m, m, degrees.
const GOAL: [f64; 3] = [1700.5, -1650.75, GOAL_YAW_DEG];
const GOAL_YAW_DEG: f64 = 17.3;
/// Exponent of the length unit, 256 um.
const UNIT: u8 = 8;

/// Returns a piece: a point of the robot in a rectangle.
fn in_a_rectangle() -> PiecePlan {
    let wall = |yaw_deg, metres| facet(GOAL_YAW_DEG + yaw_deg, metres);
    let frame = FramePlan {
        axes: Axes::World,
        point: [300, -150],
        facets: vec![
            wall(0.0, 0.8),
            wall(90.0, 0.13),
            wall(180.0, -0.05),
            wall(-90.0, 0.06),
        ],
    };
    piece(145.0, 70.0, vec![frame])
}

/// Returns a piece: a point of the world in the robot's view, neither near nor far, and the robot between two walls.
fn in_view() -> PiecePlan {
    let (sin, cos) = GOAL_YAW_DEG.to_radians().sin_cos();
    let view = FramePlan {
        axes: Axes::Robot,
        point: [cos, sin].map(|v| units(-1.9 * v).round() as i16),
        facets: vec![
            facet(0.0, -0.5),
            facet(65.0, 0.0),
            facet(180.0, 1.8),
            facet(-65.0, 0.0),
        ],
    };
    let walls = FramePlan {
        axes: Axes::World,
        point: [0, 0],
        facets: [90.0, -90.0]
            .map(|yaw_deg| facet(GOAL_YAW_DEG + yaw_deg, 0.1))
            .to_vec(),
    };
    piece(150.0, 60.0, vec![view, walls])
}

/// Returns the half-plane whose normal has a heading.
fn facet(yaw_deg: f64, metres: f64) -> Facet {
    let (sin, cos) = yaw_deg.to_radians().sin_cos();
    let [x, y] = [cos, sin].map(|v| (16_384.0 * v).round() as i16);
    let b = units(metres).floor() as i16;
    Facet { x, y, b }
}

fn piece(from_deg: f64, width_deg: f64, frames: Vec<FramePlan>) -> PiecePlan {
    let units = |degrees: f64| (degrees / 360.0 * 4_294_967_296.0) as u32;
    PiecePlan {
        from: units(from_deg),
        width: units(width_deg),
        frames,
    }
}

fn units(metres: f64) -> f64 {
    metres * 1e6 / f64::from(1u32 << UNIT)
}

fn run(first: u16, last: u16) -> Run {
    Run { first, last }
}

fn table(
    task: &str,
    [x, y, yaw_deg]: [f64; 3],
    spec: TableSpec,
    epsilon: f64,
    write: impl Fn(&BakeInput<'_>, &Cells) -> Result<Vec<u8>, BakeError>,
) -> Vec<u8> {
    let Extent {
        x: xs,
        y: ys,
        yaw_deg: yaws,
    } = spec.extent;
    let order = BakeInput {
        task,
        success: &SuccessSet {
            goal: PoseDeg { x, y, yaw_deg },
            shape: Shape::Box(BoxSet {
                x: xs,
                y: ys,
                yaw_deg: yaws,
            }),
        },
        spec,
        epsilon,
    };
    let cells = spec.cells().expect("the extent is one");
    write(&order, &cells).expect("the format holds the table")
}
