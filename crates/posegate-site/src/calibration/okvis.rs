//! The settings of OKVIS: a list `cameras`, each with `focal_length` and `principal_point`.

use super::{ParsedCalibration, chosen, lens_of_file, listed_size};
use crate::error::SiteError;
use crate::yaml::{Document, Map};

const AS_SAVED: &str = "copy the settings again as OKVIS has them";

/// Returns `true` if a file has the keys of this kind.
pub(super) fn is_of(document: &Document<'_>, file: Map<'_>) -> bool {
    let cameras = file.get("cameras").map(|cameras| document.list(cameras));
    let first = cameras.and_then(|cameras| cameras.ok()?.first()?.as_map());
    first.is_some_and(|first| first.get("principal_point").is_some())
}

pub(super) fn read(
    document: &Document<'_>,
    file: Map<'_>,
    name: Option<&str>,
    site_px: [Option<f64>; 2],
) -> Result<ParsedCalibration, SiteError> {
    let cameras = document.required(file.get("cameras"), 0..0, "cameras", AS_SAVED)?;
    let (_, camera) = chosen(document, document.list(cameras)?, name)?;
    let keys = document.map(camera)?;
    let required = |key: &str| document.required(keys.get(key), camera.at.clone(), key, AS_SAVED);
    let list = required("focal_length")?;
    let [fx, fy] = document.numbers(list, "focal_length")?;
    if !(fx > 0.0) || !(fy > 0.0) {
        return Err(document
            .error(
                list.at.clone(),
                format!("the focal lengths are {fx} and {fy}"),
            )
            .expected("pixels, above 0")
            .help("calibrate again"));
    }
    let [cx, cy] = document.numbers(required("principal_point")?, "principal_point")?;
    let mut notes = Vec::new();
    let at = (camera.at.clone(), "image_dimension");
    let list = keys.get(at.1);
    let (size_at, size_px) = listed_size(document, list, at, site_px, &mut notes)?;
    let model = required("distortion_type")?;
    let list = required("distortion_coefficients")?;
    let name = "distortion_coefficients";
    let lens = lens_of_file(document, Some(model), Some(list), name, &mut notes)?;
    let mut parsed = ParsedCalibration::of_raw(size_at, size_px, [fx, fy, cx, cy], lens);
    parsed.numbers.notes = notes;
    Ok(parsed)
}
