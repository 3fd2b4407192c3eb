//! Minimal tagging of a whole site: the cheapest candidates with which every work task has a plan.

pub use self::answer::{ChosenTag, Cover, CoverOptions, Method, Polished, Stage, TaskCoverage};
pub use self::cover::cover;
pub use self::error::CoverError;
pub use self::polish::polished;
pub use self::written::written;

#[doc = include_str!("language.md")]
pub mod language {}

mod answer;
#[allow(clippy::module_inception)]
mod cover;
mod error;
mod exact;
mod greedy;
mod hung;
mod json;
mod master;
mod missing;
mod oracle;
mod polish;
mod room;
mod tags;
mod value;
mod written;
