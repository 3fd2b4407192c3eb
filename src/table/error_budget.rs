//! The rounding of a table: the edges of its slabs of headings.

use super::Cells;
use super::tests::CELLS;
use crate::error_budget::{Random, Row, Search};
use crate::test_share;

#[test]
fn slab_edges_keep_their_error() {
    let mut random = Random::new(1);
    let mut search = Search::new();
    for _ in 0..test_share(1_000_000, 100) {
        let slabs = random.log_within(1.0, 65_535.0) as u16;
        let span = random.log_within(f64::from(slabs), 4_294_967_296.0) as u64;
        let cells = Cells {
            yaw_span: span.max(slabs.into()),
            slabs,
            ..CELLS
        };
        let k = (random.unit() * f64::from(slabs)) as u16;
        let exact = cells.yaw_span as f64 * f64::from(k) / f64::from(slabs);
        let below = exact - cells.slab_edge(k) as f64;
        assert!(below >= 0.0, "{cells:?} {k}");
        search.case(1.0, below);
        assert_eq!(cells.slab_of(cells.slab_edge(k)), k, "{cells:?}");
        assert_eq!(cells.slab_edge(slabs) as u64, cells.yaw_span);
    }
    search.report(&Row {
        name: "table: edge of a slab of headings",
        unit: "2^-32 turn",
        looseness: None,
    });
}
