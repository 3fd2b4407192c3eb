//! Counts of refused true poses.

use crate::Trajectory;
use crate::recording::TruePose;
use posegate::report::{FrameId, Heading};
use posegate::set::InputError;

/// True poses of a topic that were refused.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RejectedTruth {
    /// In another frame than the world frame.
    pub other_frame: u64,
    /// The quaternion's length is not 1.
    pub not_unit: u64,
    /// Tilted by more than the gate accepts in an estimate.
    pub tilted: u64,
}

impl RejectedTruth {
    /// Adds a true pose to a trajectory. A pose in another frame than the world frame, or with an orientation that the gate would refuse in an
    /// estimate, is counted instead.
    pub(crate) fn push(&mut self, pose: &TruePose, world: FrameId, track: &mut Trajectory) {
        if FrameId::of(&pose.frame) != world {
            self.other_frame += 1;
            return;
        }
        match Heading::Quaternion(pose.orientation).angle() {
            Err(InputError::OrientationInvalid) => self.not_unit += 1,
            Err(InputError::Tilted) => self.tilted += 1,
            _ => track.push(pose.t_s, pose.level()),
        }
    }
}
