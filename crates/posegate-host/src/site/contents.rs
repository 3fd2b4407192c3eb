//! Large site files, of which little is needed at a time.

use std::collections::BTreeSet;
use std::fs::{File, Metadata};
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::str;

use sha2::{Digest, Sha256};

use super::sections::{NeedsFullParse, Section, Sections};
use super::{Site, keys, parse};

/// Walks through a file, each of which follows names by one step: a task, its chain, the tasks of that, a tag are four.
const WALKS: usize = 16;
/// A line of so many bytes is not of the usual, simple way.
const LONGEST_LINE: u64 = 1 << 20;

/// What tasks a site file has, and its digest, by its headers and by what all tasks may depend on.
///
/// For those who need some tasks of a site with thousands: [`SiteIndex::part`] reads these, and what they name. The file is walked
/// through several times, a line in memory at a time. It follows the usual, simple way to write one: a header a task and a tag,
/// strings of one line without escapes, neither imports nor candidates. **Where it is in doubt it says nothing** (`None`), and
/// it finds no fault: then the file is to be read whole ([`Site::read`]).
#[derive(Clone, Debug)]
pub struct SiteIndex {
    path: PathBuf,
    /// SHA-256 of the file's bytes.
    sha256: [u8; 32],
    /// The site's digest.
    digest: [u8; 32],
    tasks: Vec<String>,
}

/// What came of a walk over the file.
struct Walk {
    sha256: [u8; 32],
    /// What was kept.
    text: String,
    /// The strings in it.
    strings: BTreeSet<String>,
}

impl SiteIndex {
    /// Reads a site file's headers. `None` where it must be read whole.
    #[must_use]
    pub fn read(path: impl AsRef<Path>) -> Option<Self> {
        let path = path.as_ref();
        // What is no file may not be there a second time; a file that is standard input may not begin anew.
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

    /// The names of all tasks, in order.
    #[must_use]
    pub fn tasks(&self) -> &[String] {
        &self.tasks
    }

    /// The digest of the site, as [`Site::digest`] has it.
    #[must_use]
    pub const fn digest(&self) -> [u8; 32] {
        self.digest
    }

    /// The site with those tasks, tags, goals and chains that are `wanted` by their kind (`task`, `tag`, `goal`, `chain`) and
    /// name, with all that they name in turn, and with all else that a site file may have. What is there is as it is
    /// in the whole site, the digest too. `None` where the file must be read whole: also where it has changed since, and where it
    /// has a fault.
    #[must_use]
    pub fn part(&self, wanted: impl Fn(&str, &str) -> bool) -> Option<Site> {
        let site = self.named(wanted)?;
        (site.digest == self.digest).then_some(site)
    }

    fn named(&self, wanted: impl Fn(&str, &str) -> bool) -> Option<Site> {
        let mut names = BTreeSet::new();
        let mut length = None;
        // What is kept grows until it names nothing that is not kept.
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

/// Walks over a file. `wanted` says what of the named sections is kept, by kind and name; all others are.
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
