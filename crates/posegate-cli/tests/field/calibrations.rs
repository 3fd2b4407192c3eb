//! Calibrations as programs write them.

use posegate_testkit::run::{Case, Ended};
use serde_json::Value;

fn check(calibration: &str, arguments: &str) -> Ended {
    let site = "[camera.front]\ncalibration = \"c.yaml\"\nimage = \"raw\"\nmount = { x = 0.2, y = 0.0, z = 0.5, roll_deg = 0.0, pitch_deg = 0.0, yaw_deg = 0.0 }\n";
    let case = Case::new(&[
        ("site.toml", site.as_bytes()),
        ("c.yaml", calibration.as_bytes()),
    ]);
    case.run(&format!("check site.toml {arguments}"))
}

/// Returns the codes of the warnings.
fn codes(calibration: &str) -> Vec<String> {
    let checked = check(calibration, "--json").json(0);
    let warnings = checked["warnings"].as_array().expect("warnings");
    warnings
        .iter()
        .map(|warning| warning["code"].as_str().expect("a code").into())
        .collect()
}

fn is_read(calibration: &str) {
    assert_eq!(codes(calibration), Vec::<String>::new(), "{calibration}");
}

fn refused(calibration: &str, words: &[&str]) {
    check(calibration, "").is_refused_with(words);
}

const MATRIX: &str =
    "camera_matrix: {rows: 3, cols: 3, data: [520.5, 0, 322, 0, 521, 238.5, 0, 0, 1]}\n";

/// A calibration with a line for the model and coefficients.
fn ros(model: &str, coefficients: &[f64]) -> String {
    format!(
        "image_width: 640\nimage_height: 480\n{MATRIX}{model}distortion_coefficients: {{rows: 1, cols: {}, data: {coefficients:?}}}\n",
        coefficients.len()
    )
}

#[test]
fn directive_without_dashes_is_a_comment() {
    let chain = "cam0:\n  T_imu_cam: [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]\n  camera_model: pinhole\n  distortion_coeffs: [-0.28, 0.07, 0.0002, 0.00002]\n  distortion_model: radtan\n  intrinsics: [458.0, 457.0, 367.0, 248.0]\n  resolution: [752, 480]\n";
    for start in [
        "%YAML:1.0\n",
        "%YAML:1.0\n---\n",
        "%YAML:1.0 # made by hand\n\n",
        "\u{feff}%YAML:1.0\n",
        "%YAML 1.2\n---\n",
        "",
    ] {
        is_read(&format!("{start}{chain}"));
    }
    // The line of a fault is that of the file.
    refused(
        &format!("%YAML:1.0\n{}", chain.replace("458.0", "x")),
        &["c.yaml:7:16"],
    );
}

#[test]
fn old_key_of_the_model_is_read() {
    is_read(&ros(
        "camera_model: plumb_bob\n",
        &[0.1, -0.2, 0.001, 0.002, 0.0],
    ));
    is_read(&ros(
        "camera_model: rational_polynomial\n",
        &[0.1, 0.2, 0.0, 0.0, 0.01, 0.3, 0.1, 0.02],
    ));
    refused(
        &ros("camera_model: mei\n", &[0.1, -0.2, 0.001, 0.002, 0.0]),
        &["`mei` is not known"],
    );
}

#[test]
fn echoes_of_camera_info_are_read() {
    let ros2 = "header:\n  stamp:\n    sec: 12\n    nanosec: 5\n  frame_id: optical\nheight: 360\nwidth: 640\ndistortion_model: plumb_bob\nd:\n- 0.05\n- -0.1\n- 0.0\n- 0.0\n- 0.0\nk: [500.0, 0.0, 320.0, 0.0, 500.0, 180.0, 0.0, 0.0, 1.0]\nr: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]\np: [500.0, 0.0, 320.0, 0.0, 0.0, 500.0, 180.0, 0.0, 0.0, 0.0, 1.0, 0.0]\nbinning_x: 0\nbinning_y: 0\nroi:\n  x_offset: 0\n  y_offset: 0\n  height: 0\n  width: 0\n  do_rectify: false\n";
    is_read(ros2);
    is_read(&format!("{ros2}---\n"));
    assert_eq!(
        codes(&format!("{ros2}---\n{ros2}---\nheader:\n  st")),
        ["assumed"]
    );
    let ros1 = ros2
        .replace("\nd:", "\nD:")
        .replace("\nk:", "\nK:")
        .replace("\nr:", "\nR:")
        .replace("\np:", "\nP:");
    is_read(&ros1);
    let gazebo = ros2
        .replace("plumb_bob", "''")
        .replace("d:\n- 0.05\n- -0.1\n- 0.0\n- 0.0\n- 0.0\n", "d: []\n");
    is_read(&gazebo);
    refused(&ros2.replace("k: [500.0", "k: [0.0"), &["k[0], fx, is 0"]);
    // The site's keys are not needed: half of the sensor, every second pixel.
    let halved = ros2
        .replace("binning_x: 0", "binning_x: 2")
        .replace("binning_y: 0", "binning_y: 2");
    is_read(&halved);
}

#[test]
fn zero_tails_of_coefficients_are_read() {
    let rational = [0.1, 0.2, 0.0, 0.0, 0.01, 0.3, 0.1, 0.02];
    let with = |own: &[f64], count: usize| {
        let mut all = own.to_vec();
        all.resize(count, 0.0);
        all
    };
    for (model, own, counts) in [
        ("rational_polynomial", &rational[..], &[8, 12, 14][..]),
        ("rational_polynomial", &rational[..4], &[4, 5]),
        ("plumb_bob", &[0.1, -0.2, 0.001, 0.002], &[4, 5, 8, 12, 14]),
        ("equidistant", &[0.1, -0.02, 0.001, 0.002], &[4, 5, 8]),
    ] {
        for count in counts {
            is_read(&ros(
                &format!("distortion_model: {model}\n"),
                &with(own, *count),
            ));
        }
    }
    let mut prism = with(&rational, 12);
    prism[9] = 0.01;
    refused(
        &ros("distortion_model: rational_polynomial\n", &prism),
        &["c.yaml:5", "thin prism (s1 to s4)"],
    );
    let mut tilted = with(&rational, 14);
    tilted[13] = 0.01;
    refused(
        &ros("distortion_model: rational_polynomial\n", &tilted),
        &["tilted sensor"],
    );
    refused(
        &ros("distortion_model: plumb_bob\n", &rational),
        &["k4, k5, k6"],
    );
    refused(
        &ros("distortion_model: plumb_bob\n", &[0.1, 0.2]),
        &["has 2 numbers, plumb_bob has 5"],
    );
    for count in [4, 5, 8] {
        assert_eq!(codes(&ros("", &with(&rational[..4], count))), ["assumed"]);
    }
}

#[test]
fn files_of_opencv_vins_tagslam_and_photonvision_are_read() {
    let opencv = "%YAML:1.0\n---\ncalibration_time: \"Tue\"\nimage_width: 640\nimage_height: 480\nflags: 0\ncamera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: [ 6.0e+02, 0., 3.2e+02, 0., 6.0e+02, 2.4e+02, 0., 0., 1. ]\ndistortion_coefficients: !!opencv-matrix\n   rows: 5\n   cols: 1\n   dt: d\n   data: [ 1.0e-01, -2.0e-01, 0., 0., 0. ]\navg_reprojection_error: 0.4\n";
    assert_eq!(codes(opencv), ["assumed"]);
    assert_eq!(
        codes(&opencv.replace("error: 0.4", "error: 3.5")),
        ["assumed", "calibration_rms"]
    );
    is_read(
        &opencv
            .replace("flags: 0", "fisheye_model: 1")
            .replace("1.0e-01, -2.0e-01, 0., 0., 0.", "0.1, -0.02, 0., 0."),
    );
    let vins = "%YAML:1.0\n---\nmodel_type: PINHOLE\ncamera_name: camera\nimage_width: 752\nimage_height: 480\ndistortion_parameters:\n   k1: -0.29\n   k2: 0.08\n   p1: 0.0001\n   p2: 0.00002\nprojection_parameters:\n   fx: 461.0\n   fy: 460.0\n   cx: 363.0\n   cy: 248.0\n";
    is_read(vins);
    is_read(
        "%YAML:1.0\n\nmodel_type: KANNALA_BRANDT\ncamera_name: c\nimage_width: 800\nimage_height: 600\nprojection_parameters:\n  k2: -0.01\n  k3: 0.02\n  k4: -0.003\n  k5: 0.001\n  mu: 300.0\n  mv: 300.0\n  u0: 400.0\n  v0: 300.0\n",
    );
    refused(&vins.replace("PINHOLE", "MEI"), &["`MEI` is not supported"]);
    is_read(
        "cam0:\n  camera_model: pinhole\n  intrinsics: [700.0, 700.0, 640.0, 360.0]\n  distortion_model: plumb_bob\n  distortion_coeffs: [0.01, -0.02, 0.0, 0.0, 0.001]\n  resolution: [1280, 720]\n  tagtopic: /tags\n",
    );
    let photon = r#"{"resolution":{"width":1280.0,"height":800.0},"cameraIntrinsics":{"rows":3,"cols":3,"type":6,"data":[900.0,0.0,640.0,0.0,900.0,400.0,0.0,0.0,1.0]},"distCoeffs":{"rows":1,"cols":8,"type":6,"data":[0.05,-0.1,0.0,0.0,0.0,0.0,0.0,0.01]},"calobjectWarp":[],"observations":[]}"#;
    is_read(photon);
    refused(
        &photon.replace("1280.0,\"h", "1280.5,\"h"),
        &["`resolution.width` is 1280.5"],
    );
    refused(
        &photon.replace("distCoeffs", "dist"),
        &["`distCoeffs` is missing"],
    );
}

#[test]
fn unlikely_numbers_are_warnings_with_the_number() {
    let moved = ros("distortion_model: plumb_bob\n", &[0.0; 5])
        .replace("640", "1280")
        .replace("480", "960");
    let checked = check(&moved, "--json").json(0);
    let warning = &checked["warnings"][0];
    assert_eq!(warning["code"], "axis_off_centre", "{checked}");
    let message = warning["message"].as_str().expect("a message");
    assert!(
        message.contains("242 px from the middle") && message.contains("25 % of the height"),
        "{message}"
    );
    assert!(warning["line"].is_u64());
    let plain = ros("distortion_model: plumb_bob\n", &[0.0; 5]);
    // Millimetres; thousandths of pixels; binned rows.
    for (fx, fy) in [("4.0", "4.0"), ("520500", "521000"), ("260", "521")] {
        let odd = plain.replace("520.5", fx).replace("521", fy);
        assert_eq!(codes(&odd), ["focal_length_odd"], "{fx}");
    }
    // At 14 % nothing is said.
    is_read(&ros("distortion_model: plumb_bob\n", &[0.0; 5]).replace("322", "231"));
    let folded = ros("distortion_model: plumb_bob\n", &[-0.5, 0.0, 0.0, 0.0, 0.0]);
    let checked = check(&folded, "--json").json(0);
    let warning = checked["warnings"][0].clone();
    assert_eq!(warning["code"], "lens_folds", "{checked}");
    let border = border_of(&warning);
    // 1 - 1.5 r^2 = 0 at r = 0.8165, where the radius of the image is 0.8165 (1 - 0.333) 520.5 = 283 px: the corners at 400 px are beyond.
    assert!((60.0..100.0).contains(&border), "{warning}");
}

fn border_of(warning: &Value) -> f64 {
    let message = warning["message"].as_str().expect("a message");
    assert!(message.contains("folds at 283."), "{message}");
    let words: Vec<&str> = message.split_whitespace().collect();
    let at = words
        .iter()
        .position(|word| *word == "border")
        .expect("a border");
    words[at + 2].parse().expect("pixels")
}

/// EuRoC's `sensor.yaml`: Kalibr's keys of one camera, without a camchain.
#[test]
fn sensor_file_of_one_camera_is_read() {
    is_read(
        "sensor_type: camera\nT_BS:\n  cols: 4\n  rows: 4\n  data: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]\nrate_hz: 20\nresolution: [640, 480]\ncamera_model: pinhole\nintrinsics: [458.5, 457.5, 322.0, 238.0] #fu, fv, cu, cv\ndistortion_model: radial-tangential\ndistortion_coefficients: [-0.1, 0.02, 0.0002, 0.00002]\n",
    );
}

/// A pinhole would be a guess: the coefficients may be there under a name that is not known.
#[test]
fn missing_coefficients_are_refused() {
    let size = "image_width: 640\nimage_height: 480\n";
    for rest in ["", "dist_parameters: [0.3, -0.2, 0.001, 0.002, 0.0]\n"] {
        refused(
            &format!("{size}{MATRIX}{rest}"),
            &[
                "c.yaml:1",
                "`distortion_coefficients` is missing",
                "[0, 0, 0, 0, 0]",
            ],
        );
    }
    // Explicitly none.
    is_read(&format!("{size}{MATRIX}distortion_coefficients: []\n"));
}

#[test]
fn rows_and_names_of_tutorials_are_read() {
    assert_eq!(
        codes(
            "image_width: 640\nimage_height: 480\ncamera_matrix:\n- [520.5, 0.0, 322.0]\n- [0.0, 521.0, 238.5]\n- [0.0, 0.0, 1.0]\ndist_coeff:\n- [0.1, -0.2, 0.001, 0.002, 0.0]\n"
        ),
        ["assumed"]
    );
    refused(
        "image_width: 640\nimage_height: 480\nmtx: [[520.5, 0.0], [0.0, 521.0]]\ndist: [[0.0, 0.0, 0.0, 0.0, 0.0]]\n",
        &["c.yaml:3", "mtx has 4 numbers"],
    );
}

/// `ros2 topic echo --flow-style`, and Python's json.dump.
#[test]
fn files_in_braces_are_read() {
    is_read(
        "{header: {stamp: {sec: 1, nanosec: 2}, frame_id: c}, height: 480, width: 640, distortion_model: plumb_bob, d: [0.1, 0.0, 0.0, 0.0, 0.0], k: [600.0, 0.0, 320.0, 0.0, 600.0, 240.0, 0.0, 0.0, 1.0]}\n---\n",
    );
    is_read(
        "\u{feff}{\"image_width\": 640, \"image_height\": 480,\n \"camera_matrix\": {\"rows\": 3, \"cols\": 3, \"data\": [520, 0, 322, 0, 521, 238, 0, 0, 1]},\n \"distortion_model\": \"plumb_bob\", \"distortion_coefficients\": {\"data\": [0.1, 0, 0, 0, 0]}}\n",
    );
}

/// CalibDB's exports: rows, or OpenCV's matrices, also of the size.
#[test]
fn exports_of_calibdb_are_read() {
    let rows = r#"{"camera": "c", "avg_reprojection_error": 0.4, "camera_matrix": [[520.5, 0, 322], [0, 521, 238.5], [0, 0, 1]],
 "distortion_coefficients": [0.1, -0.02, 0.001, 0.002, 0.0], "distortion_model": "rectilinear", "img_size": [640, 480], "keyframes": 12}"#;
    assert_eq!(codes(rows), ["assumed"]);
    assert_eq!(
        codes(&rows.replace(
            "[640, 480]",
            r#"{"type_id": "opencv-matrix", "rows": 2, "cols": 1, "dt": "d", "data": [640, 480]}"#
        )),
        ["assumed"]
    );
    refused(
        &rows.replace("[640, 480]", "[640]"),
        &["c.yaml:2", "img_size has 1 numbers"],
    );
}

#[test]
fn size_may_be_that_of_the_site() {
    let text = format!(
        "{MATRIX}distortion_model: plumb_bob\ndistortion_coefficients: [0.0, 0.0, 0.0, 0.0, 0.0]\n"
    );
    refused(
        &text,
        &["`image_width` is missing", "`width_px` and `height_px`"],
    );
    let site = "[camera.front]\ncalibration = \"c.yaml\"\nimage = \"raw\"\nwidth_px = 640\nheight_px = 480\nmount = { x = 0.2, y = 0.0, z = 0.5, roll_deg = 0.0, pitch_deg = 0.0, yaw_deg = 0.0 }\n";
    let case = Case::new(&[("site.toml", site.as_bytes()), ("c.yaml", text.as_bytes())]);
    let checked = case.run("check site.toml --json").json(0);
    assert_eq!(checked["warnings"][0]["code"], "assumed", "{checked}");
    // One of both is a fault of the file.
    let half = format!("image_width: 640\n{text}");
    let case = Case::new(&[("site.toml", site.as_bytes()), ("c.yaml", half.as_bytes())]);
    case.run("check site.toml")
        .is_refused_with(&["`image_height` is missing"]);
}

#[test]
fn chain_of_one_camera_may_have_other_keys() {
    let chain = "cam0:\n  camera_model: pinhole\n  distortion_coeffs: [-0.28, 0.07, 0.0002, 0.00002]\n  distortion_model: radtan\n  intrinsics: [458.0, 457.0, 367.0, 248.0]\n  resolution: [752, 480]\n";
    is_read(&format!("{chain}T_imu_body: [[1, 0], [0, 1]]\n\t\n"));
    refused(
        &format!("{chain}{}", chain.replace("cam0", "cam1")),
        &["several cameras: `cam0`, `cam1`"],
    );
}

#[test]
fn photonvision_of_all_years_is_read() {
    let old = r#"{"resolution":{"width":640.0,"height":480.0},"cameraIntrinsics":{"rows":3,"cols":3,"type":6,"data":[600.0,0.0,320.0,0.0,600.0,240.0,0.0,0.0,1.0]},"cameraExtrinsics":{"rows":1,"cols":4,"type":6,"data":[0.0,0.0,0.6,0.0]},"perViewErrors":[0.2],"standardDeviation":0.1,"isFisheye":false}"#;
    // As plumb_bob the third one is p1, which folds the lens; as a fisheye's it is k3.
    let plain = check(old, "--json");
    assert!(
        plain.code != 0 || plain.out.contains("lens_folds"),
        "{}",
        plain.out
    );
    is_read(&old.replace("false", "true"));
    refused(
        &old.replace(
            "\"isFisheye\":false",
            "\"lensmodel\":\"LENSMODEL_SPLINED_STERIOGRAPHIC\"",
        ),
        &["`lensmodel` is not a model of OpenCV"],
    );
    is_read(
        &old.replace("\"isFisheye\":false", "\"lensmodel\":\"LENSMODEL_OPENCV\"")
            .replace("cameraExtrinsics", "distCoeffs")
            .replace("0.0,0.0,0.6,0.0", "0.1,-0.02,0.0,0.0"),
    );
}

#[test]
fn settings_of_orb_slam_are_read() {
    let two = "%YAML:1.0\n\nCamera.fx: 517.5\nCamera.fy: 516.5\nCamera.cx: 318.5\nCamera.cy: 255.5\n\nCamera.k1: 0.26\nCamera.k2: -0.2\nCamera.p1: -0.005\nCamera.p2: 0.002\nCamera.k3: 0.1\nCamera.width: 640\nCamera.height: 480\nCamera.fps: 30.0\nORBextractor.nFeatures: 1000\n";
    is_read(two);
    let three = two.replace(
        "Camera.width",
        "File.version: \"1.0\"\nCamera.type: \"PinHole\"\nCamera.width",
    );
    let three = ["fx", "fy", "cx", "cy", "k1", "k2", "k3", "p1", "p2"]
        .iter()
        .fold(three, |text, key| {
            text.replace(&format!("Camera.{key}"), &format!("Camera1.{key}"))
        });
    is_read(&three);
    is_read(
        &three
            .replace("PinHole", "KannalaBrandt8")
            .replace("Camera1.p1", "Camera1.k4")
            .replace("Camera1.p2", "other"),
    );
    refused(
        &three.replace("PinHole", "Rectified"),
        &["c.yaml:14", "`Rectified`", "rectified image's `width_px`"],
    );
    refused(
        &format!(
            "{two}LEFT.K: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: [458.0, 0, 367, 0, 457, 248, 0, 0, 1]\n"
        ),
        &["c.yaml:1", "a pair of cameras, rectified"],
    );
    refused(
        &two.replace("Camera.p1", "Camera.q1"),
        &["`Camera.p1` is missing", "write 0"],
    );
    refused(
        &two.replace("517.5", "-517.5"),
        &["c.yaml:3", "Camera.fx is -517.5", "above 0"],
    );
    refused(
        &two.replace("Camera.width: 640\n", ""),
        &["`Camera.width` is missing"],
    );
}

#[test]
fn xml_of_opencv_is_read_as_its_yaml() {
    let sample = "<?xml version=\"1.0\"?>\n<opencv_storage>\n<calibration_time>\"Sat 28 Nov 2026 10:00:00 AM UTC\"</calibration_time>\n<nr_of_frames>25</nr_of_frames>\n<image_width>640</image_width>\n<image_height>480</image_height>\n<!-- made by hand -->\n<camera_matrix type_id=\"opencv-matrix\">\n  <rows>3</rows>\n\t<cols>3</cols>\n  <dt>d</dt>\n  <data>\n    5.205e+02 0. 322. 0. 521. 2.385e+02 0.\n    0. 1.</data></camera_matrix>\n<distortion_coefficients type_id=\"opencv-matrix\">\n  <rows>5</rows><cols>1</cols><dt>d</dt>\n  <data>1.e-01 -2.e-01 1.e-03 2.e-03 0.</data></distortion_coefficients>\n<avg_reprojection_error>3.1e-01</avg_reprojection_error>\n<distortion_model>plumb_bob</distortion_model><grid_points/>\n</opencv_storage>\n";
    is_read(sample);
    is_read(&format!("\u{feff}{}", sample.replace('\n', "\r\n")));
    let size = "<image_width>640</image_width>\n<image_height>480</image_height>";
    is_read(&sample.replace(size, "<image_size>640 480</image_size>"));
    is_read(&sample.replace(size, "<image_size><_>640</_><_>480</_></image_size>"));
    assert_eq!(
        codes(&sample.replace("3.1e-01", "3.1")),
        ["calibration_rms"]
    );
    for (from, to, words) in [
        ("5.205e+02", "x", &["c.yaml:13", "found `x`"][..]),
        ("5.205e+02", ".Nan", &["c.yaml:13", "calibrate again"]),
        (
            "5.205e+02 0.",
            "5.205e+02",
            &["c.yaml:13", "camera_matrix has 8 numbers"],
        ),
        (
            "<rows>3</rows>",
            "3 <rows>3</rows>",
            &["c.yaml:9", "beside elements"],
        ),
        (
            "<nr_of_frames>25</nr_of_frames>",
            "<image_width>641</image_width>",
            &["c.yaml:5", "twice, first in line 4"],
        ),
        (
            "</opencv_storage>",
            "",
            &["c.yaml:2", "<opencv_storage> has no end"],
        ),
        (
            "</data></camera_matrix>",
            "</camera_matrix>",
            &["c.yaml:14", "not read"],
        ),
        (
            "opencv_storage",
            "calibration",
            &["c.yaml:2", "<calibration>", "<opencv_storage>"],
        ),
    ] {
        refused(&sample.replace(from, to), words);
    }
}

#[test]
fn settings_of_okvis_are_read() {
    let camera = "     - {T_SC: [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0],\n        image_dimension: [752, 480],\n        distortion_coefficients: [-0.28, 0.07, 0.0002, 0.00002],\n        distortion_type: radialtangential,\n        focal_length: [458.5, 457.5],\n        principal_point: [367.0, 248.5]}\n";
    let one = format!("%YAML:1.0\ncameras:\n{camera}imu_params:\n    rate: 200\n");
    is_read(&one);
    is_read(&one.replace("radialtangential", "equidistant"));
    refused(
        &one.replace("458.5", "0.0"),
        &["c.yaml:7", "focal lengths are 0 and"],
    );
    refused(
        &one.replace("radialtangential", "fov"),
        &["`fov` is not known"],
    );
    refused(
        &one.replace("image_dimension", "dimension"),
        &["`image_dimension` is missing", "width_px"],
    );
    let two = one.replace("imu_params", &format!("{camera}imu_params"));
    refused(&two, &["`cam0`, `cam1`", "FILE#cam0"]);
}

#[test]
fn calibrations_of_basalt_are_read() {
    let file = |model: &str, terms: &str| {
        format!(
            "{{\"value0\": {{\"T_imu_cam\": [], \"intrinsics\": [{{\"camera_type\": \"{model}\", \"intrinsics\": {{\"fx\": 349.5, \"fy\": 348.5, \"cx\": 365.5, \"cy\": 249.5{terms}}}}}], \"resolution\": [[752, 480]]}}}}"
        )
    };
    let kb4 = file(
        "kb4",
        ", \"k1\": -0.01, \"k2\": 0.02, \"k3\": 0.001, \"k4\": 0.0",
    );
    is_read(&kb4);
    is_read(&file("pinhole", ""));
    is_read(&file(
        "pinhole-radtan8",
        ", \"k1\": -0.01, \"k2\": 0.02, \"p1\": 0, \"p2\": 0, \"k3\": 0, \"k4\": 0.1, \"k5\": 0, \"k6\": 0",
    ));
    refused(
        &file("ds", ", \"xi\": -0.2, \"alpha\": 0.5"),
        &["`ds` is not supported", "kb4"],
    );
    refused(&kb4.replace("349.5", "-1"), &["fx is -1"]);
    refused(&kb4.replace("\"k3\"", "\"k5\""), &["`k3` is missing"]);
    refused(
        &kb4.replace("[[752, 480]]", "[]"),
        &["`resolution` is missing"],
    );
}

#[test]
fn notations_of_other_versions_are_read() {
    let plumb = ros(
        "distortion_model: plumb_bob\n",
        &[0.1, -0.2, 0.001, 0.002, 0.0],
    );
    // OpenCV writes a number of type double with a point.
    is_read(&plumb.replace("640", "640.").replace("480", "4.8e+02"));
    refused(
        &plumb.replace("640", "640.5"),
        &["found `640.5`", "a whole number"],
    );
    // stella_vslam nests the keys of OpenVSLAM.
    is_read(
        "Camera:\n  model: perspective\n  fx: 458.5\n  fy: 457.5\n  cx: 367.0\n  cy: 248.5\n  k1: -0.28\n  k2: 0.07\n  p1: 0.0001\n  p2: 0.0\n  k3: 0.0\n  cols: 752\n  rows: 480\n",
    );
    refused("[image]\nwidth\n640\n", &["INI", "ost.yaml"]);
    let chain = "cam0:\n  camera_model: pinhole\n  intrinsics: [458.0, 457.0, 367.0, 248.0]\n  distortion_model: radtan\n  distortion_coeffs: [-0.28, 0.07, 0.0, 0.0]\n";
    refused(chain, &["`cam0.resolution` is missing", "width_px"]);
}

/// A month in the words of the user's language, in an older encoding; the numbers are plain.
#[test]
fn dates_may_have_any_encoding() {
    let text = format!(
        "# M\u{e4}rz\n{}",
        ros("distortion_model: plumb_bob\n", &[0.0; 5])
    );
    let latin_1: Vec<u8> = text
        .chars()
        .map(|letter| u8::try_from(u32::from(letter)).expect("Latin 1"))
        .collect();
    let of = |bytes: &[u8]| {
        let site = "[camera.front]\ncalibration = \"c.yaml\"\nmount = { x = 0.2, y = 0.0, z = 0.5, roll_deg = 0.0, pitch_deg = 0.0, yaw_deg = 0.0 }\n";
        Case::new(&[("site.toml", site.as_bytes()), ("c.yaml", bytes)])
            .run("check site.toml --json")
    };
    assert_eq!(of(&latin_1).json(0)["warnings"], serde_json::json!([]));
    let utf_16: Vec<u8> = text.encode_utf16().flat_map(u16::to_le_bytes).collect();
    of(&utf_16).is_refused_with(&["not UTF-8", "encoding UTF-8"]);
}

#[test]
fn lost_messages_of_an_echo_are_left_out() {
    let message = "header:\n  frame_id: optical\nheight: 480\nwidth: 640\ndistortion_model: plumb_bob\nd: [0.1, -0.2, 0.0, 0.0, 0.0]\nk: [520.5, 0.0, 322.0, 0.0, 521.0, 238.5, 0.0, 0.0, 1.0]\n---\n";
    let loss = "A message was lost!!!\n\ttotal count change:1\n\ttotal count: 1---\n";
    let checked = check(&format!("{loss}{message}{loss}"), "--json").json(0);
    assert_eq!(
        checked["warnings"].as_array().map(Vec::len),
        Some(1),
        "{checked}"
    );
    let words = checked["warnings"][0]["message"]
        .as_str()
        .expect("a message");
    assert!(words.contains("2 times"), "{words}");
    // The line of a fault is that of the file.
    refused(
        &format!("{loss}{}", message.replace("640", "x")),
        &["c.yaml:7:8"],
    );
}

#[test]
fn files_of_other_kinds_say_what_to_use() {
    refused(
        "# oST version 5.0 parameters\n\n\n[image]\n\nwidth\n640\n",
        &["INI", "ost.yaml"],
    );
    is_read(
        "%YAML:1.0\n---\nmodel_type: PINHOLE_FULL\ncamera_name: c\nimage_width: 640\nimage_height: 480\ndistortion_parameters:\n   k1: 0.1\n   k2: 0.02\n   k3: 0.1\n   k4: 0.2\n   k5: 0.0\n   k6: 0.0\n   p1: 0.0001\n   p2: 0.00002\nprojection_parameters:\n   fx: 461.0\n   fy: 460.0\n   cx: 323.0\n   cy: 248.0\n",
    );
}
