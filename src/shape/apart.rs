//! Regions that a success set excludes: obstacles, positions too near a tag, views of a tag that are too
//! head-on, walls in front of a tag.
//!
//! At every heading each of these excludes an open convex region of positions. The remaining set is not
//! convex. It is a union of half-planes, one for each line that has the region on its other side
//! ([`SeparatingHalfPlane`]): two convex bodies whose interiors do not meet have a plane between them.

use super::clear::Clear;
use super::footprint::farthest;
use super::polygon::edges;
use super::side::{Line, SeparatingHalfPlane};
use super::visibility::{Resolved, Visibility};
use super::wall::{self, Wall};
use super::{PoseDeg, Scalar, Tolerance};
use std::sync::Arc;

/// A set that is the outside of something convex.
#[derive(Clone, Debug, PartialEq)]
pub enum Exclusion {
    /// The robot does not overlap an obstacle.
    Obstacle(Clear),
    /// The robot does not reach into a convex piece of the space that a union of regions does not cover.
    Gap {
        /// The robot and the piece.
        clear: Clear,
        /// The regions.
        regions: Arc<[Vec<[f64; 2]>]>,
    },
    /// The camera is at least `d_min` from the tag's centre.
    Near {
        /// The camera and the tag.
        view: Visibility,
        /// Smallest distance, metres.
        d_min: f64,
    },
    /// The tag is seen at an angle of at least `psi_min_deg`: seen head-on, its pose has two similar
    /// solutions.
    Square {
        /// The camera and the tag.
        view: Visibility,
        /// Smallest angle between the tag's normal and the ray to the camera, degrees, below 90.
        psi_min_deg: f64,
    },
    /// No part of the tag's face is hidden by a wall.
    Hidden {
        /// The camera and the tag.
        view: Visibility,
        /// The wall that may hide the tag.
        wall: Wall,
    },
}

/// Number of directions tried around a tag.
const DIRECTIONS: u32 = 48;

impl Exclusion {
    /// Returns the name of the set's slack.
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Obstacle(_) => "obstacle",
            Self::Gap { .. } => "region",
            Self::Near { .. } => "d_min",
            Self::Square { .. } => "psi_min",
            Self::Hidden { .. } => "wall",
        }
    }

    /// Returns the poses that are outside for every position of the obstacle or the regions within a tolerance of the goal. Tags and walls
    /// have tolerances of their own.
    pub(super) fn within(self, tolerance: Tolerance) -> Self {
        match self {
            Self::Obstacle(clear) => Self::Obstacle(clear.within(tolerance)),
            Self::Gap { clear, regions } => Self::Gap {
                clear: clear.within(tolerance),
                regions,
            },
            Self::Near { .. } | Self::Square { .. } | Self::Hidden { .. } => self,
        }
    }

    /// Returns the distance from the robot's reference point of the farthest point that must not reach into the region, metres.
    pub(super) fn lever(&self) -> f64 {
        match self {
            Self::Obstacle(clear) | Self::Gap { clear, .. } => farthest(clear.footprint()),
            Self::Near { view, .. } | Self::Square { view, .. } | Self::Hidden { view, .. } => {
                libm::hypot(view.mount.x, view.mount.y)
            }
        }
    }

    /// Returns the required distance from an obstacle, metres.
    pub(super) const fn gap(&self) -> f64 {
        match self {
            Self::Obstacle(clear) | Self::Gap { clear, .. } => clear.gap(),
            Self::Near { .. } | Self::Square { .. } | Self::Hidden { .. } => 0.0,
        }
    }

    /// Returns the half-planes of [`Self::sides`] in `f64`.
    pub fn lines(&self, goal: PoseDeg) -> impl Iterator<Item = Line<f64>> {
        let sides = self.sides(goal).into_iter();
        sides.map(move |side| side.resolve(goal))
    }

    /// Returns half-planes whose union is the set, except for the space between neighbouring tangents of a
    /// curve.
    pub fn sides(&self, goal: PoseDeg) -> Vec<SeparatingHalfPlane> {
        let around = |k: u32| f64::from(k) / f64::from(DIRECTIONS) * core::f64::consts::TAU;
        match self {
            Self::Obstacle(clear) | Self::Gap { clear, .. } => {
                let (footprint, obstacle) = (clear.footprint(), clear.obstacle());
                let theirs = edges(obstacle).map(|edge| SeparatingHalfPlane::OfObstacle {
                    points: footprint.to_vec(),
                    edge,
                    gap: clear.gap(),
                });
                let own = edges(footprint).map(|edge| SeparatingHalfPlane::OfRobot {
                    points: obstacle.to_vec(),
                    edge,
                    gap: clear.gap(),
                });
                if footprint.len() == 1 {
                    theirs.collect()
                } else {
                    theirs.chain(own).collect()
                }
            }
            Self::Near { view, d_min } => {
                let tag: Resolved<f64> = view.resolve(goal);
                let side = |direction| SeparatingHalfPlane::Near {
                    view: *view,
                    d_min: *d_min,
                    direction,
                };
                // So far above or below the tag that no position is too near.
                if (view.mount.z - tag.centre[2]).abs()
                    > *d_min + view.tolerance_margins().ray + 1e-9
                {
                    return std::vec![side([0.0; 2])];
                }
                (0..DIRECTIONS)
                    .map(around)
                    .map(|angle| side([libm::cos(angle), libm::sin(angle)]))
                    .collect()
            }
            Self::Square { view, psi_min_deg } => {
                let normal = view.resolve::<f64>(goal).normal;
                let [c, s] = f64::cos_sin_deg(view.too_head_on(*psi_min_deg).0);
                let (first, second) = across(normal);
                (0..DIRECTIONS)
                    .map(around)
                    .map(|angle| {
                        let (a, b) = (s * libm::cos(angle), s * libm::sin(angle));
                        SeparatingHalfPlane::Square {
                            view: *view,
                            psi_min_deg: *psi_min_deg,
                            toward: [0, 1, 2].map(|i| c * normal[i] + a * first[i] + b * second[i]),
                        }
                    })
                    .collect()
            }
            Self::Hidden { view, wall } => wall::planes(view, wall, goal)
                .into_iter()
                .map(|(normal, offset)| SeparatingHalfPlane::Hidden {
                    view: *view,
                    wall: wall.clone(),
                    normal,
                    offset,
                })
                .collect(),
        }
    }
}

/// Returns two unit vectors perpendicular to a unit vector and to each other.
fn across(n: [f64; 3]) -> ([f64; 3], [f64; 3]) {
    // Horizontal if possible: the flipped poses of a wall tag are to the left and to the right.
    let level = libm::hypot(n[0], n[1]);
    let first = if level > 1e-6 {
        [-n[1] / level, n[0] / level, 0.0]
    } else {
        [1.0, 0.0, 0.0]
    };
    let second = [
        n[1] * first[2] - n[2] * first[1],
        n[2] * first[0] - n[0] * first[2],
        n[0] * first[1] - n[1] * first[0],
    ];
    (first, second)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::visibility::test_view;

    /// A tolerance widens the cone at every width.
    #[test]
    fn head_on_views_grow_by_rotation() {
        let view = Visibility {
            psi_max_deg: 90.0,
            tag_tolerance: Tolerance {
                translation: 0.01,
                turn_deg: 2e-4,
            },
            ..test_view()
        };
        for psi_min_deg in [1.0, 45.0, 89.9, 89.9995] {
            let (angle, back) = view.too_head_on(psi_min_deg);
            assert!(angle >= psi_min_deg + 2e-4 && angle < 90.0, "{angle}");
            assert!(back >= 0.01 / libm::sin(angle.to_radians()), "{back}");
        }
    }
}
