//! The demo's application: submits each key when its content time has come.

use std::time::Duration;

use anyhow::{Context as _, bail};
use foreframe_client::{ConnectOptions, Event, Statistics};
use foreframe_engine::{MonoSpan, MonoTime};
use foreframe_fixtures::{FootageClient, Submitted};
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
    /// Keys for which no slot was free.
    pub skipped: u64,
    /// Time to fill and submit each key.
    pub work: Vec<MonoSpan>,
    /// The daemon's counts at the end.
    pub statistics: Option<Statistics>,
    /// The daemon's counts after the first second.
    pub settled: Option<Statistics>,
}

/// A client with footage to submit.
#[derive(Debug)]
pub struct Application {
    client: FootageClient,
    base: MonoTime,
}

impl Application {
    /// Connects and creates the stream; the first key is due at `base`.
    ///
    /// # Errors
    /// If the daemon refuses.
    pub fn connect(
        options: &ConnectOptions,
        rehearsal: &Rehearsal,
        base: MonoTime,
    ) -> anyhow::Result<Self> {
        let footage = &rehearsal.footage;
        let client = FootageClient::connect(options, CONNECT_TIMEOUT, footage, base.as_ns())
            .context("connecting as the application")?;
        Ok(Self { client, base })
    }

    /// Submits every key in time, then ends the stream.
    ///
    /// # Errors
    /// If the daemon goes away or finds fault with something.
    pub fn play(mut self, rehearsal: &Rehearsal, bar: &ProgressBar) -> anyhow::Result<Submissions> {
        let footage = &rehearsal.footage;
        let mut done = Submissions::default();
        for index in 0..footage.keys.len() as u64 {
            let due_at = MonoTime::from_ns(self.client.content_time_ns(footage, index));
            clock::sleep_until(due_at);
            let started_at = clock::now();
            match self.client.submit(footage, index).context("submitting a key frame")? {
                Submitted::Sent => {
                    let sent_at = clock::now();
                    done.work.push(sent_at - started_at);
                    done.sent.push((index, sent_at));
                }
                Submitted::Skipped => done.skipped += 1,
            }
            self.look_at_events()?;
            if done.settled.is_none() && due_at - self.base >= SETTLED_AFTER {
                let stream = self.client.stream();
                done.settled = self.client.client_mut().statistics(stream);
            }
            bar.inc(1);
        }
        let last = self.client.content_time_ns(footage, footage.keys.len() as u64);
        clock::sleep_until(MonoTime::from_ns(last));
        self.end(&mut done)?;
        Ok(done)
    }

    fn look_at_events(&mut self) -> anyhow::Result<bool> {
        let mut has_ended = false;
        while let Some(event) = self.client.client_mut().next_event() {
            match event {
                Event::Refused(error) => {
                    bail!("the daemon expected {}, found {}", error.expected, error.found)
                }
                Event::StreamEnded { .. } => has_ended = true,
                _ => {}
            }
        }
        Ok(has_ended)
    }

    fn end(&mut self, done: &mut Submissions) -> anyhow::Result<()> {
        let stream = self.client.stream();
        self.client.client_mut().destroy_stream(stream).context("ending the stream")?;
        while !self.look_at_events()? {
            if !self.client.client_mut().wait(END_TIMEOUT)? {
                bail!("expected the stream to end within {END_TIMEOUT:?}, found that it goes on");
            }
        }
        done.statistics = self.client.client_mut().statistics(stream);
        Ok(())
    }
}
