//! `posegate place`: finds the best place of a task's tag.

use crate::arguments::numbers;
use crate::belief::{UncertaintyArgs, Weights};
use crate::sheet;
use crate::site_input::{Failure, Outcome, answer, print, print_json, progress, site, task, warn};
use posegate::shape::{Family, Pose3Deg, Tag, Tolerance};
use posegate_files::files::{Files, Input, Output};
use posegate_files::printable::fixed;
use posegate_learn::ErrorModel;
use posegate_place::{
    Candidate, LearntCost, Method, Objective, PlaceError, Placed, Placement, PlacementProblem,
    PosePrior, Space, Task, ViewBound, candidates, compare, place, ranges,
};
use posegate_show::doctor::stated_error;
use posegate_show::draw::{Column, Mounted, MountingSheet, placement_picture};
use posegate_site::{Site, pose_line};
use serde_json::{Value, json};

/// Finds the place of a task's tag with the least expected cost of seeing it, or by another objective
///
/// The robot is near the task's goal, with the given sigmas. The tag moves within --free or on a --wall, or each of the
/// --candidates is tried. Exit code 1 if no place sees the tag, or if no place satisfies the objective.
#[derive(clap::Args)]
#[command(
    after_help = "Example:\n  posegate place site.toml --task see-t7 --sigma-x 0.1 --sigma-y 0.1 --sigma-yaw-deg 1 --free x=0.3:7,y=-3:3,yaw_deg=0:360 --json\n  posegate place site.toml --task see-t7 --sigma-x 0.1 --sigma-y 0.1 --sigma-yaw-deg 1 --wall north --objective contained-cost --reserve 0.01,0.5\n  posegate place site.toml --task see-t7 --exact --free x=0.3:7,z=0:2\n\nObjectives: cost (E[c]), contained-cost (E[c] if the whole pose-set is in S), margin (the largest pose-set that is in S), smallest-tag, tolerance (the largest installation error beyond the reserve, the same number of centimetres and of degrees). The expected cost is that of the planned place; margins hold for every place within --reserve."
)]
pub struct Arguments {
    /// The site file; `-` for standard input
    site: Input,
    /// The task
    #[arg(long)]
    task: String,
    /// The tag that moves, if the task looks at several
    #[arg(long)]
    tag: Option<String>,
    #[command(flatten)]
    belief: UncertaintyArgs,
    /// The pose is known exactly (the paper's x = x*)
    #[arg(long, conflicts_with_all = ["sigma_x", "sigma_y", "sigma_yaw_deg", "covariance_file"])]
    exact: bool,
    /// Confidence of the pose-set [default: the site's]
    #[arg(long, allow_negative_numbers = true)]
    epsilon: Option<f64>,
    #[command(flatten)]
    weights: Weights,
    /// Take the cost of a view from this [error_model] of the site instead of c1, c2 and c3. The cost is 100 times the bound in
    /// metres plus the bound in degrees, including the tolerances of tag and camera
    #[arg(long)]
    error_model: Option<String>,
    /// Ranges of the tag's pose: x, y, z (m) and yaw_deg, such as x=0.3:7,y=-3:3,yaw_deg=0:360; on a wall only z
    #[arg(long, allow_hyphen_values = true)]
    free: Option<String>,
    /// Mount the tag flat on this wall of the site, on the goal's side
    #[arg(long)]
    wall: Option<String>,
    /// Largest mounting error, metres and degrees: the margin holds for every such error [default: the tag's
    /// tolerance in the site, else 0.01,0.5]
    #[arg(long, value_parser = reserve, value_name = "M,DEG", allow_hyphen_values = true)]
    reserve: Option<Tolerance>,
    /// Compare these places: a CSV of x, y, z, yaw_deg and optionally name, roll_deg, pitch_deg; `-` for standard input
    #[arg(long, conflicts_with_all = ["free", "wall", "method", "budget", "seed"])]
    candidates: Option<Input>,
    /// The search method
    #[arg(long, value_enum, default_value_t = MethodName::Bobyqa)]
    method: MethodName,
    /// The seed of the search: the same seed gives the same answer
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Largest number of places that are evaluated
    #[arg(long, default_value_t = 1_000, value_parser = clap::value_parser!(u64).range(1..=1_000_000_000))]
    budget: u64,
    /// The objective of the search
    #[arg(long, value_parser = objective, default_value = "cost")]
    objective: Objective,
    /// Draw the tag's present place and the best ones, side by side (SVG)
    #[arg(short, long)]
    output: Option<Output>,
    /// Write a mounting sheet of the best place: an A4 page as HTML if the file's name ends with .html, else as SVG
    #[arg(long)]
    sheet: Option<Output>,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum MethodName {
    /// Quadratic models within the borders, from the best places of a grid
    Bobyqa,
    /// CMA-ES from these places, for comparison
    Cmaes,
    /// A genetic algorithm (the paper's) about these places, for comparison
    Ga,
}

fn reserve(text: &str) -> Result<Tolerance, String> {
    let found = numbers(text, |number| number.is_finite() && number >= 0.0);
    let [translation, turn_deg] =
        found.ok_or("expected metres and degrees, such as 0.01,0.5, neither of them below 0")?;
    if translation > 1.0 {
        return Err(format!(
            "{translation} m is more than 1 m: the first number is in metres, such as 0.01"
        ));
    }
    if turn_deg >= 90.0 {
        return Err("no tag is seen that may be turned by 90 degrees or more".into());
    }
    Ok(Tolerance {
        translation,
        turn_deg,
    })
}

fn objective(text: &str) -> Result<Objective, String> {
    let found = Objective::ALL
        .into_iter()
        .find(|objective| objective.name() == text);
    found.ok_or_else(|| {
        let names = Objective::ALL.map(Objective::name);
        format!("expected one of {}", names.join(", "))
    })
}

pub fn run(arguments: &Arguments, files: &Files) -> Outcome {
    let site = site(files, &arguments.site)?;
    let success = &task(&site, &arguments.task)?.success;
    let tag = chosen_tag(arguments, &site, &success.tags())?;
    let moved_task = Task {
        reserve: arguments
            .reserve
            .unwrap_or_else(|| Task::usual_reserve(success, &tag)),
        set: success.clone(),
        tag,
        wall: arguments.wall.clone(),
    };
    let epsilon = arguments.epsilon.unwrap_or(site.epsilon);
    let belief = match arguments.exact {
        true => None,
        false => arguments.belief.gaussian(epsilon, files)?,
    };
    let known = belief.map_or(PosePrior::Exactly, PosePrior::About);
    let cost = arguments.weights.cost();
    cost.check()
        .map_err(|error| Failure::usage(error.to_string(), "see `posegate place --help`"))?;
    let learnt = learnt(arguments, &site, cost.c_high, &moved_task)?;
    let order = PlacementProblem {
        task: &moved_task,
        known,
        cost: match &learnt {
            Some(learnt) => learnt,
            None => &cost,
        },
        objective: arguments.objective,
    };
    if let Some(file) = &arguments.candidates {
        return compared(arguments, &site, &order, file, files);
    }
    let space = space(arguments, &site, &moved_task)?;
    let bar = progress(arguments.budget, "places");
    let method = match arguments.method {
        MethodName::Bobyqa => Method::Bobyqa,
        MethodName::Cmaes => Method::Cmaes,
        MethodName::Ga => Method::Genetic,
    };
    let (budget, seed) = (arguments.budget, arguments.seed);
    let tick = |count| bar.inc(count);
    let (before, found) = rayon::join(
        || order.placed(order.task.tag.pose),
        || place(&order, &space, method, budget, seed, &tick),
    );
    bar.finish_and_clear();
    let found = found.map_err(|error| refused(arguments, &error))?;
    pictures(arguments, &site, &order, &before, &found, files)?;
    let serves = serves(arguments.objective, &found.best);
    if arguments.json {
        let mut line = found.to_json();
        line["task"] = json!(arguments.task);
        line["cost_definition"] = json!(order.cost.definition());
        line["site_digest"] = json!(site.digest_text());
        line["before"] = before.map_or(Value::Null, |before| before.to_json());
        print_json(&line)?;
    } else {
        print(&format_args!("cost of a view: {}", order.cost.definition()))?;
        print_places(before.as_ref().ok(), &found)?;
        print(&format_args!(
            "{} places evaluated ({})",
            found.evaluations,
            space.name()
        ))?;
    }
    if !serves {
        warn(&unmet_objective(arguments, &found.best));
    } else if let Some(warning) = error_of_reserve(&site, &order, &found.best) {
        warn(&warning);
    }
    Ok(answer(serves))
}

/// Returns a warning if a tag that is off by the reserve makes a larger error than the task states. The margin is about seeing the
/// tag, not about the pose that follows.
fn error_of_reserve(site: &Site, order: &PlacementProblem<'_>, best: &Placed) -> Option<String> {
    let (name, task) = site
        .tasks
        .iter()
        .find(|(_, task)| task.success == order.task.set)?;
    let set = order.task.changed(best.pose, best.size, Some(best.reserve));
    let warning = stated_error(&set.shape, task.error_bound?, name)?;
    Some(format!(
        "if the tag is off by the reserve and the site file keeps the pose above, every pose from it is off, too. {}: {}; survey the tag after mounting, and write its `pose` and `tolerance` into the site file",
        warning.about, warning.message
    ))
}

/// Prints the present place, the best one, others that are about as good, and how far apart the restarts ended.
fn print_places(before: Option<&Placed>, found: &Placement) -> Result<(), Failure> {
    if let Some(before) = before {
        print(&"before:")?;
        print_placed(before)?;
        print(&"best:")?;
    }
    print_placed(&found.best)?;
    print(&format_args!(
        "in the site  {}",
        pose_line(&found.best.pose)
    ))?;
    for other in &found.others {
        let mean = |value| format!(", mean cost {value:.6}");
        print(&format_args!(
            "another: {}{}",
            place_text(&other.pose),
            other
                .mean
                .map_or_else(String::new, |found| mean(found.value)),
        ))?;
    }
    restarts(found)
}

/// Prints how far apart the restarts of the search ended.
fn restarts(found: &Placement) -> Result<(), Failure> {
    let means: Vec<f64> = found.restarts.iter().filter_map(|one| one.mean).collect();
    let Some(best) = found.best.mean.map(|mean| mean.value) else {
        return Ok(());
    };
    let same = means.iter().filter(|mean| **mean <= 1.01 * best).count();
    let worst = means.iter().copied().fold(best, f64::max);
    if means.len() == 1 {
        return print(&"all restarts of the search ended at one place");
    }
    print(&format_args!(
        "{} different results of the restarts: mean costs from {best:.6} to {worst:.6}, {same} of them within 1 % of the best",
        means.len()
    ))
}

/// Writes the requested pictures.
fn pictures(
    arguments: &Arguments,
    site: &Site,
    order: &PlacementProblem<'_>,
    before: &Result<Placed, PlaceError>,
    found: &Placement,
    files: &Files,
) -> Result<(), Failure> {
    if let Some(path) = &arguments.output {
        let before = before.as_ref().map_err(|error| refused(arguments, error))?;
        let belief = match order.known {
            PosePrior::Exactly => None,
            PosePrior::About(belief) => Some(belief),
        };
        let best = format!("best by {}", arguments.objective.name());
        let named = [("before".to_owned(), before), (best, &found.best)];
        let others = found
            .others
            .iter()
            .map(|other| ("another".to_owned(), other));
        let columns: Vec<Column> = named
            .into_iter()
            .chain(others)
            .map(|(heading, placed)| Column {
                heading,
                set: order.task.changed(placed.pose, placed.size, None),
                belief,
                placed: placed.clone(),
            })
            .collect();
        let title = format!("Places of the tag of task {}", arguments.task);
        files.write(
            path,
            placement_picture(&title, &order.cost.definition(), &columns).as_bytes(),
        )?;
    }
    if let Some(path) = &arguments.sheet {
        let tag = order.task.tag;
        let known = site.tags.iter().find(|(_, known)| known.tag == tag);
        let best = &found.best;
        let mounted = Mounted {
            name: known.map_or_else(|| format!("id {}", tag.id), |(name, _)| name.clone()),
            family: known.map_or_else(String::new, |(_, known)| known.family.clone()),
            tag: Tag {
                size: best.size,
                pose: best.pose,
                ..tag
            },
            reserve: best.contained.then_some(best.reserve),
            left: best.mean.filter(|_| best.contained).map(|_| best.left),
        };
        let title = format!("Mounting sheet for task {}", arguments.task);
        let content = MountingSheet {
            title: &title,
            origin: &site.origin(&arguments.site.display().to_string()),
            tags: &[mounted],
            walls: &site.walls,
        };
        sheet::write(files, path, &content)?;
    }
    Ok(())
}

/// Returns the cost of the model that --error-model names.
fn learnt<'a>(
    arguments: &Arguments,
    site: &'a Site,
    c_high: f64,
    task: &Task,
) -> Result<Option<LearntCost<'a>>, Failure> {
    let Some(name) = &arguments.error_model else {
        return Ok(None);
    };
    let own = site.error_models.get(name);
    if let Some((difference, advice)) = own.and_then(|model| differing(site, model, task)) {
        return Err(Failure::usage(
            format!(
                "{}: the error model `{name}` was learnt with {difference} as task `{}` uses",
                arguments.site.display(),
                arguments.task
            ),
            advice,
        ));
    }
    let learnt = own.map(ViewBound::Learnt);
    let formula = site.error_formulas.get(name);
    let psi_max_deg = task
        .set
        .shape
        .visibility()
        .map_or(90.0, |view| view.psi_max_deg);
    if formula.is_some_and(|model| !model.is_bound_up_to(psi_max_deg)) {
        return Err(Failure::usage(
            format!(
                "{}: the error model `{name}` has a bound below 0 at a psi of {psi_max_deg} deg, up to which the task sees its tag",
                arguments.site.display()
            ),
            "choose a c3 with c0 + c3 psi^2 >= 0 up to the task's psi_max_deg",
        ));
    }
    let formula = formula.map(ViewBound::Formula);
    let model = learnt.or(formula).ok_or_else(|| {
        Failure::usage(
            format!(
                "{}: there is no error model `{name}`",
                arguments.site.display()
            ),
            "write [error_model.NAME] with translation and yaw_deg, or with file = \"MODEL.toml\", made by `posegate learn bounds`",
        )
    })?;
    Ok(Some(LearntCost::new(model, c_high, task)))
}

/// Returns the first difference of a task's views of its tag from those with which a model was learnt, and what to do.
fn differing(site: &Site, model: &ErrorModel, task: &Task) -> Option<(String, &'static str)> {
    let views = task.set.views_of(&task.tag);
    views.iter().find_map(|view| site.difference(model, view))
}

/// Returns `true` if a place satisfies the objective.
fn serves(objective: Objective, placed: &Placed) -> bool {
    match objective {
        Objective::Cost => placed.p_miss < 1.0,
        Objective::Margin => placed.margin.is_none_or(|margin| margin > 0.0),
        _ => placed.contained,
    }
}

fn unmet_objective(arguments: &Arguments, placed: &Placed) -> String {
    let pose = placed.pose;
    let at = format!(
        "the nearest is x {}, y {}, z {}, yaw {} deg",
        fixed(pose.x, 3),
        fixed(pose.y, 3),
        fixed(pose.z, 3),
        fixed(pose.yaw_deg, 1)
    );
    if placed.p_miss >= 1.0 {
        format!(
            "at no evaluated place is the tag seen from task `{}`'s pose-set; {at}",
            arguments.task
        )
    } else {
        let margin = placed.margin.unwrap_or(0.0);
        format!(
            "no evaluated place has the pose-set inside the success set; {at}, with a margin of {margin:.4} for a tag within the --reserve"
        )
    }
}

/// Returns a tag's place with its units.
fn place_text(pose: &Pose3Deg) -> String {
    let [x, y, z] = [pose.x, pose.y, pose.z].map(|length| fixed(length, 4));
    format!(
        "x {x} m, y {y} m, z {z} m, yaw {} deg",
        fixed(pose.yaw_deg, 3)
    )
}

fn print_placed(placed: &Placed) -> Result<(), Failure> {
    print(&format_args!(
        "tag at {}, size {:.3} m",
        place_text(&placed.pose),
        placed.size
    ))?;
    if let Some(mean) = placed.mean {
        print(&format_args!(
            "mean cost    {:.6} +- {:.1e}",
            mean.value, mean.error
        ))?;
    }
    print(&format_args!("at the goal  {:.6}", placed.cost_at_goal))?;
    print(&format_args!("misses       {:.3e}", placed.p_miss))?;
    let Tolerance {
        translation,
        turn_deg,
    } = placed.reserve;
    let off = format!(
        "for a tag that is up to {} cm and {turn_deg} deg off",
        rounded(100.0 * translation)
    );
    if let Some(margin) = placed.margin {
        print(&format_args!("margin       {margin:.4} {off}"))?;
    }
    if placed.mean.is_some() && placed.contained {
        print(&format_args!(
            "left         {0:.2} cm and {0:.2} deg beyond that",
            placed.left
        ))?;
    }
    print(&format_args!("distance     {:.4} m", placed.distance))
}

/// Returns a number without the rounding errors of its last digits.
fn rounded(number: f64) -> f64 {
    (number * 1e6).round() / 1e6
}

/// Returns the tag that moves.
fn chosen_tag(arguments: &Arguments, site: &Site, seen: &[Tag]) -> Result<Tag, Failure> {
    let place = format!("{}: task `{}`", arguments.site.display(), arguments.task);
    let name_of = |tag: &Tag| {
        let mut known = site.tags.iter().filter(|(_, known)| known.tag == *tag);
        known
            .next()
            .map_or_else(|| format!("id {}", tag.id), |(name, _)| name.clone())
    };
    let names: Vec<String> = seen.iter().map(name_of).collect();
    match (&arguments.tag, seen) {
        (_, []) => Err(Failure::usage(
            format!("{place}: its success set has no view of a tag, so there is no tag to place"),
            "name a task whose success set has shape = \"visibility\" in it",
        )),
        (None, [only]) => Ok(*only),
        (None, _) => Err(Failure::usage(
            format!("{place}: it looks at several tags: {}", names.join(", ")),
            "name the tag that moves with --tag",
        )),
        (Some(name), _) => {
            let found = names.iter().position(|known| known == name);
            found
                .and_then(|index| seen.get(index))
                .copied()
                .ok_or_else(|| {
                    Failure::usage(
                        format!(
                            "{place}: it does not look at a tag `{name}`; it looks at {}",
                            names.join(", ")
                        ),
                        "name one of these with --tag",
                    )
                })
        }
    }
}

/// Returns the search space: free ranges or a wall.
fn space(arguments: &Arguments, site: &Site, moved_task: &Task) -> Result<Space, Failure> {
    let free = arguments.free.as_deref().map(ranges).transpose();
    let free = free.map_err(|error| {
        Failure::usage(
            format!("--free: {error}"),
            "for example --free x=0.3:7,y=-3:3,z=0:2,yaw_deg=0:360",
        )
    })?;
    let refused = |error: posegate_place::SpaceError| {
        Failure::usage(
            error.to_string(),
            "see `posegate place --help` for --free and --wall",
        )
    };
    let Some(name) = &arguments.wall else {
        let ranges = free.ok_or_else(|| {
            Failure::usage(
                "the search space is missing".into(),
                "give --free x=0.3:7,y=-3:3,z=0:2,yaw_deg=0:360 (any of these), --wall NAME or --candidates FILE",
            )
        })?;
        return Space::free(moved_task.tag.pose, ranges).map_err(refused);
    };
    let wall = site
        .walls
        .iter()
        .find(|wall| wall.name == *name)
        .ok_or_else(|| {
            let known: Vec<&str> = site.walls.iter().map(|wall| wall.name.as_str()).collect();
            Failure::usage(
                format!("{}: there is no wall `{name}`", arguments.site.display()),
                &if known.is_empty() {
                    "the site has no [wall.NAME] table: write one with from, to and z".to_owned()
                } else {
                    format!("its walls are {}", known.join(", "))
                },
            )
        })?;
    let [x, y, z, yaw] = free.unwrap_or_default();
    if x.is_some() || y.is_some() || yaw.is_some() {
        return Err(Failure::usage(
            "on a wall a tag is moved along it and up: x, y and yaw_deg are the wall's".into(),
            "leave out --free, or give --free z=LOW:HIGH alone",
        ));
    }
    let goal = moved_task.set.goal;
    let size = moved_task.tag.size;
    let mut known = site.tags.values();
    let known = known.find(|known| known.tag == moved_task.tag);
    let whole = known.map_or(Family::WIDEST, |known| Family::whole_of(&known.family));
    Space::wall(wall, [size, size * whole], [goal.x, goal.y], z).map_err(refused)
}

fn refused(arguments: &Arguments, error: &PlaceError) -> Failure {
    let help = match error {
        PlaceError::Exact(_) => {
            "give --sigma-x, --sigma-y and --sigma-yaw-deg, or another --objective"
        }
        PlaceError::NoSmallest => {
            "give the visibility set `px_per_bit_min`, the fewest pixels of a tag's bit"
        }
        PlaceError::NoCandidates => "the file has a header x,y,z,yaw_deg and one line per place",
        _ => "see `posegate place --help`",
    };
    Failure::usage(
        format!(
            "{}: task `{}`: {error}",
            arguments.site.display(),
            arguments.task
        ),
        help,
    )
}

/// Compares candidates.
fn compared(
    arguments: &Arguments,
    site: &Site,
    order: &PlacementProblem<'_>,
    file: &Input,
    files: &Files,
) -> Outcome {
    let (bytes, name) = files.read(file)?;
    let list = candidates(&bytes, &name).map_err(|error| {
        Failure::usage(
            error,
            "the file has a header x,y,z,yaw_deg (and optionally name) and one line per place",
        )
    })?;
    let poses: Vec<_> = list.iter().map(|one| one.pose).collect();
    let bar = progress(poses.len() as u64, "places");
    let looked = compare(order, &poses, &|count| bar.inc(count));
    bar.finish_and_clear();
    let (best, placed) = looked.map_err(|error| refused(arguments, &error))?;
    let serves = serves(arguments.objective, &placed[best]);
    let named = |(one, placed): (&Candidate, &Placed)| {
        let mut line = placed.to_json();
        line["name"] = json!(one.name);
        line
    };
    if arguments.json {
        let mut line = named((&list[best], &placed[best]));
        line["evaluations"] = json!(placed.len());
        line["cost_definition"] = json!(order.cost.definition());
        line["site_digest"] = json!(site.digest_text());
        let all: Vec<Value> = list.iter().zip(&placed).map(named).collect();
        line["candidates"] = json!(all);
        print_json(&line)?;
    } else {
        print(&format_args!("cost of a view: {}", order.cost.definition()))?;
        print(&format_args!(
            "the best of {} is {}",
            list.len(),
            list[best].name
        ))?;
        print_placed(&placed[best])?;
        for (one, placed) in list.iter().zip(&placed) {
            let mean = placed.mean.map_or(placed.cost_at_goal, |mean| mean.value);
            print(&format_args!(
                "{:<16} {mean:>16.6}  p_miss {:.3e}",
                one.name, placed.p_miss
            ))?;
        }
    }
    if !serves {
        warn(&unmet_objective(arguments, &placed[best]));
    }
    Ok(answer(serves))
}
