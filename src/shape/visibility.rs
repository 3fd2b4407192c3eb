//! Visibility sets: the poses from which a tag is seen (S_l of the paper).

use super::Pose3Deg;

/// A pinhole camera's image: pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Image width, pixels.
    pub width_px: f64,
    /// Image height, pixels.
    pub height_px: f64,
    /// Focal length along a row, pixels.
    pub fx: f64,
    /// Focal length along a column, pixels.
    pub fy: f64,
    /// Column of the optical axis, pixels.
    pub cx: f64,
    /// Row of the optical axis, pixels.
    pub cy: f64,
}

/// Where a camera sits on the robot: frame m in frame r (`T_r_m`).
pub type Mount = Pose3Deg;

/// A fiducial as it hangs in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tag {
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
