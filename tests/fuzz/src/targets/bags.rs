//! Bags: MCAP files and what lies beside them.

use std::{fs, path::Path, sync::LazyLock};

use lgvi_bag::{BagReader, Compression};

use super::{recovery::recovered, scratch};
use crate::sample;

/// The bytes are an MCAP file.
pub fn bag_reader(data: &[u8]) {
    let directory = scratch();
    let file = directory.path().join("bag_0.mcap");
    if fs::write(&file, data).is_ok() {
        read(&file);
    }
}

/// The bytes are records, of which an MCAP file is made whose framing is right: see [`file_of_records`].
pub fn bag_records(data: &[u8]) {
    bag_reader(&file_of_records(data));
}

/// The text is the `metadata.yaml` of a bag whose file, `bag_0.mcap`, is good. It is read, and recovered.
pub fn bag_metadata(data: &[u8]) {
    let directory = scratch();
    let written = fs::write(directory.path().join("metadata.yaml"), data)
        .and_then(|()| fs::write(directory.path().join("bag_0.mcap"), &*GOOD));
    if written.is_ok() {
        read(directory.path());
        recovered(directory.path(), &directory.path().join("recovered"));
    }
}

static GOOD: LazyLock<Vec<u8>> = LazyLock::new(|| match sample::bag(Compression::None) {
    Ok((_, file)) => file,
    Err(error) => panic!("no bag was made: {error}"),
});

fn read(path: &Path) {
    let bag = match BagReader::open(path) {
        Ok(bag) => bag,
        Err(error) => {
            let _ = error.to_string();
            return read_damaged(path);
        }
    };
    let (counts, times) = (bag.message_counts(), bag.times());
    let mut last = 0;
    for message in bag.messages() {
        match message {
            Ok(message) => {
                assert!(bag.topics().contains(message.topic));
                last = message.log_time;
            }
            Err(error) => {
                let _ = error.to_string();
                return;
            }
        }
    }
    let _ = (counts, times, bag.custom());
    for message in bag.messages_of(last, |_| true) {
        assert!(message.is_ok_and(|message| message.log_time >= last));
    }
}

/// Reads what is readable of a damaged bag.
fn read_damaged(path: &Path) {
    let (bag, faults) = match BagReader::open_damaged(path) {
        Ok(opened) => opened,
        Err(error) => return drop(error.to_string()),
    };
    for fault in faults {
        let _ = fault.to_string();
    }
    let _ = (bag.message_counts(), bag.times(), bag.custom());
    for message in bag.messages() {
        if let Err(error) = message {
            let _ = error.to_string();
        }
    }
}

/// Operation code of a chunk.
const CHUNK: u8 = 0x06;

/// Set in the operation code of what belongs into the summary.
const SUMMARY: u8 = 0x80;

/// An MCAP file of these records: each an operation code, the length of its body in two bytes, the body. Where the code has
/// the highest bit set the record goes into the summary. The body of a chunk is its compression (0 none, 1 zstd, 2 lz4,
/// anything else unknown), the sixteen bytes of its times and, if not compressed, again such records.
///
/// Header, indexes of the chunks, data end, footer and all lengths and offsets are right; checksums are left out, as the
/// format allows.
pub fn file_of_records(data: &[u8]) -> Vec<u8> {
    let mut file = mcap_magic().to_vec();
    let header = [text("ros2"), text("")].concat();
    push(&mut file, 0x01, &header);
    let mut summary = Vec::new();
    for (code, body) in Records(data) {
        match code {
            CHUNK => {
                let start = file.len() as u64;
                let Some((times, chunk)) = chunk(body) else {
                    continue;
                };
                push(&mut file, CHUNK, &chunk);
                let length = file.len() as u64 - start;
                let mut index = times.to_vec();
                index.extend(start.to_le_bytes());
                index.extend(length.to_le_bytes());
                push(&mut summary, 0x08, &index);
            }
            _ if code & SUMMARY != 0 => push(&mut summary, code & !SUMMARY, body),
            _ => push(&mut file, code, body),
        }
    }
    push(&mut file, 0x0f, &[0; 4]);
    let summary_start = file.len() as u64;
    file.extend(summary);
    let footer = [&summary_start.to_le_bytes()[..], &[0; 12]].concat();
    push(&mut file, 0x02, &footer);
    file.extend(mcap_magic());
    file
}

fn mcap_magic() -> [u8; 8] {
    *b"\x89MCAP0\r\n"
}

fn chunk(body: &[u8]) -> Option<(&[u8; 16], Vec<u8>)> {
    let (&compression, body) = body.split_first()?;
    let (times, body) = body.split_first_chunk::<16>()?;
    let (name, size, content) = match compression {
        0 => {
            let mut content = Vec::new();
            for (code, body) in Records(body) {
                push(&mut content, code, body);
            }
            ("", content.len() as u64, content)
        }
        _ => {
            let (size, content) = body.split_first_chunk::<8>()?;
            let name = match compression {
                1 => "zstd",
                2 => "lz4",
                _ => "bz2",
            };
            (name, u64::from_le_bytes(*size), content.to_vec())
        }
    };
    let mut chunk = times.to_vec();
    chunk.extend(size.to_le_bytes());
    chunk.extend([0; 4]);
    chunk.extend(text(name));
    chunk.extend((content.len() as u64).to_le_bytes());
    chunk.extend(content);
    Some((times, chunk))
}

fn push(file: &mut Vec<u8>, code: u8, body: &[u8]) {
    file.push(code);
    file.extend((body.len() as u64).to_le_bytes());
    file.extend(body);
}

fn text(text: &str) -> Vec<u8> {
    let mut field = (text.len() as u32).to_le_bytes().to_vec();
    field.extend(text.as_bytes());
    field
}

/// The records that the bytes hold; the last one may be cut off.
struct Records<'a>(&'a [u8]);

impl<'a> Iterator for Records<'a> {
    type Item = (u8, &'a [u8]);

    fn next(&mut self) -> Option<Self::Item> {
        let (&[code, low, high], left) = self.0.split_first_chunk::<3>()?;
        let length = usize::from(u16::from_le_bytes([low, high])).min(left.len());
        let (body, left) = left.split_at(length);
        self.0 = left;
        Some((code, body))
    }
}
