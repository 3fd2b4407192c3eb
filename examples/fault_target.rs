//! A gate as a product runs it, as a target of fault injection: `./ci.sh faults`,
//! `crates/posegate-boards/tests/fault_injection`.
//!
//! At start the firmware checks its own code and itself. Then the reports of a schedule follow, one per cycle, and the
//! interlock follows the gate. In its idle time the firmware checks code and table. It has no protection that the crate
//! does not offer. It must be sealed after linking (`posegate table seal`), otherwise its gate is latched.
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
    use crate::board::lamps::{Heartbeat, ReadBack};
    use crate::faults::markers::{code, cycle_begins, cycle_done, halt, schedule_over};
    use crate::faults::schedule::{Cycle, SCHEDULE, SETTINGS, START_MS, TABLE};
    use cortex_m_rt::{ExceptionFrame, entry, exception};
    use posegate::gate::{Gate, Interlock, Reason, Scrub, ScrubProgress, Seal};

    /// Filled in after linking.
    #[used]
    static SEAL: Seal = Seal::UNSEALED;

    type Output = Interlock<Led, ReadBack, Heartbeat>;

    /// Bytes checked in a cycle's idle time.
    const A_FEW: usize = 64;

    #[entry]
    fn main() -> ! {
        // The program halts if the set-up fails.
        let (Ok(mut gate), Some(mut output)) = (Gate::new(TABLE, &SETTINGS, START_MS), output())
        else {
            halt()
        };
        let image = image();
        if let Err(reason) = SEAL.check(image) {
            gate.fault(reason);
        }
        let mut progress = Scrub::new();
        for cycle in &SCHEDULE {
            cycle_begins(cycle.number, (&raw const gate).cast(), size_of_val(&gate));
            let verdict = run(&mut gate, &mut output, cycle);
            cycle_done(cycle.number, code(verdict));
            let _ = gate.scrub(A_FEW);
            if SEAL.scrub(&mut progress, image, A_FEW) == ScrubProgress::Damaged {
                gate.fault(Reason::CodeDamaged);
            }
        }
        schedule_over();
        halt()
    }

    fn output() -> Option<Output> {
        Interlock::new(Led::new())
            .ok()?
            .with_read_back(ReadBack, 10)
            .ok()?
            .with_heartbeat(Heartbeat, 10)
            .ok()
    }

    /// A control cycle, as the README shows it.
    #[inline(never)]
    fn run(gate: &mut Gate<'_>, output: &mut Output, cycle: &Cycle) -> Result<(), Reason> {
        let step = match &cycle.report {
            Some(report) => gate.step(cycle.now_ms, report),
            None => gate.tick(cycle.now_ms),
        };
        if output.apply(cycle.now_ms, &step.permission).is_err() {
            gate.fault(Reason::InterlockFault);
        }
        step.verdict
    }

    unsafe extern "C" {
        // From cortex-m-rt's linker script: where the initial values of variables are in flash, and where the variables
        // are.
        static __sidata: u32;
        static __sdata: u32;
        static __edata: u32;
    }

    /// Returns every byte that is loaded into flash. The image starts at address 0, which no slice may have; the board
    /// maps the same memory again 4 MB higher.
    fn image() -> &'static [u8] {
        const SHOWN_AGAIN: usize = 0x0040_0000;
        let [values, start, end] = [&raw const __sidata, &raw const __sdata, &raw const __edata]
            .map(|pointer| pointer.addr());
        let length = values + (end - start);
        // SAFETY: memory that is never written, of the length that the linker defines.
        unsafe { core::slice::from_raw_parts(SHOWN_AGAIN as *const u8, length) }
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
