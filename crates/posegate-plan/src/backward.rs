//! Backward pass from the work task: the places from which it is reachable, and a lower bound of the cost from each.

use std::collections::BinaryHeap;

use super::BeliefStateF64;
use super::costs::distance;
use super::library::needed;
use super::problem::SearchProblem;
use super::queue::Queued;
use posegate::contain::{Decision, decide};
use posegate::table::Table;

/// Scale factors for a belief's set. A larger set is tried if the set itself does not fit.
const LARGER: [f64; 7] = [1.0, 1.15, 1.3, 1.6, 2.0, 2.6, 3.5];

impl SearchProblem<'_> {
    /// Returns the belief after a look, exact at a place: no belief at that place is better.
    fn at_best(&self, place: usize, look: usize) -> BeliefStateF64 {
        let bound = self.library.looks[look].bound.metres_radians();
        BeliefStateF64 {
            pose: self.places[place],
            spread: bound,
            certain: bound,
            doubt: 0.0,
            random: None,
        }
    }

    /// Yields the first of all looks with the same error, because their best results are equal.
    fn distinct<'s>(&'s self, looks: &'s [usize]) -> impl Iterator<Item = usize> + 's {
        let bound = |look: usize| self.library.looks[look].bound;
        looks.iter().enumerate().filter_map(move |(at, look)| {
            let known = looks[..at]
                .iter()
                .any(|other| bound(*other) == bound(*look));
            (!known).then_some(*look)
        })
    }

    /// Returns `true` if a task may begin with a belief, or with a larger one. The facet test uses several levers: a
    /// smaller set may fail it although a larger set passes. This bound must not exclude a belief that the search can
    /// still use.
    fn may_fit(&self, table: &Table<'_>, belief: &BeliefStateF64) -> bool {
        LARGER.into_iter().any(|larger| {
            let set = needed(belief, self.wider * larger);
            set.is_some_and(|set| decide(table, &set) == Decision::Inside)
        })
    }

    /// Returns `true` if, at best, some look at one place can be followed by a look at another place.
    pub fn arrives(&self, from: usize, to: usize) -> bool {
        if distance(self.places[from], self.places[to]) > self.range {
            return false;
        }
        self.distinct(&self.seen[from]).any(|look| {
            let best = self.at_best(from, look);
            self.drive(&best, to).is_some_and(|there| {
                let mut next = self.seen[to].iter();
                next.any(|look| self.may_fit(&self.tables[*look], &there))
            })
        })
    }

    /// Returns the least cost from each place (before a look there) to the end of the work.
    pub(super) fn to_go(&self, banned: Option<usize>) -> Vec<f64> {
        let mut cost = vec![f64::INFINITY; self.places.len()];
        let allowed = |look: &usize| self.allowed(*look, banned);
        let mut queue = BinaryHeap::new();
        let push =
            |queue: &mut BinaryHeap<Queued>, cost: &mut Vec<f64>, place: usize, value: f64| {
                if value < cost[place] {
                    cost[place] = value;
                    queue.push(Queued {
                        bound: value,
                        label: place,
                        done: false,
                    });
                }
            };
        // Places from which the work can begin on arrival.
        for place in self.ends {
            push(&mut queue, &mut cost, *place, 0.0);
        }
        // The last look, and the drive to the goal (or no drive).
        for place in 0..self.places.len() {
            let looks: Vec<usize> = self.seen[place].iter().copied().filter(allowed).collect();
            for look in self.distinct(&looks) {
                let best = self.at_best(place, look);
                let stays = self.may_fit(self.work, &best);
                if stays {
                    push(&mut queue, &mut cost, place, self.costs.look);
                }
                for end in self.ends.iter().copied() {
                    let near = distance(self.places[place], self.places[end]) <= self.range;
                    let there = near.then(|| self.drive(&best, end)).flatten();
                    if there.is_some_and(|there| self.may_fit(self.work, &there)) {
                        let value = self.costs.look + self.costs.drive(place, end, self.places);
                        push(&mut queue, &mut cost, place, value);
                    }
                }
            }
        }
        // Drives between places. A robot may arrive at a place after any look at the place before.
        while let Some(Queued {
            bound, label: to, ..
        }) = queue.pop()
        {
            if bound > cost[to] {
                continue;
            }
            for from in self.predecessors[to].iter().copied() {
                let value = bound + self.costs.look + self.costs.drive(from, to, self.places);
                push(&mut queue, &mut cost, from, value);
            }
        }
        cost
    }
}
