//! Converts verdicts to metres, radians and factors, and says which reasons are of an estimate alone.

use posegate::contain::Margin;
use posegate::gate::Reason;
use posegate::pose::Pose;

/// Returns a margin as a factor. Exact.
#[must_use]
pub fn factor(margin: Margin) -> f64 {
    f64::from(margin.q16()) / 65536.0
}

/// Returns a margin with three decimals, rounded down: the printed margin is still proven, and a
/// denial never reads 1.000.
#[must_use]
pub fn factor_text(margin: Margin) -> String {
    format!("{:.3}", libm::floor(factor(margin) * 1e3) * 1e-3)
}

/// Returns a pose as `[m, m, rad]`, yaw in `[-pi, pi)`.
#[must_use]
pub fn coordinates(pose: Pose) -> [f64; 3] {
    [
        f64::from(pose.x_um) / 1e6,
        f64::from(pose.y_um) / 1e6,
        f64::from(pose.yaw.signed()) * (core::f64::consts::TAU / 4_294_967_296.0),
    ]
}

/// Returns `true` if a reason of a gate's step may come from its memory, and not from the estimate. (Staleness is
/// included: the gate's clock may not advance if a time is missing.)
#[must_use]
pub const fn remembers(reason: Reason) -> bool {
    !matches!(
        reason,
        Reason::NotContained
            | Reason::PoseSetTooLarge
            | Reason::OutsideTable
            | Reason::EstimateNotFinite
            | Reason::EstimateOutOfRange
            | Reason::CovarianceNotFinite
            | Reason::CovarianceZero
            | Reason::CovarianceNotSymmetric
            | Reason::CovarianceNotPositiveDefinite
            | Reason::CovarianceTooLarge
            | Reason::CovarianceUnknown
            | Reason::BoundInvalid
            | Reason::OrientationInvalid
            | Reason::Tilted
            | Reason::FrameMismatch
            | Reason::SourceUnknown
            | Reason::TagPosesAmbiguous
            | Reason::CornersDoNotFit
            | Reason::TooFewCorners
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use posegate::num::BinaryAngle;

    #[test]
    fn margin_of_a_denial_is_printed_below_one() {
        assert_eq!(factor_text(Margin::from_q16(65_535)), "0.999");
        assert_eq!(factor_text(Margin::ONE), "1.000");
        assert_eq!(factor(Margin::from_q16(1 << 17)), 2.0);
    }

    #[test]
    fn poses_are_converted_to_metres_and_radians() {
        let pose = Pose {
            x_um: -1_500_000,
            y_um: 20_000,
            yaw: BinaryAngle(3 << 30),
        };
        assert_eq!(
            coordinates(pose),
            [-1.5, 0.02, -core::f64::consts::FRAC_PI_2]
        );
    }
}
