//! Messages on their way to the writer, many at a time.

/// What there is of a message beside its bytes. Times are nanoseconds since the UNIX epoch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Head {
    /// The topic, by its place in the account.
    pub(crate) track: usize,
    /// Whose it is; any number where the topic has one publisher.
    pub(crate) publisher: u128,
    /// When it is logged.
    pub(crate) log_time: i64,
    /// When it was published.
    pub(crate) publish_time: i64,
    /// The publisher's count.
    pub(crate) sequence: u64,
}

/// Messages one after the other, in memory that is used again.
#[derive(Debug, Default)]
pub(crate) struct Batch {
    /// Each with the end of its bytes.
    heads: Vec<(Head, usize)>,
    bytes: Vec<u8>,
}

impl Batch {
    /// Adds a message whose bytes `encode` appends; nothing where that fails.
    pub(crate) fn push_with<E>(
        &mut self,
        head: Head,
        encode: impl FnOnce(&mut Vec<u8>) -> Result<(), E>,
    ) -> Result<(), E> {
        let start = self.bytes.len();
        let encoded = encode(&mut self.bytes);
        if encoded.is_err() {
            self.bytes.truncate(start);
        } else {
            self.heads.push((head, self.bytes.len()));
        }
        encoded
    }

    /// The messages, in their order.
    pub(crate) fn messages(&self) -> impl Iterator<Item = (Head, &[u8])> {
        let starts = std::iter::once(0).chain(self.heads.iter().map(|(_, end)| *end));
        starts
            .zip(&self.heads)
            .map(|(start, (head, end))| (*head, &self.bytes[start..*end]))
    }

    /// Number of messages.
    pub(crate) fn len(&self) -> usize {
        self.heads.len()
    }

    /// What the messages take (bytes).
    pub(crate) fn size(&self) -> usize {
        self.bytes.len() + size_of_val(&*self.heads)
    }

    /// Memory that is held (bytes).
    pub(crate) fn capacity(&self) -> usize {
        self.bytes.capacity() + self.heads.capacity() * size_of::<(Head, usize)>()
    }

    pub(crate) fn clear(&mut self) {
        self.heads.clear();
        self.bytes.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_come_out_as_they_were_put_in() {
        let head = |sequence| Head {
            publisher: 0,
            track: 1,
            log_time: 2,
            publish_time: 3,
            sequence,
        };
        let mut batch = Batch::default();
        let append = |bytes: &'static [u8]| {
            move |all: &mut Vec<u8>| {
                all.extend_from_slice(bytes);
                Ok::<(), ()>(())
            }
        };
        batch.push_with(head(0), append(b"one")).unwrap();
        batch.push_with(head(1), append(b"")).unwrap();
        let half = batch.push_with(head(2), |all| {
            all.extend_from_slice(b"ha");
            Err("no more")
        });
        assert_eq!(half, Err("no more"));
        batch.push_with(head(3), append(b"two")).unwrap();
        let messages: Vec<_> = batch.messages().collect();
        let expected: [(Head, &[u8]); 3] = [(head(0), b"one"), (head(1), b""), (head(3), b"two")];
        assert_eq!(messages, expected);
        assert_eq!((batch.len(), batch.size() > 6), (3, true));
        batch.clear();
        assert_eq!((batch.len(), batch.size()), (0, 0));
        assert!(batch.capacity() > 0, "memory is kept");
    }
}
