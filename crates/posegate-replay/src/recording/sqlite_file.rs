//! ROS 2 bags in SQLite (`.db3`), read in the order in which they were written.
//!
//! SQLite reads the file; it is opened unchangeable, and nothing in its schema is run: `topics` and `messages` must be plain tables.

use super::intake::{Intake, Schema};
use super::storage::Storage;
use super::{Item, RecordingError};
use crate::mcap::chunk::LARGEST;
use rusqlite::config::DbConfig;
use rusqlite::limits::Limit;
use rusqlite::{Connection, OpenFlags, OptionalExtension};
use std::collections::BTreeMap;
use std::path::Path;

/// The columns that are read, by table.
const TABLES: [&str; 2] = ["topics", "messages"];
const NEXT: &str =
    "SELECT rowid, topic_id, timestamp, data FROM messages WHERE rowid > ?1 ORDER BY rowid LIMIT 1";
/// The most topics of a file.
const MOST_TOPICS: usize = 1 << 16;

/// A reader of a file.
pub(super) struct SqliteFile {
    connection: Connection,
    file: String,
    /// The file's length, and the number of messages in it.
    length: u64,
    messages: u64,
    /// The numbers of the topics in the intake; `None` before the topics were read.
    topics: Option<BTreeMap<i64, u32>>,
    /// The row of the last message, and the number of messages that were read.
    last: i64,
    read: u64,
    is_over: bool,
    /// What is read although the file is not complete.
    damage: Option<String>,
    /// Keeps an unpacked copy of the file.
    _copy: Option<tempfile::TempPath>,
}

impl SqliteFile {
    /// Opens a file; `file` names it in errors. `copy` is removed when the reader is dropped.
    pub fn open(
        path: &Path,
        file: &str,
        copy: Option<tempfile::TempPath>,
    ) -> Result<Self, RecordingError> {
        let bad = |why: &dyn std::fmt::Display| RecordingError::NotABag {
            file: file.into(),
            why: why.to_string(),
        };
        let length = std::fs::metadata(path).map_err(|source| RecordingError::Io {
            file: file.into(),
            source,
        })?;
        // Unchangeable: SQLite writes nothing beside the file.
        let uri = format!("file:{}?immutable=1", escaped(path));
        let flags = OpenFlags::SQLITE_OPEN_READ_ONLY
            | OpenFlags::SQLITE_OPEN_URI
            | OpenFlags::SQLITE_OPEN_NO_MUTEX;
        let connection = Connection::open_with_flags(uri, flags).map_err(|error| bad(&error))?;
        let safe = |connection: &Connection| {
            connection.set_db_config(DbConfig::SQLITE_DBCONFIG_DEFENSIVE, true)?;
            connection.set_db_config(DbConfig::SQLITE_DBCONFIG_TRUSTED_SCHEMA, false)?;
            connection.set_db_config(DbConfig::SQLITE_DBCONFIG_ENABLE_TRIGGER, false)?;
            connection.set_db_config(DbConfig::SQLITE_DBCONFIG_ENABLE_VIEW, false)?;
            connection.set_limit(Limit::SQLITE_LIMIT_LENGTH, LARGEST as i32)?;
            Ok::<(), rusqlite::Error>(())
        };
        safe(&connection).map_err(|error| bad(&error))?;
        for table in TABLES {
            let plain = is_plain(&connection, table).map_err(|error| bad(&error))?;
            if !plain {
                return Err(bad(&format_args!(
                    "SQLite without the table `{table}` of rosbag2"
                )));
            }
        }
        let beside = path.with_file_name(format!(
            "{}-wal",
            path.file_name().unwrap_or_default().to_string_lossy()
        ));
        let is_open = std::fs::metadata(beside).is_ok_and(|data| data.len() > 0);
        let count = "SELECT count(*) FROM messages";
        let messages = connection.query_row(count, [], |row| row.get::<_, i64>(0));
        Ok(Self {
            messages: messages.map_or(0, |count| count.unsigned_abs()),
            connection,
            file: file.into(),
            length: length.len(),
            topics: None,
            last: i64::MIN,
            read: 0,
            is_over: false,
            damage: is_open.then(|| {
                format!(
                    "{file}: the recording was not closed; messages in its -wal file are not read"
                )
            }),
            _copy: copy,
        })
    }

    /// Announces the topics to the intake.
    fn announce(&mut self, intake: &mut Intake) -> rusqlite::Result<()> {
        let definitions = definitions(&self.connection)?;
        let mut statement = self
            .connection
            .prepare("SELECT id, name, type, serialization_format FROM topics ORDER BY id")?;
        let mut rows = statement.query([])?;
        let mut numbers = BTreeMap::new();
        while let Some(row) = rows.next()? {
            let (id, name): (i64, String) = (row.get(0)?, row.get(1)?);
            let (kind, encoding): (String, String) = (row.get(2)?, row.get(3)?);
            let number = u32::try_from(numbers.len()).unwrap_or(u32::MAX);
            let definition = definitions.get(&kind).cloned().unwrap_or_default();
            let bytes = name.len() + kind.len() + definition.len();
            let schema = Schema {
                name: kind,
                encoding: "ros2msg".into(),
                definition,
                has_fields: None,
            };
            let stored = intake.schema(number, bytes, schema);
            let stored = stored.and_then(|()| intake.channel(number, 0, &name, number, &encoding));
            if stored.is_err() || numbers.len() >= MOST_TOPICS {
                intake.diagnostics.bad_records += 1;
                break;
            }
            numbers.insert(id, number);
        }
        self.topics = Some(numbers);
        Ok(())
    }

    /// Passes the next message on. `Ok(None)` at the end.
    fn step(
        &mut self,
        intake: &mut Intake,
    ) -> rusqlite::Result<Option<Result<Option<Item>, RecordingError>>> {
        let mut statement = self.connection.prepare_cached(NEXT)?;
        let mut rows = statement.query([self.last])?;
        let Some(row) = rows.next()? else {
            return Ok(None);
        };
        self.last = row.get(0)?;
        self.read += 1;
        let topic: i64 = row.get(1)?;
        let logged_ns: i64 = row.get(2)?;
        let number = self.topics.as_ref().and_then(|topics| topics.get(&topic));
        let number = number.copied().unwrap_or(u32::MAX);
        // SQLite reads the bytes of a message only if they are asked for: pictures are passed over.
        let data: &[u8] = if intake.reads(number) {
            row.get_ref(3)?.as_blob()?
        } else {
            &[]
        };
        Ok(Some(intake.message(number, logged_ns, data)))
    }
}

impl Storage for SqliteFile {
    fn next(&mut self, intake: &mut Intake) -> Result<Option<Item>, RecordingError> {
        if let Some(damage) = self.damage.take() {
            intake.diagnostics.damage.get_or_insert(damage);
        }
        while !self.is_over {
            let taken = match self.topics {
                None => self.announce(intake).map(|()| Some(Ok(None))),
                Some(_) => self.step(intake),
            };
            match taken {
                Ok(Some(Ok(Some(item)))) => return Ok(Some(item)),
                Ok(Some(Ok(None))) => {}
                Ok(Some(Err(error))) => return Err(error),
                Ok(None) => self.is_over = true,
                Err(error) => {
                    self.is_over = true;
                    let message = format!("{}: after {} messages: {error}", self.file, self.read);
                    intake.diagnostics.damage = Some(message);
                }
            }
        }
        Ok(None)
    }

    fn bytes(&self) -> u64 {
        let share = self.read.min(self.messages) as f64 / self.messages.max(1) as f64;
        (self.length as f64 * share) as u64
    }
}

/// Returns `true` if a name is that of a table whose columns are all stored.
fn is_plain(connection: &Connection, table: &str) -> rusqlite::Result<bool> {
    let of_name = "SELECT sql FROM sqlite_schema WHERE type = 'table' AND name = ?1";
    let sql: Option<Option<String>> = connection
        .query_row(of_name, [table], |row| row.get(0))
        .optional()?;
    let Some(Some(sql)) = sql else {
        return Ok(false);
    };
    let is_virtual = sql.to_ascii_uppercase().contains("VIRTUAL");
    let hidden = "SELECT count(*) FROM pragma_table_xinfo(?1) WHERE hidden <> 0";
    let hidden: i64 = connection.query_row(hidden, [table], |row| row.get(0))?;
    Ok(!is_virtual && hidden == 0)
}

/// Returns the message definitions by type. Files of Humble and older have none.
fn definitions(connection: &Connection) -> rusqlite::Result<BTreeMap<String, String>> {
    if !is_plain(connection, "message_definitions")? {
        return Ok(BTreeMap::new());
    }
    let mut statement = connection.prepare(
        "SELECT topic_type, encoded_message_definition FROM message_definitions WHERE encoding = 'ros2msg'",
    )?;
    let rows = statement.query_map([], |row| Ok((row.get(0)?, row.get(1)?)))?;
    rows.collect()
}

/// Returns a path for a URI.
fn escaped(path: &Path) -> String {
    let path = path.to_string_lossy();
    let mut text = String::new();
    for letter in path.chars() {
        match letter {
            '%' => text += "%25",
            '?' => text += "%3f",
            '#' => text += "%23",
            _ => text.push(letter),
        }
    }
    text
}
