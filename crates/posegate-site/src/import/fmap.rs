//! Limelight's field map: tags in the frame of the field's middle, x out of the face, sizes in millimetres.

use super::place::{Frame, LENGTH_SLACK, Matrix};
use super::{Placed, is_size};
use crate::error::{SiteError, Source};
use crate::families::{FAMILIES, meant_family};
use crate::json::Value;
use crate::suggest;

const FILE: &str = "{ \"fiducials\": [ ... ], \"type\": \"frc\" }, as Limelight's field maps are";
const TAG: &str = "{ \"family\": \"apriltag3_36h11_classic\", \"id\": 7, \"size\": 165.1, \"transform\": [ ... ] }";
const TRANSFORM: &str =
    "16 numbers, row by row: [-1, 0, 0, 3.0,  0, -1, 0, 0.5,  0, 0, 1, 1.2,  0, 0, 0, 1]";

/// The tags of a file.
pub(super) struct Found {
    /// The family of all tags, as detectors name it.
    pub family: &'static str,
    /// Each tag's number, size (m) and pose.
    pub tags: Vec<Placed<(u32, f64, Frame)>>,
}

pub(super) fn read(source: Source<'_>) -> Result<Found, SiteError> {
    let file = Value::root(source)?;
    let mut family = None;
    let mut tags = Vec::new();
    for tag in file.required("fiducials", FILE)?.list("[ ... ]")? {
        let id = tag.required("id", TAG)?;
        let named = tag.required("family", TAG)?;
        let own = meant_family(named.text("\"apriltag3_36h11_classic\"")?).ok_or_else(|| {
            named
                .error(format!("{} is not a known family", named.title()))
                .expected(format!("one of {}", suggest::list(FAMILIES.into_iter())))
                .help("write the name of the family that is printed, as tag36h11")
        })?;
        if *family.get_or_insert(own) != own {
            return Err(named
                .error(format!(
                    "{} is another family than that of the tags before",
                    named.title()
                ))
                .expected("one family in a file")
                .help("cut the file into one for each family"));
        }
        let written = tag.required("size", TAG)?;
        let size = written.number()? / 1000.0;
        if !is_size(size) || size < 1e-3 {
            return Err(written
                .error(format!("{} is {} m", written.title(), size))
                .expected("millimetres: the black border's outer edge")
                .help("write 165.1 for 16.51 cm"));
        }
        let list = tag.required("transform", TAG)?;
        tags.push(Placed {
            at: id.span(),
            value: (id.whole()?, size, frame(&list)?),
        });
    }
    Ok(Found {
        family: family.unwrap_or_default(),
        tags,
    })
}

fn frame(list: &Value<'_>) -> Result<Frame, SiteError> {
    let numbers = list.list(TRANSFORM)?;
    let numbers = numbers
        .iter()
        .map(Value::number)
        .collect::<Result<Vec<f64>, _>>()?;
    let fault = |what: String| {
        list.error(format!("{} {what}", list.title()))
            .expected("a rigid transform with its last row 0, 0, 0, 1")
            .help(format!("write {TRANSFORM}"))
    };
    let Ok([a, b, c, x, d, e, f, y, g, h, i, z, last @ ..]) = <[f64; 16]>::try_from(numbers) else {
        return Err(fault("is not 16 numbers".into()));
    };
    if last != [0.0, 0.0, 0.0, 1.0] {
        return Err(fault("has another last row than 0, 0, 0, 1".into()));
    }
    let turn: Matrix = [[a, b, c], [d, e, f], [g, h, i]];
    Frame::of_rotation([x, y, z], turn).ok_or_else(|| {
        fault(format!(
            "has no rotation: its rows are not unit vectors at right angles within {LENGTH_SLACK}"
        ))
    })
}
