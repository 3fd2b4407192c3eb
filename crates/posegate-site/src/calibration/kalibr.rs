//! Kalibr's camchain, and those of OpenVINS and TagSLAM: several cameras in one file. EuRoC's `sensor.yaml`: the same keys of one camera.

use super::{ParsedCalibration, is_camera, lens_of_file, listed_size};
use crate::error::SiteError;
use crate::suggest;
use crate::yaml::{Document, Map, Node};
use std::ops::Range;

const AS_SAVED: &str = "copy the camchain again as Kalibr saved it";

pub(super) fn read(
    document: &Document<'_>,
    file: Map<'_>,
    name: Option<&str>,
    site_px: [Option<f64>; 2],
) -> Result<ParsedCalibration, SiteError> {
    // Users add keys of their own: transforms, notes.
    let mut cameras = file.sorted();
    cameras.retain(|(name, _)| is_camera(name));
    let names = || suggest::list(cameras.iter().map(|(name, _)| *name));
    let name = match (name, cameras.as_slice()) {
        (Some(name), _) => name,
        (None, [(name, _)]) => name,
        (None, _) => {
            let message = format!("the camchain has several cameras: {}", names());
            return Err(document
                .error(0..0, message)
                .expected("the name of one of them after the file's name")
                .help("write `calibration = \"FILE#cam0\"`"));
        }
    };
    let Some(camera) = file.get(name) else {
        let message = format!("the camchain has no camera `{name}`");
        return Err(document
            .error(0..0, message)
            .expected(format!("one of {}", names()))
            .help("write `calibration = \"FILE#cam0\"`"));
    };
    let keys = document.map(camera)?;
    of_camera(document, name, keys, camera.at.clone(), site_px)
}

/// Returns `true` if the file has the keys of one camera.
pub(super) fn is_of(keys: Map<'_>) -> bool {
    keys.get("intrinsics").is_some() && keys.get("camera_model").is_some()
}

/// Reads a file with the keys of one camera.
pub(super) fn read_one(
    document: &Document<'_>,
    keys: Map<'_>,
    site_px: [Option<f64>; 2],
) -> Result<ParsedCalibration, SiteError> {
    of_camera(document, "the file", keys, 0..0, site_px)
}

fn of_camera(
    document: &Document<'_>,
    name: &str,
    keys: Map<'_>,
    at: Range<usize>,
    site_px: [Option<f64>; 2],
) -> Result<ParsedCalibration, SiteError> {
    let required = |key: &str| {
        document.required(
            keys.get(key),
            at.clone(),
            &format!("{name}.{key}"),
            AS_SAVED,
        )
    };
    let unknown = |node: &Node, what: &str, expected: &str, help: &str| {
        let message = format!("the {what} `{}` is not supported", document.quote(node));
        let error = document.error(node.at.clone(), message);
        error.expected(expected).help(help)
    };

    let model = required("camera_model")?;
    let word = document.text(model)?;
    if word != "pinhole" {
        let help = "calibrate with `--models pinhole-radtan` or `pinhole-equi`";
        return Err(unknown(model, "camera model", "pinhole", help));
    }
    let list = required("intrinsics")?;
    let [fx, fy, cx, cy] = document.numbers(list, "intrinsics")?;
    if !(fx > 0.0) || !(fy > 0.0) {
        let message = format!("the focal lengths are {fx} and {fy}");
        return Err(document
            .error(list.at.clone(), message)
            .expected("fu, fv, pu, pv in pixels, fu and fv above 0")
            .help("calibrate again"));
    }
    let mut notes = Vec::new();
    let in_file = format!("{name}.resolution");
    let list = keys.get("resolution");
    let place = (at.clone(), in_file.as_str());
    let (size_at, size_px) = listed_size(document, list, place, site_px, &mut notes)?;

    let model = required("distortion_model")?;
    let list = match document.text(model)? {
        "none" => None,
        // EuRoC's name.
        _ => Some(match keys.get("distortion_coefficients") {
            Some(list) => list,
            None => required("distortion_coeffs")?,
        }),
    };
    let lens = lens_of_file(document, Some(model), list, "distortion_coeffs", &mut notes)?;
    let mut parsed = ParsedCalibration::of_raw(size_at, size_px, [fx, fy, cx, cy], lens);
    parsed.numbers.notes = notes;
    Ok(parsed)
}
