//! A file read once from its start, in memory of a chunk: of one that does not tell what is in it, or to check it.

use std::ops::ControlFlow;

use mcap::{
    records::{ChunkHeader, MessageHeader, Record, op},
    sans_io::linear_reader::LinearReaderOptions,
};

use super::{
    MAX_RECORD_LENGTH,
    chunk::unpack,
    contents::{Contents, Span},
    source::Source,
};
use crate::{
    BagError, Damage, REPEATED,
    error::limited,
    record::{self, PREFIX, parse, records},
    times::{Times, around, widen},
};

/// Length from which on messages that lie outside of chunks are no longer read together.
const RUN_LENGTH: u64 = 1 << 20;

/// What is in the data section of a file, up to the first fault.
pub(crate) fn scan(source: &Source) -> (Contents, Option<BagError>) {
    let options = LinearReaderOptions::default().with_validate_data_section_crc(true);
    let mut scan = Scan::default();
    let walked = source.walk(None, options, |offset, opcode, body| {
        scan.take(offset, opcode, body)?;
        Ok(match opcode {
            op::DATA_END => ControlFlow::Break(()),
            _ => ControlFlow::Continue(()),
        })
    });
    scan.end_run();
    (scan.contents, walked.err())
}

/// The first thing that is wrong with a file: in a checksum, a record, or in what the summary tells, which is `known`.
pub(crate) fn check(source: &Source, known: &Contents) -> Result<(), BagError> {
    let options = LinearReaderOptions::default()
        .with_validate_data_section_crc(true)
        .with_validate_summary_section_crc(true)
        .with_check_finishes_after_end_magic(true);
    let mut scan = Scan::default();
    source.walk(None, options, |offset, opcode, body| {
        scan.take(offset, opcode, body).map(ControlFlow::Continue)
    })?;
    scan.end_run();
    let agreed = known.agree_with(&scan.contents);
    agreed.map_err(|damage| source.damaged(0, damage))
}

#[derive(Default)]
struct Scan {
    contents: Contents,
    /// Messages outside of chunks that are read together.
    run: Option<Span>,
}

impl Scan {
    fn take(&mut self, offset: u64, opcode: u8, body: &[u8]) -> Result<(), Damage> {
        let length = (PREFIX + body.len()) as u64;
        match opcode {
            op::CHUNK | op::ATTACHMENT => self.end_run(),
            _ => drop(limited(opcode, body.len() as u64, MAX_RECORD_LENGTH)?),
        }
        match parse(opcode, body)? {
            Record::Message { header, .. } => {
                self.count(&header)?;
                self.add_to_run(offset, length, header.log_time);
            }
            Record::Chunk { header, data } => {
                let times = self.chunk(&header, &data)?;
                self.contents.spans.extend(times.map(|times| Span {
                    times,
                    offset,
                    length,
                    is_chunk: true,
                    channels: None,
                }));
            }
            Record::Metadata(metadata) if metadata.name == REPEATED => {
                self.contents.repeated = record::repeated(metadata)?;
            }
            record => self.define(record, body.len())?,
        }
        Ok(())
    }

    /// Takes a record if it is a definition.
    fn define(&mut self, record: Record<'_>, length: usize) -> Result<(), Damage> {
        if let Record::Channel(channel) = &record
            && channel.schema_id != 0
            && !self.contents.schemas.contains_key(&channel.schema_id)
        {
            return Err(Damage::undefined("schema", channel.schema_id));
        }
        self.contents.define(record, length)
    }

    /// Counts a message, whose channel has to be known.
    fn count(&mut self, header: &MessageHeader) -> Result<(), Damage> {
        let id = header.channel_id;
        if !self.contents.channels.contains_key(&id) {
            return Err(Damage::undefined("channel", id));
        }
        *self.contents.counts.entry(id).or_default() += 1;
        widen(&mut self.contents.times, header.log_time);
        Ok(())
    }

    fn add_to_run(&mut self, offset: u64, length: u64, log_time: u64) {
        let run = self.run.get_or_insert(Span {
            times: (log_time, log_time),
            offset,
            length: 0,
            is_chunk: false,
            channels: None,
        });
        run.times = (run.times.0.min(log_time), run.times.1.max(log_time));
        run.length = offset + length - run.offset;
        if run.length >= RUN_LENGTH {
            self.end_run();
        }
    }

    fn end_run(&mut self) {
        self.contents.spans.extend(self.run.take());
    }

    /// Takes the definitions and messages of a chunk, and gives the times of these.
    fn chunk(&mut self, header: &ChunkHeader, packed: &[u8]) -> Result<Times, Damage> {
        let bytes = unpack(header, packed)?;
        let before = self.contents.times.take();
        let read = records(&bytes).try_for_each(|record| {
            let (opcode, place) = record?;
            let body = &bytes[place];
            limited(opcode, body.len() as u64, MAX_RECORD_LENGTH)?;
            match opcode {
                op::SCHEMA | op::CHANNEL => self.define(parse(opcode, body)?, body.len()),
                op::MESSAGE => self.count(&record::message(body)?.0),
                _ => Ok(()),
            }
        });
        let times = self.contents.times;
        self.contents.times = around(before.into_iter().chain(times));
        read?;
        let (packed, unpacked) = (header.compressed_size, header.uncompressed_size);
        self.contents
            .add_chunk(&header.compression, packed, unpacked);
        Ok(times)
    }
}
