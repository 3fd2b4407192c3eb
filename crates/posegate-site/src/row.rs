//! Rows of candidates along walls, from TOML.

use super::error::SiteError;
use super::names::named;
use super::reader::{Node, Table};
use super::{Candidate, SiteTag, keys};
use posegate::shape::{Family, Pose3Deg, Tag, Tolerance, Wall};
use std::collections::BTreeMap;

/// The most candidates of one row.
const MOST: usize = 1_000;

/// Returns the candidates of a `[candidates.NAME]` table, named `NAME-1`, `NAME-2`, ... in the order along the wall.
/// The heights of one place follow each other.
///
/// Each face of the wall with a goal in front of it gets a candidate every `every` metres, centred on the face. If no
/// goal is in front of any face, all faces get candidates. Places on keep-outs are left out.
pub(super) fn row(
    name: &str,
    node: &Node<'_>,
    walls: &BTreeMap<String, Wall>,
    goals: &[[f64; 2]],
) -> Result<Vec<(String, Candidate)>, SiteError> {
    let table = node.table(&[
        &keys::ROW_WALL,
        &keys::ROW_EVERY,
        &keys::ROW_Z,
        &keys::ID,
        &keys::FAMILY,
        &keys::SIZE,
        &keys::CANDIDATE_COST,
        &keys::TOLERANCE,
    ])?;
    let wall = named(&table.required(&keys::ROW_WALL)?, "wall", walls)?;
    let every = table.required(&keys::ROW_EVERY)?;
    let family = table.required(&keys::FAMILY)?;
    if family.text()?.is_empty() {
        return Err(family.error("the tag's family is empty"));
    }
    let family = family.text()?.to_owned();
    let size = table.number(&keys::SIZE)?;
    let half = 0.5 * size * Family::whole_of(&family);
    let heights = heights(&table, wall, half)?;
    let places = places(wall, half, every.number()?, goals);
    if places.is_empty() {
        return Err(node.error(format!(
            "no face of the wall `{}` is as long as the tag with its white border: {} m",
            wall.name,
            2.0 * half
        )));
    }
    if places.len() * heights.len() > MOST {
        return Err(every.error(format!(
            "the wall `{}` has {} places for candidates; at most {MOST} are allowed",
            wall.name,
            places.len() * heights.len()
        )));
    }
    let first = match table.optional(&keys::ID) {
        Some(node) => Some((node.whole(0..=u32::MAX)?, node)),
        None => None,
    };
    let cost = match table.optional(&keys::CANDIDATE_COST) {
        Some(node) => node.number()?,
        None => 1.0,
    };
    let tolerance = match table.optional(&keys::TOLERANCE) {
        Some(node) => super::places::tolerance(&node)?,
        None => Tolerance::NONE,
    };
    let mut found = Vec::new();
    for place in &places {
        for z in &heights {
            if is_kept_out(wall, place.along, *z, half) {
                continue;
            }
            let number = found.len();
            let id = match &first {
                Some((first, node)) => {
                    let id = u32::try_from(number).ok();
                    let id = id.and_then(|number| first.checked_add(number));
                    Some(id.ok_or_else(|| node.out_of_range())?)
                }
                None => None,
            };
            let tag = Tag {
                id: id.unwrap_or_default(),
                size,
                pose: Pose3Deg {
                    z: *z,
                    ..place.pose
                },
            };
            let tag = SiteTag {
                family: family.clone(),
                tag,
                tolerance,
            };
            found.push((
                format!("{name}-{}", number + 1),
                Candidate { tag, id, cost },
            ));
        }
    }
    if found.is_empty() {
        return Err(node.error(format!(
            "the keep-outs of the wall `{}` leave no place for a candidate",
            wall.name
        )));
    }
    Ok(found)
}

/// Returns the heights of the tags' centres. The complete tag must be on the wall.
fn heights(table: &Table<'_>, wall: &Wall, half: f64) -> Result<Vec<f64>, SiteError> {
    let node = table.required(&keys::ROW_Z)?;
    let heights: Vec<f64> = node
        .array()?
        .iter()
        .map(Node::number)
        .collect::<Result<_, _>>()?;
    if heights.is_empty() {
        return Err(node.error("a row of candidates has no height"));
    }
    let [low, high] = [wall.z[0] + half, wall.z[1] - half];
    match heights.iter().find(|z| !(low <= **z && **z <= high)) {
        None => Ok(heights),
        Some(z) if low <= high => Err(node
            .error(format!(
                "at z = {z} the tag with its white border is not on the wall `{}`",
                wall.name
            ))
            .help(format!("give heights from {low} to {high}"))),
        Some(_) => Err(node.error(format!(
            "the wall `{}` is lower than the tag with its white border: {} m",
            wall.name,
            2.0 * half
        ))),
    }
}

/// A place on a wall: the distance from the first corner along the outline, and the pose on the floor.
struct Place {
    along: f64,
    pose: Pose3Deg,
}

fn places(wall: &Wall, half: f64, every: f64, goals: &[[f64; 2]]) -> Vec<Place> {
    let count = wall.corners.len();
    let mut faces = Vec::new();
    let mut begin = 0.0;
    for i in 0..count.max(2) {
        let (a, b) = (wall.corners[i % count], wall.corners[(i + 1) % count]);
        let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
        let length = libm::hypot(dx, dy);
        let direction = [dx / length, dy / length];
        // The outside of an outline with counter-clockwise corners is to the right. A wall with two corners has an
        // edge in each direction.
        let normal = [direction[1], -direction[0]];
        let front = |[x, y]: &[f64; 2]| (x - a[0]) * normal[0] + (y - a[1]) * normal[1] > 0.0;
        // The edge back passes the same places.
        let backward = count == 2 && i == 1;
        let along = move |at: f64| {
            if backward { length - at } else { begin + at }
        };
        let free = length - 2.0 * half;
        let mut on_it = Vec::new();
        if free >= 0.0 {
            let steps = libm::floor(free / every * (1.0 + 1e-12));
            let from = 0.5 * (length - steps * every);
            // A number above the limit need not be exact.
            let steps = steps.min(1e4) as u32;
            on_it.extend((0..=steps).map(|k| {
                let at = from + f64::from(k) * every;
                Place {
                    along: along(at),
                    pose: Pose3Deg {
                        x: a[0] + at * direction[0],
                        y: a[1] + at * direction[1],
                        z: 0.0,
                        roll_deg: 0.0,
                        pitch_deg: 0.0,
                        yaw_deg: libm::atan2(normal[1], normal[0]).to_degrees(),
                    },
                }
            }));
        }
        if backward {
            on_it.reverse();
        }
        faces.push((goals.iter().any(front), on_it));
        begin += length;
    }
    let is_seen = faces.iter().any(|(is_seen, _)| *is_seen);
    let used = faces.into_iter().filter(|(front, _)| *front || !is_seen);
    used.flat_map(|(_, on_it)| on_it).collect()
}

/// Returns `true` if a tag overlaps a keep-out.
fn is_kept_out(wall: &Wall, along: f64, z: f64, half: f64) -> bool {
    wall.keep_outs.iter().any(|[[a, b], [low, high]]| {
        let depth = (along + half - a)
            .min(b - along + half)
            .min(z + half - low)
            .min(high - z + half);
        depth > 1e-9
    })
}
