//! Bags of ROS 1: records of a header, with named fields, and data. Chunks contain compressed records; an index at the end
//! repeats the connections.
//!
//! Source: <https://wiki.ros.org/Bags/Format/2.0>.

use std::collections::BTreeMap;
use std::path::Path;

use deltille_files::limits::Limits;

use super::fields::Fields;
use super::message::{Dialect, Message};
use super::source::Source;
use super::topic::Topic;
use crate::problem::Problem;

/// First bytes of a file.
const MAGIC: &[u8; 13] = b"#ROSBAG V2.0\n";

/// Maximum length of a header, bytes: the longest field is the name of a topic.
const HEADER_BYTES: u32 = 1 << 16;

const MESSAGE: u8 = 2;
const BAG_HEADER: u8 = 3;
const CHUNK: u8 = 5;
const CONNECTION: u8 = 7;

/// Returns the topics from the index, or from all records if there is none.
pub(crate) fn topics(path: &Path, limits: &Limits) -> Result<Vec<Topic>, Problem> {
    let mut records = Records::open(path, limits)?;
    if records.index > 0 {
        // An index behind the end is missing, so all records are read.
        let _ = records.source.seek(records.index);
    }
    loop {
        match records.next_message() {
            Ok(Some(_)) => {}
            // The reader of the messages reports damage.
            Ok(None) => return Ok(records.connections.into_values().collect()),
            Err(Problem::Damaged(_)) if !records.connections.is_empty() => {
                return Ok(records.connections.into_values().collect());
            }
            Err(problem) => return Err(problem),
        }
    }
}

/// The messages of a topic.
pub(crate) struct Messages {
    records: Records,
    topic: String,
    has_ended: bool,
}

impl Messages {
    pub(crate) fn open(path: &Path, topic: &Topic, limits: &Limits) -> Result<Self, Problem> {
        let records = Records::open(path, limits)?;
        Ok(Self { records, topic: topic.name.clone(), has_ended: false })
    }
}

impl Iterator for Messages {
    type Item = Result<Message, Problem>;

    fn next(&mut self) -> Option<Self::Item> {
        while !self.has_ended {
            match self.records.next_message() {
                Ok(Some((connection, message))) => {
                    let topic = self.records.connections.get(&connection);
                    if topic.is_some_and(|topic| topic.name == self.topic) {
                        return Some(Ok(message));
                    }
                }
                Ok(None) => self.has_ended = true,
                Err(problem) => {
                    self.has_ended = true;
                    return Some(Err(problem));
                }
            }
        }
        None
    }
}

/// The records of a file, with the connections so far.
struct Records {
    source: Source,
    connections: BTreeMap<u32, Topic>,
    /// Position of the index; 0 if the recording was not finished.
    index: u64,
}

impl Records {
    /// Opens a file and reads its first record.
    fn open(path: &Path, limits: &Limits) -> Result<Self, Problem> {
        let mut source = Source::open(path, limits)?;
        if source.array().ok().as_ref() != Some(MAGIC) {
            return Err(Problem::Damaged("not a bag of ROS 1, version 2.0".to_owned()));
        }
        let mut records = Self { source, connections: BTreeMap::new(), index: 0 };
        let header = records.header()?;
        if operation(&header)? != BAG_HEADER {
            return Err(Problem::Damaged("the first record is not a bag header".to_owned()));
        }
        records.index = Fields::new(field(&header, "index_pos")?).u64()?;
        let padding = records.length()?;
        records.source.skip(padding.into())?;
        Ok(records)
    }

    /// Returns the next message and its connection; `None` at the end of the file.
    fn next_message(&mut self) -> Result<Option<(u32, Message)>, Problem> {
        loop {
            if self.source.is_at_end()? {
                return match self.index {
                    0 => Err(Problem::Damaged("the recording was not finished".to_owned())),
                    _ => Ok(None),
                };
            }
            let header = self.header()?;
            let length = self.length()?;
            let number = |name| Fields::new(field(&header, name)?).u32();
            match operation(&header)? {
                CONNECTION => {
                    let connection = number("conn")?;
                    let name = text(field(&header, "topic")?);
                    let own = self.source.bytes(length.into())?;
                    let type_name = text(field(&own, "type")?);
                    let topic = Topic { name, type_name, dialect: Dialect::Ros1 };
                    self.connections.insert(connection, topic);
                }
                MESSAGE => {
                    let mut time = Fields::new(field(&header, "time")?);
                    let [seconds, ns] = [time.u32()?, time.u32()?].map(i64::from);
                    let time_ns = Some(seconds * 1_000_000_000 + ns);
                    let data = self.source.bytes(length.into())?;
                    let part = self.source.part();
                    return Ok(Some((number("conn")?, Message { time_ns, part, data })));
                }
                CHUNK => {
                    let compression = text(field(&header, "compression")?);
                    let size = number("size")?;
                    self.source.enter(&compression, length.into(), size.into())?;
                }
                _ => self.source.skip(length.into())?,
            }
        }
    }

    fn length(&mut self) -> Result<u32, Problem> {
        Ok(u32::from_le_bytes(self.source.array()?))
    }

    fn header(&mut self) -> Result<Vec<u8>, Problem> {
        match self.length()? {
            length if length > HEADER_BYTES => {
                Err(Problem::Damaged("a record has no valid header".to_owned()))
            }
            length => self.source.bytes(length.into()),
        }
    }
}

/// Returns the value of a field `name=value` in a header.
fn field<'a>(header: &'a [u8], name: &str) -> Result<&'a [u8], Problem> {
    let mut fields = Fields::new(header);
    while !fields.is_at_end() {
        let field = fields.counted()?;
        let value = field.strip_prefix(name.as_bytes()).and_then(|rest| rest.strip_prefix(b"="));
        if let Some(value) = value {
            return Ok(value);
        }
    }
    Err(Problem::Damaged(format!("a record has no field {name}")))
}

fn operation(header: &[u8]) -> Result<u8, Problem> {
    Fields::new(field(header, "op")?).u8()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}
