//! The files of a ROS 2 bag that is a folder: `metadata.yaml` names them in order.

use posegate_files::input::{self, Limit};
use std::path::{Component, Path, PathBuf};

/// What to do about a folder that is not a bag.
pub const BAD_FOLDER: &str = "name the recording itself (.mcap, .db3, .bag), or the folder that `ros2 bag record` wrote, with its metadata.yaml; \
     `ros2 bag reindex` writes a lost one";

/// The file that lists the others.
const METADATA: &str = "metadata.yaml";
/// The keys of the list.
const KEYS: [&str; 2] = ["rosbag2_bagfile_information", "relative_file_paths"];
/// The endings of bags' names.
const ENDINGS: [&str; 5] = [".mcap", ".db3", ".bag", ".mcap.zstd", ".db3.zstd"];
/// The most files of a bag.
const MOST_FILES: usize = 1 << 14;

/// Returns `true` for a folder, and for the `metadata.yaml` of one.
#[must_use]
pub fn is_folder(path: &Path) -> bool {
    path.is_dir() || path.file_name().is_some_and(|name| name == METADATA) && path.is_file()
}

/// Returns the files of a bag: the path itself, or the files of a folder in the order of its `metadata.yaml`, which may be named instead. A
/// folder without one may have a single recording.
///
/// # Errors
/// A description of the fault; [`BAD_FOLDER`] says what to do.
pub fn files_of(path: &Path) -> Result<Vec<PathBuf>, String> {
    if !is_folder(path) {
        return Ok(vec![path.to_owned()]);
    }
    let path = match path.parent() {
        Some(folder) if !path.is_dir() => folder,
        _ => path,
    };
    let list = path.join(METADATA);
    if !list.is_file() {
        return only_recording(path);
    }
    let name = list.display();
    let bytes = input::read_file(&list, Limit::MAP).map_err(|cause| format!("{name}: {cause}"))?;
    let text = String::from_utf8(bytes).map_err(|_| format!("{name} is not UTF-8"))?;
    let paths = posegate_site::yaml_texts(&text, &list.to_string_lossy(), &KEYS)?;
    if paths.is_empty() || paths.len() > MOST_FILES {
        return Err(format!("{name} names {} files", paths.len()));
    }
    let inner = |file: &String| {
        let relative = Path::new(file);
        let is_inner = relative
            .components()
            .all(|part| matches!(part, Component::Normal(_)));
        let there = path.join(relative);
        if is_inner && there.is_file() {
            return Ok(there);
        }
        // Up to version 3 of the metadata the paths begin with the folder's own name, which users change.
        let moved = relative.file_name().map(|name| path.join(name));
        if let Some(moved) = moved.filter(|moved| moved.is_file()) {
            return Ok(moved);
        }
        if is_inner {
            return Ok(there);
        }
        Err(format!("{name} names {file:?}, which is not in the folder"))
    };
    paths.iter().map(inner).collect()
}

/// Returns the recording of a folder if there is one only.
fn only_recording(folder: &Path) -> Result<Vec<PathBuf>, String> {
    let entries =
        std::fs::read_dir(folder).map_err(|cause| format!("{}: {cause}", folder.display()))?;
    let mut found = Vec::new();
    for entry in entries.take(MOST_FILES).flatten() {
        let name = entry.file_name();
        let name = name.to_string_lossy();
        if ENDINGS.iter().any(|ending| name.ends_with(ending)) {
            found.push(entry.path());
        }
    }
    match found.len() {
        1 => Ok(found),
        0 => Err(format!("the folder {} has no recording", folder.display())),
        count => Err(format!(
            "the folder {} has {count} recordings and no {METADATA}",
            folder.display()
        )),
    }
}
