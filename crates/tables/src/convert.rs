//! Conversion of a bag to a directory of tables.

use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::path::{Path, PathBuf};

use lgvi_bag::{BagReader, Message, NewDirectory, ROS2MSG, Topic, WriteError};

use crate::conversion::{Conversion, ConvertError, Format, LeftOut, Options, TableFile};
use crate::definition;
use crate::file_names::{self, FileNames};
use crate::layout::Layout;
use crate::open::{Learnt, Open};

/// Maximum number of tables open at a time. A process may typically have at most 1024 files open.
const MAX_OPEN: usize = 200;

/// Limit on the memory for the rows of all tables together (bytes). Above it, the table with the most rows in memory is
/// flushed.
const MAX_BUFFERED: usize = 64 << 20;

const NO_DEFINITION: &str = "it has no definition";

/// Writes a table of each topic to the directory `output`, which must be empty or not exist.
///
/// The bag is first read once to determine the columns. To write the tables, it is read once for each 64 MiB of short
/// topics, whose messages are held in memory, and once for each 200 long topics. Memory is bounded by the needs of the
/// bag's reader plus these 64 MiB, which also limit the size of a row group. The directory gets its final name only
/// when all tables are complete.
///
/// Topics whose definition or messages cannot be decoded have no table and are listed in the result.
///
/// # Errors
/// Returns an error as described in [`ConvertError`].
pub fn convert(
    bag: &BagReader,
    output: &Path,
    options: &Options,
) -> Result<Conversion, ConvertError> {
    convert_within(bag, output, options, MAX_BUFFERED)
}

/// Converts like [`convert`], with at most `buffered` bytes of rows in memory.
pub(crate) fn convert_within(
    bag: &BagReader,
    output: &Path,
    options: &Options,
    buffered: usize,
) -> Result<Conversion, ConvertError> {
    check_topics(bag, &options.topics)?;
    let directory = NewDirectory::begin(output).map_err(|error| output_error(output, error))?;
    let (layouts, left_out) = learn(bag, options)?;
    let mut files = write(bag, directory.path(), options.format, layouts, buffered)?;
    directory
        .complete()
        .map_err(|error| output_error(output, error))?;
    for file in &mut files {
        file.file = output.join(&file.file);
    }
    Ok(Conversion { files, left_out })
}

fn output_error(output: &Path, error: WriteError) -> ConvertError {
    match error {
        WriteError::Exists(path) => ConvertError::Exists { path },
        WriteError::NoName(path) => ConvertError::NoName { path },
        WriteError::Io(path, source) => ConvertError::Io { path, source },
        other => ConvertError::Io {
            path: output.to_owned(),
            source: io::Error::other(other),
        },
    }
}

pub(crate) fn check_topics(bag: &BagReader, wanted: &[String]) -> Result<(), ConvertError> {
    let topics = bag.topics().iter().map(|topic| &*topic.name);
    let left_out = bag.left_out().iter().map(|topic| &*topic.name);
    let known: Vec<&str> = topics.chain(left_out).collect();
    let names: BTreeSet<_> = known.iter().copied().collect();
    match wanted.iter().find(|name| !names.contains(name.as_str())) {
        None => Ok(()),
        Some(topic) => Err(ConvertError::UnknownTopic {
            topic: topic.clone(),
            known: known.join(", "),
        }),
    }
}

/// Name and type of a topic, which together are unique in a bag.
pub(crate) type Key<'b> = (&'b str, &'b str);

pub(crate) fn key(topic: &Topic) -> Key<'_> {
    (&topic.name, &topic.type_name)
}

/// Determines the layouts of the topics from all messages.
pub(crate) fn learn<'b>(
    bag: &'b BagReader,
    options: &Options,
) -> Result<(Vec<Learnt<'b>>, Vec<LeftOut>), ConvertError> {
    let chosen: BTreeSet<_> = options.topics.iter().collect();
    let wanted = |name: &String| chosen.is_empty() || chosen.contains(name);
    let mut topics: BTreeMap<Key<'b>, Result<Learnt<'b>, String>> = BTreeMap::new();
    for topic in bag.topics().iter().filter(|topic| wanted(&topic.name)) {
        topics.insert(key(topic), begin(topic, options.max_elements));
    }
    for message in bag.messages() {
        let message = message?;
        let Some(entry) = topics.get_mut(&key(message.topic)) else {
            continue;
        };
        if let Ok(learnt) = entry {
            learnt.rows += 1;
            learnt.bytes += size_of::<Message<'_>>() + message.data.len();
            if let Err(error) = observe(learnt, &message, options.format) {
                let at = message.log_time;
                *entry = Err(if has_definition(message.topic) {
                    format!("message at {at} ns: {error}")
                } else {
                    NO_DEFINITION.to_owned()
                });
            }
        }
    }
    let mut learnt = Vec::new();
    let unreadable = bag.left_out().iter().filter(|topic| wanted(&topic.name));
    let mut left_out: Vec<_> = unreadable
        .map(|topic| LeftOut {
            topic: topic.name.clone(),
            type_name: topic.type_name.clone(),
            reason: topic.reason.clone(),
        })
        .collect();
    for (topic, found) in topics {
        let finished = found.and_then(|mut learnt| {
            let finished = learnt.layout.finish();
            finished.map_err(|error| error.to_string())?;
            Ok(learnt)
        });
        match finished {
            Ok(found) => learnt.push(found),
            Err(reason) => left_out.push(LeftOut {
                topic: topic.0.to_owned(),
                type_name: topic.1.to_owned(),
                reason,
            }),
        }
    }
    Ok((learnt, left_out))
}

fn begin(topic: &Topic, max_elements: usize) -> Result<Learnt<'_>, String> {
    file_names::check(&topic.name)?;
    if topic.definition_encoding != ROS2MSG {
        if !has_definition(topic) {
            return Err(NO_DEFINITION.to_owned());
        }
        let encoding = &topic.definition_encoding;
        return Err(format!(
            "its definition is {encoding:?}, expected {ROS2MSG:?}"
        ));
    }
    let message = definition::Message::parse(&topic.type_name, &topic.definition)
        .map_err(|error| error.to_string())?;
    let layout = Layout::new(message, max_elements).map_err(|error| error.to_string())?;
    Ok(Learnt {
        topic,
        layout,
        rows: 0,
        bytes: 0,
    })
}

/// Returns true if the topic has a definition. A message without fields also has an empty one.
fn has_definition(topic: &Topic) -> bool {
    !topic.definition.trim().is_empty()
}

fn observe(learnt: &mut Learnt<'_>, message: &Message<'_>, format: Format) -> Result<(), String> {
    let latest = message.log_time.max(message.publish_time);
    if format == Format::Parquet && i64::try_from(latest).is_err() {
        return Err(format!("time {latest} ns is beyond what Parquet can tell"));
    }
    learnt
        .layout
        .observe(&message.data)
        .map_err(|error| error.to_string())
}

fn write<'b>(
    bag: &'b BagReader,
    directory: &Path,
    format: Format,
    learnt: Vec<Learnt<'b>>,
    buffered: usize,
) -> Result<Vec<TableFile>, ConvertError> {
    let mut names = FileNames::default();
    let mut files = Vec::with_capacity(learnt.len());
    let named = learnt.into_iter().map(|learnt| {
        let name = format!("{}.{}", names.of(&learnt.topic.name), format.name());
        (directory.join(name), learnt)
    });
    let (short, long): (Vec<_>, Vec<_>) =
        named.partition(|(_, learnt)| learnt.bytes <= buffered / MAX_OPEN);
    let mut long = long.into_iter();
    while long.len() > 0 {
        let mut open = BTreeMap::new();
        for (path, learnt) in long.by_ref().take(MAX_OPEN) {
            let table = Open::create(bag, path, format, learnt)?;
            open.insert(key(table.topic()), table);
        }
        write_open(bag, &mut open, buffered)?;
        for table in open.into_values() {
            files.push(table.finish()?);
        }
    }
    let mut short = short.into_iter().peekable();
    while short.len() > 0 {
        let mut left = buffered;
        let mut fits = |(_, learnt): &Named<'_>| {
            let rest = left.checked_sub(learnt.bytes);
            left = rest.unwrap_or(left);
            rest.is_some()
        };
        let held = std::iter::from_fn(|| short.next_if(&mut fits)).collect();
        write_held(bag, held, format, &mut files)?;
    }
    files.sort_by(|a, b| (&a.topic, &a.type_name).cmp(&(&b.topic, &b.type_name)));
    Ok(files)
}

/// The path of a table and its layout.
type Named<'b> = (PathBuf, Learnt<'b>);

/// Writes tables one after another, with the messages of all of them in memory.
fn write_held<'b>(
    bag: &'b BagReader,
    tables: Vec<Named<'b>>,
    format: Format,
    files: &mut Vec<TableFile>,
) -> Result<(), ConvertError> {
    let topics = tables.iter().map(|(_, learnt)| key(learnt.topic));
    let mut held: BTreeMap<Key<'b>, Vec<Message<'b>>> =
        topics.map(|topic| (topic, Vec::new())).collect();
    for message in bag.messages() {
        let message = message?;
        if let Some(messages) = held.get_mut(&key(message.topic)) {
            messages.push(message);
        }
    }
    for (path, learnt) in tables {
        let messages = held.remove(&key(learnt.topic)).unwrap_or_default();
        let mut table = Open::create(bag, path, format, learnt)?;
        for message in &messages {
            table.row(message)?;
        }
        files.push(table.finish()?);
    }
    Ok(())
}

/// Writes the rows of the open tables.
fn write_open<'b>(
    bag: &'b BagReader,
    open: &mut BTreeMap<Key<'b>, Open<'b>>,
    buffered: usize,
) -> Result<(), ConvertError> {
    for message in bag.messages() {
        let message = message?;
        let Some(file) = open.get_mut(&key(message.topic)) else {
            continue;
        };
        file.row(&message)?;
        flush(open, buffered)?;
    }
    Ok(())
}

/// Flushes the tables with the most bytes in memory until at most `buffered` bytes remain.
fn flush(open: &mut BTreeMap<Key<'_>, Open<'_>>, buffered: usize) -> Result<(), ConvertError> {
    let mut total: usize = open.values().map(Open::buffered).sum();
    while total > buffered {
        let Some(longest) = open.values_mut().max_by_key(|file| file.buffered()) else {
            break;
        };
        total -= longest.buffered();
        longest.flush()?;
    }
    Ok(())
}
