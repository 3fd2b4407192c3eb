//! One tag on a mounting sheet: its planned pose, its image, and a table for the measured values.

use super::elevation::{elevation, from_above, front_view};
use super::place::OnWall;
use super::{Mounted, SIDES};
use crate::draw::letters::literal;
use crate::draw::measure::fitted;
use crate::draw::palette;
use crate::draw::panel::signed;
use crate::draw::svg::{Anchor, Font, Picture, Style};
use crate::draw::tag_image::bits;
use posegate::shape::{Family, Wall};

/// Height of a line of text, pixels.
const LINE: f64 = 21.0;
/// Column of the values.
const VALUES: f64 = SIDES[0] + 84.0;
/// Where the column of the image begins.
const IMAGE_COLUMN: f64 = 584.0;
/// Edge of the image with its white border, pixels.
const IMAGE: f64 = 150.0;
const BOX: Style = Style::outlined(palette::FRAME, 1.0);

/// Draws the block of a tag below a height.
pub(super) fn draw(picture: &mut Picture, top: f64, mounted: &Mounted, walls: &[Wall]) {
    let on = OnWall::of(&mounted.tag.pose, walls);
    let name = literal(&mounted.name);
    let heading = format!("{name}: {} id {}", literal(&mounted.family), mounted.tag.id);
    let heading = fitted(&heading, 16.0, true, 520.0);
    let bold = Font::new(16.0, palette::INK).bold();
    picture.text([SIDES[0], top + 12.0], &heading, &bold);
    let label = Font::new(12.0, palette::FAINT);
    let value = Font::new(13.0, palette::INK);
    for (row, (what, text)) in lines(mounted, on.as_ref()).into_iter().enumerate() {
        let y = top + 40.0 + LINE * row as f64;
        picture.text([SIDES[0], y], what, &label);
        let text = fitted(&text, 13.0, false, IMAGE_COLUMN - 14.0 - VALUES);
        picture.text([VALUES, y], &text, &value);
    }
    image(picture, [IMAGE_COLUMN + 10.0, top + 22.0], mounted);
    let has_reserve = mounted.reserve.is_some();
    measured(
        picture,
        top + 232.0,
        &planned(mounted, on.as_ref()),
        has_reserve,
    );
    ticks(picture, [IMAGE_COLUMN, top + 232.0], on.is_some());
    let drawing = top + 350.0;
    match &on {
        Some(on) => elevation(picture, [SIDES[0] + 16.0, drawing], on, mounted),
        None => front_view(picture, [SIDES[0] + 16.0, drawing], mounted),
    }
    from_above(picture, [IMAGE_COLUMN + 16.0, drawing], &mounted.tag);
}

fn degrees(value: f64) -> String {
    // Avoids a minus sign before zero.
    signed(libm::round(value * 10.0) / 10.0)
}

fn metres(value: f64) -> String {
    let text = format!("{value:.3}").replace('-', "\u{2212}");
    if text == "\u{2212}0.000" {
        "0.000".into()
    } else {
        text
    }
}

/// Returns the instructions for the installer: the subject and the text of each line.
fn lines(mounted: &Mounted, on: Option<&OnWall>) -> Vec<(&'static str, String)> {
    let pose = mounted.tag.pose;
    let mut lines = Vec::new();
    match on {
        Some(on) => {
            let [x, y] = on.ends[0].map(metres);
            let wall = format!(
                "{}, this face is {} m long",
                literal(&on.wall),
                metres(on.length)
            );
            lines.push(("wall", wall));
            lines.push((
                "along it",
                format!("{} m from corner A, the left end", metres(on.along)),
            ));
            lines.push((
                "corner A",
                format!("at x {x} m, y {y} m in the site's frame"),
            ));
        }
        None => {
            lines.push(("wall", "none: on a stand of its own".into()));
            let [x, y] = [pose.x, pose.y].map(metres);
            lines.push(("along it", format!("x {x} m, y {y} m in the site's frame")));
        }
    }
    lines.push(("height", format!("{} m above the floor", metres(pose.z))));
    let upright = if pose.roll_deg == 0.0 && pose.pitch_deg == 0.0 {
        "upright".to_owned()
    } else {
        format!(
            "roll {}°, pitch {}°",
            degrees(pose.roll_deg),
            degrees(pose.pitch_deg)
        )
    };
    let turn = match on {
        Some(on) if on.turn_deg.abs() < 0.05 => format!("flat on the wall, {upright}"),
        Some(on) => format!("{}° from flat on the wall, {upright}", degrees(on.turn_deg)),
        None => upright,
    };
    let yaw = degrees(pose.yaw_deg);
    lines.push(("turn", format!("{turn}; its face looks to yaw {yaw}°")));
    let size = mounted.tag.size;
    let whole = size * Family::whole_of(&mounted.family);
    lines.push((
        "print it",
        format!(
            "size {:.0} mm over the border that is measured, {:.0} mm in all",
            size * 1e3,
            whole * 1e3
        ),
    ));
    lines.push((
        "reserve",
        match mounted.reserve {
            Some(reserve) if !reserve.is_none() => format!(
                "it may be off by {:.0} mm and {}°",
                // Rounded down: the installer may rely on it.
                libm::floor(reserve.translation * 1e3 + 1e-6),
                reserve.turn_deg
            ),
            Some(_) => "mount it exactly: nothing is allowed for errors".into(),
            None => "unknown: survey it after mounting".into(),
        },
    ));
    if let Some(left) = mounted.left {
        lines.push((
            "beyond it",
            format!(
                "still seen if it is {:.0} mm and {:.1}° more off,",
                libm::floor(left * 10.0),
                libm::floor(left * 10.0) / 10.0
            ),
        ));
        lines.push(("", "but every pose that it gives is then as far off".into()));
    }
    lines
}

/// Draws the tag as it is printed, its number below it.
fn image(picture: &mut Picture, [left, top]: [f64; 2], mounted: &Mounted) {
    let caption = Font::new(11.0, palette::FAINT).anchored(Anchor::Middle);
    let middle = left + 0.5 * IMAGE;
    picture.text([middle, top - 8.0], "\u{2191} this edge up", &caption);
    let frame = [left, top, IMAGE, IMAGE];
    let white = Style::filled("#ffffff").with_outline(palette::FRAME, 1.0);
    picture.rectangle(frame, &white);
    match bits(&mounted.family, mounted.tag.id) {
        Some(bits) => {
            // One cell of white border and one of black around the bits.
            let cell = IMAGE / (bits.len() as f64 + 4.0);
            let black = bits.len() as f64 + 2.0;
            picture.rectangle(
                [left + cell, top + cell, black * cell, black * cell],
                &Style::filled("#000000"),
            );
            for (row, line) in bits.iter().enumerate() {
                for (column, _) in line.iter().enumerate().filter(|(_, white)| **white) {
                    let at = |index: usize| (index as f64 + 2.0) * cell;
                    // Slightly larger, so that no seam shows between white cells.
                    let square = [left + at(column), top + at(row), cell + 0.2, cell + 0.2];
                    picture.rectangle(square, &Style::filled("#ffffff"));
                }
            }
        }
        None => {
            let lines = [
                "the image of this",
                "family is not known:",
                "print it with its tools",
            ];
            for (row, line) in lines.into_iter().enumerate() {
                let y = top + 0.5 * IMAGE - 12.0 + 16.0 * row as f64;
                picture.text([middle, y], line, &caption);
            }
        }
    }
    let under = format!("{} id {}", literal(&mounted.family), mounted.tag.id);
    let under = fitted(&under, 13.0, true, 758.0 - left);
    let font = Font::new(13.0, palette::INK)
        .bold()
        .anchored(Anchor::Middle);
    picture.text([middle, top + IMAGE + 18.0], &under, &font);
}

/// A quantity that is measured after mounting: its name, its planned value and its unit.
type Quantity = (&'static str, String, &'static str);

/// Returns what is measured after mounting.
fn planned(mounted: &Mounted, on: Option<&OnWall>) -> Vec<Quantity> {
    let pose = mounted.tag.pose;
    let mut rows = match on {
        Some(on) => vec![("from corner A", metres(on.along), " m")],
        None => vec![("x", metres(pose.x), " m"), ("y", metres(pose.y), " m")],
    };
    rows.push(("height", metres(pose.z), " m"));
    rows.push(match on {
        Some(on) => ("turn from flat", degrees(on.turn_deg), "°"),
        None => ("yaw", degrees(pose.yaw_deg), "°"),
    });
    rows
}

/// Draws the table for measured values. Without a known reserve there is nothing to tick.
fn measured(picture: &mut Picture, top: f64, rows: &[Quantity], has_reserve: bool) {
    let columns = [SIDES[0], 170.0, 280.0, 430.0];
    let head = Font::new(11.0, palette::FAINT);
    let titles = ["measure", "planned", "measured", "within the reserve"];
    let count = if has_reserve { 4 } else { 3 };
    for (x, title) in columns.into_iter().zip(titles).take(count) {
        picture.text([x, top], title, &head);
    }
    let font = Font::new(13.0, palette::INK);
    let faint = Font::new(12.0, palette::FAINT).anchored(Anchor::End);
    for (row, (what, value, unit)) in rows.iter().enumerate() {
        let y = top + 8.0 + 25.0 * row as f64;
        picture.text([columns[0], y + 15.0], what, &font);
        picture.text([columns[1], y + 15.0], &format!("{value}{unit}"), &font);
        picture.rectangle([columns[2], y, 130.0, 20.0], &BOX);
        // In the box, so that nobody writes centimetres.
        picture.text([columns[2] + 124.0, y + 15.0], unit.trim_start(), &faint);
        if has_reserve {
            picture.rectangle([columns[3], y + 3.0, 14.0, 14.0], &BOX);
        }
    }
}

/// Draws the boxes to tick.
fn ticks(picture: &mut Picture, [left, top]: [f64; 2], flat: bool) {
    let head = Font::new(11.0, palette::FAINT);
    picture.text([left, top], "tick when it is so", &head);
    let flat = if flat {
        "flat on the wall"
    } else {
        "stand does not move"
    };
    let font = Font::new(12.0, palette::INK);
    for (row, text) in ["right number", "this edge up", flat, "name and date:"]
        .into_iter()
        .enumerate()
    {
        let y = top + 8.0 + 22.0 * row as f64;
        if row < 3 {
            picture.rectangle([left, y + 2.0, 14.0, 14.0], &BOX);
        }
        let x = if row < 3 { left + 22.0 } else { left };
        picture.text([x, y + 14.0], text, &font);
    }
    let y = top + 8.0 + 22.0 * 3.0 + 16.0;
    picture.line(&[[left + 106.0, y], [SIDES[1], y]], &BOX);
}
