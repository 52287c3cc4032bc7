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
}

pub(crate) struct Schema {
    pub id: u16,
    pub name: String,
    pub encoding: String,
    pub data: Vec<u8>,
}

pub(crate) struct Channel {
    pub id: u16,
    /// Zero if it has none.
    pub schema: u16,
    pub topic: String,
    pub encoding: String,
    pub metadata: BTreeMap<String, String>,
}

pub(crate) struct Message {
    pub channel: u16,
    pub sequence: u32,
    pub log_time: u64,
    pub publish_time: u64,
    pub data: Vec<u8>,
}

pub(crate) struct ChunkIndex {
    /// No message of the chunk is earlier (ns).
    pub start_time: u64,
    pub offset: u64,
    pub length: u64,
}

pub(crate) struct Statistics {
    pub message_count: u64,
    pub start_time: u64,
    pub end_time: u64,
    /// Number of messages of each channel that has any.
    pub channel_message_counts: BTreeMap<u16, u64>,
}

impl Header {
    pub fn parse(body: &[u8]) -> Result<Self, Damage> {
        Ok(Self {
            profile: Fields::new("header", body).string()?,
        })
    }
}

impl Footer {
    pub fn parse(body: &[u8]) -> Result<Self, Damage> {
        Ok(Self {
            summary_start: Fields::new("footer", body).u64()?,
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

impl Message {
    pub fn parse(body: &[u8]) -> Result<Self, Damage> {
        let mut fields = Fields::new("message", body);
        Ok(Self {
            channel: fields.u16()?,
            sequence: fields.u32()?,
            log_time: fields.u64()?,
            publish_time: fields.u64()?,
            data: fields.left.to_vec(),
        })
    }
}

impl ChunkIndex {
    pub fn parse(body: &[u8]) -> Result<Self, Damage> {
        let mut fields = Fields::new("chunk index", body);
        let start_time = fields.u64()?;
        let _end_time = fields.u64()?;
        Ok(Self {
            start_time,
            offset: fields.u64()?,
            length: fields.u64()?,
        })
    }
}

impl Statistics {
    pub fn parse(body: &[u8]) -> Result<Self, Damage> {
        let mut fields = Fields::new("statistics", body);
        let message_count = fields.u64()?;
        let _schemas = fields.u16()?;
        let [_channels, _attachments, _metadata, _chunks] =
            [fields.u32()?, fields.u32()?, fields.u32()?, fields.u32()?];
        Ok(Self {
            message_count,
            start_time: fields.u64()?,
            end_time: fields.u64()?,
            channel_message_counts: fields.map(|entry| Ok((entry.u16()?, entry.u64()?)))?,
        })
    }
}

/// The fields of a record that are still to be read.
struct Fields<'a> {
    record: &'static str,
    left: &'a [u8],
}

impl<'a> Fields<'a> {
    fn new(record: &'static str, left: &'a [u8]) -> Self {
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

    fn u16(&mut self) -> Result<u16, Damage> {
        self.array().map(u16::from_le_bytes)
    }

    fn u32(&mut self) -> Result<u32, Damage> {
        self.array().map(u32::from_le_bytes)
    }

    fn u64(&mut self) -> Result<u64, Damage> {
        self.array().map(u64::from_le_bytes)
    }

    fn bytes(&mut self) -> Result<&'a [u8], Damage> {
        let length = self.u32()?;
        self.take(length as usize)
    }

    fn string(&mut self) -> Result<String, Damage> {
        let text = std::str::from_utf8(self.bytes()?);
        text.map(str::to_owned).map_err(|source| Damage::NotUtf8 {
            record: self.record,
            source,
        })
    }

    fn map<K: Ord, V>(
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
