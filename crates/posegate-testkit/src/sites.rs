//! Success sets and tables for tests.

use posegate::bake::{BakeInput, Rows, TableSpec, grid, write_grid};
use posegate::verify::ExpectedTable;
use posegate_site::{SAMPLE, Site};

/// Returns the sample site.
pub fn sample() -> Site {
    Site::parse(SAMPLE, "sample.toml").unwrap()
}

/// Returns the input from which a task's table is baked.
pub fn order<'a>(site: &'a Site, task: &'a str) -> BakeInput<'a> {
    let found = site.task(task).unwrap();
    BakeInput {
        task,
        success: &found.success,
        spec: *site.table_spec(found).unwrap(),
        epsilon: site.epsilon,
    }
}

/// Returns the facts with which a task's table must agree.
pub fn claim<'a>(site: &'a Site, task: &'a str) -> ExpectedTable<'a> {
    ExpectedTable {
        task,
        success: &site.task(task).unwrap().success,
        epsilon: site.epsilon,
    }
}

/// Returns the table of a task of the sample site.
pub fn table(task: &str) -> Vec<u8> {
    grid(&order(&sample(), task), &|| ()).unwrap()
}

/// Returns a table of the sample site's dock with the given runs.
pub fn table_of(spec: TableSpec, slabs: &[Rows]) -> Vec<u8> {
    let site = sample();
    let order = BakeInput {
        spec,
        ..order(&site, "dock")
    };
    write_grid(&order, &spec.cells().unwrap(), slabs).unwrap()
}

/// Writes the correct checksum into the bytes.
pub fn repair(bytes: &mut [u8]) {
    let end = bytes.len() - 4;
    let crc = posegate::table::checksum(&bytes[..end]);
    bytes[end..].copy_from_slice(&crc.to_le_bytes());
}
