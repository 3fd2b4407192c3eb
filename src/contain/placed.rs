//! A pose-set in the small integers of a facet layout.
//!
//! Lengths of the estimate are in the layout's units of 2^k um. The extent has units of its own, 2^e um ("extent units"), chosen so that its
//! entries and the effect of a slab's headings at the longest lever are below 40,330: a small set keeps its shape. Their products with normals, cosines and turns fit 32
//! bits, and so do the sums and squares that a facet needs. The same instructions run on a core with 32-bit multiplication only.

use super::slab::{Middle, Root, U, Width};
use crate::num::{BinaryAngle, product, sqrt_ceil};
use crate::pose::{Pose, REACH_UM};
use crate::set::{Extent, Growth, PoseSet, SqrtFactor, Turn};
use crate::table::parts;
use crate::table::{Axes, Facet, Facets, Frame, NORMAL_BITS, Piece};

/// The largest heading offset that is cut into slabs: one turn, 2^-24 turn.
pub(super) const ONE_TURN: u32 = 1 << 24;
/// Half a turn, 2^-24 turn.
const HALF_TURN: u32 = 1 << 23;
/// Slack of an arc, 2^-32 turn: headings of estimate and goal are each within 0.51, and the proof treats the border of a box's arc as 1.37 wide.
pub(super) const ARC_SLACK: u32 = 3;
/// Most by which roundings can lower [`Seen::enough`], extent units.
const ROUNDED_BROADLY: i32 = 12;

/// A pose-set relative to a goal, in world axes and small integers.
#[derive(Clone, Copy, Debug)]
pub(super) struct Placed {
    /// The estimate relative to the goal, length units, to the nearest: within the layout's reach.
    pub place: [i32; 2],
    heading: BinaryAngle,
    /// Cosine and sine of the heading, 2^-15.
    pub facing: [i32; 2],
    /// The estimate's heading relative to the goal's, 2^-32 turn.
    pub above_goal: u32,
    /// The largest heading offset of the whole set, 2^-32 turn, or `u32::MAX`.
    reach: u32,
    /// The largest heading offset without a movement's turn, 2^-24 turn: at most [`ONE_TURN`] if a point turns with the robot.
    pub yaw: u32,
    /// The columns of the factor's x and y rows, extent units, to the nearest. Those of a cylinder are its disc, at every heading.
    pub columns: [[i32; 2]; 3],
    pub is_cylinder: bool,
    /// Upper bound of the length of an offset in the plane, extent units.
    pub broad: i32,
    pub movement: Option<Movement>,
    /// e: the extent's unit is 2^e um.
    pub unit: u32,
    /// The right shift from length units times 2^14 to extent units: 14 - k + e, from 2 to 15.
    pub down: u32,
    /// The first slabs.
    pub first: Width,
    /// Most by which the roundings of a factor that is scaled can lower a bound, extent units.
    rescaled: i32,
}

/// The growth of an ellipsoid by a movement, at every heading.
#[derive(Clone, Copy, Debug)]
pub(super) struct Movement {
    /// The radius in the plane, extent units, up.
    pub length: i32,
    /// The largest part of it across the estimate's heading, extent units, up; the radius if it may lead anywhere.
    pub side: i32,
    /// The turn to either side: at most half a radian.
    pub turn: Turn,
    /// The right shift of a product of the turn and a length in length units, to extent units.
    pub shift: u32,
    /// The movement as given.
    pub by: Growth,
}

/// The point of a set in a frame, at the middle of a slab.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seen {
    pub axes: Axes,
    /// P of the estimate, length units.
    pub point: [i32; 2],
    /// The part of P that turns with the heading: from the robot to its point, or from the point in the world to the robot. Length units.
    pub arm: [i32; 2],
    /// The change of P while the heading turns by a slab's half width, to first order, extent units.
    pub swing: [i32; 2],
}

impl Placed {
    /// Returns `None` if the estimate is beyond the layout's reach, or if the set is far larger than the table.
    #[inline(always)]
    pub fn of(facets: &Facets<'_>, set: &PoseSet, goal: Pose) -> Option<Self> {
        let k = u32::from(facets.unit());
        let place = place(facets, set, goal)?;
        let common = set.common();
        let mut placed = Self {
            place,
            heading: set.mean().yaw,
            facing: [common.cos_q15, common.sin_q15],
            above_goal: set.mean().yaw.minus(goal.yaw).0,
            reach: common.turn.reach,
            yaw: 0,
            columns: [[0; 2]; 3],
            is_cylinder: false,
            broad: 0,
            movement: None,
            unit: 0,
            down: 0,
            first: Width::NONE,
            rescaled: 0,
        };
        // Growths are stored up to this length. No table contains a set of that size: tables reach half as far from the goal.
        if common.broad_um >= REACH_UM.unsigned_abs() {
            return None;
        }
        let (factor, by) = match set.extent() {
            Extent::Gaussian(factor) => (Some(factor), Growth::NONE),
            Extent::Grown { factor, by } => (Some(factor), by),
            Extent::Bounded { .. } => (None, Growth::NONE),
        };
        let lever = facets.lever();
        let swing = Turn::of(by.yaw_q24().unsigned_abs());
        let ellipsoid = factor.filter(|factor| {
            lever == 0
                || factor.yaw.unsigned_abs() <= ONE_TURN && swing.radians_q15 <= Turn::LARGEST
        });
        let (disc, yaw) = match (ellipsoid, set.extent()) {
            (Some(factor), _) => (0, factor.yaw),
            (
                None,
                Extent::Bounded {
                    translation_um,
                    yaw_q24,
                },
            ) => (translation_um.unsigned_abs(), yaw_q24),
            (None, _) => (common.broad_um, HALF_TURN as i32),
        };
        placed.is_cylinder = ellipsoid.is_none();
        placed.yaw = yaw.unsigned_abs();
        if placed.is_cylinder {
            // From half a turn to either side on, it has every heading.
            placed.yaw = placed.yaw.min(HALF_TURN);
        }
        let has_moved = by != Growth::NONE;
        let turn = if lever == 0 {
            Turn::NONE
        } else if has_moved || placed.is_cylinder {
            Turn::of(placed.yaw)
        } else {
            common.turn
        };
        let width = Width::first(turn, placed.yaw);
        // The effect of the turns of the first slabs and of a movement at the longest arm counts like an entry.
        let lever = if lever == 0 {
            0
        } else {
            // A rotated arm is rounded.
            facets.longest_arm(place).wrapping_add(2) as i32
        };
        let weight = width
            .turn_at(lever)
            .wrapping_add(swing.at(lever, swing.shift(0)));
        let weight = weight.unsigned_abs().wrapping_shl(k);
        // Each is below 40,330 extent units, and their sum below 57,500.
        let (most, sum) = (
            common.broad_um.max(weight),
            common.broad_um.wrapping_add(weight),
        );
        let most = most.wrapping_sub((most >> 3).wrapping_add(most >> 4));
        let sum = sum.wrapping_add(sum >> 3).wrapping_add(sum >> 6) >> 1;
        let largest = most.max(sum);
        let e = 17u32.saturating_sub(largest.leading_zeros());
        let finer = k.wrapping_sub(e) as i32;
        if finer < -1 {
            return None;
        }
        // The turn is up by 2^-24 turn: 3.8e-7 of a lever. The rest is less than a unit, or counted.
        let swung = lever.wrapping_shl(finer.max(0).unsigned_abs()) >> 20;
        placed.rescaled = swung.wrapping_add(2i32.wrapping_shr(e));
        placed.unit = e;
        placed.down = NORMAL_BITS.wrapping_sub(finer as u32);
        placed.broad = common.broad_um.wrapping_shr(e).wrapping_add(1) as i32;
        placed.first = width.with_units(finer, placed.broad);
        let half = 1i32.wrapping_shl(e) >> 1;
        let nearest = |[x, y]: [i32; 2]| {
            [
                x.wrapping_add(half).wrapping_shr(e),
                y.wrapping_add(half).wrapping_shr(e),
            ]
        };
        placed.columns = match ellipsoid {
            Some(SqrtFactor {
                x: [x1, x2, x3],
                y: [y1, y2, y3],
                ..
            }) => [nearest([x1, y1]), nearest([x2, y2]), nearest([x3, y3])],
            None => {
                let disc = disc.wrapping_shr(e).wrapping_add(1) as i32;
                [[0; 2], [disc, 0], [0, disc]]
            }
        };
        if ellipsoid.is_some() && has_moved {
            let extent = |um: i32| um.unsigned_abs().wrapping_shr(e).wrapping_add(1) as i32;
            placed.movement = Some(Movement {
                length: extent(by.translation_um()),
                side: extent(by.aside_um(yaw)),
                turn: swing,
                shift: swing.shift(finer),
                by,
            });
        }
        Some(placed)
    }

    /// Returns `true` if every heading of the set lies in a piece's arc.
    #[inline(always)]
    pub fn is_in_arc(&self, piece: &Piece<'_>) -> bool {
        self.room_in_arc(piece).is_none_or(|(room, reach)| {
            let above = self.above_goal.wrapping_sub(piece.from);
            above <= piece.width && reach.saturating_add(ARC_SLACK) <= room
        })
    }

    /// Returns how far a set's headings could reach in a piece's arc, and how far they do, 2^-32 turn; `None` for the whole circle.
    pub fn room_in_arc(&self, piece: &Piece<'_>) -> Option<(u32, u32)> {
        let above = self.above_goal.wrapping_sub(piece.from);
        let room = above.min(piece.width.saturating_sub(above));
        (!piece.is_whole_circle()).then_some((room, self.reach))
    }

    /// Returns the middle of a slab at u = e, unit 2^-15. u is from -1 to 1, times the largest heading offset.
    #[inline(always)]
    pub fn middle(&self, e: i32) -> Middle {
        if !parts::HEADINGS || e == 0 {
            return Middle {
                e,
                facing: self.facing,
                offset: [0; 2],
            };
        }
        self.middle_beside(e)
    }

    #[inline(never)]
    fn middle_beside(&self, e: i32) -> Middle {
        let [f, ..] = self.columns;
        Middle {
            e,
            facing: self.heading_at(e).cos_sin_q15(),
            offset: f.map(|v| q15(v.wrapping_mul(e))),
        }
    }

    /// Returns the heading at u = e, unit 2^-15.
    pub fn heading_at(&self, e: i32) -> BinaryAngle {
        // 2^-24 turn times 2^-15: below 2^39.
        let turn = product(self.yaw as i32, e) >> 7;
        self.heading.plus(BinaryAngle(turn as u32))
    }

    /// Returns the most by which roundings to the nearest can lower the bound of a slab at u = e: of a facet in robot axes, or in world axes.
    #[inline(always)]
    pub fn slack(&self, turns: bool, e: i32) -> i32 {
        let units = if turns {
            // 5 or 7 for an offset of 2^15.
            let beside = i32::from(e != 0);
            let share = self
                .broad
                .wrapping_mul(beside.wrapping_mul(2).wrapping_add(5))
                >> 15;
            share.wrapping_add(8).wrapping_add(beside)
        } else {
            5
        };
        self.rescaled.wrapping_add(units)
    }

    /// Returns `sqrt(1 - u^2)` at u = e; for a cylinder 1.
    #[inline(always)]
    pub fn root(&self, e: i32) -> Root {
        if self.is_cylinder {
            Root::CYLINDER
        } else {
            Root::of(e)
        }
    }

    /// Returns the turn of a movement to either side, 2^-32 turn.
    pub fn swing(&self) -> i64 {
        self.movement
            .map_or(0, |movement| i64::from(movement.by.yaw_q24()) << 8)
    }

    /// Returns a pose relative to the estimate, um, um, 2^-24 turn, from its place relative to the goal, length units times 2^14, and its u.
    pub fn offset_of(&self, at: [i64; 2], e: i32) -> [i64; 3] {
        let [[x, y], [from_x, from_y]] = [at, self.place.map(|v| i64::from(v) << 14)];
        let um = |fine: i64| fine.wrapping_shl(self.unit).wrapping_shr(self.down);
        let yaw = product(self.yaw as i32, e) >> U;
        [um(x.wrapping_sub(from_x)), um(y.wrapping_sub(from_y)), yaw]
    }

    /// Returns the set's point in a frame.
    #[inline(always)]
    pub fn seen(&self, frame: &Frame<'_>, at: &Middle, width: &Width) -> Seen {
        self.seen_at(
            frame.axes,
            [i32::from(frame.x), i32::from(frame.y)],
            at,
            width,
        )
    }

    /// As [`Placed::seen`], for a frame's point.
    #[inline(always)]
    pub fn seen_at(&self, axes: Axes, point: [i32; 2], at: &Middle, width: &Width) -> Seen {
        let ([x, y], [vx, vy]) = (self.place, point);
        match axes {
            Axes::World if vx == 0 && vy == 0 => Seen {
                axes,
                point: self.place,
                arm: [0; 2],
                swing: [0; 2],
            },
            Axes::World => {
                let [ax, ay] = at.outwards(point);
                Seen {
                    axes,
                    point: [x.wrapping_add(ax), y.wrapping_add(ay)],
                    arm: [ax, ay],
                    swing: [width.turned(ay.wrapping_neg()), width.turned(ax)],
                }
            }
            Axes::Robot => {
                let [mx, my] = at.inwards([x.wrapping_sub(vx), y.wrapping_sub(vy)]);
                let mut swing = [width.turned(my), width.turned(mx.wrapping_neg())];
                if parts::HEADINGS && at.e != 0 {
                    let [ox, oy] = at.inwards(at.offset);
                    let [sx, sy] = swing;
                    swing = [
                        sx.wrapping_add(width.turn_at(oy)),
                        sy.wrapping_sub(width.turn_at(ox)),
                    ];
                }
                Seen {
                    axes,
                    point: [mx, my],
                    arm: [mx, my],
                    swing,
                }
            }
        }
    }

    /// Returns the slack of the estimate at a facet, extent units, rounded down.
    #[inline(always)]
    pub fn spare(&self, facet: Facet, seen: &Seen) -> i32 {
        let along = dot([i32::from(facet.x), i32::from(facet.y)], seen.point);
        // Below 2^30.8.
        (i32::from(facet.b) << NORMAL_BITS)
            .wrapping_sub(along)
            .wrapping_shr(self.down)
    }

    /// Returns `true` if a set that turns by more than one slab satisfies a facet at every heading. `seen` is at the estimate's heading.
    #[inline(never)]
    pub fn holds_at_any_heading(&self, facet: Facet, seen: &Seen) -> bool {
        parts::HEADINGS
            && self.first.depth > 0
            && self.spare(facet, seen) >= self.enough_at_any_heading(facet, seen)
    }

    /// Returns the slack of the estimate at which a facet holds at any heading, extent units: `abs(A) - n . A`, and the longest offset.
    #[inline(always)]
    pub fn enough_at_any_heading(&self, facet: Facet, seen: &Seen) -> i32 {
        let own = [facet.x, facet.y].map(i32::from);
        let [ax, ay] = seen.arm;
        let along = dot(own, [ax, ay]) >> NORMAL_BITS;
        let across = (dot(own, [ay.wrapping_neg(), ax]) >> NORMAL_BITS).wrapping_abs();
        let square = |v: i32| product(v, v).unsigned_abs();
        let longest = sqrt_ceil(square(along).wrapping_add(square(across.wrapping_add(1))));
        // Below 2^16.4, times 2^14.
        let moved = (longest as i32).wrapping_sub(along).wrapping_add(1);
        let moved = moved.wrapping_shl(NORMAL_BITS).wrapping_shr(self.down);
        let broad = self.broad.wrapping_add(self.broad >> 7);
        moved.wrapping_add(broad).wrapping_add(ROUNDED_BROADLY)
    }

    /// Returns the slack of the estimate at which a facet of a frame holds for every pose of the set, extent units. `seen` is at the estimate's
    /// heading.
    #[inline(always)]
    pub fn enough(&self, seen: &Seen) -> i32 {
        let chord = longer(seen.swing);
        let mut moved = self.broad.wrapping_add(self.first.of_all(chord));
        if let Some(movement) = &self.movement {
            let arm = longer(seen.arm);
            moved = moved.wrapping_add(movement.turn.at(arm, movement.shift));
        }
        // A normal is longer than 1 by 2^-8 at most.
        moved.wrapping_add(moved >> 7).wrapping_add(ROUNDED_BROADLY)
    }
}

/// Returns the estimate above the goal, length units, to the nearest; `None` if it is beyond the layout's reach.
#[inline(always)]
fn place(facets: &Facets<'_>, set: &PoseSet, goal: Pose) -> Option<[i32; 2]> {
    let k = u32::from(facets.unit());
    let half = 1i32.wrapping_shl(k) >> 1;
    let reach = u32::from(facets.reach());
    // Estimates and goals are within 2,000,000,000 um of the origin.
    let offset = |at: i32, goal: i32| {
        let offset = at.checked_sub(goal)?.checked_add(half)?.wrapping_shr(k);
        (offset.unsigned_abs() <= reach).then_some(offset)
    };
    let mean = set.mean();
    Some([offset(mean.x_um, goal.x_um)?, offset(mean.y_um, goal.y_um)?])
}

/// Returns a vector's length, or at most 12 % more.
#[inline(always)]
const fn longer([x, y]: [i32; 2]) -> i32 {
    let [x, y] = [x.wrapping_abs(), y.wrapping_abs()];
    if x > y {
        x.wrapping_add(y >> 1)
    } else {
        y.wrapping_add(x >> 1)
    }
}

/// Returns `a . b`.
#[inline(always)]
pub(super) const fn dot([ax, ay]: [i32; 2], [bx, by]: [i32; 2]) -> i32 {
    ax.wrapping_mul(bx).wrapping_add(ay.wrapping_mul(by))
}

/// Returns `value / 2^15` to the nearest.
#[inline(always)]
pub(super) const fn q15(value: i32) -> i32 {
    value.wrapping_add(1 << 14) >> 15
}
