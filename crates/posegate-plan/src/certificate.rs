//! A proof that one pose-set lies in a success set, without a table.
//!
//! The set is the belief's set in the goal frame. Its lengths are 6 um and its angles 2^-22 turn wider than the
//! floats. The error of the floats is 1e-9 of these margins.

use nalgebra::{Matrix3, Vector3};

use super::BeliefStateF64;
use posegate::certify::{Body, ProofBudget, Prover};
use posegate::shape::SuccessSet;

const BUDGET: ProofBudget = ProofBudget {
    blocks: 6_000,
    smallest: 0.004,
};

/// Metres.
const WIDER_M: f64 = 6e-6;
/// Radians: 2^-22 turn.
const WIDER_RAD: f64 = 1.5e-6;

/// Returns `true` if the set of a belief, scaled by `scale`, is proven to lie in a success set. `false` means not
/// proven.
pub(super) fn is_certain(
    prover: &Prover,
    success: &SuccessSet,
    belief: &BeliefStateF64,
    scale: f64,
) -> bool {
    body(success, belief, scale).is_some_and(|body| body.is_within(prover, BUDGET))
}

fn body(success: &SuccessSet, belief: &BeliefStateF64, scale: f64) -> Option<Body> {
    let centre = success.to_goal(belief.pose);
    let numbers = centre.iter().chain(&belief.certain).chain(&belief.spread);
    if !(scale.is_finite() && numbers.into_iter().all(|v| v.is_finite())) {
        return None;
    }
    if let Some(random) = &belief.random
        && belief.certain == [0.0, 0.0]
        && belief.spread == [0.0, 0.0]
    {
        let (s, c) = {
            let turn = -success.goal.yaw_deg.to_radians();
            (libm::sin(turn), libm::cos(turn))
        };
        let turn = Matrix3::new(c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0);
        let square =
            turn * random.covariance * turn.transpose() * random.radius_squared * (scale * scale);
        let wider = Vector3::new(WIDER_M, WIDER_M, WIDER_RAD);
        let square =
            square * (1.0 + 1e-6) + Matrix3::from_diagonal(&(wider.component_mul(&wider) * 1e6));
        return Body::ellipsoid(centre, square);
    }
    let [rho, alpha] = belief.enclosing();
    Some(Body::cylinder(
        centre,
        (rho + belief.spread[0]) * scale + WIDER_M,
        ((alpha + belief.spread[1]) * scale).min(core::f64::consts::PI) + WIDER_RAD,
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use posegate::shape::{BoxSet, PoseDeg, Shape};
    use posegate_site::StartUncertainty;

    fn dock() -> SuccessSet {
        SuccessSet {
            goal: PoseDeg {
                x: 12.0,
                y: -3.0,
                yaw_deg: 170.0,
            },
            shape: Shape::Box(BoxSet {
                x: [-0.2, 0.2],
                y: [-0.1, 0.1],
                yaw_deg: [-20.0, 20.0],
            }),
        }
    }

    fn at(x: f64, y: f64, yaw: f64, known: &StartUncertainty) -> BeliefStateF64 {
        let (s, c) = 170f64.to_radians().sin_cos();
        let pose = [
            12.0 + c * x - s * y,
            -3.0 + s * x + c * y,
            170f64.to_radians() + yaw,
        ];
        BeliefStateF64::at_start(pose, posegate::shape::Tolerance::NONE, known)
    }

    #[test]
    fn cylinder_that_touches_the_border_is_proven() {
        let (set, prover) = (dock(), Prover::new(&dock()));
        let known = StartUncertainty::Bounded {
            translation: 0.05,
            yaw_deg: 10.0,
        };
        let fits = |x, y, yaw| is_certain(&prover, &set, &at(x, y, yaw, &known), 1.0);
        assert!(fits(0.1499, 0.0499, 0.174));
        assert!(!fits(0.1501, 0.0, 0.0));
        assert!(!fits(0.0, 0.0501, 0.0));
        assert!(!fits(0.0, 0.0, 0.175));
        let scaled = |scale| is_certain(&prover, &set, &at(0.0, 0.0, 0.0, &known), scale);
        assert!(scaled(1.99) && !scaled(2.01));
    }

    #[test]
    fn ellipsoid_that_touches_the_border_is_proven() {
        let (set, prover) = (dock(), Prover::new(&dock()));
        let r = libm::sqrt(posegate::confidence::radius_squared(0.99).unwrap());
        // Long across the goal's x axis, turned with it.
        let (s, c) = 170f64.to_radians().sin_cos();
        let (a, b) = ((0.1 / r).powi(2), (0.03 / r).powi(2));
        let known = StartUncertainty::Gaussian {
            covariance: [
                [c * c * a + s * s * b, c * s * (a - b), 0.0],
                [c * s * (a - b), s * s * a + c * c * b, 0.0],
                [0.0, 0.0, (0.1 / r).powi(2)],
            ],
            epsilon: 0.99,
        };
        let fits = |x, y, yaw| is_certain(&prover, &set, &at(x, y, yaw, &known), 1.0);
        assert!(fits(0.098, 0.068, 0.24));
        assert!(!fits(0.1005, 0.0, 0.0));
        assert!(!fits(0.0, 0.0705, 0.0));
        assert!(!fits(0.0, 0.0, 0.2495));
    }
}
