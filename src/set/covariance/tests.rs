use super::*;
use crate::set::{RadiusSquared, Trust};
use proptest::prelude::*;

const X: usize = 0;
const Y: usize = 1;
const YAW: usize = 2;

/// Returns `true` if no principal minor of a symmetric matrix is below zero. Entries below 2^40.
fn is_semidefinite([[a, d, e], [_, b, f], [_, _, c]]: [[i128; 3]; 3]) -> bool {
    let determinant = a * (b * c - f * f) - d * (d * c - f * e) + e * (d * f - b * e);
    [a, b, c].iter().all(|v| *v >= 0)
        && a * b >= d * d
        && a * c >= e * e
        && b * c >= f * f
        && determinant >= 0
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(crate::test_iterations(10_000, 40)))]
    /// Exactly: `F F' - T` has no negative direction for any T within the slack, and the diagonal is larger only by
    /// the loading and the roots.
    #[test]
    fn factors_of_integers_dominate(
        bits in proptest::array::uniform3(1u32..19),
        root in proptest::array::uniform6(-(1i64 << 18)..1 << 18),
        slack_bits in proptest::array::uniform3(0u32..12),
    ) {
        let [q, x2, y3] = [0, 1, 2].map(|k| (root[k].abs() >> (18 - bits[k].min(18))) + 1);
        let [x1, y1, y2] = [root[3] % (x2 + 1), root[4] % (y3 + 1), root[5] % (y3 + 1)];
        let [xy_slack, xt_slack, yt_slack] = slack_bits.map(|b| 1 << b);
        let target = ScaledCovariance {
            xx: x1 * x1 + x2 * x2,
            yy: y1 * y1 + y2 * y2 + y3 * y3,
            tt: q * q,
            xy: x1 * y1 + x2 * y2,
            xt: q * x1,
            yt: q * y1,
            xy_slack,
            xt_slack,
            yt_slack,
        };
        let SqrtFactor { yaw, x, y } = target.factor().unwrap();
        let wide = |row: [i32; 3]| row.map(i128::from);
        let (yaw, x, y) = (i128::from(yaw), wide(x), wide(y));
        let dot = |a: [i128; 3], b: [i128; 3]| a.iter().zip(b).map(|(a, b)| a * b).sum::<i128>();
        let beyond = |got: i128, from: i64| got - i128::from(from);
        let (tt, xx, yy) = (
            beyond(yaw * yaw, target.tt),
            beyond(dot(x, x), target.xx),
            beyond(dot(y, y), target.yy),
        );
        for signs in 0..8 {
            let off = |bit: i64, slack: i64| if signs >> bit & 1 == 0 { slack } else { -slack };
            let xt = beyond(yaw * x[0], target.xt + off(0, xt_slack));
            let yt = beyond(yaw * y[0], target.yt + off(1, yt_slack));
            let xy = beyond(dot(x, y), target.xy + off(2, xy_slack));
            prop_assert!(is_semidefinite([[tt, xt, yt], [xt, xx, xy], [yt, xy, yy]]));
        }
        let share = (q * ((q >> 11) + 1)) as f64;
        // The weight `pivot^2 / spare` is rounded up by less than 1/4 for yaw, and 3/4 for x.
        let loading = |pivot: i128, slack: i64, spare: f64, up: f64| {
            let pivot = pivot as f64;
            let ratio = (pivot / 2.0 + 0.01 + slack as f64) / pivot + 5.0 / 16384.0;
            ratio.powi(2) * (pivot * pivot / spare + up) + 1.0 + pivot / 4096.0
        };
        let room = |extra: f64, square: i64, root: f64| {
            let square = square as f64 + extra;
            extra + root * (2.0 * square.sqrt() + root) + 1e-3
        };
        let (x_loading, y_loading) = (
            loading(yaw, xt_slack, share, 0.25),
            loading(yaw, yt_slack, share, 0.25)
                + loading(x[1], xy_slack, 2.0 * x[1] as f64 - 1.0, 0.75),
        );
        prop_assert_eq!(yaw, i128::from(q + (q >> 11) + 1));
        prop_assert!(xx as f64 <= room(x_loading, target.xx, 2.0));
        prop_assert!(yy as f64 <= room(y_loading, target.yy, 1.0));
    }
}

/// The digits of a float, and the power of two.
fn digits(value: f64) -> (u128, i32) {
    let float = crate::num::Float::of(value).unwrap();
    (u128::from(float.mantissa), float.exponent)
}

/// Returns the integers below and above `value unit r2`, for a unit of at most 50 bits `factor 2^exponent`.
fn between(value: f64, (factor, exponent): (u128, i32), r2: u32) -> (i128, i128) {
    let (mantissa, power) = digits(value);
    let exact = mantissa * factor * u128::from(r2);
    let down = 16 - power - exponent;
    if down <= 0 {
        let whole = (exact << -down) as i128;
        return (whole, whole);
    }
    let below = if down < 128 { exact >> down } else { 0 };
    let is_whole = down < 128 && below << down == exact;
    (
        below as i128,
        below as i128 + i128::from(!is_whole && exact != 0),
    )
}

/// The units, rounded down and up to 50 bits.
const UNITS: [[(u128, i32); 2]; 3] = [
    [(1_000_000_000_000, 0), (1_000_000_000_000, 0)],
    [(683_565_275_576_431, -8), (683_565_275_576_432, -8)],
    [(912_620_089_792_739, -7), (912_620_089_792_741, -7)],
];

#[test]
fn units_enclose() {
    let q24 = 16_777_216.0 / core::f64::consts::TAU;
    for ([low, high], (unit, exact)) in
        UNITS
            .into_iter()
            .zip([(UM2, 1e12), (UM_Q24, 1e6 * q24), (Q24_2, q24 * q24)])
    {
        let value = |(factor, exponent): (u128, i32)| factor as f64 * 2f64.powi(exponent);
        assert!(value(low) <= exact * (1.0 + 1e-15) && value(high) >= exact * (1.0 - 1e-15));
        assert!((value(low) / value(high) - 1.0).abs() < 1e-14);
        // One unit of the 32 bits.
        let up = u128::from(unit.factor) << (unit.exponent - high.1);
        assert!(up >= high.0 && up < high.0 + (1 << (unit.exponent - high.1)));
    }
}

/// Sigmas and correlations from plain to hopeless: tiny, huge, nearly singular, with halves that differ.
fn covariances() -> impl Strategy<Value = ([[f64; 3]; 3], u32)> {
    let power = || prop_oneof![4 => -5.5f64..1.5, 1 => 1.0f64..2.4, 1 => -155.0f64..-5.0, 1 => -163.0f64..-155.0];
    let near = || prop_oneof![3 => 0f64..1.0, 1 => -12.0f64..0.0];
    (
        [power(), power(), power()],
        [near(), near(), near()],
        any::<[bool; 3]>(),
        proptest::array::uniform3(
            prop_oneof![2 => Just(0.0), 1 => -3.8e-6f64..3.8e-6, 1 => -1e-12f64..1e-12],
        ),
        1u32 << 16..1 << 24,
    )
        .prop_map(|(power, near, signs, skew, r2)| {
            let sigma = power.map(|p| 10f64.powf(p));
            let sign = |k: usize| if signs[k] { 1.0 } else { -1.0 };
            // Negative: 1 - 10^near.
            let size = |k: usize| {
                if near[k] < 0.0 {
                    1.0 - 10f64.powf(near[k])
                } else {
                    near[k]
                }
            };
            let (a, b) = (sign(0) * size(0), sign(1) * size(1));
            // Any correlation of x and y that the other two allow.
            let free = ((1.0 - a * a) * (1.0 - b * b)).max(0.0).sqrt();
            let c = a * b + free * sign(2) * size(2);
            let mut p = [[0.0; 3]; 3];
            for (k, (i, j, rho)) in [(0, 1, c), (0, 2, a), (1, 2, b)].into_iter().enumerate() {
                p[j][i] = rho * sigma[i] * sigma[j];
                p[i][j] = p[j][i] + skew[k] * sigma[i] * sigma[j];
            }
            for (axis, sigma) in sigma.into_iter().enumerate() {
                p[axis][axis] = sigma * sigma;
            }
            (p, r2)
        })
}

fn full(r2: u32) -> Reach {
    Reach::of(RadiusSquared::from_q16(r2).unwrap(), Trust::FULL)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(crate::test_iterations(20_000, 40)))]
    /// Exactly: each variance of a target is at least `r2 P`, each covariance within its slack of both halves; and
    /// neither by more than the head states.
    #[test]
    fn targets_enclose_the_covariance((p, r2) in covariances()) {
        let Ok(found) = target(&p, full(r2)) else {
            return Ok(());
        };
        for (got, axis, unit) in [(found.xx, X, 0), (found.yy, Y, 0), (found.tt, YAW, 2)] {
            let (_, above) = between(p[axis][axis], UNITS[unit][1], r2);
            let got = i128::from(got);
            prop_assert!(got >= above && got <= above + (above >> 28) + 1, "{got} {above}");
        }
        for (got, slack, i, j, unit) in [
            (found.xy, found.xy_slack, X, Y, 0),
            (found.xt, found.xt_slack, X, YAW, 1),
            (found.yt, found.yt_slack, Y, YAW, 1),
        ] {
            for value in [p[i][j], p[j][i]] {
                let (below, _) = between(value, UNITS[unit][0], r2);
                let (_, above) = between(value, UNITS[unit][1], r2);
                let got = i128::from(if value < 0.0 { -got } else { got });
                let slack = i128::from(slack);
                prop_assert!(got - slack <= below && got + slack >= above, "{got} {slack} {below} {above}");
            }
            if p[i][j] == p[j][i] {
                // Three units of the correlations, each at most 2^-28 of the root of the variances.
                let root = (f64::sqrt(p[i][i]) * f64::sqrt(p[j][j]), UNITS[unit][1]);
                let (_, most) = between(root.0, root.1, r2);
                prop_assert!(i128::from(slack) <= ((most * 3) >> 28) + 2, "{slack} {most}");
            }
        }
    }

    /// Exactly, at every size: shares as in the head exist, so `F F' - T` has no negative direction for any T within
    /// the slack.
    #[test]
    fn factors_dominate_at_every_size((p, r2) in covariances()) {
        let Ok(t) = target(&p, full(r2)) else {
            return Ok(());
        };
        let Some(SqrtFactor { yaw, x: [x1, x2, x3], y: [y1, y2, y3] }) = t.factor() else {
            return Ok(());
        };
        prop_assert_eq!(x3, 0);
        let square = |v: i32| i128::from(v) * i128::from(v);
        let times = |a: i32, b: i32| i128::from(a) * i128::from(b);
        let residual = |got: i128, of: i64, slack: i64| (got - i128::from(of)).abs() + i128::from(slack);
        let (xt, yt) = (residual(times(yaw, x1), t.xt, t.xt_slack), residual(times(yaw, y1), t.yt, t.yt_slack));
        let xy = residual(times(x1, y1) + times(x2, y2), t.xy, t.xy_slack);
        // The yaw pivot's rounding in two equal shares.
        let share = (square(yaw) - i128::from(t.tt)) / 2;
        prop_assert!(share > 0);
        let over = |residual: i128| (residual * residual + share - 1) / share;
        let x_rest = square(x1) + square(x2) - i128::from(t.xx) - over(xt);
        let y_rest = square(y1) + square(y2) + square(y3) - i128::from(t.yy) - over(yt);
        prop_assert!(x_rest >= 0 && y_rest >= 0 && x_rest * y_rest >= xy * xy, "{x_rest} {y_rest} {xy}");
    }

    /// The test without quotients never contradicts the one with them, near the border of definiteness.
    #[test]
    fn a_quick_answer_is_the_exact_one(
        x in 1i64 << 28..=1 << 30, y in 1i64 << 28..=1 << 30, t in 1i64 << 28..=1 << 30,
        xt in -1.0f64..1.0, yt in -1.0f64..1.0, near in 0.0f64..30.0, up: bool,
    ) {
        let root = |a: i64, b: i64| (a as f64 * b as f64).sqrt();
        let (xt, yt) = ((xt * root(x, t)) as i64, (yt * root(y, t)) as i64);
        let (x_minor, y_minor) = (x * t - xt * xt, y * t - yt * yt);
        if x_minor > 1 << 34 && y_minor > 1 << 34 {
            // xy t - xt yt near the root of the minors' product, by 2^-near.
            let between = root(x_minor, y_minor) * if up { 1.0 } else { -1.0 } * (1.0 - 2f64.powf(-near));
            let xy = ((between + xt as f64 * yt as f64) / t as f64) as i64;
            let between = xy * t - xt * yt;
            if xy.abs() <= 1 << 30 && is_well_definite(x_minor, y_minor, between) {
                let by = Divisor::new(t).unwrap();
                let (x, y, xy) = (by.floor(x_minor), by.floor(y_minor), by.nearest(between));
                prop_assert!(xy.abs() <= 1 << 30);
                prop_assert!(x * y - xy * xy > 80 * (x + y) + 1600);
            }
        }
    }

    /// Each share is at least what the pivot's rounding needs, exactly.
    #[test]
    fn a_share_is_enough(q in 1i64..1 << 29, by in 0..29u32, entry in any::<i64>(), down in 4..64u32, slack in 0i64..1 << 30, less in 0..31u32) {
        let q = (q >> by).max(1);
        let (entry, slack) = (entry >> down.min(63), slack >> less);
        let w = (q >> 11) + 1;
        for (pivot, spare) in [
            (Pivot::of((q + w) as i32, yaw_weight(q as u32, w as u32)), q * w),
            (Pivot::of(q as i32, (q as u32 + 1) << 1), 2 * q - 1),
        ] {
            if let Some((quotient, share)) = pivot.divide(entry, slack) {
                let value = i128::from(pivot.value);
                let rest = (i128::from(entry) - i128::from(quotient) * value).abs();
                let residual = rest + i128::from(slack);
                prop_assert!(i128::from(share) * i128::from(spare) >= residual * residual);
                // Near the nearest.
                prop_assert!(rest as f64 / value as f64 <= 0.5 + f64::from(quotient).abs() * 2f64.powi(-26));
            }
        }
    }
}
