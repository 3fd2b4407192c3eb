//! What is not known exactly of a tag, a camera and a dock.

/// How far a surveyed pose may be off: a success set must hold for every pose within it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tolerance {
    /// Metres, in any direction.
    pub translation: f64,
    /// Degrees: of a tag or a dock about the vertical, of a camera about any axis.
    pub turn_deg: f64,
}

/// How far a calibration's numbers may be off. (Not its lens: coefficients count as exact.)
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Intrinsics {
    /// Each focal length, as a share of itself; below 1.
    pub focal: f64,
    /// The optical axis along a row and along a column, pixels of the image that the detector reads.
    pub centre_px: f64,
}

impl Intrinsics {
    /// Nothing is off.
    pub const NONE: Self = Self {
        focal: 0.0,
        centre_px: 0.0,
    };

    /// How far what is seen in an image of this size can be from where the calibration has it, along a row and along
    /// a column, pixels; rounded up. What is so many pixels from the optical axis moves by its share of them.
    #[must_use]
    pub fn reach_px(&self, size_px: [f64; 2], axis_px: [f64; 2]) -> f64 {
        let farthest = [0, 1].map(|i| axis_px[i].abs().max((size_px[i] - axis_px[i]).abs()));
        (self.focal * farthest[0].max(farthest[1]) + self.centre_px) * (1.0 + 1e-12)
    }
}

/// How finely a tag must be seen for its bits to be read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sharpness {
    /// Smallest width of a bit in the image, pixels.
    pub px_per_bit: f64,
    /// Bits along the black border's outer edge, the border's own included: 8 for tag36h11.
    pub bits: u32,
}

impl Tolerance {
    /// Nothing is off.
    pub const NONE: Self = Self {
        translation: 0.0,
        turn_deg: 0.0,
    };

    /// Whether nothing is off.
    #[must_use]
    pub fn is_none(&self) -> bool {
        *self == Self::NONE
    }

    /// How far a point at a distance (metres) from the middle of what is off can be from where it was
    /// surveyed, metres; rounded up.
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
