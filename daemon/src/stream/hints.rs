//! What a stream would best render: the schedule of the motion-quality model for the pixels that
//! its client renders per second, and the speed at which they move.
//!
//! Once per second of content time, and to the client only when it says something new. The display
//! is taken to be lit all of the time, as most are, and what moves to be predictable. Needs the
//! angular size of a pixel (`--ppd`, `--profile`): without it the model knows no speed.

use foreframe_engine::{MonoSpan, MonoTime};
use foreframe_perception::motion_quality::Motion;
use foreframe_perception::motion_quality::schedule::{
    LEAST_REFRESH_HZ, Schedule, ScheduleDisplay, schedule,
};
use foreframe_protocol::Hint;

/// Content time that one measurement covers.
const WINDOW: MonoSpan = MonoSpan::from_ms(1000);
/// A longer gap between two keys is a pause and measures nothing.
const PAUSE: MonoSpan = MonoSpan::from_ms(250);
/// Change of size or interval from which on a hint is news: less is what the measurement wavers by.
const NEWS: f64 = 0.05;

/// The hints of one stream.
#[derive(Clone, Debug)]
pub struct Hints {
    display: ScheduleDisplay,
    window: Option<Window>,
    told: Option<Schedule>,
}

#[derive(Clone, Copy, Debug)]
struct Window {
    since: MonoTime,
    newest: MonoTime,
    pixels: u64,
}

impl Hints {
    /// For pictures of this size; None where it is not known how large they are to the eye.
    #[must_use]
    pub fn new(size_px: [u32; 2], pixels_per_degree: Option<f32>) -> Option<Self> {
        let display = ScheduleDisplay {
            size_px,
            width_deg: f64::from(size_px[0]) / f64::from(pixels_per_degree?),
            max_refresh_hz: LEAST_REFRESH_HZ,
            persistence: 1.0,
        };
        display.check().is_ok().then_some(Self { display, window: None, told: None })
    }

    /// A key that shows `content_time` was rendered with so many `pixels`, for a display with these
    /// refreshes; `speed` says how fast its picture moves, pixels per second. What to tell the
    /// client, without the number of its stream. Of a display slower than any schedule, nothing.
    pub fn on_key(
        &mut self,
        content_time: MonoTime,
        refresh_interval: MonoSpan,
        pixels: u64,
        speed: impl FnOnce() -> Option<f32>,
    ) -> Option<Hint> {
        let begin = Window { since: content_time, newest: content_time, pixels: 0 };
        let window = self.window.get_or_insert(begin);
        if content_time - window.newest > PAUSE {
            *window = begin;
            return None;
        }
        if content_time > window.newest {
            window.pixels += pixels;
        }
        window.newest = content_time;
        let covered = content_time - window.since;
        if covered < WINDOW {
            return None;
        }
        #[expect(clippy::cast_precision_loss, reason = "pixels of a second have below 2^53")]
        let budget = window.pixels as f64 / covered.as_secs_f64();
        *window = begin;
        // The pacer's estimate wavers by some ppm.
        self.display.max_refresh_hz = (1e3 / refresh_interval.as_secs_f64()).round() / 1e3;
        if self.display.max_refresh_hz < LEAST_REFRESH_HZ {
            return None;
        }
        let velocity = f64::from(speed()?) / self.display.ppd();
        let best = schedule(&self.display, budget, velocity, Motion::Predictable).ok()?;
        let differs = |a: f64, b: f64| (a / b - 1.0).abs() > NEWS;
        let is_news = self.told.is_none_or(|told| {
            differs(best.scale, told.scale) || differs(best.refresh_hz, told.refresh_hz)
        });
        if !is_news {
            return None;
        }
        self.told = Some(best);
        Some(self.hint(best))
    }

    #[expect(clippy::cast_possible_truncation, reason = "float to int casts saturate")]
    #[expect(clippy::cast_sign_loss, reason = "sizes and rates are positive")]
    fn hint(&self, Schedule { refresh_hz, scale }: Schedule) -> Hint {
        let [width, height] =
            self.display.size_px.map(|side| ((f64::from(side) * scale).round() as u32).max(1));
        Hint { stream: 0, width, height, key_interval_ns: (1e9 / refresh_hz).round() as u64 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: [u32; 2] = [1920, 1080];

    /// Hints over `seconds` at this many keys per second, of full size, moving at `speed`.
    fn told(hints: &mut Hints, from_s: i64, keys_hz: i64, speed: f32) -> Vec<Hint> {
        let key = |i: i64| {
            let at = MonoTime::ZERO + MonoSpan::from_ms(1000 * from_s + 1000 * i / keys_hz);
            hints.on_key(at, MonoSpan::from_hz(120.0), 1920 * 1080, || Some(speed))
        };
        (0..3 * keys_hz).filter_map(key).collect()
    }

    fn hints() -> Hints {
        Hints::new(SIZE, Some(50.0)).unwrap()
    }

    #[test]
    fn a_still_picture_wants_pixels_and_a_fast_one_wants_frames_for_the_same_budget() {
        let still = told(&mut hints(), 0, 50, 0.0);
        let fast = told(&mut hints(), 0, 50, 2000.0);
        let ([still], [fast]) = (&still[..], &fast[..]) else { panic!("{still:?} {fast:?}") };
        assert_eq!((still.width, still.height, still.key_interval_ns), (1920, 1080, 20_000_000));
        assert!(fast.width < still.width && fast.key_interval_ns < still.key_interval_ns);
        // Both spend what is spent now.
        let budget = |hint: &Hint| {
            f64::from(hint.width) * f64::from(hint.height) * 1e9 / hint.key_interval_ns as f64
        };
        assert!((budget(fast) / budget(still) - 1.0).abs() < 0.02, "{fast:?}");
    }

    #[test]
    fn the_same_is_said_once_and_a_pause_says_nothing() {
        let mut hints = hints();
        assert_eq!(told(&mut hints, 0, 50, 800.0).len(), 1);
        assert_eq!(told(&mut hints, 3, 50, 800.0).len(), 0);
        // Two minutes later: the pause is no low rate.
        assert_eq!(told(&mut hints, 120, 50, 800.0).len(), 0);
        assert_eq!(told(&mut hints, 123, 50, 0.0).len(), 1);
    }

    #[test]
    fn nothing_is_said_of_pixels_of_unknown_size_or_speed_nor_of_a_slow_display() {
        assert!(Hints::new(SIZE, None).is_none());
        for (refresh_hz, speed) in [(120.0, None), (40.0, Some(800.0))] {
            let mut hints = hints();
            let key = |i: i64| {
                let at = MonoTime::ZERO + MonoSpan::from_ms(20 * i);
                hints.on_key(at, MonoSpan::from_hz(refresh_hz), 1920 * 1080, || speed)
            };
            assert_eq!((0..200).filter_map(key).count(), 0, "{refresh_hz}");
        }
    }
}
