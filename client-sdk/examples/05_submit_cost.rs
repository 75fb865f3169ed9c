//! What `acquire`, `submit` and `dispatch` cost an application, beside writing its pixels.
//!
//! Prints the median and the 99th percentile for a 1920x1080 stream with depth and motion at half
//! resolution. The daemon is a thread of this process that only gives slots back:
//! `cargo run --release -p foreframe-client --example 05_submit_cost`.

mod clock;

use std::time::Duration;

use foreframe_client::{
    Camera, ConnectOptions, Depth, DepthFormat, DepthMeaning, Error, Handshake, Key, Motion,
    MotionFormat, StreamOptions,
};
use foreframe_protocol::memory::ReadOnlyPool;
use foreframe_protocol::socket::{Channel, Received};
use foreframe_protocol::{
    Body, ClientMessage, Clock, Features, GpuKind, Packet, PoolAccepted, ReleaseReason,
    SlotReleased, StreamCreated, Welcome,
};

const KEYS: u64 = 2000;
const IDENTITY: [f32; 16] = [1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1.];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (ours, theirs) = Channel::pair()?;
    let connecting = ConnectOptions::new("submit cost").start_over(ours)?;
    let daemon = std::thread::spawn(move || serve(&theirs));
    let mut handshake = connecting.dispatch()?;
    let mut client = loop {
        match handshake {
            Handshake::Done(client) => break client,
            Handshake::Pending(connecting) => handshake = connecting.dispatch()?,
        }
    };
    let options = StreamOptions::rgba8(1920, 1080)
        .depth(Depth::new(DepthFormat::F32, DepthMeaning::Reversed).ratio(2.0))
        .motion(Motion::new(MotionFormat::Rg16f).ratio(2.0));
    let stream = client.create_stream(&options)?;

    let camera = Camera { view: IDENTITY, projection: IDENTITY };
    let mut costs_ns = Vec::new();
    while (costs_ns.len() as u64) < KEYS {
        let index = costs_ns.len() as u64 + 1;
        let start = clock::monotonic_ns();
        client.dispatch()?;
        let acquired = clock::monotonic_ns();
        match client.acquire(stream) {
            Ok(frame) => {
                let key = Key::new(index, index * 1000).motion_from(index * 1000 - 1);
                client.submit(frame, key.camera(camera).motion_from_camera(camera))?;
                costs_ns.push(clock::monotonic_ns() - start);
            }
            Err(Error::WouldBlock) => clock::wait_until(&mut client, acquired + 100_000)?,
            Err(error) => return Err(error.into()),
        }
        while client.next_event().is_some() {}
        // About as long as a fast application takes between two frames.
        client.wait(Duration::from_micros(500))?;
    }
    drop(client);
    daemon.join().map_err(|_| "the daemon's thread panicked")??;

    costs_ns.sort_unstable();
    let at = |percent: usize| costs_ns[costs_ns.len() * percent / 100] as f64 / 1000.0;
    println!(
        "dispatch + acquire + submit, {KEYS} key frames of 1920x1080, depth and motion 960x540"
    );
    println!("median {:.1} us, 99th percentile {:.1} us", at(50), at(99));
    Ok(())
}

/// Welcomes one client and gives each slot back at once.
fn serve(channel: &Channel) -> Result<(), foreframe_protocol::Error> {
    fn send<T: Body>(channel: &Channel, body: &T) -> Result<(), foreframe_protocol::Error> {
        channel.send(&Packet::new(body), None).map(drop)
    }
    let mut pool = None;
    loop {
        let incoming = match channel.receive()? {
            Received::Packet(incoming) => incoming,
            Received::Closed => return Ok(()),
            Received::WouldBlock => {
                let mut fds = [rustix::event::PollFd::new(channel, rustix::event::PollFlags::IN)];
                // A signal ends the wait early, which does no harm.
                rustix::event::poll(&mut fds, None).unwrap_or_default();
                continue;
            }
        };
        let (message, fd) = incoming.parse_client()?;
        match message {
            ClientMessage::Hello(_) => send(channel, &welcome())?,
            ClientMessage::CreateStream(create) => {
                let created = StreamCreated { stream: create.stream, slots: create.slots };
                send(channel, &created)?;
            }
            ClientMessage::RegisterPool(register) => {
                let bytes = register.pool_bytes();
                pool = fd.map(|fd| ReadOnlyPool::accept(fd, bytes, bytes)).transpose()?;
                let accepted = PoolAccepted { stream: register.stream, pool: register.pool };
                send(channel, &accepted)?;
            }
            ClientMessage::Submit(submit) => {
                let mut pixel = [0; 4];
                if let Some(pool) = &pool {
                    pool.copy_to(0, &mut pixel)?;
                }
                let released = SlotReleased {
                    stream: submit.stream,
                    slot: submit.slot,
                    key_index: submit.key_index,
                    reason: ReleaseReason::Copied,
                };
                send(channel, &released)?;
            }
            _ => {}
        }
    }
}

fn welcome() -> Welcome {
    Welcome {
        major: 1,
        minor: 0,
        session: 1,
        features: Features::NONE,
        clock: Clock::Monotonic,
        clock_now_ns: clock::monotonic_ns(),
        max_streams: 1,
        max_slots: 8,
        max_width: 8192,
        max_height: 8192,
        max_pool_bytes: 1 << 30,
        refresh_interval_ns: 0,
        gpu_kind: GpuKind::Cpu,
        gpu_name: "none".to_owned(),
        gpu_pci: None,
    }
}
