//! Imported tags and goals as tables of a site file.

use std::fmt::Write;

use super::Imported;
use posegate::shape::Pose3Deg;
use posegate_files::printable::{toml_key as key, toml_string};

/// Returns the tables, ordered by name. Numbers have as many digits as needed to be read back to the same
/// bits.
pub(super) fn tables(imported: &Imported) -> String {
    let mut text = String::new();
    let mut line = |arguments: std::fmt::Arguments<'_>| {
        // Writing to a String cannot fail.
        let _ = writeln!(text, "{arguments}");
    };
    for (name, tag) in &imported.tags {
        line(format_args!("\n[tag.{}]", key(name)));
        line(format_args!("id = {}", tag.tag.id));
        line(format_args!("family = {}", toml_string(&tag.family)));
        line(format_args!("size = {:?}", tag.tag.size));
        let Pose3Deg {
            x,
            y,
            z,
            roll_deg,
            pitch_deg,
            yaw_deg,
        } = tag.tag.pose;
        line(format_args!(
            "pose = {{ x = {x:?}, y = {y:?}, z = {z:?}, roll_deg = {roll_deg:?}, pitch_deg = {pitch_deg:?}, yaw_deg = \
             {yaw_deg:?} }}"
        ));
        if !tag.tolerance.is_none() {
            line(format_args!(
                "tolerance = {{ translation = {:?}, yaw_deg = {:?} }}",
                tag.tolerance.translation, tag.tolerance.turn_deg
            ));
        }
    }
    for (name, goal) in &imported.goals {
        line(format_args!("\n[goal.{}]", key(name)));
        line(format_args!("x = {:?}\ny = {:?}", goal.x, goal.y));
        line(format_args!("yaw_deg = {:?}", goal.yaw_deg));
    }
    for (name, task) in &imported.tasks {
        line(format_args!("\n[task.{}]", key(name)));
        line(format_args!(
            "kind = \"work\"\ngoal = {}",
            toml_string(name)
        ));
        line(format_args!(
            "success = {{ shape = \"disc\", radius = {:?}, yaw_deg = [-180.0, 180.0] }}",
            task.radius
        ));
    }
    text.trim_start().to_string()
}
