//! Real-time priority, which keeps wakes on time on a busy machine. Many machines do not grant it,
//! and streams run without.

use std::io;
use std::sync::Once;
use std::thread;

use thread_priority::{
    RealtimeThreadSchedulePolicy, ThreadPriority, ThreadPriorityValue, ThreadSchedulePolicy,
    set_thread_priority_and_policy, thread_native_id,
};
use tracing::{debug, info};

/// At the lower end: above every ordinary thread, below what drives devices.
const PRIORITY: u8 = 10;

/// Asks for it for the calling thread, a stream's, and says once in the log what came of it.
pub(super) fn ask() {
    static SAID: Once = Once::new();
    let asked = set(PRIORITY);
    SAID.call_once(|| match asked {
        Ok(()) => info!("streams run with real-time priority"),
        Err(error) => info!(%error, "streams run without real-time priority"),
    });
}

/// Asks the same for a thread that a stream waits for or hands its pictures to, as the engine's
/// workers and the threads of surfaces: one below the stream's own.
pub fn ask_for_work() {
    if let Err(error) = set(PRIORITY - 1) {
        debug!(%error, "a worker runs without real-time priority");
    }
}

/// Whether this process would get it: asks on a thread that ends at once.
///
/// # Errors
/// Why it would not, or if no thread can be started.
pub fn probe() -> io::Result<()> {
    let asked = thread::Builder::new().name("priority".to_owned()).spawn(|| set(PRIORITY))?.join();
    let asked = asked.unwrap_or(Err(thread_priority::Error::Ffi("the thread ended early")));
    asked.map_err(|error| match error {
        thread_priority::Error::OS(code) => io::Error::from_raw_os_error(code),
        other => io::Error::other(format!("{other:?}")),
    })
}

fn set(priority: u8) -> Result<(), thread_priority::Error> {
    let policy = ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo);
    let priority = ThreadPriorityValue::try_from(priority)
        .expect("the value is below 100, the highest that there is");
    set_thread_priority_and_policy(
        thread_native_id(),
        ThreadPriority::Crossplatform(priority),
        policy,
    )
}
