//! Finds the line of a key in a site file's text.

use toml::de::{DeTable, DeValue};

/// Returns the line, counted from 1, of a key of a site file: of `["tag", "t7", "size"]`, for example. If the file does
/// not have keys after the second, returns the line of the one before. Returns `None` without the first two, or if the
/// text is not valid TOML.
#[must_use]
pub fn line_of(text: &str, path: &[&str]) -> Option<usize> {
    let document = DeTable::parse(text).ok()?;
    let mut table = document.get_ref();
    let mut at = None;
    for (depth, name) in path.iter().enumerate() {
        let Some((key, value)) = table.get_key_value(*name) else {
            if depth < 2 {
                return None;
            }
            break;
        };
        at = Some(key.span().start);
        match value.get_ref() {
            DeValue::Table(inner) => table = inner,
            _ => break,
        }
    }
    let before = text.get(..at?)?;
    Some(1 + before.matches('\n').count())
}

#[cfg(test)]
mod tests {
    use super::line_of;

    #[test]
    fn keys_are_found_in_every_notation() {
        let text = "[tag.a]\nid = 1\nsize = 300\n\n[tag.b]\npose = { x = 1.0,\n y = 2.0 }\ntag = 3\n[wall]\nc.z = 1\n";
        for (path, line) in [
            (&["tag", "a"][..], Some(1)),
            (&["tag", "a", "size"], Some(3)),
            (&["tag", "a", "missing"], Some(1)),
            (&["tag", "b", "pose"], Some(6)),
            (&["tag", "b", "pose", "y"], Some(7)),
            (&["wall", "c"], Some(10)),
            (&["goal", "a"], None),
            (&["tag", "c"], None),
        ] {
            assert_eq!(line_of(text, path), line, "{path:?}");
        }
        assert_eq!(line_of("[", &["tag"]), None);
    }
}
