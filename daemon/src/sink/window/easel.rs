//! The place for one picture between a stream and a thread that draws.
//!
//! Drawing may wait for the display, so the stream leaves its picture here and goes on. What the
//! thread did not get to is replaced by the next.

use std::sync::{Condvar, Mutex, PoisonError};

use foreframe_engine::ColorPlane;

/// A place for a picture, with what is to be known of it.
#[derive(Debug)]
pub(super) struct Easel<M> {
    state: Mutex<State<M>>,
    changed: Condvar,
}

#[derive(Debug)]
struct State<M> {
    next: Option<(M, ColorPlane)>,
    /// A picture that was drawn, for its memory.
    spare: Option<ColorPlane>,
    is_over: bool,
}

impl<M> Default for Easel<M> {
    fn default() -> Self {
        let state = Mutex::new(State { next: None, spare: None, is_over: false });
        Self { state, changed: Condvar::new() }
    }
}

impl<M> Easel<M> {
    /// Leaves a copy of `frame`. What is known of the picture that it replaces, if nobody has
    /// taken that.
    pub(super) fn leave(&self, known: M, frame: &ColorPlane) -> Option<M> {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        let (replaced, memory) = match state.next.take() {
            Some((replaced, memory)) => (Some(replaced), Some(memory)),
            None => (None, state.spare.take()),
        };
        let copy = match memory {
            Some(mut memory) => {
                memory.reset(frame.format(), frame.width(), frame.height());
                memory.copy_from(frame);
                memory
            }
            None => frame.clone(),
        };
        state.next = Some((known, copy));
        self.changed.notify_one();
        replaced
    }

    /// Leaves a picture that is in what is known of it; what is taken beside that is any other.
    pub(super) fn leave_known(&self, known: M) -> Option<M> {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        let (replaced, memory) = match state.next.take() {
            Some((replaced, memory)) => (Some(replaced), memory),
            None => (None, state.spare.take().unwrap_or_default()),
        };
        state.next = Some((known, memory));
        self.changed.notify_one();
        replaced
    }

    /// Waits for the next picture; None when there will be none. Gives back one that was drawn.
    pub(super) fn take(&self, drawn: Option<ColorPlane>) -> Option<(M, ColorPlane)> {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        state.spare = drawn;
        loop {
            if state.is_over {
                return None;
            }
            if let Some(next) = state.next.take() {
                return Some(next);
            }
            state = self.changed.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// There will be none.
    pub(super) fn close(&self) {
        self.state.lock().unwrap_or_else(PoisonError::into_inner).is_over = true;
        self.changed.notify_one();
    }
}

#[cfg(test)]
mod tests {
    use foreframe_engine::StreamFormat;

    use super::*;

    fn grey(level: u8, width: u32) -> ColorPlane {
        let mut frame = ColorPlane::new(StreamFormat::rgba8(1, 1).color, width, 1);
        frame.as_mut_bytes().fill(level);
        frame
    }

    #[test]
    fn the_newest_picture_is_taken_and_the_one_that_it_replaced_is_named() {
        let easel = Easel::default();
        assert_eq!(easel.leave(1, &grey(1, 2)), None);
        assert_eq!(easel.leave(2, &grey(2, 2)), Some(1));
        let (known, frame) = easel.take(None).unwrap();
        assert_eq!((known, frame.as_bytes()), (2, grey(2, 2).as_bytes()));
        // Its memory comes back, and takes a picture of another size.
        assert_eq!(easel.leave(3, &grey(3, 1)), None);
        let (known, next) = easel.take(Some(frame)).unwrap();
        assert_eq!((known, next.as_bytes()), (3, grey(3, 1).as_bytes()));
        assert_eq!(easel.leave(4, &grey(4, 3)), None);
        assert_eq!(easel.take(None).unwrap().1.as_bytes(), grey(4, 3).as_bytes());
        easel.close();
        assert!(easel.take(None).is_none(), "it is over");
    }
}
