//! The parts of Fig. 1 about errors of the car's pose: along, across and in heading, each alone. A further panel
//! shows all three: yaw over x, with y as the colour.

use posegate::shape::{Footprint, Planar, SuccessSet};
use posegate_show::draw::palette;
use posegate_show::draw::scene::{
    Anchor, Font, Inside, Panel, Picture, Style, Window, border, number,
};
use posegate_show::draw::study::PoseSetSpec;

/// An error: its name, its pose at size 1 (m, m, rad), the largest size that is tried, and its notation.
struct PoseError {
    name: &'static str,
    unit: [f64; 3],
    most: f64,
}

const ERRORS: [PoseError; 3] = [
    PoseError {
        name: "(a) error along x",
        unit: [1.0, 0.0, 0.0],
        most: 1.0,
    },
    PoseError {
        name: "(b) error across, y",
        unit: [0.0, 1.0, 0.0],
        most: 1.0,
    },
    PoseError {
        name: "(c) error in yaw",
        unit: [0.0, 0.0, 1.0],
        most: 0.6,
    },
];

/// The ratio of the error of a car that sticks out to the largest error that fits.
const TOO_FAR: f64 = 1.5;
const FITS: Style = Style::outlined(palette::INK, 1.8);
const STICKS_OUT: Style = Style::outlined(palette::NO, 1.8).dashed("7 4");

/// Returns `true` if a pose of the goal frame (m, m, rad) is in the set. The goal of Fig. 1 is the origin.
fn holds(set: &SuccessSet, pose: [f64; 3]) -> bool {
    set.membership(pose).inside
}

/// Returns the largest error that is in the set, by halving.
fn largest(most: f64, holds: impl Fn(f64) -> bool) -> f64 {
    let (mut low, mut high) = (0.0, most);
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if holds(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    low
}

/// Draws one panel per error, in a row below `top`.
pub(super) fn single_errors(picture: &mut Picture, top: f64, set: &SuccessSet, shape: &Footprint) {
    for (index, error) in ERRORS.iter().enumerate() {
        let at = |size: f64| error.unit.map(|v| v * size);
        let fits = largest(error.most, |size| holds(set, at(size)));
        let panel = Panel {
            window: Window {
                x: [-3.2, 3.2],
                y: [-2.0, 2.0],
            },
            left: 66.0 + 366.0 * index as f64,
            top,
            scale: 50.0,
            y_title: index == 0,
        };
        panel.draw(picture, error.name, 1.0, |inside| {
            let ground = Style::outlined(palette::INK, 2.5).with_fill_opacity("#f3f0e6", 1.0);
            inside.polygons(&[shape.region().to_vec()], &ground);
            inside.polygons(&[outline_at(shape, [0.0; 3])], &palette::BODY);
            inside.polygons(&[outline_at(shape, at(fits))], &FITS);
            inside.polygons(&[outline_at(shape, at(TOO_FAR * fits))], &STICKS_OUT);
        });
        let size_text = |size: f64| {
            if error.unit[2] > 0.0 {
                format!("{}°", number(size.to_degrees()))
            } else {
                format!("{} m", number(size))
            }
        };
        let text = format!(
            "fits up to {}; dashed: off by {}, sticks out",
            size_text(fits),
            size_text(TOO_FAR * fits)
        );
        let below = [panel.left, panel.bottom() + 50.0];
        picture.text(below, &text, &Font::new(12.0, palette::INK));
    }
}

/// Returns the car's outline at a pose of the goal frame: m, m, rad.
pub(super) fn outline_at(shape: &Footprint, [x, y, yaw]: [f64; 3]) -> Vec<[f64; 2]> {
    let pose = Planar {
        x,
        y,
        cos: libm::cos(yaw),
        sin: libm::sin(yaw),
    };
    let corners = shape.footprint().iter();
    corners.map(|corner| pose.to_goal(*corner)).collect()
}

/// Limits of y, metres, and the colour of the poses at which y may be off this far: darker for larger limits, with a
/// number.
const ALLOWED: [(f64, &str); 4] = [
    (0.0, "#fde3dd"),
    (0.2, "#f6b0a4"),
    (0.4, "#e88578"),
    (0.6, "#cf4a40"),
];

/// Draws S with yaw over x; the colour shows the largest error of y. The point is the upper left corner of the panel.
pub(super) fn yaw_over_x(
    picture: &mut Picture,
    [left, top]: [f64; 2],
    set: &SuccessSet,
    known: &[PoseSetSpec],
) {
    let panel = Panel {
        window: Window {
            x: [-0.4, 0.4],
            y: [-0.36, 0.36],
        },
        left,
        top,
        scale: 430.0,
        y_title: true,
    };
    let allows = |x: f64, yaw: f64, y: f64| holds(set, [x, y, yaw]) && holds(set, [x, -y, yaw]);
    let title = "(d) S, yaw over x; colour: how far y may be off";
    panel.draw_named(picture, title, 0.1, ["x (m)", "yaw (rad)"], |inside| {
        for (y, colour) in ALLOWED {
            let area = border(&|[x, yaw]| allows(x, yaw, y), &panel.window, 0.004);
            let style = Style::filled(colour).with_outline("#b3001b", 1.2);
            inside.polygons(&area, &style);
        }
        for spec in known {
            bounds(inside, spec);
        }
        for (y, _) in ALLOWED {
            let high = largest(0.6, |yaw| allows(0.0, yaw, y));
            inside.label(
                [0.0, high],
                [-16.0, 14.0],
                &format!("{y} m"),
                36.0,
                palette::INK,
            );
        }
    });
    // y has no axis here: its scale is the row of colours below.
    for (index, (y, colour)) in ALLOWED.into_iter().enumerate() {
        let at = [left + 86.0 * index as f64, panel.bottom() + 44.0];
        let patch = Style::filled(colour).with_outline("#b3001b", 1.2);
        picture.rectangle([at[0], at[1], 18.0, 12.0], &patch);
        let font = Font::new(12.0, palette::INK).anchored(Anchor::Start);
        let text = if index == 0 {
            "y (m): 0".to_owned()
        } else {
            format!("{y} m")
        };
        picture.text([at[0] + 24.0, at[1] + 10.0], &text, &font);
    }
}

/// Draws the bounds of a pose-set in x and yaw.
fn bounds(inside: &mut Inside<'_>, spec: &PoseSetSpec) {
    if let PoseSetSpec::Bounded {
        translation,
        yaw_deg,
    } = spec
    {
        let (x, yaw) = (*translation, yaw_deg.to_radians());
        let rectangle = std::vec![[-x, -yaw], [x, -yaw], [x, yaw], [-x, yaw]];
        inside.polygons(&[rectangle], &palette::PAPER_SET);
    }
}
