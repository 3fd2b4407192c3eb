//! The contents of a page about a site.

use rayon::prelude::*;
use serde_json::{Value, json};

use super::start::first_sigmas;
use crate::draw::panel::Window;
use crate::draw::site_plan;
use crate::draw::{DrawError, Subject, chain_picture, success_of};
use crate::draw::{SeenFrom, task_image_with_numbers, task_plan};
use data_encoding::BASE64;
use posegate::bake;
use posegate::chain::StartAssumption;
use posegate::table::Table;
use posegate::verify::{Proof, build};
use posegate_plan::{ChainReport, Options, Plans, Route, evaluate};
use posegate_site::{Site, Task};

/// The input of a page.
#[derive(Clone, Debug)]
pub struct PageInput<'a> {
    /// The site.
    pub site: &'a Site,
    /// The name of the site file: the mounting sheet states it.
    pub file: String,
    /// The page's title.
    pub title: String,
    /// The output of `posegate place --json`, each with its task's name.
    pub placements: Vec<(String, Value)>,
    /// Pictures (SVG) that other commands drew, each with its title.
    pub pictures: Vec<(String, String)>,
}

/// The reason why a page cannot be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PageError {
    /// The site has no tasks.
    #[error("the site has no tasks")]
    NoTasks,
    /// A placement of a task that does not exist.
    #[error("the site has no task `{0}`")]
    NoTask(String),
    /// A placement has none of the task's tags at its start or at its end.
    #[error(
        "none of the tags of `{0}` is where its placement begins, or at the place that it found: it belongs to another site, or to another version of this one"
    )]
    OtherTag(String),
    /// A placement of another site file.
    #[error(
        "the placement of `{0}` was made for another site file, or for another version of this one: its digest is {1}, and this file's is {2}; run `posegate place` again"
    )]
    OtherSite(String, String, String),
    /// The input is not a placement.
    #[error("the placement of `{0}` is not the output of `posegate place --json`")]
    NoPlacement(String),
}

/// The content of one task.
#[derive(Clone, Debug)]
pub struct Shown {
    /// The task's name.
    pub name: String,
    /// The table's bytes with the proof, or the reason why there is none.
    pub table: Result<(Vec<u8>, Proof), String>,
    /// The drawn part of the goal frame.
    pub window: Window,
    /// Headings relative to the goal's, degrees, with the borders of the set there: closed polygons, metres of the goal
    /// frame.
    pub sections: Vec<(f64, Vec<Vec<[f64; 2]>>)>,
    /// The floor plan.
    pub floor: String,
    /// The camera's image with the visible tags, if the task has a camera.
    pub image: Option<(String, Vec<SeenFrom>)>,
}

/// A chain or a plan, by name.
#[derive(Clone, Debug)]
pub struct ShownChain {
    /// The chain's name, or the work task's.
    pub name: String,
    /// The report and its picture, or the reason why there is none.
    pub found: Result<(ChainReport, String), String>,
}

/// The contents of a page.
#[derive(Clone, Debug)]
pub struct Contents {
    /// The site plan.
    pub plan: String,
    /// The tasks, in the order of their names.
    pub tasks: Vec<Shown>,
    /// The tasks that cannot be shown, with the reasons.
    pub left_out: Vec<(String, String)>,
    /// The chains whose steps the site file lists.
    pub chains: Vec<ShownChain>,
    /// The plans of the work tasks that have a start.
    pub plans: Vec<ShownChain>,
}

/// Smallest and largest number of headings of a task. Within these, headings are two degrees apart; on a full turn they
/// are five degrees apart.
const HEADINGS: [usize; 2] = [9, 73];
/// Number of steps across the larger side of a section; its border is bisected between them.
const STEPS: f64 = 75.0;

impl Contents {
    /// Builds and proves every task's table, evaluates the chains, makes the plans and draws the pictures. `tick` is
    /// called for each task, with the number of tasks.
    ///
    /// # Errors
    /// [`PageError::NoTasks`] if the site has no tasks. Other failures are reported in the contents.
    pub fn of(site: &Site, tick: &(dyn Fn(usize) + Sync)) -> Result<Self, PageError> {
        if site.tasks.is_empty() {
            return Err(PageError::NoTasks);
        }
        let tasks: Vec<(String, Result<Shown, String>)> = site
            .tasks
            .par_iter()
            .map(|(name, task)| {
                let shown = shown(site, name, task).map_err(|error| error.to_string());
                tick(site.tasks.len());
                (name.clone(), shown)
            })
            .collect();
        let (chains, plans) = (chains(site), plans(site));
        let found = |list: &[ShownChain]| -> Vec<Route> {
            let found = list.iter().filter_map(|shown| shown.found.as_ref().ok());
            found.map(|(report, _)| Route::from(report)).collect()
        };
        // The routes of the plans; without plans those of the chains in the site file.
        let mut routes = found(&plans);
        if routes.is_empty() {
            routes = found(&chains);
        }
        let mut contents = Self {
            plan: site_plan(site, &routes),
            tasks: Vec::new(),
            left_out: Vec::new(),
            chains,
            plans,
        };
        for (name, shown) in tasks {
            match shown {
                Ok(shown) => contents.tasks.push(shown),
                Err(why) => contents.left_out.push((name, why)),
            }
        }
        Ok(contents)
    }
}

fn shown(site: &Site, name: &str, task: &Task) -> Result<Shown, DrawError> {
    let table = table(site, name, task);
    let mut subject = Subject::new(site, name)?;
    if let Ok((bytes, _)) = &table {
        subject = subject.with_table(bytes)?;
    }
    let expected = task.wish.expected.is_some();
    if expected {
        subject = subject.expected()?;
    }
    let (window, headings) = subject.extent()?;
    let wide = (window.x[1] - window.x[0]).max(window.y[1] - window.y[0]);
    let sections = spread(headings)
        .into_iter()
        .map(|yaw_deg| (yaw_deg, subject.section(yaw_deg, &window, wide / STEPS)))
        .collect();
    Ok(Shown {
        name: name.to_owned(),
        window,
        sections,
        floor: task_plan(&subject)?,
        image: match task_image_with_numbers(&subject) {
            Ok(image) => Some(image),
            Err(DrawError::NoCamera(_)) => None,
            Err(error) => return Err(error),
        },
        table,
    })
}

/// Builds a task's table, as `posegate table build` does.
fn table(site: &Site, name: &str, task: &Task) -> Result<(Vec<u8>, Proof), String> {
    let spec = site.chosen_table(task).ok_or_else(|| {
        "no extent can be chosen for it: its success set has no bound, or no pose".to_owned()
    })?;
    let order = bake::BakeInput {
        task: name,
        success: &task.success,
        spec,
        epsilon: site.epsilon,
    };
    build(&order, &|| ()).map_err(|error| error.to_string())
}

/// Returns headings over a range of degrees, including the goal's if it is in the range.
fn spread([lo, hi]: [f64; 2]) -> Vec<f64> {
    let steps_of_2_deg = libm::ceil(0.5 * (hi - lo)) as usize + 1;
    let count = steps_of_2_deg.clamp(HEADINGS[0], HEADINGS[1]);
    let last = (count - 1) as f64;
    // Stay within the closed set, despite the rounding of sums of angles.
    let within = 1e-9_f64.min(0.25 * (hi - lo));
    let mut all: Vec<f64> = (0..count)
        .map(|k| (lo + (hi - lo) * k as f64 / last).clamp(lo + within, hi - within))
        .collect();
    if lo <= 0.0 && hi >= 0.0 {
        let nearest = |a: &f64, b: &f64| a.abs().total_cmp(&b.abs());
        let nearest = (0..count).min_by(|a, b| nearest(&all[*a], &all[*b]));
        if let Some(nearest) = nearest {
            all[nearest] = 0.0;
        }
    }
    all
}

fn chains(site: &Site) -> Vec<ShownChain> {
    let written = site
        .chains
        .iter()
        .filter(|(_, chain)| !chain.steps.is_empty());
    let written: Vec<_> = written.collect();
    written
        .into_par_iter()
        .map(|(name, chain)| ShownChain {
            name: name.clone(),
            found: evaluate(site, name, chain, StartAssumption::General)
                .map(|report| with_picture(site, name, report))
                .map_err(|error| error.to_string()),
        })
        .collect()
}

fn plans(site: &Site) -> Vec<ShownChain> {
    let mut plans = Plans::of(site);
    let options = Options::default();
    let begun = site
        .tasks
        .iter()
        .filter_map(|(name, task)| Some((name, task.from.as_ref()?)));
    begun
        .map(|(name, from)| ShownChain {
            name: name.clone(),
            found: match plans.plan(from, name, &options) {
                Ok(Some(planned)) => match &planned.plan {
                    Some(plan) => Ok(with_picture(site, name, plan.report())),
                    None => Err(planned.why_not()),
                },
                Ok(None) => Err(
                    "the site has no looks: no localization task, and no [planner] look".to_owned(),
                ),
                Err(error) => Err(error.to_string()),
            },
        })
        .collect()
}

fn with_picture(site: &Site, name: &str, report: ChainReport) -> (ChainReport, String) {
    let success = |name: &str| success_of(site, name);
    let picture = chain_picture(name, &report, &success, Some(site));
    (report, picture)
}

impl Shown {
    /// Returns the data for the page's script: the table, the window and the sections.
    pub(super) fn to_json(&self, site: &Site) -> Option<Value> {
        let task = site.tasks.get(&self.name)?;
        let goal = task.success.goal;
        let headings: Vec<f64> = self.sections.iter().map(|(yaw, _)| rounded(*yaw)).collect();
        let flat = |ring: &Vec<[f64; 2]>| -> Vec<f64> {
            ring.iter().flatten().copied().map(rounded).collect()
        };
        let polygons: Vec<Vec<Vec<f64>>> = self
            .sections
            .iter()
            .map(|(_, rings)| rings.iter().map(flat).collect())
            .collect();
        // The sigmas whose pose-set is as large as the expected one, or well inside.
        let wide = (self.window.x[1] - self.window.x[0]).min(self.window.y[1] - self.window.y[0]);
        let table = self.table.as_ref().ok();
        let table = table.and_then(|(bytes, _)| Table::parse(bytes).ok());
        let sigma = first_sigmas(task, wide, table.as_ref());
        Some(json!({
            "name": self.name,
            "goal": { "x": goal.x, "y": goal.y, "yaw_deg": goal.yaw_deg },
            "table": self.table.as_ref().ok().map(|(bytes, _)| BASE64.encode(bytes)),
            "why": self.table.as_ref().err(),
            "window": { "x": self.window.x, "y": self.window.y },
            "sections": { "headings": headings, "polygons": polygons },
            "start": {
                "at": [0.0, 0.0, 0.0],
                "sigma": sigma,
            },
        }))
    }
}

/// Rounds to a tenth of a millimetre, the resolution of a picture.
fn rounded(value: f64) -> f64 {
    libm::round(value * 1e4) / 1e4
}
