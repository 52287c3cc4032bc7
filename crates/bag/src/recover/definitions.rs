//! The definitions of a file's topics.

use std::collections::BTreeMap;

use mcap::records::Channel;

use crate::{
    Qos, SERIALIZATION_FORMAT, channel_key,
    read::{Contents, Schema},
};

/// Schemas and channels by id, each with a flag that tells if a checksum covers it.
#[derive(Default)]
pub(super) struct Definitions {
    schemas: BTreeMap<u16, (Schema, bool)>,
    channels: BTreeMap<u16, (Channel, bool)>,
}

impl Definitions {
    /// Takes the definitions of a readable summary.
    pub fn of_summary(contents: &Contents) -> Self {
        let schemas = contents.schemas.iter();
        let channels = contents.channels.iter();
        Self {
            schemas: schemas
                .map(|(&id, schema)| (id, (schema.clone(), true)))
                .collect(),
            channels: channels
                .map(|(&id, channel)| (id, (channel.clone(), true)))
                .collect(),
        }
    }

    /// Adds a schema. The first one counts, but one with a checksum replaces one without.
    pub fn add_schema(&mut self, schema: Schema, checked: bool) {
        add(&mut self.schemas, schema.id, schema, checked);
    }

    /// Adds a channel, see [`add_schema`](Self::add_schema).
    pub fn add_channel(&mut self, channel: Channel, checked: bool) {
        add(&mut self.channels, channel.id, channel, checked);
    }

    /// Ids of all channels.
    pub fn channels(&self) -> Vec<u16> {
        self.channels.keys().copied().collect()
    }

    /// A channel and its schema, and what was dropped of the channel.
    ///
    /// # Errors
    /// Says why the messages of the channel cannot be kept.
    pub fn topic(&self, id: u16) -> Result<(Channel, &Schema, Option<String>), String> {
        let Some((channel, _)) = self.channels.get(&id) else {
            return Err(format!("the definition of channel {id} is lost"));
        };
        if channel.message_encoding != SERIALIZATION_FORMAT {
            let (found, expected) = (&channel.message_encoding, SERIALIZATION_FORMAT);
            return Err(format!(
                "channel {id} holds {found:?}, expected {expected:?}"
            ));
        }
        let Some((schema, _)) = self.schemas.get(&channel.schema_id) else {
            return Err(format!("channel {id} has no definition"));
        };
        let mut channel = channel.clone();
        let offered = channel.metadata.get(channel_key::QOS);
        let qos = offered.map_or(Ok(Qos::default()), |text| Qos::from_yaml(text));
        let dropped = qos.err().map(|error| {
            channel.metadata.remove(channel_key::QOS);
            format!("quality of service of channel {id}: {error}")
        });
        Ok((channel, schema, dropped))
    }
}

fn add<T>(known: &mut BTreeMap<u16, (T, bool)>, id: u16, definition: T, checked: bool) {
    if known.get(&id).is_none_or(|(_, before)| checked && !before) {
        known.insert(id, (definition, checked));
    }
}
