//! Two tables that no task of the examples asks for: far and turned goals, headings across +-180
//! degrees, several runs in a row. Their cells are made up; they prove nothing of a success set.

use posegate::bake::{Extent, Layout, Order, Rows, Step, TableSpec, write};
use posegate::shape::{BoxSet, PoseDeg, Shape, SuccessSet};
use posegate::table::Run;

/// Every heading; two rooms whose wall wanders with the heading, and a pillar in one of them.
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
        &slabs,
    )
}

/// Headings from 140 to 220 degrees, in the world from 157.3 to 237.3; columns that need 16 bits.
pub fn over_180() -> Vec<u8> {
    let slabs: Vec<Rows> = (0..8u16)
        .map(|slab| {
            let row = |row: u16| {
                let step = 3 * row.abs_diff(11) + slab;
                vec![run(step, 280 - 2 * step), run(300, 399 - step)]
            };
            (0..20).map(row).collect()
        })
        .collect();
    let spec = TableSpec {
        extent: Extent {
            x: [-2.5, 1.5],
            y: [-0.1, 0.1],
            yaw_deg: [140.0, 220.0],
        },
        step: Step {
            xy: 0.01,
            yaw_deg: 10.0,
        },
        layout: Layout::Grid,
    };
    table("over-180", [1700.5, -1650.75, 17.3], spec, 0.95, &slabs)
}

fn run(first: u16, last: u16) -> Run {
    Run { first, last }
}

fn table(
    task: &str,
    [x, y, yaw_deg]: [f64; 3],
    spec: TableSpec,
    epsilon: f64,
    slabs: &[Rows],
) -> Vec<u8> {
    let Extent {
        x: xs,
        y: ys,
        yaw_deg: yaws,
    } = spec.extent;
    let order = Order {
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
        site_digest: [0; 32],
    };
    let cells = spec.cells().expect("the extent is one");
    write(&order, &cells, slabs).expect("the format holds the table")
}
