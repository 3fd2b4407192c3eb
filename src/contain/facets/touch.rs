//! The clearance of a table's borders, and the points where a set touches them.

use super::*;
use crate::contain::exact::cases::Case;
use crate::set::SqrtFactor;
use crate::table::Table;

/// A set at the goal, whose heading is 0, in a layout of one facet across x.
fn case(unit: u8, point: [i16; 2], extent: Extent) -> Case {
    Case {
        unit,
        reach: 1,
        arm: 4,
        farthest: 0,
        axes: Axes::World,
        point,
        facet: Facet {
            x: 16_384,
            y: 0,
            b: 50,
        },
        goal: Pose::default(),
        mean: Pose::default(),
        extent,
    }
}

const fn disc(translation_um: i32, yaw_q24: i32) -> Extent {
    Extent::Bounded {
        translation_um,
        yaw_q24,
    }
}

/// Returns how far the set reaches along the facet, and the touching point.
fn touches(case: Case) -> (i64, [i64; 3]) {
    let bytes = case.bytes();
    let table = Table::parse(&bytes).unwrap();
    let layout = table.facets().unwrap();
    let set = case.set();
    let ready = Ready::of(
        QuantizedPoseSet::of(layout, &set, case.goal).unwrap(),
        layout,
    )
    .unwrap();
    let frame = layout.pieces().next().unwrap().frames().next().unwrap();
    let found = touching(case.facet, &ready.seen(&frame), &ready);
    assert_eq!(witness(layout, &set, case.goal), found.1);
    found
}

#[test]
fn discs_touch_where_the_normal_points() {
    // 100 um and one, and three for the length of a normal; the disc itself has 100.
    let found = touches(case(0, [0, 0], disc(100, 1000)));
    assert_eq!(found, (104 << 14, [100, 0, 1000]));
    // In units of 8 um: 12501, and 97 and 3 for the length of a normal.
    let found = touches(case(4, [0, 0], disc(100_000, 1000)));
    assert_eq!(found, (12_601 << 14, [100_000, 0, 1000]));
    // 0.4 rad turn a point at 4 to the left by 1.6, and a point at the right by as much.
    let found = touches(case(0, [0, -4], disc(100, 1_068_000)));
    assert_eq!(found, (106 << 14, [100, 0, 1_068_000]));
    let found = touches(case(0, [0, 4], disc(100, 1_068_000)));
    assert_eq!(found, (106 << 14, [100, 0, -1_068_000]));
    // A normal that is too long.
    let mut long = case(0, [0, 0], disc(10_000, 1000));
    (long.facet.x, long.facet.y) = (16_440, 0);
    assert_eq!(touches(long).1, [10_000, 0, 1000]);
}

#[test]
fn ellipsoids_touch_where_their_columns_share() {
    let extent = |x, y| Extent::Gaussian(SqrtFactor { yaw: 1000, x, y });
    let found = touches(case(0, [0, 0], extent([300, 400, 0], [10, 20, 30])));
    // Shares of 0.6 and 0.8; the results are rounded down.
    assert_eq!(found, (500 << 14, [499, 21, 599]));
    let found = touches(case(0, [0, 0], extent([0, 0, -500], [10, 20, 30])));
    assert_eq!(found, (500 << 14, [500, -30, 0]));
    // In units of 8 um.
    let found = touches(case(4, [0, 0], extent([0, 80_000, 0], [0; 3])));
    assert_eq!(found, (10_000 << 14, [80_000, 0, 0]));
    let found = touches(case(4, [0, 0], extent([0, 80_003, 0], [0; 3])));
    assert_eq!(found, (10_000 << 14, [80_003, 0, 0]));
}

#[test]
fn borders_pay_for_every_rounding() {
    let facet = Facet {
        x: 16_384,
        y: -100,
        b: 0,
    };
    let along = 16_484 / 2 + 16_484 / 8 + 3;
    let paid = |axes, turns| clearance_q14(facet, axes, turns, 3, 1000);
    assert_eq!(paid(Axes::World, false), along);
    let turned = i64::from(COS_SIN_ERROR_Q15) * 1007 / 2 + 13_004 + 2;
    assert_eq!(paid(Axes::World, true), along + turned);
    let along = 23_262 / 2 + 23_262 / 8 + 3;
    assert_eq!(paid(Axes::Robot, true), along + turned);
    assert_eq!(paid(Axes::Robot, false), along + turned);
}

#[test]
fn arcs_hold_every_heading_of_a_set() {
    // Headings up to 1024 to both sides, and three for roundings.
    let case = case(0, [0, 0], disc(100, 4));
    let bytes = case.bytes();
    let table = Table::parse(&bytes).unwrap();
    let layout = table.facets().unwrap();
    let holds = |from: u32, width: u32, yaw: u32| {
        let mean = Pose {
            yaw: crate::num::BinaryAngle(yaw),
            ..case.mean
        };
        let set = PoseSet::of(mean, case.extent);
        let mut piece = layout.pieces().next().unwrap();
        (piece.from, piece.width) = (from, width);
        in_arc(
            &piece,
            set.mean().yaw.minus(case.goal.yaw).0,
            set.common().turn.reach,
        )
    };
    for from in [0, 5, u32::MAX - 600] {
        let at = |above: u32| from.wrapping_add(above);
        assert!(holds(from, 2054, at(1027)));
        assert!(!holds(from, 2053, at(1027)));
        assert!(!holds(from, 2054, at(1026)) && !holds(from, 2054, at(1028)));
        assert!(!holds(from, 2054, at(5000)) && !holds(from, 5000, at(0)));
        assert!(holds(from, u32::MAX, at(0)));
    }
    assert!(!holds(0, 2054, 1 << 31));
}

/// The goal's own point needs no allowance for its turn, and the margin of the nearest facet is sharp
/// with levers.
#[test]
fn levers_cost_what_they_are() {
    let turning = case(0, [0, 0], disc(100, 1_068_000));
    let bytes = turning.bytes();
    let table = Table::parse(&bytes).unwrap();
    let layout = table.facets().unwrap();
    let set = turning.set();
    let ready = Ready::of(
        QuantizedPoseSet::of(layout, &set, turning.goal).unwrap(),
        layout,
    )
    .unwrap();
    let frame = layout.pieces().next().unwrap().frames().next().unwrap();
    let seen = ready.seen(&frame);
    assert_eq!((seen.lever, seen.rest, seen.bend), ([0; 2], 0, 0));

    let mut long = case(0, [0, 4000], disc(100, 10_000)).with_b(300);
    long.arm = 4000;
    let bytes = long.bytes();
    let table = Table::parse(&bytes).unwrap();
    let margin = margin_q10(table.facets().unwrap(), &long.set(), long.goal);
    assert!(margin.unwrap() > 1900, "{margin:?}");
}

#[test]
fn quotients_are_cut_towards_zero() {
    for (value, by, found) in [(7, 2, 3), (-7, 2, -3), (1, 2, 0), (-1, 2, 0), (5, 0, 0)] {
        assert_eq!(quotient(value, by), found);
    }
}
