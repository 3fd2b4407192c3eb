//! Plans on the controller that succeed, lose a tag or have a surprise; and damaged rules.

use posegate::num::BinaryAngle;
use posegate::pose::Pose;
use posegate::sequencer::{Instruction, Kind, Rule, Rules, RulesError, Sequencer, StopReason};
use posegate::set::{Estimate, PoseSet};
use posegate::table::checksum;
use posegate::task::Cylinder;
use posegate_plan::{RuleOrder, write_rules as write};

fn pose(x_m: f64) -> Pose {
    Pose {
        x_um: (x_m * 1e6) as i32,
        y_um: 0,
        yaw: BinaryAngle(0),
    }
}

fn cylinder(translation: f64, yaw: f64) -> Cylinder {
    Cylinder::new(translation, yaw).unwrap()
}

fn rule(
    kind: Kind,
    task: &str,
    tag: u32,
    at: f64,
    set: f64,
    then: u16,
    otherwise: Option<u16>,
) -> RuleOrder {
    RuleOrder {
        task: (kind != Kind::Drive).then(|| String::from(task)),
        rule: Rule {
            kind,
            attempts: 2,
            task: 0,
            tag,
            then,
            otherwise,
            place: pose(at),
            spread: cylinder(0.1, 0.1),
            set: cylinder(set, 0.05),
            to: pose(at + 1.0),
        },
    }
}

/// Returns rules: look at tag 7 (or, if that fails, at tag 9), drive, work.
fn bytes() -> Vec<u8> {
    let orders = [
        rule(Kind::Look, "see-7", 7, 0.0, 0.5, 1, Some(3)),
        rule(Kind::Drive, "", 0, 0.0, 0.05, 2, None),
        rule(Kind::Work, "dock", 0, 1.0, 0.1, 2, None),
        rule(Kind::Look, "see-9", 9, 0.0, 0.4, 1, None),
    ];
    write(&orders, [5; 32]).unwrap()
}

fn set(x_m: f64, translation_m: f64) -> PoseSet {
    let estimate = Estimate {
        x_m,
        y_m: 0.0,
        yaw_rad: 0.0,
    };
    PoseSet::bounded(estimate, translation_m, 0.02).unwrap()
}

#[test]
fn plan_without_failures_succeeds() {
    let bytes = bytes();
    let mut plan = Sequencer::new(Rules::parse(&bytes).unwrap());
    assert_eq!(plan.rules().site_digest(), &[5; 32]);
    assert_eq!(
        plan.next(&set(0.0, 0.4)),
        Instruction::Look {
            task: "see-7",
            tag: 7
        }
    );
    plan.succeeded();
    assert_eq!(
        plan.next(&set(0.05, 0.04)),
        Instruction::Drive { to: pose(1.0) }
    );
    plan.succeeded();
    assert_eq!(
        plan.next(&set(1.02, 0.09)),
        Instruction::Work { task: "dock" }
    );
    plan.succeeded();
    assert_eq!(
        plan.next(&set(1.02, 0.09)),
        Instruction::Inhibit(StopReason::Done)
    );
    assert_eq!(plan.surprises(), 0);
}

#[test]
fn lost_tag_is_tried_twice_and_then_replaced() {
    let bytes = bytes();
    let mut plan = Sequencer::new(Rules::parse(&bytes).unwrap());
    let see_7 = Instruction::Look {
        task: "see-7",
        tag: 7,
    };
    assert_eq!(plan.next(&set(0.0, 0.3)), see_7);
    plan.failed();
    assert_eq!(plan.next(&set(0.0, 0.3)), see_7);
    plan.failed();
    let see_9 = Instruction::Look {
        task: "see-9",
        tag: 9,
    };
    assert_eq!(plan.next(&set(0.0, 0.3)), see_9);
    plan.failed();
    plan.failed();
    assert_eq!(
        plan.next(&set(0.0, 0.3)),
        Instruction::Inhibit(StopReason::GaveUp)
    );
}

#[test]
fn surprise_leads_to_another_entry_or_inhibits() {
    let bytes = bytes();
    let mut plan = Sequencer::new(Rules::parse(&bytes).unwrap());
    let _ = plan.next(&set(0.0, 0.3));
    plan.succeeded();
    let _ = plan.next(&set(0.0, 0.04));
    plan.succeeded();
    // Before the work the set is again as large as at the start, and the robot is at the start: it looks again, by
    // the last entry.
    assert_eq!(
        plan.next(&set(0.0, 0.3)),
        Instruction::Look {
            task: "see-9",
            tag: 9
        }
    );
    assert_eq!(plan.surprises(), 1);
    plan.failed();
    plan.failed();
    assert_eq!(
        plan.next(&set(0.0, 0.3)),
        Instruction::Inhibit(StopReason::GaveUp)
    );
    // Far from every entry, or with a set for which no entry is proven.
    let mut plan = Sequencer::new(Rules::parse(&bytes).unwrap());
    assert_eq!(
        plan.next(&set(0.2, 0.3)),
        Instruction::Inhibit(StopReason::NoEntry)
    );
    assert_eq!(
        plan.next(&set(0.0, 0.51)),
        Instruction::Inhibit(StopReason::NoEntry)
    );
    // Such a pause ends as soon as an entry applies again.
    assert_eq!(
        plan.next(&set(0.0, 0.5)),
        Instruction::Look {
            task: "see-7",
            tag: 7
        }
    );
}

/// After any surprise, a lost tag is not looked at again.
#[test]
fn lost_tag_stays_lost_after_surprises() {
    let bytes = bytes();
    let mut plan = Sequencer::new(Rules::parse(&bytes).unwrap());
    let _ = plan.next(&set(0.0, 0.3));
    plan.failed();
    plan.failed();
    // Larger than the set of the other tag's entry, but not than that of the lost tag's entry.
    assert_eq!(
        plan.next(&set(0.0, 0.45)),
        Instruction::Inhibit(StopReason::NoEntry)
    );
}

#[test]
fn damaged_rules_are_refused() {
    let good = bytes();
    for bit in 0..good.len() * 8 {
        let mut bytes = good.clone();
        bytes[bit / 8] ^= 1 << (bit % 8);
        assert!(Rules::parse(&bytes).is_err(), "bit {bit}");
    }
    for length in 0..good.len() {
        assert!(Rules::parse(&good[..length]).is_err(), "{length}");
    }
    // With a correct checksum: every byte set to each of a few values gives rules or an error, and no panic.
    for at in 0..good.len() - 4 {
        for value in [0, 1, 3, 0x7f, 0x80, 0xff] {
            let mut bytes = good.clone();
            bytes[at] = value;
            let end = bytes.len() - 4;
            let crc = checksum(&bytes[..end]);
            bytes[end..].copy_from_slice(&crc.to_le_bytes());
            if let Ok(rules) = Rules::parse(&bytes) {
                let mut plan = Sequencer::new(rules);
                for _ in 0..6 {
                    let _ = plan.next(&set(0.0, 0.3));
                    plan.succeeded();
                }
            }
        }
    }
}

#[test]
fn rules_with_invalid_targets_are_refused() {
    let parse = |order: RuleOrder| {
        let bytes = write(&[order], [0; 32]).unwrap();
        Rules::parse(&bytes).map(|_| ())
    };
    assert_eq!(parse(rule(Kind::Drive, "", 0, 0.0, 0.1, 0, None)), Ok(()));
    assert_eq!(
        parse(rule(Kind::Drive, "", 0, 0.0, 0.1, 1, None)),
        Err(RulesError::Rule)
    );
    assert_eq!(
        parse(rule(Kind::Drive, "", 0, 0.0, 0.1, 0, Some(1))),
        Err(RulesError::Rule)
    );
    let mut never = rule(Kind::Drive, "", 0, 0.0, 0.1, 0, None);
    never.rule.attempts = 0;
    assert_eq!(parse(never), Err(RulesError::Rule));
    assert_eq!(write(&[], [0; 32]), None);
    assert_eq!(
        write(
            &[rule(
                Kind::Work,
                "a name of more than thirty-two bytes",
                0,
                0.0,
                0.1,
                0,
                None
            )],
            [0; 32]
        ),
        None
    );
}
