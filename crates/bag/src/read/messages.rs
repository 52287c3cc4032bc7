//! The messages of a bag in the order of their log times.

use std::{
    borrow::Cow,
    cmp::Reverse,
    collections::{BTreeMap, BinaryHeap, VecDeque, binary_heap::PeekMut},
};

use super::{
    BagReader,
    file::{Batch, Span, unpacked},
    reader::OpenFile,
};
use crate::{BagError, Topic};

/// Memory (bytes) from which on no further overlapping chunk is read.
const MAX_HELD: usize = 512 << 20;

/// A message of a bag.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Message<'a> {
    /// The topic it was published on.
    pub topic: &'a Topic,
    /// Its index among the bag's topics.
    pub topic_index: usize,
    /// When it was recorded (ns).
    pub log_time: u64,
    /// When it was published (ns).
    pub publish_time: u64,
    /// The publisher's count.
    pub sequence: u32,
    /// CDR with its encapsulation header.
    pub data: Vec<u8>,
}

/// Iterator over the messages of a bag; ends after the first error.
pub struct Messages<'a> {
    bag: &'a BagReader,
    /// No message before it is given out (ns).
    start: u64,
    /// Whether each topic's messages are given out.
    wanted: Vec<bool>,
    /// Not yet read, by file and in order.
    spans: VecDeque<(usize, &'a Span)>,
    /// Read, not yet given out, by file and offset.
    batches: BTreeMap<(usize, u64), Batch>,
    /// The next message of each batch.
    next: BinaryHeap<Reverse<Position>>,
    /// Bytes of memory that the batches take.
    held: usize,
}

/// Log time of a batch's next message, with its file and offset, in the order of reading.
type Position = (u64, usize, u64);

impl<'a> Messages<'a> {
    pub(crate) fn new(bag: &'a BagReader, start: u64, wanted: Vec<bool>) -> Self {
        let is_wanted = |file: usize, span: &Span| {
            let topics = &bag.files[file].channels;
            span.channels.as_ref().is_none_or(|channels| {
                let mut topics = channels.iter().filter_map(|channel| topics.get(channel));
                topics.any(|topic| wanted[*topic])
            })
        };
        let spans = bag.files.iter().enumerate().flat_map(|(index, file)| {
            file.mcap
                .contents
                .spans
                .iter()
                .map(move |span| (index, span))
        });
        let mut spans: Vec<_> = spans
            .filter(|&(file, span)| span.times.1 >= start && is_wanted(file, span))
            .collect();
        spans.sort_by_key(|&(file, span)| start_of(file, span));
        Self {
            bag,
            start,
            wanted,
            spans: spans.into(),
            batches: BTreeMap::new(),
            next: BinaryHeap::new(),
            held: 0,
        }
    }

    /// Reads spans until no unread one can hold a message before the next one.
    fn fill(&mut self) -> Result<(), BagError> {
        while let Some(&(file, span)) = self.spans.front() {
            let start = start_of(file, span);
            if self.next.peek().is_some_and(|Reverse(next)| *next < start) {
                break;
            }
            self.spans.pop_front();
            let OpenFile {
                mcap,
                channels: topics,
                repeated,
            } = &self.bag.files[file];
            if self.held > MAX_HELD {
                let reason = format!("chunks that overlap in time hold more than {MAX_HELD} bytes");
                let reason = reason + "; sort the file: mcap sort";
                return Err(BagError::invalid(&mcap.source.path, reason));
            }
            let repeated = repeated.get(&span.offset).copied().unwrap_or(0);
            let batch = mcap.read(span, repeated, |header| {
                let wanted = topics
                    .get(&header.channel_id)
                    .is_some_and(|topic| self.wanted[*topic]);
                Ok(wanted && header.log_time >= self.start)
            })?;
            if let Some(log_time) = batch.next_time() {
                self.held += batch.memory();
                self.next.push(Reverse((log_time, file, span.offset)));
                self.batches.insert((file, span.offset), batch);
            }
        }
        Ok(())
    }

    fn pop(&mut self) -> Option<Result<Message<'a>, BagError>> {
        let mut next = self.next.peek_mut()?;
        let Reverse((next_time, file, offset)) = &mut *next;
        let (file, offset) = (*file, *offset);
        let batch = self.batches.get_mut(&(file, offset))?;
        let (header, data) = batch.pop()?;
        let topic_index = self.bag.files[file].channels[&header.channel_id];
        let data = unpacked(data).map(Cow::into_owned);
        if let Some(log_time) = batch.next_time() {
            *next_time = log_time;
        } else {
            self.held -= batch.memory();
            PeekMut::pop(next);
            self.batches.remove(&(file, offset));
        }
        let message = data.map(|data| Message {
            topic: &self.bag.topics[topic_index],
            topic_index,
            log_time: header.log_time,
            publish_time: header.publish_time,
            sequence: header.sequence,
            data,
        });
        Some(message.map_err(|damage| self.bag.files[file].mcap.source.damaged(offset, damage)))
    }
}

fn start_of(file: usize, span: &Span) -> Position {
    (span.times.0, file, span.offset)
}

impl<'a> Iterator for Messages<'a> {
    type Item = Result<Message<'a>, BagError>;

    fn next(&mut self) -> Option<Self::Item> {
        let next = match self.fill() {
            Ok(()) => self.pop(),
            Err(error) => Some(Err(error)),
        };
        if let Some(Err(_)) = next {
            self.spans.clear();
            self.next.clear();
        }
        next
    }
}
