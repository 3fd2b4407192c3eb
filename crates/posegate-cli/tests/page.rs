//! The page of a site is one file that fetches nothing, shows every task, and contains the core as built from the source. Text of a
//! site file is text in the page, never markup. (`./ci.sh browser` opens the page.)

use posegate_show::page::{CORE, Contents, PageError, PageInput, page};
use posegate_site::{SAMPLE, Site};
use posegate_testkit::run::Case;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, OnceLock};

/// A site, and the contents of its page.
type Prepared = (Site, Result<Contents, PageError>);

/// Returns a site file's tables and plans, which all tests of that file share.
fn prepared(text: &str) -> Arc<OnceLock<Prepared>> {
    static FILES: Mutex<BTreeMap<String, Arc<OnceLock<Prepared>>>> = Mutex::new(BTreeMap::new());
    let of_file = {
        let mut files = FILES.lock().expect("no test panics here");
        Arc::clone(files.entry(text.into()).or_default())
    };
    of_file.get_or_init(|| {
        let site = Site::parse(text, "site.toml").unwrap_or_else(|error| panic!("{error}"));
        let contents = Contents::of(&site, &|_| ());
        (site, contents)
    });
    of_file
}

fn made(text: &str, change: impl FnOnce(&mut PageInput<'_>)) -> Result<String, PageError> {
    let of_file = prepared(text);
    let (site, contents) = of_file.get().expect("it is prepared");
    let contents = contents.as_ref().map_err(Clone::clone)?;
    let mut order = input(site);
    change(&mut order);
    page(&order, contents)
}

fn input(site: &Site) -> PageInput<'_> {
    PageInput {
        site,
        file: "folder/hall.toml".into(),
        title: "Hall".into(),
        placements: vec![],
        pictures: vec![],
    }
}

/// Returns the data of the page's script.
fn data(page: &str) -> Value {
    let (_, rest) = page.split_once("id=\"data\">").expect("data");
    let (text, _) = rest.split_once("</script>").expect("its end");
    serde_json::from_str(text).expect("JSON")
}

#[test]
fn page_shows_every_task_and_fetches_nothing() {
    let page = made(SAMPLE, |_| ()).expect("a page");
    let data = data(&page);
    let site = Site::parse(SAMPLE, "site.toml").expect("a site");
    let names: Vec<&str> = data["tasks"]
        .as_array()
        .expect("tasks")
        .iter()
        .map(|task| task["name"].as_str().expect("a name"))
        .collect();
    assert_eq!(names, site.tasks.keys().collect::<Vec<_>>());
    for task in data["tasks"].as_array().expect("tasks") {
        assert!(
            task["table"]
                .as_str()
                .is_some_and(|table| table.len() > 100)
        );
        let headings = task["sections"]["headings"].as_array().expect("headings");
        assert!(headings.len() >= 9 && headings.contains(&json!(0.0)));
    }
    let digest: String = site
        .digest
        .iter()
        .map(|byte| format!("{byte:02x}"))
        .collect();
    assert!(page.contains(&digest) && page.contains(env!("CARGO_PKG_VERSION")));
    for asked in [
        "src=\"http",
        "href=\"http",
        "@import",
        "url(",
        "fetch(",
        "XMLHttpRequest",
        "import(",
    ] {
        assert!(!page.contains(asked), "{asked}");
    }
    assert!(page.contains("default-src 'none'") && !page.contains("{{"));
    // A second run gives the same bytes.
    let again = Contents::of(&site, &|_| ()).expect("contents");
    assert_eq!(page, self::page(&input(&site), &again).expect("a page"));
}

#[test]
fn names_are_escaped_in_the_page() {
    let hostile = "</script><b id='x'>{{core}}&\\\"";
    let text = SAMPLE.replace("[task.dock]", &format!("[task.\"{hostile}\"]"));
    let text = text.replace("task = \"dock\"", &format!("task = \"{hostile}\""));
    let page = made(&text, |order| order.title = "a</title><i>{{data}}".into()).expect("a page");
    assert!(!page.contains("<b id") && !page.contains("<i>"));
    assert_eq!(page.matches("class Core").count(), 1);
    assert_eq!(page.matches("</script>").count(), 2);
    let tasks = data(&page)["tasks"].to_string();
    assert!(tasks.contains("</script><b id='x'>{{core}}&"));
}

/// Returns the sections of a WebAssembly module: number and content.
fn sections(mut bytes: &[u8]) -> Vec<(u8, &[u8])> {
    assert_eq!(bytes[..8], *b"\0asm\x01\0\0\0");
    bytes = &bytes[8..];
    let mut found = vec![];
    while let Some((number, rest)) = bytes.split_first() {
        let (mut length, mut shift, mut at) = (0, 0, 0);
        loop {
            length |= usize::from(rest[at] & 0x7f) << shift;
            shift += 7;
            at += 1;
            if rest[at - 1] < 0x80 {
                break;
            }
        }
        found.push((*number, &rest[at..at + length]));
        bytes = &rest[at + length..];
    }
    found
}

#[test]
fn wasm_core_has_no_imports() {
    let sections = sections(CORE);
    assert!(sections.iter().all(|(number, _)| *number != 2), "an import");
    let exports = sections.iter().find(|(number, _)| *number == 7);
    let exports = String::from_utf8_lossy(exports.expect("exports").1);
    for name in [
        "posegate_judge_examine",
        "posegate_judge_permits",
        "memory",
        "__heap_base",
    ] {
        assert!(exports.contains(name), "{name}");
    }
    assert!(CORE.len() <= 150_000);
}

#[test]
fn placements_are_checked_and_shown() {
    let place = json!({
        "tag_pose": { "x": 2.5, "y": 0.25, "z": 0.5, "roll_deg": 0.0, "pitch_deg": 0.0, "yaw_deg": 170.0 },
        "mean": 109.5, "p_miss": 4e-7, "margin": 1.2499999, "others": [],
    });
    let mut placement = place.clone();
    placement["before"] = place;
    let site = Site::parse(SAMPLE, "site.toml").expect("a site");
    let mounted = site.tasks["see-t7"].success.tags()[0].pose;
    placement["before"]["tag_pose"] = json!({
        "x": mounted.x, "y": mounted.y, "z": mounted.z,
        "roll_deg": mounted.roll_deg, "pitch_deg": mounted.pitch_deg, "yaw_deg": mounted.yaw_deg,
    });
    let page = made(SAMPLE, |order| {
        order.placements.push(("see-t7".into(), placement.clone()))
    });
    let page = page.expect("a page");
    // A mean cost has no unit, and its definition is shown if it is known.
    assert!(page.contains("<th>mean cost, no unit</th>") && !page.contains("Cost of a view"));
    placement["cost_definition"] = json!("100 d^2 & more; no unit");
    let defined = made(SAMPLE, |order| {
        order.placements.push(("see-t7".into(), placement.clone()))
    });
    assert!(
        defined
            .expect("a page")
            .contains("<p>Cost of a view: 100 d^2 &amp; more; no unit.</p>")
    );
    let before = format!("<td>before</td><td>{:.4}</td>", mounted.x);
    assert!(page.contains(&before) && page.contains("<td>109.500000</td>"));
    // A probability is rounded up, a margin down.
    assert!(page.contains("<td>0.000001</td><td>1.249999</td>"));
    let wrong = |task: &str, placement: Value| {
        let page = made(SAMPLE, |order| {
            order.placements.push((task.into(), placement))
        });
        page.expect_err("a fault")
    };
    let mut moved = placement.clone();
    moved["before"]["tag_pose"]["x"] = json!(mounted.x + 0.001);
    assert_eq!(wrong("see-t7", moved), PageError::OtherTag("see-t7".into()));
    assert_eq!(
        wrong("no", placement.clone()),
        PageError::NoTask("no".into())
    );
    // A placement names the site file that it was made from.
    placement["site_digest"] = json!(site.digest_text());
    let page = made(SAMPLE, |order| {
        order.placements.push(("see-t7".into(), placement.clone()))
    });
    assert!(page.unwrap().contains("have the tag at the place"));
    let later = SAMPLE.replace("psi_max_deg = 50.0", "psi_max_deg = 49.0");
    let error = made(&later, |order| {
        order.placements.push(("see-t7".into(), placement.clone()))
    });
    assert!(
        matches!(error, Err(PageError::OtherSite(..))),
        "{:?}",
        error.err()
    );
    // After the found place is written into the site file, the page shows the tag there. The copied pose may be rounded.
    let own =
        "pose = { x = 4.0, y = 0.0, z = 0.5, roll_deg = 0.0, pitch_deg = 0.0, yaw_deg = 180.0 }";
    assert!(SAMPLE.contains(own));
    let at = |x: &str| {
        SAMPLE.replace(own, &format!("pose = {{ x = {x}, y = 0.25, z = 0.5, roll_deg = 0.0, pitch_deg = 0.0, yaw_deg = 170.0 }}"))
    };
    let page = made(&at("2.50004"), |order| {
        order.placements.push(("see-t7".into(), placement.clone()))
    });
    assert!(page.unwrap().contains("has the tag at the best place"));
    let page = made(&at("2.51"), |order| {
        order.placements.push(("see-t7".into(), placement.clone()))
    });
    assert_eq!(page.err(), Some(PageError::OtherTag("see-t7".into())));
    assert_eq!(
        wrong("see-t7", json!({ "tag_pose": 3 })),
        PageError::NoPlacement("see-t7".into())
    );
}

/// The page shows the chains of the paper's example with their steps and failures, the site from above, the sheet of its tags,
/// and plans.
#[test]
fn page_has_chains_plans_and_the_sheet() {
    let text = include_str!("../../../examples/sites/paper-chain.toml");
    let site = Site::parse(text, "site.toml").expect("a site");
    let shown = made(text, |_| ()).expect("a page");
    let figures = |page: &str, of: &str| page.matches(&format!("<figcaption>{of}")).count();
    let written = site
        .chains
        .iter()
        .filter(|(_, chain)| !chain.steps.is_empty());
    for (name, chain) in written {
        assert_eq!(
            figures(&shown, &format!("{name}, step by step: ")),
            1,
            "{name}"
        );
        let (_, steps) = shown
            .split_once(&format!("the steps of chain {name}</summary>"))
            .expect("steps");
        let (steps, _) = steps.split_once("</details>").expect("an end");
        assert!(steps.matches("<tr>").count() > chain.steps.len(), "{name}");
    }
    assert_eq!(figures(&shown, "The site from above"), 1);
    assert_eq!(figures(&shown, "The mounting sheet"), 1);
    let digest = site.digest_text();
    let origin = format!("site hall.toml, digest {}", &digest[..16]);
    assert_eq!(site.origin("folder/hall.toml"), origin);
    for (name, tag) in &site.tags {
        assert!(shown.contains(&format!(
            "<td>{name}</td><td>{} {}</td>",
            tag.family, tag.tag.id
        )));
    }
    for section in ["plan", "tasks", "chains", "tags"] {
        assert!(
            shown.contains(&format!("<section id=\"{section}\">")),
            "{section}"
        );
    }
    assert!(shown.contains("succeeds; risk at most "));
    // A dock that is too narrow for every chain.
    let narrow = text.replacen(
        "[task.dock]",
        "[task.dock]\ntolerance = { translation = 0.02, yaw_deg = 0.5 }",
        1,
    );
    assert_ne!(narrow, text);
    let narrow = made(&narrow, |_| ()).expect("a page");
    assert!(narrow.contains("FAILS at step "), "no chain fails");
    assert!(element(&narrow, "summary").ends_with(", 1 chain FAILS"));
}

/// The page has the numbers of the camera's view, from the goal and from the worst poses of the expected set.
#[test]
fn image_has_a_table_of_its_numbers() {
    let head = "[task.see-t7]\n";
    let expected = format!("{head}expected = {{ translation = 0.1, yaw_deg = 2.0 }}\n");
    for (text, worst) in [
        (SAMPLE.to_owned(), false),
        (SAMPLE.replace(head, &expected), true),
    ] {
        let page = made(&text, |_| ()).expect("a page");
        let (_, seen) = page
            .split_once("the camera&#39;s image in see-t7</summary>")
            .expect("numbers");
        let (seen, _) = seen.split_once("</details>").expect("an end");
        assert_eq!(seen.matches("<td>the goal</td>").count(), 1);
        assert_eq!(seen.contains("<td>the worst pose of the set for "), worst);
    }
}

/// The sections at the ends of a set's headings are not empty.
#[test]
fn sections_at_the_end_headings_are_not_empty() {
    let text = include_str!("../../../examples/sites/docks.toml");
    let page = made(text, |_| ()).expect("a page");
    for task in data(&page)["tasks"].as_array().expect("tasks") {
        let headings = task["sections"]["headings"].as_array().expect("headings");
        let polygons = task["sections"]["polygons"].as_array().expect("polygons");
        assert_eq!(headings.first(), Some(&json!(-4.0)));
        assert_eq!(headings.last(), Some(&json!(4.0)));
        for (heading, rings) in headings.iter().zip(polygons) {
            assert_eq!(rings.as_array().map(Vec::len), Some(1), "{heading}");
        }
    }
    assert!(!page.contains("-0.0000") && !page.contains(">empty<"));
}

/// Walls of a large hall do not make the page larger if little of them is shown.
#[test]
fn page_size_is_independent_of_wall_length() {
    let wall = |length: f64| {
        let wall = format!(
            "[wall.long]\ncorners = [[-{length:?}, -3.0], [{length:?}, -3.0], [{length:?}, 3.9], [-{length:?}, 3.9]]\nz = [3.0, 4.0]\n"
        );
        made(&format!("{SAMPLE}\n{wall}"), |_| ())
            .expect("a page")
            .len()
    };
    let (short, long) = (wall(10.0), wall(1000.0));
    assert!(long < short + short / 10, "{short} {long}");
}

#[test]
fn report_writes_a_page_or_nothing() {
    let folder = Case::new(&[
        ("site.toml", SAMPLE.as_bytes()),
        ("no.svg", b"text"),
        ("no.json", b"{"),
    ]);
    let report = "report site.toml -o report.html";
    for (more, what) in [
        ("--picture no.svg", "is not an SVG picture"),
        ("--placement see-t7=no.json", "posegate place --json"),
        ("--placement no.json", "expected TASK=FILE"),
        ("--picture none.svg", "none.svg"),
    ] {
        folder
            .run(&format!("{report} {more}"))
            .is_refused_with(&[what]);
        assert!(!folder.path().join("report.html").exists());
    }
    assert_eq!(folder.expect(0, report).1, "");
    let page = folder.text("report.html");
    assert!(page.contains("<h1>site</h1>"));
}

const HALL: &str = include_str!("../../../examples/sites/hall.toml");

/// Returns the hall with its first docks and without candidates. Tags of 30 cm are on its north wall, at these places along it
/// in metres.
fn hall(docks: u32, along: &[f64]) -> String {
    let rest = format!("[task.dock-{}]", docks + 1);
    let (site, _) = HALL
        .split_once(&rest)
        .or_else(|| HALL.split_once("[candidates."))
        .expect("docks");
    let tags = along.iter().enumerate().map(|(id, x)| {
        format!("[tag.north-{id}]\nid = {id}\nfamily = \"tag36h11\"\nsize = 0.3\npose = {{ x = {x:?}, y = 9.0, z = 0.6, roll_deg = 0.0, pitch_deg = 0.0, yaw_deg = -90.0 }}\n")
    });
    site.to_owned() + &tags.collect::<String>()
}

/// Returns the content of the element with an id.
fn element<'p>(page: &'p str, id: &str) -> &'p str {
    let (_, rest) = page
        .split_once(&format!(" id=\"{id}\""))
        .expect("an element");
    let (_, rest) = rest.split_once('>').expect("content");
    rest.split_once('<').expect("an end").0
}

/// The tags that serve the first two docks.
const TAGS_OF_TWO: [f64; 2] = [5.25, 8.25];

/// The page begins with the number of served docks, the number of tags and the worst margin.
#[test]
fn page_begins_with_a_summary() {
    let all = made(&hall(3, &[5.25, 8.25]), |_| ()).expect("a page");
    let summary = element(&all, "summary");
    assert!(
        summary.starts_with("3 of 3 docks served by 2 tags, worst margin 1.0")
            && summary.ends_with(", proven"),
        "{summary}"
    );
    // The worst margin is the least one of the tables of steps, rounded down.
    let (_, steps) = all
        .split_once("the steps of plan of dock-1")
        .expect("steps");
    let cells = steps
        .split("<td>")
        .filter_map(|cell| cell.split_once("</td>"));
    let margins = cells.map(|(cell, _)| cell).filter(|cell| {
        cell.len() == 5 && cell.as_bytes()[1] == b'.' && cell.parse::<f64>().is_ok()
    });
    let least = margins.map(|cell| cell.parse::<f64>().expect("a number"));
    let least = least.filter(|margin| *margin >= 1.0).fold(9.0, f64::min);
    let shown: f64 = summary
        .split(' ')
        .find_map(|word| word.strip_suffix(',')?.parse().ok())
        .expect("a margin");
    assert!(shown <= least && least < shown + 0.01, "{shown} {least}");
    // A margin near 1 leaves nothing for errors that are larger than stated.
    let warned = all.contains("this plan holds for hardly larger errors than stated");
    assert_eq!(warned, shown < 1.05, "{shown}");
    assert!(warned);
    let (header, _) = all.split_once("<main>").expect("a header");
    assert!(header.contains("id=\"summary\""));
    // Without the first tag the first dock is not served, and the summary reports it.
    let fewer = made(&hall(2, &TAGS_OF_TWO[1..]), |_| ()).expect("a page");
    let summary = element(&fewer, "summary");
    assert!(
        summary.starts_with("1 of 2 docks served by 1 tag"),
        "{summary}"
    );
    assert!(fewer.contains("<p id=\"summary\" class=\"bad\">"));
    assert!(fewer.contains("<li>NOT served: dock-1: "));
    // Equal docks are described once.
    assert!(all.contains("<p>3 tasks are equal in the frames of their goals."));
    assert_eq!(
        all.matches("<details><summary>the pictures of dock-")
            .count(),
        2
    );
    // The page claims nothing about tasks without a start.
    let sample = made(SAMPLE, |_| ()).expect("a page");
    assert_eq!(element(&sample, "summary"), "3 of 3 success sets proven");
    assert!(sample.contains("unknown whether a robot can reach dock, park: no start"));
}

#[test]
fn equal_tasks_are_described_once() {
    // A narrower dock is shown separately.
    let site = hall(3, &[5.25, 8.25]);
    let (before, last) = site.split_once("[task.dock-3]").expect("a task");
    let narrow = last.replacen("x = [-0.1, 0.1]", "x = [-0.1, 0.09]", 1);
    let page = made(&format!("{before}[task.dock-3]{narrow}"), |_| ()).expect("a page");
    assert!(page.contains("<p>2 tasks are equal in the frames of their goals."));
    assert_eq!(
        page.matches("<details><summary>the pictures of dock-")
            .count(),
        1
    );
}

/// If the tag's tolerance alone exceeds the stated error, a plan is proven but wrong. The summary warns of it.
#[test]
fn summary_shows_warnings() {
    let doubtful = hall(2, &TAGS_OF_TWO) + "tolerance = { translation = 0.01, yaw_deg = 0.5 }\n";
    let page = made(&doubtful, |_| ()).expect("a page");
    assert!(page.contains("<p id=\"summary\" class=\"warned\">2 of 2 docks"));
    assert!(page.contains("<li>WARNING: "), "no warning");
    let sound = hall(2, &TAGS_OF_TWO);
    let page = made(&sound, |_| ()).expect("a page");
    // A margin hardly above 1 is no warning of the site, but it is not shown in green.
    assert!(
        page.contains("<p id=\"summary\" class=\"warned\">2 of 2 docks")
            && !page.contains("WARNING")
    );
    let reserved = sound.replacen("[planner]\n", "[planner]\nleast_margin = 1.06\n", 1);
    let page = made(&reserved, |_| ()).expect("a page");
    assert!(
        page.contains("<p id=\"summary\" class=\"good\">2 of 2 docks") && !page.contains("WARNING")
    );
}

/// A missing tolerance is shown as unknown: 0.000 m would claim that the tag is exactly at the pose of the file.
#[test]
fn unknown_tolerance_is_not_shown_as_zero() {
    let page = made(&hall(1, &[5.25]), |_| ()).expect("a page");
    let (_, tags) = page.split_once("<section id=\"tags\">").expect("tags");
    assert!(tags.contains("<td>unknown</td>") && !tags.contains("<td>0.000 m"));
    let known = hall(1, &[5.25]) + "tolerance = { translation = 0.01, yaw_deg = 0.5 }\n";
    let page = made(&known, |_| ()).expect("a page");
    assert!(page.contains("<td>0.010 m, 0.50 deg</td>"));
}
