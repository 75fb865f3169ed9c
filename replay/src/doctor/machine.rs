//! Looks at what a daemon would find on this machine: what it needs, and what makes it better.
//!
//! [`Facts`] asks the machine; what they mean is said by [`examine_machine`] alone.

use std::fs;
use std::path::{Path, PathBuf};
use std::thread::available_parallelism;

use foreframe_engine::Simd;
use foreframe_engine::backend::choice::{BackendChoice, Chosen};
use foreframe_protocol::memory::{WritablePool, verify};
use foreframe_protocol::socket::{check_socket_path, default_socket_path};
use foreframed::control::{ControlError, Controller, Request, Response};
use foreframed::gpu::Gpus;
use foreframed::stream::real_time;
use serde::Serialize;

/// Bytes of the pool that is tried.
const POOL_BYTES: u64 = 1 << 16;
/// Where Linux says who gets huge pages.
const HUGE_PAGES: &str = "/sys/kernel/mm/transparent_hugepage/enabled";
/// Fewer processors than this leave the application nothing beside the engine.
const ENOUGH_PROCESSORS: usize = 2;

/// How well the machine does in one respect.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum State {
    /// As it should be.
    Ok,
    /// It works, and could work better.
    Hint,
    /// A daemon cannot run like this.
    Wrong,
}

/// One respect. Names are part of the interface.
#[derive(Clone, PartialEq, Eq, Debug, Serialize)]
pub struct Finding {
    /// What was looked at.
    pub name: &'static str,
    /// How it is.
    pub state: State,
    /// What was found.
    pub found: String,
    /// What to do, where it is not [`State::Ok`].
    pub advice: Option<&'static str>,
}

/// What was found on this machine.
#[derive(Clone, PartialEq, Eq, Debug, Serialize)]
pub struct MachineReport {
    /// In the order in which a daemon meets them.
    pub machine: Vec<Finding>,
}

/// What the machine says of itself. Errors are texts.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Facts {
    /// Processors that this process may use.
    pub processors: usize,
    /// The widest registers of kernels.
    pub registers: &'static str,
    /// Where a daemon would listen, if it can.
    pub socket: Result<PathBuf, String>,
    /// What one that runs there says of itself; None where none runs, or could.
    pub daemon: Result<Option<String>, String>,
    /// Whether a pool could be made and sealed.
    pub shared_memory: Result<(), String>,
    /// Whether real-time priority is granted.
    pub real_time: Result<(), String>,
    /// The text of [`HUGE_PAGES`], if there is one.
    pub huge_pages: Option<String>,
    /// WAYLAND_DISPLAY and DISPLAY, where they say something.
    pub displays: [Option<String>; 2],
    /// How many GPU adapters there are, and why one of them is chosen for an application that does
    /// not say what it renders on; or why none is.
    pub gpus: Result<(usize, String), String>,
}

impl Facts {
    /// Of this machine, whose daemon listens at `socket` or where daemons do by default. Asks
    /// drivers, and a daemon if one runs.
    #[must_use]
    pub fn gather(socket: Option<&Path>) -> Self {
        let said = |name: &str| std::env::var(name).ok().filter(|text| !text.is_empty());
        let socket = socket.map_or_else(default_socket_path, |path| Ok(path.to_owned()));
        let socket = socket.and_then(|path| check_socket_path(&path).map(|()| path));
        let socket = socket.map_err(|error| error.to_string());
        Self {
            processors: available_parallelism().map_or(1, usize::from),
            registers: Simd::widest_registers(),
            daemon: socket.clone().map_or(Ok(None), ask_daemon),
            socket,
            shared_memory: try_pool().map_err(|error| error.to_string()),
            real_time: real_time::probe().map_err(|error| error.to_string()),
            huge_pages: fs::read_to_string(HUGE_PAGES).ok(),
            displays: ["WAYLAND_DISPLAY", "DISPLAY"].map(said),
            gpus: choose_gpu(),
        }
    }
}

/// As [`Facts::gpus`].
fn choose_gpu() -> Result<(usize, String), String> {
    let gpus = Gpus::find(BackendChoice::Auto).map_err(|error| error.to_string())?;
    let Chosen { adapter, why } = gpus.choose_for(None);
    match adapter {
        Some(_) => Ok((gpus.facts().len(), why)),
        None => Err(why),
    }
}

/// What the daemon whose applications connect to `socket` says of itself, if one runs.
fn ask_daemon(socket: PathBuf) -> Result<Option<String>, String> {
    let answer = match Controller::connect(&socket) {
        Err(ControlError::NoDaemon { .. }) => return Ok(None),
        connected => connected.and_then(|mut daemon| daemon.ask(&Request::Status)),
    };
    match answer.map_err(|error| error.to_string())? {
        Response::Status(status) => {
            Ok(Some(format!("version {}, {} streams", status.version, status.streams.len())))
        }
        other => Err(format!("expected its status, found {other:?}")),
    }
}

/// Makes what a client would send, and looks at it as the daemon would.
fn try_pool() -> foreframe_protocol::Result<()> {
    let (pool, _slots) = WritablePool::allocate("foreframe-doctor", 1, POOL_BYTES)?;
    verify(pool.fd(), pool.pool_bytes())
}

/// Says what is wrong with a machine, and what could be better.
#[must_use]
pub fn examine_machine(facts: &Facts) -> MachineReport {
    let ok = |name, found: String| Finding { name, state: State::Ok, found, advice: None };
    let other =
        |name, state, found: String, advice| Finding { name, state, found, advice: Some(advice) };
    let processors = format!("{}, kernels use {}", facts.processors, facts.registers);
    let processors = match facts.processors {
        ENOUGH_PROCESSORS.. => ok("processors", processors),
        _ => other(
            "processors",
            State::Hint,
            processors,
            "the engine shares it with the application: give them two or more",
        ),
    };
    let socket = match &facts.socket {
        Ok(path) => ok("socket", path.display().to_string()),
        Err(error) => other(
            "socket",
            State::Wrong,
            error.clone(),
            "no daemon can listen there; a login sets a place: export \
             XDG_RUNTIME_DIR=/run/user/$(id -u)",
        ),
    };
    let daemon = match &facts.daemon {
        Ok(Some(said)) => ok("daemon", said.clone()),
        Ok(None) => {
            other("daemon", State::Hint, "none runs".to_owned(), "start one: `foreframe serve`")
        }
        Err(error) => other(
            "daemon",
            State::Wrong,
            error.clone(),
            "it is another user's, stuck or of another version: end it, and start this one",
        ),
    };
    let shared_memory = match &facts.shared_memory {
        Ok(()) => ok("shared memory", "can be made and sealed".to_owned()),
        Err(error) => other(
            "shared memory",
            State::Wrong,
            error.clone(),
            "no frame can be handed over: Linux 5.1 or newer has memfd with all four seals",
        ),
    };
    let real_time = match &facts.real_time {
        Ok(()) => ok("real-time priority", "granted".to_owned()),
        Err(error) => other(
            "real-time priority",
            State::Hint,
            error.clone(),
            "wakes are late on a busy machine: set rtprio to 10 in /etc/security/limits.conf",
        ),
    };
    let (huge_pages, are_huge) = match &facts.huge_pages {
        Some(text) => (text.trim().to_owned(), !text.contains("[never]")),
        None => ("the kernel has none".to_owned(), false),
    };
    let huge_pages = match are_huge {
        true => ok("huge pages", huge_pages),
        false => other(
            "huge pages",
            State::Hint,
            huge_pages,
            "the first keys of a stream take longer: write madvise to \
             /sys/kernel/mm/transparent_hugepage/enabled",
        ),
    };
    let display = match &facts.displays {
        [Some(wayland), _] => ok("display", format!("Wayland, {wayland}")),
        [None, Some(x11)] => ok("display", format!("X11, {x11}")),
        [None, None] => other(
            "display",
            State::Hint,
            "neither WAYLAND_DISPLAY nor DISPLAY is set".to_owned(),
            "all but --sink window works without",
        ),
    };
    let gpus = match &facts.gpus {
        Ok((count, why)) => ok("GPU adapters", format!("{count}; chosen: {why}")),
        Err(error) => other("GPU adapters", State::Hint, error.clone(), "the CPU makes the frames"),
    };
    // Nobody can be asked where nobody can listen.
    let daemon = facts.socket.is_ok().then_some(daemon);
    let rest = [shared_memory, real_time, huge_pages, display, gpus];
    MachineReport { machine: [processors, socket].into_iter().chain(daemon).chain(rest).collect() }
}

impl MachineReport {
    /// How many things keep a daemon from running.
    #[must_use]
    pub fn wrong(&self) -> usize {
        self.machine.iter().filter(|finding| finding.state == State::Wrong).count()
    }

    /// A line for each, and one more for what to do.
    #[must_use]
    pub fn to_text(&self) -> String {
        let mut text = String::new();
        for Finding { name, state, found, advice } in &self.machine {
            let state = match state {
                State::Ok => "ok",
                State::Hint => "hint",
                State::Wrong => "WRONG",
            };
            text += &format!("{state:<6} {name:<19} {found}\n");
            if let Some(advice) = advice {
                text += &format!("{:26} {advice}\n", "");
            }
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn good() -> Facts {
        Facts {
            processors: 2,
            registers: "AVX2",
            socket: Ok(PathBuf::from("/run/user/7/foreframe/daemon.sock")),
            daemon: Ok(Some("version 1, 0 streams".to_owned())),
            shared_memory: Ok(()),
            real_time: Ok(()),
            huge_pages: Some("always [madvise] never\n".to_owned()),
            displays: [Some("wayland-0".to_owned()), None],
            gpus: Ok((1, "the only one".to_owned())),
        }
    }

    /// Names of what is not as it should be.
    fn found(facts: &Facts) -> Vec<(&'static str, State)> {
        let report = examine_machine(facts);
        let odd = report.machine.iter().filter(|finding| finding.state != State::Ok);
        odd.map(|finding| (finding.name, finding.state)).collect()
    }

    #[test]
    fn a_good_machine_has_nothing_to_be_told() {
        assert_eq!(found(&good()), []);
    }

    #[test]
    fn each_thing_that_is_missing_is_told_with_what_to_do() {
        let no = || "no".to_owned();
        let cases = [
            (Facts { processors: 1, ..good() }, "processors", State::Hint),
            (Facts { socket: Err(no()), ..good() }, "socket", State::Wrong),
            (Facts { daemon: Ok(None), ..good() }, "daemon", State::Hint),
            (Facts { daemon: Err(no()), ..good() }, "daemon", State::Wrong),
            (Facts { shared_memory: Err(no()), ..good() }, "shared memory", State::Wrong),
            (Facts { real_time: Err(no()), ..good() }, "real-time priority", State::Hint),
            (Facts { huge_pages: None, ..good() }, "huge pages", State::Hint),
            (
                Facts { huge_pages: Some("always madvise [never]".into()), ..good() },
                "huge pages",
                State::Hint,
            ),
            (Facts { displays: [None, None], ..good() }, "display", State::Hint),
            (Facts { gpus: Err(no()), ..good() }, "GPU adapters", State::Hint),
        ];
        for (facts, name, state) in cases {
            assert_eq!(found(&facts), [(name, state)]);
            let report = examine_machine(&facts);
            assert_eq!(report.wrong(), usize::from(state == State::Wrong));
            assert!(report.machine.iter().all(|it| it.advice.is_some() == (it.state != State::Ok)));
        }
        let x11 = Facts { displays: [None, Some(":0".to_owned())], ..good() };
        assert!(examine_machine(&x11).to_text().contains("X11, :0"));
    }

    #[test]
    fn sealed_memory_can_be_had_wherever_these_tests_run() {
        try_pool().unwrap();
    }
}
