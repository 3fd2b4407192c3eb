//! The Stanford diagram: error versus protection level, in units of the alert limit.

use super::letters::number;
use super::palette;
use super::svg::{Anchor, Font, Picture, Style, points_path};
use posegate_replay::replay::{Region, STANFORD_END, STANFORD_STEPS, Stanford};

/// Side of the diagram, pixels.
const SIDE: f64 = 400.0;
/// Width of the strip for values beyond an axis.
const STRIP: f64 = 14.0;
/// Height of the whole diagram, with its text.
pub(super) const HEIGHT: f64 = 26.0 + STRIP + SIDE + 84.0;

const NOMINAL: Style = Style::filled("#ffffff");
const MISLEADING: Style = Style::filled("#fbe3b0");
const HAZARDOUS: Style = Style::filled("#f1b8a4");
const UNAVAILABLE: Style = Style::filled("#e3e6ea");
const BOTH: Style = Style::filled("#d3cdb9");
const LINE: Style = Style::outlined("#222222", 1.2);
const CELL: &str = "#00406b";

/// Draws the diagram; the point is the upper left corner.
pub(super) fn draw(picture: &mut Picture, [left, top]: [f64; 2], stanford: &Stanford) {
    let bold = Font::new(14.0, palette::INK).bold();
    picture.text(
        [left, top + 4.0],
        "Stanford diagram: truth, pose-set and success set",
        &bold,
    );
    let upper = top + 26.0 + STRIP;
    let bottom = upper + SIDE;
    let at = |error: f64, level: f64| {
        [
            left + SIDE * error / STANFORD_END,
            bottom - SIDE * level / STANFORD_END,
        ]
    };
    let region = |corners: &[[f64; 2]], style: &Style, picture: &mut Picture| {
        let corners: std::vec::Vec<[f64; 2]> = corners.iter().map(|[x, y]| at(*x, *y)).collect();
        picture.path(&(points_path(&corners) + "z"), style);
    };
    let end = STANFORD_END;
    let (origin, one) = ([0.0, 0.0], [1.0, 1.0]);
    region(&[origin, one, [0.0, 1.0]], &NOMINAL, picture);
    region(&[origin, one, [1.0, 0.0]], &MISLEADING, picture);
    region(
        &[[1.0, 0.0], one, [end, 1.0], [end, 0.0]],
        &HAZARDOUS,
        picture,
    );
    region(
        &[[0.0, 1.0], one, [end, end], [0.0, end]],
        &UNAVAILABLE,
        picture,
    );
    region(&[one, [end, 1.0], [end, end]], &BOTH, picture);
    cells(picture, [left, bottom], stanford);
    for (from, to) in [
        (origin, [end, end]),
        ([0.0, 1.0], [end, 1.0]),
        ([1.0, 0.0], one),
    ] {
        picture.line(&[at(from[0], from[1]), at(to[0], to[1])], &LINE);
    }
    let frame = Style::outlined(palette::FRAME, 1.0);
    picture.rectangle([left, upper, SIDE, SIDE], &frame);
    picture.rectangle([left, upper - STRIP, SIDE + STRIP, SIDE + STRIP], &frame);
    axes(picture, [left, bottom]);
    words(picture, [left + SIDE + STRIP + 22.0, upper], stanford);
}

/// Draws the cells that have points: the more points, the darker, on a logarithmic scale.
fn cells(picture: &mut Picture, [left, bottom]: [f64; 2], stanford: &Stanford) {
    let most = stanford.steps().map(|(_, _, count)| count).max();
    let most = libm::log(most.unwrap_or(1) as f64 + 1.0);
    let size = SIDE / STANFORD_STEPS as f64;
    for (column, row, count) in stanford.steps() {
        let wide = if column == STANFORD_STEPS {
            STRIP
        } else {
            size
        };
        let high = if row == STANFORD_STEPS { STRIP } else { size };
        let (x, y) = (
            left + column as f64 * size,
            bottom - row as f64 * size - high,
        );
        let dark = 0.2 + 0.8 * libm::log(count as f64 + 1.0) / most;
        let style = Style::filled(CELL).with_fill_opacity(CELL, dark);
        picture.rectangle([x, y, wide, high], &style);
    }
}

fn axes(picture: &mut Picture, [left, bottom]: [f64; 2]) {
    let small = Font::new(11.0, palette::INK);
    let (middle, end) = (small.anchored(Anchor::Middle), small.anchored(Anchor::End));
    for value in [0.0, 0.5, 1.0, 1.5, 2.0] {
        let along = SIDE * value / STANFORD_END;
        picture.text([left + along, bottom + 16.0], &number(value), &middle);
        picture.text([left - 6.0, bottom - along + 4.0], &number(value), &end);
    }
    picture.text([left + SIDE + 0.5 * STRIP, bottom + 16.0], "more", &middle);
    picture.text([left - 6.0, bottom - SIDE - 3.0], "more", &end);
    picture.text(
        [left + 0.5 * SIDE, bottom + 34.0],
        "error / alert limit: the scale at which the pose-set meets the truth, over the margin",
        &middle,
    );
    picture.text_turned(
        [left - 46.0, bottom - 0.5 * SIDE],
        -90.0,
        "protection level / alert limit: 1 / margin",
        &middle,
    );
}

fn words(picture: &mut Picture, [left, top]: [f64; 2], stanford: &Stanford) {
    let font = Font::new(12.0, palette::INK);
    let all = stanford.points().max(1) as f64;
    let lines = [
        (NOMINAL, "permitted, truth in the set", Region::Nominal),
        (MISLEADING, "permitted, misleading", Region::Misleading),
        (HAZARDOUS, "permitted, hazardous", Region::Hazardous),
        (UNAVAILABLE, "denied, truth in the set", Region::Unavailable),
        (BOTH, "denied, misleading", Region::UnavailableMisleading),
    ];
    let mut y = top + 6.0;
    for (style, name, region) in lines {
        let count = stanford.region(region);
        let outlined = style.with_outline(palette::FRAME, 0.8);
        picture.rectangle([left, y - 10.0, 16.0, 12.0], &outlined);
        picture.text([left + 22.0, y], name, &font);
        let share = format!("{count} ({:.2} %)", 100.0 * count as f64 / all);
        picture.text([left + 22.0, y + 15.0], &share, &font);
        y += 40.0;
    }
    if stanford.left_out() > 0 {
        let faint = Font::new(11.0, palette::FAINT);
        let left_out = format!("{} without a set", stanford.left_out());
        picture.text([left, y + 4.0], &left_out, &faint);
    }
}
