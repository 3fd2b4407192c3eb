//! The drawings of a mounting sheet: the wall as its viewer sees it, a stand from the front, and the tag from above.

use super::Mounted;
use super::place::OnWall;
use crate::draw::ingredients::axes;
use crate::draw::palette;
use crate::draw::panel::hatching;
use crate::draw::svg::{Font, Picture, Style};
use posegate::shape::{Family, Tag};

const DIMENSION: Style = Style::outlined(palette::FAINT, 1.0);
/// The largest drawing of a wall, pixels.
const WALL: [f64; 2] = [430.0, 66.0];
/// The smallest drawing of a tag, pixels.
const SMALLEST: f64 = 8.0;
const CAPTION: Font = Font::new(11.0, palette::FAINT);
const LABEL: Font = Font::new(12.0, palette::INK);

/// Draws the face of a wall with the tag, the distance from its left corner and the height. The point is the upper left corner.
pub(super) fn elevation(
    picture: &mut Picture,
    [left, top]: [f64; 2],
    on: &OnWall,
    mounted: &Mounted,
) {
    let caption = if on.keep_outs.is_empty() {
        "the wall as you face it, to scale"
    } else {
        "the wall as you face it, to scale; hatched: keep-out, no tag there"
    };
    picture.text([left - 16.0, top], caption, &CAPTION);
    let high = on.z[1].max(mounted.tag.pose.z + mounted.tag.size).max(0.1);
    let scale = (WALL[0] / on.length).min(WALL[1] / high);
    let floor = top + 12.0 + WALL[1];
    let at = |along: f64, z: f64| [left + along * scale, floor - z * scale];
    let rectangle = |[a, b]: [f64; 2], [low, high]: [f64; 2]| {
        [at(a, low), at(b, low), at(b, high), at(a, high)]
    };
    let face = rectangle([0.0, on.length], on.z);
    let outlined = |picture: &mut Picture, [a, b, c, d]: [[f64; 2]; 4], style: &Style| {
        picture.line(&[a, b, c, d, a], style);
    };
    let [[x0, y0], _, [x1, y1], _] = face;
    picture.rectangle([x0, y1, x1 - x0, y0 - y1], &palette::AREA);
    for [along, [low, high]] in &on.keep_outs {
        let inside = [low.clamp(on.z[0], on.z[1]), high.clamp(on.z[0], on.z[1])];
        let corners = rectangle(*along, inside);
        picture.path(&hatching(&corners), &palette::WALL);
        outlined(picture, corners, &palette::WALL);
    }
    outlined(picture, face, &palette::WALL);
    let ends = [at(0.0, 0.0), at(on.length, 0.0)];
    let beyond = [[ends[0][0] - 12.0, floor], [ends[1][0] + 12.0, floor]];
    picture.line(&beyond, &Style::outlined(palette::INK, 1.6));
    let bold = LABEL.bold();
    picture.text([ends[0][0] - 14.0, floor - 4.0], "A", &bold);
    picture.text([ends[1][0] + 5.0, floor - 4.0], "B", &bold);
    let [x, y] = at(on.along, mounted.tag.pose.z);
    square(picture, [x, y], mounted, scale);
    // The height, beyond the right end.
    let right = ends[1][0] + 22.0;
    picture.line(&[[x, y], [right, y]], &DIMENSION.dashed("3 3"));
    picture.arrow([right, floor], [right, y], &DIMENSION);
    let up = format!("{:.3} m", mounted.tag.pose.z);
    picture.text([right + 6.0, 0.5 * (floor + y) + 4.0], &up, &LABEL);
    // The distance from corner A, below the floor.
    let below = floor + 10.0;
    picture.line(&[[left, floor], [left, below + 4.0]], &DIMENSION);
    picture.line(&[[x, floor], [x, below + 4.0]], &DIMENSION);
    picture.arrow([left, below], [x, below], &DIMENSION);
    let along = format!("{:.3} m from A", on.along);
    picture.text([left, below + 16.0], &along, &LABEL);
}

/// Draws the tag to scale, or as the smallest visible square.
fn square(picture: &mut Picture, [x, y]: [f64; 2], mounted: &Mounted, scale: f64) {
    let edge = |edge: f64| {
        let edge = (edge * scale).max(SMALLEST);
        [x - 0.5 * edge, y - 0.5 * edge, edge, edge]
    };
    let whole = mounted.tag.size * Family::whole_of(&mounted.family);
    let white = Style::filled("#ffffff").with_outline(palette::FRAME, 1.0);
    picture.rectangle(edge(whole), &white);
    picture.rectangle(edge(mounted.tag.size), &Style::filled("#222222"));
}

/// Draws a tag on a stand from the front, above the floor. The point is the upper left corner.
pub(super) fn front_view(picture: &mut Picture, [left, top]: [f64; 2], mounted: &Mounted) {
    picture.text(
        [left - 16.0, top],
        "seen from the front, to scale",
        &CAPTION,
    );
    let z = mounted.tag.pose.z;
    let scale = 80.0 / (z + mounted.tag.size).max(0.5);
    let floor = top + 96.0;
    let [x, y] = [left + 90.0, floor - z * scale];
    picture.line(
        &[[left, floor], [left + 220.0, floor]],
        &Style::outlined(palette::INK, 1.6),
    );
    picture.text([left + 226.0, floor + 4.0], "floor", &CAPTION);
    square(picture, [x, y], mounted, scale);
    let right = left + 160.0;
    picture.arrow([right, floor], [right, y], &DIMENSION);
    picture.line(&[[x, y], [right, y]], &DIMENSION.dashed("3 3"));
    let up = format!("{z:.3} m");
    picture.text([right + 6.0, 0.5 * (floor + y) + 4.0], &up, &LABEL);
}

/// Draws the tag from above, with the site's axes. The point is the upper left corner.
pub(super) fn from_above(picture: &mut Picture, [left, top]: [f64; 2], tag: &Tag) {
    picture.text(
        [left - 16.0, top],
        "from above; the arrow: its face",
        &CAPTION,
    );
    let [normal, across, _] = axes(&tag.pose);
    let [x, y] = [left + 104.0, top + 56.0];
    let at = |along: f64, right: f64| {
        [
            x + along * normal[0] + right * across[0],
            y - along * normal[1] - right * across[1],
        ]
    };
    picture.line(&[at(0.0, -20.0), at(0.0, 20.0)], &palette::TAG);
    let ink = Style::outlined(palette::INK, 1.8);
    picture.arrow(at(0.0, 0.0), at(38.0, 0.0), &ink);
    let origin = [left - 10.0, top + 96.0];
    for (tip, name, label) in [
        ([origin[0] + 32.0, origin[1]], "x", [6.0, 4.0]),
        ([origin[0], origin[1] - 32.0], "y", [6.0, 4.0]),
    ] {
        picture.arrow(origin, tip, &DIMENSION);
        picture.text([tip[0] + label[0], tip[1] + label[1]], name, &CAPTION);
    }
}
