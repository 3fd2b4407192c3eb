//! Views from which an observation is accurate enough: boxes of (d, phi, psi) in which both bounds are within a
//! limit.

use super::error_model::ErrorModel;

/// Views in which both bounds are within a limit, ends included. [`Detection::at`](super::Detection::at) defines d, phi
/// and psi.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViewBox {
    /// Smallest and largest distance, metres; 0 as the smallest means no limit.
    pub d: [f64; 2],
    /// Largest phi, degrees; the smallest is 0.
    pub phi_max_deg: f64,
    /// Smallest and largest psi, degrees; 0 as the smallest means no limit.
    pub psi_deg: [f64; 2],
    /// The largest bounds in the box, metres and degrees.
    pub bounds: [f64; 2],
}

/// Number of parts of each fine cell along d, phi and psi.
const PARTS: [usize; 3] = [4, 2, 4];
/// The most boxes.
const MOST: usize = 8;
/// A box that adds less than this share of all good parts is not returned.
const WORTH: f64 = 0.005;
/// Distance of boxes from the edges of cells: there the larger bound of two neighbours applies.
const INSIDE: f64 = 1e-9;
/// Distance of the bounds' logarithms from those of the limits, for rounding errors.
const MARGIN: f64 = 1e-9;

impl ErrorModel {
    /// Returns at most eight boxes, which may overlap, in each of which both bounds are at most `translation` (m) and
    /// `yaw_deg` everywhere. Views that would need many more boxes are not covered.
    #[must_use]
    pub fn views(&self, translation: f64, yaw_deg: f64) -> Vec<ViewBox> {
        self.views_within(|_| [translation, yaw_deg])
    }

    /// Returns the boxes for limits that depend on the distance: `allowed` returns the limits, metres and degrees, for
    /// views up to a distance (m). They must not grow with the distance.
    #[must_use]
    pub fn views_within(&self, allowed: impl Fn(f64) -> [f64; 2]) -> Vec<ViewBox> {
        // A success set cannot exclude small phi.
        if self.cells().axes[1].edges[0] > 0.0 {
            return Vec::new();
        }
        let good = self.good(allowed);
        let (nd, np, nq) = (good.counts[0], good.counts[1], good.counts[2]);
        let mut boxes: Vec<[usize; 5]> = Vec::new();
        for phi in 1..=np {
            let column = |i: usize, k: usize| (0..phi).all(|j| good.at([i, j, k]));
            let columns: Vec<bool> = (0..nd * nq).map(|n| column(n / nq, n % nq)).collect();
            largest(&columns, [nd, nq], &mut |[i0, i1, k0, k1]| {
                boxes.push([i0, i1, phi, k0, k1]);
            });
        }
        let mut left: Vec<bool> = good.cells.clone();
        let all = left.iter().filter(|cell| **cell).count();
        let mut chosen = Vec::new();
        while chosen.len() < MOST {
            let gain = |[i0, i1, phi, k0, k1]: [usize; 5]| -> usize {
                (i0..i1)
                    .map(|i| {
                        (0..phi)
                            .map(|j| (k0..k1).filter(|k| left[good.number([i, j, *k])]).count())
                            .sum::<usize>()
                    })
                    .sum()
            };
            let Some(best) = boxes.iter().copied().max_by_key(|b| gain(*b)) else {
                break;
            };
            let gained = gain(best);
            if gained == 0 || (gained as f64) < WORTH * all as f64 {
                break;
            }
            let [i0, i1, phi, k0, k1] = best;
            for i in i0..i1 {
                for j in 0..phi {
                    for k in k0..k1 {
                        let number = good.number([i, j, k]);
                        left[number] = false;
                    }
                }
            }
            chosen.push(self.ends(best, good.worst(best)));
        }
        chosen
    }

    /// Finds the parts of cells whose bounds are within the limits everywhere. The logarithms of the bounds are linear
    /// in each coordinate within a cell, so they are largest at a corner of a part.
    fn good(&self, allowed: impl Fn(f64) -> [f64; 2]) -> Parts {
        let fine = self.cells().fine();
        let counts = [0, 1, 2].map(|i| fine[i] * PARTS[i]);
        // The limits of each part along d. If a limit is not above 0, its logarithm is NaN or negative infinity, and no
        // bound is within it.
        let limits: Vec<[f64; 2]> = (0..counts[0])
            .map(|part| {
                let [metres, degrees] = allowed(self.end(0, part + 1));
                [metres, degrees.to_radians()].map(|limit| libm::log(limit) - MARGIN)
            })
            .collect();
        let mut parts = Parts {
            counts,
            cells: Vec::new(),
            logs: Vec::new(),
        };
        for at in super::cells::each(counts) {
            let cell = [0, 1, 2].map(|i| at[i] / PARTS[i]);
            let corner = |n: usize| {
                let ends = [n >> 2, (n >> 1) & 1, n & 1];
                let through = [0, 1, 2].map(|i| {
                    let axis = &self.cells().axes[i];
                    let share = (at[i] % PARTS[i] + ends[i]) as f64 / PARTS[i] as f64;
                    axis.through(cell[i], axis.at(cell[i], share))
                });
                self.logs_in(cell, through)
            };
            let unknown = [f64::INFINITY; 2];
            let logs = (0..8).fold([f64::NEG_INFINITY; 2], |most, n| {
                let logs = corner(n).unwrap_or(unknown);
                [most[0].max(logs[0]), most[1].max(logs[1])]
            });
            let limits = limits[at[0]];
            parts
                .cells
                .push(logs[0] <= limits[0] && logs[1] <= limits[1]);
            parts.logs.push(logs);
        }
        parts
    }

    /// Returns the beginning of a part along an axis: metres, degrees.
    fn end(&self, which: usize, part: usize) -> f64 {
        let axis = &self.cells().axes[which];
        let cell = (part / PARTS[which]).min(axis.cells() - 1);
        let share = (part - cell * PARTS[which]) as f64 / PARTS[which] as f64;
        axis.at(cell, share)
    }

    fn ends(&self, [i0, i1, phi, k0, k1]: [usize; 5], logs: [f64; 2]) -> ViewBox {
        let end = |which: usize, part: usize| self.end(which, part);
        let [metres, radians] = logs.map(|log| libm::exp(log + MARGIN));
        let least = |which: usize, part: usize| match end(which, part) {
            low if low > 0.0 => low + INSIDE,
            _ => 0.0,
        };
        ViewBox {
            d: [least(0, i0), end(0, i1) - INSIDE],
            phi_max_deg: end(1, phi) - INSIDE,
            psi_deg: [least(2, k0), end(2, k1) - INSIDE],
            bounds: [metres, radians.to_degrees()],
        }
    }
}

/// The parts of all fine cells.
struct Parts {
    counts: [usize; 3],
    cells: Vec<bool>,
    /// The largest logarithms of the bounds in each part.
    logs: Vec<[f64; 2]>,
}

impl Parts {
    fn number(&self, at: [usize; 3]) -> usize {
        super::cells::numbered(self.counts, at)
    }

    fn at(&self, at: [usize; 3]) -> bool {
        self.cells[self.number(at)]
    }

    /// Returns the largest logarithms of the bounds in a box.
    fn worst(&self, [i0, i1, phi, k0, k1]: [usize; 5]) -> [f64; 2] {
        let mut most = [f64::NEG_INFINITY; 2];
        for i in i0..i1 {
            for j in 0..phi {
                for k in k0..k1 {
                    let logs = self.logs[self.number([i, j, k])];
                    most = [most[0].max(logs[0]), most[1].max(logs[1])];
                }
            }
        }
        most
    }
}

/// Calls `found` with every rectangle of good columns that cannot be enlarged on any side.
fn largest(columns: &[bool], [nd, nq]: [usize; 2], found: &mut impl FnMut([usize; 4])) {
    for i0 in 0..nd {
        let mut good = std::vec![true; nq];
        for i1 in i0 + 1..=nd {
            for (k, good) in good.iter_mut().enumerate() {
                *good &= columns[(i1 - 1) * nq + k];
            }
            let mut k0 = 0;
            while k0 < nq {
                if !good[k0] {
                    k0 += 1;
                    continue;
                }
                let k1 = (k0..nq).find(|k| !good[*k]).unwrap_or(nq);
                let row = |i: usize| (k0..k1).all(|k| columns[i * nq + k]);
                if !(i0 > 0 && row(i0 - 1)) && !(i1 < nd && row(i1)) {
                    found([i0, i1, k0, k1]);
                }
                k0 = k1;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rectangles_are_the_largest() {
        // A stair: three columns wide at the bottom, one wide at the top.
        let columns = [true, true, true, true, false, false];
        let mut all = Vec::new();
        largest(&columns, [2, 3], &mut |rectangle| all.push(rectangle));
        assert_eq!(all, [[0, 1, 0, 3], [0, 2, 0, 1]]);
    }
}
