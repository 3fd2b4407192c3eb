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
    let [piece] = space.pieces() else {
        panic!("{space:?}")
    };
    let first = piece.pose(&[0.0, 0.0]);
    assert_eq!(
        (first.x, first.y, first.z, first.yaw_deg),
        (0.25, 5.0, 0.25, -90.0)
    );
    let last = piece.pose(&[1.0, 1.0]);
    assert_eq!((last.x, last.z), (3.75, 1.75));
    // From behind, the normal is reversed.
    let behind = Space::wall(&wall(&[]), [0.4, 1.25 * 0.4], [1.0, 9.0], None).unwrap();
    assert_eq!(behind.pieces()[0].pose(&[0.5, 0.5]).yaw_deg, 90.0);
    assert_eq!(piece.point(&last), [1.0, 1.0]);
    assert_eq!(space.nearest(&Pose3Deg { x: 9.0, ..last }), last);
}

/// Every place of a lattice is in a piece exactly if it is in no keep-out, and each piece ends at borders.
#[test]
fn pieces_are_all_places_without_a_keep_out() {
    let outs = [
        [[1.0, 2.0], [0.0, 1.2]],
        [[1.6, 2.6], [0.9, 1.6]],
        [[2.6, 3.1], [0.2, 0.4]],
        // Touches the one before: a tag may be between them.
        [[3.1, 3.3], [0.2, 0.4]],
    ];
    for heights in [None, Some([0.7, 0.7]), Some([0.5, 0.5])] {
        let space = Space::wall(&wall(&outs), [0.16, 0.2], [1.0, 0.0], heights).unwrap();
        let [bottom, top] = heights.unwrap_or([0.1, 1.9]);
        let (mut free, mut taken) = (0, 0);
        for code in 0..81 * 41 {
            let along = 0.1 + 3.8 * f64::from(code % 81) / 80.0;
            let z = bottom + (top - bottom) * f64::from(code / 81) / 40.0;
            let inside = |[[a, b], [c, d]]: &[[f64; 2]; 2]| {
                along > a - 0.1 && along < b + 0.1 && z > c - 0.1 && z < d + 0.1
            };
            let pose = Pose3Deg {
                x: along,
                y: 5.0,
                z,
                roll_deg: 0.0,
                pitch_deg: 0.0,
                yaw_deg: -90.0,
            };
            let nearest = space.nearest(&pose);
            let off = (nearest.x - along).hypot(nearest.z - z);
            if outs.iter().any(inside) {
                taken += 1;
                assert!(off > 0.0, "{along} {z}");
            } else {
                free += 1;
                assert!(off < 1e-12, "{along} {z} {off}");
            }
        }
        assert!(free > 100 && taken > 100, "{free} {taken}");
    }
    // From the left of the door to the bottom, and over it.
    let door = Space::wall(&wall(&outs[..1]), [0.16, 0.2], [1.0, 0.0], None).unwrap();
    assert_eq!(door.pieces().len(), 3);
    // A tag fits exactly between two keep-outs.
    let slit = [[[0.0, 1.0], [0.0, 2.0]], [[1.25, 4.0], [0.0, 2.0]]];
    let space = Space::wall(&wall(&slit), [0.2, 0.25], [1.0, 0.0], None).unwrap();
    assert!(
        space.pieces().iter().all(|piece| piece.dimensions() == 1),
        "{space:?}"
    );
    assert_eq!(space.pieces()[0].pose(&[0.5]).x, 1.125);
}

#[test]
fn walls_without_a_place_are_errors() {
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
    for piece in space.pieces() {
        let pose = piece.pose(&[0.3, 0.5]);
        let out = pose.yaw_deg.to_radians();
        let beyond = [pose.x + 0.1 * libm::cos(out), pose.y + 0.1 * libm::sin(out)];
        let inside = beyond[0] > 0.0 && beyond[0] < 2.0 && beyond[1] > 0.0 && beyond[1] < 1.0;
        assert!(!inside, "{pose:?}");
        if !seen.contains(&pose.yaw_deg) {
            seen.push(pose.yaw_deg);
        }
        let again = piece.pose(&piece.point(&pose));
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
    let piece = &space.pieces()[0];
    assert_eq!(piece.dimensions(), 2);
    assert!(!piece.is_periodic(0) && piece.is_periodic(1));
    assert_eq!(piece.pose(&[0.25, -0.5]), piece.pose(&[0.25, 0.5]));
    let at = piece.pose(&[0.25, 0.5]);
    assert_eq!(
        (at.x, at.y, at.z, at.yaw_deg, at.pitch_deg),
        (1.0, 2.0, 1.0, 180.0, -90.0)
    );
    assert_eq!(piece.point(&at), [0.25, 0.5]);
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
