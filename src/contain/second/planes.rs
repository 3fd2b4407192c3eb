//! Tests an estimate against the facets of a table by the plain formula: the spread of a point along a
//! normal.
//!
//! Each frame of a layout describes one point P ([`crate::table`]). To first order in the yaw, P has over
//! the set the covariance `S = T C T'`, where C is the covariance of (x, y, L yaw) times the squared radius,
//! `T = [I | dP/dyaw / L]`, and L is a power of two above the longest lever. A facet holds if `s >= 0` and
//! `s^2 >= a' S a`; for a cylinder, if `s - alpha |a . dP/dyaw| >= rho |a|`.
//!
//! Lengths are in the layout's units of 2^k um, or 2^-14 of them where stated. C and S are multiplied by
//! 2^(2 power), so that the largest variance of C is below 2^28.

use super::believed::{Ellipsoid, Question};
use super::bits::{quotient, root, root32, short_by, wide, word16, word32};
use super::spots::{Among, FINER, outermost_hold};
use super::turn::cosine_and_sine;
use crate::set::Uncertainty;
use crate::table::parts;

const HEAD: usize = 12;
pub(super) type Facet = [u8; 6];

/// 10^12 and 10^6 with their top bits at bit 30, and the powers that undo the scaling.
pub(super) const SQUARE_MICRO: (i32, i32) = (0x746a_5288, 9);
const WEIGHT_MICRO: (i32, i32) = (0x7a12_0000, -11);
/// (2^32 / (2 pi))^2 with its top bit at bit 30, rounded down.
const SQUARE_TURN: (i32, i32) = (1_740_684_680, 28);
/// Square of half a radian and 2^-11 of it, (2^-32 turn)^2: beyond it P is not linear in the yaw, and only sections decide.
const LARGEST_TURN: u64 = 116_929_449_004_694_807;
/// Pi, unit 2^-30.
const PI_Q30: u64 = 3_373_259_426;

// The tolerances of the head of `super`.
/// Apart from a factor that all entries share, which only lowers C, an entry is down by less than 1.78 (0.25 of the covariance, 0.25 of its product, 0.28 of
/// the weight, 1 of the shift) or, if it is below zero, up by less than 0.53. In the worst direction two entries off the diagonal are down and the third is up: C
/// is above the exact one by less than `(0.53 + sqrt(0.53^2 + 8 1.78^2)) / 2`, which is 2.8.
pub(super) const ROUNDING_OF_C: i32 = 3;
/// The same for C rotated into the robot's axes, and from C to S.
pub(super) const ROUNDING_OF_S: i32 = 8;
/// Most by which both roundings together can lower a variance along a normal, times the normal's square,
/// 2^28 and a little.
const BELOW_ZERO: i64 = -(64 << 28);
/// Largest `|x| + |y|` of a normal.
const ALONG: i64 = 23_262;
/// Half of [`ALONG`] times 1.118, unit 2^-28.
pub(super) const ROUNDED_AND_TURNED: i64 = 13_004 << 14;
/// 1/64 of a length unit, 2^-28.
const OWN: i64 = 1 << 22;
/// Rounding of [`Body::bends`]: two quotients.
const ROUNDING_OF_BEND: i64 = 8;
/// Tolerance of a heading, 2^-32 turn.
const OWN_HEADING: u64 = 32;
/// The largest reach of a layout, length units.
const LONGEST: u32 = 32_000;

/// The header and entries of a layout.
struct Layout<'a> {
    unit: i32,
    reach: u32,
    /// log2 of a power of two that no lever exceeds, length units; `None` without levers.
    lever: Option<u32>,
    pieces: &'a [[u8; 12]],
    frames: &'a [[u8; 6]],
    facets: &'a [Facet],
}

impl<'a> Layout<'a> {
    fn read(bytes: &'a [u8]) -> Option<Self> {
        let ([unit, pieces, frames, _], _) = bytes.split_first_chunk()?;
        let (facets, reach) = (word16(bytes, 4)?, u32::from(word16(bytes, 6)?));
        let (_, rest) = bytes.split_at_checked(HEAD)?;
        let (pieces, rest) = entries(rest, usize::from(*pieces))?;
        let (frames, rest) = entries::<6>(rest, usize::from(*frames))?;
        let (facets, _) = entries(rest, usize::from(facets))?;
        let longest = frames.iter().fold(0u32, |longest, frame| {
            let (axes, [x, y], _) = read_frame(frame);
            let both = x.unsigned_abs().saturating_add(y.unsigned_abs());
            let way = if axes == 0 {
                both
            } else {
                both.saturating_add(reach.wrapping_mul(2)).saturating_add(4)
            };
            longest.max(way)
        });
        let lever = 32u32.wrapping_sub(longest.leading_zeros());
        if *unit > 12 || lever > 15 || reach > LONGEST {
            return None;
        }
        Some(Self {
            unit: i32::from(*unit),
            reach,
            lever: (longest > 0).then_some(lever),
            pieces,
            frames,
            facets,
        })
    }
}

/// Returns some entries of a layout, and the bytes that follow them.
fn entries<const N: usize>(bytes: &[u8], count: usize) -> Option<(&[[u8; N]], &[u8])> {
    let (mine, rest) = bytes.split_at_checked(count.wrapping_mul(N))?;
    Some((mine.as_chunks().0, rest))
}

/// Returns axes, point and number of facets.
fn read_frame([axes, facets, x0, x1, y0, y1]: &[u8; 6]) -> (u8, [i32; 2], u8) {
    let number = |low: &u8, high: &u8| i32::from(i16::from_le_bytes([*low, *high]));
    (*axes, [number(x0, x1), number(y0, y1)], *facets)
}

/// A covariance of a point and the yaw: xx, xy, yy, x-yaw, y-yaw, yaw-yaw.
type Covariance = [i32; 6];

/// The set in the layout's numbers.
pub(super) struct Body {
    /// The estimate relative to the goal, 2^-14 length units.
    pub(super) at: [i32; 2],
    /// The heading relative to the goal's.
    pub(super) above_goal: u32,
    /// The heading, 2^-32 turn.
    pub(super) heading: u32,
    /// Cosine and sine of the heading, 2^-30.
    pub(super) facing: [i32; 2],
    pub(super) power: i32,
    /// The left shift that makes levers shares of L, 2^-30.
    pub(super) up: u32,
    pub(super) world: Covariance,
    pub(super) robot: Covariance,
    /// The yaw extent of a cylinder or of an ellipsoid's movement, 2^-31 rad.
    pub(super) alpha: u32,
    /// The square of the yaw extent, (2^-32 turn)^2.
    pub(super) reach: u64,
    /// The same of an ellipsoid that has moved.
    whole_reach: u64,
    /// The largest movement of an ellipsoid, 2^-14 length units, down.
    pub(super) moved: i64,
    /// How far it leads across the estimate's heading: at most as far.
    aside: i64,
    /// The largest turn of the movement to either side, 2^-32 turn.
    pub(super) swing: i64,
    pub(super) is_cylinder: bool,
    /// The amount added to every s, 2^-28 length units.
    pub(super) clearance: i64,
}

/// The point of a frame over the set.
struct FrameProjection {
    /// The point for the estimate, 2^-14 length units.
    at: [i32; 2],
    /// Its derivative by the yaw over L, 2^-30.
    lever: [i32; 2],
    /// S: xx, xy, yy.
    spread: [i32; 3],
    /// The amount added to s, 2^-28 length units.
    clearance: i64,
    is_robot: bool,
}

impl Body {
    pub(super) const EMPTY: Self = Self {
        at: [0; 2],
        above_goal: 0,
        heading: 0,
        facing: [0; 2],
        power: 0,
        up: 0,
        world: [0; 6],
        robot: [0; 6],
        alpha: 0,
        reach: 0,
        whole_reach: 0,
        moved: 0,
        aside: 0,
        swing: 0,
        is_cylinder: false,
        clearance: 0,
    };

    #[inline(never)]
    fn fill(
        &mut self,
        table: &[u8],
        layout: &Layout<'_>,
        question: &Question<'_>,
        heading: u32,
    ) -> Option<()> {
        let farthest = layout.reach.wrapping_mul(2).wrapping_add(2) << 13;
        let [x, y] = question.above(table, 14i32.wrapping_sub(layout.unit))?;
        if !(x.unsigned_abs().max(y.unsigned_abs()) <= u64::from(farthest)) {
            return None;
        }
        let unit = layout.unit.unsigned_abs();
        let half = (1i64 << 13).wrapping_add((1i64 << 13).wrapping_shr(unit));
        self.clearance = ALONG.wrapping_mul(half).wrapping_add(OWN);
        let lever = layout.lever.unwrap_or(0);
        self.at = [x as i32, y as i32];
        self.above_goal = heading.wrapping_sub(word32(table, 24)?);
        self.heading = heading;
        self.up = 16u32.wrapping_sub(lever);
        match question.belief.spread.as_ref()? {
            Uncertainty::Gaussian(covariance) => {
                let ellipsoid = question.ellipsoid(covariance)?;
                self.take(&ellipsoid, layout.unit, lever as i32)?;
                self.move_by(question, unit);
            }
            Uncertainty::Bounded {
                translation_m,
                yaw_rad,
            } => {
                let cylinder = question.cylinder(*translation_m, *yaw_rad)?;
                // The radius with its top bit at bit 31: its square is below 2^28 units at this power.
                let up = cylinder.radius_q8.leading_zeros();
                let radius = cylinder.radius_q8.wrapping_shl(up) >> 32;
                let square = (radius.wrapping_mul(radius) >> 36) as i32;
                self.power = (up as i32).wrapping_add(layout.unit).wrapping_sub(42);
                let yaw = cylinder.yaw.unsigned_abs();
                self.alpha = angle(yaw);
                self.world = [square, 0, square, 0, 0, 0];
                self.robot = self.world;
                self.reach = yaw.wrapping_mul(yaw);
                self.whole_reach = self.reach;
                self.is_cylinder = true;
            }
        }
        if layout.lever.is_some() || self.aside < self.moved {
            self.facing = cosine_and_sine(heading);
        }
        if layout.lever.is_some() && !self.is_cylinder {
            self.robot = turned(&self.world, self.facing);
        }
        Some(())
    }

    /// Applies the growth of an ellipsoid by a movement.
    #[inline(never)]
    fn move_by(&mut self, question: &Question<'_>, unit: u32) {
        self.whole_reach = self.reach;
        if question.moved_um == 0 && question.swing == 0 {
            return;
        }
        let length = |um: u32| i64::from(um).wrapping_shl(14).wrapping_shr(unit);
        self.moved = length(question.moved_um);
        self.swing = question.swing;
        let turn = self.swing.unsigned_abs();
        self.alpha = angle(turn);
        let whole = root(self.reach).wrapping_add(turn);
        self.whole_reach = whole.saturating_mul(whole);
        // The robot's heading of any moment is off by at most its yaw error and its turn: radians, 2^-31, down.
        let turned = i64::from(angle(whole.min(1 << 31)) >> 1).wrapping_mul(self.moved >> 10) >> 20;
        self.aside = length(question.side_um)
            .wrapping_add(turned.wrapping_sub(turned >> 10))
            .min(self.moved);
    }

    /// Returns a bound of a movement along a normal in world axes, 2^-28 units, down.
    pub(super) fn moved_along(&self, [x, y]: [i32; 2]) -> i64 {
        let square = x.wrapping_mul(x).wrapping_add(y.wrapping_mul(y));
        let any = i64::from(root32(square.unsigned_abs())).wrapping_mul(self.moved);
        if self.aside == self.moved {
            return any;
        }
        let [c, s] = self.facing;
        // The parts of the normal, down.
        let ahead = both(c, x, s, y).unsigned_abs().saturating_sub(1);
        let across = both(c, y, s.wrapping_neg(), x)
            .unsigned_abs()
            .saturating_sub(1);
        let strip = i64::from(ahead)
            .wrapping_mul(self.moved)
            .wrapping_add(i64::from(across).wrapping_mul(self.aside));
        any.min(strip)
    }

    /// Computes C of an ellipsoid, lowered by its rounding.
    #[inline(always)]
    pub(super) fn take(&mut self, ellipsoid: &Ellipsoid, unit: i32, lever: i32) -> Option<()> {
        let (plane, yaw) = (ellipsoid.plane, ellipsoid.yaw);
        let [.., tt] = ellipsoid.covariance;
        self.reach = tt.times(yaw.times(SQUARE_TURN)).whole();
        let lengths = plane.times(SQUARE_MICRO).scaled(unit.wrapping_mul(-2));
        let between = plane.times(WEIGHT_MICRO).scaled(lever.wrapping_sub(unit));
        let turn = yaw.scaled(lever.wrapping_mul(2));
        let weights = [lengths, lengths, lengths, between, between, turn];
        let mut numbers = ellipsoid.covariance;
        for (number, weight) in numbers.iter_mut().zip(weights) {
            *number = number.times(weight);
        }
        let [xx, _, yy, .., tt] = numbers;
        let top = xx.top().max(yy.top()).max(tt.top());
        self.power = 28i32.wrapping_sub(top) >> 1;
        // The variances are lowered by their rounding.
        let less = [ROUNDING_OF_C, 0, ROUNDING_OF_C, 0, 0, ROUNDING_OF_C];
        for ((entry, number), less) in self.world.iter_mut().zip(&numbers).zip(less) {
            let value = number.at(self.power.wrapping_mul(2))?;
            if value.unsigned_abs() > 1 << 28 {
                return None;
            }
            *entry = value.wrapping_sub(less);
        }
        Some(())
    }

    /// Returns `true` if the headings lie in a piece's arc.
    fn is_in_arc(&self, from: u32, width: u32) -> bool {
        let above = self.above_goal.wrapping_sub(from);
        let room = u64::from(above.min(width.saturating_sub(above))).wrapping_add(OWN_HEADING);
        width == u32::MAX || above <= width && room.wrapping_mul(room) >= self.whole_reach
    }

    /// Returns the set's point in a frame, or `None` if it exceeds the range of the numbers.
    #[inline(always)]
    fn seen(&self, axes: u8, [vx, vy]: [i32; 2]) -> Option<FrameProjection> {
        let [x, y] = self.at;
        let [c, s] = self.facing;
        let is_robot = axes != 0;
        let (at, lever, covariance) = if !is_robot {
            if (vx, vy) == (0, 0) {
                let [xx, xy, yy, ..] = self.world;
                return Some(FrameProjection {
                    at: self.at,
                    lever: [0; 2],
                    spread: [xx, xy, yy],
                    clearance: self.clearance,
                    is_robot,
                });
            }
            let (vx, vy) = (vx << 14, vy << 14);
            let ax = both(c, vx, s.wrapping_neg(), vy);
            let ay = both(s, vx, c, vy);
            (
                [x.wrapping_add(ax), y.wrapping_add(ay)],
                [ay.wrapping_neg(), ax],
                &self.world,
            )
        } else {
            let (dx, dy) = (x.wrapping_sub(vx << 14), y.wrapping_sub(vy << 14));
            let mx = both(c, dx, s, dy);
            let my = both(c, dy, s.wrapping_neg(), dx);
            ([mx, my], [my, mx.wrapping_neg()], &self.robot)
        };
        let [lx, ly] = lever;
        let (long, short) = (lx.unsigned_abs(), ly.unsigned_abs());
        let (long, short) = (long.max(short), long.min(short));
        if long.checked_shr(30u32.wrapping_sub(self.up))? != 0 {
            return None;
        }
        let length = i64::from(long.wrapping_add(short >> 1));
        let lever = [lx.wrapping_shl(self.up), ly.wrapping_shl(self.up)];
        Some(FrameProjection {
            at,
            lever,
            spread: if self.is_cylinder {
                let [xx, xy, yy, ..] = *covariance;
                [xx, xy, yy]
            } else {
                spread(covariance, lever)
            },
            clearance: self
                .clearance
                .wrapping_add(length.wrapping_sub(length >> 4))
                .wrapping_add(ROUNDED_AND_TURNED),
            is_robot,
        })
    }

    /// Returns `true` if a facet holds.
    #[cfg_attr(small_code, inline(never))]
    #[cfg_attr(not(small_code), inline(always))]
    fn admits(&self, [x0, x1, y0, y1, b0, b1]: &Facet, seen: &FrameProjection) -> bool {
        let number = |low: &u8, high: &u8| i32::from(i16::from_le_bytes([*low, *high]));
        let normal @ [x, y] = [number(x0, x1), number(y0, y1)];
        let mut spare = (i64::from(number(b0, b1)) << 28)
            .wrapping_add(seen.clearance)
            .wrapping_sub(dot(normal, seen.at));
        if self.alpha != 0 {
            // L is 2^(16 - up) units.
            let turned = (dot(normal, seen.lever) >> 14) as i32;
            let turned = u64::from(turned.unsigned_abs()).wrapping_mul(u64::from(self.alpha));
            let turned = turned.wrapping_shr(17u32.wrapping_add(self.up));
            spare = spare.wrapping_sub(turned as i64);
        }
        let holds = |moved| self.has_room(spare.wrapping_sub(moved), normal, seen);
        if self.moved == 0 {
            return holds(0);
        }
        // A longer normal needs no root and no angle: its length is at most this, also if it is turned and rounded. Most facets hold with it, and what
        // holds with it holds with the exact one.
        let [long, short] = normal.map(i32::unsigned_abs);
        let length = long.max(short).wrapping_add(long.min(short) >> 1);
        if holds(i64::from(length.wrapping_add(1)).wrapping_mul(self.moved)) {
            return true;
        }
        let [c, s] = self.facing;
        holds(self.moved_along(match seen.is_robot {
            true => [both(c, x, s.wrapping_neg(), y), both(s, x, c, y)],
            false => normal,
        }))
    }

    /// Returns `true` if the set reaches along a normal at most as far as `spare`, unit 2^-28 length units, also if the set bends ([`Body::bends`]).
    #[cfg_attr(small_code, inline(never))]
    #[cfg_attr(not(small_code), inline(always))]
    fn has_room(&self, spare: i64, normal: [i32; 2], seen: &FrameProjection) -> bool {
        if !(spare >= 0) {
            return false;
        }
        let Some(spare) = self.scaled(spare) else {
            return true;
        };
        let [ax, ay] = normal;
        let [xx, xy, yy] = seen.spread;
        let square = wide(ax.wrapping_mul(ax), xx)
            .wrapping_add(wide(ax.wrapping_mul(ay).wrapping_mul(2), xy))
            .wrapping_add(wide(ay.wrapping_mul(ay), yy));
        // The spare is at most 2^30.
        let held = wide(spare as i32, spare as i32) >= square;
        square >= BELOW_ZERO && (held || self.bends(normal, seen, square, spare))
    }

    /// Returns a length of 2^-28 units times 2^(power + 14), rounded up, or `None` from 2^30 on: no extent
    /// is that long.
    #[inline(always)]
    pub(super) fn scaled(&self, length: i64) -> Option<u32> {
        let by = self.power.wrapping_sub(14);
        let length = if by < 0 {
            length.wrapping_shr(by.unsigned_abs().min(63))
        } else {
            let by = by.unsigned_abs().min(30);
            if length.wrapping_shr(30u32.wrapping_sub(by)) != 0 {
                return None;
            }
            length.wrapping_shl(by)
        };
        (length < 1 << 30).then_some((length as u32).wrapping_add(1))
    }

    /// Returns `true` if the facet holds with the product of yaw and offset at the point where the ellipsoid
    /// touches it. A rotated offset `R(-t) d` is `d - t J d`. If that bends the set away from the facet, the
    /// first evaluation counts it. The condition is `s + t* (a . J d*) >= r`.
    #[inline(never)]
    fn bends(&self, normal: [i32; 2], seen: &FrameProjection, square: i64, spare: u32) -> bool {
        if !seen.is_robot || self.is_cylinder {
            return false;
        }
        let [ax, ay] = normal;
        let [xx, xy, yy, xt, yt, tt] = self.robot;
        let [lx, ly] = seen.lever;
        // The covariance of a variable with the point, along the normal.
        let along = |to_x: i32, to_y: i32, to_yaw: i32| {
            let x = to_x.wrapping_add(share(to_yaw, lx));
            let y = to_y.wrapping_add(share(to_yaw, ly));
            dot(normal, [x, y])
        };
        let yaw = along(xt, yt, tt);
        let across = i64::from(ay)
            .wrapping_mul(along(xx, xy, xt))
            .wrapping_sub(i64::from(ax).wrapping_mul(along(xy, yy, yt)));
        // r, the touching point's yaw times 2^16, and its offset across.
        let distance = root(square.max(1).unsigned_abs());
        let by = |value: i64| quotient(value, distance);
        let bend = by(yaw.wrapping_mul(1 << 16)).wrapping_mul(by(across)) >> 16;
        // The value is scaled by L 2^(2 power + 14).
        let down = self.power.wrapping_add(16).wrapping_sub(self.up as i32);
        let bend = bend.wrapping_shr(down.unsigned_abs().min(63));
        let spare = i64::from(spare)
            .wrapping_add(bend)
            .wrapping_add(ROUNDING_OF_BEND);
        down >= 0 && spare >= distance as i64
    }
}

/// Returns a turn of 2^-32 turn in 2^-31 rad, down; at most 1 rad.
#[cfg_attr(small_code, inline(never))]
fn angle(turn: u64) -> u32 {
    (turn.wrapping_mul(PI_Q30) >> 30).min(1 << 31) as u32
}

/// Returns C in the robot's axes, `R(-yaw) C R(yaw)`.
#[inline(never)]
pub(super) fn turned([xx, xy, yy, xt, yt, tt]: &Covariance, [c, s]: [i32; 2]) -> Covariance {
    let along = |x: i32, y: i32| both(c, x, s, y);
    let across = |x: i32, y: i32| both(c, y, s.wrapping_neg(), x);
    let (ux, uy) = (along(*xx, *xy), along(*xy, *yy));
    let (wx, wy) = (across(*xx, *xy), across(*xy, *yy));
    [
        along(ux, uy),
        across(ux, uy),
        across(wx, wy),
        along(*xt, *yt),
        across(*xt, *yt),
        *tt,
    ]
}

/// Returns S of a point with a lever over L, lowered by its rounding. The largest is below 2^30.6.
#[inline(always)]
pub(super) fn spread([xx, xy, yy, xt, yt, tt]: &Covariance, [lx, ly]: [i32; 2]) -> [i32; 3] {
    let vx = xt.wrapping_add(share(*tt, lx));
    let vy = yt.wrapping_add(share(*tt, ly));
    [
        xx.wrapping_add(share(xt.wrapping_add(vx), lx))
            .wrapping_sub(ROUNDING_OF_S),
        xy.wrapping_add(share(*yt, lx)).wrapping_add(share(vx, ly)),
        yy.wrapping_add(share(yt.wrapping_add(vy), ly))
            .wrapping_sub(ROUNDING_OF_S),
    ]
}

#[cfg_attr(small_code, inline(never))]
#[cfg_attr(not(small_code), inline(always))]
fn q30(value: i64) -> i32 {
    (value.wrapping_add(1 << 29) >> 30) as i32
}

/// Returns a number times a share of 2^-30, to the nearest.
#[cfg_attr(small_code, inline(never))]
#[cfg_attr(not(small_code), inline(always))]
fn share(number: i32, share: i32) -> i32 {
    q30(wide(number, share))
}

/// Returns the sum of two products with a cosine or sine, 2^-30, to the nearest.
#[cfg_attr(small_code, inline(never))]
#[cfg_attr(not(small_code), inline(always))]
pub(super) fn both(c: i32, x: i32, s: i32, y: i32) -> i32 {
    q30(wide(c, x).wrapping_add(wide(s, y)))
}

/// Returns the scalar product of a normal of 16 bits and a vector.
#[inline(always)]
pub(super) fn dot([ax, ay]: [i32; 2], [x, y]: [i32; 2]) -> i64 {
    short_by(ax, x).wrapping_add(short_by(ay, y))
}

/// A piece's bytes.
struct Piece<'a> {
    from: u32,
    width: u32,
    frames: &'a [[u8; 6]],
    facets: &'a [Facet],
}

impl<'a> Layout<'a> {
    /// Calls `each` with the pieces until it returns `true`. `None` if the bytes are invalid.
    #[inline(always)]
    fn any(&self, mut each: impl FnMut(&Piece<'a>) -> Option<bool>) -> Option<bool> {
        let (mut frames, mut facets) = (self.frames, self.facets);
        for [f0, f1, f2, f3, w0, w1, w2, w3, own, _, c0, c1] in self.pieces {
            let (mine, rest) = frames.split_at_checked(usize::from(*own))?;
            frames = rest;
            let count = usize::from(u16::from_le_bytes([*c0, *c1]));
            let (planes, rest) = facets.split_at_checked(count)?;
            facets = rest;
            let piece = Piece {
                from: u32::from_le_bytes([*f0, *f1, *f2, *f3]),
                width: u32::from_le_bytes([*w0, *w1, *w2, *w3]),
                frames: mine,
                facets: planes,
            };
            if each(&piece)? {
                return Some(true);
            }
        }
        Some(false)
    }
}

/// Returns `true` if one piece contains the set, or several pieces its outermost poses. `None` if the bytes are invalid or the set
/// exceeds the range of the numbers.
#[inline(never)]
pub(super) fn hold(table: &[u8], layout: &[u8], question: &Question<'_>) -> Option<bool> {
    let layout = Layout::read(layout)?;
    let is_in_one = in_one(table, &layout, question) == Some(true);
    if is_in_one || !parts::UNIONS || layout.pieces.len() < 2 {
        return Some(is_in_one);
    }
    in_several(table, layout, question)
}

/// Its stack is free while the pieces are tried one by one.
#[inline(never)]
fn in_several(table: &[u8], layout: Layout<'_>, question: &Question<'_>) -> Option<bool> {
    let place = Place {
        at: question.above(table, FINER)?,
        heading: question.heading()?,
        goal: word32(table, 24)?,
        layout,
    };
    outermost_hold(question, &Among::Pieces(place))
}

#[inline(never)]
fn in_one(table: &[u8], layout: &Layout<'_>, question: &Question<'_>) -> Option<bool> {
    let mut body = Body::EMPTY;
    body.fill(table, layout, question, question.heading()?)?;
    layout.any(|piece| {
        Some(
            body.is_in_arc(piece.from, piece.width)
                && piece_holds(&body, piece.frames, piece.facets)?,
        )
    })
}

/// An estimate among pieces.
pub(super) struct Place<'a> {
    /// From the goal in world axes, 2^-3 um.
    at: [i64; 2],
    /// 2^-32 turn.
    heading: u32,
    /// The goal's heading.
    goal: u32,
    layout: Layout<'a>,
}

impl Place<'_> {
    /// Returns `true` if a piece contains the pose at an offset from the estimate, 2^-3 um, 2^-3 um, 2^-32 turn.
    #[inline(never)]
    pub(super) fn is_in_a_piece(&self, [dx, dy, turn]: [i64; 3]) -> Option<bool> {
        let [x, y] = self.at;
        let unit = self.layout.unit.unsigned_abs();
        // 2^-14 length units. Beyond the reach of every layout: 2^30 of them.
        let place = |at: i64, by: i64| {
            let at = at.saturating_add(by).clamp(-(1 << 40), 1 << 40);
            let at = at.wrapping_shl(14).wrapping_shr(unit.wrapping_add(3));
            i32::try_from(at)
                .ok()
                .filter(|at| at.unsigned_abs() < 1 << 30)
        };
        let (Some(x), Some(y)) = (place(x, dx), place(y, dy)) else {
            return Some(false);
        };
        let heading = self.heading.wrapping_add(turn as u32);
        let above_goal = heading.wrapping_sub(self.goal);
        let facing = cosine_and_sine(heading);
        let half = (1i64 << 13).wrapping_add((1i64 << 13).wrapping_shr(unit));
        let clearance = ALONG.wrapping_mul(half).wrapping_add(OWN);
        self.layout.any(|piece| {
            let ahead = above_goal
                .wrapping_sub(piece.from)
                .wrapping_add(OWN_HEADING as u32);
            let width = piece.width.saturating_add((OWN_HEADING as u32) << 1);
            if piece.width != u32::MAX && ahead > width {
                return Some(false);
            }
            let mut facets = piece.facets;
            for frame in piece.frames {
                let (axes, point, own) = read_frame(frame);
                let (mine, rest) = facets.split_at_checked(usize::from(own))?;
                facets = rest;
                if !point_holds(mine, axes, point, [x, y], facing, clearance) {
                    return Some(false);
                }
            }
            Some(true)
        })
    }
}

/// Returns `true` if a frame's point is within its facets at a pose.
#[inline(never)]
fn point_holds(
    facets: &[Facet],
    axes: u8,
    [vx, vy]: [i32; 2],
    [x, y]: [i32; 2],
    [c, s]: [i32; 2],
    clearance: i64,
) -> bool {
    let (vx, vy) = (vx << 14, vy << 14);
    let (at, lever) = if axes == 0 {
        let ax = both(c, vx, s.wrapping_neg(), vy);
        let ay = both(s, vx, c, vy);
        ([x.wrapping_add(ax), y.wrapping_add(ay)], [ax, ay])
    } else {
        let (dx, dy) = (x.wrapping_sub(vx), y.wrapping_sub(vy));
        let at = [both(c, dx, s, dy), both(c, dy, s.wrapping_neg(), dx)];
        (at, at)
    };
    let [lx, ly] = lever.map(i32::unsigned_abs);
    let length = i64::from(lx.max(ly).wrapping_add(lx.min(ly) >> 1));
    let spare = clearance
        .wrapping_add(length.wrapping_sub(length >> 4))
        .wrapping_add(ROUNDED_AND_TURNED);
    facets.iter().all(|[x0, x1, y0, y1, b0, b1]| {
        let number = |low: &u8, high: &u8| i32::from(i16::from_le_bytes([*low, *high]));
        let along = dot([number(x0, x1), number(y0, y1)], at);
        (i64::from(number(b0, b1)) << 28).wrapping_add(spare) >= along
    })
}

/// Returns `true` if every facet of a piece's frames holds, and the number of facets is as the frames state.
/// A separate function, so that its stack is not that of the conversion.
#[inline(never)]
fn piece_holds(body: &Body, frames: &[[u8; 6]], mut facets: &[Facet]) -> Option<bool> {
    for frame in frames {
        let (axes, point, own) = read_frame(frame);
        let (mine, rest) = facets.split_at_checked(usize::from(own))?;
        facets = rest;
        let seen = body.seen(axes, point)?;
        let turns = axes != 0 || point != [0, 0];
        let is_linear = !turns || body.whole_reach <= LARGEST_TURN;
        let holds = |facet: &Facet| {
            is_linear && body.admits(facet, &seen)
                || parts::HEADINGS && turns && body.sections_hold(facet, axes, point)
        };
        if !mine.iter().all(holds) {
            return Some(false);
        }
    }
    Some(!frames.is_empty() && facets.is_empty())
}
