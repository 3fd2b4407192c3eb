//! The pictures of a whole site: its floor plan, and each tag and camera from three sides.

use super::portrait::{camera_portrait, tag_portrait};
use super::site_plan::site_plan;
use posegate_site::Site;

/// Draws the pictures of a site. Returns file names and SVG texts.
#[must_use]
pub fn site_pictures(site: &Site) -> Vec<(String, String)> {
    let mut files = vec![("site.svg".to_owned(), site_plan(site, &[]))];
    let mut add = |kind: &str, name: &str, text: String| {
        // Names may contain any character; keep only those that every system accepts in file names.
        let plain = |c: char| {
            if c.is_ascii_alphanumeric() || c == '-' {
                c
            } else {
                '_'
            }
        };
        let stem: String = name.chars().map(plain).collect();
        let mut file = format!("{kind}-{stem}.svg");
        let mut count = 1;
        // Some systems ignore the case of file names.
        while files
            .iter()
            .any(|(known, _)| known.eq_ignore_ascii_case(&file))
        {
            count += 1;
            file = format!("{kind}-{stem}-{count}.svg");
        }
        files.push((file, text));
    };
    for (name, tag) in &site.tags {
        add("tag", name, tag_portrait(name, &tag.tag));
    }
    for (name, camera) in &site.cameras {
        add("camera", name, camera_portrait(name, camera));
    }
    files
}

#[cfg(test)]
mod tests {
    use super::*;

    const DOCK: &str = include_str!("../../../../examples/sites/dock.toml");

    #[test]
    fn picture_names_are_unique() {
        let text = DOCK
            .replace("[tag.t7]", "[tag.\"a/b\"]")
            .replace("tag = \"t7\"", "tag = \"a/b\"");
        let more = "[tag.\"A b\"]\nid = 9\nfamily = \"tag36h11\"\nsize = 0.3\npose = { x = 4.0, y = 2.0, z = 0.5, roll_deg = 0.0, pitch_deg = 0.0, yaw_deg = 180.0 }\n[task.dock]\n";
        let files =
            site_pictures(&Site::parse(&text.replace("[task.dock]\n", more), "site.toml").unwrap());
        let names: Vec<&str> = files.iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(
            names,
            [
                "site.svg",
                "tag-A_b.svg",
                "tag-a_b-2.svg",
                "camera-front.svg"
            ]
        );
        assert!(
            files
                .iter()
                .all(|(_, text)| text.starts_with("<svg ") && !text.contains("NaN"))
        );
    }
}
