use super::*;
use crate::contain::Margin;
use crate::gate::{Reason, Verdict};
use embedded_hal_mock::eh1::MockError;
use embedded_hal_mock::eh1::digital::{Mock, State, Transaction};
use std::io::ErrorKind;

/// A permission or a denial for the cycle in which it is applied.
#[derive(Clone, Copy, PartialEq)]
enum Shown {
    Open,
    Shut,
}

use Shown::{Open as OPEN, Shut as SHUT};

impl Shown {
    fn at(self, now_ms: u32) -> Permission {
        let verdict = match self {
            Self::Open => Verdict::Permit {
                margin: Margin::ONE,
            },
            Self::Shut => Verdict::deny(Reason::Stale),
        };
        Permission::of_single(&verdict, now_ms)
    }
}

impl<P: OutputPin, R: InputPin, H: OutputPin> Interlock<P, R, H> {
    fn apply_shown(&mut self, now_ms: u32, shown: Shown) -> Result<(), InterlockFault> {
        self.apply(now_ms, &shown.at(now_ms))
    }
}

/// A stored permission opens nothing later, even after a denial in between, and is a fault.
#[test]
fn a_permission_of_another_cycle_is_refused() {
    for later in [1, 10, 1 << 31, u32::MAX] {
        let (output, mut asked) = pin(&[low(), high(), low(), low(), low(), low(), high(), low()]);
        let mut interlock = Interlock::new(output).unwrap();
        let kept = OPEN.at(100);
        interlock.apply(100, &kept).unwrap();
        interlock.apply_shown(105, SHUT).unwrap();
        let now_ms = 100u32.wrapping_add(later);
        let refused = Err(InterlockFault::OldPermission);
        assert_eq!(interlock.apply(now_ms, &kept), refused);
        // The fault is latched.
        assert_eq!(interlock.apply_shown(now_ms, OPEN), refused);
        interlock.reset();
        interlock.apply_shown(now_ms, OPEN).unwrap();
        drop(interlock);
        asked.done();
    }
}

fn high() -> Transaction {
    Transaction::set(State::High)
}

fn low() -> Transaction {
    Transaction::set(State::Low)
}

fn fails(transaction: Transaction) -> Transaction {
    transaction.with_error(MockError::Io(ErrorKind::NotConnected))
}

/// Returns a mock pin that expects exactly these transactions, and a clone to check that they took place.
fn pin(expected: &[Transaction]) -> (Mock, Mock) {
    let pin = Mock::new(expected);
    (pin.clone(), pin)
}

#[test]
fn low_at_first_on_denial_and_at_the_end() {
    let (output, mut asked) = pin(&[low(), high(), low(), high(), low()]);
    let mut interlock = Interlock::new(output).unwrap();
    interlock.apply_shown(0, OPEN).unwrap();
    interlock.apply_shown(10, SHUT).unwrap();
    interlock.apply_shown(20, OPEN).unwrap();
    drop(interlock);
    asked.done();
}

#[test]
fn a_pin_that_cannot_go_low_at_first_is_not_taken() {
    let (output, mut asked) = pin(&[fails(low())]);
    assert!(Interlock::new(output).is_err());
    asked.done();
}

/// An error drives the output low, is reported, and is latched until a reset.
#[test]
fn an_output_error_is_latched() {
    let (output, mut asked) = pin(&[
        low(),
        high(),
        fails(high()),
        low(),
        // While latched: low again in every cycle, never high.
        low(),
        low(),
        high(),
        low(),
    ]);
    let mut interlock = Interlock::new(output).unwrap();
    interlock.apply_shown(0, OPEN).unwrap();
    assert_eq!(interlock.apply_shown(10, OPEN), Err(InterlockFault::Output));
    assert_eq!(interlock.apply_shown(20, OPEN), Err(InterlockFault::Output));
    assert_eq!(interlock.apply_shown(30, OPEN), Err(InterlockFault::Output));
    assert_eq!(interlock.fault(), Some(InterlockFault::Output));
    interlock.reset();
    interlock.apply_shown(40, OPEN).unwrap();
    drop(interlock);
    asked.done();
}

#[test]
fn a_pin_that_cannot_be_closed_is_latched() {
    let (output, mut asked) = pin(&[low(), high(), fails(low()), low(), low()]);
    let mut interlock = Interlock::new(output).unwrap();
    interlock.apply_shown(0, OPEN).unwrap();
    assert_eq!(interlock.close(), Err(InterlockFault::Output));
    assert_eq!(interlock.apply_shown(1, OPEN), Err(InterlockFault::Output));
    drop(interlock);
    asked.done();
}

/// The first fault stays: it is the cause.
#[test]
fn failed_close_keeps_the_latched_fault() {
    let (output, mut asked) = pin(&[low(), low(), fails(low()), low()]);
    let (input, mut read) = pin(&[fails(Transaction::get(State::Low))]);
    let mut interlock = Interlock::new(output)
        .unwrap()
        .with_read_back(input, 30)
        .unwrap();
    assert_eq!(interlock.apply_shown(0, OPEN), Err(InterlockFault::Input));
    assert_eq!(interlock.close(), Err(InterlockFault::Output));
    assert_eq!(interlock.fault(), Some(InterlockFault::Input));
    drop(interlock);
    asked.done();
    read.done();
}

/// Applies permissions at times to a contact with scripted levels, and checks the call in which the interlock
/// reports the fault.
fn follow(shown: &[(u32, Shown, bool)], fault_at: Option<usize>) {
    let mut driven = Vec::from([low()]);
    for (index, (_, permission, _)) in shown.iter().enumerate() {
        match fault_at {
            Some(at) if index >= at => driven.push(low()),
            _ if *permission == OPEN => driven.push(high()),
            _ => driven.push(low()),
        }
    }
    driven.push(low());
    let (output, mut asked) = pin(&driven);
    let seen = shown.iter().take(fault_at.map_or(shown.len(), |at| at + 1));
    let levels: Vec<_> = seen
        .map(|(_, _, level)| Transaction::get(if *level { State::High } else { State::Low }))
        .collect();
    let (input, mut read) = pin(&levels);
    let mut interlock = Interlock::new(output)
        .unwrap()
        .with_read_back(input, 30)
        .unwrap();
    for (index, (now, permission, _)) in shown.iter().enumerate() {
        let applied = interlock.apply_shown(*now, *permission);
        let expected = match fault_at {
            Some(at) if index >= at => Err(InterlockFault::NotFollowing),
            _ => Ok(()),
        };
        assert_eq!(applied, expected, "{index}");
    }
    drop(interlock);
    asked.done();
    read.done();
}

#[test]
fn a_contact_may_take_its_time() {
    let at = u32::MAX - 15;
    let t = |ms: u32| at.wrapping_add(ms);
    // The input is read before the output is driven: the contact follows the level of the previous cycle.
    follow(
        &[
            (t(0), OPEN, false),
            (t(10), OPEN, false),
            (t(20), OPEN, false),
            (t(30), OPEN, true),
            (t(40), SHUT, true),
            (t(70), SHUT, true),
            (t(80), SHUT, false),
        ],
        None,
    );
}

#[test]
fn a_welded_contact_is_found() {
    let shown = [
        (0, SHUT, false),
        (10, OPEN, false),
        (20, SHUT, true),
        (35, SHUT, true),
        (50, SHUT, true),
        (51, SHUT, true),
        (60, OPEN, false),
    ];
    follow(&shown, Some(5));
    // From the first cycle.
    follow(
        &[(0, SHUT, true), (30, SHUT, true), (31, SHUT, true)],
        Some(2),
    );
}

/// An output that goes high again before the time is over does not hide a weld. A contact that follows the
/// output, or that is slower than a short permit, is not reported as welded.
#[test]
fn a_welded_contact_is_found_under_an_output_that_flaps() {
    for start in [0, u32::MAX - 45] {
        let flaps = |levels: [bool; 12]| -> Vec<_> {
            let time = |k: usize| start.wrapping_add(10 * k as u32);
            let commanded = |k| if k % 2 == 0 { OPEN } else { SHUT };
            let shown = levels.into_iter().enumerate();
            shown
                .map(|(k, level)| (time(k), commanded(k), level))
                .collect()
        };
        let welded = [
            false, true, true, true, true, true, true, true, true, true, true, true,
        ];
        follow(&flaps(welded), Some(8));
        let follows = [
            false, true, false, true, false, true, false, true, false, true, false, true,
        ];
        follow(&flaps(follows), None);
        follow(&flaps([false; 12]), None);
        // Once the contact is read low, the whole time is restored.
        let opens_once = [
            false, true, true, true, true, true, false, true, true, true, true, true,
        ];
        follow(&flaps(opens_once), None);
    }
}

#[test]
fn a_contact_that_never_closes_is_found() {
    let shown = [
        (0, OPEN, false),
        (30, OPEN, false),
        (31, OPEN, false),
        (40, OPEN, false),
    ];
    follow(&shown, Some(2));
    // A clock that goes backwards gains no time.
    follow(&[(50, OPEN, false), (49, OPEN, false)], Some(1));
}

#[test]
fn a_read_back_that_fails_is_a_fault() {
    let (output, mut asked) = pin(&[low(), low(), low()]);
    let (input, mut read) = pin(&[fails(Transaction::get(State::Low))]);
    let mut interlock = Interlock::new(output)
        .unwrap()
        .with_read_back(input, 30)
        .unwrap();
    assert_eq!(interlock.apply_shown(0, OPEN), Err(InterlockFault::Input));
    drop(interlock);
    asked.done();
    read.done();
}

/// The heartbeat toggles while the interlock is applied, closed or open, and stops with a fault.
#[test]
fn a_heartbeat_stops_with_a_fault() {
    let (output, mut asked) = pin(&[
        low(),
        low(),
        low(),
        high(),
        high(),
        fails(high()),
        low(),
        low(),
        low(),
    ]);
    let (beat, mut beaten) = pin(&[high(), low()]);
    let mut interlock = Interlock::new(output)
        .unwrap()
        .with_heartbeat(beat, 20)
        .unwrap();
    for (now, permission) in [(0, SHUT), (10, SHUT), (20, OPEN), (45, OPEN)] {
        interlock.apply_shown(now, permission).unwrap();
    }
    for now in [65, 85] {
        assert_eq!(
            interlock.apply_shown(now, OPEN),
            Err(InterlockFault::Output)
        );
    }
    drop(interlock);
    asked.done();
    beaten.done();
}

/// A cycle that is a millisecond early does not delay the beat by a whole cycle: in a second there are as many beats as periods.
#[test]
fn a_heartbeat_keeps_its_rate_beside_jitter() {
    let beats: Vec<_> = (0..25)
        .map(|k| if k % 2 == 0 { high() } else { low() })
        .collect();
    let lows: Vec<_> = (0..103).map(|_| low()).collect();
    let (output, mut asked) = pin(&lows);
    let (beat, mut beaten) = pin(&beats);
    let mut interlock = Interlock::new(output)
        .unwrap()
        .with_heartbeat(beat, 40)
        .unwrap();
    for cycle in 0..=100u32 {
        // Every third cycle is a millisecond early.
        let now = 10 * cycle - u32::from(cycle % 3 == 0 && cycle > 0);
        interlock.apply_shown(now, SHUT).unwrap();
    }
    drop(interlock);
    asked.done();
    beaten.done();
}

#[test]
fn a_heartbeat_that_fails_closes() {
    let (output, mut asked) = pin(&[low(), high(), high(), low(), low()]);
    let (beat, mut beaten) = pin(&[fails(high())]);
    let mut interlock = Interlock::new(output)
        .unwrap()
        .with_heartbeat(beat, 10)
        .unwrap();
    interlock.apply_shown(0, OPEN).unwrap();
    assert_eq!(
        interlock.apply_shown(10, OPEN),
        Err(InterlockFault::Heartbeat)
    );
    drop(interlock);
    asked.done();
    beaten.done();
}

#[test]
fn no_time_switches_a_check_off() {
    for bad in [0, 1 << 31, u32::MAX] {
        let wrong = Some(InvalidParameter::InterlockTime);
        assert_eq!(
            Interlock::new(NoPin)
                .unwrap()
                .with_read_back(NoPin, bad)
                .err(),
            wrong
        );
        assert_eq!(
            Interlock::new(NoPin)
                .unwrap()
                .with_heartbeat(NoPin, bad)
                .err(),
            wrong
        );
    }
}
