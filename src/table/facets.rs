//! The facet layout: convex pieces of the success set, one a yaw slab, in overlapping layers.
//!
//! A facet is a half-space `a . p <= b` in small integers. `p = (x, y, yaw)`: x and y are offsets
//! from the goal *in world axes*, so a decision needs no rotation; yaw is relative to the slab's
//! centre. The tilt `a_yaw` follows the border of the set as the robot turns. A slab's facets bound a
//! convex piece that lies in the success set for every yaw of the slab.
//!
//! # Units
//! Lengths in units of 2^k um, yaw in units of 2^j of 2^-32 turn, with k and j in the layout's head.
//! Normals `(a_x, a_y)` have the length 2^14 (to 2^-8 of it); `b` is in length units, times 2^14 in
//! the comparison; `a_yaw` is in length units a yaw unit, times 2^14.
//!
//! # Layers
//! Layers come in groups; a pose-set must pass every group. In a layer with stride d, slab s covers
//! the yaws `[s d, (s + 2) d]` above the table's lower end: neighbours overlap by half, so an
//! interval no wider than d lies in one slab. The next layer of a group has half the stride; slabs
//! 2s and 2s + 2 of it tile slab s.
//!
//! # Bytes
//!
//! | offset in the layout | type | field |
//! |---|---|---|
//! | 0 | u8, u8 | k, j |
//! | 2 | u8, u8 | layers, 0 |
//! | 4 | u16, u16 | largest tilt, facets |
//! | 8 | 12 bytes a layer | u8 group, u8 0, u16 stride, u16 slabs, u16 0, u32 offset of its index |
//! | | u16 each | index: first facet of each slab, and one past the last's; a slab without facets covers nothing |
//! | | 8 bytes a facet | i16 a_x, a_y, a_yaw, b |

use super::Cells;
use super::bytes::{bytes_at, u16_at, u32_at};

const HEAD: usize = 8;
const ENTRY: usize = 12;
const FACET: usize = 8;
/// Most layers of a table, over all groups.
pub const MOST_LAYERS: u8 = 12;
/// Largest stride, yaw units: a slab reaches no farther than this from its centre.
pub const LARGEST_STRIDE: u16 = 1 << 13;
/// Fraction bits of normals and tilts.
pub const NORMAL_BITS: u32 = 14;

/// A half-space `a . p <= b`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Facet {
    /// Normal, times 2^14.
    pub x: i16,
    /// Normal, times 2^14.
    pub y: i16,
    /// Tilt in length units a yaw unit, times 2^14.
    pub yaw: i16,
    /// Offset, length units.
    pub b: i16,
}

/// A layer of slabs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Layer {
    /// Which group it belongs to.
    pub group: u8,
    /// From one slab to the next, yaw units; a slab is twice as wide.
    pub stride: u16,
    /// Slabs, at least 1.
    pub slabs: u16,
    index: u32,
}

/// The facet layout of a parsed table.
#[derive(Clone, Copy, Debug)]
pub struct Facets<'a> {
    bytes: &'a [u8],
    length_shift: u8,
    yaw_shift: u8,
    layers: u8,
    tilt: u16,
    facets: &'a [u8],
}

impl<'a> Facets<'a> {
    /// Checks every layer, every index and every facet; `None` when one is out of range.
    pub(super) fn parse(bytes: &'a [u8], cells: &Cells) -> Option<Self> {
        let [length_shift, yaw_shift, layers, zero] = bytes_at(bytes, 0)?;
        let tilt = u16_at(bytes, 4)?;
        let count = usize::from(u16_at(bytes, 6)?);
        if zero != 0 || length_shift > 12 || yaw_shift > 24 || !(1..=MOST_LAYERS).contains(&layers)
        {
            return None;
        }
        let length = count.checked_mul(FACET)?;
        let start = bytes.len().checked_sub(length)?;
        let facets = Self {
            bytes,
            length_shift,
            yaw_shift,
            layers,
            tilt,
            facets: bytes.get(start..)?,
        };
        facets.check(cells, count, start).then_some(facets)
    }

    fn check(&self, cells: &Cells, count: usize, facets_at: usize) -> bool {
        let mut at = ENTRY
            .saturating_mul(usize::from(self.layers))
            .saturating_add(HEAD);
        let mut next = 0u16;
        let mut before: Option<Layer> = None;
        for number in 0..self.layers {
            let Some(layer) = self.read_layer(number) else {
                return false;
            };
            let reserved = usize::from(number)
                .saturating_mul(ENTRY)
                .saturating_add(HEAD);
            let zeros = (
                self.bytes.get(reserved.saturating_add(1)),
                u16_at(self.bytes, reserved.saturating_add(6)),
            );
            if zeros != (Some(&0), Some(0)) || usize::try_from(layer.index) != Ok(at) {
                return false;
            }
            // Slabs leave no gap and reach the end of the table's yaw range.
            let covered = (u64::from(layer.slabs).saturating_add(1))
                .saturating_mul(u64::from(layer.stride))
                .wrapping_shl(u32::from(self.yaw_shift));
            let follows = match before {
                None => layer.group == 0,
                Some(last) if last.group == layer.group => {
                    last.stride == layer.stride.saturating_mul(2)
                        && u32::from(layer.slabs)
                            == u32::from(last.slabs).saturating_mul(2).saturating_add(1)
                }
                Some(last) => layer.group == last.group.saturating_add(1),
            };
            if layer.slabs == 0
                || !(1..=LARGEST_STRIDE).contains(&layer.stride)
                || covered < cells.yaw_span
                || !follows
            {
                return false;
            }
            for slab in 0..=layer.slabs {
                let Some(start) = self.start(&layer, slab) else {
                    return false;
                };
                if (slab == 0 && start != next) || start < next {
                    return false;
                }
                next = start;
            }
            at = at.saturating_add(usize::from(layer.slabs).saturating_add(1).saturating_mul(2));
            before = Some(layer);
        }
        if usize::from(next) != count || at != facets_at {
            return false;
        }
        self.facets.chunks_exact(FACET).all(|bytes| {
            let facet = read_facet(bytes);
            let square = |v: i16| i32::from(v).wrapping_mul(i32::from(v));
            let length = square(facet.x).wrapping_add(square(facet.y));
            // 2^28 to within 2^21: the length to within 2^-8.
            length.abs_diff(1 << 28) <= 1 << 21 && facet.yaw.unsigned_abs() <= self.tilt
        })
    }

    /// The exponent of the length unit: 2^k micrometres.
    #[must_use]
    pub const fn length_shift(&self) -> u8 {
        self.length_shift
    }

    /// The exponent of the yaw unit: 2^j of 2^-32 turn.
    #[must_use]
    pub const fn yaw_shift(&self) -> u8 {
        self.yaw_shift
    }

    /// The largest tilt of any facet, times 2^14.
    #[must_use]
    pub const fn tilt(&self) -> u16 {
        self.tilt
    }

    /// Number of layers.
    #[must_use]
    pub const fn layers(&self) -> u8 {
        self.layers
    }

    /// Bytes of the layout.
    #[must_use]
    pub const fn byte_length(&self) -> usize {
        self.bytes.len()
    }

    /// Number of facets.
    #[must_use]
    pub const fn len(&self) -> usize {
        self.facets.len() / FACET
    }

    /// Whether there are no facets at all.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.facets.is_empty()
    }

    /// A layer; one without slabs past the last.
    #[must_use]
    pub fn layer(&self, number: u8) -> Layer {
        let none = Layer {
            group: u8::MAX,
            stride: 1,
            slabs: 0,
            index: 0,
        };
        if number < self.layers {
            self.read_layer(number).unwrap_or(none)
        } else {
            none
        }
    }

    fn read_layer(&self, number: u8) -> Option<Layer> {
        let at = usize::from(number).checked_mul(ENTRY)?.checked_add(HEAD)?;
        Some(Layer {
            group: *self.bytes.get(at)?,
            stride: u16_at(self.bytes, at.checked_add(2)?)?,
            slabs: u16_at(self.bytes, at.checked_add(4)?)?,
            index: u32_at(self.bytes, at.checked_add(8)?)?,
        })
    }

    fn start(&self, layer: &Layer, slab: u16) -> Option<u16> {
        let at = usize::try_from(layer.index).ok()?;
        u16_at(
            self.bytes,
            at.checked_add(usize::from(slab).checked_mul(2)?)?,
        )
    }

    /// The facets of a slab; none (which covers nothing) past the last.
    #[must_use]
    pub fn slab(&self, layer: &Layer, slab: u16) -> Piece<'a> {
        let range = self
            .start(layer, slab)
            .zip(self.start(layer, slab.saturating_add(1)));
        let bytes = range.filter(|_| slab < layer.slabs).and_then(|(from, to)| {
            let from = usize::from(from).checked_mul(FACET)?;
            let to = usize::from(to).checked_mul(FACET)?;
            self.facets.get(from..to)
        });
        Piece {
            bytes: bytes.unwrap_or(&[]),
        }
    }
}

/// The facets of one slab: a convex piece of the success set.
#[derive(Clone, Copy, Debug)]
pub struct Piece<'a> {
    bytes: &'a [u8],
}

impl<'a> Piece<'a> {
    /// Whether the piece covers nothing.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.bytes.is_empty()
    }

    /// The facets.
    pub fn facets(&self) -> impl Iterator<Item = Facet> + use<'a> {
        self.bytes.chunks_exact(FACET).map(read_facet)
    }
}

/// A facet from its eight bytes.
fn read_facet(bytes: &[u8]) -> Facet {
    let at = |offset| bytes_at::<2>(bytes, offset).map_or(0, i16::from_le_bytes);
    Facet {
        x: at(0),
        y: at(2),
        yaw: at(4),
        b: at(6),
    }
}
