//! Visibility sets: the poses from which a tag is seen (S_l of the paper).

use super::planar::Planar;
use super::scalar::{
    NONE, Scalar, Selection, Vector, dot, minus, rotation, selected, times, transposed_times,
};
use super::{Camera, Lens, Pose3Deg, PoseDeg, Sharpness, Tolerance};

/// Pose of a camera on the robot: frame m in frame r (`T_r_m`).
pub type Mount = Pose3Deg;

/// A fiducial tag mounted in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tag {
    /// The tag's number within its family.
    pub id: u32,
    /// Edge length of the black border's outer square, metres.
    pub size: f64,
    /// Frame t in the world (`T_w_t`).
    pub pose: Pose3Deg,
}

/// The poses from which a tag is seen: every corner in the image and in front of the camera, and the tag near enough
/// (`d`), near the optical axis (`phi`) and not too oblique (`psi`).
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
    /// The largest error of the tag's surveyed pose; the rotation error is about the vertical.
    pub tag_tolerance: Tolerance,
    /// The largest error of the camera's calibrated pose on the robot; the rotation error is about any axis.
    pub mount_tolerance: Tolerance,
    /// The resolution at which the tag must be seen; `None` for any. `f b cos psi / d`, with the smaller focal length and the width b
    /// of a bit, is no more than the width of any bit at the tag's centre in a pinhole's image.
    pub sharpness: Option<Sharpness>,
    /// The part of the allowed error r of S_l(r) that is left for the error that tolerances add to an observation
    /// ([`Visibility::tolerance_error`]), metres and degrees: r minus the largest bound that an error model has learnt
    /// for this view. `d_max` satisfies it. `None` if no learnt bound limits the view.
    pub error_room: Option<[f64; 2]>,
}

/// A tag's centre and corners as the camera sees them at a pose: the distance d and the angles phi and psi.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sight {
    /// Camera centre to tag centre, metres.
    pub d: f64,
    /// Angle between the optical axis and the ray to the tag's centre, radians.
    pub phi: f64,
    /// Angle between the tag's normal and the ray to the camera, radians.
    pub psi: f64,
    /// The four corners, pixels; `None` if the depth is below `z_near`. AprilTag's order: counter-clockwise from the
    /// lower left, as a viewer sees the tag.
    pub corners_px: [Option<[f64; 2]>; 4],
}

/// A visibility set with its tag transformed to the goal frame, in some arithmetic.
#[derive(Clone, Copy, Debug)]
pub struct Resolved<S> {
    pub(crate) set: Visibility,
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
    /// Cosines of `phi_max` (at most a right angle, because corners are in front of the camera anyway) and of
    /// `psi_max`.
    pub(crate) cos_phi: S,
    pub(crate) cos_psi: S,
    /// The amounts by which tolerances reduce the slacks.
    pub(crate) less: ToleranceMargins,
    /// The ball in which the camera must be so that the tag's bits are wide enough: the distance of its middle from the
    /// tag's centre along the normal, and its radius, metres.
    pub(crate) ball: Option<[f64; 2]>,
}

/// The amounts by which tolerances reduce the slacks of a visibility set, metres, rounded up. A cone whose points may
/// be off by a distance contains them all if it is moved along its axis by that distance over the sine of its half
/// angle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ToleranceMargins {
    /// Displacement of a corner, as the camera sees it.
    pub corner: f64,
    /// Displacement of a corner in the world.
    pub hung: f64,
    /// Displacement of the camera.
    pub mounted: f64,
    /// Displacement of the vector from the camera's centre to the tag's.
    pub ray: f64,
    /// Distance by which the cone about the optical axis is moved.
    pub phi: f64,
    /// Distance by which the cone about the tag's normal is moved.
    pub psi: f64,
}

impl Visibility {
    /// Returns the half angles of the cones about the optical axis and about the tag's normal, minus the tolerances,
    /// degrees. Not above zero if nothing is left.
    #[must_use]
    pub fn half_angles_deg(&self) -> [f64; 2] {
        let less = |angle: f64, tolerance: Tolerance| {
            if tolerance.turn_deg > 0.0 {
                angle - tolerance.turn_deg - 1e-12
            } else {
                angle
            }
        };
        [
            less(self.phi_max_deg.min(90.0), self.mount_tolerance),
            less(self.psi_max_deg, self.tag_tolerance),
        ]
    }

    /// Returns the half angle of the cone of views that are too head-on, degrees (below 90), and how far its
    /// tip is moved behind the tag, metres. Both include the tolerances.
    pub(super) fn too_head_on(&self, psi_min_deg: f64) -> (f64, f64) {
        let turned = self.tag_tolerance.turn_deg;
        let angle = if turned > 0.0 {
            (psi_min_deg + turned + 1e-12).min(90.0)
        } else {
            psi_min_deg
        };
        let back = self.tolerance_margins().ray / f64::cos_sin_deg(angle)[1] * (1.0 + 1e-9);
        (angle, back)
    }

    /// Returns by how much the tolerances of tag and mount reduce the slacks, rounded up. All zero if neither has a
    /// tolerance.
    #[must_use]
    pub fn tolerance_margins(&self) -> ToleranceMargins {
        let (tag, mount) = (self.tag_tolerance, self.mount_tolerance);
        if tag.is_none() && mount.is_none() {
            return ToleranceMargins::default();
        }
        let half_diagonal = self.tag.size * core::f64::consts::FRAC_1_SQRT_2;
        let ray = (tag.translation + mount.translation) * (1.0 + 1e-12);
        let hung = tag.reach(half_diagonal);
        let [phi, psi] = self.half_angles_deg();
        let moved = |half_angle: f64| {
            let sine = f64::cos_sin_deg(half_angle.max(0.0))[1];
            if ray > 0.0 {
                ray / sine * (1.0 + 1e-9)
            } else {
                0.0
            }
        };
        ToleranceMargins {
            // A camera that turns by an angle moves an object's image by a chord at the object's distance.
            corner: (hung + mount.reach(self.d_max + half_diagonal)) * (1.0 + 1e-12),
            hung,
            mounted: mount.translation,
            ray,
            phi: moved(phi),
            psi: moved(psi),
        }
    }

    /// Returns the ball of sharp views: `f b cos psi / d >= n` is `|r - normal k / 2| <= k / 2`, `k = f b / n`, of the
    /// ray r from tag to camera.
    fn ball(&self) -> Option<[f64; 2]> {
        let Sharpness { px_per_bit, bits } = self.sharpness?;
        let focal = self.camera.fx.min(self.camera.fy);
        let half = 0.5 * focal * self.tag.size / f64::from(bits) / px_per_bit * (1.0 - 1e-12);
        let turned = self.tag_tolerance.turn_deg;
        let turned = Tolerance {
            translation: 0.0,
            turn_deg: turned,
        };
        Some([
            half,
            half - self.tolerance_margins().ray - turned.reach(half),
        ])
    }
}

impl Visibility {
    /// Transforms the tag to the goal frame (`T_g_t = T_w_g^-1 T_w_t`).
    pub fn resolve<S: Scalar>(&self, goal: PoseDeg) -> Resolved<S> {
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
        let [phi, psi] = self.half_angles_deg();
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
            cos_phi: S::cos_sin_deg(phi.max(0.0))[0],
            cos_psi: S::cos_sin_deg(psi.max(0.0))[0],
            less: self.tolerance_margins(),
            ball: self.ball(),
        }
    }
}

impl<S: Scalar> Resolved<S> {
    /// Transforms a point of the goal frame to frame m of the camera at a robot pose: forward, left, up.
    pub(super) fn in_camera(&self, pose: &Planar<S>, point: Vector<S>) -> Vector<S> {
        transposed_times(self.axes, minus(pose.to_robot(point), self.mount))
    }

    /// Selects the slacks of distance and of both cones in [`Self::slacks`], numbered from 0.
    pub(super) fn cones(&self) -> Selection {
        let corners = 4 * (1 + self.set.camera.view().planes().len());
        (corners..corners + 3).fold(NONE, |all, index| all | selected(index))
    }

    /// Computes every constraint as a slack that is at least 0 inside, roughly in metres. For fixed yaw each is a
    /// concave function of x and y. Only the selected slacks are computed; they are numbered from `first`. Returns the
    /// number after the last.
    pub(crate) fn slacks(
        &self,
        pose: &Planar<S>,
        selection: Selection,
        first: usize,
        note: &mut impl FnMut(usize, &'static str, S),
    ) -> usize {
        let window = self.set.camera.view();
        let planes = window.planes();
        let wanted = |index: usize| selection & selected(index) != NONE;
        let count = 1 + planes.len();
        // A tolerance reduces the slack; without a tolerance nothing is rounded.
        let less = |slack: S, by: f64| {
            if by > 0.0 {
                slack - S::exact(by)
            } else {
                slack
            }
        };
        for (number, corner) in self.corners.into_iter().enumerate() {
            let first = first + count * number;
            if !(first..first + count).any(wanted) {
                continue;
            }
            let [depth, left, up] = self.in_camera(pose, corner);
            for (index, [a, b, c]) in planes.iter().enumerate() {
                let index = first + 1 + index;
                if !wanted(index) {
                    continue;
                }
                // a X + b Y + c Z >= 0; a positive factor makes it a distance.
                let (a, b) = (-a, -b);
                let mut slack = S::exact(*c) * depth;
                if a != 0.0 {
                    slack = slack + S::exact(a) * left;
                }
                if b != 0.0 {
                    slack = slack + S::exact(b) * up;
                }
                let unit = 1.0 / libm::sqrt(a * a + b * b + c * c);
                note(
                    index,
                    side_name(a, b),
                    less(slack * S::exact(unit), self.less.corner),
                );
            }
            if wanted(first) {
                note(
                    first,
                    "depth",
                    less(depth - S::exact(self.set.z_near), self.less.corner),
                );
            }
        }
        let [d, phi, psi, sharp] = [0, 1, 2, 3].map(|index| first + 4 * count + index);
        if !(d..=sharp).any(wanted) {
            return sharp + 1;
        }
        let ray = self.in_camera(pose, self.centre);
        let distance = dot(ray, ray).root();
        if wanted(d) {
            let slack = S::exact(self.set.d_max) - distance;
            note(d, "d", less(slack, self.less.ray));
        }
        if wanted(phi) {
            let (mut ray, mut length) = (ray, distance);
            if self.less.phi > 0.0 {
                ray[0] = ray[0] - S::exact(self.less.phi);
                length = dot(ray, ray).root();
            }
            note(phi, "phi", ray[0] - self.cos_phi * length);
        }
        if wanted(psi) {
            let slack = if self.less.psi > 0.0 {
                let back = self.off_the_tag(pose, self.less.psi);
                dot(self.normal, back) - self.cos_psi * dot(back, back).root()
            } else {
                self.facing(pose) - self.cos_psi * distance
            };
            note(psi, "psi", slack);
        }
        if let Some([middle, radius]) = self.ball
            && wanted(sharp)
        {
            let back = self.off_the_tag(pose, middle);
            note(
                sharp,
                "px_per_bit",
                S::exact(radius) - dot(back, back).root(),
            );
        }
        sharp + 1
    }

    /// Returns the vector to the camera from the point on the tag's normal that is `before` metres in front of its
    /// centre.
    fn off_the_tag(&self, pose: &Planar<S>, before: f64) -> Vector<S> {
        let before = S::exact(before);
        minus(
            self.tag_to_camera(pose),
            self.normal.map(|component| component * before),
        )
    }

    /// Returns the dot product of the tag's normal and the vector from tag to camera.
    fn facing(&self, pose: &Planar<S>) -> S {
        dot(self.normal, self.tag_to_camera(pose))
    }

    /// Returns the vector from the tag's centre to the camera's, in the goal frame.
    pub(crate) fn tag_to_camera(&self, pose: &Planar<S>) -> Vector<S> {
        let [mx, my, mz] = self.mount;
        let [x, y] = pose.to_goal([mx, my]);
        minus([x, y, mz], self.centre)
    }
}

/// Returns the side of the image that a plane of the window bounds, from its factors of left and up.
fn side_name(left: f64, up: f64) -> &'static str {
    match (left.abs() >= up.abs(), left > 0.0, up > 0.0) {
        (true, false, _) => "image_left",
        (true, true, _) => "image_right",
        (false, _, false) => "image_top",
        (false, _, true) => "image_bottom",
    }
}

impl Resolved<f64> {
    /// Returns how far within the image the corners are seen through a lens, metres at their depth; `None` without a
    /// lens.
    pub(crate) fn image_slack(&self, pose: &Planar<f64>) -> Option<f64> {
        let camera = &self.set.camera;
        let mut slacks = self.corners.iter().map(|corner| {
            let [depth, left, up] = self.in_camera(pose, *corner);
            if depth <= 0.0 {
                return camera.within_px([0.0; 2]).map(|_| depth);
            }
            let pixels = camera.within_px([-left / depth, -up / depth])?;
            Some(pixels * depth / camera.fx)
        });
        slacks.try_fold(f64::INFINITY, |least, slack| Some(least.min(slack?)))
    }

    /// Returns the tag as the camera sees it at a pose.
    pub(crate) fn sight(&self, pose: &Planar<f64>) -> Sight {
        let camera = &self.set.camera;
        let ray = self.in_camera(pose, self.centre);
        let [d, phi, psi] = distance_and_angles(ray, self.tag_to_camera(pose), self.normal);
        Sight {
            d,
            phi,
            psi,
            corners_px: self.corners.map(|corner| {
                let [depth, left, up] = self.in_camera(pose, corner);
                (depth >= self.set.z_near).then(|| match camera.lens() {
                    Lens::Pinhole => [
                        camera.cx - camera.fx * left / depth,
                        camera.cy - camera.fy * up / depth,
                    ],
                    _ => camera.project([-left / depth, -up / depth]),
                })
            }),
        }
    }
}

/// Returns `[d, phi, psi]` from the ray from camera to tag in frame m, and from the vector from tag to camera and the
/// tag's normal, both in the goal frame.
pub(super) fn distance_and_angles(
    ray: Vector<f64>,
    back: Vector<f64>,
    normal: Vector<f64>,
) -> [f64; 3] {
    let across = [
        normal[1] * back[2] - normal[2] * back[1],
        normal[2] * back[0] - normal[0] * back[2],
        normal[0] * back[1] - normal[1] * back[0],
    ];
    [
        dot(ray, ray).root(),
        libm::atan2(libm::hypot(ray[1], ray[2]), ray[0]),
        libm::atan2(dot(across, across).root(), dot(normal, back)),
    ]
}

/// Returns a view for tests: the tag and a camera on the robot at one height, without tolerances.
#[cfg(test)]
pub(super) fn test_view() -> Visibility {
    let pose = crate::shape::Pose3Deg {
        x: 0.0,
        y: 0.0,
        z: 0.5,
        roll_deg: 0.0,
        pitch_deg: 0.0,
        yaw_deg: 0.0,
    };
    Visibility {
        camera: Camera::pinhole([640.0, 480.0], [600.0, 600.0], [320.0, 240.0]),
        mount: pose,
        tag: Tag {
            id: 1,
            size: 0.2,
            pose,
        },
        d_max: 5.0,
        phi_max_deg: 40.0,
        psi_max_deg: 70.0,
        z_near: 0.05,
        tag_tolerance: Tolerance::NONE,
        mount_tolerance: Tolerance::NONE,
        sharpness: None,
        error_room: None,
    }
}
