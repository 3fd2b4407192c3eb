//! Learns bounds on errors from detections: a shape is fitted to one part of them and calibrated, region by region,
//! on the other part.

use super::LearnError;
use super::axis::PARTS;
use super::calibration::Calibration;
use super::cells::{Cells, each, nested};
use super::detections::Detections;
use super::document::{self, Document};
use super::error_model::ErrorModel;
use super::family::{Family, LEAST_RATIO};
use super::runs::{self, Tally};
use super::sample::{FEWEST, FEWEST_RUNS, LEAST_ERROR, Sample};
use super::smooth::{Lattice, Target, capped, errors_around, fit, floored, share_of};
use super::split::{Drawn, FITTED, split};
use super::taken_with::TakenWith;
use posegate_files::printable::hex;

/// The settings for learning bounds.
#[derive(Clone, Debug, PartialEq)]
pub struct BoundsSettings {
    /// The share of the detections for which each of the two bounds shall hold, above 0 and below 1.
    pub quantile: f64,
    /// The probability, over the random choice of calibration data, that a bound holds for this share in a region;
    /// above 0 and below 1.
    pub confidence: f64,
    /// The seed for splitting the detections.
    pub seed: u64,
    /// The camera and the tags of the detections, if known.
    pub taken_with: Option<TakenWith>,
}

impl Default for BoundsSettings {
    fn default() -> Self {
        Self {
            quantile: 0.95,
            confidence: 0.95,
            seed: 1,
            taken_with: None,
        }
    }
}

/// A coarse cell gets this many times the fewest rows for a bound.
const ROOMY: f64 = 3.0;
/// The fewest rows of a coarse cell for which its parts are filled.
const FULL: f64 = 100.0;
/// The number of coarse cells of the shape with which the dependence within runs is measured.
const COARSE: f64 = 8.0;
/// The fewest rows of a cell for the share of detected views.
const FEWEST_VIEWS: f64 = 40.0;
/// Intermediate quantiles before the requested one. A level is used only if at least `APART` times more rows are
/// beyond it than beyond the requested one.
const LEVELS: [f64; 3] = [0.7, 0.9, 0.97];
const APART: f64 = 1.8;
/// The ratio of the odds of an error beyond a shape to those beyond the next one.
const STEP: f64 = 3.0;
/// The fewest rows beyond the widest shape. With fewer, there is one shape, and the corners have no upper limits.
const FEWEST_BEYOND: f64 = 10.0;
/// Weight of the slope penalty relative to the bend penalty, in the fit of the differences between means and
/// quantiles.
const SLOPE: f64 = 0.02;
/// The smallest psi at which a mirrored solution is recognised, degrees.
const HEAD_ON: f64 = 10.0;

/// Learns bounds and the share of detected views.
///
/// # Errors
/// [`LearnError::Share`] if a setting is not in (0, 1); [`LearnError::TooFew`], [`LearnError::TooFewRuns`] or
/// [`LearnError::Nowhere`] if no cell gets a bound.
pub fn learn_bounds(
    detections: &Detections,
    settings: &BoundsSettings,
) -> Result<ErrorModel, LearnError> {
    settings.check()?;
    let learner = Learner::new(detections, settings);
    learner.check_counts()?;
    let quantile = settings.quantile;
    let Learner { seen, places, .. } = &learner;
    let in_runs = learner.runs.is_some();
    let each_cell = (ROOMY * quantile / (1.0 - quantile)).max(FULL);
    let effect = if in_runs {
        design_effect(seen, places, quantile)
    } else {
        1.0
    };
    let cells = Cells::fine_over(places, each_cell * effect).ok_or_else(|| learner.too_few(0))?;
    let [fitted, calibrated] = [true, false].map(|side| samples(seen, &cells, side));
    if (fitted.len() as f64) < FEWEST * effect {
        return Err(learner.too_few(learner.independent(effect)));
    }
    let steps = steps(quantile, fitted.len() as f64 / effect);
    let shapes = [0, 1].map(|which| shapes(&cells, &fitted, which, &steps, in_runs));
    let [Some(translation), Some(yaw)] = [0, 1].map(|which| Family::new(&shapes[which])) else {
        return Err(learner.too_few(0));
    };
    let given = [quantile, settings.confidence];
    let mut learnt = Calibration::new(&cells, given, places, in_runs);
    learnt.run(&fitted, &calibrated, &[translation, yaw], effect);
    if !learnt.has_bounds() {
        return Err(learner.no_bounds(&learnt, effect));
    }
    let data = learner.data([fitted.len(), calibrated.len()], learnt.effect());
    let document = learner.document(&cells, &shapes, data, learnt);
    ErrorModel::new(document, "the learnt model")
}

impl BoundsSettings {
    /// Checks the settings.
    fn check(&self) -> Result<(), LearnError> {
        if let Some(what) = self.taken_with.as_ref().and_then(TakenWith::fault) {
            return Err(LearnError::TakenWith { what });
        }
        for (name, value) in [("quantile", self.quantile), ("confidence", self.confidence)] {
            if !(value > 0.0 && value < 1.0) {
                return Err(LearnError::Share { name, value });
            }
        }
        Ok(())
    }
}

/// The detections from which bounds are learnt.
struct Learner<'d> {
    detections: &'d Detections,
    settings: &'d BoundsSettings,
    /// All views.
    rows: Vec<Drawn>,
    /// The detected ones, and their places.
    seen: Vec<Drawn>,
    places: Vec<[f64; 3]>,
    /// The number of runs, if rows depend on each other.
    runs: Option<usize>,
}

impl<'d> Learner<'d> {
    /// Splits the detections.
    fn new(detections: &'d Detections, settings: &'d BoundsSettings) -> Self {
        let rows = split(detections, settings.seed);
        let seen = rows.iter().filter(|drawn| drawn.row.errors.is_some());
        let seen: Vec<Drawn> = seen.copied().collect();
        Self {
            detections,
            settings,
            places: seen.iter().map(|drawn| drawn.row.at).collect(),
            rows,
            seen,
            runs: detections.runs.count(),
        }
    }

    /// Returns the error for too few detections.
    fn too_few(&self, found: u64) -> LearnError {
        let BoundsSettings {
            quantile,
            confidence,
            ..
        } = *self.settings;
        LearnError::TooFew {
            found,
            of: match self.runs {
                None => "detections",
                Some(_) => "detections that are independent of each other",
            },
            needed: (libm::ceil(libm::log(1.0 - confidence) / libm::log(quantile)) / (1.0 - FITTED)
                + 1.0) as u64,
        }
    }

    /// Refuses data without a detection, or with too few runs.
    fn check_counts(&self) -> Result<(), LearnError> {
        if self.places.is_empty() {
            return Err(self.too_few(0));
        }
        match self.runs {
            Some(found) if (found as f64) * (1.0 - FITTED) < FEWEST_RUNS => {
                Err(LearnError::TooFewRuns {
                    found: found as u64,
                    needed: libm::ceil(FEWEST_RUNS / (1.0 - FITTED)) as u64,
                })
            }
            _ => Ok(()),
        }
    }

    /// Returns the number of independent detections for a design effect.
    fn independent(&self, effect: f64) -> u64 {
        (self.seen.len() as f64 / effect) as u64
    }

    /// Returns the error for a calibration in which no cell has a bound.
    fn no_bounds(&self, learnt: &Calibration<'_>, effect: f64) -> LearnError {
        match self.too_few(self.independent(effect)) {
            LearnError::TooFew { found, needed, .. } if found >= needed => LearnError::Nowhere {
                found: self.seen.len() as u64,
                why: learnt.reasons(),
            },
            error => error,
        }
    }

    /// Returns the description of the data, with the numbers of fitted and calibrated detections, and the design
    /// effect.
    fn data(&self, [fitted, calibrated]: [usize; 2], effect: f64) -> document::Data {
        let Self {
            detections, rows, ..
        } = self;
        let oblique = self.seen.iter().filter(|drawn| drawn.row.at[2] >= HEAD_ON);
        let flips = oblique
            .clone()
            .filter(|drawn| {
                let errors = drawn.row.errors.unwrap_or_default();
                errors[1].to_degrees() > drawn.row.at[2]
            })
            .count();
        document::Data {
            sha256: hex(&detections.sha256),
            views: rows.len() as u64,
            drawn_of: detections.drawn_of,
            detections: self.seen.len() as u64,
            fitted: fitted as u64,
            calibrated: calibrated as u64,
            flips: flips as u64,
            flip_share: flips as f64 / oblique.count().max(1) as f64,
            of_better_pose: detections.of_better_pose,
            runs: self.runs.map(|runs| runs as u64),
            independent: self
                .runs
                .map(|_| libm::floor(rows.len() as f64 / effect) as u64),
        }
    }

    /// Returns the model's file.
    fn document(
        &self,
        cells: &Cells,
        shapes: &[Vec<Vec<f64>>; 2],
        data: document::Data,
        learnt: Calibration<'_>,
    ) -> Document {
        let shape_of = |step: usize| document::Shape {
            translation_m: nested(cells, &shapes[0][step]),
            yaw_rad: nested(cells, &shapes[1][step]),
        };
        let (narrower, shape, wider) = match shapes[0].len() {
            1 => (None, shape_of(0), None),
            _ => (Some(shape_of(0)), shape_of(1), Some(shape_of(2))),
        };
        Document {
            posegate_model: document::VERSION,
            kind: "bounds".into(),
            quantile: self.settings.quantile,
            confidence: self.settings.confidence,
            seed: self.settings.seed,
            parts: (cells.parts != PARTS).then_some(cells.parts),
            taken_with: self.settings.taken_with.clone(),
            data,
            edges: cells.edges(),
            narrower,
            shape,
            wider,
            cell: learnt.cells(),
            region: learnt.regions,
            p_detect: share(&self.rows, self.runs.is_some()),
        }
    }
}

/// Returns the detections of one side of the split, within the cells.
fn samples(seen: &[Drawn], cells: &Cells, fitted: bool) -> Vec<Sample> {
    let mine = seen.iter().filter(|drawn| drawn.fitted == fitted);
    mine.filter(|drawn| cells.cell(drawn.row.at).is_some())
        .filter_map(|drawn| {
            Some(Sample {
                at: drawn.row.at,
                errors: drawn.row.errors?,
                run: drawn.run,
            })
        })
        .collect()
}

/// Returns the design effect of runs, from the detections to which a coarse shape is fitted: the largest design
/// effect of both errors, beyond their median and beyond the quantile.
fn design_effect(seen: &[Drawn], places: &[[f64; 3]], quantile: f64) -> f64 {
    let Some(cells) = Cells::over(places, (places.len() as f64 / COARSE).max(FULL)) else {
        return 1.0;
    };
    let fitted = samples(seen, &cells, true);
    let lattice = Lattice::over(&cells.axes);
    let mut effect = 1.0f64;
    for which in [0, 1] {
        let logs: Vec<f64> = shapes(&cells, &fitted, which, &[0.5], true)[0]
            .iter()
            .map(|value| libm::log(*value))
            .collect();
        let scores: Vec<f64> = fitted
            .iter()
            .filter_map(|sample| {
                let spot = cells.spot(&lattice, sample.at)?;
                Some(libm::log(sample.errors[which].max(LEAST_ERROR)) - spot.value(&logs))
            })
            .collect();
        let runs: Vec<u32> = fitted.iter().map(|sample| sample.run).collect();
        effect = effect.max(runs::effect(&scores, &runs, quantile));
    }
    effect
}

/// Returns the shares of the errors for which shapes are fitted: the requested one, and, if there are enough
/// independent rows, those with [`STEP`] times larger and smaller odds of an error beyond the shape.
fn steps(quantile: f64, independent: f64) -> Vec<f64> {
    let odds = quantile / (1.0 - quantile);
    let share = |odds: f64| odds / (1.0 + odds);
    let wider = share(odds * STEP);
    if independent * (1.0 - wider) < FEWEST_BEYOND {
        return std::vec![quantile];
    }
    std::vec![share(odds / STEP), quantile, wider]
}

/// Returns quantiles of one of the errors at the corners of the cells, with four digits. They ascend, do not decrease
/// with d, and are above the quantile before.
fn shapes(
    cells: &Cells,
    fitted: &[Sample],
    which: usize,
    quantiles: &[f64],
    in_runs: bool,
) -> Vec<Vec<f64>> {
    let lattice = Lattice::over(&cells.axes);
    let spots: Vec<_> = fitted
        .iter()
        .filter_map(|sample| cells.spot(&lattice, sample.at))
        .collect();
    let logs: Vec<f64> = fitted
        .iter()
        .map(|sample| libm::log(sample.errors[which].max(LEAST_ERROR)))
        .collect();
    let folds = folds(fitted.iter().map(|sample| sample.run), in_runs);
    // First fits the mean, for which many rows give information. Then fits the differences from quantile to quantile,
    // for which fewer rows do.
    let mut values = fit(&lattice, Target::Mean, 0.0, &spots, &logs, &folds);
    let mut shapes: Vec<Vec<f64>> = Vec::new();
    let around = errors_around(lattice.len(), &spots, &logs);
    let below = LEVELS
        .iter()
        .filter(|level| 1.0 - **level >= APART * (1.0 - quantiles[0]));
    let [a, b, c] = cells.fine().map(|count| count + 1);
    for (wanted, level) in below
        .map(|level| (false, *level))
        .chain(quantiles.iter().map(|level| (true, *level)))
    {
        let beyond: Vec<f64> = spots
            .iter()
            .zip(&logs)
            .map(|(spot, log)| log - spot.value(&values))
            .collect();
        let above = fit(
            &lattice,
            Target::Quantile(level),
            SLOPE,
            &spots,
            &beyond,
            &folds,
        );
        for (value, above) in values.iter_mut().zip(&above) {
            *value += above;
        }
        if !wanted {
            continue;
        }
        let mut logs = floored(&values, &spots);
        if quantiles.len() > 1 {
            logs = capped(&logs, &around, level);
        }
        for [i, j, k] in each([a - 1, b, c]) {
            let nearer = logs[lattice.corner([i, j, k])];
            let farther = &mut logs[lattice.corner([i + 1, j, k])];
            *farther = farther.max(nearer);
        }
        let mut shape: Vec<f64> = logs.iter().map(|log| digits(libm::exp(*log))).collect();
        if let Some(before) = shapes.last() {
            for (value, before) in shape.iter_mut().zip(before) {
                *value = value.max(digits(before * (2.0 * LEAST_RATIO - 1.0)));
            }
        }
        shapes.push(shape);
    }
    shapes
}

/// Returns the fold of each row for cross-validation: dependent rows are in the same fold.
fn folds(runs: impl Iterator<Item = u32>, in_runs: bool) -> Vec<usize> {
    runs.enumerate()
        .map(|(index, run)| if in_runs { run as usize } else { index })
        .collect()
}

/// Rounds a number above 0 to four digits.
fn digits(number: f64) -> f64 {
    let unit = libm::pow(10.0, 3.0 - libm::floor(libm::log10(number)));
    libm::round(number * unit) / unit
}

/// Returns the share of detected views.
fn share(rows: &[Drawn], in_runs: bool) -> document::Share {
    let places: Vec<[f64; 3]> = rows.iter().map(|drawn| drawn.row.at).collect();
    let Some(cells) = Cells::over(&places, ROOMY * FEWEST_VIEWS) else {
        return document::Share::default();
    };
    let lattice = Lattice::over(&cells.axes);
    let (mut spots, mut hits, mut runs) = (Vec::new(), Vec::new(), Vec::new());
    let mut each: Vec<Vec<(u32, bool)>> = std::vec![Vec::new(); cells.coarse().iter().product()];
    for drawn in rows {
        let at = drawn.row.at;
        let (Some(cell), Some(spot)) = (cells.cell(at), cells.spot(&lattice, at)) else {
            continue;
        };
        let hit = drawn.row.errors.is_some();
        each[cells.number(cells.coarse_of(cell))].push((drawn.run, hit));
        spots.push(spot);
        hits.push(f64::from(u8::from(hit)));
        runs.push(drawn.run);
    }
    let folds = folds(runs.into_iter(), in_runs);
    let logits = fit(&lattice, Target::Share, 0.0, &spots, &hits, &folds);
    let shares: Vec<f64> = logits
        .iter()
        .map(|logit| libm::round(share_of(*logit) * 1e6) / 1e6)
        .map(|share| share.clamp(1e-6, 1.0 - 1e-6))
        .collect();
    let independent = |views: &Vec<(u32, bool)>| {
        let tally = Tally::of(views.iter().copied());
        libm::floor(tally.independent(0.95)) as u64
    };
    document::Share {
        edges: cells.edges(),
        share: nested(&cells, &shares),
        views: each.iter().map(|views| views.len() as u64).collect(),
        detected: each
            .iter()
            .map(|views| views.iter().filter(|(_, hit)| *hit).count() as u64)
            .collect(),
        independent: if in_runs {
            each.iter().map(independent).collect()
        } else {
            Vec::new()
        },
    }
}
