//! The hall from above: walls, tags, the goals of its tasks, the routes of robots, and the places of the looks at
//! tags.

use super::floor::Labels;
use super::ingredients::{Eye, Ingredients, ahead, frame, radians};
use super::legend::{LINE, Sample, legend};
use super::palette;
use super::panel::{Inside, Panel, tick_at_scale};
use super::svg::{Picture, Style, literal};
use super::task_plan::about;
use posegate::shape::{PoseDeg, SuccessSet};
use posegate_plan::{Route, RouteStep, StepKind};
use posegate_site::Site;

const CAMERA: Style = Style::outlined("#8a6d00", 1.8).dashed("5 2");
const GOAL: Style = Style::outlined(palette::INK, 2.2);
const ROUTE: Style = Style::outlined("#0072b2", 1.8);
/// Every place where the robot may be when it looks: blue and dashed.
const LOOK: Style = Style::outlined("#0072b2", 1.4)
    .with_fill_opacity("#0072b2", 0.22)
    .dashed("4 2");
const SIGHT: Style = Style::outlined("#444444", 1.0).dashed("1 3");

/// Returns the success set of a task or of a look that the planner made; `None` for another name.
pub fn success_of<'s>(site: &'s Site, name: &str) -> Option<&'s SuccessSet> {
    let made = site.planner.looks.get(name).map(|look| &look.success);
    let own = site.tasks.get(name).map(|task| &task.success);
    own.or(made)
}

fn looks(routes: &[Route]) -> Vec<&RouteStep> {
    let steps = routes.iter().flat_map(|route| &route.steps);
    steps
        .filter(|step| step.kind == StepKind::Localization)
        .collect()
}

/// Returns the robots at the goals of the tasks of some routes, or of all tasks if there is no route: goals and outlines.
fn robots(site: &Site, routes: &[Route]) -> Vec<(PoseDeg, Vec<[f64; 2]>)> {
    let mut robots = Vec::new();
    for (name, task) in &site.tasks {
        let mut steps = routes.iter().flat_map(|route| &route.steps);
        if routes.is_empty() || steps.any(|step| step.task.as_ref() == Some(name)) {
            let outlines = Ingredients::of(&task.success.shape).outlines.into_iter();
            robots.extend(outlines.map(|outline| (task.success.goal, outline)));
        }
    }
    robots
}

/// Returns the corners of all drawn parts, in the world.
fn points(site: &Site, routes: &[Route]) -> Vec<[f64; 2]> {
    let mut points: Vec<[f64; 2]> = Vec::new();
    points.extend(site.tags.values().map(|t| [t.tag.pose.x, t.tag.pose.y]));
    let walls = site.walls.iter();
    points.extend(walls.flat_map(|wall| wall.corners.iter().copied()));
    let goals = || site.tasks.values().map(|task| task.success.goal);
    points.extend(goals().map(|goal| [goal.x, goal.y]));
    for (goal, outline) in robots(site, routes) {
        let place = frame(radians(goal));
        points.extend(outline.iter().map(|p| place.to_goal(*p)));
    }
    for camera in site.cameras.values() {
        points.extend(goals().map(|goal| {
            let [x, y, _] = Eye::of(&camera.mount, radians(goal)).centre;
            [x, y]
        }));
    }
    for step in routes.iter().flat_map(|route| &route.steps) {
        let ([x, y], reach) = (step.from, step.reach);
        points.extend([[x - reach, y - reach], [x + reach, y + reach]]);
        points.push(step.to);
    }
    if points.is_empty() {
        points.push([0.0; 2]);
    }
    points
}

/// Returns the panel of a hall with its left upper corner at a point, at most as large as `largest` (pixels).
pub(super) fn hall_panel(
    site: &Site,
    routes: &[Route],
    corner: [f64; 2],
    largest: [f64; 2],
) -> Panel {
    Panel::fitted(about(&points(site, routes)), corner, largest)
}

/// Draws the hall into its panel.
pub(super) fn hall(
    picture: &mut Picture,
    panel: &Panel,
    site: &Site,
    routes: &[Route],
    title: &str,
) {
    let scale = panel.scale;
    let hall = Hall {
        site,
        routes,
        scale,
    };
    panel.draw(picture, title, tick_at_scale(scale, 60.0), |inside| {
        hall.draw_bodies(inside);
        hall.draw_steps(inside);
        hall.draw_goals_and_tags(inside);
        let mut labels = Labels::default();
        hall.avoid_drawn(inside, &mut labels);
        hall.label_tasks_and_tags(inside, &mut labels);
        hall.label_starts(inside, &mut labels);
        for wall in &site.walls {
            // At a corner of the hall, a name would be next to two walls.
            if let Some(at) = inside.middle(&wall.corners) {
                labels.place(inside, at, &literal(&wall.name));
            }
        }
    });
}

/// The drawn parts of a hall.
struct Hall<'a> {
    site: &'a Site,
    routes: &'a [Route],
    /// Pixels per metre.
    scale: f64,
}

impl Hall<'_> {
    /// Yields the goals of the tasks.
    fn goals(&self) -> impl Iterator<Item = PoseDeg> {
        self.site.tasks.values().map(|task| task.success.goal)
    }

    /// Yields the steps of all routes.
    fn steps(&self) -> impl Iterator<Item = &RouteStep> {
        self.routes.iter().flat_map(|route| &route.steps)
    }

    /// Draws the walls, and the robots at the goals.
    fn draw_bodies(&self, inside: &mut Inside<'_>) {
        self.site.walls.iter().for_each(|wall| inside.wall(wall));
        for (goal, outline) in robots(self.site, self.routes) {
            inside.robot(&outline, radians(goal));
        }
    }

    /// Draws the looks with their lines of sight, and the drives.
    fn draw_steps(&self, inside: &mut Inside<'_>) {
        for step in looks(self.routes) {
            let at = step.from;
            inside.disc(at, step.reach, &LOOK);
            let name = step.task.as_deref();
            let set = name.and_then(|name| success_of(self.site, name));
            for tag in set.map(SuccessSet::tags).unwrap_or_default() {
                inside.line(&[at, [tag.pose.x, tag.pose.y]], &SIGHT);
            }
        }
        for step in self.steps() {
            if step.kind == StepKind::Navigation {
                inside.arrow(step.from, step.to, &ROUTE);
            }
        }
    }

    /// Draws the goals and the tags; without routes, also the cameras at the goals.
    fn draw_goals_and_tags(&self, inside: &mut Inside<'_>) {
        if self.routes.is_empty() {
            for goal in self.goals() {
                for camera in self.site.cameras.values() {
                    let eye = Eye::of(&camera.mount, radians(goal));
                    let ([x, y, _], [fx, fy, _]) = (eye.centre, eye.axes[0]);
                    let ahead = 24.0 / self.scale;
                    inside.arrow([x, y], [x + ahead * fx, y + ahead * fy], &CAMERA);
                }
            }
        }
        self.goals().for_each(|goal| inside.pose(goal, &GOAL));
        let tags = self.site.tags.values();
        tags.for_each(|tag| inside.tag(&tag.tag));
    }

    /// Reserves the area of looks, drives, goals and tags, so that no label covers them.
    fn avoid_drawn(&self, inside: &mut Inside<'_>, labels: &mut Labels) {
        for step in looks(self.routes) {
            labels.avoid(inside, step.from, step.reach * self.scale);
        }
        for step in self.steps() {
            let [from, to] = [step.from, step.to];
            let between = |t: f64| [0, 1].map(|axis| from[axis] + t * (to[axis] - from[axis]));
            let length = libm::hypot(to[0] - from[0], to[1] - from[1]) * self.scale;
            let count = libm::ceil(length / 14.0).min(100.0) as u32;
            for k in 0..=count {
                let t = f64::from(k) / f64::from(count.max(1));
                labels.avoid(inside, between(t), 3.0);
            }
        }
        for goal in self.goals() {
            let middle = ahead(radians(goal), 13.0 / self.scale);
            labels.avoid(inside, middle, 9.0);
        }
        for tag in self.site.tags.values() {
            labels.avoid(inside, [tag.tag.pose.x, tag.tag.pose.y], 6.0);
        }
    }

    /// Labels tasks at their goals, and tags. Tasks that share a goal share a label.
    fn label_tasks_and_tags(&self, inside: &mut Inside<'_>, labels: &mut Labels) {
        let mut tasks: Vec<([f64; 2], String)> = Vec::new();
        for (name, task) in &self.site.tasks {
            let at = [task.success.goal.x, task.success.goal.y];
            match tasks.iter_mut().find(|(known, _)| *known == at) {
                Some((_, text)) => *text += &format!(", {}", literal(name)),
                None => tasks.push((at, literal(name))),
            }
        }
        for (at, text) in &tasks {
            labels.place(inside, *at, text);
        }
        for (name, tag) in &self.site.tags {
            let text = format!("{}, id {}", literal(name), tag.tag.id);
            labels.place(inside, [tag.tag.pose.x, tag.tag.pose.y], &text);
        }
    }

    /// Draws the starts of the routes. Routes that share a start share a label.
    fn label_starts(&self, inside: &mut Inside<'_>, labels: &mut Labels) {
        for (number, route) in self.routes.iter().enumerate() {
            let Some(first) = route.steps.first() else {
                continue;
            };
            inside.disc(first.from, 0.0, &Style::filled("#0072b2"));
            let begun = self.routes[..number]
                .iter()
                .filter_map(|other| other.steps.first());
            if !begun.map(|step| step.from).any(|at| at == first.from) {
                labels.place(inside, first.from, "start");
            }
        }
    }
}

/// Draws the legend of a hall in two columns; the point is the upper left corner.
pub(super) fn hall_legend(
    picture: &mut Picture,
    [left, top]: [f64; 2],
    entries: &[(Sample, &str)],
) {
    let rows = entries.len().div_ceil(2);
    for (column, entries) in entries.chunks(rows).enumerate() {
        legend(picture, [left + 320.0 * column as f64, top], entries);
    }
}

/// Returns the height of the legend of a hall, pixels.
pub(super) fn legend_height(entries: &[(Sample, &str)]) -> f64 {
    LINE * entries.len().div_ceil(2) as f64
}

/// Returns the entries of the legend of a hall: one for each kind of drawn part.
pub(super) fn hall_entries(site: &Site, routes: &[Route]) -> Vec<(Sample, &'static str)> {
    let kinds = || routes.iter().flat_map(|route| &route.steps);
    let has = |kind| kinds().any(|step| step.kind == kind);
    let of_wall = |is_block: bool| {
        let walls = site.walls.iter();
        walls.filter(move |wall| (wall.corners.len() > 2) == is_block)
    };
    let wall = palette::WALL.with_outline("#444444", 3.5);
    let all = [
        (
            !site.tags.is_empty(),
            Sample::Line(palette::TAG),
            "tags; arrows: where their faces look",
        ),
        (
            true,
            Sample::Line(GOAL),
            "goals of the tasks, and their headings",
        ),
        (
            of_wall(true).count() > 0,
            Sample::Hatched(palette::WALL),
            "blocks",
        ),
        (of_wall(false).count() > 0, Sample::Line(wall), "walls"),
        (
            site.walls.iter().any(|wall| !wall.keep_outs.is_empty()),
            Sample::Line(palette::KEPT_OUT),
            "no tag may be mounted there, at some heights",
        ),
        (
            has(StepKind::Navigation),
            Sample::Line(ROUTE),
            "straight ways from the start to the goals",
        ),
        (
            has(StepKind::Localization),
            Sample::Disc(LOOK),
            "looks: every place where the robot may be",
        ),
        (
            has(StepKind::Localization),
            Sample::Line(SIGHT),
            "the tag that the robot sees there",
        ),
        (
            routes.is_empty() && !site.cameras.is_empty(),
            Sample::Line(CAMERA),
            "cameras there, where they look",
        ),
        (
            !robots(site, routes).is_empty(),
            Sample::Patch(palette::BODY),
            "robots at their goals",
        ),
    ];
    let drawn = all.into_iter().filter(|(is_drawn, ..)| *is_drawn);
    drawn.map(|(_, sample, words)| (sample, words)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const DOCK: &str = include_str!("../../../../examples/sites/dock.toml");

    /// Returns the box of the text in a picture: left, top, right, bottom.
    fn box_of(svg: &str, text: &str) -> [f64; 4] {
        let end = format!(">{text}</text>");
        let line = svg.lines().find(|line| line.ends_with(&end));
        let line = line.unwrap_or_else(|| panic!("no text `{text}`: {svg}"));
        let number = |name: &str| -> f64 {
            let (_, rest) = line.split_once(&format!(" {name}=\"")).unwrap();
            rest.split_once('"').unwrap().0.parse().unwrap()
        };
        let (x, y, size) = (number("x"), number("y"), number("font-size"));
        let wide = crate::draw::measure::text_width(text, size, true);
        [x, y - size, x + wide, y + 0.3 * size]
    }

    #[test]
    fn walls_are_labelled_at_their_middles() {
        let text = format!(
            "{DOCK}\n[wall.north]\nfrom = [-2.0, 3.0]\nto = [6.0, 3.0]\nz = [0.0, 2.5]\n\
             [wall.rack_a]\ncorners = [[1.0, -3.0], [3.0, -3.0], [3.0, -2.0], [1.0, -2.0]]\nz = [0.0, 2.5]\n"
        );
        let site = Site::parse(&text, "site.toml").unwrap();
        let mut picture = Picture::new(760.0, 760.0, "walls");
        let panel = hall_panel(&site, &[], [66.0, 50.0], [600.0, 560.0]);
        hall(&mut picture, &panel, &site, &[], "");
        let svg = picture.finish();
        for (name, middle) in [("north", [2.0, 3.0]), ("rack_a", [2.0, -2.5])] {
            assert_eq!(svg.matches(&format!(">{name}</text>")).count(), 1, "{svg}");
            let [left, top, right, bottom] = box_of(&svg, name);
            let [x, y] = panel.at(middle);
            let near = [x.clamp(left, right), y.clamp(top, bottom)];
            let off = libm::hypot(near[0] - x, near[1] - y);
            assert!(off <= 16.0, "{name}: {off} px from its middle: {svg}");
        }
    }
}
