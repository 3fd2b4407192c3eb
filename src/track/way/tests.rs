use super::*;
use crate::track::OdometryErrors;
use core::f64::consts::TAU;
use proptest::prelude::*;

type Matrix = [[f64; 3]; 3];

fn matrix(n: &PathNoise) -> Matrix {
    let [xx, xy, yy, xt, yt, tt] = [n.xx, n.xy, n.yy, n.xt, n.yt, n.tt].map(|v| v as f64);
    [[xx, xy, xt], [xy, yy, yt], [xt, yt, tt]]
}

proptest! {
    /// One increment of any length: the carried noise is not smaller than the exact `G N G' + Q`, and larger only by the roundings.
    #[test]
    fn carried_noise_is_never_smaller_than_the_exact_one(
        roots in prop::array::uniform9(-1.0e6..1.0e6f64),
        shrunk in 0i32..20,
        ahead in -(1i32 << 22)..=1 << 22,
        left in -(1i32 << 22)..=1 << 22,
        shorter in 0u32..16,
        turn: u32,
        ms in 1u32..100,
    ) {
        let roots = roots.map(|root| root * 2f64.powi(-shrunk));
        let [a, b, c, d, e, f, g, h, i] = roots;
        let dot = |u: [f64; 3], v: [f64; 3]| (u[0] * v[0] + u[1] * v[1] + u[2] * v[2]) as i64;
        let (x, y, t) = ([a, b, c], [d, e, f], [g, h, i]);
        let start = PathNoise {
            xx: dot(x, x) + 3,
            xy: dot(x, y),
            yy: dot(y, y) + 3,
            xt: dot(x, t),
            yt: dot(y, t),
            tt: dot(t, t) + 3,
        };
        let mut way = Way { turn, noise: start, ..Way::START };
        let noise = Noise::of(&OdometryErrors { m_per_sqrt_m: 0.01, rad_per_sqrt_m: 0.02, ..OdometryErrors::NONE }).unwrap();
        let increment = Step { x_um: ahead >> shorter, y_um: left >> shorter, turn: 12_345_678, stamp_ms: 0 };
        way.add(&increment, ms, &noise);
        // 2^-8 um, times a 2^-24 turn in radians.
        let lever = |v: i64| v as f64 / 256.0 * TAU / 16_777_216.0;
        let (p, q) = (-lever(way.y), lever(way.x));
        let n = matrix(&start);
        let g = [[1.0, 0.0, p], [0.0, 1.0, q], [0.0, 0.0, 1.0]];
        let [plane, turned] = noise.variances(increment.length_um(), increment.turn_q24(), ms);
        let own = [plane as f64, plane as f64, turned as f64];
        let found = matrix(&way.noise);
        let more: Matrix = core::array::from_fn(|r| core::array::from_fn(|s| {
            let mut exact = if r == s { own[r] } else { 0.0 };
            // The error of the increment's own turn.
            exact += own[2] * match (r, s) {
                (2, 2) => 0.0,
                (2, k) | (k, 2) => [p, q][k] / 2.0,
                _ => 0.5 * [p, q][r] * [p, q][s],
            };
            for u in 0..3 {
                for v in 0..3 {
                    exact += g[r][u] * n[u][v] * g[s][v];
                }
            }
            found[r][s] - exact
        }));
        // Of floats with 53 bits: sums below 2^46 are exact to 2^-6.
        let slack = 0.25;
        for r in 0..3 {
            let off: f64 = (0..3).filter(|s| *s != r).map(|s| more[r][s].abs()).sum();
            prop_assert!(more[r][r] + slack >= off, "{more:?}");
            prop_assert!(more[r][r] <= 2.0 * ROUNDED as f64, "{more:?}");
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
            let mut way = Way::START;
            for _ in 0..count {
                let step = Step {
                    x_um: 1_000_000 / count,
                    y_um: 500_000 / count,
                    turn: 0,
                    stamp_ms: 0,
                };
                way.add(&step, 1, &noise);
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
        x_um: 1 << 22,
        y_um: 1 << 22,
        turn: 0,
        stamp_ms: 0,
    };
    for (xx, tt) in [(0, WIDEST_TURN), (WIDEST_PLANE, 0), (i64::MAX, i64::MAX)] {
        let noise_before = PathNoise {
            xx,
            tt,
            ..Way::START.noise
        };
        let mut way = Way {
            noise: noise_before,
            ..Way::START
        };
        way.add(&increment, 1, &noise);
        assert_eq!(way.noise.tt, i64::MAX);
    }
}
