//! Bags of ROS 2 in SQLite (`.db3`): tables `topics` and `messages`.
//!
//! Source: <https://github.com/ros2/rosbag2>, `rosbag2_storage_sqlite3`.

use std::path::{Path, PathBuf};

use deltille_files::limits::Limits;
use rusqlite::limits::Limit;
use rusqlite::{Connection, ErrorCode, OpenFlags, OptionalExtension, params};

use super::message::{Dialect, Message};
use super::topic::Topic;
use crate::problem::Problem;

/// Characters that have a meaning in the URI of a database.
const RESERVED: [(char, &str); 3] = [('%', "%25"), ('?', "%3f"), ('#', "%23")];

/// Returns the topics of a file.
pub(crate) fn topics(path: &Path, limits: &Limits) -> Result<Vec<Topic>, Problem> {
    let database = open(path, limits)?;
    let named = "SELECT name, type FROM topics WHERE serialization_format = 'cdr' ORDER BY id";
    let mut statement = database.prepare(named).map_err(problem)?;
    let topics = statement.query_map([], |row| {
        Ok(Topic { name: row.get(0)?, type_name: row.get(1)?, dialect: Dialect::Cdr })
    });
    topics.map_err(problem)?.collect::<Result<_, _>>().map_err(problem)
}

/// The messages of a topic.
pub(crate) struct Messages {
    database: Connection,
    topic: String,
    /// Id of the last message.
    last: i64,
    /// Smallest and largest id of all messages.
    ids: [i64; 2],
    has_ended: bool,
}

impl Messages {
    pub(crate) fn open(path: &Path, topic: &Topic, limits: &Limits) -> Result<Self, Problem> {
        let database = open(path, limits)?;
        let id = |which: &str| {
            let which = format!("SELECT {which}(id) FROM messages");
            database.query_row(&which, [], |row| row.get::<_, Option<i64>>(0))
        };
        // Damage is reported when the messages are read.
        let ids = ["min", "max"].map(|which| id(which).ok().flatten().unwrap_or(0));
        Ok(Self { database, topic: topic.name.clone(), last: i64::MIN, ids, has_ended: false })
    }

    fn next_message(&mut self) -> rusqlite::Result<Option<Message>> {
        // In the order of recording, which needs no index.
        let next = "SELECT id, timestamp, data FROM messages WHERE id > ?1 \
                    AND topic_id IN (SELECT id FROM topics WHERE name = ?2) ORDER BY id LIMIT 1";
        let mut statement = self.database.prepare(next)?;
        let row = statement.query_row(params![self.last, self.topic], |row| {
            let id: i64 = row.get(0)?;
            let [first, last] = self.ids.map(|id| id as f64);
            let part = ((id as f64 - first + 1.0) / (last - first + 1.0)).clamp(0.0, 1.0);
            Ok((id, Message { time_ns: row.get(1)?, part, data: row.get(2)? }))
        });
        Ok(row.optional()?.map(|(id, message)| {
            self.last = id;
            message
        }))
    }
}

impl Iterator for Messages {
    type Item = Result<Message, Problem>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.has_ended {
            return None;
        }
        let next = self.next_message().map_err(problem).transpose();
        self.has_ended = !matches!(next, Some(Ok(_)));
        next
    }
}

/// Opens a database that nobody writes, or that a recorder did not finish.
fn open(path: &Path, limits: &Limits) -> Result<Connection, Problem> {
    std::fs::File::open(path).map_err(Problem::Io)?;
    let mut uri = std::path::absolute(path).map_err(Problem::Io)?.to_string_lossy().into_owned();
    for (reserved, escaped) in RESERVED {
        uri = uri.replace(reserved, escaped);
    }
    // Without a journal, no lock is needed, which would be a new file beside the database.
    let has_journal = ["-wal", "-journal"].iter().any(|end| {
        let mut journal = path.as_os_str().to_owned();
        journal.push(end);
        PathBuf::from(journal).exists()
    });
    let uri = format!("file:{uri}?mode=ro{}", if has_journal { "" } else { "&immutable=1" });
    let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_URI;
    let database = Connection::open_with_flags(uri, flags).map_err(problem)?;
    let most = i32::try_from(limits.picture_bytes()).unwrap_or(i32::MAX);
    database.set_limit(Limit::SQLITE_LIMIT_LENGTH, most).map_err(problem)?;
    // A file that is shorter than it states is read as far as it goes; code in the schema is not run.
    let settings = "PRAGMA writable_schema = ON; PRAGMA trusted_schema = OFF; \
                    PRAGMA cell_size_check = ON;";
    database.execute_batch(settings).map_err(problem)?;
    let tables = "SELECT count(*) FROM sqlite_schema WHERE type = 'table' AND rootpage > 0 \
                  AND name IN ('topics', 'messages')";
    match database.query_row(tables, [], |row| row.get(0)).map_err(problem)? {
        2 => Ok(database),
        _ => Err(Problem::Damaged("not a bag of ROS 2: no topics and messages".to_owned())),
    }
}

fn problem(error: rusqlite::Error) -> Problem {
    let is_io = |code: ErrorCode| {
        matches!(
            code,
            ErrorCode::CannotOpen | ErrorCode::PermissionDenied | ErrorCode::DatabaseBusy
        )
    };
    match &error {
        rusqlite::Error::SqliteFailure(cause, _) if is_io(cause.code) => {
            Problem::Unsupported(error.to_string())
        }
        _ => Problem::Damaged(error.to_string()),
    }
}
