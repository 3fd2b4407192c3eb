//! Random cameras, tags and poses, and success sets made of them.

use posegate::bake::sight_record;
use posegate::num::BinaryAngle;
use posegate::pose::Pose;
use posegate::shape::{
    Camera, Mount, Pose3Deg, PoseDeg, Shape, SuccessSet, Tag, Tolerance, Visibility,
};
use posegate::sight::Scene;

/// A generator of numbers (splitmix64).
pub struct Random(pub u64);

impl Random {
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Returns a number uniform in `[lo, hi)`.
    pub fn within(&mut self, lo: f64, hi: f64) -> f64 {
        lo + (hi - lo) * (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Returns a number in `[lo, hi)` with a uniform logarithm.
    pub fn scale(&mut self, lo: f64, hi: f64) -> f64 {
        self.within(lo.ln(), hi.ln()).exp()
    }

    pub fn one_in(&mut self, n: u64) -> bool {
        self.bits().is_multiple_of(n)
    }
}

type Vector = [f64; 3];

/// Returns `Rz(yaw) Ry(pitch) Rx(roll) v`, degrees.
fn turned([roll, pitch, yaw]: Vector, [x, y, z]: Vector) -> Vector {
    let turn = |deg: f64, a: f64, b: f64| {
        let (s, c) = deg.to_radians().sin_cos();
        (c * a - s * b, s * a + c * b)
    };
    let (y, z) = turn(roll, y, z);
    let (z, x) = turn(pitch, z, x);
    let (x, y) = turn(yaw, x, y);
    [x, y, z]
}

/// Returns the inverse of [`turned`].
fn turned_back([roll, pitch, yaw]: Vector, v: Vector) -> Vector {
    let v = turned([0.0, 0.0, -yaw], v);
    turned([-roll, 0.0, 0.0], turned([0.0, -pitch, 0.0], v))
}

/// Returns a tag's corners in the camera's optical axes (right, down, forward), metres, in AprilTag's order.
pub fn corners(set: &Visibility, [x, y, yaw]: [f64; 3]) -> [Vector; 4] {
    let (half, tag, mount) = (0.5 * set.tag.size, set.tag.pose, set.mount);
    [(-half, -half), (half, -half), (half, half), (-half, half)].map(|(b, c)| {
        let corner = turned([tag.roll_deg, tag.pitch_deg, tag.yaw_deg], [0.0, b, c]);
        let world = [
            tag.x + corner[0] - x,
            tag.y + corner[1] - y,
            tag.z + corner[2],
        ];
        let robot = turned([0.0, 0.0, -yaw.to_degrees()], world);
        let from = [robot[0] - mount.x, robot[1] - mount.y, robot[2] - mount.z];
        let axes = [mount.roll_deg, mount.pitch_deg, mount.yaw_deg];
        let [forward, left, up] = turned_back(axes, from);
        [-left, -up, forward]
    })
}

/// Returns a visibility set, its scene, and a pose of the robot (m, m, rad) from which the tag is nearly
/// straight ahead.
pub fn scene(random: &mut Random) -> (SuccessSet, Scene, [f64; 3]) {
    // A few sets are beyond the ranges of a record.
    for _ in 0..100 {
        let (success, pose) = set(random);
        if let Some(record) = sight_record(&success) {
            return (success, Scene::new(record).unwrap(), pose);
        }
    }
    panic!("a hundred sets, and none has a record");
}

fn set(random: &mut Random) -> (SuccessSet, [f64; 3]) {
    let width = random.scale(100.0, 8000.0).round();
    let height = (width * random.within(0.4, 1.2)).round();
    let focal = width * random.scale(0.4, 4.0);
    let camera = Camera::pinhole(
        [width, height],
        [focal, focal * random.within(0.9, 1.1)],
        [
            width * random.within(0.35, 0.65),
            height * random.within(0.35, 0.65),
        ],
    );
    // Every other camera looks straight ahead and is mounted level.
    let level = random.one_in(2);
    let mut tilt = |most: f64| {
        if level {
            0.0
        } else {
            random.within(-most, most)
        }
    };
    let (roll_deg, pitch_deg, yaw_deg) = (tilt(180.0), tilt(70.0), tilt(180.0));
    let mount = Mount {
        x: random.within(-2.0, 2.0),
        y: random.within(-1.0, 1.0),
        z: random.within(-0.5, 3.0),
        roll_deg,
        pitch_deg,
        yaw_deg,
    };
    let far = if random.one_in(3) { 1900.0 } else { 20.0 };
    let pose = [
        random.within(-far, far),
        random.within(-far, far),
        random.within(-20.0, 20.0),
    ];
    let d = random.scale(0.3, 90.0);
    let view = d * 0.3 * width / focal;
    let off = [
        d,
        random.within(-view, view),
        random.within(-view, view) * 0.7,
    ];
    let ray = turned([roll_deg, pitch_deg, yaw_deg], off);
    let seen = [mount.x + ray[0], mount.y + ray[1], mount.z + ray[2]];
    let place = turned([0.0, 0.0, pose[2].to_degrees()], seen);
    // The normal points roughly back to the camera.
    let back = turned([0.0, 0.0, pose[2].to_degrees()], ray.map(|v| -v));
    let size = random.scale(0.01, 0.5) * view.max(0.02);
    let tag = Tag {
        id: random.bits() as u32,
        size: size.min(8.0),
        pose: Pose3Deg {
            x: pose[0] + place[0],
            y: pose[1] + place[1],
            z: place[2],
            roll_deg: random.within(-180.0, 180.0),
            pitch_deg: -(back[2] / d).asin().to_degrees() + random.within(-30.0, 30.0),
            yaw_deg: back[1].atan2(back[0]).to_degrees() + random.within(-40.0, 40.0),
        },
    };
    let shape = Visibility {
        camera,
        mount,
        tag,
        d_max: (d * random.within(0.9, 2.5)).min(100.0),
        phi_max_deg: random.within(8.0, 95.0),
        psi_max_deg: random.within(30.0, 90.0),
        z_near: random.scale(0.01, 0.5),
        tag_tolerance: Tolerance::NONE,
        mount_tolerance: Tolerance::NONE,
        sharpness: None,
        error_room: None,
    };
    let goal = PoseDeg {
        x: pose[0] + random.within(-2.0, 2.0),
        y: pose[1] + random.within(-2.0, 2.0),
        yaw_deg: random.within(-180.0, 180.0),
    };
    let success = SuccessSet {
        goal,
        shape: Shape::Visibility(shape),
    };
    (success, pose)
}

/// Returns a pose near another: mostly so that the tag stays in view, sometimes anywhere near.
pub fn about(random: &mut Random, [x, y, yaw]: [f64; 3], d: f64) -> [f64; 3] {
    let reach = if random.one_in(4) { 3.0 } else { 0.4 };
    [
        x + random.within(-reach, reach) * d,
        y + random.within(-reach, reach) * d,
        yaw + random.within(-reach, reach),
    ]
}

/// Returns the integer pose that represents a pose.
pub fn rounded([x, y, yaw]: [f64; 3]) -> Pose {
    Pose {
        x_um: (x * 1e6).round() as i32,
        y_um: (y * 1e6).round() as i32,
        yaw: BinaryAngle::from_radians(yaw).unwrap(),
    }
}
