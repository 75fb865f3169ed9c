//! `PROTOCOL.md` says what the structs are: its tables are parsed and compared with the offsets.

use std::collections::BTreeMap;

use foreframe_protocol::limits;
use foreframe_protocol::wire::{enum_layouts, struct_layouts};

const DOCUMENT: &str = include_str!("../../PROTOCOL.md");

/// Heading of each fourth-level section that is a table, with its rows of cells.
fn tables(document: &str) -> BTreeMap<&str, Vec<Vec<&str>>> {
    let mut tables = BTreeMap::new();
    for section in document.split("\n#### ").skip(1) {
        let (heading, rest) = section.split_once('\n').expect("a heading has a line of its own");
        let rows: Vec<Vec<&str>> = rest
            .lines()
            .skip_while(|line| line.is_empty())
            .take_while(|line| line.starts_with('|'))
            .skip(2)
            .map(|line| line.trim_matches('|').split('|').map(|cell| cell.trim()).collect())
            .collect();
        assert!(tables.insert(heading, rows).is_none(), "{heading} stands twice");
    }
    tables
}

/// A Rust type as the document spells it.
fn spelled(type_name: &str) -> String {
    match type_name {
        "PciAddressRaw" => "pci_address".to_owned(),
        "PlaneSizeRaw" => "plane_size".to_owned(),
        "PlaneRaw" => "plane".to_owned(),
        array if array.starts_with('[') => {
            let (element, count) =
                array.trim_matches(['[', ']']).split_once("; ").expect("an array has a length");
            format!("{}[{count}]", spelled(element))
        }
        number => number.to_lowercase(),
    }
}

#[test]
fn tables_of_structs_are_those_of_the_code() {
    let tables = tables(DOCUMENT);
    for layout in struct_layouts() {
        let heading = format!("`{}`, {} bytes", layout.name, layout.size);
        let rows = tables.get(heading.as_str()).unwrap_or_else(|| panic!("no table {heading}"));
        let documented: Vec<String> = rows.iter().map(|row| row[..4].join(" ")).collect();
        let coded: Vec<String> = layout
            .fields
            .iter()
            .map(|field| {
                let type_name = spelled(field.type_name);
                format!("{} {} {type_name} `{}`", field.offset, field.size, field.name)
            })
            .collect();
        assert_eq!(documented, coded, "{heading}");
        assert!(rows.iter().all(|row| row.len() == 5 && !row[4].is_empty()), "{heading}: meaning");
    }
}

#[test]
fn tables_of_codes_are_those_of_the_code() {
    let tables = tables(DOCUMENT);
    for layout in enum_layouts() {
        let heading = format!("`{}`", layout.name);
        let rows = tables.get(heading.as_str()).unwrap_or_else(|| panic!("no table {heading}"));
        let documented: Vec<String> = rows.iter().map(|row| row[..2].join(" ")).collect();
        let coded: Vec<String> =
            layout.values.iter().map(|(code, name)| format!("{code} `{name}`")).collect();
        assert_eq!(documented, coded, "{heading}");
    }
}

#[test]
fn every_table_is_checked_by_one_of_the_above() {
    let known = struct_layouts().len() + enum_layouts().len();
    assert_eq!(tables(DOCUMENT).len(), known);
}

#[test]
fn structs_have_no_gaps_and_every_number_is_aligned() {
    for layout in struct_layouts() {
        let mut end = 0;
        for field in layout.fields {
            assert_eq!(field.offset, end, "{}.{}", layout.name, field.name);
            end += field.size;
            let element = field.type_name.trim_start_matches('[').split(';').next().unwrap();
            let align = match element {
                "U16" => 2,
                "U32" | "I32" | "F32" => 4,
                "U64" | "I64" => 8,
                _ => 1,
            };
            assert_eq!(field.offset % align, 0, "{}.{}", layout.name, field.name);
        }
        assert_eq!(end, layout.size, "{}", layout.name);
    }
}

#[test]
fn limits_are_those_of_the_code() {
    let stated = [
        format!("| packet | {} bytes |", limits::MAX_PACKET_BYTES),
        format!("| file descriptors in a packet | {} |", limits::MAX_FDS),
        format!(
            "| slots of a stream or output pool | {} to {}, {} by default |",
            limits::MIN_SLOTS,
            limits::MAX_SLOTS,
            limits::DEFAULT_SLOTS
        ),
        format!("| width and height of a plane | 1 to {} |", limits::MAX_SIZE),
        format!("| stride | {} bytes |", limits::MAX_STRIDE),
        format!("| start of a plane | a multiple of {} bytes |", limits::OFFSET_ALIGN),
        format!("| slot | a multiple of {} bytes |", limits::SLOT_ALIGN),
        format!("| pool | 2^{} bytes |", limits::MAX_POOL_BYTES.ilog2()),
        format!("| jitter | +-{} pixel |", limits::MAX_JITTER_PX),
        format!("| time for the handshake | {} s |", limits::HANDSHAKE_TIMEOUT_NS / 1_000_000_000),
    ];
    for line in stated {
        assert!(DOCUMENT.contains(&line), "PROTOCOL.md has no line {line}");
    }
    assert!(limits::MAX_POOL_BYTES.is_power_of_two());
    assert_eq!(limits::MAX_TIME_NS, (1 << 63) - 1);
}
