//! Things on a floor plan: walls, tags, cameras, robots.

use super::ingredients::{Eye, axes, frame};
use super::palette;
use super::panel::{Inside, Window};
use super::section::border;
use super::svg::{Anchor, Font, Style};
use posegate::shape::{PoseDeg, Tag, Visibility, Wall};

impl Inside<'_> {
    /// Draws a wall as a thick line, and a block as a hatched area.
    pub fn wall(&mut self, wall: &Wall) {
        if let [from, to] = wall.corners.as_slice() {
            self.line(&[*from, *to], &palette::WALL.with_outline("#444444", 3.5));
        } else {
            self.hatched(&wall.corners, &palette::WALL);
        }
    }

    /// Draws a tag's edge from above, with the direction of its face.
    pub fn tag(&mut self, tag: &Tag) {
        let [normal, across, _] = axes(&tag.pose);
        let (x, y, half) = (tag.pose.x, tag.pose.y, 0.5 * tag.size);
        let end = |way: f64| [x + way * half * across[0], y + way * half * across[1]];
        self.line(&[end(-1.0), end(1.0)], &palette::TAG);
        let mut tip = [x, y];
        self.in_pixels(|_, panel| {
            let length = (30.0 / panel.scale).max(0.6 * tag.size);
            tip = [x + length * normal[0], y + length * normal[1]];
        });
        self.arrow([x, y], tip, &Style::outlined(palette::INK, 1.6));
    }

    /// Draws a pose as a dot and an arrow forward.
    pub fn pose(&mut self, pose: PoseDeg, style: &Style) {
        let yaw = pose.yaw_deg.to_radians();
        let from = [pose.x, pose.y];
        let mut tip = from;
        self.in_pixels(|_, panel| {
            let length = 26.0 / panel.scale;
            tip = [
                pose.x + length * libm::cos(yaw),
                pose.y + length * libm::sin(yaw),
            ];
        });
        self.disc(from, 0.0, &Style::filled(palette::INK));
        self.arrow(from, tip, style);
    }

    /// Draws a robot's outline at a pose: m, m, rad.
    pub fn robot(&mut self, outline: &[[f64; 2]], pose: [f64; 3]) {
        let place = frame(pose);
        let corners: Vec<_> = outline.iter().map(|p| place.to_goal(*p)).collect();
        if corners.len() > 1 {
            self.polygons(&[corners], &palette::BODY);
        }
    }

    /// Draws a name some pixels from a point of the floor, moved so that all of it is in the panel.
    pub fn name(&mut self, at: [f64; 2], [dx, dy]: [f64; 2], text: &str) {
        self.in_pixels(|picture, panel| {
            let width = 6.4 * text.chars().count() as f64;
            let [x, y] = panel.at(at);
            let within = |v: f64, lo: f64, hi: f64| v.min(hi).max(lo);
            let left = panel.left + 3.0;
            let x = within(x + dx, left, (left + panel.width() - width - 6.0).max(left));
            let y = within(y + dy, panel.top + 13.0, panel.bottom() - 4.0);
            let ground = Style::filled("none").with_fill_opacity("#ffffff", 0.8);
            picture.rectangle([x - 2.0, y - 10.5, width + 2.0, 14.0], &ground);
            let font = Font::new(11.0, palette::INK).bold();
            picture.text([x, y], text, &font.anchored(Anchor::Start));
        });
    }
}

/// Returns polygons of the floor that a camera sees at the height of its tag, up to the largest distance of
/// the tag. The view of a lens ends at its window.
#[must_use]
pub fn seen(
    view: &Visibility,
    robot: [f64; 3],
    window: &Window,
    spacing: f64,
) -> Vec<Vec<[f64; 2]>> {
    let eye = Eye::of(&view.mount, robot);
    let planes = view.camera.view();
    let z = view.tag.pose.z;
    let inside = |[x, y]: [f64; 2]| {
        let [depth, left, up] = eye.sees([x, y, z]);
        let far = depth * depth + left * left + up * up;
        depth > 0.0
            && far <= view.d_max * view.d_max
            && planes.contains([-left / depth, -up / depth])
    };
    border(&inside, window, spacing)
}
