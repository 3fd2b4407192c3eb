use super::*;
use crate::num::BinaryAngle;
use std::vec;

/// A layout to be written.
#[derive(Clone)]
struct Plan {
    unit: u8,
    zero: u8,
    /// Reach, arm, farthest.
    limits: [u16; 3],
    /// First heading, width, frames, a zero, facets.
    pieces: Vec<(u32, u32, u8, u8, u16)>,
    /// Axes, facets, point.
    frames: Vec<(u8, u8, [i16; 2])>,
    facets: Vec<[i16; 3]>,
}

impl Plan {
    /// Two pieces, the first of two frames and the second of one. Every limit is reached.
    fn good() -> Self {
        Self {
            unit: LARGEST_UNIT,
            zero: 0,
            limits: [100, 40, 50],
            pieces: vec![(1000, 2000, 2, 0, 3), (3000, 500, 1, 0, 1)],
            frames: vec![(0, 2, [30, -10]), (1, 1, [-20, 7]), (0, 1, [0, 0])],
            facets: vec![
                [16_384, 0, 32_000],
                [0, -16_384, -32_000],
                [11_585, 11_585, 50],
                [-16_384, 0, 5],
            ],
        }
    }

    fn bytes(&self) -> Vec<u8> {
        let [pieces, frames] = [self.pieces.len(), self.frames.len()].map(|n| n as u8);
        let mut bytes = vec![self.unit, pieces, frames, self.zero];
        bytes.extend((self.facets.len() as u16).to_le_bytes());
        bytes.extend(self.limits.iter().flat_map(|limit| limit.to_le_bytes()));
        for (from, width, frames, zero, facets) in &self.pieces {
            bytes.extend(from.to_le_bytes());
            bytes.extend(width.to_le_bytes());
            bytes.extend([*frames, *zero]);
            bytes.extend(facets.to_le_bytes());
        }
        for (axes, facets, point) in &self.frames {
            bytes.extend([*axes, *facets]);
            bytes.extend(point.iter().flat_map(|v| v.to_le_bytes()));
        }
        bytes.extend(self.facets.iter().flatten().flat_map(|v| v.to_le_bytes()));
        bytes
    }

    fn is_read(&self, change: impl Fn(&mut Self)) -> bool {
        let mut plan = self.clone();
        change(&mut plan);
        Facets::parse(&plan.bytes(), &cells(1000, 2500)).is_some()
    }
}

fn cells(yaw_lo: u32, yaw_span: u64) -> Cells {
    Cells {
        x_lo_um: 0,
        y_lo_um: 0,
        step_um: 1,
        columns: 1,
        rows: 1,
        yaw_lo: BinaryAngle(yaw_lo),
        yaw_span,
        slabs: 1,
    }
}

#[test]
fn layout_reads_back_written_facets() {
    let bytes = Plan::good().bytes();
    let layout = Facets::parse(&bytes, &cells(1000, 2500)).unwrap();
    assert_eq!((layout.unit(), layout.reach()), (12, 100));
    // From (-20, 7) to the farthest pose within reach.
    assert_eq!(layout.lever(), 227);
    // The lengths of the estimate and of (-20, 7), or that of (30, -10): each at most 12 % and 1 more.
    assert_eq!(layout.longest_arm([30, -40]), 55 + 24);
    assert_eq!(layout.longest_arm([3, -4]), 35);
    assert_eq!(layout.byte_length(), bytes.len());
    assert_eq!((layout.frame_count(), layout.facet_count()), (3, 4));
    let pieces: Vec<_> = layout.pieces().collect();
    let arcs: Vec<_> = pieces.iter().map(|p| (p.from, p.width)).collect();
    assert_eq!(arcs, [(1000, 2000), (3000, 500)]);
    let frames: Vec<_> = pieces.iter().flat_map(Piece::frames).collect();
    let seen: Vec<_> = frames
        .iter()
        .map(|frame| (frame.axes, frame.x, frame.y, frame.facets().count()))
        .collect();
    assert_eq!(
        seen,
        [
            (Axes::World, 30, -10, 2),
            (Axes::Robot, -20, 7, 1),
            (Axes::World, 0, 0, 1)
        ]
    );
    let facets: Vec<_> = frames
        .iter()
        .flat_map(Frame::facets)
        .map(|facet| [facet.x, facet.y, facet.b])
        .collect();
    assert_eq!(facets, Plan::good().facets);
}

#[test]
fn every_limit_is_checked() {
    let good = Plan::good();
    assert!(good.is_read(|_| ()));
    assert!(!good.is_read(|plan| plan.zero = 1));
    assert!(!good.is_read(|plan| plan.unit = LARGEST_UNIT + 1));
    assert!(!good.is_read(|plan| plan.limits[0] = 0));
    // 27 plus twice the reach.
    assert!(good.is_read(|plan| plan.limits[0] = 15_986));
    assert!(!good.is_read(|plan| plan.limits[0] = 15_987));
    for limit in [1, 2] {
        assert!(good.is_read(|plan| plan.limits[limit] = LONGEST_LEVER));
        assert!(!good.is_read(|plan| plan.limits[limit] = LONGEST_LEVER + 1));
    }
    // No frame in robot axes.
    let mut world = good.clone();
    world.frames[1].0 = 0;
    assert!(world.is_read(|plan| plan.limits[0] = LONGEST_LEVER));
    assert!(!world.is_read(|plan| plan.limits[0] = LONGEST_LEVER + 1));
    // Limits of a frame.
    assert!(!good.is_read(|plan| plan.limits[1] = 39));
    assert!(!good.is_read(|plan| plan.frames[0].0 = 2));
    assert!(!good.is_read(|plan| plan.facets[0][2] = 32_001));
    assert!(!good.is_read(|plan| plan.facets[1][2] = -32_001));
    assert!(!good.is_read(|plan| plan.facets[2][2] = 51));
    assert!(!good.is_read(|plan| plan.facets[2][2] = -51));
    // Normals within 2^-8 of their length.
    for (x, y, is_read) in [
        (16_384, 1448, true),
        (16_384, 1449, false),
        (16_320, 0, true),
        (16_319, 0, false),
        (0, 0, false),
    ] {
        assert_eq!(good.is_read(|plan| plan.facets[0] = [x, y, 0]), is_read);
    }
}

#[test]
fn inconsistent_counts_are_refused() {
    let good = Plan::good();
    let mut bytes = good.bytes();
    bytes.push(0);
    assert!(Facets::parse(&bytes, &cells(1000, 2500)).is_none());
    assert!(!good.is_read(|plan| plan.pieces[0].3 = 1));
    // No piece, and an empty piece.
    assert!(!good.is_read(|plan| {
        plan.pieces.clear();
        plan.frames.clear();
        plan.facets.clear();
    }));
    assert!(!good.is_read(|plan| plan.pieces.push((1000, 0, 0, 0, 0))));
    // More frames than the layout has.
    assert!(!good.is_read(|plan| plan.pieces.push((1000, 0, 9, 0, 0))));
    // Frames and facets that no piece uses.
    assert!(!good.is_read(|plan| plan.frames.push((0, 1, [0, 0]))));
    assert!(!good.is_read(|plan| plan.facets.push([16_384, 0, 0])));
    // A frame without facets.
    assert!(!good.is_read(|plan| {
        plan.frames.push((0, 0, [0, 0]));
        plan.pieces[1].2 = 2;
    }));
    let mut one = good.clone();
    one.pieces.truncate(1);
    one.frames.truncate(2);
    one.facets.truncate(3);
    assert!(one.is_read(|_| ()));
    // A facet without a frame, and a frame with fewer facets than it states.
    assert!(!one.is_read(|plan| {
        plan.pieces[0].4 = 4;
        plan.facets.push([16_384, 0, 0]);
    }));
    assert!(!one.is_read(|plan| {
        plan.pieces[0].4 = 2;
        plan.facets.truncate(2);
        plan.frames[1].1 = 5;
    }));
}

#[test]
fn arcs_lie_in_the_yaw_range() {
    let good = Plan::good();
    assert!(!good.is_read(|plan| plan.pieces[1].1 = 501));
    assert!(!good.is_read(|plan| plan.pieces[1].0 = 3001));
    assert!(!good.is_read(|plan| plan.pieces[0].0 = 999));
    let whole = cells(1000, 1 << 32);
    let nearly = cells(1000, (1 << 32) - 1);
    let mut plan = good.clone();
    plan.pieces[0].1 = u32::MAX;
    assert!(Facets::parse(&plan.bytes(), &nearly).is_none());
    let bytes = plan.bytes();
    let layout = Facets::parse(&bytes, &whole).unwrap();
    let circles: Vec<_> = layout.pieces().map(|p| p.is_whole_circle()).collect();
    assert_eq!(circles, [true, false]);
    plan.pieces[0].1 = u32::MAX - 1;
    assert!(Facets::parse(&plan.bytes(), &nearly).is_some());
}
