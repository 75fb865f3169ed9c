//! `foreframe adapters`: the GPU adapters of this machine, and which one would be chosen.

use std::fmt::Write as _;

use foreframe_engine::backend::choice::{AdapterFacts, AdapterKind, BackendChoice, Chosen, choose};
use foreframe_engine::backend::gpu::adapters;
use foreframed::gpu::memory_bytes;
use serde::Serialize;

use crate::output::Output;

/// Arguments of `foreframe adapters`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// What to choose: auto, cpu, gpu or gpu:NAME
    #[arg(long, default_value_t = BackendChoice::Auto)]
    pub backend: BackendChoice,
}

/// Everything that is printed.
#[derive(Clone, Debug, Serialize)]
struct Listing {
    adapters: Vec<Listed>,
    /// For an application that does not say what it renders on.
    chosen: String,
    why: String,
    /// For an application on each of the adapters.
    for_application_on: Vec<ForApplication>,
}

/// One adapter.
#[derive(Clone, Debug, Serialize)]
struct Listed {
    name: String,
    backend: &'static str,
    r#type: &'static str,
    driver: String,
    pci_bus_id: String,
    /// None where the kernel does not say.
    memory_bytes: Option<u64>,
    /// Bytes of the largest plane of a picture.
    largest_plane_bytes: u64,
    usable: bool,
    why: String,
}

#[derive(Clone, Debug, Serialize)]
struct ForApplication {
    application: String,
    chosen: String,
    why: String,
}

/// Lists the adapters.
///
/// # Errors
/// If `--backend` asks for what there is not.
pub fn run(args: &Args, output: &Output) -> anyhow::Result<()> {
    let facts: Vec<_> = adapters().into_iter().map(|adapter| adapter.facts).collect();
    let listing = Listing::new(&args.backend, &facts)?;
    output.result(&listing, &listing.to_text())
}

impl Listing {
    fn new(choice: &BackendChoice, facts: &[AdapterFacts]) -> anyhow::Result<Self> {
        let name = |chosen: &Chosen| {
            chosen.adapter.map_or_else(|| "cpu".to_owned(), |index| facts[index].name.clone())
        };
        let chosen = choose(choice, facts, None)?;
        let for_application_on = (0..facts.len()).map(|index| {
            let chosen = choose(choice, facts, Some(index))?;
            let application = facts[index].name.clone();
            anyhow::Ok(ForApplication { application, chosen: name(&chosen), why: chosen.why })
        });
        Ok(Self {
            for_application_on: for_application_on.collect::<Result<_, _>>()?,
            chosen: name(&chosen),
            why: chosen.why,
            adapters: facts.iter().map(Listed::new).collect(),
        })
    }

    fn to_text(&self) -> String {
        let mut text = String::new();
        for adapter in &self.adapters {
            let Listed { name, r#type, driver, pci_bus_id, memory_bytes, why, .. } = adapter;
            let place = if pci_bus_id.is_empty() { "not on a known bus" } else { pci_bus_id };
            let memory = memory_bytes.map_or_else(
                || "memory not known".to_owned(),
                |bytes| format!("{} MiB of memory", bytes >> 20),
            );
            let _infallible = writeln!(
                text,
                "{name}\n  {type}, {place}, {memory}, planes of up to {} MiB\n  {driver}\n  {why}",
                adapter.largest_plane_bytes >> 20,
            );
        }
        let Self { chosen, why, .. } = self;
        let _infallible = writeln!(text, "chosen: {chosen} ({why})");
        for ForApplication { application, chosen, why } in &self.for_application_on {
            let _infallible =
                writeln!(text, "  for an application on {application}: {chosen} ({why})");
        }
        text
    }
}

impl Listed {
    fn new(facts: &AdapterFacts) -> Self {
        let why = match (&facts.unusable, facts.kind) {
            (Some(why), _) => format!("unusable: {why}"),
            (None, AdapterKind::Cpu) => {
                "usable, but a software driver: only gpu:NAME chooses it".to_owned()
            }
            (None, _) => "usable".to_owned(),
        };
        Self {
            name: facts.name.clone(),
            backend: "vulkan",
            r#type: facts.kind.name(),
            driver: format!("{} {}", facts.driver, facts.driver_info).trim().to_owned(),
            pci_bus_id: facts.pci_bus_id.clone(),
            memory_bytes: memory_bytes(facts),
            largest_plane_bytes: facts.binding_limit,
            usable: facts.unusable.is_none(),
            why,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn facts(name: &str, kind: AdapterKind) -> AdapterFacts {
        AdapterFacts {
            name: name.to_owned(),
            kind,
            driver: "driver".to_owned(),
            driver_info: "1".to_owned(),
            pci_bus_id: String::new(),
            binding_limit: 128 << 20,
            unusable: None,
        }
    }

    #[test]
    fn each_adapter_is_told_what_an_application_on_it_gets() {
        let facts = [facts("card", AdapterKind::Discrete), facts("soft", AdapterKind::Cpu)];
        let listing = Listing::new(&BackendChoice::Auto, &facts).unwrap();
        assert_eq!(listing.chosen, "card");
        let chosen: Vec<_> =
            listing.for_application_on.iter().map(|on| on.chosen.as_str()).collect();
        assert_eq!(chosen, ["card", "card"]);
        let text = listing.to_text();
        assert!(text.contains("only gpu:NAME chooses it"), "{text}");
        assert!(text.contains("for an application on soft: card"), "{text}");
    }

    #[test]
    fn a_machine_without_adapters_has_the_cpu() {
        let listing = Listing::new(&BackendChoice::Auto, &[]).unwrap();
        assert_eq!(listing.to_text(), "chosen: cpu (no usable GPU adapter)\n");
        assert!(Listing::new(&BackendChoice::Gpu, &[]).is_err());
    }
}
