//! If a pose-set is proven without a table to be in a success set, it is in the set.

use nalgebra::{Matrix3, Vector3};
use posegate::certify::{Body, ProofBudget, Prover};
use posegate::shape::SuccessSet;
use posegate_site::{SAMPLE, Site};
use posegate_testkit::counts;

const BUDGET: ProofBudget = ProofBudget {
    blocks: 20_000,
    smallest: 1e-4,
};

fn set(task: &str) -> SuccessSet {
    let site = Site::parse(SAMPLE, "site.toml").unwrap();
    site.task(task).unwrap().success.clone()
}

/// A generator of numbers in [-1, 1), the same on every machine.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
}

/// Returns `true` if a pose of the goal frame is in the set; the sample's goals are at the origin.
fn holds(set: &SuccessSet, pose: Vector3<f64>) -> bool {
    assert_eq!((set.goal.x, set.goal.y, set.goal.yaw_deg), (0.0, 0.0, 0.0));
    set.membership([pose.x, pose.y, pose.z]).inside
}

#[test]
fn no_pose_of_a_proven_set_is_outside() {
    let sets = if counts::is_deep() { 40 } else { 12 };
    let mut random = Random(1 + counts::first_seed());
    for (task, reach) in [("see-t7", [1.5, 1.0, 0.3]), ("dock", [0.1, 0.08, 0.1])] {
        let (set, mut counts) = (set(task), [0; 2]);
        let prover = Prover::new(&set);
        assert!(prover.is_convex());
        for _ in 0..sets {
            // An ellipsoid with all correlations, and the largest scale of it that is proven.
            let factor = Matrix3::from_fn(|row, _| 0.4 * reach[row] * random.next());
            let centre = Vector3::from(reach.map(|reach| 0.3 * reach * random.next()));
            let proven = |scale: f64| {
                let square =
                    factor * factor.transpose() * scale * scale + Matrix3::identity() * 1e-16;
                let body = Body::ellipsoid(centre.into(), square);
                body.is_some_and(|body| body.is_within(&prover, BUDGET))
            };
            let (mut low, mut high) = (0.0, 8.0);
            for _ in 0..9 {
                let middle = 0.5 * (low + high);
                *(if proven(middle) { &mut low } else { &mut high }) = middle;
            }
            counts[usize::from(low > 0.01)] += 1;
            for _ in 0..400 {
                let direction = Vector3::new(random.next(), random.next(), random.next());
                let pose = centre + factor * direction.normalize() * low;
                assert!(low == 0.0 || holds(&set, pose), "{task}: {pose} at {low}");
            }
            // Cylinders.
            let (radius, yaw) = (
                0.5 * reach[0] * random.next().abs(),
                0.5 * reach[2] * random.next().abs(),
            );
            if Body::cylinder(centre.into(), radius, yaw).is_within(&prover, BUDGET) {
                for _ in 0..200 {
                    let angle = 3.2 * random.next();
                    let off = Vector3::new(
                        radius * angle.cos(),
                        radius * angle.sin(),
                        yaw * random.next(),
                    );
                    assert!(holds(&set, centre + off), "{task}: {centre} {radius} {yaw}");
                }
            }
        }
        assert!(2 * counts[1] > sets, "{task}: {counts:?}");
    }
}

#[test]
fn sets_with_nan_or_infinity_are_not_proven() {
    let prover = Prover::new(&set("dock"));
    assert!(Body::cylinder([0.0; 3], 0.01, 0.01).is_within(&prover, BUDGET));
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        assert!(!Body::cylinder([bad, 0.0, 0.0], 0.01, 0.01).is_within(&prover, BUDGET));
        assert!(!Body::cylinder([0.0; 3], bad, 0.01).is_within(&prover, BUDGET));
        assert!(!Body::cylinder([0.0; 3], 0.01, bad).is_within(&prover, BUDGET));
        let square = Matrix3::from_diagonal(&Vector3::new(1e-4, bad, 1e-4));
        let body = Body::ellipsoid([0.0; 3], square);
        assert!(body.is_none_or(|body| !body.is_within(&prover, BUDGET)));
    }
    assert!(!Body::cylinder([0.0; 3], -0.01, 0.01).is_within(&prover, BUDGET));
    assert!(!Body::cylinder([0.0; 3], 0.01, -0.01).is_within(&prover, BUDGET));
}
