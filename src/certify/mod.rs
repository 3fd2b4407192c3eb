//! Outward-rounded intervals: is this block of poses inside S? And what does this camera see?
//!
//! Every answer "yes" is a proof: each operation rounds outwards, angles and their functions are
//! enclosed, and no sample stands for what lies between samples.
//!
//! # What a camera sees
//!
//! A distorted image has a border that no plane through the camera draws. What a table needs is a
//! convex cone of which it is proven that all of it is seen: a polygon of normalised points
//! ([`Window`](crate::shape::Window)). [`CertifiedCamera::of`] chooses one with plain floats, and proves it with
//! outward-rounded intervals:
//!
//! 1. *The field* ([`Lens::field`](crate::shape::Lens::field)). With s = r^2 and the radial factor f(s), a
//!    distortion's Jacobian is `J = f I + 2 f' p p' + 2 (q p' + p q') + 2 (q.p) I`, q = (p2, p1): it is
//!    symmetric. Radially and across, its first two terms have the eigenvalues (r f)' and f; the others
//!    have `4 q.p +- 2 |q| |p|`, which is at least `-6 |q| r`. So where `min(f, (r f)') > 6 |q| r` on
//!    [0, R], shown interval by interval, J is positive definite on the disc of radius R: its determinant
//!    is above 0, and as `(F(b) - F(a)).(b - a)` is the integral of `(b - a)' J (b - a)` along the line,
//!    F takes no two points of the disc to the same one. (Worst is the direction of -q, where the bound
//!    is exact.)
//! 2. *The polygon* is what it is taken for: its corners, enclosed as the meeting points of neighbouring
//!    planes, are strictly within all others. So each is a corner of the planes' common part, each plane's edge runs
//!    between two of them, and there is nothing else. They are in the disc, and so is all of it.
//! 3. *Its border* is mapped into the image: each edge, piece by piece, through the distortion with its
//!    derivative.
//! 4. *Its interior* follows. F is open there (J has an inverse), so where u or v is largest or smallest
//!    on the polygon is no point of the interior: it is on the border, and lies in the image by 3.

pub(crate) use self::block::PartProver;
pub use self::block::{BOX_BORDER_M, BOX_BORDER_RAD, Block, Prover, goal_cos_sin};
pub use self::body::{Body, ProofBudget};
pub use self::interval::Interval;
pub use self::lens::{Calibration, CertifiedCamera, Image, LensError, Roi};
pub use self::slope::{Slope, sharp};

mod block;
mod body;
mod interval;
mod lens;
mod optic;
mod slope;
