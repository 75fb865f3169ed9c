//! What an application links: hands key frames to the daemon, never blocks, never panics.
