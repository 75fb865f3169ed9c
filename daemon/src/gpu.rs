//! The GPU adapters of the machine, the choice among them, and their devices.
//!
//! The rule is the engine's ([`foreframe_engine::backend::choice`]); this module knows the machine
//! and the application. Devices are opened when the first stream needs one, on that stream's
//! thread, and shared by all that follow.

use std::collections::BTreeMap;
use std::fs;
use std::sync::{Arc, Mutex, PoisonError};

use foreframe_engine::backend::choice::{
    AdapterFacts, AdapterKind, BackendChoice, ChoiceError, Chosen, choose,
};
use foreframe_engine::backend::gpu::{Gpu, GpuAdapter, GpuError, adapters};
use foreframe_protocol::{GpuKind, PciAddress};

/// The adapters, and what was asked for.
#[derive(Debug)]
pub struct Gpus {
    choice: BackendChoice,
    adapters: Vec<GpuAdapter>,
    facts: Vec<AdapterFacts>,
    open: Mutex<BTreeMap<usize, Arc<Gpu>>>,
}

impl Gpus {
    /// Looks for adapters, unless `choice` is the CPU.
    ///
    /// # Errors
    /// If `choice` asks for what there is not.
    pub fn find(choice: BackendChoice) -> Result<Self, ChoiceError> {
        let adapters = if choice == BackendChoice::Cpu { Vec::new() } else { adapters() };
        let facts: Vec<_> = adapters.iter().map(|adapter| adapter.facts.clone()).collect();
        choose(&choice, &facts, None)?;
        Ok(Self { choice, adapters, facts, open: Mutex::default() })
    }

    /// What is known of each adapter.
    #[must_use]
    pub fn facts(&self) -> &[AdapterFacts] {
        &self.facts
    }

    /// The choice for an application that renders on the adapter at `application`, if it says so.
    #[must_use]
    pub fn choose_for(&self, application: Option<PciAddress>) -> Chosen {
        let application = application.and_then(|address| self.at(address));
        choose(&self.choice, &self.facts, application)
            .unwrap_or_else(|error| Chosen { adapter: None, why: error.to_string() })
    }

    fn at(&self, address: PciAddress) -> Option<usize> {
        self.facts.iter().position(|facts| pci_address(facts) == Some(address))
    }

    /// The device of the adapter of this index, opened now if it is not, or lost.
    ///
    /// # Errors
    /// If its driver opens no device.
    pub fn open(&self, index: usize) -> Result<Arc<Gpu>, GpuError> {
        let mut open = self.open.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(gpu) = open.get(&index).filter(|gpu| !gpu.is_lost()) {
            return Ok(Arc::clone(gpu));
        }
        let gpu = Gpu::open(&self.adapters[index])?;
        open.insert(index, Arc::clone(&gpu));
        Ok(gpu)
    }
}

/// Opens what `choice` asks for, for work without an application; None is the CPU.
///
/// # Errors
/// If `choice` asks for what there is not, or what does not open.
pub fn open(choice: &BackendChoice) -> anyhow::Result<Option<Arc<Gpu>>> {
    let gpus = Gpus::find(choice.clone())?;
    let chosen = gpus.choose_for(None);
    Ok(chosen.adapter.map(|index| gpus.open(index)).transpose()?)
}

/// Where an adapter sits, if its driver says.
#[must_use]
pub fn pci_address(facts: &AdapterFacts) -> Option<PciAddress> {
    facts.pci_bus_id.parse().ok()
}

/// Bytes of an adapter's own memory, where the kernel says.
#[must_use]
pub fn memory_bytes(facts: &AdapterFacts) -> Option<u64> {
    let file = format!("/sys/bus/pci/devices/{}/mem_info_vram_total", pci_address(facts)?);
    fs::read_to_string(file).ok()?.trim().parse().ok()
}

/// What the protocol calls a kind of adapter.
#[must_use]
pub fn kind(kind: AdapterKind) -> GpuKind {
    match kind {
        AdapterKind::Discrete => GpuKind::Discrete,
        AdapterKind::Integrated => GpuKind::Integrated,
        AdapterKind::Virtual => GpuKind::Virtual,
        AdapterKind::Cpu => GpuKind::Software,
        AdapterKind::Other => GpuKind::Unknown,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_cpu_needs_no_driver_and_opens_nothing() {
        let gpus = Gpus::find(BackendChoice::Cpu).unwrap();
        assert_eq!(gpus.facts(), []);
        assert_eq!(gpus.choose_for(None).adapter, None);
        assert!(open(&BackendChoice::Cpu).unwrap().is_none());
    }

    #[test]
    fn an_adapter_that_nobody_has_is_refused_with_what_there_is() {
        let choice = BackendChoice::Named("no such adapter".to_owned());
        let error = open(&choice).unwrap_err().to_string();
        assert!(error.contains("`no such adapter`, found "), "{error}");
    }
}
