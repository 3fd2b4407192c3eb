//! A gate without protection, for comparison: each report is evaluated once, and the pin follows.
//! `./ci.sh faults` injects the same faults here.
#![cfg_attr(target_os = "none", no_std, no_main)]

/// Firmware has no meaning on a host; this lets `cargo test --all-features` build there.
#[cfg(not(target_os = "none"))]
fn main() {}

#[cfg(target_os = "none")]
mod board;

#[cfg(target_os = "none")]
mod faults;

#[cfg(target_os = "none")]
mod firmware {
    use crate::board::Led;
    use crate::faults::markers::{code, cycle_begins, cycle_done, halt, schedule_over};
    use crate::faults::schedule::{Cycle, SCHEDULE, SETTINGS, TABLE};
    use cortex_m_rt::{ExceptionFrame, entry, exception};
    use embedded_hal::digital::OutputPin;
    use posegate::gate::Reason;
    use posegate::recordings::Evaluator;
    use posegate::set::Trust;

    #[entry]
    fn main() -> ! {
        let Ok(judge) = Evaluator::new(TABLE, SETTINGS.maximum_age_ms) else {
            halt()
        };
        let mut led = Led::new();
        for cycle in &SCHEDULE {
            cycle_begins(cycle.number, (&raw const judge).cast(), size_of_val(&judge));
            let verdict = run(&judge, &mut led, cycle);
            cycle_done(cycle.number, code(verdict));
        }
        schedule_over();
        halt()
    }

    #[inline(never)]
    fn run(judge: &Evaluator<'_>, led: &mut Led, cycle: &Cycle) -> Result<(), Reason> {
        let verdict = match &cycle.report {
            Some(report) => judge.permits(
                cycle.now_ms,
                report.stamp_ms,
                report.belief.pose_set(judge.radius_squared(), Trust::FULL),
            ),
            None => Err(Reason::Silent),
        };
        let driven = match verdict {
            Ok(()) => led.set_high(),
            Err(_) => led.set_low(),
        };
        driven.map_err(|_| Reason::InterlockFault).and(verdict)
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
