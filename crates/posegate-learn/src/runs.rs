//! Runs: rows that depend on each other, such as those of one drive or one video, and the number of independent rows
//! with the same information.

use super::binomial::order_statistic;
use super::quantiles::{normal_quantile, t_quantile};
use std::collections::BTreeMap;

/// The origin of the runs of a file's rows.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub enum RunSource {
    /// The rows are taken as independent of each other.
    #[default]
    Independent,
    /// The column `run` states the run of each row.
    Column,
    /// The rows follow each other at video rate: a new run starts after a gap in `t_s`.
    Gaps {
        /// The median step of `t_s`, seconds.
        step_s: f64,
        /// A longer step starts a new run, seconds.
        gap_s: f64,
    },
}

/// The runs of a file's rows. Rows of different runs are independent of each other.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Runs {
    /// The run of each row, from 0; empty if every row is a run of its own.
    pub of_row: Vec<u32>,
    /// The origin of the runs.
    pub source: RunSource,
}

/// Rows follow each other at video rate if half of the steps are at most this, seconds.
const VIDEO_STEP_S: f64 = 0.5;
/// A gap between runs is longer than this, seconds, and than this many median steps.
const GAP_S: f64 = 2.0;
const GAP_STEPS: f64 = 10.0;

impl Runs {
    /// Returns the runs of rows with names. Rows with the same name are a run, at any place in the file.
    #[must_use]
    pub fn of_names<'a>(names: impl Iterator<Item = &'a str>) -> Self {
        let mut known: BTreeMap<&str, u32> = BTreeMap::new();
        let mut of_row = Vec::new();
        for name in names {
            let next = known.len() as u32;
            of_row.push(*known.entry(name).or_insert(next));
        }
        Self {
            of_row,
            source: RunSource::Column,
        }
    }

    /// Returns the runs of rows without names, by their times (seconds). If half of the rows follow the previous one
    /// within 0.5 s, in the file's order or in the order of time, a new run starts if time falls, or after a step of
    /// more than 2 s and of more than 10 median steps. Otherwise the rows are independent.
    #[must_use]
    pub fn of_times(times: &[f64]) -> Self {
        let as_in_file: Vec<usize> = (0..times.len()).collect();
        let mut in_time = as_in_file.clone();
        in_time.sort_by(|a, b| times[*a].total_cmp(&times[*b]));
        for order in [as_in_file, in_time] {
            let steps = order.windows(2).map(|pair| times[pair[1]] - times[pair[0]]);
            let mut close: Vec<f64> = steps
                .filter(|step| (0.0..=VIDEO_STEP_S).contains(step))
                .collect();
            if close.is_empty() || 2 * close.len() < times.len() - 1 {
                continue;
            }
            close.sort_by(f64::total_cmp);
            let step_s = close[close.len() / 2];
            let gap_s = GAP_S.max(GAP_STEPS * step_s);
            let mut of_row = std::vec![0; times.len()];
            let mut run = 0;
            for pair in order.windows(2) {
                let step = times[pair[1]] - times[pair[0]];
                run += u32::from(!(0.0..=gap_s).contains(&step));
                of_row[pair[1]] = run;
            }
            return Self {
                of_row,
                source: RunSource::Gaps { step_s, gap_s },
            };
        }
        Self::default()
    }

    /// Returns the number of runs; `None` if every row is a run of its own.
    #[must_use]
    pub fn count(&self) -> Option<usize> {
        let last = self.of_row.iter().max()?;
        Some(*last as usize + 1)
    }
}

/// Rows of each run, and how many of them are hits.
#[derive(Clone, Debug, Default)]
pub(super) struct Tally {
    runs: BTreeMap<u32, [u64; 2]>,
}

impl Tally {
    pub(super) fn of(rows: impl Iterator<Item = (u32, bool)>) -> Self {
        let mut tally = Self::default();
        for (run, hit) in rows {
            let counts = tally.runs.entry(run).or_default();
            counts[0] += 1;
            counts[1] += u64::from(hit);
        }
        tally
    }

    /// Returns the design effect: the ratio of the variance of the share of hits to that of the same number of
    /// independent rows, at least 1, from the spread of the sums over runs. `None` with fewer than two runs.
    pub(super) fn effect(&self) -> Option<f64> {
        let runs = self.runs.len() as f64;
        let total = |which: usize| self.runs.values().map(|run| run[which]).sum::<u64>() as f64;
        let (rows, hits) = (total(0), total(1));
        if runs < 2.0 {
            return None;
        }
        let share = hits / rows;
        let random = rows * share * (1.0 - share);
        if random <= 0.0 {
            return Some(1.0);
        }
        let spread: f64 = self
            .runs
            .values()
            .map(|run| {
                let off = run[1] as f64 - share * run[0] as f64;
                off * off
            })
            .sum();
        Some((spread * runs / (runs - 1.0) / random).max(1.0))
    }

    /// Returns the number of independent rows with the same information on the share of hits, for limits with a
    /// confidence.
    pub(super) fn independent(&self, confidence: f64) -> f64 {
        let rows = self.runs.values().map(|run| run[0]).sum::<u64>() as f64;
        let effect = self.effect().unwrap_or(rows.max(1.0));
        rows / effect * for_few_runs(self.runs.len(), confidence)
    }
}

/// Returns the design effect of scores in runs: the larger one of the shares of scores beyond the median and beyond
/// the q-quantile.
pub(super) fn effect(scores: &[f64], runs: &[u32], q: f64) -> f64 {
    let mut effect = 1.0f64;
    for level in [0.5, q] {
        let rank = libm::ceil(scores.len() as f64 * level) as u64;
        let Some(limit) = order_statistic(scores, rank) else {
            continue;
        };
        let beyond = scores.iter().map(|score| *score > limit);
        let tally = Tally::of(runs.iter().copied().zip(beyond));
        effect = effect.max(tally.effect().unwrap_or(1.0));
    }
    effect
}

/// Returns the factor by which a number of independent rows is reduced because their number was estimated from a few
/// runs: the squared ratio of the quantiles of the normal and of Student's t distribution (Korn and Graubard).
pub(super) fn for_few_runs(runs: usize, confidence: f64) -> f64 {
    if runs < 2 {
        return 0.0;
    }
    let probability = confidence.max(0.75);
    let ratio = normal_quantile(probability) / t_quantile(probability, (runs - 1) as f64);
    ratio * ratio
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn video_is_split_into_runs_at_gaps() {
        // Three approaches of 50 frames at 10 Hz; after the second one the clock starts again.
        let mut times: Vec<f64> = (0..50).map(|k| 0.1 * f64::from(k)).collect();
        times.extend((0..50).map(|k| 30.0 + 0.1 * f64::from(k)));
        times.extend((0..50).map(|k| 0.1 * f64::from(k)));
        let runs = Runs::of_times(&times);
        assert_eq!(runs.count(), Some(3));
        assert!(matches!(runs.source, RunSource::Gaps { gap_s: 2.0, .. }));
        let expected: Vec<u32> = (0..150).map(|k| k / 50).collect();
        assert_eq!(runs.of_row, expected);
        // In shuffled order: two approaches, whose rows alternate.
        let shuffled: Vec<f64> = (0..50).flat_map(|k| [times[k], times[50 + k]]).collect();
        let expected: Vec<u32> = (0..100).map(|k| k % 2).collect();
        assert_eq!(Runs::of_times(&shuffled).of_row, expected);
    }

    #[test]
    fn rows_far_apart_are_independent() {
        let times: Vec<f64> = (0..50).map(|k| 3.0 * f64::from(k)).collect();
        assert_eq!(Runs::of_times(&times), Runs::default());
        assert_eq!(Runs::of_times(&[]), Runs::default());
        assert_eq!(Runs::of_times(&[1.0]), Runs::default());
        assert_eq!(Runs::default().count(), None);
        let named = Runs::of_names(["b", "a", "b"].into_iter());
        assert_eq!(
            (named.of_row.as_slice(), named.count()),
            ([0, 1, 0].as_slice(), Some(2))
        );
    }

    /// Rows that repeat 20 times count once.
    #[test]
    fn effect_of_constant_runs_is_their_length() {
        let hit = |run: u32| crate::random::mixed(u64::from(run)).is_multiple_of(4);
        let repeated = Tally::of((0..20_000).map(|row| (row / 20, hit(row / 20))));
        let effect = repeated.effect().unwrap();
        assert!((18.0..22.0).contains(&effect), "{effect}");
        let single = Tally::of((0..20_000).map(|row| (row / 20, hit(row))));
        let effect = single.effect().unwrap();
        assert!((1.0..1.15).contains(&effect), "{effect}");
        assert_eq!(
            Tally::of([(0, true), (0, false)].into_iter()).effect(),
            None
        );
    }

    #[test]
    fn few_runs_reduce_the_independent_rows() {
        assert_eq!(for_few_runs(1, 0.95), 0.0);
        assert!((for_few_runs(2, 0.95) - (1.644_854f64 / 6.313_752).powi(2)).abs() < 1e-5);
        assert!(for_few_runs(1000, 0.95) > 0.995);
    }
}
