//! A robot that executes the plan of `examples/sites/contingent.toml` through a script of events: the first tag is not
//! seen, twice; the wheels slip before the dock; at the end the pose is unknown. Prints one line per step. Run by
//! the firmware example `contingent_plan` under emulation, and by `crates/posegate-plan/tests/contingent_plan.rs` on
//! the host, which compares the lines.

use core::fmt::{Error, Write};
use posegate::contain::{Decision, decide};
use posegate::pose::Pose;
use posegate::sequencer::{Instruction, Rules, Sequencer};
use posegate::set::{Estimate, PoseSet};
use posegate::table::Table;

pub static RULES: &[u8] = include_bytes!("../tables/contingent.rules");
pub static TABLES: [&[u8]; 3] = [
    include_bytes!("../tables/see-left.posegate"),
    include_bytes!("../tables/see-right.posegate"),
    include_bytes!("../tables/contingent-dock.posegate"),
];

/// The event of a step: the distance of the estimate from the start of the rule's step, the size of the set, and whether
/// the step succeeds.
struct Event {
    off_m: f64,
    translation_m: f64,
    yaw_rad: f64,
    succeeds: bool,
}

const fn event(off_m: f64, translation_m: f64, yaw_rad: f64, succeeds: bool) -> Event {
    Event {
        off_m,
        translation_m,
        yaw_rad,
        succeeds,
    }
}

const EVENTS: [Event; 11] = [
    // From the start to the view of the left tag.
    event(0.05, 0.39, 0.034, true),
    // The left tag is not seen, twice.
    event(0.004, 0.45, 0.04, false),
    event(0.004, 0.45, 0.04, false),
    // To the view of the right tag.
    event(0.004, 0.45, 0.04, true),
    event(0.004, 0.46, 0.042, true),
    // The drive to the dock. The wheels slip, and the robot reports it.
    event(0.1, 0.05, 0.034, true),
    event(-1.0, 0.3, 0.04, true),
    // Look again, drive again, dock.
    event(0.1, 0.05, 0.034, true),
    event(0.003, 0.07, 0.05, true),
    event(0.003, 0.07, 0.05, true),
    // The robot was lifted and put down: its pose is unknown.
    event(0.0, 3.0, 3.0, true),
];

fn set(place: Pose, event: &Event) -> Option<PoseSet> {
    let metres = |um: i32| f64::from(um) / 1e6;
    let yaw_rad = f64::from(place.yaw.signed()) / 4_294_967_296.0 * core::f64::consts::TAU;
    let estimate = Estimate {
        x_m: metres(place.x_um) + event.off_m,
        y_m: metres(place.y_um),
        yaw_rad,
    };
    PoseSet::bounded(estimate, event.translation_m, event.yaw_rad).ok()
}

/// Returns `Some(true)` if the table of a task contains a set; `None` if there is no such table.
fn permits(task: &str, set: &PoseSet) -> Option<bool> {
    let mut tables = TABLES.iter().filter_map(|bytes| Table::parse(bytes).ok());
    let table = tables.find(|table| table.task() == task)?;
    Some(decide(&table, set) == Decision::Inside)
}

pub fn run(out: &mut impl Write) -> Result<(), Error> {
    let rules = Rules::parse(RULES).map_err(|_| Error)?;
    let mut plan = Sequencer::new(rules);
    let mut at = Pose::default();
    // After an unexpected event the robot stays at its place.
    for (number, event) in EVENTS.iter().enumerate() {
        if event.off_m >= 0.0
            && let Some(rule) = plan.rule().and_then(|rule| plan.rules().get(rule))
        {
            at = rule.place;
        }
        let kept = Event {
            off_m: event.off_m.max(0.0),
            ..*event
        };
        let set = set(at, &kept).ok_or(Error)?;
        let instruction = plan.next(&set);
        write!(out, "{number}: ")?;
        let permitted = match instruction {
            Instruction::Look { task, tag } => {
                write!(out, "look at tag {tag} ({task})")?;
                permits(task, &set)
            }
            Instruction::Work { task } => {
                write!(out, "work ({task})")?;
                permits(task, &set)
            }
            Instruction::Drive { to } => {
                write!(out, "drive to {} um, {} um, {}", to.x_um, to.y_um, to.yaw.0)?;
                None
            }
            Instruction::Inhibit(why) => {
                write!(out, "inhibit ({why:?})")?;
                None
            }
        };
        match permitted {
            Some(true) => write!(out, ", permitted")?,
            Some(false) => write!(out, ", DENIED")?,
            None => {}
        }
        writeln!(out, ", surprises {}", plan.surprises())?;
        if event.succeeds && permitted != Some(false) {
            plan.succeeded();
        } else {
            plan.failed();
        }
    }
    Ok(())
}
