//! Cells of distances and angles, and the cell of a number.

/// The most coarse cells of d, phi and psi.
const MOST: [usize; 3] = [8, 2, 9];
/// The number of parts of a coarse cell along d, phi and psi in files that do not state it; the shape is linear within a part.
pub(super) const PARTS: [usize; 3] = [2, 1, 2];
/// Coarse cells of d and psi have more parts if there are at most this many. Errors may jump, for example if tags
/// flip, and wide parts would spread large errors far.
const FEW: usize = 5;
/// The fewest rows per part for which cells have more parts.
const FILLED: usize = 30;
/// Inverse of the unit to which edges are rounded: millimetres, hundredths of a degree.
const ROUND: [f64; 3] = [1000.0, 100.0, 100.0];
/// An interval without numbers is a gap if it is wider than this share of the mean cell width and than this many mean
/// spacings. `GAPS` is the most gaps that are cells of their own.
pub(super) const GAP: [f64; 3] = [0.2, 0.1, 0.2];
const SPACINGS: f64 = 10.0;
const GAPS: [usize; 3] = [5, 2, 5];
/// Cells may be extended down to 0 if the smallest number is at most this. Distances are never extended. Psi is
/// extended only from 1 degree, because tags that are seen head-on differ from others.
const CLOSED: [f64; 3] = [0.0, 180.0, 1.0];

/// The division of a number's range into cells.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Axis {
    /// The ends of the cells, ascending: at least two.
    pub(super) edges: Vec<f64>,
    /// The scale on which the shape is linear: the logarithm of distances, the angle itself.
    scale: Vec<f64>,
    logarithmic: bool,
}

impl Axis {
    /// Returns `None` unless the edges ascend and, for a logarithm, are above 0.
    pub(super) fn new(edges: Vec<f64>, logarithmic: bool) -> Option<Self> {
        let ascend = edges.len() >= 2 && edges.windows(2).all(|pair| pair[0] < pair[1]);
        if !ascend || edges.iter().any(|edge| !edge.is_finite()) {
            return None;
        }
        if logarithmic && !(edges[0] > 0.0) {
            return None;
        }
        let scale = edges
            .iter()
            .map(|edge| scaled(*edge, logarithmic))
            .collect();
        Some(Self {
            edges,
            scale,
            logarithmic,
        })
    }

    pub(super) fn cells(&self) -> usize {
        self.edges.len() - 1
    }

    /// Returns the cell of a number, the lower one at an edge between two; `None` outside of all cells.
    pub(super) fn cell(&self, number: f64) -> Option<usize> {
        let (first, last) = (*self.edges.first()?, *self.edges.last()?);
        if !(number >= first && number <= last) {
            return None;
        }
        let above = self.edges.partition_point(|edge| *edge < number);
        Some(above.saturating_sub(1).min(self.cells() - 1))
    }

    /// Returns the first and the last of the cells that contain a number: two at an edge between them.
    pub(super) fn touched(&self, number: f64) -> Option<[usize; 2]> {
        let lower = self.cell(number)?;
        let on = self.edges[lower + 1] == number && lower + 1 < self.cells();
        Some([lower, if on { lower + 1 } else { lower }])
    }

    /// Returns the relative position of a number in a cell, 0 to 1.
    pub(super) fn through(&self, cell: usize, number: f64) -> f64 {
        let (low, high) = (self.scale[cell], self.scale[cell + 1]);
        ((scaled(number, self.logarithmic) - low) / (high - low)).clamp(0.0, 1.0)
    }

    /// Returns the number at a relative position in a cell, 0 to 1.
    pub(super) fn at(&self, cell: usize, through: f64) -> f64 {
        let (low, high) = (self.edges[cell], self.edges[cell + 1]);
        low + through * (high - low)
    }
}

fn scaled(number: f64, logarithmic: bool) -> f64 {
    if logarithmic {
        libm::log(number)
    } else {
        number
    }
}

/// Returns the number of coarse cells along d, phi and psi for which a cell has about `each` rows.
pub(super) fn coarse_counts(rows: usize, each: f64) -> [usize; 3] {
    let cells = (rows as f64 / each).max(1.0);
    let share = |power: f64, most: usize| (libm::pow(cells, power) as usize).clamp(1, most);
    [
        share(0.42, MOST[0]),
        share(0.16, MOST[1]),
        share(0.42, MOST[2]),
    ]
}

/// Returns the numbers of parts of a coarse cell, given the numbers of rows and of coarse cells.
pub(super) fn parts(rows: usize, coarse: [usize; 3]) -> [usize; 3] {
    let more = [0, 1, 2].map(|axis| match axis {
        1 => 1,
        _ if coarse[axis] <= FEW => 2 * PARTS[axis],
        _ => PARTS[axis],
    });
    let fine: usize = (0..3).map(|axis| coarse[axis] * more[axis]).product();
    if rows < FILLED * fine { PARTS } else { more }
}

/// Returns `true` if a coarse cell contains about one number rather than a range of numbers.
pub(super) fn narrow(which: usize, [low, high]: [f64; 2]) -> bool {
    (high - low) * ROUND[which] < 2.5
}

/// Returns the axis `which` of d, phi and psi for some numbers: coarse cells with equally many numbers, each divided
/// into `parts` with equally many. A gap between numbers is a coarse cell of its own, and so is a single number
/// between two gaps. `None` without numbers.
pub(super) fn over(numbers: &[f64], which: usize, coarse: usize, parts: usize) -> Option<Axis> {
    let mut sorted = numbers.to_vec();
    sorted.sort_by(f64::total_cmp);
    let kept = inner(&sorted, coarse)?;
    let mut edges: Vec<f64> = Vec::new();
    let runs = runs(kept, which, coarse);
    for (number, run) in runs.iter().enumerate() {
        let cells = libm::round((coarse * run.len()) as f64 / kept.len() as f64) as usize;
        let mut own = cut(run, which, cells.max(1), parts)?;
        // Numbers on the border of a gap would count as in the gap.
        let unit = ROUND[which];
        if number > 0 && own[0] >= run[0] {
            own[0] -= 1.0 / unit;
        }
        let end = own.len() - 1;
        if number + 1 < runs.len() && own[end] <= run[run.len() - 1] {
            own[end] += 1.0 / unit;
        }
        if let (Some(from), Some(to)) = (edges.last().copied(), own.first()) {
            let step = (to - from) / parts as f64;
            edges.extend((1..parts).map(|part| from + part as f64 * step));
        }
        edges.extend(own);
    }
    // Angles have no sign: views on either side of 0 are equal, so a small gap to 0 is between neighbours.
    let low = edges[0];
    if low > 0.0 && low <= CLOSED[which] && low <= GAP[which] * edges[parts] {
        edges[0] = 0.0;
    }
    Axis::new(edges, which == 0)
}

/// Splits sorted numbers at their widest gaps.
fn runs(kept: &[f64], which: usize, coarse: usize) -> Vec<&[f64]> {
    let range = kept.last().unwrap_or(&0.0) - kept.first().unwrap_or(&0.0);
    let least = (GAP[which] / coarse as f64).max(SPACINGS / kept.len() as f64) * range;
    let least = least.max(4.0 / ROUND[which]);
    let mut gaps: Vec<(f64, usize)> = kept
        .windows(2)
        .enumerate()
        .map(|(at, pair)| (pair[1] - pair[0], at + 1))
        .filter(|(gap, _)| *gap > least)
        .collect();
    gaps.sort_by(|a, b| b.0.total_cmp(&a.0));
    gaps.truncate(GAPS[which]);
    gaps.sort_by_key(|(_, at)| *at);
    let mut runs = Vec::new();
    let mut from = 0;
    for (_, at) in gaps {
        runs.push(&kept[from..at]);
        from = at;
    }
    runs.push(&kept[from..]);
    runs
}

/// Returns the edges of coarse cells, and of their parts, for sorted numbers without a gap.
fn cut(kept: &[f64], which: usize, coarse: usize, parts: usize) -> Option<Vec<f64>> {
    let count = coarse * parts;
    let (first, last) = (*kept.first()?, *kept.last()?);
    let unit = ROUND[which];
    let mut low = libm::floor(first * unit) / unit;
    if which == 0 {
        low = low.max(first.min(1.0 / unit));
    }
    let mut edges = std::vec![low];
    for k in 1..count {
        let value = kept[k * (kept.len() - 1) / count];
        edges.push(libm::round(value * unit) / unit);
    }
    edges.push(libm::ceil(last * unit) / unit);
    let end = edges[count];
    edges.dedup_by(|b, a| !(*b > *a));
    while edges.last().is_some_and(|edge| *edge >= end) && edges.len() > 1 {
        edges.pop();
    }
    edges.push(if end > edges[0] {
        end
    } else {
        end + 1.0 / unit
    });
    // Only whole coarse cells: repeated numbers can leave fewer edges.
    while edges.len() > parts + 1 && !(edges.len() - 1).is_multiple_of(parts) {
        edges.remove(edges.len() - 2);
    }
    while edges.len() < parts + 1 {
        let width = |at: usize| edges[at] - edges[at - 1];
        let widest = (1..edges.len()).fold(1, |a, b| if width(b) > width(a) { b } else { a });
        edges.insert(widest, 0.5 * (edges[widest - 1] + edges[widest]));
    }
    Some(edges)
}

/// Returns sorted numbers without the few outliers: the outer half of each outermost cell must contain at least a
/// twentieth of that cell's numbers.
fn inner(sorted: &[f64], coarse: usize) -> Option<&[f64]> {
    let mut kept = sorted;
    for _ in 0..64 {
        let (first, last) = (*kept.first()?, *kept.last()?);
        let depth = (kept.len() / coarse).max(1);
        let top = kept[kept.len() - depth];
        let bottom = kept[depth - 1];
        let high = 0.5 * (top + last);
        let low = 0.5 * (bottom + first);
        let above = kept.len() - kept.partition_point(|value| *value <= high);
        let below = kept.partition_point(|value| *value < low);
        if last > top && above * 20 < depth {
            kept = &kept[..kept.len() - above];
        } else if bottom > first && below * 20 < depth {
            kept = &kept[below..];
        } else {
            break;
        }
    }
    Some(kept)
}

#[cfg(test)]
mod tests;
