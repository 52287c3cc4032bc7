//! What RustDDS keeps of a topic after it has been taken.

use crate::request::DEPTH;

/// An estimate of the bytes of a topic's newest messages, as many as its depth.
#[derive(Debug, Default)]
pub(crate) struct Kept {
    messages: usize,
    bytes: usize,
    told: bool,
}

impl Kept {
    /// Takes note of a message; how much is kept by now, the first time that it is more than `limit` (bytes).
    pub(crate) fn add(&mut self, length: usize, limit: usize) -> Option<usize> {
        if self.messages < DEPTH {
            self.messages += 1;
        } else {
            self.bytes -= self.bytes / DEPTH;
        }
        self.bytes += length;
        if self.told || self.bytes <= limit {
            return None;
        }
        self.told = true;
        Some(self.bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_newest_messages_count() {
        let limit = 100 * DEPTH;
        let mut kept = Kept::default();
        for _ in 0..10 * DEPTH {
            assert_eq!(kept.add(100, limit), None);
        }
        let longer = (0..DEPTH).find_map(|_| kept.add(200, limit));
        assert!(longer.is_some_and(|bytes| bytes > limit), "{longer:?}");
        assert_eq!(kept.add(usize::from(u16::MAX), limit), None, "told once");
    }

    #[test]
    fn a_few_long_messages_are_more_than_is_allowed() {
        let mut kept = Kept::default();
        assert_eq!(kept.add(600, 1000), None);
        assert_eq!(kept.add(600, 1000), Some(1200));
    }
}
