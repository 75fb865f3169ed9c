//! A pool travels from its writer to its reader, and nothing that is less than sealed is read.

use std::os::fd::{AsFd, OwnedFd};

use foreframe_protocol::memory::{REQUIRED_SEALS, ReadOnlyPool, WritablePool, create_memfd};
use foreframe_protocol::{Error, RegisterPool, socket};
use rustix::fs::{FallocateFlags, SealFlags, fallocate, fcntl_add_seals, ftruncate};

const SLOT: u64 = 8192;

fn property(refused: Result<ReadOnlyPool, Error>) -> &'static str {
    match refused.expect_err("the pool must be refused") {
        Error::Memory { property, .. } => property,
        other => panic!("expected a memory error, found {other}"),
    }
}

/// A memfd of `bytes` bytes, every page written.
fn written(bytes: u64) -> OwnedFd {
    let fd = create_memfd("test").expect("a memfd");
    let zeros = vec![0; usize::try_from(bytes).expect("small")];
    assert_eq!(rustix::io::write(&fd, &zeros).expect("room in memory"), zeros.len());
    fd
}

#[test]
fn reader_sees_what_the_writer_put_into_its_slot() {
    let (pool, mut slots) = WritablePool::allocate("test", 3, SLOT).unwrap();
    for slot in &mut slots {
        let index = u8::try_from(slot.index()).unwrap();
        slot.fill(index + 1);
    }
    let reader =
        ReadOnlyPool::accept(pool.fd().try_clone_to_owned().unwrap(), 3 * SLOT, 3 * SLOT).unwrap();
    let mut bytes = [0; 4];
    reader.copy_to(SLOT - 2, &mut bytes).unwrap();
    assert_eq!(bytes, [1, 1, 2, 2]);
    // The writer goes on writing through the mapping that it made before it sealed.
    slots[1].fill(9);
    reader.copy_to(SLOT - 2, &mut bytes).unwrap();
    assert_eq!(bytes, [1, 1, 9, 9]);
}

#[test]
fn each_missing_seal_is_refused_and_all_four_are_enough() {
    for missing in [SealFlags::GROW, SealFlags::SHRINK, SealFlags::FUTURE_WRITE, SealFlags::SEAL] {
        let fd = written(SLOT);
        fcntl_add_seals(&fd, REQUIRED_SEALS.difference(missing)).unwrap();
        assert_eq!(property(ReadOnlyPool::accept(fd, SLOT, SLOT)), "seals", "{missing:?}");
    }
    let fd = written(SLOT);
    fcntl_add_seals(&fd, REQUIRED_SEALS).unwrap();
    ReadOnlyPool::accept(fd, SLOT, SLOT).unwrap();
}

#[test]
fn blocks_allocated_behind_the_end_do_not_hide_a_hole() {
    let fd = create_memfd("test").unwrap();
    ftruncate(&fd, SLOT).unwrap();
    fallocate(&fd, FallocateFlags::KEEP_SIZE, SLOT, SLOT).unwrap();
    fcntl_add_seals(&fd, REQUIRED_SEALS).unwrap();
    let blocks = rustix::fs::fstat(&fd).unwrap().st_blocks;
    assert!(u64::try_from(blocks).unwrap() * 512 >= SLOT, "the block count alone looks right");
    assert_eq!(property(ReadOnlyPool::accept(fd, SLOT, SLOT)), "allocation");
}

#[test]
fn pool_arrives_with_its_message() {
    let (client, daemon) = socket::Channel::pair().unwrap();
    let (pool, _slots) = WritablePool::allocate("test", 2, SLOT).unwrap();
    let message = RegisterPool { stream: 1, pool: 1, slots: 2, slot_bytes: SLOT };
    let packet = foreframe_protocol::Packet::new(&message);
    assert_eq!(client.send(&packet, Some(pool.fd())).unwrap(), socket::Sent::Whole);
    let socket::Received::Packet(incoming) = daemon.receive().unwrap() else {
        panic!("a packet was sent");
    };
    let (received, fd) = incoming.parse_client().unwrap();
    assert_eq!(received, message.into());
    let fd = fd.expect("the message carries one");
    ReadOnlyPool::accept(fd.as_fd().try_clone_to_owned().unwrap(), 2 * SLOT, 2 * SLOT).unwrap();
}
