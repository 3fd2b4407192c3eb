use super::section::{Cut, Disc, EitherSection, Ellipsoid, Offset, Section, Shared, Side, Window};
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

#[test]
fn discs_are_scaled_up() {
    let scaled = |radius, yaw, scale| {
        let disc = Disc::new(radius, yaw).scaled(scale);
        disc.map(|disc| disc.extent())
    };
    assert_eq!(scaled(1000, 50, 1 << 16), Some(bounded(1000, 50)));
    assert_eq!(scaled(1000, 50, (1 << 16) + 1), Some(bounded(1001, 51)));
    assert_eq!(scaled(1000, 50, 0), Some(bounded(0, 0)));
    let (half_turn, limit) = (1 << 23, 1 << 29);
    assert_eq!(
        scaled(1, half_turn / 2, 4 << 16),
        Some(bounded(4, 2 * half_turn))
    );
    // From 32 turns on, every heading at every scale.
    assert_eq!(scaled(1, half_turn, 65 << 16), Some(bounded(65, limit)));
    assert_eq!(scaled(1, limit, 1), Some(bounded(1, limit)));
    assert_eq!(scaled(limit - 1, 1, 1 << 16), Some(bounded(limit - 1, 1)));
    assert_eq!(scaled(limit, 1, 1 << 16), None);
    assert_eq!(scaled(limit / 2, 1, 2 << 16), None);
}

#[test]
fn discs_reach_as_far_as_a_circle() {
    let disc = Disc::new(500, 40);
    assert_eq!(disc.yaw_q24(), 40);
    let Cut {
        left,
        right,
        bottom,
        top,
    } = disc.cut([-3, 5]);
    assert_eq!([left, right, bottom, top], [500; 4]);
    assert_eq!(disc.yaw_end(true), Offset([0, 0, 40]));
    assert_eq!(disc.yaw_end(false), Offset([0, 0, -40]));
    assert_eq!(disc.y_end(true, [3, 9]), Offset([0, 500, 3]));
    assert_eq!(disc.y_end(false, [-9, -3]), Offset([0, -500, -3]));
    assert_eq!(disc.y_end(true, [-9, 3]), Offset([0, 500, 0]));
    // Rows, and the farthest point to the right in each.
    for (y, farthest) in [
        ([300, 400], [400, 300]),
        ([-400, -300], [400, -300]),
        ([-5, 9], [500, 0]),
        ([0, 9], [500, 0]),
        ([-9, 0], [500, 0]),
        ([600, 700], [0, 600]),
    ] {
        let window = Window { y, yaw: [2, 7] };
        let [x, y] = farthest;
        assert_eq!(disc.row_end(Side::Right, &window), Offset([x, y, 2]));
        assert_eq!(disc.row_end(Side::Left, &window), Offset([-x, y, 2]));
        for side in [Side::Left, Side::Right] {
            assert!(disc.fits_row(side, &window, x, &mut Default::default()));
            assert!(!disc.fits_row(side, &window, x - 1, &mut Default::default()));
        }
    }
}

#[test]
fn offsets_are_drawn_in() {
    let mean = Pose {
        x_um: 10,
        y_um: -10,
        yaw: BinaryAngle(5),
    };
    let at = |offset| {
        let pose = Offset(offset).applied_to(mean);
        (
            pose.x_um - 10,
            pose.y_um + 10,
            pose.yaw.minus(mean.yaw).signed(),
        )
    };
    assert_eq!(at([0, 0, 0]), (0, 0, 0));
    assert_eq!(at([1, -1, 1]), (0, 0, 0));
    assert_eq!(at([8192, -8192, -8192]), (8189, -8190, -8190 * 256));
    assert_eq!(at([-8193, 8193, 8193]), (-8190, 8190, 8190 * 256));
}

/// Computes the farthest points of an ellipsoid in doubles.
struct Reference {
    yaw: f64,
    x: [f64; 3],
    y: [f64; 3],
}

impl Reference {
    fn of(factor: SqrtFactor) -> Self {
        Self {
            yaw: f64::from(factor.yaw),
            x: factor.x.map(f64::from),
            y: factor.y.map(f64::from),
        }
    }

    /// Returns the set mirrored in x, so that its right side is the left side of the original.
    fn left(self) -> Self {
        Self {
            x: self.x.map(|v| -v),
            ..self
        }
    }

    fn swapped(self) -> Self {
        Self {
            x: self.y,
            y: self.x,
            ..self
        }
    }

    /// Returns y at a yaw offset: the middle, and the reach to either side.
    fn band(&self, offset: f64) -> (f64, f64) {
        let share = (offset / self.yaw).clamp(-1.0, 1.0);
        let reach = (1.0 - share * share).sqrt() * self.y[1].hypot(self.y[2]);
        (self.y[0] * share, reach)
    }

    /// Returns the distance by which y misses a row at a yaw offset, negative if it does not.
    fn missed(&self, offset: f64, [low, high]: [f64; 2]) -> f64 {
        let (middle, reach) = self.band(offset);
        (low - middle - reach).max(middle - reach - high)
    }

    /// Returns the largest x and its y at a yaw offset, with y in a row that is not missed.
    fn at(&self, offset: f64, [low, high]: [f64; 2]) -> (f64, f64) {
        let share = (offset / self.yaw).clamp(-1.0, 1.0);
        let radius = (1.0 - share * share).sqrt();
        let ([x1, x2, x3], [y1, y2, y3]) = (self.x, self.y);
        let length = y2.hypot(y3);
        let along = (x2 * y2 + x3 * y3) / length;
        let across = (x2 * y3 - x3 * y2) / length;
        let best = y1 * share + radius * length * along / along.hypot(across);
        let (middle, reach) = self.band(offset);
        let y = best.clamp(low, high).clamp(middle - reach, middle + reach);
        let t = (y - middle) / length;
        let rest = (radius * radius - t * t).max(0.0).sqrt();
        (x1 * share + along * t + across.abs() * rest, y)
    }

    /// Returns the largest x, its y and its yaw, with y and yaw in a window, or `None` if the set misses
    /// the window.
    fn farthest(&self, y: [f64; 2], yaw: [f64; 2]) -> Option<[f64; 3]> {
        let thirds = |mut from: f64, mut to: f64, cost: &dyn Fn(f64) -> f64| {
            for _ in 0..100 {
                let (a, b) = (from + (to - from) / 3.0, to - (to - from) / 3.0);
                if cost(a) <= cost(b) { to = b } else { from = a }
            }
            (from + to) / 2.0
        };
        let [from, to] = yaw.map(|v| v.clamp(-self.yaw, self.yaw));
        let touch = thirds(from, to, &|e| self.missed(e, y));
        if self.missed(touch, y) > 0.0 {
            return None;
        }
        let end = |mut out: f64| {
            let mut inside = touch;
            for _ in 0..100 {
                let middle = (out + inside) / 2.0;
                *(if self.missed(middle, y) > 0.0 {
                    &mut out
                } else {
                    &mut inside
                }) = middle;
            }
            if self.missed(out, y) > 0.0 {
                inside
            } else {
                out
            }
        };
        let best = thirds(end(from), end(to), &|e| -self.at(e, y).0);
        let (x, y) = self.at(best, y);
        Some([x, y, best])
    }
}

const NO_ROW: [f64; 2] = [-1e12, 1e12];

prop_compose! {
    /// Generates factors of sets from a decimetre to some metres.
    fn factors()(
        yaw in 5.0f64..7.0,
        scale in [5.0f64..7.0, 5.0f64..7.0],
        x in proptest::array::uniform3(-1.0f64..1.0),
        y in proptest::array::uniform3(-1.0f64..1.0),
    ) -> SqrtFactor {
        let row = |exponent: f64, row: [f64; 3]| row.map(|v| (10f64.powf(exponent) * v) as i32);
        SqrtFactor { yaw: 10f64.powf(yaw) as i32, x: row(scale[0], x), y: row(scale[1], y) }
    }
}

/// Returns `true` if the plane part of a factor is not very thin.
fn is_round(factor: &SqrtFactor) -> bool {
    let ([x1, x2, x3], [y1, y2, y3]) = (factor.x.map(f64::from), factor.y.map(f64::from));
    let area = (x2 * y3 - x3 * y2).abs();
    area > 0.2 * x2.hypot(x3) * y2.hypot(y3)
        && x2.hypot(x3) > 0.1 * x1.abs()
        && y2.hypot(y3) > 0.1 * y1.abs()
        && area > 1e5
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(crate::test_iterations(2_000, 3)))]
    #[test]
    fn ellipsoids_reach_as_far_as_they_do(
        factor in factors().prop_filter("a needle", is_round),
        window in [-1.2f64..1.2, -1.2f64..1.2],
    ) {
        let section = Ellipsoid::new(factor);
        prop_assert_eq!(section.yaw_q24(), i64::from(factor.yaw));
        let mut yaw = window.map(|v| ((v * f64::from(factor.yaw)) as i32).clamp(-factor.yaw, factor.yaw));
        yaw.sort_unstable();
        let window = yaw.map(i64::from);
        let Cut { left, right, bottom, top } = section.cut(window);
        let reference = || Reference::of(factor);
        for (got, reference) in [
            (right, reference()),
            (left, reference().left()),
            (top, reference().swapped()),
            (bottom, reference().swapped().left()),
        ] {
            let [expected, ..] = reference.farthest(NO_ROW, yaw.map(f64::from)).unwrap();
            let across = reference.x[1].hypot(reference.x[2]);
            // A root that is rounded up, times the row, divided by the yaw.
            let most = expected + across / reference.yaw + 3.0;
            prop_assert!(got as f64 >= expected - 1e-3 && got as f64 <= most, "{got} {expected}");
        }
        for high in [true, false] {
            let Offset([x, y, yaw]) = section.y_end(high, window);
            let reference = if high { reference().swapped() } else { reference().swapped().left() };
            let [expected, other, offset] = reference.farthest(NO_ROW, window.map(|v| v as f64)).unwrap();
            let sign = if high { 1.0 } else { -1.0 };
            let size = 3.0 + 1e-3 * reference.x.iter().fold(0.0, |sum: f64, v| sum + v.abs());
            prop_assert!((sign * y as f64 - expected).abs() <= size, "{y} {expected}");
            let size = 3.0 + 2e-2 * reference.y.iter().fold(0.0, |sum: f64, v| sum + v.abs());
            prop_assert!((x as f64 - other).abs() <= size, "{x} {other}");
            prop_assert!((yaw as f64 - offset).abs() <= 3.0 + 2e-2 * reference.yaw, "{yaw} {offset}");
        }
    }

    /// What a walk keeps from row to row changes no answer, in any order of sides, rows and slabs.
    #[test]
    fn shared_values_change_no_answer(
        factor in factors(),
        rows in proptest::collection::vec((0usize..2, 0usize..3, -1.0f64..1.0, -1.0f64..1.2), 1..12),
    ) {
        let section = Ellipsoid::new(factor);
        let reach = |row: [i32; 3]| row.iter().fold(0.0, |sum: f64, v| sum.hypot(f64::from(*v)));
        let mut shared = Shared::default();
        for (side, slab, y, room) in rows {
            let low = (y * reach(factor.y)) as i64;
            let edge = |share: i64| i64::from(factor.yaw) * share / 3;
            let slab = slab as i64 * 2 - 3;
            let window = Window { y: [low, low + 1 + (reach(factor.y) / 50.0) as i64], yaw: [edge(slab), edge(slab + 2)] };
            let (side, room) = ([Side::Left, Side::Right][side], (room * reach(factor.x)) as i64);
            prop_assert_eq!(
                section.fits_row(side, &window, room, &mut shared),
                section.fits_row(side, &window, room, &mut Shared::default())
            );
        }
    }

    /// The certificate of a row is never wrong, and only slightly too strict.
    #[test]
    fn ellipsoids_fit_a_row_where_they_do(
        factor in factors().prop_filter("a needle", is_round),
        row in [-1.0f64..1.0, 0.0f64..0.5],
        yaw in [-1.0f64..1.0, 0.0f64..1.0],
    ) {
        let section = Ellipsoid::new(factor);
        let height = Reference::of(factor).swapped().farthest(NO_ROW, [-1e9, 1e9]).unwrap()[0];
        let low = (row[0] * height) as i64;
        let from = (yaw[0] * f64::from(factor.yaw)) as i64;
        let window = Window {
            y: [low, low + 1 + (row[1] * height) as i64],
            yaw: [from, (from + 1 + (yaw[1] * f64::from(factor.yaw)) as i64).min(i64::from(factor.yaw))],
        };
        let (y, yaw) = (window.y.map(|v| v as f64), window.yaw.map(|v| v as f64));
        for side in [Side::Left, Side::Right] {
            let reference = Reference::of(factor);
            let (reference, sign) = match side {
                Side::Left => (reference.left(), -1.0),
                Side::Right => (reference, 1.0),
            };
            prop_assert!(!section.fits_row(side, &window, -(1 << 30), &mut Default::default()) || reference.farthest(y, yaw).is_none());
            let Some([expected, ..]) = reference.farthest(y, yaw) else { continue };
            for less in [0.5, 10.0, 1e3, 1e5, 1e8] {
                prop_assert!(!section.fits_row(side, &window, (expected - less).floor() as i64, &mut Default::default()));
            }
            let size = reference.x.iter().fold(0.0, |sum: f64, v| sum + v.abs());
            let sums = reference.y.iter().fold(0.0, |sum: f64, v| sum + v.abs());
            // In a window that is slightly wider or narrower.
            let by = |share: f64| {
                let part = |[low, high]: [f64; 2], size: f64| {
                    let by = share.signum() * 3.0 + share * size;
                    (low - by < high + by).then_some([low - by, high + by])
                };
                reference.farthest(part(y, sums)?, part(yaw, reference.yaw)?)
            };
            let most = by(0.02).unwrap()[0] + 3.0 + 3e-3 * size;
            // If the farthest point of the slab is far from the row, the row sharpens the bound.
            let [_, free, _] = reference.farthest(NO_ROW, yaw).unwrap();
            if free < y[0] - 3.0 - 1e-3 * sums || free > y[1] + 3.0 + 1e-3 * sums {
                prop_assert!(section.fits_row(side, &window, most as i64, &mut Default::default()), "{expected} {most}");
            }
            let Offset([x, row, offset]) = section.row_end(side, &window);
            let (x, row, offset) = (sign * x as f64, row as f64, offset as f64);
            prop_assert!(x <= most, "{x} {most}");
            if let Some([least, ..]) = by(-0.02) {
                prop_assert!(x >= least - 3.0 - 3e-3 * size, "{x} {least}");
            }
            let near = |at: f64, size: f64| [at - 3.0 - 1e-3 * size, at + 3.0 + 1e-3 * size];
            let ([low, high], [from, to]) = (near(row, sums), near(offset, reference.yaw));
            prop_assert!(low <= y[1] && high >= y[0] && from <= yaw[1] && to >= yaw[0]);
            let there = reference.farthest([low, high], [from, to]).unwrap()[0];
            prop_assert!(x <= there + 3.0 + 3e-3 * size, "{x} {there}");
        }
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

#[test]
fn ellipsoids_end_with_their_yaw() {
    let section = Ellipsoid::new(SqrtFactor {
        yaw: 1000,
        x: [-300, 5, 6],
        y: [40, 7, 8],
    });
    assert_eq!(section.yaw_end(true), Offset([-300, 40, 1000]));
    assert_eq!(section.yaw_end(false), Offset([300, -40, -1000]));
}

/// A row that contains the slab's own farthest point adds nothing: the slab is checked already.
#[test]
fn a_row_helps_only_beside_the_farthest_point() {
    let section = Ellipsoid::new(SqrtFactor {
        yaw: 1000,
        x: [0, 5000, 0],
        y: [0, 0, 5000],
    });
    for side in [Side::Left, Side::Right] {
        let fits = |y: [i64; 2]| {
            let yaw = [-1000, 1000];
            section.fits_row(side, &Window { y, yaw }, 1 << 30, &mut Default::default())
        };
        assert!(!fits([0, 50]) && !fits([-50, 0]) && !fits([-50, 50]));
        assert!(fits([1, 50]) && fits([-50, -1]));
    }
}

/// A set of two yaw units that touches a row at 1.41 of them: a window that contains the whole unit
/// leaves the touching point unchanged.
#[test]
fn a_window_moves_only_what_lies_beyond_it() {
    let section = Ellipsoid::new(SqrtFactor {
        yaw: 2,
        x: [100_000, 0, 100_000],
        y: [0, 1 << 22, 0],
    });
    let end = |yaw: [i64; 2]| section.row_end(Side::Right, &Window { y: [1, 9], yaw }).0;
    let [x, _, yaw] = end([0, 2]);
    assert!((141_415..=141_422).contains(&x) && yaw == 1, "{x} {yaw}");
    assert_eq!(end([1, 2]), end([0, 2]));
    assert_eq!(end([0, 1]), end([0, 2]));
    let [x, _, yaw] = end([-1, 0]);
    assert!((99_990..=100_001).contains(&x) && yaw == 0, "{x} {yaw}");
    let [x, _, yaw] = end([2, 2]);
    assert!((99_990..=100_001).contains(&x) && yaw == 2, "{x} {yaw}");
}

/// Multipliers and slacks of 2^31 and more are not multiplied: each makes the row unproven, even if the
/// set fits.
#[test]
fn multipliers_have_a_limit() {
    let fits = |yaw: i32, x: [i32; 3], y: [i32; 3], window: [[i64; 2]; 2], room: i64| {
        let [y_um, yaw_q24] = window;
        let window = Window {
            y: y_um,
            yaw: yaw_q24,
        };
        Ellipsoid::new(SqrtFactor { yaw, x, y }).fits_row(
            Side::Right,
            &window,
            room,
            &mut Default::default(),
        )
    };
    // The multiplier of yaw is 2^20 times the last entry of x.
    let with = |last: i32| {
        let window = [[1, 9], [1, 1]];
        fits(1, [0, 0, last], [0, 1 << 22, 0], window, 1 << 12)
    };
    assert!(with((1 << 11) - 1) && !with(1 << 11));
    // The same for the multiplier of y.
    let with = |last: i32| {
        let window = [[1, 9], [-9, 9]];
        fits(1, [0, 0, last], [0, 1, 0], window, 1 << 12)
    };
    assert!(with((1 << 11) - 1) && !with(1 << 11));
    let with = |room: i64| {
        let window = [[1, 50], [-1000, 1000]];
        fits(1000, [0, 5000, 0], [0, 0, 5000], window, room)
    };
    assert!(with((1 << 31) - 1) && !with(1 << 31) && !with(-(1 << 31)));
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

fn walk<S: Section>(bytes: &[u8], mean: [i64; 3], section: &S) -> Result<(), Offset> {
    let table = Table::parse(bytes).unwrap();
    match grid::covers(
        table.grid().unwrap(),
        table.cells(),
        mean,
        section,
        u32::MAX,
    ) {
        Ok(()) => Ok(()),
        Err(grid::Stop::NotCovered(offset)) => Err(offset),
        Err(grid::Stop::TooCostly) => unreachable!("a walk without a limit"),
    }
}

fn walk_disc(bytes: &[u8], mean: [i64; 3]) -> Result<(), Offset> {
    let found = walk(bytes, mean, &Disc::new(1_000, 10));
    let either = EitherSection::Disc(Disc::new(1_000, 10));
    assert_eq!(walk(bytes, mean, &either), found);
    found
}

#[test]
fn a_set_touches_the_ends_of_the_table() {
    let bytes = bytes_of(&MILLIMETRES, full(&MILLIMETRES));
    let span = 1 << 24;
    let good = [5_000, 5_000, REACH];
    assert_eq!(walk_disc(&bytes, good), Ok(()));
    for (axis, at, offset) in [
        (0, [1_006, 1_005], [-1_000, 0, 0]),
        (0, [8_994, 8_995], [1_000, 0, 0]),
        (1, [1_006, 1_005], [0, -1_000, 0]),
        (1, [8_994, 8_995], [0, 1_000, 0]),
        (2, [REACH, REACH - 1], [0, 0, -10]),
        (2, [span - REACH, span - REACH + 1], [0, 0, 10]),
    ] {
        let mut mean = [5_000, 5_000, 1 << 23];
        mean[axis] = at[0];
        assert_eq!(walk_disc(&bytes, mean), Ok(()), "{mean:?}");
        mean[axis] = at[1];
        assert_eq!(walk_disc(&bytes, mean), Err(Offset(offset)), "{mean:?}");
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
            assert_eq!(walk_disc(&bytes, mean).is_ok(), expected, "{mean:?}");
        }
    }
}

/// Each row needs only the cells that the disc has there, and each of them.
#[test]
fn a_disc_needs_the_cells_of_a_disc() {
    let disc = Disc::new(4_500, 10);
    let mean = [5_000, 5_000, 1 << 23];
    let runs: Vec<Runs> = (0..10)
        .map(|row| {
            // The distance of the widened row.
            let nearest = f64::max(4.0 - f64::from(row), f64::from(row) - 5.0).max(0.0) * 1e3;
            let y = (nearest - 6.0).max(0.0);
            let half = (4.5e3f64.powi(2) - y * y).sqrt() + 6.0;
            let ends = [(5e3 - half) / 1e3, (5e3 + half) / 1e3];
            vec![(ends[0].floor() as u16, ends[1].ceil() as u16 - 1)]
        })
        .collect();
    assert!(runs[0] != runs[4] && runs[0] == runs[9]);
    let ask = |runs: &[Runs]| walk(&bytes_of(&MILLIMETRES, vec![runs.to_vec(); 4]), mean, &disc);
    assert_eq!(ask(&runs), Ok(()));
    for row in 0..10 {
        let (first, last) = runs[row][0];
        for (short, sign) in [((first + 1, last), -1), ((first, last - 1), 1)] {
            let mut runs = runs.clone();
            runs[row] = vec![short];
            let Err(Offset([x, y, _])) = ask(&runs) else {
                panic!("{row} {short:?}")
            };
            assert!(x.signum() == sign && x * x + y * y <= 4_500 * 4_500);
            assert!((x * x + y * y) > 4_490 * 4_490);
        }
    }
}

/// A row is widened by 6 um to either side: the unwidened row is not enough. A disc of 4500 um reaches
/// 3354.1 um at 3000 um, and 3359.6 um at 2994 um.
#[test]
fn rows_are_widened() {
    let cells = Cells {
        columns: 12,
        ..MILLIMETRES
    };
    for row in [1, 8] {
        for (run, [near, far]) in [((0, 8), [5_634, 5_637]), ((3, 11), [6_366, 6_363])] {
            let mut slabs = full(&cells);
            slabs.iter_mut().for_each(|rows| rows[row] = vec![run]);
            let bytes = bytes_of(&cells, slabs);
            let ask = |x| walk(&bytes, [x, 5_000, 1 << 23], &Disc::new(4_500, 10)).is_ok();
            assert!(ask(near) && !ask(far), "{row} {run:?}");
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
            let end = |reference: Reference| {
                let [reach, ..] = reference.farthest(NO_ROW, yaw).unwrap();
                reach + 6.0
            };
            let left = middle as f64 - end(Reference::of(factor).left());
            let right = middle as f64 + end(Reference::of(factor));
            let ends = [left, right].map(|x| x / 1e3);
            rows.fill(vec![(ends[0].floor() as u16, ends[1].ceil() as u16 - 1)]);
        }
        assert_ne!(slabs[0], slabs[1]);
        let section = Ellipsoid::new(factor);
        let mean = [middle, 5_000, yaw_span as i64 / 2];
        let either = EitherSection::Ellipsoid(Ellipsoid::new(factor));
        let ask = |slabs| {
            let bytes = bytes_of(&cells, slabs);
            let found = walk(&bytes, mean, &section);
            assert_eq!(walk(&bytes, mean, &either), found);
            found
        };
        assert_eq!(ask(slabs.clone()), Ok(()));
        for k in 0..4 {
            let (first, last) = slabs[k][5][0];
            for run in [(first + 1, last), (first, last - 1)] {
                let mut slabs = slabs.clone();
                slabs[k][5] = vec![run];
                assert!(ask(slabs).is_err(), "{k} {run:?}");
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
    let ask = |bytes: &[u8], yaw: i64| walk_disc(bytes, [5_000, 5_000, yaw]).is_ok();
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

/// A set of more than a turn is walked half a turn and the slack to either side: its x grows with its
/// yaw, and the last slab has only cells of smaller x.
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
        Ellipsoid::new(SqrtFactor {
            yaw,
            x: [40_000, 10, 0],
            y: [0, 0, 10],
        })
    };
    let bytes = bytes_of(&cells, full(&cells));
    assert_eq!(walk(&bytes, [50_000, 5_000, 0], &section(1 << 24)), Ok(()));
    let mut slabs = full(&cells);
    // Headings from three quarters of a turn: a quarter to one side, or three to the other.
    slabs[3] = vec![vec![(0, 55)]; 10];
    let bytes = bytes_of(&cells, slabs);
    let at = 0;
    // With half a turn at most, x is at most that of the estimate there.
    let to_the_left = |yaw: i32| walk(&bytes, [45_000, 5_000, at], &section(yaw));
    assert_eq!(to_the_left(1 << 23), Ok(()));
    assert!(to_the_left((1 << 24) - 1).is_err());
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
        (0.0, 0.35, Decision::Inside),
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
