//! What ARCHITECTURE.md promises about the structure, held by tests.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use cargo_metadata::{DependencyKind, MetadataCommand};

/// Which package may depend on which, and on nothing else of this workspace.
const ARROWS: [(&str, &[&str]); 8] = [
    ("foreframe-protocol", &[]),
    ("foreframe-client", &["foreframe-protocol"]),
    ("foreframe-perception", &[]),
    ("foreframe-engine", &["foreframe-perception"]),
    ("foreframed", &["foreframe-protocol", "foreframe-engine", "foreframe-perception"]),
    ("foreframe-fixtures", &["foreframe-protocol", "foreframe-client"]),
    (
        "foreframe",
        &[
            "foreframe-protocol",
            "foreframe-client",
            "foreframe-perception",
            "foreframe-engine",
            "foreframed",
            "foreframe-fixtures",
        ],
    ),
    (
        "foreframe-tests",
        &[
            "foreframe-protocol",
            "foreframe-client",
            "foreframe-perception",
            "foreframe-engine",
            "foreframed",
            "foreframe-fixtures",
            "foreframe",
        ],
    ),
];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("..")
        .canonicalize()
        .expect("the repository is there")
}

/// The arrows between workspace packages that cargo sees, development dependencies included.
fn found_arrows() -> BTreeMap<String, BTreeSet<String>> {
    let metadata = MetadataCommand::new()
        .manifest_path(root().join("Cargo.toml"))
        .no_deps()
        .other_options(vec!["--offline".to_owned()])
        .exec()
        .expect("cargo reads the workspace");
    let names: BTreeSet<String> =
        metadata.packages.iter().map(|package| package.name.to_string()).collect();
    metadata
        .packages
        .iter()
        .map(|package| {
            let kinds =
                [DependencyKind::Normal, DependencyKind::Build, DependencyKind::Development];
            let inside = package
                .dependencies
                .iter()
                .filter(|dependency| kinds.contains(&dependency.kind))
                .filter(|dependency| names.contains(&dependency.name))
                .map(|dependency| dependency.name.clone())
                .collect();
            (package.name.to_string(), inside)
        })
        .collect()
}

/// The arrows in `found` that `ARROWS` does not allow.
fn forbidden(found: &BTreeMap<String, BTreeSet<String>>) -> Vec<String> {
    let allowed: BTreeMap<&str, &[&str]> = ARROWS.into_iter().collect();
    found
        .iter()
        .flat_map(|(from, to)| to.iter().map(move |to| (from, to)))
        .filter(|(from, to)| {
            !allowed.get(from.as_str()).is_some_and(|allowed| allowed.contains(&to.as_str()))
        })
        .map(|(from, to)| format!("{from} -> {to}"))
        .collect()
}

#[test]
fn packages_depend_on_each_other_only_along_the_allowed_arrows() {
    let found = found_arrows();
    let known: BTreeSet<&str> = ARROWS.iter().map(|(from, _)| *from).collect();
    let packages: BTreeSet<&str> = found.keys().map(String::as_str).collect();
    assert_eq!(packages, known, "a new package needs a row in ARROWS and a reason in ARCHITECTURE");
    assert_eq!(forbidden(&found), Vec::<String>::new(), "arrows that ARCHITECTURE does not allow");
}

#[test]
fn an_arrow_from_the_engine_to_the_protocol_would_be_found() {
    let mut found = found_arrows();
    found.get_mut("foreframe-engine").unwrap().insert("foreframe-protocol".to_owned());
    assert_eq!(forbidden(&found), ["foreframe-engine -> foreframe-protocol"]);
}

/// Back-quoted words of a document that look like paths of the repository.
fn quoted_paths(document: &str) -> Vec<String> {
    let mut fenced = false;
    let mut paths = Vec::new();
    for line in document.lines() {
        if line.starts_with("```") {
            fenced = !fenced;
        }
        if fenced {
            continue;
        }
        for word in line.split('`').skip(1).step_by(2) {
            let is_path = word.contains('/')
                && !word.contains(|c: char| c.is_whitespace() || "*$<>{}|:=~".contains(c))
                && !word.starts_with(['/', '-', '.']);
            let has_known_root = ["protocol/", "client-sdk/", "daemon/", "replay/", "fixtures/"]
                .iter()
                .chain(&["tests/", "docs/"])
                .any(|root| word.starts_with(root));
            if is_path && has_known_root {
                paths.push(word.to_owned());
            }
        }
    }
    paths
}

#[test]
fn every_path_that_the_documents_name_exists() {
    let mut missing = Vec::new();
    for document in
        ["README.md", "ARCHITECTURE.md", "CONVENTIONS.md", "TESTING.md", "CONTRIBUTING.md"]
    {
        let text = fs::read_to_string(root().join(document)).unwrap();
        for path in quoted_paths(&text) {
            if !root().join(&path).exists() {
                missing.push(format!("{document}: {path}"));
            }
        }
    }
    assert_eq!(missing, Vec::<String>::new(), "paths that do not exist");
}

#[test]
fn a_path_that_does_not_exist_would_be_found() {
    let paths = quoted_paths("see `daemon/nowhere.rs` and `cargo test` and `--sink png:DIR`");
    assert_eq!(paths, ["daemon/nowhere.rs"]);
    assert!(!root().join(&paths[0]).exists());
}

#[test]
fn the_readme_tells_of_every_method() {
    let readme = include_str!("../../README.md");
    for method in foreframe_engine::Method::ALL {
        let row = format!("| `{method}` |");
        assert!(readme.contains(&row), "README.md: expected a row `{row}` in its table of methods");
    }
}
