//! Checks that tags have enough space at their places.

use posegate::shape::{Family, Pose3Deg, Wall, rotation};
use posegate_place::Space;
use posegate_site::{Site, SiteTag};

/// A tag at most this far from a wall counts as mounted on it, metres.
const ON_A_WALL: f64 = 0.02;
/// Tags farther than this behind each other do not overlap, metres.
const BEHIND: f64 = 0.05;

/// Returns the edge length of a printed tag, white border included, metres.
pub(super) fn edge(tag: &SiteTag) -> f64 {
    tag.tag.size * Family::whole_of(&tag.family)
}

/// Returns `true` if two tags that face the same direction overlap.
pub fn overlap(a: &SiteTag, b: &SiteTag) -> bool {
    let [p, q] = [a.tag.pose, b.tag.pose];
    let axes =
        |pose: Pose3Deg| -> [[f64; 3]; 3] { rotation(pose.roll_deg, pose.pitch_deg, pose.yaw_deg) };
    let (own, other) = (axes(p), axes(q));
    let column = |rows: [[f64; 3]; 3], axis: usize| rows.map(|row| row[axis]);
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    if dot(column(own, 0), column(other, 0)) < 0.5 {
        return false;
    }
    let between = [q.x - p.x, q.y - p.y, q.z - p.z];
    let off = [0, 1, 2].map(|axis| dot(column(own, axis), between).abs());
    let reach = 0.5 * (edge(a) + edge(b)) * (1.0 - 1e-9);
    off[0] < BEHIND && off[1] < reach && off[2] < reach
}

/// Returns the walls on which the centre of a tag lies.
fn carriers<'a>(site: &'a Site, tag: &SiteTag) -> impl Iterator<Item = &'a Wall> {
    let pose = tag.tag.pose;
    site.walls.iter().filter(move |wall| {
        wall.distance([pose.x, pose.y]) <= ON_A_WALL && pose.z >= wall.z[0] && pose.z <= wall.z[1]
    })
}

/// The face of a wall on which a tag is mounted.
struct Face {
    /// The places without a keep-out, and all places.
    spaces: [Space; 2],
}

impl Face {
    /// Returns `None` if the tag fits nowhere on the wall.
    fn of(wall: &Wall, tag: &SiteTag) -> Option<Self> {
        let pose = tag.tag.pose;
        let out: [[f64; 3]; 3] = rotation(pose.roll_deg, pose.pitch_deg, pose.yaw_deg);
        let front = [pose.x + 0.1 * out[0][0], pose.y + 0.1 * out[1][0]];
        let bare = Wall {
            keep_outs: std::vec![],
            ..wall.clone()
        };
        let space = |wall| Space::wall(wall, [tag.tag.size, edge(tag)], front, None).ok();
        Some(Self {
            spaces: [space(wall)?, space(&bare)?],
        })
    }

    /// Returns `true` if the place nearest to a pose is not on a keep-out.
    fn is_clear(&self, pose: &Pose3Deg) -> bool {
        let off = |space: &Space| {
            let on = space.nearest(pose);
            [pose.x - on.x, pose.y - on.y, pose.z - on.z]
        };
        let [clear, any] = [0, 1].map(|k| off(&self.spaces[k]));
        clear.iter().zip(any).all(|(a, b)| (a - b).abs() < 1e-6)
    }
}

/// Returns the name of a wall if a tag, including its border, lies on one of the wall's keep-outs.
pub fn on_a_keep_out<'a>(site: &'a Site, tag: &SiteTag) -> Option<&'a str> {
    let mut walls = carriers(site, tag).filter(|wall| !wall.keep_outs.is_empty());
    let clear = |wall: &Wall| Face::of(wall, tag).is_some_and(|face| face.is_clear(&tag.tag.pose));
    let wall = walls.find(|wall| !clear(wall));
    wall.map(|wall| wall.name.as_str())
}
