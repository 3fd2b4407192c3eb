//! Pictures of success sets and pose-sets.
//!
//! Pictures are SVG, written here ([`svg`]): self-contained and the same bytes on every host. The
//! paper's case study ([`study`]) is drawn as its Figs. 1 and 3 and told in numbers ([`report`]).

pub use self::localization::fig3_sections;
pub use self::parking::fig1_parking;
pub use self::plan::fig3_plan;

mod legend;
mod localization;
mod multiple;
pub mod palette;
pub mod panel;
mod parking;
mod plan;
pub mod report;
pub mod section;
pub mod study;
pub mod svg;
