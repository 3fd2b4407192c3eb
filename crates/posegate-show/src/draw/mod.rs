//! Pictures of success sets and pose-sets.
//!
//! Pictures are SVG: self-contained, with the same bytes on every host. The
//! paper's case study ([`study`]) is drawn ([`figures`]), and reported in numbers
//! ([`report`]). [`scene`] has what pictures are made of.
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

/// What pictures are made of: elements of SVG, panels with axes, legends. Their colours are in [`palette`].
pub mod scene {
    pub use super::legend::{Sample, legend, verdict};
    pub use super::panel::{Inside, Panel, Window, signed, tick_at_scale};
    pub use super::section::border;
    pub use super::svg::{Anchor, Font, Picture, Style, literal, number};
}

pub use self::belief::PoseSetF64;
pub(crate) use self::borders::borders_picture;
pub use self::chain::chain_picture;
pub use self::figures::figures;
pub use self::hall::success_of;
pub use self::placement::{Column, placement_picture};
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

mod belief;
mod borders;
mod chain;
mod figures;
mod floor;
mod hall;
pub(crate) mod ingredients;
mod legend;
mod letters;
mod measure;
pub mod palette;
pub(crate) mod panel;
mod pieces;
mod placement;
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
