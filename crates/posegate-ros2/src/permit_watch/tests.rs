use super::*;
use crate::fixtures::{self, at};
use crate::message::{KeyValue, WARN};
use crate::permission::Heartbeat;
use crate::permit_gate::Answer;
use crate::settings::NodeSettings;
use posegate::gate::{Reason, State};

const TABLES: [&[u8]; 3] = [
    include_bytes!("../../../../examples/tables/dock.posegate"),
    include_bytes!("../../../../examples/tables/contingent-dock.posegate"),
    include_bytes!("../../../../examples/tables/see-t7.posegate"),
];
fn settings(table: &[u8], number: usize) -> NodeSettings {
    let line =
        format!("--ros-args -r __ns:=/robot{number} -p stands_still:=true -p cross_terms:=filled");
    fixtures::settings(table, &line)
}

fn answer(ms: i128, is_open: bool) -> Answer {
    Answer {
        now: at(ms),
        is_open,
        state: if is_open {
            State::Permitted
        } else {
            State::Inhibited(Reason::Silent)
        },
    }
}

fn watch(settings: &NodeSettings) -> PermitWatch {
    PermitWatch::new(settings.task(), &settings.robot, &settings.table())
}

fn set(message: &mut DiagnosticArray, key: &str, value: &str) {
    for pair in &mut message.status[0].values {
        if pair.key == key {
            pair.value = value.into();
        }
    }
}

/// A heartbeat that permits the robot 0 at the time 0, and a watch of it.
fn good() -> (DiagnosticArray, PermitWatch) {
    let settings = settings(TABLES[0], 0);
    let message = Heartbeat::start().next(&answer(0, true), &settings, Some(&settings), Vec::new());
    (message, watch(&settings))
}

/// Of three robots in one domain two are permitted, and the third has no pose. Its consumer also receives their
/// heartbeats (their namespace is confused), and any of robot, table and run of theirs may equal its own: all but all
/// of them. Its own node is alive and denies.
#[test]
fn permit_of_another_robot_is_never_obeyed() {
    let (mut asks, mut wrong, mut right) = (0_u32, 0_u32, 0_u32);
    let mut random = 1_u64;
    let mut chance = move || {
        random = random
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (random >> 33) % 100
    };
    for own in 0..3_usize {
        let own_settings = settings(TABLES[own], own);
        for confusion in 0..15_u32 {
            let is_confused = |bit: u32| confusion & (1 << bit) != 0;
            let mut nodes = Vec::new();
            for other in (0..3).filter(|other| *other != own) {
                let table = TABLES[if is_confused(1) { own } else { other }];
                let mut settings = settings(table, other);
                if is_confused(2) {
                    settings.robot.clone_from(&own_settings.robot);
                }
                let watch = watch(&settings);
                nodes.push((settings, Heartbeat::start(), watch));
            }
            let (mut watch, mut heartbeat) = (watch(&own_settings), Heartbeat::start());
            let mut run = String::new();
            for ms in 0..2_300_i128 {
                if ms % 50 == 0 {
                    let message = heartbeat.next(
                        &answer(ms, false),
                        &own_settings,
                        Some(&own_settings),
                        Vec::new(),
                    );
                    run = message.status[0].value("run").unwrap().to_owned();
                    if chance() >= 30 {
                        watch.heartbeat(&message, at(ms + 1), ms * MS);
                    }
                }
                for (k, (settings, heartbeat, own_watch)) in nodes.iter_mut().enumerate() {
                    if (ms + 17 + 16 * k as i128) % 50 != 0 {
                        continue;
                    }
                    let mut message =
                        heartbeat.next(&answer(ms, true), settings, Some(settings), Vec::new());
                    own_watch.heartbeat(&message, at(ms + 1), ms * MS);
                    if is_confused(3) {
                        set(&mut message, "run", &run);
                    }
                    if is_confused(0) && chance() >= 30 {
                        watch.heartbeat(&message, at(ms + 1), ms * MS);
                    }
                }
                asks += 1;
                wrong += u32::from(watch.permitted(ms * MS));
                right += u32::from(nodes.iter_mut().all(|(.., watch)| watch.permitted(ms * MS)));
            }
        }
    }
    assert!(asks > 100_000 && right > 90_000, "{asks} {right}");
    assert_eq!(wrong, 0, "wrong permits in {asks} asks");
}

/// Two nodes of one robot, both open: none of them is obeyed, also if one of them is slow. After the end of one, the
/// other is, ten seconds later.
#[test]
fn two_runs_that_alternate_deny() {
    let settings = settings(TABLES[0], 0);
    let mut watch = watch(&settings);
    let [mut one, mut two] = [Heartbeat::start(), Heartbeat::start()];
    let first = one.next(&answer(0, true), &settings, Some(&settings), Vec::new());
    watch.heartbeat(&first, at(0), 0);
    assert!(watch.permitted(0));
    for ms in (50..20_000).step_by(50) {
        let heartbeat = if ms % 3_000 == 0 && ms < 7_000 {
            &mut one
        } else {
            &mut two
        };
        let message = heartbeat.next(&answer(ms, true), &settings, Some(&settings), Vec::new());
        watch.heartbeat(&message, at(ms), ms * MS);
        let permits = watch.permitted(ms * MS);
        // The other run is new at 50 ms, and comes back for the last time at 6050 ms.
        let expected = (1_050..3_000).contains(&ms) || ms >= 16_050;
        assert_eq!(permits, expected, "{ms}: {}", watch.reason());
    }
}

#[test]
fn every_part_of_a_heartbeat_is_required() {
    let (message, mut watch) = good();
    watch.heartbeat(&message, at(0), 0);
    assert!(watch.permitted(249 * MS) && !watch.permitted(250 * MS));
    let mut refused: Vec<DiagnosticArray> = Vec::new();
    for key in [
        "format", "robot", "table", "task", "run", "sequence", "valid_ms", "state", "reason",
    ] {
        let mut without = message.clone();
        without.status[0].values.retain(|pair| pair.key != key);
        refused.push(without);
        for value in ["x1", "99999999999999999999", "0", "1001", ""] {
            // Every text is a run, and an empty reason is that of a permit.
            if key == "run"
                || (key, value) == ("reason", "")
                || (key, value) == ("sequence", "0")
                || (key, value) == ("sequence", "1001")
            {
                continue;
            }
            let mut changed = message.clone();
            set(&mut changed, key, value);
            refused.push(changed);
        }
    }
    for change in [
        |message: &mut DiagnosticArray| message.status[0].level = WARN,
        |message: &mut DiagnosticArray| message.status[0].message = "deny".into(),
        |message: &mut DiagnosticArray| message.status[0].name = "other".into(),
        |message: &mut DiagnosticArray| message.status.clear(),
        |message: &mut DiagnosticArray| message.status.push(message.status[0].clone()),
        |message: &mut DiagnosticArray| {
            message.status[0].values.push(KeyValue::new("task", "dock"))
        },
        |message: &mut DiagnosticArray| message.header.stamp = at(-250).time(),
        |message: &mut DiagnosticArray| message.header.stamp = at(21).time(),
    ] {
        let mut changed = message.clone();
        change(&mut changed);
        refused.push(changed);
    }
    for message in &refused {
        let (_, mut watch) = good();
        watch.heartbeat(message, at(0), 0);
        assert!(!watch.permitted(0), "{message:?}");
        assert!(!watch.reason().is_empty());
    }
    for (robot, table) in [("", "x"), ("/robot0/posegate", "")] {
        let mut changed = message.clone();
        set(&mut changed, "robot", robot);
        set(&mut changed, "table", table);
        let mut watch = PermitWatch::new("dock", robot, table);
        watch.heartbeat(&changed, at(0), 0);
        assert!(!watch.permitted(0), "an empty name permits");
    }
}

#[test]
fn repeated_heartbeat_ends_the_permit() {
    let (message, mut watch) = good();
    watch.heartbeat(&message, at(0), 0);
    watch.heartbeat(&message, at(1), MS);
    assert!(!watch.permitted(MS));
    assert_eq!(watch.reason(), "heartbeats out of order");
}
