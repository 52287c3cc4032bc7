//! The definitions of a file's topics, and which of them are believed.

use std::collections::{BTreeMap, BTreeSet};

use super::{
    losses::Losses,
    plausibility::{is_plausible_channel, is_plausible_schema, is_type_hash},
    scan::Place,
    twins::{Twins, known_by_hash, known_by_name, near, near_channels, near_schemas},
};
use crate::{
    Qos, SERIALIZATION_FORMAT, channel_key,
    records::{Channel, Schema},
};

/// A topic whose messages are copied.
pub(super) struct Topic {
    pub channel: Channel,
    pub schema: Schema,
}

/// Definitions as they were found, and topics made of them.
///
/// Those that a checksum covers are taken as they are, the first one of each id. Others are compared with their twins: what
/// the bag's other files have under the same id, and the types that this repository knows.
pub(super) struct Definitions<'a> {
    twins: Option<&'a Twins>,
    schemas: BTreeMap<u16, Found<Schema>>,
    channels: BTreeMap<u16, Found<Channel>>,
    /// Schemas that are written already.
    settled: BTreeMap<u16, Schema>,
    topics: BTreeMap<u16, Topic>,
    /// Channels whose messages are not taken.
    refused: BTreeSet<u16>,
}

struct Found<T> {
    definition: T,
    place: Place,
    /// Whether a checksum covers it.
    checked: bool,
}

impl<'a> Definitions<'a> {
    pub fn new(twins: Option<&'a Twins>) -> Self {
        Self {
            twins,
            schemas: BTreeMap::new(),
            channels: BTreeMap::new(),
            settled: BTreeMap::new(),
            topics: BTreeMap::new(),
            refused: BTreeSet::new(),
        }
    }

    /// The bag's other files are of another recorder than this one.
    pub fn forget_twins(&mut self) {
        self.twins = None;
    }

    pub fn add_schema(&mut self, schema: Schema, place: Place, checked: bool, losses: &mut Losses) {
        let id = schema.id;
        let found = Found {
            definition: schema,
            place,
            checked,
        };
        let what = |schema: &Schema| format!("the definition of {}", schema.name);
        add(&mut self.schemas, id, found, what, losses);
    }

    pub fn add_channel(
        &mut self,
        channel: Channel,
        place: Place,
        checked: bool,
        losses: &mut Losses,
    ) {
        let id = channel.id;
        let found = Found {
            definition: channel,
            place,
            checked,
        };
        let what = |channel: &Channel| format!("the channel of {}", channel.topic);
        add(&mut self.channels, id, found, what, losses);
    }

    /// Ids of all channels that were found.
    pub fn channels(&self) -> Vec<u16> {
        self.channels.keys().copied().collect()
    }

    /// The topics that messages were copied of, and those that were asked for.
    pub fn topics(&self) -> impl Iterator<Item = &Topic> {
        self.topics.values()
    }

    /// The topic of a channel; none if its definition is lost, or is of what no reader of this crate takes.
    pub fn topic(&mut self, id: u16, losses: &mut Losses) -> Option<&Topic> {
        if !self.topics.contains_key(&id) {
            let topic = self.make(id, losses)?;
            self.topics.insert(id, topic);
        }
        self.topics.get(&id)
    }

    fn make(&mut self, id: u16, losses: &mut Losses) -> Option<Topic> {
        if self.refused.contains(&id) {
            return None;
        }
        let (channel, place) = self.channel(id, losses)?;
        let mut channel = match channel {
            Ok(channel) => channel,
            Err(reason) => {
                losses.leave_out(place, reason);
                self.refused.insert(id);
                return None;
            }
        };
        let hash = channel.metadata.get(channel_key::TYPE_HASH);
        let hash = hash.cloned().unwrap_or_default();
        let schema = match self.settled.get(&channel.schema) {
            Some(schema) => schema.clone(),
            None => {
                let schema = self.schema(channel.schema, &hash, losses)?;
                self.settled.insert(schema.id, schema.clone());
                schema
            }
        };
        if let Some(found) = self.channels.get(&id)
            && !found.checked
        {
            mend_hash(&mut channel, &schema, found.place, losses);
        }
        drop_damaged_qos(&mut channel, place, losses);
        Some(Topic { channel, schema })
    }

    /// The channel of an id and where it was found, or why it is not taken.
    fn channel(&self, id: u16, losses: &mut Losses) -> Option<(Result<Channel, String>, Place)> {
        let twin = self.twins.and_then(|twins| twins.channels.get(&id));
        let Some(found) = self.channels.get(&id) else {
            let nowhere = Place {
                offset: 0,
                length: 0,
            };
            return twin.map(|twin| (Ok(twin.clone()), nowhere));
        };
        let (channel, place) = (&found.definition, found.place);
        let plausible = found.checked || is_plausible_channel(channel);
        let better = twin.filter(|twin| !found.checked && *twin != channel);
        if let Some(twin) = better.filter(|twin| !plausible || near_channels(channel, twin)) {
            let topic = &twin.topic;
            let reason = format!("the channel of {topic} is damaged: taken from another file");
            losses.leave_out(place, reason);
            return Some((Ok(twin.clone()), place));
        }
        let refusal = if !plausible {
            Some(format!("the definition of channel {id} is damaged"))
        } else if channel.schema == 0 {
            Some(format!("channel {id} has no definition"))
        } else if channel.encoding != SERIALIZATION_FORMAT {
            let (found, expected) = (&channel.encoding, SERIALIZATION_FORMAT);
            Some(format!(
                "channel {id} holds {found:?}, expected {expected:?}"
            ))
        } else {
            None
        };
        Some((refusal.map_or_else(|| Ok(channel.clone()), Err), place))
    }

    /// A schema whose messages have this type hash, if it is known.
    fn schema(&self, id: u16, hash: &str, losses: &mut Losses) -> Option<Schema> {
        let twin = self.twins.and_then(|twins| twins.schemas.get(&id));
        let twin = twin.cloned().or_else(|| known_by_hash(id, hash));
        let Some(Found {
            definition,
            place,
            checked,
        }) = self.schemas.get(&id)
        else {
            return twin;
        };
        let twin = twin.or_else(|| known_by_name(id, &definition.name));
        if *checked || twin.as_ref() == Some(definition) {
            return Some(definition.clone());
        }
        let plausible = is_plausible_schema(definition);
        if let Some(twin) = twin.filter(|twin| !plausible || near_schemas(definition, twin)) {
            let name = &twin.name;
            let reason = format!("the definition of {name} is damaged: taken from elsewhere");
            losses.leave_out(*place, reason);
            return Some(twin);
        }
        if plausible {
            return Some(definition.clone());
        }
        let name = &definition.name;
        let reason = format!("the definition of {name:?} is damaged: messages are kept without it");
        losses.leave_out(*place, reason);
        // As rosbag2 writes types of which it knows no more than the name.
        Some(Schema {
            encoding: String::new(),
            data: Vec::new(),
            name: name.replace(|letter: char| !letter.is_ascii_graphic(), "_"),
            id,
        })
    }
}

/// The first one of an id counts, but one that a checksum covers before one that none does.
fn add<T: PartialEq>(
    known: &mut BTreeMap<u16, Found<T>>,
    id: u16,
    found: Found<T>,
    what: impl Fn(&T) -> String,
    losses: &mut Losses,
) {
    match known.get_mut(&id) {
        Some(before) if found.checked && !before.checked => {
            if before.definition != found.definition {
                let reason = format!(
                    "{} is damaged: taken from its copy",
                    what(&found.definition)
                );
                losses.leave_out(before.place, reason);
            }
            *before = found;
        }
        Some(_) => {}
        None => {
            known.insert(id, found);
        }
    }
}

/// Takes the type hash of a known definition where the channel's is nearly that, and leaves out one that is none.
fn mend_hash(channel: &mut Channel, schema: &Schema, place: Place, losses: &mut Losses) {
    let Some(hash) = channel.metadata.get_mut(channel_key::TYPE_HASH) else {
        return;
    };
    let known = known_by_name(schema.id, &schema.name).filter(|known| known == schema);
    let known = known.and_then(|known| lgvi_msgs::lookup(&known.name));
    let mended = match known {
        Some(known) if hash != known.hash && near(hash.as_bytes(), known.hash.as_bytes()) => {
            Some(known.hash)
        }
        _ if !is_type_hash(hash) => Some(""),
        _ => None,
    };
    if let Some(mended) = mended {
        let reason = format!("the type hash of {} is damaged", channel.topic);
        losses.leave_out(place, reason);
        mended.clone_into(hash);
    }
}

/// Leaves out a quality of service that no reader takes.
fn drop_damaged_qos(channel: &mut Channel, place: Place, losses: &mut Losses) {
    let offered = channel.metadata.get(channel_key::QOS);
    if let Some(Err(error)) = offered.map(|text| Qos::from_yaml(text)) {
        let reason = format!("quality of service of channel {}: {error}", channel.id);
        losses.leave_out(place, reason);
        channel.metadata.remove(channel_key::QOS);
    }
}
