//! `posegate import`: converts a map of tags or docks to tables of a site file.

use crate::site_input::{Failure, Outcome, answer, print, print_json, warn};
use clap::builder::PossibleValuesParser;
use posegate::shape::Pose3Deg;
use posegate_files::files::{Files, Input, Output};
use posegate_files::printable::printable;
use posegate_site::{Convention, DockDirection, Format, Import, ImportError, Imported};
use serde_json::json;
use std::ffi::OsString;

/// Converts a map of tags or docks to tables of a site file
///
/// The same settings in an [import.NAME] table of a site file give the same tags and goals.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  posegate import field.json --format wpilib --size 0.1651 --family tag36h11\n  posegate import tags.yaml#dock --format apriltag_ros --convention apriltag_ros --family tag36h11 --pose x=4,y=0,z=0.5,yaw_deg=180 -o tags.toml\n  posegate import map.fmap --format fmap\n  posegate import nav2_params.yaml --format nav2_docks --dock-direction backward\n\nFormats:\n  wpilib        a field layout of WPILib (JSON), with the keys of any year; needs --size and --family\n  fmap          a field map of Limelight (JSON); its origin is the middle of the field\n  apriltag_ros  a tags.yaml with bundles; needs --convention, --family and --pose\n  nav2_docks    a dock database of Nav2, or parameters with the docking server's docks\n  posegate      [tag.NAME] and [goal.NAME] tables"
)]
pub struct Arguments {
    /// The file; `-` for standard input; `tags.yaml#NAME` is one bundle or tag of apriltag_ros
    file: Input,
    /// The file's format
    #[arg(long, value_parser = PossibleValuesParser::new(Format::NAMES))]
    format: String,
    /// The file's tag frame, if the format does not define it (apriltag_ros)
    #[arg(long, value_parser = PossibleValuesParser::new(Convention::NAMES))]
    convention: Option<String>,
    /// The outer edge of the tags' black border in metres, if the format does not state it (wpilib)
    #[arg(long)]
    size: Option<f64>,
    /// The tags' family, if the format does not state it (wpilib, apriltag_ros)
    #[arg(long)]
    family: Option<String>,
    /// Pose of the file's frame in the world, such as x=4,y=0,z=0.5,yaw_deg=180 (also roll_deg, pitch_deg; parts that
    /// are not named are 0). The pose of a bundle is written like that of a tag: x out of its face
    #[arg(long, allow_hyphen_values = true)]
    pose: Option<String>,
    /// How the robot enters the docks, if the file does not say it (nav2_docks): backward turns their headings by 180 degrees
    #[arg(long, value_name = "WAY", value_parser = PossibleValuesParser::new(DockDirection::NAMES))]
    dock_direction: Option<String>,
    /// Read only the docks of this frame (nav2_docks)
    #[arg(long, value_name = "NAME")]
    frame: Option<String>,
    /// Prefix of a tag's number or a dock's name [default: t before numbers]
    #[arg(long)]
    prefix: Option<String>,
    /// The file to write the tables to [default: standard output]
    #[arg(short, long)]
    output: Option<Output>,
    /// Print JSON: the tags and goals
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments, files: &Files) -> Outcome {
    // The parser of the arguments accepts only known names.
    let unknown = || Failure::internal("a format or convention without a meaning".into());
    let format = Format::named(&arguments.format).ok_or_else(unknown)?;
    let convention = match &arguments.convention {
        Some(name) => Some(Convention::named(name).ok_or_else(unknown)?),
        None => None,
    };
    let named = arguments.file.as_path().to_string_lossy();
    let (path, part) = format.split(&named);
    let order = Import {
        convention,
        size: arguments.size,
        family: arguments.family.clone(),
        pose: arguments.pose.as_deref().map(pose).transpose()?,
        prefix: arguments.prefix.clone(),
        part: part.map(str::to_owned),
        dock_direction: arguments
            .dock_direction
            .as_deref()
            .and_then(DockDirection::named),
        frame: arguments.frame.clone(),
        ..Import::of(format)
    };
    let (text, name) = files.read_text(&OsString::from(path).into())?;
    let imported = match order.parse(&text, &name) {
        Ok(imported) => imported,
        Err(ImportError::File(error)) => return Err(Failure::in_file(&error)),
        Err(error) => return Err(setting(&name, &error)),
    };
    let remarks: String = imported
        .remarks
        .iter()
        .map(|remark| format!("# Remark: {}\n", printable(remark)))
        .collect();
    for remark in &imported.remarks {
        warn(&format_args!("remark: {remark}"));
    }
    let tables = format!(
        "# From {name:?}, format {}.\n{remarks}{}",
        format.name(),
        imported.to_toml()
    );
    match &arguments.output {
        Some(path) => files.write(path, tables.as_bytes())?,
        None if !arguments.json => print(&tables.trim_end())?,
        None => {}
    }
    let convention = convention.or(format.convention());
    if arguments.json {
        print_json(&as_json(&imported, format, convention))?;
    } else if let Some(path) = arguments.output.as_ref().filter(|path| !path.is_standard()) {
        print(&format_args!(
            "wrote {}: {} tags, {} goals; paste it into a site file, or name it in an [import.NAME] table of the \
             format posegate",
            path.display(),
            imported.tags.len(),
            imported.goals.len()
        ))?;
    }
    Ok(answer(true))
}

/// Returns the failure for an invalid setting, with help that names the option.
fn setting(name: &str, error: &ImportError) -> Failure {
    let help = match error {
        ImportError::Setting {
            key: "pose",
            like: Some(_),
            ..
        } => "write --pose x=4,y=0,z=0.5,yaw_deg=180".into(),
        ImportError::Setting {
            key,
            like: Some(like),
            ..
        } => format!(
            "write --{} {}",
            key.replace('_', "-"),
            like.replace('"', "")
        ),
        ImportError::Setting {
            key, like: None, ..
        } => format!("leave --{} out", key.replace('_', "-")),
        _ => "see posegate import --help".into(),
    };
    Failure::usage(format!("{name}: {error}"), &help)
}

/// Parses a pose from named numbers, such as `x=4,yaw_deg=180`.
fn pose(text: &str) -> Result<Pose3Deg, Failure> {
    const HELP: &str = "write it like --pose x=4,y=0,z=0.5,roll_deg=0,pitch_deg=0,yaw_deg=180";
    const NAMES: [&str; 6] = ["x", "y", "z", "roll_deg", "pitch_deg", "yaw_deg"];
    let mut numbers = [None; 6];
    for part in text.split(',') {
        let wrong = |why: &str| Failure::usage(format!("--pose: {part:?} {why}"), HELP);
        let (name, number) = part
            .split_once('=')
            .ok_or_else(|| wrong("is not NAME=NUMBER"))?;
        let slot = NAMES.iter().position(|known| *known == name.trim());
        let slot = slot.ok_or_else(|| wrong("is not a part of a pose"))?;
        let number = number
            .trim()
            .parse()
            .ok()
            .filter(|number: &f64| number.is_finite());
        let number = number.ok_or_else(|| wrong("is not a finite number"))?;
        if numbers[slot].replace(number).is_some() {
            return Err(wrong("is there twice"));
        }
    }
    let [x, y, z, roll_deg, pitch_deg, yaw_deg] = numbers.map(|number| number.unwrap_or(0.0));
    Ok(Pose3Deg {
        x,
        y,
        z,
        roll_deg,
        pitch_deg,
        yaw_deg,
    })
}

fn as_json(
    imported: &Imported,
    format: Format,
    convention: Option<Convention>,
) -> serde_json::Value {
    let tags: Vec<_> = imported
        .tags
        .iter()
        .map(|(name, tag)| {
            let pose = &tag.tag.pose;
            json!({
                "name": name, "id": tag.tag.id, "family": tag.family, "size": tag.tag.size,
                "pose": {"x": pose.x, "y": pose.y, "z": pose.z, "roll_deg": pose.roll_deg, "pitch_deg": pose.pitch_deg, "yaw_deg": pose.yaw_deg},
            })
        })
        .collect();
    let goals: Vec<_> = imported
        .goals
        .iter()
        .map(
            |(name, goal)| json!({"name": name, "x": goal.x, "y": goal.y, "yaw_deg": goal.yaw_deg}),
        )
        .collect();
    let tasks: Vec<_> = imported
        .tasks
        .iter()
        .map(|(name, task)| json!({"name": name, "goal": name, "radius": task.radius}))
        .collect();
    json!({
        "format": format.name(), "convention": convention.map(Convention::name), "tags": tags, "goals": goals, "tasks": tasks,
        "remarks": imported.remarks,
    })
}
