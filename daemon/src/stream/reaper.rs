//! Drops what is slow to drop on a thread of its own.
//!
//! To unmap a pool and close its descriptor takes milliseconds, which neither the main loop nor a
//! stream can spare. [`Reaped`] sends its content to the [`Reaper`] when it goes out of scope.

use std::any::Any;
use std::io;
use std::ops::{Deref, DerefMut};
use std::sync::mpsc::{Sender, channel};
use std::thread;

/// The thread that drops things. Clones share it; it ends when the last one is gone.
#[derive(Clone, Debug)]
pub struct Reaper {
    things: Sender<Box<dyn Any + Send>>,
}

impl Reaper {
    /// Starts the thread.
    ///
    /// # Errors
    /// If it cannot be started.
    pub fn spawn() -> io::Result<Self> {
        let (things, queue) = channel::<Box<dyn Any + Send>>();
        thread::Builder::new()
            .name("foreframe-reaper".to_owned())
            .spawn(move || queue.iter().for_each(drop))?;
        Ok(Self { things })
    }

    /// Wraps `content` so that it is dropped on the reaper's thread.
    pub fn guard<T: Any + Send>(&self, content: T) -> Reaped<T> {
        Reaped { content: Some(content), reaper: self.clone() }
    }
}

/// Something that is dropped elsewhere.
#[derive(Debug)]
pub struct Reaped<T: Any + Send> {
    /// There until the drop.
    content: Option<T>,
    reaper: Reaper,
}

impl<T: Any + Send> Deref for Reaped<T> {
    type Target = T;

    fn deref(&self) -> &T {
        self.content.as_ref().expect("content is there until the drop")
    }
}

impl<T: Any + Send> DerefMut for Reaped<T> {
    fn deref_mut(&mut self) -> &mut T {
        self.content.as_mut().expect("content is there until the drop")
    }
}

impl<T: Any + Send> Drop for Reaped<T> {
    fn drop(&mut self) {
        if let Some(content) = self.content.take() {
            // With the thread gone, what comes back in the error is dropped right here.
            drop(self.reaper.things.send(Box::new(content)));
        }
    }
}

#[cfg(test)]
mod tests {
    use std::thread::ThreadId;

    use super::*;

    struct SaysWhereItDies(Sender<ThreadId>);

    impl Drop for SaysWhereItDies {
        fn drop(&mut self) {
            self.0.send(thread::current().id()).unwrap();
        }
    }

    #[test]
    fn what_is_guarded_dies_on_another_thread() {
        let (died_on, died) = channel();
        drop(Reaper::spawn().unwrap().guard(SaysWhereItDies(died_on)));
        assert_ne!(died.recv().unwrap(), thread::current().id());
    }
}
