//! Text in SVG: subscripts, literal names, and numbers.

/// Replaces an underscore that does not begin a subscript.
pub(super) const UNDERSCORE: char = '\u{1}';

/// Returns a name for literal use in texts and titles: its underscores do not begin subscripts. Control characters,
/// which XML does not allow, are replaced by U+FFFD.
#[must_use]
pub fn literal(name: &str) -> String {
    name.chars()
        .map(|letter| match letter {
            '_' => UNDERSCORE,
            letter if letter.is_control() => '\u{fffd}',
            letter => letter,
        })
        .collect()
}

/// Escapes text for XML.
pub(super) fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
}

/// Returns text with the letter after each underscore as a subscript. Shifts are given as `dy`, which every SVG
/// reader supports; the text after the subscript is shifted back. (The picture preserves space: some readers drop it
/// where an element begins.)
pub(super) fn lowered(text: &str, size: f64) -> String {
    let mut parts = text.split('_');
    let mut out = escaped(parts.next().unwrap_or_default());
    let shift = number(0.25 * size);
    for part in parts {
        let mut letters = part.chars();
        let letter: String = letters.next().into_iter().collect();
        out += &format!(
            "<tspan dy=\"{shift}\" font-size=\"{}\" font-style=\"italic\">{}</tspan>",
            number(0.8 * size),
            escaped(&letter)
        );
        let rest = letters.as_str();
        if !rest.is_empty() {
            out += &format!("<tspan dy=\"-{shift}\">{}</tspan>", escaped(rest));
        }
    }
    out.replace(UNDERSCORE, "_")
}

/// Formats a number with at most two decimals, without trailing zeros.
#[must_use]
pub fn number(value: f64) -> String {
    let text = format!("{value:.2}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0" } else { text }.into()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draw::svg::{Font, Picture};

    #[test]
    fn text_is_escaped_and_lowered() {
        let mut picture = Picture::new(10.0, 10.0, "a < b");
        picture.text([1.0, 2.0], "X & S_l, S_w too", &Font::new(10.0, "#000"));
        let text = picture.finish();
        assert!(text.contains("<title>a &lt; b</title>"));
        assert!(text.contains("X &amp; S<tspan dy=\"2.5\" font-size=\"8\" font-style=\"italic\">l</tspan><tspan dy=\"-2.5\">, S</tspan>"));
        assert!(text.contains(">w</tspan><tspan dy=\"-2.5\"> too</tspan></text>"));
    }

    #[test]
    fn names_are_literal() {
        let mut picture = Picture::new(10.0, 10.0, &literal("a_b"));
        picture.text(
            [1.0, 2.0],
            &literal("see_t7\u{7}"),
            &Font::new(10.0, "#000"),
        );
        let text = picture.finish();
        assert!(text.contains("<title>a_b</title>"));
        assert!(text.contains(">see_t7\u{fffd}</text>"));
    }

    #[test]
    fn numbers_have_at_most_two_decimals() {
        for (value, text) in [
            (1.0, "1"),
            (-0.001, "0"),
            (0.5, "0.5"),
            (10.0, "10"),
            (-3.456, "-3.46"),
            (100.0, "100"),
        ] {
            assert_eq!(number(value), text);
        }
    }
}
