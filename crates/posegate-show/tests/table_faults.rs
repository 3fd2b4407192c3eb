//! Damaged tables are refused; wrong tables are not proven.

use posegate_testkit::{counts, sites};

use posegate::bake::{BakeError, BakeInput, Extent, Layout, Step, TableSpec, grid, write_grid};
use posegate::shape::{Footprint, Shape, SuccessSet};
use posegate::table::{Cells, HEADER_LENGTH, Run, SIGHT_LENGTH, Table, TableError};
use posegate::verify::{VerifyError, verify};
use posegate_show::draw::study::CaseStudy;
use rayon::prelude::*;
use sites::{claim, order, repair, sample, table};

/// Checks that each damaged copy of a table is refused. Returns their number.
fn damage(name: &str, bytes: &[u8]) -> usize {
    assert!(Table::parse(bytes).is_ok(), "{name}");
    // In place, because copies of a large table would take most of the time.
    let mut damaged = bytes.to_vec();
    for bit in 0..bytes.len() * 8 {
        damaged[bit / 8] ^= 1 << (bit % 8);
        assert!(Table::parse(&damaged).is_err(), "{name}: bit {bit}");
        damaged[bit / 8] ^= 1 << (bit % 8);
    }
    for length in 0..bytes.len() {
        assert!(
            Table::parse(&bytes[..length]).is_err(),
            "{name}: length {length}"
        );
    }
    for more in 1..=64 {
        for fill in [0, 0xff] {
            let mut longer = bytes.to_vec();
            longer.resize(bytes.len() + more, fill);
            assert!(Table::parse(&longer).is_err());
        }
    }
    bytes.len() * 9 + 128
}

/// The demo's tables and tables of facets: all bits are flipped, all lengths are tried.
#[test]
fn every_flipped_bit_and_every_truncation_is_refused() {
    let study = CaseStudy::run(&|| ()).unwrap();
    assert_eq!(study.tables.len(), 3);
    let mut tables: Vec<(String, Vec<u8>)> = study
        .tables
        .into_iter()
        .map(|table| (format!("the demo's {}", table.task), table.bytes))
        .collect();
    tables.push(("dock".into(), table("dock")));
    for name in ["dock", "see-t7"] {
        let path = format!(
            "{}/examples/tables/{name}.posegate",
            concat!(env!("CARGO_MANIFEST_DIR"), "/../..")
        );
        tables.push((path.clone(), std::fs::read(path).unwrap()));
    }
    let tried: usize = tables
        .par_iter()
        .map(|(name, bytes)| damage(name, bytes))
        .sum();
    let bytes: usize = tables.iter().map(|(_, bytes)| bytes.len()).sum();
    assert_eq!(tried, bytes * 9 + 128 * tables.len());
    println!(
        "{{\"name\": \"tables damaged by a bit, a cut or more bytes\", \"tried\": {tried}, \"value\": 0, \"unit\": \"accepted\", \"goal\": 0}}"
    );
}

/// Returns a facet table of a task of the sample site.
fn facets(task: &str) -> Vec<u8> {
    let site = sample();
    let mut order = order(&site, task);
    order.spec.layout = Layout::Facets;
    posegate::bake::table(&order, &|| ()).unwrap()
}

#[test]
fn erased_flash_is_refused() {
    for fill in [0x00, 0xff, 0xa5] {
        for length in [0, 4, 179, 180, 181, 4096] {
            assert!(Table::parse(&vec![fill; length]).is_err());
        }
    }
    let bytes = table("dock");
    let mut swapped = bytes.clone();
    swapped.rotate_left(bytes.len() / 2);
    assert!(Table::parse(&swapped).is_err());
}

#[test]
fn another_version_has_its_own_error() {
    let mut bytes = table("dock");
    bytes[8] = 2;
    repair(&mut bytes);
    assert_eq!(Table::parse(&bytes).err(), Some(TableError::TooNew));
    let mut bytes = table("dock");
    bytes[0] = b'p';
    repair(&mut bytes);
    assert_eq!(Table::parse(&bytes).err(), Some(TableError::Magic));
}

/// If the checksum is corrected, a changed header byte is refused by the parser or by the proof.
#[test]
fn proof_checks_every_header_field() {
    let site = sample();
    let claim = claim(&site, "dock");
    let bytes = table("dock");
    let (mut parser, mut proof) = (0, 0);
    for at in 0..HEADER_LENGTH {
        for flip in [0x01, 0x80, 0xff] {
            let mut changed = bytes.clone();
            changed[at] ^= flip;
            repair(&mut changed);
            match verify(&changed, &claim, &|| ()) {
                Err(VerifyError::Table(_)) => parser += 1,
                Err(_) => proof += 1,
                // The proof may accept these: the tool's version is for information, and cells
                // that are moved or stretched may still lie inside the set.
                Ok(_) => assert!(
                    (36..62).contains(&at) || (160..176).contains(&at),
                    "byte {at} ^ {flip:#x}"
                ),
            }
        }
    }
    assert!(parser > 60 && proof > 150, "{parser} {proof}");
}

/// Returns the offset of the sight record.
fn sight_at(bytes: &[u8]) -> usize {
    u32::from_le_bytes(bytes[92..96].try_into().unwrap()) as usize
}

/// The parser or the proof refuses the least change of any byte of a sight record, and its loss.
#[test]
fn proof_checks_every_number_of_the_sight_record() {
    let site = sample();
    let claim = claim(&site, "see-t7");
    let bytes = facets("see-t7");
    verify(&bytes, &claim, &|| ()).unwrap();
    let start = sight_at(&bytes);
    assert_eq!(start + SIGHT_LENGTH + 4, bytes.len());
    let (mut parser, mut proof) = (0, 0);
    let mut fields = std::collections::BTreeSet::new();
    for at in start..start + SIGHT_LENGTH {
        for bit in 0..8 {
            let mut changed = bytes.clone();
            changed[at] ^= 1 << bit;
            repair(&mut changed);
            match verify(&changed, &claim, &|| ()) {
                Err(VerifyError::Table(TableError::Sight)) => parser += 1,
                Err(VerifyError::Header { field, .. }) => {
                    fields.insert(field);
                    proof += 1;
                }
                other => panic!("byte {at}, bit {bit}: {other:?}"),
            }
        }
    }
    println!("{parser} by the parser, {proof} by the proof: {fields:?}");
    assert!(parser > 300 && proof > 500 && fields.len() == 19);
    for (offset, expected) in [
        (0, Err("sight record")),
        (HEADER_LENGTH, Ok(TableError::Sight)),
        (HEADER_LENGTH - 1, Ok(TableError::Header)),
        (start + 1, Ok(TableError::Header)),
        (start + 4, Ok(TableError::Header)),
        (u32::MAX as usize, Ok(TableError::Header)),
    ] {
        let mut changed = bytes.clone();
        changed[92..96].copy_from_slice(&(offset as u32).to_le_bytes());
        repair(&mut changed);
        let found = match verify(&changed, &claim, &|| ()) {
            Err(VerifyError::Table(error)) => Ok(error),
            Err(VerifyError::Header { field, .. }) => Err(field),
            other => panic!("{offset}: {other:?}"),
        };
        assert_eq!(found, expected, "{offset}");
    }
}

/// A table of another kind of set has no sight record, and must not have one.
#[test]
fn only_visibility_sets_have_a_sight_record() {
    let site = sample();
    let record = facets("see-t7");
    let record = &record[sight_at(&record)..record.len() - 4];
    for task in ["dock", "park"] {
        let mut bytes = facets(task);
        assert_eq!(sight_at(&bytes), 0);
        let claim = claim(&site, task);
        verify(&bytes, &claim, &|| ()).unwrap();
        let at = bytes.len() - 4;
        bytes.splice(at..at, record.iter().copied());
        let length = bytes.len() as u32;
        bytes[12..16].copy_from_slice(&length.to_le_bytes());
        bytes[92..96].copy_from_slice(&(at as u32).to_le_bytes());
        repair(&mut bytes);
        assert!(Table::parse(&bytes).unwrap().sight_record().is_some());
        assert!(matches!(
            verify(&bytes, &claim, &|| ()),
            Err(VerifyError::Header {
                field: "sight record",
                ..
            })
        ));
    }
}

/// If any one run is widened by one cell, `verify` names that cell.
#[test]
fn run_that_is_one_cell_too_wide_is_not_proven() {
    let site = sample();
    for (task, slab_step, row_step) in [("dock", 1, 1), ("park", 1, 2), ("see-t7", 2, 3)] {
        let mut order = order(&site, task);
        // Coarse cells, because each change below needs a proof of the whole table.
        order.spec.step = match task {
            "see-t7" => Step {
                xy: 0.1,
                yaw_deg: 4.0,
            },
            "park" => Step {
                xy: 0.05,
                yaw_deg: 2.0,
            },
            _ => order.spec.step,
        };
        let claim = claim(&site, task);
        let bytes = grid(&order, &|| ()).unwrap();
        let proof = verify(&bytes, &claim, &|| ()).unwrap();
        assert!(proof.runs > 40 && proof.cells > 300);
        let parsed = Table::parse(&bytes).unwrap();
        let cells = parsed.cells();
        let slabs: Vec<Vec<Vec<Run>>> = (0..cells.slabs)
            .map(|k| {
                let slab = parsed.grid().unwrap().slab(k);
                (0..cells.rows)
                    .map(|row| slab.runs(row).collect())
                    .collect()
            })
            .collect();
        let rewritten = write_grid(&order, cells, &slabs).unwrap();
        assert_eq!(rewritten, bytes, "the bytes come back from their runs");
        let mut tried = 0;
        // A sample of slabs and rows; every run would take minutes. A third of it each day, all of it in a deep job.
        let (skipped, parts) = counts::part(3);
        let sampled = (0..slabs.len()).step_by(slab_step);
        for slab in sampled.skip(skipped).step_by(parts) {
            for row in (0..slabs[slab].len()).step_by(row_step) {
                let Some(run) = slabs[slab][row].first().copied() else {
                    continue;
                };
                let wider = [
                    Run {
                        last: run.last + 1,
                        ..run
                    },
                    Run {
                        first: run.first.wrapping_sub(1),
                        ..run
                    },
                ];
                for (wider, column) in wider
                    .into_iter()
                    .zip([run.last + 1, run.first.wrapping_sub(1)])
                {
                    if wider.last >= cells.columns || wider.first >= cells.columns {
                        continue;
                    }
                    let mut changed = slabs.clone();
                    changed[slab][row][0] = wider;
                    let bytes = write_grid(&order, cells, &changed).unwrap();
                    match verify(&bytes, &claim, &|| ()) {
                        Err(VerifyError::Cell(cell)) => {
                            assert_eq!(
                                (usize::from(cell.slab), usize::from(cell.row), cell.column),
                                (slab, row, column)
                            );
                            tried += 1;
                        }
                        // `bake` keeps a small distance from the border, so the cell may be inside.
                        Ok(_) => assert!(
                            is_inside(order.success, cells, slab, row, column),
                            "{task} {slab} {row} {column}"
                        ),
                        Err(other) => panic!("{other}"),
                    }
                }
            }
        }
        assert!(tried >= 10, "{task}: {tried}");
    }
}

/// Returns `true` if a lattice of poses of a cell is in the set.
fn is_inside(success: &SuccessSet, cells: &Cells, slab: usize, row: usize, column: u16) -> bool {
    let goal = success.goal;
    let (sin, cos) = goal.yaw_deg.to_radians().sin_cos();
    let unit = std::f64::consts::TAU / 4_294_967_296.0;
    let yaw_lo = f64::from(cells.yaw_lo.signed());
    let edges = [slab as u16, slab as u16 + 1].map(|k| (yaw_lo + cells.slab_edge(k) as f64) * unit);
    let parts = [0.001, 0.25, 0.5, 0.75, 0.999];
    let at = |lo: i32, index: f64, part: f64| {
        (f64::from(lo) + (index + part) * f64::from(cells.step_um)) * 1e-6
    };
    parts.iter().all(|a| {
        parts.iter().all(|b| {
            parts.iter().all(|c| {
                let (x, y) = (
                    at(cells.x_lo_um, f64::from(column), *a),
                    at(cells.y_lo_um, row as f64, *b),
                );
                let yaw = edges[0] + c * (edges[1] - edges[0]) + goal.yaw_deg.to_radians();
                success
                    .membership([goal.x + cos * x - sin * y, goal.y + sin * x + cos * y, yaw])
                    .inside
            })
        })
    })
}

/// Sampling of corners would accept this table: in a wide slab the parked car swings out between the sampled
/// headings.
#[test]
fn exit_between_samples_is_not_proven() {
    let site = sample();
    let task = site.task("park").unwrap();
    // The vertex (2, 1) is farthest along x at a heading of -26.57 deg, so the slab is [-40, -13.13].
    let region = |x: f64| vec![[-x, -3.0], [x, -3.0], [x, 3.0], [-x, 3.0]];
    let footprint = vec![[-2.0, -1.0], [2.0, -1.0], [2.0, 1.0], [-2.0, 1.0]];
    let diagonal = 2.0f64.hypot(1.0);
    let at_ends = diagonal * 13.435f64.to_radians().cos();
    assert!(at_ends + 0.02 < diagonal - 0.01);
    let success = SuccessSet {
        goal: task.success.goal,
        shape: Shape::Footprint(Footprint::new(footprint, region(at_ends + 0.02)).unwrap()),
    };
    let [from, to] = [-40.0, -13.13];
    for yaw in [from, to] {
        let heading = success.goal.yaw_deg + yaw;
        let goal = success.goal;
        let inside = success
            .membership([goal.x, goal.y, f64::to_radians(heading)])
            .inside;
        assert!(inside, "the set holds the goal at {yaw} deg");
    }
    let spec = TableSpec {
        extent: Extent {
            x: [-0.01, 0.01],
            y: [-0.01, 0.01],
            yaw_deg: [from, to],
        },
        step: Step {
            xy: 0.02,
            yaw_deg: 40.0,
        },
        layout: Layout::Grid,
    };
    let order = BakeInput {
        task: "dip",
        success: &success,
        spec,
        epsilon: 0.99,
    };
    let cells = spec.cells().unwrap();
    assert_eq!((cells.columns, cells.rows, cells.slabs), (1, 1, 1));
    let whole = vec![vec![vec![Run { first: 0, last: 0 }]]];
    let bytes = write_grid(&order, &cells, &whole).unwrap();
    let claim = posegate::verify::ExpectedTable {
        task: "dip",
        success: &success,
        epsilon: 0.99,
    };
    // Every corner of the only cell is inside ...
    let goal = success.goal;
    let [sin, cos] = [
        goal.yaw_deg.to_radians().sin(),
        goal.yaw_deg.to_radians().cos(),
    ];
    for x in [-0.01, 0.01] {
        for y in [-0.01, 0.01] {
            for yaw in [from, to] {
                let world = [
                    goal.x + cos * x - sin * y,
                    goal.y + sin * x + cos * y,
                    (goal.yaw_deg + yaw).to_radians(),
                ];
                assert!(success.membership(world).inside);
            }
        }
    }
    // ... and the cell is not.
    assert!(matches!(
        verify(&bytes, &claim, &|| ()),
        Err(VerifyError::Cell(_))
    ));
}

#[test]
fn bytes_are_equal_for_any_number_of_threads() {
    let site = sample();
    let order = order(&site, "see-t7");
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| grid(&order, &|| ()).unwrap())
    };
    let one = with(1);
    assert!(with(2) == one && with(7) == one);
}

#[test]
fn values_beyond_the_format_are_refused_with_numbers() {
    let site = sample();
    let with = |extent: Extent, step: Step| {
        let mut order = order(&site, "dock");
        order.spec.extent = extent;
        order.spec.step = step;
        grid(&order, &|| ()).unwrap_err()
    };
    let extent = |half: f64| Extent {
        x: [-half, half],
        y: [-half, half],
        yaw_deg: [-4.0, 4.0],
    };
    let step = |xy: f64| Step { xy, yaw_deg: 1.0 };
    let error = with(extent(100.0), step(0.001));
    assert!(
        matches!(error, BakeError::TooLarge { count, .. } if count == 200_000.0),
        "{error}"
    );
    assert!(
        error
            .to_string()
            .contains("200000 cells along x, at most 65535"),
        "{error}"
    );
    assert!(matches!(
        with(extent(200.0), step(1.0)),
        BakeError::TooFar { .. }
    ));
    assert!(matches!(
        with(extent(0.01), step(0.5)),
        BakeError::Empty { .. } | BakeError::TooLarge { .. }
    ));
    assert_eq!(with(extent(f64::NAN), step(0.1)), BakeError::BadExtent);
    assert_eq!(with(extent(0.0), step(0.1)), BakeError::BadExtent);
    assert_eq!(with(extent(0.1), step(0.0)), BakeError::BadExtent);
}
