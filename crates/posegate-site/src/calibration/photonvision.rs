//! PhotonVision's calibration in JSON, which OpenCV's calibrateCamera made.

use super::{Misfit, ParsedCalibration, lens};
use crate::error::{SiteError, Source};
use crate::json::Value;

const FILE: &str = "{ \"resolution\": { ... }, \"cameraIntrinsics\": { ... }, \"distCoeffs\": { ... } }, as PhotonVision exports it";
const SIZE: &str = "{ \"width\": 640.0, \"height\": 480.0 }";
const MATRIX: &str = "{ \"rows\": 3, \"cols\": 3, \"type\": 6, \"data\": [ ... ] }";

pub(super) fn read(source: Source<'_>) -> Result<ParsedCalibration, SiteError> {
    let file = Value::root(source)?;
    let size = file.required("resolution", FILE)?;
    let side = |key: &str| {
        let value = size.required(key, SIZE)?;
        let number = value.number()?;
        if (1.0..=100_000.0).contains(&number) && number == libm::floor(number) {
            return Ok(number);
        }
        Err(value
            .error(format!("{} is {number}", value.title()))
            .expected("a whole number of pixels, from 1 to 100000")
            .help(format!("write it like {SIZE}")))
    };
    let size_px = [side("width")?, side("height")?];
    let numbers = |key: &str| {
        let data = file.required(key, FILE)?.required("data", MATRIX)?;
        let list = data.list("[ ... ]")?;
        let numbers = list
            .iter()
            .map(Value::number)
            .collect::<Result<Vec<f64>, _>>()?;
        Ok::<_, SiteError>((data, numbers))
    };
    let (data, matrix) = numbers("cameraIntrinsics")?;
    let (fx, fy, cx, cy) = match *matrix.as_slice() {
        [fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0] if fx > 0.0 && fy > 0.0 => (fx, fy, cx, cy),
        _ => {
            return Err(data
                .error(format!(
                    "{} is not [fx, 0, cx, 0, fy, cy, 0, 0, 1]",
                    data.title()
                ))
                .expected("a camera matrix without skew, focal lengths above 0")
                .help("export the calibration again"));
        }
    };
    if let Some(model) = file.optional("lensmodel", FILE)?
        && !model
            .text("\"LENSMODEL_OPENCV\"")?
            .starts_with("LENSMODEL_OPENCV")
    {
        return Err(model
            .error(format!("{} is not a model of OpenCV", model.title()))
            .expected("LENSMODEL_OPENCV")
            .help("calibrate again with the model of OpenCV"));
    }
    // Until 2024 PhotonVision had the coefficients in `cameraExtrinsics`.
    let has = |key: &str| Ok::<_, SiteError>(file.optional(key, FILE)?.is_some());
    let is_old = !has("distCoeffs")? && has("cameraExtrinsics")?;
    let (data, coefficients) = numbers(if is_old {
        "cameraExtrinsics"
    } else {
        "distCoeffs"
    })?;
    // It writes 5 or 8 numbers, and wrote 4 with `isFisheye`.
    let is_fisheye = match file.optional("isFisheye", FILE)? {
        Some(flag) => flag.truth()?,
        None => false,
    };
    let model = match coefficients.len() {
        _ if is_fisheye => "equidistant",
        ..=5 => "plumb_bob",
        _ => "rational_polynomial",
    };
    let lens = lens(model, &coefficients).unwrap_or(Err(Misfit::Count(8)));
    let lens = lens.map_err(|misfit| {
        let what = match misfit {
            Misfit::Count(_) => format!("{} numbers", coefficients.len()),
            Misfit::Terms(terms) => terms.to_owned(),
        };
        data.error(format!("{} has {what}", data.title()))
            .expected(
                "4, 5 or 8 coefficients of OpenCV (4 of its fisheye model), or zeros after them",
            )
            .help("calibrate again with PhotonVision")
    })?;
    Ok(ParsedCalibration::of_raw(
        size.span(),
        size_px,
        [fx, fy, cx, cy],
        lens,
    ))
}
