//! The identity of the file that a path names.

use std::fs::Metadata;
use std::path::{Path, PathBuf};

/// A regular file, independent of its name. Devices and pipes have no identity, because writing to them
/// replaces nothing.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Identity {
    /// An existing file, by its device and inode number: the same through hard and symbolic links.
    #[cfg(unix)]
    Existing { device: u64, number: u64 },
    /// A file that does not exist yet, by its path without links.
    Path(PathBuf),
}

impl Identity {
    /// Returns the identity of an existing file. `None` if it does not exist, or is not a regular file.
    pub(super) fn of(path: &Path) -> Option<Self> {
        Self::of_metadata(&std::fs::metadata(path).ok()?, path)
    }

    /// Like [`Identity::of`], from existing metadata.
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

    /// Returns the identity of an output file: that of an existing file, else its folder and its name.
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

    /// Returns the identity of standard input or output, if it is a regular file.
    #[cfg(unix)]
    pub(super) fn of_standard(stream: impl std::os::fd::AsFd) -> Option<Self> {
        // Duplicate the handle; the duplicate is closed at the end of this function.
        let own = stream.as_fd().try_clone_to_owned().ok()?;
        let data = std::fs::File::from(own).metadata().ok()?;
        Self::of_metadata(&data, Path::new("-"))
    }

    /// On other systems the identity is not known.
    #[cfg(not(unix))]
    pub(super) fn of_standard<T>(_: T) -> Option<Self> {
        None
    }
}
