//! Bodies of the MCAP records that are read.
//!
//! The parser of the mcap crate reserves as much memory as a damaged length asks for and can panic on a damaged
//! attachment; this one believes no length beyond the record's end.

use std::collections::BTreeMap;

use crate::error::Damage;

pub(crate) struct Header {
    pub profile: String,
}

pub(crate) struct Footer {
    /// Zero if there is no summary.
    pub summary_start: u64,
    /// Zero if it was not computed.
    pub summary_checksum: u32,
}

pub(crate) struct DataEnd {
    /// Zero if it was not computed.
    pub checksum: u32,
}

#[derive(Clone, PartialEq, Eq)]
pub(crate) struct Schema {
    pub id: u16,
    pub name: String,
    pub encoding: String,
    pub data: Vec<u8>,
}

#[derive(Clone, PartialEq, Eq)]
pub(crate) struct Channel {
    pub id: u16,
    /// Zero if it has none.
    pub schema: u16,
    pub topic: String,
    pub encoding: String,
    pub metadata: BTreeMap<String, String>,
}

pub(crate) struct MessageHeader {
    pub channel: u16,
    pub sequence: u32,
    pub log_time: u64,
    pub publish_time: u64,
}

pub(crate) struct ChunkHeader {
    /// First and last log time (ns).
    pub times: (u64, u64),
    /// Of the records (bytes).
    pub length: u64,
    /// Of the records; zero if it was not computed.
    pub checksum: u32,
    pub compression: String,
    /// Bytes in the file.
    pub packed_length: u64,
}

pub(crate) struct ChunkIndex {
    /// No message of the chunk is earlier (ns).
    pub start_time: u64,
    /// No message of the chunk is later (ns).
    pub end_time: u64,
    pub offset: u64,
    pub length: u64,
    /// Channels of which the chunk's messages are indexed.
    pub channels: Vec<u16>,
    pub compression: String,
    pub packed_length: u64,
    pub unpacked_length: u64,
}

pub(crate) struct Metadata {
    pub name: String,
    pub entries: BTreeMap<String, String>,
}

pub(crate) struct MetadataIndex {
    pub offset: u64,
    pub length: u64,
    pub name: String,
}

pub(crate) struct Statistics {
    pub message_count: u64,
    pub chunk_count: u32,
    pub start_time: u64,
    pub end_time: u64,
    /// Number of messages of each channel that has any.
    pub channel_message_counts: BTreeMap<u16, u64>,
}

impl Header {
    pub fn parse(body: &[u8]) -> Result<Self, Damage> {
        let mut fields = Fields::new("header", body);
        Ok(Self {
            profile: fields.string()?,
        })
    }
}

impl Footer {
    pub fn parse(body: &[u8]) -> Result<Self, Damage> {
        let mut fields = Fields::new("footer", body);
        let summary_start = fields.u64()?;
        let _offsets_start = fields.u64()?;
        Ok(Self {
            summary_start,
            summary_checksum: fields.u32()?,
        })
    }
}

impl DataEnd {
    pub fn parse(body: &[u8]) -> Result<Self, Damage> {
        Ok(Self {
            checksum: Fields::new("data end", body).u32()?,
        })
    }
}

impl Schema {
    pub fn parse(body: &[u8]) -> Result<Self, Damage> {
        let mut fields = Fields::new("schema", body);
        Ok(Self {
            id: fields.u16()?,
            name: fields.string()?,
            encoding: fields.string()?,
            data: fields.bytes()?.to_vec(),
        })
    }
}

impl Channel {
    pub fn parse(body: &[u8]) -> Result<Self, Damage> {
        let mut fields = Fields::new("channel", body);
        Ok(Self {
            id: fields.u16()?,
            schema: fields.u16()?,
            topic: fields.string()?,
            encoding: fields.string()?,
            metadata: fields.map(|entry| Ok((entry.string()?, entry.string()?)))?,
        })
    }
}

impl MessageHeader {
    pub const LENGTH: usize = 2 + 4 + 8 + 8;

    /// The header of a message, and its data.
    pub fn parse(body: &[u8]) -> Result<(Self, &[u8]), Damage> {
        let mut fields = Fields::new("message", body);
        let header = Self {
            channel: fields.u16()?,
            sequence: fields.u32()?,
            log_time: fields.u64()?,
            publish_time: fields.u64()?,
        };
        Ok((header, fields.left))
    }
}

impl ChunkHeader {
    /// Bytes before the compression's name.
    pub const FIXED: usize = 8 + 8 + 8 + 4 + 4;

    /// Length of the compression's name.
    pub fn name_length(fixed: &[u8]) -> Result<usize, Damage> {
        let mut fields = Fields::new("chunk", fixed);
        fields.take(Self::FIXED - size_of::<u32>())?;
        fields.u32().map(|length| length as usize)
    }

    pub fn parse(body: &[u8]) -> Result<Self, Damage> {
        let mut fields = Fields::new("chunk", body);
        Ok(Self {
            times: (fields.u64()?, fields.u64()?),
            length: fields.u64()?,
            checksum: fields.u32()?,
            compression: fields.string()?,
            packed_length: fields.u64()?,
        })
    }
}

impl ChunkIndex {
    pub fn parse(body: &[u8]) -> Result<Self, Damage> {
        let mut fields = Fields::new("chunk index", body);
        let [start_time, end_time] = [fields.u64()?, fields.u64()?];
        let [offset, length] = [fields.u64()?, fields.u64()?];
        let indexes = fields.map(|entry| Ok((entry.u16()?, entry.u64()?)))?;
        let _indexes_length = fields.u64()?;
        Ok(Self {
            start_time,
            end_time,
            offset,
            length,
            channels: indexes.into_keys().collect(),
            compression: fields.string()?,
            packed_length: fields.u64()?,
            unpacked_length: fields.u64()?,
        })
    }
}

impl Metadata {
    pub fn parse(body: &[u8]) -> Result<Self, Damage> {
        let mut fields = Fields::new("metadata", body);
        Ok(Self {
            name: fields.string()?,
            entries: fields.map(|entry| Ok((entry.string()?, entry.string()?)))?,
        })
    }

    /// The entries as numbers.
    pub fn counts(self) -> Result<BTreeMap<String, u64>, Damage> {
        let counts = self.entries.into_iter().map(|(key, value)| {
            value
                .parse()
                .map(|count: u32| (key.clone(), count.into()))
                .map_err(|_| Damage::NotCount { key, value })
        });
        counts.collect()
    }
}

impl MetadataIndex {
    pub fn parse(body: &[u8]) -> Result<Self, Damage> {
        let mut fields = Fields::new("metadata index", body);
        Ok(Self {
            offset: fields.u64()?,
            length: fields.u64()?,
            name: fields.string()?,
        })
    }
}

impl Statistics {
    pub fn parse(body: &[u8]) -> Result<Self, Damage> {
        let mut fields = Fields::new("statistics", body);
        let message_count = fields.u64()?;
        let _schemas = fields.u16()?;
        let [_channels, _attachments, _metadata] = [fields.u32()?, fields.u32()?, fields.u32()?];
        Ok(Self {
            message_count,
            chunk_count: fields.u32()?,
            start_time: fields.u64()?,
            end_time: fields.u64()?,
            channel_message_counts: fields.map(|entry| Ok((entry.u16()?, entry.u64()?)))?,
        })
    }
}

/// The fields of a record that are still to be read.
pub(crate) struct Fields<'a> {
    record: &'static str,
    pub left: &'a [u8],
}

impl<'a> Fields<'a> {
    pub fn new(record: &'static str, left: &'a [u8]) -> Self {
        Self { record, left }
    }

    fn take(&mut self, needed: usize) -> Result<&'a [u8], Damage> {
        let Some((field, left)) = self.left.split_at_checked(needed) else {
            return Err(Damage::Short {
                record: self.record,
                needed,
                left: self.left.len(),
            });
        };
        self.left = left;
        Ok(field)
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N], Damage> {
        let mut array = [0; N];
        array.copy_from_slice(self.take(N)?);
        Ok(array)
    }

    pub fn u16(&mut self) -> Result<u16, Damage> {
        self.array().map(u16::from_le_bytes)
    }

    pub fn u32(&mut self) -> Result<u32, Damage> {
        self.array().map(u32::from_le_bytes)
    }

    pub fn u64(&mut self) -> Result<u64, Damage> {
        self.array().map(u64::from_le_bytes)
    }

    fn bytes(&mut self) -> Result<&'a [u8], Damage> {
        let length = self.u32()?;
        self.take(length as usize)
    }

    pub fn string(&mut self) -> Result<String, Damage> {
        let text = std::str::from_utf8(self.bytes()?);
        text.map(str::to_owned).map_err(|source| Damage::NotUtf8 {
            record: self.record,
            source,
        })
    }

    pub fn map<K: Ord, V>(
        &mut self,
        mut entry: impl FnMut(&mut Self) -> Result<(K, V), Damage>,
    ) -> Result<BTreeMap<K, V>, Damage> {
        let mut entries = Self::new(self.record, self.bytes()?);
        let mut map = BTreeMap::new();
        while !entries.left.is_empty() {
            map.extend([entry(&mut entries)?]);
        }
        Ok(map)
    }
}
