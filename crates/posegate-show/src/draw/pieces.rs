//! The pieces of a table of facets at one heading, as convex polygons.

use super::panel::Window;
use posegate::num::BinaryAngle;
use posegate::table::{Axes, NORMAL_BITS, Piece, Table};

/// Returns the pieces of a table at a heading of the goal frame, clipped at the window: convex polygons in the
/// goal frame, metres.
#[must_use]
pub fn pieces(table: &Table<'_>, yaw_deg: f64, window: &Window) -> Vec<Vec<[f64; 2]>> {
    let (Some(facets), Some(heading)) = (
        table.facets(),
        BinaryAngle::from_radians(yaw_deg.to_radians()),
    ) else {
        return Vec::new();
    };
    let goal = f64::from(table.goal().pose.yaw.0) / 4_294_967_296.0 * core::f64::consts::TAU;
    let unit = 1e-6 * f64::from(1_u32 << facets.unit());
    facets
        .pieces()
        .filter(|piece| has(piece, heading))
        .map(|piece| polygon(&piece, goal, yaw_deg.to_radians(), unit, window))
        .filter(|polygon| polygon.len() >= 3)
        .collect()
}

/// Returns `true` if a piece contains a heading. Degrees are rarely exact binary angles, so two units beyond
/// an end are still inside.
fn has(piece: &Piece<'_>, heading: BinaryAngle) -> bool {
    let above = heading.0.wrapping_sub(piece.from).wrapping_add(2);
    piece.is_whole_circle() || u64::from(above) <= u64::from(piece.width) + 4
}

/// Cuts the window along every facet.
fn polygon(piece: &Piece<'_>, goal: f64, yaw: f64, unit: f64, window: &Window) -> Vec<[f64; 2]> {
    let ([x0, x1], [y0, y1]) = (window.x, window.y);
    let mut rest = std::vec![[x0, y0], [x1, y0], [x1, y1], [x0, y1]];
    let turned = |[x, y]: [f64; 2], by: f64| {
        let (c, s) = (libm::cos(by), libm::sin(by));
        [c * x - s * y, s * x + c * y]
    };
    for frame in piece.frames() {
        let point = [frame.x, frame.y].map(|v| f64::from(v) * unit);
        for facet in frame.facets() {
            let one = f64::from(1_u32 << NORMAL_BITS);
            let normal = [facet.x, facet.y].map(|v| f64::from(v) / one);
            let b = f64::from(facet.b) * unit;
            // As a line of the goal frame: P is p + R v in the world's axes, or R^-1 (p - q) in the robot's.
            let (line, offset) = match frame.axes {
                Axes::World => {
                    let v = turned(point, goal + yaw);
                    (turned(normal, -goal), b - dot(normal, v))
                }
                Axes::Robot => {
                    let world = turned(normal, goal + yaw);
                    (turned(normal, yaw), b + dot(world, point))
                }
            };
            rest = cut(&rest, line, offset);
        }
    }
    rest
}

fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

/// Returns the part of a convex polygon with `line . p <= offset`.
fn cut(polygon: &[[f64; 2]], line: [f64; 2], offset: f64) -> Vec<[f64; 2]> {
    let mut part = Vec::new();
    let ends = polygon.iter().cycle().skip(1);
    for (a, b) in polygon.iter().zip(ends) {
        let (ha, hb) = (offset - dot(line, *a), offset - dot(line, *b));
        if ha >= 0.0 {
            part.push(*a);
        }
        if (ha > 0.0 && hb < 0.0) || (ha < 0.0 && hb > 0.0) {
            let t = ha / (ha - hb);
            part.push([a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])]);
        }
    }
    part
}
