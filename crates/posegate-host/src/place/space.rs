//! The search space of a tag's pose.

use posegate::shape::{Pose3Deg, Wall};

/// The poses at which a tag may be mounted, as the unit cube that a search explores.
#[derive(Clone, Debug)]
pub enum Space {
    /// Anywhere in a box.
    Free {
        /// The tag's present pose: coordinates without a range keep its values, and roll and pitch always do.
        pose: Pose3Deg,
        /// Ranges of x, y, z (metres) and yaw (degrees, an arc).
        ranges: [Option<[f64; 2]>; 4],
    },
    /// Flat on a wall, or on the faces of a block.
    Wall(Faces),
}

/// The faces of a wall on which a tag may be mounted.
#[derive(Clone, Debug)]
pub struct Faces {
    name: String,
    faces: Vec<Face>,
    /// Heights of the tag's centre, metres.
    z: [f64; 2],
    /// Keep-outs, widened by half of the tag's width.
    keep_outs: Vec<[[f64; 2]; 2]>,
}

/// A face of a wall: the usable interval along the wall, the point where it begins, its direction, and the heading of
/// its normal.
#[derive(Clone, Copy, Debug)]
struct Face {
    along: [f64; 2],
    from: [f64; 2],
    direction: [f64; 2],
    yaw_deg: f64,
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
    /// Creates a box about a pose.
    ///
    /// # Errors
    /// [`SpaceError::Range`] if a range is invalid, [`SpaceError::NothingFree`] if no range has a length.
    pub fn free(pose: Pose3Deg, ranges: [Option<[f64; 2]>; 4]) -> Result<Self, SpaceError> {
        for (name, range) in ["x", "y", "z", "yaw_deg"].into_iter().zip(ranges) {
            let Some([lo, hi]) = range else { continue };
            let widest = if name == "yaw_deg" { 360.0 } else { f64::MAX };
            if !(lo.is_finite() && hi.is_finite() && lo <= hi && hi - lo <= widest) {
                return Err(SpaceError::Range { name, lo, hi });
            }
        }
        let space = Self::Free { pose, ranges };
        if space.dimensions() == 0 {
            return Err(SpaceError::NothingFree);
        }
        Ok(space)
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
        let count = wall.corners.len();
        let sides = if count == 2 { 1 } else { count };
        let mut faces = Vec::new();
        let mut begin = 0.0;
        for i in 0..sides {
            let (a, b) = (wall.corners[i], wall.corners[(i + 1) % count]);
            let direction = [b[0] - a[0], b[1] - a[1]];
            let length = libm::hypot(direction[0], direction[1]);
            let along = [begin + half, begin + length - half];
            begin += length;
            if !(along[0] <= along[1]) {
                continue;
            }
            let direction = direction.map(|v| v / length);
            // The outside of an outline with counter-clockwise corners is to the right.
            let mut normal = [direction[1], -direction[0]];
            let to = [front[0] - a[0], front[1] - a[1]];
            if count == 2 && normal[0] * to[0] + normal[1] * to[1] < 0.0 {
                normal = normal.map(|v| -v);
            }
            faces.push(Face {
                along,
                from: [a[0] + half * direction[0], a[1] + half * direction[1]],
                direction,
                yaw_deg: libm::atan2(normal[1], normal[0]).to_degrees(),
            });
        }
        if faces.is_empty() {
            return Err(no_space(format!("it is {begin} m long")));
        }
        let widened =
            |[along, z]: &[[f64; 2]; 2]| [*along, *z].map(|[lo, hi]| [lo - half, hi + half]);
        let faces = Faces {
            name: wall.name.clone(),
            faces,
            z: [low, high],
            keep_outs: wall.keep_outs.iter().map(widened).collect(),
        };
        if !faces.has_place() {
            return Err(no_space("its keep-outs leave none".into()));
        }
        Ok(Self::Wall(faces))
    }

    /// Returns the number of coordinates of a place.
    #[must_use]
    pub fn dimensions(&self) -> usize {
        match self {
            Self::Free { ranges, .. } => ranges.iter().flatten().filter(|[lo, hi]| hi > lo).count(),
            Self::Wall(faces) => 1 + usize::from(faces.z[1] > faces.z[0]),
        }
    }

    /// Returns `true` if a coordinate is periodic: its 0 and its 1 are the same place.
    #[must_use]
    pub fn is_periodic(&self, number: usize) -> bool {
        match self {
            Self::Free { ranges, .. } => {
                let mut free = ranges
                    .iter()
                    .enumerate()
                    .filter(|(_, range)| range.is_some_and(|[lo, hi]| hi > lo));
                free.nth(number).is_some_and(|(axis, range)| {
                    axis == 3 && range.is_some_and(|[lo, hi]| hi - lo >= 360.0)
                })
            }
            Self::Wall(_) => false,
        }
    }

    /// Returns the pose at a point of the unit cube. If no tag may be mounted there, returns the depth in the keep-out,
    /// in metres, as the error.
    pub fn pose(&self, point: &[f64]) -> Result<Pose3Deg, f64> {
        let mut numbers = point.iter().copied();
        let mut between = |[lo, hi]: [f64; 2]| match hi > lo {
            true => lo + (hi - lo) * numbers.next().unwrap_or(0.5).clamp(0.0, 1.0),
            false => lo,
        };
        match self {
            Self::Free { pose, ranges } => {
                let own = [pose.x, pose.y, pose.z, pose.yaw_deg];
                let mut at = own;
                for (at, range) in at.iter_mut().zip(ranges) {
                    *at = range.map_or(*at, &mut between);
                }
                let [x, y, z, yaw_deg] = at;
                Ok(Pose3Deg {
                    x,
                    y,
                    z,
                    yaw_deg,
                    ..*pose
                })
            }
            Self::Wall(faces) => {
                let whole = faces.length();
                let along = between([0.0, 1.0]) * whole;
                let z = between(faces.z);
                faces.at(along, z)
            }
        }
    }

    /// Returns the point of the unit cube whose pose is nearest to the given one.
    #[must_use]
    pub fn point(&self, pose: &Pose3Deg) -> Vec<f64> {
        let share = |value: f64, [lo, hi]: [f64; 2]| ((value - lo) / (hi - lo)).clamp(0.0, 1.0);
        match self {
            Self::Free { ranges, .. } => {
                let own = [pose.x, pose.y, pose.z, pose.yaw_deg];
                let free = own.into_iter().zip(ranges).enumerate();
                free.filter_map(|(axis, (value, range))| {
                    let [lo, hi] = (*range)?;
                    let value = if axis == 3 {
                        lo + libm::fmod(libm::fmod(value - lo, 360.0) + 360.0, 360.0)
                    } else {
                        value
                    };
                    (hi > lo).then(|| share(value, [lo, hi]))
                })
                .collect()
            }
            Self::Wall(faces) => {
                let mut before = 0.0;
                let mut best = (f64::INFINITY, 0.0);
                for face in &faces.faces {
                    let length = face.along[1] - face.along[0];
                    let to = [pose.x - face.from[0], pose.y - face.from[1]];
                    let along =
                        (to[0] * face.direction[0] + to[1] * face.direction[1]).clamp(0.0, length);
                    let off = libm::hypot(
                        to[0] - along * face.direction[0],
                        to[1] - along * face.direction[1],
                    );
                    if off < best.0 {
                        best = (off, before + along);
                    }
                    before += length;
                }
                let mut point = std::vec![best.1 / before.max(f64::MIN_POSITIVE)];
                if faces.z[1] > faces.z[0] {
                    point.push(share(pose.z, faces.z));
                }
                point
            }
        }
    }

    /// Returns about `count` points of the unit cube in rows and columns: over each part of a wall without a
    /// keep-out, up to its borders, or over each free coordinate.
    #[must_use]
    pub fn grid(&self, count: usize) -> Vec<Vec<f64>> {
        let spread = |number: usize, [lo, hi]: [f64; 2]| -> Vec<f64> {
            let last = number.saturating_sub(1).max(1) as f64;
            let at = |k: usize| lo + (hi - lo) * (k as f64 / last);
            (0..number.max(1)).map(at).collect()
        };
        let axes = match self {
            Self::Free { .. } => {
                let count = count.max(1) as f64;
                let each = libm::floor(libm::pow(count, 1.0 / self.dimensions() as f64) + 1e-9);
                let each = (each as usize).max(2);
                // In the middle of each cell.
                let half = 0.5 / each as f64;
                (0..self.dimensions())
                    .map(|_| spread(each, [half, 1.0 - half]))
                    .collect()
            }
            Self::Wall(faces) => faces.grid(count),
        };
        axes.into_iter()
            .fold(std::vec![Vec::new()], |points: Vec<Vec<f64>>, axis| {
                let with = |point: &Vec<f64>| {
                    let longer = |at: &f64| point.iter().copied().chain([*at]).collect();
                    axis.iter().map(longer).collect::<Vec<Vec<f64>>>()
                };
                points.iter().flat_map(with).collect()
            })
    }

    /// Returns a description of the space.
    #[must_use]
    pub fn name(&self) -> String {
        match self {
            Self::Free { ranges, .. } => {
                let named = ["x", "y", "z", "yaw_deg"].into_iter().zip(ranges);
                let words = named.filter_map(|(name, range)| {
                    let [lo, hi] = (*range)?;
                    Some(format!("{name}={lo}:{hi}"))
                });
                words.collect::<Vec<_>>().join(",")
            }
            Self::Wall(faces) => format!("wall {}", faces.name),
        }
    }
}

impl Faces {
    /// Returns the rows and columns of a grid: evenly spread, and at the borders of keep-outs.
    fn grid(&self, count: usize) -> Vec<Vec<f64>> {
        /// One in this number of points of a grid on a wall is a height.
        const HEIGHTS: usize = 9;
        let whole = self.length().max(f64::MIN_POSITIVE);
        let is_flat = self.z[1] <= self.z[0];
        let columns = if is_flat { count } else { count / HEIGHTS };
        let evenly = |count: usize| {
            let last = count.saturating_sub(1).max(1) as f64;
            (0..count.max(2)).map(move |k| (k as f64 / last).min(1.0))
        };
        let mut along: Vec<f64> = evenly(columns).collect();
        let mut heights: Vec<f64> = evenly(HEIGHTS).collect();
        let mut before = 0.0;
        for face in &self.faces {
            for [[from, to], [low, high]] in &self.keep_outs {
                let at = |v: &f64| (before + v - face.along[0]) / whole;
                let on_face = |v: &&f64| (face.along[0]..=face.along[1]).contains(*v);
                along.extend([from, to].into_iter().filter(on_face).map(at));
                let share = |v: &f64| (v - self.z[0]) / (self.z[1] - self.z[0]);
                heights.extend([low, high].into_iter().map(share));
            }
            before += face.along[1] - face.along[0];
        }
        let mut axes = std::vec![along, heights];
        axes.truncate(if is_flat { 1 } else { 2 });
        for axis in &mut axes {
            axis.retain(|at| (0.0..=1.0).contains(at));
            axis.sort_by(f64::total_cmp);
            axis.dedup();
        }
        axes
    }

    fn length(&self) -> f64 {
        self.faces
            .iter()
            .map(|face| face.along[1] - face.along[0])
            .sum()
    }

    fn at(&self, along: f64, z: f64) -> Result<Pose3Deg, f64> {
        let mut left = along;
        let mut faces = self.faces.iter().peekable();
        while let Some(face) = faces.next() {
            let length = face.along[1] - face.along[0];
            if left > length && faces.peek().is_some() {
                left -= length;
                continue;
            }
            let left = left.min(length);
            let place = face.along[0] + left;
            let depth =
                |[[a, b], [c, d]]: &[[f64; 2]; 2]| (place - a).min(b - place).min(z - c).min(d - z);
            let deepest = self.keep_outs.iter().map(depth).fold(0.0, f64::max);
            if deepest > 0.0 {
                return Err(deepest);
            }
            return Ok(Pose3Deg {
                x: face.from[0] + left * face.direction[0],
                y: face.from[1] + left * face.direction[1],
                z,
                roll_deg: 0.0,
                pitch_deg: 0.0,
                yaw_deg: face.yaw_deg,
            });
        }
        Err(f64::INFINITY)
    }

    /// Returns `true` if some place is outside of every keep-out. If there is any, there is one at their borders.
    fn has_place(&self) -> bool {
        let ends = |axis: usize, own: [f64; 2]| {
            let borders = self.keep_outs.iter().flat_map(move |out| out[axis]);
            let inner = borders.filter(move |v| *v >= own[0] && *v <= own[1]);
            inner.chain(own).collect::<Vec<f64>>()
        };
        let mut before = 0.0;
        self.faces.iter().any(|face| {
            let start = before;
            before += face.along[1] - face.along[0];
            ends(0, face.along).iter().any(|place| {
                let along = start + place - face.along[0];
                ends(1, self.z).iter().any(|z| self.at(along, *z).is_ok())
            })
        })
    }
}

#[cfg(test)]
mod tests;
