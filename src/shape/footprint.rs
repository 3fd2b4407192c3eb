//! Footprints in regions: every vertex of the robot's outline lies inside a convex polygon.

use super::planar::Planar;
use super::polygon::edges;
use super::scalar::{NONE, Scalar, Selection, selected};
use super::{Round, Tolerance};

/// The poses at which a convex footprint lies inside a convex region.
///
/// Both polygons are convex and counter-clockwise; only [`Footprint::new`] creates this type.
#[derive(Clone, Debug, PartialEq)]
pub struct Footprint {
    pub(super) footprint: Vec<[f64; 2]>,
    pub(super) region: Vec<[f64; 2]>,
    pub(super) inset: f64,
    /// The ellipse that the region is inscribed in, if that is the set.
    pub(super) round: Option<Round>,
}

impl Footprint {
    /// Largest coordinate of a corner, metres.
    pub const LARGEST: f64 = 1e9;

    /// Largest number of corners of a polygon.
    pub const MOST_CORNERS: usize = 320;
    /// Largest number of pairs of a footprint corner and an edge of the region or obstacle. Each pair is a border of
    /// the set; a table with more cannot be baked and proven within seconds.
    pub const MOST_PAIRS: usize = 1280;

    /// Creates the set of poses at which `footprint` (robot frame) lies inside `region` (goal frame): corners `[x, y]`
    /// in metres.
    ///
    /// Both are convex and list each of their corners once, counter-clockwise. A corner may lie exactly on the straight
    /// line between its neighbours. A region has at least 3 corners, and so has a footprint unless it is a single
    /// point. The side of an edge on which a corner lies is decided exactly.
    ///
    /// # Errors
    /// The first problem of the footprint, or else of the region.
    pub fn new(footprint: Vec<[f64; 2]>, region: Vec<[f64; 2]>) -> Result<Self, PolygonError> {
        Self::check_footprint(&footprint)?;
        Self::check_region(&region)?;
        Self::check_pairs(&footprint, &region)?;
        Ok(Self {
            footprint,
            region,
            inset: 0.0,
            round: None,
        })
    }

    /// Returns the set of an ellipse in which the region is inscribed: tables use the region, membership the ellipse.
    #[must_use]
    pub(super) fn within_round(mut self, round: Round) -> Self {
        self.round = Some(round);
        self
    }

    /// Returns the ellipse that the region is inscribed in, if that is the set.
    #[must_use]
    pub const fn round(&self) -> Option<&Round> {
        self.round.as_ref()
    }

    /// Computes the slacks of the set itself, by name: those of the region, or that of the ellipse.
    pub(super) fn exact_slacks(
        &self,
        pose: &Planar<f64>,
        note: &mut impl FnMut(&'static str, f64),
    ) {
        match &self.round {
            Some(round) => note(round.name(), round.slack(pose) - self.inset),
            None => {
                self.slacks(pose, super::ALL, 0, &mut |_, name, slack| note(name, slack));
            }
        }
    }

    /// Checks that [`Footprint::new`] accepts these corners as a footprint.
    ///
    /// # Errors
    /// The first problem of the corners.
    pub fn check_footprint(corners: &[[f64; 2]]) -> Result<(), PolygonError> {
        match corners {
            [point] => check_coordinates(&[*point]),
            [] | [_, _] => Err(PolygonError::FootprintCorners),
            _ => check_polygon(corners),
        }
    }

    /// Checks that [`Footprint::new`] accepts these corners as a region.
    ///
    /// # Errors
    /// The first problem of the corners.
    pub fn check_region(corners: &[[f64; 2]]) -> Result<(), PolygonError> {
        if corners.len() < 3 {
            return Err(PolygonError::TooFewCorners);
        }
        check_polygon(corners)
    }

    /// Checks that two polygons together have few enough corners.
    ///
    /// # Errors
    /// [`PolygonError::TooManyPairs`] if there are more pairs than [`Self::MOST_PAIRS`].
    pub(super) const fn check_pairs(
        footprint: &[[f64; 2]],
        other: &[[f64; 2]],
    ) -> Result<(), PolygonError> {
        if footprint.len() * other.len() > Self::MOST_PAIRS {
            return Err(PolygonError::TooManyPairs);
        }
        Ok(())
    }

    /// Returns the robot's outline in the robot frame, metres, counter-clockwise; a single point represents the robot's
    /// reference point.
    #[must_use]
    pub fn footprint(&self) -> &[[f64; 2]] {
        &self.footprint
    }

    /// Returns the distance of the farthest corner of the footprint from the robot's reference point, metres.
    #[must_use]
    pub fn lever(&self) -> f64 {
        farthest(&self.footprint)
    }

    /// Returns the region in the goal frame, metres, counter-clockwise.
    #[must_use]
    pub fn region(&self) -> &[[f64; 2]] {
        &self.region
    }

    /// Returns the set for a region that may be off by a tolerance: the inset grows by the largest distance that one of
    /// the region's points can move, metres.
    #[must_use]
    pub fn within(mut self, tolerance: Tolerance) -> Self {
        self.inset += tolerance.reach(farthest(&self.region));
        self
    }

    /// Returns the required distance from the region's edges, metres.
    #[must_use]
    pub const fn inset(&self) -> f64 {
        self.inset
    }

    /// Returns for each vertex its distance from the nearest edge of the region, positive inside.
    pub(super) fn depths(&self, pose: &Planar<f64>) -> Vec<f64> {
        let count = self.footprint.len();
        let mut depths = std::vec![f64::INFINITY; count];
        self.slacks(pose, super::ALL, 0, &mut |index, _, slack| {
            let depth = &mut depths[index % count];
            *depth = depth.min(slack);
        });
        depths
    }

    /// Computes the distance of every vertex from every edge of the region, positive inside. For fixed yaw each is
    /// affine in x and y. Only the selected slacks are computed; they are numbered from `first`. Returns the number
    /// after the last.
    pub fn slacks<S: Scalar>(
        &self,
        pose: &Planar<S>,
        selection: Selection,
        first: usize,
        note: &mut impl FnMut(usize, &'static str, S),
    ) -> usize {
        let mut index = first;
        for [[ax, ay], [bx, by]] in edges(&self.region) {
            let unit = S::exact(1.0 / libm::hypot(bx - ax, by - ay));
            let (from_x, from_y) = (S::exact(ax), S::exact(ay));
            let along = [S::exact(bx) - from_x, S::exact(by) - from_y];
            for vertex in &self.footprint {
                if selection & selected(index) != NONE {
                    let [x, y] = pose.to_goal(vertex.map(S::exact));
                    let slack = along[0] * (y - from_y) - along[1] * (x - from_x);
                    let slack = slack * unit;
                    let slack = if self.inset > 0.0 {
                        slack - S::exact(self.inset)
                    } else {
                        slack
                    };
                    note(index, "region", slack);
                }
                index += 1;
            }
        }
        index
    }
}

/// Returns the distance of the farthest corner from the origin, metres.
pub(super) fn farthest(corners: &[[f64; 2]]) -> f64 {
    let distances = corners.iter().map(|[x, y]| libm::hypot(*x, *y));
    distances.fold(0.0, f64::max)
}

/// Why a list of points is not a polygon that a footprint set can use.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum PolygonError {
    /// A region with fewer than three corners.
    #[error("a region needs at least 3 corners")]
    TooFewCorners,
    /// A footprint with no corners or two.
    #[error("a footprint is one point or has at least 3 corners")]
    FootprintCorners,
    /// The polygon has more corners than [`Footprint::MOST_CORNERS`].
    #[error("a polygon has more than {} corners", Footprint::MOST_CORNERS)]
    TooManyCorners,
    /// The polygon and the footprint form more pairs than [`Footprint::MOST_PAIRS`].
    #[error(
        "the footprint's corners times the polygon's are more than {}",
        Footprint::MOST_PAIRS
    )]
    TooManyPairs,
    /// A coordinate is not a finite number.
    #[error("a corner is not finite")]
    NotFinite,
    /// A coordinate is larger than [`Footprint::LARGEST`].
    #[error("a corner is more than 1e9 m away")]
    TooLarge,
    /// The corners run clockwise.
    #[error("the corners run clockwise; list them counter-clockwise")]
    Clockwise,
    /// The polygon has a dent, repeats a corner, or crosses itself.
    #[error("the polygon is not convex (or repeats a corner, or crosses itself)")]
    NotConvex,
}

fn check_coordinates(corners: &[[f64; 2]]) -> Result<(), PolygonError> {
    let coordinates = || corners.iter().flatten();
    if coordinates().any(|c| !c.is_finite()) {
        Err(PolygonError::NotFinite)
    } else if coordinates().any(|c| c.abs() > Footprint::LARGEST) {
        Err(PolygonError::TooLarge)
    } else {
        Ok(())
    }
}

fn check_polygon(corners: &[[f64; 2]]) -> Result<(), PolygonError> {
    if corners.len() > Footprint::MOST_CORNERS {
        return Err(PolygonError::TooManyCorners);
    }
    check_coordinates(corners)?;
    let repeated = (1..corners.len()).any(|i| corners[..i].contains(&corners[i]));
    if !repeated && all_on_side(corners, 1.0) {
        Ok(())
    } else if !repeated && all_on_side(corners, -1.0) {
        Err(PolygonError::Clockwise)
    } else {
        Err(PolygonError::NotConvex)
    }
}

/// Returns `true` if no corner lies on the wrong side of any edge, and not all corners lie on one line.
///
/// If all corners differ, such a polygon is convex and winds once around: each edge is a part of the corners' convex
/// hull, in the hull's direction.
fn all_on_side(corners: &[[f64; 2]], side: f64) -> bool {
    let mut encloses = false;
    for [start, end] in edges(corners) {
        for &corner in corners {
            let turn = side * orientation(start, end, corner);
            if turn < 0.0 {
                return false;
            }
            encloses |= turn > 0.0;
        }
    }
    encloses
}

/// Returns a positive value if a, b, c turn counter-clockwise, a negative value if they turn clockwise, and zero if
/// they lie on one line: exactly.
///
/// (Products of coordinates must not underflow: coordinates of less than 1e-140 are used as they round.)
pub(super) fn orientation(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    // Shewchuk's bound on the rounding of the plain determinant: (3 + 16 u) u with u = 2^-53.
    const ROUNDING: f64 = 3.330_669_073_875_472e-16;
    let left = (a[0] - c[0]) * (b[1] - c[1]);
    let right = (a[1] - c[1]) * (b[0] - c[0]);
    let plain = left - right;
    if plain.abs() > ROUNDING * (left.abs() + right.abs()) {
        return plain;
    }
    let products = [
        (a[0], b[1]),
        (-a[0], c[1]),
        (-c[0], b[1]),
        (-a[1], b[0]),
        (a[1], c[0]),
        (c[1], b[0]),
    ];
    // The exact sum as non-overlapping parts, smallest first: the last nonzero part has its sign.
    let mut parts: Vec<f64> = Vec::with_capacity(12);
    for (p, q) in products {
        let product = p * q;
        for mut carry in [p.mul_add(q, -product), product] {
            for part in &mut parts {
                (carry, *part) = two_sum(carry, *part);
            }
            parts.push(carry);
        }
    }
    let largest = parts.iter().rev().find(|&&part| part != 0.0);
    largest.copied().unwrap_or(0.0)
}

/// Returns the rounded sum and its rounding error.
fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    let b_part = sum - a;
    let a_part = sum - b_part;
    (sum, (a - a_part) + (b - b_part))
}

#[cfg(test)]
mod tests {

    use super::{Footprint, PolygonError, orientation};

    const SQUARE: [[f64; 2]; 4] = [[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]];

    fn region(corners: &[[f64; 2]]) -> Result<(), PolygonError> {
        Footprint::check_region(corners)
    }

    #[test]
    fn accepts_convex_counter_clockwise() {
        let set = Footprint::new(vec![[0.5, 0.25]], SQUARE.to_vec()).expect("a point in a square");
        assert_eq!(set.footprint(), [[0.5, 0.25]]);
        assert_eq!(set.region(), SQUARE);
        assert_eq!(region(&[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]), Ok(()));
        // A corner exactly on an edge.
        assert_eq!(
            region(&[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [0.0, 1.0]]),
            Ok(())
        );
    }

    #[test]
    fn each_invalid_footprint_is_refused() {
        use PolygonError::{
            Clockwise, FootprintCorners, NotConvex, NotFinite, TooFewCorners, TooLarge,
        };
        let mut clockwise = SQUARE.to_vec();
        clockwise.reverse();
        let pentagram: Vec<[f64; 2]> = (0..5)
            .map(|i| f64::from(i * 2) * core::f64::consts::TAU / 5.0)
            .map(|angle| [angle.cos(), angle.sin()])
            .collect();
        let rows: [(&[[f64; 2]], PolygonError); 11] = [
            (&SQUARE[..2], TooFewCorners),
            (&[], TooFewCorners),
            (&clockwise, Clockwise),
            (&[[0.0, 0.0], [2.0, 0.0], [0.5, 0.5], [0.0, 2.0]], NotConvex),
            (&[[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]], NotConvex),
            (&[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]], NotConvex),
            (&[[0.0, 0.0], [2.0, 0.0], [1.0, 0.0], [0.0, 1.0]], NotConvex),
            (&[[0.0, 0.0], [1.0, 0.0], [1.0, 0.0], [0.0, 1.0]], NotConvex),
            (&pentagram, NotConvex),
            (&[[0.0, 0.0], [1.0, f64::NAN], [0.0, 1.0]], NotFinite),
            (&[[0.0, 0.0], [1e300, 0.0], [0.0, 1.0]], TooLarge),
        ];
        for (corners, fault) in rows {
            assert_eq!(region(corners), Err(fault), "{corners:?}");
        }
        for few in [&SQUARE[..0], &SQUARE[..2]] {
            assert_eq!(Footprint::check_footprint(few), Err(FootprintCorners));
        }
        let twice = [SQUARE, SQUARE].concat();
        assert_eq!(region(&twice), Err(NotConvex));
        assert_eq!(Footprint::new(clockwise, SQUARE.to_vec()), Err(Clockwise));
    }

    #[test]
    fn orientation_is_exact_near_a_line() {
        // One unit in the last place off a diagonal, where rounding hides the sign of the plain determinant.
        let (b, c) = ([12.0, 12.0], [24.0, 24.0]);
        let ulp = f64::EPSILON / 2.0;
        for i in 0..16_i32 {
            for j in 0..16_i32 {
                let a = [0.5 + f64::from(i) * ulp, 0.5 + f64::from(j) * ulp];
                // Left of the diagonal, which runs from b to c, where y > x.
                let side = Some(j.cmp(&i));
                assert_eq!(orientation(b, c, a).partial_cmp(&0.0), side, "{i} {j}");
                assert_eq!(orientation(a, b, c).partial_cmp(&0.0), side, "{i} {j}");
            }
        }
    }
}
