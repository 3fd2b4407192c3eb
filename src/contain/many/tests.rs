use super::*;
use crate::contain::Cause;
use crate::pose::Pose;
use crate::set::Extent;
use proptest::prelude::*;
use proptest::strategy::ValueTree;
use proptest::test_runner::TestRunner;

/// Every committed table: convex sets, unions, arcs, whole circles, cells alone and cells next to facets.
const TABLES: [(&str, &[u8]); 13] = [
    (
        "dock",
        include_bytes!("../../../examples/tables/dock.posegate"),
    ),
    (
        "contingent-dock",
        include_bytes!("../../../examples/tables/contingent-dock.posegate"),
    ),
    (
        "see-left",
        include_bytes!("../../../examples/tables/see-left.posegate"),
    ),
    (
        "see-right",
        include_bytes!("../../../examples/tables/see-right.posegate"),
    ),
    (
        "see-t7",
        include_bytes!("../../../examples/tables/see-t7.posegate"),
    ),
    (
        "see-t7-grid",
        include_bytes!("../../../examples/tables/see-t7-grid.posegate"),
    ),
    (
        "corner",
        include_bytes!("../../../tests/data/corner.posegate"),
    ),
    (
        "over-180",
        include_bytes!("../../../tests/data/over-180.posegate"),
    ),
    (
        "over-180-grid",
        include_bytes!("../../../tests/data/over-180-grid.posegate"),
    ),
    (
        "see-bay",
        include_bytes!("../../../tests/data/see-bay.posegate"),
    ),
    (
        "turning",
        include_bytes!("../../../tests/data/turning.posegate"),
    ),
    (
        "whole-circle",
        include_bytes!("../../../tests/data/whole-circle.posegate"),
    ),
    ("self-test", include_bytes!("../../gate/self_test.posegate")),
];

/// Numbers of a set, each as a share of the table's width.
#[derive(Clone, Debug)]
struct Shares {
    /// x and y from the middle of the cells, yaw from the middle of the arc.
    place: [f64; 3],
    /// The reach along each axis, as powers of ten.
    reach: [f64; 3],
    /// Signs and logarithms of 1 - correlation.
    correlations: [(bool, f64); 3],
    /// Whole turns of the estimate.
    turns: i32,
    radius: u32,
}

fn shares() -> impl Strategy<Value = Shares> {
    let place = prop_oneof![4 => -0.5f64..0.5, 1 => -0.8f64..0.8, 1 => Just(0.5f64), 1 => Just(-0.5f64), 1 => Just(0.0f64)];
    let reach =
        prop_oneof![4 => -2.0f64..-0.3, 1 => -4.5f64..0.5, 1 => Just(-core::f64::consts::LOG10_2)];
    let reaches = prop_oneof![
        3 => proptest::array::uniform3(reach),
        // Small in the plane and wide in yaw: terms beyond first order count.
        1 => (-3.6f64..-2.0, -3.6f64..-2.0, -1.2f64..-0.2).prop_map(|(x, y, yaw)| [x, y, yaw]),
        // Small on all axes: the rounding of the estimate counts.
        1 => proptest::array::uniform3(-4.2f64..-2.8),
    ];
    let correlation = (
        any::<bool>(),
        prop_oneof![3 => -0.5f64..0.0, 2 => -3.0f64..-0.5, 1 => -7.0f64..-3.0],
    );
    (
        proptest::array::uniform3(place),
        reaches,
        proptest::array::uniform3(correlation),
        -3..3i32,
        prop_oneof![2 => Just(743_498u32), 1 => 1u32 << 16..1 << 24],
    )
        .prop_map(|(place, reach, correlations, turns, radius)| Shares {
            place,
            reach,
            correlations,
            turns,
            radius,
        })
}

/// Sets as they are in use: on the table or near it, none of them on a border.
fn plain() -> impl Strategy<Value = Shares> {
    let place = -0.6f64..0.6;
    let reach = -1.7f64..-0.4;
    let correlation = (any::<bool>(), -0.6f64..0.0);
    (
        proptest::array::uniform3(place),
        proptest::array::uniform3(reach),
        proptest::array::uniform3(correlation),
    )
        .prop_map(|(place, reach, correlations)| Shares {
            place,
            reach,
            correlations,
            turns: 0,
            radius: 743_498,
        })
}

impl Shares {
    fn radius(&self) -> RadiusSquared {
        RadiusSquared::from_q16(self.radius).unwrap()
    }

    /// Returns estimate and covariance on a table.
    fn on(&self, table: &Table<'_>) -> ([f64; 3], [[f64; 3]; 3]) {
        let cells = table.cells();
        let turn = core::f64::consts::TAU / 4_294_967_296.0;
        let low = [
            f64::from(cells.x_lo_um) * 1e-6,
            f64::from(cells.y_lo_um) * 1e-6,
            f64::from(cells.yaw_lo.0) * turn,
        ];
        let step = f64::from(cells.step_um) * 1e-6;
        let width = [
            step * f64::from(cells.columns),
            step * f64::from(cells.rows),
            cells.yaw_span as f64 * turn,
        ];
        let [x, y, yaw] = [0, 1, 2].map(|k| low[k] + width[k] * (0.5 + self.place[k]));
        let goal = table.goal();
        let (c, s) = (
            f64::from(goal.cos_q30) / f64::from(1 << 30),
            f64::from(goal.sin_q30) / f64::from(1 << 30),
        );
        let pose = [
            f64::from(goal.pose.x_um) * 1e-6 + c * x - s * y,
            f64::from(goal.pose.y_um) * 1e-6 + s * x + c * y,
            f64::from(goal.pose.yaw.0) * turn
                + yaw
                + f64::from(self.turns) * core::f64::consts::TAU,
        ];
        let r = (f64::from(self.radius) / 65_536.0).sqrt();
        let sigma = [0, 1, 2].map(|k| width[k] * 10f64.powf(self.reach[k]) / r);
        let signed = |(negative, less): (bool, f64)| {
            (1.0 - 10f64.powf(less)) * if negative { -1.0 } else { 1.0 }
        };
        let [a, b, free] = self.correlations.map(signed);
        // Any correlation of x and y that the other two allow.
        let between = a * b + ((1.0 - a * a) * (1.0 - b * b)).max(0.0).sqrt() * free;
        let mut covariance = [[0.0; 3]; 3];
        for (i, j, rho) in [(0, 1, between), (0, 2, a), (1, 2, b)] {
            covariance[i][j] = rho * sigma[i] * sigma[j];
            covariance[j][i] = covariance[i][j];
        }
        for k in 0..3 {
            covariance[k][k] = sigma[k] * sigma[k];
        }
        (pose, covariance)
    }
}

fn by_integers(
    table: &Table<'_>,
    radius: RadiusSquared,
    [x_m, y_m, yaw_rad]: [f64; 3],
    covariance: [[f64; 3]; 3],
) -> Result<Decision, InputError> {
    PoseSet::gaussian(Estimate { x_m, y_m, yaw_rad }, covariance, radius)
        .map(|set| decide(table, &set))
}

fn scaled(covariance: [[f64; 3]; 3], by: f64) -> [[f64; 3]; 3] {
    covariance.map(|row| row.map(|entry| entry * by * by))
}

/// Compares the filter with the integer code on one set; returns `true` if the filter is certain.
fn compared(
    name: &str,
    filter: &Filter<'_>,
    pose: [f64; 3],
    covariance: [[f64; 3]; 3],
) -> Result<bool, TestCaseError> {
    let certain = filter.is_certain(pose, &covariance);
    if certain {
        let expected = by_integers(&filter.table, filter.radius_squared, pose, covariance);
        prop_assert_eq!(
            expected,
            Ok(Decision::Inside),
            "{}: {:?} {:?} {:?}",
            name,
            pose,
            covariance,
            filter.radius_squared
        );
    }
    Ok(certain)
}

/// Returns the number of cases; POSEGATE_CASES sets another. At 40,000 every bound of the filter has been seen to matter.
fn cases(all: u32) -> u32 {
    let asked = std::env::var("POSEGATE_CASES").ok();
    asked
        .and_then(|cases| cases.parse().ok())
        .unwrap_or(crate::test_iterations(all, 4))
}

/// Random sets on and around every table; and on each, the sets of the same shape at the scales at which the filter changes its
/// answer, where it is nearest to being wrong.
#[test]
fn certain_permits_are_those_of_the_integer_code() {
    for (name, bytes) in TABLES {
        let table = Table::parse(bytes).unwrap();
        let mut runner = TestRunner::new(ProptestConfig::with_cases(cases(1_500)));
        let result = runner.run(&shares(), |shares| {
            let filter = Filter::new(&table, shares.radius());
            let (pose, covariance) = shares.on(&table);
            let at = |scale: f64| compared(name, &filter, pose, scaled(covariance, scale));
            let mut answer = at(1.0)?;
            // From scale to scale; where the answer changes, the two sides of the change.
            for k in -8..=8i32 {
                let (mut low, mut high) = (1.3f64.powi(k), 1.3f64.powi(k + 1));
                answer = if k == -8 { at(low)? } else { answer };
                let above = at(high)?;
                if above != answer {
                    for _ in 0..24 {
                        let middle = 0.5 * (low + high);
                        if at(middle)? == answer {
                            low = middle
                        } else {
                            high = middle
                        }
                    }
                    at(low)?;
                    at(high)?;
                }
                answer = above;
            }
            Ok(())
        });
        result.unwrap();
    }
}

/// As above, with the estimate moved to where the filter changes its answer.
#[test]
fn estimates_on_the_border_of_certainty_agree() {
    for (name, bytes) in TABLES {
        let table = Table::parse(bytes).unwrap();
        let mut runner = TestRunner::new(ProptestConfig::with_cases(cases(1_500)));
        let result = runner.run(
            &(shares(), -1.0f64..1.0, -1.0f64..1.0, -1.0f64..1.0),
            |(shares, dx, dy, dt)| {
                let filter = Filter::new(&table, shares.radius());
                let ([x, y, yaw], covariance) = shares.on(&table);
                let at = |by: f64| {
                    compared(
                        name,
                        &filter,
                        [x + by * dx, y + by * dy, yaw + by * dt],
                        covariance,
                    )
                };
                let (mut low, mut high) = (0.0, 1.0);
                let answer = at(low)?;
                if at(high)? != answer {
                    for _ in 0..30 {
                        let middle = 0.5 * (low + high);
                        if at(middle)? == answer {
                            low = middle
                        } else {
                            high = middle
                        }
                    }
                }
                at(low)?;
                at(high)?;
                Ok(())
            },
        );
        result.unwrap();
    }
}

/// The bounds of the set of integers hold along random directions.
#[test]
fn bounds_contain_the_factor() {
    let directions = proptest::array::uniform3(-1.0f64..1.0);
    let sigmas = proptest::array::uniform3(-4.2f64..0.6);
    let correlations = proptest::array::uniform3(-0.999f64..0.999);
    let mut runner = TestRunner::new(ProptestConfig::with_cases(cases(20_000)));
    let strategy = (directions, sigmas, correlations);
    let result = runner.run(&strategy, |([x, y, t], sigmas, [a, b, free])| {
        let radius = RadiusSquared::from_q16(743_498).unwrap();
        let sigma = sigmas.map(|power| 10f64.powf(power));
        let between = a * b + ((1.0 - a * a) * (1.0 - b * b)).sqrt() * free;
        let entry = |i: usize, j: usize, rho: f64| rho * sigma[i] * sigma[j];
        let (xy, xt, yt) = (entry(0, 1, between), entry(0, 2, a), entry(1, 2, b));
        let covariance = [
            [entry(0, 0, 1.0), xy, xt],
            [xy, entry(1, 1, 1.0), yt],
            [xt, yt, entry(2, 2, 1.0)],
        ];
        let Some(spread) = Spread::new([0.0; 3], &covariance, radius, Pose::default()) else {
            return Ok(());
        };
        let origin = Estimate {
            x_m: 0.0,
            y_m: 0.0,
            yaw_rad: 0.0,
        };
        let set = PoseSet::gaussian(origin, covariance, radius).unwrap();
        let Extent::Gaussian(factor) = set.extent() else {
            panic!("not an ellipsoid");
        };
        // Directions in which lengths and headings have equal weight.
        let r2 = f64::from(radius.q16()) / 65_536.0;
        let scale = [sigma[0] * 1e6, sigma[1] * 1e6, sigma[2]].map(|v| v * r2.sqrt());
        let along = [x / scale[0], y / scale[1], t / scale[2]];
        let turn = f64::from(factor.yaw_q24()) * core::f64::consts::TAU / 16_777_216.0;
        let rows = [factor.x_um(), factor.y_um()].map(|row| row.map(f64::from));
        let column =
            |k: usize, yaw: f64| along[0] * rows[0][k] + along[1] * rows[1][k] + along[2] * yaw;
        let square: f64 = [column(0, turn), column(1, 0.0), column(2, 0.0)]
            .map(|v| v * v)
            .iter()
            .sum();
        prop_assert!(square <= spread.above.along(along));
        prop_assert!(turn <= spread.turn);
        prop_assert!(
            rows.as_flattened()
                .iter()
                .map(|v| v * v)
                .sum::<f64>()
                .sqrt()
                <= spread.broad
        );
        Ok(())
    });
    result.unwrap();
}

/// Invalid and unusual input is left to the integer code.
#[test]
fn unusual_numbers_are_not_certain() {
    let table = Table::parse(TABLES[0].1).unwrap();
    let filter = Filter::new(&table, table.radius_squared());
    let good = [[1e-4, 0.0, 0.0], [0.0, 1e-4, 0.0], [0.0, 0.0, 1e-5]];
    assert!(filter.is_certain([0.0; 3], &good));
    for k in 0..3 {
        for bad in [f64::NAN, f64::INFINITY, 1e300, 16_384.0] {
            let mut pose = [0.0; 3];
            pose[k] = bad;
            assert!(!filter.is_certain(pose, &good), "{pose:?}");
        }
        for other in 0..3 {
            for bad in [f64::NAN, f64::INFINITY, -1e-4, 1e6] {
                let mut covariance = good;
                covariance[k][other] = bad;
                assert!(!filter.is_certain([0.0; 3], &covariance), "{covariance:?}");
            }
        }
    }
    assert!(!filter.is_certain([0.0; 3], &[[0.0; 3]; 3]));
}

/// Each answer is in the row of its set, also beyond one chunk of a thread.
#[test]
fn answers_are_in_the_order_of_the_sets() {
    let table = Table::parse(TABLES[4].1).unwrap();
    let radius = table.radius_squared();
    let covariance = [[1e-3, 0.0, 0.0], [0.0, 1e-3, 0.0], [0.0, 0.0, 1e-4]];
    let poses: Vec<[f64; 3]> = (0..3 * CHUNK + 7)
        .map(|k| match k % 5 {
            0 => [f64::NAN, 0.0, 0.0],
            1 => [0.0, 0.0, 0.0],
            2 => [0.0, 9.0, 0.0],
            _ => [0.001 * (k % 700) as f64, 0.0, 0.3],
        })
        .collect();
    let found = decide_many(&table, radius, &poses, &std::vec![covariance; poses.len()]);
    assert_eq!(found.len(), poses.len());
    for (pose, found) in poses.iter().zip(&found) {
        assert_eq!(*found, by_integers(&table, radius, *pose, covariance));
    }
    assert_eq!(found[2], Ok(Decision::Outside(Cause::OffTable)));
}

/// The filter permits at least four of ten sets that a table contains; otherwise it would be useless. Cells are left to the integer code.
#[test]
fn many_permits_are_certain() {
    for (name, bytes) in TABLES {
        let table = Table::parse(bytes).unwrap();
        let (mut certain, mut permitted) = (0, 0);
        let mut runner = TestRunner::deterministic();
        for _ in 0..2_000 {
            let shares = plain().new_tree(&mut runner).unwrap().current();
            let (pose, covariance) = shares.on(&table);
            let found = by_integers(&table, shares.radius(), pose, covariance);
            if found == Ok(Decision::Inside) {
                permitted += 1;
                let filter = Filter::new(&table, shares.radius());
                certain += i32::from(filter.is_certain(pose, &covariance));
            }
        }
        std::eprintln!("{name}: {certain} of {permitted} certain");
        if table.facets().is_some() {
            assert!(permitted > 20, "{name}: {permitted}");
            assert!(
                certain * 10 >= permitted * 4,
                "{name}: {certain} of {permitted}"
            );
        } else {
            assert_eq!(certain, 0, "{name}");
        }
    }
}
