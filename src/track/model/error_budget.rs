//! The rows of the odometry's numbers: each is stated by exact numbers from the text of [`OdometryErrors`].

use super::*;
use crate::error_budget::{Exact, Random, Row, Search};
use crate::test_share;
use core::f64::consts::TAU;

/// A movement that was reported: its length and turn, and its time. Metres, radians, seconds.
struct Movement {
    metres: Exact,
    radians: Exact,
    seconds: Exact,
}

/// Returns `1 / (1 - share)`.
fn of_the_rest(share: f64) -> Exact {
    Exact::int(1).div(&(&Exact::int(1) - &Exact::float(share)))
}

fn square(value: f64) -> Exact {
    &Exact::float(value) * &Exact::float(value)
}

impl Movement {
    /// The longest that the robot drove or the odometry reported: metres and radians.
    fn longest(&self, errors: &OdometryErrors) -> [Exact; 2] {
        let metres = &self.metres * &of_the_rest(errors.slip);
        let besides = &Exact::float(errors.turn_slip_per_m) * &metres;
        let radians = &(&self.radians + &besides) * &of_the_rest(errors.turn_slip);
        [metres, radians]
    }

    /// The variances of the position on each axis and of the heading: m^2 and rad^2.
    fn variances(&self, errors: &OdometryErrors) -> [Exact; 2] {
        let [metres, radians] = self.longest(errors);
        let plane = &(&square(errors.m_per_sqrt_m) * &metres)
            + &(&square(errors.m_per_sqrt_s) * &self.seconds);
        let turn = &(&square(errors.rad_per_sqrt_rad) * &radians)
            + &(&square(errors.rad_per_sqrt_m) * &metres);
        [
            plane,
            &turn + &(&square(errors.rad_per_sqrt_s) * &self.seconds),
        ]
    }

    /// The largest wrong length and the largest wrong turn: metres and radians.
    fn slip(&self, errors: &OdometryErrors) -> [Exact; 2] {
        let [metres, radians] = self.longest(errors);
        let length = &Exact::float(errors.slip) * &metres;
        let besides = &Exact::float(errors.turn_slip_per_m) * &metres;
        [
            length,
            &(&Exact::float(errors.turn_slip) * &radians) + &besides,
        ]
    }
}

fn drawn(random: &mut Random) -> OdometryErrors {
    let mut maybe = |low: f64, high: f64| {
        if random.unit() < 0.3 {
            0.0
        } else {
            random.log_within(low, high)
        }
    };
    OdometryErrors {
        m_per_sqrt_m: maybe(1e-4, 0.3),
        rad_per_sqrt_rad: maybe(1e-4, 0.3),
        rad_per_sqrt_m: maybe(1e-4, 0.3),
        m_per_sqrt_s: maybe(1e-5, 0.1),
        rad_per_sqrt_s: maybe(1e-5, 0.1),
        slip: maybe(1e-3, 0.5),
        turn_slip: maybe(1e-3, 0.5),
        turn_slip_per_m: maybe(1e-3, 0.5),
    }
}

/// A 2^-24 turn in radians.
fn q24() -> Exact {
    &(&Exact::pi() + &Exact::pi()) * &Exact::dyadic(1, 24)
}

/// The errors of one increment, from the shortest to the longest.
#[test]
fn noise_and_slip_of_a_movement() {
    let mut random = Random::new(11);
    let mut searches: [Search; 4] = core::array::from_fn(|_| Search::new());
    let unit = q24();
    let um = Exact::int(1_000_000);
    for _ in 0..test_share(20_000, 20) {
        let errors = drawn(&mut random);
        let noise = Noise::of(&errors).unwrap();
        let length_q8 = random.log_within(1.0, 1.0737e9) as u32;
        let turn_q24 = random.log_within(1.0, 2_097_152.0) as u32;
        let ms = random.log_within(1.0, 10_000.0) as u32;
        let movement = Movement {
            metres: Exact::int(length_q8).div(&Exact::int(256_000_000)),
            radians: &Exact::int(turn_q24) * &unit,
            seconds: Exact::int(ms).div(&Exact::int(1000)),
        };
        let [plane, turn] = noise.variances(length_q8, turn_q24, ms);
        let [length, turned] = noise.slip(length_q8.into(), turn_q24.into());
        let [exact_plane, exact_turn] = movement.variances(&errors);
        let [exact_length, exact_turned] = movement.slip(&errors);
        let exact = [
            &(&exact_plane * &um) * &um,
            exact_turn.div(&(&unit * &unit)),
            &exact_length * &um,
            exact_turned.div(&unit),
        ];
        let found = [plane as f64, turn as f64, length as f64, turned as f64];
        for ((search, bound), exact) in searches.iter_mut().zip(found).zip(exact) {
            search.case(bound.max(f64::MIN_POSITIVE), exact.to_f64());
        }
    }
    let rows = [
        ("track: variance of the position in an increment", "um^2"),
        (
            "track: variance of the heading in an increment",
            "2^-48 turn^2",
        ),
        ("track: slip of a length", "um"),
        ("track: slip of a turn", "2^-24 turn"),
    ];
    for (search, (name, unit)) in searches.iter().zip(rows) {
        search.report(&Row {
            name,
            unit,
            looseness: None,
        });
    }
}

/// The largest turn that the odometry reads in an increment that is not refused for its time, with 16 deviations of its noise.
#[test]
fn readings_are_told_apart() {
    let mut random = Random::new(12);
    let mut search = Search::new();
    for _ in 0..test_share(20_000, 20) {
        let errors = drawn(&mut random);
        let noise = Noise::of(&errors).unwrap();
        let (speed, rate) = (random.log_within(0.01, 5.0), random.log_within(0.01, 10.0));
        let bounds = MotionBounds::new(speed, 0.0, rate).unwrap();
        let ms = noise.longest_ms(bounds);
        if ms == 0 {
            continue;
        }
        // As fast as the bounds allow, a millisecond longer than the stamps tell.
        let seconds = Exact::int(u64::from(ms) + 1).div(&Exact::int(1000));
        let movement = Movement {
            metres: &Exact::float(speed) * &seconds,
            radians: &Exact::float(rate) * &seconds,
            seconds,
        };
        let [_, radians] = movement.longest(&errors);
        let [_, variance] = movement.variances(&errors);
        let deviations = &Exact::int(16) * &variance.sqrt();
        search.case(0.875 * TAU, (&radians + &deviations).to_f64());
    }
    search.report(&Row {
        name: "track: largest reading of an increment",
        unit: "rad",
        looseness: None,
    });
}
