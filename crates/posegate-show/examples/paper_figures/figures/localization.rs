//! Fig. 3 of the paper: the pose-sets inside S_l (seeing the tag) and S_w (docking).

use super::answers::{row_heading, words};
use super::multiple::Row;
use super::{Result, sight};
use posegate::shape::Visibility;
use posegate_show::draw::palette;
use posegate_show::draw::report::chain;
use posegate_show::draw::scene::{
    Font, Inside, Panel, Picture, Sample, Style, Window, legend, signed, verdict,
};
use posegate_show::draw::study::{Answer, CaseStudy, DOCK, PoseSetSpec, SEE};
use posegate_site::inscribe::{InscribedBox, inscribed_box};

const WIDTH: f64 = 660.0;
const HEIGHT: f64 = 1534.0;
/// Left edge of the first column of panels, and the distance between columns. There are two: on a telephone, the words of
/// more would be too small to be read.
const LEFT: f64 = 66.0;
const PITCH: f64 = 307.0;
/// Baselines of the headings of S_l and S_w.
const SEE_TOP: f64 = 202.0;
const DOCK_TOP: f64 = 952.0;

/// The headings of S_l's sections, degrees; they include the ends of the pose-sets.
const SEE_DEG: [f64; 5] = [-8.0, -2.0, 0.0, 2.0, 8.0];
/// The names of these panels.
const NAMES: [&str; 5] = ["(a) ", "(b) ", "(c) ", "(d) ", "(e) "];
/// The headings of S_w's sections, degrees.
const DOCK_DEG: [f64; 3] = [-2.0, 0.0, 2.0];

/// Returns an SVG of Fig. 3: sections of S_l and S_w with the pose-sets before and after the localization.
///
/// # Errors
/// If one of the tasks is missing from the study.
pub fn fig3_sections(study: &CaseStudy) -> Result<String> {
    let title = "Fig. 3: which containments hold: pose-sets in S_l and in S_w";
    let mut picture = Picture::new(WIDTH, HEIGHT, title);
    let font = Font::new(18.0, palette::INK).bold();
    picture.text([24.0, 32.0], title, &font);
    for (index, step) in chain(study)?.iter().enumerate() {
        let bold = format!("{}. {}", index + 1, words(&step.answer, step.set_name));
        let at = [24.0, 50.0 + 42.0 * index as f64];
        verdict(&mut picture, at, step.answer.holds(), &bold, step.meaning);
    }
    see(study, &mut picture)?;
    explain(study, &mut picture, [LEFT + PITCH - 24.0, SEE_TOP + 490.0])?;
    dock(study, &mut picture)?;
    Ok(picture.finish())
}

fn see(study: &CaseStudy, picture: &mut Picture) -> Result<()> {
    let sight = sight(study)?;
    let answers = [
        study.ask(SEE, PoseSetSpec::ONE_METRE)?,
        study.ask(SEE, PoseSetSpec::TWO_METRES)?,
    ];
    let [one, two] = &answers;
    let heading = "S_l: where the robot sees tag t7, heading by heading";
    row_heading(picture, SEE_TOP, heading, &[(one, "S_l"), (two, "S_l")]);
    let row = Row {
        study,
        task: SEE,
        answers: &answers,
        tick: 1.0,
    };
    let boxes = boxes(study)?;
    for (index, yaw_deg) in SEE_DEG.into_iter().enumerate() {
        let panel = Panel {
            window: Window {
                x: [-2.1, 4.2],
                y: [-2.1, 2.1],
            },
            left: LEFT + PITCH * (index % 2) as f64,
            top: SEE_TOP + 58.0 + 226.0 * (index / 2) as f64,
            scale: 39.0,
            y_title: index.is_multiple_of(2),
        };
        row.draw(picture, &panel, NAMES[index], yaw_deg, "", |inside| {
            for (inscribed, style) in boxes.iter().zip(BOXES) {
                let [low, high] = inscribed.yaw_deg;
                if (low..=high).contains(&yaw_deg) {
                    let ([x0, x1], [y0, y1]) = (inscribed.x, inscribed.y);
                    let corners = std::vec![[x0, y0], [x1, y0], [x1, y1], [x0, y1]];
                    inside.polygons(&[corners], &style);
                }
            }
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

/// The styles of the boxes inside S_l.
const BOXES: [Style; 2] = [
    palette::PAPER_BOX,
    Style::outlined("#222222", 1.6).dashed("9 3"),
];

/// Returns boxes that are proven inside S_l (the paper's TSR_l): a large one, and one for the headings of the pose-sets.
fn boxes(study: &CaseStudy) -> Result<[InscribedBox; 2]> {
    let success = &study.task(SEE)?.success;
    let found = |yaw_deg| inscribed_box(success, yaw_deg).ok_or("S_l has no box");
    Ok([found(None)?, found(Some(2.0))?])
}

/// Draws the legend.
fn explain(study: &CaseStudy, picture: &mut Picture, [left, top]: [f64; 2]) -> Result<()> {
    let entries = [
        (Sample::SuccessSet, "success set S at this heading"),
        (
            Sample::Disc(palette::PAPER_SET),
            "pose-set X\u{302} about the goal, where",
        ),
        (Sample::Words, "its yaw interval has the heading"),
        (Sample::Line(palette::TAG), "tag t7, facing the goal"),
    ];
    legend(picture, [left, top], &entries);
    for (number, (inscribed, style)) in boxes(study)?.into_iter().zip(BOXES).enumerate() {
        let [place, yaw] = in_words(&inscribed);
        let at = [left, top + 84.0 + 63.0 * number as f64];
        let entries = [
            (Sample::Line(style), "box TSR_l in S_l, proven:"),
            (Sample::Words, &*place),
            (Sample::Words, &*yaw),
        ];
        legend(picture, at, &entries);
    }
    Ok(())
}

/// Returns a box in two lines of words.
fn in_words(inscribed: &InscribedBox) -> [String; 2] {
    let ends = |[lo, hi]: [f64; 2]| format!("{} to {}", signed(lo), signed(hi));
    [
        format!("x {} m, y {} m,", ends(inscribed.x), ends(inscribed.y)),
        format!("yaw {}°", ends(inscribed.yaw_deg)),
    ]
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

fn dock(study: &CaseStudy, picture: &mut Picture) -> Result<()> {
    let answers = [
        study.ask(DOCK, PoseSetSpec::FIVE_CENTIMETRES)?,
        study.ask(DOCK, PoseSetSpec::ONE_METRE)?,
    ];
    let [small, large] = &answers;
    let heading = "S_w: where docking succeeds, enlarged";
    row_heading(
        picture,
        DOCK_TOP,
        heading,
        &[(small, "S_w"), (large, "S_w")],
    );
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
        left: LEFT + 18.0 + PITCH * (index % 2) as f64,
        top: DOCK_TOP + 58.0 + 272.0 * (index / 2) as f64,
        scale: 105.0 / reach,
        y_title: index.is_multiple_of(2),
    };
    for (index, yaw_deg) in DOCK_DEG.into_iter().enumerate() {
        row.draw(picture, &square(index, 0.12), "", yaw_deg, "", |inside| {
            inside.label([-0.115, -0.113], [0.0, 0.0], &fits, 108.0, fits_colour);
            let text = format!("{sticks_out}, covers all");
            inside.label([-0.115, 0.1], [0.0, 0.0], &text, 196.0, out_colour);
        })?;
    }
    let wide = Row { tick: 0.6, ..row };
    let note = ", ten times as wide";
    wide.draw(picture, &square(3, 1.2), "", 0.0, note, |inside| {
        inside.label([-1.15, 1.06], [0.0, 0.0], &sticks_out, 128.0, out_colour);
        inside.label([0.1, 0.0], [2.0, 4.0], "S_w", 24.0, palette::INK);
    })
}
