//! An open recording, the truth, and the camera.

use super::Reading;
use super::bag;
use crate::site_input::Failure;
use posegate_files::files::{FileError, Files, Opened};
use posegate_files::printable::printable;
use posegate_replay::corners::MountedCamera;
use posegate_replay::recording::{
    BAD_FOLDER, Bag, BagFile, BodyFrames, Format, ReaderDiagnostics, Recording, Role, TagLocalizer,
    Text, Wanted, files_of, format_of, is_folder,
};
use posegate_replay::replay::{Clock, Part};
use posegate_replay::tum::Stamped;
use posegate_replay::{Columns, KnownTags, Trajectory, estimates, trajectories};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, Read};

type Reader = BufReader<Box<dyn Read + Send>>;
/// A CSV that is read as a stream.
pub type CsvText = Text<Reader>;

/// An open recording, with the truth, the time range and the camera that it is replayed with.
pub struct Recorded {
    pub recording: Box<dyn Recording + Send>,
    pub name: String,
    pub length: u64,
    pub track: Option<Trajectory>,
    pub part: Part,
    /// The camera of a bag's detections.
    pub camera: Option<MountedCamera>,
    /// The gate's clock, if the recording's format defines it.
    pub clock: Option<Clock>,
    /// The places of frames on the robot.
    body: BodyFrames,
    /// Poses of the truth's file that are left out because the one before has the same time.
    pub duplicates: u64,
}

impl Recorded {
    pub fn open(
        reading: &Reading<'_>,
        files: &Files,
        radius_squared: f64,
        since_fix: impl FnOnce(&mut CsvText, &str),
    ) -> Result<Self, Failure> {
        let Source {
            mut reader,
            format,
            name,
            length,
        } = Source::open(reading, files)?;
        let is_bag = format.is_bag();
        if is_bag == reading.topics.is_empty() {
            return Err(if is_bag {
                which_topic(Bag::of_files(parts(reader, reading, files)?, &[]), &name)?
            } else {
                Failure::usage(
                    format!("{name} is not a bag: it has no topics"),
                    "leave --topic out",
                )
            });
        }
        let Truth {
            track,
            topic: truth_topic,
            duplicates,
        } = truth(reading, files, is_bag)?;
        let camera = if is_bag { camera(reading)? } else { None };
        let looks = camera.map(|camera| {
            let (tags, sigma_px) = (KnownTags::of(reading.site), reading.options.sigma_px);
            TagLocalizer::new(camera, tags, sigma_px, radius_squared)
        });
        let mut clock = None;
        let body;
        let recording: Box<dyn Recording + Send> = match format {
            format if format.is_bag() => {
                let numbered = (0u8..=255).zip(&reading.topics);
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
                body = bag::body(reading, files, &wanted)?;
                let bag = Bag::of_files(parts(reader, reading, files)?, &wanted);
                let bag = bag.with_frames(reading.options.frames());
                Box::new(bag.with_body(body.clone()))
            }
            Format::Csv => {
                let mut text =
                    Text::csv(reader, &name, reading.is_gaussian).map_err(Failure::input)?;
                since_fix(&mut text, &name);
                body = bag::of_site(reading)?;
                // A recorded time of use is the clock, however far it is from the stamps.
                clock = Some(if text.has_use() {
                    Clock::Logged
                } else {
                    Clock::Stamps
                });
                Box::new(text.with_body(body.clone()))
            }
            Format::Tum => {
                body = bag::of_site(reading)?;
                Box::new(Text::tum(reader, &name).with_body(body.clone()))
            }
            Format::Euroc | Format::Kitti => {
                body = bag::of_site(reading)?;
                let mut text = Vec::new();
                let times = times(reading, files)?;
                let times = times
                    .as_ref()
                    .map(|(text, name)| (text.as_slice(), name.as_str()));
                reader
                    .read_to_end(&mut text)
                    .map_err(|cause| FileError::Unread {
                        name: name.clone(),
                        cause,
                    })?;
                let text = Text::<std::io::Empty>::trajectory(&text, &name, times);
                Box::new(text.map_err(Failure::input)?.with_body(body.clone()))
            }
            _ => return Err(Failure::internal("a format without a reader".into())),
        };
        Ok(Self {
            recording,
            name,
            length,
            track,
            part: Part {
                range: [
                    reading.options.from.unwrap_or(f64::NEG_INFINITY),
                    reading.options.to.unwrap_or(f64::INFINITY),
                ],
                looks,
                outside: 0,
            },
            camera,
            clock,
            body,
            duplicates,
        })
    }

    /// Returns the frames of the recorded poses with a known place on the robot: x, y (m) and yaw (rad).
    pub fn body_frames(&self) -> Value {
        let frames = self.recording.diagnostics().child_frames.iter();
        let known = frames.filter_map(|name| Some((name.clone(), json!(self.body.place(name)?))));
        Value::Object(known.collect())
    }
}

/// The recording, open or to be opened.
struct Source {
    /// The bytes of a stream or a text; those of a bag at a path are read again from the path.
    reader: Reader,
    format: Format,
    name: String,
    /// Bytes; 0 if it is not known.
    length: u64,
}

impl Source {
    fn open(reading: &Reading<'_>, files: &Files) -> Result<Self, Failure> {
        let log = reading.log;
        if is_folder(log.as_path()) {
            let paths =
                files_of(log.as_path()).map_err(|fault| Failure::usage(fault, BAD_FOLDER))?;
            let lengths = paths.iter().filter_map(|path| path.metadata().ok());
            return Ok(Self {
                reader: BufReader::new(Box::new(std::io::empty())),
                format: Format::Mcap,
                name: log.display().to_string(),
                length: lengths.map(|data| data.len()).sum(),
            });
        }
        let Opened {
            reader,
            name,
            length,
        } = files.open(log)?;
        let mut reader = BufReader::with_capacity(1 << 18, reader);
        let start = reader.fill_buf().map_err(|cause| FileError::Unread {
            name: name.clone(),
            cause,
        })?;
        refuse_other(start, &name)?;
        Ok(Self {
            format: format_of(start),
            reader,
            name,
            length,
        })
    }
}

/// Refuses files that are no recordings but are often given as one.
fn refuse_other(start: &[u8], name: &str) -> Result<(), Failure> {
    let (what, help) = if start.starts_with(b"\x1f\x8b") || start.starts_with(b"PK") {
        (
            "is packed by gzip or zip",
            "unpack it, and give what was in it",
        )
    } else if start.trim_ascii_start().starts_with(b"header:") {
        (
            "is the text of `ros2 topic echo`",
            "record the topic: `ros2 bag record TOPIC`",
        )
    } else {
        return Ok(());
    };
    Err(Failure::usage(format!("{} {what}", printable(name)), help))
}

/// Returns the files of a bag.
fn parts(
    reader: Reader,
    reading: &Reading<'_>,
    files: &Files,
) -> Result<Vec<BagFile<'static>>, Failure> {
    let log = reading.log;
    // A pipe gives its bytes once.
    if log.as_path().is_file() || log.as_path().is_dir() {
        return bag::parts(files, log);
    }
    let name = log.display().to_string();
    Ok(vec![BagFile::Stream(Box::new(reader), name)])
}

/// Lists the topics of a bag, one line each.
pub fn topics(diagnostics: &ReaderDiagnostics) -> String {
    let read = diagnostics.read.iter();
    let read = read.map(|(topic, count)| (topic, format!("{count} messages")));
    let skipped = diagnostics.skipped.iter().map(|(topic, skipped)| {
        let words = format!(
            "{}, {} messages",
            printable(&skipped.schema),
            skipped.messages
        );
        (topic, words)
    });
    let all: BTreeMap<&String, String> = read.chain(skipped).collect();
    let lines = all
        .into_iter()
        .map(|(topic, words)| format!("\n  {} ({words})", printable(topic)));
    lines.collect()
}

/// Returns the failure for a bag without --topic, with the bag's topics.
fn which_topic(mut bag: Bag<'_>, name: &str) -> Result<Failure, Failure> {
    while bag.next().map_err(bag::failure)?.is_some() {}
    Ok(Failure::list(
        &format!(
            "{} has topics:{}",
            printable(name),
            topics(bag.diagnostics())
        ),
        "name the topic with the estimates, such as --topic /amcl_pose",
    ))
}

/// The true poses.
#[derive(Default)]
struct Truth {
    track: Option<Trajectory>,
    /// The topic that has them.
    topic: Option<String>,
    /// Poses of a file that are left out because the one before has the same time.
    duplicates: u64,
}

/// Returns the truth from a file, or the topic that has it.
fn truth(reading: &Reading<'_>, files: &Files, is_bag: bool) -> Result<Truth, Failure> {
    let Some(truth) = &reading.options.truth else {
        return Ok(Truth::default());
    };
    if !(reading.options.truth_gap > 0.0) {
        return Err(Failure::usage(
            format!("--truth-gap {} is not a time", reading.options.truth_gap),
            "give seconds above 0",
        ));
    }
    let topic = truth.as_path().to_string_lossy().into_owned();
    if !truth.as_path().is_file() {
        if !is_bag {
            return Err(Failure::usage(
                format!("--truth {topic}: there is no such file"),
                "give a TUM file or a CSV; topics are those of bags",
            ));
        }
        if reading.topics.contains(&topic) {
            return Err(Failure::usage(
                format!("--truth {topic} is a topic of estimates too"),
                "estimates cannot be their own truth: name another topic",
            ));
        }
        let track = Trajectory::new(reading.most_true, reading.options.truth_gap);
        return Ok(Truth {
            track: Some(track),
            topic: Some(topic),
            duplicates: 0,
        });
    }
    let (bytes, name) = files.read(truth)?;
    let mut duplicates = 0;
    let [east, north] = reading.site.map_origin;
    let track = match format_of(&bytes) {
        Format::Csv => {
            let rows = estimates(bytes.as_slice(), &name, Columns::TimedPoses);
            let rows = rows.map_err(Failure::input)?;
            let mut track = Trajectory::new(rows.len(), reading.options.truth_gap);
            for row in rows {
                let pose = row.estimate;
                track.push(
                    row.t_s.unwrap_or(f64::NAN),
                    [pose.x_m - east, pose.y_m - north, pose.yaw_rad],
                );
            }
            track.complete();
            track
        }
        Format::Tum | Format::Euroc | Format::Kitti => {
            let times = times(reading, files)?;
            let times = times
                .as_ref()
                .map(|(text, name)| (text.as_slice(), name.as_str()));
            let mut found = trajectories::read(&bytes, &name, times).map_err(Failure::input)?;
            duplicates = found.duplicates;
            refuse_tilted(&found.poses, &name)?;
            for pose in &mut found.poses {
                pose.position.x -= east;
                pose.position.y -= north;
            }
            Trajectory::of(&found.poses, reading.options.truth_gap)
        }
        _ => {
            return Err(Failure::usage(
                format!("--truth {name} is neither a trajectory nor a CSV"),
                "name a topic of the recording, or give a file of TUM, EuRoC or KITTI",
            ));
        }
    };
    Ok(Truth {
        track: Some(track),
        duplicates,
        ..Truth::default()
    })
}

/// Refuses a truth most of whose poses lie on their side: its headings would be those of another axis.
fn refuse_tilted(poses: &[Stamped], name: &str) -> Result<(), Failure> {
    let is_tilted = |pose: &&Stamped| pose.upright() < core::f64::consts::FRAC_1_SQRT_2;
    let tilted = poses.iter().filter(is_tilted).count();
    if 2 * tilted <= poses.len() {
        return Ok(());
    }
    Err(Failure::usage(
        format!(
            "--truth {}: {tilted} of {} poses are tilted by more than 45 degrees",
            printable(name),
            poses.len()
        ),
        "check the order of the quaternion (TUM: qx qy qz qw; EuRoC: qw, qx, qy, qz); the truth is the pose of the robot's base, with z up",
    ))
}

/// Reads the times of a KITTI trajectory. Returns the file and its name.
fn times(reading: &Reading<'_>, files: &Files) -> Result<Option<(Vec<u8>, String)>, Failure> {
    let times = reading.options.times.as_ref();
    Ok(times.map(|times| files.read(times)).transpose()?)
}

/// Returns the camera of detections. `None` if the site has no camera, or has several and --camera is missing.
fn camera(reading: &Reading<'_>) -> Result<Option<MountedCamera>, Failure> {
    let camera = match reading.camera {
        Some(name) => Some(reading.site.cameras.get(name).ok_or_else(|| {
            let names: Vec<&str> = reading.site.cameras.keys().map(String::as_str).collect();
            Failure::usage(
                format!("the site has no camera `{name}`"),
                &format!("it has: {}", names.join(", ")),
            )
        })?),
        None => reading
            .site
            .cameras
            .values()
            .next()
            .filter(|_| reading.site.cameras.len() == 1),
    };
    if !(reading.options.sigma_px > 0.0 && reading.options.sigma_px.is_finite()) {
        return Err(Failure::usage(
            format!(
                "--sigma-px {} is not a standard deviation",
                reading.options.sigma_px
            ),
            "give pixels above 0, like 0.3",
        ));
    }
    Ok(camera.map(|camera| MountedCamera {
        camera: camera.camera,
        mount: camera.mount,
        mount_tolerance: camera.mount_tolerance,
    }))
}
