//! The split of detections into those to which the shape is fitted and those on which regions are calibrated.

use super::Detection;
use super::detections::Detections;
use super::random::mixed;
use std::collections::BTreeMap;

/// The share of the detections, or of the runs, to which the shape is fitted.
pub(super) const FITTED: f64 = 0.4;

/// A row with its part in the split.
#[derive(Clone, Copy, Debug)]
pub(super) struct Drawn {
    pub(super) row: Detection,
    /// `true` if the shape is fitted to it; otherwise it calibrates regions.
    pub(super) fitted: bool,
    /// The row's run; every row has its own run if rows are independent.
    pub(super) run: u32,
    draw: u64,
}

/// Returns the rows in an order that depends only on the rows and their runs, not on the file's order. Complete runs
/// are on one side of the split.
pub(super) fn split(detections: &Detections, seed: u64) -> Vec<Drawn> {
    let of_row = &detections.runs.of_row;
    let mut rows: Vec<Drawn> = detections
        .rows
        .iter()
        .enumerate()
        .map(|(index, row)| Drawn {
            row: *row,
            fitted: false,
            run: of_row.get(index).copied().unwrap_or(index as u32),
            draw: drawn(row, seed),
        })
        .collect();
    sort(&mut rows);
    // Equal rows are also split: if all were on one side, they would not be independent.
    let mut repeats = 0u64;
    let mut last: Option<Detection> = None;
    for drawn in &mut rows {
        let again = last.is_some_and(|last| compare(&last, &drawn.row).is_eq());
        repeats = if again { repeats + 1 } else { 0 };
        last = Some(drawn.row);
        if again {
            drawn.draw = mixed(drawn.draw ^ mixed(repeats));
        }
    }
    sort(&mut rows);
    if of_row.is_empty() {
        for (index, drawn) in rows.iter_mut().enumerate() {
            drawn.fitted = (drawn.draw >> 11) as f64 / (1u64 << 53) as f64 <= FITTED;
            drawn.run = index as u32;
        }
        return rows;
    }
    // All rows of a run use the draw of the run.
    let mut draws: BTreeMap<u32, u64> = BTreeMap::new();
    for drawn in &rows {
        let draw = draws.entry(drawn.run).or_default();
        *draw = draw.wrapping_add(mixed(drawn.draw));
    }
    let mut order: Vec<(u64, u32)> = draws
        .iter()
        .map(|(run, draw)| (mixed(*draw), *run))
        .collect();
    order.sort_unstable();
    let fitted = libm::round(order.len() as f64 * FITTED) as usize;
    let rank: BTreeMap<u32, usize> = order
        .iter()
        .enumerate()
        .map(|(rank, (_, run))| (*run, rank))
        .collect();
    for drawn in &mut rows {
        let rank = rank[&drawn.run];
        drawn.fitted = rank < fitted;
        drawn.run = rank as u32;
    }
    rows
}

fn sort(rows: &mut [Drawn]) {
    rows.sort_by(|a, b| {
        let draws = a.draw.cmp(&b.draw);
        draws.then_with(|| compare(&a.row, &b.row))
    });
}

/// Returns a pseudorandom number for a row, from its values and the seed.
fn drawn(row: &Detection, seed: u64) -> u64 {
    let [a, b, c] = row.at;
    let [e, f] = row.errors.unwrap_or([-1.0; 2]);
    [a, b, c, e, f]
        .iter()
        .fold(mixed(seed), |draw, number| mixed(draw ^ number.to_bits()))
}

fn compare(a: &Detection, b: &Detection) -> core::cmp::Ordering {
    let bits = |row: &Detection| {
        let [e, f] = row.errors.unwrap_or([-1.0; 2]);
        let [x, y, z] = row.at;
        [x, y, z, e, f].map(f64::to_bits)
    };
    bits(a).cmp(&bits(b))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Runs;

    fn detections(count: u64, of_row: Vec<u32>) -> Detections {
        let rows = (0..count)
            .map(|k| Detection {
                at: [1.0 + 0.01 * k as f64, 2.0, 3.0],
                errors: Some([0.01, 0.002]),
            })
            .collect();
        let runs = Runs {
            of_row,
            ..Runs::default()
        };
        Detections {
            rows,
            runs,
            ..Detections::default()
        }
    }

    #[test]
    fn runs_are_on_one_side() {
        let of_row: Vec<u32> = (0..600).map(|k| k % 30).collect();
        let mut sides: BTreeMap<u32, Vec<bool>> = BTreeMap::new();
        for drawn in split(&detections(600, of_row), 1) {
            sides.entry(drawn.run).or_default().push(drawn.fitted);
        }
        assert_eq!(sides.len(), 30);
        let is_complete = |side: &Vec<bool>| side.len() == 20 && side.iter().all(|f| *f == side[0]);
        assert!(sides.values().all(is_complete));
        assert_eq!(sides.values().filter(|side| side[0]).count(), 12);
    }

    #[test]
    fn independent_rows_are_split_individually() {
        let rows = split(&detections(1000, Vec::new()), 1);
        let fitted = rows.iter().filter(|drawn| drawn.fitted).count();
        assert!((350..450).contains(&fitted), "{fitted}");
        // Another seed splits them differently.
        let sides =
            |rows: &[Drawn]| -> Vec<bool> { rows.iter().map(|drawn| drawn.fitted).collect() };
        assert_ne!(
            sides(&rows),
            sides(&split(&detections(1000, Vec::new()), 2))
        );
    }
}
