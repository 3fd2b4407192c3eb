//! Warnings about the mounting of tags and candidates: walls, directions and families.

use super::collisions::meet;
use super::warning::{Warning, warn};
use crate::draw::ingredients::{Eye, axes, radians};
use posegate::shape::{Family, Tag, Wall};
use posegate_plan::cover::on_a_keep_out;
use posegate_site::{FAMILIES, Site, SiteTag, question};

/// The usual range of tag sizes, metres.
pub(super) const SIZES: [f64; 2] = [0.02, 2.0];
/// A wall closer than this in front of a tag's face hides the tag from all poses, metres.
const NEAR: f64 = 0.05;
/// The wall on which a tag is mounted is at most this far behind its centre, metres.
const MOUNTED: f64 = 1e-3;
/// Walls farther from a tag than this are not named as hiding it, metres.
const FAR: f64 = 3.0;

/// Returns warnings of a tag or candidate. `about` is its kind and its name in the site file.
pub(super) fn mounted(site: &Site, about: [&str; 2], tag: &SiteTag) -> Vec<Warning> {
    let found = [
        wall(site, about, &tag.tag),
        kept_out(site, about, tag),
        family(about, tag),
    ];
    found.into_iter().flatten().collect()
}

/// Returns a warning if a tag is within a block, faces the wall on which it is mounted, or is behind a wall.
fn wall(site: &Site, about: [&str; 2], tag: &Tag) -> Option<Warning> {
    let pose = tag.pose;
    let near = |wall: &&Wall| wall.z[0] < pose.z && pose.z < wall.z[1];
    let walls = || site.walls.iter().filter(near);
    if let Some(block) =
        walls().find(|wall| wall.corners.len() > 2 && meet(&wall.corners, &[[pose.x, pose.y]]))
    {
        return Some(warn(
            "tag_in_block",
            about,
            format!("its centre is inside of the block {}", block.name),
            "a tag is mounted on a face of a block or in front of it",
        ));
    }
    let [nx, ny, _] = axes(&pose)[0];
    let ahead = |far: f64| [pose.x + far * nx, pose.y + far * ny];
    let before = |far: f64| walls().find(|wall| meet(&wall.corners, &[ahead(MOUNTED), ahead(far)]));
    if let Some(wall) = before(NEAR) {
        return Some(warn(
            "tag_faces_wall",
            about,
            format!(
                "its face looks to {:.1} deg, into the wall {}",
                pose.yaw_deg, wall.name
            ),
            "`yaw_deg` is the heading that the face looks to: turn the tag by 180 deg, or move it to the other side of the wall",
        ));
    }
    let wall = before(FAR).filter(|_| is_hidden(site, tag))?;
    Some(warn(
        "tag_behind_wall",
        about,
        format!(
            "it is behind the wall {}, which hides it from every camera at every goal",
            wall.name
        ),
        "move the tag to the side of the wall from which it is to be seen",
    ))
}

/// Returns `true` if at least one camera at a goal is in front of a tag, and walls are between the tag and all of
/// these cameras.
fn is_hidden(site: &Site, tag: &Tag) -> bool {
    let pose = tag.pose;
    let normal = axes(&pose)[0];
    let mut seers = site.tasks.values().flat_map(|task| {
        let goal = radians(task.success.goal);
        site.cameras
            .values()
            .map(move |camera| Eye::of(&camera.mount, goal).centre)
    });
    let mut is_before = false;
    let all = seers.all(|[x, y, z]| {
        let offset = [x - pose.x, y - pose.y, z - pose.z];
        if (0..3).map(|i| normal[i] * offset[i]).sum::<f64>() <= 0.0 {
            return true;
        }
        is_before = true;
        let begin = [pose.x + MOUNTED * normal[0], pose.y + MOUNTED * normal[1]];
        site.walls.iter().any(|wall| {
            let [low, high] = wall.z;
            let heights = [pose.z, z];
            heights.iter().all(|at| low < *at && *at < high)
                && meet(&wall.corners, &[begin, [x, y]])
        })
    });
    all && is_before
}

fn kept_out(site: &Site, about: [&str; 2], tag: &SiteTag) -> Option<Warning> {
    // A tag in millimetres fits on no wall, which another warning reports.
    if tag.tag.size > SIZES[1] {
        return None;
    }
    let wall = on_a_keep_out(site, tag)?;
    Some(warn(
        "tag_in_keep_out",
        about,
        format!("it is on a keep-out of the wall {wall}, where no tag may be mounted"),
        "move the tag along the wall, or correct the keep-out",
    ))
}

fn family(about: [&str; 2], tag: &SiteTag) -> Option<Warning> {
    if Family::named(&tag.family).is_some() {
        return None;
    }
    let advice = question(&tag.family, FAMILIES.into_iter())
        .unwrap_or_else(|| format!("known families are {}", FAMILIES.join(", ")));
    let mut found = warn(
        "family_unknown",
        about,
        format!("`{}` is not a known family of tags; {advice}", tag.family),
        "its white border is taken as the widest one that is known, and the number of its tags as unlimited",
    );
    found.at.push("family".into());
    Some(found)
}
