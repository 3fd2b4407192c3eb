//! Writes mounting sheets.

use crate::site_input::Failure;
use posegate_files::files::{Files, Output};
use posegate_show::draw::{MountingSheet, mounting_sheet, mounting_sheet_html};

/// Writes a mounting sheet: HTML if the file's name ends with `.html`, else SVG.
pub fn write(files: &Files, path: &Output, sheet: &MountingSheet<'_>) -> Result<(), Failure> {
    let extension = path.as_path().extension();
    let text = if extension.is_some_and(|extension| extension.eq_ignore_ascii_case("html")) {
        mounting_sheet_html(sheet)
    } else {
        mounting_sheet(sheet)
    };
    Ok(files.write(path, text.as_bytes())?)
}
