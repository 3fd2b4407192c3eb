use super::*;
use posegate_site::SAMPLE;

const SETTINGS: DetectorSettings = DetectorSettings {
    corner_sigma_px: 0.3,
    max_hamming: 0,
    radius_squared: 11.3449,
};
/// Tag 7 of the sample from x = 1 m, y = -1.5 m, yaw = 0.45 rad.
const CORNERS: [[f64; 2]; 4] = [
    [284.9, 269.1],
    [338.1, 270.4],
    [338.1, 209.6],
    [284.9, 210.9],
];

fn detector() -> Detector {
    let site = Site::parse(SAMPLE, "site.toml").unwrap();
    Detector::new(&site, Some("front"), SETTINGS).unwrap()
}

fn info() -> CameraInfo {
    CameraInfo {
        width: 640,
        height: 480,
        distortion_model: "plumb_bob".into(),
        d: vec![0.0; 5],
        k: [615.0, 0.0, 320.0, 0.0, 615.0, 240.0, 0.0, 0.0, 1.0],
        r: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        p: [
            615.0, 0.0, 320.0, 0.0, 0.0, 615.0, 240.0, 0.0, 0.0, 0.0, 1.0, 0.0,
        ],
        ..CameraInfo::default()
    }
}

fn tag() -> FoundTag {
    FoundTag {
        family: "36h11".into(),
        id: 7,
        hamming: 0,
        corners_px: CORNERS,
    }
}

#[test]
fn known_tag_gives_a_pose() {
    let detector = detector();
    let camera = detector.camera(&info()).unwrap();
    let other = FoundTag { id: 99, ..tag() };
    for found in [vec![tag()], vec![other, tag()]] {
        let fixes = detector.look(&camera, &found).unwrap();
        let [x, y, yaw] = fixes[0].pose;
        assert!((x - 1.0).abs() < 0.01 && (y + 1.5).abs() < 0.01 && (yaw - 0.45).abs() < 0.01);
    }
}

#[test]
fn unusable_detections_have_their_own_errors() {
    let detector = detector();
    let camera = detector.camera(&info()).unwrap();
    let change = |change: &dyn Fn(&mut FoundTag)| {
        let mut tag = tag();
        change(&mut tag);
        tag
    };
    let moved = |by: f64| {
        move |tag: &mut FoundTag| {
            for [u, _] in &mut tag.corners_px {
                *u += by;
            }
        }
    };
    let misfit = Some(Reason::CornersDoNotFit);
    for (found, words, reason) in [
        (vec![], "no tag is detected", None),
        (
            vec![change(&|tag| tag.id = 8)],
            "tag 36h11 8 is not in the site, which has tag36h11 7",
            None,
        ),
        (vec![change(&|tag| tag.id = -1)], "not in the site", None),
        (
            vec![change(&|tag| tag.family = "tag25h9".into())],
            "tag tag25h9 7 is not in the site",
            None,
        ),
        (
            vec![change(&|tag| tag.hamming = 1)],
            "1 corrected bits, at most 0",
            None,
        ),
        (
            vec![change(&|tag| tag.hamming = -1)],
            "corrected bits",
            None,
        ),
        (vec![tag(), tag()], "detected twice", misfit),
        (vec![change(&moved(400.0))], "not in the image", misfit),
        (
            vec![change(&|tag| tag.corners_px[3][1] = f64::NAN)],
            "not finite",
            Some(Reason::TooFewCorners),
        ),
        (
            vec![change(&|tag| tag.corners_px.rotate_left(1))],
            "do not fit",
            misfit,
        ),
    ] {
        let error = detector.look(&camera, &found).unwrap_err();
        let message = error.to_string();
        assert!(message.contains(words), "{message}");
        assert_eq!(error.reason(), reason, "{message}");
    }
}

#[test]
fn calibration_of_another_camera_is_refused() {
    let detector = detector();
    let change = |change: &dyn Fn(&mut CameraInfo)| {
        let mut info = info();
        change(&mut info);
        info
    };
    for (info, words) in [
        (CameraInfo::default(), "calibrate the camera"),
        (
            change(&|info| info.width = 1280),
            "image of 1280 x 480, and the site's camera `front` has 640 x 480",
        ),
        (change(&|info| info.binning = [2, 2]), "image of 320 x 240"),
        (
            change(&|info| info.roi = [0, 0, 320, 240]),
            "image of 320 x 240",
        ),
        (
            change(&|info| info.k[0] = 618.0),
            "differs from the site's camera `front` by up to",
        ),
        (change(&|info| info.k[2] = 330.0), "differs"),
        (change(&|info| info.d[0] = -0.3), "differs"),
        (change(&|info| info.k[0] = f64::NAN), "camera info"),
        (
            change(&|info| info.d = vec![0.1; 3]),
            "`plumb_bob` with 3 coefficients",
        ),
    ] {
        // The rectified image of a pinhole site is also compared: give it the same fault.
        let mut info = info;
        info.p = [
            info.k[0], 0.0, info.k[2], 0.0, 0.0, info.k[4], info.k[5], 0.0, 0.0, 0.0, 1.0, 0.0,
        ];
        if info.d.iter().any(|d| *d != 0.0) {
            info.r[1] = 0.1;
        }
        let error = detector.camera(&info).unwrap_err().to_string();
        assert!(error.contains(words), "{words}: {error}");
    }
    // A pinhole site whose detector reads the rectified image of a lens.
    let lens = change(&|info| {
        info.d = vec![-0.2, 0.05, 0.0, 0.0, 0.0];
        info.k = [600.0, 0.0, 318.0, 0.0, 601.0, 243.0, 0.0, 0.0, 1.0];
    });
    let camera = detector.camera(&lens).unwrap().camera;
    assert_eq!((camera.fx, camera.lens()), (615.0, Lens::Pinhole));
    // A small difference is accepted, and the published numbers are used.
    let near = change(&|info| info.k[0] = 616.0);
    assert_eq!(detector.camera(&near).unwrap().camera.fx, 616.0);
}

#[test]
fn site_without_the_camera_is_refused() {
    let mut site = Site::parse(SAMPLE, "site.toml").unwrap();
    let error = |site: &Site, name| Detector::new(site, name, SETTINGS).unwrap_err().to_string();
    assert!(error(&site, Some("rear")).contains("no camera `rear`: it has front"));
    let front = site.cameras["front"];
    site.cameras.insert("rear".into(), front);
    assert!(error(&site, None).contains("front, rear: name one"));
    site.cameras.clear();
    assert!(error(&site, None).contains("no camera: add"));
    site.cameras.insert("front".into(), front);
    site.tags.clear();
    assert!(error(&site, None).contains("no tag: add"));
}

/// Tags with equal family and number cannot be identified. The tolerance of a calibration is not in the pose-set.
#[test]
fn equal_tags_and_calibration_tolerance_are_refused() {
    let new = |site: &str| {
        let site = Site::parse(site, "site.toml").unwrap();
        Detector::new(&site, Some("front"), SETTINGS).map(|_| ())
    };
    let twin = "[tag.other]\nid = 7\nfamily = \"36h11\"\nsize = 0.3\npose = { x = 9.0, y = 9.0, z = 0.5, roll_deg = 0.0, pitch_deg = 0.0, yaw_deg = 90.0 }\n";
    let expected = DetectorError::Alike(AlikeTags {
        first: "other".into(),
        second: "t7".into(),
    });
    assert_eq!(new(&format!("{SAMPLE}\n{twin}")), Err(expected));
    assert_eq!(
        new(&format!("{SAMPLE}\n{}", twin.replace("id = 7", "id = 8"))),
        Ok(())
    );
    let loose = SAMPLE.replace(
        "fx = 615.0",
        "tolerance = { focal = 0.01, centre_px = 0.0 }\nfx = 615.0",
    );
    assert_eq!(new(&loose), Err(DetectorError::Calibration("front".into())));
}

/// A second detection of a tag is a contradiction even if it has corrected bits.
#[test]
fn tag_detected_twice_is_a_contradiction() {
    let detector = detector();
    let camera = detector.camera(&info()).unwrap();
    let weak = FoundTag {
        hamming: 1,
        ..tag()
    };
    for found in [[weak.clone(), tag()], [tag(), weak]] {
        assert_eq!(detector.look(&camera, &found), Err(LookError::Twice(7)));
    }
}
