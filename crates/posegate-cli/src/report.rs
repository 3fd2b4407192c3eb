//! `posegate report`: writes a site as one HTML page.

use crate::site_input::{Failure, Outcome, answer, progress, site, warn};
use posegate_files::files::{Files, Input, NamedInput, Output};
use posegate_show::page::{Contents, PageInput, page};
use serde_json::Value;

/// Writes a site as one HTML page in which the firmware's core decides on an estimate that the reader drags
///
/// The page fetches nothing, so it can be mailed or put on any server. Its tables are built and proven.
#[derive(clap::Args)]
#[command(
    after_help = "Example:\n  posegate report site.toml -o report.html\n  posegate place site.toml --task see-t7 --sigma-x 0.1 --sigma-y 0.1 --sigma-yaw-deg 1 --free x=0.3:7,y=-3:3 --json > place.json\n  posegate report site.toml --placement see-t7=place.json -o report.html"
)]
pub struct Arguments {
    /// The site file; `-` for standard input
    site: Input,
    /// The page to write; `-` for standard output
    #[arg(short, long)]
    output: Output,
    /// The page's title [default: the file's name]
    #[arg(long)]
    title: Option<String>,
    /// Output of `posegate place --json` for a task's tag: TASK=FILE; may be repeated
    #[arg(long, value_name = "TASK=FILE", value_parser = placement)]
    placement: Vec<NamedInput>,
    /// A picture (SVG) of another command, shown with its file's name; may be repeated
    #[arg(long, value_name = "FILE")]
    picture: Vec<Input>,
}

fn placement(text: &str) -> Result<NamedInput, &'static str> {
    text.parse().map_err(|_| "expected TASK=FILE")
}

pub fn run(arguments: &Arguments, files: &Files) -> Outcome {
    let parsed = site(files, &arguments.site)?;
    let named = |path: &Input| {
        let name = path.as_path();
        let name = name.file_stem().unwrap_or(name.as_os_str());
        match name.to_string_lossy() {
            name if name == "-" => "site".to_owned(),
            name => name.into_owned(),
        }
    };
    let mut placements = Vec::new();
    for NamedInput { name: task, input } in &arguments.placement {
        let (bytes, name) = files.read(input)?;
        let placement: Value = serde_json::from_slice(&bytes).map_err(|error| {
            Failure::usage(
                format!("{name}: {error}"),
                "give what `posegate place --json` prints",
            )
        })?;
        placements.push((task.clone(), placement));
    }
    let mut pictures = Vec::new();
    for path in &arguments.picture {
        let (bytes, name) = files.read(path)?;
        let svg = String::from_utf8(bytes).ok();
        let svg = svg.filter(|svg| svg.contains("<svg"));
        let svg = svg.ok_or_else(|| {
            Failure::usage(
                format!("{name} is not an SVG picture"),
                "give what a command's `-o FILE.svg` writes",
            )
        })?;
        pictures.push((named(path), svg));
    }
    let order = PageInput {
        site: &parsed,
        file: arguments.site.display().to_string(),
        title: arguments
            .title
            .clone()
            .unwrap_or_else(|| named(&arguments.site)),
        placements,
        pictures,
    };
    let refused = |error: posegate_show::page::PageError| {
        Failure::usage(
            format!("{}: {error}", arguments.site.display()),
            "see `posegate report --help`",
        )
    };
    let bar = progress(parsed.tasks.len() as u64, "tasks");
    let contents = Contents::of(&parsed, &|_| bar.inc(1));
    bar.finish_and_clear();
    let contents = contents.map_err(refused)?;
    let without = contents.tasks.iter().filter_map(|task| {
        let why = task.table.as_ref().err()?;
        Some((&task.name, "has no table", why))
    });
    let left_out = contents.left_out.iter();
    let left_out = left_out.map(|(name, why)| (name, "is not shown", why));
    for (name, what, why) in without.chain(left_out) {
        warn(&format_args!("task `{name}` {what}: {why}"));
    }
    let text = page(&order, &contents).map_err(refused)?;
    files.write(&arguments.output, text.as_bytes())?;
    Ok(answer(true))
}
