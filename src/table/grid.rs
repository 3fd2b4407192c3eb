//! The grid layout: for each yaw slab and row, the runs of cells that lie in the success set.
//!
//! # Bytes
//!
//! | offset in the layout | type | field |
//! |---|---|---|
//! | 0 | u8 | bytes of a column number: 1 (at most 255 columns) or 2 |
//! | 1 | u8, u16 | 0 |
//! | 4 | 8 bytes a slab | directory: u32 offset in the layout, u16 first row, u16 rows and a flag |
//! | | | the rows of the slabs; slabs whose rows are equal may share them |
//!
//! The flag is bit 15 of the count. Without it, each row is one run: first column, last column
//! (inclusive); a row without a run is written as all ones, zero. With it, a row may have any number
//! of runs: `rows + 1` u16 say where each row's runs start (in runs), then the runs follow, ascending
//! and with a gap between neighbours. Rows outside of a slab's rows have no run.

use super::Cells;
use super::bytes::{u16_at, u32_at};

const DIRECTORY: usize = 4;
const ENTRY: usize = 8;
const SEVERAL: u16 = 1 << 15;

/// A run of covered cells in a row, both ends inclusive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Run {
    /// First covered column.
    pub first: u16,
    /// Last covered column.
    pub last: u16,
}

/// The grid layout of a parsed table.
#[derive(Clone, Copy, Debug)]
pub struct Grid<'a> {
    bytes: &'a [u8],
    wide: bool,
}

/// The rows of one yaw slab.
#[derive(Clone, Copy, Debug)]
pub struct Slab<'a> {
    first_row: u16,
    rows: u16,
    /// Where each row's runs start, where a row may have several.
    starts: Option<&'a [u8]>,
    runs: &'a [u8],
    wide: bool,
}

impl<'a> Grid<'a> {
    /// Checks every directory entry and every run; `None` when one is out of range or the layout
    /// has bytes that no slab uses.
    pub(super) fn parse(bytes: &'a [u8], cells: &Cells) -> Option<Self> {
        let wide = match bytes.get(..DIRECTORY)? {
            [1, 0, 0, 0] => false,
            [2, 0, 0, 0] => true,
            _ => return None,
        };
        let grid = Self { bytes, wide };
        let mut end = usize::from(cells.slabs)
            .checked_mul(ENTRY)?
            .checked_add(DIRECTORY)?;
        let directory_end = end;
        for k in 0..cells.slabs {
            let (offset, slab) = grid.find(k)?;
            if offset < directory_end || offset > end {
                return None;
            }
            end = end.max(offset.checked_add(slab.byte_length())?);
            if slab.first_row.checked_add(slab.rows)? > cells.rows {
                return None;
            }
            slab.check(cells.columns)?;
        }
        (end == bytes.len()).then_some(grid)
    }

    /// The rows of slab `k`; a slab without rows past the last.
    #[must_use]
    pub fn slab(&self, k: u16) -> Slab<'a> {
        self.find(k).map_or(
            Slab {
                first_row: 0,
                rows: 0,
                starts: None,
                runs: &[],
                wide: self.wide,
            },
            |(_, slab)| slab,
        )
    }

    /// Bytes of the layout.
    #[must_use]
    pub const fn byte_length(&self) -> usize {
        self.bytes.len()
    }

    fn find(&self, k: u16) -> Option<(usize, Slab<'a>)> {
        let entry = usize::from(k).checked_mul(ENTRY)?.checked_add(DIRECTORY)?;
        let offset = usize::try_from(u32_at(self.bytes, entry)?).ok()?;
        let first_row = u16_at(self.bytes, entry.checked_add(4)?)?;
        let count = u16_at(self.bytes, entry.checked_add(6)?)?;
        let rows = count & !SEVERAL;
        let (starts, runs_at, runs) = if count & SEVERAL == 0 {
            (None, offset, usize::from(rows))
        } else {
            let length = usize::from(rows).checked_add(1)?.checked_mul(2)?;
            let runs_at = offset.checked_add(length)?;
            let starts = self.bytes.get(offset..runs_at)?;
            let runs = u16_at(starts, length.checked_sub(2)?)?;
            (Some(starts), runs_at, usize::from(runs))
        };
        let length = runs.checked_mul(run_length(self.wide))?;
        let slab = Slab {
            first_row,
            rows,
            starts,
            runs: self.bytes.get(runs_at..runs_at.checked_add(length)?)?,
            wide: self.wide,
        };
        Some((offset, slab))
    }
}

const fn run_length(wide: bool) -> usize {
    if wide { 4 } else { 2 }
}

impl<'a> Slab<'a> {
    /// First row that has runs.
    #[must_use]
    pub const fn first_row(&self) -> u16 {
        self.first_row
    }

    /// Number of rows from [`Slab::first_row`] on.
    #[must_use]
    pub const fn rows(&self) -> u16 {
        self.rows
    }

    /// The runs of a row, ascending; none for a row without.
    #[must_use]
    pub fn runs(&self, row: u16) -> Runs<'a> {
        self.span(row).map_or(
            Runs {
                slab: *self,
                next: 0,
                end: 0,
            },
            |(next, end)| Runs {
                slab: *self,
                next,
                end,
            },
        )
    }

    /// Indices of the first run of a row and of the one past its last.
    fn span(&self, row: u16) -> Option<(u16, u16)> {
        let row = row.checked_sub(self.first_row)?;
        if row >= self.rows {
            return None;
        }
        let next = row.checked_add(1)?;
        match self.starts {
            None => Some((row, next)),
            Some(starts) => {
                let at = |row: u16| u16_at(starts, usize::from(row).checked_mul(2)?);
                Some((at(row)?, at(next)?))
            }
        }
    }

    /// Run number `index`; `None` past the end and for an empty row.
    fn run(&self, index: u16) -> Option<Run> {
        let offset = usize::from(index).checked_mul(run_length(self.wide))?;
        let run = if self.wide {
            Run {
                first: u16_at(self.runs, offset)?,
                last: u16_at(self.runs, offset.checked_add(2)?)?,
            }
        } else {
            Run {
                first: u16::from(*self.runs.get(offset)?),
                last: u16::from(*self.runs.get(offset.checked_add(1)?)?),
            }
        };
        (run.first <= run.last).then_some(run)
    }

    fn byte_length(&self) -> usize {
        self.starts
            .map_or(0, <[u8]>::len)
            .saturating_add(self.runs.len())
    }

    /// `Some` when every run of every row is in range.
    fn check(&self, columns: u16) -> Option<()> {
        let all_ones = if self.wide { u16::MAX } else { 0xff };
        let mut at = 0;
        for row in 0..self.rows {
            let (next, end) = self.span(self.first_row.checked_add(row)?)?;
            if next != at || end < next {
                return None;
            }
            at = end;
            let mut free = 0u16;
            for index in next..end {
                let offset = usize::from(index).checked_mul(run_length(self.wide))?;
                match self.run(index) {
                    Some(run) => {
                        if run.first < free || run.last >= columns {
                            return None;
                        }
                        free = run.last.saturating_add(2);
                    }
                    None => {
                        // An empty row has one spelling, and no place beside other runs.
                        let spelled = if self.wide {
                            (
                                u16_at(self.runs, offset)?,
                                u16_at(self.runs, offset.checked_add(2)?)?,
                            )
                        } else {
                            (
                                u16::from(*self.runs.get(offset)?),
                                u16::from(*self.runs.get(offset.checked_add(1)?)?),
                            )
                        };
                        if self.starts.is_some() || spelled != (all_ones, 0) {
                            return None;
                        }
                    }
                }
            }
        }
        Some(())
    }
}

/// The runs of one row.
#[derive(Clone, Debug)]
pub struct Runs<'a> {
    slab: Slab<'a>,
    next: u16,
    end: u16,
}

impl Iterator for Runs<'_> {
    type Item = Run;

    fn next(&mut self) -> Option<Run> {
        if self.next >= self.end {
            return None;
        }
        let run = self.slab.run(self.next);
        self.next = self.next.saturating_add(1);
        run
    }
}
