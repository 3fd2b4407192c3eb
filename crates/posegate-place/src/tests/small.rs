//! Small obstacles are not skipped, and unknown views are misses.

use super::*;
use core::sync::atomic::{AtomicU64, Ordering};
use posegate::shape::{Pose3Deg, Tolerance};

const VIEW: &str = "{ shape = \"visibility\", camera = \"front\", tag = \"t7\", d_max = 5.5, phi_max_deg = 25.0, psi_max_deg = 50.0 }";

/// Returns the sample's view, with a point of the robot kept clear of a square obstacle.
fn with_post(point: [f64; 2], [x, y]: [f64; 2], edge: f64) -> SuccessSet {
    let (x1, y1) = (x + edge, y + edge);
    let all = format!(
        "{{ all = [{VIEW}, {{ shape = \"clear\", footprint = [{point:?}], obstacle = [[{x:?}, {y:?}], [{x1:?}, {y:?}], [{x1:?}, {y1:?}], [{x:?}, {y1:?}]] }}] }}"
    );
    set(&[(VIEW, &all)])
}

/// Returns `true` if a number equals another within its error and a relative error of the other.
fn agrees(found: Approximate, exact: f64, share: f64) -> bool {
    (found.value - exact).abs() <= found.error + share * exact
}

/// A post that the robot must avoid: the density's integral over it, for the headings in the ball.
#[test]
fn post_between_two_rays_is_met() {
    let plain = cost(&set(&[]), &sigmas([0.3, 0.3, 1.0]), 1e-7);
    for edge in [0.001, 0.01, 0.02, 0.1] {
        for at in [
            [-0.55, 0.4137],
            [-0.3, -0.6],
            [0.62, 0.21],
            [0.01, 0.013],
            [-0.9, -0.42],
        ] {
            let found = cost(
                &with_post([0.0, 0.0], at, edge),
                &sigmas([0.3, 0.3, 1.0]),
                1e-7,
            );
            let r2 = posegate::confidence::radius_squared(0.99).unwrap();
            let count = 60;
            let exact: f64 = (0..count * count)
                .map(|k| {
                    let place = |k: u32| edge * (f64::from(k) + 0.5) / f64::from(count);
                    let [x, y] = [at[0] + place(k % count), at[1] + place(k / count)];
                    let square = (x * x + y * y) / 0.09;
                    let heading = libm::erf(libm::sqrt(0.5 * (r2 - square).max(0.0)));
                    libm::exp(-0.5 * square) * heading
                })
                .sum();
            let exact = exact * (edge / f64::from(count)).powi(2) / (core::f64::consts::TAU * 0.09);
            // The lattice's own error is larger if the ball ends within the post.
            let coarse = if at[0] == -0.9 { 3e-3 } else { 1e-4 };
            assert!(
                agrees(found.outside_mass, exact, coarse)
                    && found.outside_mass.error < 1e-2 * exact
                    && (found.mean.value - plain.mean.value - 1e6 * exact / 0.99).abs()
                        <= found.mean.error + 1.1e6 * coarse * exact + 3000.0 * exact,
                "{edge} {at:?}: {exact:e} {found:?}"
            );
        }
    }
}

/// An arm of one metre hits a post of 2 mm, within a tenth of a degree of headings. The position's uncertainty is
/// smaller than the post.
#[test]
fn post_between_two_headings_is_met() {
    let (sigma, yaw) = (2e-4, 5f64.to_radians());
    let belief = Gaussian::of_sigmas([sigma, sigma, yaw], 0.99).unwrap();
    for heading in [0.02f64, -0.071, 0.1234, 0.21] {
        let (at, edge) = ([libm::cos(heading), libm::sin(heading)], 0.002);
        let found = cost(&with_post([1.0, 0.0], at, edge), &belief, 1e-7);
        let radius = libm::sqrt(posegate::confidence::radius_squared(0.99).unwrap());
        // A lattice of the headings, and of the positions at each heading.
        let (count, step) = (60, 2.0 * radius / 60.0);
        let place = |k: u32| (f64::from(k) + 0.5) * step - radius;
        let mut exact = 0.0;
        let (first, last) = (heading - 0.004, heading + 0.008);
        for k in 0..1200 {
            let angle = first + (last - first) * (f64::from(k) + 0.5) / 1200.0;
            let u1 = angle / yaw;
            for j in 0..count * count {
                let [u, v] = [place(j % count), place(j / count)];
                let square = u * u + v * v + u1 * u1;
                let [x, y] = [
                    sigma * u + libm::cos(angle) - at[0],
                    sigma * v + libm::sin(angle) - at[1],
                ];
                if square <= radius * radius && x.min(y) > 0.0 && x.max(y) < edge {
                    exact += libm::exp(-0.5 * square);
                }
            }
        }
        let volume = step * step * (last - first) / 1200.0 / yaw;
        let exact = exact * volume / core::f64::consts::TAU.powf(1.5);
        assert!(
            agrees(found.outside_mass, exact, 0.01) && exact > 1e-5,
            "{heading}: {exact:e} {found:?}"
        );
    }
}

/// The mass that no ray meets is in the reported error.
#[test]
fn mass_that_no_ray_meets_is_in_the_error() {
    let edge = 1e-6;
    let found = cost(
        &with_post([0.0, 0.0], [-0.55, 0.4137], edge),
        &sigmas([0.3, 0.3, 1.0]),
        1e-4,
    );
    let square = (0.55f64.powi(2) + 0.4137f64.powi(2)) / 0.09;
    let exact = libm::exp(-0.5 * square) * edge * edge / (core::f64::consts::TAU * 0.09);
    assert!(
        found.outside_mass.error > 0.0 && agrees(found.outside_mass, exact, 0.05),
        "{exact:e} {found:?}"
    );
}

/// A cost that is unknown beyond a distance.
struct Within {
    distance: f64,
    asked: AtomicU64,
}

impl ViewCost for Within {
    fn of_view(&self, view: [f64; 3]) -> f64 {
        self.asked.fetch_add(1, Ordering::Relaxed);
        if view[0] <= self.distance {
            Cost::default().of_view(view)
        } else {
            f64::INFINITY
        }
    }

    fn of_miss(&self) -> f64 {
        1e6
    }

    fn definition(&self) -> String {
        Cost::default().definition()
    }

    fn quadrature(&self, requested: Quadrature) -> Quadrature {
        Quadrature {
            accuracy: requested.accuracy.max(1e-4),
            views: 400_000,
            ..requested
        }
    }
}

/// Views that are unknown beyond a distance are as probable as views beyond that limit. They are found within the
/// limit of views.
#[test]
fn unknown_view_is_a_miss() {
    let plain = set(&[]);
    let belief = sigmas([0.1, 0.1, 1.0]);
    // Test all distances only in the deep job.
    let all = [3.7, 4.0, 3.3, 3.5, 3.85, 3.95, 4.07];
    let few = if std::env::var_os("POSEGATE_DEEP").is_some() {
        7
    } else {
        2
    };
    for distance in all.into_iter().take(few) {
        let nearer = set(&[("d_max = 5.5", &format!("d_max = {distance:?}"))]);
        let exact = cost(&nearer, &belief, 1e-7);
        let within = Within {
            distance,
            asked: AtomicU64::new(0),
        };
        let task = Task {
            set: plain.clone(),
            tag: plain.tags()[0],
            wall: None,
            reserve: Tolerance::NONE,
        };
        let order = PlacementProblem {
            task: &task,
            known: PosePrior::About(belief),
            cost: &within,
            objective: Objective::Cost,
        };
        let placed = order.placed(task.tag.pose).unwrap();
        let asked = within.asked.load(Ordering::Relaxed);
        let mean = placed.mean.unwrap();
        let share = exact.p_miss.value;
        assert!(
            agrees(placed.p_unknown, share, 1e-9)
                && agrees(mean, exact.mean.value, 1e-9)
                && placed.p_unknown.error <= 0.1 * share
                && (placed.p_miss - placed.p_unknown.value).abs() < 1e-12,
            "{distance}: {share:e} {placed:?} {exact:?}"
        );
        assert!(asked < 1_500_000, "{distance}: {asked}");
        assert_eq!(placed.contained, share == 0.0, "{distance}: {placed:?}");
        // Also for an exactly known pose.
        let exactly = PlacementProblem {
            known: PosePrior::Exactly,
            ..order
        };
        let placed = exactly.placed(task.tag.pose).unwrap();
        let seen = distance >= 3.75;
        let miss = if seen { 0.0 } else { 1.0 };
        assert_eq!((placed.contained, placed.p_miss), (seen, miss));
    }
}

/// Places with unknown views do not count as contained.
#[test]
fn unknown_views_are_not_contained() {
    let plain = set(&[]);
    let task = Task {
        set: plain.clone(),
        tag: plain.tags()[0],
        wall: None,
        reserve: Tolerance::NONE,
    };
    let within = Within {
        distance: 3.75,
        asked: AtomicU64::new(0),
    };
    let order = PlacementProblem {
        task: &task,
        known: PosePrior::About(sigmas([0.1, 0.1, 1.0])),
        cost: &within,
        objective: Objective::ContainedCost,
    };
    let near = Pose3Deg {
        x: 3.0,
        ..task.tag.pose
    };
    let (best, placed) = compare(&order, &[task.tag.pose, near], &|_| ()).unwrap();
    assert_eq!(best, 1, "{placed:?}");
    assert_eq!(
        placed.iter().map(|p| p.contained).collect::<Vec<_>>(),
        [false, true]
    );
}

/// The cost of an exactly known pose is that of its view.
#[test]
fn cost_of_an_exact_pose_is_that_of_its_view() {
    let found = ExpectedCost::at_goal(&set(&[]), &Cost::default()).unwrap();
    // 3.75 m straight ahead.
    assert!(
        (found.mean.value - 100.0 * 3.75 * 3.75).abs() < 1e-9,
        "{found:?}"
    );
    assert_eq!((found.mass.value, found.p_miss.value), (1.0, 0.0));
    let behind = set(&[("psi_max_deg = 50.0", "psi_max_deg = 50.0, d_min = 3.8")]);
    let found = ExpectedCost::at_goal(&behind, &Cost::default()).unwrap();
    assert_eq!((found.integral.value, found.p_miss.value), (1e6, 1.0));
    assert_eq!(
        found.outside_mass,
        Approximate {
            value: 1.0,
            error: 0.0
        }
    );
    // With two tags, the cost is that of the visible tag, or of the cheaper one.
    let (_, two) = sets().into_iter().nth(4).unwrap();
    let found = ExpectedCost::at_goal(&two, &Cost::default()).unwrap();
    let tiny = cost(&two, &sigmas([1e-7, 1e-7, 1e-5]), 1e-6);
    assert!((found.mean.value / tiny.mean.value - 1.0).abs() < 1e-6);
    let site = Site::parse(SAMPLE, "site.toml").unwrap();
    let dock = &site.tasks["dock"].success;
    assert_eq!(
        ExpectedCost::at_goal(dock, &Cost::default()),
        Err(CostError::NoView("box"))
    );
}
