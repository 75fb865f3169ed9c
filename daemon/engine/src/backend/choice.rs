//! Which backend makes the pictures of a stream.
//!
//! An application hands its frames over to free the GPU that it renders on, so `auto` prefers
//! another one:
//!
//! ```text
//! (1) a GPU adapter other than the application's, an integrated one first where the application is
//!     on a discrete one, else a discrete one first
//! (2) the application's own
//! (3) the CPU
//! ```
//!
//! Software adapters are slower than the CPU backend and serve as test bench: only their name
//! chooses them.

use std::fmt;
use std::str::FromStr;

/// What is known of a GPU adapter.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct AdapterFacts {
    /// As the driver names it.
    pub name: String,
    /// What it is.
    pub kind: AdapterKind,
    /// Name of the driver.
    pub driver: String,
    /// Its version, as the driver writes it.
    pub driver_info: String,
    /// `domain:bus:device.function` in hexadecimal; empty where it is not known.
    pub pci_bus_id: String,
    /// Bytes of the largest plane that it takes.
    pub binding_limit: u64,
    /// Why the kernels cannot run on it.
    pub unusable: Option<String>,
}

/// What a GPU adapter is.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum AdapterKind {
    /// A card with memory of its own.
    Discrete,
    /// Part of the processor.
    Integrated,
    /// A GPU lent to a virtual machine.
    Virtual,
    /// A driver that runs on the processor.
    Cpu,
    /// The driver does not say.
    Other,
}

impl AdapterKind {
    /// Name in tables and JSON.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Discrete => "discrete",
            Self::Integrated => "integrated",
            Self::Virtual => "virtual",
            Self::Cpu => "cpu",
            Self::Other => "other",
        }
    }
}

/// What a user asks for: `auto`, `cpu`, `gpu` or `gpu:NAME`.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub enum BackendChoice {
    /// By the rule of [`choose`].
    Auto,
    /// The CPU.
    #[default]
    Cpu,
    /// By the rule, but not the CPU.
    Gpu,
    /// The first GPU adapter whose name, driver or PCI bus id contains this, whatever its case.
    Named(String),
}

impl fmt::Display for BackendChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Auto => f.write_str("auto"),
            Self::Cpu => f.write_str("cpu"),
            Self::Gpu => f.write_str("gpu"),
            Self::Named(name) => write!(f, "gpu:{name}"),
        }
    }
}

impl FromStr for BackendChoice {
    type Err = UnknownBackend;

    fn from_str(text: &str) -> Result<Self, UnknownBackend> {
        match text.split_once(':') {
            None if text == "auto" => Ok(Self::Auto),
            None if text == "cpu" => Ok(Self::Cpu),
            None if text == "gpu" => Ok(Self::Gpu),
            Some(("gpu", name)) if !name.is_empty() => Ok(Self::Named(name.to_owned())),
            _ => Err(UnknownBackend { found: text.to_owned() }),
        }
    }
}

/// A backend that cannot be asked for.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
#[error("expected one of auto, cpu, gpu, gpu:NAME, found `{found}`")]
pub struct UnknownBackend {
    /// What was asked for.
    pub found: String,
}

/// What was chosen, and why.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Chosen {
    /// Index of the GPU adapter; None is the CPU.
    pub adapter: Option<usize>,
    /// The reason, for people.
    pub why: String,
}

/// A choice that cannot be met.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ChoiceError {
    /// No GPU adapter has this name.
    #[error("expected a GPU adapter named `{name}`, found {}", list(.found))]
    NoSuchAdapter {
        /// What was asked for.
        name: String,
        /// The names of those there are.
        found: Vec<String>,
    },
    /// The one that was asked for cannot be used.
    #[error("{name} cannot be used: {why}")]
    Unusable {
        /// Its name.
        name: String,
        /// What it lacks.
        why: String,
    },
    /// There is none that the rule takes.
    #[error("expected a GPU adapter, found {}; name a software adapter with gpu:NAME", list(.found))]
    NoGpu {
        /// The names of those there are.
        found: Vec<String>,
    },
}

fn list(names: &[String]) -> String {
    if names.is_empty() { "none".to_owned() } else { names.join(", ") }
}

/// Chooses among `adapters` for an application that renders on `application`, an index too, where
/// that is known.
///
/// # Errors
/// If `choice` asks for what there is not.
pub fn choose(
    choice: &BackendChoice,
    adapters: &[AdapterFacts],
    application: Option<usize>,
) -> Result<Chosen, ChoiceError> {
    let names = || adapters.iter().map(|adapter| adapter.name.clone()).collect();
    match choice {
        BackendChoice::Cpu => Ok(Chosen { adapter: None, why: "asked for by name".to_owned() }),
        BackendChoice::Named(name) => {
            let index = named(adapters, name)
                .ok_or_else(|| ChoiceError::NoSuchAdapter { name: name.clone(), found: names() })?;
            if let Some(why) = &adapters[index].unusable {
                let name = adapters[index].name.clone();
                return Err(ChoiceError::Unusable { name, why: why.clone() });
            }
            Ok(Chosen { adapter: Some(index), why: "asked for by name".to_owned() })
        }
        BackendChoice::Auto => Ok(by_rule(adapters, application)),
        BackendChoice::Gpu => Some(by_rule(adapters, application))
            .filter(|chosen| chosen.adapter.is_some())
            .ok_or_else(|| ChoiceError::NoGpu { found: names() }),
    }
}

/// The first adapter that has exactly this name, else the first that `text` is a part of.
fn named(adapters: &[AdapterFacts], text: &str) -> Option<usize> {
    let wanted = text.to_lowercase();
    let fits = |text: &String| text.to_lowercase().contains(&wanted);
    adapters.iter().position(|adapter| adapter.name.to_lowercase() == wanted).or_else(|| {
        adapters.iter().position(|adapter| {
            let AdapterFacts { name, driver, driver_info, pci_bus_id, .. } = adapter;
            [name, driver, driver_info, pci_bus_id].into_iter().any(fits)
        })
    })
}

/// (1) to (3).
fn by_rule(adapters: &[AdapterFacts], application: Option<usize>) -> Chosen {
    let is_offered = |index: &usize| {
        adapters[*index].unusable.is_none() && adapters[*index].kind != AdapterKind::Cpu
    };
    let on = application.and_then(|index| adapters.get(index)).map(|adapter| adapter.kind);
    // Without a word of the application it is taken to be on the fastest there is.
    let first = if matches!(on, Some(AdapterKind::Integrated)) {
        AdapterKind::Discrete
    } else {
        AdapterKind::Integrated
    };
    let others = (0..adapters.len()).filter(is_offered).filter(|index| Some(*index) != application);
    // The first of the smallest: the drivers' order decides among equals.
    if let Some(other) = others.min_by_key(|index| adapters[*index].kind != first) {
        let kind = adapters[other].kind.name();
        let why = match application {
            Some(_) => format!("{kind}, and not the one that the application renders on"),
            None => format!("{kind}; the application does not say what it renders on"),
        };
        return Chosen { adapter: Some(other), why };
    }
    if let Some(same) = application.filter(|index| *index < adapters.len()).filter(is_offered) {
        let why = "the only one: the application renders on it too".to_owned();
        return Chosen { adapter: Some(same), why };
    }
    let why = match adapters.iter().any(|adapter| adapter.kind == AdapterKind::Cpu) {
        true => "no GPU adapter but software ones, which only their name chooses",
        false => "no usable GPU adapter",
    };
    Chosen { adapter: None, why: why.to_owned() }
}

#[cfg(test)]
mod tests;
