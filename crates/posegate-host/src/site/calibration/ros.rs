//! The calibration file of ROS's camera_calibration_parsers.

use super::{Numbers, ParsedCalibration, lens};
use crate::site::error::SiteError;
use crate::site::yaml::{Document, Map, Node};

const AS_SAVED: &str = "copy the calibration file again as cameracalibrator saved it (ost.yaml)";

const WHICH_MODEL: &str = "write `distortion_model: plumb_bob` for the 5 coefficients of OpenCV's calibrateCamera, \
     `rational_polynomial` for 8, `equidistant` for the 4 of its fisheye model; OpenCV's own files do not say which";

const CALIBRATE: &str = "calibrate it: ros2 run camera_calibration cameracalibrator";

const IDENTITY: [f64; 9] = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];

pub(super) fn read(document: &Document<'_>, file: Map<'_>) -> Result<ParsedCalibration, SiteError> {
    let required = |name: &str, help: &str| document.required(file.get(name), 0..0, name, help);
    let width = required("image_width", AS_SAVED)?;
    let height = required("image_height", AS_SAVED)?;
    let size_px = [
        f64::from(document.whole(width)?),
        f64::from(document.whole(height)?),
    ];

    let list = data(
        document,
        required("camera_matrix", AS_SAVED)?,
        "camera_matrix",
    )?;
    let [fx, skew, cx, lower, fy, cy, rest @ ..]: [f64; 9] =
        document.numbers(list, "camera_matrix")?;
    let fault = |at: usize, what: &str, expected: &str, help: &str| {
        let error = document.error(document.place_of(list, at), what);
        Err(error.expected(expected).help(help))
    };
    if fx == 0.0 {
        let what = "camera_matrix[0], fx, is 0: the camera is not calibrated";
        return fault(0, what, "a focal length in pixels, above 0", CALIBRATE);
    }
    for (at, focal) in [(0, fx), (4, fy)] {
        if !(focal > 0.0) {
            let what = format!("camera_matrix[{at}] is {focal}");
            return fault(at, &what, "a focal length in pixels, above 0", CALIBRATE);
        }
    }
    if [skew, lower] != [0.0; 2] || rest != [0.0, 0.0, 1.0] {
        let what = "camera_matrix is not [fx, 0, cx, 0, fy, cy, 0, 0, 1]";
        return fault(1, what, "a camera matrix without skew", AS_SAVED);
    }

    let model_at = required("distortion_model", WHICH_MODEL)?;
    let model = document.text(model_at)?;
    let name = "distortion_coefficients";
    let list = data(document, required(name, AS_SAVED)?, name)?;
    let coefficients = document.finite_numbers(list, name)?;
    let lens = match lens(model, &coefficients) {
        Some(Ok(lens)) => lens,
        Some(Err(wanted)) => {
            let found = coefficients.len();
            let message = format!("{name} has {found} numbers, {model} has {wanted}");
            return Err(document
                .error(list.at.clone(), message)
                .expected(format!("{wanted} numbers"))
                .help(WHICH_MODEL));
        }
        None => {
            let message = format!(
                "the distortion model `{}` is not known",
                document.quote(model_at)
            );
            return Err(document
                .error(model_at.at.clone(), message)
                .expected("plumb_bob, rational_polynomial or equidistant")
                .help(WHICH_MODEL));
        }
    };

    let rect = match file.get("projection_matrix") {
        None => [fx, fy, cx, cy],
        Some(matrix) => {
            let list = data(document, matrix, "projection_matrix")?;
            projection(document, list)?.unwrap_or([fx, fy, cx, cy])
        }
    };
    let turned = match file.get("rectification_matrix") {
        None => None,
        Some(matrix) => {
            let list = data(document, matrix, "rectification_matrix")?;
            let turn: [f64; 9] = document.numbers(list, "rectification_matrix")?;
            (turn != IDENTITY && turn != [0.0; 9]).then(|| {
                document
                    .error(
                        list.at.clone(),
                        "the rectification matrix turns the image: its axes are not the camera's",
                    )
                    .expected("the identity, as in the calibration of a single camera")
                    .help(
                        "calibrate this camera of the pair by itself for tags, or read the raw image: `image = \"raw\"`",
                    )
            })
        }
    };
    Ok(ParsedCalibration {
        size_at: width.at.clone(),
        numbers: Numbers {
            size_px,
            focal_px: [fx, fy],
            axis_px: [cx, cy],
            lens,
            rect,
            turned,
        },
    })
}

/// Returns fx, fy, cx, cy of a projection matrix; `None` if it is zero. (Its fourth column is the offset to
/// another camera of a pair, and is ignored.)
fn projection(document: &Document<'_>, list: &Node) -> Result<Option<[f64; 4]>, SiteError> {
    let all: [f64; 12] = document.numbers(list, "projection_matrix")?;
    let [fx, skew, cx, _, lower, fy, cy, _, rest @ ..] = all;
    if all == [0.0; 12] || fx == 0.0 {
        return Ok(None);
    }
    if !(fx > 0.0) || !(fy > 0.0) || [skew, lower] != [0.0; 2] || rest != [0.0, 0.0, 1.0, 0.0] {
        return Err(document
            .error(
                list.at.clone(),
                "projection_matrix is not [fx, 0, cx, Tx, 0, fy, cy, Ty, 0, 0, 1, 0]",
            )
            .expected("a projection matrix without skew")
            .help(AS_SAVED));
    }
    Ok(Some([fx, fy, cx, cy]))
}

/// Returns the list of numbers of a matrix in the notation of ROS and OpenCV.
fn data<'n>(document: &Document<'_>, matrix: &'n Node, name: &str) -> Result<&'n Node, SiteError> {
    let data = document.map(matrix)?.get("data");
    document.required(data, matrix.at.clone(), &format!("{name}.data"), AS_SAVED)
}
