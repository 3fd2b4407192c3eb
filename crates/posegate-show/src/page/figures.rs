//! Figures and tables of a page.

use data_encoding::BASE64;

/// Escapes text for HTML. Control characters, which HTML does not allow, are replaced by U+FFFD.
pub(super) fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            c if c.is_control() && !matches!(c, '\n' | '\t') => out.push('\u{fffd}'),
            c => out.push(c),
        }
    }
    out
}

/// Returns a figure with its caption.
pub(super) fn figure(svg: &str, caption: &str) -> String {
    let caption = escaped(caption);
    format!(
        "<figure><img loading=\"lazy\" alt=\"{caption}\" src=\"data:image/svg+xml;base64,{}\"><figcaption>{caption}</figcaption></figure>\n",
        BASE64.encode(svg.as_bytes())
    )
}

/// Returns an HTML table.
pub(super) fn table(head: &[&str], rows: impl IntoIterator<Item = Vec<String>>) -> String {
    fn row(cells: &[impl AsRef<str>], kind: &str) -> String {
        let cell = |cell: &_| format!("<{kind}>{}</{kind}>", escaped(AsRef::as_ref(cell)));
        format!("<tr>{}</tr>\n", cells.iter().map(cell).collect::<String>())
    }
    let rows = rows.into_iter().map(|cells| row(&cells, "td"));
    format!(
        "<div class=\"wide\"><table><thead>{}</thead><tbody>{}</tbody></table></div>\n",
        row(head, "th"),
        rows.collect::<String>()
    )
}

/// Returns content that is folded under a title.
pub(super) fn folded(title: &str, inside: &str) -> String {
    format!(
        "<details><summary>{}</summary>\n{inside}</details>\n",
        escaped(title)
    )
}

/// Returns the numbers of a figure as a folded table with a title.
pub(super) fn numbers(
    of: &str,
    head: &[&str],
    rows: impl IntoIterator<Item = Vec<String>>,
) -> String {
    folded(&format!("the numbers behind it: {of}"), &table(head, rows))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn markup_in_text_is_escaped() {
        let text = escaped("</script><a b='c' d=\"e\">&");
        assert_eq!(
            text,
            "&lt;/script&gt;&lt;a b=&#39;c&#39; d=&quot;e&quot;&gt;&amp;"
        );
        assert_eq!(escaped("a\u{1b}\u{85}\n\tb"), "a\u{fffd}\u{fffd}\n\tb");
    }
}
