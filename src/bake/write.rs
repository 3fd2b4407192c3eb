//! Writes cells and runs as the bytes of format version 1.

use super::{BakeError, BakeInput, FacetPlan, Rows, check, goal_frame, sight_record};
use crate::confidence::core_radius;
use crate::table::{
    Axes, CRC_LENGTH, Cells, HEADER_LENGTH, MAGIC, Run, SightRecord, VERSION, checksum,
};
use std::collections::BTreeMap;

/// Largest table, bytes: no controller has more flash for it.
pub const LARGEST_TABLE: usize = 64 << 20;

/// Returns the bytes of a grid table.
///
/// # Errors
/// [`BakeError`] if the table exceeds the format.
pub fn write_grid(
    order: &BakeInput<'_>,
    cells: &Cells,
    slabs: &[Rows],
) -> Result<Vec<u8>, BakeError> {
    write(order, cells, &grid(cells, slabs)?, &[])
}

/// Returns the bytes of a table of facets.
///
/// # Errors
/// [`BakeError`] if the order is refused or the table exceeds the format.
pub fn write_facets(order: &BakeInput<'_>, plan: &FacetPlan) -> Result<Vec<u8>, BakeError> {
    write(order, &check(order)?, &[], &facets(plan)?)
}

/// Returns the bytes of a table: header, grid or facets, the sight record of a visibility set, checksum.
fn write(
    order: &BakeInput<'_>,
    cells: &Cells,
    grid: &[u8],
    facets: &[u8],
) -> Result<Vec<u8>, BakeError> {
    let radius = core_radius(order.epsilon).ok_or(BakeError::Epsilon(order.epsilon))?;
    let goal = goal_frame(order.success)?;
    let sight = sight_record(order.success).map(|record| SightRecord::bytes(&record));
    let sight = sight.as_ref().map_or(&[][..], |bytes| bytes);
    let total = HEADER_LENGTH + grid.len() + facets.len() + sight.len() + CRC_LENGTH;
    if total > LARGEST_TABLE {
        let limit = LARGEST_TABLE as f64;
        return Err(BakeError::too_large("bytes", total as f64, limit));
    }
    let mut bytes = Vec::with_capacity(total);
    bytes.extend(MAGIC);
    bytes.extend(VERSION.to_le_bytes());
    bytes.extend((HEADER_LENGTH as u16).to_le_bytes());
    bytes.extend((total as u32).to_le_bytes());
    bytes.extend(goal.pose.x_um.to_le_bytes());
    bytes.extend(goal.pose.y_um.to_le_bytes());
    bytes.extend(goal.pose.yaw.0.to_le_bytes());
    bytes.extend(goal.cos_q30.to_le_bytes());
    bytes.extend(goal.sin_q30.to_le_bytes());
    bytes.extend(cells.x_lo_um.to_le_bytes());
    bytes.extend(cells.y_lo_um.to_le_bytes());
    bytes.extend(cells.step_um.to_le_bytes());
    bytes.extend(cells.columns.to_le_bytes());
    bytes.extend(cells.rows.to_le_bytes());
    bytes.extend(cells.yaw_lo.0.to_le_bytes());
    // The whole circle, 2^32, is written as 0.
    bytes.extend((cells.yaw_span as u32).to_le_bytes());
    bytes.extend(cells.slabs.to_le_bytes());
    bytes.extend(0u16.to_le_bytes());
    bytes.extend(radius.q16().to_le_bytes());
    let mut at = HEADER_LENGTH;
    for section in [grid, facets] {
        let offset = if section.is_empty() { 0 } else { at };
        bytes.extend((offset as u32).to_le_bytes());
        bytes.extend((section.len() as u32).to_le_bytes());
        at += section.len();
    }
    bytes.extend(order.epsilon.to_le_bytes());
    let sight_at = if sight.is_empty() { 0 } else { at };
    bytes.extend((sight_at as u32).to_le_bytes());
    bytes.extend(order.success.digest(order.epsilon));
    bytes.extend(padded::<32>(order.task)?);
    bytes.extend(padded::<16>(env!("CARGO_PKG_VERSION"))?);
    debug_assert_eq!(bytes.len(), HEADER_LENGTH);
    bytes.extend(grid);
    bytes.extend(facets);
    bytes.extend(sight);
    let crc = checksum(&bytes);
    bytes.extend(crc.to_le_bytes());
    Ok(bytes)
}

/// Returns a name followed by zeros.
fn padded<const N: usize>(name: &str) -> Result<[u8; N], BakeError> {
    let mut field = [0; N];
    match field.get_mut(..name.len()) {
        Some(start) if !name.is_empty() && !name.contains('\0') => {
            start.copy_from_slice(name.as_bytes());
            Ok(field)
        }
        _ => Err(BakeError::Name(name.to_string())),
    }
}

/// Encodes the grid layout; slabs with equal rows share them.
fn grid(cells: &Cells, slabs: &[Rows]) -> Result<Vec<u8>, BakeError> {
    let wide = cells.columns > 255;
    let directory = 4 + 8 * slabs.len();
    let mut head = Vec::with_capacity(directory);
    head.extend([if wide { 2 } else { 1 }, 0, 0, 0]);
    let mut body: Vec<u8> = Vec::new();
    let mut known: BTreeMap<Vec<u8>, u32> = BTreeMap::new();
    for rows in slabs {
        let filled = |row: &Vec<Run>| !row.is_empty();
        let first = rows.iter().position(filled).unwrap_or(0);
        let end = rows.iter().rposition(filled).map_or(first, |last| last + 1);
        let rows = &rows[first..end];
        let several = rows.iter().any(|row| row.len() > 1);
        let mut bytes = Vec::new();
        if several {
            let mut start = 0usize;
            let mut put = |start: usize| -> Result<(), BakeError> {
                let most = f64::from(u16::MAX);
                let beyond = |_| BakeError::too_large("runs in a slab", start as f64, most);
                bytes.extend(u16::try_from(start).map_err(beyond)?.to_le_bytes());
                Ok(())
            };
            put(0)?;
            for row in rows {
                start += row.len();
                put(start)?;
            }
        }
        let mut column = |number: u16| {
            if wide {
                bytes.extend(number.to_le_bytes());
            } else {
                bytes.push(number as u8);
            }
        };
        for row in rows {
            for run in row {
                column(run.first);
                column(run.last);
            }
            if !several && !filled(row) {
                column(if wide { u16::MAX } else { 0xff });
                column(0);
            }
        }
        if rows.len() > 0x7fff {
            return Err(BakeError::too_large("rows", rows.len() as f64, 32767.0));
        }
        let offset = *known.entry(bytes).or_insert_with_key(|bytes| {
            let offset = directory + body.len();
            body.extend(bytes);
            offset as u32
        });
        if directory + body.len() > LARGEST_TABLE {
            let count = (directory + body.len()) as f64;
            return Err(BakeError::too_large("bytes", count, LARGEST_TABLE as f64));
        }
        head.extend(offset.to_le_bytes());
        head.extend((first as u16).to_le_bytes());
        head.extend((rows.len() as u16 | if several { 1 << 15 } else { 0 }).to_le_bytes());
    }
    head.extend(body);
    Ok(head)
}

/// Encodes the facet layout.
fn facets(plan: &FacetPlan) -> Result<Vec<u8>, BakeError> {
    let counted = |count: usize, what, most: u16| {
        u16::try_from(count)
            .ok()
            .filter(|count| *count <= most)
            .ok_or(BakeError::too_large(what, count as f64, f64::from(most)))
    };
    let frames = || plan.pieces.iter().flat_map(|piece| &piece.frames);
    let all = counted(frames().map(|f| f.facets.len()).sum(), "facets", u16::MAX)?;
    let mut bytes = std::vec![
        plan.unit,
        counted(plan.pieces.len(), "pieces", 255)? as u8,
        counted(frames().count(), "frames", 255)? as u8,
        0,
    ];
    bytes.extend(all.to_le_bytes());
    let of = |axes: Axes| frames().filter(move |frame| frame.axes == axes);
    let arms = of(Axes::World).map(|f| f.point[0].unsigned_abs() + f.point[1].unsigned_abs());
    let offsets = of(Axes::Robot).flat_map(|f| &f.facets);
    let farthest = offsets.map(|facet| facet.b.unsigned_abs()).max();
    for length in [plan.reach, arms.max().unwrap_or(0), farthest.unwrap_or(0)] {
        bytes.extend(length.to_le_bytes());
    }
    for piece in &plan.pieces {
        bytes.extend(piece.from.to_le_bytes());
        bytes.extend(piece.width.to_le_bytes());
        bytes.extend([piece.frames.len() as u8, 0]);
        let own: usize = piece.frames.iter().map(|frame| frame.facets.len()).sum();
        bytes.extend((own as u16).to_le_bytes());
    }
    for frame in frames() {
        bytes.push(match frame.axes {
            Axes::World => 0,
            Axes::Robot => 1,
        });
        bytes.push(counted(frame.facets.len(), "facets in a frame", 255)? as u8);
        for value in frame.point {
            bytes.extend(value.to_le_bytes());
        }
    }
    for facet in frames().flat_map(|frame| &frame.facets) {
        for value in [facet.x, facet.y, facet.b] {
            bytes.extend(value.to_le_bytes());
        }
    }
    Ok(bytes)
}
