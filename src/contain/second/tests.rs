use super::*;
use crate::contain::{Decision, decide};
use crate::report::Heading;
use crate::set::{CrossTerms, Estimate, Inflation, SplitWeight, Uncertainty};
use crate::table::{Axes, Table};
use proptest::prelude::*;

const SEE_T7: &[u8] = include_bytes!("../../../examples/tables/see-t7.posegate");
const SEE_T7_GRID: &[u8] = include_bytes!("../../../examples/tables/see-t7-grid.posegate");
const DOCK: &[u8] = include_bytes!("../../../examples/tables/dock.posegate");

/// Standard deviations, and correlations xy, x-yaw, y-yaw.
fn gaussian([x, y, t]: [f64; 3], [xy, xt, yt]: [f64; 3]) -> Uncertainty {
    Uncertainty::Gaussian([
        [x * x, xy * x * y, xt * x * t],
        [xy * x * y, y * y, yt * y * t],
        [xt * x * t, yt * y * t, t * t],
    ])
}

fn small() -> PoseEstimate {
    let estimate = Estimate {
        x_m: 0.01,
        y_m: -0.01,
        yaw_rad: 0.01,
    };
    PoseEstimate::new(estimate, gaussian([0.01, 0.01, 0.0035], [0.3, 0.2, 0.4]))
}

fn confirms(table: &[u8], belief: &PoseEstimate) -> bool {
    opinion(table, belief, Trust::FULL) == INSIDE
}

/// Correlations that no covariance has: above 1, or three that contradict each other.
#[test]
fn an_impossible_covariance_is_not_inside() {
    let deviations = [0.01, 0.01, 0.0035];
    let says = |correlations| PoseEstimate {
        spread: Some(gaussian(deviations, correlations)),
        ..small()
    };
    for [xy, xt, yt] in [[0.9, 0.9, 0.8], [-0.99, 0.0, 0.0], [0.0, 0.5, -0.8]] {
        assert!(confirms(DOCK, &says([xy, xt, yt])), "{xy} {xt} {yt}");
    }
    for [xy, xt, yt] in [
        [1.1, 0.0, 0.0],
        [0.0, -1.01, 0.0],
        [0.0, 0.0, 1.5],
        [0.9, 0.9, -0.8],
        [-0.8, 0.8, 0.8],
    ] {
        assert!(!confirms(DOCK, &says([xy, xt, yt])), "{xy} {xt} {yt}");
    }
}

#[test]
fn the_words_are_far_apart_and_far_from_nothing() {
    assert_eq!(INSIDE.count_ones(), 16);
    assert_eq!(INSIDE ^ OUTSIDE, u32::MAX);
    for byte in INSIDE.to_le_bytes() {
        assert_eq!(byte.count_ones(), 4);
    }
}

#[test]
fn what_is_no_belief_is_not_inside() {
    for table in [SEE_T7, SEE_T7_GRID] {
        assert!(confirms(table, &small()));
        let with = |change: &dyn Fn(&mut PoseEstimate)| {
            let mut belief = small();
            change(&mut belief);
            confirms(table, &belief)
        };
        assert!(with(&|_| ()));
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300] {
            assert!(!with(&|b| b.x_m = bad));
            assert!(!with(&|b| b.y_m = -bad));
            assert!(!with(&|b| b.heading = Heading::Radians(bad)));
            assert!(!with(
                &|b| b.heading = Heading::RollPitchYaw([bad, 0.0, 0.0])
            ));
            assert!(!with(
                &|b| b.heading = Heading::RollPitchYaw([0.0, bad, 0.0])
            ));
            assert!(!with(
                &|b| b.heading = Heading::Quaternion([0.0, 0.0, bad, 1.0])
            ));
        }
        assert!(with(
            &|b| b.heading = Heading::RollPitchYaw([0.06, -0.06, 0.01])
        ));
        assert!(!with(
            &|b| b.heading = Heading::RollPitchYaw([0.07, 0.0, 0.01])
        ));
        assert!(with(
            &|b| b.heading = Heading::Quaternion([0.0, 0.0, 0.0, -1.0])
        ));
        for none in [[0.0; 4], [0.0, 0.0, 0.0, 1.001], [0.05, 0.0, 0.0, 0.99875]] {
            assert!(
                !with(&|b| b.heading = Heading::Quaternion(none)),
                "{none:?}"
            );
        }
        assert!(!with(&|b| b.spread = None));
        for axis in 0..3 {
            for bad in [0.0, -0.0, -1e-4, f64::NAN, f64::INFINITY] {
                let change = |b: &mut PoseEstimate| {
                    if let Some(Uncertainty::Gaussian(covariance)) = &mut b.spread {
                        covariance[axis][axis] = bad;
                    }
                };
                assert!(!with(&change), "{axis} {bad}");
            }
        }
        for (row, column) in [(0, 1), (0, 2), (1, 2)] {
            // Not a number, or far more than the variances allow.
            for bad in [f64::NAN, f64::INFINITY, 1e3] {
                let change = |b: &mut PoseEstimate| {
                    if let Some(Uncertainty::Gaussian(covariance)) = &mut b.spread {
                        covariance[row][column] = bad;
                    }
                };
                assert!(!with(&change), "{row} {column} {bad}");
            }
        }
        for bad in [0.0, -0.0, -0.1, f64::NAN, f64::INFINITY, 1e300] {
            let bounded = |translation_m, yaw_rad| {
                with(&|b| {
                    b.spread = Some(Uncertainty::Bounded {
                        translation_m,
                        yaw_rad,
                    });
                })
            };
            assert!(bounded(0.01, 0.01));
            assert!(!bounded(bad, 0.01), "{bad}");
            assert!(!bounded(0.01, bad), "{bad}");
        }
    }
}

/// A hundredfold covariance reduces the allowed size to a tenth, for every cause.
#[test]
fn trust_counts() {
    for table in [SEE_T7, SEE_T7_GRID] {
        let all = |inflation: f64, cross_terms| {
            let trust = Trust {
                inflation: Inflation::new(inflation).unwrap(),
                cross_terms,
            };
            opinion(table, &small(), trust) == INSIDE
        };
        let share = |raw| SplitWeight::from_q8(raw).unwrap();
        assert!(all(1.0, CrossTerms::Filled) && all(20.0, CrossTerms::Filled));
        assert!(!all(4000.0, CrossTerms::Filled));
        assert!(all(1.0, CrossTerms::YawUnknown(share(128))));
        assert!(!all(100.0, CrossTerms::YawUnknown(share(2))));
        assert!(!all(100.0, CrossTerms::YawUnknown(share(254))));
        assert!(all(1.0, CrossTerms::AllUnknown(share(128))));
        assert!(!all(100.0, CrossTerms::AllUnknown(share(2))));
    }
}

/// The shares of x, y and yaw, if their cross terms are unknown, add up to at most the whole.
#[test]
fn shares_of_what_is_unknown_are_no_more_than_the_whole() {
    let belief = small();
    let Some(Uncertainty::Gaussian(covariance)) = &belief.spread else {
        unreachable!()
    };
    for share in 1..=u8::MAX {
        let share = SplitWeight::from_q8(share).unwrap();
        for (cross_terms, blocks) in [
            (CrossTerms::YawUnknown(share), 1.0),
            (CrossTerms::AllUnknown(share), 2.0),
        ] {
            let question = believed::Question {
                belief: &belief,
                trust: Trust {
                    cross_terms,
                    ..Trust::FULL
                },
                radius_q16: 743_498,
                moved_um: 0,
                side_um: 0,
                swing: 0,
            };
            let set = question.ellipsoid(covariance).unwrap();
            let [plane, yaw] = [set.plane, set.yaw].map(|w| 743_498.0 / 65536.0 / w.value());
            let whole = blocks * plane + yaw;
            assert!((0.99..1.0 + 1e-8).contains(&whole), "{share:?}: {whole}");
        }
    }
}

/// Returns the least slack of a facet beyond the required slack, metres, from the parsed table in floats; and
/// the same with the tolerance of the module head.
fn by_floats(table: &Table<'_>, [x, y, yaw]: [f64; 3], covariance: [[f64; 3]; 3]) -> [f64; 2] {
    let layout = table.facets().unwrap();
    let unit = f64::from(1u32 << layout.unit()) * 1e-6;
    let r2 = f64::from(table.radius_squared().q16()) / 65536.0;
    let (s, c) = yaw.sin_cos();
    let (mut exact, mut lenient) = (f64::INFINITY, f64::INFINITY);
    for piece in layout.pieces() {
        for frame in piece.frames() {
            let point = [f64::from(frame.x) * unit, f64::from(frame.y) * unit];
            let out = |[x, y]: [f64; 2]| [c * x - s * y, s * x + c * y];
            let (at, lever, is_robot): ([f64; 2], [f64; 2], _) = match frame.axes {
                Axes::World => {
                    let arm = out(point);
                    ([x + arm[0], y + arm[1]], [-arm[1], arm[0]], false)
                }
                Axes::Robot => {
                    let (dx, dy) = (x - point[0], y - point[1]);
                    let seen = [c * dx + s * dy, c * dy - s * dx];
                    (seen, [seen[1], -seen[0]], true)
                }
            };
            let turns = lever != [0.0; 2];
            let tolerance = unit
                * (0.71 * (1.0 + 0.5f64.powi(i32::from(layout.unit()))) * 1.005
                    + 1.0 / 60.0
                    + if turns {
                        0.8 + 5.73e-5 * 1.13 * lever[0].hypot(lever[1]) / unit
                    } else {
                        0.0
                    });
            for facet in frame.facets() {
                let a = [f64::from(facet.x) / 16384.0, f64::from(facet.y) / 16384.0];
                let world = if is_robot { out(a) } else { a };
                let spare = f64::from(facet.b) * unit - a[0] * at[0] - a[1] * at[1];
                let g = [world[0], world[1], a[0] * lever[0] + a[1] * lever[1]];
                let pg: Vec<f64> = covariance
                    .iter()
                    .map(|row| row.iter().zip(g).map(|(p, g)| p * g).sum())
                    .collect();
                let square: f64 = pg.iter().zip(g).map(|(p, g)| p * g).sum();
                let reach = (r2 * square).sqrt();
                let mut needs = reach;
                if is_robot {
                    // The touching point's offset across the normal, times its yaw.
                    let touch: Vec<f64> = pg.iter().map(|v| v * r2 / reach).collect();
                    let across = world[1] * touch[0] - world[0] * touch[1];
                    needs = reach.min(reach - touch[2] * across);
                }
                let largest = (r2 * (covariance[0][0] + covariance[1][1])).sqrt()
                    + (r2 * covariance[2][2]).sqrt() * f64::from(layout.lever()) * unit;
                exact = exact.min(spare - needs);
                lenient = lenient.min(spare + tolerance + 6e-4 * largest - needs);
            }
        }
    }
    [exact, lenient]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(20_000))]

    /// Sets that floats find inside are confirmed. Sets that floats find outside by more than the
    /// tolerances of the module head are not.
    #[test]
    fn the_formula_is_the_plain_one(
        at in (-1.5f64..1.5, -1.0f64..1.0, -0.3f64..0.3),
        size in -5.0f64..-0.3,
        shape in proptest::array::uniform3(-2.0f64..0.0),
        rows in proptest::array::uniform9(-1.0f64..1.0),
        dock: bool,
    ) {
        let (bytes, at) = if dock {
            (DOCK, [at.0 * 0.05, at.1 * 0.05, at.2 * 0.2])
        } else {
            (SEE_T7, [at.0, at.1, at.2])
        };
        let table = Table::parse(bytes).unwrap();
        let size = 10f64.powf(size) * if dock { 0.1 } else { 0.3 };
        let deviation = shape.map(|v| size * 10f64.powf(v));
        let mut covariance = [[0.0; 3]; 3];
        for i in 0..3 {
            for j in 0..3 {
                let dot: f64 = (0..3).map(|k| rows[3 * i + k] * rows[3 * j + k]).sum();
                covariance[i][j] = dot * deviation[i] * deviation[j] + if i == j { 1e-14 } else { 0.0 };
            }
        }
        let [x_m, y_m, yaw_rad] = at;
        let belief = PoseEstimate::new(Estimate { x_m, y_m, yaw_rad }, Uncertainty::Gaussian(covariance));
        let [exact, lenient] = by_floats(&table, at, covariance);
        // The arc of headings is checked separately.
        let turn = (covariance[2][2] * 11.3449f64).sqrt();
        let (arc, limit) = if dock { (4f64, 10.0) } else { (20.0, 0.5) };
        let arc = arc.to_radians();
        let in_arc = at[2].abs() + turn < arc - 1e-6 && turn < limit;
        let confirmed = confirms(bytes, &belief);
        if in_arc && exact >= 1e-9 {
            prop_assert!(confirmed, "{exact:e}");
        }
        // The plain formula is linear in the yaw: by up to half of the lever, and of the extent, times the turn's square it errs, and then
        // sections decide. Beyond half a radian they always do.
        let extent = ((covariance[0][0] + covariance[1][1]) * 11.3449f64).sqrt();
        let lever = if dock { 0.0 } else { 6.0 + extent };
        let is_linear = dock || turn < 0.5;
        // Sections allow 2^-11 of the extent and 18 units: the largest of extent and L times the turn has 2^13 of them at least.
        let sections = if dock {
            0.0
        } else {
            (0.5f64.powi(11) + 18.0 * 0.5f64.powi(13)) * extent.max(2.0 * lever * turn)
        };
        let beyond = lenient + sections + 0.5 * lever * turn * turn;
        if is_linear && beyond < -1e-9 || at[2].abs() + turn > arc + 1e-6 {
            prop_assert!(!confirmed, "{lenient:e}");
        }
    }

    /// For any bits of an estimate and any bytes in and after a header there is an answer without panic.
    #[test]
    fn nothing_panics(
        numbers in proptest::array::uniform14(any::<u64>()),
        kind in 0..4usize,
        cut in 0..400usize,
        changes in proptest::collection::vec((0..400usize, any::<u8>()), 0..30),
        radius in any::<u32>(),
        share in 1u8..,
        grid: bool,
    ) {
        let number = |k: usize| f64::from_bits(numbers[k]);
        let heading = match kind {
            0 => Heading::Radians(number(2)),
            1 => Heading::RollPitchYaw([number(2), number(3), number(4)]),
            _ => Heading::Quaternion([number(2), number(3), number(4), number(5)]),
        };
        let row = |k: usize| [number(k), number(k + 1), number(k + 2)];
        let spread = if kind == 3 {
            Uncertainty::Bounded { translation_m: number(6), yaw_rad: number(7) }
        } else {
            Uncertainty::Gaussian([row(6), row(8), row(11)])
        };
        let belief = PoseEstimate { x_m: number(0), y_m: number(1), heading, spread: Some(spread) };
        let share = SplitWeight::from_q8(share).unwrap();
        let trust = Trust {
            inflation: Inflation::from_q16(radius).unwrap_or(Inflation::NONE),
            cross_terms: [CrossTerms::Filled, CrossTerms::YawUnknown(share), CrossTerms::AllUnknown(share)][kind % 3],
        };
        let mut bytes = if grid { SEE_T7_GRID } else { SEE_T7 }.to_vec();
        let _ = opinion(&bytes, &belief, trust);
        for (at, value) in changes {
            if let Some(byte) = bytes.get_mut(at) {
                *byte = value;
            }
        }
        for belief in [belief, small(), PoseEstimate { spread: belief.spread, ..small() }] {
            let _ = opinion(&bytes, &belief, trust);
            let end = bytes.len().saturating_sub(cut);
            let _ = opinion(&bytes[..end], &belief, trust);
        }
    }
}

/// The parsed table's borders are moved outwards by 0.5 m: the first evaluation permits by them, the
/// second reads the flash.
#[test]
fn a_table_that_fell_over_in_memory_permits_nothing() {
    let mut wide = SEE_T7.to_vec();
    let end = wide.len() - 4;
    // The end of the facet layout, from the header.
    let word = |at: usize| usize::from(wide[at]) + 256 * usize::from(wide[at + 1]);
    let facets = word(76) + word(80);
    for facet in 0..15 {
        let at = facets - 6 * facet - 2;
        let b = i16::from_le_bytes([wide[at], wide[at + 1]]) + 2000;
        wide[at..at + 2].copy_from_slice(&b.to_le_bytes());
    }
    // The largest offset is changed too.
    wide[186..188].copy_from_slice(&9000u16.to_le_bytes());
    let crc = crate::table::checksum(&wide[..end]).to_le_bytes();
    wide[end..].copy_from_slice(&crc);
    let fallen = Table::parse(&wide).unwrap();
    let mut wrong = 0;
    for step in 0..200 {
        let mut belief = small();
        belief.y_m = 0.02 * f64::from(step);
        let set = belief
            .pose_set(fallen.radius_squared(), Trust::FULL)
            .unwrap();
        let healthy = decide(&Table::parse(SEE_T7).unwrap(), &set) == Decision::Inside;
        if decide(&fallen, &set) == Decision::Inside && !healthy {
            wrong += 1;
            assert!(!confirms(SEE_T7, &belief), "{belief:?}");
        }
        assert!(!healthy || confirms(SEE_T7, &belief));
    }
    assert!(wrong >= 20, "{wrong}");
}
