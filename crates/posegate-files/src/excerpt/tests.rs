use super::*;

/// Returns the part of the excerpt marked as the fault.
fn fault(excerpt: &Excerpt) -> &str {
    &excerpt.text[excerpt.fault.clone()]
}

fn of(text: &str, fault: &str) -> Excerpt {
    let start = text.find(fault).unwrap();
    let line = 1 + text[..start].matches('\n').count();
    Excerpt::new(text, start..start + fault.len(), line)
}

#[test]
fn short_text_is_shown_with_the_lines_around() {
    let shown = of("a = 1\nb = 2\r\nc = wrong # d\ne = 3\nf = 4\n", "wrong");
    assert_eq!(shown.text, "b = 2\nc = wrong # d\ne = 3");
    assert_eq!((fault(&shown), shown.first_line), ("wrong", 2));
    let first = of("a = 1\n", "a");
    assert_eq!((&*first.text, first.first_line), ("a = 1\n", 1));
}

#[test]
fn end_of_file_is_a_fault_of_no_length() {
    for text in ["", "a = 1", "a = 1\n", "\n\n"] {
        let shown = Excerpt::new(text, text.len()..text.len() + 9, 1);
        assert_eq!(fault(&shown), "", "{text:?}");
    }
    assert_eq!(Excerpt::new("a = 1\n", 6..6, 2).text, "a = 1\n");
    assert_eq!(Excerpt::new("a = 1\n", 5..6, 1).text, "a = 1\n");
}

#[test]
fn hostile_characters_are_escaped_and_the_fault_is_shifted() {
    let shown = of(
        "\u{feff}\u{1b}[31m ä = \u{202e}\"\u{9b}\" # \u{7f}\n",
        "\"\u{9b}\"",
    );
    assert_eq!(fault(&shown), "\"\\u{9b}\"");
    assert_eq!(
        shown.text,
        "\\u{feff}\\u{1b}[31m ä = \\u{202e}\"\\u{9b}\" # \\u{7f}\n"
    );
}

#[test]
fn megabytes_are_shortened_to_a_few_hundred_characters() {
    let many = "\u{20ac}".repeat(1 << 20);
    let text = format!("{many}\n{many}wrong{many}\n{many}\n");
    let shown = of(&text, "wrong");
    assert_eq!((fault(&shown), shown.first_line), ("wrong", 1));
    let lines: Vec<_> = shown
        .text
        .lines()
        .map(|line| line.chars().count())
        .collect();
    assert_eq!(lines, [2 * REACH + 1, 2 * REACH + 7, 2 * REACH + 1]);
    let long = Excerpt::new(&text, 0..text.len(), 1);
    assert!(long.text.chars().count() < 20 * REACH);
    let within = Excerpt::new(&many, 1..many.len() - 1, 1);
    assert_eq!(within.text.chars().count(), REACH + 1);
}

#[test]
fn long_faults_show_their_first_line() {
    let lines = |count| format!("[{}]\nz = 1\n", "\n1,".repeat(count));
    let shown = of(&lines(7), "[\n1,\n1,\n1,\n1,\n1,\n1,\n1,]");
    assert_eq!(shown.text.lines().count(), 9);
    assert!(fault(&shown).ends_with("1,]"));
    let text = lines(MOST_LINES);
    let end = text.find(']').unwrap();
    let shown = Excerpt::new(&text, 0..end, 1);
    assert_eq!((fault(&shown), &*shown.text), ("[", "[\n1,"));
}
