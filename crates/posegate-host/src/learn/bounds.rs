//! Learns bounds on errors from detections: a shape is fitted to one part of them and calibrated, region by region,
//! on the other part.

use super::calibration::Calibration;
use super::cells::{Cells, each, nested};
use super::detections::{Detections, hexadecimal};
use super::document::{self, Document};
use super::error_model::ErrorModel;
use super::smooth::{Lattice, Target, fit, floored, share_of};
use super::{Detection, LearnError};

/// The settings for learning bounds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoundsSettings {
    /// The share of the detections for which each of the two bounds shall hold, above 0 and below 1.
    pub quantile: f64,
    /// The probability, over the random choice of calibration data, that a bound holds for this share in a region;
    /// above 0 and below 1.
    pub confidence: f64,
    /// The seed for splitting the detections.
    pub seed: u64,
}

impl Default for BoundsSettings {
    fn default() -> Self {
        Self {
            quantile: 0.95,
            confidence: 0.95,
            seed: 1,
        }
    }
}

/// The share of the detections to which the shape is fitted.
pub(super) const FITTED: f64 = 0.4;
/// The smallest error that is used, metres and radians; smaller ones are replaced by it.
const LEAST_ERROR: f64 = 1e-7;
/// A coarse cell gets this many times the fewest rows for a bound.
const ROOMY: f64 = 3.0;
/// The fewest rows of a coarse cell for which its parts are filled.
const FULL: f64 = 100.0;
/// The fewest rows of a cell with a bound.
pub(super) const FEWEST: f64 = 10.0;
/// The fewest rows of a cell for the share of detected views.
const FEWEST_VIEWS: f64 = 40.0;
/// Intermediate quantiles before the requested one. A level is used only if at least `APART` times more rows lie
/// beyond it than beyond the requested one.
const LEVELS: [f64; 3] = [0.7, 0.9, 0.97];
const APART: f64 = 1.8;
/// Weight of the slope penalty relative to the bend penalty, in the fit of the differences between means and
/// quantiles.
const SLOPE: f64 = 0.02;
/// The smallest psi at which a mirrored solution is recognised, degrees.
const SQUARE_ON: f64 = 10.0;

/// Learns bounds and the share of detected views.
///
/// # Errors
/// [`LearnError::Share`] if a setting is not in (0, 1); [`LearnError::TooFew`] or [`LearnError::Nowhere`] if no cell
/// gets a bound.
pub fn learn_bounds(
    detections: &Detections,
    settings: &BoundsSettings,
) -> Result<ErrorModel, LearnError> {
    let BoundsSettings {
        quantile,
        confidence,
        seed,
    } = *settings;
    for (name, value) in [("quantile", quantile), ("confidence", confidence)] {
        if !(value > 0.0 && value < 1.0) {
            return Err(LearnError::Share { name, value });
        }
    }
    // The order depends only on the rows themselves, not on the file's order.
    let mut rows: Vec<(u64, Detection)> = detections
        .rows
        .iter()
        .map(|row| (drawn(row, seed), *row))
        .collect();
    rows.sort_by(|a, b| a.0.cmp(&b.0).then_with(|| compare(&a.1, &b.1)));
    // Equal rows are split like others: if all were on one side, they would not be independent.
    let mut alike = 0u64;
    let mut last: Option<Detection> = None;
    for (draw, row) in &mut rows {
        let again = last.is_some_and(|last| compare(&last, row).is_eq());
        alike = if again { alike + 1 } else { 0 };
        last = Some(*row);
        if again {
            *draw = mixed(*draw ^ mixed(alike));
        }
    }
    rows.sort_by(|a, b| a.0.cmp(&b.0).then_with(|| compare(&a.1, &b.1)));
    let seen: Vec<(u64, [f64; 3], [f64; 2])> = rows
        .iter()
        .filter_map(|(draw, row)| row.errors.map(|errors| (*draw, row.at, errors)))
        .collect();
    let fewest = quantile / (1.0 - quantile);
    let too_few = |found: usize| LearnError::TooFew {
        found: found as u64,
        of: "detections",
        needed: (libm::ceil(libm::log(1.0 - confidence) / libm::log(quantile)) / (1.0 - FITTED)
            + 1.0) as u64,
    };
    let places: Vec<[f64; 3]> = seen.iter().map(|(_, at, _)| *at).collect();
    let each_cell = (ROOMY * fewest).max(FULL);
    let cells = Cells::over(&places, each_cell).ok_or_else(|| too_few(0))?;

    let (fitted, calibrated): (Vec<_>, Vec<_>) = seen
        .iter()
        .filter(|(_, at, _)| cells.cell(*at).is_some())
        .map(|(draw, at, errors)| (*draw, *at, *errors))
        .partition(|(draw, _, _)| (*draw >> 11) as f64 / (1u64 << 53) as f64 <= FITTED);
    if fitted.len() < FEWEST as usize {
        return Err(too_few(seen.len()));
    }
    let strip = |part: &[(u64, [f64; 3], [f64; 2])]| -> Vec<([f64; 3], [f64; 2])> {
        part.iter().map(|(_, at, errors)| (*at, *errors)).collect()
    };
    let (fitted, calibrated) = (strip(&fitted), strip(&calibrated));
    let shapes = [0, 1].map(|which| shape(&cells, &fitted, which, quantile));
    let mut learnt = Calibration::new(&cells, settings, &places);
    learnt.run(&fitted, &calibrated, &shapes);
    if !learnt.says_something() {
        let error = too_few(seen.len());
        return Err(match error {
            LearnError::TooFew { found, needed, .. } if found >= needed => LearnError::Nowhere {
                found,
                why: learnt.reasons(),
            },
            _ => error,
        });
    }

    let oblique = seen.iter().filter(|(_, at, _)| at[2] >= SQUARE_ON);
    let flips = oblique
        .clone()
        .filter(|(_, at, errors)| errors[1].to_degrees() > at[2])
        .count();
    let document = Document {
        posegate_model: document::VERSION,
        kind: "bounds".into(),
        quantile,
        confidence,
        seed,
        data: document::Data {
            sha256: hexadecimal(&detections.sha256),
            views: rows.len() as u64,
            detections: seen.len() as u64,
            fitted: fitted.len() as u64,
            calibrated: calibrated.len() as u64,
            flips: flips as u64,
            flip_share: flips as f64 / oblique.count().max(1) as f64,
        },
        edges: cells.edges(),
        shape: document::Shape {
            translation_m: nested(&cells, &shapes[0]),
            yaw_rad: nested(&cells, &shapes[1]),
        },
        cell: learnt.cells(),
        region: learnt.regions,
        p_detect: share(&rows),
    };
    ErrorModel::new(document, "the learnt model")
}

/// Returns a pseudorandom number for a row, from its values and the seed.
fn drawn(row: &Detection, seed: u64) -> u64 {
    let [a, b, c] = row.at;
    let [e, f] = row.errors.unwrap_or([-1.0; 2]);
    [a, b, c, e, f]
        .iter()
        .fold(mixed(seed), |draw, number| mixed(draw ^ number.to_bits()))
}

/// One step of Splitmix64.
pub(super) fn mixed(number: u64) -> u64 {
    let mut z = number.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

fn compare(a: &Detection, b: &Detection) -> core::cmp::Ordering {
    let bits = |row: &Detection| {
        let [e, f] = row.errors.unwrap_or([-1.0; 2]);
        let [x, y, z] = row.at;
        [x, y, z, e, f].map(f64::to_bits)
    };
    bits(a).cmp(&bits(b))
}

/// Returns the quantile of one of the errors at the corners of the cells, with four digits, not falling with d.
fn shape(cells: &Cells, fitted: &[([f64; 3], [f64; 2])], which: usize, quantile: f64) -> Vec<f64> {
    let lattice = Lattice::over(&cells.axes);
    let spots: Vec<_> = fitted
        .iter()
        .filter_map(|(at, _)| cells.spot(&lattice, *at))
        .collect();
    let logs: Vec<f64> = fitted
        .iter()
        .map(|(_, errors)| libm::log(errors[which].max(LEAST_ERROR)))
        .collect();
    // First fit the mean, for which many rows give information. Then fit the differences from quantile to quantile,
    // for which fewer and fewer rows do.
    let mut values = fit(&lattice, Target::Mean, 0.0, &spots, &logs);
    let below = LEVELS
        .iter()
        .filter(|level| 1.0 - **level >= APART * (1.0 - quantile));
    for level in below.chain(core::iter::once(&quantile)) {
        let beyond: Vec<f64> = spots
            .iter()
            .zip(&logs)
            .map(|(spot, log)| log - spot.value(&values))
            .collect();
        let above = fit(&lattice, Target::Quantile(*level), SLOPE, &spots, &beyond);
        for (value, above) in values.iter_mut().zip(&above) {
            *value += above;
        }
    }
    let mut values = floored(&values, &spots);
    let [a, b, c] = cells.fine().map(|count| count + 1);
    for [i, j, k] in each([a - 1, b, c]) {
        let nearer = values[lattice.corner([i, j, k])];
        let farther = &mut values[lattice.corner([i + 1, j, k])];
        *farther = farther.max(nearer);
    }
    values.iter().map(|log| digits(libm::exp(*log))).collect()
}

/// Rounds a number above 0 to four digits.
fn digits(number: f64) -> f64 {
    let unit = libm::pow(10.0, 3.0 - libm::floor(libm::log10(number)));
    libm::round(number * unit) / unit
}

/// Returns the share of detected views.
fn share(rows: &[(u64, Detection)]) -> document::Share {
    let places: Vec<[f64; 3]> = rows.iter().map(|(_, row)| row.at).collect();
    let Some(cells) = Cells::over(&places, ROOMY * FEWEST_VIEWS) else {
        return document::Share::default();
    };
    let lattice = Lattice::over(&cells.axes);
    let coarse = cells.coarse();
    let (mut spots, mut hits) = (Vec::new(), Vec::new());
    let mut views = std::vec![0u64; coarse.iter().product()];
    let mut detected = views.clone();
    for (_, row) in rows {
        let (Some(cell), Some(spot)) = (cells.cell(row.at), cells.spot(&lattice, row.at)) else {
            continue;
        };
        let number = cells.number(Cells::coarse_of(cell));
        views[number] += 1;
        detected[number] += u64::from(row.errors.is_some());
        spots.push(spot);
        hits.push(f64::from(u8::from(row.errors.is_some())));
    }
    let logits = fit(&lattice, Target::Share, 0.0, &spots, &hits);
    let shares: Vec<f64> = logits
        .iter()
        .map(|logit| libm::round(share_of(*logit) * 1e6) / 1e6)
        .map(|share| share.clamp(1e-6, 1.0 - 1e-6))
        .collect();
    document::Share {
        edges: cells.edges(),
        share: nested(&cells, &shares),
        views,
        detected,
    }
}
