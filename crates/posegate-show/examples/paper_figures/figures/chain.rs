//! Fig. 2 of the paper: a look at the tag makes docking certain. The pose-set before and after each task.

use super::Result;
use posegate::shape::SuccessSet;
use posegate_plan::{BeliefStateF64, StepReport};
use posegate_replay::factor_text;
use posegate_show::draw::palette;
use posegate_show::draw::scene::{
    Anchor, Font, Panel, Picture, Sample, Style, Window, border, legend, literal, tick_at_scale,
};
use posegate_show::draw::study::CaseStudy;

const EDGE: f64 = 230.0;
const LEFT: f64 = 66.0;
const TOP: f64 = 104.0;
/// Distances from a panel to the one after its task, and to the one before the next task.
const PITCH: [f64; 2] = [EDGE + 118.0, EDGE + 64.0];

/// Draws the pose-sets before and after the look and the work, with each task's success set: each task begins with the estimate at
/// its goal, as in the paper.
///
/// # Errors
/// If the chain cannot be evaluated.
pub fn fig2_chain(study: &CaseStudy) -> Result<String> {
    let site = &study.site;
    let report = study.chain()?;
    let title = "Fig. 2: the chain, with the pose-set before and after each task";
    let width = LEFT + (PITCH[0] + PITCH[1]) * report.steps.len() as f64;
    let mut picture = Picture::new(width, TOP + EDGE + 190.0, title);
    picture.text([24.0, 32.0], title, &Font::new(19.0, palette::INK).bold());
    let whole = match report.first_failure() {
        None => format!("the chain succeeds; risk at most {}", report.risk_text()),
        Some((index, _)) => format!("the chain fails at step {}", index + 1),
    };
    let colour = palette::of_words(report.succeeds());
    picture.text([24.0, 56.0], &whole, &Font::new(14.0, colour));
    for (index, step) in report.steps.iter().enumerate() {
        let left = LEFT + (PITCH[0] + PITCH[1]) * index as f64;
        let name = step.task.as_deref().unwrap_or_default();
        let set = site.tasks.get(name).map(|task| &task.success);
        let before = format!("{}. before {}", index + 1, literal(name));
        panel(&mut picture, left, &before, &step.before, set, index == 0);
        verdict(&mut picture, left, step);
        let [from, to] = [left + EDGE + 18.0, left + PITCH[0] - 46.0];
        let middle = TOP + 0.5 * EDGE;
        let arrow = Style::outlined(palette::INK, 2.4);
        picture.arrow([from, middle], [to, middle], &arrow);
        let font = Font::new(13.0, palette::INK)
            .bold()
            .anchored(Anchor::Middle);
        picture.text([0.5 * (from + to), middle - 12.0], &literal(name), &font);
        let after = format!("after {}", literal(name));
        panel(
            &mut picture,
            left + PITCH[0],
            &after,
            &step.after,
            set,
            false,
        );
        known(&mut picture, left + PITCH[0], &step.after);
    }
    legend(
        &mut picture,
        [24.0, TOP + EDGE + 106.0],
        &[
            (
                Sample::SuccessSet,
                "S of the task, at the heading of its goal",
            ),
            (
                Sample::Disc(palette::PAPER_SET),
                "pose-set X\u{302}: where the robot may be; a work task leaves it as it is",
            ),
        ],
    );
    Ok(picture.finish())
}

fn panel(
    picture: &mut Picture,
    left: f64,
    title: &str,
    belief: &BeliefStateF64,
    set: Option<&SuccessSet>,
    y_title: bool,
) {
    let [x, y, heading] = belief.pose;
    let half = 2.2 * belief.enclosing()[0] + 0.05;
    let window = Window {
        x: [x - half, x + half],
        y: [y - half, y + half],
    };
    let scale = EDGE / (2.0 * half);
    let panel = Panel {
        window,
        left,
        top: TOP,
        scale,
        y_title,
    };
    panel.draw(picture, title, tick_at_scale(scale, 60.0), |inside| {
        if let Some(set) = set {
            let depth = set.evaluator();
            let holds = |[x, y]: [f64; 2]| depth.holds([x, y, heading]);
            inside.success_set(&border(&holds, &window, 1.5 / scale));
        }
        inside.disc([x, y], belief.enclosing()[0], &palette::PAPER_SET);
        let ahead = [
            x + 0.16 * half * libm::cos(heading),
            y + 0.16 * half * libm::sin(heading),
        ];
        inside.arrow([x, y], ahead, &Style::outlined(palette::INK, 2.0));
    });
}

/// Writes the pose-set below a panel.
fn known(picture: &mut Picture, left: f64, belief: &BeliefStateF64) {
    let [m, rad] = belief.enclosing();
    let text = format!(
        "X\u{302}: {:.1} cm, yaw {:.1}°",
        100.0 * m,
        rad.to_degrees()
    );
    let font = Font::new(13.0, palette::INK);
    picture.text([left, TOP + EDGE + 54.0], &text, &font);
}

/// Writes the pose-set and the verdict below a panel.
fn verdict(picture: &mut Picture, left: f64, step: &StepReport) {
    known(picture, left, &step.before);
    let margin = step.margin.map_or_else(|| "unknown".into(), factor_text);
    let inside = if step.failure.is_none() {
        "all of X\u{302} is in S"
    } else {
        "NOT all of X\u{302} is in S"
    };
    let colour = palette::of_words(step.failure.is_none());
    let font = Font::new(13.0, colour).bold();
    let text = format!("{inside}, margin {margin}");
    picture.text([left, TOP + EDGE + 74.0], &text, &font);
}
