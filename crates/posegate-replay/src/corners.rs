//! Estimates the robot's pose and its covariance from the corners of known tags, for detectors that publish a
//! covariance of zeros.
//!
//! The result is the pose on the floor (x, y, yaw) that fits the projected corners to the observed ones with least
//! squares, in pixels. If the pixel errors are independent and normal with deviation sigma, its covariance is
//! `sigma^2 (J'J)^-1` to first order, J being the Jacobian of the projection there. If the tag is seen nearly head-on,
//! the valley of the least squares is curved and wider than that. The ellipsoid of the wanted confidence is then grown
//! until it holds every pose that fits within that confidence ([`Fix::grown`]). If tag or mount have a tolerance, the
//! ellipsoid is widened so that it holds the true pose for every place within them (`survey.rs`). A wrong calibration
//! or a tilted robot is not covered.
//!
//! A tag that is small in the image fits nearly as well in its mirrored orientation (a pose flip). If the pixels do not
//! distinguish the two poses, or fit no pose, [`locate`] returns no fix. [`locate_all`] returns both poses instead, each
//! with its own covariance, and follows the valley of the least squares for any curvature.
//!
//! ```
//! use posegate_replay::corners::{MountedCamera, TagObservation, locate};
//! use posegate_site::{SAMPLE, Site};
//! use posegate::shape::Tolerance;
//!
//! let site = Site::parse(SAMPLE, "site.toml")?;
//! let (front, tag) = (&site.cameras["front"], &site.tags["t7"]);
//! let camera = MountedCamera {
//!     camera: front.camera,
//!     mount: front.mount,
//!     mount_tolerance: Tolerance::NONE,
//! };
//! // The corners of a tag that is seen from 27 degrees off its normal, at 3.1 m, in pixels.
//! let corners_px = [[284.9, 269.1], [338.1, 270.4], [338.1, 209.6], [284.9, 210.9]];
//! let observation = TagObservation { tag: &tag.tag, tolerance: Tolerance::NONE, corners_px };
//! // Corners are detected to 0.3 px; pose-sets have epsilon = 0.99.
//! let fix = locate(&camera, &[observation], 0.3, 11.3449)?;
//! let [x, y, yaw] = fix.pose;
//! assert!((x - 1.0).abs() < 0.01 && (y + 1.5).abs() < 0.01 && (yaw - 0.45).abs() < 0.01);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use nalgebra::{IsometryMatrix3, Matrix3, Point3, Rotation3, Translation3, Vector3};
use posegate::gate::Reason;
use posegate::shape::{Camera, Mount, Pose3Deg, Tag, Tolerance};

mod solutions;
mod survey;
#[cfg(test)]
mod tests;

pub use self::solutions::locate_all;

/// A camera of the robot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MountedCamera {
    /// The image that the detector reads.
    pub camera: Camera,
    /// The pose of the camera on the robot.
    pub mount: Mount,
    /// The tolerance of `mount`; the rotation is about any axis.
    pub mount_tolerance: Tolerance,
}

/// An observation of a known tag.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TagObservation<'t> {
    /// The tag, with its pose in the world.
    pub tag: &'t Tag,
    /// The tolerance of the tag's pose; the rotation is about the vertical.
    pub tolerance: Tolerance,
    /// The tag's corners in AprilTag's order ([`posegate::shape::Sight`]), pixels.
    pub corners_px: [[f64; 2]; 4],
}

/// The robot's pose from observed tags.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fix {
    /// x, y (m) and yaw (rad) in the world frame.
    pub pose: [f64; 3],
    /// The covariance by rows, world axes: m^2, m rad, rad^2. With tolerances of tags and camera it is wider than that
    /// of the noise. The ellipsoid of `radius_squared` contains the true pose with the confidence of that radius.
    pub covariance: [[f64; 3]; 3],
    /// The factor between the covariance and its first-order approximation, before tolerances: at least 1. At most 4
    /// from [`locate`]; from [`locate_all`] the largest of all directions.
    pub grown: f64,
    /// The root mean square of the pixel residuals.
    pub rms_px: f64,
}

/// The reason why there is no fix.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, thiserror::Error)]
#[non_exhaustive]
pub enum FixError {
    /// No known tag was observed.
    #[error("no known tag")]
    NoTag,
    /// Corners or sigma are not finite, or sigma is not above zero.
    #[error("corners or sigma are not finite numbers")]
    NotFinite,
    /// No start converged to a pose with all corners in front of the camera.
    #[error("no pose fits")]
    NoPose,
    /// Poses that are far apart fit about equally well: the pixels do not distinguish them.
    #[error("poses far apart fit about as well")]
    Ambiguous,
    /// The residuals of the best pose are larger than pixel noise explains: another tag, or another calibration.
    #[error("the corners do not fit the tag")]
    Misfit,
}

impl FixError {
    /// Returns the reason's name in snake case.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::NoTag => "no_known_tag",
            Self::NotFinite => "corners_not_finite",
            Self::NoPose => "no_pose_fits",
            Self::Ambiguous => "ambiguous",
            Self::Misfit => "corners_do_not_fit",
        }
    }

    /// Returns the gate's reason for observed tags that give no pose; `None` if no known tag was observed, which is not a report.
    #[must_use]
    pub const fn reason(self) -> Option<Reason> {
        match self {
            Self::NoTag => None,
            Self::NotFinite => Some(Reason::TooFewCorners),
            Self::Ambiguous => Some(Reason::TagPosesAmbiguous),
            Self::NoPose | Self::Misfit => Some(Reason::CornersDoNotFit),
        }
    }
}

/// The widest valley of fits that counts as one pose, relative to its first-order covariance: that of [`locate`].
const WIDEST: f64 = 4.0;

/// Returns `true` if poses that are far apart fit: two poses, or all poses between them.
#[must_use]
pub fn is_ambiguous(fixes: &[Fix]) -> bool {
    fixes.len() > 1 || fixes.iter().any(|fix| fix.grown > WIDEST)
}

/// Number of directions from which the search starts.
const STARTS: u32 = 24;
/// Most iterations of one search.
const STEPS: u32 = 40;
/// Another pose must fit worse by at least this, as a difference of the sums of squares over sigma^2: a likelihood
/// 3,000 times smaller.
const CLEARER: f64 = 16.0;
/// Number of directions in which the cost is sampled around the fix, and of steps per direction up to twice the
/// ellipsoid's radius.
const RAYS: u32 = 192;
const RAY_STEPS: u32 = 24;
/// No pose may fit at these distances, in radii of the ellipsoid.
const BEYOND: [f64; 5] = [2.25, 2.5, 3.0, 4.0, 6.0];
/// Poses at least this far apart count as different, m and rad.
const APART: f64 = 1e-3;
/// Step of the finite differences for the Jacobian, m and rad.
const STEP: f64 = 1e-6;

/// Estimates the robot's pose. `sigma_px` is the standard deviation of each coordinate of a corner, pixels;
/// `radius_squared` is that of the pose-sets for which the covariance is used (11.3449 for confidence 0.99).
///
/// # Errors
/// [`FixError`].
pub fn locate(
    eye: &MountedCamera,
    seen: &[TagObservation<'_>],
    sigma_px: f64,
    radius_squared: f64,
) -> Result<Fix, FixError> {
    let view = View::checked(eye, seen, sigma_px, radius_squared)?;
    let found = view.minima();
    let (cost, pose) = *found.first().ok_or(FixError::NoPose)?;
    let variance = sigma_px * sigma_px;
    let other = found.iter().find(|(_, other)| apart(other, &pose) > APART);
    if cost > variance * misfit(8 * seen.len() - 3) {
        return Err(FixError::Misfit);
    }
    let clearer = clearer(radius_squared) * variance;
    if other.is_some_and(|(other, _)| other - cost < clearer) {
        return Err(FixError::Ambiguous);
    }
    let (information, _) = view.normal_equations(&pose).ok_or(FixError::NoPose)?;
    let covariance = information.cholesky().ok_or(FixError::NoPose)?.inverse() * variance;
    let level = cost + radius_squared * variance;
    let root = covariance.cholesky().ok_or(FixError::NoPose)?.unpack() * libm::sqrt(radius_squared);
    let grown = view.grown(&pose, &root, level).ok_or(FixError::Ambiguous)?;
    let balls = survey::balls(&view, eye, seen);
    let shifts = survey::shifts(&view, &pose, &balls).ok_or(FixError::NoPose)?;
    let covariance = survey::widened(covariance * grown, radius_squared, &shifts);
    let covariance = covariance.ok_or(FixError::NoPose)?;
    Ok(Fix::of(&pose, &covariance, grown, cost, seen.len()))
}

impl Fix {
    fn of(
        pose: &Vector3<f64>,
        covariance: &Matrix3<f64>,
        grown: f64,
        cost: f64,
        tags: usize,
    ) -> Self {
        Self {
            pose: [pose.x, pose.y, wrapped(pose.z)],
            covariance: [0, 1, 2].map(|row| [0, 1, 2].map(|column| covariance[(row, column)])),
            grown,
            rms_px: libm::sqrt(cost / (8 * tags) as f64),
        }
    }
}

/// Returns how much worse another pose must fit to be excluded, as a difference of the sums of squares over sigma^2.
fn clearer(radius_squared: f64) -> f64 {
    CLEARER.max(1.5 * radius_squared)
}

/// Returns the distance of two poses: metres and radians as one norm.
fn apart(a: &Vector3<f64>, b: &Vector3<f64>) -> f64 {
    let mut apart = a - b;
    apart.z = wrapped(apart.z);
    apart.norm()
}

/// Returns the value that a sum of squares over sigma^2 with this many degrees of freedom exceeds with probability 1
/// / 30,000: 4 standard deviations in the approximation of Wilson and Hilferty.
fn misfit(freedom: usize) -> f64 {
    let n = freedom as f64;
    let part = 2.0 / (9.0 * n);
    n * libm::pow(1.0 - part + 4.0 * libm::sqrt(part), 3.0)
}

/// Returns the derivatives from the residuals one [`STEP`] ahead and one behind.
fn slopes(ahead: &[f64], behind: &[f64]) -> Option<Vec<f64>> {
    let pairs = ahead.iter().zip(behind);
    let slopes: Vec<f64> = pairs.map(|(a, b)| (a - b) / (2.0 * STEP)).collect();
    slopes
        .iter()
        .all(|slope| slope.is_finite())
        .then_some(slopes)
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn wrapped(angle: f64) -> f64 {
    libm::atan2(libm::sin(angle), libm::cos(angle))
}

fn isometry(pose: &Pose3Deg) -> IsometryMatrix3<f64> {
    let [roll, pitch, yaw] = [pose.roll_deg, pose.pitch_deg, pose.yaw_deg].map(f64::to_radians);
    IsometryMatrix3::from_parts(
        Translation3::new(pose.x, pose.y, pose.z),
        Rotation3::from_euler_angles(roll, pitch, yaw),
    )
}

/// The tags' corners in the world and in the image.
#[derive(Clone)]
struct View<'e> {
    camera: &'e Camera,
    mount: IsometryMatrix3<f64>,
    corners: Vec<(Point3<f64>, [f64; 2])>,
}

impl<'e> View<'e> {
    /// Returns the view if there is a tag and all numbers are finite.
    fn checked(
        eye: &'e MountedCamera,
        seen: &[TagObservation<'_>],
        sigma_px: f64,
        radius_squared: f64,
    ) -> Result<Self, FixError> {
        if seen.is_empty() {
            return Err(FixError::NoTag);
        }
        let finite = seen
            .iter()
            .flat_map(|seen| seen.corners_px.as_flattened())
            .all(|pixel| pixel.is_finite());
        let positive = |value: f64| value > 0.0 && value.is_finite();
        if !(finite && positive(sigma_px) && positive(radius_squared)) {
            return Err(FixError::NotFinite);
        }
        Ok(Self::of(eye, seen))
    }

    /// Returns the local minima of the cost that are reached from all directions, best first. A minimum may occur
    /// several times.
    fn minima(&self) -> Vec<(f64, Vector3<f64>)> {
        let mut found: Vec<(f64, Vector3<f64>)> = (0..STARTS)
            .filter_map(|k| self.descended(self.start(f64::from(k) / f64::from(STARTS))?))
            .collect();
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        found
    }

    fn of(eye: &'e MountedCamera, seen: &[TagObservation<'_>]) -> Self {
        let corners = seen.iter().flat_map(|seen| {
            let half = 0.5 * seen.tag.size;
            let own = [[-half, -half], [half, -half], [half, half], [-half, half]];
            let place = isometry(&seen.tag.pose);
            let world = own.map(|[y, z]| place * Point3::new(0.0, y, z));
            world.into_iter().zip(seen.corners_px)
        });
        Self {
            camera: &eye.camera,
            mount: isometry(&eye.mount),
            corners: corners.collect(),
        }
    }

    /// Returns a start pose. The first tag is at its place in the image, at the distance that its size in the image
    /// gives, in a given direction of the world (turns).
    fn start(&self, turns: f64) -> Option<Vector3<f64>> {
        let tag = self.corners.get(..4)?;
        let middle = tag
            .iter()
            .fold(Vector3::zeros(), |sum, (p, _)| sum + p.coords)
            * 0.25;
        let pixel = |k: usize| tag.get(k).map(|(_, pixel)| *pixel);
        let diagonal = |a: usize, b: usize| {
            let ([ax, ay], [bx, by]) = (pixel(a)?, pixel(b)?);
            Some(libm::hypot(ax - bx, ay - by))
        };
        let length_px = diagonal(0, 2)?.max(diagonal(1, 3)?);
        let length = (tag.first()?.0 - tag.get(2)?.0).norm();
        let distance = (self.camera.fx * length / length_px.max(1e-3)).min(1e3);
        let columns: f64 = tag.iter().map(|(_, [u, _])| u).sum();
        let across = (0.25 * columns - self.camera.cx) / self.camera.fx;
        // The ray to the tag in the robot's frame, on the floor.
        let ray = self.mount.rotation * Vector3::new(1.0, -across, 0.0);
        let bearing = libm::atan2(ray.y, ray.x);
        let heading = turns * core::f64::consts::TAU;
        let rise = middle.z - self.mount.translation.z;
        let floor = libm::sqrt((distance * distance - rise * rise).max(0.01));
        let yaw = heading - bearing;
        let (sin, cos) = (libm::sin(yaw), libm::cos(yaw));
        let mount = self.mount.translation.vector;
        Some(Vector3::new(
            middle.x - floor * libm::cos(heading) - (cos * mount.x - sin * mount.y),
            middle.y - floor * libm::sin(heading) - (sin * mount.x + cos * mount.y),
            yaw,
        ))
    }

    /// Calls `take` with the residual of each corner's pixels at a pose, until it returns `None`. Returns `None` then, and if a corner
    /// is not in front of the camera.
    fn each_residual(
        &self,
        pose: &Vector3<f64>,
        mut take: impl FnMut([f64; 2]) -> Option<()>,
    ) -> Option<()> {
        let (sin, cos) = libm::sincos(pose.z);
        for (corner, [u, v]) in &self.corners {
            let (x, y) = (corner.x - pose.x, corner.y - pose.y);
            // In the robot's frame, then in the camera's.
            let robot = Point3::new(cos * x + sin * y, cos * y - sin * x, corner.z);
            let at = self.mount.inverse_transform_point(&robot);
            if !(at.x > 1e-3) {
                return None;
            }
            let [pu, pv] = self.camera.project([-at.y / at.x, -at.z / at.x]);
            take([pu - u, pv - v])?;
        }
        Some(())
    }

    /// As [`View::each_residual`], in one list.
    fn residuals(&self, pose: &Vector3<f64>) -> Option<Vec<f64>> {
        let mut residuals = Vec::with_capacity(2 * self.corners.len());
        self.each_residual(pose, |residual| {
            residuals.extend(residual);
            Some(())
        })?;
        Some(residuals)
    }

    /// Returns the sum of the squared residuals at a pose, px^2; `None` if it is not finite, or as for [`View::each_residual`].
    fn cost(&self, pose: &Vector3<f64>) -> Option<f64> {
        self.cost_below(pose, f64::INFINITY)
    }

    /// Returns the cost at a pose if it is less than `level`.
    fn cost_below(&self, pose: &Vector3<f64>, level: f64) -> Option<f64> {
        let mut cost = 0.0;
        self.each_residual(pose, |[u, v]| {
            cost = cost + u * u + v * v;
            (cost < level).then_some(())
        })?;
        Some(cost)
    }

    /// Returns the columns of the Jacobian of the residuals at a pose: by x, y and yaw.
    fn jacobian(&self, pose: &Vector3<f64>) -> Option<[Vec<f64>; 3]> {
        let column = |axis: usize| {
            let mut step = Vector3::zeros();
            step[axis] = STEP;
            slopes(
                &self.residuals(&(pose + step))?,
                &self.residuals(&(pose - step))?,
            )
        };
        Some([column(0)?, column(1)?, column(2)?])
    }

    /// Returns `J'J` and `J'e` at a pose.
    fn normal_equations(&self, pose: &Vector3<f64>) -> Option<(Matrix3<f64>, Vector3<f64>)> {
        let residuals = self.residuals(pose)?;
        let columns = self.jacobian(pose)?;
        let information = Matrix3::from_fn(|r, c| dot(&columns[r], &columns[c]));
        let gradient = Vector3::from_fn(|r, _| dot(&columns[r], &residuals));
        Some((information, gradient))
    }

    /// Returns the factor by which the covariance must grow so that its ellipsoid, with the axes `root`, contains
    /// every sampled pose whose cost is below a level. `None` if the factor would be above 4.
    fn grown(&self, pose: &Vector3<f64>, root: &Matrix3<f64>, level: f64) -> Option<f64> {
        let fits = |ray: &Vector3<f64>, radii: f64| {
            self.cost_below(&(pose + ray * radii), level).is_some()
        };
        let mut most = 1.0_f64;
        for k in 0..RAYS {
            // Evenly distributed over the sphere, by the golden angle.
            let height = 1.0 - (2.0 * f64::from(k) + 1.0) / f64::from(RAYS);
            let (across, turn) = (
                libm::sqrt(1.0 - height * height),
                2.399_963_23 * f64::from(k),
            );
            let ray =
                root * Vector3::new(across * libm::cos(turn), across * libm::sin(turn), height);
            if BEYOND.iter().any(|radii| fits(&ray, *radii)) {
                return None;
            }
            // From twice the radius inwards, in steps of an eighth of the squared radius.
            let share = |step: u32| 1.0 + 3.0 * f64::from(step) / f64::from(RAY_STEPS);
            let last = (0..=RAY_STEPS)
                .rev()
                .find(|step| fits(&ray, libm::sqrt(share(*step))));
            match last {
                Some(RAY_STEPS) => return None,
                Some(step) => most = most.max(share(step + 1)),
                None => {}
            }
        }
        Some(most)
    }

    /// Returns the local minimum reached from a start pose, with its cost (Levenberg and Marquardt).
    fn descended(&self, start: Vector3<f64>) -> Option<(f64, Vector3<f64>)> {
        let mut pose = start;
        let mut cost = self.cost(&pose)?;
        let mut damping = 1e-3;
        for _ in 0..STEPS {
            let (information, gradient) = self.normal_equations(&pose)?;
            let mut damped = information;
            for axis in 0..3 {
                damped[(axis, axis)] *= 1.0 + damping;
            }
            let step = damped.cholesky()?.solve(&gradient);
            let next = pose - step;
            match self.cost(&next) {
                Some(better) if better <= cost => {
                    (pose, cost) = (next, better);
                    damping *= 0.2;
                    if step.norm() < 1e-10 {
                        break;
                    }
                }
                _ => {
                    damping *= 5.0;
                    if damping > 1e9 {
                        break;
                    }
                }
            }
        }
        Some((cost, pose))
    }
}
