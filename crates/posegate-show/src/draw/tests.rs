//! Shared parts of the tests of pictures, and tests that the pictures are correct.

use super::belief::PoseSetF64;
use super::panel::Window;
use super::pieces::pieces;
use super::{Subject, task_image, task_plan, task_sections};
use posegate::bake::{BakeInput, Layout};
use posegate::gate::judge;
use posegate::set::{RadiusSquared, Uncertainty};
use posegate::table::Table;
use posegate::verify::build;
use posegate_site::Site;
use posegate_testkit::counts;

const BAY: &str = include_str!("../../../../examples/sites/loading-bay.toml");

/// Pseudorandom numbers, the same on every run: xorshift.
pub struct Random(pub u64);

impl Random {
    /// Returns a number between -1 and 1.
    pub fn signed(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        2.0 * (self.0 >> 11) as f64 / (1_u64 << 53) as f64 - 1.0
    }

    fn within(&mut self, [lo, hi]: [f64; 2]) -> f64 {
        lo + (hi - lo) * 0.5 * (self.signed() + 1.0)
    }
}

fn site(text: &str) -> Site {
    Site::parse(text, "site.toml").unwrap()
}

fn table(site: &Site, name: &str, layout: Layout) -> Vec<u8> {
    let task = site.task(name).unwrap();
    let mut spec = site.chosen_table(task).unwrap();
    spec.layout = layout;
    let order = BakeInput {
        task: name,
        success: &task.success,
        spec,
        epsilon: site.epsilon,
    };
    build(&order, &|| ()).unwrap().0
}

/// A panel of a picture: left, top, width, height; its heading; and its paths by fill and stroke colour.
struct Drawn {
    edges: [f64; 4],
    yaw_deg: f64,
    paths: Vec<(String, Vec<Vec<[f64; 2]>>)>,
}

fn attribute<'a>(tag: &'a str, name: &str) -> Option<&'a str> {
    let start = tag.find(&std::format!(" {name}=\""))? + name.len() + 3;
    tag[start..].split('"').next()
}

/// Parses the panels of sections, only from the SVG text.
fn panels(svg: &str) -> Vec<Drawn> {
    let mut panels = Vec::new();
    for part in svg.split("<svg x=").skip(1) {
        let head = std::format!("<svg x={}", part.lines().next().unwrap());
        let edges = ["x", "y", "width", "height"]
            .map(|name| attribute(&head, name).unwrap().parse().unwrap());
        let (body, after) = part.split_once("</svg>").unwrap();
        let yaw = after
            .split("yaw ")
            .nth(1)
            .unwrap()
            .split('°')
            .next()
            .unwrap();
        let paths = body.lines().filter(|line| line.starts_with("<path"));
        panels.push(Drawn {
            edges,
            yaw_deg: yaw.replace('\u{2212}', "-").parse().unwrap(),
            paths: paths
                .map(|line| {
                    let stroke = attribute(line, "stroke").unwrap_or_default();
                    let fill = attribute(line, "fill").unwrap();
                    let data = attribute(line, "d").unwrap();
                    (std::format!("{fill} {stroke}"), polygons(data))
                })
                .collect(),
        });
    }
    panels
}

fn polygons(data: &str) -> Vec<Vec<[f64; 2]>> {
    let closed = |part: &str| {
        if let Some((at, size)) = part.split_once('h') {
            // A rectangle: M x y h w v h h -w z.
            let [x, y] = pairs(at)[0];
            let (w, rest) = size.split_once('v').unwrap();
            let h = rest.split('h').next().unwrap();
            let (w, h): (f64, f64) = (w.parse().unwrap(), h.parse().unwrap());
            std::vec![[x, y], [x + w, y], [x + w, y + h], [x, y + h]]
        } else {
            pairs(part)
        }
    };
    data.split('M').skip(1).map(closed).collect()
}

fn pairs(text: &str) -> Vec<[f64; 2]> {
    let numbers: Vec<f64> = text
        .split(['L', 'Z', 'z', ' '])
        .filter(|word| !word.is_empty())
        .map(|word| word.parse().unwrap())
        .collect();
    numbers.chunks(2).map(|pair| [pair[0], pair[1]]).collect()
}

/// Returns `true` if a point is in polygons with holes, and its distance from their edges.
fn in_polygons(polygons: &[Vec<[f64; 2]>], p: [f64; 2]) -> (bool, f64) {
    let (mut crossings, mut nearest) = (0, f64::INFINITY);
    for polygon in polygons {
        for (a, b) in polygon.iter().zip(polygon.iter().cycle().skip(1)) {
            if (a[1] > p[1]) != (b[1] > p[1]) {
                let x = a[0] + (p[1] - a[1]) / (b[1] - a[1]) * (b[0] - a[0]);
                crossings += i32::from(x > p[0]);
            }
            let d = [b[0] - a[0], b[1] - a[1]];
            let along = (p[0] - a[0]) * d[0] + (p[1] - a[1]) * d[1];
            let t = (along / (d[0] * d[0] + d[1] * d[1]).max(1e-12)).clamp(0.0, 1.0);
            let off = libm::hypot(a[0] + t * d[0] - p[0], a[1] + t * d[1] - p[1]);
            nearest = nearest.min(off);
        }
    }
    (crossings % 2 == 1, nearest)
}

/// At random points of every panel: the drawn S equals S, and the drawn table lies in S.
#[test]
fn drawn_sections_agree_with_membership() {
    let turned = BAY.replace(
        "goal = { x = 2.2, y = 0.0, yaw_deg = 0.0 }",
        "goal = { x = 2.2, y = 7.0, yaw_deg = 130.0 }",
    );
    let rounds = counts::rounds(1500, 4);
    let mut random = Random(11);
    let drawn = [
        (BAY, "see-bay", Layout::Facets),
        (BAY, "see-bay", Layout::Grid),
        (turned.as_str(), "enter-bay", Layout::Facets),
        (turned.as_str(), "enter-bay", Layout::Grid),
    ];
    for (text, name, layout) in counts::one_a_day(&drawn) {
        let site = site(text);
        let bytes = table(&site, name, layout);
        let subject = Subject::new(&site, name).unwrap();
        let subject = subject.with_table(&bytes).unwrap().expected().unwrap();
        let (window, _) = subject.extent().unwrap();
        let svg = task_sections(&subject).unwrap();
        let (mut inside, mut outside, mut held) = (0, 0, 0);
        let panels = panels(&svg);
        assert!(panels.len() >= 5);
        for panel in &panels {
            let [left, top, width, height] = panel.edges;
            let of = |style: &str| -> Vec<Vec<[f64; 2]>> {
                let own = panel.paths.iter().filter(|(known, _)| known == style);
                own.flat_map(|(_, polygons)| polygons.clone()).collect()
            };
            let border = of("none #0072b2");
            let pieces = panel
                .paths
                .iter()
                .filter(|(known, _)| known == "#a9d7f2 " || known == "#a9d7f2 #4a86a8");
            let pieces: Vec<&Vec<[f64; 2]>> = pieces.flat_map(|(_, polygons)| polygons).collect();
            for _ in 0..rounds {
                let point = [random.within(window.x), random.within(window.y)];
                let pixel = [
                    left + width * (point[0] - window.x[0]) / (window.x[1] - window.x[0]),
                    top + height * (window.y[1] - point[1]) / (window.y[1] - window.y[0]),
                ];
                let [x, y] = subject.in_world(point);
                let yaw = (subject.goal().yaw_deg + panel.yaw_deg).to_radians();
                let is = subject.task.success.membership([x, y, yaw]).inside;
                let (drawn, off) = in_polygons(&border, pixel);
                if off > 1.5 {
                    assert_eq!(drawn, is, "{name}, yaw {}: {point:?}", panel.yaw_deg);
                    inside += u32::from(is);
                    outside += u32::from(!is);
                }
                for piece in &pieces {
                    let (drawn, off) = in_polygons(std::slice::from_ref(*piece), pixel);
                    if drawn && off > 0.1 {
                        assert!(is, "{name}, yaw {}: {point:?} of a table", panel.yaw_deg);
                        held += 1;
                    }
                }
            }
        }
        if !cfg!(miri) {
            assert!(
                inside > 500 && outside > 500 && held > 500,
                "{inside} {outside} {held}"
            );
        }
    }
}

/// The drawn pieces are those of the gate: it permits poses in them, and denies poses outside of all pieces.
#[test]
fn drawn_pieces_equal_those_of_the_gate() {
    let turned = BAY
        .replace(
            "goal = { x = 2.2, y = 0.0, yaw_deg = 0.0 }",
            "goal = { x = 2.2, y = 7.0, yaw_deg = 130.0 }",
        )
        .replace(
            "goal = { x = 0.0, y = 0.0, yaw_deg = 0.0 }",
            "goal = { x = 0.3, y = -0.2, yaw_deg = -7.0 }",
        );
    let site = site(&turned);
    let mut random = Random(5);
    for name in ["see-bay", "enter-bay"] {
        let bytes = table(&site, name, Layout::Facets);
        let subject = Subject::new(&site, name).unwrap();
        let extent = site.chosen_table(subject.task).unwrap().extent;
        let window = Window {
            x: extent.x,
            y: extent.y,
        };
        let table = Table::parse(&bytes).unwrap();
        let (mut permits, mut denials) = (0, 0);
        for _ in 0..counts::rounds(20, 2) {
            let yaw_deg = random.within([-20.0, 20.0]);
            let pieces = pieces(&table, yaw_deg, &window);
            for _ in 0..counts::rounds(180, 4) {
                let point = [random.within(window.x), random.within(window.y)];
                let looks = pieces
                    .iter()
                    .map(|p| in_polygons(std::slice::from_ref(p), point));
                let looks: Vec<(bool, f64)> = looks.collect();
                let [x, y] = subject.in_world(point);
                let belief = PoseSetF64 {
                    estimate: [x, y, (subject.goal().yaw_deg + yaw_deg).to_radians()],
                    spread: Uncertainty::Bounded {
                        translation_m: 1e-5,
                        yaw_rad: 1e-5,
                    },
                    radius_squared: RadiusSquared::LARGEST,
                };
                let verdict = judge(&table, &belief.pose_set().unwrap());
                // Lengths in a table are rounded to its unit, here at most a millimetre.
                if looks.iter().any(|(within, off)| *within && *off > 4e-3) {
                    assert!(
                        verdict.is_permit(),
                        "{name} {yaw_deg} {point:?}: {verdict:?}"
                    );
                    permits += 1;
                } else if looks.iter().all(|(within, off)| !within && *off > 4e-3) {
                    assert!(!verdict.is_permit(), "{name} {yaw_deg} {point:?}");
                    denials += 1;
                }
            }
        }
        assert!(
            cfg!(miri) || (permits > 300 && denials > 300),
            "{name}: {permits} {denials}"
        );
    }
}

/// A hole in a set is drawn as a hole.
#[test]
fn holes_are_drawn() {
    let text = "[task.around]\nkind = \"work\"\ngoal = { x = 0.0, y = 1.0, yaw_deg = 30.0 }\n\
        success = { all = [{ shape = \"box\", x = [-2.0, 2.0], y = [-2.0, 2.0], yaw_deg = [-10.0, 10.0] }, \
        { shape = \"clear\", footprint = [[0.0, 0.0]], obstacle = [[1.0, 0.5], [0.5, 0.5], [0.5, -0.5], [1.0, -0.5]] }] }\n";
    let site = site(text);
    let subject = Subject::new(&site, "around").unwrap();
    let panels = panels(&task_sections(&subject).unwrap());
    for panel in &panels {
        let border = panel
            .paths
            .iter()
            .find(|(style, _)| style == "none #0072b2");
        assert_eq!(border.unwrap().1.len(), 2, "yaw {}", panel.yaw_deg);
    }
}

/// Pictures have the same bytes each time, refer to no other files, and show their units.
#[test]
fn pictures_are_deterministic_and_self_contained() {
    let site = site(BAY);
    let subject = || Subject::new(&site, "see-bay").unwrap().expected().unwrap();
    for (draw, units) in [
        (task_sections as fn(&Subject<'_>) -> _, ["x (m)", "y (m)"]),
        (task_plan, ["x (m)", "y (m)"]),
        (task_image, ["u (px)", "v (px)"]),
    ] {
        let text: String = draw(&subject()).unwrap();
        assert_eq!(Ok(text.clone()), draw(&subject()));
        assert!(text.len() < 60_000, "{} bytes", text.len());
        for unit in units {
            assert!(text.contains(unit));
        }
        for bad in ["NaN", "inf", "href", "url(", "<image", "@import"] {
            assert!(!text.contains(bad), "{bad}");
        }
    }
}

/// A plan names all tags and walls that it shows, and no others.
#[test]
fn plan_names_exactly_the_shown_parts() {
    let far = "[tag.elsewhere]\nid = 9\nfamily = \"tag36h11\"\nsize = 0.16\n\
               pose = { x = 400.0, y = 0.0, z = 0.5, roll_deg = 0.0, pitch_deg = 0.0, yaw_deg = 0.0 }\n\
               [wall.beyond]\nfrom = [400.0, -1.0]\nto = [400.0, 1.0]\nz = [0.0, 2.0]\n";
    let site = site(&format!("{BAY}\n{far}"));
    let subject = Subject::new(&site, "see-bay").unwrap();
    let svg = task_plan(&subject).unwrap();
    let own = subject.task.success.tags()[0];
    assert!(svg.contains(&format!(", id {}", own.id)));
    assert!(!svg.contains("elsewhere") && !svg.contains("beyond"));
}

/// The tag is drawn where the camera projects it; the corners are numbered in AprilTag's order.
#[test]
fn image_shows_projected_corners_in_order() {
    let site = site(BAY);
    let subject = Subject::new(&site, "see-bay").unwrap().expected().unwrap();
    let svg = task_image(&subject).unwrap();
    let quads: Vec<Vec<[f64; 2]>> = svg
        .lines()
        .filter(|line| {
            line.contains("stroke=\"#222222\" stroke-width=\"2.4\"") && line.contains('Z')
        })
        .flat_map(|line| polygons(attribute(line, "d").unwrap()))
        .collect();
    assert_eq!(quads.len(), 2);
    // Seen by a viewer: 0 lower left, 1 lower right, 2 upper right, 3 upper left; v grows downwards.
    for quad in &quads {
        assert!(quad[0][0] < quad[1][0] && quad[3][0] < quad[2][0]);
        assert!(quad[0][1] > quad[3][1] && quad[1][1] > quad[2][1]);
    }
    // The left tag is on the left.
    assert!(quads[0][0][0] < quads[1][0][0]);
}
