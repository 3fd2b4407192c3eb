//! Nav2's dock database (opennav_docking): the poses of the robot's base when it is docked.

use std::f64::consts::TAU;

use super::Placed;
use super::place::{tidy, tidy_angle};
use crate::site::error::{SiteError, Source};
use crate::site::yaml::{Document, FormatMessages};
use posegate::shape::PoseDeg;

const MESSAGES: FormatMessages = FormatMessages {
    what: "a dock database of Nav2",
    written: "write `docks:` and below it `dock1: {type: \"charging_dock\", frame: map, pose: [1.0, 2.0, 1.57]}`",
    numbers: "write `pose: [x, y, theta]` in metres, metres and radians, as [1.0, 2.0, 1.57]",
    not_finite: "measure the dock's pose again",
    length: "write `pose: [x, y, theta]`: metres, metres, radians; there is no z",
};

/// The frame of a dock without `frame`.
const DEFAULT_FRAME: &str = "map";

/// Returns docks by name, in their common frame. It must be `map` unless the import gives the
/// frame's pose. Nav2 ignores unknown keys, and so does this.
pub(super) fn read(
    source: Source<'_>,
    is_placed: bool,
) -> Result<Vec<(String, Placed<PoseDeg>)>, SiteError> {
    let document = Document::new(source, &MESSAGES)?;
    let root = document.parse()?;
    let file = document.map(&root)?;
    let docks = file.get("docks").ok_or_else(|| {
        document
            .error(0..0, "the file has no `docks`")
            .expected(MESSAGES.what)
            .help(
                "name the file of the docking server's parameter `dock_database`; docks in the server's own \
                 parameters must be moved into that file",
            )
    })?;
    let mut shared: Option<String> = None;
    let mut found = Vec::new();
    for (name, node) in document.map(docks)?.sorted() {
        let at = node.at.clone();
        let key = |key: &str| format!("docks.{name}.{key}");
        let dock = document.map(node)?;
        let kind =
            document.required(dock.get("type"), at.clone(), &key("type"), MESSAGES.written)?;
        document.text(kind)?;
        let (frame, frame_at) = match dock.get("frame") {
            None => (DEFAULT_FRAME, at.clone()),
            Some(frame) => (document.text(frame)?, frame.at.clone()),
        };
        if !is_placed && frame != DEFAULT_FRAME {
            return Err(document
                .error(
                    frame_at,
                    format!("the dock `{name}` is in the frame `{frame}`"),
                )
                .expected("the frame `map`, or the `pose` of this frame")
                .help(format!(
                    "add the `pose` of the frame `{frame}` in the site's world"
                )));
        }
        let first = shared.get_or_insert_with(|| frame.to_owned());
        if first != frame {
            return Err(document
                .error(
                    frame_at,
                    format!(
                        "the dock `{name}` is in the frame `{frame}`, another one in `{first}`"
                    ),
                )
                .expected("one frame for all docks: there is one `pose`")
                .help("write a dock database for each frame, and import each with its `pose`"));
        }
        let list =
            document.required(dock.get("pose"), at.clone(), &key("pose"), MESSAGES.written)?;
        let [x, y, theta] = document.numbers(list, &key("pose"))?;
        if theta.abs() > TAU + 1e-3 {
            return Err(document
                .error(
                    document.place_of(list, 2),
                    format!("the heading of dock `{name}` is {theta} radians"),
                )
                .expected("radians, from -6.2832 to 6.2832")
                .help("90 degrees are 1.5708"));
        }
        let value = PoseDeg {
            x: tidy(x),
            y: tidy(y),
            yaw_deg: tidy_angle(theta.to_degrees()),
        };
        found.push((name.to_owned(), Placed { at, value }));
    }
    Ok(found)
}
