//! Upper bounds of the widths of texts, so that texts do not overlap in any `sans-serif` font.

/// Returns an upper bound on the width of a letter, in units of the font size. The bound is valid for DejaVu Sans,
/// one of the widest fonts that systems use as `sans-serif`.
fn ems(letter: char) -> f64 {
    match letter {
        'i' | 'j' | 'l' | '\'' | '|' | '.' | ',' | ':' | ';' | 'I' | ' ' => 0.34,
        'f' | 't' | 'r' | '(' | ')' | '[' | ']' | '-' | '/' | '!' => 0.42,
        'm' | 'w' | 'M' | 'W' | '@' | '%' | '…' => 1.0,
        '°' | '"' | '*' => 0.51,
        'a'..='z' | '0'..='9' => 0.64,
        'A'..='Z' => 0.79,
        letter if letter < '\u{2e80}' => 0.84,
        _ => 1.1,
    }
}

/// The largest ratio of the widths of a bold letter and the same regular letter.
const BOLD: f64 = 1.13;

/// Returns an upper bound on the width of a text, pixels.
#[must_use]
pub(super) fn text_width(text: &str, size: f64, bold: bool) -> f64 {
    let ems: f64 = text.chars().map(ems).sum();
    ems * size * if bold { BOLD } else { 1.0 }
}

/// Returns a text that is at most as wide as `most` pixels: if it is wider, it ends with an ellipsis.
#[must_use]
pub(super) fn fitted(text: &str, size: f64, bold: bool, most: f64) -> String {
    if text_width(text, size, bold) <= most {
        return text.to_owned();
    }
    let mut short: String = text.to_owned();
    while short.pop().is_some() {
        let with = format!("{}…", short.trim_end());
        if text_width(&with, size, bold) <= most {
            return with;
        }
    }
    String::new()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_texts_are_shortened_to_fit() {
        assert_eq!(fitted("north", 12.0, false, 200.0), "north");
        let short = fitted(&"north wall ".repeat(20), 12.0, true, 200.0);
        assert!(
            short.starts_with("north wall") && short.ends_with('…'),
            "{short}"
        );
        assert!(text_width(&short, 12.0, true) <= 200.0);
        assert_eq!(fitted("north", 12.0, false, 1.0), "");
    }
}
