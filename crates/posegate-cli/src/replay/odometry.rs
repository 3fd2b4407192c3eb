//! The odometry of a replay: a topic of the recording, or a file.

use super::Arguments;
use crate::recording::{body, failure, open, topics};
use crate::site_input::Failure;
use posegate::set::{RadiusSquared, Trust};
use posegate::track::{OdometryErrors, TrackerSettings};
use posegate_files::files::{Files, Input};
use posegate_files::printable::printable;
use posegate_replay::recording::{
    Format, FrameNames, Item, Kind, ReaderDiagnostics, Recording, Role, Wanted, format_of,
};
use posegate_replay::replay::{Odometry, OdometryPose, odometry_csv};
use posegate_replay::trajectories;
use posegate_site::Site;

/// Reads the odometry; `None` without --odom.
pub fn odometry(
    arguments: &Arguments,
    files: &Files,
    site: &Site,
) -> Result<Option<Odometry>, Failure> {
    let Some(from) = &arguments.odom else {
        return Ok(None);
    };
    if !(arguments.max_speed > 0.0) {
        return Err(Failure::usage(
            "--odom without --max-speed: a robot that never moves needs no odometry".into(),
            "give the robot's largest speed: --max-speed (m/s) and --max-yaw-rate (degrees/s)",
        ));
    }
    let poses = if from.as_path().is_file() {
        of_file(from, files)?
    } else {
        of_topic(arguments, &from.as_path().to_string_lossy(), files, site)?
    };
    let odometry = Odometry::new(poses);
    if odometry.is_empty() {
        return Err(Failure::usage(
            format!("--odom {}: there are no poses", from.display()),
            "name a topic of nav_msgs/msg/Odometry, or a file with poses and times",
        ));
    }
    Ok(Some(odometry))
}

fn of_file(from: &Input, files: &Files) -> Result<Vec<OdometryPose>, Failure> {
    let (bytes, name) = files.read(from)?;
    match format_of(&bytes) {
        Format::Csv => odometry_csv(bytes.as_slice(), &name).map_err(Failure::input),
        Format::Tum | Format::Euroc => {
            let found = trajectories::read(&bytes, &name, None).map_err(Failure::input)?;
            let poses = found.poses.iter();
            Ok(poses.map(|pose| (pose.t_s, pose.level())).collect())
        }
        _ => Err(Failure::usage(
            format!("--odom {name} is not TUM, EuRoC or CSV"),
            "name a topic of the recording, or give a file with poses and times",
        )),
    }
}

/// Reads a topic of the recording, in a separate pass.
fn of_topic(
    arguments: &Arguments,
    topic: &str,
    files: &Files,
    site: &Site,
) -> Result<Vec<OdometryPose>, Failure> {
    if arguments.recorded.topic.is_empty() {
        return Err(Failure::usage(
            format!("--odom {topic}: there is no such file"),
            "give a TUM file or a CSV; topics are those of bags",
        ));
    }
    if arguments.recorded.topic.iter().any(|known| known == topic) {
        return Err(Failure::usage(
            format!("--odom {topic} is a topic of estimates too"),
            "name the topic of the odometry",
        ));
    }
    let wanted = [Wanted {
        topic: topic.to_string(),
        role: Role::Odometry,
    }];
    let reading = arguments.reading(site);
    let body = body(&reading, files, &wanted)?;
    let mut bag = open(&reading, files, &wanted)?.with_body(body);
    let mut poses = Vec::new();
    while let Some(item) = bag.next().map_err(failure)? {
        if let Item::Truth(pose) = item {
            poses.push((pose.t_s, pose.level()));
        }
    }
    let diagnostics = bag.diagnostics();
    let name = arguments.log.display();
    if !diagnostics.read.contains_key(topic) {
        let refused = diagnostics.skipped.get(topic);
        let transforms = diagnostics
            .skipped
            .iter()
            .find(|(_, skipped)| skipped.schema == Kind::Transforms.name() && skipped.messages > 1);
        let help = transforms.map_or_else(
            || "name the topic of the odometry, such as --odom /odom".into(),
            |(topic, _)| {
                format!(
                    "{} has transforms: --odom {} takes the odometry of them",
                    printable(topic),
                    printable(topic)
                )
            },
        );
        let topic = printable(topic);
        return Err(match refused {
            Some(skipped) => Failure::usage(
                format!(
                    "{name}: the topic {topic} is not an odometry: {} ({})",
                    skipped.why.name(),
                    printable(&skipped.schema)
                ),
                &help,
            ),
            None => Failure::list(
                &format!(
                    "{name} has no topic {topic}; it has:{}",
                    topics(diagnostics)
                ),
                &help,
            ),
        });
    }
    if poses.is_empty() && !diagnostics.transforms.is_empty() {
        return Err(no_edge(
            &format!("{}: {} has", name, printable(topic)),
            diagnostics,
            arguments,
        ));
    }
    Ok(poses)
}

/// Returns the failure for transforms that are not those of the robot.
pub fn no_edge(of: &str, diagnostics: &ReaderDiagnostics, arguments: &Arguments) -> Failure {
    let edges: String = diagnostics
        .transforms
        .iter()
        .map(|((parent, child), count)| {
            format!(
                "\n  {} -> {}, {count} times",
                printable(parent),
                printable(child)
            )
        })
        .collect();
    let FrameNames {
        world,
        odometry,
        base,
    } = arguments.recorded.frames();
    let base = base.unwrap_or_else(|| "base_link or base_footprint".into());
    Failure::list(
        &format!("{of} no pose of the robot, only the transforms{edges}"),
        &format!(
            "expected {world} -> {odometry} (estimates) and {odometry} -> {base}: name the frames with --frame, --odom-frame and --base-frame"
        ),
    )
}

/// Returns the settings with which fixes are carried.
pub fn tracker(
    arguments: &Arguments,
    trust: Trust,
    radius_squared: RadiusSquared,
) -> Result<TrackerSettings, Failure> {
    let [m_per_sqrt_m, rad_per_sqrt_rad, rad_per_sqrt_m] = arguments.odom_noise()?;
    Ok(TrackerSettings {
        errors: OdometryErrors {
            m_per_sqrt_m,
            rad_per_sqrt_rad,
            rad_per_sqrt_m,
            slip: arguments.odom_slip,
            turn_slip: arguments.odom_slip,
            ..OdometryErrors::NONE
        },
        bounds: arguments.motion()?,
        trust,
        radius_squared,
        maximum_gap_ms: arguments.odom_gap_ms,
        maximum_fix_age_ms: arguments.fix_age_ms,
    })
}
