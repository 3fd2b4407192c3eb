//! The committed tables equal those made from the committed site, byte for byte, and they are proven.
//!
//! `POSEGATE_BLESS=1` rewrites them.

use posegate::bake::{BakeInput, Extent, Layout, Step, TableSpec, table};
use posegate::shape::PoseDeg;
use posegate::table::{Table, checksum};
use posegate::verify::{ExpectedTable, build, coverage, verify};
use posegate_site::Site;
use std::path::Path;

#[test]
fn committed_tables_are_made_from_the_committed_site() {
    let root = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("examples");
    let site = Site::read(root.join("sites/dock.toml")).unwrap();
    for (task, file, layout) in [
        ("dock", "dock", Layout::Facets),
        ("see-t7", "see-t7", Layout::Facets),
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
        };
        let made = table(&order, &|| ()).unwrap();
        let path = root.join(format!("tables/{file}.posegate"));
        if std::env::var_os("POSEGATE_BLESS").is_some() {
            std::fs::write(&path, &made).unwrap();
        }
        let kept = std::fs::read(&path).unwrap();
        assert!(
            kept == made,
            "{file}: differs; POSEGATE_BLESS=1 cargo test -p posegate-site --test golden_tables"
        );
        let claim = ExpectedTable {
            task,
            success: &found.success,
            epsilon: site.epsilon,
        };
        let proof = verify(&kept, &claim, &|| ()).unwrap();
        assert_eq!(proof.cells > 1000, layout == Layout::Grid);
        assert_eq!(proof.corners > 10, layout == Layout::Facets);
        let table = Table::parse(&kept).unwrap();
        assert_eq!(table.tool_version(), env!("CARGO_PKG_VERSION"));
        assert_eq!(
            (table.task(), table.task_digest()),
            (task, site.task_digest(found))
        );
    }
    // Facets in several pieces, for the budgets of a decision. Two tags took 29 kB with cells.
    let bay = Site::read(root.join("sites/loading-bay.toml")).unwrap();
    let order = chosen(&bay, "see-bay");
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

/// The tables of the gate's self-test, of a tag that is seen from an unusual place.
#[test]
fn self_test_tables_equal_those_that_are_made() {
    for (name, layout) in [
        ("self_test", Layout::Facets),
        ("self_test_grid", Layout::Grid),
    ] {
        let made = self_test_table(layout);
        let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))
            .join(format!("src/gate/{name}.posegate"));
        if std::env::var_os("POSEGATE_BLESS").is_some() {
            std::fs::write(&path, &made).unwrap();
        }
        assert!(
            std::fs::read(&path).unwrap() == made,
            "POSEGATE_BLESS=1 cargo test -p posegate-site --test golden_tables"
        );
        assert!(made.len() <= 800, "{}", made.len());
        let table = Table::parse(&made).unwrap();
        assert!(table.grid().is_some() == (layout == Layout::Grid));
        assert!(table.sight_record().is_none());
    }
}

/// Returns the table of a task as the site asks for it.
fn chosen<'a>(site: &'a Site, task: &'a str) -> BakeInput<'a> {
    let found = site.task(task).unwrap();
    BakeInput {
        task,
        success: &found.success,
        spec: site.chosen_table(found).unwrap(),
        epsilon: site.epsilon,
    }
}

/// A look of a synthetic plant. Its chords meet 3 to 6 mm outside of the set: it has no table with insets of 12 units alone.
#[test]
fn look_with_slanted_chords_has_a_table() {
    let camera = include_str!("../../../examples/sites/dock.toml");
    let camera = &camera[..camera.find("[tag.").unwrap()];
    let text = format!(
        "{camera}[tag.t]\nid = 73\nfamily = \"tag36h11\"\nsize = 0.16\n\
         pose = {{ x = 20.05651869218019, y = 0.0, z = 0.594535777917998, roll_deg = 0.0, pitch_deg = 0.0, yaw_deg = 90.0 }}\n\
         [task.see]\nkind = \"localization\"\ngoal = {{ x = 20.16408323186995, y = 1.1710996984885498, yaw_deg = -90.0 }}\n\
         success = {{ shape = \"visibility\", camera = \"front\", tag = \"t\", d_max = 3.5, phi_max_deg = 25.0, psi_max_deg = 50.0, walls = [] }}\n\
         error_bound = {{ translation = 0.03, yaw_deg = 1.0 }}\n"
    );
    let site = Site::parse(&text, "site.toml").unwrap();
    let order = chosen(&site, "see");
    let (bytes, _) = build(&order, &|| ()).unwrap();
    let share = coverage(&Table::parse(&bytes).unwrap(), order.success).share;
    assert!(share > 0.95, "{share}");
}

/// Returns a proven table without its sight record.
fn self_test_table(layout: Layout) -> Vec<u8> {
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
            layout,
        },
        epsilon: 0.99,
    };
    let (mut bytes, _) = build(&order, &|| ()).unwrap();
    let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
    let sight_at = word(92);
    bytes.truncate(sight_at as usize);
    for (at, value) in [(12, sight_at + 4), (92, 0)] {
        bytes[at..at + 4].copy_from_slice(&value.to_le_bytes());
    }
    // It is of no site's task.
    bytes[96..128].fill(0);
    bytes.extend(checksum(&bytes).to_le_bytes());
    bytes
}
