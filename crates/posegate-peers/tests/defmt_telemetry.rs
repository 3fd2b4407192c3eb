//! The firmware of `examples/defmt_telemetry.rs` in QEMU: what it logs over semihosting is decoded here,
//! with the names that its ELF file holds, and compared with `tests/data/defmt.txt` word for word. And a
//! look at the source: every public type of the core can be logged.
//!
//! `POSEGATE_BLESS=1 cargo test -p posegate-peers --test defmt_telemetry` rewrites the text.

use posegate_testkit::firmware;

use defmt_decoder::{DecodeError, Table};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

const EXPECTED: &str = "tests/data/defmt.txt";

fn at_root(path: &str) -> PathBuf {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join(path)
}

/// The bytes that a firmware logs until it ends.
fn logged(elf: &Path) -> Vec<u8> {
    let output = Command::new("qemu-system-arm")
        .args(["-M", "mps2-an386", "-display", "none", "-monitor", "none"])
        .args(["-serial", "none"])
        .args(["-semihosting-config", "enable=on,target=native", "-kernel"])
        .arg(elf)
        .stdin(Stdio::null())
        .output()
        .unwrap_or_else(|e| panic!("qemu-system-arm: {e}: apt-get install -y qemu-system-arm"));
    assert!(output.status.success(), "{output:?}");
    output.stdout
}

/// What they say: a line each, with time and level.
fn decoded(elf: &Path, bytes: &[u8]) -> String {
    let elf = std::fs::read(elf).expect("the firmware");
    let table = Table::parse(&elf)
        .expect("a table")
        .expect("defmt's strings");
    let mut decoder = table.new_stream_decoder();
    decoder.received(bytes);
    let mut text = String::new();
    loop {
        match decoder.decode() {
            Ok(frame) => {
                let time = frame.display_timestamp().expect("a time");
                let level = frame.level().expect("a level");
                text += &format!("{time} {} {}\n", level.as_str(), frame.display_message());
            }
            Err(DecodeError::UnexpectedEof) => return text,
            Err(DecodeError::Malformed) => panic!("malformed after:\n{text}"),
        }
    }
}

#[test]
fn what_a_controller_logs_is_read_on_the_host() {
    let elf = firmware::build_with("defmt_telemetry", "firmware,defmt");
    let bytes = logged(&elf);
    let text = decoded(&elf, &bytes);
    let path = at_root(EXPECTED);
    if std::env::var_os("POSEGATE_BLESS").is_some_and(|value| value == "1") {
        std::fs::write(&path, &text).expect("the text is written");
    }
    let expected = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{EXPECTED}: {e}"));
    assert!(
        text == expected,
        "POSEGATE_BLESS=1 writes {EXPECTED} anew:\n{text}"
    );
    // Words stay in the ELF file.
    assert!(
        bytes.len() * 3 < text.len(),
        "{} {}",
        bytes.len(),
        text.len()
    );
    // What it must speak of, whatever the words.
    for word in [
        "Report {",
        "PoseEstimate {",
        "Step {",
        "Permission {",
        "Permit {",
        "Deny {",
        "NotContained",
        "Permitted",
        "Qualifying(2)",
        "Inhibited(Silent)",
        "PoseSet {",
        "CovarianceZero",
        "Telemetry {",
        "Settings {",
        "Table {",
        "Interlock {",
        "Evaluator {",
        "LookAtTag(7)",
        "NaN",
    ] {
        assert!(text.contains(word), "{word}");
    }
}

/// A public type of a core module, and where it is.
struct Type {
    name: String,
    place: String,
    can_be_logged: bool,
}

/// The core modules of `src/lib.rs`.
fn core_rooms() -> Vec<String> {
    let text = std::fs::read_to_string(at_root("src/lib.rs")).unwrap();
    let (core, _) = text.split_once("std line").unwrap();
    let rooms = core
        .lines()
        .filter_map(|line| line.strip_prefix("pub mod "));
    rooms
        .map(|room| room.trim_end_matches(';').to_owned())
        .collect()
}

/// The types of a file that can be named from outside: all of a public module's, and of a private one what
/// its parent publishes. `published` is the parent's text, or nothing where the module is public.
fn types(place: &str, text: &str, published: Option<&str>) -> Vec<Type> {
    let code = text.split("#[cfg(test)]").next().unwrap_or_default();
    let lines: Vec<&str> = code.lines().collect();
    let mut types = Vec::new();
    for (index, line) in lines.iter().enumerate() {
        let Some(rest) = ["pub struct ", "pub enum ", "pub union "]
            .iter()
            .find_map(|start| line.strip_prefix(start))
        else {
            continue;
        };
        let is_name = |c: char| c.is_alphanumeric() || c == '_';
        let name: String = rest.chars().take_while(|c| is_name(*c)).collect();
        let named = |text: &str| text.split(|c| !is_name(c)).any(|word| word == name);
        let public = |text: &str| {
            let uses = text.split("pub use ").skip(1);
            uses.filter_map(|rest| rest.split(';').next()).any(named)
        };
        if !published.is_none_or(public) {
            continue;
        }
        let attributes = lines[..index]
            .iter()
            .rev()
            .take_while(|line| line.starts_with("#[") || line.starts_with("///"));
        let derived = attributes
            .into_iter()
            .any(|line| line.contains(r#"feature = "defmt""#) && line.contains("defmt::Format"));
        let implemented = code
            .split("defmt::Format for ")
            .skip(1)
            .any(|rest| rest.chars().take_while(|c| is_name(*c)).eq(name.chars()));
        types.push(Type {
            name,
            place: place.to_owned(),
            can_be_logged: derived || implemented,
        });
    }
    types
}

/// Every public type of the core.
fn public_types() -> Vec<Type> {
    let mut found = Vec::new();
    for room in core_rooms() {
        let file = at_root(&format!("src/{room}.rs"));
        let folder = at_root(&format!("src/{room}"));
        let head = if file.is_file() {
            file
        } else {
            folder.join("mod.rs")
        };
        let head_text = std::fs::read_to_string(&head).unwrap();
        found.extend(types(&room, &head_text, None));
        let Ok(entries) = std::fs::read_dir(&folder) else {
            continue;
        };
        for entry in entries {
            let path = entry.unwrap().path();
            let module = path.file_stem().unwrap().to_str().unwrap().to_owned();
            let is_source = path.extension().is_some_and(|e| e == "rs");
            if !is_source || module == "mod" || module == "tests" {
                continue;
            }
            let text = std::fs::read_to_string(&path).unwrap();
            let is_public = head_text.contains(&format!("pub mod {module};"));
            let published = (!is_public).then_some(head_text.as_str());
            found.extend(types(&format!("{room}::{module}"), &text, published));
        }
    }
    found
}

#[test]
fn every_public_type_of_the_core_can_be_logged() {
    let types = public_types();
    assert!(types.len() >= 50, "{}", types.len());
    for known in [
        "Gate",
        "Interlock",
        "Verdict",
        "PoseSet",
        "Table",
        "Report",
        "Telemetry",
        "VisionPositionEstimate",
    ] {
        assert!(types.iter().any(|found| found.name == known), "{known}");
    }
    let silent = types.iter().filter(|found| !found.can_be_logged);
    let silent: Vec<_> = silent
        .map(|found| format!("{}::{}", found.place, found.name))
        .collect();
    assert!(silent.is_empty(), "without defmt::Format: {silent:?}");
}

#[test]
fn a_type_that_cannot_be_logged_is_seen() {
    let parent = "mod a;\npub use self::a::{Seen, Both};\n";
    let text = "
#[derive(Debug)]
#[cfg_attr(feature = \"defmt\", derive(defmt::Format))]
pub struct Seen(u8);

/// Words.
#[derive(Debug)]
pub enum Both<'a> {}

pub struct Hidden;

#[cfg(test)]
pub struct Test;
";
    let told = |text: &str, published| -> Vec<(String, bool)> {
        let found = types("", text, published).into_iter();
        found.map(|t| (t.name, t.can_be_logged)).collect()
    };
    let pair = |name: &str, logged| (name.to_owned(), logged);
    let through = [pair("Seen", true), pair("Both", false)];
    assert_eq!(told(text, Some(parent)), through);
    let all = [
        pair("Seen", true),
        pair("Both", false),
        pair("Hidden", false),
    ];
    assert_eq!(told(text, None), all);
    let by_hand = text.replace(
        "pub struct Hidden",
        "impl defmt::Format for Both<'_> {}\npub struct Hidden",
    );
    assert_eq!(told(&by_hand, Some(parent))[1], pair("Both", true));
}
