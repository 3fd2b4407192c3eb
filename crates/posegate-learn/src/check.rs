//! Tests whether a learnt error model is valid on new data, by bets that may be evaluated after every row.

use super::LearnError;
use super::detections::Detections;
use super::error_model::{ErrorModel, RegionReport};
use super::runs::RunSource;
use std::collections::BTreeMap;

/// The settings of a check.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CheckSettings {
    /// The probability that a valid model is ever contradicted is at most 1 - `confidence`, for any number of rows;
    /// above 0 and below 1.
    pub confidence: f64,
}

impl Default for CheckSettings {
    fn default() -> Self {
        Self { confidence: 0.95 }
    }
}

/// A row with errors: its number from 1, its region, its d, phi and psi, its errors, and their bounds.
type RowErrors = (u64, usize, [f64; 3], [f64; 2], [f64; 2]);

/// The kind of change that explains the errors since a change best.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Change {
    /// All errors are larger by a common factor: noise, blur, a smaller tag, worse light.
    Scale,
    /// The position's error is the same at every place: a tag or a camera is displaced.
    Offset,
    /// The yaw's error is the same at every place, or the position's is proportional to the distance: the calibration's
    /// image centre or focal length is off, or the camera or the tag is turned.
    Calibration,
}

impl Change {
    /// Returns the change's name: `scale`, `offset` or `calibration`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Scale => "scale",
            Self::Offset => "offset",
            Self::Calibration => "calibration",
        }
    }
}

/// The result for one bound.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BoundCheck {
    /// The share of the errors within the bound.
    pub held: f64,
    /// The largest value of the bet against the bound.
    pub e_value: f64,
    /// The number of rows after which this bet alone contradicts the bound; `None` if it does not.
    pub after_rows: Option<u64>,
    /// The row at which a change is most likely, from 1; `None` if the bet never won.
    pub since_row: Option<u64>,
}

/// The result for a region, or for all regions together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RegionCheck {
    /// The ends of d (m), phi and psi (degrees): see [`Detection::at`](super::Detection::at).
    pub ends: [[f64; 2]; 3],
    /// New detections in the region.
    pub rows: u64,
    /// The bound on the position.
    pub translation: BoundCheck,
    /// The bound on the yaw.
    pub yaw: BoundCheck,
    /// The kind of change; `None` if neither bound of the region is contradicted.
    pub looks_like: Option<Change>,
}

/// The result for the share of detected views.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DetectionCheck {
    /// New views in cells with enough views.
    pub views: u64,
    /// Views in which the tag was detected.
    pub detected: u64,
    /// The mean share that the model expects for these views.
    pub expected: f64,
    /// The largest value of the bet against the expected share.
    pub e_value: f64,
    /// The number of rows after which the share is contradicted; `None` if it is not.
    pub after_rows: Option<u64>,
}

/// The result of a check.
#[derive(Clone, Debug, PartialEq)]
pub struct CheckReport {
    /// The number of rows after which the model was contradicted; `None` if it was not.
    pub after_rows: Option<u64>,
    /// Number of new rows.
    pub rows: u64,
    /// Rows that are independent of each other, or runs: the number of bets.
    pub bets: u64,
    /// Detections for whose place the model has no bounds.
    pub without_bounds: u64,
    /// All regions together.
    pub overall: RegionCheck,
    /// The result of each region.
    pub regions: Vec<RegionCheck>,
    /// The share of detected views.
    pub detection: DetectionCheck,
}

/// The shares of the wealth that bets stake. The best stake against a share p, if m is allowed, is (p - m) / (1 - m)
/// (Kelly): small stakes find a bound at 0.99 that is valid for 0.985.
const STAKES: [f64; 9] = [0.004, 0.01, 0.03, 0.08, 0.15, 0.25, 0.4, 0.6, 0.85];
/// The stake of the sum whose minimum dates a change.
const DATED: f64 = 0.35;
/// The share of the false alarms for detection: one half for the limits of the shares, one half for the bet.
const FOR_DETECTION: f64 = 0.25;
/// The share of the bounds' false alarms for all regions together.
const FOR_OVERALL: f64 = 0.5;

/// A change of another kind than scale must have a spread that is smaller by this factor.
const CLEARLY: f64 = 0.85;

/// A bet against "a share of at most m is missed". It starts at 1. It is a mean over stakes and over the row at which
/// it starts: a late change is found nearly as early as a change at the start.
#[derive(Clone, Debug)]
struct Bet {
    wealth: [f64; STAKES.len()],
    steps: f64,
    dated: f64,
    least: f64,
    since_row: u64,
    most: f64,
}

impl Default for Bet {
    fn default() -> Self {
        Self {
            wealth: [0.0; STAKES.len()],
            steps: 0.0,
            dated: 0.0,
            least: 0.0,
            since_row: 0,
            most: 1.0,
        }
    }
}

impl Bet {
    /// Bets on a share `missed`, of which at most `allowed` is expected; returns the value of the bet. `first` is the
    /// first row of this step.
    fn step(&mut self, missed: f64, allowed: f64, first: u64) -> f64 {
        // At step k, the part 1 / (k + 1) (k + 2) of the wealth that has not been staked starts to be staked.
        let start = 1.0 / ((self.steps + 1.0) * (self.steps + 2.0));
        self.steps += 1.0;
        let factor = |stake: f64| 1.0 + stake * (missed / allowed - 1.0);
        let mut sum = 0.0;
        for (wealth, stake) in self.wealth.iter_mut().zip(STAKES) {
            *wealth = ((*wealth + start) * factor(stake)).min(1e200);
            sum += *wealth;
        }
        if self.dated <= self.least {
            self.least = self.dated;
            self.since_row = first;
        }
        self.dated += libm::log(factor(DATED));
        let value = sum / STAKES.len() as f64 + 1.0 / (self.steps + 1.0);
        self.most = self.most.max(value);
        value
    }

    fn since(&self) -> Option<u64> {
        (self.dated > self.least).then_some(self.since_row)
    }
}

/// A bet against a bound of a region, or of all.
#[derive(Clone, Debug)]
struct BoundBet {
    /// Against the share that the model states.
    stated: Bet,
    /// Against the share on the calibration data.
    calibrated: Bet,
    rows: u64,
    held: u64,
    value: f64,
    most: f64,
    after_rows: Option<u64>,
}

impl Default for BoundBet {
    fn default() -> Self {
        Self {
            stated: Bet::default(),
            calibrated: Bet::default(),
            rows: 0,
            held: 0,
            value: 1.0,
            most: 1.0,
            after_rows: None,
        }
    }
}

impl BoundBet {
    /// The smaller one of two bets. It is valid if the model's bounds are valid for the stated share. It is also
    /// valid if the new rows are distributed like the calibration data, for which the stated share is reached only
    /// with some confidence.
    fn step(&mut self, missed: f64, allowed: [f64; 2], rows: [u64; 2], weight: f64, limit: f64) {
        let stated = self.stated.step(missed, allowed[0], rows[0]);
        let calibrated = self.calibrated.step(missed, allowed[1], rows[0]);
        self.value = stated.min(calibrated);
        self.most = self.most.max(self.value);
        if self.value * weight >= limit && self.after_rows.is_none() {
            self.after_rows = Some(rows[1]);
        }
    }

    fn report(&self) -> BoundCheck {
        BoundCheck {
            held: if self.rows == 0 {
                1.0
            } else {
                self.held as f64 / self.rows as f64
            },
            e_value: self.most,
            after_rows: self.after_rows,
            since_row: self.stated.since(),
        }
    }
}

/// The expected misses according to a region's calibration: those of a Polya urn, which is exact for the next row if
/// it is exchangeable with the calibration data and the rows before.
#[derive(Clone, Copy, Debug)]
struct Urn {
    missed: f64,
    all: f64,
    /// Each row counts as 1 / `effect`.
    effect: f64,
}

impl Urn {
    /// Returns the urn of a region's calibration.
    fn of(region: &RegionReport) -> Self {
        let (n, independent) = (region.detections as f64, region.independent as f64);
        let kept = region.rank as f64 * independent / n.max(1.0);
        Self {
            missed: independent + 1.0 - kept,
            all: independent + 1.0,
            effect: (n / independent.max(1.0)).max(1.0),
        }
    }

    fn share(&self) -> f64 {
        self.missed / self.all
    }

    fn add(&mut self, missed: f64, rows: f64) {
        self.missed += missed / self.effect;
        self.all += rows / self.effect;
    }
}

/// The rows of one bet, region by region: rows, and misses of both bounds.
#[derive(Clone, Debug, Default)]
struct Batch {
    first: u64,
    last: u64,
    regions: BTreeMap<usize, [f64; 3]>,
    views: Vec<View>,
}

/// A view in a cell whose share of detected views is tested.
#[derive(Clone, Copy, Debug)]
struct View {
    detected: bool,
    /// The share that the model expects, and its lower limit.
    expected: f64,
    least: f64,
}

/// Tests whether a model's bounds, and its shares of detected views, are valid on new rows. Each row is a bet, in the
/// order of time if the rows have times, else of the file. With runs, each run is one bet, at its last row. Rows at
/// video rate without names of runs are thinned to the distance between runs.
///
/// # Errors
/// [`LearnError::Share`] if the confidence is not in (0, 1); [`LearnError::Poses`] if the rows have the errors of one
/// pose and the model those of the better one of two, or vice versa.
pub fn check_bounds(
    model: &ErrorModel,
    new: &Detections,
    settings: &CheckSettings,
) -> Result<CheckReport, LearnError> {
    let alpha = 1.0 - settings.confidence;
    if !(alpha > 0.0 && alpha < 1.0) {
        return Err(LearnError::Share {
            name: "confidence",
            value: settings.confidence,
        });
    }
    check_poses(model, new)?;
    let mut bets = ModelBets::new(model, alpha);
    let order = order(new);
    let batches = batches(model, new, &order, alpha * FOR_DETECTION / 2.0);
    for batch in &batches {
        bets.step(batch);
    }
    let (errors, without_bounds) = bets.count(new, &order);
    Ok(CheckReport {
        after_rows: bets.after_rows,
        rows: new.rows.len() as u64,
        bets: batches.len() as u64,
        without_bounds,
        overall: RegionCheck {
            ends: model.reach(),
            rows: errors.len() as u64,
            translation: bets.overall[0].report(),
            yaw: bets.overall[1].report(),
            looks_like: bets
                .after_rows
                .and_then(|_| likely_change(&errors, &bets.overall, None)),
        },
        regions: bets.region_checks(&errors),
        detection: bets.detection.report,
    })
}

/// Refuses rows with the errors of one pose for a model of the better one of two, and vice versa.
fn check_poses(model: &ErrorModel, new: &Detections) -> Result<(), LearnError> {
    let poses = [model.is_of_better_pose(), new.of_better_pose];
    let [of_model, of_rows] = poses.map(|better| {
        if better {
            "the better one of two poses"
        } else {
            "one pose"
        }
    });
    if of_model != of_rows {
        return Err(LearnError::Poses {
            model: of_model,
            rows: of_rows,
        });
    }
    Ok(())
}

/// The bets against a model.
struct ModelBets<'m> {
    model: &'m ErrorModel,
    regions: Vec<RegionReport>,
    /// The value from which bets contradict the model.
    limit: f64,
    /// The weight of a bet against one bound of one region.
    of_region: f64,
    /// The share of misses that the model states.
    stated: f64,
    urns: Vec<[Urn; 2]>,
    bets: Vec<[BoundBet; 2]>,
    overall: [BoundBet; 2],
    detection: DetectionBet,
    /// The number of rows after which the model was contradicted.
    after_rows: Option<u64>,
}

impl<'m> ModelBets<'m> {
    /// Returns the bets before the first row. `alpha` is the probability that a valid model is ever contradicted.
    fn new(model: &'m ErrorModel, alpha: f64) -> Self {
        let regions: Vec<_> = model.regions().collect();
        Self {
            model,
            limit: 1.0 / (alpha * (1.0 - FOR_DETECTION)),
            of_region: (1.0 - FOR_OVERALL) / (2 * regions.len().max(1)) as f64,
            stated: 1.0 - model.quantile(),
            urns: regions.iter().map(|region| [Urn::of(region); 2]).collect(),
            bets: std::vec![Default::default(); regions.len()],
            overall: Default::default(),
            detection: DetectionBet::new(alpha * FOR_DETECTION),
            after_rows: None,
            regions,
        }
    }

    /// Bets on a batch of rows.
    fn step(&mut self, batch: &Batch) {
        let rows = [batch.first, batch.last];
        let (mut missed, mut expected, mut count) = ([0.0; 2], [0.0; 2], 0.0);
        for (region, [n, translation, yaw]) in &batch.regions {
            count += n;
            for (which, misses) in [*translation, *yaw].into_iter().enumerate() {
                let urn = &mut self.urns[*region][which];
                let allowed = urn.share();
                missed[which] += misses;
                expected[which] += n * allowed;
                let bet = &mut self.bets[*region][which];
                let shares = [self.stated, allowed];
                bet.step(misses / n, shares, rows, self.of_region, self.limit);
                urn.add(misses, *n);
            }
        }
        if count > 0.0 {
            for which in [0, 1] {
                let allowed = [self.stated, expected[which] / count];
                let weight = 0.5 * FOR_OVERALL;
                let missed = missed[which] / count;
                self.overall[which].step(missed, allowed, rows, weight, self.limit);
            }
        }
        self.detection.step(&batch.views, batch.last);
        let is_contradicted =
            self.sum() >= self.limit || self.detection.report.after_rows.is_some();
        if self.after_rows.is_none() && is_contradicted {
            self.after_rows = Some(batch.last);
        }
    }

    /// Returns the weighted sum of the bets against bounds.
    fn sum(&self) -> f64 {
        self.bets.iter().flatten().map(|bet| bet.value).sum::<f64>() * self.of_region
            + self.overall.iter().map(|bet| bet.value).sum::<f64>() * 0.5 * FOR_OVERALL
    }

    /// Counts the errors within the bounds, also those of rows without a bet. Returns the rows with errors and bounds,
    /// and the number of detections without bounds.
    fn count(&mut self, new: &Detections, order: &[usize]) -> (Vec<RowErrors>, u64) {
        let mut without_bounds = 0;
        let mut errors: Vec<RowErrors> = Vec::new();
        for (index, row) in order.iter().map(|row| new.rows[*row]).enumerate() {
            let Some(found) = row.errors else { continue };
            let model = self.model;
            let bounds = model.bounds_deg(row.at).zip(model.region_deg(row.at));
            let Some((bounds, region)) = bounds else {
                without_bounds += 1;
                continue;
            };
            let bounds = [bounds.0, bounds.1];
            for which in [0, 1] {
                for bet in [&mut self.bets[region][which], &mut self.overall[which]] {
                    bet.rows += 1;
                    bet.held += u64::from(found[which] <= bounds[which]);
                }
            }
            errors.push((index as u64 + 1, region, row.at, found, bounds));
        }
        (errors, without_bounds)
    }

    /// Returns the result for each region.
    fn region_checks(&self, errors: &[RowErrors]) -> Vec<RegionCheck> {
        let regions = self.regions.iter().zip(&self.bets).enumerate();
        let regions = regions.map(|(number, (region, bets))| {
            let is_contradicted = bets.iter().any(|bet| bet.after_rows.is_some());
            RegionCheck {
                ends: region.ends,
                rows: bets[0].rows,
                translation: bets[0].report(),
                yaw: bets[1].report(),
                looks_like: is_contradicted
                    .then(|| likely_change(errors, bets, Some(number)))
                    .flatten(),
            }
        });
        regions.collect()
    }
}

/// Returns the likely kind of change in a region, or in all, from the rows since the change.
fn likely_change(
    errors: &[RowErrors],
    bets: &[BoundBet; 2],
    region: Option<usize>,
) -> Option<Change> {
    let which = usize::from(bets[1].most > bets[0].most);
    let since = bets[which].stated.since().unwrap_or(1);
    let rows = errors
        .iter()
        .filter(|(row, of, ..)| *row >= since && region.is_none_or(|region| region == *of));
    let rows = rows.map(|(_, _, at, errors, bounds)| (at[0], errors[which], bounds[which]));
    change(&rows.collect::<Vec<_>>(), which)
}

/// A bet against the shares of detected views: each row against the lower limit of its cell's share.
struct DetectionBet {
    bet: Bet,
    limit: f64,
    expected: f64,
    report: DetectionCheck,
}

impl DetectionBet {
    fn new(alpha: f64) -> Self {
        Self {
            bet: Bet::default(),
            limit: 2.0 / alpha,
            expected: 0.0,
            report: DetectionCheck {
                e_value: 1.0,
                ..DetectionCheck::default()
            },
        }
    }

    /// Bets on the views of a batch against the lower limits of their shares.
    fn step(&mut self, views: &[View], row: u64) {
        if views.is_empty() {
            return;
        }
        let n = views.len() as f64;
        let detected = views.iter().filter(|view| view.detected).count();
        let least = views.iter().map(|view| view.least).sum::<f64>() / n;
        let value = self.bet.step(1.0 - detected as f64 / n, 1.0 - least, row);
        self.report.views += views.len() as u64;
        self.report.detected += detected as u64;
        self.expected += views.iter().map(|view| view.expected).sum::<f64>();
        self.report.expected = self.expected / self.report.views as f64;
        self.report.e_value = self.report.e_value.max(value);
        if value >= self.limit && self.report.after_rows.is_none() {
            self.report.after_rows = Some(row);
        }
    }
}

/// Returns the order of the rows: of time if they are independent and have times, else of the file.
fn order(new: &Detections) -> Vec<usize> {
    let mut order: Vec<usize> = (0..new.rows.len()).collect();
    if new.runs.source == RunSource::Independent && new.times.len() == order.len() {
        order.sort_by(|a, b| new.times[*a].total_cmp(&new.times[*b]));
    }
    order
}

/// Returns the bets, in the order of their last rows. `alpha` is the probability that any limit of a share of
/// detected views is wrong.
fn batches(model: &ErrorModel, new: &Detections, order: &[usize], alpha: f64) -> Vec<Batch> {
    let limits = model.detection_limits(alpha);
    let mut batches: Vec<Batch> = Vec::new();
    let mut of_run: BTreeMap<u32, usize> = BTreeMap::new();
    let mut used: BTreeMap<u32, f64> = BTreeMap::new();
    for (index, row) in order.iter().enumerate() {
        let number = index as u64 + 1;
        let run = new.runs.of_row.get(*row).copied().unwrap_or(*row as u32);
        let fresh = Batch {
            first: number,
            ..Batch::default()
        };
        let batch = match new.runs.source {
            RunSource::Column => *of_run.entry(run).or_insert_with(|| {
                batches.push(fresh);
                batches.len() - 1
            }),
            RunSource::Gaps { gap_s, .. } => {
                let now = new.times.get(*row).copied().unwrap_or(0.0);
                if used.get(&run).is_some_and(|last| now - last < gap_s) {
                    continue;
                }
                used.insert(run, now);
                batches.push(fresh);
                batches.len() - 1
            }
            RunSource::Independent => {
                batches.push(fresh);
                batches.len() - 1
            }
        };
        let batch = &mut batches[batch];
        batch.last = number;
        let row = &new.rows[*row];
        if let Some((expected, least)) = model.expected_share(row.at, &limits) {
            batch.views.push(View {
                detected: row.errors.is_some(),
                expected,
                least,
            });
        }
        let found = model.bounds_deg(row.at).zip(model.region_deg(row.at));
        if let (Some(errors), Some((bounds, region))) = (row.errors, found) {
            let counts = batch.regions.entry(region).or_default();
            counts[0] += 1.0;
            counts[1] += f64::from(u8::from(errors[0] > bounds.0));
            counts[2] += f64::from(u8::from(errors[1] > bounds.1));
        }
    }
    batches.sort_by_key(|batch| batch.last);
    batches
}

/// Returns the kind of change whose errors vary least around it: errors in proportion to their bounds, to the
/// distance, or constant. In a narrow region all three are similar; then the result is a scale. Each row has the
/// distance, the error and the bound.
fn change(rows: &[(f64, f64, f64)], which: usize) -> Option<Change> {
    let spread = |of: &dyn Fn(f64, f64) -> f64| -> Option<f64> {
        let mut logs: Vec<f64> = rows
            .iter()
            .map(|(d, error, bound)| libm::log(error.max(1e-9) / of(*d, *bound)))
            .collect();
        logs.sort_by(f64::total_cmp);
        let nth = |share: f64| logs.get((share * logs.len() as f64) as usize);
        Some(nth(0.75)? - nth(0.25)?)
    };
    let constant = if which == 0 {
        Change::Offset
    } else {
        Change::Calibration
    };
    let mut kinds = std::vec![
        (CLEARLY * spread(&|_, bound| bound)?, Change::Scale),
        (spread(&|_, _| 1.0)?, constant),
    ];
    if which == 0 {
        kinds.push((spread(&|d, _| d)?, Change::Calibration));
    }
    kinds.sort_by(|a, b| a.0.total_cmp(&b.0));
    kinds.first().map(|(_, kind)| *kind)
}

#[cfg(test)]
mod tests;
