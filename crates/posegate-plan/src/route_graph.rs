//! The places of one planning problem, and the drives between them.

use super::Library;
use super::map::Roadmap;

/// The places of a planning problem, with the successors and the predecessors of each.
#[derive(Clone, Debug)]
pub(super) struct RouteGraph {
    pub map: Roadmap,
    pub successors: Vec<Vec<usize>>,
    pub predecessors: Vec<Vec<usize>>,
}

impl RouteGraph {
    /// Keeps the looks that have a new number in `number`, and their places.
    pub fn only(&self, library: &Library, number: &[Option<usize>]) -> Self {
        let (map, renumbered) = self.map.only(library, number);
        let part = |ways: &[Vec<usize>]| -> Vec<Vec<usize>> {
            let kept = ways
                .iter()
                .zip(&renumbered)
                .filter(|(_, new)| new.is_some());
            let to = |to: &usize| renumbered[*to];
            kept.map(|(list, _)| list.iter().filter_map(to).collect())
                .collect()
        };
        Self {
            successors: part(&self.successors),
            predecessors: part(&self.predecessors),
            map,
        }
    }
}
