//! Prints lens models and windows as JSON lines for `./ci.sh lenses`, which compares them with OpenCV: a
//! calibration, random points of its field with their pixels, and its window.

use posegate::certify::{Calibration, CertifiedCamera, Image};
use posegate::shape::Lens;
use serde_json::json;

/// Number of points of each lens.
const POINTS: usize = 1000;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut state = 1u64;
    let mut unit = || {
        // splitmix64.
        state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (state ^ (state >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    };
    for (lens, focal) in [
        (Lens::Pinhole, 615.0),
        (
            Lens::PlumbBob([-0.22, 0.06, 0.0006, -0.0004, -0.006]),
            410.0,
        ),
        (Lens::PlumbBob([0.12, 0.03, -0.001, 0.002, 0.01]), 410.0),
        (
            Lens::RationalPolynomial([5.1, 2.9, -0.0002, 0.0003, 0.14, 5.4, 4.4, 0.8]),
            410.0,
        ),
        (
            Lens::RationalPolynomial([-0.31, 0.09, 0.002, -0.001, 0.004, 0.02, -0.01, 0.003]),
            500.0,
        ),
        (Lens::Equidistant([-0.012, 0.006, -0.004, 0.0007]), 300.0),
        (Lens::Equidistant([0.0; 4]), 250.0),
    ] {
        let calibration = Calibration {
            size_px: [640.0, 480.0],
            focal_px: [focal, 1.003 * focal],
            axis_px: [325.5, 236.25],
            lens,
            image: Image::Raw,
            roi: None,
            binning: [1, 1],
            border_px: 0.0,
        };
        let view = CertifiedCamera::of(&calibration)?;
        let camera = view.camera;
        let reach = view.field.min(1.5);
        let points: Vec<[f64; 2]> =
            std::iter::repeat_with(|| [0; 2].map(|_| reach * (2.0 * unit() - 1.0)))
                .filter(|[x, y]| x.hypot(*y) <= reach)
                .take(POINTS)
                .collect();
        let pixels: Vec<[f64; 2]> = points.iter().map(|point| camera.project(*point)).collect();
        let line = json!({
            "model": lens.name(),
            "coefficients": lens.coefficients(),
            "k": [camera.fx, camera.fy, camera.cx, camera.cy],
            "size": [camera.width_px, camera.height_px],
            "points": points,
            "pixels": pixels,
            "planes": camera.view().planes(),
            "kept": view.kept,
        });
        println!("{line}");
    }
    Ok(())
}
