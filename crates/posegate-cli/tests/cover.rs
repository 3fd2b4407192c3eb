//! Covers are optimal and valid. On small sites `plan` tries every subset of the candidates, and no subset that serves is
//! cheaper. The written site serves with and without each tag. The answer is equal for any number of threads.

use posegate_plan::cover::{
    Cover, CoverError, CoverOptions, Incumbent, Method, Watch, cover, cover_watched, written,
};
use posegate_plan::{Options, PlanError, Prepared};
use posegate_site::Site;
use rayon::prelude::*;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};

use posegate_testkit::run::Case;
use posegate_testkit::{counts, warehouse};

use warehouse::warehouse;

const LENGTH: f64 = 5.0;
const DOCKS: usize = 4;

fn order(survive: bool, method: Method) -> CoverOptions {
    CoverOptions {
        survive_a_lost_tag: survive,
        method,
        gap: 0.0,
        // All of a small site.
        beside: 50.0,
        ..CoverOptions::default()
    }
}

fn covered(site: &Site, order: &CoverOptions) -> Cover {
    cover(site, order, &|_, _| ()).unwrap_or_else(|error| panic!("{error}"))
}

fn parsed(text: &str) -> Site {
    Site::parse(text, "site.toml").unwrap_or_else(|error| panic!("{error}\n{text}"))
}

/// Returns the text with some of its candidates as tags, and without the others.
fn mounted(text: &str, has: impl Fn(usize) -> bool) -> String {
    let mut number = 0;
    let mut sections = Vec::new();
    for section in text.split("\n\n") {
        if !section.starts_with("[candidate.") {
            sections.push(section.to_owned());
            continue;
        }
        if has(number) {
            let lines = section.lines().filter(|line| !line.starts_with("cost"));
            let tag = lines.collect::<Vec<_>>().join("\n");
            let tag = tag.replace("[candidate.", "[tag.");
            sections.push(tag.replacen('\n', &format!("\nid = {number}\n"), 1));
        }
        number += 1;
    }
    sections.join("\n\n")
}

/// Returns which tasks have a plan on a site, and which have one that survives the loss of a tag. Tasks are in the order of
/// their names.
fn plans(text: &str) -> [Vec<bool>; 2] {
    let site = parsed(text);
    let mut prepared = match Prepared::of(&site, None) {
        Ok(prepared) => prepared,
        Err(PlanError::NoLooks(_)) => return [0, 1].map(|_| vec![false; site.tasks.len()]),
        Err(error) => panic!("{error}"),
    };
    let start = |from: &Option<String>| &site.chains[from.as_ref().expect("a start")].start;
    let mut has_plan = |name: &str, from: &Option<String>, survive_a_lost_tag| {
        let options = Options {
            survive_a_lost_tag,
            ..Options::default()
        };
        let planned = prepared.plan(start(from), name, &options);
        planned.expect("an answer").plan.is_some()
    };
    let tasks = site.tasks.iter();
    let (plain, surviving) = tasks
        .map(|(name, task)| {
            let plain = has_plan(name, &task.from, false);
            // A plan that survives is a plan.
            (plain, plain && has_plan(name, &task.from, true))
        })
        .unzip();
    [plain, surviving]
}

/// Returns the served tasks for each subset of the candidates.
fn all_subsets(text: &str, candidates: usize) -> Vec<[Vec<bool>; 2]> {
    let mut all: Vec<[Vec<bool>; 2]> = (0..1usize << candidates)
        .into_par_iter()
        .map(|subset| plans(&mounted(text, |number| subset >> number & 1 == 1)))
        .collect();
    // A task that survives also has a plan without any one of the tags.
    for subset in (0..all.len()).rev() {
        for lost in (0..candidates).filter(|number| subset >> number & 1 == 1) {
            let plain = all[subset & !(1 << lost)][0].clone();
            for (surviving, plain) in all[subset][1].iter_mut().zip(plain) {
                *surviving &= plain;
            }
        }
    }
    all
}

/// Returns sites with a choice, each with its number of candidates.
fn sites() -> Vec<(String, usize)> {
    let mut sites: Vec<(String, usize)> = [(1, 7), (2, 6)]
        .map(|(seed, candidates)| (warehouse(seed, 1, LENGTH, DOCKS, candidates), candidates))
        .into();
    sites.push((borrowed(true), 4));
    sites
}

/// Returns a dock of a large warehouse. Its plan looks at one of two tags from a place that was generated for the other one. With
/// `twice`, there is a lower copy of each candidate, and one of the copies is expensive.
fn borrowed(twice: bool) -> String {
    let text = warehouse(1, 10, 40.0, 100, 2_000);
    let mut sections: Vec<String> = vec![];
    for section in text.split("\n\n") {
        let of = |kind: &str| section.starts_with(kind);
        let candidate = ["[candidate.c643]", "[candidate.c1953]"]
            .map(of)
            .contains(&true);
        if !(of("[task.") || of("[candidate.")) || of("[task.dock-23]") || candidate {
            sections.push(section.to_owned());
        }
        if candidate && twice {
            let (before, rest) = section.split_once(" z = ").expect("a height");
            let (z, after) = rest.split_once(',').expect("a height");
            let lower = z.parse::<f64>().expect("a number") - 0.4;
            let again = format!("{before} z = {lower:?},{after}");
            let costly = again.replace("cost = 2.5", "cost = 100.0");
            sections.push(match of("[candidate.c643]") {
                true => costly.replace("[candidate.c643]", "[candidate.d643]"),
                false => again.replace("[candidate.c1953]", "[candidate.d1953]"),
            });
        }
    }
    // In the order of their names.
    let (mut candidates, others): (Vec<String>, Vec<String>) = sections
        .into_iter()
        .partition(|section| section.starts_with("[candidate."));
    candidates.sort();
    others
        .into_iter()
        .chain(candidates)
        .collect::<Vec<_>>()
        .join("\n\n")
}

#[test]
fn exact_cover_costs_no_more_than_any_serving_subset() {
    let mut served = [0, 0];
    // Only the smallest site, unless the test is deep.
    let skipped = if counts::is_deep() { 0 } else { 2 };
    for (seed, (text, candidates)) in sites().into_iter().enumerate().skip(skipped) {
        let site = parsed(&text);
        // Candidates are numbered in the order of their names: there are fewer than ten.
        let costs: Vec<f64> = site.candidates.values().map(|found| found.cost).collect();
        let [plain, surviving]: [Vec<Vec<bool>>; 2] = {
            let all = all_subsets(&text, candidates);
            [0, 1].map(|kind: usize| all.iter().map(|serves| serves[kind].clone()).collect())
        };
        for (survive, subsets) in [(false, plain), (true, surviving)] {
            let possible = subsets.last().expect("subsets");
            let cost_of = |subset: usize| -> f64 {
                let chosen = (0..candidates).filter(|number| subset >> number & 1 == 1);
                chosen.map(|number| costs[number]).sum()
            };
            let enough = |subset: &usize| {
                let serves = subsets[*subset].iter().zip(possible);
                serves
                    .into_iter()
                    .all(|(serves, possible)| *serves || !possible)
            };
            let best = (0..subsets.len())
                .filter(enough)
                .map(cost_of)
                .fold(f64::INFINITY, f64::min);
            let exact = covered(&site, &order(survive, Method::Exact));
            let served_tasks: Vec<bool> = exact
                .tasks
                .iter()
                .map(|task| task.reason.is_none())
                .collect();
            assert_eq!(&served_tasks, possible, "seed {seed}, survive {survive}");
            assert!(
                (exact.cost - best).abs() < 1e-9,
                "seed {seed}, survive {survive}: {} and by trying all {best}",
                exact.cost
            );
            assert!(exact.bound <= best + 1e-9 && exact.gap() <= 1e-6);
            assert!(exact.bound_checked <= exact.bound + 1e-9);
            let greedy = covered(&site, &order(survive, Method::Greedy));
            assert!(greedy.cost >= best - 1e-9 && greedy.bound <= best + 1e-9);
            for found in [&exact, &greedy] {
                let names: Vec<&String> = site.candidates.keys().collect();
                let has = |number: usize| found.tags.iter().any(|tag| tag.name == *names[number]);
                let subset: usize = (0..candidates).map(|n| usize::from(has(n)) << n).sum();
                assert!(enough(&subset), "seed {seed}, survive {survive}");
                assert!((cost_of(subset) - found.cost).abs() < 1e-9);
            }
            served[usize::from(survive)] += possible.iter().filter(|serves| **serves).count();
        }
    }
    println!("{served:?} tasks served");
    let least = if counts::is_deep() { [4, 1] } else { [1, 0] };
    assert!(served[0] >= least[0] && served[1] >= least[1], "{served:?}");
}

/// Returns a site with too many candidates to try all subsets.
fn aisle() -> String {
    warehouse(5, 1, 8.0, 4, 36)
}

#[test]
fn written_site_serves_with_and_without_each_tag() {
    let text = aisle();
    let site = parsed(&text);
    let methods = [
        (false, Method::Greedy),
        (false, Method::Exact),
        (true, Method::Greedy),
    ];
    let tried = if counts::is_deep() { 3 } else { 1 };
    for (survive, method) in methods.into_iter().take(tried) {
        let order = CoverOptions {
            survive_a_lost_tag: survive,
            method,
            beside: 50.0,
            ..CoverOptions::default()
        };
        let found = covered(&site, &order);
        assert!(found.serves_all() && !found.tags.is_empty());
        let text = written(&text, "site.toml", &found).expect("a site file");
        let names: Vec<String> = parsed(&text).tasks.keys().cloned().collect();
        assert!(plans(&text)[usize::from(survive)].iter().all(|plan| *plan));
        // A third of the tags each day; all in a deep job.
        let (skipped, step) = counts::part(3.min(found.tags.len()));
        for tag in found.tags.iter().skip(skipped).step_by(step) {
            let head = format!("[tag.{}]", tag.name);
            let (before, rest) = text.split_once(&head).expect("the tag");
            let after = rest
                .split_once("\n[")
                .map_or(String::new(), |(_, after)| format!("[{after}"));
            let less = format!("{before}{after}");
            assert_eq!(parsed(&less).tags.len() + 1, found.tags.len());
            let lost: Vec<String> = names
                .iter()
                .zip(&plans(&less)[0])
                .filter(|(_, plan)| !**plan)
                .map(|(name, _)| name.clone())
                .collect();
            assert_eq!(lost, tag.needed_by, "{}", tag.name);
            assert!(!survive || lost.is_empty(), "{}", tag.name);
            // Every chosen tag is needed.
            assert!(
                !(tag.needed_by.is_empty() && tag.second_of.is_empty()),
                "{}",
                tag.name
            );
        }
    }
}

#[test]
fn cover_keeps_both_tags_that_a_plan_needs() {
    // The plan looks at one of the tags from a place that was generated for the other one, so it needs both.
    let text = borrowed(false);
    assert_eq!(
        [0b01, 0b10, 0b11].map(|subset: usize| {
            let has = |number: usize| subset >> number & 1 == 1;
            plans(&mounted(&text, has))[0][0]
        }),
        [false, false, true]
    );
    let found = covered(&parsed(&text), &CoverOptions::default());
    assert!(found.serves_all(), "{:?}", found.tasks[0].reason);
    assert_eq!(found.tags.len(), 2);
}

#[test]
fn cover_is_equal_for_any_number_of_threads() {
    let text = if counts::is_deep() {
        aisle()
    } else {
        warehouse(5, 1, 8.0, 2, 12)
    };
    let site = parsed(&text);
    let bytes = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        pool.build().expect("threads").install(|| {
            let found = covered(&site, &CoverOptions::default());
            let text = written(&text, "site.toml", &found).expect("a site file");
            (found.to_json().to_string(), text)
        })
    };
    assert_eq!(bytes(1), bytes(2));
}

fn refused(text: &str) -> String {
    Site::parse(text, "site.toml")
        .expect_err("a fault")
        .to_string()
}

#[test]
fn bad_input_is_reported_with_the_reason() {
    let text = warehouse(1, 1, LENGTH, 2, 3);
    let with = |from: &str, to: &str| text.replacen(from, to, 1);
    let error = |text: &str| {
        let found = cover(&parsed(text), &CoverOptions::default(), &|_, _| ());
        found.expect_err("a fault")
    };
    assert_eq!(error(&mounted(&text, |_| true)), CoverError::NoCandidates);
    assert_eq!(
        error(&with("from = \"from-", "# from = \"from-")),
        CoverError::NoStart("dock-0".into())
    );
    let look = text.find("look = ").expect("a look");
    let lines: Vec<&str> = text[look..].lines().take(2).collect();
    let mut without = text.clone();
    for line in lines {
        without = without.replacen(line, "", 1);
    }
    assert_eq!(error(&without), CoverError::NoLook);
    let work: String = text
        .split("\n\n")
        .filter(|section| !section.starts_with("[task."))
        .collect::<Vec<_>>()
        .join("\n\n");
    assert_eq!(error(&work), CoverError::NoWork);
    let found = cover(
        &parsed(&text),
        &CoverOptions {
            gap: f64::NAN,
            ..CoverOptions::default()
        },
        &|_, _| (),
    );
    assert!(matches!(found, Err(CoverError::Number(_))));

    // Numbers and names of the file.
    let twice = with("[candidate.c0]\n", "[candidate.c0]\nid = 3\n");
    let twice = twice.replacen("[candidate.c1]\n", "[candidate.c1]\nid = 3\n", 1);
    let error_text = refused(&twice);
    assert!(
        error_text.contains("the candidate `c1` has the number 3 of candidate `c0`"),
        "{error_text}"
    );
    let tag = mounted(&text, |number| number == 0);
    let candidates = &text[text.find("[candidate.c0]").expect("a candidate")..];
    let error_text = refused(&format!("{tag}\n\n{candidates}"));
    assert!(
        error_text.contains("the candidate `c0` has the name of a tag"),
        "{error_text}"
    );
    let own = candidates.replacen("[candidate.c0]\n", "[candidate.d0]\nid = 0\n", 1);
    let error_text = refused(&format!("{tag}\n\n{own}"));
    assert!(
        error_text.contains("has the number 0 of tag `c0`"),
        "{error_text}"
    );
    let error_text = refused(&with("cost = ", "cost = -"));
    assert!(
        error_text.contains("`candidate.c0.cost` is -"),
        "{error_text}"
    );
    let error_text = refused(&with("from = \"from-", "from = \"form-"));
    assert!(
        error_text.contains("there is no chain `form-"),
        "{error_text}"
    );
}

#[test]
#[ignore = "takes long: ./ci.sh deep"]
fn chosen_tags_have_distinct_places() {
    let text = warehouse(5, 1, 8.0, 1, 18);
    // The same places again, under other names. Two tags at one place would not survive its loss.
    let candidates = &text[text.find("[candidate.").expect("a candidate")..];
    let twice = format!(
        "{text}\n\n{}",
        candidates.replace("[candidate.c", "[candidate.d")
    );
    let found = covered(&parsed(&twice), &order(true, Method::Greedy));
    let poses: Vec<_> = found.tags.iter().map(|tag| tag.tag.tag.pose).collect();
    for (at, pose) in poses.iter().enumerate() {
        assert!(!poses[..at].contains(pose), "{pose:?}");
    }
    assert!(found.serves_all());
    assert!(found.tags.iter().all(|tag| tag.needed_by.is_empty()));
}

#[test]
fn chosen_tag_needs_wall_space_and_a_free_id() {
    let text = warehouse(5, 1, 8.0, 1, 18);
    // Candidates at places that small, useless tags occupy: no candidate has space.
    let alone = borrowed(false);
    let has_both = mounted(&alone, |_| true);
    let again = &alone[alone.find("[candidate.").expect("a candidate")..];
    let again = again.replace("[candidate.c", "[candidate.d");
    let taken = has_both.replace("size = 0.3\n", "size = 0.1\n");
    let found = covered(
        &parsed(&format!("{taken}\n\n{again}")),
        &CoverOptions::default(),
    );
    assert!(!found.serves_all() && found.tags.is_empty() && found.bound == 0.0);

    // A candidate on a keep-out, and one whose border reaches over it.
    let with_keep_out = |to: f64| {
        let all = format!("keep_out = [{{ along = [0.0, {to:?}], z = [0.0, 2.5] }}]\n");
        let heads = ["[wall.rack-0]\n", "[wall.rack-1]\n"];
        let text = heads.iter().fold(text.clone(), |text, head| {
            text.replacen(head, &format!("{head}{all}"), 1)
        });
        cover(&parsed(&text), &CoverOptions::default(), &|_, _| ())
    };
    assert!(matches!(
        with_keep_out(18.4),
        Err(CoverError::KeepOut { .. })
    ));
    assert!(with_keep_out(1e-3).is_ok());

    // A family of thirty tags, all of which are mounted.
    let mut mounted = text.replace("family = \"tag36h11\"", "family = \"tag16h5\"");
    mounted = mounted.replace("px_per_bit_min = 4.0", "px_per_bit_min = 5.0");
    for id in 0..30 {
        mounted += &format!(
            "\n[tag.t{id}]\nid = {id}\nfamily = \"tag16h5\"\nsize = 0.3\npose = {{ x = {id}.0, y = 90.0, z = 1.0, roll_deg = 0.0, pitch_deg = 0.0, yaw_deg = 0.0 }}\n"
        );
    }
    let full = cover(&parsed(&mounted), &CoverOptions::default(), &|_, _| ());
    assert!(matches!(full, Err(CoverError::NoNumber(_))), "{full:?}");
}

#[test]
fn exact_start_needs_no_tag() {
    let text = warehouse(1, 1, LENGTH, 2, 3)
        .replace(
            "bounded = { translation = 0.25, yaw_deg = 3.0 }",
            "bounded = { translation = 0.0, yaw_deg = 0.0 }",
        )
        .replace(
            "k_turn = 0.004, k_drift = 0.004, k_slip = 0.01",
            "k_turn = 0.0, k_drift = 0.0, k_slip = 0.0",
        );
    for survive in [false, true] {
        let found = covered(&parsed(&text), &order(survive, Method::Exact));
        assert!(found.serves_all() && found.tags.is_empty());
        assert_eq!((found.cost, found.bound, found.gap()), (0.0, 0.0, 0.0));
    }
}

#[test]
fn mounted_tags_cost_nothing() {
    let text = warehouse(5, 1, 12.0, 2, 30);
    let all = mounted(&text, |_| true);
    // The same candidates again, under other names.
    let candidates = &text[text.find("[candidate.").expect("a candidate")..];
    let again = candidates.replace("[candidate.c", "[candidate.d");
    let found = covered(
        &parsed(&format!("{all}\n\n{again}")),
        &CoverOptions::default(),
    );
    assert!(found.serves_all() && found.tags.is_empty() && found.cost == 0.0);
}

#[test]
fn unserved_task_is_reported_with_the_reason() {
    let reason = |text: &str| {
        let found = covered(&parsed(text), &CoverOptions::default());
        assert!(!found.serves_all());
        let first = found.tasks.into_iter().find_map(|task| task.reason);
        first.expect("a reason")
    };
    let text = warehouse(5, 1, 12.0, 1, 10);
    // Far away.
    let far = text.replace("goal = { x = ", "goal = { x = 10");
    // Turned to the wall.
    let turned = text.replace(
        "roll_deg = 0.0, pitch_deg = 0.0, yaw_deg = -90.0 }",
        "roll_deg = 0.0, pitch_deg = 0.0, yaw_deg = +90.5 }",
    );
    let turned = turned.replace(
        "roll_deg = 0.0, pitch_deg = 0.0, yaw_deg = 90.0 }",
        "roll_deg = 0.0, pitch_deg = 0.0, yaw_deg = -90.0 }",
    );
    let turned = turned.replace("yaw_deg = +90.5 }", "yaw_deg = 90.0 }");
    // A dock that is narrower than the error after an observation.
    let from = text.find("x = [-0.").expect("a box");
    let to = from + text[from..].find(", yaw_deg").expect("a box");
    let narrow = text.replacen(&text[from..to], "x = [-0.01, 0.01], y = [-0.01, 0.01]", 1);
    let cases = [
        (far.as_str(), "none is near enough"),
        (turned.as_str(), "walls hide them"),
        (narrow.as_str(), "the nearest miss"),
    ];
    for (text, expected) in counts::one_a_day(&cases) {
        let message = reason(text);
        assert!(message.contains(expected), "{message}");
    }
}

#[test]
fn cover_writes_a_site_that_plan_accepts() {
    let site = warehouse(5, 1, 12.0, 2, 30);
    let folder = Case::new(&[("site.toml", site.as_bytes())]);
    let report = folder.json(0, "cover site.toml -o out.toml --json");
    assert!(report["success"] == true && report["gap"].as_f64().expect("a gap") <= 0.05);
    for task in ["dock-0", "dock-1"] {
        folder.expect(0, &format!("plan out.toml --to {task} --json"));
    }
    // A task that cannot be served: nothing is written.
    let far = site.replacen("goal = { x = ", "goal = { x = 10", 1);
    folder.write("site.toml", far);
    std::fs::remove_file(folder.path().join("out.toml")).expect("the file was written");
    let (text, _) = folder.expect(1, "cover site.toml -o out.toml");
    assert!(
        text.contains("dock-0: NOT SERVED: no candidate is in reach"),
        "{text}"
    );
    assert_eq!(folder.names(), ["site.toml"]);
}

/// A search that is stopped after its first choice costs no more than the greedy choice, and its bound holds.
#[test]
fn stopped_search_keeps_the_best_choice() {
    let mut unfinished = 0;
    let skipped = if counts::is_deep() { 0 } else { 2 };
    for (text, _) in sites().into_iter().skip(skipped) {
        let site = parsed(&text);
        for survive in [false, true] {
            let greedy = covered(&site, &order(survive, Method::Greedy));
            let best = covered(&site, &order(survive, Method::Exact));
            let stop: Arc<AtomicBool> = Arc::default();
            let seen = Mutex::new(Vec::new());
            let improved = |now: Incumbent| {
                stop.store(true, Ordering::Relaxed);
                seen.lock().unwrap().push((now.cost, now.bound));
            };
            let watch = Watch {
                tick: &|_, _| (),
                improved: &improved,
                stop: stop.clone(),
            };
            let stopped = cover_watched(&site, &order(survive, Method::Exact), &watch).unwrap();
            let seen = seen.into_inner().unwrap();
            assert!(!seen.is_empty());
            assert!(
                stopped.cost <= greedy.cost,
                "{} {}",
                stopped.cost,
                greedy.cost
            );
            assert!(stopped.bound <= best.cost + 1e-9);
            assert_eq!(stopped.serves_all(), best.serves_all());
            // With no time at all the result is equal.
            let limited = CoverOptions {
                time_limit: Some(1e-9),
                ..order(survive, Method::Exact)
            };
            let limited = covered(&site, &limited);
            assert_eq!((limited.cost, limited.bound), (stopped.cost, stopped.bound));
            assert_eq!(limited.is_finished, stopped.is_finished);
            // Costs fall and bounds rise.
            let seen = Mutex::new(Vec::new());
            let watch = Watch {
                tick: &|_, _| (),
                improved: &|now: Incumbent| seen.lock().unwrap().push((now.cost, now.bound)),
                stop: Arc::default(),
            };
            let found = cover_watched(&site, &order(survive, Method::Exact), &watch).unwrap();
            assert_eq!((found.cost, found.bound), (best.cost, best.bound));
            let seen = seen.into_inner().unwrap();
            let improves = |two: &[(f64, f64)]| two[1].0 <= two[0].0 && two[1].1 >= two[0].1;
            assert!(seen.windows(2).all(improves), "{seen:?}");
            assert_eq!(seen.last(), Some(&(best.cost, best.bound)));
            unfinished += usize::from(!stopped.is_finished);
        }
    }
    assert!(unfinished > 0);
}
