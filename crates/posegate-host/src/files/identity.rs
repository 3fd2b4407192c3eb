//! Which file a path means.

use std::fs::Metadata;
use std::path::{Path, PathBuf};

/// A regular file, however it is named. Devices and pipes have no identity: to write to one replaces nothing.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Identity {
    /// A file that exists, by its device and its number on it: also through links of both kinds.
    #[cfg(unix)]
    Existing { device: u64, number: u64 },
    /// A file by its path without links: one that does not exist yet.
    Path(PathBuf),
}

impl Identity {
    /// Of a file that exists. `None` if it does not, or is not a regular file.
    pub(super) fn of(path: &Path) -> Option<Self> {
        Self::of_metadata(&std::fs::metadata(path).ok()?, path)
    }

    /// The same of what is known of it already.
    pub(super) fn of_metadata(data: &Metadata, path: &Path) -> Option<Self> {
        if !data.is_file() {
            return None;
        }
        #[cfg(unix)]
        {
            use std::os::unix::fs::MetadataExt;
            let _ = path;
            Some(Self::Existing {
                device: data.dev(),
                number: data.ino(),
            })
        }
        #[cfg(not(unix))]
        path.canonicalize().ok().map(Self::Path)
    }

    /// Of a file that is to be written: where it does not exist, its folder and its name.
    pub(super) fn of_target(path: &Path) -> Option<Self> {
        if path.symlink_metadata().is_ok() {
            return Self::of(path);
        }
        let folder = match path.parent() {
            Some(folder) if folder != Path::new("") => folder,
            _ => Path::new("."),
        };
        let folder = folder.canonicalize().ok()?;
        Some(Self::Path(folder.join(path.file_name()?)))
    }

    /// Of standard input or output, where it is a regular file.
    #[cfg(unix)]
    pub(super) fn of_standard(stream: impl std::os::fd::AsFd) -> Option<Self> {
        // A handle of its own, closed at the end of this function.
        let own = stream.as_fd().try_clone_to_owned().ok()?;
        let data = std::fs::File::from(own).metadata().ok()?;
        Self::of_metadata(&data, Path::new("-"))
    }

    /// Elsewhere it is not known.
    #[cfg(not(unix))]
    pub(super) fn of_standard<T>(_: T) -> Option<Self> {
        None
    }
}
