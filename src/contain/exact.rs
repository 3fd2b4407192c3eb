//! Tests the decision on facets against the exact sets.
//!
//! The tests use random layouts of one facet, and random sets that the decision just accepts. These are found
//! by bisection over the facet's offset, and then over the size of the set, whose unit is finer. For each of
//! them the largest `a . P - b` over all poses of the exact set may be at most the value of
//! [`clearance_q14`](super::facets::clearance_q14). The estimate is chosen where rounding favours acceptance,
//! so that hardly any of the clearance is left.
//!
//! The exact side is `f64`: lengths are below 2^29 um, a dozen operations have an error of 2^-53 of them
//! each, and sines and cosines are within one ulp. The sum is below 2^-18 um, far below [`NUMERIC_UM`]. An
//! ellipsoid at a fixed first coordinate of u, and so at a fixed heading, is a disc's image, whose largest
//! `a . P` has a closed form. The rest is the maximum of a function of one number. If that search misses the
//! maximum, the test is weaker, but it never rejects a correct decision.

use crate::num::BinaryAngle;
use crate::pose::Pose;
use crate::set::{Extent, SqrtFactor};
use crate::table::{Axes, Facet};
use crate::test_iterations;

use self::cases::{Case, NUMERIC_UM};
use self::random::{Random, case, favoured};

pub(super) mod cases;
pub(super) mod random;

/// Returns the case at the border of the decision, or `None` if no offset is accepted, or every offset is.
fn at_border(case: Case, random: &mut Random) -> Option<Case> {
    let limit = match case.axes {
        Axes::World => 30_000,
        Axes::Robot => i32::from(case.farthest),
    };
    let (mut low, mut high) = (-limit, limit);
    if case.with_b(low).holds() || !case.with_b(high).holds() {
        return None;
    }
    while high - low > 1 {
        let middle = (low + high) / 2;
        if case.with_b(middle).holds() {
            high = middle;
        } else {
            low = middle;
        }
    }
    let case = case.with_b(high);
    // The largest accepted set: an extent's unit is finer than an offset's.
    let sized = |by: f64, plane: bool| {
        if plane {
            case.scaled(by, 1.0)
        } else {
            case.scaled(1.0, by)
        }
    };
    let plane = !random.one_in(3);
    let (mut low, mut high) = (1.0, 2.0);
    if case.scaled(1.0, 1.0).holds() && !sized(high, plane).holds() {
        for _ in 0..20 {
            let middle = 0.5 * (low + high);
            if sized(middle, plane).holds() {
                low = middle;
            } else {
                high = middle;
            }
        }
        return Some(sized(low, plane));
    }
    Some(case)
}

#[test]
fn what_is_accepted_is_inside() {
    let mut random = Random(7);
    // Smallest slack in the extent's units: of points that do not rotate, points that do, and points in robot
    // axes; first ellipsoids, then discs.
    let mut least = [f64::INFINITY; 6];
    let mut counts = [0u32; 6];
    let mut wide = 0u32;
    for _ in 0..test_iterations(40_000, 8) {
        let Some(case) = at_border(case(&mut random), &mut random) else {
            continue;
        };
        let slack = case.slack_um();
        assert!(slack >= -NUMERIC_UM, "{slack} um: {case:?}");
        let kind = match case.axes {
            Axes::World if case.point == [0, 0] => 0,
            Axes::World => 1,
            Axes::Robot => 2,
        } + if case.is_disc() { 3 } else { 0 };
        let Some((_, unit)) = case.favour() else {
            // The set turns by more than half a radian: it has no unit of its own.
            wide += 1;
            continue;
        };
        counts[kind] += 1;
        least[kind] = least[kind].min(slack / unit);
    }
    std::println!("cases {counts:?} and {wide} wide ones, smallest slack {least:.2?}");
    if cfg!(miri) {
        assert!(counts.iter().sum::<u32>() > 2, "{counts:?}");
        return;
    }
    assert!(counts.iter().all(|count| *count > 1_000), "{counts:?}");
    // Roundings of the extent need not use any of their allowance of 8. The borders are where they should be:
    // a test that allows that much less fails.
    let close = least.iter().zip([8.5, 11.0, 15.0, 14.0, 16.0, 18.0]);
    assert!(
        close.clone().all(|(found, limit)| *found < limit),
        "{least:?}"
    );
}

/// The effect of rounding the estimate alone, at the least favourable estimates: less than the clearance, by
/// little.
#[test]
fn what_is_granted_for_the_estimate_is_needed() {
    let mut random = Random(3);
    // Indexed by the axes, and by whether the lever is long.
    let mut least = [[f64::INFINITY; 2]; 3];
    for _ in 0..test_iterations(3_000, 4) {
        let mut case = case(&mut random);
        let most = favoured(&mut case, &mut random, test_iterations(300, 10));
        let kind = match case.axes {
            Axes::World if case.point == [0, 0] => 0,
            Axes::World => 1,
            Axes::Robot => 2,
        };
        let left = case.granted() - most;
        assert!(left >= 0.0, "{left} length units: {case:?}");
        let long = usize::from(case.lever() > 5_000);
        least[kind][long] = least[kind][long].min(left);
    }
    std::println!("smallest slack of the clearance, length units: {least:.3?}");
    if cfg!(miri) {
        return;
    }
    let [[still, _], [world, far_world], [robot, far_robot]] = least;
    assert!(still < 0.01 && world < 0.2 && robot < 0.2, "{least:?}");
    assert!(far_world < 0.6 && far_robot < 0.6, "{least:?}");
}

/// The estimate is rounded on world axes, and a normal in robot axes can lie at an angle to them.
#[test]
fn rounding_across_a_normal_in_robot_axes_is_paid() {
    let case = Case {
        unit: 12,
        reach: 100,
        arm: 0,
        farthest: 200,
        axes: Axes::Robot,
        point: [0, 0],
        facet: Facet {
            x: 16_350,
            y: 0,
            b: 8,
        },
        goal: Pose::default(),
        // 6 units and almost a half on each axis, seen at 45 degrees: 9.19 units, taken for 8.
        mean: Pose {
            x_um: 6 * 4096 + 2047,
            y_um: 6 * 4096 + 2047,
            yaw: BinaryAngle(1 << 29),
        },
        extent: Extent::Bounded {
            translation_um: 1,
            yaw_q24: 1,
        },
    };
    assert!(
        case.holds() && case.slack_um() >= 0.0,
        "{}",
        case.slack_um()
    );
}

/// A point of the robot is rounded on world axes, and that error rotates with the yaw offset.
#[test]
fn rounding_that_turns_is_paid() {
    let case = Case {
        unit: 11,
        reach: 1370,
        arm: 5,
        farthest: 0,
        axes: Axes::World,
        point: [5, 0],
        facet: Facet {
            x: 372,
            y: 16_395,
            b: -757,
        },
        goal: Pose {
            x_um: -291_626_454,
            y_um: -1_209_906_498,
            yaw: BinaryAngle(0),
        },
        mean: Pose {
            x_um: -293_209_558,
            y_um: -1_211_418_947,
            yaw: BinaryAngle(2_684_822_216),
        },
        extent: Extent::Gaussian(SqrtFactor {
            yaw: 1_115_964,
            x: [-7026, 0, 0],
            y: [11_050, 0, 0],
        }),
    };
    assert!(
        case.holds() && case.slack_um() >= 0.0,
        "{}",
        case.slack_um()
    );
}
