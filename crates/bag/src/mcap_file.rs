//! One MCAP file of a bag.
//!
//! A section is taken as a whole and only if its checksum is right, and no length found in the file is believed beyond
//! [`MAX_RECORD_LENGTH`].

use std::{
    collections::BTreeMap,
    fs::File,
    io::{self, Read, Seek, SeekFrom},
    ops::ControlFlow,
    path::{Path, PathBuf},
};

use mcap::{
    MAGIC, McapError,
    records::op,
    sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions},
};

use crate::{
    BagError, Damage, PROFILE, Qos, SCHEMA_ENCODING, SERIALIZATION_FORMAT, Topic, channel_key,
    records::{Channel, ChunkIndex, Footer, Header, Message, Schema, Statistics},
};

/// Longest record that is read: far above any message of lgvi, and an image of 4K still fits.
const MAX_RECORD_LENGTH: usize = 64 << 20;

/// Bytes read from the file at once.
const READ_LENGTH: usize = 64 << 10;

/// Operation code and length before each record's body.
const RECORD_PREFIX: usize = 1 + 8;

/// The data end record lies right before the summary.
const DATA_END_LENGTH: u64 = RECORD_PREFIX as u64 + 4;

/// The footer record holds two offsets and a checksum and lies right before the end magic.
const FOOTER_LENGTH: u64 = RECORD_PREFIX as u64 + 8 + 8 + 4;

const MAGIC_LENGTH: u64 = MAGIC.len() as u64;

/// An MCAP file, of which the summary is in memory.
pub(crate) struct McapFile {
    path: PathBuf,
    /// Topics by channel.
    pub topics: BTreeMap<u16, Topic>,
    /// What can be read at once.
    pub spans: Vec<Span>,
    statistics: Option<Statistics>,
}

/// A part of the file that is read at once: a chunk, or everything before the summary if the file has no chunk index.
#[derive(Clone, Copy)]
pub(crate) struct Span {
    /// No message in it is earlier (ns).
    pub start_time: u64,
    pub offset: u64,
    length: u64,
}

#[derive(Default)]
struct Summary {
    schemas: BTreeMap<u16, Schema>,
    channels: Vec<Channel>,
    chunks: Vec<ChunkIndex>,
    statistics: Option<Statistics>,
}

impl McapFile {
    /// Reads header and summary.
    pub fn open(path: &Path) -> Result<Self, BagError> {
        let source = Source::open(path)?;
        source.check_header()?;
        let summary_start = source.read_footer()?;
        let summary = source.read_summary(summary_start)?;
        let topics = summary
            .channels
            .iter()
            .map(|channel| {
                Ok((
                    channel.id,
                    source.topic(channel, &summary.schemas, summary_start)?,
                ))
            })
            .collect::<Result<_, BagError>>()?;
        Ok(Self {
            path: path.to_owned(),
            topics,
            spans: source.spans(&summary.chunks, summary_start)?,
            statistics: summary.statistics,
        })
    }

    /// Number of messages of each channel, if the file tells.
    pub fn message_counts(&self) -> Option<&BTreeMap<u16, u64>> {
        self.statistics
            .as_ref()
            .map(|statistics| &statistics.channel_message_counts)
    }

    /// First and last log time (ns), if the file tells and has messages.
    pub fn times(&self) -> Option<(u64, u64)> {
        self.statistics
            .as_ref()
            .filter(|statistics| statistics.message_count > 0)
            .map(|statistics| (statistics.start_time, statistics.end_time))
    }

    /// All messages of a span, in the order of the file.
    pub fn read(&self, span: Span) -> Result<Vec<Message>, BagError> {
        let source = Source::open(&self.path)?;
        let whole = span.offset == 0;
        if !whole {
            source.check_chunk(span)?;
        }
        let options = options()
            .with_skip_start_magic(!whole)
            .with_skip_end_magic(true)
            .with_validate_chunk_crcs(true)
            .with_validate_data_section_crc(whole);
        let mut messages = Vec::new();
        source.visit(span.offset, span.length, options, |opcode, body| {
            if opcode == op::MESSAGE {
                let message = Message::parse(body)?;
                if !self.topics.contains_key(&message.channel) {
                    let Message {
                        sequence, channel, ..
                    } = message;
                    return Err(Damage::UnknownChannel { sequence, channel });
                }
                messages.push(message);
            }
            Ok(ControlFlow::Continue(()))
        })?;
        Ok(messages)
    }
}

/// The open file.
struct Source<'a> {
    path: &'a Path,
    file: File,
    size: u64,
}

impl<'a> Source<'a> {
    fn open(path: &'a Path) -> Result<Self, BagError> {
        let open = || {
            let file = File::open(path)?;
            let size = file.metadata()?.len();
            Ok(Self { path, file, size })
        };
        open().map_err(|source| BagError::Io {
            path: path.to_owned(),
            source,
        })
    }

    /// The file from `offset` on, at most `length` bytes.
    fn section(&self, offset: u64, length: u64) -> Result<impl Read, BagError> {
        let mut file = &self.file;
        file.seek(SeekFrom::Start(offset))
            .map_err(|source| self.io_error(source))?;
        Ok(file.take(length))
    }

    fn bytes(&self, offset: u64, length: u64) -> Result<Vec<u8>, BagError> {
        let mut bytes = Vec::new();
        self.section(offset, length)?
            .read_to_end(&mut bytes)
            .map_err(|source| self.io_error(source))?;
        Ok(bytes)
    }

    fn check_header(&self) -> Result<(), BagError> {
        let found = self.bytes(0, MAGIC_LENGTH)?;
        if found != MAGIC {
            return Err(if MAGIC.starts_with(&found) {
                self.truncated("the MCAP magic", 0, found)
            } else {
                BagError::NotMcap {
                    file: self.path.to_owned(),
                    found,
                }
            });
        }
        let mut found = String::new();
        self.visit(MAGIC_LENGTH, self.size, options(), |opcode, body| {
            if opcode == op::HEADER {
                found = Header::parse(body)?.profile;
            }
            Ok(ControlFlow::Break(()))
        })?;
        if found != PROFILE {
            return Err(BagError::Profile {
                file: self.path.to_owned(),
                found,
                expected: PROFILE,
            });
        }
        Ok(())
    }

    /// The offset at which the summary starts.
    fn read_footer(&self) -> Result<u64, BagError> {
        let end_magic = self.size.saturating_sub(MAGIC_LENGTH);
        let found = self.bytes(end_magic, MAGIC_LENGTH)?;
        if found != MAGIC {
            return Err(self.truncated("the MCAP end magic", end_magic, found));
        }
        let footer = end_magic.saturating_sub(FOOTER_LENGTH);
        let record = self.bytes(footer, FOOTER_LENGTH)?;
        let Some((&[op::FOOTER, ..], body)) = record.split_first_chunk::<RECORD_PREFIX>() else {
            return Err(self.truncated("the footer record", footer, record));
        };
        let Footer { summary_start } =
            Footer::parse(body).map_err(|damage| self.damaged(footer, damage))?;
        if summary_start == 0 {
            return Err(BagError::NoSummary {
                file: self.path.to_owned(),
            });
        }
        if !(MAGIC_LENGTH + DATA_END_LENGTH..footer).contains(&summary_start) {
            let length = footer.saturating_sub(summary_start);
            let damage = Damage::OutOfRange {
                record: "footer",
                offset: summary_start,
                length,
                end: footer,
            };
            return Err(self.damaged(footer, damage));
        }
        Ok(summary_start)
    }

    fn read_summary(&self, start: u64) -> Result<Summary, BagError> {
        let mut summary = Summary::default();
        // The reader starts the checksum of the summary at the data end record.
        let start = start - DATA_END_LENGTH;
        let options = options().with_validate_summary_section_crc(true);
        self.visit(start, self.size - start, options, |opcode, body| {
            match opcode {
                op::SCHEMA => {
                    let schema = Schema::parse(body)?;
                    summary.schemas.insert(schema.id, schema);
                }
                op::CHANNEL => summary.channels.push(Channel::parse(body)?),
                op::CHUNK_INDEX => summary.chunks.push(ChunkIndex::parse(body)?),
                op::STATISTICS => summary.statistics = Some(Statistics::parse(body)?),
                _ => {}
            }
            Ok(ControlFlow::Continue(()))
        })?;
        Ok(summary)
    }

    fn topic(
        &self,
        channel: &Channel,
        schemas: &BTreeMap<u16, Schema>,
        summary_start: u64,
    ) -> Result<Topic, BagError> {
        let (file, topic) = (self.path.to_owned(), channel.topic.clone());
        if channel.encoding != SERIALIZATION_FORMAT {
            return Err(BagError::Encoding {
                file,
                topic,
                field: "message encoding",
                found: channel.encoding.clone(),
                expected: SERIALIZATION_FORMAT,
            });
        }
        let Some(schema) = schemas.get(&channel.schema) else {
            let damage = Damage::UnknownSchema {
                channel: channel.id,
                schema: channel.schema,
            };
            return Err(self.damaged(summary_start, damage));
        };
        if schema.encoding != SCHEMA_ENCODING {
            return Err(BagError::Encoding {
                file,
                topic,
                field: "schema encoding",
                found: schema.encoding.clone(),
                expected: SCHEMA_ENCODING,
            });
        }
        let metadata = |key| channel.metadata.get(key).map_or("", String::as_str);
        let qos = Qos::from_yaml(metadata(channel_key::QOS));
        Ok(Topic {
            name: channel.topic.clone(),
            type_name: schema.name.clone(),
            type_hash: metadata(channel_key::TYPE_HASH).to_owned(),
            definition: String::from_utf8_lossy(&schema.data).into_owned(),
            qos: qos.map_err(|source| BagError::Qos {
                file,
                topic,
                source,
            })?,
        })
    }

    fn spans(&self, chunks: &[ChunkIndex], summary_start: u64) -> Result<Vec<Span>, BagError> {
        if chunks.is_empty() {
            return Ok(vec![Span {
                start_time: 0,
                offset: 0,
                length: summary_start,
            }]);
        }
        chunks
            .iter()
            .map(
                |&ChunkIndex {
                     start_time,
                     offset,
                     length,
                 }| {
                    if offset
                        .checked_add(length)
                        .is_none_or(|end| end > summary_start)
                    {
                        let damage = Damage::OutOfRange {
                            record: "chunk index",
                            offset,
                            length,
                            end: summary_start,
                        };
                        return Err(self.damaged(summary_start, damage));
                    }
                    Ok(Span {
                        start_time,
                        offset,
                        length,
                    })
                },
            )
            .collect()
    }

    /// The reader would take what is no chunk for a record of no interest.
    fn check_chunk(&self, Span { offset, length, .. }: Span) -> Result<(), BagError> {
        let found = self.bytes(offset, RECORD_PREFIX as u64)?;
        let body = length.saturating_sub(RECORD_PREFIX as u64);
        let expected = [&[op::CHUNK], &body.to_le_bytes()[..]].concat();
        if found != expected {
            return Err(self.damaged(offset, Damage::NotChunk { expected, found }));
        }
        Ok(())
    }

    /// Calls `visit` with operation code and body of each record of a section, those within chunks included.
    fn visit(
        &self,
        offset: u64,
        length: u64,
        options: LinearReaderOptions,
        mut visit: impl FnMut(u8, &[u8]) -> Result<ControlFlow<()>, Damage>,
    ) -> Result<(), BagError> {
        let damaged = |damage| self.damaged(offset, damage);
        let mut section = self.section(offset, length)?;
        let mut reader = LinearReader::new_with_options(options);
        while let Some(event) = reader.next_event() {
            match event.map_err(|error| self.reader_error(offset, error))? {
                LinearReadEvent::ReadRequest(length) => {
                    let buffer = reader.insert(length.min(READ_LENGTH));
                    let read = section
                        .read(buffer)
                        .map_err(|source| self.io_error(source))?;
                    reader.notify_read(read);
                }
                LinearReadEvent::Record { opcode, data } => {
                    if visit(opcode, data).map_err(damaged)?.is_break() {
                        break;
                    }
                }
            }
        }
        Ok(())
    }

    fn reader_error(&self, offset: u64, error: McapError) -> BagError {
        match error {
            McapError::UnsupportedCompression(found) => BagError::ChunkCompression {
                file: self.path.to_owned(),
                found,
            },
            error => self.damaged(offset, error.into()),
        }
    }

    fn io_error(&self, source: io::Error) -> BagError {
        BagError::Io {
            path: self.path.to_owned(),
            source,
        }
    }

    fn damaged(&self, offset: u64, source: Damage) -> BagError {
        BagError::Damaged {
            file: self.path.to_owned(),
            offset,
            source,
        }
    }

    fn truncated(&self, expected: &'static str, offset: u64, found: Vec<u8>) -> BagError {
        BagError::Truncated {
            file: self.path.to_owned(),
            expected,
            offset,
            found,
            size: self.size,
        }
    }
}

fn options() -> LinearReaderOptions {
    LinearReaderOptions::default()
        .with_skip_start_magic(true)
        .with_record_length_limit(MAX_RECORD_LENGTH)
}
