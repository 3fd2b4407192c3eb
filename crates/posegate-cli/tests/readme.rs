//! The README and the pages of `docs` are correct. The README's Rust code is in an example that runs, the lines of
//! site files are valid, and the named files and jobs exist.

use std::path::PathBuf;

fn root() -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))
}

fn read(path: &str) -> String {
    std::fs::read_to_string(root().join(path)).unwrap()
}

/// Returns the fenced blocks of a language.
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
fn readme_code_is_in_an_example() {
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

/// Returns the paths of the README, the pages of `docs` and the pages for contributors.
fn documents() -> Vec<String> {
    let mut found: Vec<String> = ["README.md", "ARCHITECTURE.md", "CONTRIBUTING.md"]
        .map(String::from)
        .into();
    for entry in std::fs::read_dir(root().join("docs")).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        if name.ends_with(".md") {
            found.push(format!("docs/{name}"));
        }
    }
    assert!(found.len() >= 9, "{found:?}");
    found
}

#[test]
fn readme_is_short() {
    assert!(
        read("README.md").lines().count() <= 150,
        "the README has at most 150 lines: move what is long to a page of docs/"
    );
}

#[test]
fn documented_site_files_are_valid() {
    let shown = blocks(&read("docs/host.md"), "toml");
    let site = shown
        .iter()
        .find(|block| block.contains("[task.dock]"))
        .unwrap();
    let site = posegate_site::Site::parse(site, "docs/host.md").unwrap();
    assert!(site.table_spec(site.task("dock").unwrap()).is_some());
}

/// Returns the paths of the repository that a text names, including links from a page of `docs`.
fn paths(text: &str) -> Vec<&str> {
    let words = text.split(|c: char| c.is_whitespace() || "()`,:;#[]".contains(c));
    let of_repository = |word: &&str| {
        [
            "src/",
            "tests/",
            "examples/",
            "benches/",
            "docs/",
            "include/",
            "crates/",
        ]
        .iter()
        .any(|start| word.starts_with(start))
    };
    words
        .map(|word| word.trim_start_matches("../").trim_end_matches('.'))
        .filter(of_repository)
        .collect()
}

#[test]
fn named_files_exist() {
    for document in documents() {
        let text = read(&document);
        let found = paths(&text);
        for path in &found {
            assert!(root().join(path).exists(), "{document}: {path}");
        }
        assert!(found.len() >= 3, "{document}");
    }
}

/// Every job that a document names is in the list of `cargo xtask`.
#[test]
fn named_jobs_exist() {
    let list = read("xtask/src/main.rs");
    let (_, list) = list.split_once("const JOBS").unwrap();
    let jobs: Vec<&str> = list
        .split("job(")
        .skip(1)
        .filter_map(|rest| rest.split('"').nth(1))
        .collect();
    assert!(jobs.len() >= 30, "{jobs:?}");
    let more = [".ci/run", "examples/README.md", "src/gate/assumptions.md"].map(String::from);
    let mut named = 0;
    for document in documents().into_iter().chain(more) {
        let text = read(&document);
        for call in ["./ci.sh ", "cargo xtask "] {
            for part in text.split(call).skip(1) {
                let job: String = part
                    .chars()
                    .take_while(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || *c == '_')
                    .collect();
                assert!(
                    job.is_empty() || jobs.contains(&job.as_str()),
                    "{document}: {job}"
                );
                named += usize::from(!job.is_empty());
            }
        }
    }
    assert!(named >= 40, "{named}");
}

/// Types and functions that a step of CONTRIBUTING.md names in code are in a file that the same step names.
#[test]
fn names_of_a_step_are_in_its_files() {
    let text = read("CONTRIBUTING.md");
    let mut steps: Vec<String> = Vec::new();
    for line in text.lines() {
        let is_step = line.starts_with(|c: char| c.is_ascii_digit());
        if is_step {
            steps.push(String::new());
        } else if !line.starts_with("   ") {
            continue;
        }
        if let Some(step) = steps.last_mut() {
            step.push_str(line);
            step.push('\n');
        }
    }
    assert!(steps.len() >= 15, "{}", steps.len());
    let mut names = 0;
    for step in &steps {
        let there: String = paths(step)
            .into_iter()
            .filter(|path| root().join(path).is_file())
            .map(read)
            .collect();
        for span in step.split('`').skip(1).step_by(2) {
            let is_name = |c: char| c.is_ascii_alphanumeric() || c == '_';
            let simple = span.strip_suffix("()").unwrap_or(span);
            let is_code = simple.starts_with(|c: char| c.is_ascii_uppercase())
                || simple.contains("::")
                || span.ends_with("()");
            if !is_code || !simple.chars().all(|c| is_name(c) || c == ':') {
                continue;
            }
            for name in simple.split("::").filter(|name| !name.is_empty()) {
                let is_named = there.split(|c| !is_name(c)).any(|word| word == name);
                assert!(
                    is_named,
                    "`{name}` is in no file that this step names: {step}"
                );
                names += 1;
            }
        }
    }
    assert!(names >= 20, "{names}");
}

/// The crate's page names every feature, and no other.
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
    let mut documented: Vec<&str> = library
        .lines()
        .filter_map(|line| line.strip_prefix("//! | `")?.split_once("` |"))
        .map(|(name, _)| name)
        .collect();
    there.sort_unstable();
    documented.sort_unstable();
    assert_eq!(documented, there);
}

/// The front page of the API documents replaces each link of the README to a file, and shows the README's picture.
#[test]
fn front_page_has_no_link_to_a_file() {
    let readme = read("README.md");
    assert!(
        !readme.contains("](docs/") && !readme.contains("](examples/"),
        "write links to files as `[text][name]`, with `[name]: path` at the end: the front page replaces them"
    );
    let library = read("src/lib.rs");
    let mut links = 0;
    for line in readme.lines() {
        let Some((name, _)) = line
            .strip_prefix('[')
            .and_then(|rest| rest.split_once("]: "))
        else {
            continue;
        };
        let is_replaced = library
            .lines()
            .any(|line| line.starts_with(&format!("//! [{name}]: ")));
        assert!(
            is_replaced || name == "first-picture",
            "src/lib.rs does not say where `{name}` leads on its pages"
        );
        links += 1;
    }
    assert!(links >= 10, "{links}");
}

#[test]
fn front_page_picture_equals_the_readme_picture() {
    let definition = read("docs/first-picture.uri");
    let text = definition
        .strip_prefix("[first-picture]: data:image/svg+xml,")
        .unwrap()
        .trim_end();
    let mut picture = Vec::new();
    let mut rest = text;
    while let Some(letter) = rest.chars().next() {
        if letter == '%' {
            picture.push(u8::from_str_radix(&rest[1..3], 16).unwrap());
            rest = &rest[3..];
        } else {
            assert!(
                letter.is_ascii_graphic() && !"()<>\"#".contains(letter),
                "{letter}"
            );
            picture.push(letter as u8);
            rest = &rest[1..];
        }
    }
    assert!(
        picture == std::fs::read(root().join("docs/first-picture.svg")).unwrap(),
        "docs/first-picture.uri is docs/first-picture.svg with all but letters, digits and `-._~/:;=,?!+*&'` as %XX"
    );
}
