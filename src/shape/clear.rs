//! Obstacles: the robot's outline does not overlap a convex obstacle.

use super::Tolerance;
use super::footprint::{Footprint, PolygonError, farthest};

/// The poses at which the interiors of a convex footprint and of a convex obstacle do not meet; touching is
/// allowed. A footprint of one point is that point itself.
#[derive(Clone, Debug, PartialEq)]
pub struct Clear {
    pub(super) footprint: Vec<[f64; 2]>,
    pub(super) obstacle: Vec<[f64; 2]>,
    pub(super) gap: f64,
}

impl Clear {
    /// Creates the set of poses at which `footprint` (robot frame) stays clear of `obstacle` (goal frame):
    /// corners `[x, y]` in metres, both as [`Footprint::new`] accepts them.
    ///
    /// # Errors
    /// The first problem of the footprint, or else of the obstacle.
    pub fn new(footprint: Vec<[f64; 2]>, obstacle: Vec<[f64; 2]>) -> Result<Self, PolygonError> {
        Footprint::check_footprint(&footprint)?;
        Footprint::check_region(&obstacle)?;
        Footprint::check_pairs(&footprint, &obstacle)?;
        Ok(Self {
            footprint,
            obstacle,
            gap: 0.0,
        })
    }

    /// Returns the set for an obstacle that may be off by a tolerance: the gap grows by the largest distance
    /// that one of the obstacle's points can move, metres.
    #[must_use]
    pub fn within(mut self, tolerance: Tolerance) -> Self {
        self.gap += tolerance.reach(farthest(&self.obstacle));
        self
    }

    /// Returns the required distance from the obstacle, metres.
    #[must_use]
    pub const fn gap(&self) -> f64 {
        self.gap
    }

    /// Returns the robot's outline in the robot frame, metres, counter-clockwise; or its reference point.
    #[must_use]
    pub fn footprint(&self) -> &[[f64; 2]] {
        &self.footprint
    }

    /// Returns the obstacle in the goal frame, metres, counter-clockwise.
    #[must_use]
    pub fn obstacle(&self) -> &[[f64; 2]] {
        &self.obstacle
    }
}
