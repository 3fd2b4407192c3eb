//! A plan and a clock in C: they act as in Rust, and no wrong argument gives a step or stops the time unseen.

mod support;

use posegate::gate::{Clock, Reason};
use posegate::report::PoseEstimate;
use posegate::sequencer::{Instruction, Rules, Sequencer, StopReason};
use posegate::set::{Estimate, PoseSet, RadiusSquared, Uncertainty};
use posegate_c::*;
use std::ffi::CStr;
use support::{RULES, in_c, leaked, zero, zeroed};

/// The squared radius of epsilon 0.99.
const RADIUS: u32 = 743_498;
const OK: posegate_status = posegate_status::Ok;

fn sequencer() -> *mut posegate_sequencer {
    let sequencer = zeroed();
    // SAFETY: valid pointers.
    let status = unsafe { posegate_sequencer_init(sequencer, RULES.as_ptr(), RULES.len()) };
    assert_eq!(status, OK);
    sequencer
}

const ORIGIN: Estimate = Estimate {
    x_m: 0.0,
    y_m: 0.0,
    yaw_rad: 0.0,
};

/// Returns an estimate from which the plan drives first.
fn start() -> posegate_belief {
    let bounded = Uncertainty::Bounded {
        translation_m: 0.1,
        yaw_rad: 0.02,
    };
    in_c(&PoseEstimate::new(ORIGIN, bounded))
}

/// Returns what an instruction in Rust is in C.
fn expected(instruction: Instruction<'_>) -> (u32, u32, u32, String, posegate_pose) {
    let nowhere = zero();
    let none = String::new();
    match instruction {
        Instruction::Look { task, tag } => (1, 0, tag, task.into(), nowhere),
        Instruction::Drive { to } => {
            let to = posegate_pose {
                x_um: to.x_um,
                y_um: to.y_um,
                yaw_turn_q32: to.yaw.0,
            };
            (2, 0, POSEGATE_NO_TAG, none, to)
        }
        Instruction::Work { task } => (3, 0, POSEGATE_NO_TAG, task.into(), nowhere),
        Instruction::Inhibit(why) => {
            let stop = match why {
                StopReason::Done => posegate_stop::Done,
                StopReason::GaveUp => posegate_stop::GaveUp,
                StopReason::NoEntry => posegate_stop::NoEntry,
                other => panic!("{other:?}"),
            };
            (4, stop as u32, POSEGATE_NO_TAG, none, nowhere)
        }
    }
}

/// Thousands of plans with failures and sets of many sizes end as in Rust, step by step.
#[test]
fn c_sequencer_equals_rust_sequencer() {
    let rules = Rules::parse(RULES).unwrap();
    let mut state = 1_u64;
    let mut below = |limit: u64| {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        (state >> 33) % limit
    };
    let mut kinds = [0; 8];
    for _ in 0..2_000 {
        let (in_c, mut in_rust) = (sequencer(), Sequencer::new(rules));
        for _ in 0..12 {
            let place = in_rust.rule().and_then(|number| rules.get(number));
            let place = place.map(|rule| rule.place).unwrap_or_default();
            let far = if below(20) == 0 { 5.0 } else { 0.0 };
            let estimate = Estimate {
                x_m: f64::from(place.x_um) / 1e6 + far,
                y_m: f64::from(place.y_um) / 1e6,
                yaw_rad: f64::from(place.yaw.signed()) / 4_294_967_296.0 * core::f64::consts::TAU,
            };
            let size = 0.02 * (1 + below(15)) as f64;
            let (spread, set) = if below(2) == 0 {
                let spread = Uncertainty::Bounded {
                    translation_m: size,
                    yaw_rad: 0.03,
                };
                (spread, PoseSet::bounded(estimate, size, 0.03).unwrap())
            } else {
                let variance = (size / 4.0).powi(2);
                let covariance = [[variance, 0.0, 0.0], [0.0, variance, 0.0], [0.0, 0.0, 1e-4]];
                let radius = RadiusSquared::from_q16(RADIUS).unwrap();
                let set = PoseSet::gaussian(estimate, covariance, radius).unwrap();
                (Uncertainty::Gaussian(covariance), set)
            };
            let belief = support::in_c(&PoseEstimate::new(estimate, spread));
            let next = zeroed::<posegate_instruction>();
            // SAFETY: valid pointers; the name ends with a zero.
            let found = unsafe {
                assert_eq!(posegate_sequencer_next(in_c, &belief, RADIUS, next), OK);
                let next = &*next;
                let task = CStr::from_ptr(next.task.as_ptr()).to_str().unwrap();
                (next.kind, next.stop, next.tag, task.to_owned(), next.to)
            };
            assert_eq!(found, expected(in_rust.next(&set)));
            kinds[(found.0 + found.1) as usize] += 1;
            let succeeds = below(4) != 0;
            // SAFETY: a valid pointer.
            let status = unsafe {
                if succeeds {
                    in_rust.succeeded();
                    posegate_sequencer_succeeded(in_c)
                } else {
                    in_rust.failed();
                    posegate_sequencer_failed(in_c)
                }
            };
            assert_eq!(status, OK);
        }
    }
    // Looks, drives, work; done, given up, no entry.
    let [_, looks, drives, work, _, done, gave_up, no_entry] = kinds;
    for count in [looks, drives, work, done, gave_up, no_entry] {
        assert!(count > 100, "{kinds:?}");
    }
}

/// A wrong argument is an error, inhibits, and does not move the plan.
#[test]
fn invalid_arguments_inhibit() {
    let bad = posegate_status::BadValue;
    let good = start();
    let gaussian = [[1e-4, 0.0, 0.0], [0.0, 1e-4, 0.0], [0.0, 0.0, 1e-4]];
    let gaussian = PoseEstimate::new(ORIGIN, Uncertainty::Gaussian(gaussian));
    let gaussian = in_c(&gaussian);
    let not_a_number = posegate_belief {
        x_m: f64::NAN,
        ..good
    };
    let unknown = posegate_belief {
        spread_kind: posegate_spread::Unknown as u32,
        ..good
    };
    let no_form = posegate_belief {
        spread_kind: 9,
        ..good
    };
    let plan = sequencer();
    let next = zeroed::<posegate_instruction>();
    // SAFETY: pointers are null, misaligned or valid.
    unsafe {
        for (belief, radius) in [
            (not_a_number, RADIUS),
            (unknown, RADIUS),
            (no_form, RADIUS),
            (gaussian, 0),
        ] {
            (*next).kind = posegate_instruction_kind::Work as u32;
            assert_eq!(posegate_sequencer_next(plan, &belief, radius, next), bad);
            assert_eq!((*next).kind, posegate_instruction_kind::Inhibit as u32);
            assert_eq!((*next).stop, 0);
        }
        assert_eq!(posegate_sequencer_next(plan, &good, 0, next), OK);
        assert_eq!((*next).kind, posegate_instruction_kind::Drive as u32);
        let status = posegate_sequencer_init(zeroed(), RULES.as_ptr(), usize::MAX);
        assert_eq!(status, posegate_status::BadLength);
        // A copy at another place.
        let moved = leaked(plan.read());
        let status = posegate_sequencer_next(moved, &good, RADIUS, next);
        assert_eq!(status, posegate_status::NotInitialised);
        // Damaged rules leave storage that is not in use.
        let status = posegate_sequencer_init(plan, RULES.as_ptr(), RULES.len() - 1);
        assert_eq!(status, posegate_status::RulesInvalid);
        let status = posegate_sequencer_next(plan, &good, RADIUS, next);
        assert_eq!(status, posegate_status::NotInitialised);
    }
}

#[test]
fn c_clock_equals_rust_clock() {
    let clock = zeroed::<posegate_clock>();
    let mut now_ms = 1;
    // SAFETY: pointers are null or valid.
    unsafe {
        for (ticks_per_s, bits, still) in
            [(0, 32, 1), (1_000, 0, 1), (1_000, 33, 1), (1_000, 32, 0)]
        {
            let status = posegate_clock_init(clock, ticks_per_s, bits, still, 0);
            assert_eq!(status, posegate_status::BadValue);
        }
        // After an error the time is 0, at which a gate denies.
        let status = posegate_clock_now(clock, 5, &mut now_ms);
        assert_eq!((status, now_ms), (posegate_status::NotInitialised, 0));
        assert_eq!(posegate_clock_init(clock, 32_768, 24, 2, 0xff_ff00), OK);
        let mut in_rust = Clock::new(32_768, 24, 2, 0xff_ff00).unwrap();
        for round in 0..1_000_u32 {
            let count = round.wrapping_mul(16_000_001);
            assert_eq!(posegate_clock_now(clock, count, &mut now_ms), OK);
            assert_eq!(now_ms, in_rust.now_ms(count));
        }
        // The counter stands still.
        let count = 999_u32.wrapping_mul(16_000_001);
        let before = now_ms;
        assert_eq!(posegate_clock_now(clock, count, &mut now_ms), OK);
        let status = posegate_clock_now(clock, count, &mut now_ms);
        assert_eq!(status, posegate_status::ClockStopped);
        assert_eq!(now_ms, before);
    }
    assert_eq!(Reason::ClockStopped.code(), 46);
}

/// The state of a plan is the caller's own, so the same estimate gives the same step until its result is reported.
#[test]
fn a_step_is_repeated_until_its_result_is_reported() {
    let belief = start();
    let (plan, next) = (sequencer(), zeroed::<posegate_instruction>());
    // SAFETY: valid pointers.
    unsafe {
        assert_eq!(posegate_sequencer_next(plan, &belief, 0, next), OK);
        let first = *next;
        assert_eq!(posegate_sequencer_next(plan, &belief, 0, next), OK);
        assert_eq!(*next, first);
        let to = first.to;
        assert_eq!((to.x_um, to.y_um), (1_500_000, 200_000));
    }
}
