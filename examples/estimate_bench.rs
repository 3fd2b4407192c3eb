//! NOT a gate, but a bench for single estimates: they come in over a serial line, each is evaluated by itself, and an
//! output is high after a permit and at no other time. There are no permits in a row, no second evaluation and no settings.
//! A gate is `docking_gate.rs`. For a Cortex-M4F; runs in QEMU.
//!
//! ```text
//! cargo build -p posegate --profile firmware --target thumbv7em-none-eabihf --features firmware --example estimate_bench
//! qemu-system-arm -M mps2-an386 -display none -monitor none -serial stdio -kernel target/thumbv7em-none-eabihf/firmware/examples/estimate_bench
//! ```
//!
//! The messages are those of [`posegate::wire`]; `crates/posegate-cli/tests/uart_replay.rs` talks to this program.
//!
//! The emulated board shares no clock with the sender, so the time of use (`now_ms`) comes in with the
//! request. A product reads its own timer there, synchronised with the clock that stamps the estimates:
//! a sender that is late, or lies, must not be the one to say how late it is.
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

    /// The tasks of this controller; a request names one by its place in this order.
    static TABLES: [&[u8]; 2] = [
        include_bytes!("tables/dock.posegate"),
        include_bytes!("tables/see-t7.posegate"),
    ];
    /// An older estimate is of no use.
    const MAXIMUM_AGE_MS: u32 = 200;
    /// A permit ends when no request has come for this long.
    const LONGEST_SILENCE: u32 = TICKS_PER_SECOND / 1000 * MAXIMUM_AGE_MS;

    #[entry]
    fn main() -> ! {
        // What cannot be set up is not run without.
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
            // An output that does not follow is no interlock.
            if done.is_err() {
                halt();
            }
        }
    }

    /// One for each table. A damaged table still gives one: it denies, and says why.
    fn evaluators() -> Result<[Evaluator<'static>; 2], InvalidParameter> {
        let [dock, see_t7] = TABLES.map(|table| Evaluator::new(table, MAXIMUM_AGE_MS));
        Ok([dock?, see_t7?])
    }

    /// Judges a request and drives the interlock. What is no request closes it.
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

    /// Closed for good, until a reset. A product lets its watchdog do that.
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
