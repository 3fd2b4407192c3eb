//! No false permit: random and searched pose-sets on random sets and tables, against an exact
//! double-precision oracle that shares no code with the crate.
//!
//! `cargo test -p posegate --features std --test adversarial` runs a short campaign; `ci.sh adversarial N SEED
//! [LAYOUT]` a long one. Prints one JSON line, and fails at the first kind of failure.
//!
//! Pose-sets across narrow gaps and notches are tried apart ([`unions`]).
//!
//! Each world is a random success set with a random goal, baked to a table that is proven. Half
//! of its pose-sets come in bursts ([`burst`]), the others singly ([`singles`]); some are carried by a tracker ([`carried`]). The oracle checks every
//! permit, by the least slack over the pose-set or a border that it found before. Permits of a grid are also checked
//! at the poses of the set that would leave the covered cells first. The test decodes these cells from the bytes.
//!
//! The line is the same for the same N and SEED at any number of threads: a world's random numbers depend on its
//! number, and worlds are added up in order.

#[path = "../../crates/posegate-testkit/src/oracle/mod.rs"]
mod oracle;

mod burst;
mod carried;
mod sets;
mod singles;
mod stage;
mod tally;
mod trial;
mod unions;
mod voxels;

use oracle::Rng;
use posegate::bake::Layout;
use posegate::table::Table;
use std::process::ExitCode;
use std::sync::atomic::{AtomicUsize, Ordering};
use tally::Tally;
use trial::Trial;
use voxels::Voxels;

/// Returns the number of pose-sets for one world: more in a long campaign, which bakes enough worlds.
fn per_world(cases: usize) -> usize {
    (cases / 250).clamp(2000, 10_000)
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args()
        .skip(1)
        .filter(|a| !a.starts_with("--"))
        .collect();
    let number = |at: usize, default: u64| -> u64 {
        arguments.get(at).map_or(default, |text| {
            text.parse()
                .unwrap_or_else(|_| panic!("`{text}` is no number: adversarial N SEED [LAYOUT]"))
        })
    };
    let (cases, seed) = (number(0, 20_000) as usize, number(1, 1));
    let layout = arguments.get(2).map_or("grid", String::as_str);
    let layout_of = match layout {
        "grid" => Layout::Grid,
        "facets" => Layout::Facets,
        _ => panic!("no layout `{layout}`: grid or facets"),
    };
    let per_world = per_world(cases);
    let worlds = cases.div_ceil(per_world);
    let next = AtomicUsize::new(0);
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let mut tallies: Vec<(usize, Tally)> = std::thread::scope(|scope| {
        let work = || {
            let mut tallies = Vec::new();
            loop {
                let world = next.fetch_add(1, Ordering::Relaxed);
                if world >= worlds {
                    return tallies;
                }
                let mut rng = Rng::new(seed.wrapping_mul(1_000_003).wrapping_add(world as u64));
                let left = (cases - world * per_world).min(per_world);
                tallies.push((world, try_world(&mut rng, left, layout_of)));
            }
        };
        let workers: Vec<_> = (0..threads).map(|_| scope.spawn(work)).collect();
        workers
            .into_iter()
            .flat_map(|worker| worker.join().unwrap())
            .collect()
    });
    tallies.sort_by_key(|(world, _)| *world);
    let mut all = Tally::default();
    for (_, tally) in tallies {
        all.add(tally);
    }
    // Of facets: cells would be as coarse as the gaps are narrow.
    let gaps = unions::gaps_and_notches(&mut Rng::new(seed), (cases / 20).max(1_000));
    all.false_permits += gaps.false_permits;
    all.gaps = (gaps.cases, gaps.permits);
    println!("{}", all.line(seed, layout));
    ExitCode::from(u8::from(!(all.is_sound() & all.is_meaningful())))
}

fn try_world(rng: &mut Rng, cases: usize, layout: Layout) -> Tally {
    let stage = stage::stage(rng, layout);
    let mut trial = Trial {
        table: Table::parse(&stage.bytes).unwrap(),
        voxels: (layout == Layout::Grid).then(|| Voxels::read(&stage.bytes)),
        tally: Tally {
            unproven: usize::from(rng.below(16) == 0 && !stage.is_proven()),
            withheld: stage.withheld,
            ..Tally::default()
        },
        stage: &stage,
    };
    carried::robots(rng, &mut trial, cases / 50);
    while trial.tally.cases < cases {
        let before = trial.tally.cases;
        burst::bursts(rng, &mut trial, cases - before);
        // As many cases again, singly; some if a world is so small that no base was found.
        let made = trial.tally.cases - before;
        let end = (trial.tally.cases + made.max(30)).min(cases);
        while trial.tally.cases < end {
            let most = end - trial.tally.cases;
            singles::three(rng, &mut trial, most);
        }
    }
    trial.tally
}
