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

    /// Returns the offset from the nearest place to a pose, metres; `None` if that place is on a keep-out.
    fn off(&self, pose: &Pose3Deg) -> Option<[f64; 3]> {
        let off = |space: &Space| {
            let on = space.nearest(pose);
            [pose.x - on.x, pose.y - on.y, pose.z - on.z]
        };
        let [clear, any] = [0, 1].map(|k| off(&self.spaces[k]));
        near(clear, any).then_some(clear)
    }
}

/// Returns `true` if two offsets are equal.
fn near(a: [f64; 3], b: [f64; 3]) -> bool {
    a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-6)
}

/// Returns the name of a wall if a tag, including its border, lies on one of the wall's keep-outs.
pub fn on_a_keep_out<'a>(site: &'a Site, tag: &SiteTag) -> Option<&'a str> {
    let mut walls = carriers(site, tag).filter(|wall| !wall.keep_outs.is_empty());
    let clear = |wall: &Wall| Face::of(wall, tag)?.off(&tag.tag.pose);
    let wall = walls.find(|wall| clear(wall).is_none());
    wall.map(|wall| wall.name.as_str())
}

/// The places to which a tag may be moved.
pub(super) struct Place<'a> {
    site: &'a Site,
    /// The face on which it is mounted, and its offset from the face.
    face: Option<(Face, [f64; 3])>,
    tag: &'a SiteTag,
}

impl<'a> Place<'a> {
    /// Returns `None` if the tag is mounted on a wall, but not completely on one face, or on a keep-out. Such a tag
    /// is not moved.
    pub fn of(site: &'a Site, tag: &'a SiteTag) -> Option<Self> {
        let mut walls = carriers(site, tag).peekable();
        if walls.peek().is_none() {
            let free = Self {
                site,
                face: None,
                tag,
            };
            return Some(free);
        }
        walls.find_map(|wall| {
            let face = Face::of(wall, tag)?;
            let off = face.off(&tag.tag.pose)?;
            let away = off.iter().map(|by| by * by).sum::<f64>();
            (libm::sqrt(away) <= ON_A_WALL).then_some(Self {
                site,
                face: Some((face, off)),
                tag,
            })
        })
    }

    /// Returns `true` if the tag may be mounted at a pose next to other tags. It must stay on its face; a tag without
    /// a face must be above the floor and clear of all walls. It may only overlap tags that it overlapped before.
    pub fn holds<'t>(&self, pose: Pose3Deg, others: impl Iterator<Item = &'t SiteTag>) -> bool {
        let mut moved = self.tag.clone();
        moved.tag.pose = pose;
        let half = 0.5 * edge(self.tag);
        let stays = match &self.face {
            Some((face, from)) => face.off(&pose).is_some_and(|now| near(now, *from)),
            None => {
                let away = |wall: &Wall| {
                    wall.distance([pose.x, pose.y]) > half
                        || pose.z + half < wall.z[0]
                        || pose.z - half > wall.z[1]
                };
                pose.z >= half && self.site.walls.iter().all(away)
            }
        };
        let clear = |other: &SiteTag| !overlap(&moved, other) || overlap(self.tag, other);
        stays && others.into_iter().all(clear)
    }
}
