//! Pictures of success sets and pose-sets.
//!
//! Pictures are SVG: self-contained, with the same bytes on every host. The
//! paper's case study ([`study`]) is drawn as its Figs. 1 to 4, and reported in numbers
//! ([`report`]).
//!
//! ```
//! use posegate_show::draw::{Subject, task_plan};
//! use posegate_site::{SAMPLE, Site};
//!
//! let site = Site::parse(SAMPLE, "site.toml")?;
//! let picture = task_plan(&Subject::new(&site, "see-t7")?)?;
//! assert!(picture.starts_with("<svg "));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub use self::belief::PoseSetF64;
pub(crate) use self::borders::borders_picture;
pub use self::chain::chain_picture;
pub use self::fig2::fig2_chain;
pub use self::fig4::fig4_placement;
pub use self::growth::logarithmic;
pub use self::hall::success_of;
pub use self::localization::fig3_sections;
pub use self::parking::fig1_parking;
pub use self::placement::{Column, placement_picture};
pub use self::plan::fig3_plan;
pub use self::replay::replay_picture;
pub use self::sheet::{Mounted, MountingSheet, mounting_sheet, mounting_sheet_html};
pub use self::site_pictures::site_pictures;
pub(crate) use self::site_plan::site_plan;
pub use self::site_plan::site_routes_picture;
pub use self::subject::{DrawError, Subject};
pub(crate) use self::task_image::task_image_with_numbers;
pub use self::task_image::{SeenFrom, task_image};
pub use self::task_plan::task_plan;
pub use self::task_sections::task_sections;

mod answers;
mod belief;
mod borders;
mod chain;
mod fig2;
mod fig4;
mod floor;
mod growth;
mod hall;
pub(crate) mod ingredients;
mod legend;
mod letters;
mod localization;
mod measure;
mod multiple;
mod palette;
pub(crate) mod panel;
mod parking;
mod parking_errors;
mod pieces;
mod placement;
mod plan;
mod portrait;
mod replay;
mod replay_lanes;
mod replay_map;
pub mod report;
mod section;
mod sheet;
mod site_pictures;
mod site_plan;
mod stanford;
pub mod study;
mod subject;
mod svg;
mod tag_image;
mod tag_places;
mod task_image;
mod task_plan;
mod task_sections;
#[cfg(test)]
mod tests;
