//! NOT a gate, but a test bench for single estimates. They arrive over a serial line, and each is evaluated by itself.
//! An output is high after a permit and at no other time. There is no sequence of permits, no second evaluation and no
//! settings. For a gate see `docking_gate.rs`. For a Cortex-M4F; runs in QEMU.
//!
//! ```text
//! cargo build -p posegate --profile firmware --target thumbv7em-none-eabihf --features firmware --example estimate_bench
//! qemu-system-arm -M mps2-an386 -display none -monitor none -serial stdio -kernel target/thumbv7em-none-eabihf/firmware/examples/estimate_bench
//! ```
//!
//! The messages are those of [`posegate::wire`]; `crates/posegate-cli/tests/uart_replay.rs` communicates with this
//! program.
//!
//! The emulated board shares no clock with the sender, so the time of use (`now_ms`) comes with the request. A product
//! must instead read its own timer, synchronised with the clock that stamps the estimates: a sender that is late or
//! wrong must not report its own delay.
#![cfg_attr(target_os = "none", no_std, no_main)]

/// Firmware has no meaning on a host; this lets `cargo test --all-features` build there.
#[cfg(not(target_os = "none"))]
fn main() {}

#[cfg(target_os = "none")]
mod board;

#[cfg(target_os = "none")]
mod firmware {
    use crate::board::{Led, TICKS_PER_SECOND, Timer, Uart};
    use cortex_m_rt::{ExceptionFrame, entry, exception};
    use posegate::gate::{Interlock, InterlockFault, InvalidParameter, Permission};
    use posegate::recordings::Evaluator;
    use posegate::wire::{Frame, Receiver, Reply, Request, WireError, encode};

    /// The tasks of this controller; a request refers to a task by its index here.
    static TABLES: [&[u8]; 2] = [
        include_bytes!("tables/dock.posegate"),
        include_bytes!("tables/see-t7.posegate"),
    ];
    /// Older estimates are denied.
    const MAXIMUM_AGE_MS: u32 = 200;
    /// A permit ends after this time without a request.
    const LONGEST_SILENCE: u32 = TICKS_PER_SECOND / 1000 * MAXIMUM_AGE_MS;

    #[entry]
    fn main() -> ! {
        // The program halts if the set-up fails.
        let (Ok(evaluators), Ok(mut interlock)) = (evaluators(), Interlock::new(Led::new())) else {
            halt()
        };
        let mut uart = Uart::new();
        let mut receiver = Receiver::new();
        let mut silence = Timer::new(LONGEST_SILENCE);
        loop {
            let done = if let Some(frame) = uart.receive().and_then(|byte| receiver.push(byte)) {
                silence.restart();
                answer(frame, &evaluators, &mut interlock)
                    .map(|reply| uart.send(&encode(&reply.body())))
            } else if silence.elapsed().is_none() {
                interlock.close()
            } else {
                Ok(())
            };
            // Halt if the output does not follow: it cannot serve as an interlock.
            if done.is_err() {
                halt();
            }
        }
    }

    /// Creates one evaluator per table. A damaged table also gives an evaluator: it denies with the reason.
    fn evaluators() -> Result<[Evaluator<'static>; 2], InvalidParameter> {
        let [dock, see_t7] = TABLES.map(|table| Evaluator::new(table, MAXIMUM_AGE_MS));
        Ok([dock?, see_t7?])
    }

    /// Evaluates a request and drives the interlock. An invalid request closes it.
    fn answer(
        frame: Result<Frame, WireError>,
        evaluators: &[Evaluator<'_>],
        interlock: &mut Interlock<Led>,
    ) -> Result<Reply, InterlockFault> {
        let judged = frame
            .and_then(|body| Request::from_body(&body))
            .and_then(|request| Ok((request, request.evaluate(evaluators)?)));
        match judged {
            Ok((request, verdict)) => {
                interlock.apply(
                    request.now_ms,
                    &Permission::of_single(&verdict, request.now_ms),
                )?;
                Ok(Reply {
                    sequence: request.sequence,
                    verdict: Ok(verdict),
                    interlock_high: Led::is_high(),
                })
            }
            Err(error) => {
                interlock.close()?;
                Ok(Reply::refused(error))
            }
        }
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
