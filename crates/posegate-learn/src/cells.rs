//! The cells of (d, phi, psi): fine ones, within which a shape is linear in each coordinate, and coarse ones,
//! which have enough rows for a bound.

use super::axis::{self, Axis, PARTS};
use super::document::{Corners, Edges};
use super::smooth::{InterpolationWeights, Lattice};

/// The three axes.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Cells {
    pub(super) axes: [Axis; 3],
    /// The number of fine cells of a coarse one along each axis.
    pub(super) parts: [usize; 3],
}

impl Cells {
    /// Returns cells over some places, each coarse one with about `each` of them; `None` without places.
    pub(super) fn over(places: &[[f64; 3]], each: f64) -> Option<Self> {
        Self::divided(places, axis::coarse_counts(places.len(), each), PARTS)
    }

    /// Returns such cells with more parts if the coarse cells are few.
    pub(super) fn fine_over(places: &[[f64; 3]], each: f64) -> Option<Self> {
        let coarse = axis::coarse_counts(places.len(), each);
        Self::divided(places, coarse, axis::parts(places.len(), coarse))
    }

    fn divided(places: &[[f64; 3]], coarse: [usize; 3], parts: [usize; 3]) -> Option<Self> {
        let of = |which: usize| {
            let numbers: Vec<f64> = places.iter().map(|at| at[which]).collect();
            axis::over(&numbers, which, coarse[which], parts[which])
        };
        Some(Self {
            axes: [of(0)?, of(1)?, of(2)?],
            parts,
        })
    }

    /// Returns the cells of a file; `None` if the edges do not ascend or do not form complete coarse cells.
    pub(super) fn of(edges: &Edges, parts: [usize; 3]) -> Option<Self> {
        if parts.contains(&0) {
            return None;
        }
        let whole = |edges: &Vec<f64>, parts: usize| {
            (edges.len() > parts && (edges.len() - 1).is_multiple_of(parts)).then(|| edges.clone())
        };
        Some(Self {
            axes: [
                Axis::new(whole(&edges.d_m, parts[0])?, true)?,
                Axis::new(whole(&edges.phi_deg, parts[1])?, false)?,
                Axis::new(whole(&edges.psi_deg, parts[2])?, false)?,
            ],
            parts,
        })
    }

    pub(super) fn edges(&self) -> Edges {
        let [d, phi, psi] = &self.axes;
        Edges {
            d_m: d.edges.clone(),
            phi_deg: phi.edges.clone(),
            psi_deg: psi.edges.clone(),
        }
    }

    /// Returns the number of fine cells along each axis.
    pub(super) fn fine(&self) -> [usize; 3] {
        [0, 1, 2].map(|i| self.axes[i].cells())
    }

    /// Returns the number of coarse cells along each axis.
    pub(super) fn coarse(&self) -> [usize; 3] {
        let fine = self.fine();
        [0, 1, 2].map(|i| fine[i] / self.parts[i])
    }

    /// Returns the fine cell of a place.
    pub(super) fn cell(&self, at: [f64; 3]) -> Option<[usize; 3]> {
        let [d, phi, psi] = &self.axes;
        Some([d.cell(at[0])?, phi.cell(at[1])?, psi.cell(at[2])?])
    }

    /// Returns the relative position of a place in a fine cell.
    pub(super) fn through(&self, cell: [usize; 3], at: [f64; 3]) -> [f64; 3] {
        [0, 1, 2].map(|i| self.axes[i].through(cell[i], at[i]))
    }

    pub(super) fn spot(&self, lattice: &Lattice, at: [f64; 3]) -> Option<InterpolationWeights> {
        let cell = self.cell(at)?;
        Some(lattice.spot(cell, self.through(cell, at)))
    }

    /// Returns the index of a coarse cell.
    pub(super) fn number(&self, coarse: [usize; 3]) -> usize {
        numbered(self.coarse(), coarse)
    }

    /// Returns the coarse cell that contains a fine one.
    pub(super) fn coarse_of(&self, fine: [usize; 3]) -> [usize; 3] {
        [0, 1, 2].map(|i| fine[i] / self.parts[i])
    }

    /// Returns the ends of a coarse cell along each axis.
    pub(super) fn ends(&self, coarse: [usize; 3]) -> [[f64; 2]; 3] {
        [0, 1, 2].map(|i| {
            let edges = &self.axes[i].edges;
            [
                edges[coarse[i] * self.parts[i]],
                edges[(coarse[i] + 1) * self.parts[i]],
            ]
        })
    }

    /// Returns every coarse cell, in the order of their indices.
    pub(super) fn each_coarse(&self) -> impl Iterator<Item = [usize; 3]> {
        each(self.coarse())
    }
}

/// Returns the index of a cell, given the counts along each axis.
pub(super) fn numbered(counts: [usize; 3], [i, j, k]: [usize; 3]) -> usize {
    (i * counts[1] + j) * counts[2] + k
}

/// Returns every cell, given the counts along each axis.
pub(super) fn each([a, b, c]: [usize; 3]) -> impl Iterator<Item = [usize; 3]> {
    (0..a).flat_map(move |i| (0..b).flat_map(move |j| (0..c).map(move |k| [i, j, k])))
}

/// Returns the values of a lattice in the nesting of a file.
pub(super) fn nested(cells: &Cells, values: &[f64]) -> Corners {
    let lattice = Lattice::over(&cells.axes);
    let [a, b, c] = cells.fine().map(|count| count + 1);
    let at = |i, j, k| values[lattice.corner([i, j, k])];
    (0..a)
        .map(|i| {
            (0..b)
                .map(|j| (0..c).map(|k| at(i, j, k)).collect())
                .collect()
        })
        .collect()
}

/// Returns the values of a file in the lattice's order; `None` if their number is not that of the cells'
/// corners, or one of them is not allowed.
pub(super) fn flat(
    cells: &Cells,
    corners: &Corners,
    allows: impl Fn(f64) -> bool,
) -> Option<Vec<f64>> {
    let [a, b, c] = cells.fine().map(|count| count + 1);
    let whole = corners.len() == a
        && corners
            .iter()
            .all(|rows| rows.len() == b && rows.iter().all(|row| row.len() == c));
    let values: Vec<f64> = corners.iter().flatten().flatten().copied().collect();
    (whole
        && values
            .iter()
            .all(|value| value.is_finite() && allows(*value)))
    .then_some(values)
}
