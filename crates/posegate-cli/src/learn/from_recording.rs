//! Recordings in place of the tables of `learn`.

use crate::recording::{Options, Reading, Recorded, failure, topics};
use crate::site_input::{Failure, site, warn};
use posegate::confidence::radius_squared;
use posegate_files::files::{Files, Input};
use posegate_replay::KnownTags;
use posegate_replay::recording::{format_of, is_folder};
use posegate_replay::tables::{Played, Table};
use posegate_site::Site;
use std::io::Read;

/// The confidence of the ellipsoids with which poses are computed from corners.
const EPSILON: f64 = 0.99;

/// A recording instead of a CSV: a bag with the topics of estimates or detections, and the truth.
#[derive(clap::Args)]
pub struct FromRecording {
    #[command(flatten)]
    options: Options,
    /// A topic with detections of tags (of a bag): AprilTagDetectionArray
    #[arg(long = "detections", id = "detections_topic", value_name = "TOPIC")]
    detections: Option<String>,
}

/// The site and the camera of a recording.
#[derive(clap::Args)]
pub struct Rig {
    /// The site of the recording: its tags, cameras, frames and origin
    #[arg(long)]
    site: Option<Input>,
    /// The camera whose detections are read; required if the site has several
    #[arg(long)]
    camera: Option<String>,
}

impl Rig {
    pub fn borrowed(&self) -> (Option<&Input>, Option<&str>) {
        (self.site.as_ref(), self.camera.as_deref())
    }
}

/// The bytes of a table and its name in messages.
type Named = (Vec<u8>, String);

/// Returns the estimates of a recording, with their true poses, as a table. `None` if the file is not a bag.
pub fn estimates(
    files: &Files,
    log: &Input,
    arguments: &FromRecording,
    rig: (Option<&Input>, Option<&str>),
    epsilon: f64,
) -> Result<Option<Named>, Failure> {
    let Some((played, mut recorded, _)) = open(files, log, arguments, rig, epsilon)? else {
        return Ok(None);
    };
    let table = played.estimates(&mut recorded.part.looks);
    table_of(
        table,
        &recorded,
        "have no true pose, no covariance, or two poses",
    )
    .map(Some)
}

/// Returns the views of tags in a recording, with the errors of detections, as a table. `None` if the file is not a bag.
pub fn views(
    files: &Files,
    log: &Input,
    arguments: &FromRecording,
    rig: (Option<&Input>, Option<&str>),
) -> Result<Option<Named>, Failure> {
    let Some((played, recorded, site)) = open(files, log, arguments, rig, EPSILON)? else {
        return Ok(None);
    };
    let camera = recorded.camera.ok_or_else(|| {
        Failure::usage(
            "detections need a camera: the site has none, or several".into(),
            "name it: --site site.toml --camera front",
        )
    })?;
    let radius = radius_squared(EPSILON).unwrap_or(f64::NAN);
    let sigma = arguments.options.sigma_px;
    let table = played.views(&camera, &KnownTags::of(&site), sigma, radius);
    table_of(table, &recorded, "have no true pose").map(Some)
}

/// Opens and reads a bag. `None` if the file is not a bag.
fn open(
    files: &Files,
    log: &Input,
    arguments: &FromRecording,
    (from, camera): (Option<&Input>, Option<&str>),
    epsilon: f64,
) -> Result<Option<(Played, Recorded, Site)>, Failure> {
    let options = &arguments.options;
    let asked = !options.topic.is_empty() || arguments.detections.is_some();
    if !is_bag(files, log)? {
        if asked && !log.is_standard() {
            return Err(Failure::usage(
                format!("{} is not a bag: it has no topics", log.display()),
                "leave --topic and --detections out",
            ));
        }
        if !asked {
            if options.truth.is_some() {
                warn(&format_args!(
                    "{}: a CSV has its own true poses or errors: --truth is not used",
                    log.display()
                ));
            }
            return Ok(None);
        }
    }
    options.check()?;
    let site = match from {
        Some(from) => site(files, from)?,
        None => Site::parse("", "no site").map_err(|error| Failure::in_file(&error))?,
    };
    if options.truth.is_none() {
        return Err(Failure::usage(
            format!("{}: errors need the true poses", log.display()),
            "name their topic or file: --truth /mocap or --truth truth.txt",
        ));
    }
    let mut topics_of_all = options.topic.clone();
    topics_of_all.extend(arguments.detections.clone());
    let reading = Reading {
        log,
        options,
        topics: topics_of_all,
        camera,
        site: &site,
        is_gaussian: true,
        is_partial: false,
        most_true: usize::MAX,
    };
    let radius = radius_squared(epsilon).ok_or_else(|| {
        Failure::usage(
            format!("epsilon {epsilon} is no share"),
            "write it like --epsilon 0.95",
        )
    })?;
    let mut recorded = Recorded::open(&reading, files, radius, |_, _| ())?;
    let track = recorded.track.take();
    let range = recorded.part.range;
    let played = Played::read(&mut *recorded.recording, track, &options.frame, range);
    let played = played.map_err(failure)?;
    let diagnostics = recorded.recording.diagnostics();
    let name = &recorded.name;
    for topic in &reading.topics {
        if !diagnostics.read.contains_key(topic) {
            return Err(Failure::list(
                &format!(
                    "{name}: no messages are read of {topic}; it has:{}",
                    topics(diagnostics)
                ),
                "name an existing topic with estimates or detections",
            ));
        }
    }
    if played.is_empty() {
        return Err(Failure::usage(
            format!("{name}: no estimate and no image"),
            "times of --from and --to are those of the stamps, in seconds",
        ));
    }
    if let Some(damage) = &diagnostics.damage {
        warn(&format_args!(
            "{name}: broken {damage}; the intact part was read"
        ));
    }
    Ok(Some((played, recorded, site)))
}

/// Returns `true` if an input is a bag: a folder, or a file that begins like one.
fn is_bag(files: &Files, log: &Input) -> Result<bool, Failure> {
    if is_folder(log.as_path()) {
        return Ok(true);
    }
    if log.is_standard() || !log.as_path().is_file() {
        return Ok(false);
    }
    let mut start = Vec::new();
    let opened = files.open(log)?;
    // The command reads the file again, and reports a fault.
    let _ = opened.reader.take(4096).read_to_end(&mut start);
    Ok(format_of(&start).is_bag())
}

/// Returns the table's bytes. Refuses a table without rows, and warns of what is left out.
fn table_of(table: Table, recorded: &Recorded, words: &str) -> Result<Named, Failure> {
    let name = recorded.name.clone();
    if table.rows == 0 {
        return Err(Failure::usage(
            format!("{name}: no row: all {} {words}", table.left_out),
            "check that the truth has the clock and the frame (--frame) of the estimates, and --truth-gap",
        ));
    }
    if table.left_out > 0 {
        warn(&format_args!(
            "{name}: {} of {} {words}, and are left out",
            table.left_out,
            table.rows + table.left_out
        ));
    }
    Ok((table.text.into_bytes(), name))
}
