//! The gate's state machine: a million random events are compared with a short reference, and each
//! failure that occurred in real systems is injected by name.

#[path = "../crates/posegate-testkit/src/gate.rs"]
#[allow(dead_code)] // This target uses only a part.
mod support;

use posegate::gate::{Advice, Gate, InvalidParameter, Reason, Restart, Settings, Source, State};
use posegate::motion::MotionBounds;
use posegate::report::{FrameId, PoseEstimate, Report};
use posegate::set::{Aging, CrossTerms, Estimate, Inflation, Trust, Uncertainty};
use support::{
    DOCK, MAXIMUM_AGE_MS, OLDEST_MS, PERMIT_HOLD_MS, SOURCE, belief, permitted, report, settings,
};

const SEE_T7: &[u8] = include_bytes!("../examples/tables/see-t7.posegate");
static TOO_MANY: [Source; 257] = [SOURCE; 257];

/// Returns the next random number (SplitMix64).
fn next(state: &mut u64) -> u64 {
    *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let mut z = *state;
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// A report for the reference, whose clock does not wrap.
#[derive(Clone, Copy)]
struct SentReport {
    source: u8,
    sequence: u32,
    stamp: i64,
    /// Its frame is that of the source.
    framed: bool,
    /// Its estimate would be permitted if fresh.
    inside: bool,
}

/// The reference: the required behaviour in plain numbers.
struct Reference<'a> {
    set: &'a Settings<'a>,
    now: i64,
    closed_until: i64,
    row: u32,
    open_until: i64,
    last: Option<(u8, u32)>,
    newest: i64,
    open: bool,
    latched: bool,
}

impl<'a> Reference<'a> {
    fn new(set: &'a Settings<'a>, now: i64) -> Self {
        Self {
            set,
            now,
            closed_until: now + i64::from(set.inhibit_hold_ms),
            row: 0,
            open_until: 0,
            last: None,
            newest: i64::MIN,
            open: false,
            latched: false,
        }
    }

    fn close(&mut self) {
        self.latched |= self.open && self.set.restart == Restart::OnReset;
        (self.open, self.row) = (false, 0);
        self.closed_until = self.now + i64::from(self.set.inhibit_hold_ms);
    }

    fn happens(&mut self, now: i64, sent: Option<SentReport>) {
        let maximum_age = i64::from(self.set.maximum_age_ms);
        let backwards = now < self.now;
        let late = self.open && now - self.now > i64::from(self.set.response_ms);
        self.now = now;
        if backwards {
            self.newest = self.newest.min(now + maximum_age);
        }
        if backwards || late || self.row > 0 && now > self.open_until {
            self.close();
        }
        let Some(sent) = sent else { return };
        if !sent.framed || usize::from(sent.source) >= self.set.sources.len() {
            return self.close();
        }
        let last = self.last.replace((sent.source, sent.sequence));
        let again = last == self.last && sent.stamp == self.newest;
        let before = (sent.source, sent.sequence.wrapping_sub(1));
        let next = last.is_none_or(|last| last == before && sent.stamp > self.newest);
        if sent.stamp <= now {
            self.newest = self.newest.max(sent.stamp);
        }
        let oldest = maximum_age - i64::from(self.set.response_ms);
        let permits = sent.inside && (0..=oldest).contains(&(now - sent.stamp));
        if backwards || !permits || !(next || again) {
            return self.close();
        }
        if next {
            self.row += 1;
            self.open_until = (now + i64::from(self.set.permit_hold_ms)).min(sent.stamp + oldest);
            self.open |=
                self.row >= u32::from(self.set.permits_in_a_row) && now >= self.closed_until;
        }
    }
}

/// Returns random settings: few and many permits, hold times below, at and above the maximum age, two and
/// three sources, both kinds of restart.
fn drawn_settings(seed: &mut u64) -> Settings<'static> {
    static THREE: [Source; 3] = [SOURCE; 3];
    let pick = next(seed);
    let hold = |at: u64| [50, 100, MAXIMUM_AGE_MS, 300][(pick >> at) as usize % 4];
    Settings {
        permits_in_a_row: 1 + (pick % 4) as u16,
        report_period_ms: 1,
        permit_hold_ms: hold(8),
        inhibit_hold_ms: if pick & 0x8000 == 0 { 10 } else { hold(16) },
        sources: &THREE[..2 + (pick >> 24) as usize % 2],
        restart: match (pick >> 32) % 4 {
            0 => Restart::OnReset,
            _ => Restart::Automatic,
        },
        ..settings()
    }
}

#[test]
fn million_random_events_match_the_reference() {
    let mut seed = 0x0bad_5eed;
    let (mut opened, mut permitted, mut closed, mut events) = (0u32, 0u32, 0u32, 0u32);
    // Counts of rare events: replays, repetitions, unknown sources, resets, faults, ends until a reset, external inhibits.
    let mut seen = [0u32; 7];
    while events < 1_000_000 {
        let settings = drawn_settings(&mut seed);
        // Begin near the wrap of the clock, of the sequence, or anywhere.
        let mut now = match next(&mut seed) % 3 {
            0 => (1i64 << 32) - 400,
            1 => (1i64 << 31) - 400,
            _ => i64::from(next(&mut seed) as u32),
        };
        let mut sequences = [(); 4].map(|()| match next(&mut seed) % 2 {
            0 => u32::MAX - 20,
            _ => next(&mut seed) as u32,
        });
        let mut gate = Gate::new(DOCK, &settings, now as u32).unwrap();
        let mut reference = Reference::new(&settings, now);
        let (mut stamp, mut source) = (now, 0);
        let (mut past, mut replayed): (Vec<SentReport>, _) = (Vec::new(), None);
        // Some runs have few disturbances, others many.
        let calm = 1 + next(&mut seed) % 64;
        for _ in 0..200 {
            events += 1;
            let mut odd = || next(&mut seed).is_multiple_of(2 * calm);
            let strange = [(); 10].map(|()| odd());
            let pick = next(&mut seed);
            let small = (pick >> 8) as i64;
            // Manual resets, and other faults. A latched gate is soon reset.
            let by_hand = if reference.latched { 16 } else { 512 };
            if (pick >> 48).is_multiple_of(by_hand) {
                gate.reset(now as u32).unwrap();
                reference = Reference::new(&settings, now);
                seen[3] += 1;
            } else if strange[9] && (pick >> 48) % 16 == 1 {
                gate.fault(Reason::InterlockFault);
                (reference.open, reference.latched) = (false, true);
                seen[4] += 1;
            } else if strange[9] && (pick >> 48) % 16 == 2 {
                let _ = gate.inhibit(now as u32, Reason::InterlockFault);
                reference.happens(now, None);
                reference.close();
                seen[6] += 1;
            }
            now += match (strange[0], pick % 4) {
                (false, _) if replayed.is_some() => small % 6,
                (false, _) => small % 30,
                (true, 0) => -(small % 40),
                (true, 1) => small % 350,
                (true, 2) => small % 0x1fff_ffff,
                (true, _) => {
                    [49, 50, 51, 99, 100, 101, 199, 200, 201, 300, 301, -300][small as usize % 12]
                }
            };
            let pick = next(&mut seed);
            if strange[6] && replayed.is_none() {
                // An earlier report is repeated.
                replayed = Some(past.len().saturating_sub((pick >> 32) as usize % 8));
            }
            let sent = if let Some(sent) = replayed.and_then(|at: usize| past.get(at)) {
                replayed = replayed
                    .map(|at| at + 1)
                    .filter(|_| !pick.is_multiple_of(8));
                seen[0] += 1;
                Some(*sent)
            } else if pick & 0x70 == 0 {
                replayed = None;
                None
            } else {
                replayed = None;
                // The source changes for good, or for one report.
                source = if strange[4] {
                    (pick >> 40) as u8 % 3
                } else {
                    source
                };
                let source = if strange[7] {
                    (pick >> 44) as u8 % 4
                } else {
                    source
                };
                let sequence = &mut sequences[usize::from(source)];
                *sequence = match (strange[1], pick % 4) {
                    (false, _) => sequence.wrapping_add(1),
                    (true, 0) => *sequence,
                    (true, 1) => sequence.wrapping_add(2),
                    (true, 2) => sequence.wrapping_sub(1),
                    (true, _) => pick as u32,
                };
                let age = match (strange[2], (pick >> 4) % 5) {
                    (false, _) => 0,
                    (true, 0) => i64::from(OLDEST_MS) + (pick >> 8) as i64 % 3 - 1,
                    (true, 1) => -1 - (pick >> 8) as i64 % 1000,
                    (true, 2) => (pick >> 8) as i64 % 250,
                    (true, 3) => (pick >> 8) as i64 % 30,
                    (true, _) => (pick >> 8) as i64 % 0x1fff_ffff,
                };
                stamp = if strange[3] { stamp } else { now - age };
                let sent = SentReport {
                    source,
                    sequence: *sequence,
                    stamp,
                    framed: !(strange[8] && pick & 1 == 0),
                    inside: !strange[5],
                };
                seen[2] += u32::from(!sent.framed || sent.source >= 2);
                past.push(sent);
                Some(sent)
            };
            let was_latched = reference.latched;
            reference.happens(now, sent);
            seen[5] += u32::from(reference.latched && !was_latched);
            let step = match sent {
                None => gate.tick(now as u32),
                Some(sent) => {
                    let step = gate.step(
                        now as u32,
                        &Report {
                            source: sent.source,
                            frame: FrameId::of(if sent.framed { "map" } else { "odom" }),
                            belief: belief(if sent.inside { 0.0 } else { 1.0 }),
                            ..report(sent.sequence, sent.stamp as u32)
                        },
                    );
                    seen[1] += u32::from(step.verdict == Err(Reason::Repeated));
                    step
                }
            };
            let open = reference.open && !reference.latched;
            assert_eq!(
                step.permission.is_permit(),
                open,
                "event {events}: {step:?}"
            );
            assert_eq!(open, step.state == State::Permitted);
            assert_eq!(
                reference.latched,
                matches!(step.state, State::Latched(_)),
                "{step:?}"
            );
            opened += u32::from(open && permitted == 0);
            permitted = u32::from(open);
            closed += u32::from(!open);
        }
    }
    // A gate that never opens, or always opens, would prove nothing.
    assert!(opened > 5_000 && closed > 100_000, "{opened} {closed}");
    assert!(events - closed > 100_000, "{events} {closed}");
    assert!(seen.iter().all(|count| *count > 300), "{seen:?}");
}

/// A gate is closed at first, and opens only after consecutive permits and the hold time.
#[test]
fn gate_opens_only_after_consecutive_permits() {
    let settings = settings();
    let gate = Gate::new(DOCK, &settings, 5).unwrap();
    assert_eq!(gate.state(), State::Inhibited(Reason::Silent));
    assert_eq!(gate.advice(), Some(Advice::Wait));
    for start in [1000, u32::MAX - 100, (1 << 31) - 60] {
        permitted(DOCK, &settings, start);
    }
}

/// Events that must close an open gate at once.
#[test]
fn each_failure_closes_an_open_gate() {
    type Change = fn(&mut Report, &mut u32);
    let cases: [(&str, Change, Reason); 22] = [
        (
            "stale",
            |r, now| {
                r.stamp_ms = *now - 10;
                *now += 191;
            },
            Reason::Stale,
        ),
        (
            "from the future",
            |r, now| r.stamp_ms = *now + 1,
            Reason::Stale,
        ),
        (
            "far in the future",
            |r, now| r.stamp_ms = now.wrapping_add(1 << 30),
            Reason::Stale,
        ),
        ("a gap", |r, _| r.sequence += 1, Reason::SequenceGap),
        ("out of order", |r, _| r.sequence -= 2, Reason::SequenceGap),
        (
            "the sequence stands still",
            |r, _| r.sequence -= 1,
            Reason::SequenceStuck,
        ),
        (
            "the stamp stands still",
            |r, now| r.stamp_ms = *now - 20,
            Reason::TimeBackwards,
        ),
        (
            "the stamp goes backwards",
            |r, now| r.stamp_ms = *now - 21,
            Reason::TimeBackwards,
        ),
        (
            "the clock goes backwards",
            |_, now| *now -= 21,
            Reason::TimeBackwards,
        ),
        ("another source", |r, _| r.source = 1, Reason::SourceChanged),
        (
            "an unknown source",
            |r, _| r.source = 2,
            Reason::SourceUnknown,
        ),
        (
            "another frame",
            |r, _| r.frame = FrameId::of("odom"),
            Reason::FrameMismatch,
        ),
        (
            "no frame",
            |r, _| r.frame = FrameId::UNNAMED,
            Reason::FrameMismatch,
        ),
        (
            "an estimate next to the dock",
            |r, _| r.belief = belief(0.1),
            Reason::NotContained,
        ),
        (
            "an estimate far away",
            |r, _| r.belief = belief(100.0),
            Reason::OutsideTable,
        ),
        (
            "NaN",
            |r, _| r.belief.x_m = f64::NAN,
            Reason::EstimateNotFinite,
        ),
        (
            "an infinite estimate",
            |r, _| r.belief.y_m = f64::INFINITY,
            Reason::EstimateNotFinite,
        ),
        (
            "a covariance of zeros",
            |r, _| r.belief.spread = Some(Uncertainty::Gaussian([[0.0; 3]; 3])),
            Reason::CovarianceZero,
        ),
        (
            "a variance of NaN",
            |r, _| r.belief = PoseEstimate::diagonal(ZERO, [f64::NAN, 1e-4, 1e-4]),
            Reason::CovarianceNotFinite,
        ),
        (
            "a negative variance",
            |r, _| r.belief = PoseEstimate::diagonal(ZERO, [1e-4, -1e-4, 1e-4]),
            Reason::CovarianceNotPositiveDefinite,
        ),
        (
            "a correlation of 1",
            |r, _| {
                r.belief.spread = Some(Uncertainty::Gaussian([
                    [1e-4, 1e-4, 0.0],
                    [1e-4, 1e-4, 0.0],
                    [0.0, 0.0, 1e-4],
                ]))
            },
            Reason::CovarianceNotPositiveDefinite,
        ),
        (
            "a covariance that is not known",
            |r, _| r.belief.spread = None,
            Reason::CovarianceUnknown,
        ),
    ];
    let settings = Settings {
        report_period_ms: 1,
        permit_hold_ms: 1000,
        ..settings()
    };
    for (name, change, reason) in cases {
        let (mut gate, sequence, now) = permitted(DOCK, &settings, 1000);
        let mut now = now + 20;
        let mut next = report(sequence + 1, now);
        change(&mut next, &mut now);
        let step = gate.step(now, &next);
        assert_eq!(step.verdict, Err(reason), "{name}");
        assert!(!step.permission.is_permit(), "{name}");
        // It stays closed until there are consecutive permits again, and at least for the hold time.
        let (sequence, source) = (next.sequence, next.source.min(1));
        let mut count = 0;
        for later in 1..=6u32 {
            let now = now + 20 * later;
            let again = Report {
                source,
                ..report(sequence.wrapping_add(later), now)
            };
            let step = gate.step(now, &again);
            count = if step.verdict.is_ok() { count + 1 } else { 0 };
            assert!(
                !step.permission.is_permit() || (later >= 3 && count >= 3),
                "{name}: {later}"
            );
        }
    }
}

const ZERO: Estimate = Estimate {
    x_m: 0.0,
    y_m: 0.0,
    yaw_rad: 0.0,
};

/// A gate cannot know that a filter's covariance is implausibly small.
#[test]
fn tiny_covariance_is_not_detected() {
    let settings = settings();
    let verdict = |variance: f64| {
        let mut gate = Gate::new(DOCK, &settings, 0).unwrap();
        let report = Report {
            belief: PoseEstimate::diagonal(ZERO, [variance; 3]),
            ..report(1, 10)
        };
        gate.step(10, &report).verdict
    };
    assert_eq!(verdict(1e-300), Ok(()));
    assert_eq!(verdict(f64::from_bits(1)), Ok(()));
    assert_eq!(verdict(0.0), Err(Reason::CovarianceZero));
}

/// Silence ends a permit, and so does the age of its estimate.
#[test]
fn a_permit_ends_by_itself() {
    let mut settings = settings();
    // Runs a cycle every 10 ms, up to a time.
    let run = |gate: &mut Gate<'_>, from: u32, to: u32| {
        for now in (from..to).step_by(10) {
            assert!(gate.tick(now).permission.is_permit());
        }
    };
    let (mut gate, ..) = permitted(DOCK, &settings, 1000);
    run(&mut gate, 1200, 1200 + PERMIT_HOLD_MS);
    assert!(gate.tick(1200 + PERMIT_HOLD_MS).permission.is_permit());
    let step = gate.tick(1200 + PERMIT_HOLD_MS + 1);
    assert!(!step.permission.is_permit());
    assert_eq!(step.state, State::Inhibited(Reason::Silent));
    // The same report again and again is silence.
    let (mut gate, sequence, now) = permitted(DOCK, &settings, 1000);
    let same = report(sequence, now);
    run(&mut gate, now, now + 100);
    assert_eq!(gate.step(now + 100, &same).verdict, Err(Reason::Repeated));
    assert!(gate.step(now + 100, &same).permission.is_permit());
    assert!(!gate.step(now + 101, &same).permission.is_permit());
    // Half the clock's range later, and nearly all of it.
    for later in [(1u32 << 31) - 1, 1 << 31, u32::MAX - 10] {
        let (mut gate, _, now) = permitted(DOCK, &settings, 1000);
        assert!(!gate.tick(now.wrapping_add(later)).permission.is_permit());
    }
    settings.permit_hold_ms = 100_000;
    let (mut gate, ..) = permitted(DOCK, &settings, 1000);
    run(&mut gate, 1200, 1200 + OLDEST_MS);
    assert!(gate.tick(1200 + OLDEST_MS).permission.is_permit());
    let step = gate.tick(1200 + OLDEST_MS + 1);
    assert_eq!(step.state, State::Inhibited(Reason::Stale));
}

#[test]
fn no_parameter_disables_a_check() {
    type Change = fn(&mut Settings<'_>);
    let cases: [(Change, InvalidParameter); 13] = [
        (|s| s.response_ms = 0, InvalidParameter::ResponseTime),
        (
            |s| s.response_ms = s.maximum_age_ms,
            InvalidParameter::ResponseTime,
        ),
        (|s| s.maximum_age_ms = 0, InvalidParameter::MaximumAge),
        (|s| s.maximum_age_ms = 1 << 31, InvalidParameter::MaximumAge),
        (|s| s.permit_hold_ms = 0, InvalidParameter::PermitHold),
        (
            |s| s.permit_hold_ms = u32::MAX,
            InvalidParameter::PermitHold,
        ),
        (|s| s.inhibit_hold_ms = 0, InvalidParameter::InhibitHold),
        (
            |s| s.inhibit_hold_ms = 1 << 31,
            InvalidParameter::InhibitHold,
        ),
        (|s| s.permits_in_a_row = 0, InvalidParameter::PermitsInARow),
        (|s| s.task = "", InvalidParameter::Task),
        (|s| s.sources = &[], InvalidParameter::Sources),
        (
            |s| {
                s.sources = &[Source {
                    frame: FrameId::UNNAMED,
                    trust: Trust::FULL,
                    aging: Aging::NONE,
                    motion: MotionBounds::STANDS_STILL,
                }]
            },
            InvalidParameter::Frame,
        ),
        (|s| s.sources = &TOO_MANY, InvalidParameter::Sources),
    ];
    for (change, wrong) in cases {
        let mut settings = settings();
        change(&mut settings);
        assert_eq!(Gate::new(DOCK, &settings, 0).err(), Some(wrong));
    }
    for inflation in [
        0.0,
        -1.0,
        0.5,
        0.99999,
        1f64.next_down(),
        f64::NAN,
        f64::INFINITY,
        f64::NEG_INFINITY,
        1e9,
    ] {
        let source = Source::new(
            "map",
            inflation,
            CrossTerms::Filled,
            MotionBounds::STANDS_STILL,
        );
        assert_eq!(source, Err(InvalidParameter::Inflation), "{inflation}");
    }
    assert_eq!(
        Source::new("", 1.0, CrossTerms::Filled, MotionBounds::STANDS_STILL),
        Err(InvalidParameter::Frame)
    );
}

/// A source with a larger inflation needs a better estimate.
#[test]
fn an_inflation_makes_the_gate_stricter() {
    let settings = settings();
    let inflated = [Source {
        trust: Trust {
            inflation: Inflation::new(100.0).unwrap(),
            ..Trust::FULL
        },
        ..SOURCE
    }];
    let stricter = Settings {
        sources: &inflated,
        ..settings
    };
    let verdict = |settings: &Settings<'_>| {
        Gate::new(DOCK, settings, 0)
            .unwrap()
            .step(10, &report(1, 10))
            .verdict
    };
    assert_eq!(verdict(&settings), Ok(()));
    assert!(verdict(&stricter).is_err());
}

/// Invalid tables, and tables of another task or site, whose other fields are all correct.
#[test]
fn wrong_table_is_latched_at_start() {
    let settings = settings();
    let mut flipped = DOCK.to_vec();
    flipped[200] ^= 4;
    let other_task = Settings {
        task: "dock-2",
        ..settings
    };
    let other_site = Settings {
        task_digest: [7; 32],
        ..settings
    };
    let zeros = [0; 300];
    // A flipped bit in the version is damage. Only a table with a correct checksum is of another version.
    let mut version_2 = DOCK.to_vec();
    version_2[8] = 2;
    let flipped_version = version_2.clone();
    let (content, crc) = version_2.split_last_chunk_mut().unwrap();
    *crc = posegate::table::checksum(content).to_le_bytes();
    for (table, settings, reason) in [
        (&flipped[..], &settings, Reason::TableDamaged),
        (&DOCK[..DOCK.len() - 1], &settings, Reason::TableDamaged),
        (&zeros[..], &settings, Reason::TableDamaged),
        (&[], &settings, Reason::TableDamaged),
        (&flipped_version, &settings, Reason::TableDamaged),
        (&version_2, &settings, Reason::TableTooNew),
        (SEE_T7, &settings, Reason::WrongTask),
        (DOCK, &other_task, Reason::WrongTask),
        (DOCK, &other_site, Reason::WrongSite),
    ] {
        let mut gate = Gate::new(table, settings, 0).unwrap();
        assert_eq!(gate.state(), State::Latched(reason));
        for sequence in 0..10 {
            let now = 100 + 20 * sequence;
            let step = gate.step(now, &report(sequence, now));
            assert_eq!(step.verdict, Err(reason));
            assert!(!step.permission.is_permit());
        }
        // A reset does not accept a wrong table.
        gate.reset(1000).unwrap();
        assert_eq!(gate.state(), State::Latched(reason));
        assert_eq!(gate.advice(), Some(Advice::Service));
    }
}

/// A fault stays latched until a reset, for any events.
#[test]
fn a_fault_waits_for_a_reset() {
    let settings = settings();
    for reason in [
        Reason::InterlockFault,
        Reason::CodeDamaged,
        Reason::SelfTestFailed,
    ] {
        let (mut gate, sequence, now) = permitted(DOCK, &settings, 1000);
        gate.fault(reason);
        // The first fault is the one that is reported.
        gate.fault(Reason::MemoryDamaged);
        for later in 1..50 {
            let now = now + 20 * later;
            let step = gate.step(now, &report(sequence + later, now));
            assert_eq!(
                (step.verdict, step.state),
                (Err(reason), State::Latched(reason))
            );
            assert!(!step.permission.is_permit());
            assert!(!gate.tick(now).permission.is_permit());
        }
        gate.reset(5000).unwrap();
        assert_eq!(gate.state(), State::Inhibited(Reason::Silent));
        let mut opened = false;
        for sequence in 0..10 {
            let now = 5000 + 20 * sequence;
            opened = gate
                .step(now, &report(sequence, now))
                .permission
                .is_permit();
        }
        assert!(opened);
    }
}

/// If something else has closed the interlock, the gate must qualify again completely, or needs a reset.
#[test]
fn gate_requalifies_after_external_inhibit() {
    let reason = Reason::InterlockFault;
    for restart in [Restart::Automatic, Restart::OnReset] {
        let settings = Settings {
            restart,
            ..settings()
        };
        let (mut gate, sequence, now) = permitted(DOCK, &settings, 1000);
        let step = gate.inhibit(now + 10, reason);
        assert!(!step.permission.is_permit() && step.verdict == Err(reason));
        if restart == Restart::OnReset {
            assert_eq!(gate.state(), State::Latched(reason));
            continue;
        }
        assert_eq!(gate.state(), State::Inhibited(reason));
        for later in 1..=6 {
            let now = now + 20 * later;
            let step = gate.step(now, &report(sequence + later, now));
            assert_eq!(step.permission.is_permit(), later >= 3, "{later}");
        }
        // The latched fault remains the reported one.
        gate.fault(Reason::CodeDamaged);
        let step = gate.inhibit(now + 200, reason);
        assert_eq!(step.state, State::Latched(Reason::CodeDamaged));
    }
}

#[test]
fn manual_restart_latches_every_end_of_a_permit() {
    let settings = Settings {
        restart: Restart::OnReset,
        ..settings()
    };
    let (mut gate, sequence, now) = permitted(DOCK, &settings, 1000);
    // This denial ends a permit, so it latches; one before the first permit does not.
    let mut gap = report(sequence + 2, now + 20);
    assert_eq!(
        gate.step(now + 20, &gap).state,
        State::Latched(Reason::SequenceGap)
    );
    for later in 2..20 {
        gap = report(sequence + 1 + later, now + 20 * later);
        assert!(!gate.step(now + 20 * later, &gap).permission.is_permit());
    }
    let mut gate = Gate::new(DOCK, &settings, 0).unwrap();
    let far = Report {
        belief: belief(1.0),
        ..report(1, 10)
    };
    assert!(matches!(gate.step(10, &far).state, State::Inhibited(_)));
}
