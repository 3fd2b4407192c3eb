//! Regions of cells, calibrated on detections to which the shape was not fitted.

use super::axis::{GAP, narrow};
use super::binomial::{at_most, conformal_rank, order_statistic, rank};
use super::cells::{Cells, each, numbered};
use super::document;
use super::family::Family;
use super::runs::{self, for_few_runs};
use super::sample::{FEWEST, FEWEST_RUNS, LEAST_ERROR, Sample};
use super::smooth::Lattice;
use super::split::FITTED;
use std::collections::BTreeSet;

/// The intended number of scores in a region is `SCORES` Q / (1 - Q): more make a bound tighter, fewer make it more
/// local. `ENOUGH` is enough for any Q, unless it is below `HARDLY` Q / (1 - Q).
const SCORES: f64 = 30.0;
const ENOUGH: f64 = 900.0;
const HARDLY: f64 = 6.0;
/// With fewer scores than this, the confidence makes the bound much wider, for any Q.
const LEAST: f64 = 300.0;
/// A cell is calibrated alone if the probability of so few hits is below this.
const BY_CHANCE: f64 = 0.1;
/// The most parts of a cell along an axis that must each have a detection.
const BOXES: usize = 4;

/// The result of the calibration.
pub(super) struct Calibration<'a> {
    cells: &'a Cells,
    quantile: f64,
    confidence: f64,
    in_runs: bool,
    /// The design effect of all scores.
    effect: f64,
    pub(super) regions: Vec<document::Region>,
    of_cell: Vec<CellState>,
}

/// The scores of a cell for both bounds, and their runs.
#[derive(Clone, Default)]
struct Scores {
    of: [Vec<f64>; 2],
    runs: Vec<u32>,
}

impl Scores {
    fn add(&mut self, other: &Self) {
        for (mine, other) in self.of.iter_mut().zip(&other.of) {
            mine.extend(other);
        }
        self.runs.extend(&other.runs);
    }

    /// Returns the largest design effect of both bounds.
    fn effect(&self, quantile: f64) -> f64 {
        let of = |which: usize| runs::effect(&self.of[which], &self.runs, quantile);
        of(0).max(of(1))
    }

    fn run_count(&self) -> usize {
        self.runs.iter().collect::<BTreeSet<_>>().len()
    }
}

#[derive(Clone)]
struct CellState {
    detections: u64,
    region: Option<usize>,
    own: Option<[f64; 2]>,
    refused: Option<String>,
}

impl<'a> Calibration<'a> {
    /// Returns the state before the calibration, for cells over the places of all detections.
    pub(super) fn new(
        cells: &'a Cells,
        [quantile, confidence]: [f64; 2],
        places: &[[f64; 3]],
        in_runs: bool,
    ) -> Self {
        let fewest = (quantile / (1.0 - quantile)).max(FEWEST);
        let state = |(detections, refused)| CellState {
            detections,
            region: None,
            own: None,
            refused,
        };
        Self {
            cells,
            quantile,
            // The number of independent rows is itself an estimate. Half of the error keeps the confidence.
            confidence: if in_runs {
                1.0 - 0.5 * (1.0 - confidence)
            } else {
                confidence
            },
            in_runs,
            effect: 1.0,
            regions: Vec::new(),
            of_cell: support(cells, places, fewest)
                .into_iter()
                .map(state)
                .collect(),
        }
    }

    /// Returns the design effect of all scores: 1 for independent rows.
    pub(super) fn effect(&self) -> f64 {
        self.effect
    }

    /// Returns `true` if any region has enough detections for a bound.
    pub(super) fn has_bounds(&self) -> bool {
        self.of_cell.iter().any(|cell| cell.region.is_some())
    }

    /// Returns the reasons why cells have no bounds, each with the number of cells.
    pub(super) fn reasons(&self) -> String {
        let mut counts: Vec<(&str, u64)> = Vec::new();
        for why in self
            .of_cell
            .iter()
            .filter_map(|cell| cell.refused.as_deref())
        {
            match counts.iter_mut().find(|(known, _)| *known == why) {
                Some((_, count)) => *count += 1,
                None => counts.push((why, 1)),
            }
        }
        let each = counts
            .iter()
            .map(|(why, count)| format!("{count} cells: {why}"));
        each.collect::<Vec<_>>().join("; ")
    }

    /// Calibrates every region. A region gets `effect` times as many scores as it needs of independent ones.
    pub(super) fn run(
        &mut self,
        fitted: &[Sample],
        calibrated: &[Sample],
        families: &[Family; 2],
        effect: f64,
    ) {
        let coarse = self.cells.coarse();
        let mut counts = std::vec![0u64; self.of_cell.len()];
        for sample in fitted {
            if let Some(cell) = self.cells.cell(sample.at) {
                let number = self.cells.number(self.cells.coarse_of(cell));
                counts[number] += u64::from(self.of_cell[number].refused.is_none());
            }
        }
        // Regions depend only on the places of the detections used for the fit, and not on the calibration data.
        let fewest = self.quantile / (1.0 - self.quantile);
        let scores = (SCORES * fewest)
            .min(ENOUGH.max(HARDLY * fewest))
            .max(LEAST);
        let needed = (effect * scores * FITTED / (1.0 - FITTED)).max(FEWEST) as u64;
        let all = [[0, coarse[0]], [0, coarse[1]], [0, coarse[2]]];
        let boxes = divided(all, coarse, &counts, needed);

        let mut scores = std::vec![Scores::default(); self.of_cell.len()];
        let lattice = Lattice::over(&self.cells.axes);
        for sample in calibrated {
            let (Some(cell), Some(spot)) = (
                self.cells.cell(sample.at),
                self.cells.spot(&lattice, sample.at),
            ) else {
                continue;
            };
            let cell = &mut scores[self.cells.number(self.cells.coarse_of(cell))];
            for which in [0, 1] {
                let log = libm::log(sample.errors[which].max(LEAST_ERROR));
                cell.of[which].push(families[which].score(&spot, log));
            }
            cell.runs.push(sample.run);
        }
        if self.in_runs {
            let mut all = Scores::default();
            scores.iter().for_each(|cell| all.add(cell));
            self.effect = all.effect(self.quantile);
        }
        for block in boxes {
            self.region(block, &scores);
        }
    }

    /// Calibrates the cells of a region together, and cells with larger errors alone.
    fn region(&mut self, block: [[usize; 2]; 3], scores: &[Scores]) {
        let members: Vec<usize> = within(block)
            .map(|cell| self.cells.number(cell))
            .filter(|number| self.of_cell[*number].refused.is_none())
            .collect();
        if members.is_empty() {
            return;
        }
        let mut pooled = Scores::default();
        members.iter().for_each(|cell| pooled.add(&scores[*cell]));
        let n = pooled.runs.len() as u64;
        let independent = self.independent(&pooled);
        let found = independent.and_then(|count| {
            let k = rank(count, self.quantile, self.confidence)?;
            Some(scaled(k, count, n))
        });
        let factors = found.and_then(|k| factors(&pooled.of, k));
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
            independent: self.in_runs.then_some(independent.unwrap_or(0)),
            rank: factors.and(found).unwrap_or(0),
            translation: factors.map_or(0.0, |f| f[0]),
            yaw: factors.map_or(0.0, |f| f[1]),
        });
        let Some(factors) = factors else {
            let why = match independent {
                Some(_) if !self.in_runs => "its region has too few detections",
                Some(_) => "its region has too few independent detections",
                None => "its region has detections of too few runs",
            };
            for member in members {
                self.of_cell[member].refused = Some(why.into());
            }
            return;
        };
        let effect = n as f64 / independent.unwrap_or(n).max(1) as f64;
        for member in members {
            match self.alone(&scores[member].of, factors, effect) {
                Ok(own) => {
                    self.of_cell[member].region = Some(number);
                    self.of_cell[member].own = own;
                }
                Err(why) => self.of_cell[member].refused = Some(why),
            }
        }
    }

    /// Returns the number of independent scores with the same information; `None` if there are too few runs.
    fn independent(&self, scores: &Scores) -> Option<u64> {
        let n = scores.runs.len();
        if !self.in_runs {
            return Some(n as u64);
        }
        let runs = scores.run_count();
        if (runs as f64) < FEWEST_RUNS {
            return None;
        }
        let known = for_few_runs(runs, self.confidence);
        Some(libm::floor(n as f64 / scores.effect(self.quantile) * known) as u64)
    }

    /// Returns the factors of a cell whose own scores contradict its region's factors; `None` if they do not. A factor that they do not
    /// contradict stays that of the region. Each score counts as 1 / `effect` independent ones.
    fn alone(
        &self,
        scores: &[Vec<f64>; 2],
        of_region: [f64; 2],
        effect: f64,
    ) -> Result<Option<[f64; 2]>, String> {
        let n = scores[0].len() as u64;
        let count = |scores: usize| libm::round(scores as f64 / effect) as u64;
        let contradicts = |which: usize| {
            let contained = scores[which]
                .iter()
                .filter(|score| **score <= of_region[which]);
            at_most(
                count(contained.count()),
                count(scores[which].len()),
                self.quantile,
            ) < BY_CHANCE
        };
        let contradicted = [0, 1].map(contradicts);
        if contradicted == [false; 2] {
            return Ok(None);
        }
        let independent = count(scores[0].len());
        let found = conformal_rank(independent, self.quantile);
        match found.and_then(|k| factors(scores, scaled(k, independent, n))) {
            Some(own) => Ok(Some([0, 1].map(|i| match contradicted[i] {
                true => own[i].max(of_region[i]),
                false => of_region[i],
            }))),
            None => {
                Err("its errors are larger than its region's, and too few for themselves".into())
            }
        }
    }

    /// Returns the results for each cell.
    pub(super) fn cells(&self) -> Vec<document::Cell> {
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

/// Returns the rank among `n` scores with the same share as rank `k` among `independent` ones, rounded up.
fn scaled(k: u64, independent: u64, n: u64) -> u64 {
    (k * n).div_ceil(independent.max(1)).min(n)
}

/// Returns the k-th smallest score of each bound, rounded up to a multiple of 1e-6, plus 1e-6.
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

/// Halves a block of cells recursively, along the axis with the most cells, as long as both halves have enough rows.
fn divided(
    block: [[usize; 2]; 3],
    coarse: [usize; 3],
    counts: &[u64],
    needed: u64,
) -> Vec<[[usize; 2]; 3]> {
    let rows = |block: [[usize; 2]; 3]| -> u64 {
        within(block)
            .map(|cell| counts[numbered(coarse, cell)])
            .sum()
    };
    let length = |axis: usize| block[axis][1] - block[axis][0];
    // Errors vary more along d and psi than along phi.
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
            && rows(low).min(rows(high)) >= needed
        {
            let mut blocks = divided(low, coarse, counts, needed);
            blocks.extend(divided(high, coarse, counts, needed));
            return blocks;
        }
    }
    std::vec![block]
}

/// Returns the number of detections of each coarse cell, and the reason why it gets no bound.
fn support(cells: &Cells, places: &[[f64; 3]], fewest: f64) -> Vec<(u64, Option<String>)> {
    let mut contained: Vec<Vec<[f64; 3]>> = std::vec![Vec::new(); cells.each_coarse().count()];
    for at in places {
        if let Some(cell) = cells.cell(*at) {
            contained[cells.number(cells.coarse_of(cell))].push(*at);
        }
    }
    cells
        .each_coarse()
        .zip(&contained)
        .map(|(coarse, places)| {
            let why = if (places.len() as f64) < fewest {
                Some("too few detections")
            } else {
                emptiness(cells, coarse, places)
            };
            (places.len() as u64, why.map(Into::into))
        })
        .collect()
}

/// Returns the reason why the detections do not fill a coarse cell.
fn emptiness(cells: &Cells, coarse: [usize; 3], places: &[[f64; 3]]) -> Option<&'static str> {
    const HARDLY_ONE: Option<&str> = Some("a part of it has hardly a detection");
    let n = places.len();
    let ends = cells.ends(coarse);
    // Along an axis on which the cell contains about one number there is nothing to fill.
    let wide: Vec<usize> = (0..3).filter(|axis| !narrow(*axis, ends[*axis])).collect();
    let share = |axis: usize, at: f64| (at - ends[axis][0]) / (ends[axis][1] - ends[axis][0]);
    let part =
        |axis: usize, at: f64, of: usize| ((share(axis, at) * of as f64) as usize).min(of - 1);
    // Quarters in d and psi hold equally many on average; halves in phi have equal widths.
    let mut quarters = [0usize; 4];
    let mut halves = [0usize; 2];
    for at in places {
        let Some(cell) = cells.cell(*at) else {
            continue;
        };
        let upper = |axis: usize| {
            let part = cell[axis] - coarse[axis] * cells.parts[axis];
            usize::from(wide.contains(&axis) && 2 * part >= cells.parts[axis])
        };
        quarters[2 * upper(0) + upper(2)] += 1;
        halves[part(1, at[1], 2)] += 1;
    }
    let quarter_fails = [0, 1, 2, 3].iter().any(|number: &usize| {
        let there =
            (wide.contains(&0) || number >> 1 == 0) && (wide.contains(&2) || number & 1 == 0);
        there && ((quarters[*number] as f64) < FEWEST || quarters[*number] * 20 < n)
    });
    let half_fails = |half: &usize| *half == 0 || *half * 16 < n;
    if quarter_fails || wide.contains(&1) && halves.iter().any(half_fails) {
        return HARDLY_ONE;
    }
    for axis in &wide {
        let mut along: Vec<f64> = places.iter().map(|at| share(*axis, at[*axis])).collect();
        along.extend([0.0, 1.0]);
        along.sort_by(f64::total_cmp);
        // Random places leave such a wide gap only rarely.
        let by_chance = (libm::log(n as f64) + 7.0) / n as f64;
        let least = GAP[*axis].max(by_chance.min(0.2));
        if along.windows(2).any(|pair| pair[1] - pair[0] > least) {
            return Some("there is a gap in its detections");
        }
    }
    // Boxes in each pair of d, phi and psi, so large that random places rarely leave a box empty.
    let of = (libm::sqrt(n as f64 / FEWEST) as usize).min(BOXES);
    for (first, second) in [(0, 1), (0, 2), (1, 2)] {
        if !wide.contains(&first) || !wide.contains(&second) {
            continue;
        }
        let mut boxes = std::vec![false; of * of];
        for at in places {
            boxes[part(first, at[first], of) * of + part(second, at[second], of)] = true;
        }
        if boxes.contains(&false) {
            return Some("there is a hole in its detections");
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The factor of a cell is its own for the error that contradicts the region's factor, and not for the other one.
    #[test]
    fn only_the_contradicted_factor_of_a_cell_is_its_own() {
        let places: Vec<[f64; 3]> = (0..400)
            .map(|k| [1.0 + 0.01 * f64::from(k), 1.0, 30.0])
            .collect();
        let cells = Cells::over(&places, 400.0).unwrap();
        let calibration = Calibration::new(&cells, [0.9, 0.95], &places, false);
        let hundredths: Vec<f64> = (1..=100).map(|k| 0.01 * f64::from(k)).collect();
        let scores = [hundredths.clone(), hundredths];
        let alone = |of_region: [f64; 2]| calibration.alone(&scores, of_region, 1.0).unwrap();
        assert_eq!(alone([0.905, 0.905]), None);
        // Rank 91 of 100.
        let own = |factor: f64| (0.91..0.9101).contains(&factor);
        let [translation, yaw] = alone([0.905, 0.505]).unwrap();
        assert!(translation == 0.905 && own(yaw), "{translation} {yaw}");
        let [translation, yaw] = alone([0.505, 0.905]).unwrap();
        assert!(own(translation) && yaw == 0.905, "{translation} {yaw}");
    }
}
