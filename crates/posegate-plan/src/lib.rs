//! Evaluates manual chains, and finds chains ([`Prepared::plan`]).
//!
//! Decisions are made by the core's own [`posegate::chain`] on proven tables. The sets are also kept in floats
//! ([`BeliefStateF64`]), for display and for comparison.
//!
//! ```
//! use posegate::chain::StartAssumption;
//! use posegate_plan::{Options, Prepared, Status, evaluate};
//! use posegate_site::Site;
//! # const SITE: &str = include_str!("../../../examples/sites/paper-chain.toml");
//!
//! // The site has a chain that a person wrote: look, drive, look, turn, dock.
//! let site = Site::parse(SITE, "paper-chain.toml")?;
//! let chain = &site.chains["back-to-dock"];
//! let report = evaluate(&site, "back-to-dock", chain, StartAssumption::AtGoal)?;
//! assert!(report.succeeds());
//!
//! // The cheapest chain from the same start that is certain to succeed, for any estimate.
//! let mut planner = Prepared::of(&site, Some("back-to-dock"))?;
//! let found = planner.plan(&chain.start, "dock", &Options::default())?;
//! assert_eq!(found.status, Status::Optimal);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
#![forbid(unsafe_code)]
#![deny(missing_docs)]

pub use self::belief::BeliefStateF64;
pub use self::chain::evaluate;
pub use self::costs::costs;
pub use self::crossings::crossing_notes;
pub(crate) use self::endpoint::TaskPlanner;
pub use self::error::PlanError;
pub use self::library::{Library, Look, Viewpoint};
pub use self::nearby::plan_near;
pub use self::planned::{Contingency, Nearest, Options, Plan, PlanResult, PlanStep, Status};
pub use self::planner::Prepared;
pub use self::plans::Plans;
pub use self::route::{Route, RouteStep};
pub use self::rule_bytes::{RuleOrder, write_rules};
pub use self::slack::{little_slack, margin_text};
pub use self::step_report::{ChainReport, StepKind, StepReport};
pub use self::stop::StopSignal;
pub use self::task_table::TaskTable;

#[doc = include_str!("language.md")]
pub mod language {}

mod attempt;
mod backward;
mod belief;
mod better_places;
mod bound;
mod certificate;
mod chain;
mod costs;
pub mod cover;
mod crossings;
mod endpoint;
mod error;
mod horizons;
mod json;
mod library;
mod map;
mod nearby;
mod planned;
mod planner;
mod plans;
mod problem;
mod proofs;
mod queue;
mod rescue;
mod route;
mod route_graph;
mod rule_bytes;
mod rules;
mod search;
pub mod site_build;
mod slack;
mod step_report;
mod stop;
mod task_table;
mod walk;
