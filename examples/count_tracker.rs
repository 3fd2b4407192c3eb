//! Counts the cost of carrying a fix along odometry, and its memory, in QEMU as `count_instructions.rs` does for decisions.
//!
//! ```text
//! cargo run -p posegate --profile firmware --target thumbv7em-none-eabihf --features firmware --example count_tracker
//! ```
//!
//! Prints one JSON line per figure; ends with exit code 1 if a figure is above its goal or cannot be trusted.
#![cfg_attr(target_os = "none", no_std, no_main)]

/// Firmware has no meaning on a host; this lets `cargo test --all-features` build there.
#[cfg(not(target_os = "none"))]
fn main() {}

#[cfg(target_os = "none")]
mod board;

#[cfg(target_os = "none")]
#[path = "board/emulated.rs"]
mod emulated;

#[cfg(target_os = "none")]
mod firmware {
    use crate::board::counter::{Counter, Failure, M4F};
    use crate::board::stack::used_by;
    use crate::emulated::run;
    use core::hint::black_box;
    use cortex_m_rt::entry;
    use posegate::gate::Reason;
    use posegate::motion::MotionBounds;
    use posegate::report::{FrameId, PoseEstimate, Report};
    use posegate::set::{Estimate, Trust};
    use posegate::table::Table;
    use posegate::track::{Increment, OdometryErrors, Tracked, Tracker, TrackerSettings};

    static TABLE: &[u8] = include_bytes!("tables/see-t7.posegate");
    /// Increments that are kept, and their period.
    const KEPT: usize = 64;
    const PERIOD_MS: u32 = 20;

    // Measured functions. Not inlined, so that each call is a real call.

    #[inline(never)]
    fn odometry(tracker: &mut Tracker<KEPT>, increment: Increment) -> Result<(), Reason> {
        tracker.odometry(increment)
    }

    #[inline(never)]
    fn fix(tracker: &mut Tracker<KEPT>, report: &Report) -> Result<(), Reason> {
        tracker.fix(report)
    }

    #[inline(never)]
    fn tracked(tracker: &mut Tracker<KEPT>, now_ms: u32) -> Result<Tracked, Reason> {
        tracker.tracked(now_ms)
    }

    /// An increment along an arc, of 6 mm and 10 mrad, at the end of period k.
    fn increment(k: u32) -> Result<Increment, Failure> {
        let ends_ms = k * PERIOD_MS;
        Increment::of(0.006, 0.0001, 0.01, [ends_ms - PERIOD_MS, ends_ms])
            .ok_or("an increment was refused")
    }

    fn fix_at(sequence: u32, stamp_ms: u32) -> Report {
        let estimate = Estimate {
            x_m: 1.0,
            y_m: 0.25,
            yaw_rad: 0.3,
        };
        let mut belief = PoseEstimate::diagonal(estimate, [4e-4, 3e-4, 1e-4]);
        belief.spread = Some(posegate::set::Uncertainty::Gaussian([
            [4e-4, 1e-4, 2e-5],
            [1e-4, 3e-4, 1e-5],
            [2e-5, 1e-5, 1e-4],
        ]));
        Report {
            source: 0,
            frame: FrameId::of("map"),
            sequence,
            stamp_ms,
            belief,
        }
    }

    fn measure() -> Result<(), Failure> {
        let mut counter = Counter::new()?;
        let refused = |_| "the tracker refuses what is good";
        let table = Table::parse(TABLE).map_err(|_| "the table does not parse")?;
        let settings = TrackerSettings {
            errors: OdometryErrors {
                m_per_sqrt_m: 0.01,
                rad_per_sqrt_rad: 0.02,
                rad_per_sqrt_m: 0.01,
                m_per_sqrt_s: 0.001,
                rad_per_sqrt_s: 0.001,
                slip: 0.02,
                turn_slip: 0.02,
                turn_slip_per_m: 0.001,
            },
            bounds: MotionBounds::of_mm_mrad(500, 50, 1_000),
            trust: Trust::FULL,
            radius_squared: table.radius_squared(),
            maximum_gap_ms: 60,
            maximum_fix_age_ms: 2_000,
        };
        let mut tracker = Tracker::new(settings).ok_or("a setting of the tracker is invalid")?;
        let size = size_of::<Tracker<KEPT>>() as u64;
        counter.line("", "RAM of a tracker", size, "B", Some(1_536));

        // One more than are kept, so that the ring is full.
        for k in 1..=KEPT as u32 + 2 {
            odometry(&mut tracker, increment(k)?).map_err(refused)?;
        }
        let mut k = KEPT as u32 + 2;
        fix(&mut tracker, &fix_at(1, (k - 4) * PERIOD_MS)).map_err(refused)?;
        // With a full ring and a fix that is carried.
        let mut highest = 0;
        for _ in 0..8 {
            k += 1;
            let next = black_box(increment(k)?);
            let (cost, taken) = counter.count(|| odometry(&mut tracker, next))?;
            taken.map_err(refused)?;
            highest = highest.max(cost);
        }
        let most = if M4F { 1_500 } else { 5_000 };
        let name = "increment of a tracker";
        counter.line("", name, highest, "instructions", Some(most));

        // A fix from before the second increment of the ring, half a period after the first: 63 and a half increments.
        let oldest = (k - KEPT as u32) * PERIOD_MS + PERIOD_MS / 2;
        let late = black_box(fix_at(2, oldest));
        let mut fresh = Tracker::new(settings).ok_or("a setting of the tracker is invalid")?;
        for k in 1..=k {
            odometry(&mut fresh, increment(k)?).map_err(refused)?;
        }
        let (cost, taken) = counter.count(|| fix(&mut fresh, &late))?;
        taken.map_err(refused)?;
        let most = if M4F { 100_000 } else { 350_000 };
        let name = "late fix through 64 increments";
        counter.line("", name, cost, "instructions", Some(most));

        let now_ms = k * PERIOD_MS + 5;
        let (cost, found) = counter.count(|| tracked(&mut tracker, now_ms))?;
        found.map_err(refused)?;
        counter.line("", "report of a tracker", cost, "instructions", None);
        let deepest = used_by(|| tracked(&mut tracker, now_ms)).0;
        let deepest = deepest.max(used_by(|| fix(&mut fresh, &fix_at(3, oldest + 1))).0);
        counter.line("stack of", "tracker", u64::from(deepest), "B", None);
        if counter.short {
            return Err("a figure is above its goal");
        }
        Ok(())
    }

    #[entry]
    fn main() -> ! {
        run(measure)
    }
}
