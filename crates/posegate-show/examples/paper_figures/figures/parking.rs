//! Fig. 1 of the paper: a car in a parking space, and the poses at which the car is inside.

use super::Result;
use super::answers::{row_heading, words};
use super::multiple::Row;
use super::parking_errors::{single_errors, yaw_over_x};
use posegate::shape::Shape;
use posegate_show::draw::palette;
use posegate_show::draw::scene::{Font, Panel, Picture, Sample, Window, legend, verdict};
use posegate_show::draw::study::{Answer, CaseStudy, PARK, PoseSetSpec};

const WIDTH: f64 = 1160.0;
const HEIGHT: f64 = 1110.0;

/// The headings of the sections, degrees.
const YAWS_DEG: [f64; 7] = [-6.0, -4.0, -2.0, 0.0, 2.0, 4.0, 6.0];

/// Returns an SVG of Fig. 1: the errors at which the car is still in its space, and the parking success set at several headings.
///
/// # Errors
/// If the study has no parking task.
pub fn fig1_parking(study: &CaseStudy) -> Result<String> {
    let Shape::Footprint(shape) = &study.task(PARK)?.success.shape else {
        return Err("the success set of parking is not a footprint".into());
    };
    let small = study.ask(PARK, PoseSetSpec::TEN_CENTIMETRES)?;
    let large = study.ask(PARK, PoseSetSpec::ONE_METRE)?;
    let title = "Fig. 1: parking a 1.5 m by 4.5 m car in a 3 m by 5 m space";
    let mut picture = Picture::new(WIDTH, HEIGHT, title);
    picture.text([24.0, 32.0], title, &Font::new(19.0, palette::INK).bold());
    let success = &study.task(PARK)?.success;
    single_errors(&mut picture, 76.0, success, shape);
    let sets = [PoseSetSpec::TEN_CENTIMETRES, PoseSetSpec::ONE_METRE];
    yaw_over_x(&mut picture, [66.0, 376.0], success, &sets);
    text(&mut picture, [520.0, 376.0], &small, &large);
    let heading = "The success set S, heading by heading: where the car's centre may be";
    row_heading(&mut picture, 766.0, heading, &[]);
    let row = Row {
        study,
        task: PARK,
        answers: &[large, small],
        tick: 0.4,
    };
    for (index, yaw_deg) in YAWS_DEG.into_iter().enumerate() {
        let panel = Panel {
            window: Window {
                x: [-0.4, 0.4],
                y: [-0.9, 0.9],
            },
            left: 66.0 + 157.0 * index as f64,
            top: 799.0,
            scale: 150.0,
            y_title: index == 0,
        };
        row.draw(&mut picture, &panel, "", yaw_deg, "", |_| ())?;
    }
    Ok(picture.finish())
}

/// Draws the text next to the car: the pose-sets that fit, and the legend.
fn text(picture: &mut Picture, [left, top]: [f64; 2], small: &Answer, large: &Answer) {
    let heading = Font::new(15.0, palette::INK).bold();
    picture.text(
        [left, top + 4.0],
        "Which pose-sets about the goal fit?",
        &heading,
    );
    for (index, answer) in [small, large].into_iter().enumerate() {
        let plain = if answer.holds() {
            "parking succeeds from every pose of it"
        } else {
            "parking is not guaranteed"
        };
        let at = [left, top + 22.0 + 44.0 * index as f64];
        verdict(picture, at, answer.holds(), &words(answer, "S"), plain);
    }
    let notes = [
        "The margin is the factor by which the whole pose-set (metres and",
        "degrees) could grow and still be proven inside, by the table.",
    ];
    for (index, note) in notes.into_iter().enumerate() {
        let at = [left, top + 132.0 + 17.0 * index as f64];
        picture.text(at, note, &Font::new(12.0, palette::FAINT));
    }
    legend(
        picture,
        [left, top + 168.0],
        &[
            (
                Sample::SuccessSet,
                "S: the poses at which the car is in its space",
            ),
            (
                Sample::Disc(palette::PAPER_SET),
                "pose-sets of 10 cm / 2° and of 1 m / 2°, drawn from −2° to 2°",
            ),
            (
                Sample::Words,
                "(1 m is wider than the panels: it fills them)",
            ),
        ],
    );
}
