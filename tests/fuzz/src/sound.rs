//! Checks in floating point that poses of a set are where a decision states.
//!
//! Shares no code with `contain` except the clearance, which the proof of a table takes from there, too.

use posegate::contain::{Margin, facet_clearance_q14};
use posegate::pose::Pose;
use posegate::set::{Extent, PoseSet, SqrtFactor};
use posegate::table::{Axes, Cells, Facets, NORMAL_BITS, Piece, Table};
use std::f64::consts::TAU;

/// A full turn, in units of a binary angle.
const TURN: f64 = 4_294_967_296.0;
/// Largest error of the floating point: micrometres, and units of a binary angle.
const HAIR: f64 = 1e-3;

/// Offsets from the estimate: micrometres, and units of a binary angle.
type Offset = [f64; 3];

/// Returns some poses on the border of a scaled set, including those along the axes of its factor and
/// those that `pick` selects. None is beyond half a turn, because the error of a heading wraps.
fn border(set: &PoseSet, scale: f64, pick: [i8; 3]) -> Vec<Offset> {
    let mut unit = vec![[0.0; 3], pick.map(f64::from)];
    for signs in 0..8 {
        let sign = |bit: i32| if signs >> bit & 1 == 0 { 1.0 } else { -1.0 };
        unit.push([0, 1, 2].map(sign));
        unit.push([sign(0), 0.3 * sign(1), 0.1 * sign(2)]);
        unit.push([0, 1, 2].map(|axis| if axis == signs % 3 { sign(2) } else { 0.0 }));
    }
    let in_ellipsoid = |factor: SqrtFactor, [u, v, w]: [f64; 3]| {
        let length = u.hypot(v).hypot(w).max(1e-9) / scale;
        let u = [u, v, w].map(|part| part / length);
        let along = |row: [i32; 3]| -> f64 { (0..3).map(|k| f64::from(row[k]) * u[k]).sum() };
        let yaw = f64::from(factor.yaw_q24()) * u[0] * 256.0;
        [along(factor.x_um()), along(factor.y_um()), yaw]
    };
    let in_cylinder = |[translation_um, yaw_q24]: [i32; 2], [u, v, w]: [f64; 3]| {
        let length = v.hypot(w).max(1e-9) / scale;
        let radius = f64::from(translation_um);
        let yaw = f64::from(yaw_q24) * 256.0 * u.clamp(-1.0, 1.0) * scale;
        [
            radius * v / length,
            radius * w / length,
            yaw.clamp(-TURN / 2.0, TURN / 2.0),
        ]
    };
    let offsets = unit.into_iter().map(|unit| match set.extent() {
        Extent::Gaussian(factor) => in_ellipsoid(factor, unit),
        Extent::Bounded {
            translation_um,
            yaw_q24,
        } => in_cylinder([translation_um, yaw_q24], unit),
        Extent::Grown { factor, by } => {
            let moved = in_cylinder([by.translation_um(), by.yaw_q24()], unit);
            let still = in_ellipsoid(factor, unit);
            [0, 1, 2].map(|axis| still[axis] + moved[axis])
        }
    });
    offsets
        .filter(|[_, _, yaw]| yaw.abs() <= TURN / 2.0)
        .collect()
}

/// Asserts that poses of the set scaled by its reported margin lie each in a piece of the facets, or
/// each in a covered cell.
pub fn holds(table: &Table<'_>, set: &PoseSet, margin: Margin, pick: [i8; 3]) {
    let offsets = border(set, f64::from(margin.q16()) / 65_536.0, pick);
    let in_facets = table.facets().is_some_and(|layout| {
        offsets.iter().all(|offset| {
            let mut pieces = layout.pieces();
            pieces.any(|piece| is_in_piece(table, layout, &piece, set, *offset))
        })
    });
    let in_cells = || offsets.iter().all(|offset| is_in_cell(table, set, *offset));
    assert!(
        in_facets || in_cells(),
        "a pose of {set:?} times {margin:?} lies outside"
    );
}

/// Asserts that the reported worst pose is a pose of the set, up to the rounding of its units. For an
/// ellipsoid up to 0.5 % of its length, the accuracy of touching points in a row of cells.
///
/// The walk evaluates whole slabs, so for a set that is wider than half a turn it may evaluate headings just
/// beyond half a turn. Such a pose is in the set except for the wrap.
pub fn is_of(set: &PoseSet, pose: Pose) {
    let mean = set.mean();
    let (x, y) = (
        f64::from(pose.x_um) - f64::from(mean.x_um),
        f64::from(pose.y_um) - f64::from(mean.y_um),
    );
    let yaw = f64::from(pose.yaw.minus(mean.yaw).signed());
    let is_wide = match set.extent() {
        Extent::Gaussian(factor) => f64::from(factor.yaw_q24()) * 256.0 > TURN / 2.0,
        Extent::Bounded { .. } => false,
        Extent::Grown { factor, by } => {
            f64::from(factor.yaw_q24().saturating_add(by.yaw_q24())) * 256.0 > TURN / 2.0
        }
    };
    let reaches = |turns: f64| is_within(set, [x, y, (yaw + turns * TURN) / 256.0]);
    let is_of = reaches(0.0) || is_wide && (reaches(-1.0) || reaches(1.0));
    assert!(is_of, "{pose:?} is not of {set:?}");
}

/// Returns `true` if an offset (um, um, 2^-24 turn) is within the reach of the set along some directions.
fn is_within(set: &PoseSet, offset: [f64; 3]) -> bool {
    let dot = |a: [f64; 3], b: [f64; 3]| -> f64 { (0..3).map(|k| a[k] * b[k]).sum() };
    let rounding = match set.extent() {
        Extent::Gaussian(factor) | Extent::Grown { factor, .. } => {
            let length = |row: [i32; 3]| dot(row.map(f64::from), row.map(f64::from)).sqrt();
            let length = length(factor.x_um()).max(length(factor.y_um()));
            let yaw = f64::from(factor.yaw_q24());
            [8.0 + 5e-3 * length, 8.0 + 5e-3 * length, 2.0 + 5e-3 * yaw]
        }
        Extent::Bounded { .. } => [8.0, 8.0, 2.0],
    };
    (0..27).all(|number: i32| {
        let signs = [number % 3, number / 3 % 3, number / 9].map(|v| f64::from(v - 1));
        let in_cylinder = |[translation_um, yaw_q24]: [i32; 2], [x, y, yaw]: [f64; 3]| {
            f64::from(translation_um) * x.hypot(y) + f64::from(yaw_q24) * yaw.abs()
        };
        let (along, reach) = match set.extent() {
            Extent::Gaussian(factor) | Extent::Grown { factor, .. } => {
                let rows = [
                    factor.x_um().map(f64::from),
                    factor.y_um().map(f64::from),
                    [f64::from(factor.yaw_q24()), 0.0, 0.0],
                ];
                let along = [0, 1, 2].map(|k| signs[k] / dot(rows[k], rows[k]).sqrt().max(1.0));
                let column = |k: usize| (0..3).map(|row| rows[row][k] * along[row]).sum::<f64>();
                let moved = match set.extent() {
                    Extent::Grown { by, .. } => {
                        in_cylinder([by.translation_um(), by.yaw_q24()], along)
                    }
                    _ => 0.0,
                };
                let still = column(0).hypot(column(1)).hypot(column(2));
                (along, still + moved)
            }
            Extent::Bounded {
                translation_um,
                yaw_q24,
            } => (signs, in_cylinder([translation_um, yaw_q24], signs)),
        };
        dot(along, offset) <= reach + dot(along.map(f64::abs), rounding)
    })
}

fn is_in_piece(
    table: &Table<'_>,
    layout: &Facets<'_>,
    piece: &Piece<'_>,
    set: &PoseSet,
    [dx, dy, turn]: Offset,
) -> bool {
    let (goal, mean) = (table.goal().pose, set.mean());
    let above = f64::from(mean.yaw.minus(goal.yaw).0) + turn - f64::from(piece.from);
    let above = above.rem_euclid(TURN);
    let width = f64::from(piece.width);
    // Headings just below the arc's first heading have wrapped.
    if !(piece.is_whole_circle() || above <= width + HAIR || above >= TURN - HAIR) {
        return false;
    }
    let unit = f64::from(1u32 << layout.unit());
    let away = [
        (f64::from(mean.x_um) - f64::from(goal.x_um) + dx) / unit,
        (f64::from(mean.y_um) - f64::from(goal.y_um) + dy) / unit,
    ];
    let (sin, cos) = ((f64::from(mean.yaw.0) + turn) / TURN * TAU).sin_cos();
    piece.frames().all(|frame| {
        let point = [f64::from(frame.x), f64::from(frame.y)];
        let seen = match frame.axes {
            Axes::World => {
                let [x, y] = point;
                [away[0] + cos * x - sin * y, away[1] + sin * x + cos * y]
            }
            Axes::Robot => {
                let [x, y] = [away[0] - point[0], away[1] - point[1]];
                [cos * x + sin * y, cos * y - sin * x]
            }
        };
        frame.facets().all(|facet| {
            let turns = point != [0.0, 0.0];
            let clearance =
                facet_clearance_q14(facet, frame.axes, turns, layout.unit(), layout.lever());
            let one = f64::from(1 << NORMAL_BITS);
            let along = f64::from(facet.x) * seen[0] + f64::from(facet.y) * seen[1];
            along <= f64::from(facet.b) * one + clearance as f64 + HAIR
        })
    })
}

/// Cells are closed: a pose on an edge is in both.
fn is_in_cell(table: &Table<'_>, set: &PoseSet, [dx, dy, turn]: Offset) -> bool {
    let (Some(grid), goal, cells) = (table.grid(), table.goal(), table.cells()) else {
        return false;
    };
    let mean = set.mean();
    let one = f64::from(1 << 30);
    let (c, s) = (f64::from(goal.cos_q30) / one, f64::from(goal.sin_q30) / one);
    let x = f64::from(mean.x_um) - f64::from(goal.pose.x_um) + dx;
    let y = f64::from(mean.y_um) - f64::from(goal.pose.y_um) + dy;
    let (x, y) = (
        c * x + s * y - f64::from(cells.x_lo_um),
        c * y - s * x - f64::from(cells.y_lo_um),
    );
    let yaw = f64::from(mean.yaw.minus(goal.pose.yaw).minus(cells.yaw_lo).0) + turn;
    let step = f64::from(cells.step_um);
    let numbers = |at: f64, count: u16| {
        let [low, high] = [at - HAIR, at + HAIR].map(|v| (v / step).floor());
        let within = move |v: &f64| *v >= 0.0 && *v < f64::from(count);
        [low, high].into_iter().filter(within).map(|v| v as u16)
    };
    slabs(cells, yaw).any(|k| {
        numbers(y, cells.rows).any(|row| {
            numbers(x, cells.columns).any(|column| {
                let mut runs = grid.slab(k).runs(row);
                runs.any(|run| run.first <= column && column <= run.last)
            })
        })
    })
}

fn slabs(cells: &Cells, yaw: f64) -> impl Iterator<Item = u16> {
    let at = |yaw: f64| yaw.rem_euclid(TURN).floor() as i64;
    [at(yaw - HAIR), at(yaw + HAIR)]
        .into_iter()
        .filter(|at| at.unsigned_abs() <= cells.yaw_span)
        .map(|at| cells.slab_of(at))
}
