//! A panel: a rectangle of the floor at equal scale in x and y, with axes in metres.

use super::letters::number;
use super::palette;
use super::svg::{Anchor, Font, Picture, Style, points_path, rectangle_path};

/// A rectangle of the floor, metres: x forward, y left.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Window {
    /// `[lo, hi]`, metres.
    pub x: [f64; 2],
    /// `[lo, hi]`, metres.
    pub y: [f64; 2],
}

impl Window {
    /// Returns a square about a point, with half its edge, metres.
    #[must_use]
    pub fn about([x, y]: [f64; 2], half: f64) -> Self {
        Self {
            x: [x - half, x + half],
            y: [y - half, y + half],
        }
    }
}

/// A rectangle of covered cells in the goal frame, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cell {
    /// `[lo, hi]`.
    pub x: [f64; 2],
    /// `[lo, hi]`.
    pub y: [f64; 2],
}

/// A window of the floor in a picture; x to the right, y up, one scale for both.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Panel {
    /// The rectangle shown.
    pub window: Window,
    /// Left edge in the picture, pixels.
    pub left: f64,
    /// Upper edge in the picture, pixels.
    pub top: f64,
    /// Pixels per metre.
    pub scale: f64,
    /// `true` if the y axis has its title; in a row of panels only the first needs it.
    pub y_title: bool,
}

impl Panel {
    /// Returns the panel of a window, with its left upper corner at a point, at the largest scale at which it is at most `largest`
    /// pixels wide and high.
    #[must_use]
    pub fn fitted(window: Window, [left, top]: [f64; 2], largest: [f64; 2]) -> Self {
        let [wide, high] = [window.x, window.y].map(|[lo, hi]| hi - lo);
        Self {
            window,
            left,
            top,
            scale: (largest[0] / wide).min(largest[1] / high),
            y_title: true,
        }
    }

    /// Returns the panel at its place in rows of some columns, which begin at this panel; `pitch` is the distance of two columns and of
    /// two rows, pixels. The first panel of a row has the title of the y axis.
    #[must_use]
    pub fn in_rows(self, number: usize, columns: usize, pitch: [f64; 2]) -> Self {
        Self {
            left: self.left + pitch[0] * (number % columns) as f64,
            top: self.top + pitch[1] * (number / columns) as f64,
            y_title: number.is_multiple_of(columns),
            ..self
        }
    }

    /// Returns the width in the picture, pixels.
    #[must_use]
    pub fn width(&self) -> f64 {
        (self.window.x[1] - self.window.x[0]) * self.scale
    }

    /// Returns the height in the picture, pixels.
    #[must_use]
    pub fn height(&self) -> f64 {
        (self.window.y[1] - self.window.y[0]) * self.scale
    }

    /// Returns the lower edge in the picture, pixels.
    #[must_use]
    pub fn bottom(&self) -> f64 {
        self.top + self.height()
    }

    /// Converts a point of the floor to the picture.
    #[must_use]
    pub fn at(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [
            self.left + (x - self.window.x[0]) * self.scale,
            self.top + (self.window.y[1] - y) * self.scale,
        ]
    }

    /// Draws the panel's content, clipped at its edges, then its frame with ticks every `tick` metres, labelled in
    /// metres, and its title.
    pub fn draw(
        &self,
        picture: &mut Picture,
        title: &str,
        tick: f64,
        content: impl FnOnce(&mut Inside<'_>),
    ) {
        self.draw_named(picture, title, tick, ["x (m)", "y (m)"], content);
    }

    /// Like [`Panel::draw`], with other names of the axes.
    pub fn draw_named(
        &self,
        picture: &mut Picture,
        title: &str,
        tick: f64,
        names: [&str; 2],
        content: impl FnOnce(&mut Inside<'_>),
    ) {
        let edges = [self.left, self.top, self.width(), self.height()];
        picture.clipped(edges, |picture| {
            content(&mut Inside {
                panel: *self,
                picture,
            });
        });
        picture.rectangle(edges, &Style::outlined(palette::FRAME, 1.0));
        let x = multiples(self.window.x, tick).map(|x| (self.at([x, 0.0])[0], signed(x)));
        let y = multiples(self.window.y, tick).map(|y| (self.at([0.0, y])[1], signed(y)));
        let y_name = if self.y_title { names[1] } else { "" };
        axes(picture, edges, x, y, [names[0], y_name]);
        let heading = Font::new(13.0, palette::INK)
            .bold()
            .anchored(Anchor::Middle);
        let middle = self.left + 0.5 * self.width();
        picture.text([middle, self.top - 7.0], title, &heading);
    }
}

/// Draws ticks with their labels below a rectangle (left, top, width, height) and to the left of it, and the names of both axes. A tick
/// has a place in the picture, pixels, and its label.
pub(super) fn axes(
    picture: &mut Picture,
    [left, top, width, height]: [f64; 4],
    x: impl Iterator<Item = (f64, String)>,
    y: impl Iterator<Item = (f64, String)>,
    names: [&str; 2],
) {
    let style = Style::outlined(palette::FRAME, 1.0);
    let label = Font::new(11.0, palette::INK);
    let (middle, end) = (label.anchored(Anchor::Middle), label.anchored(Anchor::End));
    let bottom = top + height;
    for (x, text) in x {
        picture.line(&[[x, bottom], [x, bottom + 4.0]], &style);
        picture.text([x, bottom + 16.0], &text, &middle);
    }
    for (y, text) in y {
        picture.line(&[[left - 4.0, y], [left, y]], &style);
        picture.text([left - 6.0, y + 4.0], &text, &end);
    }
    picture.text([left + 0.5 * width, bottom + 30.0], names[0], &middle);
    if !names[1].is_empty() {
        let at = [left - 40.0, top + 0.5 * height];
        picture.text_turned(at, -90.0, names[1], &middle);
    }
}

/// The inside of a panel: coordinates are metres.
pub struct Inside<'p> {
    panel: Panel,
    picture: &'p mut Picture,
}

impl Inside<'_> {
    /// Returns the scale, pixels per metre.
    #[must_use]
    pub const fn scale(&self) -> f64 {
        self.panel.scale
    }

    /// Draws polygons as one path.
    pub fn polygons(&mut self, polygons: &[Vec<[f64; 2]>], style: &Style) {
        let data: String = polygons
            .iter()
            .map(|polygon| {
                let points: Vec<_> = polygon.iter().map(|p| self.panel.at(*p)).collect();
                format!("{}Z", points_path(&points))
            })
            .collect();
        self.picture.path(&data, style);
    }

    /// Draws a line through points.
    pub fn line(&mut self, points: &[[f64; 2]], style: &Style) {
        let points: Vec<_> = points.iter().map(|p| self.panel.at(*p)).collect();
        self.picture.line(&points, style);
    }

    /// Draws cells of a table as one path.
    pub fn cells(&mut self, cells: &[Cell], style: &Style) {
        let data: String = cells
            .iter()
            .map(|cell| {
                let [left, top] = self.panel.at([cell.x[0], cell.y[1]]);
                let [right, bottom] = self.panel.at([cell.x[1], cell.y[0]]);
                rectangle_path([left, top, right - left, bottom - top])
            })
            .collect();
        self.picture.path(&data, style);
    }

    /// Draws the inside and the border of a success set as the paper's figures do.
    pub fn success_set(&mut self, polygons: &[Vec<[f64; 2]>]) {
        self.polygons(polygons, &palette::PAPER_AREA);
        for polygon in polygons {
            let points: Vec<_> = polygon.iter().map(|p| self.panel.at(*p)).collect();
            self.picture.path(&hatching(&points), &palette::PAPER_HATCH);
        }
        self.polygons(polygons, &palette::PAPER_BORDER);
    }

    /// Draws a convex polygon with hatching inside.
    pub fn hatched(&mut self, polygon: &[[f64; 2]], style: &Style) {
        let points: Vec<_> = polygon.iter().map(|p| self.panel.at(*p)).collect();
        let panel = &self.panel;
        // Hatch only the visible part: most of a hall's wall may be outside of the panel.
        let shown = clipped(
            &points,
            [panel.left, panel.left + panel.width()],
            [panel.top, panel.bottom()],
        );
        self.picture.path(&hatching(&shown), style);
        self.polygons(&[polygon.to_vec()], style);
    }

    /// Returns `true` if a point of the floor is in the panel or at most `margin` metres outside.
    #[must_use]
    pub fn shows(&self, [x, y]: [f64; 2], margin: f64) -> bool {
        let Window {
            x: [left, right],
            y: [low, high],
        } = self.panel.window;
        (left - margin..=right + margin).contains(&x) && (low - margin..=high + margin).contains(&y)
    }

    /// Returns the middle of the corners of the visible part of a convex polygon or line; `None` if nothing of it is
    /// visible.
    #[must_use]
    pub fn middle(&self, polygon: &[[f64; 2]]) -> Option<[f64; 2]> {
        let shown = clipped(polygon, self.panel.window.x, self.panel.window.y);
        let count = shown.len() as f64;
        let sum = shown
            .iter()
            .fold([0.0; 2], |sum, p| [sum[0] + p[0], sum[1] + p[1]]);
        (count > 0.0).then(|| sum.map(|sum| sum / count))
    }

    /// Draws an arrow.
    pub fn arrow(&mut self, from: [f64; 2], to: [f64; 2], style: &Style) {
        let [from, to] = [from, to].map(|p| self.panel.at(p));
        self.picture.arrow(from, to, style);
    }

    /// Draws in pixels of the picture, clipped to the panel.
    pub fn in_pixels(&mut self, draw: impl FnOnce(&mut Picture, &Panel)) {
        draw(self.picture, &self.panel);
    }

    /// Draws a disc, or a dot of 2.5 pixels if the disc would be smaller.
    pub fn disc(&mut self, centre: [f64; 2], radius: f64, style: &Style) {
        let radius = (radius * self.panel.scale).max(2.5);
        self.picture.circle(self.panel.at(centre), radius, style);
    }

    /// Draws a text at a point of the floor, offset by some pixels, on a white background of the given width, so that
    /// it is readable on any colour.
    pub fn label(
        &mut self,
        at: [f64; 2],
        [dx, dy]: [f64; 2],
        text: &str,
        width: f64,
        colour: &'static str,
    ) {
        let [x, y] = self.panel.at(at);
        let ground = [x + dx - 3.0, y + dy - 11.0, width, 15.0];
        let white = Style::filled("none").with_fill_opacity("#ffffff", 0.85);
        self.picture.rectangle(ground, &white);
        self.picture
            .text([x + dx, y + dy], text, &Font::new(11.0, colour).bold());
    }
}

/// Returns path data of lines from the lower left to the upper right over a polygon, in pixels.
pub(super) fn hatching(polygon: &[[f64; 2]]) -> String {
    // Lines x + y = c.
    let heights = || polygon.iter().map(|[x, y]| x + y);
    let least = heights().fold(f64::INFINITY, f64::min);
    let most = heights().fold(f64::NEG_INFINITY, f64::max);
    let mut data = String::new();
    for c in multiples([least, most], HATCH) {
        let ends = polygon.iter().cycle().skip(1);
        let mut crossed: Vec<[f64; 2]> = Vec::new();
        for (a, b) in polygon.iter().zip(ends) {
            let (ha, hb) = (a[0] + a[1] - c, b[0] + b[1] - c);
            if (ha < 0.0) != (hb < 0.0) {
                let t = ha / (ha - hb);
                crossed.push([a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])]);
            }
        }
        // Along a line, points of entry and exit alternate.
        if crossed.len() > 2 {
            crossed.sort_by(|a, b| a[0].total_cmp(&b[0]));
        }
        for [from, to] in crossed.as_chunks().0 {
            data += &points_path(&[*from, *to]);
        }
    }
    data
}

/// Clips a convex polygon, or a line, to intervals of x and y, one side after the other (Sutherland and Hodgman).
fn clipped(polygon: &[[f64; 2]], x: [f64; 2], y: [f64; 2]) -> Vec<[f64; 2]> {
    let mut left = polygon.to_vec();
    for (axis, sign, end) in [
        (0, 1.0, x[0]),
        (0, -1.0, x[1]),
        (1, 1.0, y[0]),
        (1, -1.0, y[1]),
    ] {
        let margin = |p: &[f64; 2]| sign * (p[axis] - end);
        let ends = left.iter().cycle().skip(1);
        let mut cut = Vec::new();
        for (a, b) in left.iter().zip(ends) {
            let (ra, rb) = (margin(a), margin(b));
            if ra >= 0.0 {
                cut.push(*a);
            }
            if (ra < 0.0) != (rb < 0.0) {
                let t = ra / (ra - rb);
                cut.push([a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])]);
            }
        }
        left = cut;
    }
    left
}

/// Distance between the lines of a hatching along x, pixels.
const HATCH: f64 = 8.0;

/// Returns the smallest distance between ticks, 1, 2 or 5 times a power of ten, that is at least `apart` pixels.
#[must_use]
pub fn tick_at_scale(pixels_a_unit: f64, apart: f64) -> f64 {
    let least = apart / pixels_a_unit;
    let decade = libm::pow(10.0, libm::floor(libm::log10(least)));
    let tick = [1.0, 2.0, 5.0].map(|digit| digit * decade);
    let fits = tick.into_iter().find(|tick| *tick >= least * (1.0 - 1e-9));
    fits.unwrap_or(10.0 * decade)
}

/// Yields the multiples of `tick` in an interval.
pub(super) fn multiples([lo, hi]: [f64; 2], tick: f64) -> impl Iterator<Item = f64> {
    let first = libm::ceil(lo / tick - 1e-9) as i32;
    let last = libm::floor(hi / tick + 1e-9) as i32;
    (first..=last).map(move |k| f64::from(k) * tick)
}

/// Formats a number, with a minus as wide as a plus.
#[must_use]
pub fn signed(value: f64) -> String {
    number(value).replace('-', "\u{2212}")
}

#[cfg(test)]
mod tests {
    use super::*;

    const PANEL: Panel = Panel {
        window: Window {
            x: [-1.0, 3.0],
            y: [-2.0, 2.0],
        },
        left: 10.0,
        top: 20.0,
        scale: 50.0,
        y_title: true,
    };

    #[test]
    fn x_runs_right_and_y_up_at_one_scale() {
        assert_eq!(PANEL.at([-1.0, 2.0]), [10.0, 20.0]);
        assert_eq!(PANEL.at([0.0, 1.0]), [60.0, 70.0]);
        assert_eq!([PANEL.width(), PANEL.height()], [200.0, 200.0]);
    }

    #[test]
    fn ticks_are_round_numbers() {
        for (scale, tick) in [(100.0, 0.5), (40.0, 1.0), (1000.0, 0.05), (1.0, 50.0)] {
            let got = tick_at_scale(scale, 40.0);
            assert!((got / tick - 1.0).abs() < 1e-9, "{scale}: {got}");
        }
    }

    #[test]
    fn hatching_stays_in_the_polygon() {
        let triangle = [[0.0, 0.0], [40.0, 0.0], [0.0, 40.0]];
        let data = hatching(&triangle);
        assert_eq!(data.matches('M').count(), 5, "{data}");
        assert!(
            data.starts_with("M0 0L0 0") || data.starts_with("M8 0L0 8"),
            "{data}"
        );
    }

    #[test]
    fn only_the_visible_part_of_a_wall_is_hatched() {
        let wall = [[-900.0, 10.0], [900.0, 10.0], [900.0, 30.0], [-900.0, 30.0]];
        let shown = clipped(&wall, [0.0, 100.0], [0.0, 100.0]);
        let mut corners = shown.clone();
        corners.sort_by(|a, b| a.partial_cmp(b).unwrap());
        assert_eq!(
            corners,
            [[0.0, 10.0], [0.0, 30.0], [100.0, 10.0], [100.0, 30.0]]
        );
        assert!(hatching(&shown).len() < 400);
        assert_eq!(clipped(&wall, [0.0, 100.0], [40.0, 100.0]), [[0.0; 2]; 0]);
        let line = [[-50.0, 50.0], [150.0, 50.0]];
        let shown = clipped(&line, [0.0, 100.0], [0.0, 100.0]);
        assert!(shown.contains(&[0.0, 50.0]) && shown.contains(&[100.0, 50.0]));
        // A corner cut off.
        let triangle = [[-10.0, 0.0], [20.0, 0.0], [20.0, 30.0]];
        let shown = clipped(&triangle, [0.0, 50.0], [0.0, 50.0]);
        assert_eq!(shown, [[0.0, 0.0], [20.0, 0.0], [20.0, 30.0], [0.0, 10.0]]);
    }

    #[test]
    fn ticks_are_multiples_within_the_window() {
        let all: Vec<f64> = multiples([-0.12, 0.12], 0.06).collect();
        assert_eq!(all, [-0.12, -0.06, 0.0, 0.06, 0.12]);
        assert_eq!(multiples([0.1, 0.9], 1.0).count(), 0);
        assert_eq!(signed(-0.5), "\u{2212}0.5");
    }
}
