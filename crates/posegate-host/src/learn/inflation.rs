//! The factor by which a source's covariance must grow so that its pose-sets contain the truth as often as stated.

use super::LearnError;
use super::binomial::{conformal_rank, order_statistic, rank};
use super::detections::hexadecimal;
use super::document::VERSION;
use super::estimates::{LOG_DET, Scored, ScoredEstimates};
use posegate::confidence::radius_squared;
use posegate::set::Inflation;
use serde::{Deserialize, Serialize};

/// The most conditions that are distinguished.
const MOST: usize = 6;
/// A condition has this many times the fewest independent rows.
const ROOMY: f64 = 1.5;
/// The fewest independent rows for any result.
const FEWEST: f64 = 10.0;
/// The fewest blocks of consecutive rows for estimating the dependence of rows.
const FEWEST_BLOCKS: usize = 20;
/// If all rows have the same condition, other values count as equal within this: as a difference of a logarithm of a
/// determinant, as a share of any other condition.
const ALIKE: f64 = 0.01;

/// The settings for learning factors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InflationSettings {
    /// The share of the estimates whose set shall contain the truth, above 0 and below 1.
    pub epsilon: f64,
    /// The probability, over the random choice of data, that the set does so under a condition; above 0 and below 1.
    pub confidence: f64,
}

/// The factors of a source's covariance.
#[derive(Clone, Debug, PartialEq)]
pub struct InflationModel {
    document: Document,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Document {
    posegate_model: u32,
    /// `inflation`.
    kind: String,
    epsilon: f64,
    confidence: f64,
    /// The column of the condition; `log_det` for the logarithm of the covariance's determinant.
    condition: String,
    data: Data,
    overall: InflationReport,
    part: Vec<InflationReport>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Data {
    sha256: String,
    rows: u64,
    /// Rows with an impossible covariance; they are left out.
    impossible: u64,
}

impl Default for InflationSettings {
    fn default() -> Self {
        Self {
            epsilon: 0.99,
            confidence: 0.8,
        }
    }
}

/// The result for a condition.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct InflationReport {
    /// The condition's ends, both included.
    pub from: f64,
    /// See `from`.
    pub to: f64,
    /// Rows in it.
    pub rows: u64,
    /// The number of independent rows that would tell equally well how often the truth is outside. Consecutive rows
    /// are dependent.
    pub independent_rows: u64,
    /// The share of the sets that contained the truth without a factor.
    pub held: f64,
    /// The factor at which the share would have been epsilon among these rows: may be below 1.
    pub needed: f64,
    /// A lower limit of the needed factor, with the model's confidence.
    pub low: f64,
    /// The factor to use: an upper limit with the same confidence, at least 1. 0 if there are too few rows, or if the
    /// gate does not accept the factor.
    pub inflation: f64,
}

/// Learns factors from estimates with truth.
///
/// # Errors
/// [`LearnError::Share`] if a setting is not in (0, 1); [`LearnError::TooFew`] if there are too few independent rows.
pub fn learn_inflation(
    estimates: &ScoredEstimates,
    settings: &InflationSettings,
) -> Result<InflationModel, LearnError> {
    let InflationSettings {
        epsilon,
        confidence,
    } = *settings;
    if !(confidence > 0.0 && confidence < 1.0) {
        return Err(LearnError::Share {
            name: "confidence",
            value: confidence,
        });
    }
    let r2 = radius_squared(epsilon).ok_or(LearnError::Share {
        name: "epsilon",
        value: epsilon,
    })?;
    let rows = &estimates.rows;
    let z = normal_quantile(confidence);
    let all_hold = libm::log(1.0 - confidence) / libm::log(epsilon);
    let fewest = libm::ceil((z * z * epsilon / (1.0 - epsilon)).max(all_hold)).max(FEWEST);
    let of = |from: f64, to: f64| report(rows, [from, to], r2, epsilon, confidence);
    let mut sorted: Vec<f64> = rows.iter().map(|row| row.condition).collect();
    sorted.sort_by(f64::total_cmp);
    let (Some(first), Some(last)) = (sorted.first().copied(), sorted.last().copied()) else {
        return Err(LearnError::TooFew {
            found: 0,
            of: "rows whose covariance is possible",
            needed: fewest as u64,
        });
    };
    let overall = of(first, last);
    if (overall.independent_rows as f64) < fewest {
        return Err(LearnError::TooFew {
            found: overall.independent_rows,
            of: "rows that are independent of each other",
            needed: fewest as u64,
        });
    }
    // Use as many conditions as have enough rows. A column with few distinct values keeps one condition per value.
    let mut part = Vec::new();
    let distinct = distinct(&sorted);
    let size = if estimates.condition == LOG_DET {
        1.0
    } else {
        libm::fabs(first)
    };
    for count in (1..=MOST).rev() {
        let mut ends = if distinct.len() > MOST {
            cuts(&sorted, &distinct, count)
        } else {
            let mut ends = std::vec![first];
            ends.extend(distinct.windows(2).map(|pair| 0.5 * (pair[0] + pair[1])));
            ends.push(last);
            ends
        };
        if last - first <= ALIKE * size {
            ends = std::vec![first - ALIKE * size, last + ALIKE * size];
        }
        // An estimate closer to the last fix than any row is better known, not worse.
        if estimates.condition != LOG_DET && ends[0] > 0.0 {
            ends[0] = 0.0;
        }
        part = ends.windows(2).map(|pair| of(pair[0], pair[1])).collect();
        let enough = |part: &InflationReport| part.independent_rows as f64 >= ROOMY * fewest;
        let told_apart = distinct.len() <= MOST || last - first <= ALIKE * size;
        if told_apart || part.iter().all(enough) {
            break;
        }
    }
    let document = Document {
        posegate_model: VERSION,
        kind: "inflation".into(),
        epsilon,
        confidence,
        condition: estimates.condition.clone(),
        data: Data {
            sha256: hexadecimal(&estimates.sha256),
            rows: rows.len() as u64,
            impossible: estimates.impossible.len() as u64,
        },
        overall,
        part,
    };
    InflationModel::new(document, "the learnt model")
}

/// Returns sorted numbers without repetitions.
fn distinct(sorted: &[f64]) -> Vec<f64> {
    let mut distinct = sorted.to_vec();
    distinct.dedup();
    distinct
}

/// Returns the ends of `count` conditions with equally many rows. Cuts lie midway between distinct numbers, so equal
/// rows are not split, nor counted twice.
fn cuts(sorted: &[f64], distinct: &[f64], count: usize) -> Vec<f64> {
    let mut ends = std::vec![sorted[0]];
    for k in 1..count {
        let at = sorted[k * (sorted.len() - 1) / count];
        let above = distinct.partition_point(|value| *value <= at);
        let above = above.clamp(1, distinct.len() - 1);
        ends.push(0.5 * (distinct[above - 1] + distinct[above]));
    }
    ends.push(sorted[sorted.len() - 1]);
    ends.dedup();
    ends
}

/// Returns the result for the rows of a condition.
fn report(
    rows: &[Scored],
    [from, to]: [f64; 2],
    r2: f64,
    epsilon: f64,
    confidence: f64,
) -> InflationReport {
    let mine: Vec<(usize, f64)> = rows
        .iter()
        .enumerate()
        .filter(|(_, row)| (from..=to).contains(&row.condition))
        .map(|(index, row)| (index, row.squared_distance / r2))
        .collect();
    let factors: Vec<f64> = mine.iter().map(|(_, factor)| *factor).collect();
    let n = factors.len() as u64;
    let needed = order_statistic(&factors, conformal_rank(n, epsilon).unwrap_or(n)).unwrap_or(0.0);
    let independent = independent(rows, &mine, needed);
    // The score interval for a share: dependent rows are not a binomial sample with any whole number of trials.
    let margin = normal_quantile(confidence)
        * libm::sqrt(epsilon * (1.0 - epsilon) / (independent as f64).max(1.0));
    let nth = |share: f64| libm::ceil(share * n as f64 - 1e-9) as u64;
    // At least the rank that the same number of independent rows would need, which is larger near epsilon = 1.
    let floor = rank(independent, epsilon, confidence);
    let floor = floor.map(|k| k as f64 / independent as f64);
    let upper = floor
        .filter(|_| epsilon + margin <= 1.0)
        .map(|floor| nth(floor.max(epsilon + margin)))
        .zip(conformal_rank(n, epsilon))
        .map(|(k, least)| k.max(least));
    let lower = (epsilon > margin).then(|| nth(epsilon - margin));
    let at = |k: Option<u64>| k.and_then(|k| order_statistic(&factors, k));
    let inflation = at(upper).map_or(0.0, |factor| {
        let factor = (libm::ceil(factor * 1e6) / 1e6).max(1.0);
        Inflation::new(factor).map_or(0.0, |_| factor)
    });
    let held = factors.iter().filter(|factor| **factor <= 1.0).count();
    InflationReport {
        from,
        to,
        rows: n,
        independent_rows: independent,
        held: held as f64 / n.max(1) as f64,
        needed,
        low: at(lower).unwrap_or(0.0),
        inflation,
    }
}

/// Returns the quantile of the standard normal distribution.
fn normal_quantile(probability: f64) -> f64 {
    let (mut low, mut high) = (-10.0, 10.0);
    for _ in 0..80 {
        let middle = 0.5 * (low + high);
        if 0.5 * libm::erfc(-middle * core::f64::consts::FRAC_1_SQRT_2) < probability {
            low = middle;
        } else {
            high = middle;
        }
    }
    high
}

/// Returns the number of independent rows that would tell the share of rows beyond a factor as exactly. It is the
/// number of rows divided by a variance ratio: that of sums over blocks of consecutive rows to that of independent
/// rows, for the block length with the largest ratio.
fn independent(rows: &[Scored], mine: &[(usize, f64)], factor: f64) -> u64 {
    let n = mine.len() as f64;
    let beyond = mine.iter().filter(|(_, score)| *score >= factor).count() as f64;
    let share = beyond / n;
    if mine.is_empty() || share >= 1.0 {
        return mine.len() as u64;
    }
    let mut effect = 1.0f64;
    let lengths = core::iter::successors(Some(1usize), |length| length.checked_mul(2));
    for length in lengths.take_while(|length| *length < 2 * rows.len()) {
        let (mut blocks, mut sum) = (0usize, 0.0);
        let (mut last, mut off) = (None, 0.0);
        for (index, score) in mine {
            let block = (rows[*index].run, index / length);
            if last != Some(block) {
                sum += off * off;
                off = 0.0;
                blocks += 1;
                last = Some(block);
            }
            off += f64::from(u8::from(*score >= factor)) - share;
        }
        sum += off * off;
        if blocks < FEWEST_BLOCKS {
            break;
        }
        let spread = sum * blocks as f64 / (blocks - 1) as f64;
        effect = effect.max(spread / (n * share * (1.0 - share)));
    }
    libm::floor(n / effect) as u64
}

impl InflationModel {
    /// Reads a model from the text of its file; errors name it `file`.
    ///
    /// # Errors
    /// The text is not a model of this kind: another version, an unknown or a missing key, or parts that do not match.
    pub fn parse(text: &str, file: &str) -> Result<Self, LearnError> {
        Self::new(super::kind::of(text, file)?, file)
    }

    /// Returns the text of its file.
    ///
    /// # Errors
    /// [`LearnError::Unwritten`], which does not happen for a model that was learnt or read.
    pub fn write(&self) -> Result<String, LearnError> {
        super::kind::write(&self.document)
    }

    fn new(document: Document, file: &str) -> Result<Self, LearnError> {
        let wrong = |what: String| LearnError::Model {
            file: file.to_owned(),
            what,
        };
        if document.posegate_model != VERSION || document.kind != "inflation" {
            return Err(wrong("it is no model of inflation of version 1".into()));
        }
        for share in [document.epsilon, document.confidence] {
            if !(share > 0.0 && share < 1.0) {
                return Err(wrong(
                    "`epsilon` and `confidence` are above 0 and below 1".into(),
                ));
            }
        }
        let taken = |factor: f64| factor == 0.0 || Inflation::new(factor).is_some();
        let parts = document
            .part
            .iter()
            .chain(core::iter::once(&document.overall));
        for (number, part) in parts.enumerate() {
            if !(part.from <= part.to) || !taken(part.inflation) {
                return Err(wrong(format!(
                    "part {number} has `from` above `to`, or an `inflation` that a gate does not take (1 to 4096, or 0 for none)"
                )));
            }
        }
        let joined = |pair: &[InflationReport]| pair[0].to == pair[1].from;
        if document.part.is_empty() || !document.part.windows(2).all(joined) {
            return Err(wrong("its parts do not join".into()));
        }
        Ok(Self { document })
    }

    /// Returns the column of the condition; `log_det` for the logarithm of the covariance's determinant.
    #[must_use]
    pub fn condition(&self) -> &str {
        &self.document.condition
    }

    /// Returns the confidence of the pose-sets for which it was learnt.
    #[must_use]
    pub fn epsilon(&self) -> f64 {
        self.document.epsilon
    }

    /// Returns the factor for the covariance of an estimate under a condition: at least 1. At the end between two
    /// conditions the larger factor, and the largest of all if the condition is unknown. `None` outside of the
    /// conditions in the data, if there were too few rows, and for NaN.
    #[must_use]
    pub fn inflation(&self, condition: Option<f64>) -> Option<f64> {
        let holds = |part: &&InflationReport| {
            condition.is_none_or(|value| (part.from..=part.to).contains(&value))
        };
        let parts = self.document.part.iter().filter(holds);
        let overall = condition.is_none().then_some(&self.document.overall);
        let mut largest: Option<f64> = None;
        for part in parts.chain(overall) {
            if part.inflation == 0.0 {
                return None;
            }
            largest = Some(largest.map_or(part.inflation, |f| f.max(part.inflation)));
        }
        largest
    }

    /// Returns the result for all rows.
    #[must_use]
    pub fn overall(&self) -> &InflationReport {
        &self.document.overall
    }

    /// Returns the results for each condition, ascending.
    #[must_use]
    pub fn parts(&self) -> &[InflationReport] {
        &self.document.part
    }

    /// Returns the numbers of rows used, and of rows with an impossible covariance.
    #[must_use]
    pub fn counts(&self) -> (u64, u64) {
        (self.document.data.rows, self.document.data.impossible)
    }
}
