//! Floor plan of a whole site, and of the routes that a build of the site found.

use super::hall::{hall, hall_entries, hall_legend, hall_panel, legend_height};
use super::legend::LINE;
use super::measure::{fitted, text_width};
use super::palette;
use super::svg::{Font, Picture, literal};
use posegate::contain::Margin;
use posegate_plan::site_build::{MergedPlan, MergedRoute};
use posegate_plan::{Route, little_slack, margin_text};
use posegate_site::Site;

/// The largest panel, pixels: A4 paper shows the plan at its own size.
const LARGEST: [f64; 2] = [600.0, 560.0];
const LEFT: f64 = 66.0;
const WIDTH: f64 = 690.0;
const MARGIN: f64 = 24.0;
/// Size of the words about a plan.
const SIZE: f64 = 12.0;
/// Largest number of plans with words of their own.
const PLANS: usize = 60;

/// Returns an SVG of a site's floor plan in the world, with the routes of some plans or chains.
#[must_use]
pub fn site_plan(site: &Site, routes: &[Route]) -> String {
    with_notes(site, routes, "The site, as its file says it", &[])
}

/// Returns an SVG of a site with the routes of its plans, and words about each plan: its cost and smallest margin, or the
/// reason why there is none.
#[must_use]
pub fn site_routes_picture(site: &Site, plans: &[MergedPlan]) -> String {
    let found = plans.iter().filter_map(|plan| plan.found.as_ref().ok());
    let routes: Vec<Route> = found.map(|found| found.route.clone()).collect();
    let title = match (plans.len(), routes.len()) {
        (0, _) => "The site: it was built without plans".to_owned(),
        (1, 1) => "The site, with the route of its plan".to_owned(),
        (all, served) if all == served => format!("The site, with the routes of its {all} plans"),
        (all, served) => format!("The site: {served} of {all} plans found"),
    };
    with_notes(site, &routes, &title, &notes(site, plans))
}

/// A line of words below the picture; `true` for a good result.
type Note = (String, bool);

/// Returns the words about each plan: first the tasks without a plan.
fn notes(site: &Site, plans: &[MergedPlan]) -> Vec<Note> {
    let (mut notes, mut advice) = (Vec::new(), None);
    for MergedPlan { from, task, found } in plans {
        if let Err(why) = found {
            notes.push((format!("{task} from {from}: NO PLAN: {why}"), false));
        }
    }
    let with_plan = plans.iter().filter_map(|plan| {
        let found = plan.found.as_ref().ok()?;
        Some((plan, found))
    });
    for (MergedPlan { from, task, .. }, found) in with_plan {
        let MergedRoute {
            cost, worst_margin, ..
        } = found;
        let margin = worst_margin.map(|margin| Margin::from_q16((margin * 65_536.0) as u32));
        let margin_words = margin.map_or_else(String::new, |margin| {
            format!("worst margin {}, ", margin_text(margin))
        });
        let mut text = format!("{task} from {from}: {margin_words}cost {cost:.3}");
        if let Some(words) = margin.and_then(little_slack) {
            text += ", little slack";
            advice = advice.or(Some(words));
        }
        notes.push((text, true));
    }
    let more = notes.len().saturating_sub(PLANS);
    if more > 0 {
        let failed = notes.iter().skip(PLANS).filter(|(_, good)| !good).count();
        notes.truncate(PLANS);
        let text = format!("and {more} more plans, of which {failed} are not found");
        notes.push((text, failed == 0));
    }
    if let Some(words) = advice {
        notes.push((format!("little slack: {words}"), false));
    }
    if plans.iter().any(|plan| plan.found.is_ok()) {
        let planner = &site.planner;
        notes.push((
            format!(
                "costs are in the unit of the site file: {} a metre, {} a look",
                planner.metre, planner.look_cost
            ),
            true,
        ));
    }
    notes
}

fn with_notes(site: &Site, routes: &[Route], title: &str, notes: &[Note]) -> String {
    let lines: Vec<Note> = notes
        .iter()
        .flat_map(|(text, good)| {
            let lines = wrapped(&literal(text), WIDTH - 2.0 * MARGIN);
            lines.into_iter().map(|line| (line, *good))
        })
        .collect();
    let panel = hall_panel(site, routes, [LEFT, 50.0], LARGEST);
    let (bottom, entries) = (panel.bottom(), hall_entries(site, routes));
    let below = bottom + 46.0 + legend_height(&entries) + 12.0;
    let height = below
        + match lines.len() {
            0 => 0.0,
            count => LINE * count as f64 + 12.0,
        };
    let mut picture = Picture::new(WIDTH, height, title);
    let font = Font::new(19.0, palette::INK).bold();
    picture.text([MARGIN, 30.0], title, &font);
    hall(&mut picture, &panel, site, routes, "");
    hall_legend(&mut picture, [MARGIN, bottom + 46.0], &entries);
    for (number, (line, good)) in lines.iter().enumerate() {
        let at = [MARGIN, below + LINE * (number as f64 + 0.75)];
        picture.text(at, line, &Font::new(SIZE, palette::of_words(*good)));
    }
    picture.finish()
}

/// Breaks a text between words into lines that are at most as wide as `most` pixels.
fn wrapped(text: &str, most: f64) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split(' ') {
        let fits = |line: &String| text_width(&format!("{line} {word}"), SIZE, false) <= most;
        match lines.last_mut().filter(|line| fits(line)) {
            Some(line) => *line = format!("{line} {word}"),
            None => lines.push(fitted(word, SIZE, false, most)),
        }
    }
    lines
}

#[cfg(test)]
mod tests;
