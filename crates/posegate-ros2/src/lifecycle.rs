//! The states of a managed node, as `lifecycle_msgs` numbers them. A node that is not active denies.
//!
//! Source: the design "Managed nodes" of ROS 2 (<https://design.ros2.org/articles/node_lifecycle.html>), without its error processing: no
//! transition of this node can fail.

use serde::{Deserialize, Serialize};

/// A number with its name: `lifecycle_msgs/msg/State` and `Transition`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Labelled {
    /// The number.
    pub id: u8,
    /// The name.
    pub label: String,
}

/// `lifecycle_msgs/msg/TransitionDescription`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct TransitionDescription {
    /// The transition.
    pub transition: Labelled,
    /// The state before.
    pub start_state: Labelled,
    /// The state after.
    pub goal_state: Labelled,
}

/// A state of a managed node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum State {
    /// Nothing is set up: the state of a managed node at its start.
    Unconfigured = 1,
    /// The node receives, and denies.
    Inactive = 2,
    /// The gate decides. A node that is not managed is always in this state.
    Active = 3,
    /// The node ends.
    Finalized = 4,
}

/// A transition: its number, its name, and the states before and after it.
type Transition = (u8, &'static str, State, State);

const TRANSITIONS: [Transition; 7] = [
    (1, "configure", State::Unconfigured, State::Inactive),
    (2, "cleanup", State::Inactive, State::Unconfigured),
    (3, "activate", State::Inactive, State::Active),
    (4, "deactivate", State::Active, State::Inactive),
    (5, "shutdown", State::Unconfigured, State::Finalized),
    (6, "shutdown", State::Inactive, State::Finalized),
    (7, "shutdown", State::Active, State::Finalized),
];

impl State {
    const ALL: [Self; 4] = [
        Self::Unconfigured,
        Self::Inactive,
        Self::Active,
        Self::Finalized,
    ];

    /// Returns the number and the name of the state.
    #[must_use]
    pub fn labelled(self) -> Labelled {
        let label = match self {
            Self::Unconfigured => "unconfigured",
            Self::Inactive => "inactive",
            Self::Active => "active",
            Self::Finalized => "finalized",
        };
        labelled(self as u8, label)
    }

    /// Returns the state after a transition, of which one of number 0 is looked up by its name; `None` if the node cannot make it from this state.
    #[must_use]
    pub fn after(self, wanted: &Labelled) -> Option<Self> {
        let mut possible = self.transitions();
        let found = possible.find(|(id, label, ..)| match wanted.id {
            0 => *label == wanted.label,
            wanted => *id == wanted,
        });
        found.map(|(.., to)| to)
    }

    /// Returns all states.
    #[must_use]
    pub fn all() -> Vec<Labelled> {
        Self::ALL.map(Self::labelled).into()
    }

    /// Returns the transitions from this state.
    #[must_use]
    pub fn available(self) -> Vec<TransitionDescription> {
        let described = |(id, label, from, to): Transition| TransitionDescription {
            transition: labelled(id, label),
            start_state: from.labelled(),
            goal_state: to.labelled(),
        };
        self.transitions().map(described).collect()
    }

    fn transitions(self) -> impl Iterator<Item = Transition> {
        TRANSITIONS
            .into_iter()
            .filter(move |(_, _, from, _)| *from == self)
    }
}

fn labelled(id: u8, label: &str) -> Labelled {
    Labelled {
        id,
        label: label.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_manager_brings_the_node_up_and_down() {
        let mut state = State::Unconfigured;
        for (id, next) in [
            (1, State::Inactive),
            (3, State::Active),
            (4, State::Inactive),
            (2, State::Unconfigured),
            (5, State::Finalized),
        ] {
            state = state.after(&labelled(id, "")).unwrap();
            assert_eq!(state, next);
        }
        assert_eq!(state.available(), []);
    }

    /// No other transition reaches the state in which the gate decides.
    #[test]
    fn only_activate_makes_a_node_active() {
        for state in State::ALL {
            for id in 0..=u8::MAX {
                for label in ["configure", "activate", "shutdown", "unknown"] {
                    let active = state.after(&labelled(id, label)) == Some(State::Active);
                    let asked = id == 3 || id == 0 && label == "activate";
                    assert_eq!(
                        active,
                        state == State::Inactive && asked,
                        "{state:?} {id} {label}"
                    );
                }
            }
        }
    }
}
