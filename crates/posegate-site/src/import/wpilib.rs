//! WPILib's field layout: tags in the field's frame, x out of the face.

use super::Placed;
use super::place::{Frame, LENGTH_SLACK};
use crate::error::{SiteError, Source};
use crate::json::Value;

const FILE: &str = "{ \"tags\": [ ... ], \"field\": { \"length\": 16.5, \"width\": 8.1 } }, as WPILib's field layouts are";
const TAG: &str = "{ \"ID\": 7, \"pose\": { \"translation\": { ... }, \"rotation\": { ... } } }";
const POSE: &str = "{ \"translation\": { ... }, \"rotation\": { ... } }";
const TRANSLATION: &str = "{ \"x\": 4.0, \"y\": 0.0, \"z\": 0.5 }";
const ROTATION: &str = "{ \"quaternion\": { \"W\": 1.0, \"X\": 0.0, \"Y\": 0.0, \"Z\": 0.0 } }";
const QUATERNION: &str = "{ \"W\": 1.0, \"X\": 0.0, \"Y\": 0.0, \"Z\": 0.0 }";
const FIELD: &str = "{ \"length\": 16.5, \"width\": 8.1 }";

/// Returns the tags' numbers and their poses in the field.
pub(super) fn read(source: Source<'_>) -> Result<Vec<Placed<(u32, Frame)>>, SiteError> {
    let file = Value::root(source)?;
    // Since 2026 WPILib names both keys differently.
    let tags = match file.optional("field-tags", FILE)? {
        Some(tags) => tags,
        None => file.required("tags", FILE)?,
    };
    let field = match file.optional("field-dimensions", FILE)? {
        None => file.optional("field", FILE)?,
        field => field,
    };
    let reach = match field {
        Some(field) => Some([
            field.required("length", FIELD)?.number()?,
            field.required("width", FIELD)?.number()?,
        ]),
        None => None,
    };
    tags.list("[ ... ]")?
        .iter()
        .map(|tag| {
            let id = tag.required("ID", TAG)?;
            let pose = tag.required("pose", TAG)?;
            Ok(Placed {
                at: id.span(),
                value: (id.whole()?, frame(&pose, reach)?),
            })
        })
        .collect()
}

fn frame(pose: &Value<'_>, reach: Option<[f64; 2]>) -> Result<Frame, SiteError> {
    let translation = pose.required("translation", POSE)?;
    let [x, y, z] = ["x", "y", "z"].map(|name| translation.required(name, TRANSLATION)?.number());
    let at = [x?, y?, z?];
    // No tag is farther from the field than the field's own size: larger numbers are not metres.
    let [length, width] = reach.unwrap_or([f64::INFINITY; 2]);
    for (name, at, reach) in [("x", at[0], length), ("y", at[1], width)] {
        if at > 2.0 * reach || at < -reach {
            let value = translation.required(name, TRANSLATION)?;
            return Err(value
                .error(format!(
                    "{} is {at}, far outside the field of {length} m x {width} m",
                    value.title()
                ))
                .expected("metres in the field's frame")
                .help("convert the file to metres, its `field` too"));
        }
    }
    let quaternion = pose
        .required("rotation", POSE)?
        .required("quaternion", ROTATION)?;
    let [w, x, y, z] =
        ["W", "X", "Y", "Z"].map(|name| quaternion.required(name, QUATERNION)?.number());
    Frame::of_quaternion(at, [w?, x?, y?, z?]).map_err(|length| {
        quaternion
            .error(format!("{} has length {length:.4}", quaternion.title()))
            .expected(format!("a unit quaternion: length 1 within {LENGTH_SLACK}"))
            .help("write all digits; W is the cosine of half the angle")
    })
}
