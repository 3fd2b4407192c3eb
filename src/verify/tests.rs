//! What has a table gets one.

use super::build;
use crate::bake::{Extent, Layout, Order, Step, TableSpec};
use crate::shape::{Apart, Clear, PoseDeg, Shape, SuccessSet};
use std::vec;

fn set(yaw_deg: f64, shape: Shape) -> SuccessSet {
    let goal = PoseDeg {
        x: 1.0,
        y: -2.0,
        yaw_deg,
    };
    SuccessSet { goal, shape }
}

fn order(success: &SuccessSet, yaw_deg: [f64; 2], layout: Layout) -> Order<'_> {
    Order {
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
        site_digest: [0; 32],
    }
}

/// A run of cells goes on from one part of a set into the next, which need not meet where halves of the run
/// do: each of its cells is held by one.
#[test]
fn runs_across_parts_are_proven() {
    let clear = Clear::new(
        vec![[-0.0715, 0.397], [-0.474, 0.1131], [-0.1937, -0.3174]],
        vec![[-1.0738, 0.2624], [-1.771, -0.4295], [-0.4295, -0.7032]],
    );
    let success = set(90.0, Shape::Apart(Apart::Obstacle(clear.unwrap())));
    let (_, proof) = build(&order(&success, [140.0, 220.0], Layout::Grid), &|| ()).unwrap();
    assert!(proof.cells > 80_000, "{proof:?}");
}
