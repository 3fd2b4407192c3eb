//! The places of one planning problem.

use super::Library;
use super::library::{bounded, towards};
use super::problem::SearchProblem;
use posegate::contain::{Decision, decide};
use posegate::table::Table;

/// Returns the looks whose tables contain a pose.
pub(super) fn seen(library: &Library, tables: &[Table<'_>], pose: [f64; 3]) -> Vec<usize> {
    let Some(point) = bounded(pose, [1e-5, 1e-5]) else {
        return vec![];
    };
    let near = |index: &usize| {
        let look = &library.looks[*index];
        libm::hypot(look.centre[0] - pose[0], look.centre[1] - pose[1]) <= look.radius
    };
    let holds = |index: &usize| decide(&tables[*index], &point) == Decision::Inside;
    (0..tables.len()).filter(near).filter(holds).collect()
}

/// The places of one planning problem: those of the library, the start, those on the path, and the goal.
#[derive(Clone, Debug)]
pub(super) struct Roadmap {
    pub places: Vec<[f64; 3]>,
    /// The looks whose tables contain each place's pose.
    pub seen: Vec<Vec<usize>>,
    /// The successors of each place of the library.
    successors: Vec<Vec<usize>>,
    /// The number of places that belong to the library.
    fixed: usize,
    pub start: usize,
    /// The looks of the places between start and goal.
    nearer: Vec<usize>,
    /// Places from which the work may begin.
    pub ends: Vec<usize>,
}

impl Roadmap {
    /// Builds the roadmap for drives up to a range, from a start to the goal of a work task. Adds to the library's
    /// places with their looks and links. Every look within range of the goal gets a place nearer to it, for any
    /// number of other places. So more tags never remove a plan.
    pub fn of(
        library: &Library,
        tables: &[Table<'_>],
        (own_seen, own_leads): (&[Vec<usize>], &[Vec<usize>]),
        range: f64,
        work: &Table<'_>,
        [start, goal]: [[f64; 3]; 2],
    ) -> Self {
        let mut places: Vec<[f64; 3]> = library.views.iter().map(|view| view.pose).collect();
        let mut all_seen = own_seen.to_vec();
        let fixed = places.len();
        places.push(start);
        let mut nearest: Vec<(f64, usize)> = library
            .looks
            .iter()
            .enumerate()
            .map(|(index, look)| {
                let far = libm::hypot(look.centre[0] - goal[0], look.centre[1] - goal[1]);
                (far - look.radius, index)
            })
            .filter(|(far, _)| *far <= range)
            .collect();
        nearest.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let mut nearer = vec![];
        for (_, index) in nearest.into_iter() {
            let look = &library.looks[index];
            let first = library.views.iter().find(|view| view.look == index);
            let place = first.and_then(|view| towards(look, &tables[index], view.pose, goal));
            if let Some(place) = place {
                places.push(place);
                nearer.push(index);
            }
        }
        places.push(goal);
        for place in &places[fixed..] {
            all_seen.push(seen(library, tables, *place));
        }
        let last = places.len() - 1;
        let holds = |place: &usize| {
            let point = bounded(places[*place], [1e-5, 1e-5]);
            *place == last || point.is_some_and(|set| decide(work, &set) == Decision::Inside)
        };
        let ends = (0..places.len()).filter(holds).collect();
        Self {
            ends,
            successors: own_leads.to_vec(),
            start: fixed,
            fixed,
            nearer,
            seen: all_seen,
            places,
        }
    }

    /// Returns the successors and the predecessors of each place, including the places of this problem.
    pub fn with_dynamic(&self, question: &SearchProblem<'_>) -> (Vec<Vec<usize>>, Vec<Vec<usize>>) {
        let count = self.places.len();
        let mut successors = self.successors.clone();
        successors.resize(count, vec![]);
        for own in self.fixed..count {
            for (from, predecessors) in successors.iter_mut().enumerate().take(self.fixed) {
                if question.arrives(from, own) {
                    predecessors.push(own);
                }
            }
            successors[own] = (0..count).filter(|to| question.arrives(own, *to)).collect();
        }
        let mut predecessors = vec![vec![]; count];
        for (from, to) in successors.iter().enumerate() {
            for to in to {
                predecessors[*to].push(from);
            }
        }
        (successors, predecessors)
    }

    /// Keeps the looks that have a new number in `number`. Returns their part of the roadmap, and the places' new
    /// numbers.
    pub fn only(&self, library: &Library, number: &[Option<usize>]) -> (Self, Vec<Option<usize>>) {
        let stays = |place: usize| match library.views.get(place) {
            Some(view) => number[view.look].is_some(),
            None if place == self.start || place + 1 == self.places.len() => true,
            None => number[self.nearer[place - self.start - 1]].is_some(),
        };
        let mut renumbered = vec![None; self.places.len()];
        let mut kept = vec![];
        for (place, new) in renumbered.iter_mut().enumerate() {
            if stays(place) {
                *new = Some(kept.len());
                kept.push(place);
            }
        }
        let looks = |all: &[usize]| all.iter().filter_map(|look| number[*look]).collect();
        let fixed = kept.iter().filter(|place| **place < self.fixed).count();
        let map = Self {
            places: kept.iter().map(|place| self.places[*place]).collect(),
            seen: kept.iter().map(|place| looks(&self.seen[*place])).collect(),
            successors: vec![],
            fixed,
            start: fixed,
            nearer: looks(&self.nearer),
            ends: self
                .ends
                .iter()
                .filter_map(|place| renumbered[*place])
                .collect(),
        };
        (map, renumbered)
    }

    pub fn name_of(&self, place: usize, library: &Library, work: &str) -> String {
        match library.views.get(place) {
            Some(view) => view.name.clone(),
            None if place == self.start => "start".to_owned(),
            None if place + 1 == self.places.len() => work.to_owned(),
            None => {
                let look = self.nearer.get(place - self.start - 1);
                let name = look.map_or("", |look| &library.looks[*look].table.name);
                std::format!("{name}#near")
            }
        }
    }
}
