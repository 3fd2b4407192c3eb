//! Pose-sets in floats, for pictures: sections at a heading, and sample poses.

use posegate::set::{Estimate, InputError, PoseSet, RadiusSquared, Uncertainty};

/// A pose-set about an estimate, in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseSetF64 {
    /// The estimated pose: x, y (m), yaw (rad), world frame.
    pub estimate: [f64; 3],
    /// The uncertainty: a covariance in world axes, or a bound.
    pub spread: Uncertainty,
    /// The squared radius of a Gaussian set; unused for a bounded set.
    pub radius_squared: RadiusSquared,
}

/// Number of points of a section's border.
const AROUND: u32 = 48;
/// Number of rings of poses between the middle of a pose-set and its border.
const RINGS: u32 = 4;
/// Directions in each ring.
const DIRECTIONS: u32 = 480;

impl PoseSetF64 {
    /// Returns the pose-set in the gate's form.
    ///
    /// # Errors
    /// [`InputError`] if it is not a valid pose-set.
    pub fn pose_set(&self) -> Result<PoseSet, InputError> {
        let [x_m, y_m, yaw_rad] = self.estimate;
        let estimate = Estimate { x_m, y_m, yaw_rad };
        match self.spread {
            Uncertainty::Gaussian(covariance) => {
                PoseSet::gaussian(estimate, covariance, self.radius_squared)
            }
            Uncertainty::Bounded {
                translation_m,
                yaw_rad,
            } => PoseSet::bounded(estimate, translation_m, yaw_rad),
        }
    }

    /// Returns the set's half extents along x, y and yaw, world axes: m, m, rad.
    #[must_use]
    pub fn extents(&self) -> [f64; 3] {
        match self.spread {
            Uncertainty::Gaussian(p) => {
                [0, 1, 2].map(|i| libm::sqrt(p[i][i] * self.squared_radius()).max(0.0))
            }
            Uncertainty::Bounded {
                translation_m,
                yaw_rad,
            } => [translation_m, translation_m, yaw_rad],
        }
    }

    fn squared_radius(&self) -> f64 {
        f64::from(self.radius_squared.q16()) / 65_536.0
    }

    /// Returns the border of the set's projection onto the floor: points in the world, metres, counter-clockwise.
    #[must_use]
    pub fn projection(&self) -> Vec<[f64; 2]> {
        let [x, y, _] = self.estimate;
        let [a, b] = match self.spread {
            Uncertainty::Bounded { translation_m, .. } => {
                [[translation_m, 0.0], [0.0, translation_m]]
            }
            Uncertainty::Gaussian(p) => lower(
                [p[0][0], p[1][0], p[1][1]],
                libm::sqrt(self.squared_radius()),
            ),
        };
        let on_circle = |[c, s]: [f64; 2]| [x + a[0] * c, y + b[0] * c + b[1] * s];
        around().map(on_circle).collect()
    }

    /// Returns the border of the section at a world heading (rad): points in the world, metres, counter-clockwise. `None`
    /// if the set does not contain that heading.
    #[must_use]
    pub fn section(&self, yaw: f64) -> Option<Vec<[f64; 2]>> {
        let turn = core::f64::consts::TAU;
        let off = yaw - self.estimate[2];
        let off = off - turn * libm::round(off / turn);
        let [x, y, _] = self.estimate;
        match self.spread {
            // The tolerance includes a heading that is written as the end of the arc.
            Uncertainty::Bounded {
                translation_m: r,
                yaw_rad,
            } => (off.abs() <= yaw_rad + 1e-9)
                .then(|| around().map(|[c, s]| [x + r * c, y + r * s]).collect()),
            Uncertainty::Gaussian(p) => {
                // The conditional mean and covariance of the position, given the yaw.
                let rest = self.squared_radius() - off * off / p[2][2];
                if !(rest >= 0.0) {
                    return None;
                }
                let given = |i: usize, j: usize| p[i][j] - p[i][2] * p[j][2] / p[2][2];
                let [a, b] = lower([given(0, 0), given(1, 0), given(1, 1)], libm::sqrt(rest));
                let (x, y) = (x + p[0][2] / p[2][2] * off, y + p[1][2] / p[2][2] * off);
                Some(
                    around()
                        .map(|[c, s]| [x + a[0] * c, y + b[0] * c + b[1] * s])
                        .collect(),
                )
            }
        }
    }

    /// Returns poses of the set (world; m, m, rad): the estimate, the border, and rings between them.
    #[must_use]
    pub fn poses(&self) -> Vec<[f64; 3]> {
        let mut poses = std::vec![self.estimate];
        for ring in 1..=RINGS {
            let scale = f64::from(ring) / f64::from(RINGS);
            poses.extend(self.directions().map(|[dx, dy, dyaw]| {
                let [x, y, yaw] = self.estimate;
                [x + scale * dx, y + scale * dy, yaw + scale * dyaw]
            }));
        }
        poses
    }

    /// Returns poses on the set's border (world; m, m, rad).
    #[must_use]
    pub fn border(&self) -> Vec<[f64; 3]> {
        let [x, y, yaw] = self.estimate;
        let all = self.directions();
        all.map(|[dx, dy, dyaw]| [x + dx, y + dy, yaw + dyaw])
            .collect()
    }

    /// Yields the vectors from the estimate to the border.
    fn directions(&self) -> impl Iterator<Item = [f64; 3]> {
        let own = *self;
        let golden = core::f64::consts::PI * (3.0 - libm::sqrt(5.0));
        // A spiral over the sphere, both poles included.
        (0..DIRECTIONS).map(move |k| {
            let height = 1.0 - 2.0 * f64::from(k) / f64::from(DIRECTIONS - 1);
            let angle = golden * f64::from(k);
            let level = libm::sqrt((1.0 - height * height).max(0.0));
            let u = [level * libm::cos(angle), level * libm::sin(angle), height];
            match own.spread {
                Uncertainty::Bounded {
                    translation_m,
                    yaw_rad,
                } => {
                    // Map the sphere to the cylinder around it.
                    let out = 1.0 / level.max(height.abs());
                    let r = translation_m * out;
                    [r * u[0], r * u[1], yaw_rad * out * u[2]]
                }
                Uncertainty::Gaussian(p) => {
                    let r = libm::sqrt(own.squared_radius());
                    let yaw = libm::sqrt(p[2][2]);
                    let given = |i: usize, j: usize| p[i][j] - p[i][2] * p[j][2] / p[2][2];
                    let [a, b] = lower([given(0, 0), given(1, 0), given(1, 1)], r);
                    let (tx, ty) = (p[0][2] / yaw * r, p[1][2] / yaw * r);
                    [
                        tx * u[2] + a[0] * u[0],
                        ty * u[2] + b[0] * u[0] + b[1] * u[1],
                        yaw * r * u[2],
                    ]
                }
            }
        })
    }
}

/// Yields points of the unit circle, counter-clockwise.
fn around() -> impl Iterator<Item = [f64; 2]> {
    (0..AROUND).map(|k| {
        let angle = f64::from(k) / f64::from(AROUND) * core::f64::consts::TAU;
        [libm::cos(angle), libm::sin(angle)]
    })
}

/// Returns the rows of the lower triangular root of a 2x2 covariance (xx, xy, yy), times a scale.
fn lower([xx, xy, yy]: [f64; 3], scale: f64) -> [[f64; 2]; 2] {
    let a = libm::sqrt(xx.max(1e-24));
    let b = xy / a;
    let c = libm::sqrt((yy - b * b).max(0.0));
    [[scale * a, 0.0], [scale * b, scale * c]]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gaussian() -> PoseSetF64 {
        PoseSetF64 {
            estimate: [1.0, -2.0, 3.1],
            spread: Uncertainty::Gaussian([
                [0.04, 0.012, 0.002],
                [0.012, 0.09, -0.004],
                [0.002, -0.004, 0.0016],
            ]),
            radius_squared: RadiusSquared::from_q16(11 << 16).unwrap(),
        }
    }

    /// Returns `e' P^-1 e` by Cramer's rule: a method that the drawing does not use.
    fn squared(e: [f64; 3], p: [[f64; 3]; 3]) -> f64 {
        let det = |m: [[f64; 3]; 3]| {
            m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1])
                - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0])
                + m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0])
        };
        let solved = [0, 1, 2].map(|column| {
            let mut m = p;
            (0..3).for_each(|row| m[row][column] = e[row]);
            det(m) / det(p)
        });
        (0..3).map(|i| e[i] * solved[i]).sum()
    }

    #[test]
    fn sections_and_borders_are_on_the_ellipsoid() {
        let belief = gaussian();
        let Uncertainty::Gaussian(p) = belief.spread else {
            unreachable!()
        };
        let off = |pose: [f64; 3]| [0, 1, 2].map(|i| pose[i] - belief.estimate[i]);
        // Also at headings beyond pi: the heading is wrapped.
        for yaw in [3.1, 3.15, 3.2 - core::f64::consts::TAU, 3.0] {
            let turned = yaw
                + if yaw < 0.0 {
                    core::f64::consts::TAU
                } else {
                    0.0
                };
            let section = belief.section(yaw).unwrap();
            for [x, y] in &section {
                let r2 = squared(off([*x, *y, turned]), p);
                assert!((r2 / 11.0 - 1.0).abs() < 1e-9, "{yaw}: {r2}");
            }
        }
        assert!(belief.section(3.1 + 0.04 * 3.32).is_none());
        for pose in belief.border() {
            assert!((squared(off(pose), p) / 11.0 - 1.0).abs() < 1e-9);
        }
        for pose in belief.poses() {
            assert!(squared(off(pose), p) < 11.0 + 1e-6);
        }
    }

    /// No pose of the set is beside its projection, and each border of the projection is reached.
    #[test]
    fn projection_is_the_sets_shadow() {
        let belief = gaussian();
        let shadow = belief.projection();
        for angle in (0..36).map(|k| f64::from(k) / 36.0 * core::f64::consts::TAU) {
            let [c, s] = [libm::cos(angle), libm::sin(angle)];
            let farthest = |points: &mut dyn Iterator<Item = [f64; 2]>| {
                points.fold(f64::NEG_INFINITY, |most, [x, y]| most.max(c * x + s * y))
            };
            let of_set = farthest(&mut belief.border().into_iter().map(|[x, y, _]| [x, y]));
            let of_shadow = farthest(&mut shadow.iter().copied());
            assert!(
                (of_set - of_shadow).abs() < 0.02,
                "{angle}: {of_set} {of_shadow}"
            );
        }
    }

    #[test]
    fn bounded_set_is_a_cylinder() {
        let belief = PoseSetF64 {
            estimate: [1.0, 2.0, 0.0],
            spread: Uncertainty::Bounded {
                translation_m: 0.5,
                yaw_rad: 0.1,
            },
            ..gaussian()
        };
        assert!(belief.section(0.11).is_none());
        let section = belief.section(-0.1).unwrap();
        let away = |x: f64, y: f64| libm::hypot(x - 1.0, y - 2.0);
        assert!(
            section
                .iter()
                .all(|[x, y]| (away(*x, *y) - 0.5).abs() < 1e-12)
        );
        let (mut sides, mut ends) = (0, 0);
        for [x, y, yaw] in belief.border() {
            let (side, end) = (away(x, y) - 0.5, yaw.abs() - 0.1);
            assert!(side < 1e-12 && end < 1e-12);
            assert!(side.max(end) > -1e-12);
            sides += i32::from(side > -1e-12);
            ends += i32::from(end > -1e-12);
        }
        assert!(sides > 100 && ends > 50, "{sides} {ends}");
    }
}
