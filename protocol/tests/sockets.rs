//! Places of sockets, and what a hostile peer can send through one.

use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::os::unix::fs::{PermissionsExt, symlink};
use std::path::Path;

use foreframe_protocol::memory::create_memfd;
use foreframe_protocol::socket::{
    Channel, Listener, Received, Sent, check_socket_path, socket_path_in,
};
use foreframe_protocol::{DestroyStream, Error, Packet, RegisterPool};
use rustix::io::{FdFlags, fcntl_getfd};

fn packet_with_fd() -> Packet {
    Packet::new(&RegisterPool { stream: 1, pool: 1, slots: 1, slot_bytes: 4096 })
}

fn packet_without_fd() -> Packet {
    Packet::new(&DestroyStream { stream: 1 })
}

fn memfd() -> OwnedFd {
    create_memfd("test").expect("a memfd")
}

fn mode(path: &Path, mode: u32) {
    std::fs::set_permissions(path, std::fs::Permissions::from_mode(mode)).expect("our own folder");
}

#[test]
fn descriptors_that_should_not_be_there_are_closed() {
    let fd = memfd();
    let (sender, receiver) = Channel::pair().unwrap();
    let send = |packet: &Packet, fds: &[BorrowedFd<'_>]| {
        assert_eq!(sender.send_bytes(packet.as_bytes(), fds).unwrap(), Sent::Whole);
    };
    let before = own_memfds();
    for count in [1, 2, 4, 5, 100, 253] {
        send(&packet_without_fd(), &vec![fd.as_fd(); count]);
        assert!(matches!(receiver.receive(), Err(Error::Packet { .. })), "{count} where 0 belong");
    }
    for count in [0, 2, 4, 5, 100, 253] {
        send(&packet_with_fd(), &vec![fd.as_fd(); count]);
        assert!(matches!(receiver.receive(), Err(Error::Packet { .. })), "{count} where 1 belongs");
    }
    // With what is no message at all, none belongs either.
    assert_eq!(sender.send_bytes(b"garbage", &[fd.as_fd()]).unwrap(), Sent::Whole);
    assert!(matches!(receiver.receive(), Err(Error::Packet { .. })));
    // A message that carries one and then turns out to be wrong.
    send(&packet_with_fd(), &[fd.as_fd()]);
    let Received::Packet(incoming) = receiver.receive().unwrap() else { panic!("a packet") };
    assert!(incoming.parse_daemon().is_err());
    // Nobody takes what one that was right carried.
    send(&packet_with_fd(), &[fd.as_fd()]);
    drop(receiver.receive().unwrap());
    assert_eq!(own_memfds(), before);

    send(&packet_with_fd(), &[fd.as_fd()]);
    let Received::Packet(incoming) = receiver.receive().unwrap() else { panic!("a packet") };
    let (_, received) = incoming.parse_client().unwrap();
    let received = received.expect("the descriptor");
    assert!(fcntl_getfd(&received).unwrap().contains(FdFlags::CLOEXEC));
    assert_eq!(own_memfds(), before + 1, "the count would see one that leaks");
}

/// Descriptors of memfds called `test` in this process. Only the test above makes any.
fn own_memfds() -> usize {
    std::fs::read_dir("/proc/self/fd")
        .expect("procfs")
        .filter_map(|entry| std::fs::read_link(entry.ok()?.path()).ok())
        .filter(|target| target.to_string_lossy().contains("memfd:test"))
        .count()
}

#[test]
fn packets_that_are_too_long_or_empty_are_refused() {
    let (sender, receiver) = Channel::pair().unwrap();
    assert_eq!(sender.send_bytes(&[0; 1025], &[]).unwrap(), Sent::Whole);
    let error = receiver.receive().expect_err("longer than a packet").to_string();
    assert!(error.contains("at most 1024 bytes"), "{error}");
    // The next one is not affected.
    assert_eq!(sender.send(&packet_without_fd(), None).unwrap(), Sent::Whole);
    assert!(matches!(receiver.receive().unwrap(), Received::Packet(_)));
    assert_eq!(sender.send_bytes(&[], &[]).unwrap(), Sent::Whole);
    assert!(matches!(receiver.receive().unwrap(), Received::Closed));
}

#[test]
fn what_was_sent_before_the_end_is_read_before_the_end() {
    let (sender, receiver) = Channel::pair().unwrap();
    assert!(matches!(receiver.receive().unwrap(), Received::WouldBlock));
    assert_eq!(sender.send(&packet_without_fd(), None).unwrap(), Sent::Whole);
    drop(sender);
    assert!(matches!(receiver.receive().unwrap(), Received::Packet(_)));
    assert!(matches!(receiver.receive().unwrap(), Received::Closed));
    assert!(matches!(receiver.send(&packet_without_fd(), None), Err(Error::Disconnected)));
}

#[test]
fn a_peer_that_does_not_read_makes_nobody_wait() {
    let (sender, receiver) = Channel::pair().unwrap();
    let mut sent = 0;
    while sender.send(&packet_without_fd(), None).unwrap() == Sent::Whole {
        sent += 1;
    }
    for _ in 0..sent {
        assert!(matches!(receiver.receive().unwrap(), Received::Packet(_)), "none was lost");
    }
    assert!(matches!(receiver.receive().unwrap(), Received::WouldBlock));
}

#[test]
fn a_client_finds_the_daemon_and_both_know_who_it_is() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("foreframe/daemon.sock");
    let listener = Listener::bind(&path).unwrap();
    let made = std::fs::metadata(path.parent().unwrap()).unwrap();
    assert_eq!(made.permissions().mode() & 0o777, 0o700);
    assert!(listener.accept().unwrap().is_none());
    let client = Channel::connect(&path).unwrap();
    let accepted = listener.accept().unwrap().expect("a client waits");
    let own = i32::try_from(std::process::id()).unwrap();
    assert_eq!(accepted.peer().unwrap().pid, own);
    accepted.check_same_user().unwrap();
    assert_eq!(client.send(&packet_without_fd(), None).unwrap(), Sent::Whole);
    assert!(matches!(accepted.receive().unwrap(), Received::Packet(_)));
    drop(listener);
    assert!(!path.exists(), "a daemon that stops removes its socket");
    assert!(matches!(Channel::connect(&path), Err(Error::NoDaemon { .. })));
}

#[test]
fn a_second_daemon_is_told_so_and_the_first_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("foreframe/daemon.sock");
    let first = Listener::bind(&path).unwrap();
    let error = Listener::bind(&path).expect_err("one at a time").to_string();
    assert!(error.contains("another daemon listens here"), "{error}");
    Channel::connect(&path).expect("the first one still listens");
    drop(first);
    Listener::bind(&path).expect("the place is free");
}

#[test]
fn what_a_killed_daemon_left_is_replaced() {
    let folder = tempfile::tempdir().unwrap();
    mode(folder.path(), 0o700);
    let path = folder.path().join("daemon.sock");
    drop(std::os::unix::net::UnixListener::bind(&path).unwrap());
    assert!(path.exists(), "a socket that nobody listens to");
    let _listener = Listener::bind(&path).unwrap();
    Channel::connect(&path).unwrap();
}

#[test]
fn folders_that_others_can_enter_and_links_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let expect = |path: &Path, words: &str| {
        let error = Listener::bind(&path.join("daemon.sock")).expect_err(words).to_string();
        assert!(error.contains(words), "{error}");
    };
    for open in [0o755, 0o710, 0o701, 0o770] {
        mode(folder.path(), open);
        expect(folder.path(), "chmod 700");
    }
    mode(folder.path(), 0o700);
    let real = folder.path().join("real");
    std::fs::create_dir(&real).unwrap();
    mode(&real, 0o700);
    let link = folder.path().join("link");
    symlink(&real, &link).unwrap();
    expect(&link, "not a link");
    expect(&folder.path().join("missing/deeper"), "a folder that can be made");
    let file = folder.path().join("file");
    std::fs::write(&file, "").unwrap();
    expect(&file, "a folder");
    Listener::bind(&real.join("daemon.sock")).expect("the real folder is good");
}

#[test]
fn a_file_in_the_place_of_the_socket_is_kept() {
    let folder = tempfile::tempdir().unwrap();
    mode(folder.path(), 0o700);
    let path = folder.path().join("daemon.sock");
    std::fs::write(&path, "precious").unwrap();
    assert!(Listener::bind(&path).is_err());
    assert_eq!(std::fs::read(&path).unwrap(), b"precious");
    let lock = folder.path().join("other.sock.lock");
    symlink(&path, &lock).unwrap();
    assert!(Listener::bind(&folder.path().join("other.sock")).is_err(), "a lock that is a link");
}

#[test]
fn a_path_that_is_too_long_says_so() {
    let folder = tempfile::tempdir().unwrap();
    mode(folder.path(), 0o700);
    let path = folder.path().join("x".repeat(108));
    assert!(Listener::bind(&path).unwrap_err().to_string().contains("at most 107 bytes"));
    assert!(Channel::connect(&path).unwrap_err().to_string().contains("at most 107 bytes"));
}

#[test]
fn the_usual_place_needs_an_absolute_runtime_folder() {
    let path = socket_path_in(Some("/run/user/1000".into())).unwrap();
    assert_eq!(path, Path::new("/run/user/1000/foreframe/daemon.sock"));
    for folder in [None, Some("".into()), Some("run".into())] {
        let error = socket_path_in(folder).unwrap_err().to_string();
        assert!(error.contains("--socket"), "{error}");
    }
}

#[test]
fn what_a_daemon_would_be_refused_is_known_without_making_anything() {
    let folder = tempfile::tempdir().unwrap();
    mode(folder.path(), 0o700);
    let at = |name: &str| folder.path().join(name);
    std::fs::write(at("file"), "kept").unwrap();
    std::fs::create_dir(at("open")).unwrap();
    mode(&at("open"), 0o755);
    let long = "x".repeat(120);
    for name in ["new/s", "s", "none/below/s", "file", "file/s", "open/s", &long] {
        let before = std::fs::read_dir(&folder).unwrap().count();
        let told = check_socket_path(&at(name)).map_err(|error| error.to_string());
        assert_eq!(std::fs::read_dir(&folder).unwrap().count(), before, "{name}");
        let bound = Listener::bind(&at(name)).map(drop).map_err(|error| error.to_string());
        assert_eq!(told, bound, "{name}");
    }
    drop(Listener::bind(&at("s")).unwrap());
    check_socket_path(&at("s")).unwrap();
}
