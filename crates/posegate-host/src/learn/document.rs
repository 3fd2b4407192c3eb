//! The file of a learnt error model: TOML, versioned, with what it was learnt from.

use serde::{Deserialize, Serialize};

/// The version of the file that this crate writes and reads.
pub(super) const VERSION: u32 = 1;

/// Values at the corners of the cells, by d, phi and psi.
pub(super) type Corners = Vec<Vec<Vec<f64>>>;

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Document {
    /// Version.
    pub posegate_model: u32,
    /// `bounds`.
    pub kind: String,
    /// The share of the detections for which each bound holds.
    pub quantile: f64,
    /// The probability, over the data, with which it does so in a region.
    pub confidence: f64,
    /// What the split into parts was drawn with.
    pub seed: u64,
    pub data: Data,
    /// The ends of the cells.
    pub edges: Edges,
    pub shape: Shape,
    pub region: Vec<Region>,
    pub cell: Vec<Cell>,
    pub p_detect: Share,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Data {
    pub sha256: String,
    pub views: u64,
    pub detections: u64,
    /// Detections that the shape was fitted to.
    pub fitted: u64,
    /// Detections that the regions were calibrated on.
    pub calibrated: u64,
    /// Detections with psi of 10 degrees or more whose yaw errs by more than psi: flips.
    pub flips: u64,
    /// Their share of the detections with psi of 10 degrees or more.
    pub flip_share: f64,
}

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Edges {
    pub d_m: Vec<f64>,
    pub phi_deg: Vec<f64>,
    pub psi_deg: Vec<f64>,
}

/// How errors grow from corner to corner; what a region's factor is multiplied with.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Shape {
    pub translation_m: Corners,
    pub yaw_rad: Corners,
}

/// A part of (d, phi, psi) that was calibrated together.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Region {
    pub d_m: [f64; 2],
    pub phi_deg: [f64; 2],
    pub psi_deg: [f64; 2],
    /// Detections that it was calibrated on.
    pub detections: u64,
    /// The rank of the score, from the smallest, that became the factor; 0 where there are too few.
    pub rank: u64,
    /// What the shape of the translation is multiplied with.
    pub translation: f64,
    /// What the shape of the yaw is multiplied with.
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
    /// Its region, from 0; none where nothing is said of the cell.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub region: Option<usize>,
    /// Its factors where they are larger than the region's.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub own: Option<[f64; 2]>,
    /// Why nothing is said of it.
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
}
