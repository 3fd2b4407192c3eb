//! `posegate replay`: a recording held against the gate, and against the rules that are in use without one.

use crate::door::{Draft, Failure, Outcome, answer, print, progress, read, site, task, write};
use posegate::bake::Order;
use posegate::draw::replay_picture;
use posegate::gate::{InvalidParameter, Restart, Settings, Source};
use posegate::log::corners::Eye;
use posegate::log::recording::{
    Bag, Format, Looks, Recording, RecordingError, Role, Text, Told, Wanted, Why, format_of,
};
use posegate::log::replay::{
    Channels, Clock, Part, PlayError, Replay, Row, Setup, Thresholds, play,
};
use posegate::log::{Columns, Track, estimates, tum};
use posegate::set::{CrossTerms, Share};
use posegate::site::{Site, Task};
use posegate::table::Table;
use serde_json::{Map, Value, json};
use std::fs::File;
use std::io::{BufRead, BufReader, BufWriter, Read, Write};
use std::path::{Path, PathBuf};

/// Holds a recording against the gate: what it would have permitted, and whether that was right
///
/// The recording is CSV (the columns of `posegate gate`, with t_s; true_x_m, true_y_m, true_yaw_rad where the truth is
/// known), TUM, or MCAP with ROS 2 topics. It is read as a stream; what is wrong with it is counted and told.
#[derive(clap::Args)]
#[command(
    after_help = "Example:\n  posegate replay site.toml drive.mcap --task dock --topic /amcl_pose --cross-terms yaw-unknown --json\n  posegate replay site.toml estimates.csv --task dock --inflation 4 -o replay.svg --mcap verdicts.mcap\n\nRules that are shown beside the gate, and where their limits come from:\n  distance  position within --distance of the goal (Nav2: docking_threshold, 0.05 m)\n  sigma     deviations of x, y, yaw below --sigma and --sigma-yaw-deg (Nav2's docking threshold and undock_angular_tolerance)\n  ellipse   3-sigma error ellipse: long radius below --ellipse, to the side below --ellipse-lateral (Autoware's localization_error_monitor, 1.5 m and 0.3 m)\n  ate       everything where the recording's RMSE is below --ate, else nothing\n\nExit code 1: the gate permitted an estimate whose true pose was outside of the success set."
)]
pub struct Arguments {
    /// The site file
    site: PathBuf,
    /// The recording; `-` for standard input
    log: PathBuf,
    /// The task
    #[arg(long)]
    task: String,
    /// A topic with estimates (MCAP): PoseWithCovarianceStamped, Odometry, PoseStamped, or AprilTagDetectionArray; may be given several times
    #[arg(long)]
    topic: Vec<String>,
    /// The truth: a file in the TUM format or a CSV (t_s, x_m, y_m, yaw_rad), or a topic of the bag
    #[arg(long)]
    truth: Option<String>,
    /// Longest time between two true poses that is interpolated, seconds
    #[arg(long, default_value_t = 0.2)]
    truth_gap: f64,
    /// A table of the task; without it one is made of the site, and proven
    #[arg(long, conflicts_with = "epsilon")]
    table: Option<PathBuf>,
    /// Confidence of the Gaussian pose-sets [default: the site's]
    #[arg(long)]
    epsilon: Option<f64>,
    /// The covariances are multiplied by this, at least 1
    #[arg(long, default_value_t = 1.0, allow_negative_numbers = true)]
    inflation: f64,
    /// Which terms of their covariance the sources fill (AMCL: yaw-unknown)
    #[arg(long, value_enum, default_value = "filled")]
    cross_terms: Terms,
    /// What is about each estimate: its covariance, or a bound that is the same for all
    #[arg(long, value_enum, default_value = "gaussian")]
    set: Kind,
    /// Bounded sets: largest error of the position, metres
    #[arg(long, required_if_eq("set", "bounded"), allow_negative_numbers = true)]
    translation: Option<f64>,
    /// Bounded sets: largest error of the heading, degrees
    #[arg(long, required_if_eq("set", "bounded"), allow_negative_numbers = true)]
    yaw_deg: Option<f64>,
    /// The world frame's name; estimates in another are denied
    #[arg(long, default_value = "map")]
    frame: String,
    /// The gate's clock: recorded times (now_s, log times), stamps alone, or recorded times where both are of one clock
    #[arg(long, value_enum, default_value = "auto")]
    clock: ClockName,
    /// Only estimates stamped at this time or later, seconds
    #[arg(long, allow_negative_numbers = true)]
    from: Option<f64>,
    /// Only estimates stamped at this time or before, seconds
    #[arg(long, allow_negative_numbers = true)]
    to: Option<f64>,
    /// Oldest estimate that is used, milliseconds
    #[arg(long, default_value_t = 200)]
    max_age_ms: u32,
    /// How long the gate stays open without a further permit, milliseconds
    #[arg(long, default_value_t = 100)]
    permit_hold_ms: u32,
    /// How long the gate stays closed after a denial, milliseconds
    #[arg(long, default_value_t = 500)]
    inhibit_hold_ms: u32,
    /// So many permits in a row open the gate
    #[arg(long, default_value_t = 3)]
    permits_in_a_row: u16,
    /// The camera whose detections are read; needed where the site has several
    #[arg(long)]
    camera: Option<String>,
    /// Deviation of a corner's coordinates in the image, pixels
    #[arg(long, default_value_t = 0.3, allow_negative_numbers = true)]
    sigma_px: f64,
    /// Limit of the rule `distance`, metres
    #[arg(long, default_value_t = 0.05)]
    distance: f64,
    /// Limit of the rule `sigma`, metres
    #[arg(long, default_value_t = 0.05)]
    sigma: f64,
    /// Limit of the rule `sigma`, degrees [default: 0.05 rad]
    #[arg(long)]
    sigma_yaw_deg: Option<f64>,
    /// Limit of the rule `ellipse`, long radius, metres
    #[arg(long, default_value_t = 1.5)]
    ellipse: f64,
    /// Limit of the rule `ellipse`, to the side, metres
    #[arg(long, default_value_t = 0.3)]
    ellipse_lateral: f64,
    /// How many sigmas the ellipse has
    #[arg(long, default_value_t = 3.0)]
    ellipse_scale: f64,
    /// Limit of the rule `ate`, metres
    #[arg(long, default_value_t = 0.05)]
    ate: f64,
    /// Decide alone: no margins, no worst poses, no Stanford diagram
    #[arg(long)]
    fast: bool,
    /// Print JSON
    #[arg(long)]
    json: bool,
    /// Write a JSON line an estimate; `-` for standard output
    #[arg(long)]
    rows: Option<PathBuf>,
    /// Write a picture (SVG): verdicts over time, and the Stanford diagram where the truth is known
    #[arg(short, long)]
    output: Option<PathBuf>,
    /// Write verdicts as JSON channels (MCAP)
    #[arg(long)]
    mcap: Option<PathBuf>,
}

#[derive(Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Kind {
    Gaussian,
    Bounded,
}

#[derive(Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Terms {
    Filled,
    YawUnknown,
    AllUnknown,
}

#[derive(Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum ClockName {
    Auto,
    Logged,
    Stamps,
}

/// So many true poses of a topic are kept.
const MOST_TRUE: usize = 1 << 17;

pub fn run(arguments: &Arguments) -> Outcome {
    let stdout = Path::new("-");
    let on_stdout = [&arguments.rows, &arguments.output]
        .into_iter()
        .filter(|path| path.as_deref() == Some(stdout));
    if on_stdout.count() + usize::from(arguments.json) > 1
        || arguments.mcap.as_deref() == Some(stdout)
    {
        return Err(Failure::usage(
            "standard output cannot hold more than one result, and no MCAP".into(),
            "write the others to files",
        ));
    }
    let site = site(&arguments.site)?;
    let chosen = task(&site, &arguments.task)?;
    let table = table(arguments, &site, chosen)?;
    let settings = Parts::of(arguments)?;
    let settings = Settings {
        task: &arguments.task,
        site_digest: site.digest,
        sources: &settings.sources,
        maximum_age_ms: arguments.max_age_ms,
        permit_hold_ms: arguments.permit_hold_ms,
        inhibit_hold_ms: arguments.inhibit_hold_ms,
        permits_in_a_row: arguments.permits_in_a_row,
        restart: Restart::Automatic,
        look_at: None,
    };
    let setup = Setup {
        table: &table,
        settings: &settings,
        success: &chosen.success,
        bounded: match arguments.set {
            Kind::Gaussian => None,
            Kind::Bounded => Some([
                arguments.translation.unwrap_or(f64::NAN),
                arguments.yaw_deg.unwrap_or(f64::NAN).to_radians(),
            ]),
        },
        world: &arguments.frame,
        clock: match arguments.clock {
            ClockName::Auto => None,
            ClockName::Logged => Some(Clock::Logged),
            ClockName::Stamps => Some(Clock::Stamps),
        },
        thresholds: thresholds(arguments),
        examined: !arguments.fast,
    };
    let mut input = Input::open(arguments, &site)?;
    let mut replay = Replay::new(&setup, input.track.take()).map_err(parameter)?;
    let mut files = Files::open(arguments)?;
    let bar = progress(input.length, "replaying");
    let played = play(
        &mut *input.recording,
        &mut input.part,
        &mut replay,
        &mut |row| files.row(row),
        &mut |bytes| bar.set_position(bytes),
    );
    bar.finish_and_clear();
    played.map_err(not_played)?;
    let told = input.recording.told();
    let [permits, estimates] = replay.permits();
    if estimates == 0 {
        return Err(nothing(arguments, told, input.part.outside));
    }
    if let Some(damage) = &told.damage {
        eprintln!(
            "{}: broken {damage}; what stands before was read",
            input.name
        );
    }
    let mut summary = replay.summary();
    summary["task"] = json!(arguments.task);
    summary["recording"] = recording(&input);
    if let Some(looks) = &input.part.looks
        && is_looked(&input)
    {
        let counts = looks.counts().into_iter();
        let counts: Map<String, Value> = counts
            .map(|(name, count)| (name.into(), json!(count)))
            .collect();
        summary["looks"] = Value::Object(counts);
    }
    files.finish(&summary)?;
    if let Some(output) = &arguments.output {
        let title = format!("{} against {}", name_of(&arguments.log), arguments.task);
        write(output, replay_picture(&title, &replay).as_bytes())?;
    }
    if arguments.json {
        print(&summary)?;
    } else if arguments.rows.as_deref() != Some(stdout)
        && arguments.output.as_deref() != Some(stdout)
    {
        sentences(&replay, &summary, [permits, estimates])?;
    }
    let [(_, verdicts), (_, permissions), ..] = replay.tallies();
    Ok(answer(
        verdicts.false_permits == 0 && permissions.false_permits == 0,
    ))
}

fn name_of(path: &Path) -> String {
    let name = path.file_name().unwrap_or(path.as_os_str());
    name.to_string_lossy().into_owned()
}

/// The sources of the recording.
struct Parts {
    sources: Vec<Source>,
}

impl Parts {
    fn of(arguments: &Arguments) -> Result<Self, Failure> {
        let terms = match arguments.cross_terms {
            Terms::Filled => CrossTerms::Filled,
            Terms::YawUnknown => CrossTerms::YawUnknown(Share::HALF),
            Terms::AllUnknown => CrossTerms::AllUnknown(Share::HALF),
        };
        let source =
            Source::new(&arguments.frame, arguments.inflation, terms).map_err(parameter)?;
        Ok(Self {
            sources: vec![source; arguments.topic.len().max(1)],
        })
    }
}

fn parameter(error: InvalidParameter) -> Failure {
    let help = match error {
        InvalidParameter::Inflation => "give --inflation 1 to 4096",
        InvalidParameter::Frame => "name the world frame: --frame map",
        InvalidParameter::Sources => "give at most 256 topics",
        InvalidParameter::PermitsInARow => "give --permits-in-a-row 1 or more",
        _ => "give 1 to 2147483647 milliseconds; no check can be switched off",
    };
    Failure::usage(format!("a setting of the gate is none: {error:?}"), help)
}

fn thresholds(arguments: &Arguments) -> Thresholds {
    Thresholds {
        distance_m: arguments.distance,
        sigma_m: arguments.sigma,
        sigma_yaw_rad: arguments.sigma_yaw_deg.map_or(0.05, f64::to_radians),
        ellipse_scale: arguments.ellipse_scale,
        ellipse_m: arguments.ellipse,
        ellipse_lateral_m: arguments.ellipse_lateral,
        ate_m: arguments.ate,
    }
}

/// The table that is given, or one of the site, proven.
fn table(arguments: &Arguments, site: &Site, task: &Task) -> Result<Vec<u8>, Failure> {
    if let Some(path) = &arguments.table {
        let (bytes, name) = read(path)?;
        let table = Table::parse(&bytes).map_err(|error| super::gate::not_a_table(&name, error))?;
        if table.task() != arguments.task || table.site_digest() != site.digest {
            return Err(Failure::usage(
                format!("{name} is no table of this site file and task"),
                "build it again with `posegate table build`, or leave --table out",
            ));
        }
        return Ok(bytes);
    }
    let spec = site.chosen_table(task).ok_or_else(|| {
        Failure::usage(
            format!("{}: no extent can be chosen for the task `{}`", arguments.site.display(), arguments.task),
            "add `expected = { translation = .., yaw_deg = .. }` to the task, or an extent in [table] or task.NAME.table",
        )
    })?;
    let order = Order {
        task: &arguments.task,
        success: &task.success,
        spec,
        epsilon: arguments.epsilon.unwrap_or(site.epsilon),
        site_digest: site.digest,
    };
    let built = posegate::verify::build(&order, &|| {});
    let (bytes, _) = built.map_err(|error| match error {
        posegate::verify::BuildError::Bake(error) => {
            Failure::table(&arguments.site, &arguments.task, error)
        }
        other => Failure::internal(other.to_string()),
    })?;
    Ok(bytes)
}

/// A recording that is open, with what it takes to read it.
struct Input {
    recording: Box<dyn Recording + Send>,
    name: String,
    length: u64,
    track: Option<Track>,
    part: Part,
}

impl Input {
    fn open(arguments: &Arguments, site: &Site) -> Result<Self, Failure> {
        let (input, name, length) = open(&arguments.log)?;
        let mut input = BufReader::with_capacity(1 << 18, input);
        let start = input
            .fill_buf()
            .map_err(|error| unreadable(&name, &error))?;
        let format = format_of(start);
        let is_bag = format == Format::Mcap;
        if is_bag == arguments.topic.is_empty() {
            return Err(if is_bag {
                which_topic(input, &name)
            } else {
                Failure::usage(
                    format!("{name} is no MCAP file: it has no topics"),
                    "leave --topic out",
                )
            });
        }
        let (track, truth_topic) = truth(arguments, is_bag)?;
        let looks = if is_bag {
            looks(arguments, site)?
        } else {
            None
        };
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
                Box::new(Bag::new(input, &name, &wanted))
            }
            Format::Csv => {
                let gaussian = arguments.set == Kind::Gaussian;
                Box::new(Text::csv(input, &name, gaussian).map_err(Failure::input)?)
            }
            Format::Tum => Box::new(Text::tum(input, &name)),
            _ => {
                return Err(Failure::usage(
                    format!("{name} is a bag of ROS 1 or of SQLite, which is not read"),
                    "convert it: `ros2 bag convert`, or `rosbags-convert --dst-storage mcap`",
                ));
            }
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
        })
    }
}

/// A file or standard input, its name and its length.
fn open(path: &Path) -> Result<(Box<dyn Read + Send>, String, u64), Failure> {
    if path == Path::new("-") {
        return Ok((Box::new(std::io::stdin()), "<stdin>".into(), 0));
    }
    let name = path.display().to_string();
    if path.is_dir() {
        return Err(Failure::usage(
            format!("{name} is a folder"),
            "give the .mcap file in it",
        ));
    }
    let file = File::open(path).map_err(|error| unreadable(&name, &error))?;
    let length = file.metadata().map_or(0, |metadata| metadata.len());
    Ok((Box::new(file), name, length))
}

fn unreadable(name: &str, error: &std::io::Error) -> Failure {
    Failure::usage(
        format!("{name}: {error}"),
        "check the path; `-` reads standard input",
    )
}

/// A bag without a topic: which there are.
fn which_topic(input: impl Read, name: &str) -> Failure {
    let mut bag = Bag::new(input, name, &[]);
    while let Ok(Some(_)) = bag.next() {}
    Failure::usage(
        format!("{name} has topics:{}", topics(bag.told())),
        "say which one has the estimates, as --topic /amcl_pose",
    )
}

fn topics(told: &Told) -> String {
    let lines = told.skipped.iter().map(|(topic, skipped)| {
        format!(
            "\n  {topic} ({}, {} messages)",
            skipped.schema, skipped.messages
        )
    });
    lines.collect()
}

/// The truth from a file, or the topic that has it.
fn truth(arguments: &Arguments, is_bag: bool) -> Result<(Option<Track>, Option<String>), Failure> {
    let Some(truth) = &arguments.truth else {
        return Ok((None, None));
    };
    if !(arguments.truth_gap > 0.0) {
        return Err(Failure::usage(
            format!("--truth-gap {} is no time", arguments.truth_gap),
            "give seconds above 0",
        ));
    }
    let path = Path::new(truth);
    if !path.is_file() {
        if !is_bag {
            return Err(Failure::usage(
                format!("--truth {truth}: there is no such file"),
                "give a TUM file or a CSV; topics are those of MCAP files",
            ));
        }
        let track = Track::new(MOST_TRUE, arguments.truth_gap);
        return Ok((Some(track), Some(truth.clone())));
    }
    let (bytes, name) = read(path)?;
    let track = match format_of(&bytes) {
        Format::Csv => {
            let rows = estimates(bytes.as_slice(), &name, Columns::TimedPoses);
            let rows = rows.map_err(Failure::input)?;
            let mut track = Track::new(rows.len(), arguments.truth_gap);
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
            let text = String::from_utf8_lossy(&bytes);
            let poses = tum::trajectory(&text, &name).map_err(Failure::input)?;
            Track::of(&poses, arguments.truth_gap)
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

/// The camera and the tags for detections; `None` where the site has no camera.
fn looks(arguments: &Arguments, site: &Site) -> Result<Option<Looks>, Failure> {
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
            format!("--sigma-px {} is no deviation", arguments.sigma_px),
            "give pixels above 0, like 0.3",
        ));
    }
    Ok(camera.map(|camera| {
        let eye = Eye {
            camera: camera.camera,
            mount: camera.mount,
        };
        let tags = site
            .tags
            .values()
            .map(|tag| (tag.family.as_str(), &tag.tag));
        Looks::new(eye, tags, arguments.sigma_px)
    }))
}

/// The files that are written while the recording is read.
struct Files {
    rows: Option<(Box<dyn Write>, Option<Draft>)>,
    mcap: Option<(Channels<BufWriter<File>>, Draft)>,
}

impl Files {
    fn open(arguments: &Arguments) -> Result<Self, Failure> {
        let copy = |draft: &Draft| draft.file.try_clone().map_err(|error| draft.fault(&error));
        let rows = match &arguments.rows {
            None => None,
            Some(path) if path == Path::new("-") => {
                let stdout = BufWriter::new(std::io::stdout());
                Some((Box::new(stdout) as Box<dyn Write>, None))
            }
            Some(path) => {
                let draft = Draft::new(path)?;
                let file = BufWriter::new(copy(&draft)?);
                Some((Box::new(file) as Box<dyn Write>, Some(draft)))
            }
        };
        let mcap = match &arguments.mcap {
            None => None,
            Some(path) => {
                let draft = Draft::new(path)?;
                let file = BufWriter::new(copy(&draft)?);
                let channels = Channels::new(file).map_err(|error| draft.fault(&error))?;
                Some((channels, draft))
            }
        };
        Ok(Self { rows, mcap })
    }

    fn row(&mut self, row: &Row) -> Result<(), Failure> {
        if let Some((rows, draft)) = &mut self.rows
            && let Err(error) = writeln!(rows, "{}", row.json())
        {
            return Err(rows_fault(draft.as_ref(), &error));
        }
        if let Some((channels, draft)) = &mut self.mcap {
            channels.row(row).map_err(|error| draft.fault(&error))?;
        }
        Ok(())
    }

    fn finish(self, summary: &Value) -> Result<(), Failure> {
        if let Some((mut rows, draft)) = self.rows {
            if let Err(error) = rows.flush() {
                return Err(rows_fault(draft.as_ref(), &error));
            }
            if let Some(draft) = draft {
                draft.keep()?;
            }
        }
        if let Some((channels, draft)) = self.mcap {
            let mut file = channels
                .finish(summary)
                .map_err(|error| draft.fault(&error))?;
            file.flush().map_err(|error| draft.fault(&error))?;
            draft.keep()?;
        }
        Ok(())
    }
}

/// A reader of standard output that has gone away ends the program quietly.
fn rows_fault(draft: Option<&Draft>, error: &std::io::Error) -> Failure {
    match draft {
        Some(draft) => draft.fault(error),
        None if error.kind() == std::io::ErrorKind::BrokenPipe => std::process::exit(0),
        None => Failure::usage(
            format!("standard output cannot be written: {error}"),
            "redirect it to a file",
        ),
    }
}

fn not_played(error: PlayError<Failure>) -> Failure {
    match error {
        PlayError::Recording(RecordingError::Io { file, source }) => unreadable(&file, &source),
        PlayError::Recording(error) => Failure::input(error),
        PlayError::NoCamera => Failure::usage(
            "detections need a camera: the site has none, or several".into(),
            "name it: --camera front",
        ),
        PlayError::Taker(failure) => failure,
    }
}

/// Whether there was a look at tags.
fn is_looked(input: &Input) -> bool {
    let counts = input.part.looks.as_ref().map(Looks::counts);
    counts.is_some_and(|counts| counts.iter().any(|(_, count)| *count > 0))
}

/// No estimate: why.
fn nothing(arguments: &Arguments, told: &Told, outside: u64) -> Failure {
    let name = arguments.log.display();
    if outside > 0 {
        return Failure::usage(
            format!("{name}: all {outside} estimates are outside of --from and --to"),
            "times are those of the stamps, in seconds",
        );
    }
    let refused = told
        .skipped
        .iter()
        .filter(|(_, skipped)| skipped.why != Why::NotWanted)
        .map(|(topic, skipped)| {
            let why = skipped.why.name();
            format!(
                "; {topic} is not read: {why} ({}; {})",
                skipped.schema, skipped.encoding
            )
        });
    let refused: String = refused.collect();
    let damage = told
        .damage
        .as_deref()
        .map_or(String::new(), |damage| format!("; broken {damage}"));
    let bytes = told.first_undecodable.as_deref();
    let bytes = bytes.map_or(String::new(), |first| format!("; {first}"));
    let others = topics(told);
    let others = if others.is_empty() {
        others
    } else {
        format!("; its other topics:{others}")
    };
    Failure::usage(
        format!("{name}: no estimate{refused}{damage}{bytes}{others}"),
        "give a recording with estimates, and the topic that has them",
    )
}

/// What the reader met, as JSON.
fn recording(input: &Input) -> Value {
    let told = input.recording.told();
    let skipped: Map<String, Value> = told
        .skipped
        .iter()
        .map(|(topic, skipped)| {
            let line = json!({
                "schema": skipped.schema,
                "encoding": skipped.encoding,
                "why": skipped.why.name(),
                "messages": skipped.messages,
            });
            (topic.clone(), line)
        })
        .collect();
    json!({
        "file": input.name,
        "bytes": input.recording.bytes(),
        "message_bytes": told.message_bytes,
        "topics": told.read,
        "skipped_topics": skipped,
        "undecodable": told.undecodable,
        "first_undecodable": told.first_undecodable,
        "indexed": told.indexed,
        "damage": told.damage,
        "outside_time_range": input.part.outside,
    })
}

/// The same for people.
fn sentences(
    replay: &Replay<'_>,
    summary: &Value,
    [permits, estimates]: [u64; 2],
) -> Result<(), Failure> {
    print(&format_args!(
        "{estimates} estimates, {permits} permitted; open {:.1} s of {:.1} s, opened {} times",
        summary["gate"]["open_s"].as_f64().unwrap_or(0.0),
        summary["gate"]["recorded_s"].as_f64().unwrap_or(0.0),
        summary["gate"]["openings"]
    ))?;
    for (reason, count) in replay.reasons() {
        print(&format_args!("  {count} {reason}: {}", reason.action()))?;
    }
    let truth = summary.get("truth");
    print(&format_args!(
        "{:<10} {:>9} {:>13} {:>14} {:>13}",
        "rule", "permits", "availability", "false permits", "false denials"
    ))?;
    for (name, tally) in replay.tallies() {
        let [wrong, missed] = match truth {
            Some(_) => [tally.false_permits, tally.false_denials].map(|count| count.to_string()),
            None => ["-".to_string(), "-".to_string()],
        };
        print(&format_args!(
            "{name:<10} {:>9} {:>13.4} {wrong:>14} {missed:>13}",
            tally.permits,
            tally.availability()
        ))?;
    }
    if let Some(truth) = truth {
        let get = |value: &Value| value.as_f64().unwrap_or(f64::NAN);
        print(&format_args!(
            "truth known of {} estimates, {} in the success set; in the pose-set: {:.4}; NEES {:.2} (3 is honest); RMSE {:.4} m, {:.2} deg",
            truth["estimates"],
            truth["in_success_set"],
            get(&truth["coverage"]),
            get(&truth["nees"]["mean"]),
            get(&truth["rmse_m"]),
            get(&truth["rmse_yaw_rad"]).to_degrees()
        ))?;
    }
    let findings = replay.findings();
    for (name, count) in findings.named().into_iter().skip(1) {
        if count > 0 {
            print(&format_args!("found: {count} {name}"))?;
        }
    }
    for key in ["skipped_topics", "looks"] {
        let part = summary["recording"].get(key).or(summary.get(key));
        if let Some(part) = part
            .and_then(Value::as_object)
            .filter(|part| !part.is_empty())
        {
            for (name, what) in part {
                print(&format_args!("{}: {name} {what}", key.replace('_', " ")))?;
            }
        }
    }
    if summary["recording"]["undecodable"] != json!(0) {
        let recording = &summary["recording"];
        print(&format_args!(
            "{} messages are none: {}",
            recording["undecodable"], recording["first_undecodable"]
        ))?;
    }
    Ok(())
}
