//! Places of a tag next to each other (Fig. 4 of the paper): the camera's view of the tag from the pose-set, and S_l
//! from above.

use super::belief::PoseSetF64;
use super::ingredients::{Ingredients, radians};
use super::legend::{LINE, Sample, legend};
use super::palette;
use super::panel::{Panel, Window, tick_at_scale};
use super::section::border;
use super::svg::{Anchor, Font, Picture, Style};
use posegate::confidence::core_radius;
use posegate::set::Uncertainty;
use posegate::shape::{PoseDeg, SuccessSet, Visibility};
use posegate_place::{Gaussian, Placed};

/// A tag at a place.
#[derive(Clone, Debug)]
pub struct Column {
    /// The title of the column.
    pub heading: String,
    /// The success set with the tag there.
    pub set: SuccessSet,
    /// The pose-set about the goal; `None` if the pose is known exactly.
    pub belief: Option<Gaussian>,
    /// The evaluation of the place.
    pub placed: Placed,
}

const LEFT: f64 = 62.0;
const PITCH: f64 = 340.0;
/// Number of places next to each other: on a telephone, the words of more would be too small to be read.
const ABREAST: usize = 2;
const IMAGE: [f64; 2] = [268.0, 201.0];
const TOP: f64 = 92.0;
const FLOOR: f64 = TOP + 201.0 + 44.0;
const FLOOR_HEIGHT: f64 = 230.0;
/// Distance from a row of places to the next one.
const DOWN: f64 = FLOOR + FLOOR_HEIGHT + 52.0 + 6.0 * 18.0 + 4.0 - 42.0;

/// The tag's corners seen from the goal, and from the pose-set's border.
const FROM_GOAL: Style = Style::outlined("#222222", 2.0).with_fill_opacity("#222222", 0.12);
const FROM_BORDER: [&str; 4] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7"];

/// Returns an SVG of places next to each other, two in a row. `cost` is the definition of the cost
/// ([`ViewCost::definition`](posegate_place::ViewCost::definition)).
#[must_use]
pub fn placement_picture(title: &str, cost: &str, columns: &[Column]) -> String {
    let reach = columns
        .iter()
        .fold(2.0, |reach: f64, column| reach.max(wide(column)));
    let cost = format!("cost of a view: {cost}");
    let rows = columns.len().div_ceil(ABREAST).max(1);
    let below = 42.0 + DOWN * rows as f64;
    let width = LEFT + PITCH * ABREAST as f64;
    let mut picture = Picture::new(width, below + 4.0 * LINE + 20.0, title);
    picture.text([24.0, 32.0], title, &Font::new(17.0, palette::INK).bold());
    for (number, column) in columns.iter().enumerate() {
        let left = LEFT + PITCH * (number % ABREAST) as f64;
        let down = DOWN * (number / ABREAST) as f64;
        let heading = Font::new(14.0, palette::INK).bold();
        picture.text([left, down + 70.0], &column.heading, &heading);
        let views = Ingredients::of(&column.set.shape).views;
        if let Some(view) = views.first() {
            image(&mut picture, [left, down + TOP], column, view);
        }
        let is_first = number.is_multiple_of(ABREAST);
        floor(
            &mut picture,
            [left, down + FLOOR],
            column,
            &views,
            reach,
            is_first,
        );
        words(
            &mut picture,
            [left, down + FLOOR + FLOOR_HEIGHT + 52.0],
            column,
        );
    }
    legend(
        &mut picture,
        [24.0, below],
        &[
            (
                Sample::Patch(FROM_GOAL),
                "image: the tag from the goal; dots: its four corners from the pose-set's border",
            ),
            (
                Sample::SuccessSet,
                "floor: S_l at the goal's heading, with the tag and where it looks",
            ),
            (
                Sample::Disc(palette::PAPER_SET),
                "floor: the pose-set X\u{302} about the goal; the line of the margin says whether all of it is in S_l",
            ),
            (Sample::Words, &cost),
        ],
    );
    picture.finish()
}

/// Returns the length of floor that a column needs, metres.
fn wide(column: &Column) -> f64 {
    column.placed.distance + 1.0
}

/// Returns the pose-set for pictures.
fn drawn(column: &Column) -> Option<PoseSetF64> {
    let known = column.belief?;
    Some(PoseSetF64 {
        estimate: radians(column.set.goal),
        spread: Uncertainty::Gaussian(known.covariance()),
        radius_squared: core_radius(known.epsilon())?,
    })
}

fn image(picture: &mut Picture, [left, top]: [f64; 2], column: &Column, view: &Visibility) {
    let camera = &view.camera;
    let scale = (IMAGE[0] / camera.width_px).min(IMAGE[1] / camera.height_px);
    let at = |[u, v]: [f64; 2]| [left + u * scale, top + v * scale];
    let edges = [left, top, camera.width_px * scale, camera.height_px * scale];
    let corners = |pose: [f64; 3]| {
        let alone = SuccessSet {
            goal: column.set.goal,
            shape: posegate::shape::Shape::Visibility(*view),
        };
        alone
            .membership(pose)
            .sight
            .map_or([None; 4], |sight| sight.corners_px)
    };
    let margin = 12.0;
    let around = [
        edges[0] - margin,
        edges[1] - margin,
        edges[2] + 2.0 * margin,
        edges[3] + 2.0 * margin,
    ];
    picture.clipped(around, |picture| {
        picture.rectangle(
            edges,
            &Style::filled("#f7f7f4").with_outline("#222222", 1.6),
        );
        if let Some(belief) = drawn(column) {
            let mut dots: [Vec<[f64; 2]>; 4] = Default::default();
            for pose in belief.border() {
                for (corner, dots) in corners(pose).into_iter().zip(&mut dots) {
                    dots.extend(corner.map(at));
                }
            }
            for (dots, colour) in dots.iter().zip(FROM_BORDER) {
                picture.dots(dots, 1.1, colour);
            }
        }
        let seen: Option<Vec<[f64; 2]>> = corners(radians(column.set.goal))
            .into_iter()
            .map(|c| c.map(at))
            .collect();
        if let Some(seen) = seen {
            picture.path(&format!("{}Z", super::svg::points_path(&seen)), &FROM_GOAL);
        }
    });
    let caption = Font::new(11.0, palette::FAINT).anchored(Anchor::Middle);
    let below = [left + 0.5 * edges[2], top + edges[3] + 16.0];
    picture.text(
        below,
        &format!("image, {} x {} px", camera.width_px, camera.height_px),
        &caption,
    );
}

fn floor(
    picture: &mut Picture,
    corner: [f64; 2],
    column: &Column,
    views: &[Visibility],
    reach: f64,
    first: bool,
) {
    let goal = column.set.goal;
    let scale = IMAGE[0] / (reach + 1.6);
    let half = 0.5 * FLOOR_HEIGHT / scale;
    let toward = direction(column, goal);
    // The tag is in front of the goal: centre the panel between them.
    let middle = [
        goal.x + 0.5 * (reach - 1.6) * toward[0],
        goal.y + 0.5 * (reach - 1.6) * toward[1],
    ];
    let wide = 0.5 * (reach + 1.6);
    let window = Window {
        x: [middle[0] - wide, middle[0] + wide],
        y: [middle[1] - half, middle[1] + half],
    };
    let panel = Panel {
        y_title: first,
        ..Panel::fitted(window, corner, [IMAGE[0], FLOOR_HEIGHT])
    };
    let heading = radians(goal)[2];
    let inside = |[x, y]: [f64; 2]| column.set.membership([x, y, heading]).inside;
    let area = border(&inside, &panel.window, 1.5 / scale);
    panel.draw(picture, "", tick_at_scale(scale, 48.0), |inside| {
        inside.success_set(&area);
        if let Some(section) = drawn(column).and_then(|belief| belief.section(heading)) {
            inside.polygons(&[section], &palette::PAPER_SET);
        }
        // The arrows of a tag near the goal and of the goal are shorter, so that they do not meet.
        let longest = 0.4 * scale * column.placed.distance;
        inside.pose_with_arrow(goal, longest.min(26.0), &Style::outlined(palette::INK, 2.0));
        for view in views {
            inside.tag_with_arrow(&view.tag, Some(longest));
        }
    });
}

/// Returns the direction of the tag from the goal: along x or y, positive or negative.
fn direction(column: &Column, goal: PoseDeg) -> [f64; 2] {
    let off = [column.placed.pose.x - goal.x, column.placed.pose.y - goal.y];
    if off[0].abs() >= off[1].abs() {
        [off[0].signum(), 0.0]
    } else {
        [0.0, off[1].signum()]
    }
}

/// Returns the distance from the goal to the nearest border of the set at the goal's heading, metres, for a picture.
/// It searches 120 directions in steps of 2 cm, then by bisection. `None` if the goal is not in the set.
fn to_border(set: &SuccessSet) -> Option<f64> {
    let [x, y, heading] = radians(set.goal);
    let holds = |angle: f64, far: f64| {
        let at = [x + far * libm::cos(angle), y + far * libm::sin(angle)];
        set.membership([at[0], at[1], heading]).inside
    };
    if !holds(0.0, 0.0) {
        return None;
    }
    const STEP: f64 = 0.02;
    let mut nearest = 20.0;
    for direction in 0..120 {
        let angle = f64::from(direction) * core::f64::consts::TAU / 120.0;
        let mut far = 0.0;
        while far < nearest && holds(angle, far + STEP) {
            far += STEP;
        }
        let (mut inside, mut outside) = (far, far + STEP);
        for _ in 0..12 {
            let middle = 0.5 * (inside + outside);
            if holds(angle, middle) {
                inside = middle;
            } else {
                outside = middle;
            }
        }
        nearest = inside.min(nearest);
    }
    Some(nearest)
}

fn words(picture: &mut Picture, [left, top]: [f64; 2], column: &Column) {
    let placed = &column.placed;
    let pose = placed.pose;
    // Rounded, and without a minus sign before zero.
    let [x, y, z] = [pose.x, pose.y, pose.z].map(|metres| libm::round(metres * 1e3) / 1e3 + 0.0);
    let yaw = libm::round(pose.yaw_deg * 10.0) / 10.0 + 0.0;
    let mut lines = std::vec![
        format!("x {x:.3}, y {y:.3}, z {z:.3} m, yaw {yaw:.1}°"),
        format!(
            "{:.3} m from the goal, cost there {:.2}",
            placed.distance, placed.cost_at_goal
        ),
    ];
    if let Some(mean) = placed.mean {
        let misses = match placed.p_miss {
            0.0 => "none".into(),
            p_miss => format!("{p_miss:.1e}"),
        };
        lines.push(format!("mean cost E[c] {:.2}, misses {misses}", mean.value));
    }
    if let Some(margin) = placed.margin {
        lines.push(format!(
            "margin {margin:.3}: {}",
            if placed.contained {
                "all of the pose-set in S"
            } else {
                "not all of it in S"
            }
        ));
    }
    lines.push(match to_border(&column.set) {
        Some(distance) => format!("border of S_l: {distance:.2} m from the goal"),
        None => "the goal is not in S_l".to_owned(),
    });
    let off = placed.tolerance();
    if !off.is_none() {
        lines.push(format!(
            "seen by all of the pose-set if off by {:.1} cm and {:.1}°",
            100.0 * off.translation,
            off.turn_deg
        ));
    }
    for (number, line) in lines.iter().enumerate() {
        picture.text(
            [left, top + 18.0 * number as f64],
            line,
            &Font::new(12.0, palette::INK),
        );
    }
}
