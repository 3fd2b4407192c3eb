//! The camera files of VINS-Mono and VINS-Fusion (camodocal).

use super::{ParsedCalibration, side};
use crate::error::SiteError;
use crate::yaml::{Document, Map};
use posegate::shape::Lens;

const AS_SAVED: &str = "copy the camera file again as it was saved";

/// Returns `true` if a file has the keys of this kind.
pub(super) fn is_of(file: Map<'_>) -> bool {
    file.get("model_type").is_some() && file.get("projection_parameters").is_some()
}

pub(super) fn read(document: &Document<'_>, file: Map<'_>) -> Result<ParsedCalibration, SiteError> {
    let required = |key: &str| document.required(file.get(key), 0..0, key, AS_SAVED);
    let width = required("image_width")?;
    let size_px = [
        side(document, width)?,
        side(document, required("image_height")?)?,
    ];
    let model = required("model_type")?;
    let numbers = |section: &str, keys: [&str; 4]| {
        let node = required(section)?;
        let map = document.map(node)?;
        let number = |key: &str| {
            let value = document.required(
                map.get(key),
                node.at.clone(),
                &format!("{section}.{key}"),
                AS_SAVED,
            )?;
            let number = document.number(value)?;
            if number.is_finite() {
                return Ok(number);
            }
            let error = document.error(value.at.clone(), format!("{section}.{key} is {number}"));
            Err(error.expected("a finite number").help("calibrate again"))
        };
        let [a, b, c, d] = keys.map(number);
        Ok::<_, SiteError>([a?, b?, c?, d?])
    };
    let ([fx, fy, cx, cy], lens) = match document.text(model)? {
        "PINHOLE" => {
            let [k1, k2, p1, p2] = numbers("distortion_parameters", ["k1", "k2", "p1", "p2"])?;
            let projection = numbers("projection_parameters", ["fx", "fy", "cx", "cy"])?;
            let coefficients = [k1, k2, p1, p2, 0.0];
            let lens = if coefficients == [0.0; 5] {
                Lens::Pinhole
            } else {
                Lens::PlumbBob(coefficients)
            };
            (projection, lens)
        }
        "PINHOLE_FULL" => {
            let [k1, k2, p1, p2] = numbers("distortion_parameters", ["k1", "k2", "p1", "p2"])?;
            let [k3, k4, k5, k6] = numbers("distortion_parameters", ["k3", "k4", "k5", "k6"])?;
            let projection = numbers("projection_parameters", ["fx", "fy", "cx", "cy"])?;
            let coefficients = [k1, k2, p1, p2, k3, k4, k5, k6];
            (projection, Lens::RationalPolynomial(coefficients))
        }
        "KANNALA_BRANDT" => {
            let projection = numbers("projection_parameters", ["mu", "mv", "u0", "v0"])?;
            let coefficients = numbers("projection_parameters", ["k2", "k3", "k4", "k5"])?;
            (projection, Lens::Equidistant(coefficients))
        }
        other => {
            let message = format!("the camera model `{other}` is not supported");
            return Err(document
                .error(model.at.clone(), message)
                .expected("PINHOLE, PINHOLE_FULL or KANNALA_BRANDT")
                .help("calibrate with one of these models"));
        }
    };
    if !(fx > 0.0) || !(fy > 0.0) {
        let message = format!("the focal lengths are {fx} and {fy}");
        let at = required("projection_parameters")?.at.clone();
        let error = document.error(at, message);
        return Err(error.expected("pixels, above 0").help("calibrate again"));
    }
    Ok(ParsedCalibration::of_raw(
        width.at.clone(),
        size_px,
        [fx, fy, cx, cy],
        lens,
    ))
}
