//! Calibration files: ROS camera calibrations and Kalibr camchains, in YAML.

use std::path::Path;

use super::error::{SiteError, Source};
use super::named::NamedFile;
use super::reader::Node;
use super::yaml::{Document, FormatMessages};
use crate::input::{self, Limit};
use posegate::shape::Lens;

mod kalibr;
mod ros;

const MESSAGES: FormatMessages = FormatMessages {
    what: "a calibration in YAML",
    written: "use the file as cameracalibrator or Kalibr wrote it: `key: value` lines, lists in [ ]",
    numbers: "write numbers plainly, as 615.0 or 6.15e+02; if a calibration has .Nan, it has failed: calibrate \
              again",
    not_finite: "the calibration has failed: calibrate again",
    length: "copy the calibration file again as it was saved",
};

/// The camera parameters in a calibration.
pub(super) struct Numbers {
    pub(super) size_px: [f64; 2],
    /// fx and fy of the raw image.
    pub(super) focal_px: [f64; 2],
    /// cx and cy of the raw image.
    pub(super) axis_px: [f64; 2],
    pub(super) lens: Lens,
    /// fx, fy, cx, cy of the rectified image.
    pub(super) rect: [f64; 4],
    /// The error to report if the rectified image is used: its axes are not the camera's. `None` if it
    /// is usable.
    pub(super) turned: Option<SiteError>,
}

/// Reads the calibration file that a site's camera names. Also returns the file. Refuses a calibration for another
/// image size than the site's.
pub(super) fn read(
    node: &Node<'_>,
    size_px: [Option<f64>; 2],
) -> Result<(Numbers, NamedFile), SiteError> {
    let named = node.text()?;
    let (file, camera) = match named.rsplit_once('#') {
        Some((file, camera)) => (file, Some(camera)),
        None => (named, None),
    };
    let folder = Path::new(node.file()).parent().unwrap_or(Path::new(""));
    let path = folder.join(file);
    let bytes = input::read_file(&path, Limit::CALIBRATION).map_err(|cause| {
        let message = format!("the calibration {} cannot be read: {cause}", path.display());
        node.error(message)
            .help("write the file's path relative to the site file's folder")
    })?;
    let read = NamedFile::new(&path, &bytes);
    let name = path.to_string_lossy();
    let text = String::from_utf8(bytes).map_err(|_| {
        node.error(format!("the calibration {name} is not UTF-8"))
            .help("save the file in the encoding UTF-8")
    })?;
    let source = Source {
        file: &name,
        text: &text,
    };
    let document = Document::new(source, &MESSAGES)?;
    let root = document.parse()?;
    let keys = document.map(&root)?;
    let numbers = if keys.keys().any(is_camera) {
        kalibr::read(&document, keys, camera)?
    } else if keys.get("camera_matrix").is_some() {
        if let Some(camera) = camera {
            return Err(node
                .error(format!("{name} is a ROS calibration, of one camera"))
                .help(format!("remove `#{camera}`")));
        }
        ros::read(&document, keys)?
    } else {
        return Err(source
            .error(0..0, "the file is not a known kind of calibration")
            .expected("`camera_matrix` (a ROS camera calibration) or `cam0` (a Kalibr camchain)")
            .help(
                "use the file that ROS's cameracalibrator saves as ost.yaml, or Kalibr's camchain; of a CameraInfo \
                 message write its d, k, r and p as distortion_coefficients, camera_matrix, rectification_matrix and \
                 projection_matrix",
            ));
    };
    Ok((numbers.for_size(&document, size_px)?, read))
}

/// Returns `true` if a key is the name of a camera in a Kalibr camchain.
fn is_camera(key: &str) -> bool {
    key.strip_prefix("cam")
        .is_some_and(|number| !number.is_empty() && number.bytes().all(|b| b.is_ascii_digit()))
}

/// The contents of a calibration file, and the position of its image size.
struct ParsedCalibration {
    numbers: Numbers,
    size_at: std::ops::Range<usize>,
}

impl ParsedCalibration {
    fn for_size(
        self,
        document: &Document<'_>,
        size_px: [Option<f64>; 2],
    ) -> Result<Numbers, SiteError> {
        let [width, height] = self.numbers.size_px;
        let site_size_px = [size_px[0].unwrap_or(width), size_px[1].unwrap_or(height)];
        if site_size_px == [width, height] {
            return Ok(self.numbers);
        }
        let [other_width, other_height] = site_size_px;
        Err(document
            .error(
                self.size_at,
                format!(
                    "the calibration is for images of {width} x {height} px, the site's camera has {other_width} x \
                     {other_height} px"
                ),
            )
            .expected("the image size that was calibrated")
            .help(
                "if the driver bins or crops, keep the whole image's size here and write `binning` or `roi`; \
                 otherwise calibrate at the size in use; or remove `width_px` and `height_px` from the site file",
            ))
    }
}

/// Returns the lens of a ROS model with its coefficients. `None` if the model is unknown; `Err` with the
/// right number of coefficients if their number is wrong. A model with all coefficients 0 is a pinhole,
/// except for `equidistant`.
pub(super) fn lens(model: &str, coefficients: &[f64]) -> Option<Result<Lens, usize>> {
    let flat = coefficients.iter().all(|k| *k == 0.0);
    let unless_flat = |lens: Lens| if flat { Lens::Pinhole } else { lens };
    Some(match model {
        "plumb_bob" => coefficients
            .try_into()
            .map(|all| unless_flat(Lens::PlumbBob(all)))
            .map_err(|_| 5),
        "rational_polynomial" => coefficients
            .try_into()
            .map(|all| unless_flat(Lens::RationalPolynomial(all)))
            .map_err(|_| 8),
        "equidistant" => coefficients
            .try_into()
            .map(Lens::Equidistant)
            .map_err(|_| 4),
        _ => return None,
    })
}

/// Returns the lens of a ROS model with its coefficients, as in a CameraInfo message; `None` if the model or the number of its
/// coefficients is not known.
pub(crate) fn lens_of_ros(model: &str, coefficients: &[f64]) -> Option<Lens> {
    lens(model, coefficients)?.ok()
}
