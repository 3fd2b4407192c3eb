//! The predicted view of a tag: its corners, d, phi and psi at a pose, and its visibility.
//!
//! [`Scene::of`] takes camera and tag from the table of a visibility set. [`Scene::look`] returns the
//! view from a pose: one of three values for "does the visibility set contain the pose?", and the quantities behind
//! this answer, for telemetry. Integers only; nothing can fail after the scene is made.
//!
//! ```
//! use posegate::pose::Pose;
//! use posegate::sight::{Scene, TagVisibility};
//! use posegate::table::Table;
//!
//! let table = Table::parse(include_bytes!("../../examples/tables/see-t7.posegate")).unwrap();
//! let scene = Scene::of(&table).expect("the table of a visibility set");
//! let sighting = scene.look(&Pose::default());
//! assert_eq!(sighting.answer, TagVisibility::Visible);
//! assert_eq!(sighting.d_um, 3_750_000);
//! ```
//!
//! # The three values
//! A pose in integers represents every pose within half a micrometre on each axis and half a 2^-32 turn. Each number of
//! the scene likewise represents all numbers that round to it. [`TagVisibility::Visible`] means that the tag is visible
//! from each of these poses, [`TagVisibility::NotVisible`] that it is visible from none. Everything between is
//! [`TagVisibility::Unsure`]: poses within about ten micrometres of the set's border.
//!
//! No constraint needs a division: `u >= 0` is `fx X + cx Z >= 0`. The corners of a tag are its middle plus and minus
//! two half edges. The least value of a linear slack over the four corners is therefore its value at the middle minus
//! its magnitudes along the two half edges.
//!
//! # The error budget
//! Micrometres; w is the vector from camera to tag in the robot's axes. The camera is at most 2.52e8 um from a tag that
//! is evaluated, the tag at most 1.90e8 um from the robot on the floor: 2^-30 of these is 0.24 and 0.18.
//!
//! | step | at most |
//! |---|---|
//! | pose, tag and camera to the micrometre: 0.5 on two axes, 0.51 on three each, as vectors | 2.49 |
//! | heading to 2^-32 turn (0.81 of 2^-30 rad), cosine and sine ([`crate::num`]: 1.76), times 0.18 | 0.46 |
//! | turned into the robot's axes, two axes to the nearest | 0.71 |
//! | **w, as a vector** | **3.66** |
//! | a camera axis (0.51 of 2^-30 on three entries) times 0.24; to the nearest | 0.71 |
//! | **the middle of the tag on a camera axis** | **4.37** |
//! | two half edges to 2^-8 um, turned (8.4 m are 0.01 of 2^-30), and to the nearest | 1.04 |
//! | **a corner on a camera axis** | **5.41** |
//! | depth: with `z_near` to the micrometre, 0.51 | **5.92** of [`LENGTH_ERROR_UM`] |
//! | d: w, its length rounded down, `d_max` to the micrometre | **5.17** of [`LENGTH_ERROR_UM`] |
//! | cosine times d: w, rounded down, cosine (0.51 of 2^-30), product to the nearest | 5.28 |
//! | phi: with the depth of the middle | **9.65** of [`ANGLE_ERROR_UM`] |
//! | psi: with w along the normal (3.66), the normal (0.89 and 2.57 and 0.71 of 2^-30), to the nearest | **10.42** of [`ANGLE_ERROR_UM`] |
//! | image sides: `f` and `c` times a corner's; and `f`, `c` and the image's size to 2^-14 px, 1.53 of these, times a corner's coordinates | [`Scene`] adds these up |

pub use self::scene::Scene;

mod scene;
mod telemetry;

/// Upper bound of the rounding error of a depth and of a distance, micrometres.
pub const LENGTH_ERROR_UM: i64 = 6;
/// Upper bound of the rounding error of the slacks of phi and psi, micrometres. These slacks are lengths: the ray's
/// component along the axis minus `cos(phi_max) d`, and the same along the normal.
pub const ANGLE_ERROR_UM: i64 = 11;

/// The visibility of the tag from a pose.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[must_use]
pub enum TagVisibility {
    /// Visible from every pose and scene within the rounding errors.
    Visible,
    /// Visible from no pose and scene within the rounding errors, with the first constraint that all of them violate.
    NotVisible(FailedConstraint),
    /// Undecided within the rounding errors.
    #[default]
    Unsure,
}

/// The constraint that a pose violates.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum FailedConstraint {
    /// The tag is farther away than `d_max`.
    Distance,
    /// A corner is nearer than `z_near`, or behind the camera.
    Depth,
    /// A corner is outside of the image.
    Image,
    /// The tag is at too large an angle from the optical axis.
    Phi,
    /// The camera sees the tag too obliquely, or from behind.
    Psi,
}

messages!(no error FailedConstraint {
    Distance => "the tag is farther away than d_max",
    Depth => "a corner of the tag is nearer than z_near, or behind the camera",
    Image => "a corner of the tag is outside of the image",
    Phi => "the tag is at too large an angle from the optical axis (phi_max)",
    Psi => "the camera sees the tag too obliquely (psi_max), or from behind",
});

/// A point in the image, with the origin of the calibration's optical axis (`cx`, `cy`).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Pixel {
    /// Column, 2^-8 px, rightwards.
    pub u_q8: i32,
    /// Row, 2^-8 px, downwards.
    pub v_q8: i32,
}

/// The view of a tag from a pose.
///
/// The answer is a bound. The other fields are for telemetry only, each within the stated error of its true value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[must_use]
pub struct Sighting {
    /// The visibility of the tag.
    pub answer: TagVisibility,
    /// The tag's number within its family.
    pub tag: u32,
    /// The corners in AprilTag's order (counter-clockwise from the lower left as a viewer sees them); `None` if the
    /// depth Z is below `z_near`.
    ///
    /// For a depth Z of at least a millimetre, and up to 2^20 px from the optical axis: within
    /// `6 um (f + |u - c|) / Z + 2^-14 px (1 + |u - c| / f) + 2^-7 px` of the true u, and likewise for v. Saturates
    /// beyond 128 focal lengths from the axis (89.5 degrees).
    pub corners: [Option<Pixel>; 4],
    /// From the camera to the middle of the tag, micrometres, within [`LENGTH_ERROR_UM`]; `u32::MAX` if it is more than
    /// 110 m.
    pub d_um: u32,
    /// Cosine of the angle between the optical axis and the ray to the tag, 2^-30, within `11 um / d` and 2^-28. 0 if
    /// there is no angle: the tag is in the camera's centre, or more than 110 m away.
    pub cos_phi_q30: i32,
    /// Cosine of the angle between the tag's normal and the ray to the camera, as [`Self::cos_phi_q30`].
    pub cos_psi_q30: i32,
}
