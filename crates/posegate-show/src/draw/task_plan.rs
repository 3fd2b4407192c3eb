//! The floor around a task: walls, tags, the goal, the robot, its camera's view, and S at the goal's heading.

use super::floor::seen;
use super::ingredients::{Eye, Ingredients, frame, radians};
use super::legend::{Sample, legend, verdict};
use super::palette;
use super::panel::{Inside, Panel, Window, signed, tick_at_scale};
use super::section::border;
use super::subject::{ContainmentResult, DrawError, Subject};
use super::svg::{Font, Picture, Style, literal};
use super::task_sections::{name_of, of_sets};
use posegate::shape::Tag;

/// The largest panel, pixels.
const LARGEST: [f64; 2] = [740.0, 620.0];
const LEFT: f64 = 66.0;
/// Distance between the sampling points of an area, pixels; its border is bisected between them.
const SPACING: f64 = 3.0;

/// Returns an SVG of a task's floor plan in the world.
///
/// # Errors
/// [`DrawError::NoExtent`] if no extent can be chosen.
pub fn task_plan(subject: &Subject<'_>) -> Result<String, DrawError> {
    let goal = subject.goal();
    let own = Ingredients::of(&subject.task.success.shape);
    let window = window(subject, &own)?;
    let panel = Panel::fitted(window, [LEFT, 76.0], LARGEST);
    let side = LEFT + panel.width() + 28.0;
    let title = format!("Floor plan of {}", literal(subject.name));
    let height = (panel.bottom() + 46.0).max(360.0);
    let mut picture = Picture::new(side + 330.0, height, &title);
    picture.text([24.0, 32.0], &title, &Font::new(19.0, palette::INK).bold());
    let held: Vec<_> = subject.beliefs.iter().map(|b| subject.held(b)).collect();
    let shown = format!("S at the goal's heading, {}°", signed(goal.yaw_deg));
    panel.draw(
        &mut picture,
        &shown,
        tick_at_scale(panel.scale, 60.0),
        |inside| {
            draw_areas(inside, subject, &own, &panel);
            draw_bodies(inside, subject, &own);
            let heading = radians(goal)[2];
            for (belief, held) in subject.beliefs.iter().zip(&held) {
                if let Some(section) = belief.section(heading) {
                    inside.polygons(&[section], &palette::of_set(held.inside));
                }
            }
            draw_tags_and_cameras(inside, subject, &own);
            draw_names(inside, subject, &own);
        },
    );
    let top = 76.0 + draw_verdict(&mut picture, [side, 76.0], subject, &held);
    let entries = [of_sets(&held), entries(subject, &own)].concat();
    legend(&mut picture, [side, top], &entries);
    Ok(picture.finish())
}

/// Draws S at the goal's heading, and what the cameras see from the goal.
fn draw_areas(inside: &mut Inside<'_>, subject: &Subject<'_>, own: &Ingredients, panel: &Panel) {
    let at_goal = radians(subject.goal());
    let spacing = SPACING / panel.scale;
    let holds = |[x, y]: [f64; 2]| subject.depth.holds([x, y, at_goal[2]]);
    let area = border(&holds, &panel.window, spacing);
    inside.polygons(&area, &palette::AREA);
    for view in &own.views {
        let seen = seen(view, at_goal, &panel.window, spacing);
        inside.polygons(&seen, &palette::VIEW);
    }
    inside.polygons(&area, &palette::BORDER);
}

/// Draws regions, obstacles, walls, and the robot at the goal.
fn draw_bodies(inside: &mut Inside<'_>, subject: &Subject<'_>, own: &Ingredients) {
    let world = |polygon: &Vec<[f64; 2]>| -> Vec<[f64; 2]> {
        polygon.iter().map(|p| subject.in_world(*p)).collect()
    };
    let regions: Vec<_> = own.regions.iter().map(world).collect();
    inside.polygons(&regions, &REGION);
    for obstacle in own.obstacles.iter().map(world) {
        inside.hatched(&obstacle, &palette::WALL);
    }
    subject.site.walls.iter().for_each(|wall| inside.wall(wall));
    for outline in &own.outlines {
        inside.robot(outline, radians(subject.goal()));
    }
}

/// Returns `true` if a tag is in the panel.
fn shows(inside: &Inside<'_>, tag: &Tag) -> bool {
    inside.shows([tag.pose.x, tag.pose.y], 0.5 * tag.size)
}

/// Draws the tags, the goal, and the cameras at the goal.
fn draw_tags_and_cameras(inside: &mut Inside<'_>, subject: &Subject<'_>, own: &Ingredients) {
    for tag in subject.site.tags.values() {
        if shows(inside, &tag.tag) {
            inside.tag(&tag.tag);
        }
    }
    inside.pose(subject.goal(), &Style::outlined(palette::INK, 2.2));
    for view in &own.views {
        let [x, y, _] = Eye::of(&view.mount, radians(subject.goal())).centre;
        inside.in_pixels(|picture, panel| {
            let [x, y] = panel.at([x, y]);
            let white = Style::filled("#ffffff").with_outline(palette::INK, 1.5);
            picture.rectangle([x - 3.5, y - 3.5, 7.0, 7.0], &white);
        });
    }
}

/// Names the goal, the first camera, the tags and the walls.
fn draw_names(inside: &mut Inside<'_>, subject: &Subject<'_>, own: &Ingredients) {
    let goal = subject.goal();
    inside.name([goal.x, goal.y], [-14.0, 18.0], "goal");
    if let Some(view) = own.views.first() {
        let [x, y, _] = Eye::of(&view.mount, radians(goal)).centre;
        inside.name([x, y], [8.0, 4.0], "camera");
    }
    for (name, tag) in &subject.site.tags {
        let tag = tag.tag;
        let text = format!("{}, id {}", literal(name), tag.id);
        if shows(inside, &tag) {
            inside.name([tag.pose.x, tag.pose.y], [8.0, -8.0], &text);
        }
    }
    for wall in &subject.site.walls {
        if let Some(middle) = inside.middle(&wall.corners) {
            inside.name(middle, [6.0, 4.0], &literal(&wall.name));
        }
    }
}

/// Draws whether the pose-sets are inside, if there are any. Returns the height, pixels.
fn draw_verdict(
    picture: &mut Picture,
    at: [f64; 2],
    subject: &Subject<'_>,
    held: &[ContainmentResult],
) -> f64 {
    if let ([belief], [held]) = (subject.beliefs.as_slice(), held) {
        let bold = format!("{}:", name_of(belief));
        verdict(picture, at, held.inside, &bold, &held.words);
    } else if held.is_empty() {
        return 0.0;
    } else {
        let within = held.iter().filter(|held| held.inside).count();
        let bold = format!("{within} of {} pose-sets", held.len());
        verdict(picture, at, within == held.len(), &bold, "are inside");
    }
    48.0
}

/// Regions in which the robot must stay.
const REGION: Style = Style::outlined("#444444", 1.4).dashed("9 4");

fn entries(subject: &Subject<'_>, own: &Ingredients) -> Vec<(Sample, &'static str)> {
    let mut entries = std::vec![
        (
            Sample::Line(palette::BORDER),
            "border of S: the robot's reference point"
        ),
        (Sample::Patch(palette::AREA), "S"),
    ];
    if !own.views.is_empty() {
        entries.push((
            Sample::Patch(palette::VIEW),
            "what the camera sees from the goal,",
        ));
        entries.push((Sample::Words, "at the tag's height, as far as allowed"));
    }
    if own.outlines.iter().any(|outline| outline.len() > 1) {
        entries.push((Sample::Patch(palette::BODY), "the robot at the goal"));
    }
    if !own.regions.is_empty() {
        entries.push((Sample::Line(REGION), "region that it must stay in"));
    }
    if !own.obstacles.is_empty() || !subject.site.walls.is_empty() {
        entries.push((Sample::Hatched(palette::WALL), "obstacles and blocks"));
    }
    let mut walls = subject.site.walls.iter();
    if walls.any(|wall| wall.corners.len() == 2) {
        entries.push((
            Sample::Line(palette::WALL.with_outline("#444444", 3.5)),
            "walls",
        ));
    }
    if !subject.site.tags.is_empty() {
        entries.push((
            Sample::Line(palette::TAG),
            "tags; arrows: where their faces look",
        ));
    }
    entries
}

/// Returns the window of the world to draw: the set at the goal's heading and its parts, and the complete site if
/// that is not much larger.
fn window(subject: &Subject<'_>, own: &Ingredients) -> Result<Window, DrawError> {
    let (extent, _) = subject.extent()?;
    let mut points: Vec<[f64; 2]> = Vec::new();
    let goal = subject.goal();
    points.push([goal.x, goal.y]);
    for x in extent.x {
        points.extend(extent.y.map(|y| subject.in_world([x, y])));
    }
    let at = |tag: &Tag| [tag.pose.x, tag.pose.y];
    points.extend(own.views.iter().map(|view| at(&view.tag)));
    let place = frame(radians(goal));
    points.extend(own.outlines.iter().flatten().map(|p| place.to_goal(*p)));
    points.extend(own.regions.iter().flatten().map(|p| subject.in_world(*p)));
    let near = about(&points);
    let walls = subject.site.walls.iter();
    points.extend(walls.flat_map(|wall| wall.corners.iter().copied()));
    points.extend(subject.site.tags.values().map(|tag| at(&tag.tag)));
    let all = about(&points);
    let size = |w: &Window| (w.x[1] - w.x[0]).max(w.y[1] - w.y[0]);
    Ok(if size(&all) <= 2.5 * size(&near) {
        all
    } else {
        near
    })
}

/// Returns the window around points, with some margin.
pub(super) fn about(points: &[[f64; 2]]) -> Window {
    let ends = |axis: usize| {
        let values = points.iter().map(|p| p[axis]);
        values.fold([f64::INFINITY, f64::NEG_INFINITY], |[lo, hi], v| {
            [lo.min(v), hi.max(v)]
        })
    };
    let ([x0, x1], [y0, y1]) = (ends(0), ends(1));
    let margin = (0.07 * (x1 - x0).max(y1 - y0)).max(0.1);
    Window {
        x: [x0 - margin, x1 + margin],
        y: [y0 - margin, y1 + margin],
    }
}
