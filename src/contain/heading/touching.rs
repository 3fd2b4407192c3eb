//! The pose of a set that is farthest beyond a facet, for reports.

use super::slab::Root;
use super::{Movement, Section, Sweep, U, nearest, squares};
use crate::num::{product, sqrt_ceil, towards_zero};
use crate::pose::Pose;
use crate::set::PoseSet;
use crate::table::{Facet, Facets};

/// Headings on either side of the estimate's at which [`farthest`] evaluates facets.
const SIDE: i32 = 8;

/// Returns the pose of a set that is farthest beyond a facet of a layout's first piece, or nearest to one. Searches
/// the sections at seventeen headings, and some around the farthest. Relative to the estimate, in world axes: um, um,
/// 2^-24 turn. For reports.
pub(in crate::contain) fn farthest(facets: &Facets<'_>, set: &PoseSet, goal: Pose) -> [i64; 3] {
    let Some(sweep) = Sweep::of(facets, set, goal) else {
        return [0; 3];
    };
    let mut most = Touching::NONE;
    for frame in facets.pieces().take(1).flat_map(|piece| piece.frames()) {
        let point = [i32::from(frame.x), i32::from(frame.y)];
        for facet in frame.facets() {
            let mut own = Touching::NONE;
            let at = |e: i32, own: &mut Touching| {
                let section = sweep.section(facet, frame.axes, point, e);
                let found = sweep.touching(facet, &section, e);
                if found.beyond > own.beyond {
                    *own = found;
                }
            };
            for k in SIDE.wrapping_neg()..=SIDE {
                at(k << 12, &mut own);
            }
            // Down to 1/64, as finely as roots are known.
            for step in [1 << 11, 1 << 10, 1 << 9] {
                let e = own.e;
                at(e.wrapping_add(step).min(1 << U), &mut own);
                at(e.wrapping_sub(step).max(-(1 << U)), &mut own);
            }
            if own.beyond > most.beyond {
                most = own;
            }
        }
    }
    most.offset
}

/// The point where a section reaches farthest along a facet's normal.
#[derive(Clone, Copy)]
struct Touching {
    /// Its distance beyond the facet, fine units.
    beyond: i64,
    /// u of the section, 2^-15.
    e: i32,
    /// Relative to the estimate: um, um, 2^-24 turn.
    offset: [i64; 3],
}

impl Touching {
    const NONE: Self = Self {
        beyond: i64::MIN,
        e: 0,
        offset: [0; 3],
    };
}

impl Touching {
    /// Returns the pose after a movement along the normal that turns it outwards, to first order.
    fn moved(self, movement: &Movement, section: &Section) -> Self {
        if movement.is_none() {
            return self;
        }
        let [nx, ny] = section.normal.map(i64::from);
        let length = sqrt_ceil(squares(nx, ny)).max(1);
        let along = |v: i64| {
            let moved = v.wrapping_mul(i64::from(movement.by.translation_um()));
            towards_zero(moved, length)
        };
        let slope = i64::from(section.s.saturating_abs());
        let swung = slope.wrapping_mul(i64::from(movement.turn)) >> 28;
        let turn = i64::from(movement.by.yaw_q24());
        let turn = if section.s < 0 {
            turn.wrapping_neg()
        } else {
            turn
        };
        let [x, y, yaw] = self.offset;
        Self {
            beyond: self
                .beyond
                .wrapping_add(i64::from(movement.length))
                .wrapping_add(swung),
            e: self.e,
            offset: [
                x.wrapping_add(along(nx)),
                y.wrapping_add(along(ny)),
                yaw.wrapping_add(turn),
            ],
        }
    }
}

impl Sweep {
    /// Returns the pose of a section that is farthest along a facet's normal.
    fn touching(&self, facet: Facet, section: &Section, e: i32) -> Touching {
        let yaw = i64::from(self.yaw).wrapping_mul(i64::from(e)) >> U;
        let beyond = i64::from(section.c).wrapping_sub(section.left);
        // The directions of the other two columns, or of the plane's axes, along the normal.
        let (columns, [a, b], share) = match self.radius {
            Some(radius) => {
                let normal = match section.turns {
                    true => self.normal(facet, e),
                    false => [i32::from(facet.x), i32::from(facet.y)],
                };
                let along = normal.map(i64::from);
                let fine = nearest(i64::from(radius) << 14, self.unit) as i32;
                ([[fine, 0], [0, fine]], along, 1 << U)
            }
            None => {
                let [_, second, third] = self.columns;
                (
                    [second, third],
                    section.along.map(i64::from),
                    i64::from(Root::of(e).low()),
                )
            }
        };
        let length = sqrt_ceil(squares(a, b)).max(1);
        let share = |v: i64| {
            let v = v.wrapping_mul(share);
            towards_zero(v, length)
        };
        let (a2, a3) = (share(a), share(b));
        let [f, ..] = self.columns;
        let [[x2, y2], [x3, y3]] = columns;
        let axis = |f: i32, second: i32, third: i32| {
            let fine = i64::from(f)
                .wrapping_mul(i64::from(e))
                .wrapping_add(i64::from(second).wrapping_mul(a2))
                .wrapping_add(i64::from(third).wrapping_mul(a3))
                >> U;
            // To micrometres: 2^29 * 2^12.
            fine.wrapping_shl(self.unit) >> 14
        };
        let [fx, fy] = f;
        let reach = match self.radius {
            Some(radius) => self.along_any(facet, i64::from(radius)),
            None => length.wrapping_mul(i64::from(Root::of(e).low())) >> U,
        };
        let touching = Touching {
            beyond: beyond.wrapping_add(reach),
            e,
            offset: [axis(fx, x2, x3), axis(fy, y2, y3), yaw],
        };
        touching.moved(&self.movement, section)
    }

    /// Returns a facet's normal in world axes at u = e, for a facet in robot axes, 2^-14.
    fn normal(&self, facet: Facet, e: i32) -> [i32; 2] {
        let [c, s] = self.turned_to(e);
        let (nx, ny) = (i32::from(facet.x), i32::from(facet.y));
        let x = product(c, nx).wrapping_sub(product(s, ny));
        let y = product(s, nx).wrapping_add(product(c, ny));
        [nearest(x, 30) as i32, nearest(y, 30) as i32]
    }
}
