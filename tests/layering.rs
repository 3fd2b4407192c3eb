//! The rooms stand in their order: a room names only rooms above its own line in `src/lib.rs`, and
//! unsafe code is allowed nowhere but in the `ffi` room, where each has its reason.

use std::path::{Path, PathBuf};

/// The rooms of `src/lib.rs` in order, and whether each is above the std line.
fn rooms() -> Vec<(String, bool)> {
    let text = std::fs::read_to_string(root().join("src/lib.rs")).unwrap();
    let mut core = true;
    let mut rooms = Vec::new();
    for line in text.lines() {
        if line.contains("std line") {
            core = false;
        }
        if let Some(room) = line.strip_prefix("pub mod ") {
            rooms.push((room.trim_end_matches(';').to_string(), core));
        }
    }
    rooms
}

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// Every source file of a room.
fn files(room: &str) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut open = vec![root().join("src").join(room)];
    let single = root().join("src").join(format!("{room}.rs"));
    if single.is_file() {
        found.push(single);
        open.clear();
    }
    while let Some(folder) = open.pop() {
        for entry in std::fs::read_dir(&folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                open.push(path);
            } else if path.extension().is_some_and(|e| e == "rs") {
                found.push(path);
            }
        }
    }
    assert!(!found.is_empty(), "the room {room} has no files");
    found
}

/// The text without comments (documents may point downwards).
fn code(path: &Path) -> String {
    let text = std::fs::read_to_string(path).unwrap();
    text.lines()
        .filter(|line| !line.trim_start().starts_with("//"))
        .collect::<Vec<_>>()
        .join("\n")
}

/// Whether a file, or the folder that it is in, is declared as a module for tests alone.
fn is_for_tests(path: &Path, texts: &[String]) -> bool {
    let folder = path.parent().and_then(Path::file_name);
    [path.file_stem(), folder]
        .into_iter()
        .flatten()
        .filter_map(|name| name.to_str())
        .any(|name| {
            let declared = format!("#[cfg(test)]\nmod {name};");
            texts.iter().any(|text| text.contains(&declared))
        })
}

/// What is wrong with a room's code, given the rooms below it.
fn faults(text: &str, below: &[String], core: bool) -> Vec<String> {
    let mut faults = Vec::new();
    for room in below {
        if text.contains(&format!("crate::{room}"))
            || text.contains(&format!("super::super::{room}"))
        {
            faults.push(format!("names the room {room}, which is below it"));
        }
    }
    // Spellings that this test could not follow.
    for hidden in ["use crate::{", "super::super::", "use crate as", "crate::*"] {
        if text.contains(hidden) {
            faults.push(format!("writes `{hidden}`: name one room a line"));
        }
    }
    let inner = text.split("#[cfg(test)]").next().unwrap_or("");
    if core
        && (inner.contains("std::")
            || inner.contains("extern crate alloc")
            || inner.contains("alloc::"))
    {
        faults.push("uses std or alloc in the core".into());
    }
    faults
}

#[test]
fn rooms_name_only_rooms_above_them() {
    let rooms = rooms();
    assert!(rooms.len() >= 10 && rooms.iter().filter(|(_, core)| *core).count() >= 6);
    let mut wrong = Vec::new();
    for (index, (room, core)) in rooms.iter().enumerate() {
        let below: Vec<String> = rooms[index + 1..]
            .iter()
            .map(|(room, _)| room.clone())
            .collect();
        let all = files(room);
        let texts: Vec<String> = all.iter().map(|path| code(path)).collect();
        for path in &all {
            if is_for_tests(path, &texts) {
                continue;
            }
            for fault in faults(&code(path), &below, *core) {
                wrong.push(format!(
                    "{}: {fault}",
                    path.strip_prefix(root()).unwrap().display()
                ));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn faults_are_seen() {
    let below = ["gate".to_string()];
    assert_eq!(faults("use crate::gate::Gate;", &below, true).len(), 1);
    assert_eq!(faults("use crate::{gate, num};", &below, true).len(), 1);
    assert_eq!(faults("let x = std::vec![1];", &below, true).len(), 1);
    assert_eq!(
        faults(
            "use crate::num::Float;\n#[cfg(test)]\nuse std::vec::Vec;",
            &below,
            true
        )
        .len(),
        0
    );
}

#[test]
fn every_source_file_belongs_to_a_room() {
    let rooms = rooms();
    for entry in std::fs::read_dir(root().join("src")).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        let stem = name.trim_end_matches(".rs");
        let known = rooms.iter().any(|(room, _)| room == stem);
        assert!(
            known || stem == "lib" || stem == "bin",
            "src/{name} is no room of src/lib.rs"
        );
    }
}

/// Every source file below a folder.
fn below(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut open = vec![folder.to_path_buf()];
    while let Some(folder) = open.pop() {
        for entry in std::fs::read_dir(&folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                open.push(path);
            } else if path.extension().is_some_and(|e| e == "rs") {
                found.push(path);
            }
        }
    }
    found
}

/// One allowance, at the head of the C boundary.
#[test]
fn unsafe_is_allowed_in_one_room() {
    let allowances: Vec<PathBuf> = below(&root().join("src"))
        .into_iter()
        .flat_map(|path| {
            let count = code(&path).matches("allow(unsafe_code)").count();
            std::iter::repeat_n(path, count)
        })
        .collect();
    assert_eq!(allowances, [root().join("src/ffi/mod.rs")]);
    let lib = std::fs::read_to_string(root().join("src/lib.rs")).unwrap();
    assert!(lib.contains("#![deny(unsafe_code)]") && lib.contains("#![no_std]\n"));
}

/// The lines with an unsafe block or an unsafe implementation that no reason stands above, and with an
/// unsafe function that does not say what its caller promises; and how many there are of all.
fn without_reason(text: &str) -> (Vec<&str>, usize) {
    let lines: Vec<&str> = text.lines().map(str::trim).collect();
    let is_comment = |line: &str| line.starts_with("//") || line.starts_with("#[");
    let (mut wrong, mut count) = (Vec::new(), 0);
    for (at, line) in lines.iter().enumerate() {
        if is_comment(line) {
            continue;
        }
        let wanted = if line.contains("unsafe {") || line.contains("unsafe impl") {
            "// SAFETY: "
        } else if line.contains("unsafe fn")
            || line.contains("unsafe extern \"C\" fn")
            || line.contains("unsafe trait")
        {
            "/// # Safety"
        } else {
            continue;
        };
        count += 1;
        // Within a statement the reason stands above it.
        let begins = |line: &str| {
            line.is_empty() || line.ends_with(';') || line.ends_with('{') || line.ends_with('}')
        };
        let above = lines[..at].iter().rev();
        let reasons: Vec<&str> = above
            .skip_while(|line| !is_comment(line) && !begins(line))
            .take_while(|line| is_comment(line))
            .copied()
            .collect();
        if !reasons.iter().any(|line| line.starts_with(wanted)) {
            wrong.push(*line);
        }
    }
    (wrong, count)
}

#[test]
fn each_unsafe_has_its_reason() {
    let mut count = 0;
    for path in below(&root().join("src/ffi")) {
        let text = std::fs::read_to_string(&path).unwrap();
        let (wrong, here) = without_reason(&text);
        assert!(wrong.is_empty(), "{}: {wrong:#?}", path.display());
        count += here;
    }
    assert!(count >= 50, "{count}");
    let one = |text| without_reason(text).0.len();
    assert_eq!(one("let x = unsafe { f() };"), 1);
    assert_eq!(one("// SAFETY: it is so.\nlet x = unsafe { f() };"), 0);
    assert_eq!(
        one("// SAFETY: it is so.\nlet x = 1;\nlet y = unsafe { f() };"),
        1
    );
    assert_eq!(
        one("// SAFETY: it is so.\nlet (x, y) =\n    unsafe { f() };"),
        0
    );
    assert_eq!(one("/// Does.\npub unsafe fn f() {"), 1);
    assert_eq!(one("/// # Safety\n/// So.\npub unsafe fn f() {"), 0);
    assert_eq!(one("unsafe impl Plain for u8 {}"), 1);
}
