//! Colours that colour-blind people can distinguish (Okabe and Ito), with their meanings.

use super::svg::Style;

/// Text.
pub const INK: &str = "#222222";
/// Less important text.
pub const FAINT: &str = "#555555";
/// Frames and ticks of panels.
pub const FRAME: &str = "#777777";
/// Text about a pose-set that is inside.
pub const YES: &str = "#00694d";
/// Text about a pose-set that is not inside.
pub const NO: &str = "#a84300";

/// Cells that a table covers.
pub const CELLS: Style = Style::filled("#a9d7f2");
/// The inside of a success set.
pub const AREA: Style = Style::filled("#e6ebef");
/// A piece of a table of facets.
pub const PIECE: Style = Style::filled("#a9d7f2").with_outline("#4a86a8", 0.8);
/// The exact border of a success set.
pub const BORDER: Style = Style::outlined("#0072b2", 1.6);
/// A pose-set that is inside.
pub const INSIDE: Style = Style::outlined("#009e73", 2.0).with_fill_opacity("#009e73", 0.28);
/// A pose-set that is not inside: dashed, so that it is recognizable without colour.
pub const NOT_INSIDE: Style = Style::outlined("#d55e00", 2.0)
    .with_fill_opacity("#d55e00", 0.12)
    .dashed("6 3");
/// The robot, and the space around it.
pub const BODY: Style = Style::outlined("#444444", 1.6).with_fill_opacity("#999999", 0.35);
/// The end of a table.
pub const EXTENT: Style = Style::outlined("#777777", 1.0).dashed("2 3");
/// Walls, blocks and obstacles, which are also hatched.
pub const WALL: Style = Style::outlined("#444444", 1.2);
/// A part of a wall where no tag may be mounted: wider than the wall, and dotted.
pub const KEPT_OUT: Style = Style::outlined("#d55e00", 7.0).dashed("2 2");
/// The view of a camera.
pub const VIEW: Style = Style::outlined("#8a6d00", 1.4)
    .with_fill_opacity("#f0e442", 0.22)
    .dashed("8 3 2 3");
/// A tag.
pub const TAG: Style = Style::outlined("#222222", 5.0);

/// The inside of a success set in the paper's figures: red, and also hatched.
pub const PAPER_AREA: Style = Style::filled("#f6c9c4");
/// The hatching of a success set in the paper's figures.
pub const PAPER_HATCH: Style = Style::outlined("#b3001b", 0.6);
/// The border of a success set in the paper's figures: red and solid.
pub const PAPER_BORDER: Style = Style::outlined("#b3001b", 1.8);
/// A pose-set in the paper's figures: blue, and also dashed.
pub const PAPER_SET: Style = Style::outlined("#0050a0", 2.0)
    .with_fill_opacity("#0072b2", 0.28)
    .dashed("6 3");
/// A box inside a success set: black and dotted.
pub const PAPER_BOX: Style = Style::outlined("#222222", 1.6).dashed("2 2");

/// Returns the style of a pose-set.
#[must_use]
pub const fn of_set(inside: bool) -> Style {
    if inside { INSIDE } else { NOT_INSIDE }
}

/// Returns the colour of text about a pose-set.
#[must_use]
pub const fn of_words(inside: bool) -> &'static str {
    if inside { YES } else { NO }
}
