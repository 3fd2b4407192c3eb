//! True poses that were not taken.

/// True poses of a topic that were not taken.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RejectedTruth {
    /// In another frame than the world's.
    pub other_frame: u64,
    /// The quaternion's length is not 1.
    pub not_unit: u64,
    /// Tilted, beyond what the gate takes of an estimate.
    pub tilted: u64,
}
