//! What a page shows of a site.

use rayon::prelude::*;
use serde_json::{Value, json};

use super::figures::base64;
use crate::draw::doctor::site_plan;
use crate::draw::panel::Window;
use crate::draw::{DrawError, Mounted, Subject, chain_picture, mounting_sheet};
use crate::draw::{SeenFrom, task_image_with_numbers, task_plan};
use crate::plan::{ChainReport, Options, Plans, evaluate};
use crate::site::{Site, Task};
use posegate::bake;
use posegate::chain::StartAssumption;
use posegate::shape::SuccessSet;
use posegate::table::Table;
use posegate::verify::{Proof, build};

/// What a page is made of.
#[derive(Clone, Debug)]
pub struct PageInput<'a> {
    /// The site.
    pub site: &'a Site,
    /// What it is called: the page's title.
    pub title: String,
    /// What `posegate place --json` told, each with its task's name.
    pub placements: Vec<(String, Value)>,
    /// Pictures (SVG) that other commands drew, each with its title.
    pub pictures: Vec<(String, String)>,
}

/// Why there is no page.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PageError {
    /// Nothing to show.
    #[error("the site has no tasks")]
    NoTasks,
    /// A placement of a task that is not there.
    #[error("the site has no task `{0}`")]
    NoTask(String),
    /// A placement that begins where none of the task's tags hangs.
    #[error(
        "the placement of `{0}` begins at a place where no tag hangs that the task looks at: it is of another site, or of another state of this one"
    )]
    OtherTag(String),
    /// What is no placement.
    #[error("what is said to be the placement of `{0}` is not what `posegate place --json` prints")]
    NoPlacement(String),
}

/// What is shown of a task.
#[derive(Clone, Debug)]
pub struct Shown {
    /// Its name.
    pub name: String,
    /// Its table, proven, and what was found; or why there is none.
    pub table: Result<(Vec<u8>, Proof), String>,
    /// The part of the goal frame that is drawn.
    pub window: Window,
    /// Headings from the goal's, degrees, and the borders of the set there: closed polygons, metres of the goal frame.
    pub sections: Vec<(f64, Vec<Vec<[f64; 2]>>)>,
    /// The floor.
    pub floor: String,
    /// The camera's image with what is seen in it, where the task has a camera.
    pub image: Option<(String, Vec<SeenFrom>)>,
}

/// A chain or a plan, by name.
#[derive(Clone, Debug)]
pub struct ShownChain {
    /// The chain's name, or the work task's.
    pub name: String,
    /// What was found, and its picture; or why there is none.
    pub found: Result<(ChainReport, String), String>,
}

/// All that a page shows.
#[derive(Clone, Debug)]
pub struct Contents {
    /// The site from above.
    pub plan: String,
    /// The tasks, in the order of their names; those without bounds are left out, with the reason.
    pub tasks: Vec<Shown>,
    /// Tasks that cannot be shown, and why.
    pub left_out: Vec<(String, String)>,
    /// The chains that the site file writes out.
    pub chains: Vec<ShownChain>,
    /// The plans of the work tasks that say where they are begun.
    pub plans: Vec<ShownChain>,
    /// The mounting sheet; none without tags.
    pub sheet: Option<String>,
}

/// Headings of a task: as many as are two degrees apart, within these numbers. On a whole turn they are five degrees apart.
const HEADINGS: [usize; 2] = [9, 73];
/// Steps across the larger side of a section; between them its border is bisected.
const STEPS: f64 = 75.0;

impl Contents {
    /// Builds and proves every task's table, evaluates the chains, makes the plans and draws. `tick` is told of each task, with
    /// their number.
    ///
    /// # Errors
    /// [`PageError::NoTasks`]; what cannot be built or drawn is told in its place.
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
        let mut contents = Self {
            plan: site_plan(site),
            tasks: Vec::new(),
            left_out: Vec::new(),
            chains: chains(site),
            plans: plans(site),
            sheet: sheet(site),
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

/// A task's table, as `posegate table build` makes it.
fn table(site: &Site, name: &str, task: &Task) -> Result<(Vec<u8>, Proof), String> {
    let spec = site.chosen_table(task).ok_or_else(|| {
        "no extent can be chosen for it: its success set has no bound, or no pose".to_owned()
    })?;
    let order = bake::BakeInput {
        task: name,
        success: &task.success,
        spec,
        epsilon: site.epsilon,
        site_digest: site.digest,
    };
    build(&order, &|| ()).map_err(|error| error.to_string())
}

/// Headings over a range of degrees, the goal's among them where the range has it.
fn spread([lo, hi]: [f64; 2]) -> Vec<f64> {
    let wanted = libm::ceil(0.5 * (hi - lo)) as usize + 1;
    let count = wanted.clamp(HEADINGS[0], HEADINGS[1]);
    let last = (count - 1) as f64;
    // The ends of a closed set are in it, but for the last bit of a sum of angles.
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
                    "there is nothing to look at: no localization task, and no [planner] look"
                        .to_owned(),
                ),
                Err(error) => Err(error.to_string()),
            },
        })
        .collect()
}

fn with_picture(site: &Site, name: &str, report: ChainReport) -> (ChainReport, String) {
    let success = |name: &str| -> Option<&SuccessSet> {
        let made = site.planner.looks.get(name).map(|look| &look.success);
        let own = site.tasks.get(name).map(|task| &task.success);
        own.or(made)
    };
    let picture = chain_picture(name, &report, &success);
    (report, picture)
}

fn sheet(site: &Site) -> Option<String> {
    let tags: Vec<Mounted> = site
        .tags
        .iter()
        .map(|(name, tag)| Mounted {
            name: name.clone(),
            family: tag.family.clone(),
            tag: tag.tag,
            tolerance: (tag.tolerance.translation > 0.0)
                .then_some(tag.tolerance.translation * 100.0),
            on: "where the site file says".to_owned(),
        })
        .collect();
    (!tags.is_empty()).then(|| mounting_sheet("Mounting sheet", &tags))
}

impl Shown {
    /// What the page's script takes: the table, the window and the sections.
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
        let radius = self
            .table
            .as_ref()
            .ok()
            .and_then(|(bytes, _)| Table::parse(bytes).ok())
            .map_or(3.0, |table| {
                libm::sqrt(f64::from(table.radius_squared().q16()) / 65_536.0)
            });
        // A spread whose set is as large as the expected one, or a twentieth of what is drawn.
        let wide = (self.window.x[1] - self.window.x[0]).min(self.window.y[1] - self.window.y[0]);
        let (translation, turn_deg) = task.wish.expected.map_or((0.05 * wide, 1.0), |expected| {
            (expected.translation, expected.turn_deg)
        });
        let sigma = |reach: f64| libm::round(reach / radius * 1e4) / 1e4;
        Some(json!({
            "name": self.name,
            "goal": { "x": goal.x, "y": goal.y, "yaw_deg": goal.yaw_deg },
            "table": self.table.as_ref().ok().map(|(bytes, _)| base64(bytes)),
            "why": self.table.as_ref().err(),
            "window": { "x": self.window.x, "y": self.window.y },
            "sections": { "headings": headings, "polygons": polygons },
            "start": {
                "at": [0.0, 0.0, 0.0],
                "sigma": [sigma(translation), sigma(translation), sigma(turn_deg)],
            },
        }))
    }
}

/// To a tenth of a millimetre: what a picture can show.
fn rounded(value: f64) -> f64 {
    libm::round(value * 1e4) / 1e4
}
