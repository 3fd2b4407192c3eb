//! The rows of the pose-set's error budget, each searched for its worst case.

use super::*;
use crate::error_budget::{Exact, Random, Row, Search};
use crate::test_share;
use std::vec::Vec;

type Matrix = [[Exact; 3]; 3];

fn matrix(entry: impl Fn(usize, usize) -> Exact) -> Matrix {
    core::array::from_fn(|i| core::array::from_fn(|j| entry(i, j)))
}

fn determinant2(m: &Matrix, [i, j]: [usize; 2]) -> Exact {
    &(&m[i][i] * &m[j][j]) - &(&m[i][j] * &m[j][i])
}

fn determinant(m: &Matrix) -> Exact {
    let minor = |i: usize, j: usize| {
        let [a, b] = [[1, 2], [0, 2], [0, 1]][i];
        let [c, d] = [[1, 2], [0, 2], [0, 1]][j];
        &(&m[a][c] * &m[b][d]) - &(&m[a][d] * &m[b][c])
    };
    let sum = &(&m[0][0] * &minor(0, 0)) - &(&m[0][1] * &minor(0, 1));
    &sum + &(&m[0][2] * &minor(0, 2))
}

/// Returns the largest ratio of `exact` to `found` along a direction; above 1 if and only if `found - exact` has a negative direction, which the
/// exact principal minors decide.
fn ratio(found: &Matrix, exact: &Matrix) -> f64 {
    let apart = matrix(|i, j| &found[i][j] - &exact[i][j]);
    let zero = Exact::int(0);
    let is_above = (0..3).all(|i| apart[i][i] >= zero)
        && [[0, 1], [0, 2], [1, 2]]
            .iter()
            .all(|pair| determinant2(&apart, *pair) >= zero)
        && determinant(&apart) >= zero;
    let size: [f64; 3] = core::array::from_fn(|i| found[i][i].to_f64().sqrt());
    let scaled =
        |m: &Matrix| nalgebra::Matrix3::from_fn(|i, j| m[i][j].to_f64() / (size[i] * size[j]));
    // The smallest eigenvalue of apart relative to found.
    let least = scaled(found).cholesky().map(|factor| {
        let inverse = factor.l().try_inverse().expect("definite");
        let relative = inverse * scaled(&apart) * inverse.transpose();
        relative.symmetric_eigenvalues().min()
    });
    let ratio = 1.0 - least.unwrap_or(0.0).max(0.0);
    if is_above { ratio } else { f64::INFINITY }
}

/// A covariance of floats: log-uniform variances, correlations near 1, and halves that differ by a little. Symmetric matrices between the halves:
/// both halves, mixtures of their entries, and shares of both.
fn covariance(random: &mut Random) -> ([[f64; 3]; 3], Vec<Matrix>) {
    let sigma: [f64; 3] = core::array::from_fn(|_| random.log_within(1e-6, 30.0));
    let strength = random.log_within(0.01, 1e4);
    let rows: [[f64; 3]; 3] = core::array::from_fn(|i| {
        let row: [f64; 3] = core::array::from_fn(|j| {
            f64::from(u8::from(i == j)) + strength * random.within(-1.0, 1.0)
        });
        let length = row.iter().map(|v| v * v).sum::<f64>().sqrt();
        row.map(|v| v / length)
    });
    // The halves of a pair differ by up to 2^-20 of the variances' root.
    let apart = if random.unit() < 0.5 { 0.0 } else { 4.7e-7 };
    let mut p = [[0.0; 3]; 3];
    for i in 0..3 {
        for j in 0..3 {
            let dot: f64 = (0..3).map(|k| rows[i.min(j)][k] * rows[i.max(j)][k]).sum();
            let off = if i == j {
                0.0
            } else {
                random.within(-apart, apart)
            };
            p[i][j] = sigma[i] * sigma[j] * if i == j { 1.0 } else { dot + off };
        }
    }
    let mut shares: Vec<[u32; 3]> = (0..8u32)
        .map(|k| [0, 1, 2].map(|bit| (k >> bit & 1) << 10))
        .collect();
    shares.push([(); 3].map(|()| (random.unit() * 1_024.0) as u32));
    let between = |of: [u32; 3]| {
        matrix(|i, j| {
            let (i, j) = (i.min(j), i.max(j));
            let share = Exact::dyadic(of[(i + j).saturating_sub(1).min(2)], 10);
            let [upper, lower] = [Exact::float(p[i][j]), Exact::float(p[j][i])];
            &lower + &(&(&upper - &lower) * &share)
        })
    };
    let count = if apart > 0.0 { shares.len() } else { 1 };
    (p, shares.into_iter().take(count).map(between).collect())
}

/// Terms that are filled, and terms that are not, of every share.
fn terms(random: &mut Random) -> CrossTerms {
    let share = SplitWeight::from_q8(1 + (random.unit() * 255.0) as u8).unwrap();
    [
        CrossTerms::Filled,
        CrossTerms::YawUnknown(share),
        CrossTerms::AllUnknown(share),
    ][(random.unit() * 3.0) as usize]
}

/// Returns `true` if no direction has a negative variance.
fn is_covariance(m: &Matrix) -> bool {
    let zero = Exact::int(0);
    [[0, 1], [0, 2], [1, 2]]
        .iter()
        .all(|pair| determinant2(m, *pair) >= zero)
        && determinant(m) >= zero
}

/// Units of the integers: micrometres, micrometres and 2^-24 turn for a metre and a radian.
fn units() -> [Exact; 3] {
    let metre = Exact::int(1_000_000);
    let radian = Exact::int(1 << 23).div(&Exact::pi());
    [metre.clone(), metre, radian]
}

#[test]
fn factor_of_a_covariance() {
    let mut random = Random::new(11);
    let (mut search, mut unknown) = (Search::new(), Search::new());
    let units = units();
    for _ in 0..test_share(20_000, 10) {
        let (p, halves) = covariance(&mut random);
        let q16 = random.log_within(65_536.0, 16_777_215.0) as u32;
        let radius = RadiusSquared::from_q16(q16).unwrap();
        let inflation = Inflation::new(random.log_within(1.0, 1_000.0)).unwrap();
        let cross_terms = terms(&mut random);
        let trust = Trust {
            inflation,
            cross_terms,
        };
        let Ok(set) = PoseSet::trusted(Pose::default(), Uncertainty::Gaussian(p), radius, trust)
        else {
            continue;
        };
        let Extent::Gaussian(factor) = set.extent() else {
            panic!("of a covariance")
        };
        let rows = [factor.x, factor.y, [factor.yaw, 0, 0]];
        let found = matrix(|i, j| {
            let dot: i128 = (0..3)
                .map(|k| i128::from(rows[i][k]) * i128::from(rows[j][k]))
                .sum();
            Exact::int(dot)
        });
        let times = &Exact::dyadic(q16, 16) * &Exact::dyadic(inflation.q16(), 16);
        for half in halves {
            let exact = matrix(|i, j| &(&half[i][j] * &times) * &(&units[i] * &units[j]));
            // Terms that are not filled are those of some covariance.
            if cross_terms == CrossTerms::Filled {
                search.case(1.0, ratio(&found, &exact));
            } else if is_covariance(&half) {
                unknown.case(1.0, ratio(&found, &exact));
            }
        }
    }
    for (search, name) in [
        (search, "set: r2 P, over F F' in the same direction"),
        (unknown, "set: r2 P, over F F', cross terms unknown"),
    ] {
        search.report(&Row {
            name,
            unit: "1",
            looseness: None,
        });
    }
}

#[test]
fn carried_covariance() {
    let mut random = Random::new(12);
    let mut search = Search::new();
    let units = units();
    for _ in 0..test_share(20_000, 10) {
        let (p, halves) = covariance(&mut random);
        let length = random.log_within(1.0, 67_108_864.0);
        let by = [(); 2].map(|()| (random.within(-1.0, 1.0) * length) as i64);
        let noise = noise(&mut random);
        let inflation = Inflation::new(random.log_within(1.0, 100.0)).unwrap();
        let cross_terms = terms(&mut random);
        let trust = Trust {
            inflation,
            cross_terms,
        };
        let Ok(carried) =
            super::Carriable::of(&p, trust).and_then(|p| super::carried(&p, by, &noise))
        else {
            continue;
        };
        let found = matrix(|i, j| Exact::float(carried[i][j]));
        // Metres of the place per radian of the heading.
        let lever = by.map(|um| Exact::int(um).div(&units[0]));
        let g = [-&lever[1], lever[0].clone(), Exact::int(1)];
        let added = [
            [noise.xx, noise.xy, noise.xt],
            [noise.xy, noise.yy, noise.yt],
            [noise.xt, noise.yt, noise.tt],
        ];
        let times = Exact::dyadic(inflation.q16(), 16);
        for half in halves {
            let exact = matrix(|i, j| {
                let plane = |k: usize| if k < 2 { g[k].clone() } else { Exact::int(0) };
                let mut entry = half[i][j].clone();
                entry = &entry + &(&plane(i) * &half[2][j]);
                entry = &entry + &(&half[i][2] * &plane(j));
                entry = &entry + &(&(&plane(i) * &plane(j)) * &half[2][2]);
                entry = &entry * &times;
                &entry + &Exact::int(added[i][j]).div(&(&units[i] * &units[j]))
            });
            if cross_terms != CrossTerms::Filled && !is_covariance(&half) {
                continue;
            }
            search.case(1.0, ratio(&found, &exact));
        }
    }
    search.report(&Row {
        name: "set: a covariance carried along a path, over what is returned",
        unit: "1",
        looseness: None,
    });
}

/// The noise of a path, with terms off the diagonal.
fn noise(random: &mut Random) -> PathNoise {
    let [x, y, t] = [(); 3].map(|()| random.log_within(1.0, 3e4));
    let [a, b, c] = [(); 3].map(|()| random.within(-0.5, 0.5));
    let of = |share: f64| (share * share.abs().min(1.0)) as i64;
    PathNoise {
        xx: of(x) * x as i64 + 1,
        yy: of(y) * y as i64 + 1,
        tt: of(t) * t as i64 + 1,
        xy: (a * x * y) as i64,
        xt: (b * x * t) as i64,
        yt: (c * y * t) as i64,
    }
}

/// Roundings of `carried` alone: from the integers that it takes to those that it encodes.
#[test]
fn rounding_of_carried_rows() {
    let mut random = Random::new(14);
    let (mut search, mut swings) = (Search::new(), Search::new());
    let turn = &Exact::pi() * &Exact::dyadic(1, 23);
    let [metre, _, radian] = units();
    // The largest error is climbed to by changes of the last digits.
    let mut best: Option<(f64, [[f64; 3]; 3], [i64; 2])> = None;
    for round in 0..test_share(100_000, 20) {
        let (mut p, mut by);
        match &best {
            Some((_, from, at)) if round % 5_000 > 500 => {
                let reach = random.log_within(1e-9, 1e-2);
                p = *from;
                for (i, j) in [(0, 2), (1, 2), (2, 2)] {
                    p[i][j] *= 1.0 + random.within(-reach, reach);
                    p[j][i] = p[i][j];
                }
                let step = random.log_within(1.0, 1e3);
                by = at
                    .map(|um| (um + random.within(-step, step) as i64).clamp(-(1 << 26), 1 << 26));
            }
            _ => {
                let widest = if random.unit() < 0.5 { 1e-3 } else { 30.0 };
                let [a, b] = [
                    random.log_within(1e-6, 0.1),
                    random.log_within(1e-7, widest),
                ];
                let off = [(); 3].map(|()| random.within(-0.4, 0.4));
                let (xy, xt, yt) = (a * a * off[0], a * b * off[1], a * b * off[2]);
                p = [[a * a, xy, xt], [xy, a * a, yt], [xt, yt, b * b]];
                let length = random.log_within(1.0, 67_108_864.0);
                by = [(); 2].map(|()| (random.within(-1.0, 1.0) * length) as i64);
                if round % 5_000 == 0 {
                    best = None;
                }
            }
        }
        let one = RadiusSquared::from_q16(1 << 16).unwrap();
        let (Ok(t), Ok(found)) = (
            covariance::target(&p, Reach::of(one, Trust::FULL)),
            super::Carriable::of(&p, Trust::FULL)
                .and_then(|p| super::carried(&p, by, &PathNoise::default())),
        ) else {
            continue;
        };
        let [dx, dy] = &mut by;
        let lever = |um: i64| &Exact::int(um) * &turn;
        let (a, b) = (lever(-*dy), lever(*dx));
        let n = |v: i64| Exact::int(v);
        let wide = |v: i64, s: [i64; 2]| n(v + s[0] + s[1]);
        let xx = wide(t.xx, [t.xy_slack, t.xt_slack]);
        let yy = wide(t.yy, [t.xy_slack, t.yt_slack]);
        let tt = wide(t.tt, [t.xt_slack, t.yt_slack]);
        let twice = |v: &Exact| v + v;
        let (xt, yt) = (n(t.xt), n(t.yt));
        let exact = matrix(|i, j| match [i.min(j), i.max(j)] {
            [0, 0] => &(&xx + &twice(&(&a * &xt))) + &(&(&a * &a) * &tt),
            [1, 1] => &(&yy + &twice(&(&b * &yt))) + &(&(&b * &b) * &tt),
            [0, 1] => &(&n(t.xy) + &(&(&a * &yt) + &(&b * &xt))) + &(&(&a * &b) * &tt),
            [0, _] => &xt + &(&a * &tt),
            [1, _] => &yt + &(&b * &tt),
            _ => tt.clone(),
        });
        let size = [&metre, &metre, &radian];
        let off =
            matrix(|i, j| &(&(&Exact::float(found[i][j]) * size[i]) * size[j]) - &exact[i][j]);
        let longest = a.abs().max(b.abs()).to_f64().floor();
        let slack = 2.0 * longest + carried::ROUNDED as f64;
        // Entries above 2^40 are rounded up further: for the swing by the lever, and for the floats.
        if (0..3).any(|i| exact[i][i] >= Exact::int(1u64 << 40)) {
            let swing = (&a * &a).max(&b * &b).to_f64() * tt.to_f64() / 2f64.powi(35);
            let up: [f64; 3] = core::array::from_fn(|i| {
                let swing = if i < 2 { swing } else { 0.0 };
                (slack + swing + exact[i][i].to_f64() / 2f64.powi(40)).sqrt()
            });
            let above = nalgebra::Matrix3::from_fn(|i, j| off[i][j].to_f64() / (up[i] * up[j]));
            swings.case(1.0, 1.0 - above.symmetric_eigenvalues().min());
            continue;
        }
        let worst = (0..3)
            .map(|i| {
                let beside: f64 = (0..3)
                    .filter(|j| *j != i)
                    .map(|j| off[i][j].to_f64().abs())
                    .sum();
                slack - off[i][i].to_f64() + beside
            })
            .fold(f64::NEG_INFINITY, f64::max);
        search.case(slack, worst);
        if best
            .as_ref()
            .is_none_or(|(least, ..)| worst / slack >= *least)
        {
            best = Some((worst / slack, p, by));
        }
    }
    search.report(&Row {
        name: "set: roundings of a carried covariance, of a row",
        unit: "um^2, um 2^-24 turn, 2^-48 turn^2",
        looseness: None,
    });
    swings.report(&Row {
        name: "set: swing of a carried covariance beyond 2^40, in the worst direction",
        unit: "of what is added",
        looseness: None,
    });
}

/// The entries of `r2 P`: variances are rounded up, covariances stay within their slack of both halves.
#[test]
fn entries_of_the_target() {
    let mut random = Random::new(15);
    let (mut up, mut down, mut beside) = (Search::new(), Search::new(), Search::new());
    let units = units();
    for _ in 0..test_share(50_000, 20) {
        let (p, _) = covariance(&mut random);
        let q16 = random.log_within(65_536.0, 16_777_215.0) as u32;
        let radius = RadiusSquared::from_q16(q16).unwrap();
        let Ok(t) = covariance::target(&p, Reach::of(radius, Trust::FULL)) else {
            continue;
        };
        let exact = |i: usize, j: usize| {
            &(&Exact::float(p[i][j]) * &Exact::dyadic(q16, 16)) * &(&units[i] * &units[j])
        };
        for (i, found) in [t.xx, t.yy, t.tt].into_iter().enumerate() {
            let over = (&Exact::int(found) - &exact(i, i)).to_f64();
            let bound = 1.0 + found as f64 * (2f64.powf(-29.2) + 2f64.powi(-31));
            up.case(bound, over);
            down.case(1.0, 1.0 - over.min(1.0));
        }
        for (i, j, found, slack) in [
            (0, 1, t.xy, t.xy_slack),
            (0, 2, t.xt, t.xt_slack),
            (1, 2, t.yt, t.yt_slack),
        ] {
            for (i, j) in [(i, j), (j, i)] {
                let off = (&Exact::int(found) - &exact(i, j)).abs().to_f64();
                if slack > 0 {
                    beside.case(slack as f64, off);
                }
            }
        }
    }
    for (search, name) in [
        (up, "set: a variance of the target, rounded up"),
        (
            down,
            "set: a variance of the target, what is left above the exact one",
        ),
        (beside, "set: a covariance of the target, within its slack"),
    ] {
        search.report(&Row {
            name,
            unit: "of the target's units",
            looseness: None,
        });
    }
}

/// A factor that is carried by every path from a start within the tolerance.
#[test]
fn carried_factor() {
    let mut random = Random::new(16);
    let mut searches = [(); 2].map(|()| Search::new());
    let radians = &Exact::pi() * &Exact::dyadic(1, 23);
    for _ in 0..test_share(20_000, 10) {
        let mut entry = |most: f64| (random.log_within(1.0, most) * random.sign()) as i32;
        let factor = SqrtFactor {
            yaw: entry(16_777_216.0).abs(),
            x: [entry(1e8), entry(1e7).abs(), 0],
            y: [entry(1e8), entry(1e7), entry(1e7).abs()],
        };
        let step = [entry(3e8), entry(3e8)];
        let away = if entry(2.0) > 0 { 0 } else { entry(3e8).abs() };
        let Some(t) = ScaledCovariance::carried(&factor, step, away) else {
            continue;
        };
        let entries = [[t.xx, t.xy, t.xt], [t.xy, t.yy, t.yt], [t.xt, t.yt, t.tt]];
        let found = matrix(|i, j| Exact::int(entries[i][j]));
        for _ in 0..4 {
            // Ends of the path are rounded by half a micrometre each.
            let angle = random.within(-4.0, 4.0);
            let off = [angle.cos(), angle.sin()]
                .map(|v| v * f64::from(away) * (1.0 - 1e-12) + random.sign());
            let yaw = &Exact::int(factor.yaw) * &radians;
            let lever = |at: usize| &(&Exact::int(step[at]) + &Exact::float(off[at])) * &yaw;
            let n = |v: i32| Exact::int(v);
            let rows = [
                [&n(factor.x[0]) - &lever(1), n(factor.x[1]), n(0)],
                [&n(factor.y[0]) + &lever(0), n(factor.y[1]), n(factor.y[2])],
                [n(factor.yaw), n(0), n(0)],
            ];
            let exact = matrix(|i, j| {
                let products = [0, 1, 2].map(|k| &rows[i][k] * &rows[j][k]);
                &(&products[0] + &products[1]) + &products[2]
            });
            searches[usize::from(away > 0)].case(1.0, ratio(&found, &exact));
        }
    }
    for (search, name) in searches.iter().zip([
        "task: a factor carried along a path",
        "task: a factor carried from a start within a tolerance",
    ]) {
        search.report(&Row {
            name,
            unit: "1",
            looseness: None,
        });
    }
}

/// Integers to floats: the nearest one, but for the unit's own rounding.
#[test]
fn encoded_lengths_and_turns() {
    let mut random = Random::new(17);
    let mut searches = [(); 2].map(|()| Search::new());
    let (micro, turn) = (
        Exact::int(1).div(&Exact::int(1_000_000)),
        &Exact::pi() * &Exact::dyadic(1, 31),
    );
    for _ in 0..test_share(50_000, 20) {
        let um = (random.log_within(1.0, 2e18) * random.sign()) as i64;
        let units = (random.log_within(1.0, 2e9) * random.sign()) as i32;
        let cases = [
            (metres(um), &Exact::int(um) * &micro),
            (radians(units), &Exact::int(units) * &turn),
        ];
        for (search, (found, exact)) in searches.iter_mut().zip(cases) {
            let size = found.abs();
            let half = (f64::from_bits(size.to_bits() + 1) - size) / 2.0;
            let off = (&Exact::float(found) - &exact).abs().to_f64();
            search.case(half * (1.0 + 1.0 / 512.0), off);
        }
    }
    for (search, name) in searches.iter().zip([
        "set: micrometres as a float of metres",
        "set: a turn as a float of radians",
    ]) {
        search.report(&Row {
            name,
            unit: "m, rad",
            looseness: None,
        });
    }
}

#[test]
fn lengths_and_turns() {
    let mut random = Random::new(13);
    let mut searches = [(); 5].map(|()| Search::new());
    let [metre, _, radian] = units();
    for _ in 0..test_share(50_000, 20) {
        let [length, swung, inflated, scaled, turn] = &mut searches;
        let (metres, radians) = (
            random.log_within(1e-6, 260.0),
            random.log_within(1e-7, 100.0),
        );
        let growth = Growth::of(metres, radians).unwrap();
        let exact = &Exact::float(metres) * &metre;
        length.case(growth.translation_um().into(), exact.to_f64());
        turn.case(
            growth.yaw_q24().into(),
            (&Exact::float(radians) * &radian).to_f64(),
        );
        // The chord of a turn of the axes.
        let yaw = random.log_within(1.0, 536_870_912.0) as i32;
        let half = yaw.min(1 << 23);
        let [_, sin] = (&Exact::dyadic(half, 24) * &Exact::pi()).cos_sin();
        let chord = &Exact::int(2 * i64::from(growth.translation_um())) * &sin;
        // A growth is limited to 268 m.
        let chord = chord.min(Exact::int(crate::pose::REACH_UM));
        swung.case(growth.swung(yaw).translation_um().into(), chord.to_f64());
        let inflation = Inflation::new(random.log_within(1.0, 4_000.0)).unwrap();
        let root = Exact::dyadic(inflation.q16(), 16).sqrt();
        let um = i64::from(growth.translation_um());
        inflated.case(
            inflation.of_length(um) as f64,
            (&Exact::int(um) * &root).to_f64(),
        );
        let q16 = random.log_within(1.0, 1e7) as u32;
        if let Some(found) = growth.scaled(q16) {
            let exact = &Exact::int(um) * &Exact::dyadic(q16, 16);
            scaled.case(found.translation_um().into(), exact.to_f64());
        }
    }
    for (search, name) in searches.iter().zip([
        "set: a length rounded up",
        "set: the chord of a turn, rounded up",
        "set: an inflated length",
        "set: a scaled length",
        "set: a turn rounded up",
    ]) {
        search.report(&Row {
            name,
            unit: "um, 2^-24 turn",
            looseness: None,
        });
    }
}
