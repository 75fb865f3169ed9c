//! Allocates the output pools of subscribers on a thread of its own.
//!
//! The pages of a pool are touched before it is sealed, half a millisecond per megabyte: the main
//! loop, and with it every other client, would wait for that. What nobody wants any more when its
//! turn comes is not allocated at all.

use std::io;
use std::os::fd::OwnedFd;
use std::sync::mpsc::{self, channel};
use std::sync::{Arc, Weak};
use std::thread;

use calloop::channel::Sender;
use foreframe_protocol::{Error, OutputPool, StreamFormat};

use super::outlet::Outlet;

/// Kept by whoever waits for a pool; gone when the pool is no longer wanted.
pub type Wish = Arc<()>;

/// A pool that is wanted.
#[derive(Clone, Debug)]
pub struct PoolRequest {
    /// Session of the subscriber.
    pub session: u32,
    /// What the subscriber calls the stream.
    pub stream: u32,
    /// Number of the pool in that session.
    pub pool: u32,
    /// How many frames it holds.
    pub slots: u32,
    /// What the stream's frames are.
    pub format: StreamFormat,
    /// Whether it is still wanted.
    pub wish: Weak<()>,
}

/// What became of a request.
#[derive(Debug)]
pub struct AllocatedPool {
    /// Session of the subscriber.
    pub session: u32,
    /// What the subscriber calls the stream.
    pub stream: u32,
    /// Number of the pool in that session.
    pub pool: u32,
    /// The pool, what to tell the subscriber, and the descriptor that goes with it.
    pub made: Result<(Outlet, OutputPool, OwnedFd), Error>,
}

/// The thread that allocates. It ends when this is gone.
#[derive(Debug)]
pub struct Allocator {
    requests: mpsc::Sender<PoolRequest>,
}

impl Allocator {
    /// Starts the thread, which tells `results` of every pool that is wanted and done.
    ///
    /// # Errors
    /// If it cannot be started.
    pub fn spawn(results: Sender<AllocatedPool>) -> io::Result<Self> {
        let (requests, queue) = channel::<PoolRequest>();
        thread::Builder::new().name("foreframe-pools".to_owned()).spawn(move || {
            for request in queue.iter().filter(|request| request.wish.strong_count() > 0) {
                // Without a main loop nobody wants the pool.
                drop(results.send(allocate(&request)));
            }
        })?;
        Ok(Self { requests })
    }

    /// Asks for a pool. Never waits.
    pub fn request(&self, request: PoolRequest) {
        // The thread ends after its last request, not before.
        drop(self.requests.send(request));
    }
}

fn allocate(request: &PoolRequest) -> AllocatedPool {
    let &PoolRequest { session, stream, pool, slots, ref format, .. } = request;
    let made = Outlet::allocate(session, stream, pool, slots, format).and_then(|made| {
        let (outlet, memory, message) = made;
        let fd = memory.fd().try_clone_to_owned();
        let fd = fd.map_err(|reason| Error::Os { action: "copy a descriptor", reason })?;
        Ok((outlet, message, fd))
    });
    AllocatedPool { session, stream, pool, made }
}

#[cfg(test)]
mod tests {
    use calloop::channel::Event;

    use super::*;

    #[test]
    fn pools_come_back_in_order_and_what_nobody_wants_is_left_out() {
        let (results, events) = calloop::channel::channel();
        let allocator = Allocator::spawn(results).unwrap();
        let kept: Vec<Wish> = vec![Arc::default(), Arc::default()];
        let request = |pool, wish: &Wish| PoolRequest {
            session: 1,
            stream: 0,
            pool,
            slots: 2,
            format: StreamFormat::rgba8(8, 8),
            wish: Arc::downgrade(wish),
        };
        allocator.request(request(1, &kept[0]));
        allocator.request(request(2, &Wish::default()));
        allocator.request(request(3, &kept[1]));
        drop(allocator);
        let mut pools = Vec::new();
        let mut main_loop = calloop::EventLoop::<Vec<u32>>::try_new().unwrap();
        let signal = main_loop.get_signal();
        let on_event = move |event, (): &mut (), pools: &mut Vec<u32>| match event {
            Event::Msg(AllocatedPool { pool, made, .. }) => {
                let (_, message, _) = made.unwrap();
                assert_eq!((message.pool, message.slots), (pool, 2));
                pools.push(pool);
            }
            Event::Closed => signal.stop(),
        };
        main_loop.handle().insert_source(events, on_event).unwrap();
        main_loop.run(None, &mut pools, |_| {}).unwrap();
        assert_eq!(pools, [1, 3]);
    }
}
