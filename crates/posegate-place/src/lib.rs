//! Placement of tags: the expected cost of a tag's place, and the search for the best place.
//!
//! ```
//! use posegate_place::{Cost, Gaussian, Quadrature, expected_cost};
//! use posegate_site::{SAMPLE, Site};
//!
//! let site = Site::parse(SAMPLE, "site.toml")?;
//! let set = &site.task("see-t7").expect("the sample has a task `see-t7`").success;
//! let belief = Gaussian::of_sigmas([0.3, 0.3, 1f64.to_radians()], 0.99)?;
//! let cost = expected_cost(set, &belief, &Cost::default(), &Quadrature::default())?;
//! // The robot sees the tag from all of its pose-set.
//! assert_eq!(cost.outside_mass.value, 0.0);
//! assert!((cost.mass.value - 0.99).abs() < 1e-12);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
#![forbid(unsafe_code)]
#![deny(missing_docs)]

pub use self::cost::{Cost, CostError, ExpectedCost, expected_cost, expected_cost_of};
pub use self::gaussian::{Gaussian, GaussianError};
pub use self::learnt::{LearntCost, ViewBound};
pub use self::objective::{Objective, PosePrior, Task, ViewCost};
pub use self::placement::{
    PlaceError, Placed, Placement, PlacementProblem, Restart, compare, place,
};
pub use self::quadrature::{Approximate, Quadrature};
pub use self::ranges::{Candidate, candidates, ranges};
pub use self::search::Method;
pub use self::space::{Space, SpaceError};

mod accuracy;
mod cost;
mod disc;
mod gaussian;
mod guesses;
mod headings;
mod json;
mod learnt;
mod objective;
mod placement;
mod quadrature;
mod ranges;
mod rays;
mod rough;
mod scale;
mod search;
mod space;
#[cfg(test)]
mod tests;
