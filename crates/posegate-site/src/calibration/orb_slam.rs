//! The settings of ORB-SLAM 2 and 3, and of OpenVSLAM: keys `Camera.fx` or `Camera1.fx`, or `fx` within `Camera`.

use super::{Misfit, ParsedCalibration, get, lens, one_of, size};
use crate::error::SiteError;
use crate::yaml::{Document, Map};

const WIDTH: &[&str] = &["Camera.width", "Camera.cols"];
const HEIGHT: &[&str] = &["Camera.height", "Camera.rows"];
/// ORB-SLAM 2 has pinholes only, and no key for the type.
const TYPE: &[&str] = &["Camera.type", "Camera.model"];
const NUMBERS: &str =
    "write all numbers of the camera; if its images have no distortion, write 0 for k1, k2, p1, p2";
const RECTIFIED: &str = "calibrate the camera itself; or write the rectified image's `width_px`, `height_px`, `fx`, `fy`, `cx`, `cy` instead of \
     `calibration`, if that is the image of the detector";

/// Returns `true` if a file has the keys of this kind.
pub(super) fn is_of(file: Map<'_>) -> bool {
    prefix(file).is_some()
}

/// Returns the beginning of the keys of the only camera, or of the left one.
fn prefix(file: Map<'_>) -> Option<&'static str> {
    let has = |prefix: &&str| get(file, &format!("{prefix}.fx")).is_some();
    ["Camera1", "Camera"].into_iter().find(has)
}

pub(super) fn read(
    document: &Document<'_>,
    file: Map<'_>,
    site_px: [Option<f64>; 2],
) -> Result<ParsedCalibration, SiteError> {
    let prefix = prefix(file).unwrap_or_default();
    let mut notes = Vec::new();
    let (size_at, size_px) = size(document, file, [WIDTH, HEIGHT], site_px, &mut notes)?;
    // The numbers of ORB-SLAM 2 for a pair are those after rectification.
    if let Some(raw) = file.get("LEFT.K") {
        return Err(document
            .error(
                raw.at.clone(),
                "the settings are those of a pair of cameras, rectified",
            )
            .expected("the settings of one camera")
            .help(RECTIFIED));
    }
    let of_type = one_of(file, TYPE).map(|(_, node)| node);
    let (model, keys) = match of_type.map(|node| document.text(node)).transpose()? {
        None | Some("PinHole" | "Pinhole" | "perspective") => {
            ("plumb_bob", ["k1", "k2", "p1", "p2"])
        }
        Some("KannalaBrandt8" | "fisheye") => ("equidistant", ["k1", "k2", "k3", "k4"]),
        Some(word) => {
            let at = of_type.map_or(0..0, |node| node.at.clone());
            let help = if word == "Rectified" {
                RECTIFIED
            } else {
                "calibrate with one of these models"
            };
            return Err(document
                .error(at, format!("the camera's type is `{word}`"))
                .expected("PinHole or KannalaBrandt8")
                .help(help));
        }
    };
    let number = |key: &&str| {
        let key = format!("{prefix}.{key}");
        let node = document.required(get(file, &key), 0..0, &key, NUMBERS)?;
        let number = document.number(node)?;
        // fx and fy.
        let is_focal = key.ends_with(['x', 'y']) && key.contains(".f");
        if number.is_finite() && (number > 0.0 || !is_focal) {
            return Ok(number);
        }
        let error = document.error(node.at.clone(), format!("{key} is {number}"));
        let expected = if is_focal {
            "pixels, above 0"
        } else {
            "a finite number"
        };
        Err(error.expected(expected).help("calibrate again"))
    };
    let mut projection = [0.0; 4];
    for (value, key) in projection.iter_mut().zip(&["fx", "fy", "cx", "cy"]) {
        *value = number(key)?;
    }
    let mut coefficients = keys.iter().map(number).collect::<Result<Vec<_>, _>>()?;
    if model == "plumb_bob" && get(file, &format!("{prefix}.k3")).is_some() {
        coefficients.push(number(&"k3")?);
    }
    let lens = lens(model, &coefficients).unwrap_or(Err(Misfit::Count(keys.len())));
    let lens = lens.map_err(|_| {
        document
            .error(
                0..0,
                format!("{prefix} has {} coefficients", coefficients.len()),
            )
            .expected("4 or 5")
            .help(NUMBERS)
    })?;
    let mut parsed = ParsedCalibration::of_raw(size_at, size_px, projection, lens);
    parsed.numbers.notes = notes;
    Ok(parsed)
}
