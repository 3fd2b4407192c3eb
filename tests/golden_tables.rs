//! The committed tables are what the committed site makes, byte for byte, and they are proven.
//!
//! `POSEGATE_BLESS=1` rewrites them.
#![cfg(feature = "std")]

use posegate::bake::{Layout, Order, TableSpec, table};
use posegate::site::Site;
use posegate::table::Table;
use posegate::verify::{Claim, verify};
use std::path::Path;

#[test]
fn committed_tables_are_made_from_the_committed_site() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples");
    let site = Site::read(root.join("sites/dock.toml")).unwrap();
    for (task, file, layout) in [
        ("dock", "dock", Layout::Auto),
        ("see-t7", "see-t7", Layout::Auto),
        ("see-t7", "see-t7-grid", Layout::Grid),
    ] {
        let found = site.task(task).unwrap();
        let order = Order {
            task,
            success: &found.success,
            spec: TableSpec {
                layout,
                ..*site.table_spec(found).unwrap()
            },
            epsilon: site.epsilon,
            site_digest: site.digest,
        };
        let made = table(&order, &|| ()).unwrap();
        let path = root.join(format!("tables/{file}.posegate"));
        if std::env::var_os("POSEGATE_BLESS").is_some() {
            std::fs::write(&path, &made).unwrap();
        }
        let kept = std::fs::read(&path).unwrap();
        assert!(
            kept == made,
            "{file}: differs; POSEGATE_BLESS=1 cargo test --features cli --test golden_tables"
        );
        let claim = Claim {
            task,
            success: &found.success,
            epsilon: site.epsilon,
            site_digest: site.digest,
        };
        let proof = verify(&kept, &claim, &|| ()).unwrap();
        assert_eq!(proof.cells > 1000, layout == Layout::Grid);
        assert_eq!(proof.corners > 10, layout == Layout::Auto);
        let table = Table::parse(&kept).unwrap();
        assert_eq!(table.tool_version(), env!("CARGO_PKG_VERSION"));
        assert_eq!((table.task(), table.site_digest()), (task, site.digest));
    }
    // Reference set A at 2 cm and 1 degree.
    let length = |file: &str| std::fs::metadata(root.join(file)).unwrap().len();
    assert!(length("tables/see-t7-grid.posegate") <= 16_000);
    assert!(length("tables/see-t7.posegate") <= 500);
}
