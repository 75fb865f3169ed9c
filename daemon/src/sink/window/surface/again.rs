//! When a surface that does not work any more is made again: a pure function of why, when, and how
//! often that has happened. The CPU draws meanwhile, and for good once it has happened too often.

use foreframe_engine::backend::gpu::GpuError;
use foreframe_engine::{MonoSpan, MonoTime};

use super::SurfaceError;

/// Time that passes before each try, the first one first. After as many losses, there is none.
const WAITS: [MonoSpan; 4] = [
    MonoSpan::from_ms(250),
    MonoSpan::from_ms(1_000),
    MonoSpan::from_ms(4_000),
    MonoSpan::from_ms(16_000),
];
/// A surface that has worked for so long is none that fails again and again.
const GOOD_AFTER: MonoSpan = MonoSpan::from_ms(60_000);

/// The losses of one window.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::sink::window) struct Losses {
    /// Since a surface worked for long.
    count: usize,
    /// When the newest surface was made. None while there is none.
    made_at: Option<MonoTime>,
}

impl Losses {
    /// A surface was made.
    pub(in crate::sink::window) fn on_made(&mut self, now: MonoTime) {
        self.made_at = Some(now);
    }

    /// There is none any more, or none was made: time to wait before another is; None if none is to
    /// be made.
    pub(in crate::sink::window) fn on_loss(
        &mut self,
        why: &SurfaceError,
        now: MonoTime,
    ) -> Option<MonoSpan> {
        if self.made_at.take().is_some_and(|made_at| now - made_at >= GOOD_AFTER) {
            self.count = 0;
        }
        let wait = WAITS.get(self.count).copied().filter(|_| may_pass(why));
        self.count += 1;
        wait
    }
}

/// Whether another surface may work where this one does not. One that refuses or is lost is, when a
/// display or an output changes. Without the device, the CPU makes the pictures, and has a cheaper
/// way into the window; what does not answer may still hold the window.
fn may_pass(why: &SurfaceError) -> bool {
    match why {
        SurfaceError::Lost | SurfaceError::OtherDevice | SurfaceError::Refused(_) => true,
        SurfaceError::Gpu(error) => {
            matches!(error, GpuError::Refused { .. } | GpuError::OutOfMemory { .. })
        }
        SurfaceError::NoGpu
        | SurfaceError::CannotPresent(_)
        | SurfaceError::NoMode(_)
        | SurfaceError::NoFormat(_)
        | SurfaceError::Panicked
        | SurfaceError::NoThread(_)
        | SurfaceError::NoAnswer => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(ms: i64) -> MonoTime {
        MonoTime::ZERO + MonoSpan::from_ms(ms)
    }

    /// When a surface was made, if one was, and lost, in milliseconds.
    type Life = (Option<i64>, i64);

    /// Its name, lives of surfaces one after the other, and the wait after each.
    type Case = (&'static str, &'static [Life], &'static [Option<i64>]);

    /// The wait after each loss, in milliseconds.
    fn waits(lives: &[Life]) -> Vec<Option<i64>> {
        let mut losses = Losses::default();
        let wait = |&(made_at, lost_at): &Life| {
            if let Some(made_at) = made_at {
                losses.on_made(at(made_at));
            }
            let wait = losses.on_loss(&SurfaceError::Lost, at(lost_at));
            wait.map(|wait| wait.as_ns() / 1_000_000)
        };
        lives.iter().map(wait).collect()
    }

    #[test]
    fn each_try_waits_longer_and_the_fifth_loss_is_the_last() {
        let cases: [Case; 5] = [
            ("one loss", &[(Some(0), 10)], &[Some(250)]),
            (
                "again and again",
                &[
                    (Some(0), 10),
                    (Some(260), 270),
                    (Some(1_270), 1_280),
                    (Some(5_280), 5_290),
                    (Some(21_290), 21_300),
                    (Some(21_300), 21_310),
                ],
                &[Some(250), Some(1_000), Some(4_000), Some(16_000), None, None],
            ),
            (
                "none is made in between",
                &[(Some(0), 10), (None, 260), (None, 1_260), (None, 5_260), (None, 21_260)],
                &[Some(250), Some(1_000), Some(4_000), Some(16_000), None],
            ),
            (
                "one that works for a minute is good",
                &[(Some(0), 10), (Some(260), 60_260), (Some(60_510), 60_520)],
                &[Some(250), Some(250), Some(1_000)],
            ),
            (
                "one that works for less is not",
                &[(Some(0), 10), (Some(260), 60_259)],
                &[Some(250), Some(1_000)],
            ),
        ];
        for (name, lives, expected) in cases {
            assert_eq!(waits(lives), expected, "{name}");
        }
    }

    #[test]
    fn only_what_may_pass_is_tried_again() {
        let why = || "why".to_owned();
        let cases = [
            (SurfaceError::Lost, true),
            (SurfaceError::OtherDevice, true),
            (SurfaceError::Refused(why()), true),
            (SurfaceError::Gpu(GpuError::Refused { why: why() }), true),
            (SurfaceError::Gpu(GpuError::OutOfMemory { why: why() }), true),
            (SurfaceError::Gpu(GpuError::Lost { why: why() }), false),
            (SurfaceError::NoGpu, false),
            (SurfaceError::CannotPresent(why()), false),
            (SurfaceError::NoMode(why()), false),
            (SurfaceError::NoFormat(why()), false),
            (SurfaceError::Panicked, false),
            (SurfaceError::NoThread(why()), false),
            (SurfaceError::NoAnswer, false),
        ];
        for (error, expected) in cases {
            let wait = Losses::default().on_loss(&error, at(0));
            assert_eq!(wait.is_some(), expected, "{error}");
        }
    }
}
