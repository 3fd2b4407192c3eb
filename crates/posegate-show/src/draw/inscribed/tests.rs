use super::*;
use posegate_site::{SAMPLE, Site};

fn of(task: &str, yaw_deg: Option<f64>) -> Option<(InscribedBox, SuccessSet)> {
    let site = Site::parse(SAMPLE, "site.toml").unwrap();
    let success = site.tasks[task].success.clone();
    Some((inscribed_box(&success, yaw_deg)?, success))
}

/// The largest box in a box is that box.
#[test]
fn largest_box_in_a_box_is_that_box() {
    let (found, _) = of("dock", None).unwrap();
    let near = |a: [f64; 2], b: [f64; 2], off: f64| {
        (a[0] - b[0]).abs() <= off && (a[1] - b[1]).abs() <= off
    };
    assert!(near(found.x, [-0.08, 0.08], 1.1e-4), "{found:?}");
    assert!(near(found.y, [-0.06, 0.06], 1.1e-4), "{found:?}");
    assert!(near(found.yaw_deg, [-4.0, 4.0], 0.011), "{found:?}");
}

/// Corners, faces and the centre are in the set by an independent code path. A box that is longer at a face is
/// not.
#[test]
fn poses_of_the_box_are_in_the_set_and_faces_touch_its_border() {
    for (task, yaw_deg) in [("park", None), ("see-t7", Some(2.0)), ("see-t7", None)] {
        let (found, success) = of(task, yaw_deg).unwrap();
        let goal = success.goal;
        let inside = |[x, y, yaw]: [f64; 3]| {
            let (sin, cos) = goal.yaw_deg.to_radians().sin_cos();
            let world = [
                goal.x + cos * x - sin * y,
                goal.y + sin * x + cos * y,
                (goal.yaw_deg + yaw).to_radians(),
            ];
            success.membership(world).inside
        };
        let along = |[lo, hi]: [f64; 2]| (0..=8).map(move |k| lo + (hi - lo) * f64::from(k) / 8.0);
        let all = |ends: [[f64; 2]; 3]| {
            let [x, y, yaw] = ends;
            along(x).all(|x| along(y).all(|y| along(yaw).all(|yaw| inside([x, y, yaw]))))
        };
        let ends = [found.x, found.y, found.yaw_deg];
        assert!(all(ends), "{task}: {found:?}");
        for axis in 0..2 {
            for side in [0, 1] {
                let mut longer = ends;
                longer[axis][side] += if side == 0 { -0.01 } else { 0.01 };
                assert!(
                    !all(longer),
                    "{task}: {found:?} may be longer at {axis} {side}"
                );
            }
        }
        if yaw_deg.is_some() {
            assert_eq!(found.yaw_deg, [-2.0, 2.0]);
        }
    }
}

#[test]
fn no_box_if_the_goal_is_outside() {
    assert_eq!(of("dock", Some(4.5)), None);
    let text = SAMPLE.replacen("x = [-0.08, 0.08]", "x = [0.02, 0.08]", 1);
    let site = Site::parse(&text, "site.toml").unwrap();
    assert_eq!(inscribed_box(&site.tasks["dock"].success, None), None);
}
