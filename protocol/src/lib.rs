//! Wire types, handshake, shared-memory planes and fd passing. PROTOCOL.md is normative.
