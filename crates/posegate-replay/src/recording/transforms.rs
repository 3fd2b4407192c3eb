//! Transforms of `/tf`: the pose of the robot in the world, composed of two of them as tf2 does.
//!
//! A localization publishes the transform from the world frame to the odometry's frame (map to odom), the odometry
//! that from its frame to the robot (odom to base_link). The pose at a time needs both. Like tf2's lookup at time 0,
//! the composition is at the *latest common time*: the older one of the two newest stamps. If one of the transforms
//! is no longer published, this time does not advance, so a gate gets no new estimates. A localization without odometry publishes the
//! transform from the world frame to the robot.

use super::body::BASES;
use std::collections::VecDeque;

/// Transforms are kept for this time, as in tf2, nanoseconds.
const KEPT_NS: i64 = 10_000_000_000;
/// The most transforms of one edge that are kept.
const MOST_KEPT: usize = 1 << 14;

/// The names of the frames.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FrameNames {
    /// The world frame.
    pub world: String,
    /// The odometry's frame.
    pub odometry: String,
    /// The robot's frame; `None` selects the first child of the odometry's frame that is `base_link` or
    /// `base_footprint`.
    pub base: Option<String>,
}

impl Default for FrameNames {
    fn default() -> Self {
        Self {
            world: "map".into(),
            odometry: "odom".into(),
            base: None,
        }
    }
}

/// A transform as recorded: the pose of the child frame in the parent frame. Its numbers are unchecked: any bits.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Transform {
    /// Nanoseconds.
    pub stamp_ns: i64,
    pub parent: String,
    pub child: String,
    pub pose: Pose,
}

/// Metres, and the quaternion x, y, z, w.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Pose {
    pub position: [f64; 3],
    pub orientation: [f64; 4],
}

impl Pose {
    /// The parent frame itself.
    pub const NONE: Self = Self {
        position: [0.0; 3],
        orientation: [0.0, 0.0, 0.0, 1.0],
    };

    /// Returns the pose of the parent in the child.
    pub fn inverse(&self) -> Self {
        let [a, b, c, d] = self.orientation;
        let orientation = [-a, -b, -c, d];
        Self {
            position: rotated(orientation, self.position).map(|part| -part),
            orientation,
        }
    }

    /// Converts a pose in `self` to a pose in the parent of `self`.
    pub fn of(&self, inner: &Self) -> Self {
        let [x, y, z] = rotated(self.orientation, inner.position);
        let [a, b, c] = self.position;
        Self {
            position: [a + x, b + y, c + z],
            orientation: product(self.orientation, inner.orientation),
        }
    }

    /// Returns the pose at a share of the path to another pose. The length of the quaternion is interpolated too, so
    /// a quaternion that is not a unit quaternion remains detectable.
    fn towards(&self, other: &Self, share: f64) -> Self {
        let part = |a: f64, b: f64| a + share * (b - a);
        let [p, q] = [self.orientation, other.orientation];
        let lengths = [p, q].map(length);
        let dot: f64 = p.iter().zip(q).map(|(a, b)| a * b).sum::<f64>() / (lengths[0] * lengths[1]);
        // The shorter arc.
        let sign = if dot < 0.0 { -1.0 } else { 1.0 };
        let angle = libm::acos((sign * dot).clamp(-1.0, 1.0));
        let [from, to] = if angle < 1e-6 {
            [1.0 - share, share]
        } else {
            let all = libm::sin(angle);
            [
                libm::sin((1.0 - share) * angle) / all,
                libm::sin(share * angle) / all,
            ]
        };
        let size = part(lengths[0], lengths[1]);
        let orientation = core::array::from_fn(|k| {
            let (a, b) = (p.get(k).copied(), q.get(k).copied());
            let (a, b) = (a.unwrap_or(0.0) / lengths[0], b.unwrap_or(0.0) / lengths[1]);
            size * (from * a + to * sign * b)
        });
        let [a, b] = [self.position, other.position];
        Self {
            position: [part(a[0], b[0]), part(a[1], b[1]), part(a[2], b[2])],
            orientation,
        }
    }
}

fn length(q: [f64; 4]) -> f64 {
    libm::sqrt(q.iter().map(|entry| entry * entry).sum())
}

/// The product of two quaternions x, y, z, w.
fn product([a, b, c, d]: [f64; 4], [x, y, z, w]: [f64; 4]) -> [f64; 4] {
    [
        d * x + a * w + b * z - c * y,
        d * y - a * z + b * w + c * x,
        d * z + a * y - b * x + c * w,
        d * w - a * x - b * y - c * z,
    ]
}

/// A point turned by the unit quaternion along `q`.
fn rotated(q: [f64; 4], [x, y, z]: [f64; 3]) -> [f64; 3] {
    let unit = q.map(|entry| entry / length(q));
    let [a, b, c, d] = unit;
    let [x, y, z, _] = product(product(unit, [x, y, z, 0.0]), [-a, -b, -c, d]);
    [x, y, z]
}

/// The transforms of one edge in the order of their stamps.
#[derive(Clone, Debug, Default)]
struct Edge {
    kept: VecDeque<(i64, Pose)>,
}

impl Edge {
    fn newest_ns(&self) -> Option<i64> {
        self.kept.back().map(|(stamp, _)| *stamp)
    }

    /// Adds a transform. A transform that is not newer than all before is ignored.
    fn push(&mut self, stamp_ns: i64, pose: Pose) {
        if self.newest_ns().is_some_and(|newest| stamp_ns <= newest) {
            return;
        }
        let oldest = stamp_ns.saturating_sub(KEPT_NS);
        while self.kept.len() >= MOST_KEPT
            || self.kept.front().is_some_and(|(stamp, _)| *stamp < oldest)
        {
            self.kept.pop_front();
        }
        self.kept.push_back((stamp_ns, pose));
    }

    /// Returns the pose at a time, interpolated between its neighbours. `None` if the time is before the first or after the last.
    fn at(&self, time_ns: i64) -> Option<Pose> {
        let after = self.kept.partition_point(|(stamp, _)| *stamp < time_ns);
        let (later, next) = self.kept.get(after)?;
        if *later == time_ns {
            return Some(*next);
        }
        let (earlier, pose) = self.kept.get(after.checked_sub(1)?)?;
        let share = time_ns.saturating_sub(*earlier) as f64 / later.saturating_sub(*earlier) as f64;
        Some(pose.towards(next, share))
    }
}

/// Composes the poses of the robot.
#[derive(Clone, Debug, Default)]
pub(super) struct Composer {
    names: FrameNames,
    correction: Edge,
    odometry: Edge,
    given_ns: Option<i64>,
}

impl Composer {
    pub fn new(names: FrameNames) -> Self {
        Self {
            names,
            ..Self::default()
        }
    }

    /// Returns the world frame's name.
    pub fn world(&self) -> &str {
        &self.names.world
    }

    /// Returns the name of the robot's frame; `None` if none was named and none was found.
    pub fn base(&self) -> Option<&str> {
        self.names.base.as_deref()
    }

    /// Returns `true` if a transform is that of the odometry.
    pub fn is_odometry(&mut self, transform: &Transform) -> bool {
        is_same(&transform.parent, &self.names.odometry) && self.is_base(&transform.child)
    }

    /// Returns `true` if a frame is the robot's. The first one that may be it is, if none was named.
    fn is_base(&mut self, frame: &str) -> bool {
        if self.names.base.is_none() {
            let found = BASES.into_iter().find(|base| is_same(base, frame));
            self.names.base = found.map(Into::into);
        }
        let base = self.names.base.as_ref();
        base.is_some_and(|base| is_same(base, frame))
    }

    /// Adds a transform. Returns the pose in the world and its time if it is newer than the one before.
    pub fn add(&mut self, transform: &Transform) -> Option<(i64, Pose)> {
        if self.is_odometry(transform) {
            self.odometry.push(transform.stamp_ns, transform.pose);
        } else if is_same(&transform.parent, &self.names.world)
            && is_same(&transform.child, &self.names.odometry)
        {
            self.correction.push(transform.stamp_ns, transform.pose);
        } else if is_same(&transform.parent, &self.names.world)
            && self.odometry.newest_ns().is_none()
            && self.is_base(&transform.child)
        {
            // A localization without odometry publishes the pose itself.
            let (stamp_ns, pose) = (transform.stamp_ns, transform.pose);
            let is_newer = self.given_ns.is_none_or(|given| stamp_ns > given);
            return is_newer.then(|| {
                self.given_ns = Some(stamp_ns);
                (stamp_ns, pose)
            });
        } else {
            return None;
        }
        let common = self.correction.newest_ns()?.min(self.odometry.newest_ns()?);
        if self.given_ns.is_some_and(|given| common <= given) {
            return None;
        }
        let pose = self.correction.at(common)?.of(&self.odometry.at(common)?);
        self.given_ns = Some(common);
        Some((common, pose))
    }
}

/// Returns `true` if two names are those of one frame: tf2 ignores a slash before them.
fn is_same(a: &str, b: &str) -> bool {
    a.trim_start_matches('/') == b.trim_start_matches('/')
}

#[cfg(test)]
mod tests;
