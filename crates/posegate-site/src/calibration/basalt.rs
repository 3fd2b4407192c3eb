//! Basalt's calibration in JSON: `value0`, with lists `intrinsics` and `resolution`.

use super::{ParsedCalibration, chosen, lens};
use crate::error::SiteError;
use crate::yaml::{Document, Map};
use posegate::shape::Lens;

const AS_SAVED: &str = "copy the calibration again as Basalt saved it";

/// Returns `true` if a file has the keys of this kind.
pub(super) fn is_of(file: Map<'_>) -> bool {
    let inner = file.get("value0").and_then(|value| value.as_map());
    inner.is_some_and(|inner| inner.get("intrinsics").is_some())
}

pub(super) fn read(
    document: &Document<'_>,
    file: Map<'_>,
    name: Option<&str>,
) -> Result<ParsedCalibration, SiteError> {
    let required = |map: Map<'_>, key: &str| {
        let node = document.required(map.get(key).cloned(), 0..0, key, AS_SAVED)?;
        Ok::<_, SiteError>(node)
    };
    let value = required(file, "value0")?;
    let value = document.map(&value)?;
    let cameras = required(value, "intrinsics")?;
    let (index, camera) = chosen(document, document.list(&cameras)?, name)?;
    let sizes = required(value, "resolution")?;
    let size = document.list(&sizes)?.get(index);
    let size = document.required(size, sizes.at.clone(), "resolution", AS_SAVED)?;
    let size_px: [f64; 2] = document.numbers(size, "resolution")?;

    let camera = document.map(camera)?;
    let model = required(camera, "camera_type")?;
    let (kind, keys) = match document.text(&model)? {
        "pinhole" => ("plumb_bob", &[][..]),
        "kb4" => ("equidistant", &["k1", "k2", "k3", "k4"][..]),
        "pinhole-radtan8" => (
            "rational_polynomial",
            &["k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"][..],
        ),
        other => {
            return Err(document
                .error(
                    model.at.clone(),
                    format!("the camera model `{other}` is not supported"),
                )
                .expected("pinhole, kb4 or pinhole-radtan8")
                .help("calibrate with `--cam-types kb4` or `pinhole-radtan8`"));
        }
    };
    let numbers = required(camera, "intrinsics")?;
    let map = document.map(&numbers)?;
    let number = |key: &&str| {
        let node = required(map, key)?;
        let number = document.number(&node)?;
        if number.is_finite() && (number > 0.0 || !key.starts_with('f')) {
            return Ok(number);
        }
        let error = document.error(node.at, format!("{key} is {number}"));
        Err(error
            .expected("a finite number, fx and fy above 0")
            .help("calibrate again"))
    };
    let [fx, fy, cx, cy] = ["fx", "fy", "cx", "cy"].map(|key| number(&key));
    let coefficients = keys.iter().map(number).collect::<Result<Vec<_>, _>>()?;
    // The numbers of the coefficients are those of the models.
    let lens = lens(kind, &coefficients).and_then(Result::ok);
    let projection = [fx?, fy?, cx?, cy?];
    Ok(ParsedCalibration::of_raw(
        size.at.clone(),
        size_px,
        projection,
        lens.unwrap_or(Lens::Pinhole),
    ))
}
