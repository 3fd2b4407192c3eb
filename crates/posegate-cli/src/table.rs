//! `posegate table`: builds, shows, proves and exports tables, and seals the firmware that has them.

use crate::arguments::choice;
use crate::gate::not_a_table;
use crate::site_input::{Failure, Outcome, answer, print, print_json, progress, site, task, warn};
use posegate::bake::{self, BakeError, BakeInput, Language, Layout, source};
use posegate::table::{EDGE_BITS, PIXEL_BITS, SightRecord, Table};
use posegate::verify::{
    BuildError, Coverage, ExpectedTable, Proof, VerifyError, build as build_table, coverage,
    verify, volume,
};
use posegate_files::files::{Files, Input, Output};
use posegate_files::printable::{hex, printable_json};
use posegate_show::doctor::{Warning, examine};
use posegate_site::controller_cost::{self, Level};
use posegate_site::{Core, Site, TableSpec, Task};
use serde_json::{Value, json};
use std::time::Instant;

mod seal;

/// Builds, shows, proves and exports tables; seals firmware
#[derive(clap::Subcommand)]
pub enum Command {
    /// Builds the table of a task's success set, proves it, and writes it
    #[command(
        after_help = "Example:\n  posegate table build site.toml --task dock -o dock.posegate"
    )]
    Build(Build),
    /// Shows the content of a table
    #[command(after_help = "Example:\n  posegate table info dock.posegate --json")]
    Info(Info),
    /// Proves a table's bytes against a site file
    #[command(after_help = "Example:\n  posegate table verify dock.posegate site.toml")]
    Verify(Verify),
    /// Writes a table as a constant array for firmware
    #[command(
        after_help = "Example:\n  posegate table export dock.posegate --format c -o dock_table.h"
    )]
    Export(Export),
    /// Shows the flash, the stack and the instructions that a gate in C takes with a table
    #[command(
        after_help = "Example:\n  posegate table cost dock.posegate --tracker --core cortex-m4f"
    )]
    Cost(Cost),
    Seal(seal::Arguments),
}

#[derive(clap::Args)]
pub struct Build {
    /// The site file; `-` for standard input
    site: Input,
    /// The task
    #[arg(long)]
    task: String,
    /// The file to write the table to; `-` for standard output
    #[arg(short, long, required_unless_present = "dry_run")]
    output: Option<Output>,
    /// Build and prove, but write nothing: print the extent, the cells, the bytes and the time
    #[arg(long)]
    dry_run: bool,
    /// The layout, instead of the site file's
    #[arg(long, value_enum)]
    layout: Option<LayoutName>,
    /// Number of threads [default: one per core]
    #[arg(long)]
    threads: Option<usize>,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum LayoutName {
    /// As `facets`
    Auto,
    /// Half-planes, in several pieces if the set is not convex
    Facets,
    /// Cells, for any set: larger and slower than facets, and they deny more
    Grid,
    /// As `facets`, for older scripts
    Both,
}

#[derive(clap::Args)]
pub struct Info {
    /// The table; `-` for standard input
    table: Input,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

#[derive(clap::Args)]
pub struct Verify {
    /// The table; `-` for standard input
    table: Input,
    /// The site file
    site: Input,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

#[derive(clap::Args)]
pub struct Export {
    /// The table; `-` for standard input
    table: Input,
    /// The language
    #[arg(long, value_parser = choice(LANGUAGES))]
    format: Language,
    /// The file to write the source to; `-` for standard output
    #[arg(short, long)]
    output: Output,
    /// Print JSON: what was written
    #[arg(long)]
    json: bool,
}

const LANGUAGES: [(&str, Language); 2] = [("c", Language::C), ("rust", Language::Rust)];

#[derive(clap::Args)]
pub struct Cost {
    /// The table; `-` for standard input
    table: Input,
    /// The processor core
    #[arg(long, value_parser = choice(Core::ALL.map(|core| (core.name(), core))))]
    core: Core,
    /// With a tracker: fixes are carried along odometry
    #[arg(long)]
    tracker: bool,
    /// The level of optimization of the archive
    #[arg(long, default_value = "3", value_parser = choice(Level::ALL.map(|level| (level.name(), level))))]
    level: Level,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

pub fn run(command: &Command, files: &Files) -> Outcome {
    match command {
        Command::Cost(arguments) => cost(arguments, files),
        Command::Seal(arguments) => seal::run(arguments, files),
        Command::Build(arguments) => build(arguments, files),
        Command::Info(arguments) => info(arguments, files),
        Command::Verify(arguments) => check(arguments, files),
        Command::Export(arguments) => export(arguments, files),
    }
}

fn build(arguments: &Build, files: &Files) -> Outcome {
    arguments.check()?;
    let site = site(files, &arguments.site)?;
    let chosen = task(&site, &arguments.task)?;
    let mut spec = spec(&site, chosen, &arguments.site, &arguments.task)?;
    if let Some(layout) = arguments.layout {
        spec.layout = match layout {
            LayoutName::Auto | LayoutName::Facets | LayoutName::Both => Layout::Facets,
            LayoutName::Grid => Layout::Grid,
        };
    }
    arguments.start_threads()?;
    let order = BakeInput {
        task: &arguments.task,
        success: &chosen.success,
        spec,
        epsilon: site.epsilon,
    };
    let refused = |error| Failure::table(&arguments.site, &arguments.task, error);
    let slabs = u64::from(bake::check(&order).map_err(refused)?.slabs);
    let started = Instant::now();
    let bar = progress(2 * slabs, "building");
    let built = build_table(&order, &|| bar.inc(1));
    bar.finish_and_clear();
    let seconds = started.elapsed().as_secs_f64();
    let (bytes, proof) = built.map_err(|error| match (&error, cause(&site, &arguments.task)) {
        (BuildError::Bake(BakeError::Empty { .. }), Some(cause)) => Failure::usage(
            format!(
                "{}: task `{}`: {error}",
                arguments.site.display(),
                arguments.task
            ),
            &cause,
        ),
        _ => Failure::build(&arguments.site, &arguments.task, error),
    })?;
    if let (Some(output), false) = (&arguments.output, arguments.dry_run) {
        files.write(output, &bytes)?;
    }
    let table = Table::parse(&bytes).map_err(|error| Failure::internal(error.to_string()))?;
    let file = arguments
        .output
        .as_ref()
        .filter(|_| !arguments.dry_run)
        .map(|output| output.display().to_string());
    let covered = coverage(&table, &chosen.success);
    if arguments.json {
        let mut facts = facts(&table);
        facts["site_digest"] = json!(site.digest_text());
        facts["covered"] = json!(covered.share);
        facts["file"] = json!(file);
        facts["proven"] = of_proof(proof);
        facts["build_s"] = json!(seconds);
        let volume = volume(&table, &chosen.success);
        facts["volume_m2_rad"] = json!({"cells": volume.cells, "facets": volume.facets});
        print_json(&facts)?;
    } else if arguments.dry_run || !arguments.output.as_ref().is_some_and(Output::is_standard) {
        if arguments.dry_run {
            print_extent(&spec, &table)?;
        }
        print(&format_args!(
            "{}: {} bytes, proven inside: {} (built in {:.0} ms)",
            file.unwrap_or_else(|| "not written".into()),
            bytes.len(),
            proof_text(proof),
            seconds * 1e3,
        ))?;
        let worst = table.worst_case();
        print(&format_args!(
            "a decision takes at most {} instructions on a Cortex-M4F, {} on a Cortex-M0+",
            worst.instructions_m4f(),
            worst.instructions_m0_plus(),
        ))?;
        print(&format_args!(
            "it holds {:.1} % of the success set within its extent, by {} poses",
            100.0 * covered.share,
            covered.poses,
        ))?;
    }
    if covered.is_low() {
        warn(&format_args!(
            "warning: task `{}`: {covered}",
            arguments.task
        ));
    } else if covered.poses < Coverage::POSES {
        warn(&format_args!(
            "warning: task `{}`: the success set is so thin that only {} of its poses were found: the share is uncertain",
            arguments.task, covered.poses
        ));
    }
    Ok(answer(true))
}

impl Build {
    /// Refuses arguments that contradict each other.
    fn check(&self) -> Result<(), Failure> {
        let on_stdout = self.output.as_ref().is_some_and(Output::is_standard);
        if self.json && !self.dry_run && on_stdout {
            return Err(Failure::usage(
                "standard output cannot hold both the table and the JSON".into(),
                "write the table to a file, or leave out --json",
            ));
        }
        if self.threads == Some(0) {
            return Err(Failure::usage(
                "--threads 0 does no work".into(),
                "give 1 or more, or leave it out",
            ));
        }
        Ok(())
    }

    /// Starts the number of threads that --threads states.
    fn start_threads(&self) -> Result<(), Failure> {
        let Some(threads) = self.threads else {
            return Ok(());
        };
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build_global()
            .map_err(|error| {
                Failure::usage(
                    format!("--threads {threads}: {error}"),
                    "give a small number of threads",
                )
            })
    }
}

/// Prints the extent of a table and the number of its cells.
fn print_extent(spec: &TableSpec, table: &Table<'_>) -> Result<(), Failure> {
    let [x, y, yaw] = [spec.extent.x, spec.extent.y, spec.extent.yaw_deg];
    let cells = table.cells();
    print(&format_args!(
        "extent x {:.2} to {:.2} m, y {:.2} to {:.2} m, yaw {:.1} to {:.1} deg: {} x {} x {} cells",
        x[0], x[1], y[0], y[1], yaw[0], yaw[1], cells.columns, cells.rows, cells.slabs
    ))
}

/// Returns what the table of a task covers.
fn spec(site: &Site, task: &Task, input: &Input, name: &str) -> Result<TableSpec, Failure> {
    site.chosen_table(task).ok_or_else(|| {
        Failure::usage(
            format!(
                "{}: no extent can be chosen for the task `{name}`: its success set has no bound, or no pose",
                input.display(),
            ),
            "add `expected = { translation = .., yaw_deg = .. }` to the task, or an extent in [table] or task.NAME.table",
        )
    })
}

/// Builds and proves the table of a task; `input` is the site's name in messages.
pub fn built(site: &Site, input: &Input, name: &str, epsilon: f64) -> Result<Vec<u8>, Failure> {
    let task = task(site, name)?;
    let order = BakeInput {
        task: name,
        success: &task.success,
        spec: spec(site, task, input, name)?,
        epsilon,
    };
    let built = build_table(&order, &|| ());
    let (bytes, _) = built.map_err(|error| Failure::build(input, name, error))?;
    Ok(bytes)
}

fn claim<'a>(site: &'a Site, name: &'a str) -> Result<ExpectedTable<'a>, Failure> {
    Ok(ExpectedTable {
        task: name,
        success: &task(site, name)?.success,
        epsilon: site.epsilon,
    })
}

/// Describes a proof in words.
fn proof_text(proof: Proof) -> String {
    let grid = format!("{} cells in {} runs", proof.cells, proof.runs);
    let facets = format!("{} corners of facet pieces", proof.corners);
    match (proof.cells, proof.corners) {
        (_, 0) => grid,
        (0, _) => facets,
        _ => format!("{grid}, {facets}"),
    }
}

fn of_proof(proof: Proof) -> Value {
    json!({"runs": proof.runs, "cells": proof.cells, "corners": proof.corners})
}

/// Returns the content of a table as JSON.
fn facts(table: &Table<'_>) -> Value {
    let cells = table.cells();
    let goal = table.goal();
    let degrees = |units: f64| units * (360.0 / 4_294_967_296.0);
    let yaw_lo = degrees(f64::from(cells.yaw_lo.signed()));
    let worst = table.worst_case();
    let (mut runs, mut covered) = (0u64, 0u64);
    if let Some(grid) = table.grid() {
        for slab in (0..cells.slabs).map(|k| grid.slab(k)) {
            for run in (0..cells.rows).flat_map(|row| slab.runs(row)) {
                runs += 1;
                covered += u64::from(run.last - run.first) + 1;
            }
        }
    }
    json!({
        "task": table.task(),
        "format_version": posegate::table::VERSION,
        "tool_version": table.tool_version(),
        "task_digest": hex(&table.task_digest()),
        "table_digest": hex(&table.digest()),
        "crc32c": format!("{:08x}", table.crc()),
        "bytes": table.bytes().len(),
        "epsilon": table.epsilon(),
        "radius_squared": f64::from(table.radius_squared().q16()) / 65536.0,
        "layout": if table.facets().is_some() { "facets" } else { "grid" },
        "facets": table.facets().map(|layout| json!({
            "bytes": layout.byte_length(),
            "count": layout.facet_count(),
            "pieces": layout.pieces().count(),
            "frames": layout.frame_count(),
            "length_unit_um": 1u32 << layout.unit(),
        })),
        "goal": {
            "x": f64::from(goal.pose.x_um) / 1e6,
            "y": f64::from(goal.pose.y_um) / 1e6,
            "yaw_deg": degrees(f64::from(goal.pose.yaw.signed())),
        },
        "extent": {
            "x": [f64::from(cells.x_lo_um) / 1e6, f64::from(cells.x_hi_um()) / 1e6],
            "y": [f64::from(cells.y_lo_um) / 1e6, f64::from(cells.y_hi_um()) / 1e6],
            "yaw_deg": [yaw_lo, yaw_lo + degrees(cells.yaw_span as f64)],
        },
        "step": {
            "xy": f64::from(cells.step_um) / 1e6,
            "yaw_deg": degrees(cells.yaw_span as f64) / f64::from(cells.slabs),
        },
        "cells": [cells.columns, cells.rows, cells.slabs],
        "grid": {
            "bytes": table.grid().map(|grid| grid.byte_length()),
            "runs": runs,
            "covered_cells": covered,
        },
        "sight": table.sight_record().map(|record| sight(&record)),
        "parts": table.parts().names().collect::<Vec<_>>(),
        "worst_case": {
            "m4f": worst.instructions_m4f(),
            "m0plus": worst.instructions_m0_plus(),
        },
    })
}

/// Returns a sight record as JSON, in the units of the site file.
fn sight(record: &SightRecord) -> Value {
    let pixels = |pair: [i32; 2]| pair.map(|v| f64::from(v) / f64::from(1 << PIXEL_BITS));
    let metres = |um: i32| f64::from(um) / 1e6;
    let axis = |axis: [i32; 3]| axis.map(|v| f64::from(v) / f64::from(1 << 30));
    let degrees = |cos: i32| (f64::from(cos) / f64::from(1 << 30)).acos().to_degrees();
    let ([fx, fy], [cx, cy]) = (pixels(record.focal), pixels(record.centre));
    let [width, height] = pixels(record.image);
    let half = record
        .half_right
        .map(|v| metres(v) / f64::from(1 << EDGE_BITS));
    json!({
        "tag": record.tag,
        "camera": {
            "width_px": width, "height_px": height, "fx": fx, "fy": fy, "cx": cx, "cy": cy,
            "position": record.camera.map(metres),
            "forward": axis(record.axes[2]),
        },
        "tag_position": record.middle.map(metres),
        "tag_normal": axis(record.normal),
        "tag_size": 2.0 * half.iter().map(|v| v * v).sum::<f64>().sqrt(),
        "z_near": metres(record.z_near),
        "d_max": metres(record.d_max),
        "phi_max_deg": degrees(record.cos_phi),
        "psi_max_deg": degrees(record.cos_psi),
    })
}

fn info(arguments: &Info, files: &Files) -> Outcome {
    let (bytes, name) = files.read(&arguments.table)?;
    let table = Table::parse(&bytes).map_err(|error| not_a_table(&name, error))?;
    let facts = facts(&table);
    if arguments.json {
        print_json(&facts)?;
    } else {
        let pretty = serde_json::to_string_pretty(&facts).map_err(Failure::input)?;
        print(&printable_json(&pretty))?;
    }
    Ok(answer(true))
}

fn cost(arguments: &Cost, files: &Files) -> Outcome {
    let (bytes, name) = files.read(&arguments.table)?;
    let table = Table::parse(&bytes).map_err(|error| not_a_table(&name, error))?;
    let cost = controller_cost::cost(&table, arguments.core, arguments.level, arguments.tracker);
    let total = cost.flash_of_gate + cost.flash_of_tracker + cost.flash_of_table;
    if arguments.json {
        print_json(&json!({
            "parts": cost.parts,
            "flash": {"gate": cost.flash_of_gate, "tracker": cost.flash_of_tracker, "table": cost.flash_of_table, "total": total},
            "stack": {"init": cost.stack_of_init, "step": cost.stack_of_step, "tracked": cost.stack_of_tracked},
            "cycle": {"without_fix": cost.without_fix, "with_fix": cost.with_fix, "change_of_table": cost.change_of_table},
        }))?;
        return Ok(answer(true));
    }
    print(&format_args!(
        "{name} on {}, archive `{}-{}`:\n\
         flash: gate {}, tracker {}, table {}, total {total} bytes\n\
         stack: init {}, step {}, tracker {} bytes\n\
         a cycle takes at most {} instructions, {} with a fix; a change of table {}",
        arguments.core.name(),
        cost.parts,
        arguments.level.name(),
        cost.flash_of_gate,
        cost.flash_of_tracker,
        cost.flash_of_table,
        cost.stack_of_init,
        cost.stack_of_step,
        cost.stack_of_tracked,
        cost.without_fix,
        cost.with_fix,
        cost.change_of_table,
    ))?;
    Ok(answer(true))
}

fn check(arguments: &Verify, files: &Files) -> Outcome {
    let (bytes, name) = files.read(&arguments.table)?;
    let site = site(files, &arguments.site)?;
    let table = Table::parse(&bytes).map_err(|error| not_a_table(&name, error))?;
    let claim = claim(&site, table.task())?;
    let bar = progress(u64::from(table.cells().slabs), "proving");
    let started = Instant::now();
    let result = verify(&bytes, &claim, &|| bar.inc(1));
    bar.finish_and_clear();
    let seconds = started.elapsed().as_secs_f64();
    let proven = result.is_ok();
    if arguments.json {
        let line = match &result {
            Ok(proof) => {
                json!({"proven": true, "runs": proof.runs, "cells": proof.cells, "corners": proof.corners, "prove_s": seconds})
            }
            Err(error) => {
                let cell = match error {
                    VerifyError::Cell(cell) => json!({
                        "slab": cell.slab, "row": cell.row, "column": cell.column, "pose_in_goal": cell.pose,
                    }),
                    _ => Value::Null,
                };
                json!({"proven": false, "error": error.to_string(), "first_unproven": cell, "prove_s": seconds})
            }
        };
        print_json(&line)?;
    } else {
        match &result {
            Ok(proof) => print(&format_args!(
                "{name}: proven: {} lie inside the success set of `{}`",
                proof_text(*proof),
                table.task()
            ))?,
            Err(error) => print(&format_args!("{name}: NOT proven: {error}"))?,
        }
    }
    Ok(answer(proven))
}

fn export(arguments: &Export, files: &Files) -> Outcome {
    let (bytes, name) = files.read(&arguments.table)?;
    let table = Table::parse(&bytes).map_err(|error| not_a_table(&name, error))?;
    let text = source(&table, arguments.format);
    files.write(&arguments.output, text.as_bytes())?;
    if arguments.json && !arguments.output.is_standard() {
        print_json(&json!({
            "file": arguments.output.display().to_string(), "task": table.task(),
            "bytes": table.bytes().len(), "crc32c": format!("{:08x}", table.crc()),
        }))?;
    }
    Ok(answer(true))
}

/// Returns why a task's set is empty, if the site's tags or cameras are the cause.
fn cause(site: &Site, name: &str) -> Option<String> {
    let warnings = examine(site).warnings;
    let is_empty = |warning: &Warning| warning.empties && warning.about == format!("task {name}");
    let empty = warnings.iter().find(|warning| is_empty(warning))?;
    let tags = site.tasks.get(name)?.success.tags();
    let of_its_tag = |warning: &&Warning| {
        let mut known = site.tags.iter();
        known.any(|(name, tag)| warning.about == format!("tag {name}") && tags.contains(&tag.tag))
    };
    let cause = warnings.iter().find(of_its_tag).unwrap_or(empty);
    Some(format!("{}: {}", cause.about, cause.message))
}
