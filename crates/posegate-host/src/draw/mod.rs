//! Pictures of success sets and pose-sets.
//!
//! Pictures are SVG, written by [`svg`]: self-contained, with the same bytes on every host. The
//! paper's case study ([`study`]) is drawn as its Figs. 1, 3 and 4, and reported in numbers
//! ([`report`]).

pub use self::borders::borders_picture;
pub use self::chain::chain_picture;
pub use self::fig4::fig4_placement;
pub use self::growth::logarithmic;
pub use self::localization::fig3_sections;
pub use self::parking::fig1_parking;
pub use self::placement::{Column, placement_picture};
pub use self::plan::fig3_plan;
pub use self::replay::replay_picture;
pub use self::sheet::{Mounted, mounting_sheet};
pub use self::subject::{DrawError, Subject};
pub use self::task_image::{SeenFrom, task_image, task_image_with_numbers};
pub use self::task_plan::task_plan;
pub use self::task_sections::task_sections;

pub mod belief;
mod borders;
mod chain;
pub mod depth;
pub mod doctor;
mod fig4;
mod floor;
mod growth;
mod ingredients;
mod legend;
mod letters;
mod localization;
mod multiple;
pub mod palette;
pub mod panel;
mod parking;
mod pieces;
mod placement;
mod plan;
mod replay;
pub mod report;
pub mod section;
mod sheet;
mod stanford;
pub mod study;
mod subject;
pub mod svg;
mod task_image;
mod task_plan;
mod task_sections;
#[cfg(test)]
mod tests;
