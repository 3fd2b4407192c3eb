//! The factor by which a source's covariance must grow so that its pose-sets contain the truth as often as stated.

use super::LearnError;
use super::binomial::{conformal_rank, order_statistic, rank};
use super::document::VERSION;
use super::estimates::{LOG_DET, Scored, ScoredEstimates};
use super::groups::{self, GroupReport, for_a_new_group, own_factor};
use super::memory::{FEWEST_BLOCKS, memory};
use super::quantiles::normal_quantile;
use posegate::confidence::radius_squared;
use posegate::set::Inflation;
use posegate_files::printable::hex;
use serde::{Deserialize, Serialize};

/// The most conditions that are distinguished.
const MOST: usize = 6;
/// A condition has this many times the fewest independent rows.
const ROOMY: f64 = 1.5;
/// The fewest independent rows for any result.
const FEWEST: f64 = 10.0;
/// Blocks of rows show the dependence of all rows if the data are at least this many times as long as their memory.
const LONG: f64 = 60.0;
/// If all rows have the same condition, other values within this tolerance count as equal: a difference for the
/// logarithm of a determinant, a share for any other condition.
const EQUAL_WITHIN: f64 = 0.01;

/// The settings for learning factors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InflationSettings {
    /// The share of the estimates whose set must contain the truth, above 0 and below 1.
    pub epsilon: f64,
    /// The probability, over the random choice of data, that the set does so under a condition; above 0 and below 1.
    /// If the estimates are of several groups (robots, runs): the probability, over the choice of groups, that it
    /// does so for a new group.
    pub confidence: f64,
    /// `true` if the factors must be valid for a new group, `false` if only for the groups in the data.
    pub new_group: bool,
}

/// A file of learnt factors by which the covariances of a source are multiplied: one per condition, one overall.
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
    /// The column of the groups, if the factors are valid for a new group; `None` if only for those in the data.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    new: Option<String>,
    data: Data,
    overall: InflationReport,
    part: Vec<InflationReport>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    group: Vec<GroupReport>,
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
            new_group: true,
        }
    }
}

/// The result for a condition.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct InflationReport {
    /// The smallest value of the condition's column, included.
    pub from: f64,
    /// The largest value of the condition's column, included.
    pub to: f64,
    /// Rows with such values.
    pub rows: u64,
    /// The number of independent rows with the same information on the share of sets without the truth. Consecutive
    /// rows are dependent.
    pub independent_rows: u64,
    /// The share of the pose-sets that contained the truth without a factor.
    pub held: f64,
    /// The factor at which the share would have been epsilon among these rows; may be below 1.
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
/// [`LearnError::Share`] if a setting is not in (0, 1); [`LearnError::TooFew`] if there are too few independent rows;
/// [`LearnError::TooFewGroups`] if there are too few groups for a new one.
pub fn learn_inflation(
    estimates: &ScoredEstimates,
    settings: &InflationSettings,
) -> Result<InflationModel, LearnError> {
    let InflationSettings {
        epsilon,
        confidence,
        new_group,
    } = *settings;
    let r2 = settings.radius_squared()?;
    let rows = &estimates.rows;
    let several = estimates.groups.len() >= 2;
    let grouped = new_group && several;
    let scored = Scores {
        rows,
        r2,
        epsilon,
        confidence,
        groups: if grouped { estimates.groups.len() } else { 0 },
    };
    let mut sorted: Vec<f64> = rows.iter().map(|row| row.condition).collect();
    sorted.sort_by(f64::total_cmp);
    let (Some(first), Some(last)) = (sorted.first().copied(), sorted.last().copied()) else {
        return Err(scored.too_few(0, "rows whose covariance is possible"));
    };
    let overall = scored.report([first, last]);
    scored.check_counts(&overall, estimates.grouped_by)?;
    // The tolerance for equal conditions.
    let tolerance = if estimates.condition == LOG_DET {
        EQUAL_WITHIN
    } else {
        EQUAL_WITHIN * libm::fabs(first)
    };
    let document = Document {
        posegate_model: VERSION,
        kind: "inflation".into(),
        epsilon,
        confidence,
        condition: estimates.condition.clone(),
        data: Data {
            sha256: hex(&estimates.sha256),
            rows: rows.len() as u64,
            impossible: estimates.impossible.len() as u64,
        },
        new: grouped.then(|| estimates.grouped_by.to_owned()),
        overall,
        part: scored.parts(&sorted, [first, last], tolerance),
        group: Vec::new(),
    };
    let mut model = InflationModel::new(document, "the learnt model")?;
    if several {
        let factors = Scores {
            groups: estimates.groups.len(),
            ..scored
        };
        model.document.group = factors.reports(&model, &estimates.groups);
    }
    Ok(model)
}

impl InflationSettings {
    /// Checks the settings, and returns the square of the radius of a pose-set.
    fn radius_squared(&self) -> Result<f64, LearnError> {
        if !(self.confidence > 0.0 && self.confidence < 1.0) {
            return Err(LearnError::Share {
                name: "confidence",
                value: self.confidence,
            });
        }
        radius_squared(self.epsilon).ok_or(LearnError::Share {
            name: "epsilon",
            value: self.epsilon,
        })
    }
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

/// The rows, and what is learnt from them.
#[derive(Clone, Copy)]
struct Scores<'a> {
    rows: &'a [Scored],
    r2: f64,
    epsilon: f64,
    confidence: f64,
    /// The number of groups if the factors are valid for a new group, else 0.
    groups: usize,
}

impl Scores<'_> {
    /// Returns the fewest independent rows for a result.
    fn fewest(&self) -> f64 {
        let Self {
            epsilon,
            confidence,
            ..
        } = *self;
        let z = normal_quantile(confidence);
        let all_hold = libm::log(1.0 - confidence) / libm::log(epsilon);
        libm::ceil((z * z * epsilon / (1.0 - epsilon)).max(all_hold)).max(FEWEST)
    }

    /// Returns the error for too few rows of a kind.
    fn too_few(&self, found: u64, of: &'static str) -> LearnError {
        LearnError::TooFew {
            found,
            of,
            needed: self.fewest() as u64,
        }
    }

    /// Refuses too few groups for a new one, or too few independent rows. `overall` is the result for all rows.
    fn check_counts(
        &self,
        overall: &InflationReport,
        grouped_by: &'static str,
    ) -> Result<(), LearnError> {
        if self.groups > 0 {
            let factors = self.own_factors([overall.from, overall.to]);
            if for_a_new_group(&factors, self.confidence).is_none() {
                return Err(LearnError::TooFewGroups {
                    found: factors.iter().filter(|factor| factor.is_finite()).count() as u64,
                    of: grouped_by,
                    confidence: self.confidence,
                    needed: groups::needed(self.confidence),
                    rows: libm::ceil(self.epsilon / (1.0 - self.epsilon) - 1e-9) as u64,
                });
            }
        } else if (overall.independent_rows as f64) < self.fewest() {
            let of = "rows that are independent of each other";
            return Err(self.too_few(overall.independent_rows, of));
        }
        Ok(())
    }

    /// Returns the results for as many conditions as have enough rows. A column with few distinct values keeps one
    /// condition per value. Conditions within the tolerance are equal.
    fn parts(
        &self,
        sorted: &[f64],
        [first, last]: [f64; 2],
        tolerance: f64,
    ) -> Vec<InflationReport> {
        let distinct = distinct(sorted);
        let fewest = self.fewest();
        let are_equal = last - first <= tolerance;
        let enough = |part: &InflationReport| {
            let rows = part.independent_rows as f64 >= ROOMY * fewest;
            rows && (self.groups == 0 || part.inflation > 0.0)
        };
        let mut parts = Vec::new();
        for count in (1..=MOST).rev() {
            let ends = if are_equal {
                std::vec![first - tolerance, last + tolerance]
            } else if distinct.len() > MOST {
                cuts(sorted, &distinct, count)
            } else {
                let between = distinct.windows(2).map(|pair| 0.5 * (pair[0] + pair[1]));
                core::iter::once(first)
                    .chain(between)
                    .chain([last])
                    .collect()
            };
            parts = ends
                .windows(2)
                .map(|pair| self.report([pair[0], pair[1]]))
                .collect();
            if distinct.len() <= MOST || are_equal || parts.iter().all(enough) {
                break;
            }
        }
        parts
    }

    /// Returns the result for the rows of a condition.
    fn report(&self, [from, to]: [f64; 2]) -> InflationReport {
        let Self {
            rows,
            r2,
            epsilon,
            confidence,
            ..
        } = *self;
        let mine: Vec<(usize, f64)> = rows
            .iter()
            .enumerate()
            .filter(|(_, row)| (from..=to).contains(&row.condition))
            .map(|(index, row)| (index, row.squared_distance / r2))
            .collect();
        let factors: Vec<f64> = mine.iter().map(|(_, factor)| *factor).collect();
        let n = factors.len() as u64;
        let needed =
            order_statistic(&factors, conformal_rank(n, epsilon).unwrap_or(n)).unwrap_or(0.0);
        let independent = self.independent(&mine, needed);
        let margin = self.margin(independent);
        let nth = |share: f64| libm::ceil(share * n as f64 - 1e-9) as u64;
        let upper = self.upper_rank(n, independent);
        let lower = (epsilon > margin).then(|| nth(epsilon - margin));
        let at = |k: Option<u64>| k.and_then(|k| order_statistic(&factors, k));
        // A new group needs the factor of the groups, and at least the factor of all data together.
        let needed_factor = if self.groups > 0 {
            for_a_new_group(&self.own_factors([from, to]), confidence)
                .map(|factor| factor.max(at(upper).unwrap_or(0.0)))
        } else {
            at(upper)
        };
        let inflation = needed_factor.map_or(0.0, |factor| {
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

    /// Returns the number of independent rows among `mine`, for the share of rows beyond a factor. Blocks cannot show a dependence
    /// that lasts longer than they do: if there are few runs, and the data are short compared with their memory, each memory
    /// counts as one row. (A factor for a new group relies on the groups instead.)
    fn independent(&self, mine: &[(usize, f64)], factor: f64) -> u64 {
        let (independent, is_short) = independent(self.rows, mine, factor);
        if self.groups > 0 || !is_short {
            return independent;
        }
        let of_runs: Vec<(u32, f64)> = mine
            .iter()
            .map(|(index, score)| (self.rows[*index].run, *score))
            .collect();
        let memories = mine.len() as f64 / memory(&of_runs);
        if memories < LONG {
            independent.min(memories as u64)
        } else {
            independent
        }
    }

    /// Returns the margin of the score interval for a share: dependent rows are not a binomial sample with any whole number
    /// of trials.
    fn margin(&self, independent: u64) -> f64 {
        normal_quantile(self.confidence)
            * libm::sqrt(self.epsilon * (1.0 - self.epsilon) / (independent as f64).max(1.0))
    }

    /// Returns the rank of the factor that is large enough for `n` rows with the confidence; `None` if there are too few.
    fn upper_rank(&self, n: u64, independent: u64) -> Option<u64> {
        let share = self.epsilon + self.margin(independent);
        // At least the rank that the same number of independent rows would need, which is larger near epsilon = 1.
        let floor = rank(independent, self.epsilon, self.confidence)? as f64 / independent as f64;
        if share > 1.0 {
            return None;
        }
        let nth = libm::ceil(floor.max(share) * n as f64 - 1e-9) as u64;
        Some(nth.max(conformal_rank(n, self.epsilon)?))
    }

    /// Returns the factor that each group needs under a condition: with the confidence if it has enough rows, else among
    /// its rows.
    fn own_factors(&self, [from, to]: [f64; 2]) -> Vec<f64> {
        let mut scores: Vec<Vec<(usize, f64)>> = std::vec![Vec::new(); self.groups];
        for (index, row) in self.rows.iter().enumerate() {
            if (from..=to).contains(&row.condition)
                && let Some(scores) = scores.get_mut(row.group as usize)
            {
                scores.push((index, row.squared_distance / self.r2));
            }
        }
        let of_group = |mine: &Vec<(usize, f64)>| {
            let scores: Vec<f64> = mine.iter().map(|(_, score)| *score).collect();
            let least = own_factor(&scores, self.epsilon);
            let (independent, _) = independent(self.rows, mine, least);
            let upper = self.upper_rank(scores.len() as u64, independent);
            let upper = upper.and_then(|rank| order_statistic(&scores, rank));
            upper.map_or(least, |upper| upper.max(least))
        };
        scores.iter().map(of_group).collect()
    }

    /// Returns the coverage of each group by the model, and by the factors that the other groups need.
    fn reports(&self, model: &InflationModel, names: &[String]) -> Vec<GroupReport> {
        let parts = &model.document.part;
        // For each part and group: the factor for a new group, from the others.
        let left_out: Vec<Vec<Option<f64>>> = parts
            .iter()
            .map(|part| {
                let factors = self.own_factors([part.from, part.to]);
                (0..factors.len())
                    .map(|group| {
                        let mut others = factors.clone();
                        others.remove(group);
                        for_a_new_group(&others, self.confidence).map(|factor| factor.max(1.0))
                    })
                    .collect()
            })
            .collect();
        let mut counts = std::vec![[0u64; 3]; names.len()];
        let mut known = std::vec![true; names.len()];
        for row in self.rows {
            let group = row.group as usize;
            let score = row.squared_distance / self.r2;
            let Some(counts) = counts.get_mut(group) else {
                continue;
            };
            counts[0] += 1;
            let factor = model.inflation(Some(row.condition));
            counts[1] += u64::from(factor.is_some_and(|factor| score <= factor));
            // On a border the larger factor applies.
            let others = parts.iter().zip(&left_out);
            let others = others
                .filter(|(part, _)| (part.from..=part.to).contains(&row.condition))
                .map(|(_, factors)| factors[group].unwrap_or(f64::NAN))
                .fold(0.0f64, |a, b| {
                    if a.is_nan() || b.is_nan() {
                        f64::NAN
                    } else {
                        a.max(b)
                    }
                });
            known[group] &= !others.is_nan();
            counts[2] += u64::from(score <= others);
        }
        let share = |count: u64, rows: u64| count as f64 / rows.max(1) as f64;
        names
            .iter()
            .zip(counts)
            .zip(known)
            .map(|((name, [rows, covered, left_out]), known)| GroupReport {
                name: name.clone(),
                rows,
                coverage: share(covered, rows),
                left_out_coverage: known.then(|| share(left_out, rows)),
            })
            .collect()
    }
}

/// Returns the number of independent rows with the same information on the share of rows beyond a factor. It is the
/// number of rows divided by a variance ratio: that of sums over blocks of consecutive rows to that of independent
/// rows, for the block length with the largest ratio. Also returns `true` if longer blocks would be too few.
fn independent(rows: &[Scored], mine: &[(usize, f64)], factor: f64) -> (u64, bool) {
    let n = mine.len() as f64;
    let beyond = mine.iter().filter(|(_, score)| *score >= factor).count() as f64;
    let share = beyond / n;
    if mine.is_empty() || share >= 1.0 {
        return (mine.len() as u64, false);
    }
    let (mut effect, mut is_short) = (1.0f64, false);
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
            is_short = true;
            break;
        }
        let spread = sum * blocks as f64 / (blocks - 1) as f64;
        effect = effect.max(spread / (n * share * (1.0 - share)));
    }
    (libm::floor(n / effect) as u64, is_short)
}

impl InflationModel {
    /// Reads a model from the text of its file; errors name it `file`.
    ///
    /// # Errors
    /// The text is not a model of this kind: another version, an unknown or a missing key, or parts that do not match.
    pub fn parse(text: &str, file: &str) -> Result<Self, LearnError> {
        Self::new(super::model_file::parse(text, file)?, file)
    }

    /// Returns the text of the model's file.
    ///
    /// # Errors
    /// [`LearnError::Unwritten`], which does not happen for a model that was learnt or read.
    pub fn write(&self) -> Result<String, LearnError> {
        super::model_file::write(&self.document)
    }

    fn new(document: Document, file: &str) -> Result<Self, LearnError> {
        let wrong = |what: String| LearnError::Model {
            file: file.to_owned(),
            what,
        };
        if document.posegate_model != VERSION || document.kind != "inflation" {
            return Err(wrong("it is not a model of inflation of version 1".into()));
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

    /// Returns the confidence of the pose-sets for which the model was learnt.
    #[must_use]
    pub fn epsilon(&self) -> f64 {
        self.document.epsilon
    }

    /// Returns the confidence with which the factors are large enough.
    #[must_use]
    pub fn confidence(&self) -> f64 {
        self.document.confidence
    }

    /// Returns the factor, at least 1, for the covariance of an estimate under a condition. At the border of two
    /// conditions the larger factor applies, and the largest of all if the condition is unknown. `None` outside of
    /// the conditions in the data, if there were too few rows, and for NaN.
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

    /// Returns the results for each group (robot, run) of the data; empty if there are fewer than two.
    #[must_use]
    pub fn groups(&self) -> &[GroupReport] {
        &self.document.group
    }

    /// Returns the column of the groups if the factors are valid for a new group: `robot` or `run`.
    #[must_use]
    pub fn new_group(&self) -> Option<&str> {
        self.document.new.as_deref()
    }

    /// Returns the numbers of rows used, and of rows with an impossible covariance.
    #[must_use]
    pub fn counts(&self) -> (u64, u64) {
        (self.document.data.rows, self.document.data.impossible)
    }
}
