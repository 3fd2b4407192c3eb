//! Tables from fuzzed bytes: repaired so that the parser gets past the checksum, and walked.

use posegate::table::{
    Axes, CRC_LENGTH, HEADER_LENGTH, MAGIC, NORMAL_BITS, Table, VERSION, WorstCase, checksum,
};

/// Corrects the fields that the parser checks first: magic, version, lengths and
/// checksum. With `to_the_end` the last layout gets all remaining bytes.
pub fn repair(bytes: &mut [u8], to_the_end: bool) {
    let Some(end) = bytes.len().checked_sub(CRC_LENGTH) else {
        return;
    };
    if end < HEADER_LENGTH {
        return;
    }
    bytes[..8].copy_from_slice(&MAGIC);
    bytes[8..10].copy_from_slice(&VERSION.to_le_bytes());
    bytes[10..12].copy_from_slice(&(HEADER_LENGTH as u16).to_le_bytes());
    let length = bytes.len() as u32;
    bytes[12..16].copy_from_slice(&length.to_le_bytes());
    if to_the_end {
        let offset = |at: usize| {
            let mut field = [0; 4];
            field.copy_from_slice(&bytes[at..at + 4]);
            u32::from_le_bytes(field)
        };
        let last = if offset(76) > offset(68) { 76 } else { 68 };
        let rest = (end as u32).saturating_sub(offset(last));
        bytes[last + 4..last + 8].copy_from_slice(&rest.to_le_bytes());
    }
    let crc = checksum(&bytes[..end]);
    bytes[end..].copy_from_slice(&crc.to_le_bytes());
}

/// Asserts that every accessor of a parsed table satisfies the parser's guarantees.
pub fn walk(table: &Table<'_>) -> WorstCase {
    let again = Table::parse(table.bytes()).expect("it was parsed before");
    assert_eq!(
        (again.crc(), again.task_digest()),
        (table.crc(), table.task_digest())
    );
    assert_eq!(again.epsilon().to_bits(), table.epsilon().to_bits());
    assert!(!table.task().is_empty() && !table.tool_version().is_empty());
    assert!((1 << 16..1 << 24).contains(&table.radius_squared().q16()));
    assert!(table.grid().is_some() || table.facets().is_some());
    let mut worst = WorstCase::default();
    cells(table);
    grid(table, &mut worst);
    facets(table, &mut worst);
    assert_eq!(table.worst_case(), worst);
    worst
}

fn cells(table: &Table<'_>) {
    let cells = table.cells();
    assert!(cells.step_um > 0 && cells.columns > 0 && cells.rows > 0 && cells.slabs > 0);
    assert!(cells.x_hi_um() > cells.x_lo_um && cells.y_hi_um() > cells.y_lo_um);
    let span = i64::try_from(cells.yaw_span).unwrap();
    assert_eq!(
        (cells.slab_edge(0), cells.slab_edge(cells.slabs)),
        (0, span)
    );
    for k in 0..cells.slabs.min(400) {
        let (low, high) = (cells.slab_edge(k), cells.slab_edge(k + 1));
        assert!(low < high);
        assert_eq!((cells.slab_of(low), cells.slab_of(high - 1)), (k, k));
    }
}

fn grid(table: &Table<'_>, worst: &mut WorstCase) {
    let (Some(grid), cells) = (table.grid(), table.cells()) else {
        return;
    };
    assert!(grid.byte_length() < table.bytes().len());
    let mut fullest = 0;
    for k in 0..cells.slabs {
        let before = worst.runs;
        let slab = grid.slab(k);
        let (first, end) = (slab.first_row(), slab.first_row() + slab.rows());
        assert!(end <= cells.rows);
        for row in first..end {
            let (mut free, mut runs) = (0, 0);
            for run in slab.runs(row) {
                assert!(run.first >= free && run.first <= run.last && run.last < cells.columns);
                free = run.last + 2;
                runs += 1;
            }
            worst.runs += runs.max(1);
        }
        fullest = fullest.max(worst.runs - before);
        let outside = [first.checked_sub(1), Some(end), Some(u16::MAX)];
        assert!(
            outside
                .into_iter()
                .flatten()
                .all(|row| slab.runs(row).next().is_none())
        );
    }
    // Headings around the whole circle meet two slabs twice.
    let again = if cells.yaw_span == 1 << 32 { 2 } else { 0 };
    worst.slabs = u32::from(cells.slabs) + again;
    worst.runs += again * fullest;
    assert_eq!(grid.slab(cells.slabs).rows(), 0);
    assert_eq!(grid.slab(u16::MAX).rows(), 0);
}

fn facets(table: &Table<'_>, worst: &mut WorstCase) {
    let Some(layout) = table.facets() else {
        return;
    };
    let unit = 1i32 << NORMAL_BITS;
    for piece in layout.pieces() {
        worst.pieces += 1;
        for frame in piece.frames() {
            worst.frames += 1;
            let length = i32::from(frame.x).abs() + i32::from(frame.y).abs();
            let (count, limit) = match frame.axes {
                Axes::World => {
                    assert!(length <= i32::from(layout.lever()));
                    (&mut worst.world_facets, i32::from(i16::MAX))
                }
                Axes::Robot => {
                    let lever = length + 2 * i32::from(layout.reach());
                    assert!(lever <= i32::from(layout.lever()));
                    (&mut worst.robot_facets, i32::from(i16::MAX))
                }
            };
            for facet in frame.facets() {
                *count += 1;
                let [x, y, b] = [facet.x, facet.y, facet.b].map(i32::from);
                assert!((x * x + y * y - unit * unit).abs() <= (unit * unit) >> 7);
                assert!(b.abs() <= limit);
            }
        }
    }
    // Slabs of one piece if the table states that points may turn with the heading, and of several pieces together.
    if layout.lever() > 0 {
        worst.heading_slabs += 33;
    }
    if worst.pieces > 1 {
        let all = 4 * layout.frame_count() + layout.facet_count();
        let choice = u32::try_from(all / 32).expect("facets are counted by 16 bits") + 1;
        worst.heading_slabs += 3 * (72 + 3 + worst.pieces + 9 * choice.saturating_sub(8));
    }
    assert_eq!(worst.frames as usize, layout.frame_count());
    assert_eq!(
        (worst.world_facets + worst.robot_facets) as usize,
        layout.facet_count()
    );
    assert!(worst.pieces > 0 && layout.byte_length() < table.bytes().len());
}
