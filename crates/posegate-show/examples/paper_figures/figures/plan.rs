//! The floor plan of Fig. 3: the camera's view at the goal, and the robot's pose-sets.

use super::answers::words;
use super::localization::tag;
use super::{Result, sight};
use posegate::shape::Visibility;
use posegate_show::draw::Subject;
use posegate_show::draw::palette;
use posegate_show::draw::scene::{
    Font, Inside, Panel, Picture, Sample, Style, Window, legend, verdict,
};
use posegate_show::draw::study::{CaseStudy, DOCK, PoseSetSpec, SEE};

const VIEW: Style = Style::outlined("#8a6d00", 1.2).with_fill_opacity("#f0e442", 0.22);
const CONE: Style = Style::outlined("#aa4499", 1.4).dashed("8 3 2 3");

/// Draws the floor plan: the tag, the camera's view at the goal, the robot's pose-sets before and
/// after the localization, and the positions from which the robot sees the tag at the goal's
/// heading.
///
/// # Errors
/// If the study lacks one of the tasks.
pub fn fig3_plan(study: &CaseStudy) -> Result<String> {
    let sight = sight(study)?;
    let before = study.ask(SEE, PoseSetSpec::ONE_METRE)?;
    let after = study.ask(DOCK, PoseSetSpec::FIVE_CENTIMETRES)?;
    let title = "Fig. 3, floor plan: the robot at its goal, camera front, tag t7";
    // The words are below the panel: on a telephone they would be too small next to it.
    let mut picture = Picture::new(680.0, 716.0, title);
    picture.text([24.0, 32.0], title, &Font::new(17.0, palette::INK).bold());
    let panel = Panel {
        window: Window {
            x: [-2.0, 4.4],
            y: [-2.2, 2.2],
        },
        left: 66.0,
        top: 76.0,
        scale: 92.0,
        y_title: true,
    };
    let subject = Subject::new(&study.site, SEE)?;
    let border = subject.section(0.0, &panel.window, 1.0 / panel.scale);
    panel.draw(&mut picture, "S_l at yaw 0°", 1.0, |inside| {
        let wedge = [view(sight)];
        inside.polygons(&wedge, &VIEW);
        inside.success_set(&border);
        inside.polygons(&wedge, &VIEW.without_fill());
        inside.line(&facing(sight), &CONE);
        for answer in [&before, &after] {
            if let PoseSetSpec::Bounded { translation, .. } = answer.known {
                inside.disc([0.0, 0.0], translation, &palette::PAPER_SET);
            }
        }
        robot(inside, sight);
        tag(inside, sight);
        inside.label([3.9, 0.3], [-20.0, 0.0], "tag t7", 46.0, palette::INK);
        inside.label(
            [-0.5, 0.62],
            [0.0, 0.0],
            "1 m",
            30.0,
            palette::of_words(before.holds()),
        );
        inside.label(
            [-0.06, -0.14],
            [-20.0, 6.0],
            "5 cm",
            36.0,
            palette::of_words(after.holds()),
        );
    });
    let (left, below) = (24.0, panel.bottom() + 44.0);
    verdict(
        &mut picture,
        [left, below],
        before.holds(),
        &words(&before, "S_l"),
        "before the localization",
    );
    verdict(
        &mut picture,
        [left, below + 44.0],
        after.holds(),
        &words(&after, "S_w"),
        "after it",
    );
    let psi = format!("{}° off the tag's normal", sight.psi_max_deg);
    legend(
        &mut picture,
        [left, below + 94.0],
        &[
            (Sample::SuccessSet, "S_l at yaw 0°"),
            (Sample::Patch(VIEW), "the camera's view at the goal"),
            (Sample::Line(CONE), &psi),
            (
                Sample::Disc(palette::PAPER_SET),
                "pose-sets X\u{302} about the goal",
            ),
        ],
    );
    Ok(picture.finish())
}

/// Returns the part of the floor in the image at the goal, up to the largest distance of the tag: a
/// wedge.
fn view(sight: &Visibility) -> Vec<[f64; 2]> {
    let camera = sight.camera;
    let (mount, yaw) = (sight.mount, sight.mount.yaw_deg.to_radians());
    let left = libm::atan2(camera.cx, camera.fx);
    let right = libm::atan2(camera.width_px - camera.cx, camera.fx);
    let mut wedge = std::vec![[mount.x, mount.y]];
    wedge.extend((0..=32).map(|k| {
        let angle = yaw - right + (left + right) * f64::from(k) / 32.0;
        [
            mount.x + sight.d_max * libm::cos(angle),
            mount.y + sight.d_max * libm::sin(angle),
        ]
    }));
    wedge
}

/// Returns the border of the positions that the tag faces: two lines that meet at the tag.
fn facing(sight: &Visibility) -> [[f64; 2]; 3] {
    let pose = sight.tag.pose;
    let end = |turn_deg: f64| {
        let angle = (pose.yaw_deg + turn_deg).to_radians();
        [
            pose.x + sight.d_max * libm::cos(angle),
            pose.y + sight.d_max * libm::sin(angle),
        ]
    };
    [
        end(sight.psi_max_deg),
        [pose.x, pose.y],
        end(-sight.psi_max_deg),
    ]
}

/// Draws the robot's centre and heading, and its camera.
fn robot(inside: &mut Inside<'_>, sight: &Visibility) {
    let ink = Style::outlined(palette::INK, 1.8);
    let camera = [sight.mount.x, sight.mount.y];
    inside.line(&[[0.0, 0.0], camera], &ink);
    inside.disc(camera, 0.03, &Style::filled(palette::INK));
    inside.label(camera, [6.0, -8.0], "camera", 50.0, palette::INK);
}
