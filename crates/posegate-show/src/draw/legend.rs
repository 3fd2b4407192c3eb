//! Legends, and lines with the result of a containment test.

use super::palette;
use super::panel::hatching;
use super::svg::{Font, Picture, Style};

/// The sample next to a legend's text.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Sample {
    /// A patch.
    Patch(Style),
    /// A disc.
    Disc(Style),
    /// A line.
    Line(Style),
    /// A hatched patch.
    Hatched(Style),
    /// A success set of the paper's figures.
    SuccessSet,
    /// No sample: the text continues the line above.
    Words,
}

/// Height of a line of a legend, pixels.
pub const LINE: f64 = 21.0;

/// Draws a legend, one line per entry; the point is the upper left corner.
pub fn legend(picture: &mut Picture, [left, top]: [f64; 2], entries: &[(Sample, &str)]) {
    for (index, (sample, words)) in entries.iter().enumerate() {
        let middle = top + (index as f64 + 0.5) * LINE;
        match sample {
            Sample::Patch(style) => {
                picture.rectangle([left, middle - 6.0, 24.0, 12.0], style);
            }
            Sample::Disc(style) => picture.circle([left + 12.0, middle], 7.0, style),
            Sample::Line(style) => {
                picture.line(&[[left, middle], [left + 24.0, middle]], style);
            }
            Sample::Hatched(style) => {
                let corners = [[0.0, -6.0], [24.0, -6.0], [24.0, 6.0], [0.0, 6.0]];
                let corners = corners.map(|[x, y]| [left + x, middle + y]);
                picture.path(&hatching(&corners), style);
                picture.rectangle([left, middle - 6.0, 24.0, 12.0], style);
            }
            Sample::SuccessSet => {
                let corners = [[0.0, -6.0], [24.0, -6.0], [24.0, 6.0], [0.0, 6.0]];
                let corners = corners.map(|[x, y]| [left + x, middle + y]);
                let edges = [left, middle - 6.0, 24.0, 12.0];
                picture.rectangle(edges, &palette::PAPER_AREA);
                picture.path(&hatching(&corners), &palette::PAPER_HATCH);
                picture.rectangle(edges, &palette::PAPER_BORDER);
            }
            Sample::Words => {}
        }
        let font = Font::new(12.0, palette::INK);
        picture.text([left + 32.0, middle + 4.0], words, &font);
    }
}

/// Draws a line about an answer: a mark (a tick or a cross) and bold text, with plain text on a
/// second line. The point is the upper left corner; two lines take 40 pixels.
pub fn verdict(picture: &mut Picture, [left, top]: [f64; 2], holds: bool, bold: &str, plain: &str) {
    let colour = palette::of_words(holds);
    let [x, y] = [left + 9.0, top + 9.0];
    picture.circle([x, y], 9.0, &Style::filled(colour));
    let white = Style::outlined("#ffffff", 2.2);
    if holds {
        picture.line(
            &[[x - 4.5, y], [x - 1.5, y + 3.5], [x + 4.5, y - 3.5]],
            &white,
        );
    } else {
        picture.line(&[[x - 3.5, y - 3.5], [x + 3.5, y + 3.5]], &white);
        picture.line(&[[x - 3.5, y + 3.5], [x + 3.5, y - 3.5]], &white);
    }
    let heading = Font::new(14.0, colour).bold();
    picture.text([left + 27.0, top + 14.0], bold, &heading);
    let note = Font::new(12.0, palette::FAINT);
    picture.text([left + 27.0, top + 31.0], plain, &note);
}
