//! Lens models: how a lens bends the rays of a pinhole camera.

use super::Scalar;

/// A number type for lens models: the operations that they need besides [`Scalar`].
pub trait Optic: Scalar {
    /// Returns `1 / self`.
    fn reciprocal(self) -> Self;

    /// Returns `atan(r) / r` as a function of `r^2`, 1 at 0: smooth where the root is not.
    fn arctangent_ratio(self) -> Self;
}

impl Optic for f64 {
    fn reciprocal(self) -> Self {
        1.0 / self
    }

    fn arctangent_ratio(self) -> Self {
        // Below this the ratio is 1 within rounding.
        if self < 1e-17 {
            return 1.0;
        }
        let r = libm::sqrt(self);
        libm::atan(r) / r
    }
}

/// A lens model with its coefficients, in the order of the ROS message CameraInfo and of OpenCV.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Lens {
    /// No distortion.
    Pinhole,
    /// `plumb_bob` (Brown-Conrady): k1, k2, p1, p2, k3.
    PlumbBob([f64; 5]),
    /// `rational_polynomial`: k1, k2, p1, p2, k3, k4, k5, k6.
    RationalPolynomial([f64; 8]),
    /// `equidistant` (Kannala-Brandt, OpenCV's fisheye): k1, k2, k3, k4.
    Equidistant([f64; 4]),
}

impl Lens {
    /// Returns the model's name in ROS; `none` for a pinhole.
    #[must_use]
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Pinhole => "none",
            Self::PlumbBob(_) => "plumb_bob",
            Self::RationalPolynomial(_) => "rational_polynomial",
            Self::Equidistant(_) => "equidistant",
        }
    }

    /// Returns the model's coefficients in ROS's order.
    #[must_use]
    pub const fn coefficients(&self) -> &[f64] {
        match self {
            Self::Pinhole => &[],
            Self::PlumbBob(all) => all,
            Self::RationalPolynomial(all) => all,
            Self::Equidistant(all) => all,
        }
    }

    /// Maps a normalised point `(X/Z, Y/Z)` of the optical frame (x right, y down) through the lens
    /// to a normalised point of the image. Focal lengths and optical axis convert that point to
    /// pixels.
    ///
    /// With `r^2 = x^2 + y^2` and `theta = atan r`: `plumb_bob` and `rational_polynomial` scale by
    /// `(1 + k1 r^2 + k2 r^4 + k3 r^6) / (1 + k4 r^2 + k5 r^4 + k6 r^6)` and add
    /// `(2 p1 x y + p2 (r^2 + 2 x^2), p1 (r^2 + 2 y^2) + 2 p2 x y)`; `equidistant` scales by
    /// `theta (1 + k1 theta^2 + k2 theta^4 + k3 theta^6 + k4 theta^8) / r`. (OpenCV: `projectPoints`,
    /// `fisheye::projectPoints`.) Meaningful only within [`Lens::field`].
    #[must_use]
    pub fn distort<S: Optic>(&self, [x, y]: [S; 2]) -> [S; 2] {
        if matches!(self, Self::Pinhole) {
            return [x, y];
        }
        let (xx, yy) = (x.square(), y.square());
        let rr = xx + yy;
        let scale = self.scale(rr);
        let [p1, p2] = self.tangential();
        if p1 == 0.0 && p2 == 0.0 {
            return [x * scale, y * scale];
        }
        let [p1, p2] = [p1, p2].map(S::exact);
        let two = S::exact(2.0);
        let xy = two * x * y;
        [
            x * scale + p1 * xy + p2 * (rr + two * xx),
            y * scale + p1 * (rr + two * yy) + p2 * xy,
        ]
    }

    /// Returns the factor of the radial part for a squared radius.
    pub(crate) fn scale<S: Optic>(&self, rr: S) -> S {
        match *self {
            Self::Pinhole => S::exact(1.0),
            Self::PlumbBob([k1, k2, _, _, k3]) => polynomial(&[k1, k2, k3], rr),
            Self::RationalPolynomial([k1, k2, _, _, k3, k4, k5, k6]) => {
                polynomial(&[k1, k2, k3], rr) * polynomial(&[k4, k5, k6], rr).reciprocal()
            }
            Self::Equidistant(all) => {
                let ratio = rr.arctangent_ratio();
                ratio * polynomial(&all, rr * ratio.square())
            }
        }
    }

    /// Returns p1 and p2.
    pub(crate) const fn tangential(&self) -> [f64; 2] {
        match *self {
            Self::PlumbBob([_, _, p1, p2, ..]) | Self::RationalPolynomial([_, _, p1, p2, ..]) => {
                [p1, p2]
            }
            Self::Pinhole | Self::Equidistant(_) => [0.0; 2],
        }
    }
}

/// Returns `1 + k1 t + k2 t^2 + ...`
fn polynomial<S: Scalar>(coefficients: &[f64], t: S) -> S {
    let zero = S::exact(0.0);
    let rest = coefficients
        .iter()
        .rev()
        .fold(zero, |sum, k| (sum + S::exact(*k)) * t);
    S::exact(1.0) + rest
}
