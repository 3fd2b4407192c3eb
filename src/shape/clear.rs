//! Obstacles: the robot's outline and a convex obstacle do not meet.

use super::Tolerance;
use super::footprint::{Footprint, PolygonError};

/// The poses at which the interiors of a convex footprint and of a convex obstacle do not meet; touching
/// is allowed. A footprint of one point is that point itself.
#[derive(Clone, Debug, PartialEq)]
pub struct Clear {
    footprint: Vec<[f64; 2]>,
    obstacle: Vec<[f64; 2]>,
    gap: f64,
}

impl Clear {
    /// The poses at which `footprint` (robot frame) keeps clear of `obstacle` (goal frame): corners `[x, y]`
    /// in metres, both as [`Footprint::new`] takes them.
    ///
    /// # Errors
    /// What is wrong with the footprint, or else with the obstacle.
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

    /// The same set for an obstacle that may be off by a tolerance: the largest distance that one of its
    /// points can move, metres, is kept from it.
    #[must_use]
    pub fn within(mut self, tolerance: Tolerance) -> Self {
        let farthest = self.obstacle.iter().map(|[x, y]| libm::hypot(*x, *y));
        self.gap += tolerance.reach(farthest.fold(0.0, f64::max));
        self
    }

    /// The distance that is kept from the obstacle, metres.
    #[must_use]
    pub const fn gap(&self) -> f64 {
        self.gap
    }

    /// The robot's outline in the robot frame, metres, counter-clockwise; or its reference point.
    #[must_use]
    pub fn footprint(&self) -> &[[f64; 2]] {
        &self.footprint
    }

    /// The obstacle in the goal frame, metres, counter-clockwise.
    #[must_use]
    pub fn obstacle(&self) -> &[[f64; 2]] {
        &self.obstacle
    }
}
