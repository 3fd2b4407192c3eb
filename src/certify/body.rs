//! A pose-set as a body in the goal frame, and the proof that it lies in a success set without a table. Blocks that
//! cover the body are proven inside by outward-rounded intervals ([`Prover`]), and halved if they are not.
//!
//! If the success set is convex at every heading, a much cheaper proof is used. A slice of the body between two
//! headings is enclosed in a polygon. The set contains the slice if it contains the polygon's corners at all headings
//! between. If that is not proven, slices are halved and their polygons get more corners.
//!
//! A block that contains no pose of the body is skipped. For a cylinder its nearest point is farther than the radius.
//! For an ellipsoid its middle, in the ellipsoid's own units, is farther than 1 plus the extent of the block.

use nalgebra::{Matrix3, Vector3};

use super::{Block, Prover};

/// A pose-set in a goal frame (x, y, yaw; m, rad).
#[derive(Clone, Debug)]
pub struct Body {
    centre: [f64; 3],
    /// Extent along each axis.
    half: [f64; 3],
    kind: Kind,
}

#[derive(Clone, Debug)]
enum Kind {
    Cylinder,
    Ellipsoid {
        /// Maps offsets to the unit ball.
        whitened: Matrix3<f64>,
        /// Displacement of the middle of a slice per radian of yaw, metres.
        drift: [f64; 2],
        /// Maps the unit circle to the slice at the middle, by rows; lower triangular, metres.
        spread: [[f64; 2]; 2],
    },
}

/// Limits of a proof; a proof that exceeds one ends as not proven.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProofBudget {
    /// Largest number of blocks, or of corners of slices.
    pub blocks: u32,
    /// Gives up at an unproven block whose size across the floor, or a slice whose height, is below this share of the
    /// body's.
    pub smallest: f64,
}

/// Corners of the polygon around the whole body.
const CORNERS: u32 = 12;

/// Largest half height of a block or slice that a prover evaluates, radians: it requires less than a quarter of a turn.
const WIDEST: f64 = 0.35;

impl Body {
    /// Creates the body of all poses within `radius` (m) of a centre and `yaw` (rad) of its heading.
    #[must_use]
    pub const fn cylinder(centre: [f64; 3], radius: f64, yaw: f64) -> Self {
        Self {
            centre,
            half: [radius, radius, yaw],
            kind: Kind::Cylinder,
        }
    }

    /// Creates the body of all poses `p` with `e' square^-1 e <= 1`, `e = p - centre`. `None` if the square is not
    /// positive definite.
    #[must_use]
    pub fn ellipsoid(centre: [f64; 3], square: Matrix3<f64>) -> Option<Self> {
        let factor = square.cholesky()?.l();
        let yaw = square[(2, 2)];
        let drift = [square[(0, 2)] / yaw, square[(1, 2)] / yaw];
        let left = |a: usize, b: usize| square[(a, b)] - drift[a] * drift[b] * yaw;
        let along = libm::sqrt(left(0, 0));
        let across = left(0, 1) / along;
        let rest = libm::sqrt(left(1, 1) - across * across);
        let numbers = [drift[0], drift[1], along, across, rest];
        if !numbers.iter().all(|v| v.is_finite()) {
            return None;
        }
        Some(Self {
            centre,
            half: core::array::from_fn(|k| libm::sqrt(square[(k, k)])),
            kind: Kind::Ellipsoid {
                whitened: factor.try_inverse()?,
                drift,
                spread: [[along, 0.0], [across, rest]],
            },
        })
    }

    /// Returns `true` if the body is proven to lie in the prover's success set; `false` means not proven.
    ///
    /// The centre and the extent are floats: a caller that relies on the proof must enlarge the body by their possible
    /// errors.
    #[must_use]
    pub fn is_within(&self, prover: &Prover, patience: ProofBudget) -> bool {
        // A body with numbers that are not finite is not proven.
        let is_reach = |v: &f64| v.is_finite() && *v >= 0.0;
        if !self.centre.iter().all(|v| v.is_finite()) || !self.half.iter().all(is_reach) {
            return false;
        }
        if prover.is_convex() {
            self.is_within_by_slices(prover, patience)
        } else {
            self.is_within_by_blocks(prover, patience)
        }
    }

    /// Proves by polygons around slices.
    fn is_within_by_slices(&self, prover: &Prover, patience: ProofBudget) -> bool {
        let yaw = self.half[2];
        let mut open = vec![(-yaw, yaw, 0u32)];
        let mut seen = 0;
        while let Some((from, to, depth)) = open.pop() {
            // Wide slices are halved without evaluation.
            if to - from < 2.0 * WIDEST {
                // A thinner slice of a cylinder is no narrower, so its polygon needs more corners.
                let corners = match self.kind {
                    Kind::Cylinder => CORNERS << (4 + depth / 2).min(8),
                    Kind::Ellipsoid { .. } => CORNERS << (depth / 2).min(8),
                };
                let mut missed = false;
                for k in 0..corners {
                    seen += 1;
                    if seen > patience.blocks {
                        return false;
                    }
                    let angle = f64::from(k) / f64::from(corners) * core::f64::consts::TAU;
                    let [x, y] = self.corner(from, to, angle, corners);
                    if !(x.is_finite() && y.is_finite()) {
                        return false;
                    }
                    let middle = self.centre[2] + 0.5 * (from + to);
                    if !prover.is_inside_at([x, y], units(middle, 0.5 * (to - from) + 1e-12)) {
                        missed = true;
                        break;
                    }
                }
                if !missed {
                    continue;
                }
                if to - from < patience.smallest * 2.0 * yaw {
                    return false;
                }
            }
            let middle = 0.5 * (from + to);
            open.push((from, middle, depth + 1));
            open.push((middle, to, depth + 1));
        }
        true
    }

    /// Returns a corner of a polygon that contains every pose of the body whose yaw is between two ends (relative to
    /// the centre's).
    fn corner(&self, from: f64, to: f64, angle: f64, corners: u32) -> [f64; 2] {
        let about = 1.0 / libm::cos(core::f64::consts::PI / f64::from(corners)) * (1.0 + 1e-9);
        let (u, v) = (libm::cos(angle), libm::sin(angle));
        match &self.kind {
            Kind::Cylinder => [
                self.centre[0] + self.half[0] * about * u,
                self.centre[1] + self.half[0] * about * v,
            ],
            Kind::Ellipsoid {
                drift,
                spread: [[a, _], [b, c]],
                ..
            } => {
                let nearest = if from <= 0.0 && to >= 0.0 {
                    0.0
                } else {
                    from.abs().min(to.abs())
                };
                let share = nearest / self.half[2];
                let radius = libm::sqrt((1.0 - share * share).max(0.0));
                // Displacement of the middle within the slice, in the slice's own units.
                let moved = drift.map(|by| 0.5 * by * (to - from));
                let moved = [moved[0] / a, (moved[1] - b / a * moved[0]) / c];
                let reach = (radius + libm::hypot(moved[0], moved[1])) * about;
                let middle = 0.5 * (from + to);
                [
                    self.centre[0] + drift[0] * middle + a * reach * u,
                    self.centre[1] + drift[1] * middle + (b * u + c * v) * reach,
                ]
            }
        }
    }

    /// Proves by blocks.
    fn is_within_by_blocks(&self, prover: &Prover, patience: ProofBudget) -> bool {
        let mut open = vec![(self.centre, self.half)];
        let mut seen = 0;
        while let Some((middle, half)) = open.pop() {
            if self.misses(middle, half) {
                continue;
            }
            seen += 1;
            if seen > patience.blocks {
                return false;
            }
            // Wide blocks are halved without evaluation.
            let narrow = half[2] < WIDEST;
            if narrow && prover.is_inside(&block(middle, half)) {
                continue;
            }
            let share = |axis: usize| half[axis] / self.half[axis].max(1e-9);
            // A block this small that cannot be proven is at the border, or beyond.
            if narrow && share(0).max(share(1)) < patience.smallest {
                return false;
            }
            let axis = if !narrow {
                2
            } else if share(0) >= share(1) && 2.0 * share(0) >= share(2) {
                0
            } else if 2.0 * share(1) >= share(2) {
                1
            } else {
                2
            };
            for sign in [-0.5, 0.5] {
                let (mut at, mut size) = (middle, half);
                at[axis] += sign * half[axis];
                size[axis] *= 0.5;
                open.push((at, size));
            }
        }
        true
    }

    /// Returns `true` if no pose of the body is in a block; `false` if that is not certain.
    fn misses(&self, middle: [f64; 3], half: [f64; 3]) -> bool {
        let off: [f64; 3] = core::array::from_fn(|k| middle[k] - self.centre[k]);
        match &self.kind {
            Kind::Cylinder => {
                let gap = |axis: usize| (off[axis].abs() - half[axis]).max(0.0);
                libm::hypot(gap(0), gap(1)) > self.half[0] * (1.0 + 1e-9)
            }
            Kind::Ellipsoid { whitened, .. } => {
                let seen = whitened * Vector3::from(off);
                let reach = whitened.abs() * Vector3::from(half);
                seen.norm() - reach.norm() > 1.0 + 1e-9
            }
        }
    }
}

/// Returns a block in the core's units, rounded outwards.
fn block(middle: [f64; 3], half: [f64; 3]) -> Block {
    let um = |axis: usize| {
        [
            libm::floor((middle[axis] - half[axis]) * 1e6) as i64,
            libm::ceil((middle[axis] + half[axis]) * 1e6) as i64,
        ]
    };
    Block {
        x_um: um(0),
        y_um: um(1),
        yaw: units(middle[2], half[2]),
    }
}

/// Returns the ends of headings about a middle, radians, in 2^-32 turn, rounded outwards.
fn units(middle: f64, half: f64) -> [i64; 2] {
    let units = 4_294_967_296.0 / core::f64::consts::TAU;
    [
        libm::floor((middle - half) * units) as i64,
        libm::ceil((middle + half) * units) as i64,
    ]
}
