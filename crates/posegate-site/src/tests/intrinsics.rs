//! Calibrations with a tolerance: a permitted view is seen with every camera within the tolerance.

use super::{FILE, Site, fault};

fn site(camera: &str, view: &str) -> String {
    format!(
        r#"[camera.front]
width_px = 640
height_px = 480
fx = 400.0
fy = 410.0
cx = 350.0
cy = 230.0
mount = {{ x = 0.25, y = 0.0, z = 0.5, roll_deg = 0.0, pitch_deg = 0.0, yaw_deg = 0.0 }}
{camera}

[tag.t7]
id = 7
family = "tag36h11"
size = 0.3
pose = {{ x = 2.0, y = 0.0, z = 0.9, roll_deg = 0.0, pitch_deg = 0.0, yaw_deg = 180.0 }}

[task.see]
kind = "localization"
goal = {{ x = 0.0, y = 0.0, yaw_deg = 0.0 }}
success = {{ shape = "visibility", camera = "front", tag = "t7", d_max = 4.0, phi_max_deg = 60.0, psi_max_deg = 70.0{view} }}
error_bound = {{ translation = 0.05, yaw_deg = 2.0 }}
"#
    )
}

/// Returns the view at poses of the set: corners with the nominal calibration, and d and psi.
fn sights(site: &str) -> Vec<([[f64; 2]; 4], f64, f64)> {
    let site = Site::parse(site, FILE).expect("a site");
    let set = &site.task("see").expect("a task").success;
    let mut found = Vec::new();
    for (x, y, yaw) in (0..60).flat_map(|x| {
        (0..15)
            .flat_map(move |y| (0..61).map(move |yaw| (f64::from(x), f64::from(y), f64::from(yaw))))
    }) {
        let pose = [-1.5 + 0.05 * x, -0.7 + 0.1 * y, 0.025 * (yaw - 30.0)];
        let at = set.membership(pose);
        if at.inside {
            let sight = at.sight.expect("a view");
            let corners = sight.corners_px.map(|corner| corner.expect("in front"));
            found.push((corners, sight.d, sight.psi));
        }
    }
    assert!(found.len() > 100, "{}", found.len());
    found
}

#[test]
fn corners_are_in_the_image_within_the_tolerance() {
    for lens in [
        "",
        "image = \"raw\"\ndistortion = { model = \"plumb_bob\", coefficients = [-0.2, 0.05, 0.001, -0.001, 0.0] }",
    ] {
        for (focal, centre_px) in [(0.04, 0.0), (0.0, 12.0), (0.03, 5.0)] {
            for (border, view) in [("", ""), ("border_px = 4.0", ""), ("", ", border_px = 4.0")] {
                let tolerance =
                    format!("tolerance = {{ focal = {focal}, centre_px = {centre_px} }}");
                let keys = [lens, &tolerance, border].join("\n");
                let kept = if [border, view] == [""; 2] { 0.0 } else { 4.0 };
                let mut nearest = f64::INFINITY;
                for (corners, _, _) in sights(&site(&keys, view)) {
                    for ([u, v], direction, by) in corners.iter().flat_map(|corner| {
                        [-1.0, 1.0].into_iter().flat_map(move |direction| {
                            [-1.0, 1.0].map(move |by| (*corner, direction, by))
                        })
                    }) {
                        let off = |at: f64, axis: f64| {
                            at + direction * focal * (at - axis) + by * centre_px
                        };
                        let (u, v) = (off(u, 350.0), off(v, 230.0));
                        let within = u.min(640.0 - u).min(v).min(480.0 - v) - kept;
                        nearest = nearest.min(within);
                    }
                }
                // The border is not wider than needed, except on the sides nearer to the axis than the
                // farthest one.
                assert!((-1e-9..12.0).contains(&nearest), "{keys}: {nearest}");
            }
        }
    }
}

#[test]
fn bits_are_wide_enough_within_the_tolerance() {
    let keys = "tolerance = { focal = 0.1, centre_px = 0.0 }";
    let mut narrowest = f64::INFINITY;
    for (_, d, psi) in sights(&site(keys, ", px_per_bit_min = 6.0")) {
        narrowest = narrowest.min(0.9 * 400.0 * 0.3 / 8.0 * libm::cos(psi) / d);
    }
    assert!((6.0 - 1e-9..6.3).contains(&narrowest), "{narrowest}");
}

/// A rectified image is computed with the calibration, which may be wrong.
#[test]
fn rectified_images_are_refused() {
    let keys = "image = \"rect\"\ndistortion = { model = \"plumb_bob\", coefficients = [-0.2, 0.05, 0.0, 0.0, 0.0] }\n\
                tolerance = { focal = 0.01, centre_px = 0.0 }";
    let message = fault(&site(keys, "")).to_string();
    assert!(
        message.contains("`camera.front.tolerance` is supported only for raw images"),
        "{message}"
    );
    let wide = "tolerance = { focal = 0.4, centre_px = 200.0 }";
    assert!(
        fault(&site(wide, ""))
            .to_string()
            .contains("leaves nothing")
    );
    let negative = "tolerance = { focal = -0.1, centre_px = 0.0 }";
    assert!(
        fault(&site(negative, ""))
            .to_string()
            .contains("`camera.front.tolerance.focal` is -0.1")
    );
}
