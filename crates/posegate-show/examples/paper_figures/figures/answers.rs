//! The study's answers as text in its pictures.

use posegate_show::draw::palette;
use posegate_show::draw::scene::{Font, Picture};
use posegate_show::draw::study::Answer;

/// Returns the text of an answer in a picture: `1 m / 2° inside S_l, margin 1.366`.
#[must_use]
pub fn words(answer: &Answer, set_name: &str) -> String {
    format!(
        "{} {} {set_name}, margin {}",
        answer.known,
        answer.holds_text(),
        answer.margin_text()
    )
}

/// Draws the heading of a row of panels, its baseline at `top`, and the row's answers below it.
pub fn row_heading(picture: &mut Picture, top: f64, heading: &str, answers: &[(&Answer, &str)]) {
    let font = Font::new(15.0, palette::INK).bold();
    picture.text([24.0, top], heading, &font);
    for (index, (answer, set_name)) in answers.iter().enumerate() {
        let font = Font::new(13.0, palette::of_words(answer.holds())).bold();
        let at = [24.0 + 306.0 * index as f64, top + 22.0];
        picture.text(at, &words(answer, set_name), &font);
    }
}
