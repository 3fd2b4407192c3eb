//! A task's camera image with its tags: from the goal, and from the worst poses of a pose-set.

use super::ingredients::Ingredients;
use super::legend::{LINE, Sample, legend};
use super::palette;
use super::panel::{axes, multiples, signed, tick_at_scale};
use super::subject::{DrawError, Subject};
use super::svg::{Anchor, Font, Picture, Style, literal, points_path};
use posegate::shape::{Camera, Lens, Shape, SuccessSet, Visibility, Window, hull};

const LEFT: f64 = 66.0;
const TOP: f64 = 72.0;
/// The largest frame, pixels.
const LARGEST: [f64; 2] = [600.0, 470.0];
/// Margin shown around the image, as a share of its size.
const ROOM: f64 = 0.16;

const GOAL: Style = Style::outlined("#222222", 2.4);
const WORST: Style = Style::outlined("#a84300", 1.6).dashed("6 3");
const HULL: Style = Style::outlined("#009e73", 1.6)
    .with_fill_opacity("#009e73", 0.12)
    .dashed("9 3 2 3");
const WINDOW: Style = Style::outlined("#0072b2", 1.4).dashed("3 3");
const IMAGE: Style = Style::outlined("#222222", 2.0);

/// The image in the picture, y down.
struct Frame {
    scale: f64,
    size: [f64; 2],
}

impl Frame {
    fn of(camera: &Camera) -> Self {
        let size = [camera.width_px, camera.height_px];
        let fit = |i: usize| LARGEST[i] / (size[i] * (1.0 + 2.0 * ROOM));
        Self {
            scale: fit(0).min(fit(1)),
            size,
        }
    }

    fn extent(&self) -> [f64; 2] {
        self.size.map(|s| s * (1.0 + 2.0 * ROOM) * self.scale)
    }

    fn at(&self, [u, v]: [f64; 2]) -> [f64; 2] {
        [
            LEFT + (u + ROOM * self.size[0]) * self.scale,
            TOP + (v + ROOM * self.size[1]) * self.scale,
        ]
    }

    /// Returns `true` if the middle of a tag is in the picture.
    fn shows(&self, look: &Look) -> bool {
        let within = |v: f64, size: f64| (-ROOM * size..=(1.0 + ROOM) * size).contains(&v);
        quad(look).is_some_and(|quad| {
            let [u, v] = middle(&quad);
            within(u, self.size[0]) && within(v, self.size[1])
        })
    }

    fn path(&self, points: &[[f64; 2]]) -> String {
        let points: Vec<_> = points.iter().map(|p| self.at(*p)).collect();
        format!("{}Z", points_path(&points))
    }
}

/// A tag as seen from a pose, with the least slack there and the name of its constraint.
#[derive(Clone, Debug, PartialEq)]
struct Look {
    seen: SeenFrom,
    name: &'static str,
    slack: f64,
}

/// The looks at one tag.
struct Looks {
    goal: Look,
    worst: Vec<Look>,
    hull: Vec<[f64; 2]>,
    behind: usize,
}

/// A tag as seen from a pose, as [`task_image`] draws it.
#[derive(Clone, Debug, PartialEq)]
pub struct SeenFrom {
    /// The tag's name and number.
    pub tag: String,
    /// The name of the constraint for which the pose is worst; `None` for the goal.
    pub worst_for: Option<&'static str>,
    /// The pose in the world: m, m, rad.
    pub pose: [f64; 3],
    /// The four corners in AprilTag's order ([`posegate::shape::Sight`]), pixels; `None` for a corner that is not in
    /// front of the camera.
    pub corners: [Option<[f64; 2]>; 4],
}

/// Returns an SVG of the tags of a task in the image of its camera, or of the first camera if there are several.
///
/// # Errors
/// [`DrawError::NoCamera`] if the success set has no camera.
pub fn task_image(subject: &Subject<'_>) -> Result<String, DrawError> {
    task_image_with_numbers(subject).map(|(picture, _)| picture)
}

/// Like [`task_image`], and also returns the drawn numbers.
///
/// # Errors
/// [`DrawError::NoCamera`] if the success set has no camera.
pub fn task_image_with_numbers(
    subject: &Subject<'_>,
) -> Result<(String, Vec<SeenFrom>), DrawError> {
    let views = Ingredients::of(&subject.task.success.shape).views;
    let Some(first) = views.first() else {
        return Err(DrawError::NoCamera(subject.name.into()));
    };
    let (camera, mount) = (first.camera, first.mount);
    let own: Vec<&Visibility> = views
        .iter()
        .filter(|view| view.camera == camera && view.mount == mount)
        .collect();
    let all: Vec<Looks> = own
        .iter()
        .map(|view| looks(subject, view, own.len()))
        .collect();
    let frame = Frame::of(&camera);
    let [width, height] = frame.extent();
    let side = LEFT + width + 26.0;
    let lines: usize = all.iter().map(|looks| 3 + looks.worst.len() * 2).sum();
    let below = TOP + height + 46.0;
    let least = TOP + 7.0 * LINE + 20.0 + 16.0 * lines as f64 + 24.0 * all.len() as f64;
    let name = subject
        .site
        .cameras
        .iter()
        .find(|(_, known)| known.mount == mount);
    let name = name.map_or("the camera", |(name, _)| name.as_str());
    let title = format!(
        "The image of camera {} in task {}",
        literal(name),
        literal(subject.name)
    );
    let mut picture = Picture::new(side + 370.0, below.max(least), &title);
    picture.text([24.0, 32.0], &title, &Font::new(19.0, palette::INK).bold());
    picture.clipped([LEFT, TOP, width, height], |picture| {
        picture.path(&frame.path(&rectangle(&camera)), &Style::filled("#f7f7f4"));
        for looks in &all {
            picture.path(&frame.path(&looks.hull), &HULL);
        }
        if !camera.is_whole_pinhole() {
            picture.path(&frame.path(&window(&camera)), &WINDOW);
        }
        picture.path(&frame.path(&rectangle(&camera)), &IMAGE);
        let mut letters = 'A'..='Z';
        for looks in &all {
            for look in &looks.worst {
                if let Some(quad) = quad(look) {
                    picture.path(&frame.path(&quad), &WORST);
                    let letter = letters.next().unwrap_or('?');
                    letter_at(&frame, &quad, letter, picture);
                }
            }
        }
        for looks in &all {
            if let Some(quad) = quad(&looks.goal) {
                picture.path(&frame.path(&quad), &GOAL);
                numbered(&frame, &quad, picture);
                let lowest = quad.iter().map(|p| frame.at(*p)[1]).fold(0.0, f64::max);
                let [x, _] = frame.at(middle(&quad));
                let font = Font::new(11.0, palette::INK).anchored(Anchor::Middle);
                picture.text([x, lowest + 28.0], &looks.goal.seen.tag, &font);
            }
        }
    });
    let outline = [LEFT, TOP, width, height];
    picture.rectangle(outline, &Style::outlined(palette::FRAME, 1.0));
    let tick = tick_at_scale(frame.scale, 60.0);
    let shown = |size: f64| multiples([-ROOM * size, (1.0 + ROOM) * size], tick);
    let u = shown(camera.width_px).map(|u| (frame.at([u, 0.0])[0], signed(u)));
    let v = shown(camera.height_px).map(|v| (frame.at([0.0, v])[1], signed(v)));
    axes(&mut picture, outline, u, v, ["u (px)", "v (px)"]);
    let mut entries = std::vec![
        (Sample::Line(IMAGE), "the image"),
        (
            Sample::Line(GOAL),
            "tag from the goal; corners in AprilTag's order"
        ),
    ];
    if camera.lens() != Lens::Pinhole {
        entries.push((
            Sample::Line(WINDOW),
            "what is proven to be seen through the lens",
        ));
    } else if !camera.is_whole_pinhole() {
        entries.push((Sample::Line(WINDOW), "the image without its border"));
    }
    if !subject.beliefs.is_empty() {
        entries.push((Sample::Line(WORST), "from the worst poses of the pose-set"));
        entries.push((Sample::Patch(HULL), "hull of what its border sees"));
    }
    legend(&mut picture, [side, TOP], &entries);
    let mut top = TOP + entries.len() as f64 * LINE + 24.0;
    let mut letters = 'A'..='Z';
    for looks in &all {
        write_looks(&frame, looks, side, &mut top, &mut letters, &mut picture);
    }
    let shown = |looks: Looks| std::iter::once(looks.goal).chain(looks.worst);
    let numbers = all.into_iter().flat_map(shown).map(|look| look.seen);
    Ok((picture.finish(), numbers.collect()))
}

fn looks(subject: &Subject<'_>, view: &Visibility, of: usize) -> Looks {
    let set = SuccessSet {
        goal: subject.goal(),
        shape: Shape::Visibility(*view),
    };
    let goal = super::ingredients::radians(subject.goal());
    let tags = &subject.site.tags;
    let named = tags.iter().find(|(_, tag)| tag.tag == view.tag);
    let name = named.map_or("tag", |(name, _)| name.as_str());
    let tag = format!("{}, id {}", literal(name), view.tag.id);
    let look = |pose: [f64; 3], worst_for: Option<&'static str>| {
        let membership = set.membership(pose);
        let slacks = membership.slack.iter();
        let (name, slack) = slacks
            .filter(|(own, _)| worst_for.is_none_or(|name| name == *own))
            .min_by(|a, b| a.1.total_cmp(&b.1))
            .copied()
            .unwrap_or(("", f64::INFINITY));
        let seen = SeenFrom {
            tag: tag.clone(),
            worst_for,
            pose,
            corners: membership.sight.map_or([None; 4], |sight| sight.corners_px),
        };
        Look { seen, name, slack }
    };
    let poses: Vec<[f64; 3]> = subject.beliefs.iter().flat_map(|b| b.border()).collect();
    // The worst pose for each constraint, sorted by slack, each pose once.
    let names = set.membership(goal).slack;
    let mut worst: Vec<Look> = Vec::new();
    for (name, _) in names {
        let looks = poses.iter().map(|pose| look(*pose, Some(name)));
        let least = looks.min_by(|a, b| a.slack.total_cmp(&b.slack));
        worst.extend(least.filter(|least| quad(least).is_some()));
    }
    worst.sort_by(|a, b| a.slack.total_cmp(&b.slack));
    let mut kept: Vec<Look> = Vec::new();
    for look in worst {
        if kept.iter().all(|known| known.seen.pose != look.seen.pose) {
            kept.push(look);
        }
    }
    kept.truncate(if of > 1 { 2 } else { 3 });
    let mut points: Vec<[f64; 2]> = Vec::new();
    let mut behind = 0;
    for pose in &poses {
        let look = look(*pose, None);
        match quad(&look) {
            Some(quad) => points.extend(quad),
            None => behind += 1,
        }
    }
    Looks {
        goal: look(goal, None),
        worst: kept,
        hull: hull(points),
        behind,
    }
}

fn quad(look: &Look) -> Option<Vec<[f64; 2]>> {
    look.seen.corners.iter().copied().collect()
}

fn rectangle(camera: &Camera) -> [[f64; 2]; 4] {
    let (w, h) = (camera.width_px, camera.height_px);
    [[0.0, 0.0], [w, 0.0], [w, h], [0.0, h]]
}

/// Returns the border of the image area that a camera is certain to see.
pub(super) fn window(camera: &Camera) -> Vec<[f64; 2]> {
    let corners = polygon(&camera.view());
    let ends = corners.iter().cycle().skip(1);
    let mut points = Vec::new();
    for (a, b) in corners.iter().zip(ends) {
        points.extend((0..12).map(|k| {
            let t = f64::from(k) / 12.0;
            camera.project([a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])])
        }));
    }
    points
}

/// Returns a window's corners, normalised.
fn polygon(window: &Window) -> Vec<[f64; 2]> {
    let planes = window.planes();
    let mut corners = Vec::new();
    for (index, [a, b, c]) in planes.iter().enumerate() {
        for [d, e, f] in &planes[index + 1..] {
            let det = a * e - b * d;
            if det.abs() < 1e-12 {
                continue;
            }
            let point = [(b * f - c * e) / det, (c * d - a * f) / det];
            let near = |[a, b, c]: &[f64; 3]| {
                let height = a * point[0] + b * point[1] + c;
                height >= -1e-9 * (a.abs() + b.abs() + c.abs())
            };
            if planes.iter().all(near) {
                corners.push(point);
            }
        }
    }
    hull(corners)
}

fn numbered(frame: &Frame, quad: &[[f64; 2]], picture: &mut Picture) {
    let middle = middle(quad);
    for (index, corner) in quad.iter().enumerate() {
        let direction = [corner[0] - middle[0], corner[1] - middle[1]];
        let length = libm::hypot(direction[0], direction[1]).max(1e-9);
        let [x, y] = frame.at(*corner);
        let at = [
            x + 9.0 * direction[0] / length,
            y + 9.0 * direction[1] / length + 4.0,
        ];
        picture.circle([x, y], 2.4, &Style::filled(palette::INK));
        let font = Font::new(11.0, palette::INK).bold();
        picture.text(at, &format!("{index}"), &font.anchored(Anchor::Middle));
    }
}

fn letter_at(frame: &Frame, quad: &[[f64; 2]], letter: char, picture: &mut Picture) {
    let [x, y] = frame.at(middle(quad));
    let font = Font::new(12.0, palette::NO).bold();
    picture.text(
        [x, y + 4.0],
        &format!("{letter}"),
        &font.anchored(Anchor::Middle),
    );
}

fn middle(quad: &[[f64; 2]]) -> [f64; 2] {
    let count = quad.len() as f64;
    quad.iter().fold([0.0; 2], |sum, p| {
        [sum[0] + p[0] / count, sum[1] + p[1] / count]
    })
}

/// Writes the text about each look.
fn write_looks(
    frame: &Frame,
    looks: &Looks,
    left: f64,
    top: &mut f64,
    letters: &mut impl Iterator<Item = char>,
    picture: &mut Picture,
) {
    let plain = Font::new(12.0, palette::INK);
    let mut line = |text: &str, font: &Font, picture: &mut Picture| {
        picture.text([left, *top], text, font);
        *top += 16.0;
    };
    line(&looks.goal.seen.tag, &plain.bold(), picture);
    let slack = |look: &Look| {
        let sign = if look.slack < 0.0 { "" } else { "+" };
        format!("{}: {sign}{}", literal(look.name), signed(look.slack))
    };
    let from_goal = format!("from the goal, least slack {}", slack(&looks.goal));
    line(&from_goal, &plain, picture);
    for look in &looks.worst {
        let [x, y, yaw] = look.seen.pose;
        let letter = letters.next().unwrap_or('?');
        let text = format!("{letter}: slack {}", slack(look));
        line(&text, &Font::new(12.0, palette::NO).bold(), picture);
        let text = format!(
            "at ({} m, {} m, {}°){}",
            signed(x),
            signed(y),
            signed(yaw.to_degrees()),
            if frame.shows(look) {
                ""
            } else {
                ", outside of the picture"
            }
        );
        line(&text, &Font::new(12.0, palette::FAINT), picture);
    }
    if looks.behind > 0 {
        let text = format!("{} poses have a corner behind the camera", looks.behind);
        line(&text, &Font::new(12.0, palette::NO), picture);
    }
    *top += 10.0;
}
