//! The recording that is replayed, the truth, and the camera.

use super::Arguments;
use super::arguments::Kind;
use super::bag;
use super::inflation::Inflated;
use crate::site_input::Failure;
use posegate_host::files::{FileError, Files, Input, Opened};
use posegate_host::log::corners::MountedCamera;
use posegate_host::log::recording::{
    Bag, BodyFrames, Format, ReaderDiagnostics, Recording, Role, TagLocalizer, Text, Wanted,
    format_of,
};
use posegate_host::log::replay::{Clock, Part};
use posegate_host::log::{Columns, KnownTags, Trajectory, estimates, tum};
use posegate_host::printable::printable;
use posegate_host::site::Site;
use serde_json::{Value, json};
use std::io::{BufRead, BufReader, Read};

/// The largest number of true poses of a topic that are kept.
const MOST_TRUE: usize = 1 << 17;

/// An open recording, with the truth, the time range and the camera that it is replayed with.
pub struct Recorded {
    pub recording: Box<dyn Recording + Send>,
    pub name: String,
    pub length: u64,
    pub track: Option<Trajectory>,
    pub part: Part,
    /// The gate's clock, if the recording's format defines it.
    pub clock: Option<Clock>,
    /// The places of frames on the robot, if the recording is a bag.
    body: BodyFrames,
}

impl Recorded {
    pub fn open(
        arguments: &Arguments,
        files: &Files,
        site: &Site,
        radius_squared: f64,
        inflated: &Inflated,
    ) -> Result<Self, Failure> {
        let Opened {
            reader,
            name,
            length,
        } = open(files, &arguments.log)?;
        let mut input = BufReader::with_capacity(1 << 18, reader);
        let start = input.fill_buf().map_err(|cause| FileError::Unread {
            name: name.clone(),
            cause,
        })?;
        let format = format_of(start);
        if matches!(format, Format::Sqlite | Format::Ros1) {
            return Err(foreign(&name));
        }
        let is_bag = format == Format::Mcap;
        if is_bag == arguments.topic.is_empty() {
            return Err(if is_bag {
                which_topic(input, &name)
            } else {
                Failure::usage(
                    format!("{name} is not an MCAP file: it has no topics"),
                    "leave --topic out",
                )
            });
        }
        let (track, truth_topic) = truth(arguments, files, is_bag)?;
        let looks = if is_bag {
            looks(arguments, site, radius_squared)?
        } else {
            None
        };
        let mut clock = None;
        let body;
        let recording: Box<dyn Recording + Send> = match format {
            Format::Mcap => {
                let numbered = (0u8..=255).zip(&arguments.topic);
                let mut wanted: Vec<Wanted> = numbered
                    .map(|(number, topic)| Wanted {
                        topic: topic.clone(),
                        role: Role::Estimates(number),
                    })
                    .collect();
                wanted.extend(truth_topic.map(|topic| Wanted {
                    topic,
                    role: Role::Truth,
                }));
                body = bag::body(arguments, files, site, &wanted)?;
                let bag = Bag::new(input, &name, &wanted).with_frames(arguments.frames());
                Box::new(bag.with_body(body.clone()))
            }
            Format::Csv => {
                let gaussian = arguments.set == Kind::Gaussian;
                let mut text = Text::csv(input, &name, gaussian).map_err(Failure::input)?;
                inflated.reads(&mut text, &name);
                body = bag::of_site(arguments, site)?;
                // A recorded time of use is the clock, however far it is from the stamps.
                clock = Some(if text.has_use() {
                    Clock::Logged
                } else {
                    Clock::Stamps
                });
                Box::new(text.with_body(body.clone()))
            }
            Format::Tum => {
                body = bag::of_site(arguments, site)?;
                Box::new(Text::tum(input, &name).with_body(body.clone()))
            }
            _ => return Err(foreign(&name)),
        };
        Ok(Self {
            recording,
            name,
            length,
            track,
            part: Part {
                range: [
                    arguments.from.unwrap_or(f64::NEG_INFINITY),
                    arguments.to.unwrap_or(f64::INFINITY),
                ],
                looks,
                outside: 0,
            },
            clock,
            body,
        })
    }

    /// Returns the frames of the recorded poses with a known place on the robot: x, y (m) and yaw (rad).
    pub fn body_frames(&self) -> Value {
        let frames = self.recording.diagnostics().child_frames.iter();
        let known = frames.filter_map(|name| Some((name.clone(), json!(self.body.place(name)?))));
        Value::Object(known.collect())
    }
}

/// Returns the failure for a bag in a format that is not read, with or without --topic.
fn foreign(name: &str) -> Failure {
    Failure::usage(
        format!("{name} is a bag of ROS 1 or SQLite, which cannot be read"),
        "convert it: `ros2 bag convert`, or `rosbags-convert --dst-storage mcap`",
    )
}

/// Opens the recording.
fn open(files: &Files, input: &Input) -> Result<Opened, Failure> {
    if input.as_path().is_dir() {
        return Err(Failure::usage(
            format!("{} is a folder", input.display()),
            "give the .mcap file in it",
        ));
    }
    Ok(files.open(input)?)
}

/// Lists the topics that are not read, one line each.
pub fn topics(diagnostics: &ReaderDiagnostics) -> String {
    let lines = diagnostics.skipped.iter().map(|(topic, skipped)| {
        format!(
            "\n  {} ({}, {} messages)",
            printable(topic),
            printable(&skipped.schema),
            skipped.messages
        )
    });
    lines.collect()
}

/// Returns the failure for a bag without --topic, with the bag's topics.
fn which_topic(input: impl Read + Send, name: &str) -> Failure {
    let mut bag = Bag::new(input, name, &[]);
    while let Ok(Some(_)) = bag.next() {}
    Failure::list(
        &format!(
            "{} has topics:{}",
            printable(name),
            topics(bag.diagnostics())
        ),
        "name the topic with the estimates, such as --topic /amcl_pose",
    )
}

/// Returns the truth from a file, or the topic that has it.
fn truth(
    arguments: &Arguments,
    files: &Files,
    is_bag: bool,
) -> Result<(Option<Trajectory>, Option<String>), Failure> {
    let Some(truth) = &arguments.truth else {
        return Ok((None, None));
    };
    if !(arguments.truth_gap > 0.0) {
        return Err(Failure::usage(
            format!("--truth-gap {} is not a time", arguments.truth_gap),
            "give seconds above 0",
        ));
    }
    let topic = truth.as_path().to_string_lossy().into_owned();
    if !truth.as_path().is_file() {
        if !is_bag {
            return Err(Failure::usage(
                format!("--truth {topic}: there is no such file"),
                "give a TUM file or a CSV; topics are those of MCAP files",
            ));
        }
        if arguments.topic.contains(&topic) {
            return Err(Failure::usage(
                format!("--truth {topic} is a topic of estimates too"),
                "estimates cannot be their own truth: name another topic",
            ));
        }
        let track = Trajectory::new(MOST_TRUE, arguments.truth_gap);
        return Ok((Some(track), Some(topic)));
    }
    let (bytes, name) = files.read(truth)?;
    let track = match format_of(&bytes) {
        Format::Csv => {
            let rows = estimates(bytes.as_slice(), &name, Columns::TimedPoses);
            let rows = rows.map_err(Failure::input)?;
            let mut track = Trajectory::new(rows.len(), arguments.truth_gap);
            for row in rows {
                let pose = row.estimate;
                track.push(
                    row.t_s.unwrap_or(f64::NAN),
                    [pose.x_m, pose.y_m, pose.yaw_rad],
                );
            }
            track.complete();
            track
        }
        Format::Tum => {
            // A comment may have another encoding; numbers have none.
            let text = String::from_utf8_lossy(&bytes);
            let poses = tum::trajectory(&text, &name).map_err(Failure::input)?;
            Trajectory::of(&poses, arguments.truth_gap)
        }
        _ => {
            return Err(Failure::usage(
                format!("--truth {name} is neither TUM nor CSV"),
                "name a topic of the recording, or give a TUM file",
            ));
        }
    };
    Ok((Some(track), None))
}

/// Returns the localizer for detections, with the camera and the tags. `None` if the site has no camera, or has several and
/// --camera is missing.
fn looks(
    arguments: &Arguments,
    site: &Site,
    radius_squared: f64,
) -> Result<Option<TagLocalizer>, Failure> {
    let camera = match &arguments.camera {
        Some(name) => Some(site.cameras.get(name).ok_or_else(|| {
            let names: Vec<&str> = site.cameras.keys().map(String::as_str).collect();
            Failure::usage(
                format!("the site has no camera `{name}`"),
                &format!("it has: {}", names.join(", ")),
            )
        })?),
        None => site
            .cameras
            .values()
            .next()
            .filter(|_| site.cameras.len() == 1),
    };
    if !(arguments.sigma_px > 0.0 && arguments.sigma_px.is_finite()) {
        return Err(Failure::usage(
            format!(
                "--sigma-px {} is not a standard deviation",
                arguments.sigma_px
            ),
            "give pixels above 0, like 0.3",
        ));
    }
    Ok(camera.map(|camera| {
        let eye = MountedCamera {
            camera: camera.camera,
            mount: camera.mount,
            mount_tolerance: camera.mount_tolerance,
        };
        TagLocalizer::new(eye, KnownTags::of(site), arguments.sigma_px, radius_squared)
    }))
}
