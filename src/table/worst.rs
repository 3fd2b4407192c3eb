//! The largest cost of a decision on a table, from the contents of the table.

use super::{Axes, Facets, Table};

/// Largest number of slabs of headings of one pose-set that are evaluated.
pub(crate) const MOST_SLABS: u32 = 160;
/// Largest number of steps that are taken if several pieces may contain a pose-set together: tests of a facet, or of a pair of
/// facets, on a slab of headings. The choice of a piece also takes some ([`Facets::steps_of_choice`]).
pub(crate) const MOST_UNION_STEPS: u32 = 96;
/// Largest number of steps that a choice counts as. With very many facets it costs more ([`Facets::uncounted_steps`]): if all of that
/// counted, a set in two pieces would be denied.
const MOST_STEPS_OF_CHOICE: u32 = 8;
/// Most steps by which the tests of the last slab can exceed that number.
const STEPS_BEYOND: u32 = 3;
/// Price of such a step, and of the cut of the headings at a piece's arc, in slabs: two sections, their weight, their sum and its
/// test.
const SLABS_OF_STEP: u32 = 3;

/// The largest number of steps of each kind in a decision.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct WorstCase {
    /// Pieces of facets.
    pub pieces: u32,
    /// Frames of all pieces.
    pub frames: u32,
    /// Facets of frames in world axes.
    pub world_facets: u32,
    /// Facets of frames in robot axes, where a set can bend.
    pub robot_facets: u32,
    /// Slabs of headings at which facets are evaluated. With several pieces, also the steps of their union, at three slabs each. Zero
    /// for one piece with no point that turns with the heading.
    pub heading_slabs: u32,
    /// Slabs of cells that are walked. On the whole circle a set of one turn to either side meets each slab twice, and two of them again.
    pub slabs: u32,
    /// Runs of cells, and rows without a run, of all slabs. For a whole circle of headings they count twice,
    /// and the runs of the fullest slab twice more.
    pub runs: u32,
    /// Facets of points that turn with the heading, which the second evaluation may try at every section.
    pub turning_facets: u32,
    /// Outermost poses that the second evaluation looks up, if there are several pieces, or cells.
    pub spots: u32,
}

/// Instructions of each step: a decision, a piece, a frame, a facet in world axes and in robot axes, a slab of headings, a slab of
/// cells, a run.
type Prices = [u32; 8];

/// Upper bounds with slack, from measurements in the emulator. `ci.sh budgets` searches for a decision that costs
/// more, and for a run of cells that costs more than a slab and a run, and fails if it finds one.
const M4F: Prices = [800, 40, 100, 250, 420, 600, 3_500, 150];
const M0_PLUS: Prices = [2_200, 60, 160, 800, 1_600, 1_300, 10_500, 250];

/// Sections of one facet in the second evaluation: three to find the touching heading, and seventeen headings with the robot turned either
/// way.
const SECTIONS: u32 = 3 + 3 * 17;
/// Poses that the second evaluation looks up.
const SPOTS: u32 = 27;
/// Instructions of the second evaluation on a Cortex-M4F: itself and a piece, a facet, a section, a pose, and a frame and a facet at it.
const CONFIRMATION: [u32; 7] = [3_500, 100, 250, 700, 1_600, 100, 60];

impl WorstCase {
    /// Returns an upper bound of the instructions of the second evaluation on a Cortex-M4F, which confirms each permit; as
    /// [`WorstCase::instructions_m4f`], searched.
    #[must_use]
    pub fn confirmation_m4f(&self) -> u32 {
        let [own, piece, facet, section, spot, frame_at, facet_at] = CONFIRMATION;
        let facets = self.world_facets.saturating_add(self.robot_facets);
        let at = [(self.frames, frame_at), (facets, facet_at)]
            .into_iter()
            .fold(spot, |sum, (count, price)| {
                sum.saturating_add(count.saturating_mul(price))
            });
        [
            (self.pieces, piece),
            (facets, facet),
            (self.turning_facets.saturating_mul(SECTIONS), section),
            (self.spots, at),
        ]
        .into_iter()
        .fold(own, |sum, (count, price)| {
            sum.saturating_add(count.saturating_mul(price))
        })
    }

    /// Returns an upper bound of the instructions of a decision on a Cortex-M4F, built with the `firmware`
    /// profile.
    #[must_use]
    pub fn instructions_m4f(&self) -> u32 {
        self.priced(M4F)
    }

    /// As [`WorstCase::instructions_m4f`], on a Cortex-M0+ (32-bit products, no divider).
    #[must_use]
    pub fn instructions_m0_plus(&self) -> u32 {
        self.priced(M0_PLUS)
    }

    fn priced(&self, [decision, piece, frame, world, robot, heading, slab, run]: Prices) -> u32 {
        [
            (self.pieces, piece),
            (self.frames, frame),
            (self.world_facets, world),
            (self.robot_facets, robot),
            (self.heading_slabs, heading),
            (self.slabs, slab),
            (self.runs, run),
        ]
        .into_iter()
        .fold(decision, |sum, (count, price)| {
            sum.saturating_add(count.saturating_mul(price))
        })
    }
}

impl Facets<'_> {
    /// Returns the number of steps that the choice of a piece for a pose counts as.
    pub(crate) fn steps_of_choice(&self) -> u32 {
        self.cost_of_choice().min(MOST_STEPS_OF_CHOICE)
    }

    /// Returns a number of steps that cost more than a choice: the depths of the pose in all pieces, with the cheapest tests of all
    /// facets. A frame costs as much as four facets, and 32 facets less than a step.
    fn cost_of_choice(&self) -> u32 {
        let all = self
            .frame_count()
            .saturating_mul(4)
            .saturating_add(self.facet_count());
        u32::try_from(all >> 5)
            .unwrap_or(u32::MAX)
            .saturating_add(1)
    }

    /// Returns the most steps that all choices of one set cost beyond those that they count as.
    fn uncounted_steps(&self) -> u32 {
        const MOST_CHOICES: u32 = MOST_UNION_STEPS / MOST_STEPS_OF_CHOICE;
        let more = self.cost_of_choice().saturating_sub(MOST_STEPS_OF_CHOICE);
        more.saturating_mul(MOST_CHOICES)
    }
}

impl Table<'_> {
    /// Returns the largest number of steps of a decision on this table, within its limit ([`Table::within`]). Reads the whole table: for start-up, or
    /// for the host.
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
                if frame.axes == Axes::Robot || (frame.x, frame.y) != (0, 0) {
                    worst.turning_facets = worst.turning_facets.saturating_add(facets);
                }
            }
        }
        if self.facets().is_some_and(|layout| layout.lever() > 0) {
            worst.heading_slabs = MOST_SLABS;
        }
        if let Some(layout) = self.facets().filter(|_| worst.pieces > 1) {
            let steps = MOST_UNION_STEPS
                .saturating_add(STEPS_BEYOND)
                .saturating_add(worst.pieces)
                .saturating_add(layout.uncounted_steps());
            let slabs = steps.saturating_mul(SLABS_OF_STEP);
            worst.heading_slabs = worst.heading_slabs.saturating_add(slabs);
        }
        if worst.pieces != 1 {
            worst.spots = SPOTS;
        }
        if let Some(grid) = self.grid() {
            let cells = self.cells();
            let mut fullest = 0;
            for slab in 0..cells.slabs {
                let slab = grid.slab(slab);
                let rows = slab.first_row()..slab.first_row().saturating_add(slab.rows());
                let runs = rows
                    .map(|row| count(slab.runs(row).count()).max(1))
                    .fold(0, u32::saturating_add);
                worst.runs = worst.runs.saturating_add(runs);
                fullest = runs.max(fullest);
            }
            let (times, again) = if cells.is_whole_circle() {
                (2, 2)
            } else {
                (1, 0)
            };
            worst.slabs = u32::from(cells.slabs)
                .saturating_mul(times)
                .saturating_add(again);
            worst.runs = worst.runs.saturating_mul(times);
            worst.runs = worst.runs.saturating_add(fullest.saturating_mul(again));
            worst.runs = worst.runs.min(self.most_runs());
        }
        worst
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::num::BinaryAngle;
    use crate::table::Cells;
    use crate::table::tests::{Rows, table_of};

    #[test]
    fn every_step_adds_to_worst_case() {
        let worst = WorstCase {
            pieces: 2,
            frames: 3,
            world_facets: 5,
            robot_facets: 7,
            heading_slabs: 9,
            slabs: 13,
            runs: 11,
            turning_facets: 4,
            spots: 27,
        };
        let at = 1_600 + 3 * 100 + 12 * 60;
        let confirmation = 3_500 + 2 * 100 + 12 * 250 + 4 * 54 * 700 + 27 * at;
        assert_eq!(worst.confirmation_m4f(), confirmation);
        let m4f = 800 + 2 * 40 + 3 * 100 + 5 * 250 + 7 * 420 + 9 * 600 + 13 * 3_500 + 11 * 150;
        assert_eq!(worst.instructions_m4f(), m4f);
        let m0_plus =
            2_200 + 2 * 60 + 3 * 160 + 5 * 800 + 7 * 1_600 + 9 * 1_300 + 13 * 10_500 + 11 * 250;
        assert_eq!(worst.instructions_m0_plus(), m0_plus);
        let most = WorstCase {
            runs: u32::MAX,
            ..worst
        };
        assert_eq!(most.instructions_m4f(), u32::MAX);
    }

    /// A row without runs counts too.
    #[test]
    fn rows_of_every_slab_count() {
        let cells = Cells {
            x_lo_um: 0,
            y_lo_um: 0,
            step_um: 500,
            columns: 9,
            rows: 4,
            yaw_lo: BinaryAngle(0),
            yaw_span: 200,
            slabs: 2,
        };
        let slabs = [
            Rows {
                first_row: 1,
                runs: vec![vec![(0, 2), (4, 5), (7, 8)], vec![], vec![(1, 1)]],
            },
            Rows {
                first_row: 0,
                runs: vec![vec![(0, 8)]],
            },
        ];
        let bytes = table_of(&cells, &slabs, true);
        let worst = Table::parse(&bytes).unwrap().worst_case();
        let expected = WorstCase {
            slabs: 2,
            runs: 6,
            spots: 27,
            ..WorstCase::default()
        };
        assert_eq!(worst, expected);

        // Headings over the whole circle meet each slab twice, and two of them again, one of them the slab with five runs.
        let circle = Cells {
            yaw_span: 1 << 32,
            ..cells
        };
        let bytes = table_of(&circle, &slabs, true);
        let worst = Table::parse(&bytes).unwrap().worst_case();
        assert_eq!((worst.slabs, worst.runs), (6, 22));
    }
}
