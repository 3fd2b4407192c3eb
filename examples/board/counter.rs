//! Counts instructions by time, under QEMU with `-icount shift=6`.

use super::{LongTimer, Timer};
use core::arch::asm;
use core::hint::black_box;
use cortex_m_semihosting::hprintln;

/// Iterations of the calibration loop; each is two instructions.
const FEW_TURNS: u32 = 1_000;
const MANY_TURNS: u32 = 101_000;
/// Iterations that outlast the system timer's longest interval (10.4 million instructions).
const TURNS_TOO_MANY: u32 = 6_000_000;
/// Difference between the two loops in instructions.
const CALIBRATION: u32 = 2 * (MANY_TURNS - FEW_TURNS);
/// Ticks of that difference: 200,000 * 64 ns / 40 ns, within the resolution of an instruction.
const CALIBRATION_TICKS: core::ops::RangeInclusive<u32> = 319_998..=320_002;

/// The core that this is built for.
pub const M4F: bool = cfg!(target_abi = "eabihf");
const CORE: &str = if M4F { "m4f" } else { "m0+" };

/// Why the figures cannot be trusted.
pub type Failure = &'static str;

/// Executes `turns` times two instructions.
#[inline(never)]
pub fn spin(turns: u32) {
    // SAFETY: counts a register down to zero; touches nothing else.
    unsafe {
        asm!("2:", "subs {0}, {0}, #1", "bne 2b", inout(reg) turns => _, options(nomem, nostack));
    }
}

/// Counts instructions by a timer.
pub struct Counter {
    timer: Timer,
    /// For work that outlasts the timer; it may be a few ticks off.
    long: LongTimer,
    empty_ticks: u32,
    calibration_ticks: u32,
    /// `true` if a figure is above its goal.
    pub short: bool,
}

impl Counter {
    pub fn new() -> Result<Self, Failure> {
        let mut counter = Self {
            timer: Timer::new(Timer::LONGEST),
            long: LongTimer::new(),
            empty_ticks: 0,
            calibration_ticks: 0,
            short: false,
        };
        let few = counter.spun(FEW_TURNS)?;
        let many = counter.spun(MANY_TURNS)?;
        counter.calibration_ticks = many.saturating_sub(few);
        if !CALIBRATION_TICKS.contains(&counter.calibration_ticks) {
            return Err("an instruction does not take 64 ns: run QEMU with -icount shift=6");
        }
        counter.timers_agree()?;
        counter.empty_ticks = counter.ticks(|| ())?.0;
        Ok(counter)
    }

    /// Checks that the two timers agree on a loop that both can time, and on one that outlasts the first.
    fn timers_agree(&mut self) -> Result<(), Failure> {
        let (ticks, ()) = self.ticks(|| spin(black_box(MANY_TURNS)))?;
        let long = self.long.elapsed().unwrap_or(0);
        if long.abs_diff(ticks) > 400 {
            return Err("the board's two timers do not agree");
        }
        let (ticks, ()) = self.ticks(|| spin(black_box(TURNS_TOO_MANY)))?;
        let expected = u64::from(self.calibration_ticks) * u64::from(TURNS_TOO_MANY)
            / u64::from(MANY_TURNS - FEW_TURNS);
        if u64::from(ticks).abs_diff(expected) > 400 {
            return Err("an interval longer than the system timer's is timed wrongly");
        }
        Ok(())
    }

    /// Returns the ticks of a loop; the instructions around it are the same for any number of iterations.
    #[inline(never)]
    fn spun(&mut self, turns: u32) -> Result<u32, Failure> {
        Ok(self.ticks(|| spin(turns))?.0)
    }

    /// Returns the ticks of `work`, including the measurement.
    fn ticks<T>(&mut self, work: impl FnOnce() -> T) -> Result<(u32, T), Failure> {
        self.long.restart();
        self.timer.restart();
        let start = self.timer.elapsed();
        let result = black_box(work());
        let end = self.timer.elapsed();
        match (start, end.or_else(|| self.long.elapsed())) {
            (Some(start), Some(end)) => Ok((end.saturating_sub(start), result)),
            _ => Err("the work outlasted both timers"),
        }
    }

    /// Returns the instructions of `work`, to the nearest.
    pub fn count<T>(&mut self, work: impl FnOnce() -> T) -> Result<(u64, T), Failure> {
        let (ticks, result) = self.ticks(work)?;
        let ticks = u64::from(ticks.saturating_sub(self.empty_ticks));
        let calibration = u64::from(self.calibration_ticks);
        let value = (ticks * u64::from(CALIBRATION) + calibration / 2) / calibration;
        Ok((value, result))
    }

    /// Counts the instructions of `work` and prints them.
    pub fn print<T>(&mut self, name: &str, work: impl FnOnce() -> T) -> Result<T, Failure> {
        let (value, result) = self.count(work)?;
        self.line("", name, value, "instructions", None);
        Ok(result)
    }

    /// Prints a figure that is known to miss its goal. A figure above `most` makes the program fail at its
    /// end.
    pub fn short_of(&mut self, of: &str, value: u64, unit: &str, [goal, most]: [u64; 2]) {
        self.short |= value > most;
        hprintln!(
            "{{\"name\":\"{} {}\",\"value\":{},\"unit\":\"{}\",\"goal\":{},\"most\":{}}}",
            CORE,
            of,
            value,
            unit,
            goal,
            most
        );
    }

    /// Prints a figure. A figure above its goal makes the program fail at its end.
    pub fn line(&mut self, what: &str, of: &str, value: u64, unit: &str, goal: Option<u64>) {
        let space = if what.is_empty() { "" } else { " " };
        match goal {
            None => hprintln!(
                "{{\"name\":\"{} {}{}{}\",\"value\":{},\"unit\":\"{}\",\"goal\":null}}",
                CORE,
                what,
                space,
                of,
                value,
                unit
            ),
            Some(goal) => {
                self.short |= value > goal;
                hprintln!(
                    "{{\"name\":\"{} {}{}{}\",\"value\":{},\"unit\":\"{}\",\"goal\":{}}}",
                    CORE,
                    what,
                    space,
                    of,
                    value,
                    unit,
                    goal
                );
            }
        }
    }
}

/// Returns the goal on each core; `None` for 0.
pub const fn goal(m4f: u64, m0_plus: u64) -> Option<u64> {
    let goal = if M4F { m4f } else { m0_plus };
    if goal == 0 { None } else { Some(goal) }
}
