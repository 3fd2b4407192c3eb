//! `posegate draw`: draws pictures of a task.

use crate::site_input::{Failure, Outcome, answer, site};
use posegate_files::files::{Files, Input, Output};
use posegate_replay::{Columns, estimates};
use posegate_show::draw::{DrawError, Subject, task_image, task_plan, task_sections};

/// Draws a task: its success set heading by heading, its floor plan, or its camera's image
#[derive(clap::Args)]
#[command(
    after_help = "Example:\n  posegate draw site.toml --task see-t7 --table see-t7.posegate --expected -o see-t7.svg\n  posegate draw site.toml --task see-t7 --kind plan -o plan.svg\n  posegate draw site.toml --task see-t7 --kind image --expected -o image.svg"
)]
pub struct Arguments {
    /// The site file; `-` for standard input
    site: Input,
    /// The task
    #[arg(long)]
    task: String,
    /// The picture to write (SVG); `-` for standard output
    #[arg(short, long)]
    output: Output,
    /// What to draw
    #[arg(long, value_enum, default_value = "sections")]
    kind: Kind,
    /// A table of the task: its poses are drawn, and pose-sets are checked against it
    #[arg(long)]
    table: Option<Input>,
    /// Draw the pose-sets of these estimates (CSV)
    #[arg(long, conflicts_with = "expected")]
    estimates: Option<Input>,
    /// Draw the task's `expected` pose-set
    #[arg(long)]
    expected: bool,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum Kind {
    /// The success set at several headings
    Sections,
    /// The floor: walls, tags, the goal, the camera's view
    Plan,
    /// The tags in the camera's image, from the goal and from the worst poses
    Image,
}

pub fn run(arguments: &Arguments, files: &Files) -> Outcome {
    let site = site(files, &arguments.site)?;
    let refused = |error| refused(arguments, error);
    let mut subject = Subject::new(&site, &arguments.task).map_err(refused)?;
    let bytes = match &arguments.table {
        Some(path) => Some(files.read(path)?.0),
        None => None,
    };
    if let Some(bytes) = &bytes {
        subject = subject.with_table(bytes).map_err(refused)?;
    }
    if arguments.expected {
        subject = subject.expected().map_err(refused)?;
    }
    if let Some(path) = &arguments.estimates {
        let (text, name) = files.read(path)?;
        let rows = estimates(text.as_slice(), &name, Columns::Estimates).map_err(Failure::input)?;
        subject = subject.estimates(&rows).map_err(refused)?;
    }
    let picture = match arguments.kind {
        Kind::Sections => task_sections(&subject),
        Kind::Plan => task_plan(&subject),
        Kind::Image => task_image(&subject),
    };
    files.write(&arguments.output, picture.map_err(refused)?.as_bytes())?;
    Ok(answer(true))
}

fn refused(arguments: &Arguments, error: DrawError) -> Failure {
    let site = arguments.site.display();
    match error {
        DrawError::Task(error) => Failure::input(error),
        DrawError::Table(_) | DrawError::OtherTable(_) => {
            let table = arguments.table.as_ref().map(|path| path.display());
            let table = table.map_or(String::new(), |table| format!("{table}: "));
            Failure::usage(
                format!("{table}{error}"),
                "build it again with `posegate table build`",
            )
        }
        DrawError::NoExtent(_) => Failure::usage(
            format!("{site}: {error}"),
            "add `expected = { translation = .., yaw_deg = .. }` to the task, or an extent in [table] or task.NAME.table",
        ),
        DrawError::NothingExpected(_) => Failure::usage(
            format!("{site}: {error}"),
            "add `expected = { translation = .., yaw_deg = .. }` to the task, or leave out --expected",
        ),
        DrawError::NoCamera(_) => Failure::usage(
            format!("{site}: {error}"),
            "draw `--kind sections` or `--kind plan`",
        ),
        error => Failure::usage(error.to_string(), "give other estimates"),
    }
}
