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
//! | 96 | 32 bytes | task digest (`SuccessSet::digest`), SHA-256 of what decides: set, goal, confidence. Opaque to readers, which only compare it; older tools wrote the SHA-256 of the site file |
//! | 128 | 32 bytes | task name, UTF-8, zeros after it |
//! | 160 | 16 bytes | version of the tool that made it, UTF-8, zeros after it |
//! | 176 | | the layouts, and the sight record ([`SightRecord`] has its bytes) |
//! | end - 4 | u32 | CRC-32C (Castagnoli) of all bytes before |
//!
//! Magic, format version, total length and CRC have their places in every format version: a table of a later version is recognised, and
//! a flipped bit in the version is not mistaken for one.
//!
//! For the width w, slab k of n covers the closed yaw interval `[lo + floor(k w / n), lo + floor((k + 1) w / n)]`. The
//! edges are integers, and neighbours share one. Cell i along x covers the closed interval
//! `[lo + i step, lo + (i + 1) step]`; the same applies to rows along y. See [`Grid`] for the layout.

use crate::num::BinaryAngle;
use crate::pose::{GoalFrame, Pose};
use crate::set::RadiusSquared;

pub use self::cells::Cells;
pub use self::checksum::{checksum, checksum_continued};
pub use self::facets::{
    Axes, Facet, Facets, Frame, LARGEST_UNIT, LONGEST_LEVER, NORMAL_BITS, Piece,
};
pub use self::grid::{Grid, Run, Runs, Slab};
pub use self::parts::Parts;
pub use self::sight::{
    EDGE_BITS, FARTHEST_CAMERA_UM, LARGEST_HEIGHT_UM, LARGEST_SIGHT_UM, PIXEL_BITS, SIGHT_LENGTH,
    SightRecord,
};
pub(crate) use self::stored::{stored_checksum, stored_mark, stored_radius_squared};
pub use self::worst::WorstCase;
pub(crate) use self::worst::{MOST_SLABS, MOST_UNION_STEPS};

mod bytes;
mod cells;
mod checksum;
mod facets;
mod grid;
pub(crate) mod parts;
mod sight;
mod stored;
mod worst;

use bytes::{bytes_at, i32_at, padded_name, u16_at, u32_at, u64_at};

/// The first eight bytes of a table.
pub const MAGIC: [u8; 8] = *b"POSEGATE";
/// The format version that this crate reads and writes.
pub const VERSION: u16 = 1;
/// Bytes of the header.
pub const HEADER_LENGTH: usize = 176;
/// Offset of the task's digest in the header.
const TASK_DIGEST_AT: usize = 96;
/// Bytes of the checksum at the end.
pub const CRC_LENGTH: usize = 4;
/// Largest distance of a cell from the goal on an axis, micrometres (2^27, 134 m).
pub const LARGEST_REACH_UM: i32 = 1 << 27;

/// The reason why bytes are not a table. A gate without a table denies.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum TableError {
    /// Fewer bytes than a header and a checksum.
    TooShort,
    /// The first bytes are not `POSEGATE`.
    Magic,
    /// The length in the header differs from the number of bytes given.
    Length,
    /// The bytes are damaged.
    Checksum,
    /// The checksum is correct, and the format version is above [`VERSION`].
    TooNew,
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

messages!(TableError {
    TooShort => "the bytes are fewer than a table's header and checksum",
    Magic => "the first bytes are not `POSEGATE`",
    Length => "the length in the header differs from the number of bytes",
    Checksum => "the checksum is wrong: the bytes are damaged",
    TooNew => "the format version is above that of this program: a newer program made the table",
    Header => "a header field is out of its range",
    Grid => "the grid's directory or its runs are out of range",
    Facets => "the facets' counts do not add up, or an arc, a frame or a facet is out of range",
    Sight => "a number of the sight record is out of its range",
    NoCells => "the table has cells and no facets, and this program is built without the feature `cells`",
});

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
        let length = u32_at(bytes, 12).and_then(|v| usize::try_from(v).ok());
        if length != Some(bytes.len()) {
            return Err(TableError::Length);
        }
        if u32_at(bytes, end) != Some(checksum(content)) {
            return Err(TableError::Checksum);
        }
        if !u16_at(bytes, 8).is_some_and(|version| version <= VERSION) {
            return Err(TableError::TooNew);
        }
        Self::of_checked(bytes, content).ok_or(TableError::Header)?
    }

    /// Reads the fields of bytes whose checksum is correct. The outer `None` is an invalid header.
    fn of_checked(bytes: &'a [u8], content: &'a [u8]) -> Option<Result<Self, TableError>> {
        let header_length = u16_at(content, 10)?;
        let reserved = u16_at(content, 62)?;
        if u16_at(content, 8)? != VERSION
            || usize::from(header_length) != HEADER_LENGTH
            || reserved != 0
        {
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

    /// Returns the task digest: SHA-256 of the set, the goal and the confidence from which the table was made. A controller only compares it.
    #[must_use]
    pub fn task_digest(&self) -> [u8; 32] {
        bytes_at(self.bytes, 96).unwrap_or([0; 32])
    }

    /// Returns the table digest: SHA-256 of all bytes. It identifies a table, such as in the signature of an update; a gate does not use it.
    #[cfg(feature = "std")]
    #[must_use]
    pub fn digest(&self) -> [u8; 32] {
        use sha2::Digest;
        sha2::Sha256::digest(self.bytes).into()
    }

    /// Returns `true` if the table was made for the task with this digest.
    pub(crate) fn is_of_task(&self, digest: &[u8; 32]) -> bool {
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

    /// Returns the parts of the gate that firmware needs to decide on all of this table, also those that this build does not contain. Without such a
    /// part the gate denies more; without cells it refuses a table that needs them ([`TableError::NoCells`]).
    #[must_use]
    pub fn parts(&self) -> Parts {
        let facets = self.facets();
        let has_sight = u32_at(self.bytes, 92).is_some_and(|offset| offset != 0);
        Parts::default()
            .with(Parts::CELLS, facets.is_none())
            .with(
                Parts::HEADINGS,
                facets.is_some_and(|layout| layout.lever() != 0),
            )
            .with(Parts::SIGHT, has_sight)
            .with(
                Parts::UNIONS,
                facets.is_some_and(|layout| layout.pieces().nth(1).is_some()),
            )
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
mod error_budget;
#[cfg(test)]
pub(crate) mod tests;
