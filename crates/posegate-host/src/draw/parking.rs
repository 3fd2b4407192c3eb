//! Fig. 1 of the paper: a car in a parking space, and the poses at which the car is inside.

use super::legend::{Sample, legend, row_heading, verdict, words};
use super::multiple::Row;
use super::palette;
use super::panel::{Inside, Panel, Window};
use super::study::{Answer, CaseStudy, PARK, PoseSetSpec, StudyError};
use super::svg::{Font, Picture, Style};
use posegate::shape::{Footprint, Planar, Shape};

const WIDTH: f64 = 1160.0;
const HEIGHT: f64 = 862.0;

/// The headings of the sections, degrees.
const YAWS_DEG: [f64; 7] = [-6.0, -4.0, -2.0, 0.0, 2.0, 4.0, 6.0];

/// A pose of the 1 m / 2° set at which the car is not in the space: m, m, degrees.
const STRAY: [f64; 3] = [0.72, 0.6, 2.0];

/// Draws Fig. 1: the car in its space, and the parking success set at several headings.
///
/// # Errors
/// [`StudyError`] if the study has no parking task.
pub fn fig1_parking(study: &CaseStudy) -> Result<String, StudyError> {
    let Shape::Footprint(shape) = &study.task(PARK)?.success.shape else {
        return Err(StudyError::Shape(PARK.into()));
    };
    let small = study.ask(PARK, PoseSetSpec::TEN_CENTIMETRES)?;
    let large = study.ask(PARK, PoseSetSpec::ONE_METRE)?;
    let title = "Fig. 1: parking a 1.5 m by 4.5 m car in a 3 m by 5 m space";
    let mut picture = Picture::new(WIDTH, HEIGHT, title);
    picture.text([24.0, 32.0], title, &Font::new(19.0, palette::INK).bold());
    let space = Panel {
        window: Window {
            x: [-3.0, 3.0],
            y: [-1.9, 1.9],
        },
        left: 66.0,
        top: 76.0,
        scale: 95.0,
        y_title: true,
    };
    space.draw(&mut picture, "The car at the goal, yaw 0°", 1.0, |inside| {
        car_in_space(inside, shape, &[&large, &small]);
    });
    beside(&mut picture, [676.0, 76.0], &small, &large);
    let heading = "The success set S, heading by heading: where the car's centre may be";
    row_heading(&mut picture, 512.0, heading, &[]);
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
            top: 545.0,
            scale: 150.0,
            y_title: index == 0,
        };
        row.draw(&mut picture, &panel, yaw_deg, "", |_| ())?;
    }
    Ok(picture.finish())
}

fn car_in_space(inside: &mut Inside<'_>, shape: &Footprint, answers: &[&Answer; 2]) {
    let ground = Style::outlined(palette::INK, 2.5).with_fill_opacity("#f3f0e6", 1.0);
    inside.polygons(&[shape.region().to_vec()], &ground);
    inside.polygons(&[outline_at(shape, [0.0; 3])], &palette::BODY);
    let stray = Style::outlined(palette::NO, 1.8).dashed("7 4");
    inside.polygons(&[outline_at(shape, STRAY)], &stray);
    for answer in answers {
        if let PoseSetSpec::Bounded { translation, .. } = answer.known {
            let style = palette::of_set(answer.holds());
            inside.disc([0.0, 0.0], translation, &style);
        }
    }
    let arrow = Style::outlined(palette::INK, 2.0);
    inside.line(&[[0.0, 0.0], [1.7, 0.0]], &arrow);
    inside.line(&[[1.58, 0.07], [1.7, 0.0], [1.58, -0.07]], &arrow);
    inside.label(
        [-2.2, -0.62],
        [0.0, 0.0],
        "car, 4.5 m by 1.5 m",
        134.0,
        palette::INK,
    );
    inside.label(
        [-2.45, -1.4],
        [0.0, 0.0],
        "space, 5 m by 3 m",
        122.0,
        palette::INK,
    );
    inside.label(
        [0.35, 1.6],
        [0.0, 0.0],
        "a pose of 1 m / 2°: sticks out",
        196.0,
        palette::NO,
    );
}

/// Returns the car's outline at a pose of the goal frame: m, m, degrees.
fn outline_at(shape: &Footprint, [x, y, yaw_deg]: [f64; 3]) -> Vec<[f64; 2]> {
    let yaw = yaw_deg.to_radians();
    let pose = Planar {
        x,
        y,
        cos: libm::cos(yaw),
        sin: libm::sin(yaw),
    };
    shape
        .footprint()
        .iter()
        .map(|corner| pose.to_goal(*corner))
        .collect()
}

/// Draws the text next to the car: the pose-sets that fit, and the legend.
fn beside(picture: &mut Picture, [left, top]: [f64; 2], small: &Answer, large: &Answer) {
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
        "degrees) could grow and still be proven inside, on the table.",
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
                Sample::Line(palette::BORDER),
                "exact border of S at this heading",
            ),
            (
                Sample::Patch(palette::CELLS),
                "covered by the table: proven inside S",
            ),
            (
                Sample::Disc(palette::of_set(small.holds())),
                "10 cm / 2°: drawn from −2° to 2°",
            ),
            (
                Sample::Disc(palette::of_set(large.holds())),
                "1 m / 2°: wider than the panels below, fills those from −2° to 2°",
            ),
            (
                Sample::Line(Style::outlined(palette::NO, 1.8).dashed("7 4")),
                "the car at (0.72 m, 0.6 m, 2°), a pose of 1 m / 2°",
            ),
        ],
    );
}
