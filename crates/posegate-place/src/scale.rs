//! The largest scale s* at which a success set contains a Gaussian pose-set, that is, its radius times s*. It is 0 if
//! the estimate is outside, and infinite if the scaled set never leaves the success set.

use super::gaussian::{Gaussian, WhitenedPoseSet};
use core::f64::consts::TAU;
use nalgebra::Matrix3;
use posegate::certify::{Body, ProofBudget, Prover};
use posegate::shape::{Headed, LineClipper, LineSegment, OPEN, SuccessSet};

/// The resolution at which the border is searched.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Fineness {
    /// The number of headings, on each side of the middle.
    headings: u32,
    /// The number of directions at each heading.
    directions: u32,
    /// The number of steps of each search between them.
    steps: u32,
}

impl Fineness {
    /// For a search: accurate to some 1e-5.
    pub(super) const CLOSE: Self = Self {
        headings: 16,
        directions: 48,
        steps: 18,
    };
    /// For an answer: accurate to about 1e-6.
    pub(super) const FINE: Self = Self {
        headings: 40,
        directions: 96,
        steps: 30,
    };
}

/// Returns an upper estimate of the largest scale: the distance of the border in the directions tried. Returns 0 if the
/// goal itself is outside, and infinity if no direction leaves the set.
pub(super) fn largest(set: &SuccessSet, belief: &Gaussian, fineness: Fineness) -> f64 {
    let along = LineClipper::of(set);
    let white = belief.at(set.goal);
    let reach = |u1: f64, within: f64| {
        let headed = along.at(white.yaw * u1);
        let radius = border_distance(&headed, &white, u1, within, fineness);
        libm::sqrt(u1 * u1 + radius * radius)
    };
    // At heading u1 every scale is at least |u1|, so headings beyond the best scale are skipped. A scaled yaw extent
    // is limited to pi.
    let most = core::f64::consts::PI / white.yaw;
    let mut best = reach(0.0, f64::INFINITY);
    if best == 0.0 {
        return 0.0;
    }
    let mut found: Option<(f64, f64)> = None;
    let span = best.min(most);
    let step = span / f64::from(fineness.headings);
    for k in 1..=fineness.headings {
        for side in [-1.0, 1.0] {
            let u1 = side * f64::from(k) * step;
            if u1.abs() < best {
                let scale = reach(u1, best);
                if scale < best {
                    (best, found) = (scale, Some((u1, step)));
                }
            }
        }
    }
    // The set ends abruptly at the end of a yaw arc.
    for end in along.ends_of_arcs() {
        for turn in [-1.0, 0.0, 1.0] {
            let u1 = (end + TAU * turn) / white.yaw;
            for offset in [-1e-9, 1e-9] {
                let u1 = u1 + offset / white.yaw;
                if u1.abs() < best.min(most) {
                    best = best.min(reach(u1, best));
                }
            }
        }
    }
    let (at, step) = found.unwrap_or((0.0, step));
    let refined = golden(at - step, at + step, fineness.steps, |u1| {
        if u1.abs() < best.min(most) {
            reach(u1, f64::INFINITY)
        } else {
            f64::INFINITY
        }
    });
    best.min(refined) / white.radius
}

/// Returns the distance of the centre of a heading's disc from the border, in standard deviations; 0 if it is outside.
fn border_distance(
    headed: &Headed<'_>,
    white: &WhitenedPoseSet,
    u1: f64,
    within: f64,
    fineness: Fineness,
) -> f64 {
    // No useful pose-set is larger than this.
    let length = 1e4
        / white
            .to_metres([1.0, 1.0])
            .map(f64::abs)
            .iter()
            .fold(1e-12, |a, b| f64::max(a, *b));
    let mut stretches = Vec::new();
    let mut leaves = |angle: f64| {
        let walk = LineSegment {
            from: white.middle(u1),
            way: white.to_metres([libm::cos(angle), libm::sin(angle)]),
            length,
        };
        headed.stretches_into(&walk, &mut stretches);
        match stretches.first() {
            Some(first) if first.from <= 0.0 && first.ended_by[1] == OPEN => f64::INFINITY,
            Some(first) if first.from <= 0.0 => first.to,
            _ => 0.0,
        }
    };
    let step = TAU / f64::from(fineness.directions);
    let mut least = [(f64::INFINITY, 0.0); 2];
    for k in 0..fineness.directions {
        let angle = f64::from(k) * step;
        let border = leaves(angle);
        if border < least[0].0 {
            least[1] = least[0];
            least[0] = (border, angle);
        } else if border < least[1].0 {
            least[1] = (border, angle);
        }
        if border == 0.0 {
            return 0.0;
        }
    }
    let mut distance = least[0].0;
    // No refinement is needed if this heading is still far from being the nearest.
    if libm::sqrt(u1 * u1 + 0.8 * distance * distance) > within {
        return distance;
    }
    for (_, angle) in least {
        distance = distance.min(golden(
            angle - step,
            angle + step,
            fineness.steps,
            &mut leaves,
        ));
    }
    distance
}

/// Returns the least value that a golden-section search finds.
fn golden(from: f64, to: f64, steps: u32, mut value: impl FnMut(f64) -> f64) -> f64 {
    const SHARE: f64 = 0.618_033_988_749_894_9;
    let (mut low, mut high) = (from, to);
    let (mut a, mut b) = (high - SHARE * (high - low), low + SHARE * (high - low));
    let (mut at_a, mut at_b) = (value(a), value(b));
    let mut least = at_a.min(at_b);
    for _ in 0..steps {
        if at_a <= at_b {
            (high, b, at_b) = (b, a, at_a);
            a = high - SHARE * (high - low);
            at_a = value(a);
        } else {
            (low, a, at_a) = (a, b, at_b);
            b = low + SHARE * (high - low);
            at_b = value(b);
        }
        least = least.min(at_a).min(at_b);
    }
    least
}

/// The budget of a proof of one scale. If many proofs fail, an answer still takes only seconds.
const BUDGET: ProofBudget = ProofBudget {
    blocks: 150_000,
    smallest: 1e-6,
};

/// From this share of the largest size on, a proof gains less than 1 %. It takes ten times as many blocks for a tenth
/// of the rest.
const CLOSE: f64 = 0.995;

/// The budget of a proof for the last percent.
const CLOSE_BUDGET: ProofBudget = ProofBudget {
    blocks: 20_000,
    smallest: 1e-6,
};

/// The budget of the proof that decides whether a place is contained.
const OWN_BUDGET: ProofBudget = ProofBudget {
    blocks: 400_000,
    smallest: 1e-6,
};

/// Shares of the largest scale for which a proof is tried.
const SHARES: [f64; 5] = [0.8, 0.95, 0.99, 1.0 - 1e-3, 1.0 - 1e-4];

/// A smaller scale is not worth a proof.
const LEAST: f64 = 1e-3;

/// Scales for which a proof is tried if no direction leaves the set.
const LARGE: [f64; 5] = [64.0, 16.0, 4.0, 2.0, 1.0];

/// Returns a proven lower bound of the largest scale: the margin. Returns `None` if the set is proven to contain 64
/// times the pose-set, and no border was found.
///
/// The pose-set is enlarged by 1e-9 of its lengths and by [`WIDER`]. It is then covered with blocks that are proven
/// inside by outward-rounded intervals ([`Body::is_within`]).
pub(super) fn proven(set: &SuccessSet, belief: &Gaussian) -> Option<f64> {
    let largest = largest(set, belief, Fineness::FINE);
    if largest < LEAST {
        return Some(0.0);
    }
    let prover = Prover::new(set);
    let holds = |scale: f64, budget: ProofBudget| {
        body(set, belief, scale).is_some_and(|body| body.is_within(&prover, budget))
    };
    if largest == f64::INFINITY {
        // No direction that was tried leaves the set. Small gaps may be between them.
        let margin = LARGE.into_iter().find(|scale| holds(*scale, BUDGET));
        return match margin {
            Some(scale) if scale == LARGE[0] => None,
            found => Some(found.unwrap_or(0.0)),
        };
    }
    let margin = last_proven(SHARES, |share| {
        let budget = budget(&prover, share, BUDGET);
        holds(share * largest, budget)
    });
    let margin = margin.map_or(0.0, |share| share * largest);
    // Containment at scale 1 justifies a separate proof.
    let is_own = margin < 1.0 && largest > 1.0 && holds(1.0, OWN_BUDGET);
    Some(if is_own { 1.0 } else { margin })
}

/// Returns the budget of a proof of a share of the largest size: blocks take longer than the slices of a convex set.
fn budget(prover: &Prover, share: f64, usual: ProofBudget) -> ProofBudget {
    if share < CLOSE || prover.is_convex() {
        usual
    } else {
        CLOSE_BUDGET
    }
}

/// Returns the last of some shares that is proven; each share is of a larger set than the one before. A failed proof
/// takes all of its budget, and the proof of a smaller set is shorter. So the search starts with the smallest share
/// and ends with the first failure.
pub(super) fn last_proven(
    shares: impl IntoIterator<Item = f64>,
    mut holds: impl FnMut(f64) -> bool,
) -> Option<f64> {
    shares.into_iter().take_while(|share| holds(*share)).last()
}

/// Returns `true` if the set is proven to contain the pose-set, with the budget for a share of the largest tolerance.
pub(super) fn is_contained(set: &SuccessSet, belief: &Gaussian, share: f64) -> bool {
    let prover = Prover::new(set);
    let budget = budget(&prover, share, OWN_BUDGET);
    body(set, belief, 1.0).is_some_and(|body| body.is_within(&prover, budget))
}

/// By how much the pose-set is enlarged for the proof, metres and radians. This is more than the rounding of a box's
/// limits in a proof at positions (1e-11 m), and more than rounding takes from a nearly singular covariance.
const WIDER: f64 = 3e-11;
/// The relative growth of its square for this, 1 / k: `E(P) + E(W)` lies within `E((1 + 1 / k) P + (1 + k) W)`.
const SHARE: f64 = 2e-9;

/// Returns the pose-set in the goal frame, enlarged by [`WIDER`] in every direction.
fn body(set: &SuccessSet, belief: &Gaussian, scale: f64) -> Option<Body> {
    let white = belief.at(set.goal);
    let reach = scale * white.radius;
    let ([a, b], [c, d]) = (white.spread[0], white.spread[1]);
    // The columns are the effects of u1, u2, u3.
    let factor = Matrix3::new(
        white.drift[0],
        a,
        b,
        white.drift[1],
        c,
        d,
        white.yaw,
        0.0,
        0.0,
    ) * reach;
    let square = factor * factor.transpose() * (1.0 + SHARE)
        + Matrix3::from_diagonal_element(WIDER * WIDER * (1.0 + 1.0 / SHARE));
    Body::ellipsoid([0.0; 3], square)
}

#[cfg(test)]
mod tests {
    use super::*;
    use posegate::shape::{BoxSet, PoseDeg, Shape};

    fn boxed(x: f64, y: f64, yaw_deg: f64) -> SuccessSet {
        SuccessSet {
            goal: PoseDeg {
                x: 3.0,
                y: -1.0,
                yaw_deg: 90.0,
            },
            shape: Shape::Box(BoxSet {
                x: [-x, x],
                y: [-y, y],
                yaw_deg: [-yaw_deg, yaw_deg],
            }),
        }
    }

    #[test]
    fn scale_equals_that_of_the_support_function() {
        // An ellipsoid reaches r sqrt(P_kk) along each axis; the goal is turned by a right angle.
        let (s, rho) = ([0.1, 0.2, 0.05], [0.3, -0.2, 0.4]);
        let p = [
            [s[0] * s[0], rho[0] * s[0] * s[1], rho[1] * s[0] * s[2]],
            [rho[0] * s[0] * s[1], s[1] * s[1], rho[2] * s[1] * s[2]],
            [rho[1] * s[0] * s[2], rho[2] * s[1] * s[2], s[2] * s[2]],
        ];
        let belief = Gaussian::new(p, 0.99).unwrap();
        let r = libm::sqrt(posegate::confidence::radius_squared(0.99).unwrap());
        for [x, y, yaw_deg] in [
            [0.5, 9.0, 90.0],
            [9.0, 0.5, 90.0],
            [9.0, 9.0, 8.0],
            [0.7, 0.4, 12.0],
        ] {
            let set = boxed(x, y, yaw_deg);
            let exact = (x / (r * s[1]))
                .min(y / (r * s[0]))
                .min(yaw_deg.to_radians() / (r * s[2]));
            let close = largest(&set, &belief, Fineness::CLOSE);
            let fine = largest(&set, &belief, Fineness::FINE);
            assert!((fine / exact - 1.0).abs() < 2e-6, "{fine} {exact}");
            assert!(
                close >= exact * (1.0 - 1e-9) && close < exact * 1.0001,
                "{close} {exact}"
            );
            let proven = proven(&set, &belief).unwrap();
            assert!(
                proven <= exact && proven > 0.9985 * exact,
                "{proven} {exact}"
            );
        }
    }

    #[test]
    fn scale_is_zero_for_a_goal_outside() {
        let mut set = boxed(0.5, 0.5, 10.0);
        let belief = Gaussian::of_sigmas([0.1, 0.1, 0.1], 0.99).unwrap();
        set.shape = Shape::Box(BoxSet {
            x: [0.1, 0.5],
            y: [-0.5, 0.5],
            yaw_deg: [-10.0, 10.0],
        });
        assert_eq!(largest(&set, &belief, Fineness::FINE), 0.0);
        assert_eq!(proven(&set, &belief), Some(0.0));
        set.shape = Shape::Box(BoxSet {
            x: [-1e9, 1e9],
            y: [-1e9, 1e9],
            yaw_deg: [-180.0, 180.0],
        });
        assert_eq!(proven(&set, &belief), None);
    }
}
