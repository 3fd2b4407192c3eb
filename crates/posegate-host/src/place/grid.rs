//! A coarse grid of places from which searches begin: the same for every seed.

use super::objective::Task;
use super::space::Space;
use posegate::shape::{Pose3Deg, Scalar, Visibility, rotation};

/// The number of places of the grid over the space itself.
const OF_SPACE: usize = 400;
/// Distances of the grid over the camera's view, as shares of the largest one.
const DISTANCES: [f64; 8] = [0.06, 0.1, 0.16, 0.24, 0.36, 0.52, 0.72, 0.95];
/// Angles to the left of the optical axis, as shares of the largest one.
const BEARINGS: [f64; 5] = [0.0, -0.45, 0.45, -0.9, 0.9];
/// Angles above the optical axis, as shares of the largest one.
const ELEVATIONS: [f64; 3] = [0.0, -0.5, 0.5];
/// Rotations of a tag away from the camera, as shares of the largest angle.
const TURNS: [f64; 3] = [0.0, -0.55, 0.55];
/// Points closer to each other than this, in the unit cube, count as one.
const SAME: f64 = 1e-3;

/// Returns at most `most` points of the unit cube of a space: a grid over each part of the space, and places that the
/// camera at the goal sees.
pub(super) fn grid(task: &Task, space: &Space, most: usize) -> Vec<Vec<f64>> {
    let mut points = space.grid(OF_SPACE.min(most / 2));
    let views = task.set.views_of(&task.tag);
    let seen: Vec<Pose3Deg> = views.iter().flat_map(|view| in_view(task, view)).collect();
    let mut kept: Vec<Vec<f64>> = Vec::new();
    for pose in &seen {
        let point = space.point(pose);
        let same = |other: &Vec<f64>| {
            let off = other.iter().zip(&point).map(|(a, b)| (a - b).abs());
            off.fold(0.0, f64::max) < SAME
        };
        if !kept.iter().any(same) {
            kept.push(point);
        }
    }
    let rest = most.saturating_sub(points.len()).max(1);
    let every = kept.len().div_ceil(rest).max(1);
    points.extend(kept.into_iter().step_by(every));
    points
}

/// Returns poses of the tag all over the view of the camera at the goal.
fn in_view(task: &Task, view: &Visibility) -> Vec<Pose3Deg> {
    let goal = task.set.goal;
    let mount = &view.mount;
    let axes: [[f64; 3]; 3] = rotation(mount.roll_deg, mount.pitch_deg, mount.yaw_deg);
    let [cos, sin] = f64::cos_sin_deg(goal.yaw_deg);
    let camera = &view.camera;
    let wide = libm::atan(0.5 * camera.width_px / camera.fx).to_degrees();
    let high = libm::atan(0.5 * camera.height_px / camera.fy).to_degrees();
    let [wide, high] = [wide, high].map(|angle| angle.min(view.phi_max_deg));
    let mut poses = Vec::new();
    for distance in DISTANCES {
        for bearing in BEARINGS {
            for elevation in ELEVATIONS {
                let [cb, sb] = f64::cos_sin_deg(bearing * wide);
                let [ce, se] = f64::cos_sin_deg(elevation * high);
                let far = distance * view.d_max;
                let ray = [far * ce * cb, far * ce * sb, far * se];
                let own = [mount.x, mount.y, mount.z];
                let at = [0, 1, 2].map(|i: usize| {
                    own[i] + axes[i][0] * ray[0] + axes[i][1] * ray[1] + axes[i][2] * ray[2]
                });
                let x = goal.x + cos * at[0] - sin * at[1];
                let y = goal.y + sin * at[0] + cos * at[1];
                let eye = [
                    goal.x + cos * own[0] - sin * own[1],
                    goal.y + sin * own[0] + cos * own[1],
                ];
                let back = libm::atan2(eye[1] - y, eye[0] - x).to_degrees();
                poses.extend(TURNS.map(|turn| Pose3Deg {
                    x,
                    y,
                    z: at[2],
                    yaw_deg: back + turn * view.psi_max_deg,
                    ..task.tag.pose
                }));
            }
        }
    }
    poses
}
