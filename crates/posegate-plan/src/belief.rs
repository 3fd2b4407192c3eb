//! The pose estimate's uncertainty between two steps, in floats: the definition that the core's integers
//! never fall below.

use nalgebra::{Matrix2, Matrix3};

use posegate::set::Estimate;
use posegate::shape::Tolerance;
use posegate::task::{Ends, Leg, Odometry, travel};
use posegate_site::{DriveModel, StartUncertainty};

/// Knowledge of the pose between two steps of a chain, in floats: metres and radians.
#[derive(Clone, Debug, PartialEq)]
pub struct BeliefStateF64 {
    /// Intended pose of the estimate: x, y (m), yaw (rad) in the world.
    pub pose: [f64; 3],
    /// Largest distance of the estimate from the intended pose: translation (m), yaw (rad).
    pub spread: [f64; 2],
    /// Bound of the error about the estimate: translation (m), yaw (rad).
    pub certain: [f64; 2],
    /// The probability that the error exceeds `certain`.
    pub doubt: f64,
    /// The normally distributed part of the error; `None` if there is no such part.
    pub random: Option<Random>,
}

/// A normally distributed error.
#[derive(Clone, Debug, PartialEq)]
pub struct Random {
    /// World axes: m^2, m rad, rad^2.
    pub covariance: Matrix3<f64>,
    /// The confidence of its set.
    pub epsilon: f64,
    /// The squared radius of its set.
    pub radius_squared: f64,
}

impl BeliefStateF64 {
    /// Creates the belief from the start of a site file.
    #[must_use]
    pub fn at_start(pose: [f64; 3], spread: Tolerance, known: &StartUncertainty) -> Self {
        let (certain, random) = match known {
            StartUncertainty::Bounded {
                translation,
                yaw_deg,
            } => ([*translation, yaw_deg.to_radians()], None),
            StartUncertainty::Gaussian {
                covariance,
                epsilon,
            } => {
                let covariance = Matrix3::from_fn(|row, column| covariance[row][column]);
                ([0.0, 0.0], Some(Random::new(covariance, *epsilon)))
            }
        };
        Self {
            pose,
            spread: [spread.translation, spread.turn_deg.to_radians()],
            certain,
            doubt: 0.0,
            random,
        }
    }

    /// Returns the cylinder that encloses the complete error: translation (m), yaw (rad).
    #[must_use]
    pub fn enclosing(&self) -> [f64; 2] {
        let [rho, alpha] = self.certain;
        let Some(random) = &self.random else {
            return self.certain;
        };
        let plane: Matrix2<f64> = random.covariance.fixed_view::<2, 2>(0, 0).into();
        let longest = plane.symmetric_eigen().eigenvalues.max().max(0.0);
        let r2 = random.radius_squared;
        [
            rho + libm::sqrt(r2 * longest),
            alpha + libm::sqrt(r2 * random.covariance[(2, 2)].max(0.0)),
        ]
    }

    /// Returns the probability that the true pose is outside of the set.
    #[must_use]
    pub fn risk(&self) -> f64 {
        self.doubt + self.random.as_ref().map_or(0.0, |r| 1.0 - r.epsilon)
    }

    /// Returns the belief after a localization with this error bound: translation (m), yaw (rad).
    #[must_use]
    pub fn localized(&self, [translation, yaw]: [f64; 2]) -> Self {
        let [rho, alpha] = self.enclosing();
        Self {
            pose: self.pose,
            spread: [
                self.spread[0] + rho + translation,
                self.spread[1] + alpha + yaw,
            ],
            certain: [translation, yaw],
            doubt: 0.0,
            random: None,
        }
    }

    /// Returns the belief after a drive. The drive begins up to `off` (m, rad) from its path and ends
    /// within the controller's tolerance of the path's end. The added error is bounded for every such drive.
    #[must_use]
    pub fn driven(
        &self,
        from: &Estimate,
        legs: &[Leg],
        model: &DriveModel,
        epsilon: f64,
        off: [f64; 2],
        controller: Tolerance,
    ) -> Self {
        let left = [controller.translation, controller.turn_deg.to_radians()];
        let ends = Ends {
            start: off,
            end: left,
        };
        let path = travel(from, legs, &ends);
        let to = [path.to.x_m, path.to.y_m, path.to.yaw_rad];
        let after = |certain, doubt, random| Self {
            pose: to,
            spread: left,
            certain,
            doubt,
            random,
        };
        match model {
            DriveModel::Bounded(drift) => after(
                drift.grow(path.length_m, path.turning_rad, self.enclosing()),
                self.risk(),
                None,
            ),
            DriveModel::Gaussian(odometry) => {
                let chord = libm::hypot(to[0] - from.x_m, to[1] - from.y_m);
                let [rho, alpha] = self.certain;
                let half = alpha.min(core::f64::consts::PI) / 2.0;
                let swung = 2.0 * (chord + ends.away()) * libm::sin(half);
                let known = self.random.as_ref();
                let covariance = match known {
                    None => odometry.noise(from, legs, &ends),
                    Some(random) => grown(odometry, &random.covariance, from, legs, &ends),
                };
                let epsilon = known.map_or(epsilon, |random| random.epsilon);
                let random = Random::new(covariance, epsilon);
                after([rho + swung, alpha], self.doubt, Some(random))
            }
        }
    }
}

impl Random {
    fn new(covariance: Matrix3<f64>, epsilon: f64) -> Self {
        Self {
            covariance,
            epsilon,
            radius_squared: posegate::confidence::radius_squared(epsilon).unwrap_or(f64::INFINITY),
        }
    }
}

/// Returns a covariance after a path that begins near its nominal start. It dominates the covariance of every such
/// path.
fn grown(
    odometry: &Odometry,
    covariance: &Matrix3<f64>,
    from: &Estimate,
    legs: &[Leg],
    ends: &Ends,
) -> Matrix3<f64> {
    let still = Odometry {
        a1: 0.0,
        a2: 0.0,
        a3: 0.0,
        a4: 0.0,
    };
    let carried = still.grow(*covariance, from, legs);
    let noise = odometry.noise(from, legs, ends);
    let away = ends.away();
    if away <= 0.0 {
        return carried + noise;
    }
    let swung = away * away * covariance[(2, 2)];
    let across = carried[(0, 0)] + carried[(1, 1)];
    let p = libm::sqrt(swung / across.max(f64::MIN_POSITIVE)).clamp(1e-6, 1e6);
    let across = swung * (1.0 + 1.0 / p);
    carried * (1.0 + p)
        + noise
        + Matrix3::from_diagonal(&nalgebra::Vector3::new(across, across, 0.0))
}
