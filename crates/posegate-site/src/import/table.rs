//! The `[import.NAME]` tables of a site file.

use std::collections::BTreeMap;
use std::path::Path;

use super::{Convention, DockDirection, Format, Import, ImportError, Imported};
use crate::error::SiteError;
use crate::named::NamedFile;
use crate::reader::{Node, Table};
use crate::{Note, Remark, SiteTag, keys, places, poses};
use posegate::shape::PoseDeg;
use posegate_files::input::{self, Limit};

/// Adds the tags and goals of a site's imports. Returns the files by the imports' names.
pub(crate) fn imports<'a>(
    root: &Table<'a>,
    tags: &mut BTreeMap<String, SiteTag>,
    goals: &mut BTreeMap<String, PoseDeg>,
    remarks: &mut Vec<Remark>,
) -> Result<BTreeMap<&'a str, NamedFile>, SiteError> {
    let mut files = BTreeMap::new();
    let Some(node) = root.optional(&keys::IMPORTS) else {
        return Ok(files);
    };
    for (name, node) in node.any_table()?.named(&keys::IMPORT)? {
        let (table, imported, file) = import(&node)?;
        files.insert(name, file);
        remarks.extend(imported.remarks.into_iter().map(|message| Remark {
            about: ["import", name].map(str::to_owned),
            note: Note::assumed(message),
        }));
        join(&table, "tag", tags, imported.tags)?;
        join(&table, "goal", goals, imported.goals)?;
    }
    Ok(files)
}

fn join<T>(
    table: &Table<'_>,
    what: &str,
    all: &mut BTreeMap<String, T>,
    more: BTreeMap<String, T>,
) -> Result<(), SiteError> {
    for (name, entry) in more {
        if all.contains_key(&name) {
            return Err(table
                .error_at_key(
                    keys::PREFIX.name,
                    format!(
                        "{} brings a {what} `{name}`, which the site has already",
                        table.title()
                    ),
                )
                .expected("names that the site does not have yet")
                .help("add a `prefix`, or change it"));
        }
        all.insert(name, entry);
    }
    Ok(())
}

/// Reads one import. Returns its table, contents and file.
fn import<'a>(node: &Node<'a>) -> Result<(Table<'a>, Imported, NamedFile), SiteError> {
    let table = node.table(&[
        &keys::FILE,
        &keys::FORMAT,
        &keys::CONVENTION,
        &keys::SIZE,
        &keys::FAMILY,
        &keys::IMPORT_POSE,
        &keys::PREFIX,
        &keys::TOLERANCE,
        &keys::DOCK_DIRECTION,
        &keys::DOCK_FRAME,
    ])?;
    let word = table.required(&keys::FORMAT)?;
    let format = Format::named(word.text()?).ok_or_else(|| word.unknown_word(Format::NAMES))?;
    let text = |key| match table.optional(key) {
        Some(node) => node.text().map(|text| Some(text.to_owned())),
        None => Ok(None),
    };
    let file = table.required(&keys::FILE)?;
    let (path, part) = format.split(file.text()?);
    let order = Import {
        format,
        convention: match table.optional(&keys::CONVENTION) {
            Some(node) => Some(convention(&node)?),
            None => None,
        },
        size: match table.optional(&keys::SIZE) {
            Some(node) => Some(node.number()?),
            None => None,
        },
        family: text(&keys::FAMILY)?,
        pose: match table.optional(&keys::IMPORT_POSE) {
            Some(node) => Some(poses::pose3(&node)?),
            None => None,
        },
        prefix: text(&keys::PREFIX)?,
        part: part.map(ToOwned::to_owned),
        tolerance: match table.optional(&keys::TOLERANCE) {
            Some(node) => Some(places::tolerance(&node)?),
            None => None,
        },
        dock_direction: match table.optional(&keys::DOCK_DIRECTION) {
            Some(node) => Some(
                DockDirection::named(node.text()?)
                    .ok_or_else(|| node.unknown_word(DockDirection::NAMES))?,
            ),
            None => None,
        },
        frame: text(&keys::DOCK_FRAME)?,
    };
    let folder = Path::new(file.file()).parent().unwrap_or(Path::new(""));
    let path = folder.join(path);
    let name = path.to_string_lossy();
    let bytes = input::read_file(&path, Limit::MAP).map_err(|cause| {
        file.error(format!("the file {name} cannot be read: {cause}"))
            .help("write the file's path relative to the site file's folder")
    })?;
    let named = NamedFile::new(&path, &bytes);
    let text = String::from_utf8(bytes).map_err(|_| {
        file.error(format!("the file {name} is not UTF-8"))
            .help("save the file in the encoding UTF-8")
    })?;
    match order.parse(&text, &name) {
        Ok(imported) => Ok((table, imported, named)),
        Err(ImportError::File(fault)) => Err(fault),
        Err(ImportError::Setting {
            key,
            message,
            expected,
            like,
        }) => {
            let help = match like {
                Some(like) => format!("write `{key} = {like}`"),
                None => format!("remove `{key}`"),
            };
            let message = format!("{}: {message}", table.title());
            let error = table.error_at_key(key, message);
            Err(error.expected(expected).help(help))
        }
    }
}

fn convention(node: &Node<'_>) -> Result<Convention, SiteError> {
    Convention::named(node.text()?).ok_or_else(|| node.unknown_word(Convention::NAMES))
}
