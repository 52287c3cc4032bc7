//! How many bytes the rest of a file takes at most.

/// Operation code and length of a record.
const PREFIX: u64 = 1 + 8;

/// Fields of a message before its data.
const MESSAGE: u64 = PREFIX + 2 + 4 + 8 + 8;

/// Entry of a message index.
const INDEX_ENTRY: u64 = 8 + 8;

/// A chunk without its records and the index of a chunk without its channels, each with room for names.
const CHUNK: u64 = 128;
const CHUNK_INDEX: u64 = 128;

/// What a channel adds: the head of a message index, and entries of the chunk's index and of the statistics.
const MESSAGE_INDEX: u64 = PREFIX + 2 + 4;
const CHUNK_CHANNEL: u64 = 2 + 8;
const COUNTED_CHANNEL: u64 = 2 + 8;

/// A metadata record's entry in the summary, and the record without its texts.
const METADATA_INDEX: u64 = PREFIX + 8 + 8 + 64;
const METADATA: u64 = PREFIX + 64;

/// The end of the data, statistics, summary offsets, footer and magic.
const END: u64 = 512;

/// Bytes of the rest of a file, counted as its records come.
#[derive(Clone, Default)]
pub(crate) struct Room {
    /// Messages and definitions in the chunk that is being filled.
    messages: u64,
    definitions: u64,
    /// Indexes of its messages and its entry in the summary.
    chunk_indexes: u64,
    /// The summary as far as the file is written.
    summary: u64,
    /// Both descriptions of the bag.
    description: u64,
}

impl Room {
    pub fn new(description: u64) -> Self {
        let mut room = Self {
            summary: END,
            ..Self::default()
        };
        room.describe(description);
        room
    }

    /// Sets the bytes of the bag's description, which is written into the file and beside it.
    pub fn describe(&mut self, bytes: u64) {
        self.description = 2 * bytes;
    }

    /// Bytes of the messages in the chunk.
    pub fn messages(&self) -> u64 {
        self.messages
    }

    /// Returns true if the chunk has no records.
    pub fn is_empty(&self) -> bool {
        self.messages + self.definitions == 0
    }

    /// Adds a definition with texts of so many bytes, which is in a chunk and in the summary.
    pub fn define(&mut self, texts: usize) {
        let record = PREFIX + 64 + texts as u64;
        self.definitions += record;
        self.summary += record + COUNTED_CHANNEL;
    }

    /// Adds a message, whether it is the first of its channel in the chunk or not.
    pub fn message(&mut self, data: &[u8], is_first: bool) {
        self.messages += message_length(data);
        self.chunk_indexes += INDEX_ENTRY;
        if is_first {
            self.chunk_indexes += MESSAGE_INDEX + CHUNK_CHANNEL;
        }
    }

    /// Adds a metadata record with texts of so many bytes and gives its length.
    pub fn metadata(&mut self, texts: usize) -> u64 {
        self.summary += METADATA_INDEX;
        METADATA + texts as u64
    }

    /// The chunk has been written, with messages of so many channels.
    pub fn end_chunk(&mut self, channels: usize) {
        self.summary += CHUNK_INDEX + CHUNK_CHANNEL * channels as u64;
        self.messages = 0;
        self.definitions = 0;
        self.chunk_indexes = 0;
    }

    /// Bytes of everything up to the end of the file.
    pub fn bytes(&self) -> u64 {
        // lz4 and zstd add less than a 128th to what they cannot compress.
        let records = self.messages + self.definitions;
        let chunk = CHUNK + records + records / 128 + 1024 * u64::from(records > 0);
        let last = METADATA + METADATA_INDEX + self.description;
        chunk + CHUNK_INDEX + self.chunk_indexes + self.summary + last
    }
}

/// Bytes of a message's record.
pub(crate) fn message_length(data: &[u8]) -> u64 {
    MESSAGE + data.len() as u64
}
