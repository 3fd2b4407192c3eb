//! The rows of the pose-set's error budget, each searched for its worst case.

use super::*;
use crate::error_budget::{Exact, Random, Row, Search};
use crate::test_share;

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

/// A covariance of floats: log-uniform variances, correlations near 1, and halves that differ by a little. Two symmetric matrices between the
/// halves.
fn covariance(random: &mut Random) -> ([[f64; 3]; 3], [Matrix; 2]) {
    let sigma: [f64; 3] = core::array::from_fn(|_| random.log_within(1e-5, 10.0));
    let strength = random.log_within(0.01, 300.0);
    let rows: [[f64; 3]; 3] = core::array::from_fn(|i| {
        let row: [f64; 3] = core::array::from_fn(|j| {
            f64::from(u8::from(i == j)) + strength * random.within(-1.0, 1.0)
        });
        let length = row.iter().map(|v| v * v).sum::<f64>().sqrt();
        row.map(|v| v / length)
    });
    let apart = if random.unit() < 0.5 { 0.0 } else { 4e-7 };
    let mut p = [[0.0; 3]; 3];
    for i in 0..3 {
        for j in 0..3 {
            let dot: f64 = (0..3).map(|k| rows[i][k] * rows[j][k]).sum();
            let off = if i == j {
                0.0
            } else {
                random.within(-apart, apart)
            };
            p[i][j] = sigma[i] * sigma[j] * if i == j { 1.0 } else { dot + off };
        }
    }
    let of = |upper: bool| {
        matrix(|i, j| {
            let is_swapped = (i < j) != upper && i != j;
            Exact::float(if is_swapped { p[j][i] } else { p[i][j] })
        })
    };
    (p, [of(true), of(false)])
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
    let mut search = Search::new();
    let units = units();
    for _ in 0..test_share(20_000, 10) {
        let (p, halves) = covariance(&mut random);
        let q16 = random.log_within(65_536.0, 16_777_215.0) as u32;
        let radius = RadiusSquared::from_q16(q16).unwrap();
        let inflation = Inflation::new(random.log_within(1.0, 1_000.0)).unwrap();
        let trust = Trust {
            inflation,
            ..Trust::FULL
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
            search.case(1.0, ratio(&found, &exact));
        }
    }
    search.report(&Row {
        name: "set: r2 P, over F F' in the same direction",
        unit: "1",
        looseness: None,
    });
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
        let noise = PathNoise {
            xx: random.log_within(1.0, 1e9) as i64,
            yy: random.log_within(1.0, 1e9) as i64,
            tt: random.log_within(1.0, 1e9) as i64,
            ..PathNoise::default()
        };
        let inflation = Inflation::new(random.log_within(1.0, 100.0)).unwrap();
        let trust = Trust {
            inflation,
            ..Trust::FULL
        };
        let Ok(carried) = super::carried(&p, trust, by, &noise) else {
            continue;
        };
        let found = matrix(|i, j| Exact::float(carried[i][j]));
        // Metres of the place per radian of the heading.
        let lever = by.map(|um| Exact::int(um).div(&units[0]));
        let g = [-&lever[1], lever[0].clone(), Exact::int(1)];
        let added = [noise.xx, noise.yy, noise.tt];
        let times = Exact::dyadic(inflation.q16(), 16);
        for half in halves {
            let exact = matrix(|i, j| {
                let plane = |k: usize| if k < 2 { g[k].clone() } else { Exact::int(0) };
                let mut entry = half[i][j].clone();
                entry = &entry + &(&plane(i) * &half[2][j]);
                entry = &entry + &(&half[i][2] * &plane(j));
                entry = &entry + &(&(&plane(i) * &plane(j)) * &half[2][2]);
                entry = &entry * &times;
                if i == j {
                    entry = &entry + &Exact::int(added[i]).div(&(&units[i] * &units[i]));
                }
                entry
            });
            search.case(1.0, ratio(&found, &exact));
        }
    }
    search.report(&Row {
        name: "set: a covariance carried along a path, over what is returned",
        unit: "1",
        looseness: None,
    });
}

#[test]
fn lengths_and_turns() {
    let mut random = Random::new(13);
    let mut searches = [(); 5].map(|()| Search::new());
    let [metre, _, radian] = units();
    for _ in 0..test_share(50_000, 20) {
        let [length, swung, inflated, scaled, turn] = &mut searches;
        let (metres, radians) = (
            random.log_within(1e-6, 40.0),
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
        let yaw = random.log_within(1.0, 16_777_216.0) as i32;
        let [_, sin] = (&Exact::dyadic(yaw, 24) * &Exact::pi()).cos_sin();
        let chord = &Exact::int(2 * i64::from(growth.translation_um())) * &sin;
        swung.case(
            growth.swung(yaw).translation_um().into(),
            chord.abs().to_f64(),
        );
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
