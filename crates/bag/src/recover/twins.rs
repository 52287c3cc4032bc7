//! Definitions that are known to be right, with which those of a damaged file are compared.

use std::{
    collections::{BTreeMap, btree_map::Entry},
    path::{Path, PathBuf},
};

use lgvi_msgs::MessageType;
use mcap::records::op;

use super::{
    contents::is_ours,
    scan::{MAGIC_LENGTH, PREFIX},
    source::Source,
    summary,
};
use crate::{
    ROS2MSG,
    read::numbered,
    records::{Channel, Schema},
};

/// Most bytes in which a damaged definition differs from its twin.
const DAMAGED: usize = 8;

/// Longest header of a file that is read.
const HEADER: usize = 4 << 10;

/// What the complete files of a bag of this crate define, which are the same in each of them. Of what they do not agree on,
/// there is none.
#[derive(Default)]
pub(super) struct Twins {
    pub schemas: BTreeMap<u16, Schema>,
    pub channels: BTreeMap<u16, Channel>,
}

/// Twins by the bag's name in those of its files: `run` of `run_0.mcap`.
pub(super) fn read(directory: &Path, files: &[PathBuf]) -> BTreeMap<String, Twins> {
    let mut bags: BTreeMap<String, Both> = BTreeMap::new();
    for name in files.iter().filter(|_| files.len() > 1) {
        let Some(bag) = bag_of(name) else {
            continue;
        };
        if let Some(summary) = sound_summary(&directory.join(name)) {
            let bag = bags.entry(bag.to_owned()).or_default();
            for (opcode, body) in summary::records(&summary) {
                bag.add(opcode, body);
            }
        }
    }
    let agreed = bags.into_iter().map(|(bag, both)| (bag, both.agreed()));
    agreed.collect()
}

/// The bag that a file is of by its name.
pub(super) fn bag_of(name: &Path) -> Option<&str> {
    Some(numbered(name.to_str()?)?.0)
}

/// The summary of a complete file of this crate.
fn sound_summary(path: &Path) -> Option<Vec<u8>> {
    let source = Source::open(path).ok()?;
    let header = source.bytes(MAGIC_LENGTH + PREFIX, HEADER).ok()?;
    if !is_ours(&header) {
        return None;
    }
    summary::read(&source).ok()?
}

/// Definitions by id; none where files differ.
#[derive(Default)]
struct Both {
    schemas: BTreeMap<u16, Option<Schema>>,
    channels: BTreeMap<u16, Option<Channel>>,
}

impl Both {
    fn add(&mut self, opcode: u8, body: &[u8]) {
        match opcode {
            op::SCHEMA => {
                if let Ok(schema) = Schema::parse(body) {
                    agree(self.schemas.entry(schema.id), schema);
                }
            }
            op::CHANNEL => {
                if let Ok(channel) = Channel::parse(body) {
                    agree(self.channels.entry(channel.id), channel);
                }
            }
            _ => {}
        }
    }

    fn agreed(self) -> Twins {
        let schemas = self.schemas.into_iter();
        let channels = self.channels.into_iter();
        Twins {
            schemas: schemas.filter_map(|(id, it)| Some((id, it?))).collect(),
            channels: channels.filter_map(|(id, it)| Some((id, it?))).collect(),
        }
    }
}

fn agree<T: PartialEq>(known: Entry<'_, u16, Option<T>>, found: T) {
    match known {
        Entry::Vacant(place) => {
            place.insert(Some(found));
        }
        Entry::Occupied(mut known) => {
            if known.get().as_ref() != Some(&found) {
                known.insert(None);
            }
        }
    }
}

/// The schema of a known type.
pub(super) fn known_by_name(id: u16, name: &str) -> Option<Schema> {
    lgvi_msgs::lookup(name).map(|known| schema(id, known))
}

/// The same by its hash.
pub(super) fn known_by_hash(id: u16, hash: &str) -> Option<Schema> {
    let mut known = lgvi_msgs::message_types().iter();
    let known = known.find(|known| known.hash == hash)?;
    Some(schema(id, *known))
}

fn schema(id: u16, known: MessageType) -> Schema {
    Schema {
        id,
        name: known.name.to_owned(),
        encoding: ROS2MSG.to_owned(),
        data: known.definition.into(),
    }
}

/// Whether damage makes the one of the other.
pub(super) fn near_schemas(a: &Schema, b: &Schema) -> bool {
    near(a.name.as_bytes(), b.name.as_bytes())
        && near(a.encoding.as_bytes(), b.encoding.as_bytes())
        && near(&a.data, &b.data)
}

/// The same for channels, which are of one topic.
pub(super) fn near_channels(a: &Channel, b: &Channel) -> bool {
    near(a.topic.as_bytes(), b.topic.as_bytes())
}

pub(super) fn near(a: &[u8], b: &[u8]) -> bool {
    let different = a.iter().zip(b).filter(|(a, b)| a != b).count();
    // Of short names, those of two topics may differ as little.
    a.len() == b.len() && different <= DAMAGED.min(a.len().div_ceil(4))
}
