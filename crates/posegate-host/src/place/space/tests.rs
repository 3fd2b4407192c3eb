use super::*;

fn wall(keep_outs: &[[[f64; 2]; 2]]) -> Wall {
    Wall {
        name: "north".into(),
        corners: std::vec![[0.0, 5.0], [4.0, 5.0]],
        z: [0.0, 2.0],
        keep_outs: keep_outs.to_vec(),
    }
}

#[test]
fn tag_is_flat_on_the_wall() {
    let space = Space::wall(&wall(&[]), [0.4, 1.25 * 0.4], [1.0, 0.0], None).unwrap();
    let first = space.pose(&[0.0, 0.0]).unwrap();
    assert_eq!(
        (first.x, first.y, first.z, first.yaw_deg),
        (0.25, 5.0, 0.25, -90.0)
    );
    let last = space.pose(&[1.0, 1.0]).unwrap();
    assert_eq!((last.x, last.z), (3.75, 1.75));
    // From behind, the normal is reversed.
    let behind = Space::wall(&wall(&[]), [0.4, 1.25 * 0.4], [1.0, 9.0], None).unwrap();
    assert_eq!(behind.pose(&[0.5, 0.5]).unwrap().yaw_deg, 90.0);
    assert_eq!(space.point(&last), [1.0, 1.0]);
}

#[test]
fn keep_outs_have_no_places() {
    let space = Space::wall(
        &wall(&[[[1.0, 2.0], [0.0, 2.0]]]),
        [0.4, 1.25 * 0.4],
        [1.0, 0.0],
        None,
    )
    .unwrap();
    for k in 0..=100 {
        let at = space.pose(&[f64::from(k) / 100.0, 0.5]);
        let x = 0.25 + 3.5 * f64::from(k) / 100.0;
        let free = x <= 0.75 || x >= 2.25;
        assert_eq!(at.is_ok(), free, "{x}");
    }
    let all = [[[0.6, 1.9], [0.0, 2.0]], [[1.9, 3.5], [0.0, 2.0]]];
    let error = Space::wall(&wall(&all), [0.6, 1.25 * 0.6], [1.0, 0.0], None).unwrap_err();
    assert!(
        error.to_string().contains("keep-outs leave none"),
        "{error}"
    );
    assert!(Space::wall(&wall(&all), [0.4, 1.25 * 0.4], [1.0, 0.0], None).is_ok());
    assert!(Space::wall(&wall(&[]), [1.7, 1.25 * 1.7], [1.0, 0.0], None).is_err());
}

#[test]
fn faces_of_blocks_point_outwards() {
    let block = Wall {
        corners: std::vec![[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0]],
        ..wall(&[])
    };
    let space = Space::wall(&block, [0.4, 1.25 * 0.4], [9.0, 9.0], None).unwrap();
    let mut seen = Vec::new();
    for k in 0..=20 {
        let pose = space.pose(&[f64::from(k) / 20.0, 0.5]).unwrap();
        let out = pose.yaw_deg.to_radians();
        let beyond = [pose.x + 0.1 * libm::cos(out), pose.y + 0.1 * libm::sin(out)];
        let inside = beyond[0] > 0.0 && beyond[0] < 2.0 && beyond[1] > 0.0 && beyond[1] < 1.0;
        assert!(!inside, "{pose:?}");
        if !seen.contains(&pose.yaw_deg) {
            seen.push(pose.yaw_deg);
        }
        let again = space.pose(&space.point(&pose)).unwrap();
        assert!((again.x - pose.x).abs() + (again.y - pose.y).abs() < 1e-9);
    }
    assert_eq!(seen.len(), 4);
}

#[test]
fn ranges_are_checked() {
    let pose = Pose3Deg {
        x: 1.0,
        y: 2.0,
        z: 0.5,
        roll_deg: 0.0,
        pitch_deg: -90.0,
        yaw_deg: 10.0,
    };
    let space = Space::free(
        pose,
        [Some([0.0, 4.0]), None, Some([1.0, 1.0]), Some([0.0, 360.0])],
    )
    .unwrap();
    assert_eq!(space.dimensions(), 2);
    assert!(!space.is_periodic(0) && space.is_periodic(1));
    let at = space.pose(&[0.25, 0.5]).unwrap();
    assert_eq!(
        (at.x, at.y, at.z, at.yaw_deg, at.pitch_deg),
        (1.0, 2.0, 1.0, 180.0, -90.0)
    );
    assert_eq!(space.point(&at), [0.25, 0.5]);
    for (ranges, what) in [
        (
            [Some([1.0, 0.0]), None, None, None],
            "the range of x is 1:0",
        ),
        (
            [None, None, None, Some([0.0, 361.0])],
            "no more than a turn",
        ),
        ([None, Some([f64::NAN, 0.0]), None, None], "the range of y"),
        ([None, None, None, None], "nothing is free"),
        ([Some([1.0, 1.0]), None, None, None], "nothing is free"),
    ] {
        let error = Space::free(pose, ranges).unwrap_err();
        assert!(error.to_string().contains(what), "{error}");
    }
}
