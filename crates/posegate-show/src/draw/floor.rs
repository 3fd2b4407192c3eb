//! Things on a floor plan: walls, tags, cameras, robots.

use super::ingredients::{Eye, ahead, axes, frame, radians};
use super::measure::{fitted, text_width};
use super::palette;
use super::panel::{Inside, Panel, Window};
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
        for part in kept_out(wall) {
            self.line(&part, &palette::KEPT_OUT);
        }
    }

    /// Draws a tag's edge from above, with the direction of its face.
    pub fn tag(&mut self, tag: &Tag) {
        self.tag_with_arrow(tag, None);
    }

    /// Draws a tag's edge from above, with the direction of its face as an arrow of at most some pixels.
    pub fn tag_with_arrow(&mut self, tag: &Tag, longest: Option<f64>) {
        let [normal, across, _] = axes(&tag.pose);
        let (x, y, half) = (tag.pose.x, tag.pose.y, 0.5 * tag.size);
        let end = |way: f64| [x + way * half * across[0], y + way * half * across[1]];
        self.line(&[end(-1.0), end(1.0)], &palette::TAG);
        let longest = longest.map_or(f64::INFINITY, |pixels| pixels / self.scale());
        let length = (30.0 / self.scale()).max(0.6 * tag.size).min(longest);
        let tip = [x + length * normal[0], y + length * normal[1]];
        self.arrow([x, y], tip, &Style::outlined(palette::INK, 1.6));
    }

    /// Draws a pose as a dot and an arrow forward.
    pub fn pose(&mut self, pose: PoseDeg, style: &Style) {
        self.pose_with_arrow(pose, 26.0, style);
    }

    /// Draws a pose as a dot and an arrow forward with a length in pixels.
    pub fn pose_with_arrow(&mut self, pose: PoseDeg, length: f64, style: &Style) {
        let from = [pose.x, pose.y];
        let tip = ahead(radians(pose), length / self.scale());
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

    /// Draws a name some pixels from a point of the floor, moved into the panel.
    pub fn name(&mut self, at: [f64; 2], [dx, dy]: [f64; 2], text: &str) {
        self.in_pixels(|picture, panel| {
            let width = 6.4 * text.chars().count() as f64;
            let [x, y] = panel.at(at);
            let [x, y] = text_within(panel, [x + dx, y + dy], width, 3.0);
            let ground = Style::filled("none").with_fill_opacity("#ffffff", 0.8);
            picture.rectangle([x - 2.0, y - 10.5, width + 2.0, 14.0], &ground);
            let font = Font::new(11.0, palette::INK).bold();
            picture.text([x, y], text, &font.anchored(Anchor::Start));
        });
    }
}

/// Returns the place of a text in a panel that is nearest to a point, `margin` pixels from the sides of the panel.
fn text_within(panel: &Panel, [x, y]: [f64; 2], width: f64, margin: f64) -> [f64; 2] {
    let within = |v: f64, lo: f64, hi: f64| v.min(hi).max(lo);
    let left = panel.left + margin;
    let right = panel.left + panel.width() - width - margin;
    [
        within(x, left, right.max(left)),
        within(y, panel.top + 13.0, panel.bottom() - 4.0),
    ]
}

/// Returns the parts of a wall's outline where no tag may be mounted at some height: lines in the world, metres.
fn kept_out(wall: &Wall) -> Vec<[[f64; 2]; 2]> {
    let count = wall.corners.len();
    let edges = if count == 2 { 1 } else { count };
    let mut parts = Vec::new();
    let mut walked = 0.0;
    for (index, from) in wall.corners.iter().enumerate().take(edges) {
        let to = wall.corners[(index + 1) % count];
        let length = libm::hypot(to[0] - from[0], to[1] - from[1]);
        let at = |s: f64| {
            let t = ((s - walked) / length).clamp(0.0, 1.0);
            [0, 1].map(|axis| from[axis] + t * (to[axis] - from[axis]))
        };
        for [[begin, end], _] in &wall.keep_outs {
            if *begin < walked + length && walked < *end {
                parts.push([at(*begin), at(*end)]);
            }
        }
        walked += length;
    }
    parts
}

/// Names on a floor plan that do not overlap.
#[derive(Debug, Default)]
pub struct Labels {
    /// Left, top, right, bottom in the picture, pixels, and the penalty for covering this box.
    boxes: Vec<([f64; 4], u32)>,
    /// Lines from names to the named points, pixels.
    leaders: Vec<[[f64; 2]; 2]>,
}

/// Returns the line from a point to the nearest edge of a name's box; `None` if the name is near the point.
fn leader(at: [f64; 2], [left, top, right, bottom]: [f64; 4]) -> Option<[[f64; 2]; 2]> {
    let near = [at[0].clamp(left, right), at[1].clamp(top, bottom)];
    (libm::hypot(near[0] - at[0], near[1] - at[1]) > 16.0).then_some([at, near])
}

/// Returns `true` if a line crosses a box: tests every second pixel of the line.
fn crosses([from, to]: [[f64; 2]; 2], [left, top, right, bottom]: [f64; 4]) -> bool {
    let apart = |axis: usize, low: f64, high: f64| {
        from[axis].max(to[axis]) <= low || high <= from[axis].min(to[axis])
    };
    if apart(0, left, right) || apart(1, top, bottom) {
        return false;
    }
    let length = libm::hypot(to[0] - from[0], to[1] - from[1]);
    let count = libm::ceil(0.5 * length).clamp(1.0, 1000.0) as u32;
    (0..=count).any(|k| {
        let t = f64::from(k) / f64::from(count);
        let [x, y] = [0, 1].map(|axis| from[axis] + t * (to[axis] - from[axis]));
        left < x && x < right && top < y && y < bottom
    })
}

impl Labels {
    const SIZE: f64 = 11.0;
    /// Penalties for covering a name, and a part of the drawing.
    const NAME: u32 = 1000;
    const DRAWN: u32 = 1;

    /// Reserves the pixels about a point of the floor, so that names avoid them.
    pub fn avoid(&mut self, inside: &mut Inside<'_>, at: [f64; 2], reach: f64) {
        inside.in_pixels(|_, panel| {
            let [x, y] = panel.at(at);
            let about = [x - reach, y - reach, x + reach, y + reach];
            self.boxes.push((about, Self::DRAWN));
        });
    }

    /// Draws a name near a point of the floor, at the first of several places where it overlaps no other name, or at
    /// the first place if there is no such place.
    pub fn place(&mut self, inside: &mut Inside<'_>, at: [f64; 2], text: &str) {
        inside.in_pixels(|picture, panel| {
            let text = fitted(text, Self::SIZE, true, panel.width() - 8.0);
            let wide = text_width(&text, Self::SIZE, true);
            let [x, y] = panel.at(at);
            let place = |dx: f64, dy: f64| {
                let [x, y] = text_within(panel, [x + dx, y + dy], wide, 4.0);
                [x, y - 11.0, x + wide, y + 4.0]
            };
            let sides = [8.0, -8.0 - wide, -0.5 * wide, 30.0, -30.0 - wide];
            let mut offsets: Vec<[f64; 2]> = Vec::new();
            for row in 0..7 {
                let dy = 14.0 * f64::from(row);
                offsets.extend(
                    sides
                        .iter()
                        .flat_map(|dx| [[*dx, -8.0 - dy], [*dx, 18.0 + dy]]),
                );
            }
            let far = |[dx, dy]: &[f64; 2]| libm::hypot(dx + 0.5 * wide, dy - 4.0);
            offsets.sort_by(|a, b| far(a).total_cmp(&far(b)));
            let overlaps = |a: &[f64; 4]| -> u32 {
                let meets =
                    |b: &[f64; 4]| !(a[2] <= b[0] || b[2] <= a[0] || a[3] <= b[1] || b[3] <= a[1]);
                let own = leader([x, y], *a);
                let names = |bad: u32| bad == Self::NAME;
                let met = self.boxes.iter().filter(|(b, bad)| {
                    meets(b) || names(*bad) && own.is_some_and(|line| crosses(line, *b))
                });
                let under = self.leaders.iter().filter(|line| crosses(**line, *a));
                met.map(|(_, bad)| *bad).sum::<u32>() + Self::NAME * under.count() as u32
            };
            let all = offsets.into_iter().map(|[dx, dy]| place(dx, dy));
            // The first place with the least penalty. A name covers another name only at a point without a better
            // place.
            let chosen = all.min_by_key(overlaps);
            let Some([left, top, right, bottom]) = chosen else {
                return;
            };
            self.boxes.push(([left, top, right, bottom], Self::NAME));
            if let Some(line) = leader([x, y], [left, top, right, bottom]) {
                picture.line(&line, &Style::outlined(palette::FAINT, 0.8));
                self.leaders.push(line);
            }
            let ground = Style::filled("none").with_fill_opacity("#ffffff", 0.8);
            let size = [right - left, bottom - top];
            picture.rectangle([left - 1.0, top, size[0] + 1.0, size[1]], &ground);
            let font = Font::new(Self::SIZE, palette::INK).bold();
            picture.text([left, top + 11.0], &text, &font);
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draw::svg::Picture;

    #[test]
    fn keep_outs_are_measured_along_the_outline() {
        let wall = Wall {
            name: "block".into(),
            corners: vec![[0.0, 0.0], [4.0, 0.0], [4.0, 1.0], [0.0, 1.0]],
            z: [0.0, 2.0],
            keep_outs: vec![[[3.5, 4.25], [0.0, 1.0]]],
        };
        let expected = [[[3.5, 0.0], [4.0, 0.0]], [[4.0, 0.0], [4.0, 0.25]]];
        assert_eq!(kept_out(&wall), expected);
        let line = Wall {
            corners: vec![[0.0, 3.0], [18.0, 3.0]],
            keep_outs: vec![[[7.5, 10.5], [0.0, 2.5]]],
            ..wall
        };
        assert_eq!(kept_out(&line), [[[7.5, 3.0], [10.5, 3.0]]]);
    }

    /// A row of docks below a wall of tags, with drawn parts everywhere around them: a name covers these parts before
    /// it covers another name.
    #[test]
    fn names_do_not_overlap() {
        let panel = Panel {
            window: Window {
                x: [0.0, 24.0],
                y: [0.0, 12.0],
            },
            left: 66.0,
            top: 50.0,
            scale: 25.0,
            y_title: true,
        };
        let mut picture = Picture::new(700.0, 400.0, "names");
        let mut labels = Labels::default();
        panel.draw(&mut picture, "", 5.0, |inside| {
            for column in 0..240 {
                for row in 0..30 {
                    let at = [0.1 * f64::from(column), 6.0 + 0.2 * f64::from(row)];
                    labels.avoid(inside, at, 3.0);
                }
            }
            for number in 0..6 {
                let x = 3.0 + 3.0 * f64::from(number);
                labels.place(inside, [x, 9.0], &format!("dock-{number}"));
                labels.place(
                    inside,
                    [x + 0.7, 10.0],
                    &format!("north-{number}, id {number}"),
                );
            }
        });
        let names = labels.boxes.iter().filter(|(_, bad)| *bad == Labels::NAME);
        let names: Vec<&[f64; 4]> = names.map(|(name, _)| name).collect();
        assert_eq!(names.len(), 12);
        for (number, a) in names.iter().enumerate() {
            for b in &names[number + 1..] {
                assert!(
                    a[2] <= b[0] || b[2] <= a[0] || a[3] <= b[1] || b[3] <= a[1],
                    "{a:?} {b:?}"
                );
            }
        }
        // No leader crosses another name.
        assert!(!labels.leaders.is_empty());
        for line in &labels.leaders {
            assert!(!names.iter().any(|name| crosses(*line, **name)), "{line:?}");
        }
    }
}
