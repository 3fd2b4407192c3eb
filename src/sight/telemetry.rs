//! Angles for a human to read. The only place of the core where floats are reckoned with, and they stay
//! here: these functions take what has been seen and give a number, and no other module names this one.
//!
//! `micromath` serves: its arc tangent is off by up to 2.8e-3 rad (0.16 degrees) and its square root by
//! 6 %, which is why neither may come near a decision (`tests/micromath.rs`). The root here is an integer's.

#![allow(
    clippy::float_arithmetic,
    reason = "telemetry; an answer is settled before an angle is told"
)]

use super::Sighting;
use micromath::F32;

impl Sighting {
    /// The angle between the optical axis and the ray to the tag, radians in `[0, pi]`, for telemetry.
    ///
    /// Within 3e-3 rad of the angle of [`Sighting::cos_phi_q30`]. Where the tag is nearly straight ahead that
    /// cosine, within `11 um / d`, tells the angle to `sqrt(22 um / d)` only.
    #[must_use]
    pub fn phi_rad_for_telemetry(&self) -> f32 {
        angle(self.cos_phi_q30)
    }

    /// The angle between the tag's normal and the ray to the camera, likewise.
    #[must_use]
    pub fn psi_rad_for_telemetry(&self) -> f32 {
        angle(self.cos_psi_q30)
    }
}

/// The angle of a cosine of 2^-30.
fn angle(cos_q30: i32) -> f32 {
    let cos = u64::from(cos_q30.unsigned_abs().min(1 << 30));
    let sin = (1u64 << 60).wrapping_sub(cos.wrapping_mul(cos)).isqrt();
    F32(sin as f32).atan2(F32(cos_q30 as f32)).0
}
