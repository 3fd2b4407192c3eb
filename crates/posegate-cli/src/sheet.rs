//! Writes mounting sheets.

use crate::door::Failure;
use posegate_host::draw::{Mounted, mounting_sheet, mounting_sheet_html};
use posegate_host::files::{Files, Output};
use posegate_host::site::Site;

/// Writes a mounting sheet: HTML if the file's name ends with `.html`, else SVG.
pub fn write(
    files: &Files,
    path: &Output,
    title: &str,
    tags: &[Mounted],
    site: &Site,
) -> Result<(), Failure> {
    let extension = path.as_path().extension();
    let text = if extension.is_some_and(|extension| extension.eq_ignore_ascii_case("html")) {
        mounting_sheet_html(title, tags, &site.walls)
    } else {
        mounting_sheet(title, tags, &site.walls)
    };
    Ok(files.write(path, text.as_bytes())?)
}
