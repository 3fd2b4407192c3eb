//! Tables that the program made.

use posegate::table::Table;
use std::sync::OnceLock;

/// Facets and grids; a rotated goal; arcs over half a turn and of the whole circle. The first
/// is that of [`DOCK`].
pub const BYTES: [&[u8]; 8] = [
    include_bytes!("../../../examples/tables/dock.posegate"),
    include_bytes!("../../../examples/tables/see-t7.posegate"),
    include_bytes!("../../../examples/tables/see-t7-grid.posegate"),
    include_bytes!("../../data/turning.posegate"),
    include_bytes!("../../data/over-180.posegate"),
    include_bytes!("../../data/over-180-grid.posegate"),
    include_bytes!("../../data/corner.posegate"),
    include_bytes!("../../data/whole-circle.posegate"),
];

/// Half widths of the box that is the success set of `dock` in `examples/sites/dock.toml`, centred at the
/// origin: m, m, degrees.
pub const DOCK: [f64; 3] = [0.08, 0.06, 4.0];

/// Returns [`BYTES`] as tables.
pub fn all() -> &'static [Table<'static>; 8] {
    static TABLES: OnceLock<[Table<'static>; 8]> = OnceLock::new();
    TABLES.get_or_init(|| BYTES.map(|bytes| Table::parse(bytes).expect("a committed table")))
}
