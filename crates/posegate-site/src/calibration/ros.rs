//! The calibration file of ROS's camera_calibration_parsers, its relatives of OpenCV, and CameraInfo messages as text.

use super::{Numbers, ParsedCalibration, lens_of_file, note_rms, one_of, size};
use crate::error::SiteError;
use crate::yaml::{Document, Map, Node};
use posegate::certify::Roi;
use std::borrow::Cow;
use std::ops::Range;

const AS_SAVED: &str = "copy the calibration again as the program saved it: ost.yaml of cameracalibrator, OpenCV's file, or \
     `ros2 topic echo --once CAMERA_INFO`";

const NO_COEFFICIENTS: &str = "copy the calibration again as the program saved it; if the images have no distortion, write \
     `distortion_coefficients: [0, 0, 0, 0, 0]`";

const CALIBRATE: &str = "calibrate it: ros2 run camera_calibration cameracalibrator";

const IDENTITY: [f64; 9] = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];

/// The names of the keys: of ROS, of CameraInfo messages in ROS 2 and in ROS 1, and of OpenCV's samples and tutorials.
const WIDTH: &[&str] = &["image_width", "width", "image_Width"];
const HEIGHT: &[&str] = &["image_height", "height", "image_Height"];
/// A list of width and height, as of CalibDB.
const SIZE: &[&str] = &["img_size", "image_size"];
const MATRIX: &[&str] = &[
    "camera_matrix",
    "k",
    "K",
    "Camera_Matrix",
    "cameraMatrix",
    "mtx",
];
const COEFFICIENTS: &[&str] = &[
    "distortion_coefficients",
    "d",
    "D",
    "Distortion_Coefficients",
    "distCoeffs",
    "dist_coeffs",
    "dist_coeff",
    "dist_coefs",
    "distortion_coeffs",
    "dist",
];
/// Before ROS 2 cameracalibrator wrote `camera_model`.
const MODEL: &[&str] = &["distortion_model", "camera_model"];
const RECTIFICATION: &[&str] = &["rectification_matrix", "r", "R"];
const PROJECTION: &[&str] = &["projection_matrix", "p", "P"];
const RMS: &[&str] = &[
    "avg_reprojection_error",
    "Avg_Reprojection_Error",
    "reprojection_error",
    "rms",
    "RMS",
    "rms_error",
];

/// Returns `true` if a file has the keys of this kind.
pub(super) fn is_of(file: Map<'_>) -> bool {
    one_of(file, MATRIX).is_some()
}

pub(super) fn read(
    document: &Document<'_>,
    file: Map<'_>,
    site_px: [Option<f64>; 2],
) -> Result<ParsedCalibration, SiteError> {
    let required = |names: &[&'static str], help: &str| {
        document.required(one_of(file, names), 0..0, names[0], help)
    };
    let mut notes = Vec::new();
    let (size_at, size_px) = match one_of(file, SIZE) {
        Some((name, node)) => {
            let list = data(document, node, name)?;
            (list.at.clone(), document.numbers(&list, name)?)
        }
        None => size(document, file, [WIDTH, HEIGHT], site_px, &mut notes)?,
    };

    let (name, matrix) = required(MATRIX, AS_SAVED)?;
    let list = data(document, matrix, name)?;
    let [fx, skew, cx, lower, fy, cy, rest @ ..]: [f64; 9] = document.numbers(&list, name)?;
    let fault = |at: usize, what: &str, expected: &str, help: &str| {
        let error = document.error(document.place_of(&list, at), what);
        Err(error.expected(expected).help(help))
    };
    if fx == 0.0 {
        let what = format!("{name}[0], fx, is 0: the camera is not calibrated");
        return fault(0, &what, "a focal length in pixels, above 0", CALIBRATE);
    }
    for (at, focal) in [(0, fx), (4, fy)] {
        if !(focal > 0.0) {
            let what = format!("{name}[{at}] is {focal}");
            return fault(at, &what, "a focal length in pixels, above 0", CALIBRATE);
        }
    }
    if [skew, lower] != [0.0; 2] || rest != [0.0, 0.0, 1.0] {
        let what = format!("{name} is not [fx, 0, cx, 0, fy, cy, 0, 0, 1]");
        return fault(1, &what, "a camera matrix without skew", AS_SAVED);
    }

    // A file without them may have them under another name: a pinhole would be a guess.
    let (name, coefficients) = required(COEFFICIENTS, NO_COEFFICIENTS)?;
    let list = data(document, coefficients, name)?;
    let is_fisheye = match file.get("fisheye_model") {
        Some(node) => document.whole(node)? == 1,
        None => false,
    };
    let lens = if is_fisheye {
        // OpenCV's sample writes the flag instead of a model.
        let numbers = document.finite_numbers(&list, name)?;
        let lens = super::lens("equidistant", &numbers).and_then(Result::ok);
        lens.ok_or_else(|| {
            document
                .error(
                    list.at.clone(),
                    format!("a fisheye_model with {} coefficients", numbers.len()),
                )
                .expected("4 numbers")
                .help(AS_SAVED)
        })?
    } else {
        let model = one_of(file, MODEL).map(|(_, node)| node);
        lens_of_file(document, model, Some(&*list), name, &mut notes)?
    };
    if let Some((_, rms)) = one_of(file, RMS) {
        note_rms(document.number(rms)?, &mut notes);
    }

    let rect = match one_of(file, PROJECTION) {
        None => [fx, fy, cx, cy],
        Some((name, matrix)) => {
            let list = data(document, matrix, name)?;
            projection(document, &list, name)?.unwrap_or([fx, fy, cx, cy])
        }
    };
    let turned = match one_of(file, RECTIFICATION) {
        None => None,
        Some((name, matrix)) => {
            let list = data(document, matrix, name)?;
            let turn: [f64; 9] = document.numbers(&list, name)?;
            (turn != IDENTITY && turn != [0.0; 9]).then(|| turned(document, list.at.clone()))
        }
    };
    let count = |key: &str| match file.get(key) {
        Some(node) => document.whole(node).map(|count| count.max(1)),
        None => Ok(1),
    };
    Ok(ParsedCalibration {
        size_at,
        numbers: Numbers {
            size_px,
            focal_px: [fx, fy],
            axis_px: [cx, cy],
            lens,
            rect,
            turned,
            roi: match file.get("roi") {
                Some(node) => roi(document, node)?,
                None => None,
            },
            binning: [count("binning_x")?, count("binning_y")?],
            notes,
        },
    })
}

fn turned(document: &Document<'_>, at: Range<usize>) -> SiteError {
    document
        .error(
            at,
            "the rectification matrix turns the image: its axes are not the camera's",
        )
        .expected("the identity, as in the calibration of a single camera")
        .help(
            "calibrate this camera of the pair by itself for tags, or read the raw image: `image = \"raw\"`",
        )
}

/// Returns the part of the sensor that a CameraInfo message states; `None` for the whole image.
fn roi(document: &Document<'_>, node: &Node) -> Result<Option<Roi>, SiteError> {
    let keys = document.map(node)?;
    let number = |key: &str| match keys.get(key) {
        Some(node) => document.whole(node),
        None => Ok(0),
    };
    let roi = Roi {
        x_offset: number("x_offset")?,
        y_offset: number("y_offset")?,
        width: number("width")?,
        height: number("height")?,
    };
    Ok((roi.width > 0 && roi.height > 0).then_some(roi))
}

/// Returns fx, fy, cx, cy of a projection matrix; `None` if it is zero. (Its fourth column is the offset to
/// another camera of a pair, and is ignored.)
fn projection(
    document: &Document<'_>,
    list: &Node,
    name: &str,
) -> Result<Option<[f64; 4]>, SiteError> {
    let all: [f64; 12] = document.numbers(list, name)?;
    let [fx, skew, cx, _, lower, fy, cy, _, rest @ ..] = all;
    if all == [0.0; 12] || fx == 0.0 {
        return Ok(None);
    }
    if !(fx > 0.0) || !(fy > 0.0) || [skew, lower] != [0.0; 2] || rest != [0.0, 0.0, 1.0, 0.0] {
        return Err(document
            .error(
                list.at.clone(),
                format!("{name} is not [fx, 0, cx, Tx, 0, fy, cy, Ty, 0, 0, 1, 0]"),
            )
            .expected("a projection matrix without skew")
            .help(AS_SAVED));
    }
    Ok(Some([fx, fy, cx, cy]))
}

/// Returns the list of numbers of a matrix: in the notation of ROS and OpenCV, the list itself, or the rows of a list of rows.
fn data<'n>(
    document: &Document<'_>,
    matrix: &'n Node,
    name: &str,
) -> Result<Cow<'n, Node>, SiteError> {
    if matrix.is_list() {
        return Ok(matrix.rows());
    }
    let data = document.map(matrix)?.get("data");
    let data = document.required(data, matrix.at.clone(), &format!("{name}.data"), AS_SAVED)?;
    Ok(data.rows())
}
