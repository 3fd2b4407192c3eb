//! SVG text: a few elements, numbers with two decimals, no external resources.
//!
//! The same calls give the same bytes on every host. A picture needs no other file: fonts are the
//! reader's `sans-serif`.

pub use super::letters::{literal, number};

use super::letters::{UNDERSCORE, escaped, lowered};
use std::fmt::Write;

/// The style of an outline and its inside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Style {
    fill: &'static str,
    fill_opacity: f64,
    stroke: &'static str,
    width: f64,
    dashes: &'static str,
}

impl Style {
    /// Returns the style of a filled inside without an outline.
    #[must_use]
    pub const fn filled(fill: &'static str) -> Self {
        Self {
            fill,
            fill_opacity: 1.0,
            stroke: "none",
            width: 0.0,
            dashes: "",
        }
    }

    /// Returns the style of an outline without a filled inside.
    #[must_use]
    pub const fn outlined(stroke: &'static str, width: f64) -> Self {
        Self::filled("none").with_outline(stroke, width)
    }

    /// Adds an outline.
    #[must_use]
    pub const fn with_outline(self, stroke: &'static str, width: f64) -> Self {
        Self {
            stroke,
            width,
            ..self
        }
    }

    /// Fills the inside with an opacity.
    #[must_use]
    pub const fn with_fill_opacity(self, fill: &'static str, fill_opacity: f64) -> Self {
        Self {
            fill,
            fill_opacity,
            ..self
        }
    }

    /// Removes the fill.
    #[must_use]
    pub const fn without_fill(self) -> Self {
        self.with_fill_opacity("none", 1.0)
    }

    /// Makes the outline solid.
    #[must_use]
    pub const fn with_solid_stroke(self) -> Self {
        self.dashed("")
    }

    /// Makes the outline dashed, with an SVG dash list.
    #[must_use]
    pub const fn dashed(self, dashes: &'static str) -> Self {
        Self { dashes, ..self }
    }

    fn attributes(&self) -> String {
        let mut text = format!(" fill=\"{}\"", self.fill);
        if self.fill_opacity < 1.0 {
            text += &format!(" fill-opacity=\"{}\"", number(self.fill_opacity));
        }
        if self.stroke != "none" {
            text += &format!(
                " stroke=\"{}\" stroke-width=\"{}\"",
                self.stroke,
                number(self.width)
            );
        }
        if !self.dashes.is_empty() {
            text += &format!(" stroke-dasharray=\"{}\"", self.dashes);
        }
        text
    }
}

/// The point of a text that is at the given coordinates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Anchor {
    /// The start of the text.
    Start,
    /// The middle of the text.
    Middle,
    /// The end of the text.
    End,
}

/// The font of a text.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Font {
    /// Size, pixels.
    pub size: f64,
    /// The colour.
    pub colour: &'static str,
    /// `true` for bold text.
    pub bold: bool,
    /// The point of the text that is at the given coordinates.
    pub anchor: Anchor,
}

impl Font {
    /// A plain font, anchored at its start.
    #[must_use]
    pub const fn new(size: f64, colour: &'static str) -> Self {
        Self {
            size,
            colour,
            bold: false,
            anchor: Anchor::Start,
        }
    }

    /// Makes the font bold.
    #[must_use]
    pub const fn bold(self) -> Self {
        Self { bold: true, ..self }
    }

    /// Sets the anchor.
    #[must_use]
    pub const fn anchored(self, anchor: Anchor) -> Self {
        Self { anchor, ..self }
    }
}

/// An SVG picture under construction. Coordinates are pixels, x to the right, y down.
#[derive(Clone, Debug)]
pub struct Picture {
    width: f64,
    height: f64,
    title: String,
    body: String,
}

impl Picture {
    /// Creates a white picture. Screen readers read the title.
    #[must_use]
    pub fn new(width: f64, height: f64, title: &str) -> Self {
        let mut picture = Self {
            width,
            height,
            // The title shows subscripts as plain letters.
            title: escaped(&title.replace('_', "")).replace(UNDERSCORE, "_"),
            body: String::new(),
        };
        picture.rectangle([0.0, 0.0, width, height], &Style::filled("#ffffff"));
        picture
    }

    /// Draws a rectangle: left, top, width, height.
    pub fn rectangle(&mut self, [left, top, width, height]: [f64; 4], style: &Style) {
        self.element(format_args!(
            "<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\"{}/>",
            number(left),
            number(top),
            number(width),
            number(height),
            style.attributes()
        ));
    }

    /// Draws a circle.
    pub fn circle(&mut self, [x, y]: [f64; 2], radius: f64, style: &Style) {
        self.element(format_args!(
            "<circle cx=\"{}\" cy=\"{}\" r=\"{}\"{}/>",
            number(x),
            number(y),
            number(radius),
            style.attributes()
        ));
    }

    /// Draws many dots of one colour, as a single element.
    pub fn dots(&mut self, points: &[[f64; 2]], radius: f64, colour: &str) {
        let dot = |[x, y]: &[f64; 2]| format!("M{} {}h0", number(*x), number(*y));
        self.element(format_args!(
            "<path d=\"{}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"{}\" stroke-linecap=\"round\"/>",
            points.iter().map(dot).collect::<String>(),
            number(2.0 * radius)
        ));
    }

    /// Draws a line through some points.
    pub fn line(&mut self, points: &[[f64; 2]], style: &Style) {
        self.path(&points_path(points), style);
    }

    /// Draws an arrow: a line with a head of two short lines.
    pub fn arrow(&mut self, from: [f64; 2], to: [f64; 2], style: &Style) {
        let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
        let length = libm::hypot(dx, dy);
        if !(length > 0.0) {
            return;
        }
        let size = (0.5 * length).min(7.0) / length;
        let wing = |side: f64| {
            [
                to[0] - size * (dx + 0.6 * side * dy),
                to[1] - size * (dy - 0.6 * side * dx),
            ]
        };
        self.line(&[from, to], style);
        self.line(&[wing(1.0), to, wing(-1.0)], &style.with_solid_stroke());
    }

    /// Draws a path from SVG path data, as `points_path` and `rectangle_path` return it.
    pub fn path(&mut self, data: &str, style: &Style) {
        if !data.is_empty() {
            self.element(format_args!("<path d=\"{data}\"{}/>", style.attributes()));
        }
    }

    /// Draws a text with its baseline at the point. The letter after an underscore is a subscript: `S_l`.
    pub fn text(&mut self, [x, y]: [f64; 2], text: &str, font: &Font) {
        self.text_turned([x, y], 0.0, text, font);
    }

    /// Draws a text turned clockwise about its point by some degrees.
    pub fn text_turned(&mut self, [x, y]: [f64; 2], turn_deg: f64, text: &str, font: &Font) {
        let anchor = match font.anchor {
            Anchor::Start => "",
            Anchor::Middle => " text-anchor=\"middle\"",
            Anchor::End => " text-anchor=\"end\"",
        };
        let bold = if font.bold {
            " font-weight=\"bold\""
        } else {
            ""
        };
        let (x, y) = (number(x), number(y));
        let turned = if turn_deg == 0.0 {
            String::new()
        } else {
            format!(" transform=\"rotate({} {x} {y})\"", number(turn_deg))
        };
        let content = lowered(text, font.size);
        self.element(format_args!(
            "<text x=\"{x}\" y=\"{y}\" font-size=\"{}\" fill=\"{}\"{bold}{anchor}{turned}>{content}</text>",
            number(font.size),
            font.colour
        ));
    }

    /// Draws into a rectangle (left, top, width, height), clipped to it.
    pub fn clipped(&mut self, [left, top, width, height]: [f64; 4], draw: impl FnOnce(&mut Self)) {
        let [left, top, width, height] = [left, top, width, height].map(number);
        self.element(format_args!(
            "<svg x=\"{left}\" y=\"{top}\" width=\"{width}\" height=\"{height}\" viewBox=\"{left} {top} {width} {height}\">"
        ));
        draw(self);
        self.element(format_args!("</svg>"));
    }

    /// Returns the file's text.
    #[must_use]
    pub fn finish(self) -> String {
        let (width, height) = (number(self.width), number(self.height));
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
             viewBox=\"0 0 {width} {height}\" font-family=\"sans-serif\" role=\"img\" \
             xml:space=\"preserve\">\n\
             <title>{}</title>\n{}</svg>\n",
            self.title, self.body
        )
    }

    fn element(&mut self, text: core::fmt::Arguments<'_>) {
        // Writing to a string cannot fail.
        let _ = writeln!(self.body, "{text}");
    }
}

/// Returns the path data of a line through points.
#[must_use]
pub fn points_path(points: &[[f64; 2]]) -> String {
    let mut data = String::new();
    for (index, [x, y]) in points.iter().enumerate() {
        data.push(match index {
            0 => 'M',
            1 => 'L',
            _ => ' ',
        });
        data += &format!("{} {}", number(*x), number(*y));
    }
    data
}

/// Returns the path data of a rectangle (left, top, width, height).
#[must_use]
pub fn rectangle_path([left, top, width, height]: [f64; 4]) -> String {
    let [left, top, width, height] = [left, top, width, height].map(number);
    format!("M{left} {top}h{width}v{height}h-{width}z")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_are_compact() {
        assert_eq!(
            points_path(&[[0.0, 1.0], [2.5, 3.0], [4.0, 5.0]]),
            "M0 1L2.5 3 4 5"
        );
        assert_eq!(rectangle_path([1.0, 2.0, 3.0, 4.0]), "M1 2h3v4h-3z");
    }
}
