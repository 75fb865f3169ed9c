//! Memory that is not what a client says it is: each is refused with the property that is missing.

#![allow(clippy::unwrap_used, reason = "a helper that cannot go on fails its test")]

mod daemon_fixture;

use std::fs::File;
use std::os::fd::{AsFd as _, BorrowedFd, OwnedFd};

use daemon_fixture::{Client, KeySource, RunningDaemon};
use foreframe_protocol::memory::{REQUIRED_SEALS, create_memfd};
use foreframe_protocol::socket::Sent;
use foreframe_protocol::{ClientMessage, CreateStream, DaemonMessage, ErrorCode, StreamFormat};
use rustix::fs::{FallocateFlags, SealFlags, fallocate, fcntl_add_seals, ftruncate};

const SLOT_BYTES: u64 = 4096;
const POOL_BYTES: u64 = 3 * SLOT_BYTES;

/// Opens a stream and registers `fd` as its pool of three pages.
fn register(client: &mut Client, fd: BorrowedFd<'_>) {
    let format = StreamFormat::rgba8(8, 8);
    let create = CreateStream { stream: 1, format, max_sizes: format.full_sizes(), slots: 3 };
    client.send(create);
    let source = KeySource::new(create);
    assert_eq!(source.register.pool_bytes(), POOL_BYTES);
    let packet = ClientMessage::from(source.register).to_packet();
    assert_eq!(client.channel.send(&packet, Some(fd)).unwrap(), Sent::Whole);
}

/// A memfd with every page written, of this size, with these seals.
fn memfd(bytes: u64, seals: SealFlags) -> OwnedFd {
    let fd = create_memfd("test").unwrap();
    ftruncate(&fd, bytes).unwrap();
    fallocate(&fd, FallocateFlags::empty(), 0, bytes).unwrap();
    let file = File::from(fd);
    std::os::unix::fs::FileExt::write_all_at(&file, &vec![1; bytes as usize], 0).unwrap();
    fcntl_add_seals(&file, seals).unwrap();
    file.into()
}

fn refusal(daemon: &RunningDaemon, what: &str, fd: BorrowedFd<'_>) {
    let mut client = daemon.connect();
    register(&mut client, fd);
    let said = client.read_to_end();
    let error = said.iter().find_map(|message| match message {
        DaemonMessage::Error(error) => Some(error),
        _ => None,
    });
    let error = error.unwrap_or_else(|| panic!("{what}: accepted: {said:?}"));
    assert!(error.is_fatal && error.code == ErrorCode::Memory, "{what}: {error:?}");
    assert!(!error.expected.is_empty() && !error.found.is_empty(), "{what}: {error:?}");
}

#[test]
fn a_pool_without_all_four_seals_is_refused() {
    let daemon = RunningDaemon::start("shm");
    let seals = [SealFlags::SEAL, SealFlags::SHRINK, SealFlags::GROW, SealFlags::FUTURE_WRITE];
    for missing in seals {
        let fd = memfd(POOL_BYTES, REQUIRED_SEALS.difference(missing));
        refusal(&daemon, &format!("without {missing:?}"), fd.as_fd());
    }
    refusal(&daemon, "without any", memfd(POOL_BYTES, SealFlags::empty()).as_fd());
    // The control: with all of them it is taken.
    let mut client = daemon.connect();
    register(&mut client, memfd(POOL_BYTES, REQUIRED_SEALS).as_fd());
    client.expect("pool accepted", |message| {
        matches!(message, DaemonMessage::PoolAccepted(_)).then_some(())
    });
}

#[test]
fn a_pool_of_another_size_or_with_holes_is_refused() {
    let daemon = RunningDaemon::start("shm");
    for bytes in [SLOT_BYTES, POOL_BYTES - 1, POOL_BYTES + SLOT_BYTES] {
        refusal(&daemon, &format!("{bytes} bytes"), memfd(bytes, REQUIRED_SEALS).as_fd());
    }
    let sparse = create_memfd("test").unwrap();
    ftruncate(&sparse, POOL_BYTES).unwrap();
    fcntl_add_seals(&sparse, REQUIRED_SEALS).unwrap();
    refusal(&daemon, "sparse", sparse.as_fd());
}

#[test]
fn a_descriptor_of_another_kind_is_refused() {
    let daemon = RunningDaemon::start("shm");
    let file = tempfile::tempfile().unwrap();
    file.set_len(POOL_BYTES).unwrap();
    refusal(&daemon, "a file", file.as_fd());
    refusal(&daemon, "a device", File::open("/dev/zero").unwrap().as_fd());
    refusal(&daemon, "a folder", File::open("/").unwrap().as_fd());
    let (reader, _writer) = std::io::pipe().unwrap();
    refusal(&daemon, "a pipe", reader.as_fd());
    let (socket, _) = std::os::unix::net::UnixStream::pair().unwrap();
    refusal(&daemon, "a socket", socket.as_fd());
}
