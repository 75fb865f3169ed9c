//! The first packet of a session: a hello that is welcomed, or a reason why not.

use foreframe_engine::backend::choice::AdapterFacts;
use foreframe_engine::{MonoSpan, MonoTime};
use foreframe_protocol::limits::{MAJOR, MAX_POOL_BYTES, MAX_SIZE, MAX_SLOTS, MINOR};
use foreframe_protocol::socket::Incoming;
use foreframe_protocol::{
    ClientMessage, Clock, Error, Features, GpuKind, Hello, Reject, RejectCode, Welcome,
};

use crate::gpu;

/// What the daemon grants every client.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Terms {
    /// Optional parts of the protocol that it has.
    pub features: Features,
    /// Streams of one client at once.
    pub max_streams: u32,
    /// Bytes that a client's streams may cost.
    pub memory_per_client: u64,
    /// Period of the output.
    pub refresh_interval: MonoSpan,
}

impl Terms {
    /// Reads the first packet of a client.
    ///
    /// # Errors
    /// The message that tells it why there is no session.
    pub fn greet(&self, packet: Incoming) -> Result<Hello, Reject> {
        let hello = match packet.parse_client() {
            Ok((ClientMessage::Hello(hello), _)) => hello,
            Ok((other, _)) => {
                let text = format!("expected hello as the first message, found {}", other.kind());
                return Err(Reject::new(RejectCode::Malformed, text));
            }
            Err(error @ Error::Version { .. }) => {
                return Err(Reject::new(RejectCode::Version, error.to_string()));
            }
            Err(error) => return Err(Reject::new(RejectCode::Malformed, error.to_string())),
        };
        if !self.features.contains(hello.required_features) {
            let text = format!(
                "expected required features within {:#x}, found {:#x}",
                self.features.0, hello.required_features.0
            );
            return Err(Reject::new(RejectCode::Feature, text));
        }
        Ok(hello)
    }

    /// The answer to a hello; `adapter` makes the client's pictures, or else the CPU does.
    #[must_use]
    pub fn welcome(
        &self,
        hello: &Hello,
        adapter: Option<&AdapterFacts>,
        session: u32,
        now: MonoTime,
    ) -> Welcome {
        let wanted = Features(hello.required_features.0 | hello.optional_features.0);
        Welcome {
            major: MAJOR,
            minor: MINOR,
            session,
            features: self.features.common(wanted),
            clock: Clock::Monotonic,
            clock_now_ns: now.as_ns(),
            max_streams: self.max_streams,
            max_slots: MAX_SLOTS,
            max_width: MAX_SIZE,
            max_height: MAX_SIZE,
            max_pool_bytes: self.memory_per_client.min(MAX_POOL_BYTES),
            refresh_interval_ns: self.refresh_interval.as_ns().unsigned_abs(),
            gpu_kind: adapter.map_or(GpuKind::Cpu, |facts| gpu::kind(facts.kind)),
            gpu_name: adapter.map_or("cpu", |facts| &facts.name).to_owned(),
            gpu_pci: adapter.and_then(gpu::pci_address),
        }
    }
}
