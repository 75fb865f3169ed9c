//! What each refresh of the display showed, and what follows from it: judder and the timeline.
//!
//! The audience receives new pictures alone. A refresh between two of them showed the first one
//! again, unless pictures were shown that the audience did not receive.

use foreframe_client::OutputKind;
use foreframe_engine::{MonoSpan, MonoTime};

use super::application::Submissions;
use super::audience::{Seen, Shown};
use crate::pictures::{PresentKind, TimelineEvent};

/// Part of the show that the timeline draws: 0.4 s from the second third on.
const TIMELINE_SPAN: MonoSpan = MonoSpan::from_ms(400);

/// Refreshes between two pictures that follow each other, all of which showed the first one again.
/// None where pictures are missing between them.
fn repeats_between(before: &Shown, after: &Shown, refresh_interval: MonoSpan) -> Option<u64> {
    let span = after.present_at - before.present_at;
    let refreshes = (span.as_secs_f64() / refresh_interval.as_secs_f64()).round();
    let received_all = before.not_received == after.not_received;
    #[expect(clippy::cast_possible_truncation, reason = "a show lasts seconds")]
    #[expect(clippy::cast_sign_loss, reason = "not below 0")]
    received_all.then_some((refreshes - 1.0).max(0.0) as u64)
}

/// Standard deviation of the content-time step from one refresh to the next, over the refresh
/// interval. A refresh without a new picture is a step of 0. Pictures that were shown but not
/// received leave the steps around them out. None without steps.
pub(super) fn content_judder(frames: &[Shown], refresh_interval: MonoSpan) -> Option<f64> {
    let mut steps = Vec::new();
    for pair in frames.windows(2) {
        let Some(repeats) = repeats_between(&pair[0], &pair[1], refresh_interval) else { continue };
        steps.extend((0..repeats).map(|_| 0.0));
        let step = pair[1].content_ns as f64 - pair[0].content_ns as f64;
        steps.push(step / 1e9 / refresh_interval.as_secs_f64());
    }
    let count = steps.len() as f64;
    let mean = (!steps.is_empty()).then(|| steps.iter().sum::<f64>() / count)?;
    let squares: f64 = steps.iter().map(|step| (step - mean) * (step - mean)).sum();
    Some((squares / count).sqrt())
}

/// What a refresh without a bar in the timeline is, if there are any.
pub(super) fn meaning_of_gaps(frames: &[Shown]) -> &'static str {
    let received_all = frames.windows(2).all(|pair| pair[0].not_received == pair[1].not_received);
    if received_all { "" } else { "; no bar: not received" }
}

/// Every refresh that is known, in order: when it was, what it showed, and of which content time.
/// Refreshes without a new picture are of kind `unshown`.
fn refreshes(
    frames: &[Shown],
    refresh_interval: MonoSpan,
    unshown: PresentKind,
) -> Vec<(MonoTime, PresentKind, u64)> {
    let mut all = Vec::new();
    for (index, shown) in frames.iter().enumerate() {
        if let Some(before) = index.checked_sub(1).map(|before| &frames[before]) {
            let repeats =
                repeats_between(before, shown, refresh_interval).unwrap_or(0).cast_signed();
            let span = shown.present_at - before.present_at;
            all.extend((1..=repeats).map(|nth| {
                (before.present_at + span.scale(nth, repeats + 1), unshown, before.content_ns)
            }));
        }
        let kind = match shown.kind {
            OutputKind::Real => PresentKind::Real,
            OutputKind::Synthesised => PresentKind::Synthesised,
            OutputKind::Repeated => PresentKind::Repeated,
        };
        all.push((shown.present_at, kind, shown.content_ns));
    }
    all
}

/// Arrivals and refreshes of a part of the show. A refresh without a new picture is of kind
/// `unshown`.
pub(super) fn timeline_events(
    submissions: &Submissions,
    seen: &Seen,
    key_interval_ns: u64,
    refresh_interval: MonoSpan,
    unshown: PresentKind,
) -> Vec<TimelineEvent> {
    let (Some(first), Some(last)) = (seen.frames.first(), seen.frames.last()) else {
        return Vec::new();
    };
    let start = first.present_at + (last.present_at - first.present_at).scale(1, 3);
    let at_ms = |time: MonoTime| (time - start).as_ms_f64();
    let start_content_ns = (start - first.present_at).as_ns() as f64 + first.content_ns as f64;
    let content_ms = |content_ns: u64| (content_ns as f64 - start_content_ns) / 1e6;
    let is_drawn = |time: MonoTime| time >= start && time < start + TIMELINE_SPAN;
    let keys = submissions.sent.iter().filter(|(_, sent_at)| is_drawn(*sent_at)).map(
        |&(index, sent_at)| TimelineEvent::Key {
            arrived_at_ms: at_ms(sent_at),
            content_ms: content_ms(index * key_interval_ns),
        },
    );
    let presents = refreshes(&seen.frames, refresh_interval, unshown);
    let presents =
        presents.into_iter().filter(|(at, ..)| is_drawn(*at)).map(|(at, kind, content_ns)| {
            TimelineEvent::Present {
                at_ms: at_ms(at),
                kind,
                content_ms: Some(content_ms(content_ns)),
            }
        });
    keys.chain(presents).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const INTERVAL: MonoSpan = MonoSpan::from_ms(10);

    fn at(refresh: i64) -> MonoTime {
        MonoTime::ZERO + INTERVAL.scale(refresh, 1)
    }

    /// Frames shown at the given refreshes of a 100 Hz display, content times in ms.
    fn shown(frames: &[(i64, u64)]) -> Vec<Shown> {
        let frame = |&(refresh, content_ms): &(i64, u64)| Shown {
            kind: OutputKind::Synthesised,
            key_index: 0,
            phase: 0.0,
            content_ns: content_ms * 1_000_000,
            present_at: at(refresh),
            not_received: 0,
            psnr_rgb_db: None,
        };
        frames.iter().map(frame).collect()
    }

    #[test]
    fn even_steps_have_no_judder() {
        let judder = content_judder(&shown(&[(0, 0), (1, 10), (2, 20), (3, 30)]), INTERVAL);
        assert!(judder.unwrap() < 1e-9);
        assert_eq!(content_judder(&shown(&[(0, 0)]), INTERVAL), None);
    }

    #[test]
    fn a_refresh_that_repeats_a_picture_is_judder() {
        let judder =
            content_judder(&shown(&[(0, 0), (1, 10), (3, 30), (4, 40)]), INTERVAL).unwrap();
        let expected = (0.5_f64).sqrt();
        assert!((judder - expected).abs() < 1e-9, "steps 1, 0, 2, 1: found {judder}");
    }

    #[test]
    fn steps_around_frames_that_were_not_received_do_not_count() {
        let mut frames = shown(&[(0, 0), (1, 10), (3, 30), (4, 40)]);
        frames[2].not_received = 1;
        frames[3].not_received = 1;
        assert!(content_judder(&frames, INTERVAL).unwrap() < 1e-9);
    }

    #[test]
    fn a_refresh_without_a_new_picture_showed_the_one_before_again() {
        let frames = shown(&[(0, 0), (1, 10), (4, 40)]);
        let made = |refresh, content_ms: u64| {
            (at(refresh), PresentKind::Synthesised, content_ms * 1_000_000)
        };
        for unshown in [PresentKind::Repeated, PresentKind::Dropped] {
            let again = |refresh| (at(refresh), unshown, 10_000_000);
            let expected = [made(0, 0), made(1, 10), again(2), again(3), made(4, 40)];
            assert_eq!(refreshes(&frames, INTERVAL, unshown), expected);
        }
    }

    #[test]
    fn where_pictures_were_not_received_nobody_knows_what_was_shown() {
        let mut frames = shown(&[(0, 0), (3, 30)]);
        frames[1].not_received = 2;
        assert_eq!(refreshes(&frames, INTERVAL, PresentKind::Repeated).len(), 2);
        assert_eq!(meaning_of_gaps(&frames), "; no bar: not received");
        assert_eq!(meaning_of_gaps(&shown(&[(0, 0), (3, 30)])), "", "all were received");
    }

    #[test]
    fn the_timeline_shows_each_refresh_of_its_part_once() {
        let frames: Vec<_> =
            (0..90).filter(|at| at % 3 != 2).map(|at| (at, 10 * at as u64)).collect();
        let seen = Seen { frames: shown(&frames), kept: Vec::new() };
        let unshown = PresentKind::Repeated;
        let events = timeline_events(&Submissions::default(), &seen, 25_000_000, INTERVAL, unshown);
        let is = |wanted: PresentKind| {
            let is_wanted = |event: &&TimelineEvent| matches!(event, TimelineEvent::Present { kind, .. } if *kind == wanted);
            events.iter().filter(is_wanted).count()
        };
        assert_eq!((is(PresentKind::Synthesised), is(PresentKind::Repeated)), (27, 13));
    }
}
