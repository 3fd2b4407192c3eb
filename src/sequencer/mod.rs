//! A plan on the controller: rules of (state, condition on the pose-set, next task), executed on top of gates.
//!
//! The host makes the rules of a plan (`posegate plan --rules`). Each says where the estimate may be when its step
//! begins and how large its pose-set may be: what the plan was proven for. A [`Sequencer`] keeps the state, takes the
//! step whose condition holds, and where none of the state's holds (the set is larger than expected, the robot was
//! carried away) looks for another entry of the plan that holds: or inhibits.
//!
//! A sequencer does not permit anything. Before a look or a work task the task's own [`Gate`](crate::gate::Gate)
//! decides, on its table, with all of its checks; a sequencer only says which one to ask, and what to do when the
//! task fails: again, on without the tag, or give up.
//!
//! ```text
//! loop {
//!     match sequencer.next(&set) {
//!         Instruction::Look { task, .. } | Instruction::Work { task } => ask the gate of that task; when it permits, do it
//!         Instruction::Drive { to } => drive there
//!         Instruction::Inhibit(_) => stop
//!     }
//!     sequencer.succeeded() or sequencer.failed()
//! }
//! ```

use crate::pose::Pose;
use crate::set::PoseSet;
use crate::task::{Cylinder, MotionUpdate, enclosing};

#[cfg(feature = "std")]
pub use self::rules::{HEAD, MAGIC, NAME, NONE, RULE, VERSION};
pub use self::rules::{Kind, NO_TAG, Rule, Rules, RulesError};

mod rules;

/// What to do next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[must_use]
pub enum Instruction<'a> {
    /// Ask the gate of this task; when it permits, look at the tag. After it the estimate is the observation.
    Look {
        /// The task's name.
        task: &'a str,
        /// The tag's number.
        tag: u32,
    },
    /// Drive there.
    Drive {
        /// World frame.
        to: Pose,
    },
    /// Ask the gate of this task; when it permits, do it.
    Work {
        /// The task's name.
        task: &'a str,
    },
    /// Do nothing.
    Inhibit(StopReason),
}

/// Why nothing is to be done.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum StopReason {
    /// The work is done.
    Done,
    /// A task failed as often as it may, and the plan has no other way; or it was surprised a thousand times.
    GaveUp,
    /// The pose-set is one that no entry of the plan is proven for.
    NoEntry,
}

/// Where a plan stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
enum State {
    /// Before a rule, by number.
    Before(u16),
    Ended(StopReason),
}

/// Surprises after which a plan is given up: one that is surprised for ever leads nowhere.
const MOST_SURPRISES: u16 = 1_000;

/// Executes the rules of a plan.
#[derive(Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Sequencer<'a> {
    rules: Rules<'a>,
    state: State,
    tries: u8,
    /// The tag that was not seen: it is not looked at again.
    lost: Option<u32>,
    surprises: u16,
}

impl<'a> Sequencer<'a> {
    /// Before the plan's first step.
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

    /// What to do next, with what is known now.
    ///
    /// Cost: one comparison a rule, where the state's own rule does not hold.
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
        // A surprise: another entry of the plan, the latest first, for it is the nearest to the work.
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

    /// The step that was told last has been done: drives and looks lead on, work ends the plan.
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

    /// The step that was told last has failed: the tag was not seen, the gate did not permit, the drive was stopped.
    /// It is tried as often as its rule says; then the plan goes on without the tag, or gives up.
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

    /// The number of the rule that comes next; `None` at the end.
    #[must_use]
    pub const fn rule(&self) -> Option<u16> {
        match self.state {
            State::Before(number) => Some(number),
            State::Ended(_) => None,
        }
    }

    /// How often a state's own rule did not hold.
    #[must_use]
    pub const fn surprises(&self) -> u16 {
        self.surprises
    }

    /// The rules.
    #[must_use]
    pub const fn rules(&self) -> &Rules<'a> {
        &self.rules
    }

    /// Whether a rule's step is proven for a pose-set.
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
            // Rules that were parsed have the names that they refer to.
            (_, None) => Instruction::Inhibit(StopReason::NoEntry),
        }
    }
}
