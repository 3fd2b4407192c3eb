//! Invalid cameras are refused with their numbers; pinhole cameras are not changed.

use super::{BARREL, calibration};
use posegate::certify::{Calibration, CertifiedCamera, Image, LensError, Roi};
use posegate::shape::{Camera, Lens};

fn fault(lens: Lens, change: impl Fn(&mut Calibration)) -> LensError {
    let mut calibration = calibration(lens);
    change(&mut calibration);
    match CertifiedCamera::of(&calibration) {
        Ok(view) => panic!("no fault: {view:?}"),
        Err(error) => error,
    }
}

#[test]
fn folds_in_the_image_are_refused_with_their_radius() {
    // r - r^3 / 3 is largest at 1, where it is 2/3: 410 px * 2/3 along a row.
    let folding = Lens::PlumbBob([-1.0 / 3.0, 0.0, 0.0, 0.0, 0.0]);
    let error = fault(folding, |c| c.focal_px = [410.0, 410.0]);
    let LensError::Folds { fold_px, image_px } = error else {
        panic!("{error}");
    };
    assert!((fold_px - 410.0 * 2.0 / 3.0).abs() < 0.01, "{error}");
    // The farthest corner is that at (0, 480).
    assert!((image_px - 325.5f64.hypot(243.75)).abs() < 1e-9, "{error}");
    assert_eq!(
        error.to_string(),
        "the distortion folds at 273.3 px from the optical axis, the image reaches 406.7 px"
    );
    // Not refused if the image ends before the fold, or if the fold is in the border that is left out.
    for (focal, border_px) in [(620.0, 0.0), (410.0, 100.0)] {
        let mut sound = calibration(folding);
        (sound.focal_px, sound.border_px) = ([focal; 2], border_px);
        assert!(CertifiedCamera::of(&sound).is_ok(), "{focal} {border_px}");
    }
    // A rectified image that shows the raw image twice: at r = 1.7, r - r^3 / 3 is 0.06.
    let ghost = fault(folding, |c| {
        c.image = Image::Rect([180.0, 180.0, 320.0, 240.0])
    });
    assert!(matches!(ghost, LensError::Folds { .. }), "{ghost}");
    let fault = |lens| fault(lens, |_| ());
    let steep = fault(Lens::Equidistant([-1e300, 0.0, 0.0, 0.0]));
    assert_eq!(steep, LensError::NoField);
    let nan = fault(Lens::PlumbBob([0.1, 0.0, f64::NAN, 0.0, 0.0]));
    assert!(nan.to_string().contains("coefficient is NaN"), "{nan}");
}

#[test]
fn invalid_numbers_are_refused() {
    let of = |change: &dyn Fn(&mut Calibration)| fault(Lens::Pinhole, change).to_string();
    assert_eq!(of(&|c| c.focal_px[0] = 0.0), "fx is 0");
    assert_eq!(of(&|c| c.axis_px[1] = f64::INFINITY), "cy is inf");
    assert_eq!(of(&|c| c.border_px = -1.0), "border_px is -1");
    assert_eq!(of(&|c| c.binning = [1, 0]), "binning_y is 0");
    assert_eq!(
        of(&|c| c.image = Image::Rect([400.0, f64::NAN, 320.0, 240.0])),
        "fy of the rectified image is NaN"
    );
    assert_eq!(
        of(&|c| c.border_px = 240.0),
        "a border of 240 px leaves nothing of an image of 640 x 480 px"
    );
    let beyond = Roi {
        x_offset: 600,
        y_offset: 0,
        width: 41,
        height: 480,
    };
    assert_eq!(
        of(&|c| c.roi = Some(beyond)),
        "the roi reaches to (641 px, 480 px), the image to (640 px, 480 px)"
    );
    // A rectified image that extends beyond the raw one.
    let past = fault(BARREL, |c| {
        c.image = Image::Rect([400.0, 400.0, 5000.0, 240.0])
    });
    assert!(matches!(past, LensError::Nothing { .. }), "{past}");
}

/// A pinhole without a border is unchanged; with a border its four planes have moved.
#[test]
fn pinhole_window_is_its_image() {
    let plain = CertifiedCamera::of(&calibration(Lens::Pinhole)).unwrap();
    let camera = Camera::pinhole([640.0, 480.0], [410.0, 412.0], [325.5, 236.25]);
    assert_eq!((plain.camera, plain.kept), (camera, 1.0));
    assert!(plain.camera.is_whole_pinhole() && plain.field == f64::INFINITY);
    let mut bordered = calibration(Lens::Pinhole);
    bordered.border_px = 10.5;
    let planes = CertifiedCamera::of(&bordered).unwrap().camera.view();
    let expected = [
        [410.0, 0.0, 315.0],
        [-410.0, 0.0, 304.0],
        [0.0, 412.0, 225.75],
        [0.0, -412.0, 233.25],
    ];
    assert_eq!(planes.planes(), expected);
}
