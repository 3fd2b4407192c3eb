use super::*;
use crate::set::{CrossTerms, Extent, Inflation, SplitWeight};
use core::f64::consts::TAU;
use nalgebra::{Matrix3, Matrix6, SymmetricEigen};
use proptest::prelude::*;

const R2: RadiusSquared = RadiusSquared::LARGEST;

/// Generates a positive definite matrix of (x, y, yaw).
fn covariances() -> impl Strategy<Value = [[f64; 3]; 3]> {
    proptest::array::uniform9(-1.0f64..1.0).prop_map(|numbers| {
        let root = Matrix3::from_row_slice(&numbers).map(|v| 0.1 * v) + Matrix3::identity() * 0.15;
        (root * root.transpose() + Matrix3::identity() * 1e-3).into()
    })
}

/// Returns the 36 numbers of ROS. Every entry that must not count has a value that would change the result.
fn spread_over_ros([[xx, xy, xt], [yx, yy, yt], [tx, ty, tt]]: [[f64; 3]; 3]) -> [f64; 36] {
    let mut all = [777.0; 36];
    for (index, value) in [
        (0, xx),
        (1, xy),
        (5, xt),
        (6, yx),
        (7, yy),
        (11, yt),
        (30, tx),
        (31, ty),
        (35, tt),
    ] {
        all[index] = value;
    }
    all
}

/// Returns the 21 numbers of MAVLink in the same way.
fn spread_over_mavlink([[xx, xy, xt], [_, yy, yt], [_, _, tt]]: [[f64; 3]; 3]) -> [f32; 21] {
    let mut all = [777.0; 21];
    for (index, value) in [(0, xx), (1, xy), (5, xt), (6, yy), (10, yt), (20, tt)] {
        all[index] = value as f32;
    }
    all
}

/// Returns the least excess of the set of a covariance with unknown terms over the set of the true ones,
/// in units of the true reach. It is negative if the set does not cover the true one. `None` if the
/// covariance is refused.
fn least_beyond(covariance: [[f64; 3]; 3], cross_terms: CrossTerms) -> Option<f64> {
    let estimate = Estimate {
        x_m: 0.0,
        y_m: 0.0,
        yaw_rad: 0.0,
    };
    let [[xx, xy, _], [_, yy, _], [_, _, tt]] = covariance;
    let given = match cross_terms {
        CrossTerms::AllUnknown(_) => [[xx, 9.0, 9.0], [9.0, yy, 9.0], [9.0, 9.0, tt]],
        _ => [[xx, xy, 9.0], [xy, yy, -9.0], [1.0, 2.0, tt]],
    };
    let trust = Trust {
        cross_terms,
        ..Trust::FULL
    };
    let belief = PoseEstimate::new(estimate, Uncertainty::Gaussian(given));
    let set = belief.pose_set(R2, trust).ok()?;
    let Extent::Gaussian(factor) = set.extent() else {
        unreachable!()
    };
    let [x, y] = [factor.x, factor.y].map(|row| row.map(f64::from));
    let yaw = f64::from(factor.yaw);
    let f = Matrix3::new(x[0], x[1], x[2], y[0], y[1], y[2], yaw, 0.0, 0.0);
    let r2 = f64::from(R2.q16()) / 65536.0;
    let q24 = 2f64.powi(24) / TAU;
    let units = Matrix3::from_diagonal(&nalgebra::Vector3::new(1e6, 1e6, q24));
    let truth = units * Matrix3::from(covariance) * units * r2;
    // In units of the true diagonal, so that small directions count.
    let scale = Matrix3::from_diagonal(&truth.diagonal().map(|v| 1.0 / v.sqrt()));
    let more = scale * (f * f.transpose() - truth) * scale;
    Some(SymmetricEigen::new(more).eigenvalues.min())
}

/// The hardest true covariance is a line: x, y and yaw are fully correlated, with either sign.
#[test]
fn every_split_weight_covers_correlated_terms() {
    for share in 1..=u8::MAX {
        let cross_terms = CrossTerms::AllUnknown(SplitWeight::from_q8(share).unwrap());
        for signs in [[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]] {
            let [x, y, yaw] = [0.05, 0.05 * signs[0], 0.05 * signs[1]];
            let line = [x, y, yaw].map(|a| [x, y, yaw].map(|b| a * b));
            let least = least_beyond(line, cross_terms).unwrap();
            assert!(least >= -1e-9, "{share}: {least}");
        }
    }
}

fn quaternion(yaw: f64) -> [f64; 4] {
    [0.0, 0.0, (yaw / 2.0).sin(), (yaw / 2.0).cos()]
}

proptest! {
    /// Every form gives the same pose-set, except for the last bit of a heading.
    #[test]
    fn all_message_forms_of_one_estimate_give_one_set(
        x in -50.0f32..50.0, y in -50.0f32..50.0, yaw in -3.0f32..3.0, covariance in covariances(),
    ) {
        // Numbers that f32 can represent, and equal upper and lower halves.
        let p = covariance.map(|row| row.map(|v| f64::from(v as f32)));
        let [[xx, xy, xt], [_, yy, yt], [_, _, tt]] = p;
        let p = [[xx, xy, xt], [xy, yy, yt], [xt, yt, tt]];
        let (x_m, y_m, yaw_rad) = (f64::from(x), f64::from(y), f64::from(yaw));
        let plain = PoseEstimate::new(Estimate { x_m, y_m, yaw_rad }, Uncertainty::Gaussian(p));
        let expected = plain.pose_set(R2, Trust::FULL).unwrap();

        let ros = ros::PoseWithCovariance {
            position: [x_m, y_m, f64::NAN],
            orientation: quaternion(yaw_rad),
            covariance: spread_over_ros(p),
        };
        let vision = mavlink::VisionPositionEstimate {
            position: [x, y, f32::NAN],
            angles: [0.0, 0.0, yaw],
            covariance: spread_over_mavlink(p),
        };
        let down = mavlink::VisionPositionEstimate {
            position: [x, -y, 0.0],
            angles: [0.0, 0.0, -yaw],
            covariance: spread_over_mavlink([[xx, -xy, -xt], [-xy, yy, yt], [-xt, yt, tt]]),
        };
        let numbers = [x, y, yaw, xx as f32, xy as f32, xt as f32, yy as f32, yt as f32, tt as f32];
        let six = Matrix6::from_row_slice(&spread_over_ros(p));
        let space = nalgebra::Isometry3::new(
            nalgebra::Vector3::new(x_m, y_m, 9.0), nalgebra::Vector3::z() * yaw_rad,
        );
        let plane = nalgebra::Isometry2::new(nalgebra::Vector2::new(x_m, y_m), yaw_rad);
        for belief in [
            PoseEstimate::from(&ros),
            vision.belief(mavlink::Axes::Up),
            down.belief(mavlink::Axes::Down),
            PoseEstimate::compact(numbers),
            PoseEstimate::from((space, six)),
            PoseEstimate::from((plane, Matrix3::from(p))),
        ] {
            let set = belief.pose_set(R2, Trust::FULL).unwrap();
            prop_assert_eq!(set.extent(), expected.extent());
            let (mean, other) = (set.mean(), expected.mean());
            prop_assert_eq!((mean.x_um, mean.y_um), (other.x_um, other.y_um));
            prop_assert!(mean.yaw.minus(other.yaw).signed().abs() <= 1);
        }
        // Quaternions in f32 resolve a heading to 1e-7 rad.
        for (axes, sign) in [(mavlink::Axes::Up, 1.0), (mavlink::Axes::Down, -1.0)] {
            let [qx, qy, qz, qw] = quaternion(sign * yaw_rad).map(|v| v as f32);
            let odometry = mavlink::Odometry {
                position: [x, sign as f32 * y, 0.0],
                q: [qw, qx, qy, qz],
                pose_covariance: spread_over_mavlink(
                    [[xx, sign * xy, sign * xt], [xy, yy, yt], [xt, yt, tt]],
                ),
            };
            let set = odometry.belief(axes).pose_set(R2, Trust::FULL).unwrap();
            prop_assert_eq!(set.extent(), expected.extent());
            let off = set.mean().yaw.minus(expected.mean().yaw).signed();
            prop_assert!(f64::from(off).abs() <= 3e-7 / TAU * 4_294_967_296.0, "{off}");
        }
    }

    /// For all terms between yaw and plane, and between x and y: the set of unknown terms contains that
    /// of the true ones.
    #[test]
    fn unknown_terms_are_covered(covariance in covariances(), share in 1u8..) {
        let share = SplitWeight::from_q8(share).unwrap();
        for cross_terms in [CrossTerms::YawUnknown(share), CrossTerms::AllUnknown(share)] {
            let Some(least) = least_beyond(covariance, cross_terms) else { continue };
            prop_assert!(least >= -1e-9, "{least}");
        }
    }

    /// An inflation multiplies the covariance, to 2^-20 and outwards, and a cylinder's extents by its
    /// root.
    #[test]
    fn inflations_multiply(covariance in covariances(), factor in 1.0f64..4.0) {
        let estimate = Estimate { x_m: 0.0, y_m: 0.0, yaw_rad: 0.0 };
        let inflation = Inflation::new(factor).unwrap();
        let trust = Trust { inflation, ..Trust::FULL };
        let radius = RadiusSquared::from_q16(743_498).unwrap();
        let exact = f64::from(inflation.q16()) / 65536.0;
        prop_assert!(exact >= factor && exact < factor + 2e-5);
        let by_hand = covariance.map(|row| row.map(|v| v * exact));
        let set = |p, trust| PoseEstimate::new(estimate, Uncertainty::Gaussian(p)).pose_set(radius, trust).unwrap();
        let (Extent::Gaussian(got), Extent::Gaussian(expected)) =
            (set(covariance, trust).extent(), set(by_hand, Trust::FULL).extent()) else { unreachable!() };
        // Yaw, and the reach of the set along x and along y.
        let reach = |row: [i32; 3]| row.map(f64::from).iter().map(|v| v * v).sum::<f64>().sqrt();
        for (a, b) in [
            (f64::from(got.yaw), f64::from(expected.yaw)),
            (reach(got.x), reach(expected.x)),
            (reach(got.y), reach(expected.y)),
        ] {
            prop_assert!((a - b).abs() <= 3.0 + 1e-6 * b, "{got:?} {expected:?}");
        }
        let spread = Uncertainty::Bounded { translation_m: 0.1, yaw_rad: 0.02 };
        let set = PoseEstimate::new(estimate, spread).pose_set(radius, trust).unwrap();
        let Extent::Bounded { translation_um, yaw_q24 } = set.extent() else { unreachable!() };
        let root = exact.sqrt();
        let beyond = f64::from(translation_um) - 1e5 * root;
        // A unit of the extent, times the root; 2^-16 of it; one more.
        prop_assert!((0.0..=4.6).contains(&beyond), "{beyond}");
        let beyond = f64::from(yaw_q24) - 0.02 / TAU * 2f64.powi(24) * root;
        // A unit of the extent, times the root; 2^-16 of it; one more.
        prop_assert!((0.0..=4.6).contains(&beyond), "{beyond}");
    }

    #[test]
    fn bits_never_panic(bits in proptest::array::uniform12(any::<u64>()), form in 0u8..4, share in 1u8..) {
        let v = bits.map(f64::from_bits);
        let estimate = Estimate { x_m: v[0], y_m: v[1], yaw_rad: v[2] };
        let spread = Uncertainty::Gaussian([[v[3], v[4], v[5]], [v[6], v[7], v[8]], [v[9], v[10], v[11]]]);
        let share = SplitWeight::from_q8(share).unwrap();
        let cross_terms = match form {
            0 => CrossTerms::Filled,
            1 => CrossTerms::YawUnknown(share),
            _ => CrossTerms::AllUnknown(share),
        };
        let trust = Trust { inflation: Inflation::from_q16(1 << 28).unwrap(), cross_terms };
        let _ = PoseEstimate::new(estimate, spread).pose_set(R2, trust);
    }
}

#[test]
fn unknown_covariance_is_invalid() {
    let mut covariance =
        spread_over_mavlink([[1e-4, 0.0, 0.0], [0.0, 1e-4, 0.0], [0.0, 0.0, 1e-4]]);
    let belief = |covariance| {
        mavlink::VisionPositionEstimate {
            position: [0.0; 3],
            angles: [0.0; 3],
            covariance,
        }
        .belief(mavlink::Axes::Down)
        .pose_set(R2, Trust::FULL)
    };
    assert!(belief(covariance).is_ok());
    covariance[0] = f32::NAN;
    assert_eq!(belief(covariance), Err(InputError::CovarianceUnknown));
    covariance[0] = 1e-4;
    covariance[20] = f32::NAN;
    assert_eq!(belief(covariance), Err(InputError::CovarianceNotFinite));
}

/// Each of the nine entries that count is read: a wrong index would read another number.
#[test]
fn every_ros_covariance_entry_is_read_from_its_index() {
    for (index, expected) in [
        (0, InputError::CovarianceNotFinite),
        (1, InputError::CovarianceNotFinite),
        (5, InputError::CovarianceNotFinite),
        (6, InputError::CovarianceNotFinite),
        (7, InputError::CovarianceNotFinite),
        (11, InputError::CovarianceNotFinite),
        (30, InputError::CovarianceNotFinite),
        (31, InputError::CovarianceNotFinite),
        (35, InputError::CovarianceNotFinite),
    ] {
        let mut message = ros::PoseWithCovariance {
            position: [0.0; 3],
            orientation: quaternion(0.3),
            covariance: spread_over_ros([[1e-4, 0.0, 0.0], [0.0, 1e-4, 0.0], [0.0, 0.0, 1e-4]]),
        };
        assert!(
            PoseEstimate::from(&message)
                .pose_set(R2, Trust::FULL)
                .is_ok()
        );
        message.covariance[index] = f64::NAN;
        assert_eq!(
            PoseEstimate::from(&message).pose_set(R2, Trust::FULL),
            Err(expected)
        );
    }
}

#[test]
fn inflation_never_shrinks_the_set() {
    for bad in [
        0.0,
        -1.0,
        0.999,
        4097.0,
        f64::NAN,
        f64::INFINITY,
        f64::NEG_INFINITY,
        f64::MAX,
        f64::MIN_POSITIVE,
    ] {
        assert_eq!(Inflation::new(bad), None, "{bad}");
    }
    assert_eq!(Inflation::new(1.0), Some(Inflation::NONE));
    assert_eq!(Inflation::new(4096.0).unwrap().q16(), 1 << 28);
    assert_eq!(SplitWeight::from_q8(0), None);
}
