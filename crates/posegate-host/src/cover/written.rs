//! A site file with the chosen tags hung, and without candidates.

use super::{ChosenTag, Cover};
use crate::printable::toml_string;
use crate::site::Site;

/// The text of a site file with a cover's chosen tags as `[tag.NAME]` tables and without its `[candidate.NAME]` tables;
/// all else stays as it is written. `None` where the file writes candidates in another way (as one inline table, or
/// with dotted keys), so that they cannot be taken out.
///
/// What is given back has been read again: it is a valid site with the cover's tags, tasks and chains. Files that it
/// names are looked for beside `file_name`.
#[must_use]
pub fn written(text: &str, file_name: &str, cover: &Cover) -> Option<String> {
    let out = with_tags(text, &cover.tags);
    // Whatever was misread would show here.
    let again = Site::parse(&out, file_name).ok()?;
    let same = Site {
        digest: cover.site.digest,
        files: cover.site.files.clone(),
        ..again
    };
    (same == cover.site).then_some(out)
}

/// A site file's text with chosen tags and without candidates.
pub(super) fn with_tags(text: &str, tags: &[ChosenTag]) -> String {
    let mut out = String::with_capacity(text.len());
    let mut within = false;
    for line in text.split_inclusive('\n') {
        if let Some(head) = head(line) {
            within = head == "candidate" || head.starts_with("candidate.");
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
        let pose = tag.pose;
        out += &format!(
            "\n[tag.{}]\nid = {}\nfamily = {}\nsize = {:?}\n\
             pose = {{ x = {:?}, y = {:?}, z = {:?}, roll_deg = {:?}, pitch_deg = {:?}, yaw_deg = {:?} }}\n",
            key(&chosen.name),
            tag.id,
            toml_string(&chosen.tag.family),
            tag.size,
            pose.x,
            pose.y,
            pose.z,
            pose.roll_deg,
            pose.pitch_deg,
            pose.yaw_deg,
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

/// The name in a line that begins a table, without blanks about its dots; nested arrays may look like it.
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

/// A TOML key, bare where it can be.
fn key(name: &str) -> String {
    let is_bare = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    if name.chars().all(is_bare) {
        name.into()
    } else {
        toml_string(name)
    }
}
