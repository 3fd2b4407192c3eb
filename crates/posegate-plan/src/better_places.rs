//! Better places of a plan's looks, and chains with fewer looks, from places outside of the library.
//!
//! The library has a few places of each look: those where the look has the most slack. A cheaper chain may need other
//! places, for example at the limits of two bounds. A pattern search looks for such places. It tries the plan's looks,
//! the plan's looks without one of them, and single looks near the path. It only proposes: the places are added to the
//! library, and planning runs again, with its proofs.

use rayon::prelude::*;

use super::costs::distance;
use super::library::{facing, needed};
use super::problem::drive_to;
use super::{BeliefStateF64, Library, Options, Plan, StepKind};
use posegate::contain::{Decision, decide, decide_with_sharp_margin};
use posegate::set::PoseSet;
use posegate::table::Table;
use posegate_replay::factor;
use posegate_site::{ChainStart, DriveModel, Site};

/// A look, by number, and the place from which it is made.
type PlacedLook = (usize, [f64; 3]);

/// The problem whose plan is known.
pub(super) struct BetterPlaces<'a> {
    pub site: &'a Site,
    pub library: &'a Library,
    pub tables: &'a [Table<'a>],
    pub work: &'a Table<'a>,
    pub model: Option<DriveModel>,
    pub start: &'a ChainStart,
    pub begin: [f64; 3],
    pub goal: [f64; 3],
    pub options: &'a Options,
    /// The plan. The search compares costs over its cost, so it does not depend on their unit.
    pub plan: &'a Plan,
}

/// The share of the cost that better places of the same looks must save.
pub(super) const WORTH_IT: f64 = 0.005;

/// The scale at which sets must fit: the proofs and the core's integers need a little more than 1.
const SCALE: f64 = 1.02;

/// A value above all costs in use, for each set that does not fit: this many times the plan's cost.
const MISFIT: f64 = 1e6;

/// Places from which a pattern search begins.
const BEGINNINGS: usize = 3;

/// Single looks that are tried.
const SINGLES: usize = 6;

/// First steps of a pattern search, metres and radians, and the number of times that they are halved.
const STEPS: [f64; 2] = [0.4, 0.2];
const HALVINGS: u32 = 7;

impl BetterPlaces<'_> {
    /// Returns places from which cheaper chains with the plan's looks, or with fewer, may succeed, with their looks.
    pub fn places(&self) -> Vec<PlacedLook> {
        let looks = self.looks();
        let own: Vec<usize> = looks.iter().map(|(look, _)| *look).collect();
        // The library's places of a single look were as good wherever others were tried.
        if own.len() < 2 || !(self.plan.cost > 0.0) {
            return vec![];
        }
        let mut chains = vec![own.clone()];
        chains.extend((0..own.len()).map(|removed| {
            let mut others = own.clone();
            others.remove(removed);
            others
        }));
        chains.extend(self.singles().into_iter().map(|look| vec![look]));
        let mut tried: Vec<Vec<usize>> = vec![];
        let mut found: Vec<(f64, Vec<PlacedLook>)> = vec![];
        for chain in chains {
            if tried.contains(&chain) {
                continue;
            }
            let (value, places) = self.best(&chain, &looks);
            let saved = if chain == own { WORTH_IT } else { 1e-6 };
            if value < 1.0 - saved {
                found.push((value, chain.iter().copied().zip(places).collect()));
            }
            tried.push(chain);
        }
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        found.into_iter().flat_map(|(_, places)| places).collect()
    }

    /// The looks of the plan and their places.
    fn looks(&self) -> Vec<PlacedLook> {
        let looks = self.plan.steps.iter().map(|step| &step.report);
        let looks = looks.filter(|report| report.kind == StepKind::Localization);
        let looks = looks.filter_map(|report| {
            let known = self.library.looks.iter();
            let number = known
                .clone()
                .position(|look| Some(&look.table.name) == report.task.as_ref())?;
            Some((number, report.before.pose))
        });
        looks.collect()
    }

    /// The looks that may be cheaper alone than the plan, those nearest to the path first.
    fn singles(&self) -> Vec<usize> {
        let [begin, goal] = [self.begin, self.goal];
        let looks = self.library.looks.iter().enumerate();
        let mut near: Vec<(f64, usize)> = looks
            .map(|(number, look)| {
                let centre = [look.centre[0], look.centre[1], 0.0];
                let by = distance(begin, centre) + distance(centre, goal);
                (
                    (by - 2.0 * look.radius).max(distance(begin, goal)),
                    by,
                    number,
                )
            })
            .filter(|(least, ..)| self.price(*least, 1) < self.plan.cost)
            .map(|(_, by, number)| (by, number))
            .collect();
        near.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        near.truncate(SINGLES);
        near.into_iter().map(|(_, look)| look).collect()
    }

    fn price(&self, metres: f64, looks: usize) -> f64 {
        self.site.planner.metre * metres + self.site.planner.look_cost * looks as f64
    }

    /// Returns the best places found for a chain of looks, and the cost over that of the plan; at least [`MISFIT`] if the
    /// chain fails.
    fn best(&self, chain: &[usize], known: &[PlacedLook]) -> (f64, Vec<[f64; 3]>) {
        let mut begun: Vec<(f64, Vec<[f64; 3]>)> = self
            .beginnings(chain, known)
            .into_iter()
            .map(|places| (self.value(chain, &places, f64::INFINITY), places))
            .collect();
        begun.sort_by(|a, b| a.0.total_cmp(&b.0));
        begun.truncate(BEGINNINGS);
        // The descents are independent of each other, and take most of the time of a plan.
        let ends: Vec<(f64, Vec<[f64; 3]>)> = begun
            .into_par_iter()
            .map(|(value, mut places)| {
                let value = self.descend(chain, &mut places, value);
                (value, places)
            })
            .collect();
        let best = ends.into_iter().min_by(|a, b| a.0.total_cmp(&b.0));
        best.unwrap_or((f64::INFINITY, vec![]))
    }

    /// Returns places to begin with: those of the plan, and for a single look also those of the library and some on
    /// the straight path.
    fn beginnings(&self, chain: &[usize], known: &[PlacedLook]) -> Vec<Vec<[f64; 3]>> {
        let place = |look: &usize| {
            let own = known.iter().find(|(own, _)| own == look);
            let view = || self.library.views.iter().find(|view| view.look == *look);
            own.map(|(_, pose)| *pose)
                .or_else(|| view().map(|view| view.pose))
        };
        let all: Option<Vec<[f64; 3]>> = chain.iter().map(place).collect();
        let mut beginnings: Vec<Vec<[f64; 3]>> = all.into_iter().collect();
        let [look] = chain else {
            return beginnings;
        };
        let views = self.library.views.iter().filter(|view| view.look == *look);
        beginnings.extend(views.map(|view| vec![view.pose]));
        beginnings.extend(known.iter().map(|(_, pose)| vec![*pose]));
        let success = &self.library.looks[*look].table.success;
        for share in [0.0, 0.25, 0.5, 0.75, 0.9] {
            let along =
                |axis: usize| self.begin[axis] + share * (self.goal[axis] - self.begin[axis]);
            let pose = facing(success, [along(0), along(1)]);
            beginnings.extend(pose.map(|pose| vec![pose]));
        }
        beginnings
    }

    /// Moves the places, one axis at a time, while the value decreases.
    fn descend(&self, chain: &[usize], places: &mut [[f64; 3]], mut best: f64) -> f64 {
        let mut scale = 1.0;
        for _ in 0..HALVINGS {
            for _ in 0..6 {
                let before = best;
                for number in 0..places.len() {
                    for moved in self.moves(chain[number], places[number], scale) {
                        let kept = core::mem::replace(&mut places[number], moved);
                        let value = self.value(chain, places, best);
                        if value < best {
                            best = value;
                        } else {
                            places[number] = kept;
                        }
                    }
                }
                if best >= before - 1e-9 {
                    break;
                }
            }
            scale *= 0.5;
        }
        best
    }

    /// Returns poses near a pose: moved in its own axes, moved so that the tag keeps its place in the image, or
    /// turned.
    fn moves(&self, look: usize, pose: [f64; 3], scale: f64) -> Vec<[f64; 3]> {
        let success = &self.library.looks[look].table.success;
        let faced = |at: [f64; 3]| facing(success, [at[0], at[1]]);
        let mut moves = vec![];
        for sign in [-scale, scale] {
            for axis in 0..2 {
                let mut moved = pose;
                moved[axis] += sign * STEPS[0];
                moves.push(moved);
                if let (Some(before), Some(after)) = (faced(pose), faced(moved)) {
                    moved[2] += after[2] - before[2];
                    moves.push(moved);
                }
            }
            moves.push([pose[0], pose[1], pose[2] + sign * STEPS[1]]);
        }
        moves
    }

    /// Returns the cost of a chain over that of the plan. If sets do not fit or the risk is too high, the value is above
    /// all costs, and smaller the nearer the sets are to fitting. The value is infinite if it is known early that it is
    /// not below `best`.
    fn value(&self, chain: &[usize], places: &[[f64; 3]], best: f64) -> f64 {
        let stops = || places.iter().copied().chain([self.goal]);
        let starts = [self.begin].into_iter().chain(places.iter().copied());
        let metres = starts
            .zip(stops())
            .map(|(from, to)| distance(from, to))
            .sum();
        let cost = self.price(metres, chain.len()) / self.plan.cost;
        if cost >= best {
            return f64::INFINITY;
        }
        let mut belief = BeliefStateF64::at_start(self.begin, self.start.spread, &self.start.known);
        let (mut risk, mut misfit) = (0.0, 0.0);
        let looks = chain.iter().map(|look| Some(*look)).chain([None]);
        for (look, place) in looks.zip(stops()) {
            if belief.pose != place {
                if distance(belief.pose, place) > self.site.planner.range {
                    return f64::INFINITY;
                }
                let navigation = &self.site.navigation;
                let epsilon = self.start.epsilon(self.site);
                let Some(there) =
                    drive_to(&belief, place, self.model.as_ref(), navigation, epsilon)
                else {
                    return f64::INFINITY;
                };
                belief = there;
            }
            let table = look.map_or(self.work, |look| &self.tables[look]);
            let scale = SCALE * self.site.planner.least_margin();
            let missing = match needed(&belief, scale) {
                Some(set) if decide(table, &set) == Decision::Inside => 0.0,
                // Of chains that fit, only cheaper ones that fit are of use.
                _ if best < MISFIT => return f64::INFINITY,
                Some(set) => missing_scale(table, &set),
                None => 2.0,
            };
            misfit += missing;
            risk += belief.risk();
            if let Some(look) = look {
                let bound = self.library.looks[look].bound;
                risk += 1.0 - bound.coverage;
                belief = belief.localized(bound.metres_radians());
            }
        }
        if risk > self.options.most_risk {
            f64::INFINITY
        } else if misfit > 0.0 {
            MISFIT * (1.0 + misfit) + cost
        } else {
            cost
        }
    }
}

/// Returns the difference of the required scale and that of a set that does not fit.
fn missing_scale(table: &Table<'_>, set: &PoseSet) -> f64 {
    (1.0 - factor(decide_with_sharp_margin(table, set).1)).max(1e-3)
}
