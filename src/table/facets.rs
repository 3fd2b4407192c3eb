//! The facet layout: convex pieces of the success set, as half-planes on points that are fixed to the
//! robot or seen by it.
//!
//! A *facet* is a half-plane `a . P <= b` in small integers. A *frame* defines the point P:
//!
//! - world axes: `P = p + R(yaw) v`, a point v of the robot (its centre, its camera, a corner of its
//!   footprint) as an offset from the goal, in world axes;
//! - robot axes: `P = R(-yaw) (p - q)`, the robot's place as seen from a point q of the world (a corner
//!   of a tag), in robot axes.
//!
//! With these two, borders that turn with the robot are straight and constant: an image edge is one
//! facet for every heading, and so is a wall at a footprint's corner. A piece is the set of poses of an
//! arc of headings that satisfy every facet of its frames; it lies in the success set. A pose-set is
//! inside if one piece contains all of it. Sets that are not convex at a heading have several pieces.
//!
//! # Units
//! Lengths are in units of 2^k um, with k in the layout's head. Normals have the length 2^14 (to within
//! 2^-8 of it).
//!
//! # Bytes
//!
//! | offset in the layout | type | field |
//! |---|---|---|
//! | 0 | u8, u8, u8, u8 | k, pieces, frames, 0 |
//! | 4 | u16, u16 | facets; reach: an estimate farther than this from the goal on an axis is not inside |
//! | 8 | u16, u16 | arm: upper bound of the length of every v; farthest: upper bound of abs(b) in frames of robot axes |
//! | 12 | 12 bytes per piece | u32 first heading above the goal's, u32 width of the arc, both 2^-32 turn (2^32 - 1: the whole circle), u8 frames, u8 0, u16 facets |
//! | | 6 bytes per frame | u8 axes (0 world, 1 robot), u8 facets, i16 x, i16 y of v or q |
//! | | 6 bytes per facet | i16 a_x, a_y, b |

use super::Cells;
use super::bytes::{bytes_at, u16_at};

const HEAD: usize = 12;
type PieceBytes = [u8; 12];
type FrameBytes = [u8; 6];
type FacetBytes = [u8; 6];
/// Fraction bits of normals.
pub const NORMAL_BITS: u32 = 14;
/// Largest number of length units from a point of the world, or of the robot, to a pose within reach,
/// as the sum of both coordinates.
pub const LONGEST_LEVER: u16 = 32_000;
/// Largest exponent of the length unit.
pub const LARGEST_UNIT: u8 = 12;
/// No point of the world: longer than every lever.
const NO_POINT: u16 = u16::MAX;

/// A half-plane `a . P <= b`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Facet {
    /// x of the normal, times 2^14.
    pub x: i16,
    /// y of the normal, times 2^14.
    pub y: i16,
    /// Offset, length units.
    pub b: i16,
}

/// The axes of a frame's facets, which define their point P.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Axes {
    /// `P = p + R(yaw) v`, from the goal.
    World,
    /// `P = R(-yaw) (p - q)`, with q from the goal.
    Robot,
}

/// A frame: the facets of a piece that restrict the same point.
#[derive(Clone, Copy, Debug)]
pub struct Frame<'a> {
    /// The axes, which define the point.
    pub axes: Axes,
    /// v in the robot's axes, or q from the goal in world axes; length units.
    pub x: i16,
    /// As `x`.
    pub y: i16,
    facets: &'a [FacetBytes],
}

#[cfg(feature = "defmt")]
impl defmt::Format for Frame<'_> {
    fn format(&self, f: defmt::Formatter<'_>) {
        defmt::write!(
            f,
            "Frame {{ axes: {}, x: {=i16}, y: {=i16}, facets: {=usize} }}",
            self.axes,
            self.x,
            self.y,
            self.facets.len()
        );
    }
}

/// A piece: an arc of headings and the frames whose facets hold in it.
#[derive(Clone, Copy, Debug)]
pub struct Piece<'a> {
    /// The first heading above the goal's, 2^-32 turn.
    pub from: u32,
    /// Width of the arc, 2^-32 turn; `u32::MAX` is the whole circle.
    pub width: u32,
    frames: &'a [FrameBytes],
    facets: &'a [FacetBytes],
}

#[cfg(feature = "defmt")]
impl defmt::Format for Piece<'_> {
    fn format(&self, f: defmt::Formatter<'_>) {
        defmt::write!(
            f,
            "Piece {{ from: {=u32}, width: {=u32}, frames: {=usize} }}",
            self.from,
            self.width,
            self.frames.len()
        );
    }
}

/// The facet layout of a parsed table.
#[derive(Clone, Copy, Debug)]
pub struct Facets<'a> {
    length: usize,
    unit: u8,
    reach: u16,
    lever: u16,
    /// An upper bound of the length of every v, and one of every q, length units. The latter is [`NO_POINT`] if there is no q.
    arms: u16,
    points: u16,
    pieces: &'a [PieceBytes],
    frames: &'a [FrameBytes],
    facets: &'a [FacetBytes],
}

#[cfg(feature = "defmt")]
impl defmt::Format for Facets<'_> {
    fn format(&self, f: defmt::Formatter<'_>) {
        defmt::write!(
            f,
            "Facets {{ pieces: {=usize}, frames: {=usize}, facets: {=usize} }}",
            self.pieces.len(),
            self.frames.len(),
            self.facets.len()
        );
    }
}

impl<'a> Facets<'a> {
    /// Checks every piece, frame and facet. Returns `None` if one is out of range, or if the counts do
    /// not match the bytes.
    pub(crate) fn parse(bytes: &'a [u8], cells: &Cells) -> Option<Self> {
        let [unit, pieces, frames, zero] = bytes_at(bytes, 0)?;
        let count = usize::from(u16_at(bytes, 4)?);
        let (reach, arm, farthest) = (u16_at(bytes, 6)?, u16_at(bytes, 8)?, u16_at(bytes, 10)?);
        let (_, rest) = bytes.split_at_checked(HEAD)?;
        let (pieces, rest) = entries(rest, usize::from(pieces))?;
        let (frames, rest) = entries(rest, usize::from(frames))?;
        let (facets, rest) = entries(rest, count)?;
        let long = |length: &u16| *length > LONGEST_LEVER;
        if !rest.is_empty()
            || zero != 0
            || unit > LARGEST_UNIT
            || pieces.is_empty()
            || reach == 0
            || [reach, arm, farthest].iter().any(long)
        {
            return None;
        }
        let layout = Self {
            length: bytes.len(),
            unit,
            reach,
            // Until the frames are known, as the bytes state.
            lever: arm,
            arms: arm,
            points: farthest,
            pieces,
            frames,
            facets,
        };
        layout.check(cells).then(|| layout.with_lever()).flatten()
    }

    fn check(&self, cells: &Cells) -> bool {
        let (mut pieces, mut frames, mut facets) = (0usize, 0usize, 0usize);
        for piece in self.pieces() {
            let (mut count, mut own) = (0usize, 0usize);
            for frame in piece.frames() {
                if !self.admits(&frame) {
                    return false;
                }
                count = count.saturating_add(1);
                own = own.saturating_add(frame.facets.len());
            }
            if piece.frames.is_empty()
                || (count, own) != (piece.frames.len(), piece.facets.len())
                || !within(piece.from, piece.width, cells)
            {
                return false;
            }
            pieces = pieces.saturating_add(1);
            frames = frames.saturating_add(count);
            facets = facets.saturating_add(own);
        }
        self.pieces.iter().all(|[.., zero, _, _]| *zero == 0)
            && self.frames.iter().all(|[axes, ..]| *axes <= 1)
            && (pieces, frames, facets) == (self.pieces.len(), self.frames.len(), self.facets.len())
    }

    /// Returns `true` if a frame's point and facets are within the layout's limits.
    fn admits(&self, frame: &Frame<'_>) -> bool {
        let (near, limit) = match frame.axes {
            Axes::World => (
                length([frame.x, frame.y]) <= u32::from(self.arms),
                LONGEST_LEVER,
            ),
            Axes::Robot => (true, self.points),
        };
        near && !frame.facets.is_empty()
            && frame
                .facets()
                .all(|facet| is_unit(facet) && facet.b.unsigned_abs() <= limit)
    }

    /// Returns the layout with its longest lever from a point to a pose within reach, or `None` if that
    /// is too long.
    fn with_lever(self) -> Option<Self> {
        let reach = u32::from(self.reach).saturating_mul(2);
        let mut lever = u32::from(self.arms);
        let (mut arms, mut points, mut has_points) = (0u32, 0u32, false);
        for frame in self.frames {
            let (axes, _, point) = read_frame(frame);
            let [x, y] = point;
            let far = distance([x.into(), y.into()]);
            if axes == 1 {
                lever = lever.max(length(point).saturating_add(reach));
                points = points.max(far);
                has_points = true;
            } else {
                arms = arms.max(far);
            }
        }
        // Points of 16 bits are nearer than 49,153.
        let points = if has_points { points as u16 } else { NO_POINT };
        (lever <= u32::from(LONGEST_LEVER)).then_some(Self {
            lever: lever as u16,
            arms: arms as u16,
            points,
            ..self
        })
    }

    /// Returns the exponent k of the length unit: 2^k micrometres.
    #[must_use]
    pub const fn unit(&self) -> u8 {
        self.unit
    }

    /// Returns the reach, length units: an estimate farther than this from the goal on a world axis is not
    /// inside.
    #[must_use]
    pub const fn reach(&self) -> u16 {
        self.reach
    }

    /// Returns the longest lever: an upper bound of every v, and of every vector from a q to an
    /// estimate within reach, length units, as the sum of both coordinates.
    #[must_use]
    pub const fn lever(&self) -> u16 {
        self.lever
    }

    /// Returns an upper bound of every v, and of every vector from a q to this estimate, length units.
    #[inline(always)]
    pub(crate) fn longest_arm(&self, place: [i32; 2]) -> u32 {
        if self.points == NO_POINT {
            return self.arms.into();
        }
        let away = distance(place).wrapping_add(self.points.into());
        away.max(self.arms.into())
    }

    /// Returns the number of bytes of the layout.
    #[must_use]
    pub const fn byte_length(&self) -> usize {
        self.length
    }

    /// Returns the number of frames of all pieces.
    #[must_use]
    pub const fn frame_count(&self) -> usize {
        self.frames.len()
    }

    /// Returns the number of facets of all pieces.
    #[must_use]
    pub const fn facet_count(&self) -> usize {
        self.facets.len()
    }

    /// Returns the pieces.
    pub fn pieces(&self) -> impl Iterator<Item = Piece<'a>> + use<'a> {
        let (mut frames, mut facets) = (self.frames, self.facets);
        self.pieces.iter().map_while(move |bytes| {
            let (from, width, own, count) = read_piece(bytes);
            let (mine, rest) = frames.split_at_checked(usize::from(own))?;
            frames = rest;
            let (planes, rest) = facets.split_at_checked(usize::from(count))?;
            facets = rest;
            Some(Piece {
                from,
                width,
                frames: mine,
                facets: planes,
            })
        })
    }
}

impl<'a> Piece<'a> {
    /// Returns `true` if the arc is the whole circle.
    #[must_use]
    pub const fn is_whole_circle(&self) -> bool {
        self.width == u32::MAX
    }

    /// Returns the frames.
    pub fn frames(&self) -> impl Iterator<Item = Frame<'a>> + use<'a> {
        let mut facets = self.facets;
        self.frames.iter().map_while(move |bytes| {
            let (axes, own, [x, y]) = read_frame(bytes);
            let (mine, rest) = facets.split_at_checked(usize::from(own))?;
            facets = rest;
            Some(Frame {
                axes: if axes == 0 { Axes::World } else { Axes::Robot },
                x,
                y,
                facets: mine,
            })
        })
    }
}

impl<'a> Frame<'a> {
    /// Returns the facets.
    #[inline(always)]
    pub fn facets(&self) -> impl Iterator<Item = Facet> + use<'a> {
        self.facets.iter().map(read_facet)
    }
}

/// Returns the first entries of some bytes, and the rest.
fn entries<const N: usize>(bytes: &[u8], count: usize) -> Option<(&[[u8; N]], &[u8])> {
    let (mine, rest) = bytes.split_at_checked(count.checked_mul(N)?)?;
    Some((mine.as_chunks().0, rest))
}

/// Returns first heading, width, frames, facets.
#[inline(always)]
const fn read_piece(
    [f0, f1, f2, f3, w0, w1, w2, w3, frames, _, c0, c1]: &PieceBytes,
) -> (u32, u32, u8, u16) {
    (
        u32::from_le_bytes([*f0, *f1, *f2, *f3]),
        u32::from_le_bytes([*w0, *w1, *w2, *w3]),
        *frames,
        u16::from_le_bytes([*c0, *c1]),
    )
}

/// Returns axes, facets, point.
#[inline(always)]
const fn read_frame([axes, own, x0, x1, y0, y1]: &FrameBytes) -> (u8, u8, [i16; 2]) {
    let x = i16::from_le_bytes([*x0, *x1]);
    (*axes, *own, [x, i16::from_le_bytes([*y0, *y1])])
}

/// Returns the sum of both coordinates' magnitudes.
fn length([x, y]: [i16; 2]) -> u32 {
    u32::from(x.unsigned_abs()).saturating_add(u32::from(y.unsigned_abs()))
}

/// Returns a vector's length, at most 12 % and 1 more.
const fn distance([x, y]: [i32; 2]) -> u32 {
    let [x, y] = [x.unsigned_abs(), y.unsigned_abs()];
    let (most, least) = if x > y { (x, y) } else { (y, x) };
    most.wrapping_add(least.wrapping_add(1) >> 1)
}

/// Reads a facet from its bytes.
#[inline(always)]
const fn read_facet([x0, x1, y0, y1, b0, b1]: &FacetBytes) -> Facet {
    Facet {
        x: i16::from_le_bytes([*x0, *x1]),
        y: i16::from_le_bytes([*y0, *y1]),
        b: i16::from_le_bytes([*b0, *b1]),
    }
}

/// Returns `true` if a normal has the length 2^14 to within 2^-8 of it: its square is 2^28 to within
/// 2^21.
fn is_unit(facet: Facet) -> bool {
    let square = |v: i16| i32::from(v).wrapping_mul(i32::from(v));
    let length = square(facet.x).wrapping_add(square(facet.y));
    length.abs_diff(1 << 28) <= 1 << 21
}

/// Returns `true` if an arc of headings lies in the table's yaw range.
fn within(from: u32, width: u32, cells: &Cells) -> bool {
    let above = from.wrapping_sub(cells.yaw_lo.0);
    cells.is_whole_circle()
        || (width != u32::MAX
            && u64::from(above).saturating_add(u64::from(width)) <= cells.yaw_span)
}

#[cfg(test)]
mod tests;
