//! Compares the integers with the floats of `model`: never smaller, and only slightly larger.

use super::*;
use crate::set::{Estimate, RadiusSquared};
use nalgebra::{Matrix3, Vector3};
use proptest::prelude::*;

const Q24: f64 = 16_777_216.0 / core::f64::consts::TAU;

/// chi-square, 0.99 at 3 degrees of freedom, as in the gate.
fn radius() -> RadiusSquared {
    RadiusSquared::from_q16(743_499).unwrap()
}

fn estimate([x_m, y_m, yaw_rad]: [f64; 3]) -> Estimate {
    Estimate { x_m, y_m, yaw_rad }
}

/// Returns the covariance times the squared radius that a factor represents, metres and radians.
fn square_of(factor: &crate::set::SqrtFactor) -> Matrix3<f64> {
    let [x, y] = [factor.x_um(), factor.y_um()].map(|row| row.map(|v| f64::from(v) * 1e-6));
    let f = Matrix3::new(
        x[0],
        x[1],
        x[2],
        y[0],
        y[1],
        y[2], //
        f64::from(factor.yaw_q24()) / Q24,
        0.0,
        0.0,
    );
    f * f.transpose()
}

/// Returns the least eigenvalue of `larger - smaller`, in units in which `larger` is about 1.
fn least_excess(larger: &Matrix3<f64>, smaller: &Matrix3<f64>) -> f64 {
    let scale = Vector3::from_fn(|k, _| 1.0 / larger[(k, k)].sqrt());
    let scale = Matrix3::from_diagonal(&scale);
    let difference = scale * (larger - smaller) * scale;
    difference.symmetric_eigen().eigenvalues.min()
}

fn legs(places: &[[f64; 3]], arcs: u32) -> Vec<Leg> {
    let leg = |(k, place): (usize, &[f64; 3])| {
        if arcs >> k & 1 == 0 {
            Leg::Straight(estimate(*place))
        } else {
            Leg::Arc {
                x_m: place[0],
                y_m: place[1],
            }
        }
    };
    places.iter().enumerate().map(leg).collect()
}

/// Returns a path that misses its end.
fn ended(path: &[Leg], left: f64, missed: [f64; 3]) -> Vec<Leg> {
    let mut path = path.to_vec();
    if let Some(Leg::Straight(to)) = path.last_mut() {
        to.x_m += 0.7 * left * missed[0];
        to.y_m += 0.7 * left * missed[1];
        to.yaw_rad += 0.5 * left * missed[2];
    }
    path
}

fn place() -> impl Strategy<Value = [f64; 3]> {
    [-3.0f64..3.0, -3.0f64..3.0, -3.0f64..3.0]
}

fn covariance() -> impl Strategy<Value = Matrix3<f64>> {
    let entry = -1.0f64..1.0;
    (
        proptest::array::uniform9(entry),
        0.001f64..0.3,
        0.0005f64..0.1,
    )
        .prop_map(|(entries, place, yaw)| {
            let size = Matrix3::from_diagonal(&Vector3::new(place, place, yaw));
            let root = size * (Matrix3::from_row_slice(&entries) + Matrix3::identity() * 0.2);
            root * root.transpose() + size * size * 0.01
        })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(crate::test_iterations(2_000, 8)))]

    /// From any start within the tolerance, and along the path itself.
    #[test]
    fn gaussian_growth_dominates(
        covariance in covariance(),
        from in place(),
        to in prop::collection::vec(place(), 1..4),
        arcs in 0u32..8,
        gains in prop_oneof![Just([0.0; 4]), proptest::array::uniform4(0.0f64..0.005)],
        reach in (prop_oneof![Just(0.0), 0.0f64..1.5], 0.0f64..0.3),
        left in prop_oneof![Just(0.0), 0.0f64..0.4],
        off in proptest::array::uniform3(-1.0f64..1.0),
        missed in proptest::array::uniform3(-1.0f64..1.0),
    ) {
        let odometry = Odometry { a1: gains[0], a2: gains[1], a3: gains[2], a4: gains[3] };
        let path = legs(&to, arcs);
        // A path is measured from its rounded start.
        let unit = core::f64::consts::TAU / 4_294_967_296.0;
        let from = [(from[0] * 1e6).round() / 1e6, (from[1] * 1e6).round() / 1e6, (from[2] / unit).round() * unit];
        let start = Cylinder::new(reach.0, if reach.0 > 0.0 { reach.1 } else { 0.0 }).unwrap();
        let within = PathTolerance { start, end: Cylinder::new(left, 0.5 * left).unwrap() };
        let growth = MotionUpdate::gaussian(
            &estimate(from), &path, &odometry, within, radius(), Risk::from_confidence(0.99).unwrap(),
        );
        // Arcs that are nearly full circles are kilometres long.
        let way = travel(&estimate(from), &path, &Ends { start: [reach.0, 0.0], ..Ends::default() }).length_m;
        prop_assume!(way < 60.0);
        let growth = growth.unwrap();
        let before = PoseErrorSet::gaussian(covariance.into(), radius(), Risk::NONE).unwrap();
        let r2 = f64::from(radius().q16()) / 65_536.0;
        let Some(after) = growth.after(&before) else {
            // Out of range: more than 268 m.
            let exact = odometry.grow(covariance, &estimate(from), &path) * r2;
            prop_assert!(exact.trace() > 1e4 || reach.0 > 0.0 || left > 0.0);
            return Ok(());
        };
        // Start off the path's start, unless the first leg is an arc, which then cannot be driven.
        let away = [off[0] * reach.0 * 0.7, off[1] * reach.0 * 0.7];
        let begun = if arcs & 1 == 0 {
            [from[0] + away[0], from[1] + away[1], from[2] + off[2] * reach.1 * f64::from(reach.0 > 0.0)]
        } else {
            from
        };
        let ended = ended(&path, left, missed);
        let exact = odometry.grow(covariance, &estimate(begun), &ended) * r2;
        let got = square_of(&after.random.unwrap().factor);
        prop_assert!(least_excess(&got, &exact) >= -1e-9, "{got} {exact}");
        if reach.0 == 0.0 && left == 0.0 {
            // The factor's heading is 2^-11 wider, with the driven length as its lever.
            let swung = way * way * 1.3e-3 * r2 * covariance[(2, 2)];
            for k in 0..3 {
                let most = (exact[(k, k)] + swung).sqrt() * 1.002 + 4e-4;
                prop_assert!(got[(k, k)].sqrt() <= most, "{k}: {got} {exact}");
            }
        }
        // The enclosing cylinder: no direction of the plane is longer.
        let cylinder = after.enclosing().unwrap();
        for k in 0..16 {
            let (s, c) = (f64::from(k) * 0.2).sin_cos();
            let along = c * c * got[(0, 0)] + 2.0 * c * s * got[(0, 1)] + s * s * got[(1, 1)];
            prop_assert!(f64::from(cylinder.translation_um()) * 1e-6 >= along.sqrt() - 1e-12);
        }
        let longest = got.fixed_view::<2, 2>(0, 0).into_owned().symmetric_eigen().eigenvalues.max();
        prop_assert!(f64::from(cylinder.translation_um()) * 1e-6 <= longest.sqrt() * (1.0 + 1e-6) + 2e-5);
    }

    /// The bounded model applied to a cylinder, which may be a single pose.
    #[test]
    fn bounded_growth_dominates(
        from in place(),
        to in prop::collection::vec(place(), 1..4),
        gains in proptest::array::uniform3(0.0f64..0.05),
        known in (prop_oneof![Just(0.0), 0.0f64..1.0], 0.0f64..0.5),
        reach in (prop_oneof![Just(0.0), 0.0f64..1.5], 0.0f64..0.3),
        left in prop_oneof![Just(0.0), 0.0f64..0.4],
        off in proptest::array::uniform3(-1.0f64..1.0),
        missed in proptest::array::uniform3(-1.0f64..1.0),
    ) {
        let drift = BoundedDriveModel { k_turn: gains[0], k_drift: gains[1], k_slip: gains[2] };
        let path = legs(&to, 0);
        let start = Cylinder::new(reach.0, reach.1).unwrap();
        let within = PathTolerance { start, end: Cylinder::new(left, 0.5 * left).unwrap() };
        let growth = MotionUpdate::bounded(&estimate(from), &path, &drift, within).unwrap();
        let before = PoseErrorSet::bounded(Cylinder::new(known.0, known.1).unwrap());
        let after = growth.after(&before).unwrap().enclosing().unwrap();
        let got = [f64::from(after.translation_um()) * 1e-6, f64::from(after.yaw_q24()) / Q24];
        let begun = [
            from[0] + off[0] * reach.0 * 0.7,
            from[1] + off[1] * reach.0 * 0.7,
            from[2] + off[2] * reach.1,
        ];
        let exact = |from: [f64; 3], path: &[Leg]| {
            let way = travel(&estimate(from), path, &Ends::default());
            drift.grow(way.length_m, way.turning_rad, [known.0, known.1])
        };
        let least = exact(begun, &ended(&path, left, missed));
        prop_assert!(got[0] >= least[0] - 1e-12 && got[1] >= least[1].min(core::f64::consts::PI) - 1e-12);
        if reach == (0.0, 0.0) && left == 0.0 {
            let exact = exact(from, &path);
            prop_assert!(got[0] <= exact[0] + 1e-4 && got[1] <= exact[1] + 2e-6, "{got:?} {exact:?}");
        }
    }
}

/// A cylinder carried by the odometry model contains every carried error plus every noise.
#[test]
fn both_kinds_of_error_add_up() {
    let odometry = Odometry {
        a1: 0.0,
        a2: 0.0001,
        a3: 0.0004,
        a4: 0.0,
    };
    let from = estimate([0.0, 0.0, 0.0]);
    let path = [Leg::Straight(estimate([2.0, 0.0, 0.0]))];
    let risk = Risk::from_confidence(0.99).unwrap();
    let growth = MotionUpdate::gaussian(
        &from,
        &path,
        &odometry,
        PathTolerance::default(),
        radius(),
        risk,
    )
    .unwrap();
    let before = PoseErrorSet::bounded(Cylinder::new(0.05, 0.1).unwrap());
    let after = growth.after(&before).unwrap();
    assert_eq!(after.risk(), risk);
    // 0.05 + 2 * 2 sin(0.05), and r (0.04, sqrt(2) 0.02).
    let certain = 0.05 + 4.0 * 0.05f64.sin();
    assert!((f64::from(after.certain.translation_um()) * 1e-6 - certain).abs() < 4e-6);
    let r = 11.3449f64.sqrt();
    let all = after.enclosing().unwrap();
    let longest = odometry.noise(&from, &path, &Ends::default());
    let longest = longest
        .fixed_view::<2, 2>(0, 0)
        .into_owned()
        .symmetric_eigen()
        .eigenvalues
        .max()
        .sqrt();
    assert!((f64::from(all.translation_um()) * 1e-6 - certain - r * longest).abs() < 3e-4);
    // After the bounded model everything is in the cylinder, with the same risk.
    let drift = BoundedDriveModel {
        k_turn: 0.0,
        k_drift: 0.0,
        k_slip: 0.0,
    };
    let still = [Leg::Straight(from)];
    let stand = MotionUpdate::bounded(&from, &still, &drift, PathTolerance::default()).unwrap();
    let last = stand.after(&after).unwrap();
    assert_eq!((last.random, last.risk()), (None, risk));
    assert!(last.certain.holds(all));
}

#[test]
fn start_outside_its_tolerance_is_refused() {
    let drift = BoundedDriveModel {
        k_turn: 0.0,
        k_drift: 0.0,
        k_slip: 0.0,
    };
    let within = PathTolerance {
        start: Cylinder::new(0.5, 0.1).unwrap(),
        end: Cylinder::POINT,
    };
    let path = [Leg::Straight(estimate([2.0, 0.0, 0.0]))];
    let growth = MotionUpdate::bounded(&estimate([0.0; 3]), &path, &drift, within).unwrap();
    let at = |place| crate::set::pose_of(estimate(place)).unwrap();
    let spread = |m, rad| Cylinder::new(m, rad).unwrap();
    assert!(growth.begins_at(at([0.3, 0.4, 0.0]), Cylinder::POINT));
    assert!(!growth.begins_at(at([0.3, 0.401, 0.0]), Cylinder::POINT));
    assert!(growth.begins_at(at([0.3, 0.0, 0.05]), spread(0.199, 0.049)));
    assert!(!growth.begins_at(at([0.3, 0.0, 0.05]), spread(0.2, 0.051)));
    assert!(!growth.begins_at(at([0.3, 0.0, 0.0]), spread(0.201, 0.0)));
    assert!(!growth.begins_at(at([0.0, 0.0, -0.2]), Cylinder::POINT));
}

#[test]
fn negative_gains_are_refused() {
    let drift = BoundedDriveModel {
        k_turn: 0.0,
        k_drift: -0.1,
        k_slip: 0.0,
    };
    let from = estimate([0.0; 3]);
    let path = [Leg::Straight(from)];
    let none = MotionUpdate::bounded(&from, &[], &drift, PathTolerance::default());
    assert!(none.is_err());
    assert_eq!(
        MotionUpdate::bounded(&from, &path, &drift, PathTolerance::default()),
        Err(GrowthError::Model(ModelError("k_drift")))
    );
    let odometry = Odometry {
        a1: 0.0,
        a2: 0.0,
        a3: f64::NAN,
        a4: 0.0,
    };
    let growth = MotionUpdate::gaussian(
        &from,
        &path,
        &odometry,
        PathTolerance::default(),
        radius(),
        Risk::NONE,
    );
    assert_eq!(growth, Err(GrowthError::Model(ModelError("a3"))));
}

#[test]
fn risks_are_rounded_up() {
    let chance =
        |epsilon| f64::from(Risk::from_confidence(epsilon).unwrap().q32()) / 4_294_967_296.0;
    for epsilon in [0.5, 0.9, 0.99, 0.999, 1e-9, 1.0 - 1e-12] {
        let got = chance(epsilon);
        assert!(
            got >= 1.0 - epsilon && got <= 1.0 - epsilon + 6e-10,
            "{epsilon}: {got}"
        );
    }
    assert_eq!(Risk::from_confidence(1.0), Some(Risk::NONE));
    for bad in [0.0, -0.5, 1.0 + 1e-9, f64::NAN, f64::INFINITY] {
        assert_eq!(Risk::from_confidence(bad), None, "{bad}");
    }
}

/// An arc: its length and its angle, and the heading that it ends with.
#[test]
fn arcs_are_tangent() {
    // A quarter circle of a metre to the left.
    let (motion, end) = Leg::Arc { x_m: 1.0, y_m: 1.0 }.motion(&estimate([0.0; 3]));
    assert!((motion.length - core::f64::consts::FRAC_PI_2).abs() < 1e-12);
    assert!((motion.rot1 + motion.rot2 - core::f64::consts::FRAC_PI_2).abs() < 1e-12);
    assert!((end.yaw_rad - core::f64::consts::FRAC_PI_2).abs() < 1e-12);
    let (straight, end) = Leg::Arc { x_m: 2.0, y_m: 0.0 }.motion(&estimate([0.0; 3]));
    assert_eq!(
        (straight.length, straight.rot1, end.yaw_rad),
        (2.0, 0.0, 0.0)
    );
}

#[test]
fn turn_in_place_keeps_the_robots_direction() {
    for k in -1000..=1000 {
        let yaw = f64::from(k) * core::f64::consts::PI / 1000.0;
        let here = estimate([1.0, 2.0, yaw]);
        let (motion, _) = Leg::Straight(estimate([1.0, 2.0, 0.3])).motion(&here);
        let off = libm::hypot(motion.ahead[0] - yaw.cos(), motion.ahead[1] - yaw.sin());
        assert!(off < 2e-14, "{yaw}: {off}");
        assert_eq!((motion.rot1, motion.length), (0.0, 0.0));
    }
}
