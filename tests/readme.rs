//! The README says what is so: its lines of Rust are those of an example that runs, its site lines
//! are valid, and its reasons and files exist.
#![cfg(feature = "std")]

use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

fn read(path: &str) -> String {
    std::fs::read_to_string(root().join(path)).unwrap()
}

/// The fenced blocks of a language.
fn blocks(text: &str, language: &str) -> Vec<String> {
    let mut blocks = Vec::new();
    let mut open: Option<String> = None;
    for line in text.lines() {
        match &mut open {
            Some(_) if line == "```" => blocks.extend(open.take()),
            Some(block) => {
                block.push_str(line);
                block.push('\n');
            }
            None if line == format!("```{language}") => open = Some(String::new()),
            None => {}
        }
    }
    blocks
}

#[test]
fn the_rust_of_the_readme_is_the_examples() {
    let example = read("examples/may_dock.rs");
    let lines = example
        .split("// readme: begin\n")
        .nth(1)
        .and_then(|rest| rest.split("// readme: end").next())
        .unwrap();
    let shown = blocks(&read("README.md"), "rust");
    assert_eq!(shown.len(), 1);
    assert_eq!(
        shown[0], lines,
        "copy the lines of examples/may_dock.rs into the README"
    );
}

#[test]
fn the_site_of_the_readme_is_valid() {
    let shown = blocks(&read("README.md"), "toml");
    let site = shown
        .iter()
        .find(|block| block.contains("[task.dock]"))
        .unwrap();
    let site = posegate::site::Site::parse(site, "README.md").unwrap();
    assert!(site.table_spec(site.task("dock").unwrap()).is_some());
}

#[test]
fn the_files_of_the_documents_exist() {
    for document in ["README.md", "ARCHITECTURE.md"] {
        let text = read(document);
        let mut seen = 0;
        for word in text.split(|c: char| c.is_whitespace() || "()`,:;".contains(c)) {
            let is_path = ["src/", "tests/", "examples/"]
                .iter()
                .any(|start| word.starts_with(start));
            if is_path {
                assert!(Path::new(&root().join(word)).exists(), "{document}: {word}");
                seen += 1;
            }
        }
        assert!(seen >= 3, "{document}");
    }
}

/// Every job that a document names is a job of `ci.sh`.
#[test]
fn the_jobs_of_the_documents_exist() {
    let jobs = read("ci.sh");
    for document in ["README.md", "ARCHITECTURE.md", ".ci/run"] {
        for part in read(document).split("./ci.sh ").skip(1) {
            let job: String = part
                .chars()
                .take_while(|c| c.is_ascii_alphabetic() || *c == '_')
                .collect();
            assert!(
                job.is_empty() || jobs.contains(&format!("job_{job}()")),
                "{document}: {job}"
            );
        }
    }
}

/// The crate's page names every feature, and none that is not there.
#[test]
fn every_feature_is_documented() {
    let manifest = read("Cargo.toml");
    let features = manifest.split("\n[features]\n").nth(1).unwrap();
    let features = features.split("\n[").next().unwrap();
    let mut there: Vec<&str> = features
        .lines()
        .filter_map(|line| line.split_once(" = ["))
        .map(|(name, _)| name)
        .filter(|name| *name != "default")
        .collect();
    let library = read("src/lib.rs");
    let mut told: Vec<&str> = library
        .lines()
        .filter_map(|line| line.strip_prefix("//! | `")?.split_once("` |"))
        .map(|(name, _)| name)
        .collect();
    there.sort_unstable();
    told.sort_unstable();
    assert_eq!(told, there);
}
