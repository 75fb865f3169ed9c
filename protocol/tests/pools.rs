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

#[test]
fn a_pool_with_pages_that_were_never_written_is_refused() {
    let sealed = |fd: OwnedFd, bytes: u64| {
        fcntl_add_seals(&fd, REQUIRED_SEALS).expect("it may be sealed");
        property(ReadOnlyPool::accept(fd, bytes, u64::MAX))
    };
    let sparse = create_memfd("test").unwrap();
    ftruncate(&sparse, SLOT).unwrap();
    assert_eq!(sealed(sparse, SLOT), "allocation");

    let huge = create_memfd("test").unwrap();
    ftruncate(&huge, 1 << 40).unwrap();
    assert_eq!(sealed(huge, 1 << 40), "allocation");

    let half = create_memfd("test").unwrap();
    ftruncate(&half, SLOT).unwrap();
    rustix::io::pwrite(&half, &[1], 0).unwrap();
    assert_eq!(sealed(half, SLOT), "allocation");
}

#[test]
fn a_pool_of_another_size_than_claimed_or_above_the_quota_is_refused() {
    let sealed = || {
        let fd = written(SLOT);
        fcntl_add_seals(&fd, REQUIRED_SEALS).expect("it may be sealed");
        fd
    };
    assert_eq!(property(ReadOnlyPool::accept(sealed(), 2 * SLOT, u64::MAX)), "size");
    assert_eq!(property(ReadOnlyPool::accept(sealed(), SLOT / 2, u64::MAX)), "size");
    assert_eq!(property(ReadOnlyPool::accept(sealed(), SLOT, SLOT - 1)), "quota");
    ReadOnlyPool::accept(sealed(), SLOT, SLOT).unwrap();
}

#[test]
fn descriptors_that_are_no_memfd_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("file");
    std::fs::write(&file, [0; 8192]).unwrap();
    let (pipe, _write) = std::io::pipe().unwrap();
    let (channel, _other) = socket::Channel::pair().unwrap();
    let open = |path: &std::path::Path| OwnedFd::from(std::fs::File::open(path).unwrap());
    let path_only = rustix::fs::open(&file, rustix::fs::OFlags::PATH, rustix::fs::Mode::empty());
    let others = [
        ("file", open(&file)),
        ("zero", open(std::path::Path::new("/dev/zero"))),
        ("folder", open(folder.path())),
        ("pipe", pipe.into()),
        ("socket", channel.as_fd().try_clone_to_owned().unwrap()),
        ("path", path_only.unwrap()),
    ];
    for (name, fd) in others {
        let refused = property(ReadOnlyPool::accept(fd, SLOT, SLOT));
        assert!(["type", "seals"].contains(&refused), "{name}: {refused}");
    }
}

#[test]
fn huge_pages_are_refused() {
    use rustix::fs::MemfdFlags;
    let flags = MemfdFlags::ALLOW_SEALING | MemfdFlags::HUGETLB | MemfdFlags::CLOEXEC;
    // A kernel without huge pages cannot be attacked with them.
    if let Ok(fd) = rustix::fs::memfd_create("test", flags) {
        fcntl_add_seals(&fd, REQUIRED_SEALS).unwrap();
        assert_eq!(property(ReadOnlyPool::accept(fd, 0, SLOT)), "type");
    }
}

#[test]
fn the_writer_cannot_take_back_what_it_sealed() {
    let (pool, _slots) = WritablePool::allocate("test", 1, SLOT).unwrap();
    let fd = pool.fd();
    let punch = FallocateFlags::PUNCH_HOLE | FallocateFlags::KEEP_SIZE;
    assert!(ftruncate(fd, 0).is_err());
    assert!(ftruncate(fd, 2 * SLOT).is_err());
    assert!(fallocate(fd, punch, 0, SLOT).is_err());
    assert!(rustix::io::pwrite(fd, &[1], 0).is_err());
    let stat = rustix::fs::fstat(fd).unwrap();
    assert_eq!(u64::try_from(stat.st_size).unwrap(), SLOT);
}

#[test]
fn copies_stay_inside_the_pool_and_drop_the_padding() {
    let (pool, mut slots) = WritablePool::allocate("test", 1, SLOT).unwrap();
    for (index, byte) in slots[0].iter_mut().enumerate() {
        *byte = u8::try_from(index % 251).unwrap();
    }
    let reader = ReadOnlyPool::accept(pool.fd().try_clone_to_owned().unwrap(), SLOT, SLOT).unwrap();
    let mut out = vec![9; 3];
    reader.copy_rows_to_vec(10, 100, 3, 2, &mut out).unwrap();
    assert_eq!(out, [10, 11, 12, 110, 111, 112]);
    reader.copy_rows_to_vec(10, 3, 3, 2, &mut out).unwrap();
    assert_eq!(out, [10, 11, 12, 13, 14, 15]);
    reader.copy_to_vec(SLOT - 2, 2, &mut out).unwrap();
    assert_eq!(out.len(), 2);
    for (offset, len) in [(SLOT - 1, 2), (SLOT, 1), (u64::MAX, 1), (u64::MAX - 1, 2)] {
        assert!(reader.copy_to_vec(offset, len, &mut out).is_err(), "{len} at {offset}");
        assert!(reader.copy_to(offset, &mut vec![0; len]).is_err(), "{len} at {offset}");
    }
    for (offset, stride, row, rows) in
        [(0, 4096, 4096, 3), (SLOT - 5, 10, 5, 2), (0, 1, 2, 1), (0, u32::MAX, 1, u32::MAX)]
    {
        assert!(reader.copy_rows_to_vec(offset, stride, row, rows, &mut out).is_err());
    }
}

#[test]
fn slots_of_a_pool_are_apart_and_outlive_it() {
    let (pool, mut slots) = WritablePool::allocate("test", 2, SLOT).unwrap();
    drop(pool);
    let mut second = slots.pop().unwrap();
    let writer = std::thread::spawn(move || {
        second.fill(2);
        second
    });
    slots[0].fill(1);
    let second = writer.join().unwrap();
    assert!(slots[0].iter().all(|&byte| byte == 1) && second.iter().all(|&byte| byte == 2));
}

#[test]
fn no_pool_installs_a_signal_handler() {
    // The runtime has handlers of its own from the start; what counts is that none is added.
    let caught = || {
        let status = std::fs::read_to_string("/proc/self/status").unwrap();
        status.lines().find(|line| line.starts_with("SigCgt:")).map(str::to_owned).unwrap()
    };
    let before = caught();
    let (pool, _slots) = WritablePool::allocate("test", 1, SLOT).unwrap();
    let fd = pool.fd().try_clone_to_owned().unwrap();
    let reader = ReadOnlyPool::accept(fd, SLOT, SLOT).unwrap();
    reader.copy_to(0, &mut [0; 16]).unwrap();
    assert_eq!(caught(), before);
}
