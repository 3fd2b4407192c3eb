//! Counts the cost of a gate in each control cycle in addition to its decisions, and its memory, in QEMU as
//! `count_instructions.rs` does for decisions.
//!
//! ```text
//! cargo run -p posegate --profile firmware --target thumbv7em-none-eabihf --features firmware --example count_gate
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
#[path = "faults/schedule.rs"]
#[allow(dead_code)] // The targets of fault injection use the rest.
mod schedule;

#[cfg(target_os = "none")]
mod firmware {
    use crate::board::counter::{Counter, Failure, M4F};
    use crate::board::stack::used_by;
    use crate::emulated::run;
    use crate::schedule::{SCHEDULE, SETTINGS, START_MS, TABLE};
    use core::hint::black_box;
    use cortex_m_rt::entry;
    use posegate::contain::{self, Decision, second};
    use posegate::gate::{Gate, Innovation, Monitor, ScrubProgress, Step, self_test};
    use posegate::motion::MotionBounds;
    use posegate::report::{PoseEstimate, Report};
    use posegate::set::{Growth, InputError, PoseSet, Trust};
    use posegate::table::Table;

    // Measured functions. Not inlined, so that each call is a real call.

    #[inline(never)]
    fn step(gate: &mut Gate<'_>, now_ms: u32, report: &Report) -> Step {
        gate.step(now_ms, report)
    }

    #[inline(never)]
    fn tick(gate: &mut Gate<'_>, now_ms: u32) -> Step {
        gate.tick(now_ms)
    }

    #[inline(never)]
    fn convert(table: &Table<'_>, belief: &PoseEstimate) -> Result<PoseSet, InputError> {
        belief.pose_set(table.radius_squared(), Trust::FULL)
    }

    #[inline(never)]
    fn decide(table: &Table<'_>, set: &PoseSet) -> Decision {
        contain::decide(table, set)
    }

    /// Bytes of a table that are checked in one call.
    const A_KILOBYTE: usize = 1024;

    fn measure() -> Result<(), Failure> {
        let mut counter = Counter::new()?;
        let invalid = |_| "a parameter is invalid";
        let size = size_of::<Gate<'static>>() as u64;
        counter.line("", "RAM of a gate", size, "B", Some(256));

        counter
            .print("self test", || black_box(self_test()))?
            .map_err(|_| "the self test fails")?;
        let new = || Gate::new(black_box(TABLE), &SETTINGS, START_MS);
        let mut gate = counter.print("gate made", new)?.map_err(invalid)?;

        let table = Table::parse(TABLE).map_err(|_| "the table does not parse")?;
        // The first reports of the schedule are good; when the last of them arrives, the gate is open.
        let good = SCHEDULE.iter().take(4);
        let (mut highest, mut open) = ((0, 0), false);
        for cycle in good {
            let report = cycle.report.as_ref().ok_or("a cycle without a report")?;
            let (set_cost, set) = counter.count(|| convert(black_box(&table), &report.belief))?;
            let set = set.map_err(|_| "an estimate was refused")?;
            let decision = counter.count(|| decide(black_box(&table), &set))?.0;
            let second = counter
                .count(|| second::opinion(black_box(TABLE), &report.belief, Trust::FULL))?
                .0;
            let (whole, output) = counter.count(|| step(&mut gate, cycle.now_ms, report))?;
            open = output.permission.is_permit();
            let own = whole.saturating_sub(set_cost + decision + second);
            highest = highest.max((own, whole));
        }
        if !open {
            return Err("the gate is not open");
        }
        let (own, whole) = highest;
        counter.line("", "step of a gate, whole", whole, "instructions", None);
        let name = "step of a gate on top of what it calls";
        // The goal is not met yet; the cost of the redundant checks may not grow. A tenth of it are the two checks of the
        // bounds of movement, of the hypotheses and of the probability that they omit.
        counter.short_of(
            name,
            own,
            "instructions",
            [300, if M4F { 710 } else { 995 }],
        );
        let bounds = MotionBounds::of_mm_mrad(300, 0, 500);
        let report = SCHEDULE.iter().find_map(|cycle| cycle.report.as_ref());
        let report = report.ok_or("no report")?;
        let mut set =
            convert(black_box(&table), &report.belief).map_err(|_| "an estimate was refused")?;
        let growth = counter.count(|| {
            let movement = SETTINGS.movement(black_box(bounds), black_box(70));
            set.grow(movement);
        })?;
        black_box(set);
        let name = "growth of a pose-set by a movement";
        let most = if M4F { 200 } else { 500 };
        counter.line("", name, growth.0, "instructions", Some(most));
        let mut monitor = Monitor::new(1_000_000).ok_or("the monitor is invalid")?;
        let fix = counter.count(|| {
            let (fix, prediction) = (black_box(&report.belief), black_box(&report.belief));
            monitor.fix(&Innovation::of_independent(fix, prediction, Growth::NONE)?)
        })?;
        let _ = fix.1.map_err(|_| "a fix was refused")?;
        counter.line("", "fix of a monitor", fix.0, "instructions", None);
        let now_ms = SCHEDULE.get(3).map_or(0, |cycle| cycle.now_ms) + 1;
        let output = counter.print("tick of a gate", || tick(&mut gate, now_ms))?;
        if !output.permission.is_permit() {
            return Err("the gate has closed");
        }
        // Repeated to measure the stack.
        let mut gate = new().map_err(invalid)?;
        let mut deepest = 0;
        for cycle in SCHEDULE.iter().take(4) {
            let report = cycle.report.as_ref().ok_or("a cycle without a report")?;
            deepest = used_by(|| step(&mut gate, cycle.now_ms, report))
                .0
                .max(deepest);
        }
        counter.line("stack of", "step of a gate", u64::from(deepest), "B", None);

        let (cost, scrubbed) = counter.count(|| {
            let scrubbed = gate.scrub(black_box(A_KILOBYTE));
            (scrubbed, A_KILOBYTE.min(TABLE.len()))
        })?;
        let (scrubbed, looked_at) = scrubbed;
        if scrubbed == ScrubProgress::Damaged {
            return Err("the table is damaged");
        }
        let kilobyte = cost * A_KILOBYTE as u64 / looked_at as u64;
        let most = if M4F { None } else { Some(20_000) };
        counter.line("", "scrub of 1024 bytes", kilobyte, "instructions", most);
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
