//! The second evaluation confirms every permit of the first, and few other sets.
//!
//! Both matter: a permit that is not confirmed latches a fault, and a denial that a bit flip turned into a permit
//! must not be confirmed. Worlds and sets are those of `tests/adversarial`. Wrong confirmations
//! are printed as JSON lines.

#[path = "second_opinion/beliefs.rs"]
mod beliefs;
#[path = "../crates/posegate-testkit/src/counts.rs"]
mod counts;
#[path = "../crates/posegate-testkit/src/oracle/mod.rs"]
mod oracle;
#[allow(dead_code)]
#[path = "adversarial/sets.rs"]
mod sets;
#[allow(dead_code)]
#[path = "adversarial/stage.rs"]
mod stage;
#[allow(dead_code)]
#[path = "adversarial/tally.rs"]
mod tally;
#[allow(dead_code)]
#[path = "adversarial/trial.rs"]
mod trial;
#[allow(dead_code)]
#[path = "adversarial/voxels.rs"]
mod voxels;

use beliefs::{Case, extreme, plain};
use oracle::{Pose, PoseSet, Rng, scale};
use posegate::bake::Layout;
use posegate::contain::second::{INSIDE, opinion, opinion_after};
use posegate::contain::{Decision, decide};
use posegate::set::Trust;
use posegate::table::Table;
use rayon::prelude::*;
use sets::hard_case;
use stage::{Stage, stage};

/// Number of worlds in the deep job, a tenth of them in the fast suite, and of sets that are tried on each, for confirmations.
const WORLDS: u64 = 60;
const SETS: usize = 260;

/// Counts of a campaign.
#[derive(Clone, Copy, Default, Debug)]
struct Count {
    tried: usize,
    permits: usize,
    unconfirmed: usize,
    reported: usize,
}

impl Count {
    fn add(self, other: Self) -> Self {
        Self {
            tried: self.tried + other.tried,
            permits: self.permits + other.permits,
            unconfirmed: self.unconfirmed + other.unconfirmed,
            reported: self.reported,
        }
    }

    /// Returns `true` if the first evaluation permits. Then the second must confirm it.
    fn permits(&mut self, table: &Table<'_>, case: &Case) -> bool {
        self.tried += 1;
        let set = case.belief.pose_set(table.radius_squared(), case.trust);
        let set = set.map(|set| set.grown(case.movement));
        if !set.is_ok_and(|set| decide(table, &set) == Decision::Inside) {
            return false;
        }
        self.permits += 1;
        let second = opinion_after(table.bytes(), &case.belief, case.trust, &case.movement);
        if second != INSIDE {
            self.unconfirmed += 1;
            if self.reported < 2 {
                self.reported += 1;
                eprintln!("UNCONFIRMED on {}: {case:?}", table.task());
            }
        }
        true
    }

    /// Searches for the border of the first evaluation's permits, and checks every set of the search.
    fn search(&mut self, rng: &mut Rng, table: &Table<'_>, estimate: Pose, set: &PoseSet) {
        let drawn = beliefs::drawn(rng);
        let case = |by: f64| drawn.case(table, estimate, &trial::scaled(set, by));
        let (mut low, mut high) = (0.0, 1.0);
        while high < 1e6 && self.permits(table, &case(high)) {
            (low, high) = (high, 2.0 * high);
        }
        while low == 0.0 && high > 1e-7 {
            high *= 0.25;
            if self.permits(table, &case(high)) {
                (low, high) = (high, 4.0 * high);
            }
        }
        while high - low > 1e-9 * high {
            let middle = 0.5 * (low + high);
            if self.permits(table, &case(middle)) {
                low = middle;
            } else {
                high = middle;
            }
        }
        for _ in 0..4 {
            let by = low * (1.0 - rng.log_within(1e-8, 0.1));
            self.permits(
                table,
                &drawn.case(
                    table,
                    beliefs::shaken(rng, estimate),
                    &trial::scaled(set, by),
                ),
            );
        }
    }
}

fn layout(number: u64) -> Layout {
    if number % 4 == 2 {
        Layout::Grid
    } else {
        Layout::Facets
    }
}

/// Prints a figure with its goal, a lower or an upper limit.
fn print(name: &str, value: impl std::fmt::Display, unit: &str, goal: impl std::fmt::Display) {
    println!(r#"{{"name": "{name}", "value": {value}, "unit": "{unit}", "goal": {goal}}}"#);
}

#[test]
fn every_permit_of_random_worlds_is_confirmed() {
    let (worlds, first) = (
        if counts::is_deep() {
            WORLDS
        } else {
            WORLDS / 10
        },
        counts::first_seed(),
    );
    let all = (0..worlds)
        .into_par_iter()
        .map(|number| {
            let mut rng = Rng::new(7_000_003 + first + number);
            let stage = stage(&mut rng, layout(number));
            let table = Table::parse(&stage.bytes).unwrap();
            let mut count = Count::default();
            for _ in 0..SETS {
                let (estimate, mut set) = hard_case(&mut rng, &stage.world);
                if rng.chance(0.3) {
                    set = extreme(&mut rng);
                }
                count.search(&mut rng, &table, estimate, &set);
            }
            count
        })
        .reduce(Count::default, Count::add);
    let least = (200_000 * worlds / WORLDS) as usize;
    print("permits of random worlds", all.permits, "permits", least);
    print("of them not confirmed", all.unconfirmed, "permits", 0);
    assert!(all.permits >= least && all.unconfirmed == 0, "{all:?}");
}

#[test]
fn every_permit_of_the_example_tables_is_confirmed() {
    let tables: [&[u8]; 3] = [
        include_bytes!("../examples/tables/dock.posegate"),
        include_bytes!("../examples/tables/see-t7.posegate"),
        include_bytes!("../examples/tables/see-t7-grid.posegate"),
    ];
    let rounds = if counts::is_deep() { 60_u64 } else { 15 };
    let all = (0..rounds)
        .into_par_iter()
        .map(|number| {
            let mut rng = Rng::new(9_000_011 + number);
            let table = Table::parse(tables[(number % 3) as usize]).unwrap();
            let cells = table.cells();
            let mut count = Count::default();
            for _ in 0..200 {
                let within = |rng: &mut Rng, lo: i32, hi: i32| {
                    rng.within(f64::from(lo) * 1e-6, f64::from(hi) * 1e-6)
                };
                let estimate = [
                    within(&mut rng, cells.x_lo_um, cells.x_hi_um()),
                    within(&mut rng, cells.y_lo_um, cells.y_hi_um()),
                    rng.within(-0.3, 0.3),
                ];
                let set = plain(&mut rng);
                count.search(&mut rng, &table, estimate, &set);
            }
            count
        })
        .reduce(Count::default, Count::add);
    let least = (100_000 * rounds / 60) as usize;
    print(
        "permits of the example tables",
        all.permits,
        "permits",
        least,
    );
    print("of them not confirmed", all.unconfirmed, "permits", 0);
    assert!(all.permits >= least && all.unconfirmed == 0, "{all:?}");
}

/// Ranges `[from, to)` of the true scale of a set that is too large.
const BINS: [[f64; 2]; 3] = [[0.5, 0.8], [0.8, 0.95], [0.95, 1.0]];

/// For sets that are outside, by bin: their number, and the number of wrong confirmations.
type LeakCounts = [[usize; 2]; 3];

fn leak(numbers: std::ops::Range<u64>, layout: Layout, most_turn: f64) -> LeakCounts {
    numbers
        .into_par_iter()
        .map(|number| {
            let mut rng = Rng::new(11_000_017 + number);
            let stage = stage(&mut rng, layout);
            let mut found = LeakCounts::default();
            for _ in 0..60 {
                leak_of(&mut rng, &stage, most_turn, &mut found);
            }
            found
        })
        .reduce(LeakCounts::default, |mut a, b| {
            for (a, b) in a.iter_mut().flatten().zip(b.into_iter().flatten()) {
                *a += b;
            }
            a
        })
}

fn leak_of(rng: &mut Rng, stage: &Stage, most_turn: f64, found: &mut LeakCounts) {
    let table = Table::parse(&stage.bytes).unwrap();
    let (estimate, set) = hard_case(rng, &stage.world);
    let drawn = beliefs::ReportForm::honest();
    let small = drawn.case(&table, estimate, &trial::scaled(&set, 1e-3));
    // The estimate is off the table, so nothing is permitted there.
    if !Count::default().permits(&table, &small) {
        return;
    }
    let exact = scale(&stage.world, estimate, &set);
    if !(exact > 1e-3 && exact < 1e3) {
        return;
    }
    for ([from, to], [tried, through]) in BINS.into_iter().zip(found) {
        let set = trial::scaled(&set, exact / rng.within(from, to));
        if trial::yaw(&set) > most_turn {
            continue;
        }
        let case = drawn.case(&table, estimate, &set);
        *tried += 1;
        *through += usize::from(opinion(&stage.bytes, &case.belief, Trust::FULL) == INSIDE);
    }
}

#[test]
fn sets_outside_are_rarely_confirmed() {
    let layouts = [
        ("facets", Layout::Facets, 0.1, [0.002, 0.005, 0.02]),
        (
            "facets, any turn",
            Layout::Facets,
            10.0,
            [0.004, 0.01, 0.06],
        ),
        ("grid", Layout::Grid, 10.0, [0.004, 0.008, 0.04]),
    ];
    for (name, layout, turn, caps) in counts::one_a_day(&layouts) {
        let found = leak(0..60, layout, turn);
        for (([from, to], [tried, through]), cap) in BINS.into_iter().zip(found).zip(caps) {
            let share = through as f64 / tried as f64;
            let name = format!("{name}: confirmed of {tried} sets of true scale {from} to {to}");
            print(&name, format_args!("{share:.5}"), "share", cap);
            assert!(tried >= 300 && share <= cap, "{name}: {share}");
        }
    }
}

/// Returns beliefs whose sets leave the true set, with a true scale of 0.5 to 0.95.
fn outside(rng: &mut Rng, stage: &Stage, table: &Table<'_>, tries: usize) -> Vec<Case> {
    let drawn = beliefs::ReportForm::honest();
    let case = |_| {
        let (estimate, set) = hard_case(rng, &stage.world);
        let small = drawn.case(table, estimate, &trial::scaled(&set, 1e-3));
        if !Count::default().permits(table, &small) {
            return None;
        }
        let exact = scale(&stage.world, estimate, &set);
        let by = exact / rng.within(0.5, 0.95);
        (exact > 1e-3 && exact < 1e3).then(|| drawn.case(table, estimate, &trial::scaled(&set, by)))
    };
    (0..tries).filter_map(case).collect()
}

/// Returns the number of wrong permits by a flipped bit, and how many of them are confirmed.
fn fallen(number: u64) -> [usize; 2] {
    let mut rng = Rng::new(13_000_027 + number);
    let stage = stage(&mut rng, Layout::Facets);
    let healthy = Table::parse(&stage.bytes).unwrap();
    let cases = outside(&mut rng, &stage, &healthy, 60);
    let end = stage.bytes.len() - 4;
    let (mut wrong, mut confirmed) = (0, 0);
    for bit in 176 * 8..end * 8 {
        let mut bytes = stage.bytes.clone();
        bytes[bit / 8] ^= 1 << (bit % 8);
        let crc = posegate::table::checksum(&bytes[..end]).to_le_bytes();
        bytes[end..].copy_from_slice(&crc);
        let Ok(fallen) = Table::parse(&bytes) else {
            continue;
        };
        for case in &cases {
            let set = case.belief.pose_set(fallen.radius_squared(), case.trust);
            if set.is_ok_and(|set| decide(&fallen, &set) == Decision::Inside) {
                wrong += 1;
                let second = opinion(&stage.bytes, &case.belief, case.trust);
                confirmed += usize::from(second == INSIDE);
            }
        }
    }
    [wrong, confirmed]
}

/// Every bit of the facets in memory is flipped once. Almost none of the resulting wrong permits of the first
/// evaluation is confirmed from flash.
#[test]
fn permits_by_a_flipped_bit_are_not_confirmed() {
    let [wrong, confirmed] = (0..16)
        .into_par_iter()
        .map(fallen)
        .reduce(|| [0; 2], |[a, b], [c, d]| [a + c, b + d]);
    let share = confirmed as f64 / wrong as f64;
    print("wrong permits by a fallen bit", wrong, "permits", 1000);
    print(
        "share of them confirmed",
        format_args!("{share:.5}"),
        "share",
        0.02,
    );
    assert!(wrong >= 1000 && share <= 0.02, "{confirmed} of {wrong}");
}
