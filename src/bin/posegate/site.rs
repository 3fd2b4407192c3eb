//! `posegate site`: all tables, proofs and plans of a site, in shards.

use crate::door::{Failure, Outcome, answer, print, progress_with_rate, site};
use posegate::fleet::{self, FleetError, Inventory, Order, Recipe, Shard};
use posegate::plan::Options;
use serde_json::json;
use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::time::Instant;

/// Builds all of a site, on one machine or many
#[derive(clap::Subcommand)]
pub enum Command {
    /// Makes the tables, proofs and plans of a site, or of a shard of it
    #[command(
        after_help = "Examples:\n  posegate site build site.toml -o built\n  posegate site build site.toml --shard 2/8 --resume -o built\n\nA shard is a function of the site, its index and the count. Instead of --shard there may be POSEGATE_SHARD_INDEX (from 0) and POSEGATE_SHARD_COUNT: what array jobs set. When all have ended: posegate site merge built"
    )]
    Build(Build),
    /// Puts the pieces of all shards together, with a manifest, or says what is missing
    #[command(
        after_help = "Example:\n  posegate site merge built\n\nExit code 1 where a work task has no plan: its file says why."
    )]
    Merge(Merge),
}

#[derive(clap::Args)]
pub struct Build {
    /// The site file; `-` for standard input
    site: PathBuf,
    /// Which part, from 0, of how many: I/N [default: all]
    #[arg(long)]
    shard: Option<Shard>,
    /// Which part, from 0
    #[arg(
        long,
        env = "POSEGATE_SHARD_INDEX",
        value_name = "I",
        requires = "shard_count"
    )]
    shard_index: Option<u32>,
    /// Of how many parts
    #[arg(
        long,
        env = "POSEGATE_SHARD_COUNT",
        value_name = "N",
        requires = "shard_index"
    )]
    shard_count: Option<u32>,
    /// Keep pieces that are there, whole
    #[arg(long)]
    resume: bool,
    /// The folder to write into; shards may share it
    #[arg(short, long)]
    output: PathBuf,
    /// Tables and proofs, no plans
    #[arg(long)]
    tables_only: bool,
    /// The largest chance that a plan fails although no step does
    #[arg(long, default_value_t = 0.05)]
    most_risk: f64,
    /// How many tags may be missing, or not be detected, in plans: 0 or 1
    #[arg(long, default_value_t = 0, value_parser = clap::value_parser!(u8).range(0..=1))]
    survive_lost_tags: u8,
    /// Threads [default: one a core]
    #[arg(long)]
    threads: Option<usize>,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

#[derive(clap::Args)]
pub struct Merge {
    /// The folder that the shards were built into
    folder: PathBuf,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

pub fn run(command: &Command) -> Outcome {
    match command {
        Command::Build(arguments) => build(arguments),
        Command::Merge(arguments) => merge(arguments),
    }
}

fn failure(error: FleetError) -> Failure {
    if error.is_internal() {
        return Failure::internal(error.to_string());
    }
    let help = error.help();
    Failure::usage(error.to_string(), help)
}

/// The shard that is asked for: by option, by variables, or all of the site.
fn shard(arguments: &Build) -> Result<Shard, Failure> {
    let numbers = (arguments.shard_index, arguments.shard_count);
    match (arguments.shard, numbers) {
        (Some(shard), _) => Ok(shard),
        (None, (Some(index), Some(count))) => Shard::new(index, count).map_err(Failure::input),
        (None, _) => Ok(Shard::WHOLE),
    }
}

fn build(arguments: &Build) -> Outcome {
    if !(arguments.most_risk >= 0.0 && arguments.most_risk <= 1.0) {
        return Err(Failure::usage(
            format!("--most-risk {} is no probability", arguments.most_risk),
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
    let order = Order {
        shard: shard(arguments)?,
        resume: arguments.resume,
        threads,
    };
    let started = Instant::now();
    let site = site(&arguments.site)?;
    let options = Options {
        most_risk: arguments.most_risk,
        survive_a_lost_tag: arguments.survive_lost_tags > 0,
        ..Options::default()
    };
    let asked = (!arguments.tables_only).then_some(&options);
    let inventory = Inventory::of(&site, Recipe::of(&site, asked));
    let pieces = inventory.share(order.shard).count();
    let bar = progress_with_rate(pieces as u64, "building");
    let built = fleet::build(&site, &inventory, &arguments.output, &order, &|| bar.inc(1));
    bar.finish_and_clear();
    let built = built.map_err(failure)?;
    let seconds = started.elapsed().as_secs_f64();
    if arguments.json {
        print(&json!({
            "shard": order.shard.index(), "of": order.shard.count(),
            "site_digest": inventory.recipe.site_digest,
            "pieces": built.pieces, "kept": built.kept, "bytes": built.bytes,
            "of_the_site": inventory.pieces().len(), "build_s": seconds,
        }))?;
    } else {
        print(&format_args!(
            "shard {} of {}: {} of {} pieces, {} of them kept, in {seconds:.1} s",
            order.shard,
            arguments.site.display(),
            built.pieces,
            inventory.pieces().len(),
            built.kept,
        ))?;
    }
    Ok(answer(true))
}

fn merge(arguments: &Merge) -> Outcome {
    let bar = progress_with_rate(fleet::pieces(&arguments.folder) as u64, "merging");
    let merged = fleet::merge(&arguments.folder, &|| bar.inc(1));
    bar.finish_and_clear();
    let merged = merged.map_err(failure)?;
    if arguments.json {
        print(&json!({
            "tables": merged.tables, "plans": merged.plans, "without_plan": merged.without_plan,
            "files": merged.files, "bytes": merged.bytes,
            "manifest": arguments.folder.join("manifest.json").display().to_string(),
            "manifest_sha256": merged.manifest_sha256,
        }))?;
    } else {
        print(&format_args!(
            "{}: {} proven tables, {} plans, manifest {}",
            arguments.folder.display(),
            merged.tables,
            merged.plans - merged.without_plan.len(),
            merged.manifest_sha256,
        ))?;
        for name in &merged.without_plan {
            print(&format_args!("no plan: {name}"))?;
        }
    }
    Ok(answer(merged.without_plan.is_empty()))
}
