//! One facet over all headings of a pose-set, for sets whose heading is uncertain.
//!
//! At the heading offset `t = T u` (`-1 <= u <= 1`, T the largest offset) the ellipsoid `{F u : |u| <= 1}` is an
//! ellipse about `f u`, f the first column of F in the plane, with the other two columns times
//! `r(u) = sqrt(1 - u^2)`. A facet `n . P <= b` therefore asks whether a function of one variable stays
//! below zero. With `J` a quarter turn and m the estimate:
//!
//! - World axes, point v: `n.m + (n.f) u + N r(u) + C cos(t) + S sin(t) <= b`, where `C = n . R v`, `S = n . J R v` at
//!   the estimate's heading and `N = |F23' n|`.
//! - Robot axes, point q: `n_t . (m - q + f u) + |F23' n_t| r(u) <= b`, where `n_t = R(heading + t) n`.
//!
//! [`holds`] cuts `[-1, 1]` into slabs. Each slab has its middle e, its half width h in u and its half width
//! `w = T h <= 1` in heading. C, S, N and the products with f are evaluated at its middle heading; x = u - e. A slab
//! holds if one of two upper bounds does, else it is halved. The exact section at its middle denies at once.
//!
//! # The bounds of a slab
//! | part | at most |
//! |---|---|
//! | `S sin(T x)` | `kappa S T x + abs(S) (w^3/24 + w^5/3000)`, `kappa = 1 - w^2/8` |
//! | `C cos(T x)` | first bound: C if C > 0, else `C cos w`; second bound: `C - C (1 - cos w) (x/h)^2` if C > 0, else `C cos w` |
//! | robot axes: `cos(T x) G x`, `G = n.f` | `G x + abs(G) h (1 - cos w)` |
//! | robot axes: `sin(T x) H x`, `H = (J n).f` | `H h w (x/h)^2` if H > 0, else 0 |
//! | robot axes: `abs(F23' n_t)` | the larger of `abs(F23' (n +- tan(w) J n))` |
//! | first bound: `g x + N r(e + x)` | its largest value on the slab: at an end, or `hypot(g, N) - g e` |
//! | second bound: `N r(u)` | `N (p + (1 - u^2) / p) / 2` for any p > 0: a parabola, whose largest value is known |
//!
//! # Rounding
//! Lengths are "fine": 2^-14 of the layout's length unit, below 2^31. What rounds to the nearest is paid by [`SLACK`]; all else rounds
//! against acceptance. What the estimate's own rounding does is paid by the table ([`super::facet_clearance_q14`]).
//!
//! | rounded to the nearest | fine units, at most |
//! |---|---|
//! | cosine and sine, 2 of 2^-30, times 2^14; each coordinate of the turned normal 0.5 of 2^-28: 1.3 in a vector of 2^28, times a point of 2^15.5 units | 3.6 for C, the same for S times w |
//! | the middle's heading to 2^-32 turn: 0.8e-9 rad, times 2^29.5 | 0.7 |
//! | C, S, G, H to fine units | 2 |
//! | T to 2^-28 rad: 2.5, times h <= w / T, times S: `2.5 w 2^29.5 / (2^28 T)`, T >= 2^-21 turn | 8 |
//! | kappa, and its products: `S T` and `G e` to fine units | 4 |
//! | **sum** | **23** |

use super::facets::NearestFacet;
use crate::num::{BinaryAngle, product, sqrt_ceil};
use crate::set::{Extent, PoseSet};
use crate::table::{Axes, Facet, Facets, Frame, NORMAL_BITS};
