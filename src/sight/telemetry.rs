//! Angles for display. The only module of the core that calculates with floats: these functions turn a
//! sighting into a number, and no other module uses this one.
//!
//! `micromath` is enough for this. Its arc tangent is off by up to 2.8e-3 rad (0.16 degrees) and its square
//! root by 6 %, so neither may be used in a decision (`tests/micromath.rs`). The root here is an integer
//! root.

#![allow(
    clippy::float_arithmetic,
    reason = "telemetry; an answer is final before an angle is computed"
)]

use super::Sighting;
use micromath::F32;

impl Sighting {
    /// Returns the angle between the optical axis and the ray to the tag, radians in `[0, pi]`, for
    /// telemetry.
    ///
    /// Within 3e-3 rad of the angle of [`Sighting::cos_phi_q30`]. If the tag is nearly straight ahead, that
    /// cosine is within `11 um / d`, which determines the angle only to `sqrt(22 um / d)`.
    #[must_use]
    pub fn phi_rad_for_telemetry(&self) -> f32 {
        angle(self.cos_phi_q30)
    }

    /// Returns the angle between the tag's normal and the ray to the camera, likewise.
    #[must_use]
    pub fn psi_rad_for_telemetry(&self) -> f32 {
        angle(self.cos_psi_q30)
    }
}

/// Returns the angle of a cosine in units of 2^-30.
fn angle(cos_q30: i32) -> f32 {
    let cos = u64::from(cos_q30.unsigned_abs().min(1 << 30));
    let sin = (1u64 << 60).wrapping_sub(cos.wrapping_mul(cos)).isqrt();
    F32(sin as f32).atan2(F32(cos_q30 as f32)).0
}
