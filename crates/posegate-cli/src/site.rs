//! `posegate site`: all tables, proofs and plans of a site, in shards.

use crate::site_input::{Failure, Outcome, answer, print, print_json, progress_with_rate, site};
use posegate_files::files::{Files, Input, Output, OutputFolder};
use posegate_plan::Options;
use posegate_plan::site_build::{
    self, BuildOptions, Inventory, MergeChecks, Recipe, Shard, SiteBuildError,
};
use posegate_show::draw::site_routes_picture;
use serde_json::json;
use std::num::NonZeroUsize;
use std::path::Path;
use std::time::Instant;

/// Builds all of a site, on one machine or many
#[derive(clap::Subcommand)]
pub enum Command {
    /// Makes the tables, proofs and plans of a site, or of a shard of it
    #[command(
        after_help = "Examples:\n  posegate site build site.toml -o built\n  posegate site build site.toml --shard 2/8 --resume -o built\n\nA shard depends only on the site, its index and the count. Array jobs may set POSEGATE_SHARD_INDEX (from 0) and POSEGATE_SHARD_COUNT instead of --shard. All shards must run the same program file. When all have ended: posegate site merge built"
    )]
    Build(Build),
    /// Merges the pieces of all shards, with a manifest, or names what is missing
    #[command(
        after_help = "Examples:\n  posegate site merge built\n  posegate site merge built --site site.toml --prove --picture routes.svg\n\nWithout --prove it trusts what shards of the same program wrote in the folder: whoever can write there can forge tables and their proofs. With it every table is proven again; plans are trusted either way.\n\nExit code 1 if a work task has no plan (its file has the reason), or if a table is not proven (then nothing is merged)."
    )]
    Merge(Merge),
}

#[derive(clap::Args)]
pub struct Build {
    /// The site file; `-` for standard input
    site: Input,
    /// Shard I, from 0, of N: I/N [default: all]
    #[arg(long)]
    shard: Option<Shard>,
    /// Index of the shard, from 0
    #[arg(
        long,
        env = "POSEGATE_SHARD_INDEX",
        value_name = "I",
        value_parser = site_build::number,
        requires = "shard_count"
    )]
    shard_index: Option<u32>,
    /// Number of shards
    #[arg(
        long,
        env = "POSEGATE_SHARD_COUNT",
        value_name = "N",
        value_parser = site_build::number,
        requires = "shard_index"
    )]
    shard_count: Option<u32>,
    /// Keep finished pieces
    #[arg(long)]
    resume: bool,
    /// The folder to write into; shards may share it
    #[arg(short, long)]
    output: OutputFolder,
    /// Build tables and proofs, but no plans
    #[arg(long)]
    tables_only: bool,
    /// The largest accepted risk that a plan fails although no step reports a failure
    #[arg(long, default_value_t = 0.05)]
    most_risk: f64,
    /// Number of tags that may be missing or not detected: 0 or 1
    #[arg(long, default_value_t = 0, value_parser = clap::value_parser!(u8).range(0..=1))]
    survive_lost_tags: u8,
    /// Number of threads [default: one per core]
    #[arg(long)]
    threads: Option<usize>,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

#[derive(clap::Args)]
pub struct Merge {
    /// The folder that the shards were built into
    folder: OutputFolder,
    /// The site file: refuse parts of another site, and leave out stale ones next to those of this site
    #[arg(long)]
    site: Option<Input>,
    /// Prove every table again, against the site file
    #[arg(long, requires = "site")]
    prove: bool,
    /// Draw the hall with walls, tags and docks, the routes of all plans, and the places of the looks (SVG)
    #[arg(long, requires = "site", value_name = "FILE")]
    picture: Option<Output>,
    /// Accept parts of another program, or of another version
    #[arg(long)]
    any_program: bool,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

pub fn run(command: &Command, files: &Files) -> Outcome {
    match command {
        Command::Build(arguments) => build(arguments, files),
        Command::Merge(arguments) => merge(arguments, files),
    }
}

fn failure(error: SiteBuildError) -> Failure {
    if error.is_internal() {
        return Failure::internal(error.to_string());
    }
    let help = error.help();
    Failure::list(&error.to_string(), help)
}

/// Returns the requested shard: by option, by variables, or all of the site.
fn shard(arguments: &Build) -> Result<Shard, Failure> {
    let numbers = match (arguments.shard_index, arguments.shard_count) {
        (Some(index), Some(count)) => Some(Shard::new(index, count).map_err(Failure::input)?),
        _ => None,
    };
    match (arguments.shard, numbers) {
        (Some(one), Some(other)) if one != other => Err(Failure::usage(
            format!("--shard {one}, and {other} by POSEGATE_SHARD_INDEX and POSEGATE_SHARD_COUNT"),
            "leave one of them out, or unset the variables",
        )),
        (one, other) => Ok(one.or(other).unwrap_or(Shard::WHOLE)),
    }
}

/// Returns the digest of this program's file, or of the library that another program has loaded.
fn program() -> Result<String, Failure> {
    if let Some(library) = crate::calls::library() {
        return site_build::program(library).map_err(failure);
    }
    // On Linux: the running file, even if another file has its name now.
    let running = Path::new("/proc/self/exe");
    let path = if running.exists() {
        running.into()
    } else {
        std::env::current_exe().map_err(|error| Failure::internal(error.to_string()))?
    };
    site_build::program(&path).map_err(failure)
}

fn build(arguments: &Build, files: &Files) -> Outcome {
    if !(arguments.most_risk >= 0.0 && arguments.most_risk <= 1.0) {
        return Err(Failure::usage(
            format!("--most-risk {} is not a probability", arguments.most_risk),
            "give a number from 0 to 1, like 0.05",
        ));
    }
    let threads = match arguments.threads.map(NonZeroUsize::new) {
        Some(None) => {
            return Err(Failure::usage(
                "--threads 0 does no work".into(),
                "give 1 or more, or leave it out",
            ));
        }
        Some(threads) => threads,
        None => None,
    };
    let options = BuildOptions {
        shard: shard(arguments)?,
        resume: arguments.resume,
        threads,
    };
    let started = Instant::now();
    let plans = Options {
        most_risk: arguments.most_risk,
        survive_a_lost_tag: arguments.survive_lost_tags > 0,
        ..Options::default()
    };
    let plans = (!arguments.tables_only).then_some(&plans);
    let program = program()?;
    let site = site(files, &arguments.site)?;
    let inventory = Inventory::new(&site, Recipe::new(&site, plans, &program));
    files.reserve(&arguments.output, &site_build::BUILD_WRITES)?;
    let pieces = inventory.share(options.shard).count();
    let bar = progress_with_rate(pieces as u64, "building");
    let built = site_build::build(
        &site,
        &inventory,
        arguments.output.as_path(),
        &options,
        &|| bar.inc(1),
    );
    bar.finish_and_clear();
    let built = built.map_err(failure)?;
    let seconds = started.elapsed().as_secs_f64();
    if arguments.json {
        print_json(&json!({
            "shard": options.shard.index(), "of": options.shard.count(),
            "site_digest": inventory.recipe.site_digest,
            "pieces": built.pieces, "kept": built.kept, "bytes": built.bytes,
            "of_the_site": inventory.pieces().len(), "build_s": seconds,
        }))?;
    } else {
        print(&format_args!(
            "shard {} of {}: {} of {} pieces, {} of them kept, in {seconds:.1} s",
            options.shard,
            arguments.site.display(),
            built.pieces,
            inventory.pieces().len(),
            built.kept,
        ))?;
    }
    Ok(answer(true))
}

fn merge(arguments: &Merge, files: &Files) -> Outcome {
    let site = match &arguments.site {
        Some(input) => Some(site(files, input)?),
        None => None,
    };
    files.reserve(&arguments.folder, &site_build::MERGE_WRITES)?;
    if let Some(picture) = &arguments.picture {
        Files::keep_outside(picture, &arguments.folder, &site_build::MERGE_WRITES)?;
    }
    let checks = match &site {
        None => MergeChecks::Folder,
        Some(site) if arguments.prove => MergeChecks::Proof(site),
        Some(site) => MergeChecks::Site(site),
    };
    let own = match arguments.any_program {
        true => None,
        false => Some(program()?),
    };
    let bar = progress_with_rate(
        site_build::pieces(arguments.folder.as_path(), checks) as u64,
        "merging",
    );
    let merged = site_build::merge(arguments.folder.as_path(), checks, own.as_deref(), &|| {
        bar.inc(1)
    });
    bar.finish_and_clear();
    let merged = match merged {
        Err(SiteBuildError::Unproven(tables)) => return not_proven(arguments, &tables),
        merged => merged.map_err(failure)?,
    };
    if let (Some(path), Some(site)) = (&arguments.picture, &site) {
        let plans = site_build::merged_plans(arguments.folder.as_path(), site).map_err(failure)?;
        files.write(path, site_routes_picture(site, &plans).as_bytes())?;
    }
    if arguments.json {
        print_json(&json!({
            "proven_again": arguments.prove,
            "tables": merged.tables, "plans": merged.plans, "without_plan": merged.without_plan,
            "files": merged.files, "bytes": merged.bytes,
            "manifest": arguments.folder.as_path().join("manifest.json").display().to_string(),
            "manifest_sha256": merged.manifest_sha256,
        }))?;
    } else {
        print(&format_args!(
            "{}: {} proven tables{}, {} plans, manifest {}",
            arguments.folder.display(),
            merged.tables,
            if arguments.prove {
                " (each proven again)"
            } else {
                ""
            },
            merged.plans - merged.without_plan.len(),
            merged.manifest_sha256,
        ))?;
        for name in &merged.without_plan {
            print(&format_args!("no plan: {name}"))?;
        }
    }
    Ok(answer(merged.without_plan.is_empty()))
}

/// Prints the tables that are not proven, and returns exit code 1. Nothing is merged.
fn not_proven(arguments: &Merge, tables: &[String]) -> Outcome {
    if arguments.json {
        print_json(&json!({"proven_again": false, "unproven": tables}))?;
    } else {
        for why in tables {
            print(&format_args!("NOT proven: {why}"))?;
        }
        print(&format_args!(
            "{}: nothing is merged",
            arguments.folder.display()
        ))?;
    }
    Ok(answer(false))
}
