//! MCAP: records of an opcode, a length of 64 bits, and content. Schemas and channels precede the messages that refer to
//! them; chunks contain compressed records; a summary repeats schemas and channels at the end.
//!
//! Source: <https://mcap.dev/spec>.

use std::collections::BTreeMap;
use std::path::Path;

use deltille_files::limits::Limits;

use super::fields::Fields;
use super::message::{Dialect, Message};
use super::source::Source;
use super::topic::Topic;
use crate::problem::Problem;

/// First and last bytes of a file.
const MAGIC: &[u8; 8] = b"\x89MCAP0\r\n";

/// Bytes from the footer's content to the end of the file: two offsets, a checksum and the magic bytes.
const FOOTER_BYTES: u64 = 8 + 8 + 4 + 8;

const FOOTER: u8 = 2;
const SCHEMA: u8 = 3;
const CHANNEL: u8 = 4;
const MESSAGE: u8 = 5;
const CHUNK: u8 = 6;
const DATA_END: u8 = 15;

/// Returns the topics from the summary, or from all records if there is none.
pub(crate) fn topics(path: &Path, limits: &Limits) -> Result<Vec<Topic>, Problem> {
    let mut records = Records::open(path, limits)?;
    let start = records.summary().ok().flatten().unwrap_or(MAGIC.len() as u64);
    records.source.seek(start)?;
    loop {
        match records.next_message() {
            Ok(Some(_)) => {}
            // The reader of the messages reports damage.
            Ok(None) => return Ok(records.topics()),
            Err(Problem::Damaged(_)) if !records.channels.is_empty() => return Ok(records.topics()),
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
                Ok(Some((channel, message))) => {
                    let channel = self.records.channels.get(&channel);
                    if channel.is_some_and(|channel| channel.topic == self.topic) {
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

struct Channel {
    schema: u16,
    topic: String,
    encoding: String,
}

/// The records of a file, with the schemas and channels so far.
struct Records {
    source: Source,
    schemas: BTreeMap<u16, String>,
    channels: BTreeMap<u16, Channel>,
}

impl Records {
    fn open(path: &Path, limits: &Limits) -> Result<Self, Problem> {
        let mut source = Source::open(path, limits)?;
        if source.array().ok().as_ref() != Some(MAGIC) {
            return Err(Problem::Damaged("not an MCAP file".to_owned()));
        }
        Ok(Self { source, schemas: BTreeMap::new(), channels: BTreeMap::new() })
    }

    /// Returns the position of the summary, if the file was finished.
    fn summary(&mut self) -> Result<Option<u64>, Problem> {
        let footer = self.source.length().checked_sub(FOOTER_BYTES).ok_or_else(Problem::cut_off)?;
        self.source.seek(footer)?;
        let footer: [u8; FOOTER_BYTES as usize] = self.source.array()?;
        let start = Fields::new(&footer).u64()?;
        Ok((start > 0 && footer.ends_with(MAGIC)).then_some(start))
    }

    fn topics(&self) -> Vec<Topic> {
        let topics = self.channels.values().filter_map(|channel| {
            let dialect = match channel.encoding.as_str() {
                "cdr" => Dialect::Cdr,
                "ros1" => Dialect::Ros1,
                _ => return None,
            };
            let type_name = self.schemas.get(&channel.schema).cloned().unwrap_or_default();
            Some(Topic { name: channel.topic.clone(), type_name, dialect })
        });
        topics.collect()
    }

    /// Returns the next message and its channel; `None` at the end of the data.
    fn next_message(&mut self) -> Result<Option<(u16, Message)>, Problem> {
        loop {
            if self.source.is_at_end()? {
                return Err(Problem::Damaged("the recording was not finished".to_owned()));
            }
            let [opcode, length @ ..] = self.source.array::<9>()?;
            let length = u64::from_le_bytes(length);
            if matches!(opcode, DATA_END | FOOTER) {
                return Ok(None);
            }
            match opcode {
                SCHEMA | CHANNEL | MESSAGE => {}
                CHUNK => {
                    self.enter()?;
                    continue;
                }
                _ => {
                    self.source.skip(length)?;
                    continue;
                }
            }
            let content = self.source.bytes(length)?;
            let mut fields = Fields::new(&content);
            match opcode {
                SCHEMA => {
                    self.schemas.insert(fields.u16()?, fields.text()?);
                }
                CHANNEL => {
                    let (id, schema) = (fields.u16()?, fields.u16()?);
                    let (topic, encoding) = (fields.text()?, fields.text()?);
                    self.channels.insert(id, Channel { schema, topic, encoding });
                }
                _ => {
                    let (channel, _sequence) = (fields.u16()?, fields.u32()?);
                    let (logged, _published) = (fields.u64()?, fields.u64()?);
                    let start = fields.position();
                    let time_ns = i64::try_from(logged).ok();
                    let mut data = content;
                    data.drain(..start);
                    let part = self.source.part();
                    return Ok(Some((channel, Message { time_ns, part, data })));
                }
            }
        }
    }

    /// Enters a chunk: first and last time, size, checksum, compression, and records.
    fn enter(&mut self) -> Result<(), Problem> {
        let head: [u8; 32] = self.source.array()?;
        let mut head = Fields::new(&head);
        let (_first, _last) = (head.u64()?, head.u64()?);
        let (size, checksum, length) = (head.u64()?, head.u32()?, head.u32()?);
        let compression = self.source.bytes(length.into())?;
        let length = u64::from_le_bytes(self.source.array()?);
        self.source.enter(&String::from_utf8_lossy(&compression), length, size)?;
        let is_right = |chunk| checksum == 0 || crc32fast::hash(chunk) == checksum;
        match self.source.whole_chunk().is_none_or(is_right) {
            true => Ok(()),
            false => Err(Problem::Damaged("a chunk has a wrong checksum".to_owned())),
        }
    }
}
