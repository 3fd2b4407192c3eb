//! The rows of a task's error budget, each searched for its worst case.

use super::growth::{chord, outwards};
use super::path::Leg;
use crate::error_budget::{Exact, Random, Row, Search};
use crate::set::Estimate;
use crate::test_share;

#[test]
fn chord_of_a_turned_path() {
    let mut random = Random::new(21);
    let mut search = Search::new();
    for _ in 0..test_share(50_000, 20) {
        let length = random.log_within(1.0, 1e9) as i64;
        let yaw = random.log_within(1.0, 16_777_216.0) as i64;
        let [_, sin] = (&Exact::dyadic(yaw.min(1 << 23), 24) * &Exact::pi()).cos_sin();
        let exact = &Exact::int(2 * length) * &sin;
        search.case(chord(length, yaw) as f64, exact.to_f64());
    }
    search.report(&Row {
        name: "task: the chord of a path that is turned",
        unit: "um",
        looseness: None,
    });
}

/// The length of an arc by floats, rounded outwards.
#[test]
fn length_of_an_arc() {
    let mut random = Random::new(22);
    let mut search = Search::new();
    for _ in 0..test_share(50_000, 20) {
        let (chord, half) = (random.log_within(1e-3, 100.0), random.log_within(1e-9, 1.5));
        let from = Estimate {
            x_m: 0.0,
            y_m: 0.0,
            yaw_rad: 0.0,
        };
        let (s, c) = half.sin_cos();
        let (x_m, y_m) = (chord * c, chord * s);
        let (motion, _) = Leg::Arc { x_m, y_m }.motion(&from);
        // The chord and the angle of the end as floats, exactly.
        let (x, y) = (Exact::float(x_m), Exact::float(y_m));
        let chord = (&(&x * &x) + &(&y * &y)).sqrt();
        let (sin, cos) = (y.div(&chord), x.div(&chord));
        // The angle by Newton's method from the float's.
        let mut angle = Exact::float(half);
        for _ in 0..4 {
            let [c, s] = angle.cos_sin();
            angle = &angle + &(&(&sin * &c) - &(&cos * &s));
        }
        search.case(
            outwards(motion.length),
            (&chord * &angle).div(&sin).to_f64(),
        );
    }
    search.report(&Row {
        name: "task: the length of an arc",
        unit: "m",
        looseness: None,
    });
}
