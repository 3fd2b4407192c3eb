//! Bounds on errors from detections: a shape is fitted to one part of them and calibrated, region by region, on
//! the other.

use std::string::String;
use std::vec::Vec;

use super::binomial::{at_most, conformal_rank, order_statistic, rank};
use super::cells::{Cells, each, nested, numbered};
use super::detections::{Detections, hexadecimal};
use super::document::{self, Document};
use super::error_model::ErrorModel;
use super::smooth::{Lattice, Target, fit, share_of};
use super::{Detection, LearnError};

/// What is to be learnt.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoundsSettings {
    /// The share of the detections for which each of the two bounds is to hold, above 0 and below 1.
    pub quantile: f64,
    /// The probability, over the detections that happen to be calibrated on, with which a bound does so in a
    /// region; above 0 and below 1.
    pub confidence: f64,
    /// What the detections are split with.
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

/// The share of the detections that the shape is fitted to.
const FITTED: f64 = 0.4;
/// Errors below this count as this, metres and radians.
const LEAST_ERROR: f64 = 1e-7;
/// A cell has so many times the rows that are the fewest for a bound.
const ROOMY: f64 = 3.0;
/// The fewest rows of a cell that anything is said of.
const FEWEST: f64 = 10.0;
/// The fewest rows of a cell of the share of detected views.
const FEWEST_VIEWS: f64 = 40.0;
/// Quantiles on the way to the one that is asked for, and how many times more rows are beyond each than beyond that.
const LEVELS: [f64; 3] = [0.7, 0.9, 0.97];
const APART: f64 = 1.8;
/// The scores of a region, times Q / (1 - Q): with more of them a bound is tighter, with fewer it is more local; and
/// the number that is enough for any Q, unless they would hardly do for a bound.
const SCORES: f64 = 30.0;
const ENOUGH: f64 = 900.0;
const HARDLY: f64 = 6.0;
/// A cell in which so few hold, by chance, is calibrated alone.
const BY_CHANCE: f64 = 0.1;
/// How much of a slope a bend is, in what lies between means and quantiles.
const SLOPE: f64 = 0.02;
/// From here on mirrored solutions are told apart, degrees.
const SQUARE_ON: f64 = 10.0;

/// Learns bounds and the share of detected views.
///
/// # Errors
/// [`LearnError::Share`] for settings that are no shares; [`LearnError::TooFew`] where nothing can be said
/// anywhere.
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
    // In an order that is the rows' own: what the file's order is does not matter.
    let mut rows: Vec<(u64, Detection)> = detections
        .rows
        .iter()
        .map(|row| (drawn(row, seed), *row))
        .collect();
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
    let each_cell = (ROOMY * fewest).max(ROOMY * FEWEST);
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
    let support = support(&cells, &places, fewest.max(FEWEST));
    let mut learnt = Calibration {
        cells: &cells,
        quantile,
        confidence,
        regions: Vec::new(),
        of_cell: support
            .iter()
            .map(|(detections, refused)| CellState {
                detections: *detections,
                region: None,
                own: None,
                refused: refused.clone(),
            })
            .collect(),
    };
    learnt.run(&fitted, &calibrated, &shapes);
    if learnt.of_cell.iter().all(|cell| cell.region.is_none()) {
        return Err(too_few(seen.len()));
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

/// A number drawn for a row, from what it says and the seed.
fn drawn(row: &Detection, seed: u64) -> u64 {
    let [a, b, c] = row.at;
    let [e, f] = row.errors.unwrap_or([-1.0; 2]);
    [a, b, c, e, f]
        .iter()
        .fold(mixed(seed), |draw, number| mixed(draw ^ number.to_bits()))
}

/// Splitmix64's step.
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

/// The quantile of one of the errors at the corners of the cells, with four digits, growing with d.
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
    // First how large errors are on the whole, which many rows tell; then, level by level, what quantiles are beyond
    // that, which fewer and fewer rows tell.
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
    let [a, b, c] = cells.fine().map(|count| count + 1);
    for [i, j, k] in each([a - 1, b, c]) {
        let nearer = values[lattice.corner([i, j, k])];
        let farther = &mut values[lattice.corner([i + 1, j, k])];
        *farther = farther.max(nearer);
    }
    values.iter().map(|log| digits(libm::exp(*log))).collect()
}

/// A number above 0 with four digits.
fn digits(number: f64) -> f64 {
    let unit = libm::pow(10.0, 3.0 - libm::floor(libm::log10(number)));
    libm::round(number * unit) / unit
}

/// The detections of each coarse cell, and why nothing can be said of it.
fn support(cells: &Cells, places: &[[f64; 3]], fewest: f64) -> Vec<(u64, Option<String>)> {
    let fine = cells.fine();
    let mut counts = std::vec![0u64; fine.iter().product()];
    // Halves of each coarse cell in phi.
    let mut halves = std::vec![[0u64; 2]; cells.each_coarse().count()];
    for at in places {
        if let Some(cell) = cells.cell(*at) {
            counts[numbered(fine, cell)] += 1;
            let coarse = Cells::coarse_of(cell);
            let [_, [low, high], _] = cells.ends(coarse);
            let upper = usize::from(at[1] > 0.5 * (low + high));
            halves[cells.number(coarse)][upper] += 1;
        }
    }
    cells
        .each_coarse()
        .map(|[i, j, k]| {
            let part = |n: usize| counts[numbered(fine, [2 * i + (n >> 1), j, 2 * k + (n & 1)])];
            let parts = [0, 1, 2, 3].map(part);
            let detections: u64 = parts.iter().sum();
            let halves = halves[cells.number([i, j, k])];
            let least = |of: &[u64], times: u64| {
                of.iter()
                    .any(|part| *part * times < detections || *part == 0)
            };
            let refused = if (detections as f64) < fewest {
                Some("too few detections".into())
            } else if least(&parts, 32) || least(&halves, 16) {
                Some("a part of it has hardly a detection".into())
            } else {
                None
            };
            (detections, refused)
        })
        .collect()
}

/// What the second part of the detections says.
struct Calibration<'a> {
    cells: &'a Cells,
    quantile: f64,
    confidence: f64,
    regions: Vec<document::Region>,
    of_cell: Vec<CellState>,
}

#[derive(Clone)]
struct CellState {
    detections: u64,
    region: Option<usize>,
    own: Option<[f64; 2]>,
    refused: Option<String>,
}

impl Calibration<'_> {
    fn run(
        &mut self,
        fitted: &[([f64; 3], [f64; 2])],
        calibrated: &[([f64; 3], [f64; 2])],
        shapes: &[Vec<f64>; 2],
    ) {
        let coarse = self.cells.coarse();
        let mut counts = std::vec![0u64; self.of_cell.len()];
        for (at, _) in fitted {
            if let Some(cell) = self.cells.cell(*at) {
                let number = self.cells.number(Cells::coarse_of(cell));
                counts[number] += u64::from(self.of_cell[number].refused.is_none());
            }
        }
        // Regions are chosen by where the detections are that the shape was fitted to: whatever the others are.
        let fewest = self.quantile / (1.0 - self.quantile);
        let scores = (SCORES * fewest).min(ENOUGH.max(HARDLY * fewest));
        let wanted = (scores * FITTED / (1.0 - FITTED)).max(FEWEST) as u64;
        let whole = [[0, coarse[0]], [0, coarse[1]], [0, coarse[2]]];
        let boxes = divided(whole, coarse, &counts, wanted);

        let mut scores: Vec<[Vec<f64>; 2]> =
            std::vec![[Vec::new(), Vec::new()]; self.of_cell.len()];
        let lattice = Lattice::over(&self.cells.axes);
        let logs = [0, 1].map(|which| -> Vec<f64> {
            shapes[which]
                .iter()
                .map(|value| libm::log(*value))
                .collect()
        });
        for (at, errors) in calibrated {
            let (Some(cell), Some(spot)) = (self.cells.cell(*at), self.cells.spot(&lattice, *at))
            else {
                continue;
            };
            let number = self.cells.number(Cells::coarse_of(cell));
            for which in [0, 1] {
                let score = errors[which] / libm::exp(spot.value(&logs[which]));
                scores[number][which].push(score);
            }
        }
        for block in boxes {
            self.region(block, &scores);
        }
    }

    /// Calibrates the cells of a region together, and those in which that does not hold alone.
    fn region(&mut self, block: [[usize; 2]; 3], scores: &[[Vec<f64>; 2]]) {
        let members: Vec<usize> = within(block)
            .map(|cell| self.cells.number(cell))
            .filter(|number| self.of_cell[*number].refused.is_none())
            .collect();
        if members.is_empty() {
            return;
        }
        let pooled = [0, 1].map(|which| -> Vec<f64> {
            let scores = members.iter().flat_map(|number| &scores[*number][which]);
            scores.copied().collect()
        });
        let n = pooled[0].len() as u64;
        let found = rank(n, self.quantile, self.confidence);
        let factors = found.and_then(|k| factors(&pooled, k));
        let low = self.cells.ends([block[0][0], block[1][0], block[2][0]]);
        let high = self
            .cells
            .ends([block[0][1] - 1, block[1][1] - 1, block[2][1] - 1]);
        let ends = |axis: usize| [low[axis][0], high[axis][1]];
        let number = self.regions.len();
        self.regions.push(document::Region {
            d_m: ends(0),
            phi_deg: ends(1),
            psi_deg: ends(2),
            detections: n,
            rank: factors.and(found).unwrap_or(0),
            translation: factors.map_or(0.0, |f| f[0]),
            yaw: factors.map_or(0.0, |f| f[1]),
        });
        let Some(factors) = factors else {
            for member in members {
                self.of_cell[member].refused = Some("its region has too few detections".into());
            }
            return;
        };
        for member in members {
            match self.alone(&scores[member], factors) {
                Ok(own) => {
                    self.of_cell[member].region = Some(number);
                    self.of_cell[member].own = own;
                }
                Err(why) => self.of_cell[member].refused = Some(why),
            }
        }
    }

    /// The factors of a cell whose own scores contradict its region's.
    fn alone(
        &self,
        scores: &[Vec<f64>; 2],
        of_region: [f64; 2],
    ) -> Result<Option<[f64; 2]>, String> {
        let n = scores[0].len() as u64;
        let contradicts = |which: usize| {
            let held = scores[which]
                .iter()
                .filter(|score| **score <= of_region[which]);
            at_most(held.count() as u64, n, self.quantile) < BY_CHANCE
        };
        if !contradicts(0) && !contradicts(1) {
            return Ok(None);
        }
        let found = conformal_rank(n, self.quantile);
        match found.and_then(|k| factors(scores, k)) {
            Some(own) => Ok(Some([0, 1].map(|i| own[i].max(of_region[i])))),
            None => {
                Err("its errors are larger than its region's, and too few for themselves".into())
            }
        }
    }

    fn cells(&self) -> Vec<document::Cell> {
        let each = self.cells.each_coarse().zip(&self.of_cell);
        each.map(|(coarse, state)| {
            let [d_m, phi_deg, psi_deg] = self.cells.ends(coarse);
            document::Cell {
                d_m,
                phi_deg,
                psi_deg,
                detections: state.detections,
                region: state.region,
                own: state.own,
                refused: state.refused.clone(),
            }
        })
        .collect()
    }
}

/// The k-th smallest score of each bound, rounded up to 1e-6.
fn factors(scores: &[Vec<f64>; 2], k: u64) -> Option<[f64; 2]> {
    let up = |score: f64| (libm::ceil(score * 1e6) + 1.0) / 1e6;
    Some([
        up(order_statistic(&scores[0], k)?),
        up(order_statistic(&scores[1], k)?),
    ])
}

fn within(block: [[usize; 2]; 3]) -> impl Iterator<Item = [usize; 3]> {
    each([0, 1, 2].map(|i| block[i][1] - block[i][0]))
        .map(move |cell| [0, 1, 2].map(|i| block[i][0] + cell[i]))
}

/// A block of cells halved, along the axis with the most cells, as long as either half has enough rows.
fn divided(
    block: [[usize; 2]; 3],
    coarse: [usize; 3],
    counts: &[u64],
    wanted: u64,
) -> Vec<[[usize; 2]; 3]> {
    let rows = |block: [[usize; 2]; 3]| -> u64 {
        within(block)
            .map(|cell| counts[numbered(coarse, cell)])
            .sum()
    };
    let length = |axis: usize| block[axis][1] - block[axis][0];
    // Errors differ more along d and psi.
    let mut axes = [2, 0, 1];
    axes.sort_by_key(|axis| core::cmp::Reverse(if *axis == 1 { 0 } else { length(*axis) }));
    for axis in axes {
        let cut = |at: usize| {
            let (mut low, mut high) = (block, block);
            low[axis][1] = at;
            high[axis][0] = at;
            (low, high)
        };
        let best = (block[axis][0] + 1..block[axis][1])
            .map(cut)
            .max_by_key(|(low, high)| rows(*low).min(rows(*high)));
        if let Some((low, high)) = best
            && rows(low).min(rows(high)) >= wanted
        {
            let mut blocks = divided(low, coarse, counts, wanted);
            blocks.extend(divided(high, coarse, counts, wanted));
            return blocks;
        }
    }
    std::vec![block]
}

/// The share of views that are detected.
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
