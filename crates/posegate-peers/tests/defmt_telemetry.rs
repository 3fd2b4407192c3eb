//! The firmware of `examples/defmt_telemetry.rs` in QEMU logs over semihosting. The log is decoded with the strings of its
//! ELF file and must equal `tests/data/defmt.txt`. A second test checks the source: every public type of the core
//! can be logged.
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

/// Returns the bytes that a firmware logs until it ends.
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

/// Returns the log as text, one line per message, with time and level.
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
fn controller_log_is_decoded_on_host() {
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
        "POSEGATE_BLESS=1 rewrites {EXPECTED}:\n{text}"
    );
    // The strings stay in the ELF file.
    assert!(
        bytes.len() * 3 < text.len(),
        "{} {}",
        bytes.len(),
        text.len()
    );
    // The log must contain these, whatever the format.
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

/// A public type of a core module, and its module.
struct Type {
    name: String,
    place: String,
    can_be_logged: bool,
}

/// Returns the core modules of `src/lib.rs`.
fn core_modules() -> Vec<String> {
    let text = std::fs::read_to_string(at_root("src/lib.rs")).unwrap();
    let (core, _) = text.split_once("std line").unwrap();
    let modules = core
        .lines()
        .filter_map(|line| line.strip_prefix("pub mod "));
    modules
        .map(|module| module.trim_end_matches(';').to_owned())
        .collect()
}

/// Returns the types of a file that other crates can name: all types of a public module, and the re-exported ones of a
/// private module. `published` is the parent's text, or `None` if the module is public.
fn types(place: &str, text: &str, published: Option<&str>) -> Vec<Type> {
    let lines: Vec<&str> = text.lines().collect();
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
        if attributes.clone().any(|line| *line == "#[cfg(test)]") {
            continue;
        }
        let derived = attributes
            .into_iter()
            .any(|line| line.contains(r#"feature = "defmt""#) && line.contains("defmt::Format"));
        let implemented = text
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

/// Returns every public type of the core.
fn public_types() -> Vec<Type> {
    let mut found = Vec::new();
    for module in core_modules() {
        let file = at_root(&format!("src/{module}.rs"));
        let folder = at_root(&format!("src/{module}"));
        let head = if file.is_file() {
            file
        } else {
            folder.join("mod.rs")
        };
        let head_text = std::fs::read_to_string(&head).unwrap();
        found.extend(types(&module, &head_text, None));
        let Ok(entries) = std::fs::read_dir(&folder) else {
            continue;
        };
        for entry in entries {
            let path = entry.unwrap().path();
            let child = path.file_stem().unwrap().to_str().unwrap().to_owned();
            let is_source = path.extension().is_some_and(|e| e == "rs");
            let of_host = format!("#[cfg(feature = \"std\")]\npub mod {child};");
            let is_other = child == "mod" || child == "tests" || head_text.contains(&of_host);
            if !is_source || is_other {
                continue;
            }
            let text = std::fs::read_to_string(&path).unwrap();
            let is_public = head_text.contains(&format!("pub mod {child};"));
            let published = (!is_public).then_some(head_text.as_str());
            found.extend(types(&format!("{module}::{child}"), &text, published));
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
fn type_without_defmt_format_is_detected() {
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
    let names = |text: &str, published| -> Vec<(String, bool)> {
        let found = types("", text, published).into_iter();
        found.map(|t| (t.name, t.can_be_logged)).collect()
    };
    let pair = |name: &str, logged| (name.to_owned(), logged);
    let through = [pair("Seen", true), pair("Both", false)];
    assert_eq!(names(text, Some(parent)), through);
    let all = [
        pair("Seen", true),
        pair("Both", false),
        pair("Hidden", false),
    ];
    assert_eq!(names(text, None), all);
    let by_hand = text.replace(
        "pub struct Hidden",
        "impl defmt::Format for Both<'_> {}\npub struct Hidden",
    );
    assert_eq!(names(&by_hand, Some(parent))[1], pair("Both", true));
}
