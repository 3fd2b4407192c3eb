use super::*;
use crate::fixtures::{self, TABLE, at};
use rustdds::{DomainParticipantStatusEvent, GUID};

fn settings(line: &str) -> NodeSettings {
    fixtures::settings(TABLE, &format!("--ros-args -p stands_still:=true {line}"))
}

fn received() -> Received {
    let delivery = Delivery {
        reliable: true,
        transient_local: false,
    };
    let peers = Peers::new(
        "/pose",
        ["geometry_msgs", "PoseStamped"],
        GUID::from_bytes([0; 16]),
    );
    Received::new("/pose".into(), "", delivery, peers)
}

#[test]
fn publisher_that_sends_nothing_is_named() {
    let mut silent = received();
    let words = silent.problem().unwrap();
    assert!(words.contains("nobody publishes"), "{words}");
    silent
        .peers
        .note(&DomainParticipantStatusEvent::RemoteWriterMatched {
            local_reader: GUID::from_bytes([0; 16]),
            remote_writer: GUID::from_bytes([1; 16]),
        });
    let words = silent.problem().unwrap();
    assert!(words.contains("no message of it has arrived"), "{words}");
    silent.note(at(0), at(0).time());
    assert!(silent.problem().is_none());
}

#[test]
fn hold_that_would_open_is_named() {
    let mut slow = received();
    for (k, jitter) in [0, 10, -10, 5, 0, 0].into_iter().enumerate() {
        let ms = 600 * k as i128 + jitter;
        slow.note(at(ms), at(ms - 20).time());
    }
    let [period, jitter] = slow.pace_ms().unwrap();
    assert!(
        (590.0..=610.0).contains(&period) && (jitter - 35.0).abs() < 0.1,
        "{period} {jitter}"
    );
    let words = slow.hold(&settings("-p permit_hold_ms:=500")).unwrap();
    assert!(
        words.contains("held for 500 ms") && words.contains("permit_hold_ms of 601 or more"),
        "{words}"
    );
    assert!(slow.hold(&settings("-p permit_hold_ms:=601")).is_none());
    assert!(slow.hold(&settings("")).is_none());
    // The hold that is named has a maximum age with which it is accepted.
    let words = slow
        .hold(&settings("-p permit_hold_ms:=500 -p maximum_age_ms:=900"))
        .unwrap();
    assert!(words.contains("maximum_age_ms of 991 or more"), "{words}");
    let _ = settings("-p permit_hold_ms:=601 -p maximum_age_ms:=991");
    let mut fast = received();
    for k in 0..40 {
        fast.note(at(100 * k), at(100 * k).time());
    }
    assert!(fast.hold(&settings("")).is_none());
}

#[test]
fn faults_of_stamps_are_named_with_their_size() {
    let words = |stamp: Time| {
        let mut received = received();
        received.note(at(0), stamp);
        received.stamps(&settings("")).unwrap_or_default()
    };
    assert_eq!(words(at(-20).time()), "");
    assert!(
        words(at(-1_500).time()).contains("1.500 s old"),
        "{}",
        words(at(-1_500).time())
    );
    assert!(words(at(30).time()).contains("0.030 s in the future"));
    assert!(
        words(Time {
            sec: 42,
            nanosec: 0
        })
        .contains("simulated time")
    );
    assert!(words(Time::default()).contains("zero"));
}
