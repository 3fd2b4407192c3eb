//! The number of random cases of a test: a part of them in the fast suite, all of them in its deep job
//! (`./ci.sh deep`, which sets `POSEGATE_DEEP`).

use std::time::{SystemTime, UNIX_EPOCH};

/// Cases between the seeds of two days.
const A_DAY: u64 = 100_000;

/// Returns `true` in a deep job.
pub fn is_deep() -> bool {
    std::env::var_os("POSEGATE_DEEP").is_some()
}

/// Returns `all` in a deep job, and a twentieth of it in the fast suite, but at least 1.
#[allow(dead_code)] // Some tests choose their share by `is_deep`.
pub fn cases(all: u64) -> u64 {
    if is_deep() { all } else { (all / 20).max(1) }
}

/// Returns the number of iterations of a test: `all`, or the smaller number `interpreted` under Miri, which is slow.
#[must_use]
#[allow(dead_code)] // Some tests are not run under Miri.
pub const fn rounds(all: u32, interpreted: u32) -> u32 {
    if cfg!(miri) { interpreted } else { all }
}

/// Returns all cases in a deep job, and in the fast suite one of them, another one on each day of the year.
#[allow(dead_code)] // Some tests have numbers of cases.
pub fn one_a_day<T: Copy>(all: &[T]) -> Vec<T> {
    if is_deep() {
        return all.to_vec();
    }
    let day = first_seed() / A_DAY;
    let today = all.iter().cycle().nth(day as usize % all.len().max(1));
    today.copied().into_iter().collect()
}

/// Returns how many cases to skip and the step from case to case: all cases in a deep job, and in the fast suite a part of them, one
/// of `parts`, another one on each day of the year.
#[allow(dead_code)] // Some tests have numbers of cases.
pub fn part(parts: usize) -> (usize, usize) {
    if is_deep() {
        return (0, 1);
    }
    ((first_seed() / A_DAY) as usize % parts.max(1), parts.max(1))
}

/// Returns the first seed of a test: another one on each day of the year, so that the tried cases add up, and 0 in a
/// deep job. `POSEGATE_SEED` repeats a run; the seed is printed.
#[allow(dead_code)] // Some tests have no seeds.
pub fn first_seed() -> u64 {
    let given = std::env::var("POSEGATE_SEED").ok();
    let given = given.map(|value| value.parse().expect("POSEGATE_SEED is a whole number"));
    let seed = given.unwrap_or_else(|| {
        if is_deep() {
            return 0;
        }
        let now = SystemTime::now().duration_since(UNIX_EPOCH);
        let days = now.map_or(0, |since| since.as_secs() / 86_400);
        (days % 366) * A_DAY
    });
    println!("POSEGATE_SEED={seed}");
    seed
}
