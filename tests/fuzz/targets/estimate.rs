//! Any bits as an estimate with its covariance or bounds: no set from invalid input, no set smaller
//! than the input, and no permit for a pose outside.
//!
//! The input is a byte for the table, a byte of options, the squared radius, and floats.
#![no_main]

use libfuzzer_sys::fuzz_target;
use posegate::contain::{Decision, Margin, decide, decide_with_margin, examine};
use posegate::set::{Estimate, Extent, PoseSet, RadiusSquared, SqrtFactor};
use posegate_fuzz::input::Input;
use posegate_fuzz::{sound, tables};
use std::f64::consts::TAU;

/// Units of 2^-24 turn per radian.
const Q24: f64 = 16_777_216.0 / TAU;

fuzz_target!(|data: &[u8]| {
    let mut input = Input(data);
    let [which, options] = input.take();
    let radius = u32::from_le_bytes(input.take());
    let radius_squared = RadiusSquared::from_q16(radius).unwrap_or(RadiusSquared::LARGEST);
    let estimate = Estimate {
        x_m: input.float(),
        y_m: input.float(),
        yaw_rad: input.float(),
    };
    let number = usize::from(which) % tables::BYTES.len();
    let (set, reach) = if options & 1 == 0 {
        let mut p = [[0.0; 3]; 3];
        p.as_flattened_mut().fill_with(|| input.float());
        // Most covariances are symmetric.
        if options & 2 == 0 {
            p = [
                p[0],
                [p[0][1], p[1][1], p[1][2]],
                [p[0][2], p[1][2], p[2][2]],
            ];
        }
        let Ok(set) = PoseSet::gaussian(estimate, p, radius_squared) else {
            return;
        };
        let Extent::Gaussian(factor) = set.extent() else {
            panic!("a covariance gave {:?}", set.extent());
        };
        let r2 = f64::from(radius_squared.q16()) / 65_536.0;
        is_a_covariance(p);
        dominates(factor, p, r2);
        (set, [0, 1, 2].map(|axis| (r2 * p[axis][axis]).sqrt()))
    } else {
        let (translation, yaw) = (input.float(), input.float());
        let Ok(set) = PoseSet::bounded(estimate, translation, yaw) else {
            return;
        };
        assert!(translation > 0.0 && translation < 268.5 && yaw > 0.0 && yaw.is_finite());
        let Extent::Bounded {
            translation_um,
            yaw_q24,
        } = set.extent()
        else {
            panic!("bounds gave {:?}", set.extent());
        };
        assert!(f64::from(translation_um) >= translation * 1e6 * (1.0 - 1e-15));
        assert!(f64::from(yaw_q24) >= (yaw * Q24).min(8_388_608.0) * (1.0 - 1e-15));
        (set, [translation, translation, yaw])
    };
    is_at(estimate, &set);
    let table = &tables::all()[number];
    let decision = decide(table, &set);
    let (again, margin) = decide_with_margin(table, &set);
    assert_eq!(again, decision);
    assert_eq!(margin >= Margin::ONE, decision == Decision::Inside);
    if decision == Decision::Inside {
        sound::holds(table, &set, margin, [3, -2, 1]);
        if number == 0 {
            is_docked(estimate, reach);
        }
    }
    if options & 12 == 0 {
        assert_eq!(examine(table, &set).decision, decision);
    }
});

/// Asserts that a covariance is finite, and has no property that excludes a positive definite matrix.
fn is_a_covariance(p: [[f64; 3]; 3]) {
    assert!(p.as_flattened().iter().all(|v| v.is_finite()));
    let root = [0, 1, 2].map(|axis| p[axis][axis].sqrt());
    assert!(root.iter().all(|v| *v > 0.0), "{p:?}");
    let rho =
        |i: usize, j: usize| 0.5 * (p[i][j] / root[i] / root[j] + p[j][i] / root[i] / root[j]);
    let (a, b, c) = (rho(0, 1), rho(0, 2), rho(1, 2));
    assert!([a, b, c].iter().all(|rho| rho.abs() < 1.0), "{p:?}");
    assert!(1.0 + 2.0 * a * b * c - a * a - b * b - c * c > 0.0, "{p:?}");
}

/// Asserts that the integer set reaches at least as far as the true one along some directions: `|F'g|^2 >= r2 g'Pg`.
fn dominates(factor: SqrtFactor, p: [[f64; 3]; 3], r2: f64) {
    let units = [1e6, 1e6, Q24];
    let rows = [
        factor.x_um().map(f64::from),
        factor.y_um().map(f64::from),
        [f64::from(factor.yaw_q24()), 0.0, 0.0],
    ];
    let root = [0, 1, 2].map(|axis| p[axis][axis].sqrt() * units[axis]);
    for number in 0..27 {
        // Each component is scaled by the width of the set, so that no axis dominates.
        let g = [number % 3, number / 3 % 3, number / 9].map(|v: i32| f64::from(v - 1));
        let g = [0, 1, 2].map(|axis| g[axis] / root[axis].max(1e-3));
        let reach: f64 = (0..3)
            .map(|column| {
                (0..3)
                    .map(|row| rows[row][column] * g[row])
                    .sum::<f64>()
                    .powi(2)
            })
            .sum();
        let (mut least, mut size) = (0.0, 0.0);
        for i in 0..3 {
            for j in 0..3 {
                let term = r2 * g[i] * g[j] * p[i][j] * units[i] * units[j];
                least += term;
                size += term.abs();
            }
        }
        assert!(reach >= least - 1e-12 * size, "{factor:?} {p:?} {g:?}");
    }
}

/// Asserts that the estimate is rounded to the nearest unit.
fn is_at(estimate: Estimate, set: &PoseSet) {
    let mean = set.mean();
    for (um, m) in [(mean.x_um, estimate.x_m), (mean.y_um, estimate.y_m)] {
        assert!((f64::from(um) - m * 1e6).abs() <= 0.5 + 1e-6);
    }
    let turns = estimate.yaw_rad / TAU - f64::from(mean.yaw.0) / 4_294_967_296.0;
    assert!((turns - turns.round()).abs() * 4_294_967_296.0 <= 0.51 + 0.01);
}

/// Asserts that the whole set lies in the box of the demo, by closed forms of the input as the documents state them.
/// The proof treats borders as 1e-11 m and 2e-9 rad wide.
fn is_docked(estimate: Estimate, reach: [f64; 3]) {
    let yaw = estimate.yaw_rad - (estimate.yaw_rad / TAU).round() * TAU;
    let [x, y, t] = tables::DOCK;
    let at = [estimate.x_m, estimate.y_m, yaw];
    let slack = [x + 1.1e-11, y + 1.1e-11, t.to_radians() + 2.1e-9];
    let is_in = (0..3).all(|axis| at[axis].abs() + reach[axis] <= slack[axis]);
    assert!(is_in, "{estimate:?} reaching {reach:?}");
}
