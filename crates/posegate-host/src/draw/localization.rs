//! Fig. 3 of the paper: the pose-sets inside S_l (seeing the tag) and S_w (docking).

use super::legend::{Sample, legend, row_heading, verdict, words};
use super::multiple::Row;
use super::palette;
use super::panel::{Inside, Panel, Window};
use super::report::chain;
use super::study::{Answer, CaseStudy, DOCK, PoseSetSpec, SEE, StudyError};
use super::svg::{Font, Picture};
use posegate::shape::{Shape, Visibility};

const WIDTH: f64 = 1200.0;
const HEIGHT: f64 = 926.0;
/// Left edge of the first column of panels, and the distance between columns.
const LEFT: f64 = 66.0;
const PITCH: f64 = 287.0;

/// The headings of S_l's sections, degrees; they include the ends of the pose-sets.
const SEE_DEG: [f64; 7] = [-10.0, -5.0, -2.0, 0.0, 2.0, 5.0, 10.0];
/// The headings of S_w's sections, degrees.
const DOCK_DEG: [f64; 3] = [-2.0, 0.0, 2.0];

/// Draws Fig. 3: sections of S_l and S_w with the pose-sets before and after the localization.
///
/// # Errors
/// [`StudyError`] if the study lacks one of the tasks.
pub fn fig3_sections(study: &CaseStudy) -> Result<String, StudyError> {
    let title = "Fig. 3: which containments hold: pose-sets in S_l and in S_w";
    let mut picture = Picture::new(WIDTH, HEIGHT, title);
    let font = Font::new(19.0, palette::INK).bold();
    picture.text([24.0, 32.0], title, &font);
    for (index, step) in chain(study)?.iter().enumerate() {
        let bold = format!("{}. {}", index + 1, words(&step.answer, step.set_name));
        let at = [24.0 + 392.0 * index as f64, 52.0];
        verdict(&mut picture, at, step.answer.holds(), &bold, step.meaning);
    }
    see(study, &mut picture)?;
    explain(&mut picture, [LEFT + PITCH * 3.0 - 24.0, 392.0]);
    dock(study, &mut picture)?;
    Ok(picture.finish())
}

fn see(study: &CaseStudy, picture: &mut Picture) -> Result<(), StudyError> {
    let task = study.task(SEE)?;
    let Shape::Visibility(sight) = &task.success.shape else {
        return Err(StudyError::Shape(SEE.into()));
    };
    let answers = [
        study.ask(SEE, PoseSetSpec::ONE_METRE)?,
        study.ask(SEE, PoseSetSpec::TWO_METRES)?,
    ];
    let [one, two] = &answers;
    let heading = "S_l: where the robot sees tag t7, heading by heading";
    row_heading(picture, 132.0, heading, &[(one, "S_l"), (two, "S_l")]);
    let row = Row {
        study,
        task: SEE,
        answers: &answers,
        tick: 1.0,
    };
    let end = end_of_table(study)?;
    for (index, yaw_deg) in SEE_DEG.into_iter().enumerate() {
        let panel = Panel {
            window: Window {
                x: [-2.1, 4.2],
                y: [-2.1, 2.1],
            },
            left: LEFT + PITCH * (index % 4) as f64,
            top: 166.0 + 226.0 * (index / 4) as f64,
            scale: 39.0,
            y_title: index % 4 == 0,
        };
        row.draw(picture, &panel, yaw_deg, "", |inside| {
            inside.polygons(&end, &palette::EXTENT);
            tag(inside, sight);
            if yaw_deg == 0.0 {
                for answer in &answers {
                    label_radius(inside, answer);
                }
            }
        })?;
    }
    Ok(())
}

/// Draws the legend.
fn explain(picture: &mut Picture, [left, top]: [f64; 2]) {
    let entries = [
        (Sample::Line(palette::BORDER), "exact border of the set"),
        (
            Sample::Patch(palette::CELLS),
            "covered by the table: proven",
        ),
        (Sample::Disc(palette::INSIDE), "pose-set that is inside"),
        (
            Sample::Disc(palette::NOT_INSIDE),
            "pose-set that is not inside",
        ),
        (Sample::Line(palette::EXTENT), "end of the table"),
        (Sample::Line(palette::TAG), "tag t7, facing the goal"),
    ];
    legend(picture, [left, top], &entries);
    let notes = [
        "Pose-sets are about the goal, and drawn",
        "where their yaw interval has the heading.",
    ];
    for (index, note) in notes.into_iter().enumerate() {
        let at = [left, top + 144.0 + 16.0 * index as f64];
        picture.text(at, note, &Font::new(12.0, palette::FAINT));
    }
}

/// Returns the outline of S_l's table.
pub(super) fn end_of_table(study: &CaseStudy) -> Result<[Vec<[f64; 2]>; 1], StudyError> {
    let spec = study.site.table_spec(study.task(SEE)?);
    let extent = spec.ok_or_else(|| StudyError::NoTable(SEE.into()))?.extent;
    let [[x0, x1], [y0, y1]] = [extent.x, extent.y];
    Ok([std::vec![[x0, y0], [x1, y0], [x1, y1], [x0, y1]]])
}

/// Draws the tag's edge from above.
pub(super) fn tag(inside: &mut Inside<'_>, sight: &Visibility) {
    let pose = sight.tag.pose;
    let yaw = pose.yaw_deg.to_radians();
    let half = 0.5 * sight.tag.size;
    let across = [-half * libm::sin(yaw), half * libm::cos(yaw)];
    let ends = [
        [pose.x - across[0], pose.y - across[1]],
        [pose.x + across[0], pose.y + across[1]],
    ];
    inside.line(&ends, &palette::TAG);
}

/// Labels a bounded pose-set's radius at its lower edge.
fn label_radius(inside: &mut Inside<'_>, answer: &Answer) {
    if let PoseSetSpec::Bounded { translation, .. } = answer.known {
        let colour = palette::of_words(answer.holds());
        let text = format!("{translation} m");
        inside.label([0.0, -translation], [-12.0, -4.0], &text, 30.0, colour);
    }
}

fn dock(study: &CaseStudy, picture: &mut Picture) -> Result<(), StudyError> {
    let answers = [
        study.ask(DOCK, PoseSetSpec::FIVE_CENTIMETRES)?,
        study.ask(DOCK, PoseSetSpec::ONE_METRE)?,
    ];
    let [small, large] = &answers;
    let heading = "S_w: where docking succeeds, enlarged";
    row_heading(picture, 632.0, heading, &[(small, "S_w"), (large, "S_w")]);
    let caption = |answer: &Answer| format!("{}: {}", answer.known, answer.holds_text());
    let [fits, sticks_out] = [small, large].map(caption);
    let [fits_colour, out_colour] = [small, large].map(|a| palette::of_words(a.holds()));
    let row = Row {
        study,
        task: DOCK,
        answers: &answers,
        tick: 0.06,
    };
    let square = |index: usize, reach: f64| Panel {
        window: Window {
            x: [-reach, reach],
            y: [-reach, reach],
        },
        left: LEFT + 18.0 + PITCH * index as f64,
        top: 666.0,
        scale: 105.0 / reach,
        y_title: index == 0,
    };
    for (index, yaw_deg) in DOCK_DEG.into_iter().enumerate() {
        row.draw(picture, &square(index, 0.12), yaw_deg, "", |inside| {
            inside.label([-0.115, -0.113], [0.0, 0.0], &fits, 108.0, fits_colour);
            let text = format!("{sticks_out}, covers all");
            inside.label([-0.115, 0.1], [0.0, 0.0], &text, 196.0, out_colour);
        })?;
    }
    let wide = Row { tick: 0.6, ..row };
    let note = ", ten times as wide";
    wide.draw(picture, &square(3, 1.2), 0.0, note, |inside| {
        inside.label([-1.15, 1.06], [0.0, 0.0], &sticks_out, 128.0, out_colour);
        inside.label([0.1, 0.0], [2.0, 4.0], "S_w", 24.0, palette::INK);
    })
}
