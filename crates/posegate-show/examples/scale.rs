//! Measures the time and memory of a site's tables and proofs by the size of the site and the number of nodes. Prints
//! one JSON line each. Run by `ci.sh scale`, with the program, and optionally files for the two plots. It fails if
//! 1,000 endpoints take a minute or more.
//!
//! Up to 1,000 endpoints (or the number in `POSEGATE_WHOLE`) the complete site is built, by two threads. Beyond that,
//! one shard of about 200 pieces is built and the time is extrapolated, as for more than four nodes. In the model,
//! every node reads the site (`R` seconds). It then makes its share of the pieces in sequence on each of
//! its `C` cores (`p` seconds per piece). The merge comes last (`m` seconds per piece): `T(N) = R + ceil(pieces / (N
//! C)) p + m pieces`. Nodes share only the folder, whose speed is not in the model.

#[path = "support/curves.rs"]
mod curves;

use curves::logarithmic;
use posegate_site::Site;
use std::path::Path;
use std::process::{Child, Command, ExitCode, Stdio};
use std::time::Instant;

use posegate_testkit::plant;

/// Number of pieces of the shard that is built if a site is too large to be built completely.
const SAMPLE: usize = 200;
/// Largest time for 1,000 endpoints, seconds.
const MOST: f64 = 60.0;
/// Number of endpoints of the site that is built on several nodes.
const NODES_ENDPOINTS: usize = 100;

fn line(name: &str, value: f64, unit: &str, goal: Option<f64>) {
    let goal = goal.map_or("null".to_owned(), |goal| goal.to_string());
    println!(
        "{{\"name\": \"scale: {name}\", \"value\": {value:.3}, \"unit\": \"{unit}\", \"goal\": {goal}}}"
    );
}

/// Starts building a shard of a site.
fn shard(program: &str, folder: &Path, name: &str, part: [usize; 2], threads: usize) -> Child {
    let [index, count] = part;
    Command::new(program)
        .args(["site", "build", "site.toml", "--tables-only", "-o", name])
        .args(["--shard", &format!("{index}/{count}")])
        .args(["--threads", &format!("{threads}")])
        .current_dir(folder)
        .stdout(Stdio::null())
        .spawn()
        .expect("the program runs")
}

/// Waits for a process. Returns its largest observed memory, MiB.
fn peak(child: &mut Child) -> f64 {
    let mut most = 0.0_f64;
    let path = format!("/proc/{}/status", child.id());
    loop {
        let status = std::fs::read_to_string(&path).unwrap_or_default();
        let line = status.lines().find(|line| line.starts_with("VmHWM"));
        let kib = line.and_then(|line| line.split_whitespace().nth(1)?.parse::<f64>().ok());
        most = most.max(kib.unwrap_or(0.0) / 1024.0);
        if let Some(ended) = child.try_wait().expect("a process of this one") {
            assert!(ended.success(), "a shard failed");
            return most;
        }
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
}

fn main() -> ExitCode {
    let mut given = std::env::args().skip(1);
    let Some(program) = given.next() else {
        eprintln!("usage: scale PROGRAM [ENDPOINTS.svg NODES.svg]");
        return ExitCode::from(2);
    };
    let plots = [given.next(), given.next()];
    let whole = std::env::var("POSEGATE_WHOLE").ok();
    let whole = whole.map_or(1_000, |text| text.parse().expect("a number of endpoints"));
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (mut times, mut memory, mut reads) = (vec![], vec![], vec![]);
    let mut short = false;
    for endpoints in [10, 100, 1_000, 10_000, 100_000] {
        let path = folder.path().join("site.toml");
        std::fs::write(&path, plant::plant(1, endpoints)).expect("a file");
        let pieces = 2 * endpoints;
        let parts = pieces.div_ceil(SAMPLE);
        let count = if endpoints <= whole { 1 } else { parts };
        let begin = Instant::now();
        Site::read(&path).expect("a valid site");
        let read = begin.elapsed().as_secs_f64();
        let build = |name: &str, count: usize| {
            let name = format!("{name}-of-{endpoints}");
            let begin = Instant::now();
            let most = peak(&mut shard(&program, folder.path(), &name, [0, count], 2));
            (begin.elapsed().as_secs_f64(), most)
        };
        let (seconds, most) = build("shard", count);
        let all = read + (seconds - read).max(0.0) * count as f64;
        let (kind, what) = if count == 1 {
            ("measured", "peak memory of the whole build")
        } else {
            ("extrapolated", "peak memory of a shard")
        };
        let name = |what: &str| format!("{endpoints} endpoints, {what}");
        line(&name("read"), read, "s", None);
        line(
            &name(&format!("two threads, {kind}")),
            all,
            "s",
            (endpoints == 1_000).then_some(MOST),
        );
        if endpoints == 1_000 && !(all < MOST) {
            eprintln!("scale: 1,000 endpoints take {all:.1} s: {MOST} or more");
            short = true;
        }
        line(&name(what), most, "MiB", None);
        let most = if count == parts {
            most
        } else {
            let (_, most) = build("small", parts);
            line(&name("peak memory of a shard"), most, "MiB", None);
            most
        };
        let x = endpoints as f64;
        reads.push([x, read]);
        times.push([x, all]);
        memory.push([x, most]);
    }
    if let [.., [few, less], [many, more]] = memory[..] {
        let grows = 1024.0 * (more - less) / (many - few);
        line(
            "memory of a shard for each endpoint of the site",
            grows,
            "KiB",
            None,
        );
    }
    std::fs::write(
        folder.path().join("site.toml"),
        plant::plant(1, NODES_ENDPOINTS),
    )
    .expect("a file");
    let (mut measured, mut model) = (vec![], vec![]);
    let [mut one, mut merged] = [0.0; 2];
    for nodes in [1, 2, 4] {
        let name = format!("nodes-{nodes}");
        let begin = Instant::now();
        let shards: Vec<Child> = (0..nodes)
            .map(|index| shard(&program, folder.path(), &name, [index, nodes], 1))
            .collect();
        for mut child in shards {
            peak(&mut child);
        }
        let seconds = begin.elapsed().as_secs_f64();
        if nodes == 1 {
            one = seconds;
            let begin = Instant::now();
            let merge = Command::new(&program)
                .args(["site", "merge", &name])
                .current_dir(folder.path())
                .stdout(Stdio::null())
                .status();
            assert!(merge.expect("the program runs").success());
            merged = begin.elapsed().as_secs_f64();
        }
        line(
            &format!("{NODES_ENDPOINTS} endpoints on {nodes} nodes of one thread on this machine"),
            seconds,
            "s",
            None,
        );
        measured.push([nodes as f64, seconds]);
    }
    let read = reads[1][1];
    let pieces = 2 * NODES_ENDPOINTS;
    let piece = (one - read) / pieces as f64;
    for nodes in [1, 2, 4, 8, 16, 32, 64] {
        let seconds = read + pieces.div_ceil(nodes) as f64 * piece + merged;
        line(
            &format!("{NODES_ENDPOINTS} endpoints on {nodes} nodes of one core, by the model"),
            seconds,
            "s",
            None,
        );
        model.push([nodes as f64, seconds]);
    }
    let drawn = [
        logarithmic(
            "Tables and proofs of a plant, two threads",
            ["endpoints", "seconds, MiB"],
            &[
                ("time (extrapolated where it is not built whole), s", &times),
                ("reading the site, s", &reads),
                ("peak memory of a shard of at most 200 pieces, MiB", &memory),
            ],
        ),
        logarithmic(
            "Tables and proofs of 100 endpoints on several nodes",
            ["nodes of one core", "seconds"],
            &[
                ("measured on this machine", &measured),
                ("by the model", &model),
            ],
        ),
    ];
    for (path, drawn) in plots.iter().zip(drawn) {
        if let Some(path) = path {
            std::fs::write(path, drawn).expect("a plot that can be written");
        }
    }
    if short {
        ExitCode::FAILURE
    } else {
        ExitCode::SUCCESS
    }
}
