//! The parts of the gate: those that this build contains, and those that a table needs.
//!
//! An omitted part takes no flash, and only makes the gate deny more: one method less can prove that a
//! pose-set is inside. Each part is a constant, so every build compiles and checks all code, and the compiler drops
//! unreachable code.

/// Cells decide if a table has cells (feature `cells`). Without it, a table with cells alone is refused.
pub(crate) const CELLS: bool = cfg!(feature = "cells");

/// Facets on points that turn with the robot are evaluated heading by heading (feature `headings`). Without it, such facets are
/// evaluated over one slab of headings, which denies nearly every set that turns by more than half a radian. Several pieces together are always
/// evaluated heading by heading, so `unions` brings this part along.
pub(crate) const HEADINGS: bool = cfg!(any(feature = "headings", feature = "unions"));

/// Several pieces of facets may contain a pose-set together (feature `unions`). Without it, one piece must contain it.
pub(crate) const UNIONS: bool = cfg!(feature = "unions");

/// Sight records are read (feature `sight`). Without it, no table has one.
pub(crate) const SIGHT: bool = cfg!(feature = "sight");

/// A set of parts of the gate. Each part is a feature of this crate, and a bit; the bits are those of the C header.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Parts(u32);

impl Parts {
    /// Decisions on cells.
    pub const CELLS: Self = Self(1);
    /// Facets on points that turn with the robot, heading by heading.
    pub const HEADINGS: Self = Self(2);
    /// The view of a tag.
    pub const SIGHT: Self = Self(4);
    /// Pose-sets that only several pieces of facets contain together.
    pub const UNIONS: Self = Self(8);
    /// Each part alone, in alphabetical order.
    pub const ALL: [Self; 4] = [Self::CELLS, Self::HEADINGS, Self::SIGHT, Self::UNIONS];
    /// The parts that this build contains.
    pub const BUILT: Self = Self(0)
        .with(Self::CELLS, CELLS)
        .with(Self::HEADINGS, HEADINGS)
        .with(Self::SIGHT, SIGHT)
        .with(Self::UNIONS, UNIONS);

    /// Returns the bits.
    #[must_use]
    pub const fn bits(self) -> u32 {
        self.0
    }

    /// Returns `true` if each of `others` is in this set.
    #[must_use]
    pub const fn contains(self, others: Self) -> bool {
        others.0 & !self.0 == 0
    }

    /// Returns this set without `others`.
    #[must_use]
    pub const fn without(self, others: Self) -> Self {
        Self(self.0 & !others.0)
    }

    /// Returns this set with `part` if it is needed.
    pub(super) const fn with(self, part: Self, is_needed: bool) -> Self {
        if is_needed {
            Self(self.0 | part.0)
        } else {
            self
        }
    }

    /// Returns the names of the features, in alphabetical order.
    pub fn names(self) -> impl Iterator<Item = &'static str> {
        let names = ["cells", "headings", "sight", "unions"];
        let parts = Self::ALL.into_iter().zip(names);
        parts
            .filter(move |(part, _)| self.contains(*part))
            .map(|(_, name)| name)
    }
}
