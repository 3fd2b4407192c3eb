//! Floor plan of a whole site.

use super::hall::{hall, hall_legend};
use super::palette;
use super::svg::{Font, Picture};
use crate::plan::ChainReport;
use crate::site::Site;

/// The largest panel, pixels: A4 paper shows the plan at its own size.
const LARGEST: [f64; 2] = [600.0, 560.0];
const LEFT: f64 = 66.0;
const WIDTH: f64 = 690.0;

/// Returns an SVG of a site's floor plan in the world, with the routes of some plans or chains.
#[must_use]
pub fn site_plan(site: &Site, routes: &[&ChainReport]) -> String {
    let title = "The site, as its file says it";
    // The panel determines the height: draw it once for its size.
    let mut trial = Picture::new(WIDTH, 2.0 * LARGEST[1], title);
    let bottom = hall(&mut trial, site, routes, "", [LEFT, 50.0], LARGEST).bottom();
    let mut trial = Picture::new(WIDTH, 2.0 * LARGEST[1], title);
    let legend = hall_legend(&mut trial, site, routes, [24.0, bottom]);
    let mut picture = Picture::new(WIDTH, bottom + 46.0 + legend + 12.0, title);
    picture.text([24.0, 30.0], title, &Font::new(19.0, palette::INK).bold());
    hall(&mut picture, site, routes, "", [LEFT, 50.0], LARGEST);
    hall_legend(&mut picture, site, routes, [24.0, bottom + 46.0]);
    picture.finish()
}
