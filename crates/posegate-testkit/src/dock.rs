//! A good estimate for the dock, and an oracle in plain floats for reports, which shares nothing with the crate.

use posegate::report::{FrameId, Heading, PoseEstimate, Report};
use posegate::set::{Estimate, Uncertainty};

/// Returns an estimate that the dock permits: standard deviations of 5 mm and 0.3 degrees, near the goal.
pub fn good_belief() -> PoseEstimate {
    let estimate = Estimate {
        x_m: 0.01,
        y_m: -0.005,
        yaw_rad: 0.004,
    };
    let covariance = [
        [2.5e-5, 2e-6, 1e-6],
        [2e-6, 2.5e-5, 1e-6],
        [1e-6, 1e-6, 2.7e-5],
    ];
    PoseEstimate::new(estimate, Uncertainty::Gaussian(covariance))
}

/// Returns `true` if a report may be permitted, by plain floats and the limits of the site file: a dock of 8 cm,
/// 6 cm and 4 degrees to either side. Shares no code with the crate.
pub fn is_really_good(report: &Report) -> bool {
    let radius = 11.344_866_730_144_37_f64.sqrt();
    let reach = match report.belief.spread {
        None => return false,
        Some(Uncertainty::Bounded {
            translation_m,
            yaw_rad,
        }) => {
            let positive = translation_m > 0.0 && yaw_rad > 0.0;
            if !positive {
                return false;
            }
            [translation_m, translation_m, yaw_rad]
        }
        Some(Uncertainty::Gaussian(c)) => {
            let [[xx, xy, xt], [yx, yy, yt], [tx, ty, tt]] = c;
            let same = |a: f64, b: f64| (a - b).abs() <= 1e-6 * a.abs().max(b.abs());
            let determinant =
                xx * (yy * tt - yt * yt) - xy * (xy * tt - yt * xt) + xt * (xy * yt - yy * xt);
            let definite = xx > 0.0 && xx * yy - xy * xy > 0.0 && determinant > 0.0;
            if !(definite && same(xy, yx) && same(xt, tx) && same(yt, ty)) {
                return false;
            }
            [xx, yy, tt].map(|variance| radius * variance.sqrt())
        }
    };
    // The tests send the firmware only yaws.
    let Heading::Radians(yaw) = report.belief.heading else {
        return false;
    };
    let turn = core::f64::consts::TAU;
    let yaw = yaw - turn * (yaw / turn).round();
    let within = |value: f64, reach: f64, half: f64| value.abs() + reach <= half + 1e-9;
    report.source == 0
        && report.frame == FrameId::of("map")
        && within(report.belief.x_m, reach[0], 0.08)
        && within(report.belief.y_m, reach[1], 0.06)
        && within(yaw, reach[2], 4f64.to_radians())
}
