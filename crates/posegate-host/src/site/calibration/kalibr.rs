//! Kalibr's camchain: several cameras in one file.

use std::collections::BTreeMap;

use serde::Deserialize;

use super::{Numbers, ParsedCalibration, lens};
use crate::site::error::SiteError;
use crate::site::suggest;
use crate::site::yaml::{Document, Spanned, plain};

#[derive(Deserialize)]
struct Camera {
    camera_model: Option<Spanned<String>>,
    intrinsics: Option<Spanned<Vec<Spanned<f64>>>>,
    distortion_model: Option<Spanned<String>>,
    distortion_coeffs: Option<Spanned<Vec<Spanned<f64>>>>,
    resolution: Option<Spanned<Vec<Spanned<f64>>>>,
}

const AS_SAVED: &str = "copy the camchain again as Kalibr saved it";

pub(super) fn read(
    document: &Document<'_>,
    name: Option<&str>,
) -> Result<ParsedCalibration, SiteError> {
    let mut cameras: BTreeMap<String, Spanned<Camera>> = document.read()?;
    let names = || suggest::list(cameras.keys().map(String::as_str));
    let name = match name {
        Some(name) => String::from(name),
        None if cameras.len() == 1 => cameras.keys().next().cloned().unwrap_or_default(),
        None => {
            let message = format!("the camchain has several cameras: {}", names());
            return Err(document
                .error(0..0, message)
                .expected("the name of one of them after the file's name")
                .help("write `calibration = \"FILE#cam0\"`"));
        }
    };
    if !cameras.contains_key(&name) {
        let message = format!("the camchain has no camera `{name}`");
        return Err(document
            .error(0..0, message)
            .expected(format!("one of {}", names()))
            .help("write `calibration = \"FILE#cam0\"`"));
    }
    let Some(camera) = cameras.remove(&name) else {
        return Err(document.error(0..0, "no camera"));
    };
    of_camera(document, &name, camera)
}

fn of_camera(
    document: &Document<'_>,
    name: &str,
    camera: Spanned<Camera>,
) -> Result<ParsedCalibration, SiteError> {
    let at = document.span(camera.referenced);
    let camera = camera.value;
    let key = |key: &str| format!("{name}.{key}");
    let unknown = |word: &Spanned<String>, what: &str, expected: &str, help: &str| {
        let message = format!("the {what} {:?} is not supported", word.value);
        let error = document.error(document.span(word.referenced), message);
        error.expected(expected).help(help)
    };

    let model = document.required(
        camera.camera_model,
        at.clone(),
        &key("camera_model"),
        AS_SAVED,
    )?;
    if model.value != "pinhole" {
        let help = "calibrate with `--models pinhole-radtan` or `pinhole-equi`";
        return Err(unknown(&model, "camera model", "pinhole", help));
    }
    let list = document.required(camera.intrinsics, at.clone(), &key("intrinsics"), AS_SAVED)?;
    let [fx, fy, cx, cy] = document.numbers(&list, "intrinsics")?;
    if !(fx > 0.0) || !(fy > 0.0) {
        let message = format!("the focal lengths are {fx} and {fy}");
        return Err(document
            .error(document.span(list.referenced), message)
            .expected("fu, fv, pu, pv in pixels, fu and fv above 0")
            .help("calibrate again"));
    }
    let resolution =
        document.required(camera.resolution, at.clone(), &key("resolution"), AS_SAVED)?;
    let size_px: [f64; 2] = document.numbers(&resolution, "resolution")?;

    let name = key("distortion_model");
    let model = document.required(camera.distortion_model, at.clone(), &name, AS_SAVED)?;
    let name = key("distortion_coeffs");
    let list = match model.value.as_str() {
        "none" => None,
        _ => Some(document.required(camera.distortion_coeffs, at, &name, AS_SAVED)?),
    };
    let numbers = list
        .as_ref()
        .map_or_else(Vec::new, |list| plain(&list.value));
    if let Some(list) = &list {
        document.finite(list, "distortion_coeffs")?;
    }
    let found = match (model.value.as_str(), numbers.as_slice()) {
        ("none", _) => lens("plumb_bob", &[0.0; 5]),
        // Kalibr's radtan is plumb_bob without k3.
        ("radtan", [k1, k2, p1, p2]) => lens("plumb_bob", &[*k1, *k2, *p1, *p2, 0.0]),
        ("equidistant", _) => lens("equidistant", &numbers),
        ("radtan", _) => Some(Err(4)),
        _ => None,
    };
    let lens = match found {
        Some(Ok(lens)) => lens,
        Some(Err(needed)) => {
            let at = list.map_or(0..0, |list| document.span(list.referenced));
            let message = format!(
                "distortion_coeffs has {} numbers, {} has {needed}",
                numbers.len(),
                model.value
            );
            let error = document.error(at, message);
            return Err(error.expected(format!("{needed} numbers")).help(AS_SAVED));
        }
        None => {
            let help = "calibrate with `--models pinhole-radtan` or `pinhole-equi`";
            let expected = "radtan, equidistant or none";
            return Err(unknown(&model, "distortion model", expected, help));
        }
    };
    Ok(ParsedCalibration {
        size_at: document.span(resolution.referenced),
        numbers: Numbers {
            size_px,
            focal_px: [fx, fy],
            axis_px: [cx, cy],
            lens,
            rect: [fx, fy, cx, cy],
            turned: None,
        },
    })
}
