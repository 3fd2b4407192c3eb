//! Success sets as bytes in flash: format version 1.
//!
//! [`Table::parse`] is the only entry point. It checks the magic, the version, every field, every run and the CRC over
//! all bytes. After it has returned `Ok`, no accessor can fail. Every cell that an accessor reports as covered was
//! inside the success set when the table was proven (`posegate table verify`). A table borrows its bytes; nothing is
//! copied.
//!
//! ```
//! use posegate::table::{Table, TableError};
//!
//! let bytes = include_bytes!("../../examples/tables/dock.posegate");
//! let table = Table::parse(bytes)?;
//! assert_eq!(table.task(), "dock");
//! assert_eq!(table.epsilon(), 0.99);
//!
//! // One flipped bit, anywhere: not a table.
//! let mut damaged = bytes.to_vec();
//! damaged[200] ^= 1;
//! assert_eq!(Table::parse(&damaged).err(), Some(TableError::Checksum));
//! # Ok::<(), TableError>(())
//! ```
//!
//! # Bytes (little-endian)
//!
//! | offset | type | field |
//! |---|---|---|
//! | 0 | 8 bytes | magic `POSEGATE` |
//! | 8 | u16 | format version, 1 |
//! | 10 | u16 | header length, 176 |
//! | 12 | u32 | total length, the CRC included |
//! | 16 | i32, i32 | goal pose x, y in the world, um |
//! | 24 | u32 | goal yaw, 2^-32 turn |
//! | 28 | i32, i32 | cosine and sine of the goal yaw, 2^-30, within one unit |
//! | 36 | i32, i32 | lower corner of the cells, x, y in the goal frame, um |
//! | 44 | u32 | edge of a cell in x and y, um |
//! | 48 | u16, u16 | cells along x, rows along y |
//! | 52 | u32 | lower end of the yaw range in the goal frame, 2^-32 turn |
//! | 56 | u32 | width of the yaw range, 2^-32 turn; 0 is the whole circle |
//! | 60 | u16 | yaw slabs |
//! | 62 | u16 | 0 |
//! | 64 | u32 | squared radius of the site's confidence, 2^-16, rounded up |
//! | 68 | u32, u32 | grid layout: offset from the start, length; 0, 0 if there is none |
//! | 76 | u32, u32 | facet layout: offset from the start, length; 0, 0 if there is none |
//! | 84 | f64 | epsilon, the site's confidence (information; the radius decides) |
//! | 92 | u32 | sight record of 140 bytes: offset from the start; 0 if there is none |
//! | 96 | 32 bytes | SHA-256 of the site file |
//! | 128 | 32 bytes | task name, UTF-8, zeros after it |
//! | 160 | 16 bytes | version of the tool that made it, UTF-8, zeros after it |
//! | 176 | | the layouts, and the sight record ([`SightRecord`] has its bytes) |
//! | end - 4 | u32 | CRC-32C (Castagnoli) of all bytes before |
//!
//! For the width w, slab k of n covers the closed yaw interval `[lo + floor(k w / n), lo + floor((k + 1) w / n)]`. The
//! edges are integers, and neighbours share one. Cell i along x covers the closed interval
//! `[lo + i step, lo + (i + 1) step]`; the same applies to rows along y. See [`Grid`] for the layout.

use crate::num::{BinaryAngle, Divisor, clamped};
use crate::parts;
use crate::pose::{GoalFrame, Pose};
use crate::set::RadiusSquared;

pub use self::checksum::{checksum, checksum_continued};
pub use self::facets::{
    Axes, Facet, Facets, Frame, LARGEST_UNIT, LONGEST_LEVER, NORMAL_BITS, Piece,
};
pub use self::grid::{Grid, Run, Runs, Slab};
pub use self::sight::{
    EDGE_BITS, FARTHEST_CAMERA_UM, LARGEST_HEIGHT_UM, LARGEST_SIGHT_UM, PIXEL_BITS, SIGHT_LENGTH,
    SightRecord,
};
pub use self::worst::WorstCase;
pub(crate) use self::worst::{MOST_SLABS, MOST_UNION_STEPS};

mod bytes;
mod checksum;
mod facets;
mod grid;
mod sight;
mod worst;

use bytes::{bytes_at, i32_at, padded_name, u16_at, u32_at, u64_at};

/// The first eight bytes of a table.
pub const MAGIC: [u8; 8] = *b"POSEGATE";
/// The format version that this crate reads and writes.
pub const VERSION: u16 = 1;
/// Bytes of the header.
pub const HEADER_LENGTH: usize = 176;
/// Offset of the site's digest in the header.
const SITE_DIGEST_AT: usize = 96;
/// Bytes of the checksum at the end.
pub const CRC_LENGTH: usize = 4;
/// Largest distance of a cell from the goal on an axis, micrometres (2^27, 134 m).
pub const LARGEST_REACH_UM: i32 = 1 << 27;

/// Returns the checksum in the last four bytes of a table, read from memory at each call; 0 if there are fewer than
/// four bytes.
#[inline]
pub(crate) fn stored_checksum(bytes: &[u8]) -> u32 {
    core::hint::black_box(bytes)
        .last_chunk()
        .map_or(0, |crc| u32::from_le_bytes(*crc))
}

/// Returns the squared radius in the header of a table, read from memory at each call.
pub(crate) fn stored_radius_squared(bytes: &[u8]) -> Option<RadiusSquared> {
    RadiusSquared::from_q16(u32_at(core::hint::black_box(bytes), 64)?)
}

/// Returns a mark of the bytes of a table, read from memory at each call: the stated length, the first four bytes of
/// the site digest and the checksum, combined by exclusive or. A change of one of them changes the mark; changes of
/// several cancel with a probability of 2^-32. Returns 0 for bytes without a header.
#[cfg_attr(small_code, inline(never))]
#[cfg_attr(not(small_code), inline)]
pub(crate) fn stored_mark(bytes: &[u8]) -> u32 {
    let bytes = core::hint::black_box(bytes);
    let Some((header, crc)) = bytes
        .first_chunk::<{ SITE_DIGEST_AT + 4 }>()
        .zip(bytes.last_chunk::<4>())
    else {
        return 0;
    };
    let [.., s0, s1, s2, s3] = *header;
    let [_, _, _, _, _, _, _, _, _, _, _, _, l0, l1, l2, l3, ..] = *header;
    let [c0, c1, c2, c3] = *crc;
    let [site, length, crc] =
        [[s0, s1, s2, s3], [l0, l1, l2, l3], [c0, c1, c2, c3]].map(u32::from_le_bytes);
    site ^ length ^ crc
}

/// The reason why bytes are not a table. A gate without a table denies.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum TableError {
    /// Fewer bytes than a header and a checksum.
    TooShort,
    /// The first bytes are not `POSEGATE`.
    Magic,
    /// A format version that this crate does not read.
    Version,
    /// The length in the header differs from the number of bytes given.
    Length,
    /// The bytes are damaged.
    Checksum,
    /// A header field is out of its range.
    Header,
    /// The grid's directory or runs are out of range.
    Grid,
    /// The facets' counts are inconsistent, or an arc, a frame or a facet is out of range.
    Facets,
    /// A number of the sight record is out of its range.
    Sight,
    /// The table has cells and no facets, and this build has no cells: feature `cells`.
    NoCells,
}

crate::messages::messages!(TableError {
    TooShort => "the bytes are fewer than a table's header and checksum",
    Magic => "the first bytes are not `POSEGATE`",
    Version => "the format version is not one that this program reads",
    Length => "the length in the header differs from the number of bytes",
    Checksum => "the checksum is wrong: the bytes are damaged",
    Header => "a header field is out of its range",
    Grid => "the grid's directory or its runs are out of range",
    Facets => "the facets' counts do not add up, or an arc, a frame or a facet is out of range",
    Sight => "a number of the sight record is out of its range",
    NoCells => "the table has cells and no facets, and this program is built without the feature `cells`",
});

/// The cells of a table: their position and number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Cells {
    /// Lower corner in the goal frame, micrometres.
    pub x_lo_um: i32,
    /// Lower corner in the goal frame, micrometres.
    pub y_lo_um: i32,
    /// Edge of a cell along x and y, micrometres, at least 1.
    pub step_um: i32,
    /// Cells along x, at least 1.
    pub columns: u16,
    /// Cells along y, at least 1.
    pub rows: u16,
    /// Lower end of the yaw range in the goal frame.
    pub yaw_lo: BinaryAngle,
    /// Width of the yaw range, 2^-32 turn, at most 2^32 (the whole circle).
    pub yaw_span: u64,
    /// Slabs in yaw, at least 1.
    pub slabs: u16,
}

impl Cells {
    /// Returns edge `k` of the slabs, relative to [`Cells::yaw_lo`], 2^-32 turn, rounded down; `k` is at most
    /// [`Cells::slabs`].
    #[must_use]
    pub fn slab_edge(&self, k: u16) -> i64 {
        // At most 2^32 * 2^16.
        let scaled = self.yaw_span.wrapping_mul(u64::from(k)) as i64;
        Divisor::new(i64::from(self.slabs)).map_or(0, |by| by.floor(scaled))
    }

    /// Returns the last slab that contains the offset `at` above [`Cells::yaw_lo`] (2^-32 turn, within the range).
    #[must_use]
    pub fn slab_of(&self, at: i64) -> u16 {
        // floor(k w / n) <= at if and only if k w < (at + 1) n.
        let scaled = at
            .wrapping_add(1)
            .wrapping_mul(i64::from(self.slabs))
            .wrapping_sub(1);
        let k = Divisor::new(self.yaw_span as i64).map_or(0, |by| by.floor(scaled));
        clamped(k, 0, i64::from(self.slabs).wrapping_sub(1)) as u16
    }

    /// Returns `true` if the yaw range is the whole circle.
    #[must_use]
    pub const fn is_whole_circle(&self) -> bool {
        self.yaw_span == 1 << 32
    }

    /// Returns the upper end along x, micrometres.
    #[must_use]
    pub const fn x_hi_um(&self) -> i32 {
        self.x_lo_um
            .wrapping_add(self.step_um.wrapping_mul(self.columns as i32))
    }

    /// Returns the upper end along y, micrometres.
    #[must_use]
    pub const fn y_hi_um(&self) -> i32 {
        self.y_lo_um
            .wrapping_add(self.step_um.wrapping_mul(self.rows as i32))
    }

    /// Returns `true` if every field and the extent along each axis are in range.
    fn are_valid(&self) -> bool {
        let reaches = |lo: i32, count: u16| {
            let hi = i64::from(self.step_um)
                .wrapping_mul(i64::from(count))
                .wrapping_add(i64::from(lo));
            lo >= -LARGEST_REACH_UM && hi <= i64::from(LARGEST_REACH_UM)
        };
        self.step_um >= 1
            && self.columns >= 1
            && self.rows >= 1
            && self.slabs >= 1
            && self.yaw_span >= u64::from(self.slabs)
            && reaches(self.x_lo_um, self.columns)
            && reaches(self.y_lo_um, self.rows)
    }
}

/// A success set whose bytes have been checked once and can be trusted.
#[derive(Clone, Copy, Debug)]
pub struct Table<'a> {
    bytes: &'a [u8],
    goal: GoalFrame,
    cells: Cells,
    radius_squared: RadiusSquared,
    grid: Option<Grid<'a>>,
    facets: Option<Facets<'a>>,
    sight: Option<&'a sight::Words>,
    /// The largest number of runs of the grid that a decision reads.
    most_runs: u32,
}

#[cfg(feature = "defmt")]
impl defmt::Format for Table<'_> {
    /// Writes the task and the layouts, not the bytes.
    fn format(&self, f: defmt::Formatter<'_>) {
        defmt::write!(
            f,
            "Table {{ task: {=str}, cells: {}, grid: {}, facets: {} }}",
            self.task(),
            self.cells,
            self.grid,
            self.facets
        );
    }
}

impl<'a> Table<'a> {
    /// Checks bytes and borrows them as a table.
    ///
    /// Cost: one pass of CRC-32C over the bytes and one pass over the runs. Call it once, at start.
    ///
    /// # Errors
    /// The first [`TableError`] in the order of that enum.
    pub fn parse(bytes: &'a [u8]) -> Result<Self, TableError> {
        let end = bytes
            .len()
            .checked_sub(CRC_LENGTH)
            .ok_or(TableError::TooShort)?;
        if end < HEADER_LENGTH {
            return Err(TableError::TooShort);
        }
        let (content, _) = bytes.split_at_checked(end).ok_or(TableError::TooShort)?;
        if bytes_at::<8>(bytes, 0) != Some(MAGIC) {
            return Err(TableError::Magic);
        }
        if u16_at(bytes, 8) != Some(VERSION) {
            return Err(TableError::Version);
        }
        let length = u32_at(bytes, 12).and_then(|v| usize::try_from(v).ok());
        if length != Some(bytes.len()) {
            return Err(TableError::Length);
        }
        if u32_at(bytes, end) != Some(checksum(content)) {
            return Err(TableError::Checksum);
        }
        Self::of_checked(bytes, content).ok_or(TableError::Header)?
    }

    /// Reads the fields of bytes whose checksum is correct. The outer `None` is an invalid header.
    fn of_checked(bytes: &'a [u8], content: &'a [u8]) -> Option<Result<Self, TableError>> {
        let header_length = u16_at(content, 10)?;
        let reserved = u16_at(content, 62)?;
        if usize::from(header_length) != HEADER_LENGTH || reserved != 0 {
            return None;
        }
        let goal = GoalFrame {
            pose: Pose {
                x_um: i32_at(content, 16)?,
                y_um: i32_at(content, 20)?,
                yaw: BinaryAngle(u32_at(content, 24)?),
            },
            cos_q30: i32_at(content, 28)?,
            sin_q30: i32_at(content, 32)?,
        };
        if !is_unit(goal.cos_q30, goal.sin_q30) {
            return None;
        }
        let span = u64::from(u32_at(content, 56)?);
        let cells = Cells {
            x_lo_um: i32_at(content, 36)?,
            y_lo_um: i32_at(content, 40)?,
            step_um: i32_at(content, 44)?,
            columns: u16_at(content, 48)?,
            rows: u16_at(content, 50)?,
            yaw_lo: BinaryAngle(u32_at(content, 52)?),
            yaw_span: if span == 0 { 1 << 32 } else { span },
            slabs: u16_at(content, 60)?,
        };
        if !cells.are_valid() {
            return None;
        }
        let radius_squared = RadiusSquared::from_q16(u32_at(content, 64)?)?;
        // Only checked here, and read again on request, to save memory on a controller.
        padded_name(content, 128, 32)?;
        padded_name(content, 160, 16)?;
        let section = |at: usize| -> Option<Option<&'a [u8]>> {
            match (u32_at(content, at)?, u32_at(content, at.checked_add(4)?)?) {
                (0, 0) => Some(None),
                (offset, length) => {
                    section_at(content, offset, usize::try_from(length).ok()?).map(Some)
                }
            }
        };
        let (grid, facets) = (section(68)?, section(76)?);
        let sight = match u32_at(content, 92)? {
            0 => None,
            offset => Some(section_at(content, offset, SIGHT_LENGTH)?),
        };
        // A table without a layout decides nothing.
        if grid.is_none() && facets.is_none() {
            return None;
        }
        if !parts::CELLS && facets.is_none() {
            return Some(Err(TableError::NoCells));
        }
        let facets = match facets.map(|bytes| Facets::parse(bytes, &cells)) {
            None => None,
            Some(Some(facets)) => Some(facets),
            Some(None) => return Some(Err(TableError::Facets)),
        };
        // Tables of older versions may have cells beside facets.
        let grid = grid.filter(|_| parts::CELLS && facets.is_none());
        let grid = match grid.map(|bytes| Grid::parse(bytes, &cells)) {
            None => None,
            Some(Some(grid)) => Some(grid),
            Some(None) => return Some(Err(TableError::Grid)),
        };
        let sight = sight.filter(|_| parts::SIGHT);
        let sight = match sight.map(sight::checked) {
            None => None,
            Some(Some(words)) => Some(words),
            Some(None) => return Some(Err(TableError::Sight)),
        };
        Some(Ok(Self {
            bytes,
            goal,
            cells,
            radius_squared,
            grid,
            facets,
            sight,
            most_runs: u32::MAX,
        }))
    }

    /// Returns the same table with a limit: a decision reads at most `most_runs` runs of cells (a row without a run counts as one).
    /// A walk that needs more ends with [`crate::contain::Cause::TooCostly`]. Facets are not affected. A table from
    /// [`Table::parse`] has no limit.
    #[must_use]
    pub const fn within(self, most_runs: u32) -> Self {
        Self { most_runs, ..self }
    }

    /// Returns the largest number of runs of cells that a decision reads.
    pub(crate) const fn most_runs(&self) -> u32 {
        self.most_runs
    }

    /// Returns the task's goal pose with its cosine and sine.
    #[must_use]
    pub const fn goal(&self) -> &GoalFrame {
        &self.goal
    }

    /// Returns the position and number of the cells.
    #[must_use]
    pub const fn cells(&self) -> &Cells {
        &self.cells
    }

    /// Returns the squared radius of the site's confidence.
    #[must_use]
    pub const fn radius_squared(&self) -> RadiusSquared {
        self.radius_squared
    }

    /// Returns the site's confidence epsilon, for information: only the radius is used for decisions.
    #[must_use]
    pub fn epsilon(&self) -> f64 {
        f64::from_bits(u64_at(self.bytes, 84).unwrap_or(0))
    }

    /// Returns the task's name.
    #[must_use]
    pub fn task(&self) -> &'a str {
        padded_name(self.bytes, 128, 32).unwrap_or_default()
    }

    /// Returns the version of the tool that made the table.
    #[must_use]
    pub fn tool_version(&self) -> &'a str {
        padded_name(self.bytes, 160, 16).unwrap_or_default()
    }

    /// Returns the SHA-256 of the site file from which the table was made.
    #[must_use]
    pub fn site_digest(&self) -> [u8; 32] {
        bytes_at(self.bytes, 96).unwrap_or([0; 32])
    }

    /// Returns `true` if the table was made from the site file with this SHA-256.
    pub(crate) fn is_of_site(&self, digest: &[u8; 32]) -> bool {
        self.bytes
            .get(96..128)
            .is_some_and(|own| own == digest.as_slice())
    }

    /// Returns the checksum at the end of the bytes.
    #[must_use]
    pub fn crc(&self) -> u32 {
        let end = self.bytes.len().saturating_sub(CRC_LENGTH);
        u32_at(self.bytes, end).unwrap_or(0)
    }

    /// Returns the bytes.
    #[must_use]
    pub const fn bytes(&self) -> &'a [u8] {
        self.bytes
    }

    /// Returns the facet layout, if there is one.
    #[must_use]
    pub const fn facets(&self) -> Option<&Facets<'a>> {
        self.facets.as_ref()
    }

    /// Returns the features of this crate that firmware needs to decide on all of this table, in alphabetical order. Without such a feature
    /// the gate denies more, or refuses the table.
    #[cfg(feature = "std")]
    #[must_use]
    pub fn parts(&self) -> Vec<&'static str> {
        let facets = self.facets();
        let needed = [
            ("cells", self.grid().is_some()),
            ("headings", facets.is_some_and(|layout| layout.lever() != 0)),
            ("sight", self.sight.is_some()),
            (
                "unions",
                facets.is_some_and(|layout| layout.pieces().nth(1).is_some()),
            ),
        ];
        let names = needed.into_iter().filter(|(_, is_needed)| *is_needed);
        names.map(|(name, _)| name).collect()
    }

    /// Returns the grid layout, if the table has cells and no facets, and this build has the feature `cells`.
    #[must_use]
    pub const fn grid(&self) -> Option<&Grid<'a>> {
        // A constant `None` lets the compiler drop the code that only cells need.
        if parts::CELLS {
            self.grid.as_ref()
        } else {
            None
        }
    }

    /// Returns the camera and the tag of a visibility set, if the table contains them and this build has the feature `sight`.
    #[must_use]
    pub fn sight_record(&self) -> Option<SightRecord> {
        self.sight.map(SightRecord::of_words)
    }
}

/// Returns the bytes of a section, or `None` if it begins in the header or ends past the end.
fn section_at(content: &[u8], offset: u32, length: usize) -> Option<&[u8]> {
    let start = usize::try_from(offset).ok()?;
    if start < HEADER_LENGTH {
        return None;
    }
    content.get(start..start.checked_add(length)?)
}

/// Returns `true` if `cos^2 + sin^2` is 1 to within the rounding of two numbers that are each within one unit of 2^-30
/// of the true ones: |c^2 + s^2 - 2^60| <= 2 (|c| + |s|) + 2 < 2^32.
fn is_unit(cos_q30: i32, sin_q30: i32) -> bool {
    let square = |v: i32| i64::from(v).wrapping_mul(i64::from(v)).unsigned_abs();
    // Each square is at most 2^62, their sum at most 2^63.
    let sum = square(cos_q30).wrapping_add(square(sin_q30));
    sum.abs_diff(1 << 60) < 1 << 32
}

#[cfg(test)]
pub(crate) mod tests {
    pub(crate) use super::grid::tests::Rows;
    use super::grid::tests::layout;
    use super::*;

    #[test]
    fn heading_on_slab_edge_is_in_both_slabs() {
        for (span, slabs) in [
            (1u64 << 32, 360u16),
            (1 << 32, 7),
            (477_218_588, 40),
            (40, 40),
            (41, 40),
        ] {
            let cells = Cells {
                x_lo_um: 0,
                y_lo_um: 0,
                step_um: 1,
                columns: 1,
                rows: 1,
                yaw_lo: BinaryAngle(0),
                yaw_span: span,
                slabs,
            };
            assert!(cells.are_valid());
            assert_eq!(cells.slab_edge(0), 0);
            assert_eq!(cells.slab_edge(slabs), span as i64);
            for k in 0..slabs {
                let (lo, hi) = (cells.slab_edge(k), cells.slab_edge(k + 1));
                assert!(lo < hi);
                assert_eq!(cells.slab_of(lo), k);
                assert_eq!(cells.slab_of(hi - 1), k);
            }
            assert_eq!(cells.slab_of(span as i64), slabs - 1);
        }
    }

    #[test]
    fn goal_rotation_must_be_a_unit_vector() {
        assert!(is_unit(1 << 30, 0));
        assert!(is_unit(759_250_125, -759_250_125));
        assert!(!is_unit(0, 0));
        assert!(!is_unit(1 << 30, 1 << 20));
        assert!(!is_unit(i32::MIN, i32::MIN));
        assert!(is_unit((1 << 30) - 1, 1));
        // 2^32 too much, and slightly less.
        assert!(!is_unit(1 << 30, 1 << 16));
        assert!(is_unit(1 << 30, (1 << 16) - 1));
    }

    /// Returns a table with a grid for tests, with the goal at `(2, -1)` m and a heading of 90 degrees.
    pub(crate) fn table_of(cells: &Cells, slabs: &[Rows], several: bool) -> Vec<u8> {
        let grid = layout(slabs, cells.columns > 255, several);
        let mut bytes = vec![0; HEADER_LENGTH];
        let mut put = |at: usize, field: &[u8]| bytes[at..at + field.len()].copy_from_slice(field);
        put(0, &MAGIC);
        put(8, &VERSION.to_le_bytes());
        put(10, &(HEADER_LENGTH as u16).to_le_bytes());
        let length = HEADER_LENGTH + grid.len() + CRC_LENGTH;
        put(12, &(length as u32).to_le_bytes());
        put(16, &2_000_000i32.to_le_bytes());
        put(20, &(-1_000_000i32).to_le_bytes());
        put(24, &(1u32 << 30).to_le_bytes());
        put(28, &0i32.to_le_bytes());
        put(32, &(1i32 << 30).to_le_bytes());
        put(36, &cells.x_lo_um.to_le_bytes());
        put(40, &cells.y_lo_um.to_le_bytes());
        put(44, &cells.step_um.to_le_bytes());
        put(48, &cells.columns.to_le_bytes());
        put(50, &cells.rows.to_le_bytes());
        put(52, &cells.yaw_lo.0.to_le_bytes());
        put(56, &(cells.yaw_span as u32).to_le_bytes());
        put(60, &cells.slabs.to_le_bytes());
        put(64, &743_498u32.to_le_bytes());
        put(68, &(HEADER_LENGTH as u32).to_le_bytes());
        put(72, &(grid.len() as u32).to_le_bytes());
        put(84, &0.99f64.to_le_bytes());
        put(96, &[7; 32]);
        put(128, b"dock");
        put(160, b"0.1.0");
        bytes.extend(grid);
        bytes.extend([0; CRC_LENGTH]);
        repair(&mut bytes);
        bytes
    }

    fn repair(bytes: &mut [u8]) {
        let (content, crc) = bytes.split_at_mut(bytes.len() - CRC_LENGTH);
        crc.copy_from_slice(&checksum(content).to_le_bytes());
    }

    const CELLS: Cells = Cells {
        x_lo_um: -3_000,
        y_lo_um: -1_000,
        step_um: 500,
        columns: 9,
        rows: 3,
        yaw_lo: BinaryAngle(u32::MAX - 99),
        yaw_span: 200,
        slabs: 2,
    };

    fn small() -> Vec<u8> {
        let rows = Rows {
            first_row: 0,
            runs: vec![vec![(0, 8)]; 3],
        };
        table_of(&CELLS, &[rows.clone(), rows], false)
    }

    #[test]
    fn table_reads_back_written_header() {
        let bytes = small();
        let table = Table::parse(&bytes).unwrap();
        let goal = GoalFrame {
            pose: Pose {
                x_um: 2_000_000,
                y_um: -1_000_000,
                yaw: BinaryAngle(1 << 30),
            },
            cos_q30: 0,
            sin_q30: 1 << 30,
        };
        assert_eq!(*table.goal(), goal);
        assert_eq!(*table.cells(), CELLS);
        assert_eq!((CELLS.x_hi_um(), CELLS.y_hi_um()), (1_500, 500));
        assert_eq!(table.radius_squared().q16(), 743_498);
        assert_eq!(table.epsilon(), 0.99);
        assert_eq!(table.task(), "dock");
        assert_eq!(table.tool_version(), "0.1.0");
        assert_eq!(table.site_digest(), [7; 32]);
        let crc = checksum(&bytes[..bytes.len() - CRC_LENGTH]);
        assert_eq!(table.crc(), crc);
        assert_eq!(table.bytes(), bytes);
        assert!(table.facets().is_none());
        let grid = table.grid().unwrap();
        assert_eq!(grid.byte_length(), bytes.len() - HEADER_LENGTH - CRC_LENGTH);
        assert_eq!(grid.slab(1).rows(), 3);

        let whole = Cells {
            yaw_span: 1 << 32,
            ..CELLS
        };
        let rows = Rows {
            first_row: 0,
            runs: vec![],
        };
        let bytes = table_of(&whole, &[rows.clone(), rows], false);
        assert_eq!(*Table::parse(&bytes).unwrap().cells(), whole);
        assert!(whole.is_whole_circle() && !CELLS.is_whole_circle());
    }

    #[test]
    fn each_invalid_table_has_its_error() {
        let error = |bytes: &[u8]| Table::parse(bytes).err();
        for length in 0..HEADER_LENGTH + CRC_LENGTH {
            assert_eq!(error(&vec![0; length]), Some(TableError::TooShort));
        }
        let empty = [0; HEADER_LENGTH + CRC_LENGTH];
        assert_eq!(error(&empty), Some(TableError::Magic));
        let with = |at: usize, field: &[u8]| {
            let mut bytes = small();
            bytes[at..at + field.len()].copy_from_slice(field);
            repair(&mut bytes);
            error(&bytes)
        };
        assert_eq!(with(0, &MAGIC), None);
        assert_eq!(with(7, b"e"), Some(TableError::Magic));
        for version in [0u16, 2, 257] {
            assert_eq!(with(8, &version.to_le_bytes()), Some(TableError::Version));
        }
        let length = small().len() as u32;
        for length in [length - 1, length + 1, 0] {
            assert_eq!(with(12, &length.to_le_bytes()), Some(TableError::Length));
        }
        let mut damaged = small();
        damaged[100] ^= 1;
        assert_eq!(error(&damaged), Some(TableError::Checksum));
        // The grid's number of slabs, and its first bytes.
        assert_eq!(with(60, &[1, 0]), Some(TableError::Grid));
        assert_eq!(with(HEADER_LENGTH, &[9]), Some(TableError::Grid));
    }

    #[test]
    fn each_field_has_its_range() {
        let accepts = |at: usize, field: &[u8]| {
            let mut bytes = small();
            bytes[at..at + field.len()].copy_from_slice(field);
            repair(&mut bytes);
            match Table::parse(&bytes) {
                Ok(_) => true,
                Err(TableError::Header) => false,
                Err(other) => panic!("{at} {field:?}: {other:?}"),
            }
        };
        let bad: [(usize, &[u8]); 18] = [
            // Header length, reserved fields.
            (10, &[175, 0]),
            (62, &[1, 0]),
            (62, &[0, 1]),
            (92, &[0, 0, 0, 1]),
            // Cosine and sine.
            (32, &[0; 4]),
            // Step, columns, rows, slabs, less yaw than slabs.
            (44, &[0; 4]),
            (44, &(-500i32).to_le_bytes()),
            (48, &[0; 2]),
            (50, &[0; 2]),
            (60, &[0; 2]),
            (56, &[1, 0, 0, 0]),
            // Radius.
            (64, &[0; 4]),
            // The grid: none, in the header, past the end, beyond the range of offsets.
            (68, &[0; 8]),
            (68, &[175, 0, 0, 0]),
            (68, &[180, 0, 0, 0]),
            (68, &[0xff; 8]),
            // Names.
            (128, &[0; 32]),
            (160, b"0.1\x000"),
        ];
        for (at, field) in bad {
            assert!(!accepts(at, field), "{at} {field:?}");
        }
        assert!(accepts(56, &[2, 0, 0, 0]));
        assert!(accepts(128, &[b'x'; 32]) && accepts(160, &[b'x'; 16]));
        assert!(!accepts(128, b"\xff") && !accepts(128, b"\0"));
        // The reach of the cells, on both axes at both ends.
        for (at, width) in [(36, 9 * 500), (40, 3 * 500)] {
            for (lo, expected) in [
                (-LARGEST_REACH_UM, true),
                (-LARGEST_REACH_UM - 1, false),
                (LARGEST_REACH_UM - width, true),
                (LARGEST_REACH_UM - width + 1, false),
            ] {
                assert_eq!(accepts(at, &lo.to_le_bytes()), expected, "{at} {lo}");
            }
        }
    }
}
