//! The input of a search for a plan, and its elementary questions.

use super::BeliefStateF64;
use super::StopSignal;
use super::costs::{Costs, distance};
use super::horizons::Horizons;
use super::library::{Library, needed};
use posegate::contain::{Decision, decide};
use posegate::set::Estimate;
use posegate::table::Table;
use posegate::task::Leg;
use posegate_site::{DriveModel, Navigation};

/// The input of a search.
pub(super) struct SearchProblem<'a> {
    pub library: &'a Library,
    pub tables: &'a [Table<'a>],
    /// Places: the library's, and those of this problem. The goal is the last one.
    pub places: &'a [[f64; 3]],
    pub work: &'a Table<'a>,
    pub navigation: &'a Navigation,
    pub model: Option<DriveModel>,
    pub epsilon: f64,
    pub costs: &'a Costs,
    pub range: f64,
    pub most_risk: f64,
    /// The factor by which the sets of beliefs are widened.
    pub wider: f64,
    /// The places at which a robot with a known pose may begin the work. The goal is one of them.
    pub ends: &'a [usize],
    /// The looks whose success set contains each place's pose.
    pub seen: &'a [Vec<usize>],
    /// The successors of each place: those at which, at best, a robot arrives well enough to look.
    pub successors: &'a [Vec<usize>],
    /// The predecessors of each place.
    pub predecessors: &'a [Vec<usize>],
    /// The number of labels that may be taken from the queue.
    pub limit: usize,
    /// Ends the search as the limit does.
    pub stop: &'a StopSignal,
    /// `true` if dominated labels are dropped; else only equal labels are dropped.
    pub prunes_dominated: bool,
    /// The costs to go that were already computed.
    pub horizons: &'a Horizons,
}

impl SearchProblem<'_> {
    /// Returns `true` if a task may begin with a belief.
    pub(super) fn fits(&self, table: &Table<'_>, belief: &BeliefStateF64) -> bool {
        needed(belief, self.wider).is_some_and(|set| decide(table, &set) == Decision::Inside)
    }

    /// Returns the belief after a straight drive to a place, by number; `None` without a drive model.
    pub(super) fn drive(&self, belief: &BeliefStateF64, to: usize) -> Option<BeliefStateF64> {
        drive_to(
            belief,
            self.places[to],
            self.model.as_ref(),
            self.navigation,
            self.epsilon,
        )
    }

    /// Returns `true` if a look needs none of the tags of the banned look.
    pub(super) fn allowed(&self, look: usize, banned: Option<usize>) -> bool {
        let tags = |look: usize| &self.library.looks[look].tags;
        banned.is_none_or(|lost| {
            look != lost && !tags(look).iter().any(|tag| tags(lost).contains(tag))
        })
    }

    /// Returns `true` if a place is within the range of a drive.
    pub(super) fn is_near(&self, place: usize, to: usize) -> bool {
        distance(self.places[place], self.places[to]) <= self.range
    }
}

/// Returns the belief after a straight drive to a place; `None` without a drive model.
pub(super) fn drive_to(
    belief: &BeliefStateF64,
    to: [f64; 3],
    model: Option<&DriveModel>,
    navigation: &Navigation,
    epsilon: f64,
) -> Option<BeliefStateF64> {
    let pose = |[x_m, y_m, yaw_rad]: [f64; 3]| Estimate { x_m, y_m, yaw_rad };
    Some(belief.driven(
        &pose(belief.pose),
        &[Leg::Straight(pose(to))],
        model?,
        epsilon,
        belief.spread,
        navigation.controller,
    ))
}
