//! Poses from TOML.

use super::error::SiteError;
use super::keys;
use super::reader::Node;
use posegate::shape::{Pose3Deg, PoseDeg};

/// Reads a pose in space.
pub(super) fn pose3(node: &Node<'_>) -> Result<Pose3Deg, SiteError> {
    let table = node.table(&[
        &keys::X,
        &keys::Y,
        &keys::Z,
        &keys::ROLL,
        &keys::PITCH,
        &keys::YAW,
    ])?;
    Ok(Pose3Deg {
        x: table.number(&keys::X)?,
        y: table.number(&keys::Y)?,
        z: table.number(&keys::Z)?,
        roll_deg: table.number(&keys::ROLL)?,
        pitch_deg: table.number(&keys::PITCH)?,
        yaw_deg: table.number(&keys::YAW)?,
    })
}

/// Reads a pose on the floor.
pub(super) fn pose2(node: &Node<'_>) -> Result<PoseDeg, SiteError> {
    let table = node.table(&[&keys::X, &keys::Y, &keys::YAW])?;
    Ok(PoseDeg {
        x: table.number(&keys::X)?,
        y: table.number(&keys::Y)?,
        yaw_deg: table.number(&keys::YAW)?,
    })
}

/// Reads a point of the map, metres.
pub(super) fn point(node: &Node<'_>) -> Result<[f64; 2], SiteError> {
    let table = node.table(&[&keys::X, &keys::Y])?;
    Ok([table.number(&keys::X)?, table.number(&keys::Y)?])
}

/// Returns a pose in the map relative to the site's origin.
pub(super) fn less(pose: PoseDeg, [x, y]: [f64; 2]) -> PoseDeg {
    PoseDeg {
        x: pose.x - x,
        y: pose.y - y,
        ..pose
    }
}
