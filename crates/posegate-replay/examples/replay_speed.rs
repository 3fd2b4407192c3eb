//! Measures the speed of reading and replaying recordings, and the memory for that. Prints JSON lines; fails if a
//! goal is missed.
//!
//! `cargo run --release -p posegate-replay --example replay_speed` writes bags of 100 MB and 1 GB into a temporary folder,
//! and reads each in a separate process, so that the peak memory of each is known.

use posegate_testkit::bags;
use posegate_testkit::mcap::{Layout, Writer};

use bags::{Compression, Pose, pose_definition, pose_message};
use posegate::bake::BakeInput;
use posegate::gate::{Restart, Settings, Source};
use posegate::motion::MotionBounds;
use posegate::set::CrossTerms;
use posegate_replay::recording::{Bag, Recording, Role, Wanted};
use posegate_replay::replay::{Clock, Part, Replay, ReplayConfig, play};
use posegate_site::Site;
use std::convert::Infallible;
use std::error::Error;
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;
use std::process::{Command, ExitCode};
use std::time::Instant;

type Done<T> = Result<T, Box<dyn Error>>;

const TOPIC: &str = "/amcl_pose";

fn main() -> Done<ExitCode> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match arguments.as_slice() {
        [what, bag] if what == "read" => read(Path::new(bag)),
        [what, bag] if what == "replay" => replayed(Path::new(bag), false),
        [what, bag] if what == "examine" => replayed(Path::new(bag), true),
        _ => all(),
    }
}

fn all() -> Done<ExitCode> {
    let folder = tempfile::tempdir()?;
    let mut short = false;
    let own = std::env::current_exe()?;
    let figure = |what: &str, bag: &Path| -> Done<Vec<f64>> {
        let output = Command::new(&own).arg(what).arg(bag).output()?;
        let text = String::from_utf8(output.stdout)?;
        let numbers: Result<Vec<f64>, _> = text.split_whitespace().map(str::parse).collect();
        Ok(numbers.map_err(|_| String::from_utf8_lossy(&output.stderr).into_owned())?)
    };
    let mut line = |name: &str, value: f64, unit: &str, goal: Option<f64>, least: bool| {
        let goal_text = goal.map_or("null".into(), |goal| goal.to_string());
        println!(
            r#"{{"name": "{name}", "value": {value:.1}, "unit": "{unit}", "goal": {goal_text}}}"#
        );
        short |= goal.is_some_and(|goal| {
            if least {
                !(value >= goal)
            } else {
                !(value <= goal)
            }
        });
    };
    let estimates = folder.path().join("estimates.mcap");
    write(&estimates, Compression::Lz4, 2_000_000, 0)?;
    for (what, name, goal) in [
        (
            "replay",
            "estimates a second with --fast, read, decided and through the gate",
            Some(1e6),
        ),
        (
            "examine",
            "estimates a second, margins and worst poses too",
            None,
        ),
    ] {
        let numbers = figure(what, &estimates)?;
        line(
            &format!("{name}, wall clock"),
            numbers[0],
            "1/s",
            None,
            true,
        );
        if goal.is_some() {
            let name = format!("{name}, processor time of the busier thread");
            line(&name, numbers[2], "1/s", goal, true);
        }
    }
    std::fs::remove_file(&estimates)?;
    for (compression, name) in [(Compression::Lz4, "lz4"), (Compression::Zstd, "zstd")] {
        let mut memory = Vec::new();
        for (megabytes, count) in [(100, 1_000), (1_000, 10_000)] {
            let bag = folder.path().join("large.mcap");
            write(&bag, compression, count, 100_000)?;
            let numbers = figure("read", &bag)?;
            if megabytes == 1_000 {
                let name = format!("uncompressed megabytes a second of one core, {name}");
                line(&name, numbers[0], "MB/s", Some(200.0), true);
            }
            memory.push(figure("replay", &bag)?[1]);
            std::fs::remove_file(&bag)?;
        }
        line(
            &format!("largest memory with 1 GB, {name}"),
            memory[1],
            "MB",
            None,
            false,
        );
        let name = format!("largest memory with 1 GB over that with 100 MB, {name}");
        line(&name, memory[1] / memory[0], "ratio", Some(1.1), false);
    }
    Ok(ExitCode::from(u8::from(short)))
}

/// Writes a bag of `count` estimates, each with a message of another topic of `payload` bytes.
fn write(path: &Path, compression: Compression, count: u32, payload: usize) -> Done<()> {
    let layout = Layout {
        compression: Some(compression),
        chunk_size: 768 << 10,
        index: true,
    };
    let mut writer = Writer::new(BufWriter::new(File::create(path)?), layout)?;
    let schema = writer.schema(
        "geometry_msgs/msg/PoseWithCovarianceStamped",
        pose_definition().as_bytes(),
    );
    let poses = writer.channel(schema, TOPIC);
    let cloud = writer.schema("sensor_msgs/msg/PointCloud2", b"");
    let clouds = writer.channel(cloud, "/points");
    // Half of the payload repeats, like sensor data.
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    let mut random = move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        state
    };
    let mut points = vec![0; payload];
    for k in 0..count {
        let t_s = 1.0 + 0.01 * f64::from(k);
        let share = |bits: u64| (bits >> 40) as f64 / 16_777_216.0 - 0.5;
        let pose = Pose {
            t_s,
            x: 0.1 * share(random()),
            y: 0.1 * share(random()),
            yaw: 0.05 * share(random()),
            covariance: [1e-4, 1e-4, 2e-5],
            ..Pose::AT_DOCK
        };
        let time = (t_s * 1e9) as u64 + 5_000_000;
        writer.message(poses, time, &pose_message(&pose))?;
        if payload > 0 {
            for piece in points.chunks_exact_mut(16) {
                piece[..8].copy_from_slice(&random().to_le_bytes());
            }
            writer.message(clouds, time, &points)?;
        }
    }
    writer.finish()?;
    Ok(())
}

fn bag(path: &Path) -> Done<Bag<'static>> {
    let wanted = Wanted {
        topic: TOPIC.into(),
        role: Role::Estimates(0),
    };
    Ok(Bag::new(
        File::open(path)?,
        &path.display().to_string(),
        &[wanted],
    ))
}

/// Returns the processor time of this thread, seconds, without the time of other programs.
fn processor_s() -> Done<f64> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat")?;
    let nanoseconds = text.split_whitespace().next().ok_or("no time")?;
    Ok(nanoseconds.parse::<f64>()? * 1e-9)
}

/// Returns the processor time of all threads, seconds, to a hundredth.
fn all_processor_s() -> Done<f64> {
    let text = std::fs::read_to_string("/proc/self/stat")?;
    let fields = text.rsplit(')').next().unwrap_or("").split_whitespace();
    let ticks: Result<Vec<f64>, _> = fields.skip(11).take(2).map(str::parse).collect();
    Ok(ticks?.iter().sum::<f64>() * 0.01)
}

/// Reads a bag on this thread only. Prints uncompressed megabytes per second of its processor time.
fn read(path: &Path) -> Done<ExitCode> {
    let started = processor_s()?;
    let mut bag = bag(path)?;
    let mut count = 0;
    while bag.next()?.is_some() {
        count += 1;
    }
    assert!(count > 0 && bag.diagnostics().damage.is_none());
    let seconds = processor_s()? - started;
    println!(
        "{}",
        bag.diagnostics().message_bytes as f64 * 1e-6 / seconds
    );
    Ok(ExitCode::SUCCESS)
}

/// Replays a bag. Prints estimates per second by the clock, the peak memory of this process in megabytes, and estimates
/// per second of processor time of the busier of the two threads, which equals the rate by the clock if nothing else
/// runs.
fn replayed(path: &Path, examined: bool) -> Done<ExitCode> {
    let site = Site::read("examples/sites/dock.toml")?;
    let task = site.task("dock")?;
    let spec = site.chosen_table(task).ok_or("no table")?;
    let order = BakeInput {
        task: "dock",
        success: &task.success,
        spec,
        epsilon: site.epsilon,
    };
    let (table, _) = posegate::verify::build(&order, &|| {})?;
    let source = Source::new("map", 1.0, CrossTerms::Filled, MotionBounds::STANDS_STILL)
        .map_err(|error| format!("{error:?}"))?;
    let settings = Settings {
        task: "dock",
        task_digest: site.task_digest(task),
        sources: &[source],
        maximum_age_ms: 200,
        response_ms: 20,
        report_period_ms: 1,
        permit_hold_ms: 100,
        inhibit_hold_ms: 500,
        permits_in_a_row: 3,
        restart: Restart::Automatic,
        most_runs: 1_000,
        look_at: None,
    };
    let setup = ReplayConfig {
        table: &table,
        settings: &settings,
        success: &task.success,
        bounded: None,
        world: "map",
        clock: Some(Clock::Logged),
        examined,
    };
    let mut replay = Replay::new(&setup, None).map_err(|error| format!("{error:?}"))?;
    let mut part = Part {
        range: [f64::NEG_INFINITY, f64::INFINITY],
        looks: None,
        outside: 0,
    };
    let (started, own, all) = (Instant::now(), processor_s()?, all_processor_s()?);
    let mut bag = bag(path)?;
    play(
        &mut bag,
        &mut part,
        &mut replay,
        &mut |_| Ok::<(), Infallible>(()),
        &mut |_| {},
    )
    .map_err(|error| format!("{error:?}"))?;
    let seconds = started.elapsed().as_secs_f64();
    let own = processor_s()? - own;
    let busier = own.max(all_processor_s()? - all - own);
    let [permits, estimates] = replay.permits();
    assert!(
        permits > 0 && permits < estimates,
        "{permits} of {estimates}"
    );
    let status = std::fs::read_to_string("/proc/self/status")?;
    let peak = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let peak = peak
        .and_then(|rest| rest.split_whitespace().next())
        .ok_or("no VmHWM")?;
    let count = estimates as f64;
    let peak = peak.parse::<f64>()? / 1024.0;
    println!("{} {peak} {}", count / seconds, count / busier);
    Ok(ExitCode::SUCCESS)
}
