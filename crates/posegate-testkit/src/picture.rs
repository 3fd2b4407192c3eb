//! Checks of pictures.

/// Checks that the elements of an SVG are balanced, its coordinates are numbers, nothing is fetched, and it has a title.
///
/// # Panics
/// If one of these does not hold.
pub fn check_picture(text: &str, name: &str) {
    for bad in ["NaN", "inf", "href", "url(", "<image", "@import"] {
        assert!(!text.contains(bad), "{name} has {bad}");
    }
    let mut open: Vec<&str> = Vec::new();
    let mut rest = text;
    while let Some(start) = rest.find('<') {
        let end = start + rest[start..].find('>').expect("every tag ends");
        let tag = &rest[start + 1..end];
        assert!(!tag.contains('<'), "{name}: {tag}");
        assert!(tag.matches('"').count().is_multiple_of(2), "{name}: {tag}");
        if let Some(closed) = tag.strip_prefix('/') {
            assert_eq!(open.pop(), Some(closed), "{name}");
        } else if !tag.ends_with('/') {
            open.push(tag.split_whitespace().next().unwrap());
        }
        rest = &rest[end + 1..];
    }
    assert!(open.is_empty(), "{name}: {open:?}");
    assert!(text.starts_with("<svg ") && text.contains("<title>"));
}
