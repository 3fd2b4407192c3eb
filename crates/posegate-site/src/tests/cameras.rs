//! Cameras with lenses, and their calibration files.

use std::fs;

use super::{FILE, Site, SiteError, find};
use posegate::certify::{Calibration, CertifiedCamera, Image};
use posegate::shape::{Camera, Lens};

/// A ROS calibration as cameracalibrator saves it.
const ROS: &str = "image_width: 640
image_height: 480
camera_name: front
camera_matrix:
  rows: 3
  cols: 3
  data: [410.5, 0.0, 325.25, 0.0, 411.75, 236.5, 0.0, 0.0, 1.0]
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: [-0.22, 0.06, 0.0006, -0.0004, -0.006]
rectification_matrix:
  rows: 3
  cols: 3
  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]
projection_matrix:
  rows: 3
  cols: 4
  data: [380.5, 0, 324.0, 0.0, 0.0, 384.25, 235.0, 0.0, 0.0, 0.0, 1.0, 0.0]
";

/// A camchain as Kalibr saves it.
const KALIBR: &str = "cam0:
  cam_overlaps: [1]
  camera_model: pinhole
  distortion_coeffs: [-0.2, 0.05, 0.001, -0.002]
  distortion_model: radtan
  intrinsics: [410.5, 411.5, 325.0, 236.0]
  resolution: [640, 480]
  rostopic: /cam0/image_raw
cam1:
  T_cn_cnm1:
  - [1.0, 0.0, 0.0, -0.1]
  - [0.0, 1.0, 0.0, 0.0]
  - [0.0, 0.0, 1.0, 0.0]
  - [0.0, 0.0, 0.0, 1.0]
  camera_model: pinhole
  distortion_coeffs: [-0.01, 0.006, -0.004, 0.0007]
  distortion_model: equidistant
  intrinsics: [300.5, 301.5, 320.0, 240.0]
  resolution: [640, 480]
";

/// Returns a site with one camera that has the given keys.
fn site(keys: &str) -> String {
    let mount = "mount = { x = 0.25, y = 0, z = 0.5, roll_deg = 0, pitch_deg = 0, yaw_deg = 0 }";
    format!("[camera.front]\n{keys}\n{mount}\n")
}

/// Writes a site and a calibration file into one folder and reads the site.
fn site_with(calibration: &str, keys: &str) -> Result<Site, SiteError> {
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("front.yaml"), calibration).expect("written");
    let file = folder.path().join(FILE);
    fs::write(&file, site(keys)).expect("written");
    Site::read(&file)
}

fn camera(calibration: &str, keys: &str) -> Camera {
    match site_with(calibration, keys) {
        Ok(site) => site.cameras["front"].camera,
        Err(error) => panic!("{error}"),
    }
}

const BARREL: Lens = Lens::PlumbBob([-0.22, 0.06, 0.0006, -0.0004, -0.006]);

fn of_ros(image: Image) -> Calibration {
    Calibration {
        size_px: [640.0, 480.0],
        focal_px: [410.5, 411.75],
        axis_px: [325.25, 236.5],
        lens: BARREL,
        image,
        roi: None,
        binning: [1, 1],
        border_px: 0.0,
    }
}

fn view(calibration: &Calibration) -> Camera {
    CertifiedCamera::of(calibration)
        .expect("a sound calibration")
        .camera
}

#[test]
fn ros_calibrations_are_read() {
    let raw = camera(ROS, "calibration = 'front.yaml'\nimage = 'raw'");
    assert_eq!(raw, view(&of_ros(Image::Raw)));
    assert_eq!((raw.lens(), raw.fx, raw.cy), (BARREL, 410.5, 236.5));

    let rect = camera(ROS, "calibration = 'front.yaml'\nimage = 'rect'");
    assert_eq!(
        rect,
        view(&of_ros(Image::Rect([380.5, 384.25, 324.0, 235.0])))
    );
    assert_eq!(
        (rect.lens(), rect.fx, rect.cy),
        (Lens::Pinhole, 380.5, 235.0)
    );

    // Without P, or with a zero P, the rectified image has the matrix K.
    let zero = ROS.replace(
        "[380.5, 0, 324.0, 0.0, 0.0, 384.25, 235.0, 0.0, 0.0, 0.0, 1.0, 0.0]",
        "[0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]",
    );
    let (without, _) = ROS.split_once("projection_matrix").expect("P");
    for text in [zero.as_str(), without] {
        let rect = camera(text, "calibration = 'front.yaml'\nimage = 'rect'");
        assert_eq!(
            rect,
            view(&of_ros(Image::Rect([410.5, 411.75, 325.25, 236.5])))
        );
    }

    // The header of OpenCV's files.
    let opencv = format!("%YAML:1.0\n---\n{ROS}").replace(
        "matrix:\n  rows",
        "matrix: !!opencv-matrix\n  dt: d\n  rows",
    );
    assert_eq!(
        camera(&opencv, "calibration = 'front.yaml'\nimage = 'raw'"),
        raw
    );

    // The same numbers as in the file, written into the site.
    let inline = "width_px = 640\nheight_px = 480\nfx = 410.5\nfy = 411.75\ncx = 325.25\ncy = 236.5\nimage = 'raw'
distortion = { model = 'plumb_bob', coefficients = [-0.22, 0.06, 0.0006, -0.0004, -0.006] }";
    let site = Site::parse(&site(inline), FILE).expect("sound");
    assert_eq!(site.cameras["front"].camera, raw);
    assert!(site.cameras["front"].kept > 0.9 && site.cameras["front"].kept < 1.0);
}

#[test]
fn camchains_are_read() {
    let first = camera(KALIBR, "calibration = 'front.yaml#cam0'\nimage = 'raw'");
    assert_eq!(
        first.lens(),
        Lens::PlumbBob([-0.2, 0.05, 0.001, -0.002, 0.0])
    );
    assert_eq!((first.fx, first.cy), (410.5, 236.0));
    let second = camera(KALIBR, "calibration = 'front.yaml#cam1'\nimage = 'raw'");
    assert_eq!(
        second.lens(),
        Lens::Equidistant([-0.01, 0.006, -0.004, 0.0007])
    );
    // A file's only camera needs no name, and a pinhole needs no `image`.
    let (one, _) = KALIBR.split_once("cam1").expect("two cameras");
    let none = one.replace("radtan", "none");
    let pinhole = camera(&none, "calibration = 'front.yaml'");
    assert!(pinhole.is_whole_pinhole() && pinhole.fx == 410.5);
}

#[test]
fn roi_and_binning_follow_the_ros_convention() {
    let keys = "calibration = 'front.yaml'\nimage = 'raw'\nborder_px = 3
roi = { x_offset = 20, y_offset = 30, width = 601, height = 402 }\nbinning = [2, 3]";
    let camera = camera(ROS, keys);
    assert_eq!((camera.width_px, camera.height_px), (300.0, 134.0));
    // u' = (u - 20) / 2, v' = (v - 30) / 3.
    assert_eq!((camera.fx, camera.fy), (410.5 / 2.0, 411.75 / 3.0));
    assert_eq!((camera.cx, camera.cy), (305.25 / 2.0, 206.5 / 3.0));
    let all = "calibration = 'front.yaml'\nimage = 'raw'\nbinning = [0, 1]
roi = { x_offset = 0, y_offset = 0, width = 0, height = 0 }";
    assert_eq!(self::camera(ROS, all), view(&of_ros(Image::Raw)));
}

#[test]
fn digest_depends_on_the_calibration() {
    let keys = "calibration = 'front.yaml'\nimage = 'raw'";
    let digest = |text: &str| site_with(text, keys).expect("sound").digest;
    assert_eq!(digest(ROS), digest(ROS));
    let commented = format!("{ROS}# checked\n");
    assert_ne!(digest(ROS), digest(&commented));
}

/// Rows of: text of the calibration to replace => replacement => keys of the site => text at which the error
/// points => part of its message => part of its help; `-` is an empty text.
const ROS_FAULTS: &str = r#"
image_width: 640 => \timage_width: 640 => - => \t => indented by a tab => expand
  rows: 3 => \trows: 3 => - => \t => indented by a tab => expand
image_width: 640 => image_height: 640 => - => image_height: 480 => `image_height` is there twice, first in line 1 => as the calibration program
image_width: 640 => image_width: 640.5 => - => 640.5 => found `640.5` => plainly
image_width: 640\n => - => - => image_height => `image_width` is missing => ost.yaml
410.5, => 0.0, => - => 0.0, 0.0, 325 => is 0: the camera is not calibrated => cameracalibrator
411.75, => -1, => - => -1, => camera_matrix[4] is -1 => cameracalibrator
410.5, 0.0 => 410.5, 0.1 => - => 0.1, => is not [fx, 0, cx, => ost.yaml
410.5, => .nan, => - => .nan => camera_matrix[0] is NaN => calibrate again
-0.22, => .Nan, => - => .Nan => found `.Nan` => calibrate again
-0.22, => .inf, => - => .inf => distortion_coefficients[0] is inf => calibrate again
-0.0004, -0.006] => ] => - => [-0.22 => has 3 numbers, plumb_bob has 5 => rational_polynomial
236.5, 0.0, 0.0, 1.0] => 236.5] => - => [410.5 => camera_matrix has 6 numbers => saved
plumb_bob => fov => - => fov => the distortion model `fov` is not known => equidistant
camera_matrix: => camera_matrices: => - => image_width => is not a known kind of calibration => CameraInfo
410.5, 0.0 => a410, 0.0 => - => a410 => found `a410` => plainly
data: [1, 0 => data: [0.9, 0.1 => - => [0.9 => the rectification matrix turns the image => image = "raw"
380.5, 0, => 380.5, 2, => - => [380.5 => projection_matrix is not => ost.yaml
image_width: 640 => image_width: 1280 => width_px = 640 => 1280 => is for images of 1280 x 480 px, the site's camera has 640 x 480 px => binning
image_height: 480 => image_height: 960 => height_px = 480 => 640\n => is for images of 640 x 960 px, the site's camera has 640 x 480 px => binning
"#;

const KALIBR_FAULTS: &str = r#"
cam1: => cam2: => - => cam0 => several cameras: `cam0`, `cam2` => #cam0
cam1: => cam2: => #cam1 => cam0 => no camera `cam1` => #cam0
camera_model: pinhole => camera_model: omni => #cam0 => omni => the camera model `omni` is not supported => pinhole-radtan
radtan => fov => #cam0 => fov => the distortion model `fov` is not known => equidistant
, -0.002] => ] => #cam0 => [-0.2 => has 3 numbers, radtan has 4 => rational_polynomial
[410.5, 411.5 => [411.5 => #cam0 => [411.5 => intrinsics has 3 numbers => saved
[410.5, => [0, => #cam0 => [0, => focal lengths are 0 and 411.5 => calibrate
[640, 480]\n  rostopic => [640]\n  rostopic => #cam0 => [640]\n => resolution has 1 numbers => saved
  intrinsics: [410.5, 411.5, 325.0, 236.0]\n => - => #cam0 => cam_overlaps => `cam0.intrinsics` is missing => camchain
0.0007] => .nan] => #cam1 => .nan => distortion_coeffs[3] is NaN => calibrate
"#;

fn check(calibration: &str, table: &str, rows: usize, keys: impl Fn(&str) -> String) {
    let table: std::vec::Vec<&str> = table.lines().filter(|row| !row.is_empty()).collect();
    assert_eq!(table.len(), rows);
    for row in table {
        let cells: std::vec::Vec<String> = row
            .split(" => ")
            .map(|cell| if cell == "-" { "" } else { cell })
            .map(|cell| cell.replace("\\n", "\n").replace("\\t", "\t"))
            .collect();
        let [from, to, more, at, message, help] = cells.as_slice() else {
            panic!("{row}: {cells:?}");
        };
        assert!(calibration.contains(from.as_str()), "{row}");
        let text = calibration.replacen(from.as_str(), to, 1);
        let error = match site_with(&text, &keys(more)) {
            Ok(_) => panic!("no fault: {row}"),
            Err(error) => error,
        };
        let place = error.at.expect("a place");
        assert!(error.file.ends_with("front.yaml"), "{row}: {error}");
        assert_eq!(
            (place.line, place.column),
            find(&text, at),
            "{row}: {error}"
        );
        assert!(error.message.contains(message.as_str()), "{row}: {error}");
        assert!(error.expected.is_some(), "{row}: {error}");
        let advice = error.help.as_deref().expect("help");
        assert!(advice.contains(help.as_str()), "{row}: {error}");
    }
}

#[test]
fn errors_in_ros_calibrations_point_at_the_fault() {
    check(ROS, ROS_FAULTS, 20, |more| {
        format!("calibration = 'front.yaml'\nimage = 'rect'\n{more}")
    });
}

#[test]
fn errors_in_camchains_point_at_the_fault() {
    check(KALIBR, KALIBR_FAULTS, 10, |more| {
        format!("calibration = 'front.yaml{more}'\nimage = 'raw'")
    });
}

#[test]
fn site_keys_for_a_calibration_are_checked() {
    let rows = [
        (
            "calibration = 'rear.yaml'\nimage = 'raw'",
            ROS,
            "cannot be read",
        ),
        (
            "calibration = 'front.yaml#cam0'\nimage = 'raw'",
            ROS,
            "of one camera",
        ),
        ("calibration = 'front.yaml'", ROS, "`image` is missing"),
        (
            "calibration = 'front.yaml'\nimage = 'raw'\nborder_px = 240",
            ROS,
            "leaves nothing",
        ),
        ("calibration = 7\nimage = 'raw'", ROS, "is a whole number"),
    ];
    for (keys, text, message) in rows {
        let error = site_with(text, keys).expect_err("a fault");
        assert!(error.file.ends_with(FILE) && error.at.is_some(), "{error}");
        assert!(error.message.contains(message), "{keys}: {error}");
    }
    let folding = ROS.replace("-0.22, 0.06", "-0.6, 0.06");
    let folded = site_with(&folding, "calibration = 'front.yaml'\nimage = 'raw'").expect("a site");
    let [remark] = folded.remarks.as_slice() else {
        panic!("{:?}", folded.remarks);
    };
    assert_eq!(remark.about, ["camera", "front"]);
    assert!(
        remark.note.message.contains("the distortion folds at "),
        "{remark:?}"
    );
    // Only the part within the fold is seen.
    assert!(folded.cameras["front"].calibration.border_px > 0.0);
}
