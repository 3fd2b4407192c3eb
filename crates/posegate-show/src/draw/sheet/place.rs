//! The place of a tag on a wall as an installer measures it: along the wall from a corner, and up from the floor.

use crate::draw::ingredients::axes;
use posegate::shape::{Pose3Deg, Wall};

/// A tag's middle may be off its wall's face by this, metres: site files have rounded numbers.
const OFF_WALL: f64 = 0.05;
/// The least cosine between the tag's normal and that of its wall's face: 10 degrees.
const ALONG_NORMAL: f64 = 0.984_8;

/// A tag on a face of a wall, seen by a person who faces the wall.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct OnWall {
    /// The wall's name.
    pub wall: String,
    /// The left and the right end of the face, `[x, y]` in the world, metres.
    pub ends: [[f64; 2]; 2],
    /// Length of the face, metres.
    pub length: f64,
    /// Lower and upper end of the wall, metres above the floor.
    pub z: [f64; 2],
    /// From the left end to the tag's middle, metres.
    pub along: f64,
    /// The turn of the tag about the vertical against the face: degrees, counter-clockwise from above.
    pub turn_deg: f64,
    /// Areas where no tag may be mounted: `[from, to]` from the left end, and `[low, high]`, metres.
    pub keep_outs: Vec<[[f64; 2]; 2]>,
}

impl OnWall {
    /// Returns a tag's place on the nearest wall face that the tag is parallel to and touches; `None` if the tag is
    /// not on a wall.
    #[must_use]
    pub fn of(pose: &Pose3Deg, walls: &[Wall]) -> Option<Self> {
        let found = walls.iter().flat_map(|wall| faces(pose, wall));
        found
            .min_by(|(a, _), (b, _)| a.total_cmp(b))
            .map(|(_, on)| on)
    }
}

/// Returns the wall faces on which a tag is flat, with its distance from each.
fn faces(pose: &Pose3Deg, wall: &Wall) -> Vec<(f64, OnWall)> {
    let count = wall.corners.len();
    let edges = if count == 2 { 1 } else { count };
    let [normal, right, _] = axes(pose);
    let outward = |from: [f64; 2], to: [f64; 2]| {
        let length = libm::hypot(to[0] - from[0], to[1] - from[1]);
        // The outside is to the right of an edge of a counter-clockwise outline.
        [(to[1] - from[1]) / length, (from[0] - to[0]) / length]
    };
    let mut walked = 0.0;
    let mut found = Vec::new();
    for index in 0..edges {
        let (from, to) = (wall.corners[index], wall.corners[(index + 1) % count]);
        let length = libm::hypot(to[0] - from[0], to[1] - from[1]);
        let first = walked;
        walked += length;
        if !(length > 0.0) {
            continue;
        }
        let mut out = outward(from, to);
        let facing = normal[0] * out[0] + normal[1] * out[1];
        // A wall of two corners has two faces.
        if count == 2 && facing < 0.0 {
            out = out.map(|v| -v);
        }
        let facing = if count == 2 { facing.abs() } else { facing };
        let along = [(to[0] - from[0]) / length, (to[1] - from[1]) / length];
        let off = [pose.x - from[0], pose.y - from[1]];
        let at = off[0] * along[0] + off[1] * along[1];
        let gap = (off[0] * out[0] + off[1] * out[1]).abs();
        if facing < ALONG_NORMAL || gap > OFF_WALL || at < -OFF_WALL || at > length + OFF_WALL {
            continue;
        }
        // A viewer's right is the tag's y.
        let forward = along[0] * right[0] + along[1] * right[1] > 0.0;
        let from_left = |s: f64| if forward { s } else { length - s };
        let keep_outs = wall
            .keep_outs
            .iter()
            .filter_map(|[[start, end], z]| {
                let [start, end] = [start - first, end - first].map(|s| s.clamp(0.0, length));
                let [a, b] = [start, end].map(from_left);
                (start < end).then_some([[a.min(b), a.max(b)], *z])
            })
            .collect();
        let turn = libm::atan2(
            out[0] * normal[1] - out[1] * normal[0],
            out[0] * normal[0] + out[1] * normal[1],
        );
        found.push((
            gap,
            OnWall {
                wall: wall.name.clone(),
                ends: if forward { [from, to] } else { [to, from] },
                length,
                z: wall.z,
                along: from_left(at),
                turn_deg: turn.to_degrees(),
                keep_outs,
            },
        ));
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pose(x: f64, y: f64, yaw_deg: f64) -> Pose3Deg {
        Pose3Deg {
            x,
            y,
            z: 1.0,
            roll_deg: 0.0,
            pitch_deg: 0.0,
            yaw_deg,
        }
    }

    fn wall(corners: &[[f64; 2]], keep_outs: Vec<[[f64; 2]; 2]>) -> Wall {
        Wall {
            name: "north".into(),
            corners: corners.to_vec(),
            z: [0.0, 2.5],
            keep_outs,
        }
    }

    #[test]
    fn left_end_is_left_for_a_viewer_of_the_wall() {
        // A viewer south of the wall looks north: west is on the left.
        let north = wall(&[[-2.0, 4.0], [12.0, 4.0]], vec![[[1.0, 2.0], [0.0, 1.0]]]);
        let south_face = OnWall::of(&pose(1.0, 4.0, -90.0), std::slice::from_ref(&north)).unwrap();
        assert_eq!(south_face.ends, [[-2.0, 4.0], [12.0, 4.0]]);
        assert!((south_face.along - 3.0).abs() < 1e-12 && south_face.turn_deg.abs() < 1e-9);
        assert_eq!(south_face.keep_outs, [[[1.0, 2.0], [0.0, 1.0]]]);
        // On the other face, east is on the left.
        let north_face = OnWall::of(&pose(1.0, 4.0, 92.0), &[north]).unwrap();
        assert_eq!(north_face.ends, [[12.0, 4.0], [-2.0, 4.0]]);
        assert!((north_face.along - 11.0).abs() < 1e-12);
        assert!((north_face.turn_deg - 2.0).abs() < 1e-9);
        assert_eq!(north_face.keep_outs, [[[12.0, 13.0], [0.0, 1.0]]]);
    }

    #[test]
    fn blocks_have_only_outer_faces() {
        let block = wall(
            &[[0.0, 0.0], [4.0, 0.0], [4.0, 1.0], [0.0, 1.0]],
            vec![[[4.25, 4.5], [0.0, 2.0]]],
        );
        let east = OnWall::of(&pose(4.0, 0.75, 0.0), std::slice::from_ref(&block)).unwrap();
        assert_eq!((east.length, east.along), (1.0, 0.75));
        assert_eq!(east.keep_outs, [[[0.25, 0.5], [0.0, 2.0]]]);
        assert_eq!(
            OnWall::of(&pose(4.0, 0.75, 180.0), std::slice::from_ref(&block)),
            None
        );
        assert_eq!(OnWall::of(&pose(4.2, 0.75, 0.0), &[block]), None);
    }
}
