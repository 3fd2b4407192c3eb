//! `slurm`: builds a site as an array of four shards on a Slurm of four nodes of this machine.

use crate::arguments::Arguments;
use crate::files::{self, Scratch, name, release};
use crate::need;
use crate::report::Report;
use crate::shell::{Cmd, Result, Running, cmd, program_at, say};
use serde_json::Value;
use std::collections::BTreeMap;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime};

/// Longest wait for anything.
const PATIENCE: Duration = Duration::from_secs(300);

/// Checks for the same bytes as from one process. Repeats it with one node killed in the middle, its task queued again, and a merge that
/// waits for all tasks. The bytes must be the same, and no finished piece is made twice. The argument is the number of endpoints of the
/// synthetic plant (120); with few of them most of the time is spent on starting processes.
pub fn slurm(given: &Arguments) -> Result {
    let endpoints = given.number(0, 120)?;
    let missing: Vec<&str> = ["slurmctld", "slurmd", "sbatch", "munged"]
        .into_iter()
        .filter(|name| !need::exists(name))
        .collect();
    if !missing.is_empty() {
        return Err(format!(
            "missing: {}: apt-get install -y slurm-wlm munge",
            missing.join(" ")
        )
        .into());
    }
    cmd("cargo build --release -p posegate-cli -p posegate-site --bin posegate --example plant")
        .run()?;
    let folder = Scratch::new()?;
    let plant = program_at(&release("examples/plant"))
        .arg(endpoints.to_string())
        .read()?;
    files::write(folder.join("site.toml"), plant)?;
    write_wrapper(&folder.join("posegate"))?;
    say("slurm: four nodes");
    let run = Run {
        _nodes: Nodes::start(folder.path())?,
        folder,
    };
    let mut report = Report::default();
    run.four_nodes(&mut report)?;
    run.killed_node(endpoints, &mut report)?;
    report.finish()
}

/// Writes a wrapper that runs as the program: it records when and on which node it runs, and the numbers of its processes.
fn write_wrapper(path: &Path) -> Result {
    use std::os::unix::fs::PermissionsExt;
    let program = release("posegate");
    let text = format!(
        r#"#!/bin/sh
echo "${{SLURMD_NODENAME:-none}} ${{POSEGATE_SHARD_INDEX:-0}} $$ $PPID $(date +%s.%N)" >>"$STARTED"
"{}" "$@" --json &
echo "${{SLURMD_NODENAME:-none}} $!" >>"$STARTED.ids"
wait $! || exit $?
date +%s.%N >>"$STARTED.ends"
times >>"$STARTED.times"
"#,
        program.display()
    );
    files::write(path, text)?;
    std::fs::set_permissions(path, std::fs::Permissions::from_mode(0o755))?;
    Ok(())
}

/// Four running nodes and the folder of their files. Nodes end before the folder is removed.
struct Run {
    _nodes: Nodes,
    folder: Scratch,
}

impl Run {
    fn path(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }

    /// Adds what Slurm's commands and the wrapper need; `started` is where the wrapper records.
    fn with_slurm(&self, command: Cmd, started: &str) -> Cmd {
        command
            .env("SLURM_CONF", self.path("slurm.conf"))
            .env("POSEGATE", self.path("posegate"))
            .env("POSEGATE_OPTIONS", "")
            .env("STARTED", self.path(started))
    }

    fn slurm(&self, words: &str) -> Cmd {
        cmd(words).env("SLURM_CONF", self.path("slurm.conf"))
    }

    fn wait(&self, what: &str, mut is_done: impl FnMut() -> Result<bool>) -> Result {
        let start = Instant::now();
        while !is_done()? {
            if start.elapsed() > PATIENCE {
                // Only for the log, because the wait has failed already.
                let _ = self.slurm("squeue").code();
                let _ = self.slurm("sinfo -N -l").code();
                return Err(format!("slurm: timeout while waiting for {what}").into());
            }
            std::thread::sleep(Duration::from_millis(500));
        }
        Ok(())
    }

    /// Waits until a job, or an array of them, is no longer queued or running.
    fn wait_for_end(&self, what: &str, job: &str) -> Result {
        self.wait(what, || {
            let queue = self
                .slurm(&format!("squeue -h -o %T -j {job}"))
                .unlogged()
                .outcome()?;
            Ok(queue.text.trim().is_empty())
        })
    }

    fn merge(&self, built: &str) -> Result {
        program_at(&release("posegate"))
            .words("site merge")
            .arg(self.path(built))
            .run()
    }

    /// Compares a merged folder with the one of a single machine.
    fn compare(&self, built: &str, name: &str, report: &mut Report) -> Result {
        cmd("diff -r --exclude=parts")
            .arg(self.path("alone"))
            .arg(self.path(built))
            .run()?;
        report.at_most(name, 0, "files", 0);
        Ok(())
    }

    /// Builds the site by one process and by four nodes, and compares bytes and times.
    fn four_nodes(&self, report: &mut Report) -> Result {
        // By the wrapper, so that the times are comparable.
        let alone = program_at(&self.path("posegate"))
            .words("site build")
            .arg(self.path("site.toml"))
            .words("--threads 2 -o")
            .arg(self.path("alone"));
        self.with_slurm(alone, "started-alone").run()?;
        self.merge("alone")?;
        let array = cmd("sbatch --parsable --array=0-3 -o")
            .arg(self.path("array-%a.log"))
            .arg("examples/slurm/build.sbatch")
            .arg(self.path("site.toml"))
            .arg(self.path("array"));
        let array = self.with_slurm(array, "started-array").read()?;
        self.wait_for_end("the array", array.trim())?;
        self.merge("array")?;
        self.compare(
            "array",
            "slurm: files that differ from a build on one machine",
            report,
        )?;
        let times = |started: &str| -> Result<[f64; 2]> {
            let read = |end: &str| files::read(self.path(&format!("{started}{end}")));
            Ok([
                clock(&read("")?, &read(".ends")?)?,
                processor(&read(".times")?)?,
            ])
        };
        let (alone, four) = (times("started-alone")?, times("started-array")?);
        for (index, name) in ["clock", "processor"].into_iter().enumerate() {
            let (alone, four) = (alone[index], four[index]);
            report.note(
                &format!("slurm: one process with two threads, {name}"),
                format_args!("{alone:.2}"),
                "s",
            );
            report.note(
                &format!("slurm: four nodes, {name}"),
                format_args!("{four:.2}"),
                "s",
            );
            let lost = 100.0 * (four / alone - 1.0);
            let shown = (lost * 10.0).round() / 10.0;
            let line = format!("slurm: lost by four nodes, {name}");
            if name == "clock" {
                // If other processes use the machine, the clock is not meaningful: the processor's time decides.
                report.note(&line, format_args!("{shown:.1}"), "%");
            } else {
                report.at_most(&line, shown, "%", 10.0);
                let holds = alone > 0.0 && four > 0.0 && four < 1.1 * alone;
                report.require(
                    holds,
                    format_args!(
                        "slurm: four nodes lose {shown} % of the processor's time: 10 or more"
                    ),
                );
            }
        }
        Ok(())
    }

    /// Builds the site again, and kills a node in the middle.
    fn killed_node(&self, endpoints: u64, report: &mut Report) -> Result {
        say("slurm: a node is killed in the middle");
        let submit = cmd("examples/slurm/submit.sh")
            .arg(self.path("site.toml"))
            .arg(self.path("killed"))
            .arg("4");
        let submit = submit.env("SBATCH_OUTPUT", self.path("killed-%A-%a.log"));
        let numbers = self.with_slurm(submit, "started-killed").read()?;
        let (array, merge) = numbers
            .trim()
            .split_once(' ')
            .ok_or("submit.sh prints two numbers")?;
        let parts = self.path("killed/parts");
        let ids = self.path("started-killed.ids");
        self.wait("some finished pieces", || {
            let has_started = files::read(&ids).unwrap_or_default().lines().count() == 4;
            Ok(has_started && pieces(&parts).len() as u64 >= endpoints / 2)
        })?;
        let started = files::read(self.path("started-killed"))?;
        let first: Vec<&str> = started
            .lines()
            .next()
            .unwrap_or_default()
            .split(' ')
            .collect();
        let [victim, index, script, daemon, ..] = first[..] else {
            return Err("slurm: the wrapper recorded no start".into());
        };
        // Kills the node, the daemon of its task, its script and the program, as a power failure does.
        let node = files::read(self.path(&format!("node-{victim}")))?;
        let programs = files::read(&ids)?;
        let programs = programs
            .lines()
            .filter_map(|line| line.strip_prefix(victim)?.strip_prefix(' '));
        for id in [node.trim(), daemon, script].into_iter().chain(programs) {
            // The process may have ended with the one before.
            cmd("sh -c")
                .arg("kill -9 \"$1\"")
                .arg("sh")
                .arg(id)
                .code()?;
        }
        let before = pieces(&parts);
        let log = self.path(&format!("killed-{array}-{index}.log"));
        if kept(&files::read(&log).unwrap_or_default()).is_some() {
            return Err(
                format!("slurm: shard {index} had ended before its node was killed").into(),
            );
        }
        // A node keeps its name and address. Its state is lost, and it is declared down at once.
        self.slurm(&format!(
            "scontrol update NodeName={victim} State=DOWN Reason=killed"
        ))
        .run()?;
        self.wait("the task to be queued again", || {
            let job = self
                .slurm(&format!("scontrol show job {array}_{index}"))
                .unlogged()
                .outcome()?
                .text;
            Ok(job
                .split("Restarts=")
                .skip(1)
                .any(|rest| rest.starts_with(|c: char| ('1'..='9').contains(&c))))
        })?;
        // Slurm delays requeued tasks for two minutes.
        self.slurm(&format!(
            "scontrol update JobId={array}_{index} StartTime=now"
        ))
        .run()?;
        self.wait_for_end("the array", array)?;
        self.wait_for_end("the merge", merge)?;
        for path in files::files_below(self.folder.path()) {
            if name(&path).starts_with(&format!("killed-{merge}-")) {
                eprint!("{}", files::read(&path)?);
            }
        }
        report.note(
            "slurm: finished pieces when a node was killed",
            before.len(),
            "pieces",
        );
        self.compare(
            "killed",
            "slurm: files that differ after a node was killed",
            report,
        )?;
        // No finished piece was written again.
        let after = pieces(&parts);
        let lost = before
            .iter()
            .filter(|(name, at)| after.get(*name) != Some(*at));
        report.at_most("slurm: finished pieces lost", lost.count(), "pieces", 0);
        let kept = kept(&files::read(&log)?)
            .ok_or("slurm: the log of the killed shard has no \"kept\"")?;
        report.note("slurm: of them of the killed shard", kept, "pieces");
        report.require(
            kept > 0,
            "slurm: the killed shard had finished no piece: give more endpoints",
        );
        Ok(())
    }
}

/// Slurm's daemons, which end when this is dropped.
struct Nodes(Running);

impl Nodes {
    /// Starts the daemons with their files in a folder, and waits until all nodes are idle.
    fn start(folder: &Path) -> Result<Self> {
        let running = cmd("bash tests/support/slurm.sh")
            .arg(folder)
            .with_stdin()
            .with_stdout()
            .start()?;
        let mut nodes = Self(running);
        let stdout = nodes.0.child.stdout.take().ok_or("stdout is piped")?;
        let mut line = String::new();
        BufReader::new(stdout).read_line(&mut line)?;
        match line.trim() {
            "ready" => Ok(nodes),
            _ => Err("slurm: the nodes do not start: see above".into()),
        }
    }
}

impl Drop for Nodes {
    fn drop(&mut self) {
        // The script ends the daemons when its stdin closes.
        drop(self.0.child.stdin.take());
        let start = Instant::now();
        while matches!(self.0.child.try_wait(), Ok(None))
            && start.elapsed() < Duration::from_secs(60)
        {
            std::thread::sleep(Duration::from_millis(50));
        }
    }
}

/// Returns the names of the finished pieces, which are digests, and when each was written.
fn pieces(parts: &Path) -> BTreeMap<String, Option<SystemTime>> {
    let named = files::files_below(parts)
        .into_iter()
        .map(|path| (name(&path), path));
    let pieces = named.filter(|(name, _)| is_digest(name));
    let written = |path: &Path| path.metadata().and_then(|data| data.modified()).ok();
    pieces.map(|(name, path)| (name, written(&path))).collect()
}

fn is_digest(name: &str) -> bool {
    name.len() == 64
        && name
            .chars()
            .all(|c| c.is_ascii_digit() || ('a'..='f').contains(&c))
}

/// Returns how many pieces the last run kept, by the JSON lines of a log.
fn kept(log: &str) -> Option<i64> {
    let lines = log
        .lines()
        .filter_map(|line| serde_json::from_str::<Value>(line).ok());
    lines.filter_map(|line| line["kept"].as_i64()).next_back()
}

/// Returns the seconds from the first start to the last end.
fn clock(starts: &str, ends: &str) -> Result<f64> {
    let starts = starts
        .lines()
        .filter_map(|line| line.split(' ').nth(4)?.parse::<f64>().ok());
    let ends = ends.lines().filter_map(|line| line.parse::<f64>().ok());
    let (first, last) = (starts.reduce(f64::min), ends.reduce(f64::max));
    first
        .zip(last)
        .map(|(first, last)| last - first)
        .ok_or_else(|| "slurm: the wrapper recorded no times".into())
}

/// Returns the processor's seconds: every second line that `times` prints is of the program, as `0m1.5s 0m0.2s`.
fn processor(times: &str) -> Result<f64> {
    let mut sum = 0.0;
    for line in times.lines().skip(1).step_by(2) {
        for time in line.split_whitespace().take(2) {
            let (minutes, seconds) = time
                .trim_end_matches('s')
                .split_once('m')
                .ok_or("slurm: no time")?;
            sum += 60.0 * minutes.parse::<f64>()? + seconds.parse::<f64>()?;
        }
    }
    Ok(sum)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_summed_over_processes() {
        let starts = "n0 0 1 2 100.5\nn1 1 3 4 99.5\n";
        assert_eq!(clock(starts, "101\n103.5\n").unwrap(), 4.0);
        assert!(clock("", "1\n").is_err());
        assert_eq!(
            processor("0m0s 0m0s\n1m1.5s 0m0.5s\n0m0s 0m0s\n0m2s 0m0s\n").unwrap(),
            64.0
        );
    }

    #[test]
    fn counts_are_read_from_a_shards_log() {
        assert_eq!(
            kept("starts\n{\"kept\":3,\"made\":1}\n{\"kept\":7,\"made\":0}\n"),
            Some(7)
        );
        assert_eq!(kept("none"), None);
    }
}
