//! The command line: `posegate-node TABLE [--task-digest HEX] [--site FILE] [--serial DEV [--baud N]] [--ros-args ...]`.

use crate::names::{NameError, Names};
use crate::parameters::{ParameterError, Parameters};
use std::path::PathBuf;

/// The text that `--help` prints.
pub const USAGE: &str = "\
Decide whether a robot is localized well enough for a task, as a ROS 2 node

Usage: posegate-node TABLE|FOLDER [--task-digest HEX] [--site FILE] [--serial DEV [--baud N]] [--ros-args [-p NAME:=VALUE] [--params-file FILE] [-r FROM:=TO] ...]

  TABLE                the table of the task, made by `posegate table build`
  FOLDER               a built site (`posegate site merge`): the task is asked for by name on the topic posegate_task
  --task-digest HEX    the task digest that the table must have (`posegate table info` prints it); also as --site-digest, its older name
  --site FILE          the site file; the table must be of its task: its tags and cameras, for the parameter use_detections
  --serial DEV         the serial line of a controller whose gate decides: poses are passed to it, and the permit is the controller's;
                       TABLE is the table in its flash
  --baud N             the speed of that line, bits per second [default: 115200]
  --help, --version

Examples:
  posegate-node dock.posegate --ros-args -p max_speed:=0.3 -p max_yaw_rate_deg:=30.0 -r pose:=/amcl_pose
  posegate-node dock.posegate --site site.toml --ros-args -p use_detections:=true -p max_speed:=0.3 -p max_yaw_rate_deg:=30.0
  posegate-node built --ros-args -p max_speed:=0.3 -p max_yaw_rate_deg:=30.0 -r __ns:=/robot1
  posegate-node dock.posegate --serial /dev/ttyUSB0 --ros-args -r pose:=/amcl_pose

The parameters, the topics and what a consumer of the permit must do: docs/for-ros.md.";

/// A parsed command line.
#[derive(Debug)]
pub enum Command {
    /// Run the node.
    Run(Box<Arguments>),
    /// Print the usage.
    Help,
    /// Print the version.
    Version,
}

/// The arguments of a run.
#[derive(Debug)]
pub struct Arguments {
    /// The file of the table, or the folder of a built site.
    pub table: PathBuf,
    /// The task digest, as given.
    pub task_digest: Option<String>,
    /// The site file, for its tags and cameras.
    pub site: Option<PathBuf>,
    /// The serial line of a controller, and its speed in bits per second.
    pub serial: Option<(PathBuf, u32)>,
    /// The ROS parameters for this node.
    pub parameters: Parameters,
    /// The name of the node and of its topics.
    pub names: Names,
}

/// The reason why a command line is refused.
#[derive(Debug, thiserror::Error)]
pub enum ArgumentError {
    /// No table is given.
    #[error(
        "no table is given: write `posegate-node TABLE`, with a table of `posegate table build`"
    )]
    NoTable,
    /// More than one file is given.
    #[error(
        "two tables are given, `{0}` and `{1}`: give one, or the folder of a built site (`posegate site merge`)"
    )]
    TwoTables(String, String),
    /// The option does not exist.
    #[error(
        "`{0}` is not an option of posegate-node: expected a table, --task-digest, --site, --serial, --baud or --ros-args; see --help"
    )]
    Unknown(String),
    /// The ROS argument does not exist.
    #[error(
        "`{0}` is not an argument of ROS: expected -p NAME:=VALUE, --params-file FILE, -r FROM:=TO, --log-level LEVEL or `--`"
    )]
    UnknownRos(String),
    /// The value is not a speed.
    #[error("--baud is `{0}`: expected bits per second, a whole number from 1200 to 4000000")]
    Baud(String),
    /// A speed is given without a line.
    #[error("--baud is given without --serial: write --serial DEV --baud N")]
    BaudAlone,
    /// An option has no value.
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

impl Command {
    /// Reads the arguments after the program's name.
    ///
    /// # Errors
    /// [`ArgumentError`]. Parameter files are read, so a missing file is also an error.
    pub fn parse(given: impl IntoIterator<Item = String>) -> Result<Self, ArgumentError> {
        let mut words = given.into_iter();
        let (mut table, mut task_digest, mut serial, mut baud) = (None, None, None, None);
        let mut site = None;
        let mut ros = Ros::default();
        while let Some(word) = words.next() {
            match word.as_str() {
                "--help" | "-h" => return Ok(Self::Help),
                "--version" | "-V" => return Ok(Self::Version),
                "--task-digest" | "--site-digest" => {
                    let digest = words.next();
                    task_digest =
                        Some(digest.ok_or(ArgumentError::NoValue("--task-digest", "HEX"))?);
                }
                "--site" => {
                    site = Some(
                        words
                            .next()
                            .ok_or(ArgumentError::NoValue("--site", "FILE"))?,
                    );
                }
                "--serial" => {
                    serial = Some(
                        words
                            .next()
                            .ok_or(ArgumentError::NoValue("--serial", "DEV"))?,
                    );
                }
                "--baud" => {
                    let given = words.next().ok_or(ArgumentError::NoValue("--baud", "N"))?;
                    let known = given
                        .parse()
                        .ok()
                        .filter(|baud| (1_200..=4_000_000).contains(baud));
                    baud = Some(known.ok_or(ArgumentError::Baud(given))?);
                }
                "--ros-args" => ros.parse(&mut words)?,
                option
                    if option.starts_with("--task-digest=")
                        || option.starts_with("--site-digest=") =>
                {
                    task_digest = option.split_once('=').map(|(_, digest)| digest.to_owned());
                }
                option if option.starts_with('-') => return Err(ArgumentError::Unknown(word)),
                _ => match table.replace(word) {
                    None => {}
                    Some(first) => {
                        return Err(ArgumentError::TwoTables(first, table.unwrap_or_default()));
                    }
                },
            }
        }
        let table = PathBuf::from(table.ok_or(ArgumentError::NoTable)?);
        let serial = match (serial, baud) {
            (None, Some(_)) => return Err(ArgumentError::BaudAlone),
            (serial, baud) => serial.map(|path| (PathBuf::from(path), baud.unwrap_or(115_200))),
        };
        let names = Names::new(&ros.remaps)?;
        let mut parameters = Parameters::default();
        for source in &ros.parameters {
            match source {
                Source::One(assignment) => parameters.assign(assignment, &names)?,
                Source::File(path) => {
                    let text = std::fs::read_to_string(path)
                        .map_err(|error| ArgumentError::File(path.clone(), error))?;
                    parameters.read(&text, path, &names)?;
                }
            }
        }
        Ok(Self::Run(Box::new(Arguments {
            table,
            task_digest,
            site: site.map(PathBuf::from),
            serial,
            parameters,
            names,
        })))
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

    fn parse(line: &str) -> Result<Command, ArgumentError> {
        Command::parse(line.split_whitespace().map(str::to_owned))
    }

    fn refused(line: &str) -> String {
        match parse(line) {
            Err(error) => error.to_string(),
            Ok(command) => panic!("{line}: {command:?}"),
        }
    }

    #[test]
    fn run_has_table_parameters_and_names() {
        let line = "dock.posegate --task-digest abc --ros-args -p inflation:=2.0 -r pose:=/filter/pose --log-level info -- ";
        let Ok(Command::Run(arguments)) = parse(line) else {
            panic!("{line}");
        };
        assert_eq!(arguments.table, PathBuf::from("dock.posegate"));
        assert_eq!(arguments.task_digest.as_deref(), Some("abc"));
        for older in [
            "a.posegate --site-digest abc",
            "a.posegate --site-digest=abc",
        ] {
            let Ok(Command::Run(arguments)) = parse(older) else {
                panic!("{older}");
            };
            assert_eq!(arguments.task_digest.as_deref(), Some("abc"));
        }
        assert_eq!(arguments.names.pose, "/filter/pose");
        assert!(arguments.parameters.get("inflation").is_some());
    }

    #[test]
    fn invalid_command_lines_have_their_own_errors() {
        for (line, words) in [
            ("", "no table is given"),
            ("a.posegate b.posegate", "two tables"),
            ("a.posegate --speed 3", "`--speed` is not an option"),
            ("a.posegate --task-digest", "needs a value"),
            ("a.posegate --serial", "needs a value"),
            ("a.posegate --site", "needs a value"),
            ("a.posegate --baud 9600", "without --serial"),
            ("a.posegate --serial /dev/ttyS0 --baud 1", "--baud is `1`"),
            ("a.posegate --ros-args -p", "needs a value"),
            ("a.posegate --ros-args -x", "not an argument of ROS"),
            ("a.posegate --ros-args -p inflation=2", ":="),
            (
                "a.posegate --ros-args --params-file /no/such.yaml",
                "cannot read the parameter file",
            ),
        ] {
            let message = refused(line);
            assert!(message.contains(words), "{line}: {message}");
        }
    }
}
