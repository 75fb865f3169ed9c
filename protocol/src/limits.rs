//! Numbers that both sides know before they have met. What a daemon grants on top is in its
//! [`Welcome`](crate::Welcome).

/// First four bytes of every packet: `FFRM` read as a little-endian word.
pub const MAGIC: u32 = u32::from_le_bytes(*b"FFRM");
/// Version of the layout. Peers with different majors refuse each other.
pub const MAJOR: u16 = 1;
/// Version of the contents. Peers with different minors understand each other.
pub const MINOR: u16 = 0;

/// Largest packet in bytes, header included.
pub const MAX_PACKET_BYTES: usize = 1024;
/// Most file descriptors that a packet may carry.
pub const MAX_FDS: usize = 1;

/// Slots of a stream or of an output pool, at least.
pub const MIN_SLOTS: u32 = 1;
/// Slots of a stream unless it says otherwise.
pub const DEFAULT_SLOTS: u32 = 3;
/// Slots of a stream or of an output pool, at most.
pub const MAX_SLOTS: u32 = 8;

/// Largest width and height of a plane, in pixels.
pub const MAX_SIZE: u32 = 8192;
/// A plane has at least 1/4 of the columns and rows of colour (rounded down).
pub const MAX_PLANE_RATIO: u32 = 4;
/// Largest stride, in bytes: twice the widest row of the widest format.
pub const MAX_STRIDE: u32 = 2 * MAX_SIZE * 8;
/// A plane starts at a multiple of this many bytes in its slot.
pub const OFFSET_ALIGN: u64 = 16;
/// A slot, and therefore a pool, is a multiple of this many bytes.
pub const SLOT_ALIGN: u64 = 4096;
/// Largest pool, in bytes: eight slots of 8192x8192 pixels with every plane at full size.
pub const MAX_POOL_BYTES: u64 = 1 << 34;

/// Largest jitter, in pixels of its plane, to either side.
pub const MAX_JITTER_PX: f32 = 1.0;
/// Largest factor on motion vectors, to either side.
pub const MAX_MOTION_SCALE: f32 = 1e6;
/// Largest white, in cd/m2: the peak of SMPTE ST 2084.
pub const MAX_WHITE_CD_M2: f32 = 10_000.0;
/// Latest instant that a message may name: 2^63 - 1 nanoseconds.
pub const MAX_TIME_NS: u64 = i64::MAX as u64;
/// Phase 4 in Q12, the farthest extrapolation there is.
pub const MAX_PHASE_Q12: u32 = 4 << 12;

/// Time that a peer has between connecting and the end of the handshake, in nanoseconds.
pub const HANDSHAKE_TIMEOUT_NS: u64 = 2_000_000_000;
