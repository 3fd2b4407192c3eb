//! Reads parts of large site files.

use std::collections::BTreeSet;
use std::fs::{File, Metadata};
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::str;

use sha2::{Digest, Sha256};

use super::sections::{NeedsFullParse, Section, Sections};
use super::{Site, keys, parse};

/// Limit on the walks through a file. Each walk follows references by one step. Four steps lead from a task to its
/// chain, the tasks of that chain and their tags.
const WALKS: usize = 16;
/// Lines of this many bytes or more need the full parser.
const LONGEST_LINE: u64 = 1 << 20;

/// The task names and the digest of a site file, found from its headers and the sections that every task may depend
/// on.
///
/// For programs that need a few tasks of a site with thousands: [`SiteIndex::part`] reads only these and everything
/// that they refer to. It walks through the file several times, with one line in memory at a time. Only simple files
/// are supported: one header per task and per tag, strings on one line without escapes, no imports and no candidates.
/// **In every other case the result is `None`**, and no error is reported: read the complete file with [`Site::read`]
/// instead.
#[derive(Clone, Debug)]
pub struct SiteIndex {
    path: PathBuf,
    /// SHA-256 of the file's bytes.
    sha256: [u8; 32],
    /// The digest as in [`Site::digest`].
    digest: [u8; 32],
    tasks: Vec<String>,
}

/// The result of a walk over the file.
struct Walk {
    sha256: [u8; 32],
    /// The text of the kept sections.
    text: String,
    /// The strings in `text`.
    strings: BTreeSet<String>,
}

impl SiteIndex {
    /// Reads a site file's headers. `None` if the file must be read as a whole.
    #[must_use]
    pub fn read(path: impl AsRef<Path>) -> Option<Self> {
        let path = path.as_ref();
        // Only a regular file can be read again: a pipe, or standard input under another name, cannot.
        path.metadata().ok().filter(Metadata::is_file)?;
        if ["/dev", "/proc"]
            .iter()
            .any(|folder| path.starts_with(folder))
        {
            return None;
        }
        let mut tasks = BTreeSet::new();
        let all = walk(path, |kind, name| {
            if kind == keys::TASKS.name {
                tasks.insert(name.into());
            }
            false
        });
        let mut contents = Self {
            path: path.into(),
            sha256: all.ok()?.sha256,
            digest: [0; 32],
            tasks: tasks.into_iter().collect(),
        };
        contents.digest = contents.named(|_, _| false)?.digest;
        Some(contents)
    }

    /// Returns the names of all tasks, in alphabetical order.
    #[must_use]
    pub fn tasks(&self) -> &[String] {
        &self.tasks
    }

    /// Returns the digest of the site, as in [`Site::digest`].
    #[must_use]
    pub const fn digest(&self) -> [u8; 32] {
        self.digest
    }

    /// Returns the site with only the tasks, tags, goals and chains that `wanted` selects by kind (`task`, `tag`,
    /// `goal`, `chain`) and name, everything that they refer to, and all other sections of the file. Entries and digest
    /// are the same as in the whole site.
    ///
    /// `None` if the full parser is needed, if the file has changed since, or if it has a fault.
    #[must_use]
    pub fn part(&self, wanted: impl Fn(&str, &str) -> bool) -> Option<Site> {
        let site = self.named(wanted)?;
        (site.digest == self.digest).then_some(site)
    }

    fn named(&self, wanted: impl Fn(&str, &str) -> bool) -> Option<Site> {
        let mut names = BTreeSet::new();
        let mut length = None;
        // Repeats until the kept text refers to nothing outside of it.
        for _ in 0..WALKS {
            let walk = walk(&self.path, |kind, name| {
                wanted(kind, name) || names.contains(name)
            });
            let walk = walk.ok().filter(|walk| walk.sha256 == self.sha256)?;
            if length == Some(walk.text.len()) {
                let file = self.path.to_string_lossy();
                return parse::part(&walk.text, &file, self.sha256).ok();
            }
            length = Some(walk.text.len());
            names.extend(walk.strings);
        }
        None
    }
}

/// Walks over a file. `wanted` selects named sections by kind and name; all other sections are kept.
fn walk(path: &Path, mut wanted: impl FnMut(&str, &str) -> bool) -> Result<Walk, NeedsFullParse> {
    let mut file = BufReader::new(File::open(path).map_err(|_| NeedsFullParse)?);
    let mut sections = Sections::new();
    let mut digest = Sha256::new();
    let (mut text, mut strings) = (String::new(), BTreeSet::new());
    let mut bytes = Vec::new();
    let mut kept = true;
    loop {
        bytes.clear();
        let line = (&mut file).take(LONGEST_LINE).read_until(b'\n', &mut bytes);
        match line.map_err(|_| NeedsFullParse)? as u64 {
            0 => break,
            LONGEST_LINE => return Err(NeedsFullParse),
            _ => {}
        }
        digest.update(&bytes);
        let line = str::from_utf8(&bytes).map_err(|_| NeedsFullParse)?;
        if sections.line(line.strip_suffix('\n').unwrap_or(line))? {
            kept = match sections.section() {
                Section::Common => true,
                Section::Named { kind, name } => wanted(kind, name),
            };
        }
        if kept {
            text.push_str(line);
            strings.extend(sections.strings().iter().cloned());
        }
    }
    sections.end()?;
    Ok(Walk {
        sha256: digest.finalize().into(),
        text,
        strings,
    })
}
