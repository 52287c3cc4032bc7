//! How many bytes the rest of a file takes at most.

/// Fields of a message's record before its data, and its entry in the index of its chunk.
const MESSAGE: u64 = 9 + 2 + 4 + 8 + 8;
const INDEX_ENTRY: u64 = 8 + 8;

/// More than any other record takes without its texts, lists and data.
const RECORD: u64 = 128;

/// What a channel adds: the head of the index of its messages, and entries of the index of a chunk and of the statistics.
const MESSAGE_INDEX: u64 = 9 + 2 + 4;
const CHANNEL: u64 = 2 + 8;

/// The end of the data, statistics, summary offsets, footer and magic.
const END: u64 = 512;

/// Bytes of the rest of a file, counted as its records come.
#[derive(Clone, Default)]
pub(crate) struct Room {
    /// Messages and definitions in the chunk that is being filled.
    messages: u64,
    definitions: u64,
    /// Indexes of its messages and its entry in the summary.
    indexes: u64,
    /// The summary as far as the file is written.
    summary: u64,
    /// Both descriptions of the bag.
    description: u64,
}

impl Room {
    pub fn new(description: u64) -> Self {
        Self {
            summary: END,
            description: 2 * description,
            ..Self::default()
        }
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
        self.definitions += RECORD + texts as u64;
        self.summary += RECORD + CHANNEL + texts as u64;
    }

    /// Adds a message, whether it is the first of its channel in the chunk or not.
    pub fn message(&mut self, data: &[u8], is_first: bool) {
        self.messages += message_length(data);
        self.indexes += INDEX_ENTRY + (MESSAGE_INDEX + CHANNEL) * u64::from(is_first);
    }

    /// Adds a metadata record with texts of so many bytes and gives its length.
    pub fn metadata(&mut self, texts: usize) -> u64 {
        self.summary += RECORD;
        RECORD + texts as u64
    }

    /// The chunk has been written, with messages of so many channels.
    pub fn end_chunk(&mut self, channels: usize) {
        self.summary += RECORD + CHANNEL * channels as u64;
        self.messages = 0;
        self.definitions = 0;
        self.indexes = 0;
    }

    /// Bytes of everything up to the end of the file.
    pub fn bytes(&self) -> u64 {
        // lz4 and zstd add less than a 128th to what they cannot compress.
        let records = self.messages + self.definitions;
        let chunk = 2 * RECORD + records + records / 128 + 1024 * u64::from(records > 0);
        chunk + self.indexes + self.summary + 2 * RECORD + self.description
    }
}

/// Bytes of a message's record.
pub(crate) fn message_length(data: &[u8]) -> u64 {
    MESSAGE + data.len() as u64
}
