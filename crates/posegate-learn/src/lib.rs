#![doc = include_str!("language.md")]
#![forbid(unsafe_code)]
#![deny(missing_docs)]

pub use self::binomial::{acceptance, at_most, clopper_pearson, conformal_rank, rank};
pub use self::bounds::{BoundsSettings, learn_bounds};
pub use self::by_age::{ByAge, by_age_json};
pub use self::check::{
    BoundCheck, Change, CheckReport, CheckSettings, DetectionCheck, RegionCheck, check_bounds,
};
pub use self::detections::{DRAWN, Detection, Detections, places};
pub use self::error::LearnError;
pub use self::error_model::{CellReport, Detectability, ErrorModel, RegionReport};
pub use self::estimates::{Scored, ScoredEstimates, conditions};
pub use self::groups::GroupReport;
pub use self::inflation::{InflationModel, InflationReport, InflationSettings, learn_inflation};
pub use self::kind::Model;
pub use self::outcomes::{OutcomesReport, outcomes, test_outcomes};
pub use self::runs::{RunSource, Runs};
pub use self::sequence::confidence_sequence;
pub use self::survey::{Look, OffsetReport, Surveyed, SurveyedSite, looks, survey};
pub use self::taken_with::{MountRecord, TakenWith};
pub use self::views::ViewBox;

mod axis;
mod binomial;
mod bounds;
mod by_age;
mod calibration;
mod cells;
mod check;
mod detections;
mod document;
mod draw;
mod error;
mod error_model;
mod estimates;
mod family;
mod groups;
mod inflation;
mod kind;
mod memory;
mod model_file;
mod outcomes;
mod quantiles;
mod random;
mod runs;
mod sample;
mod sequence;
mod smooth;
mod split;
mod survey;
mod taken_with;
mod views;
