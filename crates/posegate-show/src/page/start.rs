//! The initial standard deviations of the panel in which the reader drags an estimate.

use posegate::gate::{Verdict, judge};
use posegate::set::{Estimate, PoseSet};
use posegate::table::Table;
use posegate_replay::factor;
use posegate_site::Task;

/// The margin of the first pose-set: well inside, and so near the border that it leaves the set when it is dragged.
const MARGIN: f64 = 1.5;
/// The largest first pose-set: this share of the drawn part, and this many degrees.
const LARGEST: [f64; 2] = [0.25, 10.0];

/// Returns sigmas of x, y (m) and yaw (degrees): those of the expected pose-set; without one, those of a pose-set
/// about the goal that is proven inside with a margin of about 1.5. `wide` is the smaller side of the drawn part,
/// metres.
pub(super) fn first_sigmas(task: &Task, wide: f64, table: Option<&Table<'_>>) -> [f64; 3] {
    let radius = table.map_or(3.0, |table| {
        libm::sqrt(f64::from(table.radius_squared().q16()) / 65_536.0)
    });
    if let Some(expected) = task.wish.expected {
        let sigma = |reach: f64| libm::round(reach / radius * 1e4) / 1e4;
        let [xy, yaw] = [expected.translation, expected.turn_deg].map(sigma);
        return [xy, xy, yaw];
    }
    let begun = [0.05 * wide, 1.0];
    let scale = table
        .and_then(|table| margin(task, table, begun))
        .filter(|margin| *margin > 0.0)
        .map_or(1.0, |margin| margin / MARGIN);
    let largest = (LARGEST[0] * wide / begun[0]).min(LARGEST[1] / begun[1]);
    let [xy, yaw] = begun.map(|reach| rounded_down(reach * scale.min(largest) / radius));
    [xy, xy, yaw]
}

/// Returns the margin of a pose-set about the goal: the half-axes in metres and in degrees.
fn margin(task: &Task, table: &Table<'_>, [xy, yaw_deg]: [f64; 2]) -> Option<f64> {
    let goal = task.success.goal;
    let estimate = Estimate {
        x_m: goal.x,
        y_m: goal.y,
        yaw_rad: goal.yaw_deg.to_radians(),
    };
    let squared = f64::from(table.radius_squared().q16()) / 65_536.0;
    let yaw = yaw_deg.to_radians();
    let variance = [xy * xy, xy * xy, yaw * yaw].map(|v| v / squared);
    let covariance = [
        [variance[0], 0.0, 0.0],
        [0.0, variance[1], 0.0],
        [0.0, 0.0, variance[2]],
    ];
    let set = PoseSet::gaussian(estimate, covariance, table.radius_squared()).ok()?;
    match judge(table, &set) {
        Verdict::Permit { margin } => Some(factor(margin)),
        Verdict::Deny { margin, .. } => margin.map(factor),
    }
}

/// Rounds down to two significant digits.
fn rounded_down(value: f64) -> f64 {
    if !(value > 0.0) {
        return value;
    }
    let unit = libm::pow(10.0, libm::floor(libm::log10(value)) - 1.0);
    let digits = libm::floor(value / unit + 1e-9);
    // The inverse of a power of ten avoids further digits.
    let inverse = libm::round(1.0 / unit);
    if inverse >= 1.0 {
        digits / inverse
    } else {
        digits * unit
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use posegate::bake::BakeInput;
    use posegate::verify::build;
    use posegate_site::{SAMPLE, Site};

    #[test]
    fn first_pose_set_is_inside_and_near_the_border() {
        let site = Site::parse(SAMPLE, "site.toml").unwrap();
        for (name, task) in &site.tasks {
            let order = BakeInput {
                task: name,
                success: &task.success,
                spec: site.chosen_table(task).unwrap(),
                epsilon: site.epsilon,
            };
            let (bytes, _) = build(&order, &|| ()).unwrap();
            let table = Table::parse(&bytes).unwrap();
            let [xy, _, yaw] = first_sigmas(task, 4.0, Some(&table));
            let radius = libm::sqrt(f64::from(table.radius_squared().q16()) / 65_536.0);
            let margin = margin(task, &table, [xy * radius, yaw * radius]).unwrap();
            assert!(
                (1.4..=2.0).contains(&margin),
                "{name}: {margin}, {xy} m, {yaw} deg"
            );
        }
    }

    #[test]
    fn two_significant_digits_are_kept() {
        for (value, rounded) in [(0.012_99, 0.012), (1.29, 1.2), (0.3, 0.3), (47.9, 47.0)] {
            assert_eq!(rounded_down(value), rounded);
        }
    }
}
