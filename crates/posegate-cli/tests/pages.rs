//! The pages for users are correct: each linked file exists, and the names in a sentence that links a program are in
//! that program.

use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))
}

/// Returns the paths of the README, the pages of `docs`, the pages for contributors, and the list of examples.
fn pages() -> Vec<PathBuf> {
    let mut pages: Vec<PathBuf> = [
        "README.md",
        "ARCHITECTURE.md",
        "CONTRIBUTING.md",
        "examples/README.md",
    ]
    .map(|page| root().join(page))
    .into();
    for entry in std::fs::read_dir(root().join("docs")).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|ending| ending == "md") {
            pages.push(path);
        }
    }
    assert!(pages.len() >= 10, "{pages:?}");
    pages
}

/// Parts of a controller: if a sentence names one, a program that it links must name it, too.
const PARTS: [&str; 3] = ["interrupt", "watchdog", "heartbeat"];

/// Returns the sentences of a page, including those of table rows, without fenced blocks. A full stop within code does not
/// end a sentence.
fn sentences(text: &str) -> Vec<String> {
    let mut sentences = vec![String::new()];
    let mut fenced = false;
    for line in text.lines() {
        if line.starts_with("```") {
            fenced = !fenced;
        }
        if fenced
            || line.starts_with("```")
            || line.trim().is_empty()
            || line.starts_with(['|', '#'])
        {
            sentences.push(String::new());
        }
        if fenced || line.starts_with("```") {
            continue;
        }
        let mut code = false;
        let mut letters = line.chars().peekable();
        while let Some(letter) = letters.next() {
            code ^= letter == '`';
            sentences.last_mut().unwrap().push(letter);
            if letter == '.' && !code && letters.peek().is_none_or(|next| *next == ' ') {
                sentences.push(String::new());
            }
        }
        sentences.last_mut().unwrap().push(' ');
    }
    sentences.retain(|sentence| !sentence.trim().is_empty());
    sentences
}

/// Returns the links of a text to files, also those at its end (`[name]: file`).
fn links(text: &str) -> Vec<&str> {
    let inline = text
        .split("](")
        .skip(1)
        .filter_map(|rest| rest.split(')').next());
    let named = text
        .lines()
        .filter_map(|line| line.strip_prefix('[')?.split_once("]: "))
        .map(|(_, link)| link);
    inline
        .chain(named)
        .map(|link| link.split('#').next().unwrap_or(link))
        .filter(|link| !link.is_empty() && !link.contains("://"))
        .collect()
}

/// Returns functions that a sentence names in code: C functions by their prefix, Rust functions as `Type::function` or
/// `function()`.
fn functions(sentence: &str) -> Vec<String> {
    let mut found = Vec::new();
    for span in sentence.split('`').skip(1).step_by(2) {
        let is_name = |c: char| c.is_ascii_alphanumeric() || c == '_';
        let words = span.split(|c| !is_name(c)).filter(|word| !word.is_empty());
        found.extend(
            words
                .filter(|word| word.starts_with("posegate_"))
                .map(str::to_string),
        );
        let call = span.split('(').next().unwrap_or("");
        if let Some((path, name)) = call.rsplit_once("::") {
            found.push(name.to_string());
            // Its type: modules need not be named at its use.
            let of = path.rsplit("::").next().unwrap_or("");
            if of.starts_with(|c: char| c.is_ascii_uppercase()) {
                found.push(of.to_string());
            }
        } else if span.contains('(') && !call.is_empty() && call.chars().all(is_name) {
            found.push(call.to_string());
        }
    }
    found
}

/// Returns `true` if a text contains a name as a whole word.
fn has_word(text: &str, name: &str) -> bool {
    text.split(|c: char| !(c.is_ascii_alphanumeric() || c == '_'))
        .any(|word| word == name)
}

/// Returns the faults of a page in a folder.
fn faults(text: &str, folder: &Path) -> Vec<String> {
    let mut faults = Vec::new();
    for link in links(text) {
        if !folder.join(link).exists() {
            faults.push(format!("{link}: no such file"));
        }
    }
    for sentence in sentences(text) {
        let programs: Vec<PathBuf> = links(&sentence)
            .iter()
            .map(|link| folder.join(link))
            .filter(|path| {
                path.extension()
                    .is_some_and(|ending| ["c", "h", "rs"].iter().any(|e| ending == *e))
            })
            .collect();
        if programs.is_empty() {
            continue;
        }
        let texts: Vec<String> = programs
            .iter()
            .map(|path| std::fs::read_to_string(path).unwrap_or_default())
            .collect();
        for name in functions(&sentence) {
            if !texts.iter().any(|text| has_word(text, &name)) {
                faults.push(format!("`{name}` is not in the linked files: {sentence}"));
            }
        }
        for part in PARTS
            .iter()
            .filter(|part| sentence.to_lowercase().contains(**part))
        {
            if !texts.iter().any(|text| text.to_lowercase().contains(part)) {
                faults.push(format!("there is no {part} in what this links: {sentence}"));
            }
        }
    }
    faults
}

#[test]
fn pages_name_only_what_their_programs_contain() {
    for page in pages() {
        let text = std::fs::read_to_string(&page).unwrap();
        let faults = faults(&text, page.parent().unwrap());
        assert!(
            faults.is_empty(),
            "{}:\n{}",
            page.display(),
            faults.join("\n")
        );
    }
}

/// The check finds a missing function, a missing part and a missing file, and reports no fault in a correct page.
#[test]
fn fault_of_a_page_is_found() {
    let folder = root().join("docs");
    let right = "[a gate](../examples/c/docking_gate.c) calls `posegate_gate_step(..) == X` once. It has no link, and `posegate_none`.";
    assert_eq!(faults(right, &folder), Vec::<String>::new());
    for (wrong, fault) in [
        (
            "[a gate](../examples/c/docking_gate.c) calls\n`posegate_gate_reset` once.",
            "`posegate_gate_reset`",
        ),
        // A page that calls a bench a gate.
        (
            "[the smallest program](../examples/c/estimate_bench.c): `posegate_gate_init` once, and the output driven.",
            "`posegate_gate_init`",
        ),
        (
            "| [gate](../examples/docking_gate.rs) | with `Evaluator::permits` |",
            "`Evaluator`",
        ),
        (
            "[a gate](../examples/c/controller.c): a watchdog.",
            "no watchdog",
        ),
        ("[a gate](../examples/c/none.c)", "no such file"),
    ] {
        let found = faults(wrong, &folder);
        assert!(
            found.len() == 1 && found[0].contains(fault),
            "{wrong}: {found:?}"
        );
    }
}
