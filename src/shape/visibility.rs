//! Visibility sets: the poses from which a tag is seen (S_l of the paper).

use super::planar::Planar;
use super::scalar::{
    NONE, Scalar, Selection, Vector, dot, minus, rotation, selected, times, transposed_times,
};
use super::{Camera, Pose3Deg, PoseDeg};

/// Where a camera sits on the robot: frame m in frame r (`T_r_m`).
pub type Mount = Pose3Deg;

/// A fiducial as it hangs in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tag {
    /// Its number within its family.
    pub id: u32,
    /// Edge length of the black border's outer square, metres.
    pub size: f64,
    /// Frame t in the world (`T_w_t`).
    pub pose: Pose3Deg,
}

/// The poses from which a tag is seen: every corner in the image and in front of the camera, the
/// tag near enough (`d`), near the optical axis (`phi`) and not too oblique (`psi`).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Visibility {
    /// The camera's image.
    pub camera: Camera,
    /// The camera on the robot.
    pub mount: Mount,
    /// The tag in the world.
    pub tag: Tag,
    /// Largest distance from the camera's centre to the tag's centre, metres.
    pub d_max: f64,
    /// Largest angle between the optical axis and the ray to the tag's centre, degrees.
    pub phi_max_deg: f64,
    /// Largest angle between the tag's normal and the ray to the camera, degrees, at most 90.
    pub psi_max_deg: f64,
    /// Smallest depth of a corner, metres.
    pub z_near: f64,
}

/// What the camera sees of a tag's centre and corners at a pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sight {
    /// Camera centre to tag centre, metres.
    pub d: f64,
    /// Optical axis to tag centre, radians.
    pub phi: f64,
    /// Tag normal to camera, radians.
    pub psi: f64,
    /// The four corners in AprilTag's order, pixels; `None` where the depth is below `z_near`.
    pub corners_px: [Option<[f64; 2]>; 4],
}

/// A visibility set with its tag taken into the goal frame, in some arithmetic.
#[derive(Clone, Copy, Debug)]
pub struct Resolved<S> {
    set: Visibility,
    /// Tag centre in the goal frame, metres.
    pub(crate) centre: Vector<S>,
    /// Tag corners in the goal frame, metres, in AprilTag's order.
    pub(crate) corners: [Vector<S>; 4],
    /// Tag normal in the goal frame.
    pub(crate) normal: Vector<S>,
    /// Camera position in the robot frame, metres.
    pub(crate) mount: Vector<S>,
    /// `R_r_m` as rows: columns are the camera's axes in the robot frame.
    pub(crate) axes: [Vector<S>; 3],
    /// Cosines of `phi_max` (at most a right angle: corners are in front of the camera anyway) and
    /// of `psi_max`.
    pub(crate) cos_phi: S,
    pub(crate) cos_psi: S,
}

impl Visibility {
    /// Takes the tag into the goal frame (`T_g_t = T_w_g^-1 T_w_t`).
    pub(crate) fn resolve<S: Scalar>(&self, goal: PoseDeg) -> Resolved<S> {
        let pose = self.tag.pose;
        let [cos, sin] = S::cos_sin_deg(goal.yaw_deg);
        let frame = Planar {
            x: S::exact(goal.x),
            y: S::exact(goal.y),
            cos,
            sin,
        };
        let turn = rotation::<S>(pose.roll_deg, pose.pitch_deg, pose.yaw_deg);
        let position = [pose.x, pose.y, pose.z].map(S::exact);
        let half = S::exact(0.5) * S::exact(self.tag.size);
        let zero = S::exact(0.0);
        let at = |v: Vector<S>| {
            let v = times(turn, v);
            frame.to_robot([position[0] + v[0], position[1] + v[1], position[2] + v[2]])
        };
        let corner = |y: S, z: S| at([zero, y, z]);
        let out = times(turn, [S::exact(1.0), zero, zero]);
        let origin = Planar {
            x: zero,
            y: zero,
            ..frame
        };
        let mount = self.mount;
        Resolved {
            set: *self,
            centre: at([zero; 3]),
            corners: [
                corner(-half, -half),
                corner(half, -half),
                corner(half, half),
                corner(-half, half),
            ],
            normal: origin.to_robot(out),
            mount: [mount.x, mount.y, mount.z].map(S::exact),
            axes: rotation(mount.roll_deg, mount.pitch_deg, mount.yaw_deg),
            cos_phi: S::cos_sin_deg(self.phi_max_deg.min(90.0))[0],
            cos_psi: S::cos_sin_deg(self.psi_max_deg)[0],
        }
    }
}

impl<S: Scalar> Resolved<S> {
    /// A point of the goal frame in frame m of the camera at a robot pose: forward, left, up.
    fn in_camera(&self, pose: &Planar<S>, point: Vector<S>) -> Vector<S> {
        transposed_times(self.axes, minus(pose.to_robot(point), self.mount))
    }

    /// Every constraint as a slack that is at least 0 inside, roughly in metres. For fixed yaw each
    /// is a concave function of x and y. Only those of the selection are computed.
    pub(crate) fn slacks(
        &self,
        pose: &Planar<S>,
        selection: Selection,
        note: &mut impl FnMut(usize, &'static str, S),
    ) {
        let camera = &self.set.camera;
        let (fx, fy) = (S::exact(camera.fx), S::exact(camera.fy));
        let (cx, cy) = (S::exact(camera.cx), S::exact(camera.cy));
        let right = S::exact(camera.width_px) - cx;
        let bottom = S::exact(camera.height_px) - cy;
        let wanted = |index: usize| selection & selected(index) != NONE;
        // u >= 0 is fx X + cx Z >= 0 where Z > 0; a positive factor makes it a distance.
        let unit = |a: f64, b: f64| S::exact(1.0 / libm::hypot(a, b));
        for (number, corner) in self.corners.into_iter().enumerate() {
            let first = 5 * number;
            if !(first..first + 5).any(wanted) {
                continue;
            }
            let [depth, left, up] = self.in_camera(pose, corner);
            let mut side = |index: usize, name, depth_factor: S, f: S, across: S, scale: S| {
                if wanted(first + index) {
                    note(
                        first + index,
                        name,
                        (depth_factor * depth + f * across) * scale,
                    );
                }
            };
            let (width, height) = (camera.width_px - camera.cx, camera.height_px - camera.cy);
            side(1, "image_left", cx, -fx, left, unit(camera.fx, camera.cx));
            side(2, "image_right", right, fx, left, unit(camera.fx, width));
            side(3, "image_top", cy, -fy, up, unit(camera.fy, camera.cy));
            side(4, "image_bottom", bottom, fy, up, unit(camera.fy, height));
            if wanted(first) {
                note(first, "depth", depth - S::exact(self.set.z_near));
            }
        }
        if !(20..23).any(wanted) {
            return;
        }
        let ray = self.in_camera(pose, self.centre);
        let distance = dot(ray, ray).root();
        if wanted(20) {
            note(20, "d", S::exact(self.set.d_max) - distance);
        }
        if wanted(21) {
            note(21, "phi", ray[0] - self.cos_phi * distance);
        }
        if wanted(22) {
            note(22, "psi", self.facing(pose) - self.cos_psi * distance);
        }
    }

    /// The tag's normal times the vector from tag to camera.
    fn facing(&self, pose: &Planar<S>) -> S {
        dot(self.normal, self.tag_to_camera(pose))
    }

    /// From the tag's centre to the camera's, in the goal frame.
    fn tag_to_camera(&self, pose: &Planar<S>) -> Vector<S> {
        let [mx, my, mz] = self.mount;
        let [x, y] = pose.to_goal([mx, my]);
        minus([x, y, mz], self.centre)
    }
}

impl Resolved<f64> {
    /// What the camera sees at a pose.
    pub(crate) fn sight(&self, pose: &Planar<f64>) -> Sight {
        let camera = &self.set.camera;
        let ray = self.in_camera(pose, self.centre);
        let back = self.tag_to_camera(pose);
        let along = dot(self.normal, back);
        let across = [
            self.normal[1] * back[2] - self.normal[2] * back[1],
            self.normal[2] * back[0] - self.normal[0] * back[2],
            self.normal[0] * back[1] - self.normal[1] * back[0],
        ];
        Sight {
            d: dot(ray, ray).root(),
            phi: libm::atan2(libm::hypot(ray[1], ray[2]), ray[0]),
            psi: libm::atan2(dot(across, across).root(), along),
            corners_px: self.corners.map(|corner| {
                let [depth, left, up] = self.in_camera(pose, corner);
                (depth >= self.set.z_near).then(|| {
                    [
                        camera.cx - camera.fx * left / depth,
                        camera.cy - camera.fy * up / depth,
                    ]
                })
            }),
        }
    }
}
