//! `posegate-node`: the gate as a ROS 2 node.

use posegate_ros2::arguments::{Command, USAGE};
use posegate_ros2::bridge::Bridge;
use posegate_ros2::clock::Now;
use posegate_ros2::graph::Environment;
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

fn start() -> Result<(), Box<dyn Error>> {
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
    let table = std::fs::read(&arguments.table).map_err(|error| {
        format!(
            "cannot read the table {}: {error}",
            arguments.table.display()
        )
    })?;
    let settings = NodeSettings::new(&arguments, &table)?;
    let gate_settings = settings.gate();
    let environment = Environment::read(|name| std::env::var(name).ok())?;
    let stop = Arc::new(AtomicBool::new(false));
    for signal in [signal_hook::consts::SIGINT, signal_hook::consts::SIGTERM] {
        signal_hook::flag::register(signal, Arc::clone(&stop))?;
    }
    let (names, domain) = (&arguments.names, environment.domain);
    let (node, task) = (names.full_node(), settings.task());
    if let Some(serial) = &settings.serial {
        let bridge = Bridge::open(serial)?;
        let mut runner = Runner::join(environment, names, bridge, &settings)?;
        eprintln!(
            "posegate-node: {node} passes {} to the controller on {}, which decides on the task `{task}`, in domain {domain}",
            names.of_poses(settings.poses.kind),
            serial.path.display()
        );
        runner.run(&stop)?;
    } else {
        let gate = PermitGate::new(&table, &settings, &gate_settings, Now::read())?
            .with_tags([names.detections.clone(), names.camera_info.clone()]);
        let mut runner = Runner::join(environment, names, gate, &settings)?;
        eprintln!(
            "posegate-node: {node} decides on the task `{task}` by {}, in domain {domain}",
            match settings.detector {
                None => names.of_poses(settings.poses.kind),
                Some(_) => names.detections.as_str(),
            }
        );
        runner.run(&stop)?;
    }
    // DDS needs many seconds to leave the graph in order, and the denial has been published.
    std::process::exit(0);
}
