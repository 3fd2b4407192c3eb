//! Encodes rules as bytes.

use posegate::pose::Pose;
use posegate::sequencer::{HEAD, Kind, MAGIC, NAME, NONE, RULE, Rule, VERSION};
use posegate::table::{CRC_LENGTH, checksum};
use posegate::task::Cylinder;

/// A rule with its task's name.
#[derive(Clone, Debug, PartialEq)]
pub struct RuleOrder {
    /// The task's name; `None` for a drive.
    pub task: Option<String>,
    /// The rule. The number of its task is not yet set.
    pub rule: Rule,
}

/// Returns the bytes of a plan's rules. `None` if there are too many rules or no rule, or if a name is too long or
/// empty.
#[must_use]
pub fn write_rules(orders: &[RuleOrder], site_digest: [u8; 32]) -> Option<Vec<u8>> {
    let mut names: Vec<&str> = Vec::new();
    for order in orders {
        if let Some(task) = &order.task
            && !names.contains(&task.as_str())
        {
            names.push(task);
        }
    }
    let count = u16::try_from(orders.len())
        .ok()
        .filter(|n| *n > 0 && *n != NONE)?;
    let length = HEAD
        .checked_add(names.len().checked_mul(NAME)?)?
        .checked_add(orders.len().checked_mul(RULE)?)?
        .checked_add(CRC_LENGTH)?;
    let mut bytes = Vec::with_capacity(length);
    bytes.extend(MAGIC);
    bytes.extend(VERSION.to_le_bytes());
    bytes.extend(count.to_le_bytes());
    bytes.extend(u16::try_from(names.len()).ok()?.to_le_bytes());
    bytes.extend([0; 2]);
    bytes.extend(u32::try_from(length).ok()?.to_le_bytes());
    bytes.extend(site_digest);
    for name in &names {
        if name.is_empty() || name.len() > NAME {
            return None;
        }
        bytes.extend(name.as_bytes());
        bytes.extend(core::iter::repeat_n(0, NAME.checked_sub(name.len())?));
    }
    for order in orders {
        let named = |task: &String| names.iter().position(|name| name == task);
        let task = match &order.task {
            Some(task) => u16::try_from(named(task)?).ok()?,
            None => 0,
        };
        let rule = &order.rule;
        bytes.push(match rule.kind {
            Kind::Work => 0,
            Kind::Look => 1,
            Kind::Drive => 2,
        });
        bytes.push(rule.attempts);
        bytes.extend(task.to_le_bytes());
        bytes.extend(rule.tag.to_le_bytes());
        bytes.extend(rule.then.to_le_bytes());
        bytes.extend(rule.otherwise.unwrap_or(NONE).to_le_bytes());
        pose(&mut bytes, rule.place);
        cylinder(&mut bytes, rule.spread);
        cylinder(&mut bytes, rule.set);
        pose(&mut bytes, rule.to);
        bytes.extend([0; 4]);
    }
    let crc = checksum(&bytes);
    bytes.extend(crc.to_le_bytes());
    Some(bytes)
}

fn pose(bytes: &mut Vec<u8>, pose: Pose) {
    bytes.extend(pose.x_um.to_le_bytes());
    bytes.extend(pose.y_um.to_le_bytes());
    bytes.extend(pose.yaw.0.to_le_bytes());
}

fn cylinder(bytes: &mut Vec<u8>, cylinder: Cylinder) {
    bytes.extend(cylinder.translation_um().to_le_bytes());
    bytes.extend(cylinder.yaw_q24().to_le_bytes());
}
