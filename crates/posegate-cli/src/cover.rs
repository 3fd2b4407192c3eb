//! `posegate cover`: chooses the cheapest tags with which every work task of a site has a plan.

use crate::arguments::choice;
use crate::sheet;
use crate::site_input::{
    Failure, Outcome, answer, check_stated_errors, parsed, print, print_json, progress, warn,
};
use indicatif::ProgressBar;
use posegate_files::files::{Files, Input, Output};
use posegate_plan::cover::{
    ChosenTag, Cover, CoverError, CoverOptions, Incumbent, Method, Stage, Watch, cover_watched,
    written,
};
use posegate_plan::{PlanError, little_slack, margin_text};
use posegate_show::draw::{Mounted, MountingSheet};
use posegate_site::Site;
use std::io::IsTerminal;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};

/// Chooses the cheapest candidates with which every work task has a plan
///
/// Candidates are the site file's [candidate.NAME] tables. `look` in [planner] states from where they are seen.
/// A row of them along a wall takes one table: [candidates.NAME] with `wall`, `every` and `z`.
/// Tags that are mounted already are kept, and cost nothing. A greedy choice is made first. Each improvement is shown with the
/// proven bound and the time; Ctrl-C ends the search and keeps the best choice.
#[derive(clap::Args)]
#[command(
    after_help = "Example:\n  posegate cover site.toml --from staging --survive-lost-tags 1 -o with-tags.toml\n\nExit code 1 if a task cannot be served. The task is then named with the reason, and nothing is written."
)]
pub struct Arguments {
    /// The site file; `-` for standard input
    site: Input,
    /// The chain whose `start` applies to tasks without a `from`
    #[arg(long)]
    from: Option<String>,
    /// Number of tags that may be missing or not detected while every task still has a plan: 0 or 1
    #[arg(long, default_value_t = 0, value_parser = clap::value_parser!(u8).range(0..=1))]
    survive_lost_tags: u8,
    /// exact: the cheapest choice, with a proven bound; greedy: a quick choice
    #[arg(long, value_parser = choice(METHODS), default_value = "exact")]
    method: Method,
    /// Stop when the proven bound is below the cost by at most this share of the cost
    #[arg(long, default_value_t = 0.05)]
    gap: f64,
    /// Stop after this many seconds, but not before the greedy choice is complete. Report the best choice so far with its
    /// proven bound and gap [default: no limit]
    #[arg(long, value_name = "SECONDS")]
    time_limit: Option<f64>,
    /// Look at tags only from places within this distance of the straight line from start to goal, in metres
    #[arg(long, default_value_t = 2.0)]
    beside: f64,
    /// The largest accepted risk that a plan fails although no step reports a failure
    #[arg(long, default_value_t = 0.05)]
    most_risk: f64,
    /// Largest number of labels that the search for one plan evaluates
    #[arg(long, default_value_t = 100_000)]
    limit: usize,
    /// Write a mounting sheet of the chosen tags: A4 pages as HTML if the file's name ends with .html, else as SVG
    #[arg(long)]
    sheet: Option<Output>,
    /// Write the site file with the chosen tags as tags, and without candidates
    #[arg(short, long)]
    output: Option<Output>,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

const METHODS: [(&str, Method); 2] = [("exact", Method::Exact), ("greedy", Method::Greedy)];

pub fn run(arguments: &Arguments, files: &Files) -> Outcome {
    let (text, name) = files.read_text(&arguments.site)?;
    let site = parsed(files, &text, &name)?;
    check_stated_errors(&site)?;
    if let Some(from) = &arguments.from {
        site.chain(from).map_err(Failure::input)?;
    }
    let order = CoverOptions {
        from: arguments.from.clone(),
        survive_a_lost_tag: arguments.survive_lost_tags > 0,
        method: arguments.method,
        gap: arguments.gap,
        time_limit: arguments.time_limit,
        beside: arguments.beside,
        most_risk: arguments.most_risk,
        limit: arguments.limit,
    };
    let wrong = |error| failure(&arguments.site, error);
    let interrupt = Interrupt::new();
    let searched = with_bars(|tick, show| {
        let improved = |incumbent: Incumbent| {
            interrupt.has_answer.store(true, Ordering::Relaxed);
            show(&progress_line(&incumbent));
        };
        let watch = Watch {
            tick,
            improved: &improved,
            stop: interrupt.stop.clone(),
        };
        cover_watched(&site, &order, &watch)
    });
    let found = searched.map_err(wrong)?;
    if let (Some(path), true) = (&arguments.output, found.serves_all()) {
        let target = path.display().to_string();
        let text = written(&text, &target, &found).ok_or_else(|| unread(&name, &target))?;
        files.write(path, text.as_bytes())?;
    }
    if let (Some(path), true) = (&arguments.sheet, found.serves_all()) {
        let content = MountingSheet {
            title: "Mounting sheet",
            origin: &site.origin(&name),
            tags: &mounted(&found),
            walls: &site.walls,
        };
        sheet::write(files, path, &content)?;
    }
    if arguments.json {
        print_json(&found.to_json())?;
    } else {
        print_cover(&found, &site)?;
    }
    Ok(answer(found.serves_all()))
}

/// Returns the chosen tags for a mounting sheet.
fn mounted(found: &Cover) -> Vec<Mounted> {
    let mounted = |chosen: &ChosenTag| Mounted {
        name: chosen.name.clone(),
        family: chosen.tag.family.clone(),
        tag: chosen.tag.tag,
        reserve: (!chosen.tag.tolerance.is_none()).then_some(chosen.tag.tolerance),
        left: None,
    };
    found.tags.iter().map(mounted).collect()
}

fn unread(name: &str, target: &str) -> Failure {
    Failure::usage(
        format!(
            "{name}: the candidates cannot be removed from the file's text, or it names files that are not in the folder of {target}"
        ),
        "write each candidate as a [candidate.NAME] or [candidates.NAME] table, and the output into the same folder",
    )
}

/// Called after each step of a stage, with the number of steps if it is known.
type Tick<'a> = &'a (dyn Fn(Stage, Option<usize>) + Sync);

/// Shows a line of text.
type ShowLine<'a> = &'a (dyn Fn(&str) + Sync);

/// What Ctrl-C does: the first one ends the search if it has an answer, else the program.
struct Interrupt {
    stop: Arc<AtomicBool>,
    has_answer: Arc<AtomicBool>,
}

impl Interrupt {
    /// The exit code of a program that Ctrl-C ended.
    const INTERRUPTED: i32 = 130;

    fn new() -> Self {
        let (stop, has_answer) = (
            Arc::new(AtomicBool::new(false)),
            Arc::new(AtomicBool::new(false)),
        );
        let (asked, known) = (stop.clone(), has_answer.clone());
        // Without a handler Ctrl-C ends the program at once, as usual.
        let _ = ctrlc::set_handler(move || {
            if asked.swap(true, Ordering::Relaxed) || !known.load(Ordering::Relaxed) {
                std::process::exit(Self::INTERRUPTED);
            }
        });
        Self { stop, has_answer }
    }
}

/// Returns the line that shows the best choice so far.
fn progress_line(incumbent: &Incumbent) -> String {
    format!(
        "cost {}, no choice costs less than {:.3} (gap {:.1} %), after {:.1} s",
        incumbent.cost,
        incumbent.bound,
        100.0 * incumbent.gap(),
        incumbent.seconds
    )
}

/// Runs `work` with one progress bar per stage, or a line of text if stderr is not a terminal.
fn with_bars(
    work: impl FnOnce(Tick<'_>, ShowLine<'_>) -> Result<Cover, CoverError>,
) -> Result<Cover, CoverError> {
    let is_seen = std::io::stderr().is_terminal();
    let message: Mutex<String> = Mutex::default();
    let shown: Mutex<Option<(Stage, ProgressBar)>> = Mutex::new(None);
    let tick = |stage: Stage, of: Option<usize>| {
        let Ok(mut shown) = shown.lock() else {
            return;
        };
        let what = match stage {
            Stage::Tables => "tables",
            Stage::Reach => "reach",
            Stage::Rounds => "rounds",
            Stage::Check => "checking",
        };
        if shown.as_ref().is_none_or(|(known, _)| *known != stage) {
            if let Some((_, bar)) = shown.take() {
                bar.finish_and_clear();
            }
            *shown = Some((stage, progress(of.unwrap_or(0) as u64, what)));
        }
        if let Some((_, bar)) = shown.as_ref() {
            if let (Stage::Rounds, Ok(message)) = (stage, message.lock()) {
                bar.set_message(message.clone());
            }
            bar.inc(1);
        }
    };
    let show = |line: &str| {
        if !is_seen {
            warn(&line);
        } else if let Ok(mut message) = message.lock() {
            line.clone_into(&mut message);
        }
    };
    let found = work(&tick, &show);
    if let Ok(mut shown) = shown.lock()
        && let Some((_, bar)) = shown.take()
    {
        bar.finish_and_clear();
    }
    found
}

fn failure(path: &Input, error: CoverError) -> Failure {
    let help = match &error {
        CoverError::NoStart(_) => {
            "write the start once, with frame = \"goal\", if all tasks are approached in the same way"
        }
        CoverError::Plan(error) => match error {
            PlanError::BoundTooLarge { .. } => {
                "make [planner] r smaller, or look = {...} wider: see --help"
            }
            _ => "see `posegate plan --help`",
        },
        _ => "see `posegate cover --help`",
    };
    Failure::usage(format!("{}: {error}", path.display()), help)
}

fn print_cover(found: &Cover, site: &Site) -> Result<(), Failure> {
    for chosen in &found.tags {
        let pose = chosen.tag.tag.pose;
        let mut line = format!(
            "{}: {} {} at x {:.3} m, y {:.3} m, z {:.3} m, yaw {:.1} deg, cost {}",
            chosen.name,
            chosen.tag.family,
            chosen.tag.tag.id,
            pose.x,
            pose.y,
            pose.z,
            pose.yaw_deg,
            chosen.cost
        );
        for (what, tasks) in [
            ("without it no plan for", &chosen.needed_by),
            ("without it no second plan for", &chosen.second_of),
        ] {
            if !tasks.is_empty() {
                line += &format!("; {what} {}", tasks.join(", "));
            }
        }
        print(&line)?;
    }
    for task in &found.tasks {
        match &task.reason {
            None => print(&format_args!("{}: {}", task.task, task.steps().join(", ")))?,
            Some(reason) => print(&format_args!("{}: NOT SERVED: {reason}", task.task))?,
        }
    }
    let reports = found.tasks.iter().filter_map(|task| {
        let report = task.planned.plan.as_ref()?.report();
        Some((report.worst_margin()?, &task.task))
    });
    if let Some(((margin, step), task)) = reports.min_by_key(|((margin, _), _)| margin.q16())
        && let Some(advice) = little_slack(margin)
    {
        print(&format_args!(
            "worst margin {} at step {} to {task}: {advice}",
            margin_text(margin),
            step + 1
        ))?;
    }
    let served = found.tasks.iter().filter(|task| task.reason.is_none());
    print(&format_args!(
        "{}{} of {} candidates, cost {}: {} of {} tasks served; no choice costs less than {:.3} (gap {:.1} %) by chains within {} m of the straight way",
        if found.is_finished {
            ""
        } else {
            "stopped early: "
        },
        found.tags.len(),
        site.candidates.len(),
        found.cost,
        served.count(),
        found.tasks.len(),
        found.bound,
        100.0 * found.gap(),
        found.beside
    ))
}
