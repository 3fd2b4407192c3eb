//! A plan on the controller: rules of (state, condition on the pose-set, next task), executed on top of gates.
//!
//! The host makes the rules of a plan (`posegate plan --rules`). Each rule states where the estimate may be when its
//! step begins and how large the pose-set may be: the conditions for which the plan was proven. A [`Sequencer`] keeps
//! the state and takes the step whose condition holds. The state's own condition fails if the set is larger than
//! expected, or the robot was moved by hand. Then it searches another entry of the plan whose condition holds. If
//! there is none, it inhibits.
//!
//! A sequencer does not permit anything. Before a look or a work task the task's own [`Gate`](crate::gate::Gate)
//! decides, on its table, with all of its checks. A sequencer only selects the gate to ask, and the reaction if the task
//! fails: retry, continue without the tag, or stop.
//!
//! ```
//! use posegate::sequencer::{Instruction, Rules, RulesError, Sequencer};
//! use posegate::set::PoseSet;
//!
//! /// Executes a plan. `set` returns the current pose-set, the other three act and return `true` on success.
//! fn run(
//!     rules: &[u8],
//!     mut set: impl FnMut() -> PoseSet,
//!     mut work_when_permitted: impl FnMut(&str) -> bool,
//!     mut look_when_permitted: impl FnMut(&str, u32) -> bool,
//!     mut drive: impl FnMut(posegate::pose::Pose) -> bool,
//! ) -> Result<(), RulesError> {
//!     let mut sequencer = Sequencer::new(Rules::parse(rules)?);
//!     loop {
//!         let has_succeeded = match sequencer.next(&set()) {
//!             // The gate of the task decides, on the task's own table.
//!             Instruction::Look { task, tag } => look_when_permitted(task, tag),
//!             Instruction::Work { task } => work_when_permitted(task),
//!             Instruction::Drive { to } => drive(to),
//!             Instruction::Inhibit(_) => return Ok(()),
//!         };
//!         if has_succeeded {
//!             sequencer.succeeded();
//!         } else {
//!             sequencer.failed();
//!         }
//!     }
//! }
//! # let refused = run(b"", || unreachable!(), |_| false, |_, _| false, |_| false);
//! # assert_eq!(refused, Err(RulesError::Length));
//! ```

use crate::pose::Pose;
use crate::set::PoseSet;
use crate::task::{Cylinder, MotionUpdate, enclosing};

#[cfg(feature = "std")]
pub use self::rules::{HEAD, MAGIC, NAME, NONE, RULE, VERSION};
pub use self::rules::{Kind, NO_TAG, Rule, Rules, RulesError};

mod rules;

/// The next step to take.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[must_use]
pub enum Instruction<'a> {
    /// Ask the gate of this task; if it permits, look at the tag. Afterwards the estimate is the observation.
    Look {
        /// The task's name.
        task: &'a str,
        /// The tag's number.
        tag: u32,
    },
    /// Drive to a pose.
    Drive {
        /// Target pose, world frame.
        to: Pose,
    },
    /// Ask the gate of this task; if it permits, do the task.
    Work {
        /// The task's name.
        task: &'a str,
    },
    /// Do nothing.
    Inhibit(StopReason),
}

/// Why the sequencer stops.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum StopReason {
    /// The work is done.
    Done,
    /// A task failed as often as its rule allows and the plan has no alternative, or a condition failed more than
    /// 1,000 times.
    GaveUp,
    /// No entry of the plan is proven for the pose-set.
    NoEntry,
}

messages!(no error StopReason {
    Done => "the work is done",
    GaveUp => "a task failed as often as its rule allows, and the plan has no alternative",
    NoEntry => "no entry of the plan is proven for the pose-set",
});

/// Position in a plan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
enum State {
    /// Before the rule with this number.
    Before(u16),
    Ended(StopReason),
}

/// A plan ends after this number of failed conditions, so that it cannot repeat without end.
const MOST_SURPRISES: u16 = 1_000;

/// Executes the rules of a plan.
#[derive(Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Sequencer<'a> {
    rules: Rules<'a>,
    state: State,
    tries: u8,
    /// The tag that was not seen; no further look at it is tried.
    lost: Option<u32>,
    surprises: u16,
}

impl<'a> Sequencer<'a> {
    /// Creates a sequencer before the plan's first step.
    #[must_use]
    pub const fn new(rules: Rules<'a>) -> Self {
        Self {
            rules,
            state: State::Before(0),
            tries: 0,
            lost: None,
            surprises: 0,
        }
    }

    /// Returns the next step for the current pose-set.
    ///
    /// Cost: one comparison per rule if the state's own rule does not hold.
    pub fn next(&mut self, set: &PoseSet) -> Instruction<'a> {
        let number = match self.state {
            State::Ended(why) => return Instruction::Inhibit(why),
            State::Before(number) => number,
        };
        if let Some(rule) = self.rules.get(number)
            && self.holds(&rule, set)
        {
            return self.instruction(&rule);
        }
        // The condition does not hold: use another entry of the plan. The last entry is tried first, because it is nearest to the work.
        self.surprises = self.surprises.saturating_add(1);
        if self.surprises > MOST_SURPRISES {
            self.state = State::Ended(StopReason::GaveUp);
            return Instruction::Inhibit(StopReason::GaveUp);
        }
        let mut found = None;
        for number in (0..self.rules.count()).rev() {
            if let Some(rule) = self.rules.get(number)
                && self.holds(&rule, set)
            {
                found = Some((number, rule));
                break;
            }
        }
        match found {
            Some((number, rule)) => {
                self.state = State::Before(number);
                self.tries = 0;
                self.instruction(&rule)
            }
            None => Instruction::Inhibit(StopReason::NoEntry),
        }
    }

    /// Reports that the last instruction succeeded: after a drive or a look the plan continues, after the work it ends.
    pub fn succeeded(&mut self) {
        if let State::Before(number) = self.state {
            self.tries = 0;
            self.state = match self.rules.get(number) {
                Some(rule) if rule.kind == Kind::Work => State::Ended(StopReason::Done),
                Some(rule) => State::Before(rule.then),
                None => State::Ended(StopReason::GaveUp),
            };
        }
    }

    /// Reports that the last instruction failed: the tag was not seen, the gate did not permit, or the drive was
    /// stopped. The step is repeated as often as its rule allows; then the plan continues without the tag, or ends.
    pub fn failed(&mut self) {
        if let State::Before(number) = self.state {
            let Some(rule) = self.rules.get(number) else {
                self.state = State::Ended(StopReason::GaveUp);
                return;
            };
            self.tries = self.tries.saturating_add(1);
            if self.tries < rule.attempts {
                return;
            }
            self.tries = 0;
            if rule.kind == Kind::Look && rule.tag != NO_TAG {
                self.lost = Some(rule.tag);
            }
            self.state = match rule.otherwise {
                Some(number) => State::Before(number),
                None => State::Ended(StopReason::GaveUp),
            };
        }
    }

    /// Returns the number of the next rule; `None` at the end.
    #[must_use]
    pub const fn rule(&self) -> Option<u16> {
        match self.state {
            State::Before(number) => Some(number),
            State::Ended(_) => None,
        }
    }

    /// Returns how often a state's own rule did not hold.
    #[must_use]
    pub const fn surprises(&self) -> u16 {
        self.surprises
    }

    /// Returns the rules.
    #[must_use]
    pub const fn rules(&self) -> &Rules<'a> {
        &self.rules
    }

    /// Returns `true` if a rule's step is proven for a pose-set.
    fn holds(&self, rule: &Rule, set: &PoseSet) -> bool {
        if rule.kind == Kind::Look && self.lost == Some(rule.tag) {
            return false;
        }
        let off = MotionUpdate::off(rule.place, set.mean(), Cylinder::POINT);
        off.is_some_and(|off| rule.spread.holds(off))
            && enclosing(set).is_some_and(|set| rule.set.holds(set))
    }

    fn instruction(&self, rule: &Rule) -> Instruction<'a> {
        match (rule.kind, self.rules.name(rule.task)) {
            (Kind::Drive, _) => Instruction::Drive { to: rule.to },
            (Kind::Look, Some(task)) => Instruction::Look {
                task,
                tag: rule.tag,
            },
            (Kind::Work, Some(task)) => Instruction::Work { task },
            // Parsed rules have the names that they refer to.
            (_, None) => Instruction::Inhibit(StopReason::NoEntry),
        }
    }
}
