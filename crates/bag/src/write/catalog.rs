//! Schemas and channels of a bag's topics as records, the same in all its files.

use std::collections::BTreeMap;

use mcap::records::op;

use super::encode;
use crate::{SERIALIZATION_FORMAT, Topic, channel_key};

#[derive(Clone, Default)]
pub(crate) struct Catalog {
    schemas: Vec<u8>,
    /// Schemas by name, encoding and definition of the type.
    schema_ids: BTreeMap<[String; 3], u16>,
    channels: Vec<u8>,
    channel_count: u16,
}

impl Catalog {
    /// Adds a topic and gives the id of its channel; none if there are too many.
    pub fn add(&mut self, topic: &Topic, qos: String) -> Option<u16> {
        let channel = self.channel_count.checked_add(1)?;
        let schema = self.schema(topic)?;
        let metadata = BTreeMap::from([
            (channel_key::QOS.to_owned(), qos),
            (channel_key::TYPE_HASH.to_owned(), topic.type_hash.clone()),
        ]);
        encode::record(&mut self.channels, op::CHANNEL, |out| {
            encode::u16(out, channel);
            encode::u16(out, schema);
            encode::bytes(out, topic.name.as_bytes());
            encode::bytes(out, SERIALIZATION_FORMAT.as_bytes());
            encode::sized(out, |out| encode::texts(out, &metadata));
        });
        self.channel_count = channel;
        Some(channel)
    }

    fn schema(&mut self, topic: &Topic) -> Option<u16> {
        let key = [
            topic.type_name.clone(),
            topic.definition_encoding.clone(),
            topic.definition.clone(),
        ];
        if let Some(&id) = self.schema_ids.get(&key) {
            return Some(id);
        }
        let id = self.schema_count().checked_add(1)?;
        encode::record(&mut self.schemas, op::SCHEMA, |out| {
            encode::u16(out, id);
            encode::bytes(out, topic.type_name.as_bytes());
            encode::bytes(out, topic.definition_encoding.as_bytes());
            encode::bytes(out, topic.definition.as_bytes());
        });
        self.schema_ids.insert(key, id);
        Some(id)
    }

    pub fn schemas(&self) -> &[u8] {
        &self.schemas
    }

    pub fn schema_count(&self) -> u16 {
        // Ids are counted in 16 bits.
        self.schema_ids.len() as u16
    }

    pub fn channels(&self) -> &[u8] {
        &self.channels
    }

    pub fn channel_count(&self) -> u16 {
        self.channel_count
    }
}
