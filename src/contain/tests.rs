use super::support::{SupportPoint, dot, held, reach, squared_length, wide_square};
use super::*;
use crate::num::BinaryAngle;
use crate::set::{Estimate, RadiusSquared, SqrtFactor};
use crate::table::tests::{Rows, table_of};
use proptest::prelude::*;

#[test]
fn products_of_rows_are_exact() {
    assert_eq!(dot([1, -2, 3], [4, 5, -6]), 4 - 10 - 18);
    let most = (1 << 30) - 1;
    let square = i64::from(most) * i64::from(most);
    assert_eq!(dot([most; 3], [-most; 3]), -3 * square);
    assert_eq!(squared_length([2, -3, 6]), 49);
    assert_eq!(wide_square(-(1 << 40)), 1 << 80);
}

/// A row of length 5000 with 3 of 5 parts from the yaw: its farthest point is at 60 of 100.
#[test]
fn the_farthest_point_is_held_at_the_nearer_limit() {
    for sign in [1, -1] {
        let best = 60 * i64::from(sign);
        let at = |low, high| held([3000 * sign, 0, 4000], 100, [low, high]);
        for (low, high) in [(-1, 1), (0, 9), (-9, 0), (0, 0)] {
            assert_eq!(at(best + low, best + high), SupportPoint::Free);
        }
        assert_eq!(at(best + 1, best + 9), SupportPoint::At(best + 1));
        assert_eq!(at(best - 9, best - 1), SupportPoint::At(best - 1));
        // Beyond zero, and at zero.
        let nearer = |limit: i64| [limit, -limit][usize::from(sign < 0)];
        let [low, high] = [nearer(-65).min(nearer(-55)), nearer(-65).max(nearer(-55))];
        assert_eq!(at(low, high), SupportPoint::At(nearer(-55)));
        assert_eq!(
            at(nearer(-9).min(0), nearer(-9).max(0)),
            SupportPoint::At(0),
            "{sign}"
        );
    }
    let level = |low, high| held([0, 3000, 4000], 100, [low, high]);
    assert_eq!(
        (level(0, 9), level(-9, 0)),
        (SupportPoint::Free, SupportPoint::Free)
    );
    assert_eq!(
        (level(1, 9), level(-9, -1)),
        (SupportPoint::At(1), SupportPoint::At(-1))
    );
}

#[test]
fn reaches_are_rounded_up() {
    let row = [3000, 0, 4000];
    assert_eq!(reach(row, 100, SupportPoint::Free), 5000);
    assert_eq!(reach([3000, 1, 4000], 100, SupportPoint::Free), 5001);
    for (offset, expected) in [(60, 5000), (0, 4000), (100, 3000), (-100, -3000)] {
        assert_eq!(reach(row, 100, SupportPoint::At(offset)), expected);
    }
    assert_eq!(reach([1, 0, 0], 2, SupportPoint::At(1)), 1);
    assert_eq!(reach([1, 0, 0], 2, SupportPoint::At(-1)), 0);
}

const fn bounded(translation_um: i32, yaw_q24: i32) -> Extent {
    Extent::Bounded {
        translation_um,
        yaw_q24,
    }
}

/// Returns the largest reach of a row for yaw offsets in a window, in doubles.
fn farthest(yaw: i32, row: [i32; 3], window: [f64; 2]) -> f64 {
    let whole = f64::from(yaw);
    let [first, second, third] = row.map(f64::from);
    let length = first.hypot(second).hypot(third);
    let best = if length > 0.0 {
        whole * first / length
    } else {
        0.0
    };
    let share = best.clamp(window[0], window[1]).clamp(-whole, whole) / whole;
    first * share + (1.0 - share * share).sqrt() * second.hypot(third)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(crate::test_iterations(2_000, 40)))]
    #[test]
    fn reaches_in_a_window_are_those_of_doubles(
        yaw in 1i32..1 << 24,
        row in proptest::array::uniform3(-(1i32 << 28)..1 << 28),
        ends in [-1.0f64..1.0, -1.0f64..1.0],
    ) {
        let mut window = ends.map(|end| (end * f64::from(yaw)) as i64);
        window.sort_unstable();
        let found = reach(row, yaw, held(row, yaw, window)) as f64;
        let expected = farthest(yaw, row, window.map(|v| v as f64));
        // The root in the window is of whole units of yaw.
        let most = 2.0 + 1.0 / f64::from(yaw) * f64::from(row[1]).hypot(row[2].into());
        prop_assert!(found >= expected - 1e-3 && found <= expected + most, "{found} {expected}");
    }
}

/// A small set at a goal of 225 degrees that can grow 79 times: the rounding of its rotation into the
/// goal frame, 0.22 um, must not grow with it.
#[test]
fn a_margin_does_not_multiply_roundings() {
    let table = Table::parse(include_bytes!("../../tests/data/whole-circle.posegate")).unwrap();
    let mean = Pose {
        x_um: -1_500_257_274,
        y_um: 880_123_680,
        yaw: BinaryAngle(2_686_093_836),
    };
    let factor = SqrtFactor {
        yaw: 3,
        x: [0, 5462, 0],
        y: [0, 0, 38],
    };
    let set = PoseSet::of(mean, Extent::Gaussian(factor));
    let Examination { margin, .. } = examine(&table, &set);
    let margin = f64::from(margin.q16()) / 65_536.0;
    // From the estimate to the wall, which begins 0.7 m above the lower corner of the cells.
    let root = 0.5f64.sqrt();
    let away = f64::from(mean.x_um + 1_500_250_000) + f64::from(mean.y_um - 880_125_000);
    let room = 300_000.0 - root * away;
    let reach = root * 5462f64.hypot(38.0);
    assert!(margin * reach <= room, "{margin} {room}");
    assert!(margin * reach > 0.999 * room - 10.0, "{margin} {room}");
}

/// A grid of 10 by 10 cells of a millimetre, for a disc of a millimetre and 10 yaw units: with the slack
/// the disc reaches 1006 um and 2816 units of a binary angle.
const MILLIMETRES: Cells = Cells {
    x_lo_um: -5_000,
    y_lo_um: -5_000,
    step_um: 1_000,
    columns: 10,
    rows: 10,
    yaw_lo: BinaryAngle(0),
    yaw_span: 1 << 24,
    slabs: 4,
};
const WHOLE: Cells = Cells {
    yaw_span: 1 << 32,
    ..MILLIMETRES
};
const REACH: i64 = 11 * 256;

type Runs = Vec<(u16, u16)>;

fn full(cells: &Cells) -> Vec<Vec<Runs>> {
    let row = vec![(0, cells.columns - 1)];
    vec![vec![row; usize::from(cells.rows)]; usize::from(cells.slabs)]
}

fn bytes_of(cells: &Cells, slabs: Vec<Vec<Runs>>) -> Vec<u8> {
    let rows: Vec<Rows> = slabs
        .into_iter()
        .map(|runs| Rows { first_row: 0, runs })
        .collect();
    table_of(cells, &rows, true)
}

fn walk(bytes: &[u8], mean: [i64; 3], extent: Extent) -> bool {
    let table = Table::parse(bytes).unwrap();
    let grid = table.grid().unwrap();
    grid::covers(grid, table.cells(), mean, extent, u32::MAX).is_ok()
}

/// The same for an ellipsoid that is a line in x, with the rest of a disc by a movement.
fn walk_disc(bytes: &[u8], mean: [i64; 3]) -> bool {
    let found = walk(bytes, mean, bounded(1_000, 10));
    let factor = SqrtFactor {
        yaw: 4,
        x: [0; 3],
        y: [0; 3],
    };
    let by = crate::set::Growth::new(1_000, 6);
    assert_eq!(walk(bytes, mean, Extent::Grown { factor, by }), found);
    found
}

#[test]
fn a_set_touches_the_ends_of_the_table() {
    let bytes = bytes_of(&MILLIMETRES, full(&MILLIMETRES));
    let span = 1 << 24;
    let good = [5_000, 5_000, REACH];
    assert!(walk_disc(&bytes, good));
    for (axis, at) in [
        (0, [1_006, 1_005]),
        (0, [8_994, 8_995]),
        (1, [1_006, 1_005]),
        (1, [8_994, 8_995]),
        (2, [REACH, REACH - 1]),
        (2, [span - REACH, span - REACH + 1]),
    ] {
        let mut mean = [5_000, 5_000, 1 << 23];
        mean[axis] = at[0];
        assert!(walk_disc(&bytes, mean), "{mean:?}");
        mean[axis] = at[1];
        assert!(!walk_disc(&bytes, mean), "{mean:?}");
    }
}

#[test]
fn a_set_touches_the_ends_of_runs_and_rows() {
    let with = |change: &dyn Fn(&mut Vec<Runs>)| {
        let mut slabs = full(&MILLIMETRES);
        slabs.iter_mut().for_each(change);
        bytes_of(&MILLIMETRES, slabs)
    };
    let runs = with(&|rows| {
        rows.iter_mut()
            .for_each(|row| *row = vec![(0, 0), (2, 6), (8, 9)])
    });
    let rows = with(&|rows| {
        rows[1].clear();
        rows[7].clear();
    });
    for (bytes, axis, [low, high]) in [(runs, 0, [3_006, 5_994]), (rows, 1, [3_006, 5_994])] {
        for (at, expected) in [
            (low, true),
            (low - 1, false),
            (high, true),
            (high + 1, false),
        ] {
            let mut mean = [5_000, 5_000, 1 << 23];
            mean[axis] = at;
            assert_eq!(walk_disc(&bytes, mean), expected, "{mean:?}");
        }
    }
}

/// A set that leans in x with its yaw needs in each slab only the cells of its part there. This includes
/// the slack in yaw, which is one cell if the set leans by one cell per yaw unit.
#[test]
fn a_leaning_set_needs_the_cells_of_its_parts() {
    for (columns, yaw_span, yaw, lean) in [
        (40, 1 << 24, 30_000, 15_000),
        (40, 1 << 24, 30_000, -15_000),
        (1_100, 1 << 18, 500, 500_000),
        (1_100, 1 << 18, 500, -500_000),
    ] {
        let cells = Cells {
            columns,
            yaw_span,
            ..MILLIMETRES
        };
        let middle = i64::from(columns) * 500;
        let factor = SqrtFactor {
            yaw,
            x: [lean, 1_000, 0],
            y: [0, 0, 1_000],
        };
        let mut slabs = full(&cells);
        for (k, rows) in slabs.iter_mut().enumerate() {
            let width = yaw_span as f64 / 1024.0;
            let low = (k as f64 - 2.0) * width;
            let yaw = [low - 1.0, low + width + 1.0];
            let end = |row: [i32; 3]| farthest(factor.yaw, row, yaw) + 6.0;
            let left = middle as f64 - end(factor.x.map(|v| -v));
            let right = middle as f64 + end(factor.x);
            let ends = [left, right].map(|x| x / 1e3);
            rows.fill(vec![(ends[0].floor() as u16, ends[1].ceil() as u16 - 1)]);
        }
        assert_ne!(slabs[0], slabs[1]);
        let mean = [middle, 5_000, yaw_span as i64 / 2];
        let ask = |slabs| walk(&bytes_of(&cells, slabs), mean, Extent::Gaussian(factor));
        assert!(ask(slabs.clone()));
        for k in 0..4 {
            let (first, last) = slabs[k][5][0];
            for run in [(first + 1, last), (first, last - 1)] {
                let mut slabs = slabs.clone();
                slabs[k][5] = vec![run];
                assert!(!ask(slabs), "{k} {run:?}");
            }
        }
    }
}

#[test]
fn a_set_touches_the_ends_of_slabs() {
    let without = |cells: &Cells, k: usize| {
        let mut slabs = full(cells);
        slabs[k] = vec![vec![]; usize::from(cells.rows)];
        bytes_of(cells, slabs)
    };
    let ask = |bytes: &[u8], yaw: i64| walk_disc(bytes, [5_000, 5_000, yaw]);
    let edge = 1 << 22;
    let bytes = without(&MILLIMETRES, 1);
    assert!(ask(&bytes, edge - REACH - 1) && !ask(&bytes, edge - REACH));
    assert!(ask(&bytes, 2 * edge + REACH) && !ask(&bytes, 2 * edge + REACH - 1));
    // The lowest heading is in the first slab; its range does not begin a turn early.
    assert!(!ask(&without(&MILLIMETRES, 0), REACH));
    let bytes = without(&WHOLE, 3);
    assert!(ask(&bytes, REACH) && !ask(&bytes, REACH - 1));
    let bytes = without(&WHOLE, 0);
    let turn = 1 << 32;
    assert!(ask(&bytes, turn - REACH - 1) && !ask(&bytes, turn - REACH));
}

/// The yaw error is a real number: a set that leans with its heading is farthest out beyond half a turn, where the heading is that of a
/// smaller error of the other side.
#[test]
fn a_set_is_walked_beyond_half_a_turn() {
    let cells = Cells {
        x_lo_um: -50_000,
        columns: 100,
        ..WHOLE
    };
    let section = |yaw: i32| {
        Extent::Gaussian(SqrtFactor {
            yaw,
            x: [40_000, 10, 0],
            y: [0, 0, 10],
        })
    };
    let bytes = bytes_of(&cells, full(&cells));
    assert!(walk(&bytes, [50_000, 5_000, 0], section(1 << 24)));
    let mut slabs = full(&cells);
    // Headings from three quarters of a turn: a quarter to one side, or three to the other.
    slabs[3] = vec![vec![(0, 55)]; 10];
    let bytes = bytes_of(&cells, slabs);
    let at = 0;
    // With half a turn at most, x is at most that of the estimate there.
    let to_the_left = |yaw: i32| walk(&bytes, [45_000, 5_000, at], section(yaw));
    assert!(to_the_left(1 << 23));
    assert!(!to_the_left((1 << 24) - 1));
}

/// Cells of 10 cm: 2 m by 2 m, and 9 degrees in 4 slabs.
const DECIMETRES: Cells = Cells {
    x_lo_um: -1_000_000,
    y_lo_um: -1_000_000,
    step_um: 100_000,
    columns: 20,
    rows: 20,
    yaw_lo: BinaryAngle(-(5 << 24) as u32),
    yaw_span: 10 << 24,
    slabs: 4,
};

/// Returns a bounded set relative to the goal frame of `table_of`: a quarter turn about `(2, -1)` m.
fn disc_at(x_um: i32, y_um: i32, yaw_rad: f64, radius_um: u32, spread_rad: f64) -> PoseSet {
    PoseSet::bounded(
        estimate(x_um, y_um, yaw_rad),
        (f64::from(radius_um) - 0.5) * 1e-6,
        spread_rad,
    )
    .unwrap()
}

fn estimate(x_um: i32, y_um: i32, yaw_rad: f64) -> Estimate {
    Estimate {
        x_m: 2.0 - f64::from(y_um) * 1e-6,
        y_m: -1.0 + f64::from(x_um) * 1e-6,
        yaw_rad: core::f64::consts::FRAC_PI_2 + yaw_rad,
    }
}

/// Returns a Gaussian set of independent sigmas in the goal frame: x, y, yaw.
fn gaussian_at(x_um: i32, y_um: i32, sigma: [f64; 3]) -> PoseSet {
    let [x, y, yaw] = sigma.map(|s| s * s);
    let p = [[y, 0.0, 0.0], [0.0, x, 0.0], [0.0, 0.0, yaw]];
    let radius = RadiusSquared::from_q16(9 << 16).unwrap();
    PoseSet::gaussian(estimate(x_um, y_um, 0.0), p, radius).unwrap()
}

const OUT: Decision = Decision::Outside(Cause::NotContained);

#[test]
fn a_set_is_too_large_or_off_the_table_on_each_axis() {
    let bytes = bytes_of(&DECIMETRES, full(&DECIMETRES));
    let table = Table::parse(&bytes).unwrap();
    let large = Decision::Outside(Cause::TooLarge);
    let off = Decision::Outside(Cause::OffTable);
    assert_eq!(
        decide(&table, &disc_at(0, 0, 0.0, 999_000, 0.1)),
        Decision::Inside
    );
    // 5/256 turn to either side are 0.1227 rad.
    for (radius, spread) in [(1_000_001, 0.1), (999_000, 0.123)] {
        assert_eq!(decide(&table, &disc_at(0, 0, 0.0, radius, spread)), large);
    }
    assert_eq!(decide(&table, &disc_at(0, 0, 0.0, 1_000_000, 0.1227)), OUT);
    for (x, y, yaw) in [
        (1_000_100, 0, 0.0),
        (-1_000_100, 0, 0.0),
        (0, 1_000_100, 0.0),
        (0, -1_000_100, 0.0),
        (0, 0, 0.123),
        (0, 0, -0.123),
        (-300_000_000, 0, 0.0),
    ] {
        let set = disc_at(x, y, yaw, 1_000, 0.01);
        assert_eq!(decide(&table, &set), off, "{x} {y} {yaw}");
        let examination = examine(&table, &set);
        assert_eq!(examination.decision, off);
        assert_eq!(
            (examination.margin.q16(), examination.worst_pose),
            (0, Some(set.mean()))
        );
    }
    let sigma = [0.01, 0.01, 0.01];
    assert_eq!(decide(&table, &gaussian_at(0, 0, sigma)), Decision::Inside);
    assert_eq!(
        decide(&table, &gaussian_at(0, 0, [0.33, 0.33, 0.04])),
        Decision::Inside
    );
    for axis in 0..3 {
        let mut sigma = sigma;
        sigma[axis] = [0.334, 0.334, 0.042][axis];
        assert_eq!(decide(&table, &gaussian_at(0, 0, sigma)), large, "{axis}");
    }
    // A narrow table: each axis has its own width, and the yaw has no limit.
    let narrow = Cells {
        columns: 4,
        yaw_span: 1 << 32,
        ..DECIMETRES
    };
    let bytes = bytes_of(&narrow, full(&narrow));
    let table = Table::parse(&bytes).unwrap();
    let centre = -800_000;
    assert_eq!(
        decide(&table, &disc_at(centre, 0, 0.0, 200_001, 0.1)),
        large
    );
    assert_eq!(
        decide(&table, &disc_at(centre, 0, 0.0, 199_000, 9.0)),
        Decision::Inside
    );
    assert_eq!(
        decide(&table, &gaussian_at(centre, 0, [0.01, 0.3, 0.01])),
        Decision::Inside
    );
    assert_eq!(
        decide(&table, &gaussian_at(centre, 0, [0.01, 0.3, 1.8])),
        Decision::Inside
    );
    // Of more than a turn, the cylinder that contains it is walked.
    for (sigma_y, expected) in [(0.01, Decision::Inside), (0.3, OUT)] {
        let set = gaussian_at(centre, 0, [0.01, sigma_y, 3.0]);
        assert_eq!(decide(&table, &set), expected);
    }
    assert_eq!(
        decide(&table, &gaussian_at(centre, 0, [0.01, 0.3, 0.01])),
        Decision::Inside
    );
    assert_eq!(
        decide(&table, &gaussian_at(centre, 0, [0.3, 0.01, 0.01])),
        large
    );
    assert_eq!(decide(&table, &disc_at(-500_000, 0, 0.0, 1_000, 0.1)), off);
    assert_eq!(
        decide(&table, &disc_at(centre, 900_000, 0.0, 1_000, 0.1)),
        Decision::Inside
    );
}

#[test]
fn margins_are_found_to_the_last_step() {
    let bytes = bytes_of(&DECIMETRES, full(&DECIMETRES));
    let table = Table::parse(&bytes).unwrap();
    let margin = |set: PoseSet| {
        let examination = examine(&table, &set);
        assert_eq!(examination.decision, decide(&table, &set));
        examination.margin.q16()
    };
    let centred = |radius| margin(disc_at(0, 0, 0.0, radius, 1e-4));
    // 999,994 um are free. Steps end at 2^-10 of the scale that is not inside: at 64.
    assert_eq!(centred(999_300), 1 << 16);
    assert_eq!(centred(999_018), (1 << 16) + 64);
    assert_eq!(centred(499_997), 1 << 17);
    assert_eq!(centred(499_998), (1 << 17) - 128);
    assert_eq!(centred(62_500), (1 << 20) - 1024);
    // The smallest set has the largest margin that is reported.
    assert_eq!(margin(disc_at(0, 0, 0.0, 1, 1e-7)), Margin::MOST.q16());
    assert_eq!(Margin::MOST.q16(), 1 << 31);
    assert_eq!(margin(disc_at(0, 0, 0.0, 31, 1e-7)), 2016 << 20);
    // Off the centre the set is outside, with 9,994 um or 54 um free.
    let beside = |room: i32| margin(disc_at(1_000_000 - 6 - room, 0, 0.0, 800_000, 0.01));
    assert_eq!(beside(9_994), 818);
    assert_eq!(beside(54), 4);
    assert_eq!(beside(399_990), (1 << 15) - 32);
    assert_eq!(beside(400_000), 1 << 15);
    assert_eq!(Margin::from_q16(123).q16(), 123);
    assert_eq!(Margin::ONE.q16(), 1 << 16);
}

#[test]
fn gaussian_margins_are_found() {
    let bytes = bytes_of(&DECIMETRES, full(&DECIMETRES));
    let table = Table::parse(&bytes).unwrap();
    for (x, y, sigma, expected) in [
        (0, 0, [0.2, 0.05, 0.001], 1.0 / 0.6),
        (0, 0, [0.05, 0.25, 0.001], 1.0 / 0.75),
        (700_000, 0, [0.2, 0.05, 0.001], 0.5),
        (0, -900_000, [0.2, 0.1, 0.001], 1.0 / 3.0),
        (0, 0, [0.001, 0.001, 0.02], 0.1227 / 0.06),
    ] {
        let set = gaussian_at(x, y, sigma);
        let examination = examine(&table, &set);
        let margin = f64::from(examination.margin.q16()) / 65536.0;
        assert!(
            (margin / expected - 1.0).abs() < 3e-3,
            "{sigma:?}: {margin}"
        );
        assert_eq!(examination.worst_pose.is_some(), expected < 1.0);
    }
}

/// The worst pose, in the world frame, is at the border of the set, where the set leaves the table first. (It is found in 256 steps.)
#[test]
fn the_worst_pose_is_beyond_the_nearest_border() {
    let bytes = bytes_of(&DECIMETRES, full(&DECIMETRES));
    let table = Table::parse(&bytes).unwrap();
    let worst = |set: &PoseSet| {
        let examination = examine(&table, set);
        assert_eq!(examination.decision, OUT);
        let pose = examination.worst_pose.unwrap();
        let pose = table.goal().pose_to_goal(pose).unwrap();
        [pose.x_um, pose.y_um, pose.yaw.signed()]
    };
    let near = |got: [i32; 3], expected: [i32; 3]| {
        let close = |axis: usize, most: i32| (got[axis] - expected[axis]).abs() <= most;
        assert!(
            close(0, 4_000) && close(1, 4_000) && close(2, 1 << 20),
            "{got:?} {expected:?}"
        );
    };
    for (x, y, set) in [
        (
            1_200_000,
            50_000,
            disc_at(400_000, 50_000, 0.0, 800_000, 0.01),
        ),
        (
            -1_200_000,
            50_000,
            disc_at(-400_000, 50_000, 0.0, 800_000, 0.01),
        ),
        (
            50_000,
            1_200_000,
            disc_at(50_000, 400_000, 0.0, 800_000, 0.01),
        ),
        (
            50_000,
            -1_150_000,
            gaussian_at(50_000, -400_000, [0.1, 0.25, 0.001]),
        ),
        (
            1_150_000,
            50_000,
            gaussian_at(400_000, 50_000, [0.25, 0.1, 0.001]),
        ),
    ] {
        near(worst(&set), [x, y, 0]);
    }
    let headed = disc_at(0, 0, 0.1, 1_000, 0.1);
    near(worst(&headed), [0, 0, 136_713_000]);
}

/// An estimate in no covered cell: no pose of the set counts as inside, and the estimate is the worst
/// pose.
#[test]
fn an_estimate_outside_is_its_own_worst_pose() {
    let mut slabs = full(&DECIMETRES);
    slabs.iter_mut().for_each(|rows| rows[12].clear());
    let bytes = bytes_of(&DECIMETRES, slabs);
    let table = Table::parse(&bytes).unwrap();
    for radius in [10, 500_000] {
        let set = disc_at(10_000, 250_000, 0.01, radius, 0.01);
        let examination = examine(&table, &set);
        assert_eq!(examination.decision, OUT);
        assert_eq!(examination.margin, Margin::default());
        assert_eq!(examination.worst_pose, Some(set.mean()));
    }
}

/// A limit only turns an answer into [`Cause::TooCostly`]. At the number of runs that the walk needs, or more, nothing changes.
#[test]
fn a_walk_beyond_its_limit_says_that_it_is_too_costly() {
    let bytes = include_bytes!("../../examples/tables/see-t7-grid.posegate");
    let table = Table::parse(bytes).unwrap();
    let worst = table.worst_case();
    let mut needed_at_most = 0;
    for (x_m, sigma, expected) in [
        (0.0, 0.01, Decision::Inside),
        (0.0, 0.1, Decision::Inside),
        (0.0, 0.25, Decision::Inside),
        (1.5, 0.25, Decision::Outside(Cause::NotContained)),
        (0.0, 0.2, Decision::Inside),
    ] {
        let at = Estimate {
            x_m,
            y_m: 0.0,
            yaw_rad: 0.0,
        };
        let variance: f64 = sigma * sigma;
        let covariance = [
            [variance, 0.0, 0.0],
            [0.0, variance, 0.0],
            [0.0, 0.0, 0.01 * variance],
        ];
        let set = PoseSet::gaussian(at, covariance, table.radius_squared()).unwrap();
        assert_eq!(decide(&table, &set), expected, "{x_m} {sigma}");
        let too_costly = Decision::Outside(Cause::TooCostly);
        let needed = (0..=worst.runs)
            .find(|most| decide(&table.within(*most), &set) != too_costly)
            .unwrap();
        assert!(needed > 0);
        for most in [needed, needed + 1, worst.runs, u32::MAX] {
            assert_eq!(decide(&table.within(most), &set), expected, "{most}");
        }
        for most in 0..needed {
            assert_eq!(decide(&table.within(most), &set), too_costly, "{most}");
        }
        needed_at_most = needed.max(needed_at_most);
    }
    assert!(needed_at_most > 100, "{needed_at_most}");
    assert_eq!(table.within(100).worst_case().runs, 100);
    assert!(table.within(100).worst_case().instructions_m4f() < worst.instructions_m4f());
    assert_eq!(table.within(u32::MAX).worst_case(), worst);
}

/// A table of an older version with cells beside facets is decided by its facets alone, in both evaluations.
#[test]
fn cells_beside_facets_are_not_used() {
    use crate::contain::second::opinion;
    use crate::report::PoseEstimate;
    use crate::set::{Estimate, Trust, Uncertainty};
    let with = include_bytes!("../../tests/data/both-layouts.posegate");
    let without = include_bytes!("../../tests/data/over-180.posegate");
    let [both, alone] = [&with[..], &without[..]].map(|bytes| Table::parse(bytes).unwrap());
    assert!(both.grid().is_none() && both.facets().is_some());
    assert_eq!(both.worst_case(), alone.worst_case());
    let goal = both.goal().pose;
    let mut random = crate::error_budget::Random::new(5);
    let mut permits = 0;
    for _ in 0..8_000 {
        let estimate = Estimate {
            x_m: f64::from(goal.x_um) * 1e-6 + random.within(-1.5, 2.5),
            y_m: f64::from(goal.y_um) * 1e-6 + random.within(-1.5, 1.5),
            yaw_rad: random.within(2.7, 4.2),
        };
        let translation_m = random.log_within(1e-3, 0.1);
        let yaw_rad = random.log_within(1e-3, 0.1);
        let set = PoseSet::bounded(estimate, translation_m, yaw_rad).unwrap();
        let decision = decide(&alone, &set);
        assert_eq!(decide(&both, &set), decision);
        let spread = Uncertainty::Bounded {
            translation_m,
            yaw_rad,
        };
        let belief = PoseEstimate::new(estimate, spread);
        assert_eq!(
            opinion(with, &belief, Trust::FULL),
            opinion(without, &belief, Trust::FULL)
        );
        permits += u32::from(decision == Decision::Inside);
    }
    assert!(permits > 50, "{permits}");
}
