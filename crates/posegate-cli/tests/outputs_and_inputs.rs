//! No output replaces an input of the same command: not directly, not through a link of either kind, not by another spelling of its path.
//! The tests cover all subcommands with all of their arguments that name files.
#![cfg(unix)]

use posegate_testkit::{commands, counts};

use commands::{
    DEMO, Folder, LINES, NAMED_BY_SITE, Role, arguments, code_of, file_of, filled, listed,
};
use std::collections::BTreeMap;
use std::fs;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};

type Snapshot = BTreeMap<PathBuf, Vec<u8>>;

/// Runs a command that must be refused and must change nothing.
fn refused(folder: &Folder, line: &[String], what: &str) {
    let before = folder.snapshot();
    let output = folder.run(line);
    let error = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{what}: {line:?}: {error}");
    let words = error.split_whitespace().filter(|word| *word != "│");
    let words = words.collect::<Vec<_>>().join(" ");
    assert!(words.contains("the same file"), "{what}: {line:?}: {error}");
    assert!(
        folder.snapshot() == before,
        "{what}: {line:?} changed something"
    );
}

/// Returns the inputs of a line with the fixture's file for each, including files that its site file names.
fn inputs(leaf: &str, line: &str) -> Vec<(Option<String>, &'static str)> {
    let all = arguments(leaf, line);
    let of_role = all.into_iter().filter(|(_, role)| *role == Role::Input);
    let mut inputs: Vec<_> = of_role
        .map(|(name, _)| (Some(name.clone()), file_of(leaf, &name)))
        .collect();
    if inputs.iter().any(|(_, file)| *file == "site.toml") {
        inputs.extend(NAMED_BY_SITE.map(|file| (None, file)));
    }
    inputs
}

#[test]
fn every_leaf_and_every_argument_has_a_command() {
    let listed = listed();
    assert!(listed.len() > 30, "{listed:?}");
    for (leaf, all) in &listed {
        let lines = || LINES.iter().chain([&DEMO]).filter(|(of, _)| of == leaf);
        assert!(
            lines().count() > 0,
            "{leaf}: add a command to crates/posegate-testkit/src/commands.rs"
        );
        for (argument, _) in all {
            let braces = format!("{{{argument}}}");
            let found = lines().any(|(_, line)| line.contains(&braces));
            assert!(
                found,
                "{leaf} {argument}: add it to a command of crates/posegate-testkit/src/commands.rs"
            );
        }
    }
}

/// The unchanged commands succeed; otherwise their refusal would prove nothing.
#[test]
fn every_command_writes_its_outputs() {
    for (leaf, line) in LINES {
        let folder = Folder::new();
        let output = folder.run(&filled(leaf, line, &[]));
        assert_eq!(
            output.status.code(),
            Some(code_of(leaf)),
            "{line}: {output:?}"
        );
        for (argument, role) in arguments(leaf, line) {
            if role == Role::Output {
                let path = folder.path().join(format!("out-{argument}"));
                assert!(
                    path.metadata().is_ok_and(|data| data.len() > 0),
                    "{line}: {argument}"
                );
            }
        }
    }
}

#[test]
fn no_output_file_replaces_an_input() {
    let (skipped, step) = counts::part(4);
    let mut pairs = 0;
    for (leaf, line) in LINES {
        for (output, role) in arguments(leaf, line) {
            if role != Role::Output {
                continue;
            }
            for (_, input) in inputs(leaf, line) {
                pairs += 1;
                if pairs % step != skipped {
                    continue;
                }
                let folder = Folder::new();
                let at = |name: &str| folder.path().join(name);
                fs::create_dir(at("sub")).unwrap();
                symlink(input, at("soft")).unwrap();
                symlink("../soft", at("sub/twice")).unwrap();
                symlink(folder.path(), at("sub/up")).unwrap();
                fs::hard_link(at(input), at("hard")).unwrap();
                let absolute = at(input).display().to_string();
                let spelled = [
                    input.to_string(),
                    format!("./sub/../{input}"),
                    absolute,
                    format!("sub/up/{input}"),
                    "soft".into(),
                    "sub/twice".into(),
                    "hard".into(),
                ];
                for name in &spelled {
                    let line = filled(leaf, line, &[(&output, name)]);
                    refused(&folder, &line, &format!("{leaf} {output} on {input}"));
                }
            }
        }
    }
    assert!(pairs > 60, "{pairs}");
}

/// An input through a link is protected like the target of the link.
#[test]
fn input_through_a_link_is_not_replaced() {
    let folder = Folder::new();
    symlink("site.toml", folder.path().join("soft")).unwrap();
    let line = [
        "table",
        "build",
        "soft",
        "--task",
        "dock",
        "-o",
        "site.toml",
    ];
    refused(&folder, &line.map(String::from), "table build");
}

#[test]
fn two_outputs_to_one_file_are_refused() {
    let mut pairs = 0;
    for (leaf, line) in LINES {
        let all = arguments(leaf, line);
        let outputs: Vec<_> = all
            .iter()
            .filter(|(_, role)| *role == Role::Output)
            .collect();
        for (index, (one, _)) in outputs.iter().enumerate() {
            for (other, _) in &outputs[index + 1..] {
                let folder = Folder::new();
                let at = |name: &str| folder.path().join(name);
                fs::create_dir(at("sub")).unwrap();
                fs::write(at("there"), "old").unwrap();
                symlink("there", at("soft")).unwrap();
                fs::hard_link(at("there"), at("hard")).unwrap();
                for pair in [
                    ["new", "sub/../new"],
                    ["new", "new"],
                    ["there", "soft"],
                    ["there", "hard"],
                    ["-", "-"],
                ] {
                    let given = [(one.as_str(), pair[0]), (other.as_str(), pair[1])];
                    refused(&folder, &filled(leaf, line, &given), leaf);
                }
                pairs += 1;
            }
        }
    }
    assert!(pairs >= 5, "{pairs}");
}

/// Returns the folder that a command writes to, and the files that it writes there.
fn written_into(leaf: &str, line: &str) -> (String, Vec<String>) {
    let folder = Folder::new();
    let before = folder.snapshot();
    let output = folder.run(&filled(leaf, line, &[]));
    assert_eq!(output.status.code(), Some(0), "{line}: {output:?}");
    let all = arguments(leaf, line);
    let written = all.iter().find(|(_, role)| *role == Role::OutputFolder);
    let root = match leaf {
        "site merge" => "built".to_string(),
        _ => format!("out-{}", written.unwrap().0),
    };
    let is_new = |(path, bytes): &(PathBuf, Vec<u8>)| {
        path.starts_with(&root) && bytes != b"folder" && !before.contains_key(path)
    };
    let after: Snapshot = folder.snapshot();
    let names = after.into_iter().filter(is_new).map(|(path, _)| {
        let name = path.strip_prefix(&root).unwrap();
        name.to_str().unwrap().to_string()
    });
    let names = names.collect();
    (root, names)
}

#[test]
fn no_file_in_an_output_folder_replaces_an_input() {
    let mut folders = 0;
    for (leaf, line) in LINES {
        let all = arguments(leaf, line);
        if all.iter().all(|(_, role)| *role != Role::OutputFolder) {
            continue;
        }
        let (root, mut names) = written_into(leaf, line);
        assert!(!names.is_empty(), "{leaf}");
        // One file of each folder is enough.
        names.sort_by_key(|name| Path::new(name).parent().map(Path::to_path_buf));
        names.dedup_by_key(|name| Path::new(name).parent().map(Path::to_path_buf));
        for (_, input) in inputs(leaf, line) {
            for name in &names {
                let made = || {
                    let folder = Folder::new();
                    let to = folder.path().join(&root).join(name);
                    fs::create_dir_all(to.parent().unwrap()).unwrap();
                    (folder, to)
                };
                let what = format!("{leaf}: {name} on {input}");
                let (folder, to) = made();
                fs::hard_link(folder.path().join(input), &to).unwrap();
                refused(&folder, &filled(leaf, line, &[]), &what);
                // A link may be replaced, but not the file that it leads to.
                let (folder, to) = made();
                symlink(folder.path().join(input), &to).unwrap();
                let before = fs::read(folder.path().join(input)).unwrap();
                let output = folder.run(&filled(leaf, line, &[]));
                assert!(
                    matches!(output.status.code(), Some(0 | 2)),
                    "{what}: {output:?}"
                );
                assert!(
                    fs::read(folder.path().join(input)).unwrap() == before,
                    "{what}"
                );
            }
        }
        folders += 1;
    }
    assert!(folders >= 3, "{folders}");
}

#[test]
fn picture_of_check_does_not_replace_the_site() {
    let (_, names) = written_into("check", "check {site} --draw {draw}");
    for name in names {
        let folder = Folder::new();
        fs::rename(folder.path().join("site.toml"), folder.path().join(&name)).unwrap();
        refused(
            &folder,
            &["check", &name, "--draw", "."].map(String::from),
            &name,
        );
    }
}

#[test]
fn site_file_inside_the_build_folder_is_refused() {
    let folder = Folder::new();
    let parts = folder.path().join("built/parts");
    for name in NAMED_BY_SITE.into_iter().chain(["site.toml"]) {
        fs::copy(folder.path().join(name), parts.join(name)).unwrap();
    }
    let site = "built/parts/site.toml";
    let build = ["site", "build", site, "--tables-only", "-o", "built"];
    refused(&folder, &build.map(String::from), "site build");
    let merge = ["site", "merge", "built", "--site", site];
    refused(&folder, &merge.map(String::from), "site merge");
    // An output next to the inputs is allowed.
    let build = ["site", "build", "site.toml", "--tables-only", "-o", "."];
    assert!(folder.run(&build).status.success());
}

/// Input and output files that the shell has opened.
#[test]
fn redirected_input_is_not_replaced() {
    let folder = Folder::new();
    let open = |name: &str| fs::File::open(folder.path().join(name)).unwrap();
    let append = |name: &str| {
        let path = folder.path().join(name);
        fs::File::options().append(true).open(path).unwrap()
    };
    let before = folder.snapshot();
    for (line, input, output) in [
        (
            "table export - --format c -o dock.posegate",
            Some("dock.posegate"),
            None,
        ),
        (
            "table export /dev/stdin --format c -o dock.posegate",
            Some("dock.posegate"),
            None,
        ),
        ("check site.toml", None, Some("site.toml")),
        ("check site.toml", None, Some("hall.json")),
        ("draw site.toml --task dock -o -", None, Some("site.toml")),
        (
            "draw site.toml --task dock -o /dev/stdout",
            None,
            Some("site.toml"),
        ),
    ] {
        let mut command = folder.command(&line.split(' ').collect::<Vec<_>>());
        if let Some(name) = input {
            command.stdin(open(name));
        }
        if let Some(name) = output {
            command.stdout(append(name));
        }
        let done = command.output().unwrap();
        assert_eq!(done.status.code(), Some(2), "{line}: {done:?}");
        assert!(folder.snapshot() == before, "{line}");
    }
    // Devices cannot be replaced.
    let line = "gate dock.posegate --estimates /dev/null";
    let done = folder.command(&line.split(' ').collect::<Vec<_>>());
    let done = { done }.stdout(append("/dev/null")).output().unwrap();
    assert!(!String::from_utf8_lossy(&done.stderr).contains("same file"));
}

/// `table seal` works in place without -o. An -o with the same file is refused.
#[test]
fn seal_replaces_its_input_only_without_output_option() {
    let folder = Folder::new();
    assert!(folder.run(&["table", "seal", "firmware"]).status.success());
    refused(
        &folder,
        &["table", "seal", "firmware", "-o", "firmware"].map(String::from),
        "table seal",
    );
}

#[test]
fn standard_input_is_used_once() {
    for (leaf, line) in LINES {
        let all = inputs(leaf, line);
        let named: Vec<&String> = all.iter().filter_map(|(name, _)| name.as_ref()).collect();
        for pair in named.windows(2) {
            let folder = Folder::new();
            let given = [(pair[0].as_str(), "-"), (pair[1].as_str(), "-")];
            let output = folder.run(&filled(leaf, line, &given));
            let error = String::from_utf8_lossy(&output.stderr);
            assert_eq!(output.status.code(), Some(2), "{line}: {error}");
            assert!(error.contains("can be read only once"), "{line}: {error}");
        }
    }
}

/// Only the module `files` opens files: the program's code names no other function that does.
#[test]
fn subcommands_open_files_only_through_the_files_module() {
    let root =
        Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("crates/posegate-cli/src");
    let mut open = vec![root];
    let mut seen = 0;
    while let Some(path) = open.pop() {
        if path.is_dir() {
            open.extend(
                fs::read_dir(&path)
                    .unwrap()
                    .map(|entry| entry.unwrap().path()),
            );
            continue;
        }
        let text = fs::read_to_string(&path).unwrap();
        for banned in [
            "fs::read",
            "fs::write",
            "fs::create",
            "fs::copy",
            "fs::rename",
            "fs::remove",
            "fs::OpenOptions",
            "File::open",
            "File::create",
            "File::options",
            "PathBuf",
            "print!(",
            "println!(",
        ] {
            let is_test = path.ends_with("arguments/tests.rs");
            assert!(
                is_test || !text.contains(banned),
                "{}: {banned}",
                path.display()
            );
        }
        seen += 1;
    }
    assert!(seen > 25, "{seen}");
}
