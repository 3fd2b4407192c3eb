//! Quick estimate of the expected cost, for searches: few rays at fixed headings.

use super::gaussian::WhitenedPoseSet;
use super::quadrature::nodes;
use super::rays::{Ray, Rule};
use core::f64::consts::{FRAC_PI_2, TAU};
use posegate::shape::{LineClipper, LineSegment};

/// The number of directions at each heading.
const DIRECTIONS: u32 = 24;

/// Returns the integral of the cost inside, and the mass outside.
///
/// Uses 15 headings (Kronrod's nodes) with 24 rays each. At every second heading the rays are turned by half a step.
/// If S contains the pose-set, the result is accurate to 1e-3 or better, else to a few percent. The mass outside is
/// exact along each ray.
pub(super) fn sums(
    along: &LineClipper,
    white: &WhitenedPoseSet,
    of_view: &dyn Fn([f64; 3]) -> f64,
) -> [f64; 2] {
    let views = along.views();
    let mut sums = [0.0; 2];
    for (number, (node, weight, _)) in nodes().enumerate() {
        let t = FRAC_PI_2 * node;
        let (u1, radius) = (white.radius * libm::sin(t), white.radius * libm::cos(t));
        let density = libm::exp(-0.5 * u1 * u1) / libm::sqrt(TAU);
        let share = FRAC_PI_2 * weight * density * radius / f64::from(DIRECTIONS);
        let headed = along.at(white.yaw * u1);
        let turned = if number % 2 == 0 { 0.0 } else { 0.5 };
        for k in 0..DIRECTIONS {
            let angle = (f64::from(k) + turned) * TAU / f64::from(DIRECTIONS);
            let walk = LineSegment {
                from: white.middle(u1),
                way: white.to_metres([libm::cos(angle), libm::sin(angle)]),
                length: radius,
            };
            let ray = Ray::cast(&headed, views, walk, radius);
            sums[0] += share * ray.seen(&headed, views, of_view, Rule::By7).value;
            sums[1] += share * ray.outside();
        }
    }
    sums
}
