//! `posegate-node`: the gate as a ROS 2 node.

use posegate::gate::Settings;
use posegate_ros2::arguments::Arguments;
use posegate_ros2::arguments::{Command, USAGE};
use posegate_ros2::bridge::Bridge;
use posegate_ros2::clock::Now;
use posegate_ros2::docks::{self, DockGate};
use posegate_ros2::graph::Environment;
use posegate_ros2::names::Names;
use posegate_ros2::permit_gate::PermitGate;
use posegate_ros2::run::Runner;
use posegate_ros2::settings::NodeSettings;
use std::error::Error;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

fn main() -> ExitCode {
    match start() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("posegate-node: {error}");
            ExitCode::from(2)
        }
    }
}

type Outcome = Result<(), Box<dyn Error>>;

fn start() -> Outcome {
    let arguments = match Command::parse(std::env::args().skip(1))? {
        Command::Help => {
            println!("{USAGE}");
            return Ok(());
        }
        Command::Version => {
            println!("posegate-node {}", env!("CARGO_PKG_VERSION"));
            return Ok(());
        }
        Command::Run(arguments) => arguments,
    };
    let environment = Environment::read(|name| std::env::var(name).ok())?;
    let stop = Arc::new(AtomicBool::new(false));
    for signal in [signal_hook::consts::SIGINT, signal_hook::consts::SIGTERM] {
        signal_hook::flag::register(signal, Arc::clone(&stop))?;
    }
    if arguments.table.is_dir() {
        many(&arguments, environment, &stop)?;
    } else {
        one(&arguments, environment, &stop)?;
    }
    // DDS needs many seconds to leave the graph in order, and the denial has been published.
    std::process::exit(0);
}

/// Returns the topic from which poses come. Prints a warning if it may be that of another robot.
fn source<'n>(names: &'n Names, settings: &NodeSettings) -> &'n str {
    let topic = match settings.detector {
        None => names.of_poses(settings.poses.kind),
        Some(_) => &names.detections,
    };
    if let Some(warning) = names.warning(topic) {
        eprintln!("posegate-node: warning: {warning}");
    }
    topic
}

/// Runs a node with one table.
fn one(arguments: &Arguments, environment: Environment, stop: &AtomicBool) -> Outcome {
    let table = std::fs::read(&arguments.table).map_err(|error| {
        format!(
            "cannot read the table {}: {error}",
            arguments.table.display()
        )
    })?;
    let settings = NodeSettings::new(arguments, &table)?;
    let gate_settings = settings.gate();
    let (names, domain) = (&arguments.names, environment.domain);
    let (node, task) = (names.full_node(), settings.task());
    let poses = source(names, &settings);
    if let Some(serial) = &settings.serial {
        let bridge = Bridge::open(serial)?;
        let mut runner = Runner::join(environment, names, bridge, &settings)?;
        eprintln!(
            "posegate-node: {node} passes {poses} to the controller on {}, which decides on the task `{task}`, in domain {domain}",
            serial.path.display()
        );
        runner.run(stop)?;
    } else {
        let gate = PermitGate::new(&table, &settings, &gate_settings, Now::read())?
            .with_tags([names.detections.clone(), names.camera_info.clone()]);
        let mut runner = Runner::join(environment, names, gate, &settings)?;
        eprintln!(
            "posegate-node: {node} decides on the task `{task}` by {poses}, in domain {domain}"
        );
        runner.run(stop)?;
    }
    Ok(())
}

/// Runs a node with the tables of a built site.
fn many(arguments: &Arguments, environment: Environment, stop: &AtomicBool) -> Outcome {
    let docks = docks::read(arguments)?;
    let gates: Vec<Settings<'_>> = docks.iter().map(|dock| dock.settings.gate()).collect();
    let (names, domain) = (&arguments.names, environment.domain);
    let topics = [names.detections.clone(), names.camera_info.clone()];
    let gate = DockGate::new(&docks, &gates, topics);
    let first = docks.first().ok_or("the site has no table")?;
    let settings = &first.settings;
    let mut runner = Runner::join(environment, names, gate, settings)?;
    eprintln!(
        "posegate-node: {} has {} tasks, decides by {} on the one that {} names, in domain {domain}",
        names.full_node(),
        docks.len(),
        source(names, settings),
        names.task
    );
    Ok(runner.run(stop)?)
}
