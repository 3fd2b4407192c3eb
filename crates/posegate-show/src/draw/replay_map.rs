//! The map of a replay: the estimates with their pose-sets, coloured by their verdicts, the success set at the goal's heading, and the worst pose
//! of the denied set that was nearest to a permit.

use super::belief::PoseSetF64;
use super::legend::Sample;
use super::palette;
use super::panel::{Inside, Panel, Window, tick_at_scale};
use super::replay_lanes::LEFT;
use super::section::border;
use super::svg::{Picture, Style};
use super::task_plan::about;
use posegate::gate::Verdict;
use posegate::shape::SuccessSet;
use posegate_replay::replay::{MapPose, Replay};
use posegate_replay::{coordinates, factor};

/// The side of a panel, pixels, and the space between two.
const SIDE: f64 = 340.0;
const BETWEEN: f64 = 72.0;
/// Height of the map with its titles and axes.
pub(super) const HEIGHT: f64 = SIDE + 68.0;
/// Distance between the sampling points of the success set, pixels; its border is bisected between them.
const SPACING: f64 = 3.0;
/// How much larger the place of all estimates is, if it has a panel of its own.
const FAR: f64 = 1.8;

const PERMITTED: Style = Style::outlined("#009e73", 0.9).with_fill_opacity("#009e73", 0.12);
const DENIED: Style = Style::outlined("#d55e00", 0.35).with_fill_opacity("#d55e00", 0.03);
const PERMIT: Style = Style::filled("#009e73");
const DENIAL: Style = Style::filled("#d55e00");
const WORST: Style = Style::outlined("#222222", 2.0);

/// What a map shows.
pub(super) struct ReplayMap<'r> {
    poses: Vec<&'r MapPose>,
    success: &'r SuccessSet,
    /// The border of each pose-set on the floor, metres; `None` if it is not finite.
    sets: Vec<Option<Vec<[f64; 2]>>>,
    /// The worst pose that is marked: x, y (m).
    worst: Option<[f64; 2]>,
    /// Of how many estimates one is shown.
    every: u64,
}

impl<'r> ReplayMap<'r> {
    /// Returns the map of a replay; `None` if no estimate has a place on it.
    pub fn of(replay: &'r Replay<'_>) -> Option<Self> {
        let poses: Vec<&MapPose> = replay.map().poses().collect();
        let set = |pose: &&MapPose| {
            let set = PoseSetF64 {
                estimate: pose.pose,
                spread: pose.spread?,
                radius_squared: replay.radius_squared(),
            };
            let border = set.projection();
            let is_finite = border.iter().flatten().all(|number| number.is_finite());
            is_finite.then_some(border)
        };
        let sets = poses.iter().map(set).collect();
        let nearest = poses.iter().filter_map(|pose| match pose.verdict {
            Verdict::Deny {
                margin: Some(margin),
                worst_pose: Some(worst),
                ..
            } => Some((factor(margin), worst)),
            _ => None,
        });
        let nearest = nearest.max_by(|(a, _), (b, _)| a.total_cmp(b));
        let worst = nearest.map(|(_, worst)| {
            let (x, y, _) = coordinates(worst).into();
            [x, y]
        });
        (!poses.is_empty()).then_some(Self {
            poses,
            success: replay.success(),
            sets,
            worst,
            every: replay.map().every(),
        })
    }

    /// Draws the map below `top`; its height is [`HEIGHT`].
    pub fn draw(&self, picture: &mut Picture, top: f64) {
        let near = self.near();
        let all = self.poses.iter().map(|pose| [pose.pose[0], pose.pose[1]]);
        let corners = [[near.x[0], near.y[0]], [near.x[1], near.y[1]]];
        let all = square(&about(&all.chain(corners).collect::<Vec<_>>()));
        let wide = |window: &Window| window.x[1] - window.x[0];
        let mut left = LEFT - 100.0;
        let mut panel = |window: Window, title: &str| {
            let panel = Panel {
                y_title: left < LEFT,
                ..Panel::fitted(window, [left, top + 24.0], [SIDE; 2])
            };
            left += SIDE + BETWEEN;
            panel.draw(picture, title, tick_at_scale(panel.scale, 60.0), |inside| {
                self.content(inside, &panel);
            });
        };
        if wide(&all) > FAR * wide(&near) {
            panel(all, "where the estimates are");
            panel(near, "near the goal");
        } else {
            panel(all, "the estimates and the goal");
        }
    }

    /// Draws what lies in a panel.
    fn content(&self, inside: &mut Inside<'_>, panel: &Panel) {
        let goal = self.success.goal;
        let heading = goal.yaw_deg.to_radians();
        let holds = |[x, y]: [f64; 2]| self.success.membership([x, y, heading]).inside;
        let area = border(&holds, &panel.window, SPACING / panel.scale);
        inside.polygons(&area, &palette::AREA);
        // What is permitted is drawn above what is denied.
        for permits in [false, true] {
            let style = if permits { &PERMITTED } else { &DENIED };
            let these = || {
                let all = self.poses.iter().zip(&self.sets);
                all.filter(|(pose, _)| pose.verdict.is_permit() == permits)
            };
            for border in these().filter_map(|(_, border)| border.as_ref()) {
                inside.polygons(std::slice::from_ref(border), style);
            }
            let dot = if permits { &PERMIT } else { &DENIAL };
            for (pose, _) in these() {
                let at = [pose.pose[0], pose.pose[1]];
                if inside.shows(at, 0.0) {
                    inside.in_pixels(|picture, panel| picture.circle(panel.at(at), 1.6, dot));
                }
            }
        }
        inside.polygons(&area, &palette::BORDER);
        inside.pose(goal, &Style::outlined(palette::INK, 2.2));
        if let Some(worst) = self.worst.filter(|worst| inside.shows(*worst, 0.0)) {
            inside.in_pixels(|picture, panel| {
                let [x, y] = panel.at(worst);
                picture.line(&[[x - 5.0, y - 5.0], [x + 5.0, y + 5.0]], &WORST);
                picture.line(&[[x - 5.0, y + 5.0], [x + 5.0, y - 5.0]], &WORST);
            });
        }
    }

    /// Returns the legend of what is drawn.
    pub fn entries(&self) -> Vec<(Sample, String)> {
        let mut entries = Vec::from([(
            Sample::Line(palette::BORDER),
            "border of the success set at the goal's heading; arrow: the goal".to_owned(),
        )]);
        let count = |permits: bool| {
            let all = self.poses.iter();
            all.filter(|pose| pose.verdict.is_permit() == permits)
                .count()
        };
        let share = match self.every {
            1 => String::new(),
            every => format!(", one of {every} estimates is drawn"),
        };
        for (permits, style, name) in [(true, PERMITTED, "permitted"), (false, DENIED, "denied")] {
            let count = count(permits);
            if count > 0 {
                let words =
                    format!("pose-sets on the floor, without movement, {name}: {count}{share}");
                entries.push((Sample::Patch(style), words));
            }
        }
        if self.worst.is_some() {
            let words = "cross: worst pose of the denied set that was nearest to a permit";
            entries.push((Sample::Words, words.into()));
        }
        entries
    }

    /// Returns the window about the success set at the goal's heading.
    fn near(&self) -> Window {
        let goal = self.success.goal;
        let heading = goal.yaw_deg.to_radians();
        let mut held = std::vec![[goal.x, goal.y]];
        let mut radius = 0.005;
        while radius < 30.0 {
            held.extend((0..64).filter_map(|k| {
                let angle = f64::from(k) / 64.0 * core::f64::consts::TAU;
                let at = [
                    goal.x + radius * libm::cos(angle),
                    goal.y + radius * libm::sin(angle),
                ];
                let [x, y] = at;
                let holds = self.success.membership([x, y, heading]).inside;
                holds.then_some(at)
            }));
            radius *= 1.1;
        }
        let Window { x, y } = about(&held);
        // As much again around the set.
        let wider = |[lo, hi]: [f64; 2]| [lo - 0.4 * (hi - lo), hi + 0.4 * (hi - lo)];
        square(&Window {
            x: wider(x),
            y: wider(y),
        })
    }
}

/// Returns the smallest square window about a window.
fn square(window: &Window) -> Window {
    let half = |[lo, hi]: [f64; 2]| 0.5 * (hi - lo);
    let middle = [window.x, window.y].map(|[lo, hi]| 0.5 * (lo + hi));
    Window::about(middle, half(window.x).max(half(window.y)))
}
