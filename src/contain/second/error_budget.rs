//! The rows of the tolerances of the second evaluation, each searched for its worst case in floats of 53 bits.

use super::believed::{Ellipsoid, Question};
use super::planes::{Body, ROUNDING_OF_C, ROUNDING_OF_S, spread, turned};
use super::turn::{cosine_and_sine, heading};
use crate::error_budget::{Random, Row, Search};
use crate::report::{Heading, PoseEstimate};
use crate::set::{Estimate, RadiusSquared, Trust, Uncertainty};
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
        if let Some(found) = question(&belief).heading() {
            let cosine = qw * qw + qx * qx - qy * qy - qz * qz;
            let exact = (2.0 * (qw * qz + qx * qy)).atan2(cosine) / TAU * TURN;
            of_quaternions.case(16.0, apart(found, exact));
        }
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

/// Random deviations (m, m, rad) and correlations, some of them extreme.
fn covariance(random: &mut Random) -> [[f64; 3]; 3] {
    let sigma = [
        random.log_within(1e-5, 2.0),
        random.log_within(1e-5, 2.0),
        random.log_within(1e-5, 1.0),
    ];
    let mut lower = [[0.0; 3]; 3];
    for row in &mut lower {
        *row = [0; 3].map(|_| random.within(-1.0, 1.0) * random.log_within(1e-3, 1.0));
    }
    let mut covariance = [[0.0; 3]; 3];
    for i in 0..3 {
        for j in 0..3 {
            let product: f64 = (0..3).map(|k| lower[i][k] * lower[j][k]).sum();
            covariance[i][j] = product * sigma[i] * sigma[j];
        }
    }
    covariance
}

/// Returns C of an ellipsoid as it is stored, and exactly.
fn taken(random: &mut Random) -> Option<(Body, Matrix3<f64>)> {
    let given = covariance(random);
    let belief = estimate(0.0, 0.0, Heading::Radians(0.0));
    let question = question(&belief);
    let ellipsoid: Ellipsoid = question.ellipsoid(&given)?;
    let (unit, lever) = ((random.unit() * 12.0) as i32, (random.unit() * 16.0) as i32);
    let mut body = Body::EMPTY;
    body.take(&ellipsoid, unit, lever)?;
    let r2 = f64::from(question.radius_q16) / 65_536.0;
    let scale = 2f64.powi(body.power);
    let to = [
        1e6 * 2f64.powi(-unit) * scale,
        1e6 * 2f64.powi(-unit) * scale,
        2f64.powi(lever) * scale,
    ];
    let exact = Matrix3::from_fn(|i, j| given[i][j] * r2 * to[i] * to[j]);
    Some((body, exact))
}

/// Both lowered covariances are below the exact ones in every direction, and by little more than their roundings.
#[test]
fn covariances_keep_their_error() {
    let mut random = Random::new(3);
    let (mut of_c, mut of_s) = (Search::new(), Search::new());
    let [less_c, less_s] = [ROUNDING_OF_C, ROUNDING_OF_S].map(f64::from);
    for _ in 0..test_share(400_000, 40) {
        let Some((body, exact)) = taken(&mut random) else {
            continue;
        };
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
    reported(&of_c, "second: C", "2^(-2 power)", None);
    reported(&of_s, "second: S", "2^(-2 power)", None);
}

/// The squared radius, a variance and a unit together are down by little.
#[test]
fn weights_keep_their_error() {
    let mut search = Search::new();
    let mut random = Random::new(4);
    for _ in 0..test_share(1_000_000, 100) {
        let value = random.log_within(1e-12, 10.0);
        let belief = estimate(0.0, 0.0, Heading::Radians(0.0));
        let radius = RadiusSquared::from_q16((random.log_within(65_536.0, 16e6)) as u32).unwrap();
        let asked = Question {
            radius_q16: radius.q16(),
            ..question(&belief)
        };
        let given = [[value, 0.0, 0.0], [0.0, value, 0.0], [0.0, 0.0, value]];
        let ellipsoid = asked.ellipsoid(&given).unwrap();
        // In 2^-60 m2, so that nothing else is rounded.
        let [xx, ..] = ellipsoid.covariance;
        let found = xx.times(ellipsoid.plane);
        let exact = value * f64::from(radius.q16()) / 65_536.0;
        let less = 1.0 - found.value() / exact;
        search.case(2f64.powi(-28), less);
    }
    reported(
        &search,
        "second: radius times a variance",
        "of the value",
        None,
    );
}
