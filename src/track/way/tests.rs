use super::*;
use crate::track::OdometryErrors;
use crate::track::increment::Excess;
use crate::track::tests::noise_of_rows;
use core::f64::consts::TAU;
use proptest::prelude::*;

type Matrix = [[f64; 3]; 3];

fn matrix(n: &PathNoise) -> Matrix {
    let [xx, xy, yy, xt, yt, tt] = [n.xx, n.xy, n.yy, n.xt, n.yt, n.tt].map(|v| v as f64);
    [[xx, xy, xt], [xy, yy, yt], [xt, yt, tt]]
}

/// Returns the mean of `(u, 1) (u, 1)'` along an arc with this chord and turn: u is the lever from a place of the arc to its end.
fn along(chord: [f64; 2], turn: f64) -> Matrix {
    // Simpson's rule.
    const PARTS: u32 = 200;
    let size = |angle: f64| {
        if angle == 0.0 {
            1.0
        } else {
            (angle / 2.0).sin() / (angle / 2.0)
        }
    };
    let mut sum = [[0.0; 3]; 3];
    for part in 0..=PARTS {
        let rest = f64::from(part) / f64::from(PARTS);
        let weight = match part {
            0 | PARTS => 1.0,
            _ if part % 2 == 1 => 4.0,
            _ => 2.0,
        };
        let weight = weight / f64::from(3 * PARTS);
        let by = rest * size(rest * turn) / size(turn);
        // The rest of the arc is its end: it is turned by half of what was driven before.
        let (s, c) = ((1.0 - rest) * turn / 2.0).sin_cos();
        let left = [
            by * (c * chord[0] - s * chord[1]),
            by * (s * chord[0] + c * chord[1]),
        ];
        let lever = [-left[1], left[0], 1.0];
        for r in 0..3 {
            for k in 0..3 {
                sum[r][k] += lever[r] * lever[k] * weight;
            }
        }
    }
    sum
}

proptest! {
    /// One increment along an arc: the carried noise is not smaller than the exact one in any direction, and larger only by the
    /// roundings and by what a straight increment adds.
    #[test]
    fn carried_noise_is_never_smaller_than_the_exact_one(
        roots in prop::array::uniform9(-1.0e6..1.0e6f64),
        shrunk in 0i32..20,
        ahead in -(1i32 << 30)..=1 << 30,
        left in -(1i32 << 30)..=1 << 30,
        shorter in 0u32..16,
        heading: u32,
        turn in -(1i32 << 29)..=1 << 29,
        straighter in 0u32..20,
        ms in 1u32..100,
        per_metre in 0.0..1.0f64,
        per_radian in 0.0..1.0f64,
    ) {
        let roots = roots.map(|root| root * 2f64.powi(-shrunk));
        let [a, b, c, d, e, f, g, h, i] = roots;
        let start = noise_of_rows([[a, b, c], [d, e, f], [g, h, i]]);
        let errors = OdometryErrors { m_per_sqrt_m: 0.01, rad_per_sqrt_m: per_metre, rad_per_sqrt_rad: per_radian, ..OdometryErrors::NONE };
        let noise = Noise::of(&errors).unwrap();
        let mut way = Way { turn: heading, noise: start, ..Way::new(&noise) };
        let increment = Step { x_q8: ahead >> shorter, y_q8: left >> shorter, turn: turn >> straighter, stamp_ms: 0 };
        way.add(&increment, increment.driven(Excess::NONE), ms, &noise);
        // 2^-8 um, times a 2^-24 turn in radians.
        let lever = |v: i64| v as f64 / 256.0 * TAU / 16_777_216.0;
        let chord = [lever(way.x), lever(way.y)];
        let n = matrix(&start);
        let g = [[1.0, 0.0, -chord[1]], [0.0, 1.0, chord[0]], [0.0, 0.0, 1.0]];
        let turned = f64::from(increment.turn) / 4_294_967_296.0 * TAU;
        // Stated by the arc, from the text of the model.
        let um = f64::hypot(f64::from(increment.x_q8), f64::from(increment.y_q8)) / 256.0;
        let arc = if turned == 0.0 { um } else { um * (turned / 2.0) / (turned / 2.0).sin() };
        let q24 = TAU / 16_777_216.0;
        let own = (per_metre * per_metre * arc * 1e-6 + per_radian * per_radian * turned.abs()) / (q24 * q24);
        let plane = 1e-4 * arc * 1e-6 * 1e12;
        let mean = along(chord, turned);
        let found = matrix(&way.noise);
        let exact: Matrix = core::array::from_fn(|r| core::array::from_fn(|s| {
            let mut entry = own * mean[r][s] + if r == s && r < 2 { plane } else { 0.0 };
            for u in 0..3 {
                for v in 0..3 {
                    entry += g[r][u] * n[u][v] * g[s][v];
                }
            }
            entry
        }));
        // Relative to the size of each row: of floats with 53 bits, and of the levers' own rounding.
        let size: [f64; 3] = core::array::from_fn(|r| found[r][r].sqrt());
        let more = nalgebra::Matrix3::from_fn(|r, s| (found[r][s] - exact[r][s]) / (size[r] * size[s]));
        let least = more.symmetric_eigenvalues().min();
        prop_assert!(least > -1e-12, "{least} {found:?} {exact:?}");
        // The share of the increment's own noise, a unit of its turn and of its length, and roundings.
        let unit = per_radian * per_radian / q24 + per_metre * per_metre * 1e-8 / (q24 * q24);
        let straight = [chord[1].powi(2), chord[0].powi(2), 1.0];
        for r in 0..3 {
            let most = 2.0 * ROUNDED as f64 + own * (0.3 * turned.abs() + 0.01) * (straight[r] + chord[0].powi(2) + chord[1].powi(2))
                + unit * (1.0 + straight[r]) + own * 0.3 * straight[r] + 0.12 * (own * mean[r][r] + plane) + 1e-12 * found[r][r];
            prop_assert!(found[r][r] - exact[r][r] <= most, "{r}: {found:?} {exact:?}");
        }
    }
}

/// One coarse increment is not more certain than many fine increments of the same path.
#[test]
fn a_coarse_increment_is_not_more_certain_than_fine_ones() {
    let errors = OdometryErrors {
        m_per_sqrt_m: 0.001,
        rad_per_sqrt_m: 0.05,
        ..OdometryErrors::NONE
    };
    let noise = Noise::of(&errors).unwrap();
    for parts in [2, 10, 1000] {
        let driven = |count: i32| {
            let mut way = Way::new(&noise);
            for _ in 0..count {
                let step = Step {
                    x_q8: 256_000_000 / count,
                    y_q8: 128_000_000 / count,
                    turn: 0,
                    stamp_ms: 0,
                };
                way.add(&step, step.driven(Excess::NONE), 1, &noise);
            }
            matrix(&way.noise)
        };
        let (coarse, fine) = (driven(1), driven(parts));
        let more = nalgebra::Matrix3::from_fn(|r, c| coarse[r][c] - fine[r][c]);
        let scale = nalgebra::Matrix3::from_fn(|r, c| coarse[r][c]).norm();
        let least = more.symmetric_eigenvalues().min();
        // A thousand increments are rounded up a thousand times.
        assert!(least > -2e-3 * scale, "{parts}: {least} of {scale}");
    }
}

#[test]
fn unused_noise_is_not_carried() {
    let noise = Noise::of(&OdometryErrors::NONE).unwrap();
    let increment = Step {
        x_q8: 1 << 30,
        y_q8: 1 << 30,
        turn: 0,
        stamp_ms: 0,
    };
    for (xx, tt) in [(0, WIDEST_TURN), (WIDEST_PLANE, 0), (i64::MAX, i64::MAX)] {
        let noise_before = PathNoise {
            xx,
            tt,
            ..Way::new(&noise).noise
        };
        let mut way = Way {
            noise: noise_before,
            ..Way::new(&noise)
        };
        way.add(&increment, increment.driven(Excess::NONE), 1, &noise);
        assert_eq!(way.noise.tt, i64::MAX);
    }
}
