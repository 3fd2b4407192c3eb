//! The last step of a cover: moves each chosen tag a little, to the place at which the tasks that look at it have the
//! most reserve.

use rayon::prelude::*;

use super::clearance::Place;
use super::oracle::Robustness;
use super::value::value;
use super::written::with_tags;
use super::{ChosenTag, Cover, CoverError, CoverOptions, Polished, Stage, TaskCoverage};
use crate::{PlanError, Plans};
use posegate::shape::{Pose3Deg, rotation};
use posegate_site::{ErrorBound, Site, StartUncertainty, TaskKind};

/// The shortest step that is tried, relative to the reach.
const FINEST: f64 = 0.125;
/// The ratio of consecutive reserves that are tried: the true reserve may be larger by this factor.
const WORTH: f64 = 1.02;
/// The largest reserve that is tried.
const MOST: f64 = 4.0;

/// Moves the chosen tags of a cover by up to `reach` metres along their own y and z axes (sideways and upwards on a
/// wall). The tags are moved one after the other, in the order of their names, if that raises the tag's
/// [reserve](Polished::reserve). A tag on a wall stays on its face, including its white border, and off the wall's
/// keep-outs. A free tag stays clear of walls and floor. No tag covers another. Then every task is planned again on
/// the complete site. If a task has no plan any more, the tags that it looked at are moved back.
///
/// `text` is the text of the site file that was covered. Returns `None` if candidates cannot be removed from it, as
/// for [`written`](super::written()).
///
/// # Errors
/// [`CoverError`].
pub fn polished(
    text: &str,
    file_name: &str,
    cover: &Cover,
    order: &CoverOptions,
    reach: f64,
    tick: &(dyn Fn(Stage, Option<usize>) + Sync),
) -> Result<Option<Cover>, CoverError> {
    if !(reach > 0.0 && reach <= 100.0) {
        return Err(CoverError::Number(std::format!(
            "tags are moved by metres, above 0 and at most 100, not {reach}"
        )));
    }
    let polish = Polish {
        text,
        file_name,
        cover,
        order,
        reach,
    };
    if polish.site(&cover.tags).is_none() {
        return Ok(None);
    }
    let mut tags = cover.tags.clone();
    for number in 0..tags.len() {
        if let Some(moved) = polish.moved(&tags, number)? {
            tags[number] = moved;
        }
        tick(Stage::Polish, Some(tags.len()));
    }
    // Reverts moves after which a task has no plan on the complete site.
    let mut found = loop {
        let Some(found) = polish.replanned(&tags, tick)? else {
            return Ok(None);
        };
        let lost = |task: &&TaskCoverage| {
            let needs = |tag: &ChosenTag| tag.needed_by.contains(&task.task);
            let needs = order.survive_a_lost_tag && found.tags.iter().any(needs);
            task.reason.is_none() && (task.planned.plan.is_none() || needs)
        };
        let lost: Vec<&TaskCoverage> = found.tasks.iter().filter(lost).collect();
        if lost.is_empty() {
            break found;
        }
        let mut undone = false;
        for (tag, first) in tags.iter_mut().zip(&cover.tags) {
            let looks = |task: &&TaskCoverage| task.looks_at(&tag.name);
            let before = cover.tasks.iter().filter(looks);
            let concerns = before
                .into_iter()
                .any(|task| lost.iter().any(|lost| lost.task == task.task));
            if concerns && tag.tag != first.tag {
                *tag = first.clone();
                undone = true;
            }
        }
        if !undone {
            return Ok(Some(cover.clone()));
        }
    };
    // Other tags may have moved since a tag's reserve was computed.
    let reserves = found.tags.par_iter().map(|tag| {
        let group = polish.group(tag);
        if group.is_empty() {
            return Ok(None);
        }
        polish.reserve(&found.tags, &group, 1.0).map(Some)
    });
    let reserves: Vec<Option<f64>> = reserves.collect::<Result<_, PlanError>>()?;
    for (tag, reserve) in found.tags.iter_mut().zip(reserves) {
        if let (Some(reserve), Some(polished)) = (reserve, &mut tag.polished) {
            polished.reserve[1] = reserve;
        }
    }
    Ok(Some(found))
}

struct Polish<'a> {
    text: &'a str,
    file_name: &'a str,
    cover: &'a Cover,
    order: &'a CoverOptions,
    reach: f64,
}

impl Polish<'_> {
    /// Returns the site with the tags mounted; its digest is that of the original site.
    fn site(&self, tags: &[ChosenTag]) -> Option<Site> {
        let site = Site::parse(&with_tags(self.text, tags), self.file_name).ok()?;
        Some(Site {
            digest: self.cover.site.digest,
            ..site
        })
    }

    /// Returns the cover with the given tags, with every served task planned again on the complete site.
    fn replanned(
        &self,
        tags: &[ChosenTag],
        tick: &(dyn Fn(Stage, Option<usize>) + Sync),
    ) -> Result<Option<Cover>, PlanError> {
        let Some(site) = self.site(tags) else {
            return Ok(None);
        };
        let mut found = Cover {
            tags: tags.to_vec(),
            site,
            ..self.cover.clone()
        };
        let options = self.order.options();
        {
            let mut plans = Plans::of(&found.site);
            for task in found.tasks.iter_mut().filter(|task| task.reason.is_none()) {
                if let Some(planned) = plans.plan(&task.from, &task.task, &options)? {
                    task.planned = planned;
                }
                tick(Stage::Check, Some(self.cover.tasks.len()));
            }
        }
        let kind = if self.order.survive_a_lost_tag {
            Robustness::Survives
        } else {
            Robustness::Plain
        };
        value(&mut found, &options, kind)?;
        Ok(Some(found))
    }

    /// Returns the served tasks whose plans look at a tag.
    fn group(&self, tag: &ChosenTag) -> Vec<&TaskCoverage> {
        let tasks = self.cover.tasks.iter();
        tasks
            .filter(|task| task.reason.is_none() && task.looks_at(&tag.name))
            .collect()
    }

    /// Returns the tag at the place with the most reserve; `None` if it is not moved.
    fn moved(&self, tags: &[ChosenTag], number: usize) -> Result<Option<ChosenTag>, PlanError> {
        let tag = &tags[number];
        let group = self.group(tag);
        if group.is_empty() {
            return Ok(None);
        }
        let first = tag.tag.tag.pose;
        let Some(place) = Place::of(&self.cover.site, &tag.tag) else {
            return Ok(None);
        };
        let before = self.reserve(tags, &group, 1.0)?;
        if before < 1.0 {
            return Ok(None);
        }
        let mut best = before;
        let mut at = [0.0, 0.0];
        let mut step = 0.5 * self.reach;
        while step >= FINEST * self.reach {
            let ways = [[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]];
            let trials: Vec<([f64; 2], f64)> = ways
                .into_par_iter()
                .map(|direction| {
                    let to = [at[0] + step * direction[0], at[1] + step * direction[1]];
                    let beyond = to.iter().any(|by| by.abs() > self.reach * (1.0 + 1e-9));
                    let pose = along(first, to);
                    let chosen = |name: &str| tags.iter().any(|tag| tag.name == name);
                    let mounted = self.cover.site.tags.iter();
                    let mounted = mounted
                        .filter(|(name, _)| !chosen(name))
                        .map(|(_, tag)| tag);
                    let others = tags
                        .iter()
                        .enumerate()
                        .filter(|(other, _)| *other != number);
                    let others = others.map(|(_, tag)| &tag.tag);
                    if beyond || !place.holds(pose, mounted.chain(others)) {
                        return Ok((to, 0.0));
                    }
                    let mut tags = tags.to_vec();
                    tags[number].tag.tag.pose = pose;
                    Ok((to, self.reserve(&tags, &group, best * WORTH)?))
                })
                .collect::<Result<_, PlanError>>()?;
            // The first, if several are equal.
            let better = trials
                .into_iter()
                .reduce(|a, b| if b.1 > a.1 { b } else { a });
            match better {
                Some((to, reserve)) if reserve > best => (at, best) = (to, reserve),
                _ => step *= 0.5,
            }
        }
        let mut moved = tag.clone();
        moved.tag.tag.pose = along(first, at);
        moved.polished = Some(Polished {
            moved: at,
            reserve: [before, best],
        });
        Ok(Some(moved))
    }

    /// Returns the reserve of a group of tasks, in steps of [`WORTH`], using only the chosen tags that they looked at
    /// before. Returns 0 if the reserve is below `least`.
    fn reserve(
        &self,
        tags: &[ChosenTag],
        group: &[&TaskCoverage],
        least: f64,
    ) -> Result<f64, PlanError> {
        let Some(mut site) = self.site(tags) else {
            return Ok(0.0);
        };
        let chosen = |name: &str| tags.iter().any(|tag| tag.name == name);
        let keeps = |name: &str| !chosen(name) || group.iter().any(|task| task.looks_at(name));
        site.tags.retain(|name, _| keeps(name));
        site.planner.looks.retain(|_, look| keeps(&look.tag));
        let has = |name: &str| group.iter().any(|task| task.task == name);
        site.tasks
            .retain(|name, task| task.kind != TaskKind::Work || has(name));
        let serves = |factor: f64| {
            let site = with_errors(&site, factor);
            let mut plans = Plans::of(&site);
            for task in group {
                let planned = plans.plan(&task.from, &task.task, &self.order.options());
                let planned = match planned {
                    Ok(planned) => planned,
                    // The scaled errors are too large for a look, or for its table.
                    Err(PlanError::BoundTooLarge { .. } | PlanError::Table { .. }) => None,
                    Err(error) => return Err(error),
                };
                if planned.is_none_or(|planned| planned.plan.is_none()) {
                    return Ok(false);
                }
            }
            Ok(true)
        };
        if !serves(least)? {
            return Ok(0.0);
        }
        // Search with growing steps, then with shrinking ones.
        let step = |doublings: u32| libm::pow(WORTH, f64::from(1u32 << doublings));
        let (mut low, mut doublings) = (least, 0);
        while low < MOST && serves(low * step(doublings))? {
            low *= step(doublings);
            doublings += 1;
        }
        for doublings in (0..doublings).rev() {
            if low < MOST && serves(low * step(doublings))? {
                low *= step(doublings);
            }
        }
        Ok(low)
    }
}

/// Returns the site with the errors of all starts and looks scaled by a factor.
fn with_errors(site: &Site, factor: f64) -> Site {
    let mut with = site.clone();
    let larger = |bound: &mut ErrorBound| {
        bound.translation *= factor;
        bound.yaw_deg = (bound.yaw_deg * factor).min(180.0);
    };
    for chain in with.chains.values_mut() {
        match &mut chain.start.known {
            StartUncertainty::Bounded {
                translation,
                yaw_deg,
            } => {
                *translation *= factor;
                *yaw_deg = (*yaw_deg * factor).min(180.0);
            }
            StartUncertainty::Gaussian { covariance, .. } => {
                for entry in covariance.iter_mut().flatten() {
                    *entry *= factor * factor;
                }
            }
        }
    }
    for look in with.planner.looks.values_mut() {
        larger(&mut look.bound);
    }
    for task in with.tasks.values_mut() {
        if let Some(bound) = &mut task.error_bound {
            larger(bound);
        }
    }
    with
}

/// Returns a pose moved along its own y and z axes, metres.
fn along(pose: Pose3Deg, [y, z]: [f64; 2]) -> Pose3Deg {
    let rows: [[f64; 3]; 3] = rotation(pose.roll_deg, pose.pitch_deg, pose.yaw_deg);
    let by = rows.map(|row| row[1] * y + row[2] * z);
    Pose3Deg {
        x: pose.x + by[0],
        y: pose.y + by[1],
        z: pose.z + by[2],
        ..pose
    }
}
