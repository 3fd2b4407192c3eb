//! The committed tables equal those made from the committed site, byte for byte, and they are proven.
//!
//! `POSEGATE_BLESS=1` rewrites them.

use posegate::bake::{BakeInput, Extent, Layout, Step, TableSpec, table};
use posegate::shape::PoseDeg;
use posegate::table::{Table, checksum};
use posegate::verify::{ExpectedTable, verify};
use posegate_host::site::Site;
use std::path::Path;

#[test]
fn committed_tables_are_made_from_the_committed_site() {
    let root = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("examples");
    let site = Site::read(root.join("sites/dock.toml")).unwrap();
    for (task, file, layout) in [
        ("dock", "dock", Layout::Auto),
        ("see-t7", "see-t7", Layout::Auto),
        ("see-t7", "see-t7-grid", Layout::Grid),
    ] {
        let found = site.task(task).unwrap();
        let order = BakeInput {
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
            "{file}: differs; POSEGATE_BLESS=1 cargo test -p posegate-host --test golden_tables"
        );
        let claim = ExpectedTable {
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
    // Facets in several pieces, for the budgets of a decision. Two tags took 29 kB with cells.
    let bay = Site::read(root.join("sites/loading-bay.toml")).unwrap();
    let task = bay.task("see-bay").unwrap();
    let order = BakeInput {
        task: "see-bay",
        success: &task.success,
        spec: bay.chosen_table(task).unwrap(),
        epsilon: bay.epsilon,
        site_digest: bay.digest,
    };
    let (made, proof) = posegate::verify::build(&order, &|| ()).unwrap();
    let path = root.join("../tests/data/see-bay.posegate");
    if std::env::var_os("POSEGATE_BLESS").is_some() {
        std::fs::write(&path, &made).unwrap();
    }
    assert!(
        std::fs::read(path).unwrap() == made && proof.cells == 0 && proof.corners > 0,
        "see-bay: differs"
    );
    assert!(made.len() <= 3_000, "{} bytes", made.len());
    // Reference set A at 2 cm and 1 degree.
    let length = |file: &str| std::fs::metadata(root.join(file)).unwrap().len();
    assert!(length("tables/see-t7-grid.posegate") <= 16_000);
    assert!(length("tables/see-t7.posegate") <= 500);
}

/// The table of the gate's self-test, with both layouts, of a tag that is seen from an unusual place.
#[test]
fn self_test_table_equals_the_one_that_is_made() {
    let examples = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("examples");
    let site = Site::read(examples.join("sites/dock.toml")).unwrap();
    let mut success = site.task("see-t7").unwrap().success.clone();
    success.goal = PoseDeg {
        x: 0.3,
        y: -0.1,
        yaw_deg: 5.0,
    };
    let order = BakeInput {
        task: "self-test",
        success: &success,
        spec: TableSpec {
            extent: Extent {
                x: [-2.0, 2.0],
                y: [-1.2, 1.2],
                yaw_deg: [-15.0, 12.0],
            },
            step: Step {
                xy: 0.2,
                yaw_deg: 3.0,
            },
            layout: Layout::Both,
        },
        epsilon: 0.99,
        site_digest: [0; 32],
    };
    let made = table(&order, &|| ()).unwrap();
    let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))
        .join("src/gate/self_test.posegate");
    if std::env::var_os("POSEGATE_BLESS").is_some() {
        std::fs::write(&path, &made).unwrap();
    }
    assert!(
        std::fs::read(&path).unwrap() == made,
        "POSEGATE_BLESS=1 cargo test -p posegate-host --test golden_tables"
    );
    let claim = ExpectedTable {
        task: "self-test",
        success: &success,
        epsilon: 0.99,
        site_digest: [0; 32],
    };
    verify(&made, &claim, &|| ()).unwrap();
    assert!(made.len() <= 1_000, "{}", made.len());
    let table = Table::parse(&made).unwrap();
    assert!(table.grid().is_some() && table.facets().is_some());
    let facets = facets_alone(&made);
    let path = path.with_file_name("self_test_facets.posegate");
    if std::env::var_os("POSEGATE_BLESS").is_some() {
        std::fs::write(&path, &facets).unwrap();
    }
    assert!(
        std::fs::read(&path).unwrap() == facets,
        "POSEGATE_BLESS=1 cargo test -p posegate-host --test golden_tables"
    );
    let table = Table::parse(&facets).unwrap();
    assert!(table.grid().is_none() && table.facets().is_some() && table.sight_record().is_none());
}

/// Returns a table without its cells and its sight record.
fn facets_alone(bytes: &[u8]) -> Vec<u8> {
    let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
    let (start, length) = (word(76), word(80));
    let mut alone = bytes[..176].to_vec();
    alone.extend(&bytes[start..start + length]);
    let total = alone.len() as u32 + 4;
    for (at, value) in [(12, total), (68, 0), (72, 0), (76, 176), (92, 0)] {
        alone[at..at + 4].copy_from_slice(&value.to_le_bytes());
    }
    alone.extend(checksum(&alone).to_le_bytes());
    alone
}
