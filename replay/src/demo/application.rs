//! The demo's application: submits each key when its content time has come.
//!
//! The fixtures' client decides what to submit; this module waits and keeps the record.

use std::time::Duration;

use anyhow::{Context as _, bail};
use foreframe_client::{Client, ConnectOptions, Event, Statistics, StreamId};
use foreframe_engine::{MonoSpan, MonoTime};
use foreframe_fixtures::client::{CLIENT_MOTION, DemoClient, KeyFate, Next, stream_options};
use foreframe_fixtures::{Recipe, Size};
use foreframed::clock;
use indicatif::ProgressBar;

use super::CONNECT_TIMEOUT;
use super::rehearsal::Rehearsal;

/// Time for the daemon to end the stream.
const END_TIMEOUT: Duration = Duration::from_secs(5);
/// The first second is the pacer's to learn in; what is dropped then is counted apart.
const SETTLED_AFTER: MonoSpan = MonoSpan::from_ms(1000);

/// What the application did and was told.
#[derive(Clone, Debug, Default)]
pub struct Submissions {
    /// Key by key: index, and when its submission was done.
    pub sent: Vec<(u64, MonoTime)>,
    /// Keys that were left out: no slot was free, or their time had passed.
    pub skipped: u64,
    /// Time to fill and submit each key.
    pub work: Vec<MonoSpan>,
    /// The newest counts of the daemon: in the end, those of the whole show.
    pub statistics: Option<Statistics>,
    /// Where the daemon makes frames, in its own words.
    pub backend: String,
    /// The refresh interval of the display, as the daemon tracks it.
    pub refresh_interval: Option<MonoSpan>,
    /// The last counts of the first second.
    pub settled: Option<Statistics>,
}

/// A client with a stream.
#[derive(Debug)]
pub struct Application {
    client: Client,
    stream: StreamId,
    base: MonoTime,
}

impl Application {
    /// Connects and creates a stream of `size`; the first key will be due at `base`.
    ///
    /// # Errors
    /// If the daemon refuses.
    pub fn connect(options: &ConnectOptions, size: Size, base: MonoTime) -> anyhow::Result<Self> {
        let mut client =
            options.connect(CONNECT_TIMEOUT).context("connecting as the application")?;
        let stream = client
            .create_stream(&stream_options(&Recipe::new(size), CLIENT_MOTION))
            .context("creating the stream")?;
        Ok(Self { client, stream, base })
    }

    /// Submits every key in time, then ends the stream.
    ///
    /// # Errors
    /// If the daemon goes away or finds fault with something.
    pub fn play(mut self, rehearsal: &Rehearsal, bar: &ProgressBar) -> anyhow::Result<Submissions> {
        let mut demo = DemoClient::new(self.stream, &rehearsal.keys, self.base.as_ns());
        let backend = self.client.welcome().gpu_name.clone();
        let mut done = Submissions { backend, ..Submissions::default() };
        let mut next = Next::At(self.base.as_ns());
        while let Next::At(due_ns) = next {
            clock::sleep_until(MonoTime::from_ns(due_ns));
            let started_at = clock::now();
            next = demo
                .advance(&mut self.client, started_at.as_ns())
                .context("submitting a key frame")?;
            if demo.fates().last() == Some(&KeyFate::Submitted) {
                let sent_at = clock::now();
                done.work.push(sent_at - started_at);
                done.sent.push((demo.fates().len() as u64 - 1, sent_at));
            }
            self.look_at_events(&mut done)?;
            if started_at - self.base < SETTLED_AFTER {
                done.settled = done.statistics;
            }
            bar.set_position(demo.fates().len() as u64);
        }
        done.skipped = demo.fates().len() as u64 - done.sent.len() as u64;
        let end_ns = rehearsal.keys.len() as u64 * rehearsal.key_interval_ns;
        clock::sleep_until(MonoTime::from_ns(self.base.as_ns() + end_ns));
        self.end(&mut done)?;
        Ok(done)
    }

    /// True if the stream has ended.
    fn look_at_events(&mut self, done: &mut Submissions) -> anyhow::Result<bool> {
        let mut has_ended = false;
        while let Some(event) = self.client.next_event() {
            match event {
                Event::Refused(error) => {
                    bail!("the daemon expected {}, found {}", error.expected, error.found)
                }
                Event::Statistics(statistics) => done.statistics = Some(statistics),
                Event::Pacing(pacing) => {
                    let ns = i64::try_from(pacing.refresh_interval_ns).unwrap_or(i64::MAX);
                    done.refresh_interval = Some(MonoSpan::from_ns(ns));
                }
                Event::StreamEnded { .. } => has_ended = true,
                _ => {}
            }
        }
        Ok(has_ended)
    }

    fn end(&mut self, done: &mut Submissions) -> anyhow::Result<()> {
        self.client.destroy_stream(self.stream).context("ending the stream")?;
        while !self.look_at_events(done)? {
            if !self.client.wait(END_TIMEOUT)? {
                bail!("expected the stream to end within {END_TIMEOUT:?}, found that it goes on");
            }
        }
        Ok(())
    }
}
