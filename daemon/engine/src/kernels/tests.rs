//! What holds for every kernel, without a GPU.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::mem::offset_of;
use std::path::{Path, PathBuf};

use naga::front::wgsl;
use naga::valid::{Capabilities, ValidationFlags, Validator};

use super::*;
use crate::backend::shader::{Binding, COLOR, COMMON, FIELD, MOST_BINDINGS, STRIP};
use crate::params::FrameParams;
use crate::warp::grid::TRIANGLE_BYTES;
use crate::warp::linear::{HOLES, LEVELS};
use crate::warp::voxel::SURFACES;

fn src() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("src")
}

fn shaders() -> impl Iterator<Item = (&'static Kernel, &'static Shader)> {
    let listed = KERNELS.iter().filter_map(|kernel| Some((kernel, kernel.shader?)));
    listed.flat_map(|(kernel, shader)| {
        // The same shader, for each of the keys before.
        let is_previous = shader.file == PREVIOUS[0].file;
        let others = if is_previous { &PREVIOUS[1..] } else { &[] };
        std::iter::once(shader).chain(others).map(move |shader| (kernel, shader))
    })
}

fn parse(shader: &Shader) -> naga::Module {
    let text = shader.parts.concat();
    wgsl::parse_str(&text).unwrap_or_else(|error| {
        panic!("{}: {}", shader.file, error.emit_to_string(&text));
    })
}

fn is_valid(module: &naga::Module) -> Result<(), String> {
    let mut validator = Validator::new(ValidationFlags::all(), Capabilities::empty());
    validator.validate(module).map(drop).map_err(|error| format!("{error:?}"))
}

#[test]
fn every_kernel_is_where_the_table_says_and_no_name_comes_twice() {
    let mut names = BTreeSet::new();
    for kernel in KERNELS {
        let files = fs::read_dir(src().join(kernel.folder)).unwrap();
        let declares = |path: PathBuf| {
            let is_rust = path.extension().is_some_and(|extension| extension == "rs");
            let declared = format!("pub fn {}(", kernel.cpu);
            is_rust && fs::read_to_string(path).unwrap().contains(&declared)
        };
        let found = files.filter(|file| declares(file.as_ref().unwrap().path())).count();
        assert!(found > 0, "{kernel:?}");
        let header = fs::read_to_string(src().join(kernel.folder).join("mod.rs")).unwrap();
        assert!(header.contains("Exactness:"), "{kernel:?} declares no exactness");
        assert!(names.insert(kernel.cpu), "{kernel:?} comes twice");
    }
}

fn wgsl_files(folder: &Path, found: &mut BTreeSet<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            wgsl_files(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "wgsl") {
            found.insert(path);
        }
    }
}

#[test]
fn every_wgsl_file_is_part_of_a_shader_in_the_table() {
    let mut files = BTreeSet::new();
    wgsl_files(&src(), &mut files);
    let listed = KERNELS.iter().filter(|kernel| kernel.shader.is_some()).count();
    assert!(files.len() >= 3 + listed, "found only {files:?}");
    for file in files {
        let text = fs::read_to_string(&file).unwrap();
        assert!(
            shaders().any(|(_, shader)| shader.parts.contains(&text.as_str())),
            "{} is in no shader of the table",
            file.display()
        );
    }
    for (kernel, shader) in shaders() {
        let own = fs::read_to_string(src().join(kernel.folder).join(shader.file)).unwrap();
        assert_eq!(shader.parts.last(), Some(&own.as_str()), "{}", shader.file);
        assert_eq!(shader.parts.first(), Some(&COMMON), "{}", shader.file);
        for part in &shader.parts[1..shader.parts.len() - 1] {
            assert!(
                [&[COLOR, FIELD, HOLES, SURFACES], &LEVELS[..]].concat().contains(part),
                "{}",
                shader.file
            );
        }
    }
}

#[test]
fn every_shader_validates_and_one_with_a_mistake_does_not() {
    for (_, shader) in shaders() {
        is_valid(&parse(shader)).unwrap_or_else(|error| panic!("{}: {error}", shader.file));
    }
    let wrong = COMMON.to_owned() + "@compute @workgroup_size(0) fn wrong() {}";
    assert!(is_valid(&wgsl::parse_str(&wrong).unwrap()).is_err());
}

#[test]
fn every_entry_point_has_the_name_and_the_workgroup_of_the_table() {
    for (_, shader) in shaders() {
        let module = parse(shader);
        let found: Vec<_> = module
            .entry_points
            .iter()
            .map(|entry| (entry.name.clone(), entry.workgroup_size))
            .collect();
        let expected: Vec<_> = shader
            .entries
            .iter()
            .map(|entry| {
                let [x, y] = entry.workgroup;
                assert!(x * y <= 256, "{}: too many for SwiftShader", entry.name);
                (entry.name.to_owned(), [x, y, 1])
            })
            .collect();
        assert_eq!(found, expected, "{}", shader.file);
    }
}

#[test]
fn every_binding_is_what_the_table_says() {
    for (_, shader) in shaders() {
        assert!(shader.bindings.len() <= MOST_BINDINGS as usize, "{} binds too much", shader.file);
        let module = parse(shader);
        let bound: BTreeMap<u32, _> = module
            .global_variables
            .iter()
            .filter_map(|(_, global)| Some((global.binding?.binding, global.space)))
            .collect();
        assert_eq!(bound.len(), shader.bindings.len() + 1, "{}", shader.file);
        assert_eq!(bound[&0], naga::AddressSpace::Uniform, "{}", shader.file);
        for (number, binding) in (1..).zip(shader.bindings) {
            let naga::AddressSpace::Storage { access } = bound[&number] else {
                panic!("{}: binding {number} is no storage", shader.file);
            };
            let is_written = access.contains(naga::StorageAccess::STORE);
            assert_eq!(
                is_written,
                matches!(binding, Binding::Write(_)),
                "{}: {binding:?}",
                shader.file
            );
        }
    }
}

/// Members and bytes of a struct of a shader.
fn structure<'a>(module: &'a naga::Module, name: &str) -> (&'a [naga::StructMember], u64) {
    let found = module.types.iter().find_map(|(_, ty)| match &ty.inner {
        naga::TypeInner::Struct { members, span } if ty.name.as_deref() == Some(name) => {
            Some((members.as_slice(), u64::from(*span)))
        }
        _ => None,
    });
    found.unwrap_or_else(|| panic!("no struct {name}"))
}

#[test]
fn a_triangle_takes_the_bytes_that_its_buffer_counts_with() {
    assert_eq!(structure(&parse(&GRID), "Triangle").1, TRIANGLE_BYTES);
}

#[test]
fn the_parameters_lie_where_the_shaders_read_them() {
    let module = parse(&BLEND);
    let (members, span) = structure(&module, "FrameParams");
    macro_rules! offsets {
        ($($member:ident),*) => {
            [$((stringify!($member), offset_of!(FrameParams, $member) as u32)),*]
        };
    }
    let expected = offsets!(
        size,
        valid_start,
        valid_size,
        cells,
        cell_scale,
        phase,
        smooth_limit,
        one_cell,
        has_depth,
        mesh_cells,
        frames,
        is_key,
        levels,
        most_step,
        is_selective,
        compares_depth,
        older_start,
        older_size,
        older_cells,
        ahead,
        older_weight,
        held_fields,
        newest_field
    );
    let found: Vec<_> =
        members.iter().map(|member| (member.name.as_deref().unwrap(), member.offset)).collect();
    assert_eq!(found, expected);
    assert_eq!(span, size_of::<FrameParams>() as u64);
}

/// The number that a constant of a shader has.
fn constant(module: &naga::Module, name: &str) -> Option<i64> {
    let (_, constant) =
        module.constants.iter().find(|(_, constant)| constant.name.as_deref() == Some(name))?;
    match module.global_expressions[constant.init] {
        naga::Expression::Literal(naga::Literal::U32(value)) => Some(i64::from(value)),
        naga::Expression::Literal(naga::Literal::I32(value)) => Some(i64::from(value)),
        _ => None,
    }
}

#[test]
fn constants_of_the_shaders_are_those_of_the_cpu() {
    use crate::color::ColorFormat::{Rgb10a2, Rgba8, Rgba16f};
    use crate::fill::far_side::{NO_CELL, NO_ROW};
    use crate::finish::selection;
    use crate::light::{self, relight};
    use crate::params::format_code;
    use crate::warp::grid::{FARTHEST, LANES};
    use crate::warp::resolve::HOLE;
    use crate::warp::scatter::{MAX_CELLS, NO_SOURCE, SOURCE_BITS};
    let listed = [LINEAR.entries[1], PREVIOUS[0].entries[0], FAR_SIDE.entries[2], VOXEL.entries[1]];
    let group = listed[0].workgroup;
    assert!(listed.iter().all(|entry| entry.workgroup == group), "all of them go over lists");
    assert_eq!(selection::TILE, light::TILE, "two shaders call it by one name");
    let hole = u32::from(HOLE.x.cast_unsigned()) | u32::from(HOLE.y.cast_unsigned()) << 16;
    let expected = [
        ("HOLE", i64::from(hole)),
        ("LOWEST", i64::from(HOLE.x)),
        ("NO_SOURCE", i64::from(NO_SOURCE)),
        ("NO_CELL", i64::from(NO_CELL)),
        ("NO_ROW", i64::from(NO_ROW)),
        ("LIST_GROUP", i64::from(group[0])),
        ("STRIP", i64::from(STRIP)),
        ("DEPTH_SHIFT", i64::from(crate::warp::linear::DEPTH_SHIFT)),
        ("SAME_SURFACE_SHIFT", i64::from(crate::warp::voxel::SAME_SURFACE_SHIFT)),
        ("MOST_KEYS", crate::warp::linear::MOST_KEYS as i64),
        ("STEADY", i64::from(crate::warp::linear::STEADY)),
        ("REACH", i64::from(crate::warp::linear::REACH)),
        ("GROUPS_OF_A_ROW", 1024),
        ("NO_TRIANGLE", i64::from(u32::MAX)),
        ("LANES", i64::from(LANES)),
        ("FARTHEST", i64::from(FARTHEST)),
        ("SOURCE_BITS", i64::from(SOURCE_BITS)),
        ("MAX_CELLS", i64::from(MAX_CELLS)),
        ("LARGEST", i64::from(crate::trajectory::effective::LARGEST)),
        ("FULL_LIGHT", i64::from(foreframe_perception::compensation::FULL_LIGHT)),
        ("TILE", i64::from(selection::TILE)),
        ("WAYS", i64::from(relight::WAYS)),
        ("BLACK", i64::from(relight::BLACK)),
        ("BRIGHTEST", i64::from(relight::BRIGHTEST)),
        ("FULL", i64::from(selection::FULL)),
        ("RGBA8", i64::from(format_code(Rgba8))),
        ("RGB10A2", i64::from(format_code(Rgb10a2))),
        ("RGBA16F", i64::from(format_code(Rgba16f))),
    ];
    let mut compared = BTreeSet::new();
    for (_, shader) in shaders() {
        let module = parse(shader);
        for (_, found) in module.constants.iter() {
            let Some(name) = found.name.as_deref() else { continue };
            let (_, value) = expected
                .iter()
                .find(|(expected, _)| *expected == name)
                .unwrap_or_else(|| panic!("{name} of {} is compared with nothing", shader.file));
            assert_eq!(constant(&module, name), Some(*value), "{name} of {}", shader.file);
            compared.insert(name.to_owned());
        }
    }
    assert_eq!(compared.len(), expected.len(), "compared only {compared:?}");
}
