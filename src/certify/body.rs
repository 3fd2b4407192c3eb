//! A pose-set as a body in the goal frame, and the proof that it lies in a success set without a table: blocks that
//! cover it are proven inside by outward-rounded intervals ([`Prover`]), and halved where they are not.
//!
//! Where the success set is convex at every heading, far fewer will do: a slice of the body between two headings is put into
//! a polygon, and the set holds all of that where it holds the corners at all headings between. Slices are halved, and
//! their polygons get more corners, where that is not proven.
//!
//! A block that no pose of the body is in is left out: for a cylinder one whose nearest point is farther than the radius,
//! for an ellipsoid one whose middle, seen in the ellipsoid's own units, is farther than 1 and all that the block reaches.

use nalgebra::{Matrix3, Vector3};

use super::{Block, Prover};

/// A pose-set in a goal frame (x, y, yaw; m, rad).
#[derive(Clone, Debug)]
pub struct Body {
    centre: [f64; 3],
    /// What it reaches along each axis.
    half: [f64; 3],
    kind: Kind,
}

#[derive(Clone, Debug)]
enum Kind {
    Cylinder,
    Ellipsoid {
        /// What takes offsets to the unit ball.
        whitened: Matrix3<f64>,
        /// What a radian of yaw moves the middle of a slice by, metres.
        drift: [f64; 2],
        /// What takes the unit circle to the slice at the middle, by rows; lower triangular, metres.
        spread: [[f64; 2]; 2],
    },
}

/// When a proof is given up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProofBudget {
    /// After so many blocks, or corners of slices.
    pub blocks: u32,
    /// At a block that is not proven and no larger across the floor, or a slice that is no higher, than this share of the body.
    pub smallest: f64,
}

/// Corners of the polygon about the whole body.
const CORNERS: u32 = 12;

/// Widest block that a prover is asked about, radians: it takes less than a quarter of a turn.
const WIDEST: f64 = 0.35;

impl Body {
    /// All poses within a radius of a centre and an angle of its yaw.
    #[must_use]
    pub const fn cylinder(centre: [f64; 3], radius: f64, yaw: f64) -> Self {
        Self {
            centre,
            half: [radius, radius, yaw],
            kind: Kind::Cylinder,
        }
    }

    /// All poses `p` with `e' square^-1 e <= 1`, `e = p - centre`. `None` where the square is not positive definite.
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

    /// Whether the body is proven to lie in the prover's success set, `false` means not proven.
    ///
    /// The centre and the reach are floats: who relies on the proof makes the body wider than what they may be off.
    #[must_use]
    pub fn is_within(&self, prover: &Prover, patience: ProofBudget) -> bool {
        // What is no number is nowhere.
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

    /// By polygons about slices.
    fn is_within_by_slices(&self, prover: &Prover, patience: ProofBudget) -> bool {
        let yaw = self.half[2];
        let mut open = vec![(-yaw, yaw, 0u32)];
        let mut seen = 0;
        while let Some((from, to, depth)) = open.pop() {
            // Wide slices are halved unseen.
            if to - from < 2.0 * WIDEST {
                // A thinner slice of a cylinder is no smaller.
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

    /// A corner of a polygon that holds every pose of the body whose yaw is between two ends (from the centre's).
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
                // What the middle moves within the slice, in the slice's own units.
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

    /// By blocks.
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
            // Wide blocks are halved unseen.
            let narrow = half[2] < WIDEST;
            if narrow && prover.is_inside(&block(middle, half)) {
                continue;
            }
            let share = |axis: usize| half[axis] / self.half[axis].max(1e-9);
            // So small a block that cannot be proven is at the border, or beyond.
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

    /// Whether no pose of the body is in a block. `false` where that is not sure.
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

/// A block in the core's units, outwards.
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

/// The ends of headings about a middle, radians, in 2^-32 turn, outwards.
fn units(middle: f64, half: f64) -> [i64; 2] {
    let units = 4_294_967_296.0 / core::f64::consts::TAU;
    [
        libm::floor((middle - half) * units) as i64,
        libm::ceil((middle + half) * units) as i64,
    ]
}
