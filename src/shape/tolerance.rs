//! Tolerances of tags, cameras and docks.

/// The largest error of a surveyed pose. A success set must hold for every pose within this tolerance.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tolerance {
    /// Metres, in any direction.
    pub translation: f64,
    /// Degrees: for a tag or a dock about the vertical, for a camera about any axis.
    pub turn_deg: f64,
}

/// The largest errors of a calibration's numbers. (Lens coefficients are assumed to be exact.)
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Intrinsics {
    /// Relative error of each focal length; below 1.
    pub focal: f64,
    /// Error of the optical axis along a row and along a column, pixels of the image that the detector reads.
    pub centre_px: f64,
}

impl Intrinsics {
    /// No error.
    pub const NONE: Self = Self {
        focal: 0.0,
        centre_px: 0.0,
    };

    /// Returns the largest distance of an image point from its position by the calibration, along a row and along a column,
    /// for an image of this size, pixels; rounded up. A focal error moves a point by that share of its distance from
    /// the optical axis.
    #[must_use]
    pub fn reach_px(&self, size_px: [f64; 2], axis_px: [f64; 2]) -> f64 {
        let farthest = [0, 1].map(|i| axis_px[i].abs().max((size_px[i] - axis_px[i]).abs()));
        (self.focal * farthest[0].max(farthest[1]) + self.centre_px) * (1.0 + 1e-12)
    }
}

/// The resolution that a detector needs to read a tag's bits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sharpness {
    /// Smallest width of a bit in the image, pixels.
    pub px_per_bit: f64,
    /// Bits along the black border's outer edge, including the border's own: 8 for tag36h11.
    pub bits: u32,
}

impl Tolerance {
    /// No tolerance.
    pub const NONE: Self = Self {
        translation: 0.0,
        turn_deg: 0.0,
    };

    /// Returns `true` if there is no tolerance.
    #[must_use]
    pub fn is_none(&self) -> bool {
        *self == Self::NONE
    }

    /// Returns the largest distance of a point from its surveyed position if it is `distance` metres from the centre of the
    /// object, metres; rounded up.
    #[must_use]
    pub fn reach(&self, distance: f64) -> f64 {
        let chord = 2.0 * libm::sin(0.5 * self.turn_deg.to_radians().min(core::f64::consts::PI));
        if self.is_none() {
            0.0
        } else {
            (self.translation + chord * distance) * (1.0 + 1e-12)
        }
    }
}
