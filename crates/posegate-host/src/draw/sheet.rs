//! A mounting sheet: one drawing per tag, for the person who mounts the tags.

use super::ingredients::axes;
use super::palette;
use super::svg::{Anchor, Font, Picture, Style, literal};
use posegate::shape::{Family, Tag, Tolerance};

/// A tag that is to be mounted.
#[derive(Clone, Debug, PartialEq)]
pub struct Mounted {
    /// Its name in the site file.
    pub name: String,
    /// Its family, `tag36h11`.
    pub family: String,
    /// Its number, size and pose.
    pub tag: Tag,
    /// Installation error for which the tasks are proven; `None` if none is known.
    pub reserve: Option<Tolerance>,
    /// What is left beyond the reserve, in centimetres and degrees; `None` if it is not known.
    pub left: Option<f64>,
    /// The wall or object that carries it.
    pub on: String,
}

const ROW: f64 = 236.0;
const TOP: f64 = 64.0;

/// Draws the sheet.
#[must_use]
pub fn mounting_sheet(title: &str, tags: &[Mounted]) -> String {
    let mut picture = Picture::new(980.0, TOP + ROW * tags.len() as f64 + 40.0, title);
    picture.text([24.0, 36.0], title, &Font::new(19.0, palette::INK).bold());
    for (number, mounted) in tags.iter().enumerate() {
        let top = TOP + ROW * number as f64;
        picture.line(
            &[[24.0, top], [956.0, top]],
            &Style::outlined(palette::FRAME, 1.0),
        );
        words(&mut picture, [24.0, top + 28.0], mounted);
        face(&mut picture, [400.0, top + 20.0], mounted);
        above(&mut picture, [700.0, top + 20.0], &mounted.tag);
    }
    let foot = TOP + ROW * tags.len() as f64 + 24.0;
    let note = "Sizes are those of the black border's outer edge. Places are of the tag's middle, in the site's frame: x, y on the floor, z above it; yaw is where the face looks.";
    picture.text([24.0, foot], note, &Font::new(11.0, palette::FAINT));
    picture.finish()
}

fn words(picture: &mut Picture, [left, top]: [f64; 2], mounted: &Mounted) {
    let Tag { id, size, pose } = mounted.tag;
    let heading = format!(
        "{}: {} id {id}",
        literal(&mounted.name),
        literal(&mounted.family)
    );
    picture.text([left, top], &heading, &Font::new(15.0, palette::INK).bold());
    let mut lines: Vec<String> = std::vec![
        format!(
            "size {:.0} mm (with white border {:.0} mm)",
            size * 1e3,
            size * Family::whole_of(&mounted.family) * 1e3
        ),
        format!("x {:.3} m,  y {:.3} m,  z {:.3} m", pose.x, pose.y, pose.z),
        format!("yaw {:.1}°", pose.yaw_deg),
    ];
    if pose.roll_deg != 0.0 || pose.pitch_deg != 0.0 {
        lines.push(format!(
            "roll {:.1}°,  pitch {:.1}°",
            pose.roll_deg, pose.pitch_deg
        ));
    }
    lines.push(format!("on {}", literal(&mounted.on)));
    lines.push(match mounted.reserve {
        Some(reserve) if !reserve.is_none() => format!(
            "may be off by {:.0} mm and {}°",
            reserve.translation * 1e3,
            reserve.turn_deg
        ),
        Some(_) => "mount it exactly: nothing is allowed for errors".into(),
        None => "survey it after mounting: no tolerance is known".into(),
    });
    if let Some(left) = mounted.left {
        lines.push(format!(
            "left beyond that: {:.0} mm and {left:.1}°",
            (left * 10.0).floor()
        ));
    }
    for (number, line) in lines.iter().enumerate() {
        picture.text(
            [left, top + 28.0 + 20.0 * number as f64],
            line,
            &Font::new(13.0, palette::INK),
        );
    }
}

const DIMENSION: Style = Style::outlined(palette::FAINT, 1.0);

/// Draws the tag's face from the front, above the floor, to scale with a height of at least 1 m.
fn face(picture: &mut Picture, [left, top]: [f64; 2], mounted: &Mounted) {
    let tag = &mounted.tag;
    let caption = Font::new(11.0, palette::FAINT);
    picture.text([left, top + 6.0], "seen from before it", &caption);
    let floor = top + 196.0;
    let z = tag.pose.z;
    let scale = 160.0 / (z + tag.size).max(1.0);
    let [middle_x, middle_y] = [left + 100.0, floor - z * scale];
    picture.line(
        &[[left, floor], [left + 220.0, floor]],
        &Style::outlined(palette::INK, 1.6),
    );
    picture.text([left + 222.0, floor + 4.0], "floor", &caption);
    let square = |edge: f64| {
        [
            middle_x - 0.5 * edge * scale,
            middle_y - 0.5 * edge * scale,
            edge * scale,
            edge * scale,
        ]
    };
    picture.rectangle(
        square(tag.size * Family::whole_of(&mounted.family)),
        &Style::filled("#ffffff").with_outline(palette::FRAME, 1.0),
    );
    picture.rectangle(square(tag.size), &Style::filled("#222222"));
    picture.rectangle(square(0.75 * tag.size), &Style::filled("#bbbbbb"));
    let beside = left + 190.0;
    picture.arrow([beside, floor], [beside, middle_y], &DIMENSION);
    picture.line(
        &[[middle_x, middle_y], [beside, middle_y]],
        &DIMENSION.dashed("3 3"),
    );
    picture.text(
        [beside + 6.0, 0.5 * (floor + middle_y) + 4.0],
        &format!("{z:.3} m"),
        &Font::new(12.0, palette::INK),
    );
}

/// Draws the tag from above, with the site's axes.
fn above(picture: &mut Picture, [left, top]: [f64; 2], tag: &Tag) {
    let caption = Font::new(11.0, palette::FAINT);
    picture.text([left, top + 6.0], "from above", &caption);
    let [normal, across, _] = axes(&tag.pose);
    let [x, y] = [left + 110.0, top + 108.0];
    let at = |along: f64, beside: f64| {
        [
            x + along * normal[0] + beside * across[0],
            y - along * normal[1] - beside * across[1],
        ]
    };
    picture.line(&[at(0.0, -34.0), at(0.0, 34.0)], &palette::TAG);
    picture.arrow(
        at(0.0, 0.0),
        at(56.0, 0.0),
        &Style::outlined(palette::INK, 1.8),
    );
    let label = Font::new(12.0, palette::INK).anchored(Anchor::Middle);
    let [lx, ly] = at(88.0, 0.0);
    picture.text([lx, ly + 4.0], &format!("{:.1}°", tag.pose.yaw_deg), &label);
    let origin = [left + 6.0, top + 190.0];
    for (tip, name) in [
        ([origin[0] + 40.0, origin[1]], "x"),
        ([origin[0], origin[1] - 40.0], "y"),
    ] {
        picture.arrow(origin, tip, &DIMENSION);
        picture.text([tip[0] + 4.0, tip[1] + 4.0], name, &caption);
    }
    picture.text(
        [x, y + 84.0],
        &format!("({:.3}, {:.3})", tag.pose.x, tag.pose.y),
        &label,
    );
}
