//! The smallest firmware with a gate: a table in flash, settings, a step or a tick in every control cycle, and an
//! interlock that is high only while the gate permits. For a Cortex-M4F; runs in QEMU.
//!
//! ```text
//! cargo emulate docking_gate
//! ```
//!
//! `board/robot.rs` simulates the robot: a script of reports and of silence.
//! `crates/posegate-boards/tests/docking_gate.rs` checks when the interlock opens and closes. A controller with
//! interrupts, read-back and watchdog is `interrupt_gate.rs`.
#![cfg_attr(target_os = "none", no_std, no_main)]

/// Firmware has no meaning on a host; this lets `cargo test --all-features` build there.
#[cfg(not(target_os = "none"))]
fn main() {}

#[cfg(target_os = "none")]
mod board;

#[cfg(target_os = "none")]
mod firmware {
    use crate::board::{Led, robot::Robot};
    use cortex_m_rt::{ExceptionFrame, entry, exception};
    use posegate::gate::{Gate, Interlock, Reason, Restart, Settings, Source, task_digest};
    use posegate::motion::MotionBounds;
    use posegate::report::FrameId;
    use posegate::set::{Aging, Trust};

    /// Made by `posegate table build`.
    static TABLE: &[u8] = include_bytes!("tables/dock.posegate");

    /// What the controller expects. The digest is that of the task: `posegate table info` prints it.
    static SETTINGS: Settings<'static> = Settings {
        task: "dock",
        task_digest: task_digest(
            "dd45d89b69c82c2f50ab8b974603f4c9f2ac254b3d9c7f82d2aa95c1b3de263c",
        )
        .expect("64 digits"),
        sources: &[Source {
            frame: FrameId::of("map"),
            trust: Trust::FULL,
            aging: Aging::NONE,
            motion: MotionBounds::STANDS_STILL,
        }],
        maximum_age_ms: 200,
        response_ms: 20,
        report_period_ms: 50,
        permit_hold_ms: 100,
        inhibit_hold_ms: 500,
        permits_in_a_row: 3,
        restart: Restart::Automatic,
        most_runs: 1_000,
        look_at: Some(7),
    };

    /// Bytes of flash that are checked per cycle.
    const SCRUBBED_A_CYCLE: usize = 32;

    #[entry]
    fn main() -> ! {
        let mut robot = Robot::new();
        // The output is low before anything else. The program halts if the set-up fails.
        let Ok(mut interlock) = Interlock::new(Led::new()) else {
            halt()
        };
        let Ok(mut gate) = Gate::new(TABLE, &SETTINGS, robot.now_ms()) else {
            halt()
        };
        // The control cycle: every 10 ms, with the report that has arrived since the last cycle, or without.
        while robot.next_cycle() {
            let now_ms = robot.now_ms();
            let _ = gate.scrub(SCRUBBED_A_CYCLE);
            let step = match robot.report() {
                Some(report) => gate.step(now_ms, &report),
                None => gate.tick(now_ms),
            };
            if interlock.apply(now_ms, &step.permission).is_err() {
                gate.fault(Reason::InterlockFault);
            }
            robot.print_change(&step, Led::is_high());
        }
        let _ = interlock.close();
        robot.stop()
    }

    /// Keeps the interlock closed until a reset. In a product the watchdog resets.
    fn halt() -> ! {
        cortex_m::interrupt::disable();
        loop {
            Led::force_low();
        }
    }

    #[panic_handler]
    fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
        halt()
    }

    #[exception]
    unsafe fn HardFault(_: &ExceptionFrame) -> ! {
        halt()
    }

    #[exception]
    unsafe fn DefaultHandler(_: i16) {
        halt()
    }
}
