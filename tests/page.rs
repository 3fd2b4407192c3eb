//! The page of a site is one file that asks for nothing, shows every task, and carries the core as the source makes it; what a site
//! file says is text in it, and never markup. (`./ci.sh browser` opens it.)
#![cfg(feature = "cli")]

use posegate::page::{CORE, Contents, Order, PageError, page};
use posegate::site::{SAMPLE, Site};
use serde_json::{Value, json};
use std::process::Command;

fn made(text: &str, change: impl FnOnce(&mut Order<'_>)) -> Result<String, PageError> {
    let site = Site::parse(text, "site.toml").unwrap_or_else(|error| panic!("{error}"));
    let contents = Contents::of(&site, &|_| ())?;
    let mut order = Order {
        site: &site,
        title: "Hall".into(),
        placements: vec![],
        pictures: vec![],
    };
    change(&mut order);
    page(&order, &contents)
}

/// The data of the page's script.
fn data(page: &str) -> Value {
    let (_, rest) = page.split_once("id=\"data\">").expect("data");
    let (text, _) = rest.split_once("</script>").expect("its end");
    serde_json::from_str(text).expect("JSON")
}

#[test]
fn it_shows_every_task_and_asks_for_nothing() {
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
    // The same bytes again.
    assert_eq!(page, made(SAMPLE, |_| ()).expect("a page"));
}

#[test]
fn names_are_text() {
    let nasty = "</script><b id='x'>{{core}}&\\\"";
    let text = SAMPLE.replace("[task.dock]", &format!("[task.\"{nasty}\"]"));
    let text = text.replace("task = \"dock\"", &format!("task = \"{nasty}\""));
    let page = made(&text, |order| order.title = "a</title><i>{{data}}".into()).expect("a page");
    assert!(!page.contains("<b id") && !page.contains("<i>"));
    assert_eq!(page.matches("class Core").count(), 1);
    assert_eq!(page.matches("</script>").count(), 2);
    let told = data(&page)["tasks"].to_string();
    assert!(told.contains("</script><b id='x'>{{core}}&"));
}

/// The sections of a WebAssembly module: number and content.
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
fn the_core_imports_nothing() {
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
        "mean": 109.5, "p_miss": 1e-7, "margin": 1.25, "others": [],
    });
    let mut told = place.clone();
    told["before"] = place;
    told["before"]["tag_pose"]["x"] = json!(4.125);
    let page = made(SAMPLE, |order| {
        order.placements.push(("see-t7".into(), told.clone()))
    });
    let page = page.expect("a page");
    assert!(page.contains("<td>4.1250</td>") && page.contains("<td>109.500000</td>"));
    let wrong = |task: &str, told: Value| {
        let page = made(SAMPLE, |order| order.placements.push((task.into(), told)));
        page.expect_err("a fault")
    };
    assert_eq!(wrong("no", told), PageError::NoTask("no".into()));
    assert_eq!(
        wrong("see-t7", json!({ "tag_pose": 3 })),
        PageError::NoPlacement("see-t7".into())
    );
}

#[test]
fn the_command_writes_a_page_or_nothing() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name);
    std::fs::write(path("site.toml"), SAMPLE).expect("a file");
    std::fs::write(path("no.svg"), "text").expect("a file");
    std::fs::write(path("no.json"), "{").expect("a file");
    let run = |more: &[&str]| {
        let told = Command::new(env!("CARGO_BIN_EXE_posegate"))
            .current_dir(folder.path())
            .args(["report", "site.toml", "-o", "report.html"])
            .args(more)
            .output()
            .expect("the program runs");
        (
            told.status.code(),
            String::from_utf8_lossy(&told.stderr).into_owned(),
        )
    };
    for (more, what) in [
        (["--picture", "no.svg"], "is no SVG picture"),
        (["--placement", "see-t7=no.json"], "posegate place --json"),
        (["--placement", "no.json"], "expected TASK=FILE"),
        (["--picture", "none.svg"], "none.svg"),
    ] {
        let (code, said) = run(&more);
        assert_eq!(code, Some(2), "{said}");
        assert!(said.contains(what), "{said}");
        assert!(!path("report.html").exists());
    }
    assert_eq!(run(&[]), (Some(0), String::new()));
    let page = std::fs::read_to_string(path("report.html")).expect("a page");
    assert!(page.contains("<h1>site</h1>"));
}
