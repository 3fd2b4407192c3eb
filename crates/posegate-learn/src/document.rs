//! The file of a learnt error model: versioned TOML, with a description of its data.

use serde::{Deserialize, Serialize};

/// The version of the file that this crate writes and reads.
pub(super) const VERSION: u32 = 1;

/// Values at the corners of the cells, by d, phi and psi.
pub(super) type Corners = Vec<Vec<Vec<f64>>>;

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Document {
    /// The version.
    pub posegate_model: u32,
    /// `bounds`.
    pub kind: String,
    /// The share of the detections for which each bound holds.
    pub quantile: f64,
    /// The probability, over the random choice of calibration data, that a bound holds for this
    /// share in a region.
    pub confidence: f64,
    /// The seed for splitting the detections.
    pub seed: u64,
    /// The numbers of fine cells of a coarse one along d, phi and psi; 2, 1 and 2 if missing. `p_detect` always has those.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub parts: Option<[usize; 3]>,
    /// The camera and the tags of the detections; `None` if they were not stated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub taken_with: Option<super::TakenWith>,
    pub data: Data,
    /// The ends of the fine cells.
    pub edges: Edges,
    /// The shape for a smaller share of the errors: step 0 if there is a `wider` one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub narrower: Option<Shape>,
    /// The shape for the share `quantile`: step 1 with the other two.
    pub shape: Shape,
    /// The shape for a larger share of the errors: step 2.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wider: Option<Shape>,
    pub region: Vec<Region>,
    pub cell: Vec<Cell>,
    pub p_detect: Share,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Data {
    pub sha256: String,
    pub views: u64,
    /// The number of rows in the file if the views were drawn from more.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub drawn_of: Option<u64>,
    pub detections: u64,
    /// Detections to which the shape was fitted.
    pub fitted: u64,
    /// Detections on which the regions were calibrated.
    pub calibrated: u64,
    /// Detections with psi of 10 degrees or more whose yaw error is larger than psi: flips.
    pub flips: u64,
    /// Their share of the detections with psi of 10 degrees or more.
    pub flip_share: f64,
    /// `true` if the errors are those of the better one of a detector's two poses.
    #[serde(default, skip_serializing_if = "core::ops::Not::not")]
    pub of_better_pose: bool,
    /// The number of runs; `None` if rows were taken as independent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub runs: Option<u64>,
    /// The number of independent views with the same information; `None` if rows were taken as independent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub independent: Option<u64>,
}

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Edges {
    pub d_m: Vec<f64>,
    pub phi_deg: Vec<f64>,
    pub psi_deg: Vec<f64>,
}

/// An error quantile at the corners.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Shape {
    pub translation_m: Corners,
    pub yaw_rad: Corners,
}

/// A part of (d, phi, psi) whose cells were calibrated together.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Region {
    pub d_m: [f64; 2],
    pub phi_deg: [f64; 2],
    pub psi_deg: [f64; 2],
    /// Detections on which it was calibrated.
    pub detections: u64,
    /// The number of independent detections with the same information; `None` if rows were taken as independent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub independent: Option<u64>,
    /// The rank, from the smallest, of the score used as the factor; 0 if there are too few.
    pub rank: u64,
    /// The step of the translation's bounds between `narrower` and `wider`, or the factor of a single shape.
    pub translation: f64,
    /// The same for the yaw.
    pub yaw: f64,
}

/// A cell: two edges of d, one of phi, two of psi.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Cell {
    pub d_m: [f64; 2],
    pub phi_deg: [f64; 2],
    pub psi_deg: [f64; 2],
    /// Detections in it.
    pub detections: u64,
    /// The index of its region, from 0; `None` if the cell has no bound.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub region: Option<usize>,
    /// The cell's own steps or factors if they are larger than the region's.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub own: Option<[f64; 2]>,
    /// The reason why it has no bound.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub refused: Option<String>,
}

/// The share of views that are detected.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Share {
    pub edges: Edges,
    pub share: Corners,
    /// Views and detections of each cell, by d, phi and psi.
    pub views: Vec<u64>,
    pub detected: Vec<u64>,
    /// The number of independent views of each cell with the same information; empty if rows were taken as independent.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub independent: Vec<u64>,
}
