//! Chains on the desk: hand-made ones evaluated, and ([`Prepared::plan`]) found.
//!
//! What decides is the core's own [`crate::chain`], on proven tables; beside it the sets are kept in floats, as
//! CONVENTIONS.md writes them, for people and for comparison.

pub use self::belief::Belief;
pub use self::chain::{ChainReport, StepKind, StepReport, evaluate};
pub use self::costs::costs;
pub use self::error::PlanError;
pub use self::library::{Library, Look, View};
pub use self::planner::{Contingency, Nearest, Options, Plan, PlanStep, Planned, Prepared, Status};
pub use self::rooms::Rooms;
pub use self::rule_bytes::{RuleOrder, write_rules};

#[doc = include_str!("language.md")]
pub mod language {}

mod belief;
mod certificate;
mod chain;
mod costs;
mod error;
mod json;
mod library;
mod planner;
mod rooms;
mod rule_bytes;
mod rules;
mod search;
