//! When the messages begin and end that are given out, of a file that has others too.

use super::{McapFile, Span};
use crate::times::{Times, around, widen};

impl McapFile {
    /// First and last log time (ns) of the messages of its topics. Where topics are left out, which may begin earlier and
    /// end later, the chunks at both ends are read.
    pub(super) fn readable_times(&self) -> Times {
        if self.left_out.is_empty() {
            return self.contents.times;
        }
        let is_readable = |channel: &u16| self.topics.contains_key(channel);
        let may_have = |span: &&Span| match &span.channels {
            Some(channels) => channels.iter().any(is_readable),
            None => !self.topics.is_empty(),
        };
        let mut spans: Vec<_> = self.contents.spans.iter().filter(may_have).collect();
        spans.sort_by_key(|span| span.start_time);
        let mut times: Times = None;
        for span in &spans {
            if times.is_some_and(|(first, _)| first <= span.start_time) {
                break;
            }
            times = around(times.into_iter().chain(self.times_of(span)));
        }
        spans.sort_by_key(|span| span.end_time);
        for span in spans.iter().rev() {
            if times.is_none_or(|(_, last)| last >= span.end_time) {
                break;
            }
            times = around(times.into_iter().chain(self.times_of(span)));
        }
        times
    }

    /// The same of a span; of one that is damaged, what its index says.
    fn times_of(&self, span: &Span) -> Times {
        let mut times = None;
        let read = self.read(span, 0, |header| {
            if self.topics.contains_key(&header.channel_id) {
                widen(&mut times, header.log_time);
            }
            Ok(false)
        });
        match read {
            Ok(_) => times,
            Err(_) => Some((span.start_time, span.end_time)),
        }
    }
}
