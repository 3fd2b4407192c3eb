//! The rows of a task's error budget, each searched for its worst case.

use super::growth::{MotionUpdate, PathTolerance, chord, outwards};
use super::path::Leg;
use super::{BoundedDriveModel, Cylinder, PoseErrorSet};
use crate::error_budget::{Exact, Random, Row, Search};
use crate::pose::Pose;
use crate::set::Estimate;
use crate::test_share;
use std::vec::Vec;

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

/// The direction of a vector, radians, by Newton's method from the float's.
fn direction(x: &Exact, y: &Exact) -> Exact {
    let length = (&(x * x) + &(y * y)).sqrt();
    let (cos, sin) = (x.div(&length), y.div(&length));
    let mut angle = Exact::float(sin.to_f64().atan2(cos.to_f64()));
    for _ in 0..4 {
        let [c, s] = angle.cos_sin();
        angle = &angle + &(&(&sin * &c) - &(&cos * &s));
    }
    angle
}

/// The magnitude of an angle's wrap.
fn turned(angle: &Exact) -> Exact {
    let turn = &Exact::pi() + &Exact::pi();
    let turns = (angle.to_f64() / core::f64::consts::TAU).round() as i64;
    (angle - &(&turn * &Exact::int(turns))).abs()
}

/// The true length and turning of straight legs between poses: metres and radians.
fn driven(poses: &[[Exact; 3]]) -> [Exact; 2] {
    let (mut length, mut turning) = (Exact::int(0), Exact::int(0));
    for pair in poses.windows(2) {
        let [[x0, y0, yaw], [x1, y1, to]] = [&pair[0], &pair[1]];
        let (dx, dy) = (x1 - x0, y1 - y0);
        let bearing = direction(&dx, &dy);
        length = &length + &(&(&dx * &dx) + &(&dy * &dy)).sqrt();
        turning = &(&turning + &turned(&(&bearing - yaw))) + &turned(&(to - &bearing));
    }
    [length, turning]
}

/// The bounded model along straight legs: starts and ends at their tolerances, and starts that `begins_at` accepts.
#[test]
fn bounded_update_of_a_path() {
    let mut random = Random::new(23);
    let mut searches = [(); 4].map(|()| Search::new());
    let metre = Exact::int(1_000_000);
    let radian = Exact::int(1 << 23).div(&Exact::pi());
    for round in 0..test_share(20_000, 10) {
        let count = 1 + (random.unit() * 3.0) as usize;
        let size = random.log_within(0.002, 50.0);
        let poses: Vec<[f64; 3]> = (0..=count)
            .map(|_| [size, size, core::f64::consts::PI].map(|most| random.within(-most, most)))
            .collect();
        let estimate = |[x_m, y_m, yaw_rad]: [f64; 3]| Estimate { x_m, y_m, yaw_rad };
        let legs: Vec<Leg> = poses[1..]
            .iter()
            .map(|pose| Leg::Straight(estimate(*pose)))
            .collect();
        let mut tolerance = || {
            if round % 2 == 0 {
                return Cylinder::POINT;
            }
            Cylinder::new(
                size * random.log_within(1e-6, 0.5),
                random.log_within(1e-6, 1.0),
            )
            .unwrap()
        };
        let within = PathTolerance {
            start: tolerance(),
            end: tolerance(),
        };
        let drift = BoundedDriveModel {
            k_turn: random.log_within(1e-4, 0.1),
            k_drift: random.log_within(1e-4, 0.1),
            k_slip: random.log_within(1e-4, 0.1),
        };
        let Ok(update) = MotionUpdate::bounded(&estimate(poses[0]), &legs, &drift, within) else {
            continue;
        };
        let before =
            Cylinder::new(random.log_within(1e-6, 1.0), random.log_within(1e-7, 0.5)).unwrap();
        let Some(after) = update.after(&PoseErrorSet::bounded(before)) else {
            continue;
        };
        let units = &Exact::pi() * &Exact::dyadic(1, 31);
        let given = |pose: Pose| {
            let length = |um: i32| Exact::int(um).div(&metre);
            let yaw = &Exact::int(pose.yaw.signed()) * &units;
            [length(pose.x_um), length(pose.y_um), yaw]
        };
        let mut exact: Vec<[Exact; 3]> = poses.iter().map(|pose| pose.map(Exact::float)).collect();
        // The set after the path is about the rounded end.
        let rounding = {
            let [to, exact] = [given(update.to()), exact[count].clone()];
            let [dx, dy] = [&to[0] - &exact[0], &to[1] - &exact[1]];
            [
                (&(&dx * &dx) + &(&dy * &dy)).sqrt(),
                turned(&(&to[2] - &exact[2])),
            ]
        };
        exact[0] = given(update.from());
        let check = |searches: &mut [Search], path: &[[Exact; 3]]| {
            let [length, turning] = driven(path);
            let k = Exact::float;
            let own = Exact::int(before.yaw_q24()).div(&radian);
            let alpha = &(&own + &(&k(drift.k_turn) * &turning)) + &(&k(drift.k_drift) * &length);
            let half = &alpha.clone().min(Exact::pi()) * &Exact::dyadic(1, 1);
            let [_, sin] = half.cos_sin();
            let added = &(&k(drift.k_slip) * &length) + &(&(&length + &length) * &sin);
            let rho = &Exact::int(before.translation_um()) + &(&(&added + &rounding[0]) * &metre);
            searches[0].case(after.certain.translation_um().into(), rho.to_f64());
            let limited = (&alpha + &rounding[1]).min(Exact::pi());
            searches[1].case(
                after.certain.yaw_q24().into(),
                (&limited * &radian).to_f64(),
            );
        };
        let off = |pose: &[Exact; 3], by: Cylinder, [angle, sign]: [f64; 2]| {
            let um = f64::from(by.translation_um()) * (1.0 - 1e-14);
            let [dx, dy] = [angle.cos(), angle.sin()].map(|v| Exact::float(v * um).div(&metre));
            let turn = &Exact::int(by.yaw_q24()).div(&radian) * &Exact::float(sign);
            [&pose[0] + &dx, &pose[1] + &dy, &pose[2] + &turn]
        };
        for _ in 0..4 {
            let mut path = exact.clone();
            path[0] = off(
                &exact[0],
                within.start,
                [random.within(-4.0, 4.0), random.sign()],
            );
            path[count] = off(
                &exact[count],
                within.end,
                [random.within(-4.0, 4.0), random.sign()],
            );
            check(&mut searches[..2], &path);
        }
        // A start as a controller compares it.
        let mut start = update.from();
        let um = f64::from(within.start.translation_um());
        let angle = random.within(-4.0, 4.0);
        start.x_um += (um * angle.cos()) as i32;
        start.y_um += (um * angle.sin()) as i32;
        if update.begins_at(start, Cylinder::POINT) {
            let mut path = exact.clone();
            path[0] = given(start);
            check(&mut searches[2..], &path);
        }
    }
    for (search, name) in searches.iter().zip([
        "task: the bounded update of a path, place",
        "task: the bounded update of a path, heading",
        "task: the bounded update from an accepted start, place",
        "task: the bounded update from an accepted start, heading",
    ]) {
        search.report(&Row {
            name,
            unit: "um, 2^-24 turn",
            looseness: None,
        });
    }
}
