//! The pose of a set that is farthest beyond a facet, for reports.

use super::placed::{Movement, Placed};
use super::slab::{Section, U, squares};
use crate::num::{product, sqrt_ceil, towards_zero};
use crate::table::Facets;
use crate::table::parts;

/// Headings on either side of the estimate's at which [`farthest`] evaluates facets.
const SIDE: i32 = 8;

/// Returns the pose of a set that is farthest beyond a facet of a layout's first piece, or nearest to one. Searches
/// the sections at seventeen headings, and some around the farthest. Relative to the estimate, in world axes: um, um,
/// 2^-24 turn. For reports.
pub(super) fn farthest(facets: &Facets<'_>, placed: &Placed) -> [i64; 3] {
    let mut most = Touching::NONE;
    for frame in facets.pieces().take(1).flat_map(|piece| piece.frames()) {
        for facet in frame.facets() {
            let mut own = Touching::NONE;
            let at = |e: i32, own: &mut Touching| {
                let middle = placed.middle(e);
                let seen = placed.seen(&frame, &middle, &placed.first);
                let section = Section::of(facet, &seen, placed, &middle, &placed.first);
                let found = placed.touching(&section, e);
                if found.beyond > own.beyond {
                    *own = found;
                }
            };
            if !parts::HEADINGS {
                at(0, &mut own);
            } else {
                for k in SIDE.wrapping_neg()..=SIDE {
                    at(k << 12, &mut own);
                }
                // Down to 1/64, as finely as roots are known.
                for step in [1 << 11, 1 << 10, 1 << 9] {
                    let e = own.e;
                    at(e.wrapping_add(step).min(1 << U), &mut own);
                    at(e.wrapping_sub(step).max(-(1 << U)), &mut own);
                }
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
    /// Its distance beyond the facet, extent units.
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

    /// Returns the pose after a movement along the normal that turns it outwards, to first order.
    fn moved(self, movement: &Movement, section: &Section, placed: &Placed) -> Self {
        let [c, s] = placed.facing;
        let [nx, ny] = section.normal;
        let length = sqrt_ceil(squares(nx, ny).into()).max(1);
        let radius = movement.by.translation_um();
        let [by_x, by_y] = if movement.side == movement.length {
            [nx, ny].map(|v| towards_zero(product(v, radius), length))
        } else {
            // A corner of the strip in the disc, or a point that is nearer.
            let side = movement.by.aside_um(placed.yaw as i32);
            let ahead = radius.wrapping_sub(side);
            let ahead = if product(nx, c).wrapping_add(product(ny, s)) < 0 {
                ahead.wrapping_neg()
            } else {
                ahead
            };
            let aside = if product(ny, c).wrapping_sub(product(nx, s)) < 0 {
                side.wrapping_neg()
            } else {
                side
            };
            [
                product(ahead, c).wrapping_sub(product(aside, s)) >> 15,
                product(ahead, s).wrapping_add(product(aside, c)) >> 15,
            ]
        };
        let swung = movement.turn.at(section.s.wrapping_abs(), movement.shift);
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
                .wrapping_add(movement.length.into())
                .wrapping_add(swung.into()),
            e: self.e,
            offset: [
                x.wrapping_add(by_x),
                y.wrapping_add(by_y),
                yaw.wrapping_add(turn),
            ],
        }
    }
}

impl Placed {
    /// Returns the pose of a section that is farthest along a facet's normal.
    fn touching(&self, section: &Section, e: i32) -> Touching {
        let [a, b] = section.along;
        let length = sqrt_ceil(squares(a, b).into());
        let reach = length.wrapping_mul(self.root(e).low().into()) >> U;
        let [x, y] = section
            .farthest(self, e)
            .map(|v| v.wrapping_shl(self.unit) >> U);
        let touching = Touching {
            beyond: reach.wrapping_sub(section.left.into()),
            e,
            offset: [x, y, product(self.yaw as i32, e) >> U],
        };
        match &self.movement {
            Some(movement) => touching.moved(movement, section, self),
            None => touching,
        }
    }
}
