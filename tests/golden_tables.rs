//! The committed tables are what the committed site makes, byte for byte, and they are proven.
//!
//! `POSEGATE_BLESS=1` rewrites them.
#![cfg(feature = "std")]

use posegate::bake::{Order, grid};
use posegate::site::Site;
use posegate::table::Table;
use posegate::verify::{Claim, verify};
use std::path::Path;

#[test]
fn committed_tables_are_made_from_the_committed_site() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples");
    let site = Site::read(root.join("sites/dock.toml")).unwrap();
    for task in ["dock", "see-t7"] {
        let found = site.task(task).unwrap();
        let order = Order {
            task,
            success: &found.success,
            spec: *site.table_spec(found).unwrap(),
            epsilon: site.epsilon,
            site_digest: site.digest,
        };
        let made = grid(&order, &|| ()).unwrap();
        let path = root.join(format!("tables/{task}.posegate"));
        if std::env::var_os("POSEGATE_BLESS").is_some() {
            std::fs::write(&path, &made).unwrap();
        }
        let kept = std::fs::read(&path).unwrap();
        assert!(
            kept == made,
            "{task}: differs; POSEGATE_BLESS=1 cargo test --features cli --test golden_tables"
        );
        let claim = Claim {
            task,
            success: &found.success,
            epsilon: site.epsilon,
            site_digest: site.digest,
        };
        assert!(verify(&kept, &claim, &|| ()).unwrap().cells > 1000);
        let table = Table::parse(&kept).unwrap();
        assert_eq!(table.tool_version(), env!("CARGO_PKG_VERSION"));
        assert_eq!((table.task(), table.site_digest()), (task, site.digest));
    }
    // The grid of reference set A at 2 cm and 1 degree.
    assert!(
        std::fs::metadata(root.join("tables/see-t7.posegate"))
            .unwrap()
            .len()
            <= 16_000
    );
}
