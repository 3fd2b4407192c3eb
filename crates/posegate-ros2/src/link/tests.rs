use super::*;
use posegate::gate::{InterlockFault, Reason};
use posegate::wire::LinkCounters;
use posegate::wire::{ReportOutcome, encode};
use proptest::prelude::*;

const LIMIT: Duration = Duration::from_millis(150);

const fn ms(ms: u64) -> Duration {
    Duration::from_millis(ms)
}

/// A controller that sends telemetry every 10 ms, and a line to it in virtual time.
struct Line {
    link: Link,
    start: Instant,
    now_ms: u64,
    number: u32,
    clock_ms: u32,
    sequence: u32,
}

impl Line {
    fn new(clock_ms: u32) -> Self {
        Self {
            link: Link::default(),
            start: Instant::now(),
            now_ms: 0,
            number: 0,
            clock_ms,
            sequence: 100,
        }
    }

    fn now(&self) -> Instant {
        self.start + ms(self.now_ms)
    }

    /// Advances the time of both.
    fn pass(&mut self, passed_ms: u64) {
        self.now_ms += passed_ms;
        self.clock_ms = self.clock_ms.wrapping_add(passed_ms as u32);
    }

    /// Makes the next message of the controller, which permits.
    fn permitting(&mut self) -> Telemetry {
        self.number += 1;
        Telemetry {
            number: self.number,
            cycle: self.number,
            now_ms: self.clock_ms,
            weighed: None,
            state: State::Permitted,
            permitted: true,
            interlock_high: true,
            fault: None,
            line: LinkCounters::default(),
        }
    }

    /// Sends a report, and returns the telemetry that names it.
    fn answered(&mut self) -> Telemetry {
        self.sequence += 1;
        let (sequence, now) = (self.sequence, self.now());
        self.link.note_sent(sequence, now);
        self.pass(10);
        let weighed = Some(ReportOutcome {
            source: 0,
            sequence,
            stamp_ms: 0,
            verdict: Ok(()),
        });
        Telemetry {
            weighed,
            ..self.permitting()
        }
    }

    fn arrive(&mut self, telemetry: &Telemetry) {
        let now = self.now();
        self.link.take(&encode(&telemetry.body()), now);
    }

    fn permits(&self) -> bool {
        self.link.permits(self.now(), LIMIT)
    }

    /// A line that permits by a round trip of 10 ms.
    fn open(clock_ms: u32) -> Self {
        let mut line = Self::new(clock_ms);
        let answer = line.answered();
        line.arrive(&answer);
        assert!(line.permits());
        line
    }
}

#[test]
fn permit_without_a_round_trip_does_not_count() {
    let mut line = Line::new(7);
    for _ in 0..100 {
        let said = line.permitting();
        line.arrive(&said);
        line.pass(10);
        assert!(!line.permits());
    }
    let answer = line.answered();
    line.arrive(&answer);
    assert!(line.permits());
}

#[test]
fn silent_controller_permits_until_the_limit() {
    // The age counts from before the report was sent, 10 ms ago. The clock wraps meanwhile.
    for clock_ms in [0, u32::MAX - 50] {
        let mut line = Line::open(clock_ms);
        line.pass(139);
        assert!(line.permits());
        line.pass(1);
        assert!(!line.permits());
    }
}

#[test]
fn telemetry_extends_the_bound_by_the_controllers_clock() {
    let mut line = Line::open(u32::MAX - 500);
    for _ in 0..200 {
        line.pass(10);
        let said = line.permitting();
        line.arrive(&said);
        assert!(line.permits());
    }
    // Three hundredths of two seconds are subtracted.
    assert_eq!(line.link.age(line.now()), Some(ms(10 + 60)));
    // Then another round trip is needed.
    line.pass(10);
    let said = line.permitting();
    line.arrive(&said);
    assert!(!line.permits() && line.link.age(line.now()).is_none());
    let answer = line.answered();
    line.arrive(&answer);
    assert!(line.permits());
}

/// A line that delivers all telemetry a second late, from a controller with a fast clock: no state ever counts as
/// young.
#[test]
fn late_line_of_a_fast_clock_never_permits() {
    for per_mille in [0u64, 1, 5, 10, 20, 30] {
        let mut link = Link::default();
        let start = Instant::now();
        let mut on_the_line = VecDeque::new();
        for now_ms in 0..300_000u64 {
            let at = start + ms(now_ms);
            let sequence = (now_ms / 100) as u32;
            if now_ms % 100 == 0 {
                link.note_sent(sequence, at);
            }
            if now_ms % 10 == 5 {
                let said = Telemetry {
                    number: (now_ms / 10) as u32 + 1,
                    cycle: 1,
                    now_ms: (now_ms * (1_000 + per_mille) / 1_000) as u32,
                    weighed: Some(ReportOutcome {
                        source: 0,
                        sequence,
                        stamp_ms: 0,
                        verdict: Ok(()),
                    }),
                    state: State::Permitted,
                    permitted: true,
                    interlock_high: true,
                    fault: None,
                    line: LinkCounters::default(),
                };
                on_the_line.push_back((now_ms, said));
            }
            while let Some((_, said)) =
                on_the_line.pop_front_if(|(made, _)| *made + 1_000 <= now_ms)
            {
                link.take(&encode(&said.body()), at);
            }
            assert!(
                !link.permits(at, LIMIT),
                "{per_mille} per mille: {now_ms} ms"
            );
        }
        // Every state is a second old: its bound is not below that.
        let age = link.age(start + ms(300_000));
        assert!(age.is_none_or(|age| age >= ms(1_000)), "{age:?}");
    }
}

/// The answer to a report of another source names no report of this end.
#[test]
fn answer_to_another_source_is_not_a_round_trip() {
    let mut line = Line::new(7);
    let answer = line.answered();
    let of_another = answer.weighed.map(|report| ReportOutcome {
        source: 1,
        ..report
    });
    line.arrive(&Telemetry {
        weighed: of_another,
        ..answer
    });
    assert!(!line.permits());
}

#[test]
fn denial_of_the_controller_counts_immediately() {
    type Change = fn(&mut Telemetry);
    let changes: [Change; 5] = [
        |said| said.permitted = false,
        |said| said.state = State::Inhibited(Reason::NotContained),
        |said| said.state = State::Qualifying(3),
        |said| said.interlock_high = false,
        |said| said.fault = Some(InterlockFault::NotFollowing),
    ];
    for change in changes {
        let mut line = Line::open(0);
        line.pass(10);
        let mut said = line.permitting();
        change(&mut said);
        line.arrive(&said);
        assert!(!line.permits(), "{said:?}");
    }
}

#[test]
fn repeated_bytes_do_not_extend_a_permit() {
    let mut line = Line::open(0);
    let said = line.permitting();
    line.arrive(&said);
    for _ in 0..20 {
        line.pass(10);
        line.arrive(&said);
    }
    assert!(!line.permits());
    assert_eq!(line.link.counts().repeated, 20);
}

/// A recorded interval that is played repeatedly, as by a blocked adapter.
#[test]
fn repeated_interval_permits_nothing() {
    let mut line = Line::new(0);
    let mut stretch = vec![line.answered()];
    for _ in 0..9 {
        line.pass(10);
        stretch.push(line.permitting());
    }
    for said in &stretch {
        line.arrive(said);
    }
    line.pass(200);
    for _ in 0..10 {
        for said in &stretch {
            line.arrive(said);
            assert!(!line.permits());
            line.pass(10);
        }
    }
    assert!(line.link.counts().restarts >= 10);
}

#[test]
fn late_telemetry_permits_nothing() {
    let mut line = Line::open(0);
    let mut delayed = VecDeque::new();
    for _ in 0..300 {
        line.pass(10);
        // Reports are answered, but the telemetry arrives 200 ms later.
        let said = line.answered();
        delayed.push_back(said);
        if delayed.len() > 10 {
            let said = delayed.pop_front().expect("one");
            line.arrive(&said);
        }
        if delayed.len() == 10 && line.now_ms > 400 {
            assert!(!line.permits(), "{}", line.now_ms);
        }
    }
    assert!(!line.permits());
}

#[test]
fn restarted_controller_must_answer_first() {
    let mut line = Line::open(50_000);
    line.pass(20);
    // It starts at another time, and claims to permit at once.
    (line.number, line.clock_ms) = (0, 3);
    for _ in 0..50 {
        let said = line.permitting();
        line.arrive(&said);
        assert!(!line.permits());
        line.pass(10);
    }
    assert_eq!(line.link.counts().restarts, 1);
    let answer = line.answered();
    line.arrive(&answer);
    assert!(line.permits());
}

#[test]
fn clock_that_jumps_ahead_counts_as_another_clock() {
    let mut line = Line::open(0);
    line.clock_ms += 1_000;
    let said = line.permitting();
    line.arrive(&said);
    assert!(!line.permits());
    assert_eq!(line.link.counts().restarts, 1);
}

#[test]
fn closing_the_line_forgets_its_telemetry() {
    let mut line = Line::open(0);
    line.link.close();
    assert!(!line.permits() && line.link.last().is_none());
    let said = line.permitting();
    line.arrive(&said);
    assert!(!line.permits());
}

#[test]
fn estimated_controller_clock_is_never_ahead() {
    let mut line = Line::new(1_000);
    let said = line.permitting();
    // 30 ms on the line.
    line.pass(30);
    line.arrive(&said);
    line.pass(5);
    assert_eq!(line.link.clock_ms(line.now()), Some(1_005));
    assert!(line.clock_ms >= 1_005);
}

proptest! {
    /// Damaged bytes between and within messages never cause a permit that no valid message contained.
    #[test]
    fn random_bytes_permit_nothing(
        steps in proptest::collection::vec((any::<u64>(), any::<bool>(), proptest::collection::vec(any::<u8>(), 0..40)), 1..60),
    ) {
        let mut line = Line::open(0);
        line.pass(200);
        for (random, is_telemetry, noise) in steps {
            line.pass(random % 20);
            let now = line.now();
            if is_telemetry {
                let mut bytes = encode(&line.permitting().body());
                let bits = bytes.len() * 8;
                let bit = (random >> 8) as usize % bits;
                bytes[bit / 8] ^= 1 << (bit % 8);
                line.link.take(&bytes, now);
            }
            line.link.take(&noise, now);
            prop_assert!(!line.permits());
        }
    }
}
