//! Poses around a scene and a digest of their sightings, which must be the same on every core.
#![allow(dead_code)] // Firmware includes this file by path, and uses a part.

use posegate::num::BinaryAngle;
use posegate::pose::Pose;
use posegate::sight::{Sighting, TagVisibility};

/// Number of poses.
pub const LOOKS: u32 = 4_000;
/// The digest of their sightings in the scene of `examples/tables/see-t7.posegate`.
pub const SEE_T7: u32 = 0xffc6_7be1;

/// An iterator over poses within 5 m of the origin of the world.
pub struct Looks(u32);

impl Looks {
    pub const fn new() -> Self {
        Self(1)
    }

    fn within(&mut self, most: i32) -> i32 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        ((i64::from(self.0.cast_signed()) * i64::from(most)) >> 31) as i32
    }

    pub fn pose(&mut self) -> Pose {
        Pose {
            x_um: self.within(5_000_000),
            y_um: self.within(5_000_000),
            // Mostly ahead.
            yaw: BinaryAngle((self.within(1 << 15) * self.within(1 << 16)).cast_unsigned()),
        }
    }
}

/// Returns a digest with every bit of a sighting added (FNV-1a, 32 bits at a time).
pub fn added(digest: u32, sighting: &Sighting) -> u32 {
    let answer = match sighting.answer {
        TagVisibility::Visible => 1,
        TagVisibility::Unsure => 2,
        TagVisibility::NotVisible(why) => 3 + why as u32,
    };
    let mut digest = digest;
    let mut add = |word: u32| digest = (digest ^ word).wrapping_mul(0x0100_0193);
    for word in [answer, sighting.tag, sighting.d_um] {
        add(word);
    }
    add(sighting.cos_phi_q30.cast_unsigned());
    add(sighting.cos_psi_q30.cast_unsigned());
    for corner in sighting.corners {
        match corner {
            None => add(1),
            Some(pixel) => {
                add(pixel.u_q8.cast_unsigned());
                add(pixel.v_q8.cast_unsigned());
            }
        }
    }
    digest
}
