//! Counts of refused true poses.

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
