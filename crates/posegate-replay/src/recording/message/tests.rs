use super::*;
use posegate_testkit::counts;
use proptest::prelude::*;

proptest! {
    #![proptest_config(ProptestConfig::with_cases(counts::rounds(2_000, 7)))]

    /// The number of decoded detections is limited by the bytes.
    #[test]
    fn random_messages_never_panic(order in 0u8..=1, body in prop::collection::vec(0u8..4, 0..900)) {
        let bytes = [&[0, order, 0, 0], &body[..]].concat();
        for kind in Kind::ALL {
            let message = decoded(kind, Encoding::Cdr, &bytes);
            if let Ok(Message { content: Content::Detections(found), .. }) = message {
                prop_assert!(found.len() * 168 <= body.len());
            }
        }
    }
}

/// A PoseStamped in either byte order, written by hand: the stamp, "map", padding to 8, seven floats.
fn pose_bytes(big: bool) -> Vec<u8> {
    let mut bytes = vec![0, u8::from(!big), 0, 0];
    let int = |value: u32| {
        if big {
            value.to_be_bytes()
        } else {
            value.to_le_bytes()
        }
    };
    for value in [7, 500_000_000, 4] {
        bytes.extend(int(value));
    }
    bytes.extend(b"map\0");
    for value in [1.0, -2.0, 0.0, 0.0, 0.0, 0.6, 0.8f64] {
        let bits = value.to_bits();
        bytes.extend(if big {
            bits.to_be_bytes()
        } else {
            bits.to_le_bytes()
        });
    }
    bytes
}

#[test]
fn big_and_little_endian_messages_are_read() {
    for big in [false, true] {
        let message = decoded(Kind::Pose, Encoding::Cdr, &pose_bytes(big)).unwrap();
        assert_eq!(
            (message.stamp_ns, message.frame.as_str()),
            (7_500_000_000, "map")
        );
        let Content::Pose { pose, covariance } = message.content else {
            panic!("a pose");
        };
        assert_eq!(pose.position, [1.0, -2.0, 0.0]);
        assert_eq!(pose.orientation, [0.0, 0.0, 0.6, 0.8]);
        assert_eq!(covariance, None);
    }
}

#[test]
fn invalid_bytes_are_errors() {
    let good = pose_bytes(false);
    let padded: Vec<u8> = good.iter().copied().chain([0; 3]).collect();
    assert!(decoded(Kind::Pose, Encoding::Cdr, &padded).is_ok());
    let longer: Vec<u8> = good.iter().copied().chain([0; 4]).collect();
    for (bytes, words) in [
        (&longer[..], "4 bytes are left over"),
        (&good[..good.len() - 1], ""),
        (&[0, 3, 0, 0, 0][..], "not plain CDR"),
        (&[0, 1][..], "2 bytes"),
    ] {
        let error = decoded(Kind::Pose, Encoding::Cdr, bytes).err().unwrap();
        assert!(error.contains(words), "{error}");
    }
    // The bytes of another type under this name.
    assert!(decoded(Kind::PoseWithCovariance, Encoding::Cdr, &good).is_err());
}

/// A detection array written by hand: stamp, frame, count, then for each detection its family, four numbers of 32 bits and
/// 19 floats.
#[test]
fn detections_are_read_and_their_count_is_bounded_by_the_bytes() {
    let mut bytes = vec![0, 1, 0, 0];
    for value in [7, 0, 1] {
        bytes.extend(u32::to_le_bytes(value));
    }
    bytes.extend([0; 4]);
    bytes.extend(2u32.to_le_bytes());
    for id in [3u32, 4] {
        bytes.extend(4u32.to_le_bytes());
        bytes.extend(b"36h\0");
        for value in [id, 0, 0, 0] {
            bytes.extend(value.to_le_bytes());
        }
        while !(bytes.len() - 4).is_multiple_of(8) {
            bytes.push(0);
        }
        for value in 0..19 {
            bytes.extend(f64::from(value).to_le_bytes());
        }
    }
    let message = decoded(Kind::Detections, Encoding::Cdr, &bytes).unwrap();
    let Content::Detections(found) = message.content else {
        panic!("detections");
    };
    let all: Vec<_> = found.iter().map(|one| (&*one.family, one.id)).collect();
    assert_eq!(all, [("36h", 3), ("36h", 4)]);
    assert_eq!(
        found[1].corners_px,
        [[2.0, 3.0], [4.0, 5.0], [6.0, 7.0], [8.0, 9.0]]
    );
    for cut in 4..bytes.len() {
        assert!(
            decoded(Kind::Detections, Encoding::Cdr, &bytes[..cut]).is_err(),
            "{cut}"
        );
    }
    bytes[20..24].copy_from_slice(&u32::MAX.to_le_bytes());
    assert!(decoded(Kind::Detections, Encoding::Cdr, &bytes).is_err());
}

#[test]
fn kinds_are_recognized_by_name_and_definition() {
    assert_eq!(Kind::of("nav_msgs/Odometry"), Some(Kind::Odometry));
    assert_eq!(Kind::of("nav_msgs/msg/Path"), None);
    let time = "builtin_interfaces/Time stamp\nstring frame_id\n";
    let poses =
        "std_msgs/Header header\ngeometry_msgs/Pose pose\n===========\nMSG: std_msgs/Header\n";
    let rest = "===========\nMSG: geometry_msgs/Pose\nPoint position\nQuaternion orientation\n===========\nMSG: geometry_msgs/Point\nfloat64 x\nfloat64 y\nfloat64 z\n===========\nMSG: geometry_msgs/Quaternion\nfloat64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1\n";
    assert!(Kind::Pose.has_fields_of(Encoding::Cdr, &format!("{poses}{time}{rest}")));
    assert!(Kind::Pose.has_fields_of(Encoding::Cdr, ""));
    let other = rest.replacen("float64 z", "float32 z", 1);
    assert!(!Kind::Pose.has_fields_of(Encoding::Cdr, &format!("{poses}{time}{other}")));
}
