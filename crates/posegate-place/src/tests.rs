use super::*;
use posegate::shape::{Shape, SuccessSet};
use posegate_site::{SAMPLE, Site};
use posegate_testkit::counts;

mod scenes;
mod small;

/// Returns the set of the sample's `see-t7`, with parts of its site replaced.
fn set(replace: &[(&str, &str)]) -> SuccessSet {
    let mut text = String::from(SAMPLE);
    for (from, to) in replace {
        assert!(text.contains(from), "{from}");
        text = text.replace(from, to);
    }
    let site = Site::parse(&text, "site.toml").unwrap_or_else(|error| panic!("{error}"));
    site.tasks["see-t7"].success.clone()
}

fn cost(set: &SuccessSet, belief: &Gaussian, accuracy: f64) -> ExpectedCost {
    let quadrature = Quadrature {
        accuracy,
        ..Quadrature::default()
    };
    expected_cost(set, belief, &Cost::default(), &quadrature).unwrap()
}

fn sigmas(sigmas: [f64; 3]) -> Gaussian {
    Gaussian::of_sigmas([sigmas[0], sigmas[1], sigmas[2].to_radians()], 0.99).unwrap()
}

/// Named sets, in addition to those with a closed form.
fn sets() -> [(&'static str, SuccessSet); 5] {
    let view = "success = { shape = \"visibility\", camera = \"front\", tag = \"t7\"";
    let near = [("pose = { x = 4.0", "pose = { x = 0.9")];
    let lens = [(
        "[tag.t7]",
        "image = \"raw\"\ndistortion = { model = \"plumb_bob\", coefficients = [-0.2, 0.05, 1e-3, 0.0, 0.0] }\n[tag.t7]",
    )];
    let wall = [
        ("x = 4.0, y = 0.0, z = 0.5", "x = 2.0, y = 0.3, z = 0.6"),
        (
            "[task.see-t7]",
            "[wall.post]\ncorners = [[1.2, 0.5], [1.1, 0.5], [1.1, 0.4], [1.2, 0.4]]\nz = [0.0, 2.0]\n[task.see-t7]",
        ),
    ];
    let two = format!("{view}s = [\"t7\", \"t8\"], see = \"any\"").replace("tag = \"t7\"s", "tags");
    let two = [
        (view, two.as_str()),
        ("x = 4.0, y = 0.0, z = 0.5", "x = 2.0, y = 0.3, z = 0.6"),
        (
            "[task.see-t7]",
            "[tag.t8]\nid = 8\nfamily = \"tag36h11\"\nsize = 0.2\npose = { x = 1.9, y = -0.4, z = 0.6, roll_deg = 0.0, pitch_deg = 0.0, yaw_deg = 170.0 }\n[task.see-t7]",
        ),
    ];
    [
        ("plain", set(&[])),
        ("near", set(&near)),
        ("lens", set(&lens)),
        ("wall", set(&wall)),
        ("two", set(&two)),
    ]
}

/// If everything is seen, no mass is outside, and the integral equals that of an independent reference.
#[test]
fn no_mass_is_outside_if_all_poses_see_the_tag() {
    let found = cost(&set(&[]), &sigmas([0.3, 0.3, 1.0]), 1e-7);
    assert_eq!(found.outside_mass, Approximate::default());
    assert_eq!(found.p_miss, Approximate::default());
    assert!((found.mass.value - 0.99).abs() < 1e-12);
    let off = found.integral.value - 1_410.038_868_717_493_9;
    assert!(off.abs() < 1e-8 * 1410.0, "{off:e}");
    assert!((found.mean.value * 0.99 / found.integral.value - 1.0).abs() < 1e-12);
    // The cost depends only on the distance, which is so large that it is nearly constant.
    let far = set(&[
        ("pose = { x = 4.0", "pose = { x = 2000.25"),
        ("d_max = 5.5", "d_max = 3000.0"),
    ]);
    let only = Cost {
        c1: 1.0,
        c2: 0.0,
        c3: 0.0,
        ..Cost::default()
    };
    let belief = sigmas([1e-3, 1e-3, 0.01]);
    let found = expected_cost(&far, &belief, &only, &Quadrature::ROUGH).unwrap();
    assert!((found.mean.value / 4e6 - 1.0).abs() < 1e-6, "{found:?}");
}

/// The mass of a ball of the standard normal density beyond a plane at a distance.
fn cap(distance: f64, radius: f64) -> f64 {
    let tail = |z: f64| 0.5 * libm::erfc(z * core::f64::consts::FRAC_1_SQRT_2);
    let flat = libm::exp(-0.5 * radius * radius) * (radius - distance);
    tail(distance) - tail(radius) - flat / libm::sqrt(core::f64::consts::TAU)
}

/// A side of a box cuts a cap off the whitened ball, for any covariance.
#[test]
fn caps_have_their_closed_form() {
    let covariance = [
        [0.04, 0.012, 0.004],
        [0.012, 0.0225, 0.005],
        [0.004, 0.005, 0.0036],
    ];
    let all = "{ shape = \"visibility\", camera = \"front\", tag = \"t7\", d_max = 5.5, phi_max_deg = 25.0, psi_max_deg = 50.0 }";
    for epsilon in [0.5, 0.99, 0.999_999] {
        let belief = Gaussian::new(covariance, epsilon).unwrap();
        let radius = libm::sqrt(posegate::confidence::radius_squared(epsilon).unwrap());
        for share in [-0.9, -0.3, 0.0, 0.2, 0.6, 0.9, 0.9995] {
            let distance = share * radius;
            // The goal faces along y: its x axis is the world's y axis.
            for (axis, yaw_deg, sigma) in [("x", 0.0, 0.2), ("x", 90.0, 0.15), ("yaw", 0.0, 0.06)] {
                let limit = distance * sigma;
                let sides = if axis == "x" {
                    format!("x = [-9.0, {limit:?}], y = [-9.0, 9.0], yaw_deg = [-180.0, 180.0]")
                } else {
                    let limit = limit.to_degrees();
                    format!("x = [-9.0, 9.0], y = [-9.0, 9.0], yaw_deg = [-100.0, {limit:?}]")
                };
                let text = format!(
                    "{{ all = [{{ any = [{all}, {{ shape = \"box\", x = [-9.0, 9.0], y = [-9.0, 9.0], yaw_deg = [-180.0, 180.0] }}] }}, {{ shape = \"box\", {sides} }}] }}"
                );
                let goal = format!("yaw_deg = {yaw_deg:?} }}\nsuccess = {{ shape = \"visibility\"");
                let set = set(&[
                    ("yaw_deg = 0.0 }\nsuccess = { shape = \"visibility\"", &goal),
                    (all, &text),
                ]);
                let found = cost(&set, &belief, 1e-6);
                let exact = cap(distance, radius);
                let off = (found.outside_mass.value - exact).abs();
                assert!(
                    off <= found.outside_mass.error.max(1e-9 * exact) && off < 3e-5 * exact + 1e-15,
                    "{epsilon} {axis} {yaw_deg} {share}: {exact:e}, {:?}",
                    found.outside_mass
                );
            }
        }
    }
}

/// Returns the sums over a lattice of the ball, by membership.
fn by_lattice(set: &SuccessSet, covariance: [[f64; 3]; 3], epsilon: f64, count: u32) -> [f64; 2] {
    let factor = nalgebra::Matrix3::from_fn(|i, j| covariance[i][j])
        .cholesky()
        .unwrap()
        .l();
    let goal = set.goal;
    let views = match &set.shape {
        Shape::Any(shapes) => shapes.clone(),
        shape => std::vec![shape.clone()],
    };
    let views: Vec<SuccessSet> = views
        .into_iter()
        .map(|shape| SuccessSet { goal, shape })
        .collect();
    let radius = libm::sqrt(posegate::confidence::radius_squared(epsilon).unwrap());
    let step = 2.0 * radius / f64::from(count);
    let at = |k: u32| (f64::from(k) + 0.5) * step - radius;
    let (mut seen, mut outside, mut mass) = (0.0, 0.0, 0.0);
    for k in 0..count * count * count {
        let u = nalgebra::Vector3::new(at(k % count), at(k / count % count), at(k / count / count));
        if u.norm() > radius {
            continue;
        }
        let weight = libm::exp(-0.5 * u.norm_squared());
        let e = factor * u;
        let pose = [
            goal.x + e[0],
            goal.y + e[1],
            goal.yaw_deg.to_radians() + e[2],
        ];
        mass += weight;
        if !set.membership(pose).inside {
            outside += weight;
            continue;
        }
        // The least cost of the views that see the tag.
        let seeing = views.iter().map(|view| view.membership(pose));
        let costs = seeing
            .filter(|membership| membership.inside)
            .filter_map(|m| m.sight);
        let cost = costs.map(|sight| Cost::default().of_view([sight.d, sight.phi, sight.psi]));
        seen += weight * cost.fold(f64::INFINITY, f64::min);
    }
    [epsilon * seen / mass, epsilon * outside / mass]
}

/// A lattice of poses gives the same result, within its resolution.
#[test]
fn sums_agree_with_a_lattice_of_poses() {
    let covariance = [[0.36, 0.06, 0.01], [0.06, 0.25, 0.02], [0.01, 0.02, 0.03]];
    let belief = Gaussian::new(covariance, 0.95).unwrap();
    // One of the sets each day; all in a deep job.
    let (skipped, step) = counts::part(5);
    for (name, set) in sets().into_iter().skip(skipped).step_by(step) {
        let found = cost(&set, &belief, 1e-5);
        let [seen, outside] = by_lattice(&set, covariance, 0.95, counts::rounds(56, 6));
        let coarse = if cfg!(miri) { 0.3 } else { 0.01 };
        let off = (found.outside_mass.value - outside) / found.mass.value;
        assert!(
            off.abs() < 0.3 * coarse,
            "{name}: {off} {:?}",
            found.outside_mass
        );
        let whole = found.integral.value - 1e6 * found.outside_mass.value;
        let off = whole / seen - 1.0;
        assert!(off.abs() < coarse, "{name}: {off} {whole} {seen}");
        assert!(
            found.outside_mass.value > 1e-4 && whole > 10.0,
            "{name}: {found:?}"
        );
    }
}

/// A robot behind the tag: from there the set is a strip, a few degrees wide, seen from its end.
#[test]
fn narrow_set_is_found_from_outside() {
    let set = set(&[
        (
            "pose = { x = 4.0, y = 0.0, z = 0.5, roll_deg = 0.0, pitch_deg = 0.0, yaw_deg = 180.0 }",
            "pose = { x = 0.3, y = 0.0, z = 0.5, roll_deg = 0.0, pitch_deg = 0.0, yaw_deg = 0.0 }",
        ),
        ("psi_max_deg = 50.0", "psi_max_deg = 1.0"),
        (
            "yaw_deg = 0.0 }\nsuccess = { shape = \"visibility\"",
            "yaw_deg = 180.0 }\nsuccess = { shape = \"visibility\"",
        ),
    ]);
    let covariance = [[0.25, 0.0, 0.0], [0.0, 0.25, 0.0], [0.0, 0.0, 1e-4]];
    let belief = Gaussian::new(covariance, 0.99).unwrap();
    let found = cost(&set, &belief, 1e-6);
    let inside = found.mass.value - found.outside_mass.value;
    // Sum over a grid of membership in x and y; the heading moves the strip only a little.
    let (mut sum, step) = (0.0, 0.002);
    for i in 0..850 {
        for j in -100..100 {
            let (x, y) = (f64::from(i) * step, (f64::from(j) + 0.5) * step);
            for heading in [-1.5, -0.5, 0.5, 1.5] {
                let pose = [x, y, core::f64::consts::PI + 0.01 * heading];
                let weight = libm::exp(-2.0 * (x * x + y * y) - 0.5 * heading * heading);
                let all = [-1.5f64, -0.5, 0.5, 1.5].map(|h| libm::exp(-0.5 * h * h));
                if set.membership(pose).inside {
                    sum += weight * step * step * 4.0
                        / core::f64::consts::TAU
                        / all.iter().sum::<f64>();
                }
            }
        }
    }
    assert!((inside / sum - 1.0).abs() < 0.1, "{inside:e} {sum:e}");
}

/// The reported errors are confirmed by a finer quadrature.
#[test]
fn errors_are_at_most_the_reported_ones() {
    for (name, set) in sets() {
        for sigmas in counts::one_a_day(&[
            [0.1, 0.1, 1.0],
            [0.3, 0.2, 4.0],
            [0.6, 0.6, 12.0],
            [1.5, 0.01, 0.1],
        ]) {
            let belief = self::sigmas(sigmas);
            let exact = cost(&set, &belief, 1e-6);
            for accuracy in [1e-3, 1e-4] {
                let found = cost(&set, &belief, accuracy);
                let off = |a: Approximate, b: Approximate| (a.value - b.value).abs();
                let (integral, outside) = (
                    off(found.integral, exact.integral),
                    off(found.outside_mass, exact.outside_mass),
                );
                let allowed = |a: Approximate, b: Approximate| a.error + b.error + 1e-12 * b.value;
                assert!(
                    integral <= allowed(found.integral, exact.integral)
                        && outside <= allowed(found.outside_mass, exact.outside_mass)
                        && found.integral.error <= accuracy * found.integral.value,
                    "{name} {sigmas:?} {accuracy}: {found:?} {exact:?}"
                );
            }
        }
    }
}

#[test]
fn equal_arguments_give_equal_results() {
    let (_, set) = sets().into_iter().nth(3).unwrap();
    let belief = sigmas([0.3, 0.2, 4.0]);
    let run = || expected_cost(&set, &belief, &Cost::default(), &Quadrature::ROUGH).unwrap();
    assert_eq!(run(), run());
}

#[test]
fn invalid_pose_sets_are_errors() {
    let good = [[1.0, 0.1, 0.0], [0.1, 1.0, 0.0], [0.0, 0.0, 0.1]];
    let changed = |row: usize, column: usize, value: f64| {
        let mut covariance = good;
        covariance[row][column] = value;
        Gaussian::new(covariance, 0.99).unwrap_err().to_string()
    };
    assert!(changed(0, 2, f64::NAN).contains("row 1, column 3 is NaN"));
    assert!(changed(1, 0, 0.2).contains("row 1, column 2 is 0.1, and row 2, column 1 is 0.2"));
    assert!(changed(2, 2, 0.0).contains("not positive definite"));
    assert!(changed(2, 2, -1.0).contains("not positive definite"));
    let flat = [[1.0, 1.0, 0.0], [1.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    assert_eq!(
        Gaussian::new(flat, 0.99),
        Err(GaussianError::NotPositiveDefinite)
    );
    for epsilon in [0.0, 1.0, -0.5, f64::NAN, f64::INFINITY] {
        let error = Gaussian::new(good, epsilon).unwrap_err();
        assert!(matches!(error, GaussianError::Epsilon(_)), "{error}");
    }
    for sigma in [0.0, -0.1, f64::NAN, f64::INFINITY, 1e-200] {
        let error = Gaussian::of_sigmas([0.1, sigma, 0.1], 0.99).unwrap_err();
        assert!(error.to_string().starts_with("sigma_y is"), "{error}");
    }
    let error = Gaussian::of_sigmas([0.1, 0.1, 100.0], 0.99).unwrap_err();
    assert!(matches!(error, GaussianError::Turns(_)), "{error}");
}

#[test]
fn sets_and_costs_without_a_value_are_errors() {
    let belief = sigmas([0.1, 0.1, 1.0]);
    let site = Site::parse(SAMPLE, "site.toml").unwrap();
    let dock = &site.tasks["dock"].success;
    let ask = |set, cost: Cost, accuracy| {
        let quadrature = Quadrature {
            accuracy,
            ..Quadrature::ROUGH
        };
        expected_cost(set, &belief, &cost, &quadrature)
    };
    let paper = Cost::default();
    assert_eq!(ask(dock, paper, 0.1), Err(CostError::NoView("box")));
    let see = &site.tasks["see-t7"].success;
    for value in [-1.0, f64::NAN, f64::INFINITY] {
        let error = ask(see, Cost { c2: value, ..paper }, 0.1).unwrap_err();
        assert!(error.to_string().starts_with("c2 is"), "{error}");
        let error = ask(
            see,
            Cost {
                c_high: value,
                ..paper
            },
            0.1,
        )
        .unwrap_err();
        assert!(error.to_string().starts_with("c_high is"), "{error}");
    }
    for accuracy in [0.0, -1.0, 2.0, f64::NAN] {
        assert!(matches!(
            ask(see, paper, accuracy),
            Err(CostError::Accuracy(_))
        ));
    }
    // If all costs are 0, a relative accuracy is impossible and not attempted.
    let nothing = Cost {
        c_high: 0.0,
        c1: 0.0,
        c2: 0.0,
        c3: 0.0,
    };
    assert_eq!(ask(see, nothing, 1e-7).unwrap().integral.value, 0.0);
}

#[test]
fn quick_estimate_is_near_the_accurate_one() {
    let set = &set(&[]);
    let cost = Cost::default();
    for (sigmas, near) in [
        ([0.05, 0.1, 0.02], 1e-4),
        ([0.1, 0.1, 0.0175], 1e-4),
        ([0.5, 0.4, 0.1], 0.05),
        ([1.0, 1.0, 0.3], 0.05),
    ] {
        let belief = Gaussian::of_sigmas(sigmas, 0.99).unwrap();
        let exact = expected_cost(set, &belief, &cost, &Quadrature::default()).unwrap();
        let of_view = |view| cost.of_view(view);
        let [seen, outside] = rough::sums(
            &posegate::shape::LineClipper::of(set),
            &belief.at(set.goal),
            &of_view,
        );
        let mean = (seen + cost.c_high * outside) / belief.mass();
        let off = mean / exact.mean.value - 1.0;
        assert!(off.abs() < near, "{sigmas:?}: {mean} {}", exact.mean.value);
    }
}

#[test]
fn post_that_no_ray_meets_prevents_a_proof() {
    // A post of one millimetre within the pose-set, which every tried ray misses.
    let site = format!(
        "{}\n[task.post]\nkind = \"work\"\ngoal = {{ x = 0.0, y = 0.0, yaw_deg = 0.0 }}\n\
         success = {{ shape = \"clear\", footprint = [[0.0, 0.0]], obstacle = [[-0.55, 0.4137], [-0.549, 0.4137], \
         [-0.549, 0.4147], [-0.55, 0.4147]] }}\n",
        SAMPLE
    );
    let site = Site::parse(&site, "site.toml").unwrap();
    let set = &site.task("post").unwrap().success;
    let belief = Gaussian::of_sigmas([0.3, 0.3, 0.02], 0.99).unwrap();
    assert!(!set.membership([-0.5495, 0.4142, 0.0]).inside);
    assert_eq!(
        scale::largest(set, &belief, scale::Fineness::FINE),
        f64::INFINITY
    );
    assert_eq!(scale::proven(set, &belief), Some(0.0));
    let small = Gaussian::of_sigmas([0.05, 0.05, 0.02], 0.99).unwrap();
    assert!(scale::proven(set, &small).is_some_and(|margin| margin >= 1.0));
}
