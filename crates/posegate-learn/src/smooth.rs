//! Smooth functions of d, phi and psi: a value at each corner of a lattice, linear in between, with a penalty on bends.
//! They are fitted to means, quantiles or shares.

use super::axis::Axis;

/// The place of a row in the lattice: the corners of its cell and their weights.
#[derive(Clone, Debug)]
pub(super) struct InterpolationWeights {
    corners: [usize; 8],
    weights: [f64; 8],
}

/// The corners of three axes.
#[derive(Clone, Debug)]
pub(super) struct Lattice {
    /// The number of corners along each axis.
    counts: [usize; 3],
}

/// The smoothness penalty of a fit: the weight of a bend, and the weight of a slope relative to it.
#[derive(Clone, Copy, Debug)]
pub(super) struct SmoothnessPenalty {
    pub(super) bend: f64,
    pub(super) slope: f64,
}

/// Iterations for quantiles and shares.
const STEPS: u32 = 16;
/// Number of folds of the cross-validation.
const FOLDS: usize = 2;
/// Bend penalties that are tried, times rows per corner.
const BENDS: [f64; 4] = [0.01, 0.1, 1.0, 10.0];
/// Relative bend penalty per axis. The penalty is larger for phi, which has little effect.
const BEND_PENALTY: [f64; 3] = [1.0, 4.0, 1.0];
/// The largest magnitude of a logit, which keeps shares away from 0 and 1.
const FARTHEST_LOGIT: f64 = 9.0;

impl Lattice {
    pub(super) fn over(axes: &[Axis; 3]) -> Self {
        Self {
            counts: [0, 1, 2].map(|i| axes[i].edges.len()),
        }
    }

    pub(super) fn len(&self) -> usize {
        self.counts.iter().product()
    }

    pub(super) fn corner(&self, [i, j, k]: [usize; 3]) -> usize {
        (i * self.counts[1] + j) * self.counts[2] + k
    }

    /// Returns the corners of a cell: bit 0 of their number is along psi, bit 1 along phi, bit 2 along d.
    pub(super) fn corners(&self, [i, j, k]: [usize; 3]) -> [usize; 8] {
        core::array::from_fn(|n| self.corner([i + (n >> 2), j + ((n >> 1) & 1), k + (n & 1)]))
    }

    pub(super) fn spot(&self, cell: [usize; 3], through: [f64; 3]) -> InterpolationWeights {
        InterpolationWeights {
            corners: self.corners(cell),
            weights: weights(through),
        }
    }

    /// Returns the fit to means.
    fn mean(
        &self,
        spots: &[&InterpolationWeights],
        values: &[f64],
        penalty: SmoothnessPenalty,
    ) -> Vec<f64> {
        let ones = std::vec![1.0; spots.len()];
        self.solve(spots, &ones, values, penalty)
    }

    /// Returns the fit to the q-quantile, by iterations from a first guess. Each step replaces the tilted absolute
    /// value by a parabola that is at least as large everywhere (Hunter and Lange).
    fn quantile(
        &self,
        spots: &[&InterpolationWeights],
        values: &[f64],
        q: f64,
        penalty: SmoothnessPenalty,
    ) -> Vec<f64> {
        let level = super::binomial::order_statistic(
            values,
            (libm::ceil(values.len() as f64 * q) as u64).max(1),
        );
        let mut fit = std::vec![level.unwrap_or(0.0); self.len()];
        let mut near = 0.5;
        let (mut price, mut pull) = (std::vec![0.0; spots.len()], std::vec![0.0; spots.len()]);
        for _ in 0..STEPS {
            for (index, spot) in spots.iter().enumerate() {
                let off = libm::fabs(values[index] - spot.value(&fit));
                price[index] = 0.5 / (near + off);
                pull[index] = price[index] * values[index] + q - 0.5;
            }
            fit = self.solve_weighted(spots, &price, &pull, penalty);
            near = (near * 0.75).max(0.01);
        }
        fit
    }

    /// Returns the fit to the logit of a share.
    fn share(
        &self,
        spots: &[&InterpolationWeights],
        hits: &[f64],
        penalty: SmoothnessPenalty,
    ) -> Vec<f64> {
        let mean = (hits.iter().sum::<f64>() + 0.5) / (hits.len() as f64 + 1.0);
        let mut fit = std::vec![libm::log(mean / (1.0 - mean)); self.len()];
        let (mut price, mut pull) = (std::vec![0.0; spots.len()], std::vec![0.0; spots.len()]);
        for _ in 0..STEPS {
            for (index, spot) in spots.iter().enumerate() {
                let logit = spot.value(&fit);
                let p = share_of(logit);
                // A floor, so that steps stay small if nearly all hits are equal.
                price[index] = (p * (1.0 - p)).max(0.02);
                pull[index] = price[index] * logit + hits[index] - p;
            }
            fit = self.solve_weighted(spots, &price, &pull, penalty);
            for logit in &mut fit {
                *logit = logit.clamp(-FARTHEST_LOGIT, FARTHEST_LOGIT);
            }
        }
        fit
    }

    fn solve(
        &self,
        spots: &[&InterpolationWeights],
        price: &[f64],
        values: &[f64],
        penalty: SmoothnessPenalty,
    ) -> Vec<f64> {
        let pull: Vec<f64> = price.iter().zip(values).map(|(w, v)| w * v).collect();
        self.solve_weighted(spots, price, &pull, penalty)
    }

    /// Returns the corners' values that minimise `sum price/2 value^2 - pull value` plus the bend penalty: a banded
    /// system, solved by Cholesky.
    fn solve_weighted(
        &self,
        spots: &[&InterpolationWeights],
        price: &[f64],
        pull: &[f64],
        penalty: SmoothnessPenalty,
    ) -> Vec<f64> {
        let n = self.len();
        let mut band = BandedMatrix::new(n, 2 * self.counts[1] * self.counts[2]);
        let mut right = std::vec![0.0; n];
        for ((spot, price), pull) in spots.iter().zip(price).zip(pull) {
            for (a, (corner, weight)) in spot.corners.iter().zip(spot.weights).enumerate() {
                right[*corner] += pull * weight;
                // The corners of a cell ascend, so only the first `a + 1` are in the lower half.
                for (below, other) in spot.corners.iter().zip(spot.weights).take(a + 1) {
                    band.add(*corner, *below, price * weight * other);
                }
            }
        }
        self.add_bend_penalty(&mut band, penalty, spots.len() as f64 / n as f64);
        band.solve(&mut right);
        right
    }

    fn add_bend_penalty(&self, band: &mut BandedMatrix, penalty: SmoothnessPenalty, each: f64) {
        let SmoothnessPenalty { bend, slope } = penalty;
        for i in 0..self.counts[0] {
            for j in 0..self.counts[1] {
                for k in 0..self.counts[2] {
                    let here = [i, j, k];
                    for axis in 0..3 {
                        let at = |step: usize| {
                            let mut at = here;
                            at[axis] += step;
                            self.corner(at)
                        };
                        let price = each * bend * BEND_PENALTY[axis];
                        if here[axis] + 2 < self.counts[axis] {
                            band.square(&[(at(0), 1.0), (at(1), -2.0), (at(2), 1.0)], price);
                        }
                        if here[axis] + 1 < self.counts[axis] {
                            let price = (price * slope).max(1e-6 * each);
                            band.square(&[(at(0), 1.0), (at(1), -1.0)], price);
                        }
                    }
                    // Makes the system solvable for a lattice without rows.
                    band.square(&[(self.corner(here), 1.0)], 1e-9 * each.max(1e-3));
                }
            }
        }
    }
}

fn weights([u, v, w]: [f64; 3]) -> [f64; 8] {
    let side = |t: f64, high: usize| if high == 1 { t } else { 1.0 - t };
    core::array::from_fn(|n| side(u, n >> 2) * side(v, (n >> 1) & 1) * side(w, n & 1))
}

/// Interpolates between a cell's corners, linearly in each coordinate.
pub(super) fn between(corners: &[f64; 8], through: [f64; 3]) -> f64 {
    let weights = weights(through);
    (0..8).map(|n| corners[n] * weights[n]).sum()
}

impl InterpolationWeights {
    pub(super) fn value(&self, fit: &[f64]) -> f64 {
        (0..8).map(|n| fit[self.corners[n]] * self.weights[n]).sum()
    }
}

/// Returns a fit whose corners are at least the lowest of its values at the rows around them: beyond the rows a slope
/// is meaningless.
pub(super) fn floored(fit: &[f64], spots: &[InterpolationWeights]) -> Vec<f64> {
    let mut least = std::vec![f64::INFINITY; fit.len()];
    let mut lowest = f64::INFINITY;
    for spot in spots {
        let value = spot.value(fit);
        lowest = lowest.min(value);
        for corner in spot.corners {
            least[corner] = least[corner].min(value);
        }
    }
    let floors = least
        .iter()
        .map(|least| if least.is_finite() { *least } else { lowest });
    fit.iter()
        .zip(floors)
        .map(|(value, floor)| value.max(floor))
        .collect()
}

/// The fewest rows around a corner whose values limit it.
const FEWEST_AROUND: usize = 20;
/// The confidence of the limit that the rows around a corner set.
const CAP_CONFIDENCE: f64 = 0.95;

/// With too few rows for such a limit, the largest value is a limit with this tail: the largest of n errors grows
/// with the power 1/4 of n.
const TAIL: f64 = 0.25;

/// Returns the values of the rows in the cells around each corner, ascending.
pub(super) fn errors_around(
    corners: usize,
    spots: &[InterpolationWeights],
    values: &[f64],
) -> Vec<Vec<f64>> {
    let mut around = std::vec![Vec::new(); corners];
    for (spot, value) in spots.iter().zip(values) {
        for corner in spot.corners {
            around[corner].push(*value);
        }
    }
    for values in &mut around {
        values.sort_by(f64::total_cmp);
    }
    around
}

/// Returns a fit to the `q`-quantile whose corners are at most an upper confidence limit of that quantile of the
/// values around them: a slope is not extrapolated to errors that were not observed.
pub(super) fn capped(fit: &[f64], around: &[Vec<f64>], q: f64) -> Vec<f64> {
    let needed = libm::log(1.0 - CAP_CONFIDENCE) / libm::log(q);
    let limit = |values: &Vec<f64>| {
        let n = values.len();
        let largest = *values.last()?;
        if n < FEWEST_AROUND {
            return None;
        }
        let k = super::binomial::rank(n as u64, q, CAP_CONFIDENCE);
        match k.and_then(|k| usize::try_from(k).ok()) {
            Some(k) => Some(values[k - 1]),
            None => Some(largest + TAIL * libm::log(needed / n as f64)),
        }
    };
    fit.iter()
        .zip(around)
        .map(|(value, around)| limit(around).map_or(*value, |limit| value.min(limit)))
        .collect()
}

pub(super) fn share_of(logit: f64) -> f64 {
    1.0 / (1.0 + libm::exp(-logit))
}

/// The quantity that is fitted.
#[derive(Clone, Copy, Debug)]
pub(super) enum Target {
    /// The mean.
    Mean,
    /// A quantile.
    Quantile(f64),
    /// The logit of a share; values are 0 or 1.
    Share,
}

impl Target {
    fn fit(
        self,
        lattice: &Lattice,
        spots: &[&InterpolationWeights],
        values: &[f64],
        penalty: SmoothnessPenalty,
    ) -> Vec<f64> {
        match self {
            Self::Mean => lattice.mean(spots, values, penalty),
            Self::Quantile(q) => lattice.quantile(spots, values, q, penalty),
            Self::Share => lattice.share(spots, values, penalty),
        }
    }

    fn loss(self, value: f64, fit: f64) -> f64 {
        match self {
            Self::Mean => (value - fit) * (value - fit),
            Self::Quantile(q) => (value - fit) * (if value > fit { q } else { q - 1.0 }),
            Self::Share => libm::log1p(libm::exp(if value > 0.5 { -fit } else { fit })),
        }
    }
}

/// Chooses the smoothness penalty by 2-fold cross-validation, then refits on all rows. `folds` has the fold of each row:
/// rows that depend on each other must be in the same one.
pub(super) fn fit(
    lattice: &Lattice,
    target: Target,
    slope: f64,
    spots: &[InterpolationWeights],
    values: &[f64],
    folds: &[usize],
) -> Vec<f64> {
    use rayon::prelude::*;
    let pick = |keep: &dyn Fn(usize) -> bool| -> (Vec<&InterpolationWeights>, Vec<f64>) {
        let rows = (0..spots.len()).filter(|index| keep(*index));
        rows.map(|index| (&spots[index], values[index])).unzip()
    };
    let judge = |bend: f64, fold: usize| {
        let (learnt, known) = pick(&|index| folds[index] % FOLDS != fold);
        let (held, truth) = pick(&|index| folds[index] % FOLDS == fold);
        let fit = target.fit(lattice, &learnt, &known, SmoothnessPenalty { bend, slope });
        let losses = held.iter().zip(&truth);
        losses
            .map(|(spot, value)| target.loss(*value, spot.value(&fit)))
            .sum::<f64>()
    };
    let tries: Vec<(usize, usize)> = (0..BENDS.len())
        .flat_map(|bend| (0..FOLDS).map(move |fold| (bend, fold)))
        .collect();
    let losses: Vec<f64> = tries
        .par_iter()
        .map(|(bend, fold)| judge(BENDS[*bend], *fold))
        .collect();
    let of = |bend: usize| losses[bend * FOLDS..(bend + 1) * FOLDS].iter().sum::<f64>();
    let best = (0..BENDS.len()).fold(
        0,
        |best, bend| if of(bend) < of(best) { bend } else { best },
    );
    let (all, known) = pick(&|_| true);
    let bend = BENDS[best];
    target.fit(lattice, &all, &known, SmoothnessPenalty { bend, slope })
}

/// The number of columns that [`BandedMatrix::factorize`] subtracts at once.
const TOGETHER: usize = 4;

/// A symmetric matrix with a band around its diagonal: the lower half, row by row.
struct BandedMatrix {
    n: usize,
    width: usize,
    rows: Vec<f64>,
}

impl BandedMatrix {
    fn new(n: usize, width: usize) -> Self {
        let width = width.min(n.saturating_sub(1));
        Self {
            n,
            width,
            rows: std::vec![0.0; n * (width + 1)],
        }
    }

    /// Adds at row `i`, column `j <= i` within the band.
    fn add(&mut self, i: usize, j: usize, value: f64) {
        let place = self.place(i, j);
        self.rows[place] += value;
    }

    /// Adds `price` times the square of a sum.
    fn square(&mut self, terms: &[(usize, f64)], price: f64) {
        for (i, a) in terms {
            for (j, b) in terms {
                if j <= i {
                    self.add(*i, *j, price * a * b);
                }
            }
        }
    }

    /// Returns the place of row `i`, column `j <= i` within the band.
    const fn place(&self, i: usize, j: usize) -> usize {
        i * (self.width + 1) + self.width + j - i
    }

    /// Replaces the matrix by the factor `L` of `L L'`. Finished columns are subtracted from all that are right of them, [`TOGETHER`] at
    /// once, so each number is loaded and stored only once for all of these.
    fn factorize(&mut self) {
        let mut panel = [(); TOGETHER].map(|()| std::vec![0.0; self.width]);
        for first in (0..self.n).step_by(TOGETHER) {
            let next = self.n.min(first + TOGETHER);
            for (k, column) in (first..next).zip(&mut panel) {
                self.finish_column(k, next, column);
            }
            let [a, b, c, d] = &panel;
            for i in next..self.n.min(next + self.width) {
                let (of_a, of_b, of_c, of_d) = (a[i - next], b[i - next], c[i - next], d[i - next]);
                let row = self.place(i, next)..=self.place(i, i);
                let row = &mut self.rows[row];
                // All slices have one length, so the compiler removes the checks of the index.
                let length = row.len();
                let (a, b, c, d) = (&a[..length], &b[..length], &c[..length], &d[..length]);
                for (j, value) in row.iter_mut().enumerate() {
                    *value -= of_a * a[j];
                    *value -= of_b * b[j];
                    *value -= of_c * c[j];
                    *value -= of_d * d[j];
                }
            }
        }
    }

    /// Finishes column `k`, subtracts it from the columns between it and `next`, and copies its rows from `next` on into `column`,
    /// which is zero beyond the band.
    fn finish_column(&mut self, k: usize, next: usize, column: &mut [f64]) {
        let diagonal = self.place(k, k);
        let root = libm::sqrt(self.rows[diagonal].max(1e-12));
        self.rows[diagonal] = root;
        column.fill(0.0);
        for i in k + 1..self.n.min(k + self.width + 1) {
            let place = self.place(i, k);
            self.rows[place] /= root;
            let factor = self.rows[place];
            if i >= next {
                column[i - next] = factor;
            }
            for j in k + 1..next.min(i + 1) {
                let other = self.rows[self.place(j, k)];
                let place = self.place(i, j);
                self.rows[place] -= factor * other;
            }
        }
    }

    /// Solves in place: `L L' x = right`.
    fn solve(&mut self, right: &mut [f64]) {
        self.factorize();
        let (n, w) = (self.n, self.width);
        for i in 0..n {
            let row = i * (w + 1) + w - i;
            let mut sum = right[i];
            let first = i.saturating_sub(w);
            let known = self.rows[row + first..row + i].iter();
            for (factor, value) in known.zip(&right[first..i]) {
                sum -= factor * value;
            }
            right[i] = sum / self.rows[row + i];
        }
        for i in (0..n).rev() {
            let row = i * (w + 1) + w - i;
            right[i] /= self.rows[row + i];
            for j in i.saturating_sub(w)..i {
                right[j] -= self.rows[row + j] * right[i];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axes() -> [Axis; 3] {
        let even = |n: u32, by: f64| (0..=n).map(|k| 1.0 + by * f64::from(k)).collect();
        [
            Axis::new(even(6, 1.0), false).unwrap(),
            Axis::new(even(2, 10.0), false).unwrap(),
            Axis::new(even(5, 10.0), false).unwrap(),
        ]
    }

    /// Returns a number uniform between 0 and 1.
    fn even(k: u64) -> f64 {
        let bits = crate::random::mixed(k) >> 11;
        bits as f64 / (1u64 << 53) as f64
    }

    /// Rows all over the lattice, each with a number uniform between 0 and 1.
    fn rows(n: u64) -> Vec<([f64; 3], f64)> {
        (0..n)
            .map(|k| {
                let at = [
                    1.0 + 6.0 * even(4 * k),
                    1.0 + 20.0 * even(4 * k + 1),
                    1.0 + 50.0 * even(4 * k + 2),
                ];
                (at, even(4 * k + 3))
            })
            .collect()
    }

    fn spots(
        axes: &[Axis; 3],
        lattice: &Lattice,
        rows: &[([f64; 3], f64)],
    ) -> Vec<InterpolationWeights> {
        rows.iter()
            .map(|(at, _)| {
                let cell = [0, 1, 2].map(|i| axes[i].cell(at[i]).unwrap());
                lattice.spot(cell, [0, 1, 2].map(|i| axes[i].through(cell[i], at[i])))
            })
            .collect()
    }

    /// Systems of all sizes and bands around the number of columns that are subtracted at once.
    #[test]
    fn solution_of_a_banded_system_has_no_residual() {
        for n in 1..=3 * TOGETHER {
            for width in 0..n {
                let number = |k: usize| even(k as u64) - 0.5;
                let element = |i: usize, j: usize| match i - j {
                    0 => n as f64 + 1.0,
                    apart if apart <= width => number(i * n + j),
                    _ => 0.0,
                };
                let mut band = BandedMatrix::new(n, width);
                for i in 0..n {
                    for j in i.saturating_sub(width)..=i {
                        band.add(i, j, element(i, j));
                    }
                }
                let right: Vec<f64> = (0..n).map(|i| number(1_000 + i)).collect();
                let mut found = right.clone();
                band.solve(&mut found);
                for (i, right) in right.iter().enumerate() {
                    let product = |j: usize| element(i.max(j), i.min(j)) * found[j];
                    let off = (0..n).map(product).sum::<f64>() - right;
                    assert!(off.abs() < 1e-12, "n {n}, width {width}, row {i}: {off}");
                }
            }
        }
    }

    #[test]
    fn fits_equal_known_quantiles_and_shares() {
        let axes = axes();
        let lattice = Lattice::over(&axes);
        let rows = rows(6000);
        let spots = spots(&axes, &lattice, &rows);
        // A number uniform between 0 and 1 at each place, added to a sloped plane.
        let ground = |at: &[f64; 3]| 0.3 * at[0] + 0.02 * at[2];
        let values: Vec<f64> = rows.iter().map(|(at, u)| ground(at) + u).collect();
        let folds: Vec<usize> = (0..rows.len()).collect();
        let found = fit(
            &lattice,
            Target::Quantile(0.9),
            0.0,
            &spots,
            &values,
            &folds,
        );
        for (spot, (at, _)) in spots.iter().zip(&rows).step_by(37) {
            let off = spot.value(&found) - ground(at) - 0.9;
            assert!(off.abs() < 0.08, "{at:?}: {off}");
        }
        let mean = fit(&lattice, Target::Mean, 0.0, &spots, &values, &folds);
        let off = spots[7].value(&mean) - ground(&rows[7].0) - 0.5;
        assert!(off.abs() < 0.05, "{off}");
        let p = |at: &[f64; 3]| share_of(3.0 - 0.06 * at[2]);
        let hits: Vec<f64> = rows
            .iter()
            .map(|(at, u)| f64::from(u8::from(*u < p(at))))
            .collect();
        let logits = fit(&lattice, Target::Share, 0.0, &spots, &hits, &folds);
        for (spot, (at, _)) in spots.iter().zip(&rows).step_by(37) {
            let off = share_of(spot.value(&logits)) - p(at);
            assert!(off.abs() < 0.08, "{at:?}: {off}");
        }
    }
}
