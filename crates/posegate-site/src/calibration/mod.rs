//! Calibration files: those of ROS, OpenCV, Kalibr and their relatives in YAML, OpenCV's in XML, and those of PhotonVision and Basalt in JSON.

use std::borrow::Cow;
use std::ops::Range;
use std::path::Path;

use super::Note;
use super::error::{SiteError, Source};
use super::named::NamedFile;
use super::reader;
use super::suggest;
use super::yaml::{Document, FormatMessages, Map, Node};
use posegate::certify::Roi;
use posegate::shape::Lens;
use posegate_files::input::{self, Limit};

mod basalt;
mod kalibr;
mod okvis;
mod orb_slam;
mod photonvision;
mod ros;
mod vins;

const MESSAGES: FormatMessages = FormatMessages {
    what: "a calibration in YAML",
    written: "use the file as the calibration program wrote it: `key: value` lines, lists in [ ]",
    numbers: "write numbers plainly, as 615.0 or 6.15e+02; if a calibration has .Nan, it has failed: calibrate \
              again",
    not_finite: "the calibration has failed: calibrate again",
    length: "copy the calibration file again as it was saved",
    // `ros2 topic echo` writes `---` after each message.
    reads_first: true,
};

const XML: FormatMessages = FormatMessages {
    what: "a calibration in XML of OpenCV, which is an <opencv_storage>",
    written: "use the file as OpenCV wrote it",
    ..MESSAGES
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
    /// The part of the sensor that is read, if the file says it.
    pub(super) roi: Option<Roi>,
    /// The columns and the rows of the sensor that are binned into one; at least 1.
    pub(super) binning: [u32; 2],
    /// What was assumed.
    pub(super) notes: Vec<Note>,
}

impl Default for Numbers {
    fn default() -> Self {
        Self {
            size_px: [0.0; 2],
            focal_px: [0.0; 2],
            axis_px: [0.0; 2],
            lens: Lens::Pinhole,
            rect: [0.0; 4],
            turned: None,
            roi: None,
            binning: [1, 1],
            notes: Vec::new(),
        }
    }
}

/// Reads the calibration file that a site's camera names. Also returns the file. Refuses a calibration for another
/// image size than the site's.
pub(super) fn read(
    node: &reader::Node<'_>,
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
    if bytes.contains(&0) {
        return Err(node
            .error(format!("the calibration {name} is not UTF-8"))
            .help("save the file in the encoding UTF-8"));
    }
    // Comments, and dates in words, may have any encoding.
    let text = String::from_utf8_lossy(&bytes);
    let source = Source {
        file: &name,
        text: &text,
    };
    let start = text.trim_start_matches('\u{feff}').trim_start();
    // Other files with braces are YAML in one line, as of `ros2 topic echo --flow-style`.
    if start.starts_with('{') && start.contains("\"cameraIntrinsics\"") {
        let numbers = photonvision::read(source)?;
        return Ok((numbers.for_size(source, size_px)?, read));
    }
    if start.starts_with("[image]") || start.contains("\n[image]") {
        return Err(source
            .error(0..0, "the calibration is an INI file")
            .expected(MESSAGES.what)
            .help("use the file ost.yaml, which cameracalibrator saves with ost.txt"));
    }
    let (text, lost) = without_losses(source.text);
    let source = Source {
        text: &text,
        ..source
    };
    let (document, root);
    if start.starts_with('<') {
        document = Document::indented(source, &XML);
        root = document.parse_xml()?;
    } else {
        document = Document::new(source, &MESSAGES)?;
        root = document.parse()?;
    }
    let keys = document.map(&root)?;
    let mut numbers = if keys.keys().any(is_camera) {
        kalibr::read(&document, keys, camera, size_px)?
    } else if okvis::is_of(&document, keys) {
        okvis::read(&document, keys, camera, size_px)?
    } else if basalt::is_of(keys) {
        basalt::read(&document, keys, camera)?
    } else if kalibr::is_of(keys) {
        kalibr::read_one(&document, keys, size_px)?
    } else if vins::is_of(keys) {
        vins::read(&document, keys)?
    } else if orb_slam::is_of(keys) {
        orb_slam::read(&document, keys, size_px)?
    } else if ros::is_of(keys) {
        if let Some(camera) = camera {
            return Err(node
                .error(format!("{name} is a calibration of one camera"))
                .help(format!("remove `#{camera}`")));
        }
        ros::read(&document, keys, size_px)?
    } else {
        return Err(source
            .error(0..0, "the file is not a known kind of calibration")
            .expected(
                "`camera_matrix` (ROS, OpenCV), `k` (a CameraInfo message), `cam0` (Kalibr), `cameras` (OKVIS), `value0` (Basalt), `projection_parameters` (VINS) or `Camera.fx` (ORB-SLAM)",
            )
            .help(
                "use the file that ROS's cameracalibrator saves as ost.yaml, a CameraInfo message of `ros2 topic echo --once`, an OpenCV calibration, \
                 Kalibr's camchain, or PhotonVision's JSON",
            ));
    };
    if document.has_more() {
        let message = "the calibration has several documents: the first one is read";
        numbers.numbers.notes.push(Note::assumed(message.into()));
    }
    if lost > 0 {
        let message = format!("`{LOSS}` is there {lost} times, and is left out");
        numbers.numbers.notes.push(Note::assumed(message));
    }
    Ok((numbers.for_size(source, size_px)?, read))
}

/// What `ros2 topic echo` writes among the messages, with two lines of counts.
const LOSS: &str = "A message was lost!!!";

/// Returns the text with blanks for the reports of lost messages, and their number.
fn without_losses(text: &str) -> (Cow<'_, str>, usize) {
    if !text.contains(LOSS) {
        return (Cow::Borrowed(text), 0);
    }
    let (mut kept, mut losses, mut is_report) = (String::new(), 0, false);
    for line in text.split_inclusive('\n') {
        let words = line.trim();
        losses += usize::from(words == LOSS);
        is_report = words == LOSS || is_report && words.starts_with("total count");
        if is_report {
            // Positions remain those of the file.
            kept.extend(
                line.bytes()
                    .map(|byte| if byte == b'\n' { '\n' } else { ' ' }),
            );
        } else {
            kept.push_str(line);
        }
    }
    (Cow::Owned(kept), losses)
}

/// Returns `true` if a key is the name of a camera in a Kalibr camchain.
fn is_camera(key: &str) -> bool {
    key.strip_prefix("cam")
        .is_some_and(|number| !number.is_empty() && number.bytes().all(|b| b.is_ascii_digit()))
}

/// The contents of a calibration file, and the position of its image size.
struct ParsedCalibration {
    numbers: Numbers,
    size_at: Range<usize>,
}

impl ParsedCalibration {
    /// Returns the contents of a file that describes the raw image: fx, fy, cx, cy in pixels.
    fn of_raw(
        size_at: Range<usize>,
        size_px: [f64; 2],
        [fx, fy, cx, cy]: [f64; 4],
        lens: Lens,
    ) -> Self {
        Self {
            size_at,
            numbers: Numbers {
                size_px,
                focal_px: [fx, fy],
                axis_px: [cx, cy],
                lens,
                rect: [fx, fy, cx, cy],
                ..Numbers::default()
            },
        }
    }

    fn for_size(self, source: Source<'_>, size_px: [Option<f64>; 2]) -> Result<Numbers, SiteError> {
        let [width, height] = self.numbers.size_px;
        let site_size_px = [size_px[0].unwrap_or(width), size_px[1].unwrap_or(height)];
        if site_size_px == [width, height] {
            return Ok(self.numbers);
        }
        let [other_width, other_height] = site_size_px;
        Err(source
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

/// Returns the value of a key, with dots or nested.
fn get<'n>(file: Map<'n>, key: &str) -> Option<&'n Node> {
    file.get(key).or_else(|| {
        let (outer, inner) = key.split_once('.')?;
        file.get(outer)?.as_map()?.get(inner)
    })
}

/// Returns the first of these keys that a file has, with its value.
fn one_of<'n>(file: Map<'n>, names: &[&'static str]) -> Option<(&'static str, &'n Node)> {
    names
        .iter()
        .find_map(|name| Some((*name, get(file, name)?)))
}

/// Returns one camera of a list, and its index. Its name is `cam` with the index.
fn chosen<'n>(
    document: &Document<'_>,
    cameras: &'n [Node],
    name: Option<&str>,
) -> Result<(usize, &'n Node), SiteError> {
    let all = (0..cameras.len()).map(|index| format!("cam{index}"));
    let all: Vec<String> = all.collect();
    let index = match (name, cameras.len()) {
        (None, 1) => Some(0),
        (None, _) => None,
        (Some(name), _) => all.iter().position(|known| known == name),
    };
    let found = index.and_then(|index| Some((index, cameras.get(index)?)));
    found.ok_or_else(|| {
        let names = suggest::list(all.iter().map(String::as_str));
        document
            .error(0..0, format!("the file has the cameras {names}"))
            .expected("the name of one of them after the file's name")
            .help("write `calibration = \"FILE#cam0\"`")
    })
}

/// Returns the size of the site's images as that of a calibration without one, with a note.
fn assumed_size(site_px: [Option<f64>; 2], notes: &mut Vec<Note>) -> Option<[f64; 2]> {
    let [Some(width), Some(height)] = site_px else {
        return None;
    };
    notes.push(Note::assumed(
        "the calibration does not state the size of its images: that of the site is assumed".into(),
    ));
    Some([width, height])
}

/// Returns the image's size from a list, and where it is; that of the site if there is no list. `at` is the camera, `name` the list's name.
fn listed_size(
    document: &Document<'_>,
    list: Option<&Node>,
    (at, name): (Range<usize>, &str),
    site_px: [Option<f64>; 2],
    notes: &mut Vec<Note>,
) -> Result<(Range<usize>, [f64; 2]), SiteError> {
    if let Some(list) = list {
        return Ok((list.at.clone(), document.numbers(list, name)?));
    }
    let size_px = document.required(assumed_size(site_px, notes), at, name, NO_SIZE)?;
    Ok((0..0, size_px))
}

/// Returns a width or height, pixels; OpenCV may write it with a decimal point.
fn side(document: &Document<'_>, node: &Node) -> Result<f64, SiteError> {
    let whole = document.whole(node);
    let number = document.number(node).ok();
    match number.filter(|number| (1.0..=100_000.0).contains(number) && number.fract() == 0.0) {
        Some(number) => Ok(number),
        None => whole.map(f64::from),
    }
}

/// Returns the image's size, and where the file states it. A file without one is for the size of the site.
fn size(
    document: &Document<'_>,
    file: Map<'_>,
    names: [&[&'static str]; 2],
    site_px: [Option<f64>; 2],
    notes: &mut Vec<Note>,
) -> Result<(Range<usize>, [f64; 2]), SiteError> {
    let found = names.map(|names| one_of(file, names).map(|(_, node)| node));
    if let [None, None] = found
        && let Some(size_px) = assumed_size(site_px, notes)
    {
        return Ok((0..0, size_px));
    }
    let required = |node: Option<&Node>, name: &str| {
        let node = document.required(node, 0..0, name, NO_SIZE)?;
        Ok::<_, SiteError>((node.at.clone(), side(document, node)?))
    };
    let [width, height] = found;
    let (at, width) = required(width, names[0][0])?;
    Ok((at, [width, required(height, names[1][0])?.1]))
}

const NO_SIZE: &str = "copy the calibration again as the program saved it, as ost.yaml of cameracalibrator; if it has no size, write `width_px` and `height_px` of the images that \
     were calibrated in the site's camera";

/// Why coefficients are not those of a model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Misfit {
    /// Another number of coefficients than this one.
    Count(usize),
    /// Terms that the model does not have, and that are not 0.
    Terms(&'static str),
}

/// The numbers of coefficients that OpenCV writes.
const COUNTS: [usize; 5] = [4, 5, 8, 12, 14];

/// Returns the lens of a model with its coefficients, in OpenCV's order: k1, k2, p1, p2, k3, k4, k5, k6, s1..s4, tau. `None` if the model is
/// unknown. Zeros at the end may be left out, or be more than the model has. A model with all coefficients 0 is a pinhole, except for
/// `equidistant`.
pub(super) fn lens(model: &str, coefficients: &[f64]) -> Option<Result<Lens, Misfit>> {
    let (own, is_fisheye) = match model {
        "plumb_bob" | "radtan" | "radial-tangential" | "radialtangential" => (5, false),
        "rational_polynomial" | "radialtangential8" => (8, false),
        "equidistant" | "equi" | "fisheye" | "kannala_brandt" => (4, true),
        _ => return None,
    };
    let count = coefficients.len();
    if !COUNTS.contains(&count) {
        return Some(match coefficients {
            [] if !is_fisheye => Ok(Lens::Pinhole),
            // Kalibr's radtan has no k3.
            _ => Err(Misfit::Count(if model == "radtan" { 4 } else { own })),
        });
    }
    let at = |index: usize| coefficients.get(index).copied().unwrap_or(0.0);
    let is_zero_from = |first: usize| coefficients.iter().skip(first).all(|k| *k == 0.0);
    if !is_zero_from(own) {
        return Some(Err(if is_fisheye {
            Misfit::Count(own)
        } else if !is_zero_from(12) {
            Misfit::Terms("a tilted sensor (tau)")
        } else if !is_zero_from(8) {
            Misfit::Terms("a thin prism (s1 to s4)")
        } else {
            Misfit::Terms("k4, k5, k6 of rational_polynomial")
        }));
    }
    Some(Ok(if is_fisheye {
        Lens::Equidistant(core::array::from_fn(at))
    } else if is_zero_from(0) {
        Lens::Pinhole
    } else if own == 5 {
        Lens::PlumbBob(core::array::from_fn(at))
    } else {
        Lens::RationalPolynomial(core::array::from_fn(at))
    }))
}

/// Returns the lens of a ROS model with its coefficients, as in a CameraInfo message; `None` if the model or the number of its
/// coefficients is not known.
pub fn lens_of_ros(model: &str, coefficients: &[f64]) -> Option<Lens> {
    lens(model, coefficients)?.ok()
}

/// Returns the lens of a file's coefficients. Without a model it is OpenCV's, by the number of the coefficients.
fn lens_of_file(
    document: &Document<'_>,
    model: Option<&Node>,
    list: Option<&Node>,
    name: &str,
    notes: &mut Vec<Note>,
) -> Result<Lens, SiteError> {
    let coefficients = match list {
        Some(list) => document.finite_numbers(list, name)?,
        None => Vec::new(),
    };
    let written = match model {
        // Simulators leave the model empty.
        Some(model) if !document.is_empty(model) => Some((document.text(model)?, model)),
        _ => None,
    };
    let word = match written {
        Some(("none", _)) if coefficients.iter().all(|k| *k == 0.0) => return Ok(Lens::Pinhole),
        // Drivers and CalibDB write these for the projection, not for the lens.
        Some(("pinhole" | "rectilinear", _)) | None => {
            let assumed = match coefficients.len() {
                0 => return Ok(Lens::Pinhole),
                4 | 5 => "plumb_bob",
                _ => "rational_polynomial",
            };
            notes.push(Note::assumed(format!(
                "the calibration has {} coefficients and no distortion model: {assumed} is assumed, the model of OpenCV's calibrateCamera",
                coefficients.len()
            )));
            assumed
        }
        Some((word, _)) => word,
    };
    let at = || list.or(model).map_or(0..0, |node| node.at.clone());
    match lens(word, &coefficients) {
        Some(Ok(lens)) => Ok(lens),
        Some(Err(Misfit::Count(wanted))) => Err(document
            .error(
                at(),
                format!("{name} has {} numbers, {word} has {wanted}", coefficients.len()),
            )
            .expected(format!("{wanted} numbers, or zeros after them up to 5, 8, 12 or 14"))
            .help(WHICH_MODEL)),
        Some(Err(Misfit::Terms(terms))) => Err(document
            .error(at(), format!("{name} has {terms}, which {word} does not have"))
            .expected("zeros for the terms that the model does not have")
            .help("calibrate with plumb_bob (5 coefficients), rational_polynomial (8) or equidistant (4)")),
        None => {
            let model = written.map_or(0..0, |(_, model)| model.at.clone());
            Err(document
                .error(model, format!("the distortion model `{word}` is not known"))
                .expected("plumb_bob (radtan), rational_polynomial or equidistant (fisheye)")
                .help(WHICH_MODEL))
        }
    }
}

const WHICH_MODEL: &str = "write `distortion_model: plumb_bob` for the 5 coefficients of OpenCV's calibrateCamera, \
     `rational_polynomial` for 8, `equidistant` for the 4 of its fisheye model";

/// The largest RMS of a good calibration, pixels.
const LARGEST_RMS: f64 = 1.0;

/// Adds a note if the stated RMS of a calibration is large.
fn note_rms(rms: f64, notes: &mut Vec<Note>) {
    if rms > LARGEST_RMS {
        notes.push(Note {
            code: "calibration_rms",
            message: format!(
                "its calibration states an RMS of {rms} px; a good one is below {LARGEST_RMS} px"
            ),
            help: "calibrate again, with a flat pattern and sharp images",
        });
    }
}
