//! The loop that plays a bag.

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use lgvi_bag::BagReader;
use lgvi_common::Event;
use lgvi_middleware::node::{Node, NodeError, Stopped};
use tracing::{info, warn};

use crate::channels::Channels;
use crate::clock::RecordedClock;
use crate::config;
use crate::latched::Latched;
use crate::range::Range;
use crate::reel::{Place, Reel, Shown};
use crate::remote::{Order, Remote, Turn};

/// How long the loop waits at a stretch.
const SLICE: Duration = Duration::from_millis(10);

/// How often progress is told of.
const PROGRESS: Duration = Duration::from_millis(100);

/// The least time between two beginnings of a bag that is played again and again.
const ROUND: Duration = Duration::from_millis(1);

/// The longest wait on the wall between two messages: who plays a bag waits no day for the next one.
const LONGEST: Duration = Duration::from_secs(24 * 3600);

/// A replay that runs.
pub(crate) struct Replay<'a> {
    pub(crate) node: &'a Node,
    pub(crate) bag: &'a BagReader,
    pub(crate) range: Range,
    pub(crate) channels: &'a mut Channels,
    pub(crate) clock: Option<&'a mut RecordedClock>,
    pub(crate) latched: &'a mut Latched,
    pub(crate) remote: &'a Remote,
    pub(crate) reel: Reel<'a>,
    pub(crate) wanted: &'a [bool],
    /// Messages published so far.
    pub(crate) played: &'a AtomicU64,
    /// When progress was last told of.
    pub(crate) told: Instant,
}

impl Replay<'_> {
    /// Plays until the end, or until somebody stops or interrupts it; `anew` from the start, with what late joiners would
    /// have got then.
    pub(crate) fn play(&mut self, anew: bool) -> Result<Stopped, NodeError> {
        let begun = if anew {
            self.go_to(self.range.start)
        } else {
            Ok(())
        };
        match begun.and_then(|()| self.play_on()) {
            Err(NodeError::Interrupted) => Ok(Stopped::Interrupted),
            ended => ended.map(|()| Stopped::Done),
        }
    }

    /// Where to go on later.
    pub(crate) fn place(&self) -> Place {
        self.reel.place()
    }

    /// Goes on at a recorded time (ns), after what late joiners would have got then.
    pub(crate) fn go_to(&mut self, time: u64) -> Result<(), NodeError> {
        let node = self.node;
        let before = self.latched.before(self.bag, time, || node.interrupted())?;
        self.reel = Reel::new(self.bag, self.wanted, self.range.end, Place::at(time))?;
        self.remote.jump(time);
        if let Some(clock) = &mut self.clock {
            clock.tell_now(time)?;
        }
        before.into_iter().try_for_each(|shown| self.publish(shown))
    }

    fn play_on(&mut self) -> Result<(), NodeError> {
        let node = self.node;
        let mut generation = None;
        let mut round = Instant::now();
        loop {
            if node.interrupted() {
                return Err(NodeError::Interrupted);
            }
            self.tell_progress();
            let next = self.reel.peek()?;
            let next = next.map(|shown| shown.message.log_time);
            if generation.replace(node.parameters.generation())
                != Some(node.parameters.generation())
            {
                let rate = config::rate(&node.parameters)?;
                self.remote.set_rate(rate, next);
                self.channels.set_rate(rate);
            }
            match self.remote.turn(next, self.slice(next)) {
                Turn::Stop => return Ok(()),
                Turn::Order(order) => self.obey(order)?,
                Turn::Due => {
                    if let Some(shown) = self.reel.take() {
                        self.play_one(shown)?;
                    }
                }
                Turn::Later if self.remote.is_paused() => {
                    if let Some(clock) = &mut self.clock {
                        clock.remind()?;
                    }
                }
                Turn::Later => match next {
                    Some(next) => {
                        self.skip_gap(next);
                        self.tell(next)?;
                    }
                    None if config::is_loop(&node.parameters)? => {
                        std::thread::sleep(ROUND.saturating_sub(round.elapsed()));
                        round = Instant::now();
                        self.go_to(self.range.start)?;
                    }
                    None => return Ok(()),
                },
            }
        }
    }

    /// Reports how far it is.
    fn tell_progress(&mut self) {
        if self.told.elapsed() < PROGRESS {
            return;
        }
        self.told = Instant::now();
        let seconds = |time: u64| time.saturating_sub(self.range.start) as f64 * 1e-9;
        self.node.report_progress(Event::Playing {
            messages: self.played.load(Ordering::Relaxed),
            time: seconds(self.remote.recorded()),
            duration: seconds(self.range.end),
        });
    }

    /// Goes on at the next message (ns) where it is too long until then.
    fn skip_gap(&self, next: u64) {
        if self.remote.until(next).is_some_and(|wait| wait > LONGEST) {
            let gap = next.saturating_sub(self.remote.recorded()) as f64 * 1e-9;
            warn!("there is no message for {gap:.0} s; playing continues at {next} ns");
            self.remote.jump(next);
        }
    }

    /// How long to wait at a stretch: not at all at the end.
    fn slice(&self, next: Option<u64>) -> Duration {
        if next.is_none() && !self.remote.is_paused() {
            return Duration::ZERO;
        }
        match &self.clock {
            Some(clock) => clock.period().clamp(ROUND, SLICE),
            None => SLICE,
        }
    }

    /// Tells the recorded time, which is not after that of the next message (ns).
    fn tell(&mut self, next: u64) -> Result<(), NodeError> {
        let time = self.remote.recorded().min(next);
        self.clock.as_mut().map_or(Ok(()), |clock| clock.tell(time))
    }

    fn obey(&mut self, order: Order) -> Result<(), NodeError> {
        match order {
            Order::Seek(time, answer) => {
                let possible = time <= self.range.end;
                if possible {
                    self.go_to(time.max(self.range.start))?;
                } else {
                    let end = self.range.end;
                    warn!("cannot go to {time} ns, which is after the end at {end} ns");
                }
                answer(possible);
            }
            Order::Burst(count, answer) => {
                let burst = self.burst(count)?;
                info!("published {burst} messages at once");
                answer(burst);
            }
        }
        Ok(())
    }

    /// Publishes so many messages, or all that follow, as long as there is a pause; how many.
    fn burst(&mut self, count: Option<u64>) -> Result<u64, NodeError> {
        let node = self.node;
        let mut burst = 0;
        while count.is_none_or(|count| burst < count) {
            let Some(next) = self.reel.peek()? else {
                break;
            };
            let time = next.message.log_time;
            if node.interrupted() || !self.remote.step(time) {
                break;
            }
            if let Some(clock) = &mut self.clock {
                clock.tell_now(time)?;
            }
            if let Some(shown) = self.reel.take() {
                self.publish(shown)?;
            }
            burst += 1;
        }
        Ok(burst)
    }

    /// Publishes a message after its time.
    fn play_one(&mut self, shown: Shown<'_>) -> Result<(), NodeError> {
        let time = shown.message.log_time;
        if let Some(clock) = &mut self.clock {
            clock.tell(time)?;
        }
        self.publish(shown)?;
        // The end is told whenever it comes.
        if let (None, Some(clock)) = (self.reel.peek()?, &mut self.clock) {
            clock.tell_now(time)?;
        }
        Ok(())
    }

    fn publish(&mut self, shown: Shown<'_>) -> Result<(), NodeError> {
        self.channels.publish(shown)?;
        self.played.fetch_add(1, Ordering::Relaxed);
        Ok(())
    }
}
