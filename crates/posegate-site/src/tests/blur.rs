//! Views with a blur limit, checked against images of the turning robot.

use super::{FILE, Site};
use posegate::shape::Camera;

/// A robot that turns about its centre, with a tag 3 m ahead of it.
fn site(camera: &str, phi_max_deg: f64) -> String {
    format!(
        r#"[camera.front]
width_px = 640
height_px = 480
fx = 400.0
fy = 400.0
cx = 320.0
cy = 240.0
mount = {{ x = 0.25, y = 0.0, z = 0.5, roll_deg = 0.0, pitch_deg = 0.0, yaw_deg = 0.0 }}
{camera}

[tag.t7]
id = 7
family = "tag36h11"
size = 0.1
pose = {{ x = 3.0, y = 0.0, z = 0.5, roll_deg = 0.0, pitch_deg = 0.0, yaw_deg = 180.0 }}

[task.see]
kind = "localization"
goal = {{ x = 0.0, y = 0.0, yaw_deg = 0.0 }}
success = {{ shape = "visibility", camera = "front", tag = "t7", d_max = 4.0, phi_max_deg = {phi_max_deg}, psi_max_deg = 70.0, blur = {{ yaw_rate_deg_s = 40.0, exposure_s = 0.004, px_max = 1.5 }} }}
error_bound = {{ translation = 0.05, yaw_deg = 2.0 }}
"#
    )
}

/// Returns the image of the tag's centre at a pose, pixels, for a camera that is off its mount by `off`.
fn image(camera: &Camera, off: [f64; 2], [x, y, yaw]: [f64; 3]) -> [f64; 2] {
    let (sin, cos) = yaw.sin_cos();
    let (dx, dy) = (3.0 - x, -y);
    let depth = cos * dx + sin * dy - 0.25 - off[0];
    let left = cos * dy - sin * dx - off[1];
    camera.project([-left / depth, 0.0])
}

/// Returns the largest blur of the tag at any pose of the set, pixels: for every extreme of the mount's tolerance,
/// with the calibration's focal length times a factor.
fn most_blurred(keys: &str, phi_max_deg: f64, off_by: f64, focal: f64) -> f64 {
    let site = Site::parse(&site(keys, phi_max_deg), FILE).expect("a site");
    let camera = site.cameras["front"].camera;
    let set = &site.task("see").expect("a task").success;
    // The rotation during the exposure.
    let turn = 40.0f64.to_radians() * 0.004;
    let mut most = 0.0f64;
    for (x, y, yaw) in (0..40).flat_map(|x| {
        (0..21)
            .flat_map(move |y| (0..41).map(move |yaw| (f64::from(x), f64::from(y), f64::from(yaw))))
    }) {
        let pose = [-0.5 + 0.08 * x, -1.0 + 0.1 * y, 0.03 * (yaw - 20.0)];
        if !set.membership(pose).inside {
            continue;
        }
        for off in [[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]] {
            let off = off.map(|share: f64| share * off_by);
            let ends = [0.5, -0.5]
                .map(|way| image(&camera, off, [pose[0], pose[1], pose[2] + way * turn]));
            most = most.max((ends[0][0] - ends[1][0]).hypot(ends[0][1] - ends[1][1]));
        }
    }
    most *= focal;
    assert!(most > 0.5, "the set is empty, or nothing turns: {most}");
    most
}

#[test]
fn tag_blur_is_within_the_limit() {
    let most = most_blurred("", 40.0, 0.0, 1.0);
    assert!(most <= 1.5 && most > 1.4, "{most}");
}

/// A lens that magnifies off the axis blurs more than a pinhole.
#[test]
fn tag_blur_with_a_lens_is_within_the_limit() {
    for coefficients in [
        "[0.3, 0.05, 0.0, 0.0, 0.0]",
        "[-0.25, 0.06, 0.0, 0.02, 0.0]",
    ] {
        let keys = format!(
            "distortion = {{ model = \"plumb_bob\", coefficients = {coefficients} }}\nimage = \"raw\""
        );
        let most = most_blurred(&keys, 40.0, 0.0, 1.0);
        assert!(most <= 1.5, "{coefficients}: {most}");
    }
}

/// A camera farther from the robot's centre than stated moves faster.
#[test]
fn tag_blur_with_mount_error_is_within_the_limit() {
    let keys = "mount_tolerance = { translation = 0.2, angle_deg = 0.0 }";
    let most = most_blurred(keys, 20.0, 0.2, 1.0);
    assert!(most <= 1.5, "{most}");
}

/// A focal length above the calibration's also blurs more.
#[test]
fn tag_blur_with_focal_error_is_within_the_limit() {
    let keys = "tolerance = { focal = 0.05, centre_px = 0.0 }";
    let most = most_blurred(keys, 40.0, 0.0, 1.05);
    assert!(most <= 1.5 && most > 1.4, "{most}");
}
