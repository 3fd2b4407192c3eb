//! Floor plan of a whole site: walls, tags with their axes, the goals of its tasks, and the cameras
//! there.

use super::ingredients::{Eye, Ingredients, radians};
use super::legend::{Sample, legend};
use super::palette;
use super::panel::{Panel, tick_at_scale};
use super::svg::{Font, Picture, Style, literal};
use super::task_plan::about;
use crate::site::Site;

const LARGEST: [f64; 2] = [820.0, 640.0];
const LEFT: f64 = 66.0;

/// Draws the floor plan of a site, in the world.
#[must_use]
pub fn site_plan(site: &Site) -> String {
    let mut points: Vec<[f64; 2]> = Vec::new();
    points.extend(site.tags.values().map(|t| [t.tag.pose.x, t.tag.pose.y]));
    points.extend(
        site.walls
            .iter()
            .flat_map(|wall| wall.corners.iter().copied()),
    );
    let goals = || site.tasks.values().map(|task| task.success.goal);
    points.extend(goals().map(|goal| [goal.x, goal.y]));
    for camera in site.cameras.values() {
        points.extend(goals().map(|goal| {
            let [x, y, _] = Eye::of(&camera.mount, radians(goal)).centre;
            [x, y]
        }));
    }
    if points.is_empty() {
        points.push([0.0; 2]);
    }
    let window = about(&points);
    let wide = [window.x[1] - window.x[0], window.y[1] - window.y[0]];
    let scale = (LARGEST[0] / wide[0]).min(LARGEST[1] / wide[1]);
    let panel = Panel {
        window,
        left: LEFT,
        top: 56.0,
        scale,
        y_title: true,
    };
    let side = LEFT + panel.width() + 28.0;
    let title = "The site, as its file says it";
    let height = (panel.bottom() + 46.0).max(240.0);
    let mut picture = Picture::new(side + 290.0, height, title);
    picture.text([24.0, 30.0], title, &Font::new(19.0, palette::INK).bold());
    panel.draw(&mut picture, "", tick_at_scale(scale, 60.0), |inside| {
        site.walls.iter().for_each(|wall| inside.wall(wall));
        for task in site.tasks.values() {
            for outline in Ingredients::of(&task.success.shape).outlines {
                inside.robot(&outline, radians(task.success.goal));
            }
        }
        for goal in goals() {
            for camera in site.cameras.values() {
                let eye = Eye::of(&camera.mount, radians(goal));
                let ([x, y, _], [fx, fy, _]) = (eye.centre, eye.axes[0]);
                let ahead = 24.0 / scale;
                inside.arrow([x, y], [x + ahead * fx, y + ahead * fy], &CAMERA);
            }
        }
        goals().for_each(|goal| inside.pose(goal, &Style::outlined(palette::INK, 2.2)));
        site.tags.values().for_each(|tag| inside.tag(&tag.tag));
        // Tasks that share a goal share a label.
        let mut labels: Vec<([f64; 2], String)> = Vec::new();
        for (name, task) in &site.tasks {
            let at = [task.success.goal.x, task.success.goal.y];
            match labels.iter_mut().find(|(known, _)| *known == at) {
                Some((_, text)) => *text += &format!(", {}", literal(name)),
                None => labels.push((at, literal(name))),
            }
        }
        for (at, text) in &labels {
            inside.name(*at, [-6.0, 20.0], text);
        }
        for (name, tag) in &site.tags {
            let text = format!("{}, id {}", literal(name), tag.tag.id);
            inside.name([tag.tag.pose.x, tag.tag.pose.y], [8.0, -8.0], &text);
        }
        for wall in &site.walls {
            if let Some([x, y]) = wall.corners.first() {
                inside.name([*x, *y], [6.0, 14.0], &literal(&wall.name));
            }
        }
    });
    legend(
        &mut picture,
        [side, 56.0],
        &[
            (
                Sample::Line(palette::TAG),
                "tags; arrows: out of their faces (x)",
            ),
            (
                Sample::Line(Style::outlined(palette::INK, 2.2)),
                "goals and their headings",
            ),
            (Sample::Line(CAMERA), "cameras there, where they look"),
            (Sample::Patch(palette::BODY), "robots at their goals"),
            (Sample::Hatched(palette::WALL), "blocks"),
            (
                Sample::Line(palette::WALL.with_outline("#444444", 3.5)),
                "walls",
            ),
        ],
    );
    picture.finish()
}

const CAMERA: Style = Style::outlined("#8a6d00", 1.8).dashed("5 2");
