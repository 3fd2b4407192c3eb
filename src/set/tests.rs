use super::*;
use proptest::prelude::*;

fn radius(r2: f64) -> RadiusSquared {
    RadiusSquared::from_q16((r2 * 65536.0).ceil() as u32).unwrap()
}

const HERE: Estimate = Estimate {
    x_m: 1.0,
    y_m: -2.0,
    yaw_rad: 0.5,
};

/// Returns a covariance from sigmas and correlations.
fn covariance(sigma: [f64; 3], rho: [f64; 3]) -> [[f64; 3]; 3] {
    let [a, b, c] = sigma;
    let [ab, ac, bc] = [rho[0] * a * b, rho[1] * a * c, rho[2] * b * c];
    [[a * a, ab, ac], [ab, b * b, bc], [ac, bc, c * c]]
}

/// Returns `true` if `F F' - r2 P` in f64 has no negative eigenvalue, to 1e-9 of its largest entry.
fn dominates(factor: &SqrtFactor, p: [[f64; 3]; 3], r2: f64) -> bool {
    let q24 = 2f64.powi(24) / core::f64::consts::TAU;
    let units = [1e6, 1e6, q24];
    let f = [
        factor.x.map(f64::from),
        factor.y.map(f64::from),
        [f64::from(factor.yaw), 0.0, 0.0],
    ];
    let mut residual = nalgebra::Matrix3::<f64>::zeros();
    for i in 0..3 {
        for j in 0..3 {
            let ff: f64 = (0..3).map(|k| f[i][k] * f[j][k]).sum();
            let pij = 0.5 * (p[i][j] + p[j][i]);
            residual[(i, j)] = ff - r2 * pij * units[i] * units[j];
        }
    }
    let largest = residual.abs().max().max(1.0);
    let eigenvalues = residual.symmetric_eigenvalues();
    let rounding = (0..3)
        .map(|i| r2 * p[i][i] * units[i] * units[i])
        .fold(0.0, f64::max)
        * 1e-15;
    eigenvalues.min() >= -1e-9 * largest - rounding
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(crate::test_iterations(20_000, 40)))]
    #[test]
    fn factors_dominate(
        sigma_exp in [-5.0f64..1.5, -5.0f64..1.5, -6.0f64..0.5],
        rho in [-0.9999f64..0.9999, -0.9999f64..0.9999, -0.9999f64..0.9999],
        r2 in 1.0f64..255.0,
    ) {
        let sigma = sigma_exp.map(|e| 10f64.powf(e));
        let p = covariance(sigma, rho);
        let det = 1.0 + 2.0 * rho[0] * rho[1] * rho[2]
            - rho[0] * rho[0] - rho[1] * rho[1] - rho[2] * rho[2];
        match PoseSet::gaussian(HERE, p, radius(r2)) {
            Ok(set) => {
                prop_assert!(det > 0.0, "accepted a matrix that is not positive definite");
                let Extent::Gaussian(factor) = set.extent() else { unreachable!() };
                prop_assert!(dominates(&factor, p, r2));
                // And not by much: only by the loading.
                let r = r2.sqrt() * sigma[2] * 2f64.powi(24) / core::f64::consts::TAU;
                prop_assert!(f64::from(factor.yaw) <= r * 1.001 + 3.0);
            }
            Err(InputError::CovarianceNotPositiveDefinite) => prop_assert!(det < 1e-5),
            Err(InputError::CovarianceTooLarge) => prop_assert!(sigma.iter().any(|s| *s > 2.0)),
            Err(other) => prop_assert!(false, "{other:?}"),
        }
    }

    /// Special values in some entries of a valid covariance, in pairs or alone: each gives an answer,
    /// and an invalid covariance never gives a set.
    #[test]
    fn no_special_value_is_trusted(
        entries in proptest::array::uniform3((0usize..9, 0usize..SPECIAL.len())), mirrored: bool,
    ) {
        let mut p = covariance([0.1, 0.2, 0.03], [0.3, 0.2, -0.4]);
        for (entry, value) in entries {
            p[entry / 3][entry % 3] = SPECIAL[value];
            if mirrored {
                p[entry % 3][entry / 3] = SPECIAL[value];
            }
        }
        if let Ok(set) = PoseSet::gaussian(HERE, p, radius(11.3449)) {
            prop_assert!(p.iter().flatten().all(|v| v.is_finite()));
            prop_assert!((0..3).all(|i| p[i][i] > 0.0));
            // From the correlations, so that tiny variances do not vanish.
            let root = [0, 1, 2].map(|i| p[i][i].sqrt());
            let rho = |i: usize, j: usize| 0.5 * (p[i][j] + p[j][i]) / root[i] / root[j];
            let (a, b, c) = (rho(0, 1), rho(0, 2), rho(1, 2));
            prop_assert!(1.0 + 2.0 * a * b * c - a * a - b * b - c * c > 0.0, "{p:?}");
            let Extent::Gaussian(factor) = set.extent() else { unreachable!() };
            prop_assert!(dominates(&factor, p, 11.3449));
        }
    }

    /// The two halves may differ by rounding: the set covers both.
    #[test]
    fn both_halves_of_a_covariance_are_covered(
        sigma_exp in [-3.0f64..1.0, -3.0f64..1.0, -4.0f64..0.0],
        rho in [-0.9f64..0.9, -0.9f64..0.9, -0.9f64..0.9],
        skew in [-1e-6f64..1e-6, -1e-6f64..1e-6, -1e-6f64..1e-6],
    ) {
        let sigma = sigma_exp.map(|e| 10f64.powf(e));
        let good = covariance(sigma, rho);
        let mut p = good;
        for (k, (i, j)) in [(0, 1), (0, 2), (1, 2)].into_iter().enumerate() {
            p[i][j] += skew[k] * sigma[i] * sigma[j] * 0.4;
        }
        if let Ok(set) = PoseSet::gaussian(HERE, p, radius(11.3449)) {
            let Extent::Gaussian(factor) = set.extent() else { unreachable!() };
            let upper = [[p[0][0], p[0][1], p[0][2]], [p[0][1], p[1][1], p[1][2]], [p[0][2], p[1][2], p[2][2]]];
            prop_assert!(dominates(&factor, good, 11.3449) && dominates(&factor, upper, 11.3449));
        }
    }
}

const SPECIAL: [f64; 14] = [
    0.0,
    -0.0,
    5e-324,
    f64::MIN_POSITIVE,
    1e-30,
    -1e-30,
    1e-4,
    1.0,
    -1.0,
    1e30,
    f64::MAX,
    f64::NAN,
    f64::INFINITY,
    f64::NEG_INFINITY,
];

/// A tiny set with a wide heading grows by only 22 um and 2^-11.
#[test]
fn the_loading_is_small() {
    for (sigma, yaw) in [
        (1e-5, 0.01),
        (1e-5, 1.0),
        (1e-4, 0.5),
        (1e-3, 0.05),
        (0.2, 0.01),
    ] {
        let p = covariance([sigma, sigma, yaw], [0.0; 3]);
        let set = PoseSet::gaussian(HERE, p, radius(11.3449)).unwrap();
        let Extent::Gaussian(factor) = set.extent() else {
            panic!()
        };
        let reach = |row: [i32; 3]| {
            row.iter()
                .map(|v| f64::from(*v).powi(2))
                .sum::<f64>()
                .sqrt()
        };
        let truth = 11.3449f64.sqrt() * sigma * 1e6;
        for row in [factor.x, factor.y] {
            let limit = (truth * truth + 40.0 * 40.0).sqrt() + 3.0;
            assert!(
                reach(row) >= truth && reach(row) <= limit,
                "{sigma} {yaw}: {} {truth}",
                reach(row)
            );
        }
        let truth = 11.3449f64.sqrt() * yaw * 2f64.powi(24) / core::f64::consts::TAU;
        assert!(f64::from(factor.yaw) <= truth * 1.0005 + 3.0);
    }
}

#[test]
fn impossible_inputs_have_their_own_reason() {
    let good = covariance([0.1, 0.2, 0.03], [0.3, 0.2, -0.4]);
    let with = |row: usize, column: usize, value: f64| {
        let mut p = good;
        p[row][column] = value;
        p[column][row] = value;
        p
    };
    let reason = |p| PoseSet::gaussian(HERE, p, radius(11.3449)).map(|_| ());
    assert_eq!(reason(good), Ok(()));
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        for (row, column) in [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)] {
            let expected = Err(InputError::CovarianceNotFinite);
            assert_eq!(
                reason(with(row, column, bad)),
                expected,
                "{bad} at {row},{column}"
            );
        }
        let at = |x_m, y_m, yaw_rad| {
            PoseSet::gaussian(Estimate { x_m, y_m, yaw_rad }, good, radius(11.3))
        };
        for set in [at(bad, 0.0, 0.0), at(0.0, bad, 0.0), at(0.0, 0.0, bad)] {
            assert_eq!(set, Err(InputError::EstimateNotFinite));
        }
        assert_eq!(
            PoseSet::bounded(HERE, bad, 0.1),
            Err(InputError::BoundInvalid)
        );
        assert_eq!(
            PoseSet::bounded(HERE, 0.1, bad),
            Err(InputError::BoundInvalid)
        );
    }
    assert_eq!(reason([[0.0; 3]; 3]), Err(InputError::CovarianceZero));
    assert_eq!(reason([[-0.0; 3]; 3]), Err(InputError::CovarianceZero));
    for axis in 0..3 {
        for variance in [0.0, -0.0, -1e-9, -1.0] {
            assert_eq!(
                reason(with(axis, axis, variance)),
                Err(InputError::CovarianceNotPositiveDefinite)
            );
        }
    }
    // Correlations of 1 and beyond.
    assert_eq!(
        reason(with(0, 1, 0.02)),
        Err(InputError::CovarianceNotPositiveDefinite)
    );
    assert_eq!(
        reason(with(0, 1, -0.02)),
        Err(InputError::CovarianceNotPositiveDefinite)
    );
    assert_eq!(
        reason(with(0, 1, 0.021)),
        Err(InputError::CovarianceNotPositiveDefinite)
    );
    assert_eq!(
        reason(with(1, 2, 1e300)),
        Err(InputError::CovarianceNotPositiveDefinite)
    );
    // Each pair is valid, but not all three together.
    assert_eq!(
        reason(covariance([1.0, 1.0, 1.0], [0.9, 0.9, -0.9])),
        Err(InputError::CovarianceNotPositiveDefinite)
    );
    let mut skew = good;
    skew[0][1] += 1e-4;
    assert_eq!(reason(skew), Err(InputError::CovarianceNotSymmetric));
    skew[0][1] = good[0][1] * (1.0 + 1e-9);
    assert_eq!(reason(skew), Ok(()));
    assert_eq!(
        reason(covariance([200.0, 0.1, 0.1], [0.0; 3])),
        Err(InputError::CovarianceTooLarge)
    );
    assert_eq!(
        reason(covariance([0.1, 0.1, 80.0], [0.0; 3])),
        Err(InputError::CovarianceTooLarge)
    );
    assert_eq!(
        reason(covariance([1e100, 0.1, 0.1], [0.0; 3])),
        Err(InputError::CovarianceTooLarge)
    );
    // Tiny is not zero: the smallest set is a few units.
    let tiny = PoseSet::gaussian(
        HERE,
        covariance([1e-150, 1e-9, 1e-12], [0.0; 3]),
        radius(11.3),
    );
    let Ok(Extent::Gaussian(factor)) = tiny.map(|s| s.extent()) else {
        panic!()
    };
    assert!(factor.yaw >= 1 && factor.x[1] >= 1 && factor.y[2] >= 1);

    let bounded = |t, a| PoseSet::bounded(HERE, t, a).map(|_| ());
    for (translation, yaw) in [
        (0.0, 0.1),
        (0.1, 0.0),
        (-0.1, 0.1),
        (0.1, -0.1),
        (-0.0, 1.0),
        (300.0, 0.1),
    ] {
        assert_eq!(bounded(translation, yaw), Err(InputError::BoundInvalid));
    }
    assert_eq!(bounded(5e-324, 5e-324), Ok(()));
    assert_eq!(bounded(0.1, 1e300), Ok(()));
    let far = |x_m| PoseSet::bounded(Estimate { x_m, ..HERE }, 0.1, 0.1).map(|_| ());
    assert_eq!(far(2000.0), Ok(()));
    for x in [2000.1, -2000.1, 1e10, 1e300, f64::MIN] {
        assert_eq!(far(x), Err(InputError::EstimateOutOfRange));
    }
    let turned = PoseSet::bounded(
        Estimate {
            yaw_rad: 2e4,
            ..HERE
        },
        0.1,
        0.1,
    );
    assert_eq!(turned, Err(InputError::EstimateOutOfRange));
}

/// 2^-28, the unit of the correlations if the variances lie in `[1, 4)`.
const UNIT: f64 = 1.0 / (1u32 << 28) as f64;

/// Returns the answer to a covariance of unit variances except for the given entries: xx, yy, and three
/// pairs.
fn answer(xx: f64, yy: f64, xy: [f64; 2], xt: f64, yt: f64) -> Result<SqrtFactor, InputError> {
    let p = [[xx, xy[0], xt], [xy[1], yy, yt], [xt, yt, 1.0]];
    PoseSet::gaussian(HERE, p, radius(1.0)).map(|set| factor_of(&set))
}

fn factor_of(set: &PoseSet) -> SqrtFactor {
    let Extent::Gaussian(factor) = set.extent() else {
        panic!()
    };
    factor
}

#[test]
fn the_halves_may_differ_by_1024_units() {
    let with = |skew: f64| answer(1.0, 1.0, [0.25 + skew * UNIT, 0.25], 0.0, 0.0).map(|_| ());
    for skew in [1024.0, -1024.0] {
        assert_eq!(with(skew), Ok(()));
        assert_eq!(
            with(skew * 1.001),
            Err(InputError::CovarianceNotSymmetric),
            "{skew}"
        );
    }
}

/// An invalid value in one half of a matrix counts. Variances are checked before the symmetry, which is
/// measured relative to them.
#[test]
fn a_bad_variance_is_no_matter_of_symmetry() {
    let with = |variances: [f64; 3], row: usize, column: usize| {
        let mut p = covariance([0.0; 3], [0.0; 3]);
        for (axis, variance) in variances.into_iter().enumerate() {
            p[axis][axis] = variance;
        }
        p[row][column] = 0.1;
        PoseSet::gaussian(HERE, p, radius(11.3)).map(|_| ())
    };
    for (row, column) in [(0, 1), (1, 0), (0, 2), (2, 0), (1, 2), (2, 1)] {
        for axes in 0..7 {
            let variances = [0, 1, 2].map(|axis| f64::from(axes >> axis & 1));
            assert_eq!(
                with(variances, row, column),
                Err(InputError::CovarianceNotPositiveDefinite),
                "{variances:?} {row} {column}"
            );
        }
        assert_eq!(
            with([1.0; 3], row, column),
            Err(InputError::CovarianceNotSymmetric)
        );
    }
}

/// The second minor must exceed the largest error of its rounding, to the last unit: here
/// `x y - xy^2 = 80 (x + y) + 1600`, and then one unit more.
#[test]
fn the_second_pivot_exceeds_its_rounding() {
    let (x, y, xy) = (312_504_080i64, 312_554_082i64, 312_529_000i64);
    assert_eq!(x * y - xy * xy, 80 * (x + y) + 1600);
    let with = |xy: i64| {
        let [x, y, xy] = [x, y, xy].map(|v| v as f64 * UNIT);
        answer(x, y, [xy, xy], 0.0, 0.0).map(|_| ())
    };
    assert_eq!(with(xy), Err(InputError::CovarianceNotPositiveDefinite));
    assert_eq!(with(xy - 1), Ok(()));
}

/// A correlation with yaw beyond 1 is refused, although the other one is below 1 by so little that the
/// second minor does not detect it: -600 * 66 exceeds 80 (66 - 600) + 1600.
#[test]
fn each_first_pivot_counts() {
    let (beyond, below) = (1.0 + 300.0 * UNIT, 1.0 - 33.0 * UNIT);
    let along = beyond * below;
    for (xt, yt) in [(beyond, below), (below, beyond)] {
        assert_eq!(
            answer(1.0, 1.0, [along, along], xt, yt),
            Err(InputError::CovarianceNotPositiveDefinite)
        );
    }
}

/// The largest variances that pass reach the stated limits exactly.
#[test]
fn entries_reach_their_limit() {
    let largest = |p: fn(f64) -> [f64; 3]| {
        let factor = |variance: f64| {
            let [xx, yy, tt] = p(variance);
            let p = [[xx, 0.0, 0.0], [0.0, yy, 0.0], [0.0, 0.0, tt]];
            PoseSet::gaussian(HERE, p, radius(1.0)).map(|set| factor_of(&set))
        };
        let (mut low, mut high) = (1f64.to_bits(), 1e9f64.to_bits());
        while high - low > 1 {
            let middle = low + (high - low) / 2;
            match factor(f64::from_bits(middle)) {
                Ok(_) => low = middle,
                Err(error) => {
                    assert_eq!(error, InputError::CovarianceTooLarge);
                    high = middle;
                }
            }
        }
        factor(f64::from_bits(low)).unwrap()
    };
    assert_eq!(largest(|xx| [xx, 1e-6, 1e-6]).x[1], (1 << 28) - 1);
    assert_eq!(largest(|yy| [1e-6, yy, 1e-6]).y[2], (1 << 28) - 1);
    let yaw = largest(|tt| [1e-6, 1e-6, tt]).yaw;
    assert!(((1 << 29) - 2..1 << 29).contains(&yaw), "{yaw}");
}

#[test]
fn a_factor_gives_its_rows() {
    let p = covariance([0.1, 0.2, 0.03], [0.3, 0.2, -0.4]);
    let set = PoseSet::gaussian(HERE, p, radius(11.3449)).unwrap();
    let SqrtFactor { yaw, x, y } = factor_of(&set);
    assert!(yaw > 1 && x[..2].iter().chain(&y).all(|v| v.abs() > 1));
    let factor = factor_of(&set);
    assert_eq!(
        (factor.yaw_q24(), factor.x_um(), factor.y_um()),
        (yaw, x, y)
    );
}

proptest! {
    #[test]
    fn factors_scale_to_the_nearest_and_up_in_yaw(
        yaw in 1i32..1 << 29,
        x in proptest::array::uniform3(-(1i32 << 28)..1 << 28),
        y in proptest::array::uniform3(-(1i32 << 28)..1 << 28),
        exponent in 0u32..32,
        fraction in any::<u32>(),
    ) {
        let scale = (1u32 << exponent) | fraction & ((1 << exponent) - 1);
        let factor = SqrtFactor { yaw, x, y };
        let exact = |v: i32| f64::from(v) * f64::from(scale) / 65536.0;
        let entries = |f: &SqrtFactor| [f.x[0], f.x[1], f.x[2], f.y[0], f.y[1], f.y[2]];
        match factor.scaled(scale) {
            Some(scaled) => {
                prop_assert!(scaled.yaw >= 1);
                let up = f64::from(scaled.yaw) - exact(yaw);
                prop_assert!((0.0..1.0).contains(&up), "{yaw} {scale} {}", scaled.yaw);
                for (got, from) in entries(&scaled).into_iter().zip(entries(&factor)) {
                    let error = (f64::from(got) - exact(from)).abs();
                    prop_assert!(error <= 0.5, "{from} {scale} {got}");
                }
            }
            None => prop_assert!(
                exact(yaw) > f64::from(1 << 30) - 1.0
                    || x.iter().chain(&y).any(|v| exact(*v).abs() > f64::from(1 << 29) - 1.0)
            ),
        }
    }
}

#[test]
fn scaled_factors_reach_their_limit() {
    let factor = |yaw, x| SqrtFactor {
        yaw,
        x: [x, 0, 0],
        y: [0, 0, x],
    };
    let four = 4 << 16;
    let (yaw, length) = (1 << 28, 1 << 27);
    for x in [length, -length] {
        assert_eq!(factor(1, x).scaled(four), None);
        let inner = x - x.signum();
        assert_eq!(factor(1, inner).scaled(four), Some(factor(4, inner * 4)));
    }
    assert_eq!(factor(yaw, 1).scaled(four), None);
    assert_eq!(
        factor(yaw - 1, 1).scaled(four),
        Some(factor((yaw - 1) * 4, 4))
    );
    assert_eq!(factor(5, 5).scaled(0), Some(factor(1, 0)));
}

#[test]
fn no_radius_switches_the_check_off() {
    assert_eq!(
        RadiusSquared::from_q16((1 << 24) - 1),
        Some(RadiusSquared::LARGEST)
    );
    for raw in [0, 1, 65_535, 1 << 24, u32::MAX] {
        assert_eq!(RadiusSquared::from_q16(raw), None);
    }
    assert!(RadiusSquared::from_q16(65_536).is_some());
}

#[test]
fn bounds_are_rounded_up() {
    let set = PoseSet::bounded(HERE, 0.050_000_1, 0.1).unwrap();
    let Extent::Bounded {
        translation_um,
        yaw_q24,
    } = set.extent()
    else {
        panic!()
    };
    assert_eq!(translation_um, 50_001);
    assert_eq!(
        yaw_q24,
        (0.1 / core::f64::consts::TAU * 16_777_216.0_f64).ceil() as i32
    );
    // As given, also beyond half a turn; up to 32 turns.
    for (given, q24) in [(4.0, 10_680_708), (1e3, 1 << 29)] {
        let all = PoseSet::bounded(HERE, 0.05, given).unwrap();
        assert!(matches!(all.extent(), Extent::Bounded { yaw_q24, .. } if yaw_q24 == q24));
    }
}
