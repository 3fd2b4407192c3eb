//! Proofs by outward-rounded intervals: that a block of poses lies in S, and which points a camera sees.
//!
//! Every answer "yes" is a proof: each operation rounds outwards, angles and their functions are enclosed, and no
//! claim about a range rests on samples.
//!
//! ```
//! use posegate::certify::{Block, Prover};
//! use posegate::shape::{BoxSet, PoseDeg, Shape, SuccessSet};
//!
//! let success = SuccessSet {
//!     goal: PoseDeg { x: 0.0, y: 0.0, yaw_deg: 0.0 },
//!     shape: Shape::Box(BoxSet {
//!         x: [-0.08, 0.08],
//!         y: [-0.06, 0.06],
//!         yaw_deg: [-4.0, 4.0],
//!     }),
//! };
//! let prover = Prover::new(&success);
//! // All poses within 5 cm and 1.4 degrees of the goal, in micrometres and 2^-32 turn: proven.
//! let yaw = [-(1 << 24), 1 << 24];
//! assert!(prover.is_inside(&Block { x_um: [-50_000, 50_000], y_um: [-50_000, 50_000], yaw }));
//! // A block that leaves the set is not.
//! assert!(!prover.is_inside(&Block { x_um: [-50_000, 50_000], y_um: [-50_000, 61_000], yaw }));
//! ```
//!
//! # What a camera sees
//!
//! The border of a distorted image is not formed by planes through the camera. A table needs a convex cone of which
//! every point is proven to be seen: a polygon of normalised points ([`Window`](crate::shape::Window)).
//! [`CertifiedCamera::of`] chooses such a polygon with plain floats, and proves it with outward-rounded intervals:
//!
//! 1. *The field* ([`Lens::field`](crate::shape::Lens::field)). With s = r^2 and the radial factor f(s), a
//!    distortion's Jacobian is `J = f I + 2 f' p p' + 2 (q p' + p q') + 2 (q.p) I`, q = (p2, p1): it is
//!    symmetric. Radially and across, its first two terms have the eigenvalues (r f)' and f; the others
//!    have `4 q.p +- 2 |q| |p|`, which is at least `-6 |q| r`. So where `min(f, (r f)') > 6 |q| r` on
//!    [0, R], shown interval by interval, J is positive definite on the disc of radius R: its determinant
//!    is above 0, and as `(F(b) - F(a)).(b - a)` is the integral of `(b - a)' J (b - a)` along the line,
//!    F maps no two points of the disc to the same point. (Worst is the direction of -q, where the bound
//!    is exact.)
//! 2. *The polygon* is the one that the planes define: its corners, enclosed as the intersections of neighbouring
//!    planes, are strictly within all other planes. So each is a corner of the planes' intersection, each plane's
//!    edge runs between two of them, and there is nothing else. The corners are in the disc, and so is the polygon.
//! 3. *Its border* is mapped into the image: each edge, piece by piece, through the distortion with its
//!    derivative.
//! 4. *Its interior* follows. F is open there (J has an inverse), so u and v have no maximum or minimum in the
//!    interior of the polygon. Their extremes are on the border, which lies in the image by 3.

pub use self::block::{BOX_BORDER_M, BOX_BORDER_RAD, Block, Prover, goal_cos_sin};
pub(crate) use self::block::{PartProver, radians};
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
