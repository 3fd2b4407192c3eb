//! Fig. 4 of the paper: the tag at a bad place, and at the best places.

use super::placement::placement_picture;
use super::study::CaseStudy;
use super::tag_places::SIGMA;
use posegate_place::Cost;

/// Returns an SVG of Fig. 4: the tag at the start, and at its best places.
#[must_use]
pub fn fig4_placement(study: &CaseStudy) -> String {
    let title = format!("Fig. 4: from a bad place to the best (sigma {SIGMA} m, 1°; none in (b))");
    placement_picture(&title, &Cost::default().definition(), &study.places)
}
