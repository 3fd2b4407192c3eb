//! Logs a gate's output with `defmt`: the format strings stay in the ELF file, only numbers are sent, and the host
//! combines them. For a Cortex-M4F; runs in QEMU, over semihosting. `crates/posegate-peers/tests/defmt_telemetry.rs`
//! checks every line.
//!
//! ```text
//! cargo build -p posegate --profile firmware --target thumbv7em-none-eabihf --features firmware,defmt --example defmt_telemetry
//! qemu-system-arm -M mps2-an386 -display none -monitor none -serial none -semihosting-config enable=on,target=native -kernel ELF | defmt-print -e ELF
//! ```
#![cfg_attr(target_os = "none", no_std, no_main)]

/// Firmware has no meaning on a host; this lets `cargo test --all-features` build there.
#[cfg(not(target_os = "none"))]
fn main() {}

#[cfg(target_os = "none")]
mod firmware {
    use core::convert::Infallible;
    use core::sync::atomic::{AtomicU32, Ordering};
    use cortex_m_rt::entry;
    use cortex_m_semihosting::debug::{EXIT_FAILURE, EXIT_SUCCESS, exit};
    use defmt_semihosting as _;
    use embedded_hal::digital::{ErrorType, OutputPin};
    use posegate::gate::{Gate, Interlock, Restart, Settings, Source, Step};
    use posegate::motion::MotionBounds;
    use posegate::recordings::Evaluator;
    use posegate::report::{FrameId, Heading, PoseEstimate, Report};
    use posegate::set::{Aging, Estimate, PoseSet, Trust, Uncertainty};
    use posegate::table::Table;
    use posegate::wire::{LinkCounters, ReportOutcome, Telemetry};

    static TABLE: &[u8] = include_bytes!("tables/dock.posegate");
    static SOURCES: [Source; 1] = [Source {
        frame: FrameId::of("map"),
        trust: Trust::FULL,
        aging: Aging::NONE,
        motion: MotionBounds::STANDS_STILL,
    }];

    /// The controller's clock, which stamps the lines.
    static NOW_MS: AtomicU32 = AtomicU32::new(0);
    defmt::timestamp!("{=u32:ms}", NOW_MS.load(Ordering::Relaxed));

    /// A pin without effect.
    struct Pin;

    impl ErrorType for Pin {
        type Error = Infallible;
    }

    impl OutputPin for Pin {
        fn set_low(&mut self) -> Result<(), Infallible> {
            Ok(())
        }

        fn set_high(&mut self) -> Result<(), Infallible> {
            Ok(())
        }
    }

    fn report(sequence: u32, stamp_ms: u32, x_m: f64) -> Report {
        let estimate = Estimate {
            x_m,
            y_m: -0.005,
            yaw_rad: 0.004,
        };
        Report {
            source: 0,
            frame: FrameId::of("map"),
            sequence,
            stamp_ms,
            belief: PoseEstimate::diagonal(estimate, [2.5e-5, 2.5e-5, 2.7e-5]),
        }
    }

    #[entry]
    fn main() -> ! {
        exit(match log() {
            Some(()) => EXIT_SUCCESS,
            None => EXIT_FAILURE,
        });
        loop {
            cortex_m::asm::wfi();
        }
    }

    fn log() -> Option<()> {
        let table = Table::parse(TABLE).ok()?;
        defmt::info!("{}", table);
        let settings = Settings {
            task: "dock",
            task_digest: table.task_digest(),
            sources: &SOURCES,
            maximum_age_ms: 200,
            response_ms: 20,
            report_period_ms: 50,
            permit_hold_ms: 100,
            inhibit_hold_ms: 20,
            permits_in_a_row: 3,
            restart: Restart::Automatic,
            most_runs: 1_000,
            look_at: Some(7),
        };
        defmt::info!("{}", settings);
        let mut gate = Gate::new(TABLE, &settings, 0).ok()?;
        let mut interlock = Interlock::new(Pin).ok()?;
        // Three good reports, silence, and a report outside of the set.
        for sequence in 1..=3 {
            let _ = weigh(
                &mut gate,
                &mut interlock,
                &report(sequence, 10 * sequence, 0.01),
            )?;
        }
        NOW_MS.store(150, Ordering::Relaxed);
        let step = gate.tick(150);
        interlock.apply(150, &step.permission).ok()?;
        defmt::warn!("{}, {}, {}", step, gate.advice(), gate);
        let step = weigh(&mut gate, &mut interlock, &report(4, 160, 0.079))?;
        defmt::warn!("{}", gate.advice());
        sets(&table);
        beliefs();
        defmt::info!(
            "{}",
            Telemetry {
                number: 1,
                cycle: 2,
                now_ms: 165,
                weighed: Some(ReportOutcome {
                    source: 0,
                    sequence: 4,
                    stamp_ms: 160,
                    verdict: step.verdict,
                }),
                state: step.state,
                permitted: step.permission.is_permit(),
                interlock_high: false,
                fault: interlock.fault(),
                line: LinkCounters::default(),
            }
        );
        // A damaged table: its first byte is missing.
        let judge = Evaluator::new(TABLE.get(1..)?, 200).ok()?;
        defmt::error!("{}", judge);
        Some(())
    }

    /// Evaluates a report 5 ms after it was made.
    fn weigh(gate: &mut Gate<'_>, interlock: &mut Interlock<Pin>, report: &Report) -> Option<Step> {
        let now_ms = report.stamp_ms + 5;
        NOW_MS.store(now_ms, Ordering::Relaxed);
        defmt::debug!("{}", report);
        let step = gate.step(now_ms, report);
        interlock.apply(now_ms, &step.permission).ok()?;
        defmt::info!("{}", step);
        defmt::info!("{}, {}", gate.examine(report), interlock);
        Some(step)
    }

    /// Logs sets, and the errors of inputs that give none.
    fn sets(table: &Table<'_>) {
        let estimate = Estimate {
            x_m: 1.5,
            y_m: -0.25,
            yaw_rad: 0.0,
        };
        defmt::info!("{}", estimate);
        defmt::info!("{}", PoseSet::bounded(estimate, 0.01, 0.02));
        let sigmas = [[1e-4, 0.0, 0.0], [0.0, 1e-4, 0.0], [0.0, 0.0, 1e-4]];
        defmt::info!(
            "{}",
            PoseSet::gaussian(estimate, sigmas, table.radius_squared())
        );
        let never = [[0.0; 3]; 3];
        defmt::warn!(
            "{}",
            PoseSet::gaussian(estimate, never, table.radius_squared())
        );
    }

    fn beliefs() {
        let belief = PoseEstimate {
            x_m: f64::NAN,
            y_m: f64::INFINITY,
            heading: Heading::Quaternion([0.0, 0.0, 0.0, 1.0]),
            spread: Some(Uncertainty::Bounded {
                translation_m: 0.05,
                yaw_rad: 0.02,
            }),
        };
        defmt::info!("{}", belief);
    }

    #[panic_handler]
    fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
        exit(EXIT_FAILURE);
        loop {
            cortex_m::asm::wfi();
        }
    }
}
