//! The last step of a cover: each chosen tag is moved a little, to where the tasks that look at it have the most reserve.

use std::vec::Vec;

use rayon::prelude::*;

use super::oracle::Kind;
use super::value::value;
use super::written::with_tags;
use super::{ChosenTag, Cover, CoverError, Order, Polished, Served, Stage};
use crate::place::{Space, WITH_WHITE};
use crate::plan::{PlanError, Plans};
use crate::shape::{Pose3Deg, rotation};
use crate::site::{ErrorBound, Known, Site, TaskKind};

/// The shortest step that is tried, as a share of the reach.
const FINEST: f64 = 0.125;
/// Steps in which a reserve is looked for: by so much it may be larger than it is told.
const WORTH: f64 = 1.02;
/// The largest reserve that is looked for.
const MOST: f64 = 4.0;
/// How near to a wall a tag is taken to hang on it, metres.
const ON_A_WALL: f64 = 0.02;

/// A cover whose chosen tags are moved by up to `reach` metres along their own y and z axes (sidewards and upwards on a
/// wall), one after the other in the order of their names, as long as that raises the tag's [reserve](Polished::reserve). A tag on a wall stays on its face, with its white border, off the wall's keep-outs; none gets
/// nearer to another than their borders allow. Every task is planned anew on the whole site; where one that had a plan then
/// has none, nothing is moved.
///
/// `text` is the text of the site file that was covered. `None` where candidates cannot be taken out of it, as for
/// [`written`](super::written()).
///
/// # Errors
/// [`CoverError`].
pub fn polished(
    text: &str,
    file_name: &str,
    cover: &Cover,
    order: &Order,
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
    let Some(site) = polish.site(&tags) else {
        return Ok(None);
    };
    let mut found = Cover {
        tags,
        site,
        ..cover.clone()
    };
    let options = order.options();
    {
        let mut plans = Plans::of(&found.site);
        for task in found.tasks.iter_mut().filter(|task| task.reason.is_none()) {
            if let Some(planned) = plans.plan(&task.from, &task.task, &options)? {
                task.planned = planned;
            }
            tick(Stage::Check, Some(cover.tasks.len()));
        }
    }
    let lost = |task: &Served| task.reason.is_none() && task.planned.plan.is_none();
    if found.tasks.iter().any(lost) {
        return Ok(Some(cover.clone()));
    }
    let kind = if order.survive_a_lost_tag {
        Kind::Survives
    } else {
        Kind::Plain
    };
    value(&mut found, &options, kind)?;
    Ok(Some(found))
}

struct Polish<'a> {
    text: &'a str,
    file_name: &'a str,
    cover: &'a Cover,
    order: &'a Order,
    reach: f64,
}

impl Polish<'_> {
    /// The site with tags hung; its digest is that of the site that was asked for.
    fn site(&self, tags: &[ChosenTag]) -> Option<Site> {
        let site = Site::parse(&with_tags(self.text, tags), self.file_name).ok()?;
        Some(Site {
            digest: self.cover.site.digest,
            ..site
        })
    }

    /// A tag where the plans that look at it have more room; `None` where it stays.
    fn moved(&self, tags: &[ChosenTag], number: usize) -> Result<Option<ChosenTag>, PlanError> {
        let tag = &tags[number];
        let group: Vec<&Served> = self
            .cover
            .tasks
            .iter()
            .filter(|task| task.reason.is_none() && task.looks_at(&tag.name))
            .collect();
        let first = tag.tag.tag.pose;
        let Some(place) = Place::of(&self.cover.site, tag) else {
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
                .map(|way| {
                    let to = [at[0] + step * way[0], at[1] + step * way[1]];
                    let beyond = to.iter().any(|by| by.abs() > self.reach * (1.0 + 1e-9));
                    let pose = along(first, to);
                    if beyond || !place.holds(pose, tags, number) {
                        return Ok((to, 0.0));
                    }
                    let mut tags = tags.to_vec();
                    tags[number].tag.tag.pose = pose;
                    Ok((to, self.reserve(&tags, &group, best * WORTH)?))
                })
                .collect::<Result<_, PlanError>>()?;
            // Of equal ones the first.
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

    /// The reserve of a group of tasks with no other chosen tags than they looked at before, in steps of [`WORTH`]; 0 where
    /// it is not `least`.
    fn reserve(&self, tags: &[ChosenTag], group: &[&Served], least: f64) -> Result<f64, PlanError> {
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
                let planned = plans.plan(&task.from, &task.task, &self.order.options())?;
                if planned.is_none_or(|planned| planned.plan.is_none()) {
                    return Ok(false);
                }
            }
            Ok(true)
        };
        if !serves(least)? {
            return Ok(0.0);
        }
        // In larger and larger steps, then in smaller and smaller ones.
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

/// The site with the errors of all starts and looks so many times as large.
fn with_errors(site: &Site, factor: f64) -> Site {
    let mut with = site.clone();
    let larger = |bound: &mut ErrorBound| {
        bound.translation *= factor;
        bound.yaw_deg = (bound.yaw_deg * factor).min(180.0);
    };
    for chain in with.chains.values_mut() {
        match &mut chain.start.known {
            Known::Bounded {
                translation,
                yaw_deg,
            } => {
                *translation *= factor;
                *yaw_deg = (*yaw_deg * factor).min(180.0);
            }
            Known::Gaussian { covariance, .. } => {
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

/// A pose moved along its own y and z axes, metres.
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

/// Where a tag may be moved to.
struct Place {
    /// The face that it hangs on, and how far from it.
    face: Option<(Space, [f64; 3])>,
    first: Pose3Deg,
}

impl Place {
    /// `None` where it hangs on a wall, but not all of it on one face, or on a keep-out: it stays.
    fn of(site: &Site, tag: &ChosenTag) -> Option<Self> {
        let (pose, size) = (tag.tag.tag.pose, tag.tag.tag.size);
        let out: [[f64; 3]; 3] = rotation(pose.roll_deg, pose.pitch_deg, pose.yaw_deg);
        let beside = [pose.x + 0.1 * out[0][0], pose.y + 0.1 * out[1][0]];
        let near = |at: [f64; 2]| {
            move |wall: &&crate::shape::Wall| {
                wall.distance(at) <= ON_A_WALL && pose.z >= wall.z[0] && pose.z <= wall.z[1]
            }
        };
        let mut walls = site.walls.iter().filter(near([pose.x, pose.y])).peekable();
        if walls.peek().is_none() {
            return Some(Self {
                face: None,
                first: pose,
            });
        }
        walls.find_map(|wall| {
            let space = Space::wall(wall, size, beside, None).ok()?;
            let off = off(&space, pose)?;
            let away = off.iter().map(|by| by * by).sum::<f64>();
            (libm::sqrt(away) <= ON_A_WALL).then_some(Self {
                face: Some((space, off)),
                first: pose,
            })
        })
    }

    fn holds(&self, pose: Pose3Deg, tags: &[ChosenTag], number: usize) -> bool {
        let stays = self.face.as_ref().is_none_or(|(space, from)| {
            let now = off(space, pose);
            now.is_some_and(|now| now.iter().zip(from).all(|(a, b)| (a - b).abs() < 1e-6))
        });
        let apart = |a: Pose3Deg, b: Pose3Deg| {
            libm::sqrt((a.x - b.x).powi(2) + (a.y - b.y).powi(2) + (a.z - b.z).powi(2))
        };
        let size = tags[number].tag.tag.size;
        stays
            && tags.iter().enumerate().all(|(other, tag)| {
                let tag = &tag.tag.tag;
                let borders = core::f64::consts::FRAC_1_SQRT_2 * WITH_WHITE * (size + tag.size);
                let now = apart(pose, tag.pose);
                other == number || now >= borders || now >= apart(self.first, tag.pose)
            })
    }
}

/// From the nearest place of a face to a pose, metres.
fn off(space: &Space, pose: Pose3Deg) -> Option<[f64; 3]> {
    let on = space.pose(&space.point(&pose)).ok()?;
    Some([pose.x - on.x, pose.y - on.y, pose.z - on.z])
}
