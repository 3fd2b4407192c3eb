//! A camera and its tag, prepared for evaluation at many poses.

use super::{ANGLE_ERROR_UM, FailedConstraint, LENGTH_ERROR_UM, Pixel, Sighting, TagVisibility};
use crate::num::{Reciprocal, product, sqrt_floor};
use crate::pose::Pose;
use crate::table::{EDGE_BITS, PIXEL_BITS, SightRecord, Table};

type Vector = [i32; 3];

/// If a tag is farther from the robot than this on a world axis, it is more than 110 m from its camera: 2^27
/// um, minus the 24 m that a camera may be from the robot's centre.
const REACH_UM: u32 = 1 << 27;

/// Fraction bits of the ratio of a corner's coordinate to its depth.
const RATIO_BITS: u32 = 24;

/// A camera on the robot and the tag that it looks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Scene {
    record: SightRecord,
    /// Along a row, along a column.
    spans: [Span; 2],
}

/// The image along a row or a column.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
struct Span {
    /// Focal length, 2^-14 px.
    focal: i32,
    /// From the image's edge to the optical axis, and from there to the other edge, 2^-14 px.
    before: i32,
    after: i32,
    /// Upper bound of the rounding error of a slack, um 2^-14 px.
    error: i64,
}

impl Scene {
    /// Returns the scene of a table; `None` if the table has no camera and tag.
    #[must_use]
    pub fn of(table: &Table<'_>) -> Option<Self> {
        Self::new(table.sight_record()?)
    }

    /// Creates the scene of a record; `None` if a number of the record is out of range.
    #[must_use]
    pub fn new(record: SightRecord) -> Option<Self> {
        if !record.is_valid() {
            return None;
        }
        let ([fx, fy], [cx, cy], [width, height]) = (record.focal, record.centre, record.image);
        // Upper bound of a corner's coordinate on any axis: if d is certainly beyond its maximum, no other
        // constraint is evaluated.
        let edges = [record.half_right, record.half_up];
        let reach = edges
            .iter()
            .flatten()
            .fold(i64::from(record.d_max), |sum, entry| {
                sum.wrapping_add(i64::from(entry.unsigned_abs() >> EDGE_BITS))
            })
            .wrapping_add(32);
        Some(Self {
            record,
            spans: [
                Span::new(fx, cx, width, reach),
                Span::new(fy, cy, height, reach),
            ],
        })
    }

    /// Returns the numbers from which the scene was made.
    #[must_use]
    pub const fn record(&self) -> &SightRecord {
        &self.record
    }

    /// Returns the view of the tag from a pose of the robot in the world.
    ///
    /// Integers only; no panic, no loop that depends on the pose. Sums of products stay below 2^61.
    pub fn look(&self, pose: &Pose) -> Sighting {
        let record = &self.record;
        let [x, y, z] = record.middle;
        let (Some(x), Some(y)) = (within_reach(x, pose.x_um), within_reach(y, pose.y_um)) else {
            return self.out_of_reach();
        };
        let turn = pose.yaw.cos_sin_q30();
        let [x, y, z] = turned(turn, [x, y, z]);
        let [camera_x, camera_y, camera_z] = record.camera;
        let ray = [
            x.wrapping_sub(camera_x),
            y.wrapping_sub(camera_y),
            z.wrapping_sub(camera_z),
        ];
        let d = sqrt_floor(dot(ray, ray).unsigned_abs());
        // The tag in the camera's axes, micrometres.
        let middle = record.axes.map(|axis| shifted::<30>(dot(axis, ray)));
        let edge = |edge: Vector| {
            let edge = turned(turn, edge);
            record
                .axes
                .map(|axis| shifted::<{ 30 + EDGE_BITS }>(dot(axis, edge)))
        };
        let tag = Tag {
            middle,
            right: edge(record.half_right),
            up: edge(record.half_up),
        };
        let [_, _, ahead] = middle;
        // From the tag to the camera along the normal.
        let facing = shifted::<30>(dot(turned(turn, record.normal), ray)).wrapping_neg();
        Sighting {
            answer: self.judge(&tag, d, facing),
            tag: record.tag,
            corners: self.corners(&tag),
            d_um: d as u32,
            cos_phi_q30: ratio_q30(ahead, d),
            cos_psi_q30: ratio_q30(facing, d),
        }
    }

    /// Evaluates every constraint from its slack, which is at least 0 if it is satisfied, and the slack's
    /// rounding error bound.
    #[inline(always)]
    fn judge(&self, tag: &Tag, d: i64, facing: i32) -> TagVisibility {
        let record = &self.record;
        let [_, _, ahead] = tag.middle;
        let depth = tag.least(|[_, _, z]| i64::from(z));
        let along = |cos: i32| product_q30(cos, d);
        let [row, column] = &self.spans;
        let constraints = [
            (
                i64::from(record.d_max).wrapping_sub(d),
                LENGTH_ERROR_UM,
                FailedConstraint::Distance,
            ),
            (
                depth.wrapping_sub(i64::from(record.z_near)),
                LENGTH_ERROR_UM,
                FailedConstraint::Depth,
            ),
            (
                row.slack(tag, |[x, _, z]| (x, z)),
                row.error,
                FailedConstraint::Image,
            ),
            (
                column.slack(tag, |[_, y, z]| (y, z)),
                column.error,
                FailedConstraint::Image,
            ),
            (
                i64::from(ahead).wrapping_sub(along(record.cos_phi)),
                ANGLE_ERROR_UM,
                FailedConstraint::Phi,
            ),
            (
                i64::from(facing).wrapping_sub(along(record.cos_psi)),
                ANGLE_ERROR_UM,
                FailedConstraint::Psi,
            ),
        ];
        let mut answer = TagVisibility::Visible;
        for (slack, error, why) in constraints {
            if slack < error.wrapping_neg() {
                return TagVisibility::NotVisible(why);
            }
            if slack < error {
                answer = TagVisibility::Unsure;
            }
        }
        answer
    }

    /// Returns the corners in AprilTag's order.
    #[inline(always)]
    fn corners(&self, tag: &Tag) -> [Option<Pixel>; 4] {
        let [row, column] = &self.spans;
        tag.corners().map(|[x, y, z]| {
            if z < self.record.z_near {
                return None;
            }
            let by_depth = Reciprocal::of(z.unsigned_abs())?;
            Some(Pixel {
                u_q8: row.pixel_q8(x, by_depth),
                v_q8: column.pixel_q8(y, by_depth),
            })
        })
    }

    /// Returns the sighting of a tag too far away for the number range, and so beyond every `d_max`.
    fn out_of_reach(&self) -> Sighting {
        Sighting {
            answer: TagVisibility::NotVisible(FailedConstraint::Distance),
            tag: self.record.tag,
            corners: [None; 4],
            d_um: u32::MAX,
            cos_phi_q30: 0,
            cos_psi_q30: 0,
        }
    }
}

impl Span {
    /// Creates a span from a record's numbers; `reach` is an upper bound of a corner's coordinate on any
    /// axis from the camera.
    fn new(focal: i32, centre: i32, length: i32, reach: i64) -> Self {
        let (before, after) = (centre, length.wrapping_sub(centre));
        let longest = before.unsigned_abs().max(after.unsigned_abs());
        let scale = i64::from(focal).wrapping_add(i64::from(longest));
        Self {
            focal,
            before,
            after,
            // 5.41 um at any point, and 1.53 of 2^-14 px.
            error: scale
                .wrapping_mul(LENGTH_ERROR_UM)
                .wrapping_add(reach.wrapping_mul(2)),
        }
    }

    /// Returns the least slack of both edges of the image over the four corners: `f X + before Z` and
    /// `after Z - f X`, um 2^-14 px.
    #[inline(always)]
    fn slack(&self, tag: &Tag, across: impl Fn(Vector) -> (i32, i32)) -> i64 {
        let first = tag.least(|point| {
            let (x, z) = across(point);
            product(self.focal, x).wrapping_add(product(self.before, z))
        });
        let second = tag.least(|point| {
            let (x, z) = across(point);
            product(self.after, z).wrapping_sub(product(self.focal, x))
        });
        first.min(second)
    }

    /// Returns `c + f X / Z`, 2^-8 px.
    #[inline(always)]
    fn pixel_q8(&self, across: i32, by_depth: Reciprocal) -> i32 {
        // 2^-38 px: below 2^61, and 2^54.
        let offset = product(self.focal, by_depth.ratio::<RATIO_BITS>(across));
        let place = offset.wrapping_add(i64::from(self.before).wrapping_shl(RATIO_BITS));
        const DOWN: u32 = PIXEL_BITS + RATIO_BITS - 8;
        let q8 = place.wrapping_add(1 << (DOWN - 1)) >> DOWN;
        q8.max(i64::from(i32::MIN)).min(i64::from(i32::MAX)) as i32
    }
}

/// A tag in the camera's axes (right, down, forward), micrometres: its middle, and from there to the middles
/// of its right and of its upper edge.
struct Tag {
    middle: Vector,
    right: Vector,
    up: Vector,
}

impl Tag {
    /// Returns the least value of a linear function over the corners.
    #[inline(always)]
    fn least(&self, linear: impl Fn(Vector) -> i64) -> i64 {
        linear(self.middle)
            .wrapping_sub(linear(self.right).wrapping_abs())
            .wrapping_sub(linear(self.up).wrapping_abs())
    }

    /// Returns lower left, lower right, upper right, upper left.
    #[inline(always)]
    fn corners(&self) -> [Vector; 4] {
        let sum = |a: Vector, b: Vector| {
            let ([ax, ay, az], [bx, by, bz]) = (a, b);
            [
                ax.wrapping_add(bx),
                ay.wrapping_add(by),
                az.wrapping_add(bz),
            ]
        };
        let minus = |a: Vector| a.map(i32::wrapping_neg);
        let lower = sum(self.middle, minus(self.up));
        let upper = sum(self.middle, self.up);
        [
            sum(lower, minus(self.right)),
            sum(lower, self.right),
            sum(upper, self.right),
            sum(upper, minus(self.right)),
        ]
    }
}

/// Returns `to - from` if it is below [`REACH_UM`].
fn within_reach(to: i32, from: i32) -> Option<i32> {
    let length = to.checked_sub(from)?;
    (length.unsigned_abs() < REACH_UM).then_some(length)
}

/// Rotates a world vector into the robot's axes, in its own unit: within half a unit on x and y.
#[inline(always)]
fn turned([cos, sin]: [i32; 2], [x, y, z]: Vector) -> Vector {
    [
        shifted::<30>(product(cos, x).wrapping_add(product(sin, y))),
        shifted::<30>(product(cos, y).wrapping_sub(product(sin, x))),
        z,
    ]
}

/// Returns the dot product of vectors whose lengths' product is below 2^61.
#[inline(always)]
fn dot([ax, ay, az]: Vector, [bx, by, bz]: Vector) -> i64 {
    product(ax, bx)
        .wrapping_add(product(ay, by))
        .wrapping_add(product(az, bz))
}

/// Returns `sum / 2^BITS` to the nearest; the quotient fits.
#[inline(always)]
fn shifted<const BITS: u32>(sum: i64) -> i32 {
    let half = 1i64.wrapping_shl(BITS) >> 1;
    sum.wrapping_add(half).wrapping_shr(BITS) as i32
}

/// Returns a cosine times a distance below 2^28, to the nearest.
fn product_q30(cos: i32, d: i64) -> i64 {
    i64::from(shifted::<30>(product(cos, d as i32)))
}

/// Returns `part / d` as a cosine, 2^-30; 0 if d is 0.
fn ratio_q30(part: i32, d: i64) -> i32 {
    let one = 1i32 << 30;
    Reciprocal::of(d as u32).map_or(0, |by_d| {
        by_d.ratio::<30>(part).max(one.wrapping_neg()).min(one)
    })
}
