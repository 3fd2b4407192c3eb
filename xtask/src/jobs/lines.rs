//! `lines`: the code of each room, against its ceiling in `xtask/lines.txt`.

use crate::arguments::Arguments;
use crate::files::root;
use crate::report::Report;
use crate::shell::Result;
use std::fs::{read_dir, read_to_string};
use std::path::{Path, PathBuf};

/// Rooms, ceilings and paths.
const FILE: &str = "xtask/lines.txt";
/// Folders of which every file belongs to one room.
const FOLDERS: [&str; 14] = [
    "src",
    "crates/posegate-c/src",
    "crates/posegate-cli/src",
    "crates/posegate-files/src",
    "crates/posegate-learn/src",
    "crates/posegate-place/src",
    "crates/posegate-plan/src",
    "crates/posegate-replay/src",
    "crates/posegate-show/src",
    "crates/posegate-site/src",
    "crates/posegate-python/src",
    "crates/posegate-ros2/src",
    "crates/posegate-testkit/src",
    "xtask/src",
];

struct Room {
    name: String,
    ceiling: usize,
    paths: Vec<PathBuf>,
    lines: usize,
}

/// Counts the code of each room. Fails if a room is above its ceiling, or if a file belongs to no room.
pub fn lines(_: &Arguments) -> Result {
    let mut rooms = rooms(&read_to_string(FILE)?)?;
    for folder in FOLDERS {
        let mut files = Vec::new();
        collect(&root().join(folder), &mut files)?;
        let texts = files
            .into_iter()
            .map(|path| read_to_string(&path).map(|text| (path, text)))
            .collect::<std::io::Result<Vec<_>>>()?;
        let of_tests: Vec<PathBuf> = texts
            .iter()
            .flat_map(|(path, text)| test_modules(path, text))
            .collect();
        for (path, text) in texts {
            let is_test = |of: &PathBuf| path.starts_with(of) || path == of.with_extension("rs");
            if !of_tests.iter().any(is_test) {
                room_of(&mut rooms, &path)?.lines += code(&text);
            }
        }
    }
    let mut report = Report::default();
    for room in &rooms {
        let name = format!("code of the room {}", room.name);
        report.at_most(&name, room.lines, "lines", room.ceiling);
    }
    report.finish()
}

/// Parses a line for each room: its name, its ceiling and its paths.
fn rooms(text: &str) -> Result<Vec<Room>> {
    let mut rooms = Vec::new();
    for line in text.lines().filter(|line| !line.starts_with('#')) {
        let mut words = line.split_whitespace();
        let (Some(name), Some(Ok(ceiling))) = (words.next(), words.next().map(str::parse)) else {
            return Err(format!("{FILE}: `{line}` is not ROOM CEILING PATH...").into());
        };
        rooms.push(Room {
            name: name.to_owned(),
            ceiling,
            paths: words.map(|path| root().join(path)).collect(),
            lines: 0,
        });
    }
    Ok(rooms)
}

/// Returns the room with the longest path that holds a file.
fn room_of<'r>(rooms: &'r mut [Room], file: &Path) -> Result<&'r mut Room> {
    let depth = |room: &Room| {
        let holding = room.paths.iter().filter(|path| file.starts_with(path));
        holding.map(|path| path.components().count()).max()
    };
    rooms
        .iter_mut()
        .max_by_key(|room| depth(room))
        .filter(|room| depth(room).is_some())
        .ok_or_else(|| format!("{FILE}: {} belongs to no room", file.display()).into())
}

fn collect(folder: &Path, files: &mut Vec<PathBuf>) -> Result {
    for entry in read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            collect(&path, files)?;
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            files.push(path);
        }
    }
    Ok(())
}

/// Returns `true` if the next item is compiled for tests alone.
fn is_for_tests(line: &str) -> bool {
    let line = line.trim_start();
    line.starts_with("#[cfg(test)]") || line.starts_with("#[cfg(all(test")
}

/// Returns the folders of the modules of a file that are compiled for tests alone.
fn test_modules(file: &Path, text: &str) -> Vec<PathBuf> {
    let is_root = ["mod.rs", "lib.rs", "main.rs"]
        .iter()
        .any(|name| file.ends_with(name));
    let folder = if is_root {
        file.parent().unwrap_or(file).to_owned()
    } else {
        file.with_extension("")
    };
    let lines: Vec<&str> = text.lines().collect();
    lines
        .windows(2)
        .filter(|pair| is_for_tests(pair[0]))
        .filter_map(|pair| pair[1].rsplit("mod ").next()?.strip_suffix(';'))
        .map(|name| folder.join(name))
        .collect()
}

/// Counts the lines that are neither blank nor comments nor of items for tests. The text is formatted by rustfmt.
fn code(text: &str) -> usize {
    let indent = |line: &str| line.len() - line.trim_start().len();
    let mut count = 0;
    let mut lines = text.lines();
    while let Some(line) = lines.next() {
        if is_for_tests(line) {
            // The item ends with the first line of its indent that closes it.
            let end = |next: &str| {
                indent(next) == indent(line)
                    && next.ends_with(['}', ';', ','])
                    && !next.trim_start().starts_with('#')
            };
            lines.by_ref().find(|next| end(next));
            continue;
        }
        let line = line.trim_start();
        count += usize::from(!line.is_empty() && !line.starts_with("//"));
    }
    count
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comments_blanks_and_tests_are_not_counted() {
        let text = "//! A file.\n\nuse a::b;\n#[cfg(test)]\nuse c::{\n    d,\n};\n\n/// A function.\nfn f() {\n    // Why.\n    g();\n}\n\n\
                    #[cfg(test)]\nmod tests {\n    fn h() {\n    }\n}\nconst A: u8 = 1;\n";
        assert_eq!(code(text), 5);
        assert_eq!(
            code("#[cfg(test)]\n#[allow(dead_code)]\nmod a;\nmod b;\n"),
            1
        );
    }

    #[test]
    fn modules_for_tests_are_beside_their_file() {
        let text = "#[cfg(test)]\nmod tests;\nmod b;\n#[cfg(test)]\npub mod cases;\n";
        let of = |file: &str| test_modules(Path::new(file), text);
        assert_eq!(
            of("src/a.rs"),
            [PathBuf::from("src/a/tests"), "src/a/cases".into()]
        );
        assert_eq!(
            of("src/a/mod.rs"),
            [PathBuf::from("src/a/tests"), "src/a/cases".into()]
        );
    }

    #[test]
    fn room_with_longest_path_has_a_file() {
        let mut rooms = rooms("# Rooms.\nall 10 src\nset 5 src/set\n").unwrap();
        let name = |rooms: &mut [Room], path: &str| {
            room_of(rooms, &root().join(path)).map(|room| room.name.clone())
        };
        assert_eq!(name(&mut rooms, "src/set/mod.rs").unwrap(), "set");
        assert_eq!(name(&mut rooms, "src/pose.rs").unwrap(), "all");
        assert!(name(&mut rooms, "crates/a.rs").is_err());
    }
}
