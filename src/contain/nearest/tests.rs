use super::*;
use crate::contain::exact::cases::Case;
use crate::contain::facets::margin_q10;
use crate::num::BinaryAngle;
use crate::pose::Pose;
use crate::set::{Extent, PoseSet};
use crate::table::{Axes, Facet, Table};
use proptest::prelude::*;

fn scale_after(before: u32, spare: i32, extent: i32, bend: i32, rest: i32) -> u32 {
    let seen = FramePoints {
        axes: Axes::World,
        x: 0,
        y: 0,
        lever: [0; 2],
        rest,
        bend,
    };
    let mut nearest = Nearest::new();
    nearest.scale_q10 = before;
    nearest.facet(spare);
    nearest.frame(&seen, extent);
    nearest.scale_q10
}

#[test]
fn scales_are_what_is_spared_for_a_facets_needs() {
    for (spare, extent, bend, rest, scale) in [
        (1000, 250, 0, 0, 4096),
        (-1, 250, 0, 0, 0),
        (1 << 22, 1 << 10, 0, 0, MOST_Q10),
        (1 << 21, 1, 0, 0, MOST_Q10),
        (1000, 0, 0, 0, 0),
        // The limit is 4: 250 + 4 (100 + 1) + 1, and 250 + 4 (4 * 100 + 1) + 1.
        (1000, 250, 100, 0, 1_024_000 / 655),
        (1000, 250, 0, 100, 1_024_000 / 1855),
        // At most 64.
        (1 << 20, 1, 1, 0, 1 << 16),
        // Values that do not fit in 16 bits, and the largest that do: half of them and one.
        (
            1 << 19,
            1 << 20,
            0,
            0xffff,
            (1 << 29) / ((1 << 20) + 16_385),
        ),
        (1 << 19, 1 << 20, 0, 0x1_0000, 0),
        (
            1 << 19,
            1 << 20,
            0xfffe,
            0,
            (1 << 29) / ((1 << 20) + 32_768),
        ),
        (1 << 19, 1 << 20, 0xffff, 0, 0),
    ] {
        let found = scale_after(MOST_Q10, spare, extent, bend, rest);
        assert_eq!(found, scale, "{spare} {extent} {bend} {rest}");
    }
}

#[test]
fn a_scale_between_two_of_the_quick_test_is_rounded_up() {
    // 1027 / 1024 needs 1003 of 1001.
    assert_eq!(scale_after(1027, 1001, 1000, 0, 0), 1025);
    assert_eq!(scale_after(1027, 1010, 1000, 0, 0), 1027);
}

/// Returns `true` if `l (A + l (E + l R)) <= s`, exactly.
fn is_met(scale_q10: u32, [spare, extent, bend, rest]: [i32; 4]) -> bool {
    let [scale, spare, extent, bend, rest] =
        [scale_q10 as i32, spare, extent, bend, rest].map(i128::from);
    // All terms in units of 2^-30.
    scale * ((extent << 20) + scale * ((bend << 10) + scale * rest)) <= spare << 30
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(crate::test_iterations(100_000, 40)))]

    /// Against exact integers: the facet holds at the scale, and the scale is no smaller than a bound with its own limit
    /// gives, whatever scale was found before.
    #[test]
    fn a_scale_is_one_at_which_the_facet_holds(
        before in prop_oneof![0..=MOST_Q10, 1_000..20_000u32],
        spare in prop_oneof![0..=1 << 21, 0..100_000i32],
        extent in prop_oneof![1..1 << 19, 1..30_000i32],
        bend in prop_oneof![Just(0), 0..1 << 18, 0..3_000i32],
        rest in prop_oneof![Just(0), 0..1 << 22, 0..3_000i32],
    ) {
        let facet = [spare, extent, bend, rest];
        let found = scale_after(before, spare, extent, bend, rest);
        prop_assert!(found <= before);
        prop_assert!(is_met(found, facet), "{found}");
        let alone = scale_after(MOST_Q10, spare, extent, bend, rest);
        prop_assert!(is_met(alone, facet), "{alone}");
        prop_assert!(found >= alone.min(before), "{found} {alone}");
    }
}

/// A disc of 100 um at the goal, 5 mm from the border.
fn case(yaw_q24: i32) -> Case {
    let facet = Facet {
        x: 16_384,
        y: 0,
        b: 5000,
    };
    Case {
        unit: 0,
        reach: 1,
        arm: 0,
        farthest: 0,
        axes: Axes::World,
        point: [0; 2],
        facet,
        goal: Pose::default(),
        mean: Pose::default(),
        extent: Extent::Bounded {
            translation_um: 100,
            yaw_q24,
        },
    }
}

#[test]
fn the_nearest_border_counts() {
    let margin = |case: Case| {
        let bytes = case.bytes();
        let table = Table::parse(&bytes).unwrap();
        margin_q10(table.facets().unwrap(), &case.set(), case.goal)
    };
    // 101 is at most 104 along a normal that is too long, and 12 are added for roundings.
    assert_eq!(margin(case(1)), Some(5000 * 1024 / 116));
    // Without a lever no turn is too large.
    assert_eq!(margin(case(1 << 20)), Some(5000 * 1024 / 116));
    // The bounds of the margin are weaker than the decision.
    assert_eq!(margin(case(1).with_b(113)), Some(1024));
    assert_eq!(margin(case(1).with_b(100)), None);
}

#[test]
fn the_nearer_end_of_an_arc_counts() {
    let case = case(1 << 14);
    let bytes = case.bytes();
    let table = Table::parse(&bytes).unwrap();
    let layout = table.facets().unwrap();
    let at = |yaw: u32| {
        let mean = Pose {
            yaw: BinaryAngle(yaw),
            ..case.mean
        };
        PoseSet::of(mean, case.extent)
    };
    let scale_in_q10 = |from: u32, width: u32, yaw: u32, turns: bool| {
        let set = at(yaw);
        let set = QuantizedPoseSet::of(layout, &set, case.goal).unwrap();
        let mut piece = layout.pieces().next().unwrap();
        (piece.from, piece.width) = (from, width);
        let mut nearest = Nearest::new();
        // As a previous piece may leave it.
        nearest.least = 1;
        nearest.piece(&piece, &set, turns);
        assert_eq!(nearest.least, i32::MAX);
        nearest.arc.lower(nearest.turn.lower(nearest.scale_q10))
    };
    let scale = |from, width, yaw| scale_in_q10(from, width, yaw, true);
    // The reach is 2^22; 2^-10 of it is 2^12, and one more for rounding up.
    assert_eq!(scale(5, 1 << 30, 5 + (1 << 28)), ((1 << 28) - 8) / 4097);
    assert_eq!(
        scale(5, 1 << 29, 5 + (1 << 28) + 4096),
        ((1 << 28) - 4104) / 4097
    );
    assert_eq!(scale(5, 1 << 30, 5), 0);
    // Half a radian, of 6.1 mrad.
    assert_eq!(scale(5, u32::MAX, 5), (1 << 24) / 202);
    assert_eq!(scale_in_q10(5, u32::MAX, 5, false), MOST_Q10);
    assert_eq!(scale(5, 1 << 31, 5 + (1 << 30)), (1 << 24) / 202);
}
