//! Places that the camera at the goal sees: near them a search looks first.

use super::objective::Task;
use posegate::shape::{Pose3Deg, Scalar, Visibility, rotation};

/// Distances of the grid over the camera's view, as shares of the largest one.
const DISTANCES: [f64; 8] = [0.06, 0.1, 0.16, 0.24, 0.36, 0.52, 0.72, 0.95];
/// Angles to the left of the optical axis, as shares of the largest one.
const BEARINGS: [f64; 5] = [0.0, -0.45, 0.45, -0.9, 0.9];
/// Angles above the optical axis, as shares of the largest one.
const ELEVATIONS: [f64; 3] = [0.0, -0.5, 0.5];
/// Rotations of a tag away from the camera, as shares of the largest angle.
const TURNS: [f64; 3] = [0.0, -0.55, 0.55];

/// Returns poses of the tag all over the views of the cameras at the goal.
pub(super) fn guesses(task: &Task) -> Vec<Pose3Deg> {
    let views = task.set.views_of(&task.tag);
    views.iter().flat_map(|view| in_view(task, view)).collect()
}

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
