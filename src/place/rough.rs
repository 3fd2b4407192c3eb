//! A quick look at the expected cost, for searches: few rays at fixed headings.

use super::gaussian::White;
use super::quadrature::nodes;
use super::rays::{Ray, Rule};
use crate::shape::{Along, Walk};
use core::f64::consts::{FRAC_PI_2, TAU};

/// Directions at a heading.
const DIRECTIONS: u32 = 24;

/// The mass-weighted cost of what is seen and the mass outside.
///
/// 15 headings (Kronrod's) with 24 rays each, every second heading turned by half a step: where S holds the pose-set it
/// is good to 1e-3 and better, elsewhere to some percent. Of every ray the mass outside is exact.
pub(super) fn sums(along: &Along, white: &White, of_view: &dyn Fn([f64; 3]) -> f64) -> [f64; 2] {
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
            let walk = Walk {
                from: white.middle(u1),
                way: white.way([libm::cos(angle), libm::sin(angle)]),
                length: radius,
            };
            let ray = Ray::cast(&headed, views, walk, radius);
            sums[0] += share * ray.seen(&headed, views, of_view, Rule::By7).value;
            sums[1] += share * ray.outside();
        }
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::place::{Cost, Gaussian, Quadrature, expected_cost};
    use crate::site::{SAMPLE, Site};

    #[test]
    fn a_quick_look_is_near_the_truth() {
        let site = Site::parse(SAMPLE, "site.toml").unwrap();
        let set = &site.task("see-t7").unwrap().success;
        let cost = Cost::default();
        for (sigmas, near) in [
            ([0.05, 0.1, 0.02], 1e-4),
            ([0.1, 0.1, 0.0175], 1e-4),
            ([0.5, 0.4, 0.1], 0.05),
            ([1.0, 1.0, 0.3], 0.05),
        ] {
            let belief = Gaussian::of_sigmas(sigmas, 0.99).unwrap();
            let exact = expected_cost(set, &belief, &cost, &Quadrature::default()).unwrap();
            let of_view = |view| cost.of_view(view);
            let [seen, outside] = sums(&Along::of(set), &belief.at(set.goal), &of_view);
            let mean = (seen + cost.c_high * outside) / belief.mass();
            let off = mean / exact.mean.value - 1.0;
            assert!(off.abs() < near, "{sigmas:?}: {mean} {}", exact.mean.value);
        }
    }
}
