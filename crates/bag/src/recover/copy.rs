//! Copies what is readable of a damaged file into one of the recovered bag.

use std::collections::BTreeMap;

use mcap::records::op;

use super::{
    LIMIT, PACKED_LIMIT, RecoverError,
    chunk::ChunkHeader,
    counts::Counts,
    definitions::Definitions,
    losses::Losses,
    original::Original,
    output::Output,
    scan::{PREFIX, Piece, Place, Scanner},
    source::Source,
    summary,
    twins::Twins,
};
use crate::{CUSTOM_DATA, REPEATED, metadata::RECORD, records::Statistics};

/// A file being copied.
pub(super) struct Copy<'a> {
    pub source: Source,
    pub output: Output,
    pub definitions: Definitions<'a>,
    pub counts: Counts,
    pub losses: Losses,
    /// What the file says of the bag.
    pub original: Option<Original>,
    /// The bag's custom data, if they were written after that.
    pub custom: Option<BTreeMap<String, String>>,
    /// Number of messages that the file's statistics tell.
    pub statistics: Option<u64>,
    /// Number of messages of each topic that the file says are repeated, if it does.
    pub repeated: Option<BTreeMap<String, u64>>,
    /// Whether this crate has written the file.
    pub is_ours: bool,
    /// Messages that no checksum covers.
    pub unverified: u64,
    /// Whether all definitions are known from the summary.
    pub has_summary: bool,
    /// Messages outside of chunks.
    pub loose: u64,
    /// Bytes that were taken for chunks in vain.
    wasted: u64,
}

impl<'a> Copy<'a> {
    /// `twins` are definitions of the bag's other files.
    pub fn new(source: Source, output: Output, twins: Option<&'a Twins>) -> Self {
        Self {
            losses: Losses::new(&source),
            source,
            output,
            definitions: Definitions::new(twins),
            counts: Counts::default(),
            original: None,
            custom: None,
            statistics: None,
            repeated: None,
            is_ours: false,
            unverified: 0,
            has_summary: false,
            loose: 0,
            wasted: 0,
        }
    }

    /// Copies all that can be read. Gives whether the file is one of MCAP at all.
    pub fn run(&mut self) -> Result<bool, RecoverError> {
        // In a complete file, what the summary says helps where the first chunk is damaged.
        if let Some(summary) = summary::read(&self.source)? {
            self.has_summary = true;
            for (opcode, body) in summary::records(&summary) {
                match opcode {
                    op::STATISTICS => {
                        let statistics = Statistics::parse(body);
                        self.statistics = statistics.ok().map(|found| found.message_count);
                    }
                    _ => {
                        let length = body.len() as u64;
                        let place = Place { offset: 0, length };
                        self.definition(opcode, body, place, true);
                    }
                }
            }
        }
        let (mut scanner, magic) = Scanner::new(&self.source)?;
        if !magic && self.source.size > 0 {
            let length = self.source.size.min(mcap::MAGIC.len() as u64);
            let place = Place { offset: 0, length };
            let reason = "the MCAP magic is damaged".to_owned();
            self.losses.leave_out(place, reason);
        }
        let mut found = magic;
        let mut data_end = None;
        while let Some(piece) = scanner.next(&mut self.source)? {
            found |= !matches!(piece, Piece::Damage { .. });
            match piece {
                Piece::Record {
                    opcode: op::MESSAGE_INDEX,
                    place,
                } => self.losses.count(&self.source, place)?,
                Piece::Record {
                    opcode: op::DATA_END,
                    place,
                } => data_end = Some(place),
                Piece::Record { opcode, place } if !scanner.in_summary => {
                    self.record(opcode, place)?
                }
                Piece::Damage { place, cut } if !scanner.in_summary => {
                    if !cut || !self.is_end(place.offset)? {
                        let reason = if cut {
                            "the file ends within a record"
                        } else {
                            "no record"
                        };
                        self.losses.leave_out(place, reason.into());
                    }
                }
                Piece::Record { .. } | Piece::Damage { .. } => {}
                Piece::Chunk {
                    header,
                    data,
                    start,
                    cut,
                    followed,
                } => {
                    self.chunk(&mut scanner, &header, data, start, cut, followed)?;
                }
            }
        }
        self.losses.settle();
        self.output.end_head()?;
        self.losses.file.complete = scanner.ended && magic;
        self.losses.file.messages = self.counts.total();
        if self.loose > 0 && !summary::data_are_sound(&mut self.source, data_end)? {
            self.unverified += self.loose;
        }
        // Topics that have no message.
        for channel in self.definitions.channels() {
            if let Some(topic) = self.definitions.topic(channel, &mut self.losses) {
                self.output.add_topic(topic)?;
            }
        }
        self.losses.settle();
        Ok(found)
    }

    fn chunk(
        &mut self,
        scanner: &mut Scanner,
        header: &ChunkHeader,
        data: Place,
        start: u64,
        cut: bool,
        followed: bool,
    ) -> Result<(), RecoverError> {
        self.output.packing.get_or_insert(header.packing);
        let end = data.offset + data.length;
        let whole = Place {
            offset: start,
            length: end - start,
        };
        let in_vain = !followed && !cut && self.wasted > self.source.size;
        if data.length > PACKED_LIMIT as u64 || in_vain {
            let reason = format!("a chunk of {} bytes, more than {PACKED_LIMIT}", data.length);
            self.drop_chunk(header, whole, reason);
            return Ok(());
        }
        let bytes = self.source.view(data.offset, data.length as usize)?;
        if cut {
            let records = header.unpack_start(bytes, data.offset);
            let left = self.records(&records, start, false)?;
            self.unverified += left.messages;
            let (reason, length) = match left.messages {
                0 => ("the file ends within a chunk".to_owned(), whole.length),
                kept => (
                    format!("the file ends within a chunk, behind {kept} messages"),
                    left.bytes,
                ),
            };
            let place = Place {
                offset: start,
                length,
            };
            self.losses.leave_out(place, reason);
            return Ok(());
        }
        match header.unpack(bytes) {
            Ok(records) => {
                self.losses.settle();
                self.losses.read(header.times);
                let seen = self.records(&records, start, header.checksum != 0)?;
                if header.checksum == 0 {
                    self.unverified += seen.messages;
                }
                if seen.bytes > 0 {
                    let place = Place {
                        offset: start,
                        length: seen.bytes,
                    };
                    let reason = "records of a chunk are damaged".to_owned();
                    self.losses.leave_out(place, reason);
                }
                Ok(())
            }
            Err(reason) => {
                let place = if followed {
                    whole
                } else {
                    self.wasted += data.length;
                    scanner.retry(&mut self.source, start)?
                };
                self.drop_chunk(header, place, reason);
                Ok(())
            }
        }
    }

    fn drop_chunk(&mut self, header: &ChunkHeader, place: Place, reason: String) {
        self.losses.leave_out(place, reason);
        self.losses.of_chunk(header.times);
    }

    /// Whether a record that the end of the file has cut off is of those that tell of the data only: an index, what rosbag2
    /// puts behind the data, custom data, a definition or a mark, of which there would be no messages.
    fn is_end(&self, offset: u64) -> Result<bool, RecoverError> {
        const BEFORE: usize = PREFIX as usize + 4;
        const NAMES: [&str; 3] = [RECORD.0, REPEATED, CUSTOM_DATA];
        let (bytes, known) = self.source.peek::<{ BEFORE + CUSTOM_DATA.len() }>(offset)?;
        let name = bytes[..known].get(BEFORE..).unwrap_or_default();
        let is_name = |full: &str| {
            full.as_bytes()
                .starts_with(&name[..name.len().min(full.len())])
        };
        Ok(match bytes[0] {
            op::MESSAGE_INDEX | op::DATA_END | op::FOOTER => true,
            op::SCHEMA | op::CHANNEL => {
                let length = bytes[1..].first_chunk().copied().map(u64::from_le_bytes);
                length.is_some_and(|length| length <= LIMIT as u64)
            }
            op::METADATA => NAMES.into_iter().any(is_name),
            _ => false,
        })
    }
}
