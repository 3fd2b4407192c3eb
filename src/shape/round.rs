//! Discs and ellipses: the position within a distance of a point. Tables are made with an inscribed polygon.

use super::planar::Planar;
use super::{BoxSet, Footprint, Shape};

/// A closed ellipse in the goal frame; a disc if both semi-axes are equal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Round {
    /// The centre, metres.
    pub centre: [f64; 2],
    /// The semi-axes along and across the turned axis, metres, above 0.
    pub axes: [f64; 2],
    /// The direction of the first semi-axis, degrees, counter-clockwise from the goal frame's x.
    pub turn_deg: f64,
}

/// Why an ellipse is not one that a set can use.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RoundError {
    /// A semi-axis is not above 0.
    #[error("a semi-axis is not a length above 0")]
    Axes,
    /// The corners of the inscribed polygon cannot be rounded into the ellipse.
    #[error("the ellipse is too thin, or too far from the goal for its size")]
    Far,
}

impl Round {
    /// The corners of the inscribed polygon. It contains every ellipse that is smaller by 0.49 %, and 99.3 % of the area.
    pub const CORNERS: u32 = 32;
    /// The share by which the polygon is smaller than one with its corners on the ellipse: more than their rounding.
    const SHRINK: f64 = 1e-9;
    /// A bound of the rounding of a corner, relative to the largest number in it.
    const ROUNDING: f64 = 1e-13;

    /// Returns the set of poses with their positions in the ellipse and their headings in an arc, degrees.
    ///
    /// # Errors
    /// [`RoundError`]
    pub fn set(self, yaw_deg: [f64; 2]) -> Result<Shape, RoundError> {
        if !self.axes.iter().all(|axis| *axis > 0.0 && axis.is_finite()) {
            return Err(RoundError::Axes);
        }
        let corners = self.corners().ok_or(RoundError::Far)?;
        let inner = Footprint::new(vec![[0.0; 2]], corners).map_err(|_| RoundError::Far)?;
        // The box bounds only the heading: the ellipse lies within its sides.
        let reach = 1.5 * self.axes[0].max(self.axes[1]);
        let side = |middle: f64| [middle - reach, middle + reach];
        let [x, y] = self.centre.map(side);
        Ok(Shape::All(vec![
            Shape::Footprint(inner.within_round(self)),
            Shape::Box(BoxSet { x, y, yaw_deg }),
        ]))
    }

    /// Returns the corners of the inscribed polygon, counter-clockwise; `None` if rounding could move one out of the ellipse.
    fn corners(&self) -> Option<Vec<[f64; 2]>> {
        let ([x, y], [a, b]) = (self.centre, self.axes);
        let largest = x.abs().max(y.abs()) + a + b;
        let shrink = Self::SHRINK + Self::ROUNDING * largest / a.min(b);
        // Not a number, or more than the loss of the polygon itself.
        if !(shrink < 1e-3) {
            return None;
        }
        let [c, s] = self.cos_sin();
        let corner = |k: u32| {
            let angle = core::f64::consts::TAU * f64::from(k) / f64::from(Self::CORNERS);
            let along = (1.0 - shrink) * a * libm::cos(angle);
            let across = (1.0 - shrink) * b * libm::sin(angle);
            [x + c * along - s * across, y + s * along + c * across]
        };
        Some((0..Self::CORNERS).map(corner).collect())
    }

    fn cos_sin(&self) -> [f64; 2] {
        <f64 as super::Scalar>::cos_sin_deg(self.turn_deg)
    }

    /// Returns a distance that a position may move in any direction within the ellipse; below 0 outside, where the ellipse is at least
    /// that far away. The exact distance from the border for a disc.
    pub(super) fn slack(&self, pose: &Planar<f64>) -> f64 {
        let [c, s] = self.cos_sin();
        let (dx, dy) = (pose.x - self.centre[0], pose.y - self.centre[1]);
        let [a, b] = self.axes;
        let (along, across) = (c * dx + s * dy, c * dy - s * dx);
        let less = a.min(b);
        less - libm::hypot(along * (less / a), across * (less / b))
    }

    /// Returns the name of the constraint.
    pub(super) fn name(&self) -> &'static str {
        if self.axes[0] == self.axes[1] {
            "disc"
        } else {
            "ellipse"
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::{PoseDeg, SuccessSet};

    fn set(round: Round) -> SuccessSet {
        SuccessSet {
            goal: PoseDeg {
                x: 0.0,
                y: 0.0,
                yaw_deg: 0.0,
            },
            shape: round.set([-4.0, 4.0]).unwrap(),
        }
    }

    /// The ellipse x' = 5 cm, y' = 3 cm, turned by 30 degrees about (0.1, -0.2): membership by its equation, and every corner of the
    /// polygon in it.
    #[test]
    fn ellipse_is_exact_and_its_polygon_inside() {
        let round = Round {
            centre: [0.1, -0.2],
            axes: [0.05, 0.03],
            turn_deg: 30.0,
        };
        let set = set(round);
        assert_eq!(set.shape.name(), "ellipse");
        let evaluator = set.evaluator();
        let (sin, cos) = 30f64.to_radians().sin_cos();
        let value = |[x, y]: [f64; 2]| {
            let (dx, dy) = (x - 0.1, y + 0.2);
            ((cos * dx + sin * dy) / 0.05).powi(2) + ((cos * dy - sin * dx) / 0.03).powi(2)
        };
        let mut counts = [0; 2];
        for k in -40..=40 {
            for l in -40..=40 {
                let at = [0.1 + 0.0015 * f64::from(k), -0.2 + 0.0015 * f64::from(l)];
                let inside = value(at) <= 1.0;
                counts[usize::from(inside)] += 1;
                assert_eq!(evaluator.contains([at[0], at[1], 0.06]), inside, "{at:?}");
                assert_eq!(set.membership([at[0], at[1], 0.06]).inside, inside);
                assert!(!evaluator.contains([at[0], at[1], 0.08]));
            }
        }
        assert!(counts.iter().all(|count| *count > 1000), "{counts:?}");
        let corners = round.corners().unwrap();
        assert!(corners.iter().all(|corner| value(*corner) < 1.0));
        assert!(corners.iter().all(|corner| value(*corner) > 1.0 - 1e-7));
    }

    #[test]
    fn polygon_has_almost_the_whole_disc() {
        let round = Round {
            centre: [0.0; 2],
            axes: [0.03; 2],
            turn_deg: 0.0,
        };
        let Shape::All(sets) = round.set([-4.0, 4.0]).unwrap() else {
            panic!("two sets");
        };
        let Shape::Footprint(inner) = &sets[0] else {
            panic!("a polygon");
        };
        let pose = |x: f64, y: f64| Planar {
            x,
            y,
            cos: 1.0,
            sin: 0.0,
        };
        for k in 0..100 {
            let (sin, cos) = f64::from(k).sin_cos();
            let at = |radius: f64| inner.depths(&pose(radius * cos, radius * sin))[0];
            assert!(at(0.03 * 0.9951) > 0.0);
            assert!(at(0.03 * 1.0001) < 0.0);
        }
    }

    #[test]
    fn far_and_thin_ellipses_are_refused() {
        for (centre, axes, error) in [
            ([0.0; 2], [0.0, 0.1], RoundError::Axes),
            ([0.0; 2], [0.1, f64::NAN], RoundError::Axes),
            ([0.0; 2], [1e12, 0.1], RoundError::Far),
            ([1e12, 0.0], [0.1, 0.1], RoundError::Far),
        ] {
            let round = Round {
                centre,
                axes,
                turn_deg: 0.0,
            };
            assert_eq!(round.set([-4.0, 4.0]), Err(error));
        }
    }
}
