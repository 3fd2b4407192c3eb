//! Footprints in regions: every vertex of the robot's outline lies inside a convex polygon.

/// The poses at which a convex footprint lies inside a convex region.
///
/// Both polygons are convex and counter-clockwise; [`Footprint::new`] is the only way to make one.
#[derive(Clone, Debug, PartialEq)]
pub struct Footprint {
    footprint: Vec<[f64; 2]>,
    region: Vec<[f64; 2]>,
}

/// Why a list of points is no polygon that a footprint set can use.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum PolygonError {
    /// A region needs three corners at least.
    #[error("a region needs at least 3 corners")]
    TooFewCorners,
    /// A coordinate is not a finite number.
    #[error("a corner is not finite")]
    NotFinite,
    /// The corners run clockwise.
    #[error("the corners run clockwise; list them counter-clockwise")]
    Clockwise,
    /// The polygon has a dent, a repeated corner or crosses itself.
    #[error("the polygon is not convex (or repeats a corner, or crosses itself)")]
    NotConvex,
}
