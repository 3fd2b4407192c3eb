//! The planner's library: looks at tags, and the viewpoints of the looks.

use std::collections::BTreeSet;

use rayon::prelude::*;

use super::{BeliefStateF64, PlanError, TaskTable};
use posegate::contain::{Decision, decide};
use posegate::set::{Estimate, PoseSet};
use posegate::shape::{Shape, SuccessSet, Visibility};
use posegate::table::Table;
use posegate::task::wrapped;
use posegate_site::{ErrorBound, Site, TableOverrides};

/// A look with its viewpoints, or the reason why it has none.
type MadeLook = Result<(Look, Vec<Viewpoint>), PlanError>;

/// A localization task that the planner can choose.
#[derive(Clone, Debug)]
pub struct Look {
    /// The table of the poses from where the look succeeds. Its name is the task's, or that of the tag for which the
    /// look was made.
    pub table: TaskTable,
    /// The names of the tags that the look needs or may need; `id N` if the site has no such tag.
    pub tags: Vec<String>,
    /// The largest error r_l, and the share of observations within it.
    pub bound: ErrorBound,
    /// x and y of the look's tag (or its goal), metres, world frame.
    pub centre: [f64; 2],
    /// Largest distance from the centre at which the look may be useful, metres.
    pub radius: f64,
}

/// A place from which a look is made.
#[derive(Clone, Debug, PartialEq)]
pub struct Viewpoint {
    /// Pose in the world: m, m, rad.
    pub pose: [f64; 3],
    /// The viewpoint's name: the look's name and a number.
    pub name: String,
    /// The look's index in [`Library::looks`].
    pub look: usize,
}

/// Looks and their viewpoints.
#[derive(Clone, Debug)]
pub struct Library {
    /// The looks, in the order of their names.
    pub looks: Vec<Look>,
    /// The viewpoints.
    pub views: Vec<Viewpoint>,
}

impl Library {
    /// Creates the library of a site: its localization tasks, and the looks that `[planner]` makes for every tag.
    ///
    /// # Errors
    /// [`PlanError::NoLooks`] if the site has no look; [`PlanError::Table`], [`PlanError::Unbounded`] or
    /// [`PlanError::Epsilon`] if a set has no table; [`PlanError::BoundTooLarge`] if a look's error bound does not fit
    /// into its own success set.
    pub fn of(site: &Site) -> Result<Self, PlanError> {
        Self::with(site, false, &|_| true)
    }

    /// Like [`Library::of`], with only the looks for whose success set `keeps` returns `true`.
    ///
    /// # Errors
    /// Those of [`Library::of`].
    pub(super) fn part(
        site: &Site,
        keeps: &dyn Fn(&SuccessSet) -> bool,
    ) -> Result<Self, PlanError> {
        Self::with(site, false, keeps)
    }

    /// Like [`Library::of`], with the looks that `[planner]` makes for every candidate. Omits candidates' looks that
    /// succeed from no pose.
    ///
    /// # Errors
    /// Those of [`Library::of`].
    pub fn with_candidates(site: &Site) -> Result<Self, PlanError> {
        Self::with(site, true, &|_| true)
    }

    /// Parses the table of every look.
    pub(super) fn tables(&self) -> Result<Vec<Table<'_>>, PlanError> {
        let tables = self.looks.iter();
        tables.map(|look| look.table.table()).collect()
    }

    fn with(
        site: &Site,
        candidates: bool,
        keeps: &dyn Fn(&SuccessSet) -> bool,
    ) -> Result<Self, PlanError> {
        let own = site.tasks.iter().filter_map(|(name, task)| {
            let bound = task.error_bound?;
            let tags = tags(site, &task.success.shape);
            Some((name, None, &task.success, tags, bound, task.wish))
        });
        let offered = candidates.then_some(&site.planner.offers);
        let made = site
            .planner
            .looks
            .iter()
            .chain(offered.into_iter().flatten());
        let made = made.map(|(name, made)| {
            let tags = vec![made.tag.clone()];
            let of = Some(&made.tag);
            (
                name,
                of,
                &made.success,
                tags,
                made.bound,
                TableOverrides::default(),
            )
        });
        let orders = own.chain(made).filter(|(_, _, success, ..)| keeps(success));
        let orders: Vec<_> = orders.collect();
        if orders.is_empty() {
            return Err(PlanError::NoLooks(site.tags.len()));
        }
        let made: Vec<(Option<&String>, MadeLook)> = orders
            .into_par_iter()
            .map(|(name, of, success, tags, bound, wish)| {
                let table = TaskTable::baked(site, name, success, wish);
                (of, table.and_then(|table| look(site, table, tags, bound)))
            })
            .collect();
        // A tag that cannot be seen well enough from anywhere is an error for a task, but not for a candidate. The
        // planner makes several looks at one tag, with different error bounds: one usable look is enough.
        let seen: BTreeSet<&String> = made
            .iter()
            .filter(|(_, found)| found.is_ok())
            .filter_map(|(of, _)| *of)
            .collect();
        let is_optional = |tag: &String| !site.tags.contains_key(tag) || seen.contains(tag);
        let mut library = Self {
            looks: vec![],
            views: vec![],
        };
        for (of, found) in made {
            let (look, views) = match found {
                Ok(found) => found,
                Err(error) if of.is_some_and(is_optional) && error.is_empty_look() => continue,
                Err(error) => return Err(error),
            };
            let own = library.looks.len();
            library.looks.push(look);
            let views = views
                .into_iter()
                .map(|view| Viewpoint { look: own, ..view });
            library.views.extend(views);
        }
        Ok(library)
    }
}

impl Library {
    /// Returns the looks for which `keeps` is `true`, with their viewpoints.
    #[must_use]
    pub fn only(&self, keeps: impl Fn(&Look) -> bool) -> Self {
        let mut number = vec![None; self.looks.len()];
        let mut looks = vec![];
        for (index, look) in self.looks.iter().enumerate() {
            if keeps(look) {
                number[index] = Some(looks.len());
                looks.push(look.clone());
            }
        }
        let kept = |view: &Viewpoint| {
            number[view.look].map(|look| Viewpoint {
                look,
                ..view.clone()
            })
        };
        Self {
            looks,
            views: self.views.iter().filter_map(kept).collect(),
        }
    }
}

/// Returns the names of the tags in a set. Compares id, size and pose, because tags of two families may share an id.
fn tags(site: &Site, shape: &Shape) -> Vec<String> {
    match shape {
        Shape::Any(sets) | Shape::All(sets) => {
            let mut all: Vec<String> = sets.iter().flat_map(|set| tags(site, set)).collect();
            all.sort();
            all.dedup();
            all
        }
        other => {
            let seen = other.visibility().map(|view| view.tag);
            let named = seen.map(|tag| {
                let mut known = site.tags.iter().filter(|(_, known)| known.tag == tag);
                let name = known.next().map(|(name, _)| name.clone());
                name.unwrap_or_else(|| format!("id {}", tag.id))
            });
            named.into_iter().collect()
        }
    }
}

fn look(
    site: &Site,
    table: TaskTable,
    tags: Vec<String>,
    bound: ErrorBound,
) -> Result<(Look, Vec<Viewpoint>), PlanError> {
    let (centre, radius) = region(&table.success);
    let most = site.planner.views as usize;
    let places = places(
        &table.success,
        &table.table()?,
        bound.metres_radians(),
        most,
    );
    if places.iter().all(|(_, slack)| *slack < 1.0) {
        return Err(PlanError::BoundTooLarge {
            task: table.name,
            translation: bound.translation,
            yaw_deg: bound.yaw_deg,
        });
    }
    let views = places
        .into_iter()
        .enumerate()
        .map(|(number, (pose, _))| Viewpoint {
            pose,
            name: format!("{}#{}", table.name, number + 1),
            look: 0,
        })
        .collect();
    let look = Look {
        table,
        tags,
        bound,
        centre,
        radius,
    };
    Ok((look, views))
}

/// Returns the position of a look's tag (or its goal), and the largest distance from it at which the look may be
/// useful, metres.
pub(super) fn region(success: &SuccessSet) -> ([f64; 2], f64) {
    match farthest_view(&success.shape) {
        Some(view) => {
            let arm = libm::hypot(view.mount.x, view.mount.y);
            ([view.tag.pose.x, view.tag.pose.y], view.d_max + arm)
        }
        None => ([success.goal.x, success.goal.y], 134.0),
    }
}

/// Returns the pose of a robot at a position whose camera faces a look's tag. `None` if the look is not at exactly
/// one tag.
pub(super) fn facing(success: &SuccessSet, [x, y]: [f64; 2]) -> Option<[f64; 3]> {
    let view = farthest_view(&success.shape)?;
    let bearing = libm::atan2(view.tag.pose.y - y, view.tag.pose.x - x);
    Some([x, y, wrapped(bearing - view.mount.yaw_deg.to_radians())])
}

/// Returns the view with the largest range, if all views are of one tag by one camera. A learnt model makes several
/// such views.
fn farthest_view(shape: &Shape) -> Option<&Visibility> {
    fn views<'a>(shape: &'a Shape, into: &mut Vec<&'a Visibility>) {
        match shape {
            Shape::Visibility(view) | Shape::Bounded { view, .. } => into.push(view),
            Shape::Any(sets) | Shape::All(sets) => sets.iter().for_each(|set| views(set, into)),
            _ => {}
        }
    }
    let mut all = vec![];
    views(shape, &mut all);
    let first = *all.first()?;
    all.iter()
        .all(|view| view.tag == first.tag && view.mount == first.mount)
        .then(|| {
            let farther = |a: &'_ &Visibility, b: &'_ &Visibility| a.d_max.total_cmp(&b.d_max);
            all.iter().copied().max_by(farther)
        })?
}

/// Returns the largest scale, at most 64, at which the set with `bound` about a pose fits. Returns 0 if the pose
/// itself is outside.
pub(super) fn slack(table: &Table<'_>, pose: [f64; 3], bound: [f64; 2]) -> f64 {
    let holds = |scale: f64| {
        bounded(pose, bound.map(|v| v * scale))
            .is_some_and(|set| decide(table, &set) == Decision::Inside)
    };
    if !holds(1e-3) {
        return 0.0;
    }
    let (mut low, mut high) = (1e-3, 64.0);
    for _ in 0..12 {
        let middle = libm::sqrt(low * high);
        if holds(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    low
}

pub(super) fn bounded([x_m, y_m, yaw_rad]: [f64; 3], [m, rad]: [f64; 2]) -> Option<PoseSet> {
    PoseSet::bounded(Estimate { x_m, y_m, yaw_rad }, m, rad).ok()
}

/// Returns the set that must fit for a belief. Its lengths are scaled by `wider` and by a small factor that covers
/// the core's roundings.
pub(super) fn needed(belief: &BeliefStateF64, wider: f64) -> Option<PoseSet> {
    let [x_m, y_m, yaw_rad] = belief.pose;
    let estimate = Estimate { x_m, y_m, yaw_rad };
    if let Some(random) = &belief.random
        && belief.certain == [0.0, 0.0]
        && belief.spread == [0.0, 0.0]
    {
        let wider = random.covariance * (wider * wider)
            + nalgebra::Matrix3::from_diagonal(&nalgebra::Vector3::new(1e-8, 1e-8, 1e-9));
        let radius = posegate::confidence::core_radius(random.epsilon)?;
        let rows: [[f64; 3]; 3] = wider.transpose().into();
        return PoseSet::gaussian(estimate, rows, radius).ok();
    }
    let [rho, alpha] = belief.enclosing();
    bounded(
        belief.pose,
        [
            (rho + belief.spread[0]) * wider + 1e-4,
            (alpha + belief.spread[1]) * wider + 1e-5,
        ],
    )
}

/// Returns the places from which a look has the most slack for its own error bound, best first, with that scale.
fn places(
    success: &SuccessSet,
    table: &Table<'_>,
    bound: [f64; 2],
    most: usize,
) -> Vec<([f64; 3], f64)> {
    // A probe of a minimum size: it prefers places with slack in position and in heading to places with slack in only
    // one.
    let probe = [bound[0].max(0.05), bound[1].max(0.02)];
    let mut found: Vec<([f64; 3], f64)> = candidates(success)
        .into_iter()
        .map(|pose| (pose, slack(table, pose, probe)))
        .filter(|(_, slack)| *slack > 0.0)
        .collect();
    let best_first = |found: &mut Vec<([f64; 3], f64)>| {
        found.sort_by(|a, b| b.1.total_cmp(&a.1));
    };
    best_first(&mut found);
    found.truncate(4 * most);
    for (pose, slack_there) in &mut found {
        climb(table, probe, pose, slack_there);
    }
    best_first(&mut found);
    let mut kept: Vec<([f64; 3], f64)> = vec![];
    for (pose, _) in found {
        let near = |other: &([f64; 3], f64)| {
            libm::hypot(other.0[0] - pose[0], other.0[1] - pose[1]) < 0.4
                && (other.0[2] - pose[2]).abs() < 0.35
        };
        if kept.len() < most && !kept.iter().any(near) {
            kept.push((pose, slack(table, pose, bound)));
        }
    }
    kept
}

/// Climbs to a pose with more slack, by coordinate steps that are halved each round.
fn climb(table: &Table<'_>, probe: [f64; 2], pose: &mut [f64; 3], best: &mut f64) {
    let mut step = [0.2, 0.2, 0.1];
    for _ in 0..4 {
        for axis in 0..3 {
            for sign in [-1.0, 1.0] {
                let mut tried = *pose;
                tried[axis] += sign * step[axis];
                let there = slack(table, tried, probe);
                if there > *best * 1.001 {
                    (*pose, *best) = (tried, there);
                }
            }
        }
        step = step.map(|v| v / 2.0);
    }
}

/// Returns candidate poses: the goal and, for a tag, a fan of distances and bearings with the camera facing the tag.
fn candidates(success: &SuccessSet) -> Vec<[f64; 3]> {
    let goal = success.goal;
    let mut poses = vec![[goal.x, goal.y, goal.yaw_deg.to_radians()]];
    let Some(view) = farthest_view(&success.shape) else {
        return poses;
    };
    let (tag, mount) = (view.tag.pose, view.mount);
    // A tag on the ceiling or the floor faces no direction in the plane.
    let level = libm::cos(tag.pitch_deg.to_radians()).abs() > 0.5;
    let bearings: Vec<f64> = if level {
        (-3..=3).map(|k| f64::from(k) * 0.35).collect()
    } else {
        (0..12)
            .map(|k| f64::from(k) * core::f64::consts::TAU / 12.0)
            .collect()
    };
    for share in [0.12, 0.25, 0.4, 0.55, 0.7, 0.85] {
        let distance = share * view.d_max;
        for bearing in &bearings {
            let from = tag.yaw_deg.to_radians() + bearing;
            let (s, c) = (libm::sin(from), libm::cos(from));
            let camera = [tag.x + distance * c, tag.y + distance * s];
            // The camera faces the tag; subtract its mounting pose on the robot.
            let yaw = from + core::f64::consts::PI - mount.yaw_deg.to_radians();
            let (s, c) = (libm::sin(yaw), libm::cos(yaw));
            poses.push([
                camera[0] - c * mount.x + s * mount.y,
                camera[1] - s * mount.x - c * mount.y,
                wrapped(yaw),
            ]);
        }
    }
    poses
}

/// Returns a viewpoint that is as near to `goal` as possible, with slack for four times the look's own error. `None`
/// if `from` has no such slack or the place is not nearer.
pub(super) fn towards(
    look: &Look,
    table: &Table<'_>,
    from: [f64; 3],
    goal: [f64; 3],
) -> Option<[f64; 3]> {
    let view = farthest_view(&look.table.success.shape)?;
    let at = |share: f64| {
        let place = [
            from[0] + share * (goal[0] - from[0]),
            from[1] + share * (goal[1] - from[1]),
        ];
        let bearing = libm::atan2(view.tag.pose.y - place[1], view.tag.pose.x - place[0]);
        let yaw = wrapped(bearing - view.mount.yaw_deg.to_radians());
        [place[0], place[1], yaw]
    };
    let fits = |share: f64| slack(table, at(share), look.bound.metres_radians()) >= 4.0;
    if !fits(0.0) {
        return None;
    }
    let (mut low, mut high) = (0.0, 1.0);
    if fits(1.0) {
        return Some(at(1.0));
    }
    for _ in 0..6 {
        let middle = 0.5 * (low + high);
        if fits(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    (low > 0.05).then(|| at(low))
}
