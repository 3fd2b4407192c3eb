//! Evaluates manual chains, and finds chains ([`Prepared::plan`]).
//!
//! Decisions are made by the core's own [`posegate::chain`] on proven tables. The sets are also kept in floats, as
//! CONVENTIONS.md defines them, for display and for comparison.

pub use self::belief::BeliefStateF64;
pub use self::chain::{ChainReport, StepKind, StepReport, evaluate};
pub use self::costs::costs;
pub use self::endpoint::TaskPlanner;
pub use self::error::PlanError;
pub use self::library::{Library, Look, Viewpoint};
pub use self::planned::{Contingency, Nearest, Options, Plan, PlanResult, PlanStep, Status};
pub use self::planner::Prepared;
pub use self::plans::Plans;
pub use self::rule_bytes::{RuleOrder, write_rules};
pub use self::task_table::TaskTable;

#[doc = include_str!("language.md")]
pub mod language {}

mod backward;
mod belief;
mod certificate;
mod chain;
mod costs;
mod endpoint;
mod error;
mod json;
mod library;
mod map;
mod planned;
mod planner;
mod plans;
mod rule_bytes;
mod rules;
mod search;
mod task_table;
mod walk;
