//! Minimal tagging of a whole site: the cheapest candidates with which every work task has a plan.
//!
//! ```
//! use posegate_plan::cover::{CoverOptions, cover, written};
//! use posegate_site::Site;
//! # const SITE: &str = include_str!("../../../../examples/sites/docks.toml");
//!
//! // Three docks, and ten places where a tag could be mounted.
//! let site = Site::read("../../examples/sites/docks.toml")?;
//! let found = cover(&site, &CoverOptions::default(), &|_, _| ())?;
//! assert!(found.tasks.iter().all(|task| task.reason.is_none()));
//! // The bound is proven: no choice of tags costs less.
//! assert!(found.bound <= found.cost && found.tags.len() < 10);
//!
//! // The site file with the chosen tags instead of the candidates.
//! let text = written(SITE, "docks.toml", &found).expect("the text of this site");
//! assert!(text.contains("[tag."));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub use self::answer::{
    ChosenTag, Cover, CoverOptions, Incumbent, Method, Stage, TaskCoverage, Watch,
};
pub use self::clearance::{on_a_keep_out, overlap};
pub use self::cover::{cover, cover_watched};
pub use self::error::CoverError;
pub use self::written::written;

#[doc = include_str!("language.md")]
pub mod language {}

mod answer;
mod clearance;
#[allow(clippy::module_inception)]
mod cover;
mod error;
mod exact;
mod greedy;
mod json;
mod master;
mod missing;
mod mounted;
mod oracle;
mod tags;
mod value;
mod written;
