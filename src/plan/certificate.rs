//! A proof that one pose-set lies in a success set, without a table: blocks that cover the set are proven inside by
//! outward-rounded intervals ([`crate::certify`]), and halved where they are not.
//!
//! The set is the belief's, in the goal frame, its lengths 6 um and its angles 2^-22 turn wider than the floats say
//! (they err by 1e-9 of that). A block that no pose of the set is in is left out: for a cylinder one whose nearest
//! point is farther than the radius, for an ellipsoid one whose middle, seen in the ellipsoid's own units, is farther
//! than 1 and all that the block reaches.

use nalgebra::{Matrix3, Vector3};

use super::Belief;
use crate::certify::{Block, Prover};
use crate::shape::SuccessSet;
use std::vec;

/// Blocks that are looked at before a proof is given up.
const MOST_BLOCKS: u32 = 6_000;

/// Metres.
const WIDER_M: f64 = 6e-6;
/// Radians: 2^-22 turn.
const WIDER_RAD: f64 = 1.5e-6;

/// A pose-set in a goal frame.
enum Body {
    Cylinder {
        centre: [f64; 3],
        radius: f64,
        yaw: f64,
    },
    Ellipsoid {
        centre: [f64; 3],
        half: [f64; 3],
        /// Takes offsets to the unit ball.
        whitened: Matrix3<f64>,
    },
}

/// Whether the set of a belief, `scale` times as large, is proven to lie in a success set. `false` means not proven.
pub(super) fn is_certain(
    prover: &Prover,
    success: &SuccessSet,
    belief: &Belief,
    scale: f64,
) -> bool {
    let Some(body) = Body::of(success, belief, scale) else {
        return false;
    };
    let (centre, half) = body.bounds();
    let mut open = vec![(centre, half)];
    let mut seen = 0;
    while let Some((middle, half)) = open.pop() {
        if body.misses(middle, half) {
            continue;
        }
        seen += 1;
        if seen > MOST_BLOCKS {
            return false;
        }
        // Wide blocks are halved unseen: a prover takes less than a quarter of a turn.
        let narrow = half[2] < 0.35;
        if narrow && prover.is_inside(&block(middle, half)) {
            continue;
        }
        let (_, whole) = body.bounds();
        let share = |axis: usize| half[axis] / whole[axis].max(1e-9);
        // A pose of the set that is outside settles it.
        if narrow && share(0).max(share(1)) < 0.004 {
            return false;
        }
        let axis = if !narrow {
            2
        } else if share(0) >= share(1) && 2.0 * share(0) >= share(2) {
            0
        } else if 2.0 * share(1) >= share(2) {
            1
        } else {
            2
        };
        for sign in [-0.5, 0.5] {
            let (mut at, mut size) = (middle, half);
            at[axis] += sign * half[axis];
            size[axis] *= 0.5;
            open.push((at, size));
        }
    }
    true
}

impl Body {
    fn of(success: &SuccessSet, belief: &Belief, scale: f64) -> Option<Self> {
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
            let square = turn
                * random.covariance
                * turn.transpose()
                * random.radius_squared
                * (scale * scale);
            let wider = Vector3::new(WIDER_M, WIDER_M, WIDER_RAD);
            let square = square * (1.0 + 1e-6)
                + Matrix3::from_diagonal(&(wider.component_mul(&wider) * 1e6));
            let factor = square.cholesky()?.l();
            return Some(Self::Ellipsoid {
                centre,
                half: core::array::from_fn(|k| libm::sqrt(square[(k, k)])),
                whitened: factor.try_inverse()?,
            });
        }
        let [rho, alpha] = belief.enclosing();
        Some(Self::Cylinder {
            centre,
            radius: (rho + belief.spread[0]) * scale + WIDER_M,
            yaw: ((alpha + belief.spread[1]) * scale).min(core::f64::consts::PI) + WIDER_RAD,
        })
    }

    fn bounds(&self) -> ([f64; 3], [f64; 3]) {
        match self {
            Self::Cylinder {
                centre,
                radius,
                yaw,
            } => (*centre, [*radius, *radius, *yaw]),
            Self::Ellipsoid { centre, half, .. } => (*centre, *half),
        }
    }

    /// Whether no pose of the set is in a block. `false` where that is not sure.
    fn misses(&self, middle: [f64; 3], half: [f64; 3]) -> bool {
        let off =
            |centre: &[f64; 3]| -> [f64; 3] { core::array::from_fn(|k| middle[k] - centre[k]) };
        match self {
            Self::Cylinder { centre, radius, .. } => {
                let [dx, dy, _] = off(centre);
                let gap = |d: f64, h: f64| (d.abs() - h).max(0.0);
                libm::hypot(gap(dx, half[0]), gap(dy, half[1])) > radius * (1.0 + 1e-9)
            }
            Self::Ellipsoid {
                centre, whitened, ..
            } => {
                let seen = whitened * Vector3::from(off(centre));
                let reach = whitened.abs() * Vector3::from(half);
                seen.norm() - reach.norm() > 1.0 + 1e-9
            }
        }
    }
}

/// A block in the core's units, outwards.
fn block(middle: [f64; 3], half: [f64; 3]) -> Block {
    let um = |axis: usize| {
        [
            libm::floor((middle[axis] - half[axis]) * 1e6) as i64,
            libm::ceil((middle[axis] + half[axis]) * 1e6) as i64,
        ]
    };
    let units = 4_294_967_296.0 / core::f64::consts::TAU;
    Block {
        x_um: um(0),
        y_um: um(1),
        yaw: [
            libm::floor((middle[2] - half[2]) * units) as i64,
            libm::ceil((middle[2] + half[2]) * units) as i64,
        ],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::{BoxSet, PoseDeg, Shape};
    use crate::site::Known;

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

    fn at(x: f64, y: f64, yaw: f64, known: &Known) -> Belief {
        let (s, c) = 170f64.to_radians().sin_cos();
        let pose = [
            12.0 + c * x - s * y,
            -3.0 + s * x + c * y,
            170f64.to_radians() + yaw,
        ];
        Belief::at_start(pose, crate::shape::Tolerance::NONE, known)
    }

    #[test]
    fn cylinders_fit_to_the_border() {
        let (set, prover) = (dock(), Prover::new(&dock()));
        let known = Known::Bounded {
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
    fn ellipsoids_fit_to_the_border() {
        let (set, prover) = (dock(), Prover::new(&dock()));
        let r = libm::sqrt(crate::confidence::radius_squared(0.99).unwrap());
        // Long across the goal's x axis, turned with it.
        let (s, c) = 170f64.to_radians().sin_cos();
        let (a, b) = ((0.1 / r).powi(2), (0.03 / r).powi(2));
        let known = Known::Gaussian {
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
