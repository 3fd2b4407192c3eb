//! Imported tags are where their maps place them, for every convention of axes. The tables that `posegate import`
//! prints agree, and a table's claim covers the bytes of every imported file.

use posegate::shape::Pose3Deg;
use posegate_site::{Convention, Format, Import, SiteTag};

mod entry_points;

type Vector = [f64; 3];

/// The directions right, up and out of the face of a tag in a convention's coordinates, as a viewer sees
/// AprilTag's own image. From the documents of the conventions' authors, not from the crate.
const SIDES: [(&str, [Vector; 3]); 5] = [
    (
        "posegate",
        [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]],
    ),
    (
        "wpilib",
        [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]],
    ),
    // The library's README: x right, y down, z into the tag.
    (
        "apriltag",
        [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]],
    ),
    // The ROS node's notes on frames: x right, y up, z towards the viewer.
    (
        "apriltag_ros",
        [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
    ),
    // OpenCV's image: its lower right bit is AprilTag's upper left one.
    (
        "opencv",
        [[-1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0]],
    ),
];

/// A unit quaternion w, x, y, z about an axis that is in no coordinate plane.
const TURN: [f64; 4] = [0.8, 0.36, -0.48, 0.0];

const OFFSET: Vector = [0.35, -0.12, 0.07];

const POSE: Pose3Deg = Pose3Deg {
    x: 4.25,
    y: -1.5,
    z: 0.875,
    roll_deg: 12.0,
    pitch_deg: -35.0,
    yaw_deg: 110.0,
};

fn add(a: Vector, b: Vector) -> Vector {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

fn times(s: f64, a: Vector) -> Vector {
    a.map(|x| s * x)
}

fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Returns Hamilton's product.
fn product(a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
    let [aw, ax, ay, az] = a;
    let [bw, bx, by, bz] = b;
    [
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
    ]
}

/// Returns `q v q*`.
fn turned(q: [f64; 4], v: Vector) -> Vector {
    let [w, x, y, z] = q;
    let [_, x, y, z] = product(product(q, [0.0, v[0], v[1], v[2]]), [w, -x, -y, -z]);
    [x, y, z]
}

/// Returns the world point of a point in a frame at a pose: rotated about the fixed axes x, y, z in turn, then moved.
fn placed(pose: Pose3Deg, v: Vector) -> Vector {
    let half = |degrees: f64| (0.5 * degrees.to_radians()).sin_cos();
    let (sr, cr) = half(pose.roll_deg);
    let (sp, cp) = half(pose.pitch_deg);
    let (sy, cy) = half(pose.yaw_deg);
    let v = turned([cr, sr, 0.0, 0.0], v);
    let v = turned([cp, 0.0, sp, 0.0], v);
    let v = turned([cy, 0.0, 0.0, sy], v);
    add(v, [pose.x, pose.y, pose.z])
}

/// The corners (left or right, lower or upper for a viewer) in AprilTag's order, and a point before the face.
const POINTS: [Vector; 5] = [
    [-1.0, -1.0, 0.0],
    [1.0, -1.0, 0.0],
    [1.0, 1.0, 0.0],
    [-1.0, 1.0, 0.0],
    [0.0, 0.0, 1.0],
];

/// Returns the points of [`POINTS`] on an imported tag in the world: frame t has x out of the face, y right, z up.
fn tag_points(tag: &SiteTag) -> [Vector; 5] {
    let half = 0.5 * tag.tag.size;
    POINTS.map(|[right, up, out]| placed(tag.tag.pose, times(half, [out, right, up])))
}

fn assert_near(found: [Vector; 5], wanted: [Vector; 5], what: &str) {
    for (a, b) in found.as_flattened().iter().zip(wanted.as_flattened()) {
        assert!((a - b).abs() < 1e-8, "{what}: {found:?} {wanted:?}");
    }
}

fn bundle(convention: &str, pose: Pose3Deg) -> Import {
    Import {
        convention: Convention::named(convention),
        family: Some("tag36h11".into()),
        pose: Some(pose),
        ..Import::of(Format::AprilTagRos)
    }
}

fn bundle_file(offset: Vector, turn: [f64; 4], size: f64) -> String {
    let ([x, y, z], [w, i, j, k]) = (offset, turn);
    format!(
        "tag_bundles:\n- name: b\n  layout:\n  - {{id: 7, size: {size}, x: {x}, y: {y}, z: {z}, qw: {w}, qx: {i}, qy: {j}, qz: {k}}}\n"
    )
}

fn field_file(offset: Vector, turn: [f64; 4]) -> String {
    let ([x, y, z], [w, i, j, k]) = (offset, turn);
    format!(
        "{{\"tags\": [{{\"ID\": 7, \"pose\": {{\"translation\": {{\"x\": {x}, \"y\": {y}, \"z\": {z}}}, \
         \"rotation\": {{\"quaternion\": {{\"W\": {w}, \"X\": {i}, \"Y\": {j}, \"Z\": {k}}}}}}}}}]}}\n"
    )
}

/// A bundle with different angles and lengths, in every convention, compared with points that are transformed
/// one by one.
#[test]
fn bundle_has_the_same_world_points_in_every_convention() {
    let size = 0.2;
    for (name, [right, up, out]) in SIDES {
        // In the bundle, in the convention's coordinates.
        let in_bundle = POINTS.map(|[r, u, o]| {
            let of_tag = add(add(times(r, right), times(u, up)), times(o, out));
            add(turned(TURN, times(0.5 * size, of_tag)), OFFSET)
        });
        // The bundle is placed like a tag at its pose.
        let wanted = in_bundle.map(|v| placed(POSE, [dot(v, out), dot(v, right), dot(v, up)]));
        let text = bundle_file(OFFSET, TURN, size);
        let imported = bundle(name, POSE).parse(&text, "tags.yaml").unwrap();
        assert_near(tag_points(&imported.tags["t7"]), wanted, name);
    }
}

/// The same tag in every convention, with simple numbers: 20 cm to a viewer's right, 10 cm up, 5 cm out of
/// the bundle's face. It is turned by 90 degrees about the vertical, counter-clockwise from above.
#[test]
fn tag_has_the_same_pose_in_every_convention() {
    let c = std::f64::consts::FRAC_1_SQRT_2;
    let rows = [
        ("posegate", [0.05, 0.2, 0.1], [c, 0.0, 0.0, c]),
        ("wpilib", [0.05, 0.2, 0.1], [c, 0.0, 0.0, c]),
        ("apriltag", [0.2, -0.1, -0.05], [c, 0.0, -c, 0.0]),
        ("apriltag_ros", [0.2, 0.1, 0.05], [c, 0.0, c, 0.0]),
        ("opencv", [-0.2, -0.1, 0.05], [c, 0.0, -c, 0.0]),
    ];
    let origin = Pose3Deg {
        x: 0.0,
        y: 0.0,
        z: 0.0,
        roll_deg: 0.0,
        pitch_deg: 0.0,
        yaw_deg: 0.0,
    };
    let wanted = Pose3Deg {
        x: 0.05,
        y: 0.2,
        z: 0.1,
        yaw_deg: 90.0,
        ..origin
    };
    for (name, offset, turn) in rows {
        let text = bundle_file(offset, turn, 0.1);
        let imported = bundle(name, origin).parse(&text, "tags.yaml").unwrap();
        assert_eq!(imported.tags["t7"].tag.pose, wanted, "{name}");
    }
}

/// A field layout at the world's origin, and moved. Its axes are those of a map. The x axis of its tags is out of the face.
#[test]
fn field_tags_follow_the_pose_of_the_field() {
    let size = 0.1651;
    for pose in [None, Some(POSE)] {
        let order = Import {
            size: Some(size),
            family: Some("tag36h11".into()),
            pose,
            ..Import::of(Format::Wpilib)
        };
        let imported = order.parse(&field_file(OFFSET, TURN), "f.json").unwrap();
        let wanted = POINTS.map(|[right, up, out]| {
            let in_field = add(turned(TURN, times(0.5 * size, [out, right, up])), OFFSET);
            pose.map_or(in_field, |pose| placed(pose, in_field))
        });
        assert_near(
            tag_points(&imported.tags["t7"]),
            wanted,
            &format!("{pose:?}"),
        );
    }
}

/// Docks in a frame that is not at the world's origin.
#[test]
fn dock_goals_follow_the_pose_of_the_frame() {
    let pose = Pose3Deg {
        z: 0.0,
        roll_deg: 0.0,
        pitch_deg: 0.0,
        ..POSE
    };
    let order = Import {
        pose: Some(pose),
        ..Import::of(Format::Nav2Docks)
    };
    let text = "docks:\n  a: {type: x, frame: hall, pose: [1.5, -0.25, 2.5]}\n";
    let goal = order.parse(text, "docks.yaml").unwrap().goals["a"];
    let at = placed(pose, [1.5, -0.25, 0.0]);
    assert!((goal.x - at[0]).abs() < 1e-8 && (goal.y - at[1]).abs() < 1e-8);
    let before = placed(pose, [1.5 + 2.5_f64.cos(), -0.25 + 2.5_f64.sin(), 0.0]);
    let heading = (before[1] - at[1]).atan2(before[0] - at[0]).to_degrees();
    assert!((goal.yaw_deg - heading).abs() < 1e-7, "{goal:?} {heading}");
}
