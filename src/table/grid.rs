//! The grid layout: for each yaw slab and row, the runs of cells that lie in the success set.
//!
//! # Bytes
//!
//! | offset in the layout | type | field |
//! |---|---|---|
//! | 0 | u8 | bytes of a column number: 1 (at most 255 columns) or 2 |
//! | 1 | u8, u16 | 0 |
//! | 4 | 8 bytes per slab | directory: u32 offset in the layout, u16 first row, u16 rows and a flag |
//! | | | the rows of the slabs; slabs whose rows are equal may share them |
//!
//! The flag is bit 15 of the count. Without it, each row is one run: first column, last column
//! (inclusive); a row without a run is written as all ones, zero. With it, a row may have any number
//! of runs: `rows + 1` u16 give the index at which each row's runs start. The runs follow, ascending
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
    slabs: u16,
    wide: bool,
}

#[cfg(feature = "defmt")]
impl defmt::Format for Grid<'_> {
    fn format(&self, f: defmt::Formatter<'_>) {
        defmt::write!(f, "Grid {{ slabs: {=u16} }}", self.slabs);
    }
}

/// The rows of one yaw slab.
#[derive(Clone, Copy, Debug)]
pub struct Slab<'a> {
    first_row: u16,
    rows: u16,
    /// The index at which each row's runs start, if rows may have several runs.
    starts: Option<&'a [u8]>,
    runs: &'a [u8],
    wide: bool,
}

#[cfg(feature = "defmt")]
impl defmt::Format for Slab<'_> {
    fn format(&self, f: defmt::Formatter<'_>) {
        let Self {
            first_row, rows, ..
        } = self;
        defmt::write!(
            f,
            "Slab {{ first_row: {=u16}, rows: {=u16} }}",
            first_row,
            rows
        );
    }
}

impl<'a> Grid<'a> {
    /// Checks every directory entry and every run. Returns `None` if one is out of range or if the
    /// layout has bytes that no slab uses.
    pub(super) fn parse(bytes: &'a [u8], cells: &Cells) -> Option<Self> {
        let wide = match bytes.get(..DIRECTORY)? {
            [1, 0, 0, 0] => false,
            [2, 0, 0, 0] => true,
            _ => return None,
        };
        let slabs = cells.slabs;
        let grid = Self { bytes, slabs, wide };
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

    /// Returns the rows of slab `k`, or a slab without rows past the last one.
    #[must_use]
    pub fn slab(&self, k: u16) -> Slab<'a> {
        self.find(k).filter(|_| k < self.slabs).map_or(
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

    /// Returns the number of bytes of the layout.
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
    /// Returns the first row that has runs.
    #[must_use]
    pub const fn first_row(&self) -> u16 {
        self.first_row
    }

    /// Returns the number of rows from [`Slab::first_row`] on.
    #[must_use]
    pub const fn rows(&self) -> u16 {
        self.rows
    }

    /// Returns the runs of a row, ascending; none for an empty row.
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

    /// Returns the index of the first run of a row, and the index after its last run.
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

    /// Returns run number `index`, or `None` past the end and for an empty row.
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

    /// Returns `Some` if every run of every row is in range.
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
                        // An empty row has exactly one encoding, and is not allowed next to other
                        // runs.
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
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
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

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::num::BinaryAngle;

    /// The rows of a slab to be written: the first row, and the runs of each row.
    #[derive(Clone)]
    pub(crate) struct Rows {
        pub first_row: u16,
        pub runs: Vec<Vec<(u16, u16)>>,
    }

    pub(crate) fn bytes_of_slab(rows: &Rows, wide: bool, several: bool) -> Vec<u8> {
        let mut bytes = Vec::new();
        if several {
            let mut start = 0u16;
            bytes.extend(start.to_le_bytes());
            for row in &rows.runs {
                start += row.len() as u16;
                bytes.extend(start.to_le_bytes());
            }
        }
        for row in &rows.runs {
            let empty = [(if wide { u16::MAX } else { 0xff }, 0)];
            let spelled = match row.len() {
                0 if !several => &empty[..],
                count => {
                    assert!(several || count == 1);
                    row
                }
            };
            for (first, last) in spelled {
                if wide {
                    bytes.extend([first.to_le_bytes(), last.to_le_bytes()].concat());
                } else {
                    bytes.extend([*first as u8, *last as u8]);
                }
            }
        }
        bytes
    }

    /// Returns the bytes of a layout, one slab after the other.
    pub(crate) fn layout(slabs: &[Rows], wide: bool, several: bool) -> Vec<u8> {
        let mut bytes = vec![if wide { 2 } else { 1 }, 0, 0, 0];
        let mut rows = Vec::new();
        for slab in slabs {
            let offset = DIRECTORY + ENTRY * slabs.len() + rows.len();
            let count = slab.runs.len() as u16 | if several { SEVERAL } else { 0 };
            bytes.extend((offset as u32).to_le_bytes());
            bytes.extend(slab.first_row.to_le_bytes());
            bytes.extend(count.to_le_bytes());
            rows.extend(bytes_of_slab(slab, wide, several));
        }
        bytes.extend(rows);
        bytes
    }

    fn cells(columns: u16, rows: u16, slabs: u16) -> Cells {
        Cells {
            x_lo_um: 0,
            y_lo_um: 0,
            step_um: 1000,
            columns,
            rows,
            yaw_lo: BinaryAngle(0),
            yaw_span: 1 << 20,
            slabs,
        }
    }

    fn rows(first_row: u16, runs: &[&[(u16, u16)]]) -> Rows {
        Rows {
            first_row,
            runs: runs.iter().map(|row| row.to_vec()).collect(),
        }
    }

    fn is_grid(bytes: &[u8], cells: &Cells) -> bool {
        Grid::parse(bytes, cells).is_some()
    }

    /// Rows of 10 columns: 5 rows from the second on in the first slab, none in the second slab.
    fn two_slabs() -> [Rows; 2] {
        let full = [(0, 9)];
        let runs: [&[(u16, u16)]; 5] = [&full, &[(3, 3)], &[], &[(9, 9)], &[(0, 0)]];
        [rows(1, &runs), rows(6, &[])]
    }

    #[test]
    fn grid_reads_back_written_runs() {
        let one = two_slabs();
        let mut more = one.clone();
        more[0].runs[1] = vec![(0, 1), (3, 4), (6, 9)];
        for (slabs, wide, several) in [
            (&one, false, false),
            (&one, true, false),
            (&one, false, true),
            (&more, false, true),
            (&more, true, true),
        ] {
            let bytes = layout(slabs, wide, several);
            let grid = Grid::parse(&bytes, &cells(10, 6, 2)).unwrap();
            assert_eq!(grid.byte_length(), bytes.len());
            for (k, written) in slabs.iter().enumerate() {
                let slab = grid.slab(k as u16);
                assert_eq!(slab.first_row(), written.first_row);
                assert_eq!(usize::from(slab.rows()), written.runs.len());
                for row in 0..10u16 {
                    let read: Vec<_> = slab.runs(row).map(|run| (run.first, run.last)).collect();
                    let written = row
                        .checked_sub(written.first_row)
                        .and_then(|row| written.runs.get(usize::from(row)));
                    assert_eq!(read, written.cloned().unwrap_or_default(), "{k} {row}");
                }
            }
            // Every shorter length and every additional byte is refused.
            for length in 0..bytes.len() {
                assert!(!is_grid(&bytes[..length], &cells(10, 6, 2)));
            }
            let mut longer = bytes.clone();
            longer.push(0);
            assert!(!is_grid(&longer, &cells(10, 6, 2)));
        }
    }

    #[test]
    fn other_column_width_is_refused() {
        for head in [[0, 0, 0, 0], [3, 0, 0, 0], [1, 1, 0, 0], [2, 0, 0, 1]] {
            let mut bytes = layout(&two_slabs(), head[0] == 2, false);
            bytes[..4].copy_from_slice(&head);
            assert!(!is_grid(&bytes, &cells(10, 6, 2)), "{head:?}");
        }
    }

    #[test]
    fn rows_and_columns_end_with_the_cells() {
        for wide in [false, true] {
            for several in [false, true] {
                let bytes = layout(&two_slabs(), wide, several);
                assert!(is_grid(&bytes, &cells(10, 6, 2)));
                assert!(is_grid(&bytes, &cells(11, 7, 2)));
                assert!(!is_grid(&bytes, &cells(9, 6, 2)));
                assert!(!is_grid(&bytes, &cells(10, 5, 2)));
            }
        }
    }

    /// Slabs may share rows. They may not lie in the directory, nor leave bytes between them.
    #[test]
    fn slabs_lie_close_behind_the_directory() {
        let slab = rows(0, &[&[(0, 9)], &[(2, 5)]]);
        let good = layout(&[slab.clone(), slab.clone()], false, false);
        let cells = cells(10, 2, 2);
        let with = |second: usize, body: usize| {
            let mut bytes = good[..DIRECTORY + 2 * ENTRY + body].to_vec();
            bytes[DIRECTORY + ENTRY..][..4].copy_from_slice(&(second as u32).to_le_bytes());
            bytes
        };
        let end = DIRECTORY + 2 * ENTRY;
        assert!(is_grid(&with(end + 4, 8), &cells));
        assert!(is_grid(&with(end, 4), &cells));
        // A row of the first slab is also a row of the second.
        assert!(is_grid(&with(end + 2, 6), &cells));
        assert!(!is_grid(&with(end - 1, 4), &cells));
        // A byte that no slab uses.
        let mut gap = with(end + 5, 4);
        gap.extend([0, 0, 9, 2, 5]);
        assert!(!is_grid(&gap, &cells));
        // Even a slab without rows may not lie in the directory.
        let mut none = layout(&[rows(0, &[]), rows(0, &[])], false, false);
        assert!(is_grid(&none, &cells));
        none[DIRECTORY..][..4].copy_from_slice(&(end as u32 - 1).to_le_bytes());
        assert!(!is_grid(&none, &cells));
    }

    #[test]
    fn empty_row_has_one_encoding() {
        for (wide, ones) in [(false, 0xff), (true, u16::MAX)] {
            let with = |first: u16, last: u16, several: bool| {
                let bytes = layout(&[rows(0, &[&[(first, last)]])], wide, several);
                is_grid(&bytes, &cells(10, 1, 1))
            };
            assert!(with(ones, 0, false));
            for (first, last) in [(ones, 1), (ones - 1, 0), (5, 4), (9, 0)] {
                assert!(!with(first, last, false), "{first} {last}");
            }
            assert!(with(4, 4, false) && with(4, 4, true));
            // If a row may have several runs, an empty row has no run at all.
            assert!(!with(ones, 0, true) && !with(5, 4, true));
            assert!(is_grid(
                &layout(&[rows(0, &[&[]])], wide, true),
                &cells(10, 1, 1)
            ));
        }
    }

    #[test]
    fn runs_ascend_and_leave_a_gap() {
        for wide in [false, true] {
            let with = |runs: &[(u16, u16)]| {
                let bytes = layout(&[rows(0, &[runs, &[(0, 9)]])], wide, true);
                is_grid(&bytes, &cells(10, 2, 1))
            };
            assert!(with(&[(0, 3), (5, 9)]));
            for bad in [
                [(0, 3), (4, 9)],
                [(0, 3), (3, 9)],
                [(5, 9), (0, 3)],
                [(0, 3), (5, 10)],
            ] {
                assert!(!with(&bad), "{bad:?}");
            }
        }
    }

    #[test]
    fn starts_begin_with_the_first_run_and_ascend() {
        let runs = [(0u16, 1u16), (3, 4), (6, 7)];
        let with = |starts: &[u16]| {
            let count = *starts.last().unwrap();
            let slab = rows(0, &vec![&[][..]; starts.len() - 1]);
            let mut bytes = layout(&[slab], false, true);
            bytes.truncate(DIRECTORY + ENTRY);
            bytes.extend(starts.iter().flat_map(|start| start.to_le_bytes()));
            for (first, last) in &runs[..usize::from(count)] {
                bytes.extend([*first as u8, *last as u8]);
            }
            is_grid(&bytes, &cells(10, 3, 1))
        };
        assert!(with(&[0, 1, 2, 3]) && with(&[0, 2, 2, 3]) && with(&[0, 0, 0, 3]));
        assert!(!with(&[1, 2, 3]));
        assert!(!with(&[0, 2, 1, 3]));
    }

    #[test]
    fn slab_past_the_last_has_no_rows() {
        let mut runs: Vec<&[(u16, u16)]> = vec![&[(0, 0)]; 300];
        runs[3] = &[(0, 1)];
        let bytes = layout(&[rows(0, &runs)], false, false);
        let grid = Grid::parse(&bytes, &cells(10, 300, 1)).unwrap();
        for k in (1..=u16::MAX).step_by(crate::test_iterations(1, 257) as usize) {
            assert_eq!(grid.slab(k).rows(), 0, "{k}");
        }
    }
}
