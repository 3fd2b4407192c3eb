//! What a gate in C takes on a controller with a table: flash, stack, and bounds on the instructions of a control cycle.
//!
//! Flash and stack are those of the released archive with the parts that the table needs; the stack is the deepest of every path through the
//! code. The bounds are those of the table ([`posegate::table::Table::worst_case`]) with what a call takes besides its decisions, as measured
//! in `examples/c/robot`. `./ci.sh costs` makes the figures.

pub use crate::controller::Level;

use crate::Core;
use posegate::table::{Parts, Table};

/// The figures: a line for each core, level of optimization and set of parts.
const FIGURES: &str = include_str!("controller_cost/figures.txt");

/// The cost of a gate: bytes, and instructions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cost {
    /// The parts of the archive: `boxes`, `turning` (headings and unions), or `all`.
    pub parts: &'static str,
    /// Flash of the gate's code and constants.
    pub flash_of_gate: u64,
    /// Flash of the tracker's; zero without a tracker.
    pub flash_of_tracker: u64,
    /// Flash of the table.
    pub flash_of_table: u64,
    /// Deepest stack of `posegate_gate_init` and of a change of table.
    pub stack_of_init: u64,
    /// Deepest stack of a step, a tick and a look at the permission.
    pub stack_of_step: u64,
    /// Deepest stack of the functions of the tracker and of a step on it; zero without a tracker.
    pub stack_of_tracked: u64,
    /// Bound on a control cycle without a fix: with a tracker an increment and a step on it, else a tick.
    pub without_fix: u64,
    /// Bound on a control cycle with a fix: with a tracker it is carried through all increments that are kept besides, else a step.
    pub with_fix: u64,
    /// Bound on a change of the table.
    pub change_of_table: u64,
}

/// A line of the figures.
struct Figures {
    flash_of_gate: u64,
    flash_of_tracker: u64,
    stack_of_init: u64,
    stack_of_step: u64,
    stack_of_tracked: u64,
    odometry: u64,
    /// A fix that is not late: only the pages state it.
    #[cfg(test)]
    fix: u64,
    late_fix: u64,
    step: u64,
    change: u64,
}

impl Figures {
    fn of(core: Core, level: Level, parts: &str) -> Self {
        let row = FIGURES
            .lines()
            .map(|line| line.split(' ').collect::<Vec<_>>())
            .find(|row| row.get(..3) == Some(&[core.name(), level.name(), parts]))
            .unwrap_or_default();
        let number = |at: usize| {
            row.get(at)
                .and_then(|text| text.parse().ok())
                .unwrap_or(u64::MAX >> 16)
        };
        Self {
            flash_of_gate: number(3),
            flash_of_tracker: number(4),
            stack_of_init: number(5),
            stack_of_step: number(6),
            stack_of_tracked: number(7),
            odometry: number(9),
            #[cfg(test)]
            fix: number(10),
            late_fix: number(11),
            step: number(12),
            change: number(13),
        }
    }
}

/// Returns the smallest set of parts that a table needs.
fn parts(table: &Table<'_>) -> &'static str {
    let needs = table.parts();
    if needs.contains(Parts::CELLS) || needs.contains(Parts::SIGHT) {
        "all"
    } else if needs == Parts::default() {
        "boxes"
    } else {
        "turning"
    }
}

/// Returns the cost of a gate with a table.
#[must_use]
pub fn cost(table: &Table<'_>, core: Core, level: Level, has_tracker: bool) -> Cost {
    let parts = parts(table);
    let own = Figures::of(core, level, parts);
    let reference = Figures::of(Core::CortexM4F, Level::Fast, parts);
    let worst = table.worst_case();
    // Both evaluations on the reference core; other cores and levels take more by the ratio of a whole step, which differs by 40 % between steps.
    let decisions = u64::from(worst.instructions_m4f()) + u64::from(worst.confirmation_m4f());
    let is_reference = (core, level) == (Core::CortexM4F, Level::Fast);
    let scaled = |instructions: u64| {
        if is_reference {
            instructions
        } else {
            (instructions * own.step / reference.step * 7).div_ceil(5)
        }
    };
    let decisions = scaled(decisions);
    // What the program measured, and a tenth for other paths.
    let besides = |measured: u64| (measured * 11).div_ceil(10);
    let step = besides(own.step) + decisions;
    let bytes = table.bytes().len() as u64;
    let (without_fix, with_fix) = if has_tracker {
        let cycle = besides(own.odometry) + step;
        (cycle, cycle + besides(own.late_fix))
    } else {
        (besides(own.step), step)
    };
    let with_tracker = |bytes: u64| if has_tracker { bytes } else { 0 };
    Cost {
        parts,
        flash_of_gate: own.flash_of_gate,
        flash_of_tracker: with_tracker(own.flash_of_tracker),
        flash_of_table: bytes,
        stack_of_init: own.stack_of_init,
        stack_of_step: own.stack_of_step,
        stack_of_tracked: with_tracker(own.stack_of_tracked),
        without_fix,
        with_fix,
        // The checksum and the checks of all numbers.
        change_of_table: besides(own.change) + scaled(30 * bytes),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DOCK: &[u8] = include_bytes!("../../../examples/tables/dock.posegate");
    const SEE_T7: &[u8] = include_bytes!("../../../examples/tables/see-t7.posegate");
    const GRID: &[u8] = include_bytes!("../../../examples/tables/see-t7-grid.posegate");
    const U_DOCK: &[u8] = include_bytes!("../../../examples/c/robot/dock.posegate");
    const CORNER: &[u8] = include_bytes!("../../../tests/data/corner.posegate");
    const CORES: [Core; 3] = Core::ALL;

    #[test]
    fn every_core_level_and_part_has_figures() {
        for core in CORES {
            for level in [Level::Fast, Level::Small] {
                for (bytes, parts) in [
                    (DOCK, "boxes"),
                    (U_DOCK, "turning"),
                    (CORNER, "turning"),
                    (SEE_T7, "all"),
                    (GRID, "all"),
                ] {
                    let table = Table::parse(bytes).unwrap();
                    let cost = cost(&table, core, level, true);
                    assert_eq!(cost.parts, parts);
                    assert!((20_000..200_000).contains(&cost.flash_of_gate), "{cost:?}");
                    assert!((5_000..60_000).contains(&cost.flash_of_tracker), "{cost:?}");
                    assert_eq!(cost.flash_of_table, bytes.len() as u64);
                    for stack in [
                        cost.stack_of_init,
                        cost.stack_of_step,
                        cost.stack_of_tracked,
                    ] {
                        assert!((400..5_000).contains(&stack), "{cost:?}");
                    }
                    assert!(cost.without_fix < cost.with_fix && cost.with_fix < 1 << 40);
                }
            }
        }
    }

    fn grouped(number: u64) -> String {
        match number {
            0..1000 => number.to_string(),
            _ => format!("{},{:03}", number / 1000, number % 1000),
        }
    }

    /// The first screen of the README, the header and the pages have the figures.
    #[test]
    fn pages_have_the_figures() {
        let readme = include_str!("../../../README.md");
        let measured = include_str!("../../../docs/measured.md");
        let for_c = include_str!("../../../docs/for-c.md");
        let header = include_str!("../../../include/posegate.h");
        let kilobytes = |bytes: u64| (bytes + 500) / 1000;
        for (core, name) in CORES
            .into_iter()
            .zip(["Cortex-M4F", "Cortex-M0+", "RV32IMC"])
        {
            let flash = |level, parts| {
                let figures = Figures::of(core, level, parts);
                let [gate, tracker] =
                    [figures.flash_of_gate, figures.flash_of_tracker].map(kilobytes);
                format!("{gate} + {tracker} kB")
            };
            let both = |of: fn(&Figures) -> String| {
                [Level::Small, Level::Fast]
                    .map(|level| of(&Figures::of(core, level, "turning")))
                    .join("; ")
            };
            let stack = both(|own| {
                let cycle = own.stack_of_step.max(own.stack_of_tracked);
                grouped(own.stack_of_init.max(cycle))
            });
            let without = both(|own| grouped(own.odometry + own.step));
            let with = both(|own| grouped(own.fix + own.odometry + own.step));
            let time = both(|own| {
                let cycle = own.fix + own.odometry + own.step;
                format!("{:.2}", cycle as f64 * 2.0 / 64_000.0)
            });
            let row = format!(
                "| {name} | {} | {} | {} | {stack} B | {without} | {with} | {time} ms |",
                flash(Level::Small, "boxes"),
                flash(Level::Small, "turning"),
                flash(Level::Fast, "turning"),
            );
            assert!(readme.contains(&row), "{row}");
            let row = format!(
                " *   {name}: flash {} (boxes, -Os) to {} (all shapes, -O3), stack {stack} B,\n *     {without} instructions without a fix, {with} with one\n",
                flash(Level::Small, "boxes"),
                flash(Level::Fast, "turning"),
            );
            assert!(header.contains(&row), "{row}");
            for (level, named) in [(Level::Small, "\"s\""), (Level::Fast, "3")] {
                let [boxes, turning, all] =
                    ["boxes", "turning", "all"].map(|parts| Figures::of(core, level, parts));
                let row = format!(
                    "| {name}, {named} | {} | {} | {} | {} bytes |",
                    grouped(boxes.flash_of_gate),
                    grouped(turning.flash_of_gate),
                    grouped(all.flash_of_gate),
                    grouped(boxes.flash_of_tracker),
                );
                assert!(measured.contains(&row), "{row}");
            }
        }
        for (parts, named) in [
            ("boxes", "none: facets of boxes"),
            (
                "turning",
                "`headings,unions`: footprints, visibility sets, sets of several pieces",
            ),
            ("all", "all: grids and tables of sight besides"),
        ] {
            let both = |of: fn(&Figures) -> u64| {
                let [small, fast] = [Level::Small, Level::Fast]
                    .map(|level| grouped(of(&Figures::of(Core::CortexM4F, level, parts))));
                format!("{small}; {fast} bytes")
            };
            let [gate, tracker] = [
                both(|own| own.flash_of_gate),
                both(|own| own.flash_of_tracker),
            ];
            let row = format!("| {named} | {gate} | {tracker} |");
            assert!(for_c.contains(&row), "{row}");
        }
    }

    #[test]
    fn small_code_takes_less_flash_and_more_instructions() {
        let table = Table::parse(DOCK).unwrap();
        for core in CORES {
            let [fast, small] =
                [Level::Fast, Level::Small].map(|level| cost(&table, core, level, false));
            assert!(small.flash_of_gate < fast.flash_of_gate);
            assert!(small.with_fix > fast.with_fix);
            assert_eq!((small.flash_of_tracker, small.stack_of_tracked), (0, 0));
        }
    }
}
