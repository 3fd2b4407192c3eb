//! The example of the README, compiled and run:
//! `cargo run -p posegate --features std --example may_dock`.

// readme: begin
use embedded_hal::digital::OutputPin;
use posegate::gate::{Gate, Interlock, Reason, Settings, Source, task_digest};
use posegate::motion::MotionBounds;
use posegate::report::{FrameId, Report};
use posegate::set::{Aging, Trust};

/// Made by `posegate table build`, kept in flash.
static TABLE: &[u8] = include_bytes!("../examples/tables/dock.posegate");

/// What the controller expects. The digest is that of the task: `posegate table info` prints it.
static SETTINGS: Settings<'static> = Settings {
    task: "dock",
    task_digest: task_digest("dd45d89b69c82c2f50ab8b974603f4c9f2ac254b3d9c7f82d2aa95c1b3de263c")
        .expect("64 digits"),
    sources: &[Source {
        frame: FrameId::of("map"),
        trust: Trust::FULL,
        aging: Aging::NONE,
        motion: MotionBounds::of_mm_mrad(50, 0, 100), // 0.05 m/s along its axis, none across, 0.1 rad/s
    }],
    look_at: Some(7),
    // Reports come every 50 ms, up to 50 ms after their stamps.
    ..Settings::for_source(50, 50)
};

/// Once, at start: the gate tests itself and the table. It is closed.
fn gate(now_ms: u32) -> Gate<'static> {
    Gate::new(TABLE, &SETTINGS, now_ms).expect("no parameter switches a check off")
}

/// In every control cycle, with a report or without: opens the interlock, or keeps it low.
fn cycle(
    gate: &mut Gate<'_>,
    interlock: &mut Interlock<impl OutputPin>,
    now_ms: u32,
    report: Option<&Report>,
) -> Result<(), Reason> {
    let step = match report {
        Some(report) => gate.step(now_ms, report),
        None => gate.tick(now_ms),
    };
    if interlock.apply(now_ms, &step.permission).is_err() {
        gate.fault(Reason::InterlockFault);
    }
    step.verdict
}
// readme: end

/// A pin with a level that can be read.
struct Lamp<'a>(&'a std::cell::Cell<bool>);

impl embedded_hal::digital::ErrorType for Lamp<'_> {
    type Error = std::convert::Infallible;
}

impl OutputPin for Lamp<'_> {
    fn set_low(&mut self) -> Result<(), Self::Error> {
        self.0.set(false);
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Self::Error> {
        self.0.set(true);
        Ok(())
    }
}

fn main() {
    use posegate::report::PoseEstimate;
    use posegate::set::Estimate;

    let level = std::cell::Cell::new(false);
    let mut interlock = Interlock::new(Lamp(&level)).expect("a lamp does not fail");
    let mut gate = gate(0);
    let mut now_ms = 0;
    let mut send = |number: u32, x_m: f64, variance: f64| {
        now_ms += 100;
        let estimate = Estimate {
            x_m,
            y_m: 0.0,
            yaw_rad: 0.0,
        };
        let report = Report {
            source: 0,
            frame: FrameId::of("map"),
            sequence: number,
            stamp_ms: now_ms - 10,
            belief: PoseEstimate::diagonal(estimate, [variance; 3]),
        };
        let verdict = cycle(&mut gate, &mut interlock, now_ms, Some(&report));
        (verdict, level.get())
    };
    // Three permits in a row, and the hold time after the start is over.
    for number in 0..2 {
        assert_eq!(send(number, 0.01, 1e-4), (Ok(()), false));
    }
    assert_eq!(send(2, 0.01, 1e-4), (Ok(()), true));
    assert_eq!(send(3, 0.07, 1e-4), (Err(Reason::NotContained), false));
    assert_eq!(send(4, 0.01, 0.0), (Err(Reason::CovarianceZero), false));
    assert_eq!(send(6, 0.01, 1e-4), (Err(Reason::SequenceGap), false));
    println!("opened after permits in a row, closed by each failure, as it should be");
}
