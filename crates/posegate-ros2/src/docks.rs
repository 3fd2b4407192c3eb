//! The tables of a built site, and the gate of the task that is asked for.
//!
//! [`read`] reads the folder of `posegate site merge`. [`DockGate`] decides on one of its tasks at a time: on none at
//! first, and on none if the name is unknown. A change of the task closes before the other table is used.

use crate::arguments::Arguments;
use crate::clock::Now;
use crate::decider::Decider;
use crate::diagnostics::explanation;
use crate::markers::markers;
use crate::message::{
    AprilTagDetectionArray, CameraInfo, DiagnosticStatus, KeyValue, Marker, Odometry,
};
use crate::permission::report_values;
use crate::permit_gate::{Answer, Origin, PermitGate};
use crate::poses::PoseReport;
use crate::settings::{NodeSettings, SettingsError};
use crate::tags::Tags;
use posegate::gate::{InvalidParameter, Reason, Settings, State, self_test};
use posegate::table::Table;
use serde::Deserialize;
use std::error::Error;
use std::path::Path;

/// The list of a built site's files.
const MANIFEST: &str = "manifest.json";

/// A table, and the settings of the node with it.
#[derive(Debug)]
pub struct Dock {
    /// The bytes of the table.
    pub table: Vec<u8>,
    /// The settings.
    pub settings: NodeSettings,
}

/// The reason why a folder is refused.
#[derive(Debug, thiserror::Error)]
pub enum DocksError {
    /// The folder has no manifest.
    #[error(
        "{folder} is not a built site: {cause}; `posegate site build SITE -o {folder}` and `posegate site merge {folder}` make it"
    )]
    NotBuilt {
        /// The folder.
        folder: String,
        /// The cause.
        cause: String,
    },
    /// A table cannot be read, or is not the one that was built.
    #[error("the table {file} {cause}: merge the site again (`posegate site merge`)")]
    Damaged {
        /// The file.
        file: String,
        /// The cause.
        cause: String,
    },
    /// An argument is for one table.
    #[error(
        "{0} is given with a folder of a built site: it is for one table; leave it out, and ask for a task on posegate_task"
    )]
    OneTable(&'static str),
    /// A setting is refused.
    #[error("task `{task}`: {error}")]
    Settings {
        /// The task.
        task: String,
        /// The error.
        error: Box<SettingsError>,
    },
}

impl Dock {
    /// Reads a table that is given alone.
    ///
    /// # Errors
    /// The file cannot be read, or [`SettingsError`].
    pub fn read(arguments: &Arguments) -> Result<Self, Box<dyn Error>> {
        let table = std::fs::read(&arguments.table).map_err(|error| {
            let path = arguments.table.display();
            format!("cannot read the table {path}: {error}")
        })?;
        let settings = NodeSettings::new(arguments, &table)?;
        Ok(Self { table, settings })
    }
}

#[derive(Deserialize)]
struct Manifest {
    files: Vec<File>,
}

#[derive(Deserialize)]
struct File {
    path: String,
    sha256: String,
}

/// Reads the tables of a built site, each with its settings.
///
/// # Errors
/// [`DocksError`]
pub fn read(arguments: &Arguments) -> Result<Vec<Dock>, DocksError> {
    let parameter = |name| arguments.parameters.get(name).is_some();
    for (is_given, name) in [
        (arguments.task_digest.is_some(), "--task-digest"),
        (arguments.serial.is_some(), "--serial"),
        (parameter("task"), "the parameter `task`"),
        (parameter("task_digest"), "the parameter `task_digest`"),
        (parameter("site_digest"), "the parameter `site_digest`"),
        (parameter("look_at"), "the parameter `look_at`"),
    ] {
        if is_given {
            return Err(DocksError::OneTable(name));
        }
    }
    let folder = arguments.table.as_path();
    let not_built = |cause: String| DocksError::NotBuilt {
        folder: folder.display().to_string(),
        cause,
    };
    let manifest = folder.join(MANIFEST);
    let text = std::fs::read_to_string(&manifest)
        .map_err(|error| not_built(format!("{}: {error}", manifest.display())))?;
    // JSON is YAML.
    let listed: Manifest = serde_norway::from_str(&text)
        .map_err(|error| not_built(format!("{}: {error}", manifest.display())))?;
    let tables = listed.files.iter();
    let tables = tables.filter(|file| file.path.starts_with("tables/"));
    let docks = tables.map(|file| dock(folder, file, arguments));
    let mut docks = docks.collect::<Result<Vec<Dock>, DocksError>>()?;
    if docks.is_empty() {
        return Err(not_built("it has no table".into()));
    }
    // Poses are converted before the task is known: by the widest set of all.
    let radii = docks.iter().map(|dock| dock.settings.poses.radius_squared);
    let widest = radii.fold(0.0, f64::max);
    for dock in &mut docks {
        dock.settings.poses.radius_squared = widest;
    }
    Ok(docks)
}

fn dock(folder: &Path, listed: &File, arguments: &Arguments) -> Result<Dock, DocksError> {
    let path = folder.join(&listed.path);
    let damaged = |cause: String| DocksError::Damaged {
        file: path.display().to_string(),
        cause,
    };
    let table =
        std::fs::read(&path).map_err(|error| damaged(format!("cannot be read ({error})")))?;
    let parsed =
        Table::parse(&table).map_err(|error| damaged(format!("is not a table ({error})")))?;
    let task = parsed.task().to_owned();
    let settings = NodeSettings::new(arguments, &table);
    let mut settings = settings.map_err(|error| DocksError::Settings {
        task,
        error: Box::new(error),
    })?;
    if settings.table() != listed.sha256 {
        return Err(damaged(format!("is not the one that {MANIFEST} lists")));
    }
    settings.site_is_checked = true;
    // Each table has its own.
    settings.parameters.leave_out("task");
    Ok(Dock { table, settings })
}

/// The task that is asked for.
#[derive(Debug)]
enum Asked<'a> {
    Nothing,
    Unknown(String),
    Task(usize, Box<PermitGate<'a>>),
}

/// A gate that changes its table.
#[derive(Debug)]
pub struct DockGate<'a> {
    docks: &'a [Dock],
    gates: &'a [Settings<'a>],
    asked: Asked<'a>,
    /// What the self-test or the last gate says: a latched fault outlives a change of the task.
    is_sound: Result<(), Reason>,
    camera_info: Option<CameraInfo>,
    takes_tasks: bool,
}

impl<'a> DockGate<'a> {
    /// Returns a gate without a task. `gates` are the settings of the docks, in their order.
    #[must_use]
    pub fn new(docks: &'a [Dock], gates: &'a [Settings<'a>]) -> Self {
        Self {
            docks,
            gates,
            asked: Asked::Nothing,
            is_sound: self_test(),
            camera_info: None,
            takes_tasks: true,
        }
    }

    /// Returns a gate that decides on the first task alone.
    ///
    /// # Errors
    /// [`InvalidParameter`] if a setting would disable a check.
    pub fn alone(
        docks: &'a [Dock],
        gates: &'a [Settings<'a>],
        now: Now,
    ) -> Result<Self, InvalidParameter> {
        let mut gate = Self::new(docks, gates);
        if let Some(first) = gate.changed(now, 0) {
            gate.asked = Asked::Task(0, Box::new(first?));
            gate.takes_tasks = false;
        }
        Ok(gate)
    }

    fn gate(&self) -> Option<&PermitGate<'a>> {
        match &self.asked {
            Asked::Task(_, gate) => Some(gate),
            _ => None,
        }
    }

    /// Passes a call to the gate of the task; without a task the answer is a denial.
    fn with(&mut self, now: Now, call: impl FnOnce(&mut PermitGate<'a>) -> Answer) -> Answer {
        match &mut self.asked {
            Asked::Task(_, gate) => call(gate),
            _ => Answer {
                now,
                is_open: false,
                state: State::Inhibited(Reason::WrongTask),
            },
        }
    }

    /// Returns the gate of a task, closed.
    fn changed(&self, now: Now, at: usize) -> Option<Result<PermitGate<'a>, InvalidParameter>> {
        let (dock, gate) = (self.docks.get(at)?, self.gates.get(at)?);
        let gate = PermitGate::new(self.is_sound, &dock.table, &dock.settings, gate, now);
        Some(gate.map(|mut gate| {
            if let Some(info) = &self.camera_info {
                gate.camera_info(Some(info));
            }
            gate
        }))
    }
}

impl Decider for DockGate<'_> {
    fn pose(&mut self, now: Now, message: &PoseReport, origin: Origin) -> Answer {
        self.with(now, |gate| gate.pose(now, message, origin))
    }

    fn detections(&mut self, now: Now, message: &AprilTagDetectionArray, origin: Origin) -> Answer {
        self.with(now, |gate| gate.detections(now, message, origin))
    }

    fn camera_info(&mut self, message: Option<&CameraInfo>) {
        self.camera_info = message.cloned();
        if let Asked::Task(_, gate) = &mut self.asked {
            gate.camera_info(message);
        }
    }

    fn odometry(&mut self, now: Now, message: &Odometry, origin: Origin) -> Answer {
        self.with(now, |gate| gate.odometry(now, message, origin))
    }

    fn odometry_lost(&mut self, now: Now) -> Answer {
        self.with(now, |gate| gate.odometry_lost(now))
    }

    fn tick(&mut self, now: Now) -> Answer {
        self.with(now, |gate| {
            gate.scrub();
            gate.tick(now)
        })
    }

    fn inhibit(&mut self, now: Now, reason: Reason) -> Answer {
        self.with(now, |gate| gate.inhibit(now, reason))
    }

    fn reset(&mut self, now: Now) -> Result<String, String> {
        if let Asked::Task(_, gate) = &mut self.asked {
            gate.reset(now).map_err(|error| error.to_string())?;
            return Ok("the gate was reset: it is closed, and qualifies again".into());
        }
        self.is_sound = self_test();
        Ok("no task is asked for: the next gate starts without a fault of earlier ones".into())
    }

    fn report(&self) -> Vec<KeyValue> {
        let last = self.gate().and_then(PermitGate::last);
        last.map(report_values).into_iter().flatten().collect()
    }

    fn frame(&self) -> Option<&str> {
        Some(&self.gate()?.last()?.frame)
    }

    fn diagnostics(&self, _: Now) -> Vec<DiagnosticStatus> {
        let tags = self.gate().and_then(PermitGate::tags);
        tags.map(Tags::status).into_iter().collect()
    }

    fn explain(&self, answer: &Answer, hint: Option<&str>) -> String {
        let gate = self.gate();
        let last = gate.and_then(PermitGate::last);
        let words = explanation(answer, last.and_then(|last| last.step.err()), hint);
        match gate.and_then(PermitGate::tags).and_then(Tags::problem) {
            Some(problem) if !answer.is_open => format!("{words} Detections: {problem}."),
            _ => words,
        }
    }

    fn markers(&self, answer: &Answer) -> Option<Vec<Marker>> {
        let gate = self.gate()?;
        Some(markers(answer, gate.last()?, gate.gate().table().ok()?))
    }

    fn takes_tasks(&self) -> bool {
        self.takes_tasks
    }

    fn ask(&mut self, now: Now, name: &str) {
        let is_named = |dock: &Dock| dock.settings.task() == name;
        let found = self.docks.iter().position(is_named);
        if let Asked::Task(at, gate) = &mut self.asked {
            if Some(*at) == found {
                return;
            }
            let _ = gate.inhibit(now, Reason::WrongTask);
            self.is_sound = gate.gate().is_sound();
        }
        self.asked = match found.and_then(|at| Some((at, self.changed(now, at)?))) {
            Some((at, Ok(gate))) => Asked::Task(at, Box::new(gate)),
            _ if name.is_empty() => Asked::Nothing,
            // Settings were checked at the start, so a task without a gate is an unknown one.
            _ => Asked::Unknown(name.into()),
        };
    }

    fn chosen<'s>(&'s self, _: &'s NodeSettings) -> Option<&'s NodeSettings> {
        match &self.asked {
            Asked::Task(at, _) => self.docks.get(*at).map(|dock| &dock.settings),
            _ => None,
        }
    }

    fn problem(&self) -> Option<String> {
        let names: Vec<&str> = self.docks.iter().map(|dock| dock.settings.task()).collect();
        let names = names.join(", ");
        match &self.asked {
            Asked::Nothing => Some(format!(
                "no task is asked for: publish its name on posegate_task; the tasks of the site are {names}"
            )),
            Asked::Unknown(name) => Some(format!(
                "the task `{name}` that is asked for is not in the site: its tasks are {names}"
            )),
            Asked::Task(..) => None,
        }
    }
}

#[cfg(test)]
mod tests;
