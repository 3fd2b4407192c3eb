//! Markers for a viewer: the pose-set of the robot, and the section of the success set at its heading. For display
//! only.

use crate::message::{Header, Marker, Pose};
use crate::permit_gate::{Answer, LastReport};
use posegate::contain::{Decision, decide};
use posegate::set::{Estimate, PoseSet, Uncertainty};
use posegate::table::Table;
use posegate_replay::coordinates;

/// Lines of an ellipse.
const SIDES: u32 = 48;
/// Points of the section along each axis.
const SECTION: i32 = 40;
/// A pose-set of almost one pose: 10 um, 10 urad.
const POINT: f64 = 1e-5;

const LINE_STRIP: i32 = 4;
const CUBE_LIST: i32 = 6;
const TRIANGLE_LIST: i32 = 11;

/// Returns the markers of the last report.
#[must_use]
pub fn markers(answer: &Answer, last: &LastReport, table: &Table<'_>) -> Vec<Marker> {
    let mut markers = Vec::new();
    let [r, g, b] = match (answer.is_open, last.verdict.is_permit()) {
        (true, _) => [0.1, 0.8, 0.2],
        (false, true) => [0.9, 0.7, 0.1],
        (false, false) => [0.9, 0.2, 0.2],
    };
    let Ok(mean) = last.estimate.mean() else {
        return markers;
    };
    let [x, y, yaw] = coordinates(mean);
    let radius = libm::sqrt(f64::from(table.radius_squared().q16()) / 65_536.0);
    if let Some((axes, reach)) = spread(last.estimate.spread.as_ref(), radius) {
        let corners = (0..=SIDES).map(|k| {
            let angle = core::f64::consts::TAU * f64::from(k) / f64::from(SIDES);
            let (s, c) = (libm::sin(angle), libm::cos(angle));
            [x + axes[0] * c, y + axes[1] * c + axes[2] * s, 0.02]
        });
        let outline = Marker {
            kind: LINE_STRIP,
            scale: [0.01; 3],
            color: [r, g, b, 0.9],
            ..marker(answer, last, 0, corners.collect())
        };
        let headings = Marker {
            kind: TRIANGLE_LIST,
            scale: [1.0; 3],
            color: [r, g, b, 0.4],
            ..marker(answer, last, 1, fan([x, y, yaw], reach))
        };
        markers.extend([outline, headings]);
    }
    let (points, step) = section(table, yaw);
    markers.push(Marker {
        kind: CUBE_LIST,
        scale: [step, step, 0.005],
        color: [0.2, 0.5, 0.9, 0.4],
        ..marker(answer, last, 2, points)
    });
    markers
}

/// Returns the lower triangular root of the plane's covariance times the radius, and the extent in heading.
fn spread(spread: Option<&Uncertainty>, radius: f64) -> Option<([f64; 3], f64)> {
    match spread? {
        Uncertainty::Gaussian([[xx, xy, _], [_, yy, _], [_, _, tt]]) => {
            let a = libm::sqrt(*xx);
            let b = xy / a;
            let c = libm::sqrt((yy - b * b).max(0.0));
            let reach = radius * libm::sqrt(*tt);
            let axes = [a * radius, b * radius, c * radius];
            axes.iter()
                .chain([&reach])
                .all(|v| v.is_finite())
                .then_some((axes, reach))
        }
        Uncertainty::Bounded {
            translation_m,
            yaw_rad,
        } => Some(([*translation_m, 0.0, *translation_m], *yaw_rad)),
    }
}

/// Returns triangles over the possible headings, 30 cm long.
fn fan([x, y, yaw]: [f64; 3], reach: f64) -> Vec<[f64; 3]> {
    let reach = reach.min(core::f64::consts::PI);
    let tip = |share: f64| {
        let angle = yaw + reach * share;
        [x + 0.3 * libm::cos(angle), y + 0.3 * libm::sin(angle), 0.02]
    };
    let edges = (-4..4).map(|k| [tip(f64::from(k) / 4.0), tip(f64::from(k + 1) / 4.0)]);
    edges
        .flat_map(|[from, to]| [[x, y, 0.02], from, to])
        .collect()
}

/// Returns points of the table's success set at a heading, and their distance, metres.
fn section(table: &Table<'_>, yaw: f64) -> (Vec<[f64; 3]>, f64) {
    let cells = table.cells();
    let goal = table.goal();
    let (width, height) = (
        cells.x_hi_um() - cells.x_lo_um,
        cells.y_hi_um() - cells.y_lo_um,
    );
    let step = (width.max(height) / SECTION).max(1);
    let mut points = Vec::new();
    let range =
        |from: i32, length: i32| (0..length / step).map(move |k| from + k * step + step / 2);
    for x_um in range(cells.x_lo_um, width) {
        for y_um in range(cells.y_lo_um, height) {
            let place = goal.pose_to_world(posegate::pose::Pose {
                x_um,
                y_um,
                ..posegate::pose::Pose::default()
            });
            let [x_m, y_m] = [place.x_um, place.y_um].map(|um| f64::from(um) * 1e-6);
            let estimate = Estimate {
                x_m,
                y_m,
                yaw_rad: yaw,
            };
            let set = PoseSet::bounded(estimate, POINT, POINT);
            if set.is_ok_and(|set| decide(table, &set) == Decision::Inside) {
                points.push([x_m, y_m, 0.0]);
            }
        }
    }
    (points, f64::from(step) * 1e-6)
}

fn marker(answer: &Answer, last: &LastReport, id: i32, points: Vec<[f64; 3]>) -> Marker {
    Marker {
        header: Header {
            stamp: answer.now.time(),
            frame_id: last.frame.clone(),
        },
        ns: "posegate".into(),
        id,
        // Viewers refuse an empty list: delete the earlier markers.
        action: if points.is_empty() { 2 } else { 0 },
        pose: Pose {
            position: [0.0; 3],
            orientation: [0.0, 0.0, 0.0, 1.0],
        },
        // Markers of a node that has ended disappear.
        lifetime: (3, 0),
        points,
        ..Marker::default()
    }
}
