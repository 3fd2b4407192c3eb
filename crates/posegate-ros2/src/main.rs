//! `posegate-node`: the gate as a ROS 2 node.

use posegate::gate::Settings;
use posegate_ros2::arguments::{ArgumentError, Arguments};
use posegate_ros2::bridge::Bridge;
use posegate_ros2::clock::Now;
use posegate_ros2::decider::Decider;
use posegate_ros2::docks::{self, Dock, DockGate};
use posegate_ros2::graph::Environment;
use posegate_ros2::names::Names;
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
            if let Some(ArgumentError::Line(asked)) = error.downcast_ref()
                && !asked.use_stderr()
            {
                asked.exit();
            }
            let words = error.to_string();
            let words = words.trim_start_matches("error: ").trim_end();
            eprintln!("posegate-node: {words}");
            ExitCode::from(2)
        }
    }
}

fn start() -> Result<(), Box<dyn Error>> {
    let arguments = Arguments::read(std::env::args().skip(1))?;
    let environment = Environment::read(|name| std::env::var(name).ok())?;
    let stop = Arc::new(AtomicBool::new(false));
    for signal in [signal_hook::consts::SIGINT, signal_hook::consts::SIGTERM] {
        signal_hook::flag::register(signal, Arc::clone(&stop))?;
    }
    let is_site = arguments.table.is_dir();
    let docks = match is_site {
        true => docks::read(&arguments)?,
        false => vec![Dock::read(&arguments)?],
    };
    let gates: Vec<Settings<'_>> = docks.iter().map(|dock| dock.settings.gate()).collect();
    let settings = &docks.first().ok_or("the site has no table")?.settings;
    let names = &arguments.names;
    let (node, task, poses) = (names.full_node(), settings.task(), source(names, settings));
    let (decider, what): (Box<dyn Decider>, String) = if is_site {
        let (tasks, asked) = (docks.len(), &names.task);
        let what = format!("has {tasks} tasks, decides by {poses} on the one that {asked} names");
        (Box::new(DockGate::new(&docks, &gates)), what)
    } else if let Some(serial) = &settings.serial {
        let device = serial.path.display();
        let what = format!(
            "passes {poses} to the controller on {device}, which decides on the task `{task}`"
        );
        (Box::new(Bridge::open(serial)?), what)
    } else {
        let gate = DockGate::alone(&docks, &gates, Now::read())?;
        (
            Box::new(gate),
            format!("decides on the task `{task}` by {poses}"),
        )
    };
    let mut runner = Runner::join(environment, names, decider, settings)?;
    eprintln!(
        "posegate-node: {node} {what}, in domain {}",
        environment.domain
    );
    runner.run(&stop)?;
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
