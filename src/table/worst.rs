//! How much a decision on a table can cost at most, from what the table holds.

use super::{Axes, Table};

/// The most steps that a decision takes, of each kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct WorstCase {
    /// Pieces of facets.
    pub pieces: u32,
    /// Frames of all pieces.
    pub frames: u32,
    /// Facets of frames in world axes.
    pub world_facets: u32,
    /// Facets of frames in the robot's axes, where a set can bend.
    pub robot_facets: u32,
    /// Runs of cells, and rows without any, of all slabs.
    pub runs: u32,
}

/// Instructions a step: a decision, a piece, a frame, a facet in world axes and in the robot's, a run.
type Prices = [u32; 6];

/// Upper bounds, seen in the emulator with room to spare; `ci.sh budgets` searches for a decision that
/// costs more, and fails where it finds one.
const M4F: Prices = [800, 40, 100, 150, 420, 2_500];
const M0_PLUS: Prices = [2_200, 60, 160, 340, 1_600, 16_000];

impl WorstCase {
    /// An upper bound on the instructions of a decision on a Cortex-M4F, built as the `firmware` profile
    /// says.
    #[must_use]
    pub fn instructions_m4f(&self) -> u32 {
        self.priced(M4F)
    }

    /// The same on a Cortex-M0+ (32-bit products, no divider).
    #[must_use]
    pub fn instructions_m0_plus(&self) -> u32 {
        self.priced(M0_PLUS)
    }

    fn priced(&self, [decision, piece, frame, world, robot, run]: Prices) -> u32 {
        [
            (self.pieces, piece),
            (self.frames, frame),
            (self.world_facets, world),
            (self.robot_facets, robot),
            (self.runs, run),
        ]
        .into_iter()
        .fold(decision, |sum, (count, price)| {
            sum.saturating_add(count.saturating_mul(price))
        })
    }
}

impl Table<'_> {
    /// The most that a decision on this table can take. Looks at the whole table: for start-up, or for
    /// the desk.
    #[must_use]
    pub fn worst_case(&self) -> WorstCase {
        let mut worst = WorstCase::default();
        let count = |number: usize| u32::try_from(number).unwrap_or(u32::MAX);
        for piece in self.facets().into_iter().flat_map(|layout| layout.pieces()) {
            worst.pieces = worst.pieces.saturating_add(1);
            for frame in piece.frames() {
                worst.frames = worst.frames.saturating_add(1);
                let facets = count(frame.facets().count());
                let sum = match frame.axes {
                    Axes::World => &mut worst.world_facets,
                    Axes::Robot => &mut worst.robot_facets,
                };
                *sum = sum.saturating_add(facets);
            }
        }
        if let Some(grid) = self.grid() {
            for slab in 0..self.cells().slabs {
                let slab = grid.slab(slab);
                let rows = slab.first_row()..slab.first_row().saturating_add(slab.rows());
                for row in rows {
                    let runs = count(slab.runs(row).count()).max(1);
                    worst.runs = worst.runs.saturating_add(runs);
                }
            }
        }
        worst
    }
}
