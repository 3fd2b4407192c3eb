//! Errors have a limited length and are printable for any input. A panic is reported in one line.
#![cfg(unix)]

use posegate_testkit::commands;

use commands::Folder;
use posegate_files::printable::is_printable;
use posegate_site::SAMPLE;
use std::process::{Output, Stdio};
use std::time::{Duration, Instant};

/// Control characters that a terminal executes, and a line end.
const HOSTILE: &str =
    "a\u{1b}[2J\u{1b}]0;x\u{7}\u{8}\u{7f}\u{9b}31m\u{202e}\u{2066}\u{200f}\u{feff}\u{85}b";

/// [`HOSTILE`] as TOML, JSON and YAML write it in a string.
const QUOTED: &str =
    "a\\u001B[2J\\u001B]0;x\\u0007\\u0008\\u007F\\u009B31m\\u202E\\u2066\\u200F\\uFEFF\\u0085b";

/// Runs a line that has spaces between its words, and ends it if it hangs.
fn run(folder: &Folder, line: &str) -> (Option<i32>, String, String) {
    let words: Vec<&str> = line.split(' ').collect();
    let mut child = folder
        .command(&words)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let streams = (child.stdout.take().unwrap(), child.stderr.take().unwrap());
    let read = |mut from: Box<dyn std::io::Read + Send>| {
        std::thread::spawn(move || {
            let mut text = String::new();
            from.read_to_string(&mut text).map(|_| text)
        })
    };
    let (out, err) = (read(Box::new(streams.0)), read(Box::new(streams.1)));
    let begun = Instant::now();
    let status = loop {
        if let Some(status) = child.try_wait().unwrap() {
            break status;
        }
        if begun.elapsed() > Duration::from_secs(60) {
            child.kill().unwrap();
            panic!("{line:?} does not end");
        }
        std::thread::sleep(Duration::from_millis(5));
    };
    let text =
        |thread: std::thread::JoinHandle<std::io::Result<String>>| thread.join().unwrap().unwrap();
    (status.code(), text(out), text(err))
}

/// Runs a command that must fail with a short, printable error and exit code 2. Returns the error.
fn error(folder: &Folder, line: &str) -> String {
    let (code, out, err) = run(folder, line);
    assert_eq!(code, Some(2), "{line:?}: {err:.3000}");
    for text in [&out, &err] {
        assert!(text.len() < 100_000, "{line:?}: {} bytes", text.len());
        shown(text);
    }
    err
}

fn shown(text: &str) {
    let raw = text.chars().find(|c| *c != '\n' && !is_printable(*c));
    assert_eq!(raw, None, "{text:?}");
}

/// Returns a site file with a fault in line 4, `before` characters (in groups of three) behind the array's begin and
/// `after` characters before the line's end.
fn long_line(before: usize, after: usize) -> String {
    format!(
        "# first\n[table]\nlayout = \"auto\"\nx = [{}wrong] # {}\n# last\n",
        "1, ".repeat(before / 3),
        "y".repeat(after)
    )
}

#[test]
fn fault_in_a_long_line_is_shown_with_its_column() {
    let folder = Folder::new();
    for (before, after) in [(10, 10), (70_000, 10), (10, 70_000), (3_000_000, 3_000_000)] {
        folder.write("long.toml", long_line(before, after));
        let message = error(&folder, "check long.toml");
        let column = 6 + before / 3 * 3;
        let place = format!("long.toml:4:{column}");
        let words = message.split_whitespace().collect::<String>();
        assert_eq!(words.matches(&place).count(), 2, "{place}: {message}");
        assert!(message.contains("wrong"), "{message}");
        assert_eq!(
            message.contains('\u{2026}'),
            before.max(after) > 100,
            "{message}"
        );
    }
}

/// Megabytes of text as a key, a value, a table's name, one line, and in a file that the site names.
#[test]
fn error_of_a_huge_input_is_short() {
    let folder = Folder::new();
    let long = "k".repeat(4_000_000);
    for text in [
        format!("{long} = 1\n"),
        format!("[{long}]\n"),
        format!("[table]\nlayout = \"{long}\"\n"),
        format!("[task.{long}]\nkind = \"work\"\n"),
        format!("[task.t]\nkind = \"{long}\"\n"),
        long.clone(),
        format!("a = \"\"\"{}", "line\n".repeat(1_000_000)),
        format!("a = [{}\n", "[1],\n".repeat(1_000_000)),
        format!("[table]\nstep = {{ {} }}\n", "a = 1, ".repeat(300_000)),
    ] {
        folder.write("long.toml", &text);
        error(&folder, "check long.toml");
    }
    folder.write(
        "hall.json",
        format!("{{\"tags\": [{{\"{long}\": {long}}}]}}"),
    );
    let message = error(&folder, "check site.toml");
    assert!(message.contains("hall.json:1:"), "{message}");
    folder.write("front.yaml", format!("{long}\n"));
    error(&folder, "check site.toml");
    folder.write("long.csv", format!("x_m,y_m,yaw_rad\n1,{long},3\n"));
    error(&folder, "contains site.toml --task dock --poses long.csv");
}

/// The caret is below the fault even if the line has escaped characters before the fault.
#[test]
fn caret_is_below_the_fault_after_escaped_characters() {
    let folder = Folder::new();
    folder.write("bad.toml", "[table]\n\"\u{202e}\u{9b}\" = 1\n# last\n");
    let message = error(&folder, "check bad.toml");
    let mut lines = message.lines().skip_while(|line| !line.contains("2 │"));
    let (text, mark) = (lines.next().unwrap(), lines.next().unwrap());
    let column = |line: &str, what: &str| line.find(what).map(|at| line[..at].chars().count());
    assert_eq!(column(text, "\"\\u{202e}"), column(mark, "─"), "{message}");
    let length = "\"\\u{202e}\\u{9b}\"".chars().count();
    let marked = mark.chars().filter(|c| matches!(c, '─' | '┬')).count();
    assert_eq!(marked, length, "{message}");
    assert!(message.contains("bad.toml:2:1"), "{message}");
}

/// Hostile names, keys and contents in errors of every reader.
#[test]
fn error_with_hostile_names_is_printable() {
    let folder = Folder::new();
    let file = |name: &str| format!("{name}{HOSTILE}.toml");
    let sites = [
        format!("\"{QUOTED}\" = 1\n"),
        format!("[task.\"{QUOTED}\"]\nkind = \"work\"\n"),
        format!("[table]\nlayout = \"{QUOTED}\"\n"),
        format!("[task.t]\nkind = 1 # {HOSTILE}\n"),
        format!("{HOSTILE}\n"),
        format!("[import.x]\nfile = \"{QUOTED}\"\nformat = \"wpilib\"\n"),
        format!("[error_model.x]\nfile = \"{QUOTED}\"\n"),
        SAMPLE.replace("t7", &format!("\"{QUOTED}\"")),
    ];
    for (index, site) in sites.iter().enumerate() {
        let name = file(&index.to_string());
        folder.write(&name, site);
        let message = error(&folder, &format!("check {name}"));
        assert!(message.contains("\\u{1b}"), "{message}");
    }
    folder.write(
        "tasks.toml",
        SAMPLE.replace("[task.dock]", &format!("[task.\"{QUOTED}\"]")),
    );
    folder.write(
        "bad.csv",
        format!("{HOSTILE},x_m,y_m,yaw_rad\n1,2,{HOSTILE},4\n"),
    );
    folder.write(
        "bad.json",
        format!("{{\"tags\": [{{\"{QUOTED}\": 1}}], \"{HOSTILE}\": 1}}"),
    );
    folder.write("bad.yaml", format!("\"{QUOTED}\": 1\n"));
    for line in [
        "contains tasks.toml --task dock --poses -".to_owned(),
        format!("contains site.toml --task {HOSTILE} --poses -"),
        "contains site.toml --task dock --poses bad.csv".to_owned(),
        format!("chain site.toml --name {HOSTILE}"),
        format!("explain {HOSTILE}"),
        "gate dock.posegate --estimates bad.csv".to_owned(),
        format!("gate {HOSTILE} --estimates bad.csv"),
        format!("gate dock.posegate --nonsense {HOSTILE}"),
        format!("gate dock.posegate --set {HOSTILE}"),
        format!("gate dock.posegate --epsilon {HOSTILE}"),
        format!("site build site.toml -o b --shard {HOSTILE}"),
        HOSTILE.to_owned(),
        "import bad.json --format wpilib".to_owned(),
        "import bad.yaml --format nav2_docks".to_owned(),
        "import bad.yaml --format apriltag_ros --convention apriltag_ros".to_owned(),
        format!("import hall.json --format wpilib --pose {HOSTILE}"),
        "predict bad.yaml --at at.csv".to_owned(),
        format!("metrics {HOSTILE} truth.tum"),
        "metrics bad.csv truth.tum".to_owned(),
        "learn outcomes bad.csv --epsilon 0.9".to_owned(),
        format!("learn inflation scored.csv --epsilon 0.9 --condition {HOSTILE} -o m"),
        format!("place site.toml --task see-t7 --exact --free {HOSTILE}"),
        format!("place site.toml --task see-t7 --exact --wall {HOSTILE}"),
        "place site.toml --task see-t7 --exact --candidates bad.csv".to_owned(),
        "replay site.toml bad.csv --task dock".to_owned(),
        format!("replay site.toml estimates.csv --task dock --truth {HOSTILE}"),
        format!("report site.toml -o out --placement x={HOSTILE}"),
        format!("table build site.toml --task dock -o nowhere/{HOSTILE}"),
        format!("table seal bad.csv -o {HOSTILE}"),
        format!("site merge {HOSTILE}"),
        format!("init {HOSTILE} --nonsense"),
    ] {
        error(&folder, &line);
    }
}

/// Answers about a site with hostile names, as text and as JSON.
#[test]
fn answer_with_hostile_names_is_printable_and_valid_json() {
    let folder = Folder::new();
    // Names with control characters are refused; characters that change the direction of text are allowed.
    const NAME: &str = "a\u{202e}\u{2066}\u{200f}\u{feff}";
    const QUOTED: &str = "a\\u202E\\u2066\\u200F\\uFEFF";
    let name = format!("dock{NAME}");
    let quoted = format!("\"dock{QUOTED}\"");
    let text = SAMPLE
        .replace("task.dock", &format!("task.{quoted}"))
        .replace("task.see-t7", &format!("task.\"see{QUOTED}\""))
        .replace("tag.t7", &format!("tag.\"t7{QUOTED}\""))
        .replace("\"t7\"", &format!("\"t7{QUOTED}\""))
        .replace("tag36h11", QUOTED)
        .replace("camera.front", &format!("camera.\"{QUOTED}\""))
        .replace("\"front\"", &format!("\"{QUOTED}\""));
    folder.write("names.toml", text);
    folder.write(
        "docks.yaml",
        format!("docks:\n  \"{QUOTED}\": {{type: charger, frame: map, pose: [1.0, 2.0, 1.5]}}\n"),
    );
    let site = format!("site{HOSTILE}.toml");
    std::fs::copy(folder.path().join("names.toml"), folder.path().join(&site)).unwrap();
    for (index, line) in [
        "check names.toml".to_owned(),
        format!("check {site}"),
        "check names.toml --draw drawn".to_owned(),
        format!("table build names.toml --task {name} -o table{HOSTILE}"),
        format!("table info table{HOSTILE}"),
        format!("table verify table{HOSTILE} names.toml"),
        "import docks.yaml --format nav2_docks".to_owned(),
        format!("init new{HOSTILE}.toml"),
        "report names.toml -o page.html".to_owned(),
        format!("draw names.toml --task {name} -o picture.svg"),
        format!("table export table{HOSTILE} --format c -o table.h"),
        format!("table export table{HOSTILE} --format rust -o table.rs"),
    ]
    .into_iter()
    .enumerate()
    {
        let (code, out, err) = run(&folder, &line);
        assert!(matches!(code, Some(0 | 1)), "{line:?}: {err}");
        shown(&out);
        shown(&err);
        let command = line.split(' ').next();
        if matches!(command, Some("report" | "draw")) {
            continue;
        }
        let force = match command {
            Some("init") => " --force",
            _ => "",
        };
        let json = format!("{line} --json{force}");
        let (code, out, err) = run(&folder, &json);
        assert!(matches!(code, Some(0 | 1)), "{json:?}: {err}");
        shown(&out);
        let value: serde_json::Value = serde_json::from_str(&out).unwrap();
        if index == 0 {
            assert_eq!(value["tasks"][0]["task"], name.as_str());
        }
    }
    // The imported tables on standard output are parsed again, name by name.
    let (_, out, _) = run(&folder, "import docks.yaml --format nav2_docks");
    let tables: toml::Table = out.parse().unwrap();
    assert!(tables["goal"].get(NAME).is_some(), "{out}");
    // Pictures and pages name tasks and tags, and have no characters that XML forbids.
    let mut files = vec![
        "picture.svg".into(),
        "page.html".into(),
        "table.h".into(),
        "table.rs".into(),
    ];
    for entry in std::fs::read_dir(folder.path().join("drawn")).unwrap() {
        files.push(format!(
            "drawn/{}",
            entry.unwrap().file_name().to_str().unwrap()
        ));
    }
    for file in files {
        let text = std::fs::read_to_string(folder.path().join(&file)).unwrap();
        let raw = text
            .chars()
            .find(|c| c.is_control() && !matches!(c, '\n' | '\t'));
        assert_eq!(raw, None, "{file}");
    }
}

/// A panic that the system causes: threads cannot be created.
#[test]
fn panic_in_main_is_one_line_and_exit_code_3() {
    let folder = Folder::new();
    let line = ["table", "build", "site.toml", "--task", "dock", "-o", "out"];
    let Output { status, stderr, .. } = folder
        .command(&line)
        .env("RUST_MIN_STACK", "70000000000000")
        .output()
        .unwrap();
    let error = String::from_utf8(stderr).unwrap();
    assert_eq!(status.code(), Some(3), "{error}");
    assert!(
        error.lines().count() == 1 && error.contains("please report it"),
        "{error}"
    );
    assert!(!folder.path().join("out").exists());
}

/// Lists keep their line ends.
#[test]
fn message_of_several_lines_keeps_its_lines() {
    let folder = Folder::new();
    std::fs::remove_dir_all(folder.path().join("built/parts")).unwrap();
    std::fs::create_dir(folder.path().join("built/parts")).unwrap();
    let build = "site build site.toml --tables-only --shard 0/2 -o built";
    assert_eq!(run(&folder, build).0, Some(0));
    let message = error(&folder, "site merge built");
    assert!(
        !message.contains("\\n") && message.lines().count() > 2,
        "{message}"
    );
}
