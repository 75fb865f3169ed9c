use super::*;

use AdapterKind::{Cpu, Discrete, Integrated, Virtual};

fn adapter(name: &str, kind: AdapterKind) -> AdapterFacts {
    AdapterFacts {
        name: name.to_owned(),
        kind,
        driver: "a driver".to_owned(),
        driver_info: "1.2.3".to_owned(),
        pci_bus_id: String::new(),
        binding_limit: 1 << 27,
        unusable: None,
    }
}

#[test]
fn the_rule_prefers_what_the_application_does_not_render_on() {
    // Kinds of the adapters, the application's, the one that is chosen.
    let cases: [(&[AdapterKind], Option<usize>, Option<usize>); 16] = [
        (&[], None, None),
        (&[Discrete], None, Some(0)),
        (&[Discrete], Some(0), Some(0)),
        (&[Integrated], Some(0), Some(0)),
        (&[Discrete, Integrated], Some(0), Some(1)),
        (&[Discrete, Integrated], Some(1), Some(0)),
        (&[Discrete, Integrated], None, Some(1)),
        (&[Discrete, Discrete], Some(0), Some(1)),
        (&[Discrete, Discrete], Some(1), Some(0)),
        (&[Discrete, Discrete, Integrated], Some(1), Some(2)),
        (&[Integrated, Discrete, Discrete], Some(0), Some(1)),
        (&[Cpu], None, None),
        (&[Cpu, Discrete], Some(1), Some(1)),
        (&[Cpu, Discrete], Some(0), Some(1)),
        (&[Cpu, Virtual], None, Some(1)),
        (&[Cpu, Cpu], Some(1), None),
    ];
    for (kinds, application, expected) in cases {
        let adapters: Vec<_> = kinds.iter().map(|kind| adapter(kind.name(), *kind)).collect();
        let chosen = choose(&BackendChoice::Auto, &adapters, application).unwrap();
        assert_eq!(chosen.adapter, expected, "{kinds:?}, application on {application:?}");
        assert!(!chosen.why.is_empty(), "{kinds:?} has no reason");
        let gpu = choose(&BackendChoice::Gpu, &adapters, application);
        assert_eq!(gpu.ok().and_then(|chosen| chosen.adapter), expected, "{kinds:?} by `gpu`");
        let cpu = choose(&BackendChoice::Cpu, &adapters, application).unwrap();
        assert_eq!(cpu.adapter, None, "{kinds:?} by `cpu`");
    }
}

#[test]
fn the_rule_passes_over_what_cannot_be_used() {
    let mut adapters = [adapter("a", Integrated), adapter("b", Discrete)];
    adapters[0].unusable = Some("no compute shaders".to_owned());
    assert_eq!(choose(&BackendChoice::Auto, &adapters, Some(1)).unwrap().adapter, Some(1));
    adapters[1].unusable = Some("no compute shaders".to_owned());
    assert_eq!(choose(&BackendChoice::Auto, &adapters, Some(1)).unwrap().adapter, None);
    let error = choose(&BackendChoice::Named("a".to_owned()), &adapters, None).unwrap_err();
    assert_eq!(error.to_string(), "a cannot be used: no compute shaders");
}

#[test]
fn a_name_is_part_of_what_the_driver_says_and_an_exact_one_wins() {
    let mut adapters =
        [adapter("Radeon Pro", Discrete), adapter("radeon", Integrated), adapter("soft", Cpu)];
    adapters[2].driver_info = "Mesa 22.3.6".to_owned();
    adapters[0].pci_bus_id = "0000:03:00.0".to_owned();
    for (name, expected) in [("RADEON", 1), ("pro", 0), ("mesa 22", 2), ("03:00.0", 0)] {
        let choice = format!("gpu:{name}").parse().unwrap();
        let chosen = choose(&choice, &adapters, None).unwrap();
        assert_eq!(chosen.adapter, Some(expected), "{name}");
    }
}

#[test]
fn an_unknown_name_lists_what_there_is() {
    let adapters = [adapter("one", Discrete), adapter("two", Cpu)];
    let choice = BackendChoice::Named("three".to_owned());
    let said = choose(&choice, &adapters, None).unwrap_err().to_string();
    assert_eq!(said, "expected a GPU adapter named `three`, found one, two");
    let said = choose(&choice, &[], None).unwrap_err().to_string();
    assert_eq!(said, "expected a GPU adapter named `three`, found none");
}

#[test]
fn what_is_typed_is_read_and_written_back() {
    for text in ["auto", "cpu", "gpu", "gpu:llvmpipe", "gpu:NVIDIA GeForce: one"] {
        assert_eq!(text.parse::<BackendChoice>().unwrap().to_string(), text);
    }
    for text in ["", "gpu:", "GPU", "vulkan", "cpu:0"] {
        assert!(text.parse::<BackendChoice>().is_err(), "{text}");
    }
}
