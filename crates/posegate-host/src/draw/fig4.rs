//! Fig. 4 of the paper: the tag at a bad place, and at the best places.

use super::placement::placement_picture;
use super::study::CaseStudy;
use super::tag_places::SIGMA;

/// Returns an SVG of Fig. 4: the tag at the start, and at its best places.
#[must_use]
pub fn fig4_placement(study: &CaseStudy) -> String {
    let title = format!(
        "Fig. 4: from a far, oblique place to the best ones (sigma {SIGMA} m, 1° in all but (b))"
    );
    placement_picture(&title, &study.places)
}
