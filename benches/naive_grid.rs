//! The baseline: a success set as one bit per cell, as a simple program would store it.
//!
//! Single-precision floats, a bounding box, and a test of every cell in it. It is unsound between
//! cells' middles and borders, and slow. It is here only for comparison with the real implementation
//! (`ci.sh budgets`).

use posegate::table::Table;

/// One bit per cell: columns fastest, then rows, then slabs.
pub struct BitGrid<'a> {
    bits: &'a [u8],
    count: [i32; 3],
    low: [f32; 3],
    step: [f32; 3],
}

impl<'a> BitGrid<'a> {
    /// Unpacks a table's grid into `bits`; `None` if `bits` has fewer than one bit per cell.
    pub fn unpack(table: &Table<'_>, bits: &'a mut [u8]) -> Option<Self> {
        let cells = table.cells();
        let grid = table.grid()?;
        let (columns, rows, slabs) = (cells.columns, cells.rows, cells.slabs);
        let all = usize::from(columns) * usize::from(rows) * usize::from(slabs);
        if bits.len() * 8 < all {
            return None;
        }
        bits.fill(0);
        for slab in 0..slabs {
            for row in 0..rows {
                for run in grid.slab(slab).runs(row) {
                    for column in run.first..=run.last {
                        let index = (usize::from(slab) * usize::from(rows) + usize::from(row))
                            * usize::from(columns)
                            + usize::from(column);
                        *bits.get_mut(index / 8)? |= 1 << (index % 8);
                    }
                }
            }
        }
        let turn = core::f32::consts::TAU / 4_294_967_296.0;
        Some(Self {
            bits,
            count: [i32::from(columns), i32::from(rows), i32::from(slabs)],
            low: [
                cells.x_lo_um as f32 * 1e-6,
                cells.y_lo_um as f32 * 1e-6,
                cells.yaw_lo.signed() as f32 * turn,
            ],
            step: [
                cells.step_um as f32 * 1e-6,
                cells.step_um as f32 * 1e-6,
                cells.yaw_span as f32 * turn / f32::from(slabs),
            ],
        })
    }

    /// Returns `true` if every cell whose middle lies in `{ e' information e <= r2 }` about `mean`
    /// is covered. `reach` is the ellipsoid's extent on each axis.
    pub fn contains(
        &self,
        mean: [f32; 3],
        information: &[[f32; 3]; 3],
        reach: [f32; 3],
        r2: f32,
    ) -> bool {
        let index = |value: f32, axis: usize| ((value - self.low[axis]) / self.step[axis]) as i32;
        let from = [0, 1, 2].map(|axis| index(mean[axis] - reach[axis], axis));
        let to = [0, 1, 2].map(|axis| index(mean[axis] + reach[axis], axis));
        for slab in from[2]..=to[2] {
            for row in from[1]..=to[1] {
                for column in from[0]..=to[0] {
                    let cell = [column, row, slab];
                    let e = [0, 1, 2].map(|axis| {
                        self.low[axis] + (cell[axis] as f32 + 0.5) * self.step[axis] - mean[axis]
                    });
                    let mut square = 0.0;
                    for (i, line) in information.iter().enumerate() {
                        square += e[i] * (line[0] * e[0] + line[1] * e[1] + line[2] * e[2]);
                    }
                    if square <= r2 && !self.covered(cell) {
                        return false;
                    }
                }
            }
        }
        true
    }

    fn covered(&self, cell: [i32; 3]) -> bool {
        if (0..3).any(|axis| cell[axis] < 0 || cell[axis] >= self.count[axis]) {
            return false;
        }
        let index = ((cell[2] * self.count[1] + cell[1]) * self.count[0] + cell[0]) as usize;
        self.bits[index / 8] >> (index % 8) & 1 == 1
    }
}
