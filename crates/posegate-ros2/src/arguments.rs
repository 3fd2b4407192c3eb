//! The command line: `posegate-node TABLE [--task-digest HEX] [--site FILE] [--serial DEV [--baud N]] [--ros-args ...]`.

use crate::names::{NameError, Names};
use crate::parameters::{ParameterError, Parameters};
use clap::Parser;
use std::path::PathBuf;

/// Decide whether a robot is localized well enough for a task, as a ROS 2 node
#[derive(Debug, Parser)]
#[command(name = "posegate-node", version, override_usage = USAGE, after_help = EXAMPLES)]
pub struct Arguments {
    /// The table of the task, made by `posegate table build`; or the folder of a built site (`posegate site merge`): the task is asked for by
    /// name on the topic posegate_task
    #[arg(value_name = "TABLE|FOLDER")]
    pub table: PathBuf,
    /// The task digest that the table must have (`posegate table info` prints it); also as --site-digest, its older name
    #[arg(long, value_name = "HEX", alias = "site-digest")]
    pub task_digest: Option<String>,
    /// The site file; the table must be of its task: its tags and cameras, for the parameter use_detections
    #[arg(long, value_name = "FILE")]
    pub site: Option<PathBuf>,
    /// The serial line of a controller whose gate decides: poses are passed to it, and the permit is the controller's; TABLE is the table in its
    /// flash
    #[arg(long, value_name = "DEV")]
    pub serial: Option<PathBuf>,
    /// The speed of that line, bits per second
    #[arg(long, value_name = "N", default_value_t = 115_200, requires = "serial")]
    #[arg(value_parser = clap::value_parser!(u32).range(1_200..=4_000_000))]
    pub baud: u32,
    /// The ROS parameters for this node.
    #[arg(skip)]
    pub parameters: Parameters,
    /// The name of the node and of its topics.
    #[arg(skip)]
    pub names: Names,
}

const USAGE: &str = "posegate-node TABLE|FOLDER [--task-digest HEX] [--site FILE] [--serial DEV [--baud N]] [--ros-args [-p NAME:=VALUE] [--params-file FILE] [-r FROM:=TO] ...]";

const EXAMPLES: &str = "\
Examples:
  posegate-node dock.posegate --ros-args -p max_speed:=0.3 -p max_yaw_rate_deg:=30.0 -r pose:=/amcl_pose
  posegate-node dock.posegate --site site.toml --ros-args -p use_detections:=true -p max_speed:=0.3 -p max_yaw_rate_deg:=30.0
  posegate-node built --ros-args -p max_speed:=0.3 -p max_yaw_rate_deg:=30.0 -r __ns:=/robot1
  posegate-node dock.posegate --serial /dev/ttyUSB0 --ros-args -r pose:=/amcl_pose

The parameters, the topics and what a consumer of the permit must do: docs/for-ros.md.";

/// The reason why a command line is refused.
#[derive(Debug, thiserror::Error)]
pub enum ArgumentError {
    /// The part before `--ros-args` is refused, or asks for help or the version.
    #[error(transparent)]
    Line(#[from] clap::Error),
    /// The ROS argument does not exist.
    #[error(
        "`{0}` is not an argument of ROS: expected -p NAME:=VALUE, --params-file FILE, -r FROM:=TO, --log-level LEVEL or `--`"
    )]
    UnknownRos(String),
    /// An argument of ROS has no value.
    #[error("{0} needs a value: write {0} {1}")]
    NoValue(&'static str, &'static str),
    /// A parameter file cannot be read.
    #[error("cannot read the parameter file {0}: {1}")]
    File(String, std::io::Error),
    /// A parameter is refused.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    /// A name is refused.
    #[error(transparent)]
    Name(#[from] NameError),
}

impl Arguments {
    /// Reads the arguments after the program's name.
    ///
    /// # Errors
    /// [`ArgumentError`]. Parameter files are read, so a missing file is also an error.
    pub fn read(given: impl IntoIterator<Item = String>) -> Result<Self, ArgumentError> {
        let mut words = given.into_iter();
        let mut line = vec!["posegate-node".to_owned()];
        let mut ros = Ros::default();
        while let Some(word) = words.next() {
            match word.as_str() {
                "--ros-args" => ros.parse(&mut words)?,
                _ => line.push(word),
            }
        }
        let mut arguments = Self::try_parse_from(line)?;
        let names = Names::new(&ros.remaps)?;
        for source in &ros.parameters {
            match source {
                Source::One(assignment) => arguments.parameters.assign(assignment, &names)?,
                Source::File(path) => {
                    let text = std::fs::read_to_string(path)
                        .map_err(|error| ArgumentError::File(path.clone(), error))?;
                    arguments.parameters.read(&text, path, &names)?;
                }
            }
        }
        Ok(Self { names, ..arguments })
    }
}

enum Source {
    One(String),
    File(String),
}

#[derive(Default)]
struct Ros {
    parameters: Vec<Source>,
    remaps: Vec<String>,
}

impl Ros {
    /// Reads the arguments up to `--`, or to the end.
    fn parse(&mut self, words: &mut impl Iterator<Item = String>) -> Result<(), ArgumentError> {
        while let Some(word) = words.next() {
            let mut value = |option, form| words.next().ok_or(ArgumentError::NoValue(option, form));
            match word.as_str() {
                "--" => return Ok(()),
                "--ros-args" => {}
                "-p" | "--param" => {
                    let value = value("-p", "NAME:=VALUE")?;
                    self.parameters.push(Source::One(value));
                }
                "--params-file" => {
                    let value = value("--params-file", "FILE")?;
                    self.parameters.push(Source::File(value));
                }
                "-r" | "--remap" => self.remaps.push(value("-r", "FROM:=TO")?),
                // This node does not use it, but launch files give it to every node.
                "--log-level" => drop(value("--log-level", "LEVEL")?),
                "--log-config-file" => drop(value("--log-config-file", "FILE")?),
                "-e" | "--enclave" => drop(value("--enclave", "PATH")?),
                switch if is_log_switch(switch) => {}
                _ => return Err(ArgumentError::UnknownRos(word)),
            }
        }
        Ok(())
    }
}

fn is_log_switch(word: &str) -> bool {
    let kinds = ["rosout-logs", "stdout-logs", "external-lib-logs"];
    let name = word
        .strip_prefix("--enable-")
        .or_else(|| word.strip_prefix("--disable-"));
    name.is_some_and(|name| kinds.contains(&name))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(line: &str) -> Result<Arguments, ArgumentError> {
        Arguments::read(line.split_whitespace().map(str::to_owned))
    }

    #[test]
    fn run_has_table_parameters_and_names() {
        let line = "dock.posegate --task-digest abc --ros-args -p inflation:=2.0 -r pose:=/filter/pose --log-level info -- ";
        let arguments = read(line).unwrap();
        assert_eq!(arguments.table, PathBuf::from("dock.posegate"));
        assert_eq!(arguments.task_digest.as_deref(), Some("abc"));
        for older in [
            "a.posegate --site-digest abc",
            "a.posegate --site-digest=abc",
        ] {
            let arguments = read(older).unwrap();
            assert_eq!(arguments.task_digest.as_deref(), Some("abc"));
        }
        assert_eq!(arguments.names.pose, "/filter/pose");
        assert!(arguments.parameters.get("inflation").is_some());
    }

    #[test]
    fn invalid_command_lines_have_their_own_errors() {
        for (line, words) in [
            ("", "<TABLE|FOLDER>"),
            ("a.posegate b.posegate", "unexpected argument 'b.posegate'"),
            ("a.posegate --speed 3", "unexpected argument '--speed'"),
            ("a.posegate --task-digest", "a value is required"),
            ("a.posegate --serial", "a value is required"),
            ("a.posegate --site", "a value is required"),
            ("a.posegate --baud 9600", "--serial <DEV>"),
            (
                "a.posegate --serial /dev/ttyS0 --baud 1",
                "1 is not in 1200..=4000000",
            ),
            ("a.posegate --ros-args -p", "needs a value"),
            ("a.posegate --ros-args -x", "not an argument of ROS"),
            ("a.posegate --ros-args -p inflation=2", ":="),
            (
                "a.posegate --ros-args --params-file /no/such.yaml",
                "cannot read the parameter file",
            ),
        ] {
            let message = read(line).unwrap_err().to_string();
            assert!(message.contains(words), "{line}: {message}");
        }
    }
}
