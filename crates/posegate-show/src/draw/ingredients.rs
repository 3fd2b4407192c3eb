//! The drawable parts of a success set: views, outlines, regions, obstacles.

use posegate::shape::{Exclusion, Planar, Pose3Deg, PoseDeg, Shape, Visibility, rotation};

/// The drawable parts of a success set.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Ingredients {
    /// Views of cameras.
    pub views: Vec<Visibility>,
    /// Outlines of the robot (robot frame).
    pub outlines: Vec<Vec<[f64; 2]>>,
    /// Regions (goal frame).
    pub regions: Vec<Vec<[f64; 2]>>,
    /// Obstacles (goal frame).
    pub obstacles: Vec<Vec<[f64; 2]>>,
}

impl Ingredients {
    /// Collects the parts of a set, each once.
    #[must_use]
    pub fn of(shape: &Shape) -> Self {
        let mut found = Self::default();
        found.collect(shape);
        found
    }

    fn collect(&mut self, shape: &Shape) {
        match shape {
            Shape::Box(_) | Shape::Apart(_) => {}
            Shape::Visibility(view) | Shape::Bounded { view, .. } => add(&mut self.views, *view),
            Shape::Footprint(set) => {
                add(&mut self.outlines, set.footprint().to_vec());
                add(&mut self.regions, set.region().to_vec());
            }
            Shape::Any(sets) | Shape::All(sets) => sets.iter().for_each(|set| self.collect(set)),
        }
        if let Shape::Apart(Exclusion::Obstacle(set) | Exclusion::Gap { clear: set, .. }) = shape {
            add(&mut self.outlines, set.footprint().to_vec());
            add(&mut self.obstacles, set.obstacle().to_vec());
        }
    }
}

fn add<T: PartialEq>(known: &mut Vec<T>, new: T) {
    if !known.contains(&new) {
        known.push(new);
    }
}

/// Returns the transformation from the frame of a pose on the floor to the world.
#[must_use]
pub fn frame([x, y, yaw]: [f64; 3]) -> Planar<f64> {
    let (cos, sin) = (libm::cos(yaw), libm::sin(yaw));
    Planar { x, y, cos, sin }
}

/// Converts a pose to metres and radians.
#[must_use]
pub fn radians(pose: PoseDeg) -> [f64; 3] {
    [pose.x, pose.y, pose.yaw_deg.to_radians()]
}

/// Returns the point ahead of a pose on the floor (m, m, rad) at a distance, metres.
#[must_use]
pub fn ahead([x, y, yaw]: [f64; 3], distance: f64) -> [f64; 2] {
    [x + distance * libm::cos(yaw), y + distance * libm::sin(yaw)]
}

/// Returns the axes of a pose in space: forward (x, a tag's normal), left (y) and up (z), in the frame of
/// the pose.
#[must_use]
pub fn axes(pose: &Pose3Deg) -> [[f64; 3]; 3] {
    let rows: [[f64; 3]; 3] = rotation(pose.roll_deg, pose.pitch_deg, pose.yaw_deg);
    [0, 1, 2].map(|axis| rows.map(|row| row[axis]))
}

/// A camera in the world: its centre, and its axes forward, left and up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Eye {
    /// The centre, metres.
    pub centre: [f64; 3],
    /// The axes, unit vectors.
    pub axes: [[f64; 3]; 3],
}

impl Eye {
    /// Returns the camera of a robot at a pose: m, m, rad.
    #[must_use]
    pub fn of(mount: &Pose3Deg, robot: [f64; 3]) -> Self {
        let place = frame(robot);
        let turn = frame([0.0, 0.0, robot[2]]);
        let [x, y] = place.to_goal([mount.x, mount.y]);
        Self {
            centre: [x, y, mount.z],
            axes: axes(mount).map(|[ax, ay, az]| {
                let [x, y] = turn.to_goal([ax, ay]);
                [x, y, az]
            }),
        }
    }

    /// Converts a point of the world to the camera's frame: forward, left, up.
    #[must_use]
    pub fn sees(&self, point: [f64; 3]) -> [f64; 3] {
        let offset = [0, 1, 2].map(|i| point[i] - self.centre[i]);
        self.axes
            .map(|axis| axis[0] * offset[0] + axis[1] * offset[1] + axis[2] * offset[2])
    }
}

/// Returns a tag's corners in the world, in AprilTag's order.
#[must_use]
pub fn corners(tag: &posegate::shape::Tag) -> [[f64; 3]; 4] {
    let [_, across, up] = axes(&tag.pose);
    let half = 0.5 * tag.size;
    let pose = [tag.pose.x, tag.pose.y, tag.pose.z];
    [(-half, -half), (half, -half), (half, half), (-half, half)]
        .map(|(y, z)| [0, 1, 2].map(|i| pose[i] + y * across[i] + z * up[i]))
}

/// Returns a direction's heading and elevation, degrees, rounded to 1e-6, so that 180 in the site file is 180 here.
#[must_use]
pub fn heading([x, y, z]: [f64; 3]) -> [f64; 2] {
    let heading = libm::atan2(y, x).to_degrees();
    let rise = libm::atan2(z, libm::hypot(x, y)).to_degrees();
    let [heading, rise] = [heading, rise].map(|deg| libm::round(deg * 1e6) * 1e-6 + 0.0);
    [if heading <= -180.0 { 180.0 } else { heading }, rise]
}
