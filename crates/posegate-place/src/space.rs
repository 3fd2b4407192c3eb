//! The places at which a tag may be mounted.

use posegate::shape::{Pose3Deg, Wall};

/// The places at which a tag may be mounted, as pieces without a forbidden place.
#[derive(Clone, Debug)]
pub struct Space {
    name: String,
    pieces: Vec<Piece>,
}

/// A box of places. Its coordinates are shares of its axes' ranges, from 0 to 1.
#[derive(Clone, Debug)]
pub(super) struct Piece {
    /// The pose at the zeros of all axes.
    origin: Pose3Deg,
    axes: Vec<Axis>,
}

/// A direction in which a tag may be moved.
#[derive(Clone, Copy, Debug)]
struct Axis {
    /// The change of x, y, z (m) and yaw (degrees) per unit.
    direction: [f64; 4],
    range: [f64; 2],
}

/// The reason why there is no place for a tag.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SpaceError {
    /// An invalid range.
    #[error("the range of {name} is {lo}:{hi}; expected two finite numbers, the lower one first{}", if *.name == "yaw_deg" { ", no more than a turn apart" } else { "" })]
    Range {
        /// `x`, `y`, `z` or `yaw_deg`.
        name: &'static str,
        /// Lower end.
        lo: f64,
        /// Upper end.
        hi: f64,
    },
    /// No coordinate is free.
    #[error(
        "nothing is free: a search needs at least one of x, y, z, yaw_deg with a range of some length"
    )]
    NothingFree,
    /// A wall without space for the tag.
    #[error(
        "wall `{wall}` has no space for a tag of {size} m (with its white border {whole} m): {why}"
    )]
    NoSpace {
        /// The wall's name.
        wall: String,
        /// The black border's edge, metres.
        size: f64,
        /// With the white border, metres.
        whole: f64,
        /// The reason.
        why: String,
    },
}

impl Space {
    /// Creates a box about a pose: ranges of x, y, z (metres) and yaw (degrees, an arc). Coordinates without a range keep
    /// the pose's values, and roll and pitch always do.
    ///
    /// # Errors
    /// [`SpaceError::Range`] if a range is invalid, [`SpaceError::NothingFree`] if no range has a length.
    pub fn free(pose: Pose3Deg, ranges: [Option<[f64; 2]>; 4]) -> Result<Self, SpaceError> {
        let mut own = numbers(&pose);
        let mut axes = Vec::new();
        let mut words = Vec::new();
        for (axis, name) in ["x", "y", "z", "yaw_deg"].into_iter().enumerate() {
            let Some(range @ [lo, hi]) = ranges[axis] else {
                continue;
            };
            let widest = if axis == YAW { TURN } else { f64::MAX };
            if !(lo.is_finite() && hi.is_finite() && lo <= hi && hi - lo <= widest) {
                return Err(SpaceError::Range { name, lo, hi });
            }
            words.push(format!("{name}={lo}:{hi}"));
            if lo == hi {
                own[axis] = lo;
                continue;
            }
            own[axis] = 0.0;
            let mut direction = [0.0; 4];
            direction[axis] = 1.0;
            axes.push(Axis { direction, range });
        }
        if axes.is_empty() {
            return Err(SpaceError::NothingFree);
        }
        let origin = with_numbers(pose, own);
        Ok(Self {
            name: words.join(","),
            pieces: std::vec![Piece { origin, axes }],
        })
    }

    /// Creates the space of a wall, for a tag of edge `size` (m), `whole` (m) wide with its white border
    /// ([`Family`](posegate::shape::Family)). A wall of two corners is used on the side of the world point `front` (m), a block
    /// on every face. The complete tag is on one face, and on no keep-out. `heights` limits the heights of the tag's
    /// centre, `[lo, hi]` in metres.
    ///
    /// # Errors
    /// [`SpaceError::NoSpace`] if the tag fits nowhere.
    pub fn wall(
        wall: &Wall,
        [size, whole]: [f64; 2],
        front: [f64; 2],
        heights: Option<[f64; 2]>,
    ) -> Result<Self, SpaceError> {
        let half = 0.5 * whole;
        let no_space = |why: String| SpaceError::NoSpace {
            wall: wall.name.clone(),
            size,
            whole,
            why,
        };
        let [mut low, mut high] = [wall.z[0] + half, wall.z[1] - half];
        if let Some([lo, hi]) = heights {
            (low, high) = (low.max(lo), high.min(hi));
        }
        if !(low <= high) {
            return Err(no_space(format!("it is {} m high", wall.z[1] - wall.z[0])));
        }
        let widened =
            |[along, z]: &[[f64; 2]; 2]| [*along, *z].map(|[lo, hi]| [lo - half, hi + half]);
        let keep_outs: Vec<[[f64; 2]; 2]> = wall.keep_outs.iter().map(widened).collect();
        let count = wall.corners.len();
        let sides = if count == 2 { 1 } else { count };
        let (mut begin, mut fits) = (0.0, false);
        let mut pieces = Vec::new();
        for i in 0..sides {
            let (a, b) = (wall.corners[i], wall.corners[(i + 1) % count]);
            let to = [b[0] - a[0], b[1] - a[1]];
            let length = libm::hypot(to[0], to[1]);
            let [x, y] = to.map(|v| v / length);
            // The outside of an outline with counter-clockwise corners is to the right.
            let mut normal = [y, -x];
            let ahead = normal[0] * (front[0] - a[0]) + normal[1] * (front[1] - a[1]);
            if count == 2 && ahead < 0.0 {
                normal = normal.map(|v| -v);
            }
            let face = [[begin + half, begin + length - half], [low, high]];
            begin += length;
            if !(face[0][0] <= face[0][1]) {
                continue;
            }
            fits = true;
            let yaw_deg = libm::atan2(normal[1], normal[0]).to_degrees();
            let before = face[0][0] - half;
            let start = [a[0] - before * x, a[1] - before * y];
            pieces.extend(clear(face, &keep_outs).into_iter().map(|[along, z]| {
                let axes = [([x, y, 0.0, 0.0], along), ([0.0, 0.0, 1.0, 0.0], z)];
                Piece::new([start[0], start[1], 0.0, yaw_deg], axes)
            }));
        }
        if !fits {
            return Err(no_space(format!("it is {begin} m long")));
        }
        if pieces.is_empty() {
            return Err(no_space("its keep-outs leave none".into()));
        }
        Ok(Self {
            name: format!("wall {}", wall.name),
            pieces,
        })
    }

    pub(super) fn pieces(&self) -> &[Piece] {
        &self.pieces
    }

    /// Returns the place that is nearest to a pose, by its position.
    #[must_use]
    pub fn nearest(&self, pose: &Pose3Deg) -> Pose3Deg {
        let places = self
            .pieces
            .iter()
            .map(|piece| piece.pose(&piece.point(pose)));
        let off = |place: &Pose3Deg| {
            libm::hypot(
                libm::hypot(place.x - pose.x, place.y - pose.y),
                place.z - pose.z,
            )
        };
        places
            .min_by(|a, b| off(a).total_cmp(&off(b)))
            .unwrap_or(*pose)
    }

    /// Returns a description of the space.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }
}

const YAW: usize = 3;
/// A full turn, degrees.
const TURN: f64 = 360.0;

fn numbers(pose: &Pose3Deg) -> [f64; 4] {
    [pose.x, pose.y, pose.z, pose.yaw_deg]
}

fn with_numbers(pose: Pose3Deg, [x, y, z, yaw_deg]: [f64; 4]) -> Pose3Deg {
    Pose3Deg {
        x,
        y,
        z,
        yaw_deg,
        ..pose
    }
}

impl Piece {
    /// Creates a piece of a wall; an axis without a length is no axis.
    fn new([x, y, z, yaw_deg]: [f64; 4], axes: [([f64; 4], [f64; 2]); 2]) -> Self {
        let mut origin = [x, y, z, yaw_deg];
        let mut kept = Vec::new();
        for (direction, range) in axes {
            if range[1] > range[0] {
                kept.push(Axis { direction, range });
            } else {
                for (at, by) in origin.iter_mut().zip(direction) {
                    *at += range[0] * by;
                }
            }
        }
        let flat = Pose3Deg {
            x,
            y,
            z,
            roll_deg: 0.0,
            pitch_deg: 0.0,
            yaw_deg,
        };
        Self {
            origin: with_numbers(flat, origin),
            axes: kept,
        }
    }

    pub(super) fn dimensions(&self) -> usize {
        self.axes.len()
    }

    /// Returns the product of the lengths of the axes.
    pub(super) fn size(&self) -> f64 {
        self.axes
            .iter()
            .map(|axis| axis.range[1] - axis.range[0])
            .product()
    }

    /// Returns `true` for an axis of a full turn: its 0 and its 1 are the same place.
    pub(super) fn is_periodic(&self, axis: usize) -> bool {
        let Axis { direction, range } = self.axes[axis];
        direction[YAW] != 0.0 && range[1] - range[0] >= TURN
    }

    /// Returns the distance of two points: the largest difference of a coordinate.
    pub(super) fn apart(&self, a: &[f64], b: &[f64]) -> f64 {
        let off = |axis: usize| {
            let off = (a[axis] - b[axis]).abs();
            if self.is_periodic(axis) {
                off.min((1.0 - off).abs())
            } else {
                off
            }
        };
        (0..a.len()).map(off).fold(0.0, f64::max)
    }

    /// Returns the pose at a point. Coordinates outside of 0 to 1 are wrapped on an axis of a full turn, else clamped.
    pub(super) fn pose(&self, point: &[f64]) -> Pose3Deg {
        let mut at = numbers(&self.origin);
        for (number, axis) in self.axes.iter().enumerate() {
            let share = if self.is_periodic(number) {
                point[number] - libm::floor(point[number])
            } else {
                point[number].clamp(0.0, 1.0)
            };
            let [lo, hi] = axis.range;
            for (at, by) in at.iter_mut().zip(axis.direction) {
                *at += by * (lo + (hi - lo) * share);
            }
        }
        with_numbers(self.origin, at)
    }

    /// Returns the point that is nearest to a pose.
    pub(super) fn point(&self, pose: &Pose3Deg) -> Vec<f64> {
        let [to, from] = [numbers(pose), numbers(&self.origin)];
        let share = |axis: &Axis| {
            let off = |k: usize| (to[k] - from[k]) * axis.direction[k];
            let [lo, hi] = axis.range;
            let mut by: f64 = (0..4).map(off).sum::<f64>() - lo;
            if axis.direction[YAW] != 0.0 {
                by -= TURN * libm::floor(by / TURN);
            }
            (by / (hi - lo)).clamp(0.0, 1.0)
        };
        self.axes.iter().map(share).collect()
    }
}

/// Returns the largest rectangles of a face, `[along, z]`, that meet no keep-out's inside.
fn clear(
    [[from, to], [bottom, top]]: [[f64; 2]; 2],
    keep_outs: &[[[f64; 2]; 2]],
) -> Vec<[[f64; 2]; 2]> {
    let borders = keep_outs.iter().flat_map(|[along, _]| *along);
    let on_face = borders.filter(|at| (from..=to).contains(at));
    let mut cuts: Vec<f64> = on_face.chain([from, to]).collect();
    cuts.sort_by(f64::total_cmp);
    let mut all: Vec<[[f64; 2]; 2]> = Vec::new();
    for (k, a) in cuts.iter().enumerate() {
        for b in &cuts[k + 1..] {
            let over = |[[w, x], _]: &&[[f64; 2]; 2]| {
                if a < b {
                    w < b && a < x
                } else {
                    w < a && a < x
                }
            };
            let mut blocked: Vec<[f64; 2]> =
                keep_outs.iter().filter(over).map(|[_, z]| *z).collect();
            blocked.sort_by(|a, b| a[0].total_cmp(&b[0]));
            let mut low = bottom;
            for [lo, hi] in blocked.into_iter().chain([[top, top]]) {
                if low <= lo.min(top) {
                    all.push([[*a, *b], [low, lo.min(top)]]);
                }
                low = low.max(hi);
            }
        }
    }
    let within = |a: &[[f64; 2]; 2], b: &[[f64; 2]; 2]| {
        (0..2).all(|k| b[k][0] <= a[k][0] && a[k][1] <= b[k][1])
    };
    let mut largest: Vec<[[f64; 2]; 2]> = Vec::new();
    for one in all {
        if !largest.iter().any(|other| within(&one, other)) {
            largest.retain(|other| !within(other, &one));
            largest.push(one);
        }
    }
    largest
}

#[cfg(test)]
mod tests;
