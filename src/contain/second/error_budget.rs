//! The rows of the tolerances of the second evaluation, each searched for its worst case in floats of 53 bits.

use super::believed::{Ellipsoid, Question};
use super::planes::{Body, ROUNDING_OF_C, ROUNDING_OF_S, SQUARE_MICRO, spread, turned};
use super::turn::{cosine_and_sine, heading};
use crate::error_budget::{Random, Row, Search};
use crate::report::{Heading, PoseEstimate};
use crate::set::{CrossTerms, Estimate, Inflation, SplitWeight, Trust, Uncertainty};
use crate::test_share;
use core::f64::consts::TAU;
use nalgebra::{Matrix2, Matrix3};

const ONE: f64 = 1_073_741_824.0;
const TURN: f64 = 4_294_967_296.0;

fn reported(search: &Search, name: &str, unit: &str, looseness: Option<&str>) {
    search.report(&Row {
        name,
        unit,
        looseness,
    });
}

/// Returns how far an angle is from another, 2^-32 turn.
fn apart(found: u32, exact: f64) -> f64 {
    let off = f64::from(found) - exact.rem_euclid(TURN);
    (off - (off / TURN).round() * TURN).abs()
}

#[test]
fn turns_keep_their_error() {
    let (mut of_cosines, mut of_headings) = (Search::new(), Search::new());
    let mut random = Random::new(1);
    for _ in 0..test_share(2_000_000, 200) {
        let turn = (random.unit() * TURN) as u32;
        let (sine, cosine) = (f64::from(turn) / TURN * TAU).sin_cos();
        for (found, exact) in cosine_and_sine(turn).into_iter().zip([cosine, sine]) {
            of_cosines.case(16.0, (f64::from(found) - exact * ONE).abs());
        }
        let length = random.within(0.9, 1.1) * ONE;
        let vector = [cosine, sine].map(|v| (v * length).round() as i32);
        let exact = f64::from(vector[1]).atan2(f64::from(vector[0])) / TAU * TURN;
        of_headings.case(12.0, apart(heading(vector), exact));
    }
    reported(&of_cosines, "second: cosine and sine", "2^-30", None);
    reported(
        &of_headings,
        "second: heading of a vector",
        "2^-32 turn",
        None,
    );
}

/// An estimate with a heading at a place.
fn estimate(x_m: f64, y_m: f64, heading: Heading) -> PoseEstimate {
    let spread = Uncertainty::Bounded {
        translation_m: 0.1,
        yaw_rad: 0.1,
    };
    let at = Estimate {
        x_m,
        y_m,
        yaw_rad: 0.0,
    };
    PoseEstimate {
        heading,
        ..PoseEstimate::new(at, spread)
    }
}

fn question(belief: &PoseEstimate) -> Question<'_> {
    Question {
        belief,
        trust: Trust::FULL,
        radius_q16: 743_498,
        moved_um: 0,
        side_um: 0,
        swing: 0,
    }
}

#[test]
fn estimates_keep_their_error() {
    let mut table = [0u8; 64];
    let (mut of_places, mut of_radians, mut of_quaternions) =
        (Search::new(), Search::new(), Search::new());
    let mut random = Random::new(2);
    for _ in 0..test_share(2_000_000, 200) {
        let goal = [0; 2].map(|_| (random.within(-1.0, 1.0) * 1e6) as i32);
        for (at, goal) in [16, 20].into_iter().zip(goal) {
            table[at..at + 4].copy_from_slice(&goal.to_le_bytes());
        }
        // Lengths at which a float still has the units' eighths.
        let [x, y] = [0; 2].map(|_| random.log_within(1e-6, 1e3) * random.sign());
        let yaw = random.within(-7.0, 7.0);
        let belief = estimate(x, y, Heading::Radians(yaw));
        let finer = 2 + (random.unit() * 13.0) as i32;
        let unit = 2f64.powi(finer);
        let found = question(&belief).above(&table, finer).unwrap();
        for ((found, at), goal) in found.into_iter().zip([x, y]).zip(goal) {
            let whole = found + (i64::from(goal) << finer);
            of_places.case(1.0, (whole as f64 - at * 1e6 * unit).abs());
        }
        let found = question(&belief).heading().unwrap();
        of_radians.case(1.0, apart(found, yaw / TAU * TURN));

        // A rotation of a length of about one, tilted by up to five degrees.
        let half = yaw / 2.0;
        let length = 1.0 + random.within(-1.0, 1.0) * 2f64.powi(-16);
        let [tilt, towards] = [random.unit() * 0.042, random.unit() * TAU];
        let upright = length * (1.0 - tilt * tilt).sqrt();
        let [qx, qy] = [tilt * towards.cos(), tilt * towards.sin()];
        let [qz, qw] = [upright * half.sin(), upright * half.cos()];
        let belief = estimate(x, y, Heading::Quaternion([qx, qy, qz, qw]));
        let found = question(&belief).heading().unwrap();
        let cosine = qw * qw + qx * qx - qy * qy - qz * qz;
        let exact = (2.0 * (qw * qz + qx * qy)).atan2(cosine) / TAU * TURN;
        of_quaternions.case(16.0, apart(found, exact));
    }
    reported(&of_places, "second: place", "2^-2 to 2^-14 um", None);
    reported(
        &of_radians,
        "second: heading in radians",
        "2^-32 turn",
        None,
    );
    reported(
        &of_quaternions,
        "second: heading of a quaternion",
        "2^-32 turn",
        None,
    );
}

/// A trust that changes every weight, and a squared radius.
fn trust(random: &mut Random) -> (Trust, u32) {
    let cross_terms = match (random.unit() * 3.0) as u32 {
        0 => CrossTerms::Filled,
        1 => CrossTerms::YawUnknown(SplitWeight::HALF),
        _ => CrossTerms::AllUnknown(SplitWeight::HALF),
    };
    let inflation = random.log_within(65_536.0, 65_536e3) as u32;
    let trust = Trust {
        inflation: Inflation::from_q16(inflation).unwrap(),
        cross_terms,
    };
    (trust, random.log_within(65_536.0, 16e6) as u32)
}

/// Returns C of an ellipsoid as it is stored, and exactly. In half of the cases the variances are nearly equal in C, where its roundings count most.
fn taken(random: &mut Random) -> Option<(Body, Matrix3<f64>)> {
    let (unit, lever) = ((random.unit() * 13.0) as i32, (random.unit() * 16.0) as i32);
    let [length, turn] = [1e6 * 2f64.powi(-unit), 2f64.powi(lever)];
    let sigma = if random.unit() < 0.5 {
        let all = random.log_within(1e-5, 1.0) * turn;
        [all / length, all / length, all / turn].map(|v| v * random.within(0.8, 1.25))
    } else {
        [
            random.log_within(1e-5, 2.0),
            random.log_within(1e-5, 2.0),
            random.log_within(1e-5, 1.0),
        ]
    };
    let lower = [0; 3].map(|_| {
        let close = random.log_within(1e-6, 1.0);
        let rho = (1.0 - close) * random.sign();
        [rho, (1.0 - rho * rho).sqrt()]
    });
    let [[a, ra], [b, rb], [c, _]] = lower;
    // Any correlation that the other two allow.
    let between = a * b + ra * rb * c;
    let entry = |i: usize, j: usize, rho: f64| rho * sigma[i] * sigma[j];
    let (xy, xt, yt) = (entry(0, 1, between), entry(0, 2, a), entry(1, 2, b));
    let given = [
        [entry(0, 0, 1.0), xy, xt],
        [xy, entry(1, 1, 1.0), yt],
        [xt, yt, entry(2, 2, 1.0)],
    ];
    let belief = estimate(0.0, 0.0, Heading::Radians(0.0));
    let (trust, radius_q16) = trust(random);
    let question = Question {
        trust,
        radius_q16,
        ..question(&belief)
    };
    let ellipsoid: Ellipsoid = question.ellipsoid(&given)?;
    let mut body = Body::EMPTY;
    body.take(&ellipsoid, unit, lever)?;
    let r2 = f64::from(radius_q16) / 65_536.0 * f64::from(trust.inflation.q16()) / 65_536.0;
    // The shares of the plane and of yaw.
    let (shares, in_plane, with_yaw) = match trust.cross_terms {
        CrossTerms::Filled => ([1.0; 2], 1.0, 1.0),
        CrossTerms::YawUnknown(_) => ([0.5; 2], 1.0, 0.0),
        CrossTerms::AllUnknown(_) => ([0.25, 0.5], 0.0, 0.0),
    };
    let scale = 2f64.powi(body.power);
    let to = [length, length, turn].map(|v| v * scale);
    let exact = Matrix3::from_fn(|i, j| {
        let [plane, yaw] = shares;
        let share = match (i == 2, j == 2) {
            (true, true) => 1.0 / yaw,
            (false, false) if i == j => 1.0 / plane,
            (false, false) => in_plane / plane,
            _ => with_yaw / plane,
        };
        given[i][j] * r2 * share * to[i] * to[j]
    });
    Some((body, exact))
}

/// Both lowered covariances are below the exact ones in every direction, and by little more than their roundings.
#[test]
fn covariances_keep_their_error() {
    let mut random = Random::new(3);
    let (mut of_c, mut of_s) = (Search::new(), Search::new());
    let (mut tried, mut found) = (0u32, 0u32);
    let [less_c, less_s] = [ROUNDING_OF_C, ROUNDING_OF_S].map(f64::from);
    for _ in 0..test_share(400_000, 40) {
        tried += 1;
        let Some((body, exact)) = taken(&mut random) else {
            continue;
        };
        found += 1;
        let [xx, xy, yy, xt, yt, tt] = body.world.map(f64::from);
        let stored = Matrix3::new(xx, xy, xt, xy, yy, yt, xt, yt, tt);
        let above = stored + Matrix3::identity() * less_c - exact;
        of_c.case(less_c, above.symmetric_eigenvalues().max());

        // S of the rotated C, from the stored numbers.
        let [c, s] = cosine_and_sine((random.unit() * TURN) as u32);
        let lever = [0; 2].map(|_| (random.within(-1.0, 1.0) * ONE) as i32);
        let [sxx, sxy, syy] = spread(&turned(&body.world, [c, s]), lever).map(f64::from);
        let [c, s] = [c, s].map(|v| f64::from(v) / ONE);
        let back = Matrix3::new(c, s, 0.0, -s, c, 0.0, 0.0, 0.0, 1.0);
        let robot = back * stored * back.transpose();
        let [lx, ly] = lever.map(|v| f64::from(v) / ONE);
        let to = nalgebra::Matrix2x3::new(1.0, 0.0, lx, 0.0, 1.0, ly);
        let above = Matrix2::new(sxx, sxy, sxy, syy) + Matrix2::identity() * less_s
            - to * robot * to.transpose();
        of_s.case(less_s, above.symmetric_eigenvalues().max());
    }
    assert!(found * 2 > tried, "{found} of {tried}");
    reported(&of_c, "second: C", "2^(-2 power)", None);
    reported(&of_s, "second: S", "2^(-2 power)", None);
}

/// The squared radius, a variance and a unit together are down, and by little.
#[test]
fn weights_keep_their_error() {
    let mut search = Search::new();
    let mut random = Random::new(4);
    for _ in 0..test_share(1_000_000, 100) {
        let value = random.log_within(1e-12, 10.0);
        let belief = estimate(0.0, 0.0, Heading::Radians(0.0));
        let (trust, radius_q16) = trust(&mut random);
        let asked = Question {
            trust,
            radius_q16,
            ..question(&belief)
        };
        let given = [[value, 0.0, 0.0], [0.0, value, 0.0], [0.0, 0.0, value]];
        let ellipsoid = asked.ellipsoid(&given).unwrap();
        let [xx, ..] = ellipsoid.covariance;
        let found = xx.times(ellipsoid.plane.times(SQUARE_MICRO)).value();
        let share = match trust.cross_terms {
            CrossTerms::Filled => 1.0,
            CrossTerms::YawUnknown(_) => 2.0,
            CrossTerms::AllUnknown(_) => 4.0,
        };
        let squared = f64::from(radius_q16) * f64::from(trust.inflation.q16());
        let exact = value * 1e12 * squared / 4_294_967_296.0 * share;
        let less = 1.0 - found / exact;
        assert!(less >= -1e-15, "{less}");
        search.case(1.5 * 2f64.powi(-28), less);
    }
    reported(
        &search,
        "second: radius times a variance and a unit",
        "of the value",
        None,
    );
}
