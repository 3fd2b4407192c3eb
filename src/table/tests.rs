pub(crate) use super::grid::tests::Rows;
use super::grid::tests::layout;
use super::*;

#[test]
fn heading_on_slab_edge_is_in_both_slabs() {
    for (span, slabs) in [
        (1u64 << 32, 360u16),
        (1 << 32, 7),
        (477_218_588, 40),
        (40, 40),
        (41, 40),
    ] {
        let cells = Cells {
            yaw_span: span,
            slabs,
            ..CELLS
        };
        assert!(cells.are_valid());
        assert_eq!(cells.slab_edge(0), 0);
        assert_eq!(cells.slab_edge(slabs), span as i64);
        for k in 0..slabs {
            let (lo, hi) = (cells.slab_edge(k), cells.slab_edge(k + 1));
            assert!(lo < hi);
            assert_eq!(cells.slab_of(lo), k);
            assert_eq!(cells.slab_of(hi - 1), k);
        }
        assert_eq!(cells.slab_of(span as i64), slabs - 1);
    }
}

#[test]
fn goal_rotation_must_be_a_unit_vector() {
    assert!(is_unit(1 << 30, 0));
    assert!(is_unit(759_250_125, -759_250_125));
    assert!(!is_unit(0, 0));
    assert!(!is_unit(1 << 30, 1 << 20));
    assert!(!is_unit(i32::MIN, i32::MIN));
    assert!(is_unit((1 << 30) - 1, 1));
    // 2^32 too much, and slightly less.
    assert!(!is_unit(1 << 30, 1 << 16));
    assert!(is_unit(1 << 30, (1 << 16) - 1));
}

/// Returns a table with a grid for tests, with the goal at `(2, -1)` m and a heading of 90 degrees.
pub(crate) fn table_of(cells: &Cells, slabs: &[Rows], several: bool) -> Vec<u8> {
    let grid = layout(slabs, cells.columns > 255, several);
    let mut bytes = vec![0; HEADER_LENGTH];
    let mut put = |at: usize, field: &[u8]| bytes[at..at + field.len()].copy_from_slice(field);
    put(0, &MAGIC);
    put(8, &VERSION.to_le_bytes());
    put(10, &(HEADER_LENGTH as u16).to_le_bytes());
    let length = HEADER_LENGTH + grid.len() + CRC_LENGTH;
    put(12, &(length as u32).to_le_bytes());
    put(16, &2_000_000i32.to_le_bytes());
    put(20, &(-1_000_000i32).to_le_bytes());
    put(24, &(1u32 << 30).to_le_bytes());
    put(28, &0i32.to_le_bytes());
    put(32, &(1i32 << 30).to_le_bytes());
    put(36, &cells.x_lo_um.to_le_bytes());
    put(40, &cells.y_lo_um.to_le_bytes());
    put(44, &cells.step_um.to_le_bytes());
    put(48, &cells.columns.to_le_bytes());
    put(50, &cells.rows.to_le_bytes());
    put(52, &cells.yaw_lo.0.to_le_bytes());
    put(56, &(cells.yaw_span as u32).to_le_bytes());
    put(60, &cells.slabs.to_le_bytes());
    put(64, &743_498u32.to_le_bytes());
    put(68, &(HEADER_LENGTH as u32).to_le_bytes());
    put(72, &(grid.len() as u32).to_le_bytes());
    put(84, &0.99f64.to_le_bytes());
    put(96, &[7; 32]);
    put(128, b"dock");
    put(160, b"0.1.0");
    bytes.extend(grid);
    bytes.extend([0; CRC_LENGTH]);
    repair(&mut bytes);
    bytes
}

fn repair(bytes: &mut [u8]) {
    let (content, crc) = bytes.split_at_mut(bytes.len() - CRC_LENGTH);
    crc.copy_from_slice(&checksum(content).to_le_bytes());
}

pub(super) const CELLS: Cells = Cells {
    x_lo_um: -3_000,
    y_lo_um: -1_000,
    step_um: 500,
    columns: 9,
    rows: 3,
    yaw_lo: BinaryAngle(u32::MAX - 99),
    yaw_span: 200,
    slabs: 2,
};

fn small() -> Vec<u8> {
    let rows = Rows {
        first_row: 0,
        runs: vec![vec![(0, 8)]; 3],
    };
    table_of(&CELLS, &[rows.clone(), rows], false)
}

#[test]
fn table_reads_back_written_header() {
    let bytes = small();
    let table = Table::parse(&bytes).unwrap();
    let goal = GoalFrame {
        pose: Pose {
            x_um: 2_000_000,
            y_um: -1_000_000,
            yaw: BinaryAngle(1 << 30),
        },
        cos_q30: 0,
        sin_q30: 1 << 30,
    };
    assert_eq!(*table.goal(), goal);
    assert_eq!(*table.cells(), CELLS);
    assert_eq!((CELLS.x_hi_um(), CELLS.y_hi_um()), (1_500, 500));
    assert_eq!(table.radius_squared().q16(), 743_498);
    assert_eq!(table.epsilon(), 0.99);
    assert_eq!(table.task(), "dock");
    assert_eq!(table.tool_version(), "0.1.0");
    assert_eq!(table.task_digest(), [7; 32]);
    let crc = checksum(&bytes[..bytes.len() - CRC_LENGTH]);
    assert_eq!(table.crc(), crc);
    assert_eq!(table.bytes(), bytes);
    assert!(table.facets().is_none());
    let grid = table.grid().unwrap();
    assert_eq!(grid.byte_length(), bytes.len() - HEADER_LENGTH - CRC_LENGTH);
    assert_eq!(grid.slab(1).rows(), 3);

    let whole = Cells {
        yaw_span: 1 << 32,
        ..CELLS
    };
    let rows = Rows {
        first_row: 0,
        runs: vec![],
    };
    let bytes = table_of(&whole, &[rows.clone(), rows], false);
    assert_eq!(*Table::parse(&bytes).unwrap().cells(), whole);
    assert!(whole.is_whole_circle() && !CELLS.is_whole_circle());
}

#[test]
fn each_invalid_table_has_its_error() {
    let error = |bytes: &[u8]| Table::parse(bytes).err();
    for length in 0..HEADER_LENGTH + CRC_LENGTH {
        assert_eq!(error(&vec![0; length]), Some(TableError::TooShort));
    }
    let empty = [0; HEADER_LENGTH + CRC_LENGTH];
    assert_eq!(error(&empty), Some(TableError::Magic));
    let with = |at: usize, field: &[u8]| {
        let mut bytes = small();
        bytes[at..at + field.len()].copy_from_slice(field);
        repair(&mut bytes);
        error(&bytes)
    };
    assert_eq!(with(0, &MAGIC), None);
    assert_eq!(with(7, b"e"), Some(TableError::Magic));
    for version in [2u16, 257] {
        assert_eq!(with(8, &version.to_le_bytes()), Some(TableError::TooNew));
    }
    let length = small().len() as u32;
    for length in [length - 1, length + 1, 0] {
        assert_eq!(with(12, &length.to_le_bytes()), Some(TableError::Length));
    }
    let mut damaged = small();
    damaged[100] ^= 1;
    assert_eq!(error(&damaged), Some(TableError::Checksum));
    // The grid's number of slabs, and its first bytes.
    assert_eq!(with(60, &[1, 0]), Some(TableError::Grid));
    assert_eq!(with(HEADER_LENGTH, &[9]), Some(TableError::Grid));
}

#[test]
fn each_field_has_its_range() {
    let accepts = |at: usize, field: &[u8]| {
        let mut bytes = small();
        bytes[at..at + field.len()].copy_from_slice(field);
        repair(&mut bytes);
        match Table::parse(&bytes) {
            Ok(_) => true,
            Err(TableError::Header) => false,
            Err(other) => panic!("{at} {field:?}: {other:?}"),
        }
    };
    let bad: [(usize, &[u8]); 19] = [
        // No table has the version 0.
        (8, &[0, 0]),
        // Header length, reserved fields.
        (10, &[175, 0]),
        (62, &[1, 0]),
        (62, &[0, 1]),
        (92, &[0, 0, 0, 1]),
        // Cosine and sine.
        (32, &[0; 4]),
        // Step, columns, rows, slabs, less yaw than slabs.
        (44, &[0; 4]),
        (44, &(-500i32).to_le_bytes()),
        (48, &[0; 2]),
        (50, &[0; 2]),
        (60, &[0; 2]),
        (56, &[1, 0, 0, 0]),
        // Radius.
        (64, &[0; 4]),
        // The grid: none, in the header, past the end, beyond the range of offsets.
        (68, &[0; 8]),
        (68, &[175, 0, 0, 0]),
        (68, &[180, 0, 0, 0]),
        (68, &[0xff; 8]),
        // Names.
        (128, &[0; 32]),
        (160, b"0.1\x000"),
    ];
    for (at, field) in bad {
        assert!(!accepts(at, field), "{at} {field:?}");
    }
    assert!(accepts(56, &[2, 0, 0, 0]));
    assert!(accepts(128, &[b'x'; 32]) && accepts(160, &[b'x'; 16]));
    assert!(!accepts(128, b"\xff") && !accepts(128, b"\0"));
    // The reach of the cells, on both axes at both ends.
    for (at, width) in [(36, 9 * 500), (40, 3 * 500)] {
        for (lo, expected) in [
            (-LARGEST_REACH_UM, true),
            (-LARGEST_REACH_UM - 1, false),
            (LARGEST_REACH_UM - width, true),
            (LARGEST_REACH_UM - width + 1, false),
        ] {
            assert_eq!(accepts(at, &lo.to_le_bytes()), expected, "{at} {lo}");
        }
    }
}
