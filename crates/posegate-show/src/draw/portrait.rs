//! Draws a tag or a camera from above, from the side and from the front, with its axes.

use super::ingredients::{axes, corners, heading};
use super::palette;
use super::panel::{Panel, signed, tick_at_scale};
use super::svg::{Anchor, Font, Picture, Style, literal};
use super::task_plan::about;
use posegate::shape::{Pose3Deg, Tag};
use posegate_site::SiteCamera;

/// The edge of a panel, pixels.
const EDGE: f64 = 250.0;
const LEFT: f64 = 66.0;
const TOP: f64 = 96.0;
const PITCH: f64 = EDGE + 78.0;

const X: Style = Style::outlined("#a84300", 2.2);
const Y: Style = Style::outlined("#00694d", 2.2).dashed("7 3");
const Z: Style = Style::outlined("#0072b2", 2.2).dashed("2 2");
const AXES: [(&str, Style); 3] = [("x", X), ("y", Y), ("z", Z)];
const FACE: Style = Style::outlined(palette::INK, 2.4).with_fill_opacity("#999999", 0.25);

/// A direction of view: the directions to the right and up.
struct Side {
    title: &'static str,
    names: [&'static str; 2],
    right: [f64; 3],
    up: [f64; 3],
    /// `true` if the corners can be distinguished from here and are numbered.
    numbers: bool,
}

/// The tag or camera to draw.
struct Body {
    centre: [f64; 3],
    axes: [[f64; 3]; 3],
    /// The drawn length of the axes, metres.
    length: f64,
    face: Vec<[f64; 3]>,
}

/// Returns an SVG of a tag with its axes: x out of the face, z up; its corners in AprilTag's order.
#[must_use]
pub fn tag_portrait(name: &str, tag: &Tag) -> String {
    let pose = tag.pose;
    let body = Body {
        centre: [pose.x, pose.y, pose.z],
        axes: axes(&pose),
        length: 0.9 * tag.size,
        face: corners(tag).to_vec(),
    };
    let [faces, rises] = heading(body.axes[0]);
    let title = format!("Tag {}, id {}", literal(name), tag.id);
    let note = format!(
        "{} m wide, its centre {} m above the floor; its face (x) looks to {}°, {}° up. World axes; y is the viewer's right, z is up on the tag.",
        signed(tag.size),
        signed(pose.z),
        signed(faces),
        signed(rises)
    );
    draw(&title, &note, &body, ["x (m)", "y (m)"], "before its face")
}

/// Returns an SVG of a camera on its robot: x along the optical axis, y left, z up in the image.
#[must_use]
pub fn camera_portrait(name: &str, camera: &SiteCamera) -> String {
    let Pose3Deg { x, y, z, .. } = camera.mount;
    let own = axes(&camera.mount);
    let length = 0.3;
    let image = camera.camera;
    // The image's corners, projected a little in front of the camera by a pinhole model.
    let far = 0.5 * length;
    let at = |u: f64, v: f64| {
        let (left, up) = (
            far * (image.cx - u) / image.fx,
            far * (image.cy - v) / image.fy,
        );
        [0, 1, 2].map(|i| [x, y, z][i] + far * own[0][i] + left * own[1][i] + up * own[2][i])
    };
    let (w, h) = (image.width_px, image.height_px);
    let body = Body {
        centre: [x, y, z],
        axes: own,
        length,
        face: std::vec![at(0.0, h), at(w, h), at(w, 0.0), at(0.0, 0.0)],
    };
    let [looks, rises] = heading(own[0]);
    let title = format!("Camera {} on its robot", literal(name));
    let note = format!(
        "At ({} m, {} m, {} m) of the robot; it looks (x) to {}°, {}° up. The robot's axes: x forward, y left. Its image: 0 is the lower left corner.",
        signed(x),
        signed(y),
        signed(z),
        signed(looks),
        signed(rises)
    );
    draw(
        &title,
        &note,
        &body,
        ["x of the robot (m)", "y of the robot (m)"],
        "behind it",
    )
}

fn draw(title: &str, note: &str, body: &Body, plane: [&'static str; 2], from: &str) -> String {
    let mut picture = Picture::new(LEFT + 3.0 * PITCH - 20.0, TOP + EDGE + 60.0, title);
    picture.text([24.0, 32.0], title, &Font::new(19.0, palette::INK).bold());
    picture.text([24.0, 54.0], note, &Font::new(12.0, palette::FAINT));
    let [nx, ny, _] = body.axes[0];
    let level = libm::hypot(nx, ny);
    // A vertical direction has no heading: use any.
    let ahead = if level > 1e-6 {
        [nx / level, ny / level, 0.0]
    } else {
        [1.0, 0.0, 0.0]
    };
    let across = [-ahead[1], ahead[0], 0.0];
    let up = [0.0, 0.0, 1.0];
    let back = across.map(|c| -c);
    let upright = body.axes[0][2].abs() < 0.9;
    let is_tag = from.starts_with("before");
    let front = Side {
        title: if is_tag {
            "from the front"
        } else {
            "from behind"
        },
        names: if upright {
            ["to the viewer's right (m)", "height (m)"]
        } else {
            ["to the viewer's right (m)", "onwards (m)"]
        },
        // A viewer of a face looks in the opposite direction; a viewer from behind looks in the
        // same direction.
        right: if is_tag { across } else { back },
        up: if upright { up } else { ahead },
        numbers: true,
    };
    let sides = [
        Side {
            title: "from above",
            names: plane,
            right: [1.0, 0.0, 0.0],
            up: [0.0, 1.0, 0.0],
            numbers: false,
        },
        Side {
            title: "from the side",
            names: ["along its heading (m)", "height (m)"],
            right: ahead,
            up,
            numbers: false,
        },
        front,
    ];
    for (index, side) in sides.iter().enumerate() {
        one(&mut picture, LEFT + PITCH * index as f64, side, body);
    }
    picture.finish()
}

fn one(picture: &mut Picture, left: f64, side: &Side, body: &Body) {
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    // In the side and front views, coordinates are relative to the tag or camera.
    let is_relative = side.title != "from above";
    let centre = body.centre;
    let at = |p: [f64; 3]| {
        let offset = [p[0] - centre[0], p[1] - centre[1], p[2]];
        if is_relative {
            [dot(offset, side.right), dot(offset, side.up)]
        } else {
            [p[0], p[1]]
        }
    };
    let tip = |axis: [f64; 3]| [0, 1, 2].map(|i| centre[i] + body.length * axis[i]);
    let mut points: Vec<[f64; 2]> = body.face.iter().map(|p| at(*p)).collect();
    points.push(at(centre));
    points.extend(body.axes.iter().map(|axis| at(tip(*axis))));
    // The floor, if it is near.
    let height = side.up == [0.0, 0.0, 1.0];
    let floor = height && centre[2].abs() < 6.0 * body.length;
    if floor {
        points.push([0.0, 0.0]);
    }
    let mut window = about(&points);
    // Square, so that all three panels have the same size.
    let wide = (window.x[1] - window.x[0]).max(window.y[1] - window.y[0]);
    let square = |[lo, hi]: [f64; 2]| [0.5 * (lo + hi - wide), 0.5 * (lo + hi + wide)];
    (window.x, window.y) = (square(window.x), square(window.y));
    let panel = Panel::fitted(window, [left, TOP], [EDGE; 2]);
    let scale = panel.scale;
    let tick = tick_at_scale(scale, 46.0);
    panel.draw_named(picture, side.title, tick, side.names, |inside| {
        if floor {
            let [lo, hi] = window.x;
            let ground = [[lo, window.y[0]], [hi, window.y[0]], [hi, 0.0], [lo, 0.0]];
            if window.y[0] < 0.0 {
                inside.hatched(&ground, &Style::outlined(palette::FRAME, 0.8));
            }
            inside.name([lo, 0.0], [6.0, 16.0], "floor");
        }
        let face: Vec<_> = body.face.iter().map(|p| at(*p)).collect();
        inside.polygons(std::slice::from_ref(&face), &FACE);
        for ((name, style), axis) in AXES.iter().zip(&body.axes) {
            let (from, to) = (at(centre), at(tip(*axis)));
            let long = libm::hypot(to[0] - from[0], to[1] - from[1]);
            if long > 0.2 * body.length {
                inside.arrow(from, to, style);
                let beyond = [0, 1].map(|i| to[i] + 9.0 / scale / long * (to[i] - from[i]));
                inside.in_pixels(|picture, panel| {
                    let [x, y] = panel.at(beyond);
                    let font = Font::new(12.0, palette::INK)
                        .bold()
                        .anchored(Anchor::Middle);
                    picture.text([x, y + 4.0], name, &font);
                });
            }
        }
        if side.numbers {
            for (index, corner) in face.iter().enumerate() {
                inside.in_pixels(|picture, panel| {
                    let ([x, y], [cx, cy]) = (panel.at(*corner), panel.at(at(centre)));
                    let way = |a: f64, b: f64| if a < b { -9.0 } else { 9.0 };
                    picture.circle([x, y], 2.6, &Style::filled(palette::INK));
                    let font = Font::new(12.0, palette::INK)
                        .bold()
                        .anchored(Anchor::Middle);
                    let at = [x + way(x, cx), y + way(y, cy) + 4.0];
                    picture.text(at, &format!("{index}"), &font);
                });
            }
        }
    });
}
