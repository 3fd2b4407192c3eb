//! Where the robot is by the corners of known tags, and how well: for detectors that publish a covariance of zeros.
//!
//! The pose on the floor (x, y, yaw) that brings the projected corners nearest to the seen ones, in the least squares
//! of pixels. With pixels whose errors are independent and normal with deviation sigma, its covariance is
//! `sigma^2 (J'J)^-1`, J the Jacobian of the projection there: to first order, which the test holds against
//! simulated noise. Only the noise of pixels is in it: a tag that hangs elsewhere, a wrong calibration or a robot
//! that is tilted is not.
//!
//! A tag that is small in the image fits nearly as well as if it looked the other way (a pose flip). Where the
//! pixels do not tell the two apart, or fit no pose, there is no fix.

use crate::shape::{Camera, Mount, Pose3Deg, Tag};
use nalgebra::{Isometry3, Matrix3, Point3, Translation3, UnitQuaternion, Vector3};
use std::vec::Vec;

/// A camera of the robot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Eye {
    /// The image that the detector reads.
    pub camera: Camera,
    /// The camera on the robot.
    pub mount: Mount,
}

/// A known tag as it was seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seen<'t> {
    /// The tag in the world.
    pub tag: &'t Tag,
    /// Its corners in AprilTag's order, pixels.
    pub corners_px: [[f64; 2]; 4],
}

/// The robot's pose by tags.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fix {
    /// x, y (m) and yaw (rad) in the world frame.
    pub pose: [f64; 3],
    /// Its covariance, by rows, world axes.
    pub covariance: [[f64; 3]; 3],
    /// The root of the mean square of what is left of the pixels.
    pub rms_px: f64,
}

/// Why there is no fix.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, thiserror::Error)]
#[non_exhaustive]
pub enum NoFix {
    /// No known tag was seen.
    #[error("no known tag")]
    NoTag,
    /// Corners or sigma are no numbers, or sigma is not above zero.
    #[error("corners or sigma are not finite numbers")]
    NotFinite,
    /// No pose brings the corners before the camera and to rest.
    #[error("no pose fits")]
    NoPose,
    /// Two poses fit about as well: the pixels do not tell them apart.
    #[error("two poses fit about as well")]
    Ambiguous,
    /// The best pose leaves more than the noise of pixels can: another tag, or another calibration.
    #[error("the corners do not fit the tag")]
    Misfit,
}

impl NoFix {
    /// Its name, in snake case.
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
}

/// Directions from which the search starts.
const STARTS: u32 = 24;
/// Steps of one search.
const STEPS: u32 = 40;
/// The other pose must fit worse by so much, as a difference of the sums of squares over sigma^2: a likelihood
/// 3,000 times smaller.
const CLEARER: f64 = 16.0;
/// How far apart two poses are at least that are not one, m and rad.
const APART: f64 = 1e-3;
/// The step of the differences that make the Jacobian, m and rad.
const STEP: f64 = 1e-6;

/// Finds the robot. `sigma_px` is the deviation of each coordinate of a corner, pixels.
///
/// # Errors
/// [`NoFix`].
pub fn locate(eye: &Eye, seen: &[Seen<'_>], sigma_px: f64) -> Result<Fix, NoFix> {
    let view = View::of(eye, seen);
    if seen.is_empty() {
        return Err(NoFix::NoTag);
    }
    let finite = seen
        .iter()
        .flat_map(|seen| seen.corners_px.as_flattened())
        .all(|pixel| pixel.is_finite());
    if !(finite && sigma_px > 0.0 && sigma_px.is_finite()) {
        return Err(NoFix::NotFinite);
    }
    let mut found: Vec<(f64, Vector3<f64>)> = (0..STARTS)
        .filter_map(|k| view.descended(view.start(f64::from(k) / f64::from(STARTS))?))
        .collect();
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (cost, pose) = *found.first().ok_or(NoFix::NoPose)?;
    let variance = sigma_px * sigma_px;
    let other = found.iter().find(|(_, other)| {
        let mut apart = other - pose;
        apart.z = wrapped(apart.z);
        apart.norm() > APART
    });
    if cost > variance * misfit(8 * seen.len() - 3) {
        return Err(NoFix::Misfit);
    }
    if other.is_some_and(|(other, _)| other - cost < CLEARER * variance) {
        return Err(NoFix::Ambiguous);
    }
    let (information, _) = view.normal_equations(&pose).ok_or(NoFix::NoPose)?;
    let covariance = information.cholesky().ok_or(NoFix::NoPose)?.inverse() * variance;
    let rows = [0, 1, 2].map(|row| [0, 1, 2].map(|column| covariance[(row, column)]));
    Ok(Fix {
        pose: [pose.x, pose.y, wrapped(pose.z)],
        covariance: rows,
        rms_px: libm::sqrt(cost / (8 * seen.len()) as f64),
    })
}

/// What a sum of squares over sigma^2 with so many degrees of freedom exceeds once in 30,000 times: 4 deviations by
/// the approximation of Wilson and Hilferty.
fn misfit(freedom: usize) -> f64 {
    let n = freedom as f64;
    let part = 2.0 / (9.0 * n);
    n * libm::pow(1.0 - part + 4.0 * libm::sqrt(part), 3.0)
}

fn wrapped(angle: f64) -> f64 {
    libm::atan2(libm::sin(angle), libm::cos(angle))
}

fn isometry(pose: &Pose3Deg) -> Isometry3<f64> {
    let [roll, pitch, yaw] = [pose.roll_deg, pose.pitch_deg, pose.yaw_deg].map(f64::to_radians);
    Isometry3::from_parts(
        Translation3::new(pose.x, pose.y, pose.z),
        UnitQuaternion::from_euler_angles(roll, pitch, yaw),
    )
}

/// Corners in the world and in the image.
struct View<'e> {
    camera: &'e Camera,
    mount: Isometry3<f64>,
    corners: Vec<(Point3<f64>, [f64; 2])>,
}

impl<'e> View<'e> {
    fn of(eye: &'e Eye, seen: &[Seen<'_>]) -> Self {
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

    /// A pose to start from: the first tag as far as its size says, where the image has it, in a direction of the
    /// world (in turns).
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

    /// What is left of each corner's pixels at a pose; `None` where one is not before the camera.
    fn residuals(&self, pose: &Vector3<f64>) -> Option<Vec<f64>> {
        let robot = Isometry3::from_parts(
            Translation3::new(pose.x, pose.y, 0.0),
            UnitQuaternion::from_euler_angles(0.0, 0.0, pose.z),
        );
        let to_mount = (robot * self.mount).inverse();
        let mut left = Vec::with_capacity(2 * self.corners.len());
        for (corner, [u, v]) in &self.corners {
            let at = to_mount * corner;
            if !(at.x > 1e-3) {
                return None;
            }
            let [pu, pv] = self.camera.project([-at.y / at.x, -at.z / at.x]);
            left.extend([pu - u, pv - v]);
        }
        Some(left)
    }

    fn cost(&self, pose: &Vector3<f64>) -> Option<f64> {
        let left = self.residuals(pose)?;
        let cost: f64 = left.iter().map(|value| value * value).sum();
        cost.is_finite().then_some(cost)
    }

    /// `J'J` and `J'e` at a pose.
    fn normal_equations(&self, pose: &Vector3<f64>) -> Option<(Matrix3<f64>, Vector3<f64>)> {
        let left = self.residuals(pose)?;
        let mut columns = Vec::with_capacity(3);
        for axis in 0..3 {
            let mut step = Vector3::zeros();
            step[axis] = STEP;
            let (ahead, behind) = (
                self.residuals(&(pose + step))?,
                self.residuals(&(pose - step))?,
            );
            let slopes = ahead
                .iter()
                .zip(&behind)
                .map(|(a, b)| (a - b) / (2.0 * STEP));
            columns.push(slopes.collect::<Vec<f64>>());
        }
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let information = Matrix3::from_fn(|r, c| dot(&columns[r], &columns[c]));
        let gradient = Vector3::from_fn(|r, _| dot(&columns[r], &left));
        Some((information, gradient))
    }

    /// The minimum that is reached from a pose, with its cost (Levenberg and Marquardt).
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

#[cfg(test)]
mod tests {
    use super::*;

    fn eye() -> Eye {
        Eye {
            camera: Camera::pinhole([640.0, 480.0], [615.0, 615.0], [320.0, 240.0]),
            mount: Pose3Deg {
                x: 0.25,
                y: 0.05,
                z: 0.5,
                roll_deg: 0.0,
                pitch_deg: -5.0,
                yaw_deg: 10.0,
            },
        }
    }

    fn tag(x: f64, y: f64, yaw_deg: f64) -> Tag {
        Tag {
            id: 7,
            size: 0.3,
            pose: Pose3Deg {
                x,
                y,
                z: 0.6,
                roll_deg: 0.0,
                pitch_deg: 0.0,
                yaw_deg,
            },
        }
    }

    /// The corners that the camera sees from a pose, each moved by what `noise` says.
    fn corners(
        eye: &Eye,
        tag: &Tag,
        pose: [f64; 3],
        noise: &mut impl FnMut() -> f64,
    ) -> [[f64; 2]; 4] {
        let blank = Seen {
            tag,
            corners_px: [[0.0; 2]; 4],
        };
        let view = View::of(eye, &[blank]);
        let pixels = view.residuals(&Vector3::from(pose)).unwrap();
        core::array::from_fn(|k| [pixels[2 * k] + noise(), pixels[2 * k + 1] + noise()])
    }

    /// Normal noise by Box and Muller over xorshift.
    fn normal(seed: u64) -> impl FnMut() -> f64 {
        let mut state = seed;
        let mut uniform = move || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            ((state >> 11) as f64 + 0.5) / 9_007_199_254_740_992.0
        };
        move || {
            let (a, b) = (uniform(), uniform());
            libm::sqrt(-2.0 * libm::log(a)) * libm::cos(core::f64::consts::TAU * b)
        }
    }

    /// The image of Reference set A's camera and tag by hand: straight ahead the tag is a square of 615 * 0.3 / 3.75
    /// pixels about the middle, and its first corner the bottom left one.
    #[test]
    fn corners_are_where_they_are_by_hand() {
        let eye = Eye {
            mount: Pose3Deg {
                x: 0.25,
                y: 0.0,
                z: 0.5,
                roll_deg: 0.0,
                pitch_deg: 0.0,
                yaw_deg: 0.0,
            },
            ..eye()
        };
        let mut ahead = tag(4.0, 0.0, 180.0);
        ahead.pose.z = 0.5;
        let seen = corners(&eye, &ahead, [0.0; 3], &mut || 0.0);
        let half = 0.5 * 615.0 * 0.3 / 3.75;
        let by_hand = [[-half, half], [half, half], [half, -half], [-half, -half]];
        for ([u, v], [du, dv]) in seen.iter().zip(by_hand) {
            assert!(
                (u - 320.0 - du).abs() < 1e-9 && (v - 240.0 - dv).abs() < 1e-9,
                "{seen:?}"
            );
        }
    }

    #[test]
    fn exact_corners_give_the_pose_back() {
        let eye = eye();
        for (pose, tag) in [
            ([0.0, 0.0, 0.0], tag(2.0, 0.8, 205.0)),
            ([1.0, -2.0, 2.9], tag(-1.0, -1.2, -50.0)),
            ([3.0, 1.0, -1.5], tag(3.0, -1.0, 60.0)),
        ] {
            let seen = Seen {
                tag: &tag,
                corners_px: corners(&eye, &tag, pose, &mut || 0.0),
            };
            let fix = locate(&eye, &[seen], 0.2).unwrap();
            for (got, wanted) in fix.pose.iter().zip(pose) {
                assert!((got - wanted).abs() < 1e-6, "{:?} for {pose:?}", fix.pose);
            }
            assert!(fix.rms_px < 1e-6);
        }
    }

    /// 4,000 noisy looks each: the covariance that is told is that of the fixes, and e' P^-1 e is 3 on average.
    #[test]
    fn the_covariance_is_that_of_simulated_noise() {
        let eye = eye();
        let pose = [0.3, -0.2, 0.1];
        let (one, two) = (tag(2.2, 0.5, 215.0), tag(2.4, -0.1, 150.0));
        for (tags, sigma, seed) in [(&[one][..], 0.3, 1), (&[one, two][..], 0.5, 2)] {
            let rounds = 4000;
            let mut noise = normal(0x9e37_79b9_7f4a_7c15 + seed);
            let mut scaled = || sigma * noise();
            let mut sum = Matrix3::<f64>::zeros();
            let mut told = Matrix3::<f64>::zeros();
            let mut nees = 0.0;
            for _ in 0..rounds {
                let seen: Vec<Seen<'_>> = tags
                    .iter()
                    .map(|tag| Seen {
                        tag,
                        corners_px: corners(&eye, tag, pose, &mut scaled),
                    })
                    .collect();
                let fix = locate(&eye, &seen, sigma).unwrap();
                let covariance = Matrix3::from_fn(|r, c| fix.covariance[r][c]);
                let error = Vector3::from_fn(|r, _| fix.pose[r] - pose[r]);
                sum += error * error.transpose();
                told += covariance;
                nees += (covariance.try_inverse().unwrap() * error).dot(&error);
            }
            let (sum, told) = (sum / f64::from(rounds), told / f64::from(rounds));
            // A variance of 4,000 draws is known to 2.2 % (one deviation).
            for axis in 0..3 {
                let ratio = sum[(axis, axis)] / told[(axis, axis)];
                assert!((ratio - 1.0).abs() < 0.09, "axis {axis}: {ratio}");
            }
            for (r, c) in [(0, 1), (0, 2), (1, 2)] {
                let size = libm::sqrt(told[(r, r)] * told[(c, c)]);
                assert!((sum[(r, c)] - told[(r, c)]).abs() < 0.09 * size, "{r} {c}");
            }
            // Its deviation is sqrt(6 / 4,000).
            let mean = nees / f64::from(rounds);
            assert!((mean - 3.0).abs() < 0.16, "{mean}");
        }
    }

    /// Far away and face-on the two ways in which the tag can look are within the noise.
    #[test]
    fn poses_that_pixels_do_not_tell_apart_are_no_fix() {
        let eye = eye();
        let far = tag(6.0, 1.2, 190.0);
        let mut noise = normal(77);
        let mut ambiguous = 0;
        for _ in 0..20 {
            let seen = Seen {
                tag: &far,
                corners_px: corners(&eye, &far, [0.0; 3], &mut || 0.5 * noise()),
            };
            ambiguous += u32::from(locate(&eye, &[seen], 0.5) == Err(NoFix::Ambiguous));
        }
        assert!(ambiguous >= 15, "{ambiguous}");
    }

    #[test]
    fn what_does_not_fit_is_told() {
        let eye = eye();
        let near = tag(2.0, 0.4, 205.0);
        let mut pixels = corners(&eye, &near, [0.0; 3], &mut || 0.0);
        assert_eq!(locate(&eye, &[], 0.3), Err(NoFix::NoTag));
        pixels[2] = [pixels[2][0] + 40.0, pixels[2][1] - 15.0];
        let seen = |corners_px| Seen {
            tag: &near,
            corners_px,
        };
        assert_eq!(locate(&eye, &[seen(pixels)], 0.3), Err(NoFix::Misfit));
        pixels[0][0] = f64::NAN;
        assert_eq!(locate(&eye, &[seen(pixels)], 0.3), Err(NoFix::NotFinite));
        let good = corners(&eye, &near, [0.0; 3], &mut || 0.0);
        for sigma in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert_eq!(locate(&eye, &[seen(good)], sigma), Err(NoFix::NotFinite));
        }
    }
}
