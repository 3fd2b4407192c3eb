//! Each point of a camera's window is seen through every lens, and the window leaves little
//! of the image unused. The lens models agree with OpenCV's formulas.

#[path = "lenses/refused.rs"]
mod refused;

use posegate::certify::{Calibration, CertifiedCamera, Image, LensError, Roi};
use posegate::shape::{Camera, Lens};

/// OpenCV's formulas, term by term, in its own order (`projectPoints`, `fisheye::projectPoints`).
fn formula(lens: &Lens, [x, y]: [f64; 2]) -> [f64; 2] {
    let r2 = x * x + y * y;
    let k = lens.coefficients();
    match lens.name() {
        "plumb_bob" | "rational_polynomial" => {
            let all = |i: usize| k.get(i).copied().unwrap_or(0.0);
            let above = 1.0 + all(0) * r2 + all(1) * r2.powi(2) + all(4) * r2.powi(3);
            let below = 1.0 + all(5) * r2 + all(6) * r2.powi(2) + all(7) * r2.powi(3);
            let (p1, p2) = (k[2], k[3]);
            [
                x * above / below + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
                y * above / below + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
            ]
        }
        "equidistant" => {
            let r = r2.sqrt();
            let theta = r.atan();
            let powers = [3, 5, 7, 9].map(|n| theta.powi(n));
            let bent = theta + powers.iter().zip(k).map(|(t, k)| t * k).sum::<f64>();
            let scale = if r > 1e-8 { bent / r } else { 1.0 };
            [x * scale, y * scale]
        }
        _ => [x, y],
    }
}

/// A random number generator (splitmix64).
struct Random(u64);

impl Random {
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    fn within(&mut self, lo: f64, hi: f64) -> f64 {
        lo + (hi - lo) * self.unit()
    }
}

fn calibration(lens: Lens) -> Calibration {
    Calibration {
        size_px: [640.0, 480.0],
        focal_px: [410.0, 412.0],
        axis_px: [325.5, 236.25],
        lens,
        image: Image::Raw,
        roi: None,
        binning: [1, 1],
        border_px: 0.0,
    }
}

const BARREL: Lens = Lens::PlumbBob([-0.22, 0.06, 0.0006, -0.0004, -0.006]);
const PINCUSHION: Lens = Lens::PlumbBob([0.12, 0.03, -0.001, 0.002, 0.01]);
const MUSTACHE: Lens = Lens::PlumbBob([-0.2, 0.16, 0.0, 0.0, 0.0]);
const RATIONAL: Lens = Lens::RationalPolynomial([5.1, 2.9, -0.0002, 0.0003, 0.14, 5.4, 4.4, 0.8]);
const FISHEYE: Lens = Lens::Equidistant([-0.012, 0.006, -0.004, 0.0007]);

/// Returns named lenses with their calibration and the least share that their window must keep.
fn cases() -> Vec<(&'static str, Calibration, f64)> {
    let with = |lens, change: &dyn Fn(&mut Calibration)| {
        let mut calibration = calibration(lens);
        change(&mut calibration);
        calibration
    };
    let plain = |lens| with(lens, &|_| ());
    vec![
        ("barrel", plain(BARREL), 0.85),
        ("pincushion", plain(PINCUSHION), 0.99),
        ("mustache", plain(MUSTACHE), 0.9),
        ("rational", plain(RATIONAL), 0.8),
        ("fisheye", plain(FISHEYE), 0.6),
        (
            "wide fisheye",
            with(FISHEYE, &|c| c.focal_px = [250.0, 250.0]),
            0.3,
        ),
        ("border", with(BARREL, &|c| c.border_px = 12.0), 0.85),
        (
            "corner of a barrel",
            with(BARREL, &|c| {
                c.roi = Some(Roi {
                    x_offset: 400,
                    y_offset: 300,
                    width: 240,
                    height: 180,
                });
            }),
            0.85,
        ),
        (
            "binned corner of a fisheye",
            with(FISHEYE, &|c| {
                c.roi = Some(Roi {
                    x_offset: 10,
                    y_offset: 20,
                    width: 301,
                    height: 222,
                });
                c.binning = [2, 3];
            }),
            0.6,
        ),
        (
            "rectified, all of the raw image",
            with(BARREL, &|c| {
                c.image = Image::Rect([300.0, 300.0, 320.0, 240.0])
            }),
            0.85,
        ),
        (
            "rectified, no black border",
            with(BARREL, &|c| {
                c.image = Image::Rect([400.0, 400.0, 320.0, 240.0])
            }),
            0.999,
        ),
        (
            "rectified, in between",
            with(PINCUSHION, &|c| {
                c.image = Image::Rect([430.0, 430.0, 330.0, 230.0])
            }),
            0.99,
        ),
        (
            "rectified without a lens",
            with(Lens::Pinhole, &|c| {
                c.image = Image::Rect([400.0, 420.0, 300.0, 250.0])
            }),
            0.999,
        ),
    ]
}

#[test]
fn lens_models_match_opencv_formulas() {
    let mut random = Random(1);
    for lens in [BARREL, PINCUSHION, RATIONAL, FISHEYE, Lens::Pinhole] {
        for _ in 0..2000 {
            let point = [random.within(-1.5, 1.5), random.within(-1.5, 1.5)];
            let (ours, theirs) = (lens.distort(point), formula(&lens, point));
            for axis in 0..2 {
                // 1e-9 px at a focal length of 1000 px.
                assert!(
                    (ours[axis] - theirs[axis]).abs() < 1e-12,
                    "{lens:?} {point:?}"
                );
            }
        }
    }
    assert_eq!(FISHEYE.distort([0.0, 0.0]), [0.0, 0.0]);
}

/// Returns by how many pixels a normalised point is certainly seen, negative outside, from the calibration with the
/// test's own formulas.
fn slack_px(calibration: &Calibration, point: [f64; 2]) -> f64 {
    let [x, y] = formula(&calibration.lens, point);
    let (fx, fy) = (calibration.focal_px[0], calibration.focal_px[1]);
    let raw = [
        fx * x + calibration.axis_px[0],
        fy * y + calibration.axis_px[1],
    ];
    let mut places = vec![raw];
    if let Image::Rect([fx, fy, cx, cy]) = calibration.image {
        places.push([fx * point[0] + cx, fy * point[1] + cy]);
    }
    let roi = calibration.roi.unwrap_or(Roi {
        x_offset: 0,
        y_offset: 0,
        width: calibration.size_px[0] as u32,
        height: calibration.size_px[1] as u32,
    });
    let offset = [roi.x_offset, roi.y_offset].map(f64::from);
    let size = [roi.width, roi.height];
    let mut least = f64::INFINITY;
    for place in places {
        for axis in 0..2 {
            let binning = calibration.binning[axis];
            let at = (place[axis] - offset[axis]) / f64::from(binning);
            let end = f64::from(size[axis] / binning);
            least = least.min(at - calibration.border_px);
            least = least.min(end - calibration.border_px - at);
        }
    }
    least
}

/// Returns the corners of a window, from its planes in any order.
fn corners(camera: &Camera) -> Vec<[f64; 2]> {
    let window = camera.view();
    let mut planes = window.planes().to_vec();
    planes.sort_by(|p, q| p[1].atan2(p[0]).total_cmp(&q[1].atan2(q[0])));
    let next = planes.iter().cycle().skip(1);
    planes
        .iter()
        .zip(next)
        .map(|([a, b, c], [d, e, f])| {
            let turn = a * e - b * d;
            [(b * f - c * e) / turn, (c * d - a * f) / turn]
        })
        .collect()
}

/// Draws points of a window, a third of them on its border and a third near it, where a fault would be, and
/// compares each with the calibration. Returns how many were in the window.
fn compare_points(
    name: &str,
    calibration: &Calibration,
    view: &CertifiedCamera,
    draws: u32,
    random: &mut Random,
) -> u32 {
    let window = view.camera.view();
    let corners = corners(&view.camera);
    let middle = [0, 1].map(|i| corners.iter().map(|c| c[i]).sum::<f64>() / corners.len() as f64);
    let mut tried = 0;
    for draw in 0..draws {
        let edge = (random.unit() * corners.len() as f64) as usize;
        let (from, to) = (corners[edge], corners[(edge + 1) % corners.len()]);
        let t = random.unit();
        let out = match draw % 3 {
            0 => 1.0 - 1e-9,
            1 => 1.0 - 1e-3 * random.unit(),
            _ => random.unit().sqrt(),
        };
        let point = [0, 1].map(|i| middle[i] + out * (from[i] + t * (to[i] - from[i]) - middle[i]));
        if !window.contains(point) {
            continue;
        }
        tried += 1;
        let slack = slack_px(calibration, point);
        assert!(
            slack >= -1e-9,
            "{name}: {point:?} is {slack} px outside of {calibration:?}"
        );
        assert!(point[0].hypot(point[1]) <= view.field, "{name}: {point:?}");
    }
    tried
}

/// Tests a hundred thousand points of each window.
#[test]
fn every_point_of_a_window_is_seen() {
    let mut random = Random(2);
    for (name, calibration, _) in cases() {
        let view =
            CertifiedCamera::of(&calibration).unwrap_or_else(|error| panic!("{name}: {error}"));
        let tried = compare_points(name, &calibration, &view, 150_000, &mut random);
        assert!(tried >= 100_000, "{name}: {tried}");
    }
}

/// Random lenses, axes, borders and parts of the sensor: refused calibrations have a reason, and the windows of the
/// others are correct. No window is left unproven.
#[test]
fn windows_of_random_cameras_are_seen() {
    let mut random = Random(3);
    let (mut proven, mut folds, mut tried) = (0, 0, 0);
    for _ in 0..600 {
        let mut k = |size: f64| random.within(-size, size);
        let lens = match (k(1.0) * 2.0).round() as i32 {
            -2..=-1 => Lens::PlumbBob([k(0.4), k(0.2), k(0.01), k(0.01), k(0.1)]),
            0 => Lens::RationalPolynomial([
                k(0.5),
                k(0.3),
                k(0.01),
                k(0.01),
                k(0.1),
                k(0.5),
                k(0.3),
                k(0.1),
            ]),
            _ => Lens::Equidistant([k(0.1), k(0.05), k(0.02), k(0.01)]),
        };
        let mut calibration = calibration(lens);
        let focal = random.within(250.0, 900.0);
        calibration.focal_px = [focal, focal * random.within(0.9, 1.1)];
        calibration.axis_px = [random.within(200.0, 440.0), random.within(150.0, 330.0)];
        if random.unit() < 0.3 {
            calibration.border_px = random.within(0.0, 20.0);
        }
        if random.unit() < 0.3 {
            let (x_offset, y_offset) = (
                (random.unit() * 400.0) as u32,
                (random.unit() * 300.0) as u32,
            );
            calibration.roi = Some(Roi {
                x_offset,
                y_offset,
                width: 640 - x_offset,
                height: 480 - y_offset,
            });
            calibration.binning = [
                1 + (random.unit() * 3.0) as u32,
                1 + (random.unit() * 3.0) as u32,
            ];
        }
        if random.unit() < 0.3 {
            let focal = focal * random.within(0.6, 1.4);
            calibration.image = Image::Rect([
                focal,
                focal,
                random.within(250.0, 390.0),
                random.within(180.0, 300.0),
            ]);
        }
        match CertifiedCamera::of(&calibration) {
            Ok(view) => {
                proven += 1;
                tried += compare_points("random", &calibration, &view, 600, &mut random);
            }
            Err(LensError::Folds { .. }) => folds += 1,
            Err(LensError::Nothing { .. }) => {}
            Err(error) => panic!("{error}: {calibration:?}"),
        }
    }
    println!("{proven} proven, {folds} fold, {tried} points");
    assert!(
        proven >= 300 && folds >= 50 && tried >= 100_000,
        "{proven} {folds} {tried}"
    );
}

/// Returns the share of the visible solid angle that the window keeps, by adding up small pieces, without formulas of
/// the crate.
fn counted(calibration: &Calibration, view: &CertifiedCamera) -> f64 {
    let window = view.camera.view();
    let reach = corners(&view.camera)
        .iter()
        .map(|c| c[0].hypot(c[1]))
        .fold(0.0, f64::max)
        .min(view.field)
        * 1.6;
    let (mut seen, mut kept) = (0.0, 0.0);
    const GRID: i32 = 700;
    for i in -GRID..=GRID {
        for j in -GRID..=GRID {
            let point = [i, j].map(|n| reach * f64::from(n) / f64::from(GRID));
            let inside = point[0].hypot(point[1]) <= view.field;
            if inside && slack_px(calibration, point) >= 0.0 {
                let weight = (1.0 + point[0] * point[0] + point[1] * point[1]).powf(-1.5);
                seen += weight;
                kept += weight * f64::from(u8::from(window.contains(point)));
            }
        }
    }
    kept / seen
}

/// A window reports the share of the visible solid angle that it keeps, which is at least that of its case.
#[test]
fn windows_keep_their_required_share() {
    for (name, calibration, least) in cases() {
        let view = CertifiedCamera::of(&calibration).unwrap();
        let planes = view.camera.view().planes().len();
        let counted = counted(&calibration, &view);
        println!(
            "{name}: {planes} planes, kept {:.4} (counted {counted:.4}), field {:.3}",
            view.kept, view.field
        );
        assert!(
            view.kept >= least && view.kept <= 1.0,
            "{name}: {}",
            view.kept
        );
        assert!(
            (counted - view.kept).abs() < 0.02,
            "{name}: {counted} {}",
            view.kept
        );
        assert!((3..=16).contains(&planes), "{name}: {planes}");
    }
}
