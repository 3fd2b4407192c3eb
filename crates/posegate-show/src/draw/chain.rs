//! Draws a chain step by step, as in the paper's Figs. 2 and 3: the pose-set before each step, and S.

use super::hall::{hall, hall_entries, hall_legend, hall_panel, legend_height};
use super::ingredients::ahead;
use super::legend::{Sample, legend};
use super::palette;
use super::panel::{Inside, Panel, Window, tick_at_scale};
use super::section::border;
use super::svg::{Font, Picture, Style, literal};
use posegate::shape::SuccessSet;
use posegate_plan::{BeliefStateF64, ChainReport, Route, StepKind, StepReport};
use posegate_replay::factor_text;
use posegate_site::Site;

/// Edge of a panel, pixels.
const EDGE: f64 = 250.0;
const COLUMNS: usize = 4;
const LEFT: f64 = 66.0;
const TOP: f64 = 84.0;
const ACROSS: f64 = EDGE + 50.0;
const DOWN: f64 = EDGE + 96.0;

/// Every pose from which a step must be possible: the estimate's spread plus its error.
const NEEDED: Style = Style::outlined("#444444", 1.2).dashed("2 3");

/// The largest panel of the hall, pixels.
const HALL: [f64; 2] = [600.0, 420.0];

/// Returns an SVG of a chain; `success` returns the success set of a task by its name. With a site, its hall comes first, with
/// the route and the poses at which the robot looks.
#[must_use]
pub fn chain_picture<'s>(
    name: &str,
    report: &ChainReport,
    success: &dyn Fn(&str) -> Option<&'s SuccessSet>,
    site: Option<&Site>,
) -> String {
    let columns = report.steps.len().clamp(1, COLUMNS);
    let rows = report.steps.len().div_ceil(COLUMNS).max(1);
    let width = LEFT + columns as f64 * ACROSS + 10.0;
    let title = format!("Chain {}", literal(name));
    // The height of the hall determines where the steps begin.
    let routes = [Route::from(report)];
    let hall_of = site.map(|site| {
        let panel = hall_panel(site, &routes, [LEFT, TOP + 14.0], HALL);
        (site, panel, hall_entries(site, &routes))
    });
    let first = hall_of.as_ref().map_or(TOP, |(_, panel, entries)| {
        panel.bottom() + 44.0 + legend_height(entries) + 34.0
    });
    let bottom = first + rows as f64 * DOWN;
    let mut picture = Picture::new(width.max(760.0), bottom + 96.0, &title);
    picture.text([24.0, 32.0], &title, &Font::new(19.0, palette::INK).bold());
    let whole = match report.first_failure() {
        None => format!("succeeds, with a risk of at most {}", report.risk_text()),
        Some((index, _)) => format!("fails at step {}", index + 1),
    };
    let colour = palette::of_words(report.succeeds());
    picture.text([24.0, 54.0], &whole, &Font::new(14.0, colour));
    if let Some((site, panel, entries)) = &hall_of {
        hall(&mut picture, panel, site, &routes, "The hall and the route");
        hall_legend(&mut picture, [24.0, panel.bottom() + 44.0], entries);
    }
    for (index, step) in report.steps.iter().enumerate() {
        let set = step.task.as_deref().and_then(success);
        panel(&mut picture, [LEFT, first + 14.0], index, step, set);
    }
    legend(
        &mut picture,
        [24.0, bottom + 6.0],
        &[
            (
                Sample::Patch(palette::AREA),
                "S at the heading that the estimate is meant to have",
            ),
            (
                Sample::Disc(palette::INSIDE),
                "what is known before the step, inside S (after a drive: what is known then)",
            ),
            (
                Sample::Disc(palette::NOT_INSIDE),
                "the same, not proven inside",
            ),
            (
                Sample::Disc(NEEDED),
                "every place where the robot may be: the estimate, too, may be off its place",
            ),
        ],
    );
    picture.finish()
}

/// Draws a step: its panel, and two lines below it. The first step's corner is given.
fn panel(
    picture: &mut Picture,
    corner: [f64; 2],
    index: usize,
    step: &StepReport,
    success: Option<&SuccessSet>,
) {
    let half = half_width(step);
    let middle = match step.kind {
        StepKind::Navigation => {
            [0, 1].map(|axis| 0.5 * (step.before.pose[axis] + step.after.pose[axis]))
        }
        _ => position(shown(step)),
    };
    let window = Window::about(middle, half);
    let panel = Panel::fitted(window, corner, [EDGE; 2]).in_rows(index, COLUMNS, [ACROSS, DOWN]);
    let scale = panel.scale;
    let what = match (&step.task, step.kind) {
        (Some(task), StepKind::Localization) => format!("{}. look: {}", index + 1, literal(task)),
        (Some(task), _) => format!("{}. work: {}", index + 1, literal(task)),
        (None, _) => format!("{}. navigate, {:.2} m", index + 1, length(step)),
    };
    panel.draw(picture, &what, tick_at_scale(scale, 60.0), |inside| {
        if let Some(set) = success {
            let depth = set.evaluator();
            let heading = shown(step).pose[2];
            let holds = |[x, y]: [f64; 2]| depth.holds([x, y, heading]);
            let area: Vec<Vec<[f64; 2]>> = border(&holds, &window, 1.5 / scale);
            inside.polygons(&area, &palette::AREA);
            inside.polygons(&area, &palette::BORDER);
        }
        draw_sets(inside, step, 0.16 * half);
    });
    draw_words(picture, [panel.left, panel.top + EDGE], step);
}

/// Returns the belief that a panel shows: after a drive, before any other step.
fn shown(step: &StepReport) -> &BeliefStateF64 {
    match step.kind {
        StepKind::Navigation => &step.after,
        _ => &step.before,
    }
}

/// Returns the position of a belief's pose.
fn position(belief: &BeliefStateF64) -> [f64; 2] {
    [belief.pose[0], belief.pose[1]]
}

/// Returns the largest distance of the robot from a belief's pose, metres.
fn reach(belief: &BeliefStateF64) -> f64 {
    belief.enclosing()[0] + belief.spread[0]
}

/// Returns the distance between the poses before and after a step, metres.
fn length(step: &StepReport) -> f64 {
    let [from, to] = [step.before.pose, step.after.pose];
    libm::hypot(to[0] - from[0], to[1] - from[1])
}

/// Returns half of the width of a step's panel, metres.
fn half_width(step: &StepReport) -> f64 {
    match step.kind {
        StepKind::Navigation => {
            0.5 * length(step) + reach(&step.before).max(reach(&step.after)) + 0.1
        }
        _ => 2.2 * reach(&step.before) + 0.05,
    }
}

/// Draws the beliefs of a step. The arrow at the shown pose has a length of `nose` metres.
fn draw_sets(inside: &mut Inside<'_>, step: &StepReport, nose: f64) {
    let (from, shown) = (&step.before, shown(step));
    if step.kind == StepKind::Navigation {
        let start = position(from);
        inside.disc(start, from.enclosing()[0], &palette::EXTENT);
        inside.disc(start, reach(from), &NEEDED);
        let way = Style::outlined(palette::INK, 1.6);
        inside.arrow(start, position(&step.after), &way);
    }
    let at = position(shown);
    inside.disc(at, reach(shown), &NEEDED);
    let style = palette::of_set(step.failure.is_none());
    inside.disc(at, shown.enclosing()[0], &style);
    let nose = ahead(shown.pose, nose);
    inside.arrow(at, nose, &Style::outlined(palette::INK, 2.0));
}

/// Draws the uncertainty and the result of a step below its panel.
fn draw_words(picture: &mut Picture, [left, bottom]: [f64; 2], step: &StepReport) {
    let [m, rad] = shown(step).enclosing();
    let known = format!(
        "{:.1} cm, yaw {:.1}° about the estimate",
        100.0 * m,
        rad.to_degrees()
    );
    let font = Font::new(12.0, palette::INK);
    picture.text([left, bottom + 46.0], &known, &font);
    let verdict = match (step.margin, step.failure) {
        (Some(margin), None) => format!("inside, margin {}", factor_text(margin)),
        (Some(margin), Some(_)) => format!("not inside, margin {}", factor_text(margin)),
        (None, Some(_)) => "no growth for this start".into(),
        (None, None) => format!(
            "from within {:.1} cm of its beginning",
            100.0 * step.before.spread[0]
        ),
    };
    let colour = palette::of_words(step.failure.is_none());
    let font = Font::new(12.0, colour);
    picture.text([left, bottom + 62.0], &verdict, &font);
}
