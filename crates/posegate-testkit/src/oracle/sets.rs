//! The three success sets, as a list of constraints in the goal frame, and the sight of a tag.

use super::{Pose, to_goal, turn, wrap};
use std::f64::consts::PI;

/// A pinhole camera; all fields in pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    pub fx: f64,
    pub fy: f64,
    pub cx: f64,
    pub cy: f64,
    pub width: f64,
    pub height: f64,
}

/// A success set in the goal frame, in metres and radians.
#[derive(Clone, Debug, PartialEq)]
pub enum Set {
    Box {
        x: [f64; 2],
        y: [f64; 2],
        yaw: [f64; 2],
    },
    /// `footprint` in the robot frame, `region` in the goal frame; both convex.
    Footprint {
        footprint: Vec<[f64; 2]>,
        region: Vec<[f64; 2]>,
    },
    /// `mount` and `tag_in_goal` are `[x, y, z, roll, pitch, yaw]`.
    Visibility {
        camera: Camera,
        mount: [f64; 6],
        tag_in_goal: [f64; 6],
        tag_size: f64,
        d_max: f64,
        phi_max: f64,
        psi_max: f64,
        z_near: f64,
    },
}

/// A success set and the world pose of its goal frame.
#[derive(Clone, Debug, PartialEq)]
pub struct World {
    pub goal: Pose,
    pub set: Set,
}

impl World {
    /// Returns the slack of a world pose.
    pub fn slack(&self, pose: Pose) -> f64 {
        slack(&self.set, to_goal(self.goal, pose))
    }

    /// Returns `true` if a world pose is in the set.
    pub fn inside(&self, pose: Pose) -> bool {
        self.slack(pose) >= 0.0
    }
}

/// All constraints of a success set, in the goal frame.
#[derive(Clone, Debug)]
pub struct Constraints {
    all: Vec<Constraint>,
    arc: Option<Arc>,
}

impl Constraints {
    pub fn of(set: &Set) -> Self {
        let (all, arc) = constraints(set);
        Self { all, arc }
    }

    /// Returns the least of all signed slacks of a goal-frame pose, in metres or radians; at least 0 inside.
    pub fn slack(&self, pose: Pose) -> f64 {
        let arc = self.arc.as_ref();
        let turned = arc.map_or(f64::INFINITY, |arc| {
            arc.half - wrap(pose[2] - arc.mid).abs()
        });
        let values = self.all.iter().map(|constraint| constraint.value(pose));
        values.fold(turned, f64::min)
    }
}

/// `value(x, y, a) = offset + n(a).(x, y) + cos cos(a) + sin sin(a) - weight |r|`, where
/// `n(a) = fixed + R(a) turning` and `r = (tag - (x, y) - R(a) mount, rise)` runs from the camera to
/// the tag. For a fixed yaw it is concave in (x, y), and affine when `weight` is 0.
#[derive(Clone, Copy, Debug, Default)]
pub struct Constraint {
    pub offset: f64,
    pub fixed: [f64; 2],
    pub turning: [f64; 2],
    pub cos: f64,
    pub sin: f64,
    pub weight: f64,
    pub tag: [f64; 2],
    pub mount: [f64; 2],
    pub rise: f64,
}

impl Constraint {
    pub fn value(&self, q: Pose) -> f64 {
        let (s, c) = q[2].sin_cos();
        let [tx, ty] = self.turning;
        let n = [
            self.fixed[0] + c * tx - s * ty,
            self.fixed[1] + s * tx + c * ty,
        ];
        let affine = self.offset + n[0] * q[0] + n[1] * q[1] + self.cos * c + self.sin * s;
        if self.weight == 0.0 {
            return affine;
        }
        let [mx, my] = self.mount;
        let rx = self.tag[0] - q[0] - (c * mx - s * my);
        let ry = self.tag[1] - q[1] - (s * mx + c * my);
        affine - self.weight * (rx * rx + ry * ry + self.rise * self.rise).sqrt()
    }

    /// Returns `offset + n.(x, y)` for a normal that does not turn with the robot.
    fn still(n: [f64; 2], offset: f64) -> Self {
        Self {
            offset,
            fixed: n,
            ..Self::default()
        }
    }

    /// Returns `k.(point in the robot frame) + offset`.
    fn carried(k: [f64; 3], point: [f64; 3], offset: f64) -> Self {
        Self {
            offset: offset + k[2] * point[2],
            turning: [-k[0], -k[1]],
            cos: k[0] * point[0] + k[1] * point[1],
            sin: k[0] * point[1] - k[1] * point[0],
            ..Self::default()
        }
    }
}

/// An arc of yaw, `|wrap(yaw - mid)| <= half`.
#[derive(Clone, Copy, Debug)]
pub struct Arc {
    pub mid: f64,
    pub half: f64,
}

/// All constraints of a set. There is no arc if every yaw is allowed.
pub fn constraints(set: &Set) -> (Vec<Constraint>, Option<Arc>) {
    match set {
        Set::Box { x, y, yaw } => {
            let faces = vec![
                Constraint::still([1.0, 0.0], -x[0]),
                Constraint::still([-1.0, 0.0], x[1]),
                Constraint::still([0.0, 1.0], -y[0]),
                Constraint::still([0.0, -1.0], y[1]),
            ];
            let half = 0.5 * (yaw[1] - yaw[0]);
            let arc = Arc {
                mid: 0.5 * (yaw[0] + yaw[1]),
                half,
            };
            (faces, (half < PI - 1e-12).then_some(arc))
        }
        Set::Footprint { footprint, region } => {
            let mut out = Vec::new();
            let sense = signed_area(region).signum();
            for (i, a) in region.iter().enumerate() {
                let b = region[(i + 1) % region.len()];
                let edge = [b[0] - a[0], b[1] - a[1]];
                let length = edge[0].hypot(edge[1]);
                if length == 0.0 {
                    continue;
                }
                let n = [-sense * edge[1] / length, sense * edge[0] / length];
                for v in footprint {
                    out.push(Constraint {
                        cos: n[0] * v[0] + n[1] * v[1],
                        sin: n[1] * v[0] - n[0] * v[1],
                        ..Constraint::still(n, -(n[0] * a[0] + n[1] * a[1]))
                    });
                }
            }
            (out, None)
        }
        Set::Visibility { .. } => (visibility(set), None),
    }
}

fn visibility(set: &Set) -> Vec<Constraint> {
    let Set::Visibility {
        camera,
        mount,
        tag_in_goal: tag,
        tag_size,
        d_max,
        phi_max,
        psi_max,
        z_near,
    } = set
    else {
        unreachable!("only called for a tag");
    };
    let looks = rotation([mount[3], mount[4], mount[5]]);
    let eye = [mount[0], mount[1], mount[2]];
    // Half-spaces through the camera's centre, inward normals in the mount frame
    // (Z = x_m, X = -y_m, Y = -z_m).
    let k = camera;
    let planes = [
        [k.cx, -k.fx, 0.0],
        [k.width - k.cx, k.fx, 0.0],
        [k.cy, 0.0, -k.fy],
        [k.height - k.cy, 0.0, k.fy],
    ];
    let mut out = Vec::with_capacity(23);
    for corner in tag_corners(tag, *tag_size) {
        for plane in planes {
            let n = apply(&looks, plane.map(|c| c / dot(plane, plane).sqrt()));
            out.push(Constraint::carried(n, corner, -dot(n, eye)));
        }
        let axis = apply(&looks, [1.0, 0.0, 0.0]);
        out.push(Constraint::carried(axis, corner, -dot(axis, eye) - z_near));
    }
    let far = Constraint {
        offset: *d_max,
        weight: 1.0,
        tag: [tag[0], tag[1]],
        mount: [mount[0], mount[1]],
        rise: tag[2] - mount[2],
        ..Constraint::default()
    };
    out.push(far);
    let axis = apply(&looks, [1.0, 0.0, 0.0]);
    out.push(Constraint {
        // From 90 degrees on, the corners' depth is the stronger limit.
        weight: phi_max.cos().max(0.0),
        ..merge(
            far,
            Constraint::carried(axis, [tag[0], tag[1], tag[2]], -dot(axis, eye)),
        )
    });
    // normal.(camera - tag), the camera at (x, y) + R(a) mount.
    let n = apply(&rotation([tag[3], tag[4], tag[5]]), [1.0, 0.0, 0.0]);
    out.push(Constraint {
        weight: psi_max.min(0.5 * PI).cos().max(0.0),
        offset: -n[0] * tag[0] - n[1] * tag[1] - n[2] * far.rise,
        fixed: [n[0], n[1]],
        cos: n[0] * mount[0] + n[1] * mount[1],
        sin: n[1] * mount[0] - n[0] * mount[1],
        ..far
    });
    out
}

/// Returns `part` with the ray of `ray`.
fn merge(ray: Constraint, part: Constraint) -> Constraint {
    Constraint {
        tag: ray.tag,
        mount: ray.mount,
        rise: ray.rise,
        ..part
    }
}

/// Returns the least of all signed slacks of a goal-frame pose, in metres or radians; at least 0 inside.
pub fn slack(set: &Set, q: Pose) -> f64 {
    Constraints::of(set).slack(q)
}

/// Returns `true` if a goal-frame pose is in the set (sets are closed).
pub fn inside(set: &Set, q: Pose) -> bool {
    slack(set, q) >= 0.0
}

/// How a camera sees a tag.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sight {
    pub d: f64,
    pub phi: f64,
    pub psi: f64,
    /// In AprilTag's corner order; `None` if the depth is below `z_near`.
    pub corners_px: [Option<[f64; 2]>; 4],
    /// `true` if all the limits of the visibility set hold.
    pub seen: bool,
}

/// Returns the sight of the tag from a goal-frame pose, computed point by point and not from the constraints.
/// `None` for a set that is not a visibility set.
pub fn sight(set: &Set, q: Pose) -> Option<Sight> {
    let Set::Visibility {
        camera,
        mount,
        tag_in_goal: tag,
        tag_size,
        d_max,
        phi_max,
        psi_max,
        z_near,
    } = set
    else {
        return None;
    };
    let looks = rotation([mount[3], mount[4], mount[5]]);
    // A goal-frame point in the mount frame: first into the robot's frame, then by the inverse of the mount.
    let into_mount = |p: [f64; 3]| {
        let [x, y] = turn(-q[2], [p[0] - q[0], p[1] - q[1]]);
        let from_eye = [x - mount[0], y - mount[1], p[2] - mount[2]];
        apply_transposed(&looks, from_eye)
    };
    let r = into_mount([tag[0], tag[1], tag[2]]);
    let d = dot(r, r).sqrt();
    let across = r[1].hypot(r[2]);
    let phi = across.atan2(r[0]);
    let [ex, ey] = turn(q[2], [mount[0], mount[1]]);
    let to_eye = [q[0] + ex - tag[0], q[1] + ey - tag[1], mount[2] - tag[2]];
    let in_tag = apply_transposed(&rotation([tag[3], tag[4], tag[5]]), to_eye);
    let psi = in_tag[1].hypot(in_tag[2]).atan2(in_tag[0]);
    let corners_px = tag_corners(tag, *tag_size).map(|corner| {
        let m = into_mount(corner);
        (m[0] >= *z_near).then(|| {
            [
                camera.fx * -m[1] / m[0] + camera.cx,
                camera.fy * -m[2] / m[0] + camera.cy,
            ]
        })
    });
    let framed = corners_px.iter().all(|corner| {
        corner.is_some_and(|[u, v]| {
            (0.0..=camera.width).contains(&u) && (0.0..=camera.height).contains(&v)
        })
    });
    Some(Sight {
        d,
        phi,
        psi,
        corners_px,
        seen: framed && d <= *d_max && phi <= *phi_max && psi <= psi_max.min(0.5 * PI),
    })
}

/// Returns the tag's corners in the frame of its pose, in AprilTag's order.
pub fn tag_corners(tag: &[f64; 6], size: f64) -> [[f64; 3]; 4] {
    let r = rotation([tag[3], tag[4], tag[5]]);
    let h = 0.5 * size;
    [[-h, -h], [h, -h], [h, h], [-h, h]].map(|[y, z]| {
        let c = apply(&r, [0.0, y, z]);
        [tag[0] + c[0], tag[1] + c[1], tag[2] + c[2]]
    })
}

/// Returns `Rz(yaw) Ry(pitch) Rx(roll)` from `[roll, pitch, yaw]`.
pub fn rotation(rpy: [f64; 3]) -> [[f64; 3]; 3] {
    let [(sr, cr), (sp, cp), (sy, cy)] = rpy.map(f64::sin_cos);
    [
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ]
}

pub fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub fn apply(m: &[[f64; 3]; 3], v: [f64; 3]) -> [f64; 3] {
    m.map(|row| dot(row, v))
}

pub fn apply_transposed(m: &[[f64; 3]; 3], v: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|j| m[0][j] * v[0] + m[1][j] * v[1] + m[2][j] * v[2])
}

/// Returns the signed area of a polygon, positive if it runs counter-clockwise.
pub fn signed_area(polygon: &[[f64; 2]]) -> f64 {
    let next = polygon.iter().cycle().skip(1);
    0.5 * polygon
        .iter()
        .zip(next)
        .map(|(a, b)| a[0] * b[1] - a[1] * b[0])
        .sum::<f64>()
}
