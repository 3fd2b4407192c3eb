//! A complete controller. Reports arrive over a serial line by interrupts, a timer runs the gate a hundred times a
//! second, and an interlock with read-back and heartbeat follows the gate. For a Cortex-M4F; runs in QEMU.
//!
//! ```text
//! cargo build -p posegate --profile firmware --target thumbv7em-none-eabihf --features firmware --example interrupt_gate
//! qemu-system-arm -M mps2-an386 -display none -monitor none -serial stdio -kernel target/thumbv7em-none-eabihf/firmware/examples/interrupt_gate
//! ```
//!
//! Reports and telemetry use version 2 of [`posegate::wire`]; `crates/posegate-boards/tests/interrupt_gate.rs`
//! communicates with this program, and tests every kind of line error.
//!
//! The clock is the controller's own, a counter of milliseconds that nothing stops. Telemetry sends its time in every
//! cycle. A sender stamps its report with the time that it last received, plus the time since then on its own clock,
//! minus the age of its estimate. So the delay of the telemetry can only increase an age. A stamp later than the
//! arrival of the report's own first byte is in the future, and denied. A controller cannot detect a sender that makes
//! an estimate younger than it is by less than that delay.
//!
//! Reports of source 0 are evaluated at their arrival. Reports of source 1 are fixes of a slow source, which a tracker carries along the
//! odometry that comes over the same line: with odometry in every cycle the gate evaluates the pose of this cycle.
//!
//! The work of a cycle is bounded: process the bytes that the queue held at its start, evaluate [`REPORTS_A_CYCLE`]
//! reports, check [`SCRUBBED_A_CYCLE`] bytes of flash, write one message per report into a queue. Interrupts with a
//! higher priority than the cycle fill and empty the line's queues. Data that does not fit is dropped and counted. A
//! lost byte is a damaged frame; a lost report is a gap in the sequence, which closes the gate.
#![cfg_attr(target_os = "none", no_std, no_main)]

/// Firmware has no meaning on a host; this lets `cargo test --all-features` build there.
#[cfg(not(target_os = "none"))]
fn main() {}

#[cfg(target_os = "none")]
mod board;

#[cfg(target_os = "none")]
mod firmware {
    use crate::board::interrupts::{self, Clock, Contact, Heartbeat, Interrupt, Watchdog};
    use crate::board::{Led, Uart};
    use core::cell::{Cell, RefCell};
    use core::sync::atomic::{AtomicBool, AtomicU32, Ordering};
    use cortex_m::interrupt::{Mutex, free};
    use cortex_m::peripheral::NVIC;
    use cortex_m_rt::{ExceptionFrame, entry, exception};
    use heapless::spsc::{Consumer, Producer, Queue};
    use posegate::gate::{Evidence, Gate, Interlock, InvalidParameter, Reason, Restart};
    use posegate::gate::{Settings, Source, State, Step};
    use posegate::motion::MotionBounds;
    use posegate::report::{FrameId, Report};
    use posegate::set::{Aging, Trust};
    use posegate::table::Table;
    use posegate::track::{Increment, OdometryErrors, Tracker, TrackerSettings};
    use posegate::wire::{
        Frame, HypothesisCollector, LinkCounters, Receiver, ReportOutcome, Telemetry, encode,
        increment_from_body,
    };

    static TABLE: &[u8] = include_bytes!("tables/dock.posegate");
    static SOURCES: [Source; 2] = [
        // One robot has one speed, whatever the source.
        Source {
            frame: FrameId::of("map"),
            trust: Trust::FULL,
            aging: Aging::NONE,
            motion: SPEEDS,
        },
        // Carried by the tracker, which applies the trust.
        Source {
            frame: FrameId::of("map"),
            trust: Trust::FULL,
            aging: Aging::NONE,
            motion: SPEEDS,
        },
    ];
    /// The source whose reports are carried.
    const CARRIED: u8 = 1;
    /// 0.1 m/s ahead, and 0.1 rad/s.
    const SPEEDS: MotionBounds = MotionBounds::of_mm_mrad(100, 0, 100);
    /// Wheels that slip by 2 % at most. Deviations as measured for this robot.
    const ODOMETRY: OdometryErrors = OdometryErrors {
        m_per_sqrt_m: 0.005,
        rad_per_sqrt_rad: 0.02,
        rad_per_sqrt_m: 0.01,
        slip: 0.02,
        turn_slip: 0.02,
        ..OdometryErrors::NONE
    };
    static SETTINGS: Settings<'static> = Settings {
        task: "dock",
        // `posegate table info examples/tables/dock.posegate`
        task_digest: [
            0xdd, 0x45, 0xd8, 0x9b, 0x69, 0xc8, 0x2c, 0x2f, 0x50, 0xab, 0x8b, 0x97, 0x46, 0x03,
            0xf4, 0xc9, 0xf2, 0xac, 0x25, 0x4b, 0x3d, 0x9c, 0x7f, 0x82, 0xd2, 0xaa, 0x95, 0xc1,
            0xb3, 0xde, 0x26, 0x3c,
        ],
        sources: &SOURCES,
        maximum_age_ms: 200,
        // If a cycle is later than this, the watchdog or the cycle itself inhibits.
        response_ms: WATCHDOG_MS + CYCLE_MS,
        report_period_ms: 50,
        permit_hold_ms: 100,
        inhibit_hold_ms: 200,
        permits_in_a_row: 3,
        restart: Restart::Automatic,
        most_runs: 1_000,
        look_at: Some(7),
    };

    const CYCLES_PER_SECOND: u32 = 100;
    const CYCLE_MS: u32 = 1000 / CYCLES_PER_SECOND;
    /// The contact must follow within `CONTACT_MS`, and the heartbeat toggles every `HEARTBEAT_MS`. If no cycle comes
    /// for `WATCHDOG_MS`, the watchdog closes, and so does the next cycle by its own clock.
    const CONTACT_MS: u32 = 30;
    const HEARTBEAT_MS: u32 = 50;
    const WATCHDOG_MS: u32 = 50;
    /// A report takes 12 ms on the line. The most expensive decision on a moving set takes 2 ms here, and a cycle must end in time even if
    /// the line is flooded.
    const REPORTS_A_CYCLE: usize = 2;
    /// Covers the table once in a tenth of a second.
    const SCRUBBED_A_CYCLE: usize = 32;
    /// Near the clock's wrap, so that a test covers it.
    const CLOCK_STARTS_AT: u32 = 0u32.wrapping_sub(10_000);
    /// In this number of cycles the clock must advance by at least this many milliseconds; the timer's first cycle may
    /// be late by one.
    const CLOCK_CHECK: (u32, u32) = (16, 140);

    /// Received bytes: nine cycles of a full line.
    type Received = Queue<Arrived, 1024>;
    /// Bytes to send: twenty messages.
    type ToSend = Queue<u8, 1024>;

    /// A byte and its time of arrival.
    #[derive(Clone, Copy)]
    struct Arrived {
        byte: u8,
        at_ms: u32,
    }

    static RECEIVING: Mutex<RefCell<Option<Producer<'static, Arrived>>>> =
        Mutex::new(RefCell::new(None));
    static SENDING: Mutex<RefCell<Option<Consumer<'static, u8>>>> = Mutex::new(RefCell::new(None));
    /// Passed from `main` to the timer's interrupt, which keeps it.
    static PREPARED: Mutex<Cell<Option<Controller>>> = Mutex::new(Cell::new(None));
    static LOST: AtomicU32 = AtomicU32::new(0);
    /// `true` if the watchdog has closed the output and the gate has not yet been informed.
    static FORCED_LOW: AtomicBool = AtomicBool::new(false);
    /// The gate's state after it has been informed.
    const FORCED: State = State::Inhibited(Reason::InterlockFault);

    #[entry]
    fn main() -> ! {
        static mut RECEIVED: Received = Queue::new();
        static mut TO_SEND: ToSend = Queue::new();
        let (received, taken_up) = RECEIVED.split();
        let (queued, to_send) = TO_SEND.split();
        Clock::start(CLOCK_STARTS_AT);
        // The program halts if the set-up fails.
        let Ok(controller) = Controller::new(taken_up, queued) else {
            halt()
        };
        free(|section| {
            RECEIVING.borrow(section).replace(Some(received));
            SENDING.borrow(section).replace(Some(to_send));
            PREPARED.borrow(section).set(Some(controller));
        });
        if interrupts::start(CYCLES_PER_SECOND).is_none() {
            halt();
        }
        loop {
            cortex_m::asm::wfi();
        }
    }

    /// The data of a cycle; nothing else accesses it.
    struct Controller {
        gate: Gate<'static>,
        interlock: Interlock<Led, Contact, Heartbeat>,
        watchdog: Watchdog,
        receiver: Receiver,
        collector: HypothesisCollector,
        tracker: Tracker<64>,
        received: Consumer<'static, Arrived>,
        /// When the first byte of the current frame arrived.
        begun_ms: Option<u32>,
        to_send: Producer<'static, u8>,
        cycle: u32,
        /// When the last cycle began.
        begun_cycle_ms: u32,
        clock_seen_ms: u32,
        messages: u32,
        line: LinkCounters,
    }

    impl Controller {
        fn new(
            received: Consumer<'static, Arrived>,
            to_send: Producer<'static, u8>,
        ) -> Result<Self, InvalidParameter> {
            let Ok(interlock) = Interlock::new(Led::new()) else {
                halt()
            };
            let Some(tracker) = Table::parse(TABLE).ok().and_then(tracker) else {
                halt()
            };
            let now_ms = Clock::now_ms();
            Ok(Self {
                gate: Gate::new(TABLE, &SETTINGS, now_ms)?,
                interlock: interlock
                    .with_read_back(Contact, CONTACT_MS)?
                    .with_heartbeat(Heartbeat, HEARTBEAT_MS)?,
                watchdog: Watchdog::start(WATCHDOG_MS),
                receiver: Receiver::new(),
                collector: HypothesisCollector::new(),
                tracker,
                received,
                begun_ms: None,
                to_send,
                cycle: 0,
                begun_cycle_ms: Clock::now_ms(),
                clock_seen_ms: now_ms,
                messages: 0,
                line: LinkCounters::default(),
            })
        }

        /// Does the work of a hundredth of a second.
        fn run(&mut self) {
            self.watchdog.feed();
            let now_ms = Clock::now_ms();
            self.cycle = self.cycle.wrapping_add(1);
            self.check_clock(now_ms);
            let _ = self.gate.scrub(SCRUBBED_A_CYCLE);
            let since_ms = now_ms.wrapping_sub(self.begun_cycle_ms);
            self.begun_cycle_ms = now_ms;
            // The watchdog has closed the output, or should have: the cycle closes even if the watchdog is broken.
            if FORCED_LOW.swap(false, Ordering::Relaxed) || since_ms >= WATCHDOG_MS {
                self.close_for_late_cycle(now_ms);
            }
            let (mut weighed, mut has_moved) = (0, false);
            for _ in 0..self.received.len() {
                let Some((body, begun_ms)) = self.take_up() else {
                    continue;
                };
                if let Ok(increment) = increment_from_body(&body) {
                    has_moved = true;
                    self.follow(now_ms, increment);
                    continue;
                }
                let evidence = match self.collector.take(&body) {
                    Ok(Some(evidence)) => evidence,
                    Ok(None) => continue,
                    Err(_) => {
                        self.line.refused = self.line.refused.wrapping_add(1);
                        continue;
                    }
                };
                let mut report = *evidence.report;
                // A stamp that is later than the report's first byte is from the future.
                let is_future = begun_ms.wrapping_sub(report.stamp_ms) >= 1 << 31;
                if report.source == CARRIED {
                    if is_future || !evidence.others.is_empty() {
                        // A tracker carries one estimate, of a past time. The carried estimate is no longer the newest
                        // that was reported.
                        self.tracker.drop_fix();
                        self.line.refused = self.line.refused.wrapping_add(1);
                    } else if self.tracker.fix(&report).is_err() {
                        self.line.refused = self.line.refused.wrapping_add(1);
                    }
                    continue;
                }
                if is_future {
                    // The gate denies it.
                    report.stamp_ms = now_ms.wrapping_add(1);
                }
                if weighed == REPORTS_A_CYCLE {
                    self.line.left_aside = self.line.left_aside.wrapping_add(1);
                    continue;
                }
                weighed += 1;
                let evidence = Evidence {
                    report: &report,
                    ..evidence
                };
                let step = self.gate.step_on(now_ms, &evidence);
                self.act(now_ms, &step, Some(&report));
            }
            if has_moved && let Ok(tracked) = self.tracker.tracked(now_ms) {
                weighed += 1;
                let step = self.gate.step_on(now_ms, &tracked.evidence());
                self.act(now_ms, &step, Some(&tracked.report));
            }
            if weighed == 0 {
                let step = self.gate.tick(now_ms);
                self.act(now_ms, &step, None);
            }
        }

        /// Takes an increment of the odometry. An increment that breaks the path closes the gate.
        fn follow(&mut self, now_ms: u32, increment: Increment) {
            if let Err(reason) = self.tracker.odometry(increment) {
                let step = self.gate.inhibit(now_ms, reason);
                self.act(now_ms, &step, None);
            }
        }

        /// Closes because this cycle came late: the permits must be earned again.
        fn close_for_late_cycle(&mut self, now_ms: u32) {
            // The watchdog may have forced the output low, so a read-back mismatch does not show a fault of the contact. A failed
            // close is a fault.
            if self.interlock.close().is_err() {
                self.gate.fault(Reason::InterlockFault);
            }
            if self.gate.state() != FORCED {
                let step = self.gate.inhibit(now_ms, Reason::InterlockFault);
                self.act(now_ms, &step, None);
            }
        }

        /// Checks the clock: if it stopped, or fell behind the timer, a permit would last too long.
        fn check_clock(&mut self, now_ms: u32) {
            let (cycles, at_least_ms) = CLOCK_CHECK;
            if self.cycle.is_multiple_of(cycles) {
                if now_ms.wrapping_sub(self.clock_seen_ms) < at_least_ms {
                    self.gate.fault(Reason::SelfTestFailed);
                }
                self.clock_seen_ms = now_ms;
            }
        }

        /// Takes the next byte, and returns the message that it completes, with the time of its first byte.
        fn take_up(&mut self) -> Option<(Frame, u32)> {
            let Arrived { byte, at_ms } = self.received.dequeue()?;
            self.line.bytes = self.line.bytes.wrapping_add(1);
            let begun_ms = *self.begun_ms.get_or_insert(at_ms);
            if byte == 0 {
                self.begun_ms = None;
            }
            match self.receiver.push(byte)? {
                Ok(body) => Some((body, begun_ms)),
                Err(_) => {
                    self.line.refused = self.line.refused.wrapping_add(1);
                    None
                }
            }
        }

        /// Drives the interlock and sends telemetry.
        fn act(&mut self, now_ms: u32, step: &Step, report: Option<&Report>) {
            // The watchdog may fire at any time; after that this cycle must not open the output.
            let forced_low = || FORCED_LOW.load(Ordering::Relaxed);
            let mut driven = Ok(());
            if !forced_low() {
                driven = self.interlock.apply(now_ms, &step.permission);
            }
            if forced_low() {
                driven = driven.and(self.interlock.close());
            }
            if driven.is_err() {
                self.gate.fault(Reason::InterlockFault);
            }
            self.line.lost = LOST.load(Ordering::Relaxed);
            let telemetry = Telemetry {
                number: self.messages,
                cycle: self.cycle,
                now_ms,
                weighed: report.map(|report| ReportOutcome {
                    source: report.source,
                    sequence: report.sequence,
                    stamp_ms: report.stamp_ms,
                    verdict: step.verdict,
                }),
                state: step.state,
                permitted: step.permission.is_permit(),
                interlock_high: Led::is_high(),
                fault: self.interlock.fault(),
                line: self.line,
            };
            self.messages = self.messages.wrapping_add(1);
            self.send(&encode(&telemetry.body()));
        }

        /// Puts a whole message in the queue, or nothing.
        fn send(&mut self, frame: &Frame) {
            let free = self.to_send.capacity() - self.to_send.len();
            if frame.len() <= free {
                for byte in frame {
                    let _ = self.to_send.enqueue(*byte);
                }
                NVIC::pend(Interrupt::Send);
            }
        }
    }

    fn tracker(table: Table<'_>) -> Option<Tracker<64>> {
        Tracker::new(TrackerSettings {
            errors: ODOMETRY,
            bounds: SPEEDS,
            trust: Trust::FULL,
            radius_squared: table.radius_squared(),
            maximum_gap_ms: 5 * CYCLE_MS,
            maximum_fix_age_ms: 1000,
        })
    }

    /// The control cycle.
    #[exception]
    fn SysTick() {
        static mut CONTROLLER: Option<Controller> = None;
        if CONTROLLER.is_none() {
            *CONTROLLER = free(|section| PREPARED.borrow(section).take());
        }
        match CONTROLLER {
            Some(controller) => controller.run(),
            None => halt(),
        }
    }

    /// Interrupts of devices. In a product each has its own vector, from the chip's crate; this program does not use
    /// such a crate.
    #[exception]
    unsafe fn DefaultHandler(number: i16) {
        match Interrupt::of(number) {
            Some(Interrupt::Receive) => receive(),
            Some(Interrupt::Send) => send(),
            None => halt(),
        }
    }

    /// Handles a received byte.
    fn receive() {
        let (byte, overrun) = Uart::received();
        let mut lost = u32::from(overrun);
        if let Some(byte) = byte {
            let arrived = Arrived {
                byte,
                at_ms: Clock::now_ms(),
            };
            let kept = free(|section| {
                let mut receiving = RECEIVING.borrow(section).borrow_mut();
                receiving
                    .as_mut()
                    .is_some_and(|to| to.enqueue(arrived).is_ok())
            });
            lost += u32::from(!kept);
        }
        LOST.fetch_add(lost, Ordering::Relaxed);
    }

    /// Handles a sent byte.
    fn send() {
        Uart::sent(|| {
            free(|section| {
                let mut sending = SENDING.borrow(section).borrow_mut();
                sending.as_mut().and_then(Consumer::dequeue)
            })
        });
    }

    /// Keeps the interlock closed until a reset.
    fn halt() -> ! {
        cortex_m::interrupt::disable();
        loop {
            Led::force_low();
        }
    }

    /// The watchdog: no cycle has started for too long, or a cycle takes too long. The output is low until the next
    /// cycle, which closes the gate; if the program hangs, it stays low.
    #[exception]
    unsafe fn NonMaskableInt() {
        Led::force_low();
        FORCED_LOW.store(true, Ordering::Relaxed);
        Watchdog::acknowledge();
    }

    #[exception]
    unsafe fn HardFault(_: &ExceptionFrame) -> ! {
        halt()
    }

    #[panic_handler]
    fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
        halt()
    }
}
