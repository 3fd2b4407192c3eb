//! Writes a site file with the chosen tags, without candidates.

use super::{ChosenTag, Cover};
use posegate_files::printable::toml_string;
use posegate_site::{Site, pose_line};

/// Returns the text of a site file with a cover's chosen tags as `[tag.NAME]` tables and without its
/// `[candidate.NAME]` and `[candidates.NAME]` tables. All other text is unchanged. Returns `None` if the file has
/// candidates in another form (one inline table, or dotted keys), so that they cannot be removed.
///
/// The returned text was parsed again: it is a valid site with the cover's tags, tasks and chains. Files that it
/// names are searched next to `file_name`.
#[must_use]
pub fn written(text: &str, file_name: &str, cover: &Cover) -> Option<String> {
    let out = with_tags(text, &cover.tags);
    // Any error of `with_tags` is detected here.
    let again = Site::parse(&out, file_name).ok()?;
    let same = Site {
        digest: cover.site.digest,
        files: cover.site.files.clone(),
        ..again
    };
    (same == cover.site).then_some(out)
}

/// Returns a site file's text with the chosen tags and without candidates.
fn with_tags(text: &str, tags: &[ChosenTag]) -> String {
    let mut out = String::with_capacity(text.len());
    let mut within = false;
    for line in text.split_inclusive('\n') {
        if let Some(head) = head(line) {
            let first = head
                .split_once('.')
                .map_or(head.as_str(), |(first, _)| first);
            within = matches!(first, "candidate" | "candidates");
        }
        if !within {
            out.push_str(line);
        }
    }
    if !out.is_empty() && !out.ends_with('\n') {
        out.push('\n');
    }
    for chosen in tags {
        let (tag, tolerance) = (&chosen.tag.tag, chosen.tag.tolerance);
        out += &format!(
            "\n[tag.{}]\nid = {}\nfamily = {}\nsize = {:?}\n\
             {}\n",
            key(&chosen.name),
            tag.id,
            toml_string(&chosen.tag.family),
            tag.size,
            pose_line(&tag.pose),
        );
        if tolerance.translation > 0.0 || tolerance.turn_deg > 0.0 {
            out += &format!(
                "tolerance = {{ translation = {:?}, yaw_deg = {:?} }}\n",
                tolerance.translation, tolerance.turn_deg
            );
        }
    }
    out
}

/// Returns the name in a line that begins a table, without blanks around its dots. A line of a nested array may look
/// the same.
fn head(line: &str) -> Option<String> {
    let inner = line.trim().strip_prefix('[')?;
    let (inner, rest) = inner.split_once(']')?;
    let rest = rest.trim_start();
    let ends = rest.is_empty() || rest.starts_with('#');
    let name: String = inner.chars().filter(|c| !c.is_whitespace()).collect();
    let is_name =
        name.starts_with(|c: char| c.is_alphabetic() || c == '_' || c == '"' || c == '\'');
    (ends && is_name).then_some(name)
}

/// Returns a TOML key, without quotes if possible.
fn key(name: &str) -> String {
    let is_bare = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    if name.chars().all(is_bare) {
        name.into()
    } else {
        toml_string(name)
    }
}
